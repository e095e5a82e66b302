//! Pictures in memory.

use crate::error::RenderError;

/// Longest side of a picture [pixels]; the rasteriser's fixed-point numbers are laid out for it.
pub const LARGEST_SIDE: u32 = 8192;

/// A picture of 8-bit sRGB pixels, row by row from the top left.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RgbImage {
    /// Width [pixels].
    pub width: u32,
    /// Height [pixels].
    pub height: u32,
    /// Red, green and blue of each pixel.
    pub pixels: Vec<[u8; 3]>,
}

impl RgbImage {
    /// A black picture.
    pub fn black(width: u32, height: u32) -> Result<Self, RenderError> {
        if width == 0 || height == 0 || width > LARGEST_SIDE || height > LARGEST_SIDE {
            return Err(RenderError::Size { width, height });
        }
        Ok(Self { width, height, pixels: vec![[0; 3]; width as usize * height as usize] })
    }

    /// Copies another picture in, its top left corner at column `left` of the first row; what sticks out is cut off.
    pub fn paste(&mut self, other: &RgbImage, left: u32) {
        let columns = other.width.min(self.width.saturating_sub(left)) as usize;
        for row in 0..other.height.min(self.height) as usize {
            let to = row * self.width as usize + left as usize;
            let from = row * other.width as usize;
            self.pixels[to..to + columns].copy_from_slice(&other.pixels[from..from + columns]);
        }
    }
}
