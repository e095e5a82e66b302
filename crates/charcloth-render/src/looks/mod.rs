//! How a frame can be drawn: one file a look, one row each in the table.

pub mod shaded;
pub mod split;
pub mod wireframe;

use crate::camera::View;
use crate::error::RenderError;
use crate::image::RgbImage;
use charcloth::frame::Frame;
use charcloth::registry::Entry;

/// Draws frames; keeps its buffers from one to the next.
pub trait Look: Send {
    /// Draws a frame over the whole of a picture of the view's size.
    fn draw(&mut self, frame: &Frame, image: &mut RgbImage) -> Result<(), RenderError>;
}

/// Makes a look for a view.
pub type BuildLook = fn(&View) -> Result<Box<dyn Look>, RenderError>;

/// Every look.
pub const LOOKS: &[Entry<BuildLook>] = &[
    Entry { name: "shaded", about: "White sheet, brown scorch, black char, glow at the front", item: shaded::build },
    Entry { name: "wireframe", about: "The mesh, coloured by temperature", item: wireframe::build },
    Entry { name: "split", about: "Wireframe left, shaded right, of the same frame", item: split::build },
];
