//! Charcloth: frames to pixels on the processor, no window, no graphics card.
//!
//! In reading order: [`camera`] puts the eye where it sees the sheet; [`surface`] takes what is seen of a frame;
//! [`props`] are what it meets; [`raster`] finds what each pixel sees; [`looks`] give it colour, with [`charcloth::noise`] and
//! [`light`]; [`flames`] stand on it; [`post`] turns light into a picture; [`picture`] and [`movie`] write it. A [`Renderer`] holds
//! all of it:
//!
//! ```
//! use charcloth::frame::Frame;
//! use charcloth::scene::{Axis, Camera, Style};
//! use charcloth_render::Renderer;
//! use glam::DVec3;
//!
//! let bounds = (DVec3::ZERO, DVec3::new(0.210, 0.297, 0.0));
//! let mut renderer = Renderer::build(&Camera::default(), Axis::Y, bounds, [96, 72], Style::Shaded)?;
//! let empty = Frame::default();
//! assert!(renderer.render(&empty).unwrap_err().to_string().contains("nothing to draw"));
//! # Ok::<(), charcloth_render::RenderError>(())
//! ```

pub mod camera;
pub mod error;
pub mod flames;
mod glow;
pub mod image;
pub mod light;
pub mod looks;
pub mod movie;
pub mod picture;
pub mod post;
pub mod props;
pub mod raster;
mod specks;
pub mod surface;
mod video_signal;

pub use crate::camera::View;
pub use crate::error::RenderError;
pub use crate::image::RgbImage;
pub use crate::looks::LOOKS;
pub use crate::movie::MovieWriter;
pub use crate::picture::write_png;

use crate::looks::Look;
use charcloth::contact::scenery::Scenery;
use charcloth::frame::Frame;
use charcloth::registry::find;
use charcloth::scene::{Axis, Camera, Style};
use glam::DVec3;

/// Name of the look of a style.
pub fn look_of(style: Style) -> &'static str {
    match style {
        Style::Shaded => "shaded",
        Style::Wireframe => "wireframe",
        Style::Split => "split",
    }
}

/// Draws frames of one run: one camera, one look, one size.
pub struct Renderer {
    look: Box<dyn Look>,
    size: [u32; 2],
}

impl Renderer {
    /// A renderer for pictures of `size` [pixels]; `bounds` are the lowest and highest corner [m] of the sheet as it
    /// lies at the start, see [`charcloth::sheet::bounds`].
    pub fn build(
        settings: &Camera,
        up: Axis,
        bounds: (DVec3, DVec3),
        size: [u32; 2],
        style: Style,
    ) -> Result<Self, RenderError> {
        Self::with_look(settings, up, bounds, size, look_of(style))
    }

    /// The same, with a look by its name in [`LOOKS`].
    pub fn with_look(
        settings: &Camera,
        up: Axis,
        bounds: (DVec3, DVec3),
        size: [u32; 2],
        look: &str,
    ) -> Result<Self, RenderError> {
        Self::of(&View { settings: settings.clone(), up, bounds, size, scenery: Scenery::default() }, look)
    }

    /// A renderer for a view, obstacles and all, with a look by its name in [`LOOKS`].
    pub fn of(view: &View, look: &str) -> Result<Self, RenderError> {
        let entry = find(LOOKS, look, "output.style")?;
        Ok(Self { look: (entry.item)(view)?, size: view.size })
    }

    /// Draws a frame.
    pub fn render(&mut self, frame: &Frame) -> Result<RgbImage, RenderError> {
        let mut image = RgbImage::black(self.size[0], self.size[1])?;
        self.render_into(frame, &mut image)?;
        Ok(image)
    }

    /// Draws a frame into a picture that is there already; it gets the renderer's size.
    pub fn render_into(&mut self, frame: &Frame, image: &mut RgbImage) -> Result<(), RenderError> {
        if [image.width, image.height] != self.size {
            *image = RgbImage::black(self.size[0], self.size[1])?;
        }
        self.look.draw(frame, image)
    }
}
