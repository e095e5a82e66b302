//! Stills: PNG files that are there whole or not at all.

use crate::error::RenderError;
use crate::image::RgbImage;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a picture as a PNG file, under a temporary name first, so that a reader never sees half of it.
pub fn write_png(path: &Path, image: &RgbImage) -> Result<(), RenderError> {
    if image.width == 0 || image.height == 0 {
        return Err(RenderError::Size { width: image.width, height: image.height });
    }
    let temporary = temporary_name(path);
    let written = write(&temporary, image).and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|source| {
        // Best effort: the first error is the one to tell.
        let _ = std::fs::remove_file(&temporary);
        RenderError::file(path, source)
    })
}

fn write(path: &Path, image: &RgbImage) -> std::io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    let mut encoder = png::Encoder::new(&mut file, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(image.pixels.as_flattened())?;
    writer.finish()?;
    file.flush()
}

/// The name a file has until it is whole: in the same folder, so that it can be renamed.
pub(crate) fn temporary_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(".part");
    path.with_file_name(name)
}
