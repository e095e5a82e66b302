//! Pictures laid on the sheet by texture coordinates: PNG and JPEG, read as grey values.

use crate::error::IoError;
use crate::files::read_whole;
use charcloth::simulation::GreyImage;
use std::io::Cursor;
use std::path::Path;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The first bytes of a PNG, and of a JPEG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

/// Most bytes a picture may take once it is unpacked: a small file can claim any size.
const MOST_BYTES: usize = 1 << 29;

/// Samples as they are stored, row by row from the top.
struct Pixels {
    width: usize,
    height: usize,
    /// Samples of a pixel; of two and four, the last is its opacity.
    channels: usize,
    /// 0 to 1.
    samples: Vec<f32>,
}

/// What is wrong with a picture, and what to try.
type Problem = (String, &'static str);

/// Reads a PNG or JPEG as grey values, 0 black to 1 white, row by row from the top.
///
/// Values are taken as they are stored (no gamma is undone), colours by their luminance, 16-bit pictures in full, and
/// transparency is ignored. The format is told by the content, not by the name.
pub fn read_grey(path: &Path) -> Result<GreyImage, IoError> {
    let bytes = read_whole(path)?;
    let pixels = match bytes.as_slice() {
        [] => Err(("the file is empty".to_owned(), "export the picture again")),
        bytes if bytes.starts_with(PNG) => read_png(bytes),
        bytes if bytes.starts_with(JPEG) => read_jpeg(bytes),
        _ => Err(("not a PNG or JPEG".to_owned(), "save the picture as PNG")),
    };
    let Pixels { width, height, channels, samples } =
        pixels.map_err(|(problem, hint)| IoError::content(path, problem, hint))?;
    let grey = |pixel: &[f32]| match *pixel {
        // Rec. ITU-R BT.709-6, item 3.2: luminance weights of the three primaries.
        [r, g, b, ..] => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        [grey, ..] => grey,
        [] => 0.0,
    };
    Ok(GreyImage { width, height, values: samples.chunks_exact(channels).map(grey).collect() })
}

fn too_large() -> Problem {
    ("the picture is too large".to_owned(), "scale it down")
}

fn not_sound(error: impl std::fmt::Display) -> Problem {
    (format!("not a sound picture ({error})"), "save it again, as PNG")
}

fn read_png(bytes: &[u8]) -> Result<Pixels, Problem> {
    let problem = |error: png::DecodingError| match error {
        png::DecodingError::LimitsExceeded => too_large(),
        other => not_sound(other),
    };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: MOST_BYTES });
    decoder.set_transformations(png::Transformations::EXPAND); // palettes and samples of 1, 2 and 4 bits to 8 bits
    let mut reader = decoder.read_info().map_err(problem)?;
    let size = reader.output_buffer_size().filter(|size| *size <= MOST_BYTES).ok_or_else(too_large)?;
    let mut stored = vec![0; size];
    let info = reader.next_frame(&mut stored).map_err(problem)?;
    stored.truncate(info.buffer_size());
    // The last chunk is there, or the file is cut short.
    reader.finish().map_err(problem)?;
    let samples = match info.bit_depth {
        png::BitDepth::Sixteen => {
            stored.chunks_exact(2).map(|s| f32::from(u16::from_be_bytes([s[0], s[1]])) / 65535.0).collect()
        }
        _ => from_bytes(&stored),
    };
    let channels = info.color_type.samples();
    Ok(Pixels { width: info.width as usize, height: info.height as usize, channels, samples })
}

fn read_jpeg(bytes: &[u8]) -> Result<Pixels, Problem> {
    // Two bytes hold a side; whether the whole is too large is for us to say.
    let options = DecoderOptions::default().set_max_width(1 << 16).set_max_height(1 << 16);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(not_sound)?;
    let (wanted, channels) = match decoder.input_colorspace() {
        Some(ColorSpace::Luma) => (ColorSpace::Luma, 1),
        _ => (ColorSpace::RGB, 3),
    };
    let (width, height) = decoder.dimensions().ok_or_else(|| not_sound("it has no size"))?;
    if width * height * channels > MOST_BYTES {
        return Err(too_large());
    }
    decoder.set_options(options.jpeg_set_out_colorspace(wanted));
    let stored = decoder.decode().map_err(not_sound)?;
    if stored.len() != width * height * channels {
        return Err(not_sound("it has too few pixels"));
    }
    Ok(Pixels { width, height, channels, samples: from_bytes(&stored) })
}

fn from_bytes(bytes: &[u8]) -> Vec<f32> {
    bytes.iter().map(|byte| f32::from(*byte) / 255.0).collect()
}
