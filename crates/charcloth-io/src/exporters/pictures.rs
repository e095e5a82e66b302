//! Pictures written row by row from the top, so that only a few rows are in memory.

use crate::error::IoError;
use crate::files::{Durability, Failure, write_streamed};
use exr::block::writer::SequentialBlocksCompressor;
use exr::block::{self, BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use std::io::{self, Write};
use std::path::Path;

/// Rows that are compressed together.
const ROWS_A_BLOCK: usize = 16;

/// Fills the next row of a picture with samples.
type FillRow<'a, T> = &'a mut dyn FnMut(usize, &mut [T]) -> Result<(), Failure>;

/// Writes single-precision samples as OpenEXR. Channels are in the order of their letters, and `fill` gets a row as one
/// channel after the other.
pub(super) fn write_exr(
    path: &Path,
    size: [usize; 2],
    channels: &[&str],
    fill: FillRow<'_, f32>,
) -> Result<(), IoError> {
    assert!(channels.is_sorted(), "channels stand in a file in the order of their names");
    let [width, height] = size;
    let names = channels.iter().map(|name| ChannelDescription::named(*name, SampleType::F32)).collect();
    let header = Header::new(Text::default(), (width, height), names).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    );
    write_streamed(path, Durability::Process, |out| {
        // The library knows errors of its own only, so one of the rows is kept aside.
        let mut failure = None;
        let written = block::write(out, [header].into_iter().collect(), false, |meta, chunks| {
            let mut blocks = SequentialBlocksCompressor::new(&meta, chunks);
            let mut row = vec![0.0; width * channels.len()];
            for (k, top) in (0..height).step_by(ROWS_A_BLOCK).enumerate() {
                let rows = ROWS_A_BLOCK.min(height - top);
                let mut data = Vec::with_capacity(4 * rows * row.len());
                for y in top..top + rows {
                    if let Err(error) = fill(y, &mut row) {
                        failure = Some(error);
                        return Err(exr::error::Error::Aborted);
                    }
                    row.iter().for_each(|sample| data.extend(sample.to_ne_bytes()));
                }
                let index = BlockIndex {
                    layer: 0,
                    pixel_position: Vec2(0, top),
                    pixel_size: Vec2(width, rows),
                    level: Vec2(0, 0),
                };
                blocks.compress_block(k, UncompressedBlock { index, data })?;
            }
            Ok(())
        });
        match (failure, written) {
            (Some(failure), _) => Err(failure),
            (None, Err(exr::error::Error::Io(error))) => Err(error.into()),
            (None, Err(error)) => Err(io::Error::other(error.to_string()).into()),
            (None, Ok(())) => Ok(()),
        }
    })
}

/// Writes samples as PNG, interleaved; those of sixteen bits with the high byte first.
pub(super) fn write_png(
    path: &Path,
    size: [usize; 2],
    color: png::ColorType,
    depth: png::BitDepth,
    fill: FillRow<'_, u8>,
) -> Result<(), IoError> {
    let [width, height] = size;
    let io_error = |error: png::EncodingError| match error {
        png::EncodingError::IoError(error) => error,
        error => io::Error::other(error.to_string()),
    };
    write_streamed(path, Durability::Process, |out| {
        let mut encoder = png::Encoder::new(out, width as u32, height as u32);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().map_err(io_error)?;
        let mut stream = writer.stream_writer().map_err(io_error)?;
        let bytes_a_sample = if depth == png::BitDepth::Sixteen { 2 } else { 1 };
        let mut row = vec![0; width * color.samples() * bytes_a_sample];
        for y in 0..height {
            fill(y, &mut row)?;
            stream.write_all(&row)?;
        }
        stream.finish().map_err(io_error)?;
        writer.finish().map_err(io_error)?;
        Ok(())
    })
}
