//! Wireframe left, shaded right: the same frame seen from the same side, each in its half, with a thin line between.

use super::{Look, shaded, wireframe};
use crate::camera::View;
use crate::error::RenderError;
use crate::image::RgbImage;
use charcloth::frame::Frame;

/// Colour of the line between the halves.
const DIVIDER: [u8; 3] = [120, 116, 112];

struct Split {
    left: Box<dyn Look>,
    right: Box<dyn Look>,
    left_image: RgbImage,
    right_image: RgbImage,
}

/// Makes the look.
pub fn build(view: &View) -> Result<Box<dyn Look>, RenderError> {
    let [width, height] = view.size;
    // Both halves are as wide, so that both cameras stand in the same place.
    let half = width.div_ceil(2);
    let view = View { size: [half, height], ..view.clone() };
    Ok(Box::new(Split {
        left: wireframe::build(&view)?,
        right: shaded::build(&view)?,
        left_image: RgbImage::black(half, height)?,
        right_image: RgbImage::black(half, height)?,
    }))
}

impl Look for Split {
    fn draw(&mut self, frame: &Frame, image: &mut RgbImage) -> Result<(), RenderError> {
        self.left.draw(frame, &mut self.left_image)?;
        self.right.draw(frame, &mut self.right_image)?;
        let half = image.width / 2;
        image.paste(&self.left_image, 0);
        image.paste(&self.right_image, half);
        let width = image.width as usize;
        if width > 2 {
            for row in image.pixels.chunks_exact_mut(width) {
                row[half as usize] = DIVIDER;
            }
        }
        Ok(())
    }
}
