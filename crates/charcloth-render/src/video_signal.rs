//! From pictures to the signal in a film: BT.709 planes, and the note in the stream that says so.
//!
//! Without the note players guess the matrix from the picture size, and the colours shift. The encoder writes no such
//! note (VUI, ITU-T H.264 annex E), so it is put into the sequence header here: its flag is the header's last bit.

use crate::image::RgbImage;
use rayon::prelude::*;

/// Luma and colour differences at half the size, 8 bits, video range.
#[derive(Debug, Clone, Default)]
pub struct Planes {
    /// Luma.
    pub luma: Vec<u8>,
    /// Blue difference.
    pub blue: Vec<u8>,
    /// Red difference.
    pub red: Vec<u8>,
}

impl Planes {
    /// Takes the top left part of a picture, of even size.
    pub fn convert(&mut self, image: &RgbImage, size: [u32; 2]) {
        let [width, height] = size.map(|side| side as usize);
        let stride = image.width as usize;
        self.luma.resize(width * height, 0);
        self.blue.resize(width * height / 4, 0);
        self.red.resize(width * height / 4, 0);
        let luma = self.luma.par_chunks_mut(width * 2);
        let blue = self.blue.par_chunks_mut(width / 2);
        let red = self.red.par_chunks_mut(width / 2);
        luma.zip(blue).zip(red).enumerate().for_each(|(pair, ((luma, blue), red))| {
            let (upper, lower) = luma.split_at_mut(width);
            let first = &image.pixels[pair * 2 * stride..][..width];
            let second = &image.pixels[(pair * 2 + 1) * stride..][..width];
            for x in 0..width {
                upper[x] = luma_of(first[x].map(i32::from));
                lower[x] = luma_of(second[x].map(i32::from));
            }
            for x in 0..width / 2 {
                let sum: [i32; 3] = std::array::from_fn(|c| {
                    i32::from(first[2 * x][c])
                        + i32::from(first[2 * x + 1][c])
                        + i32::from(second[2 * x][c])
                        + i32::from(second[2 * x + 1][c])
                });
                // BT.709 [Itu2015], video range, times 65536; the sum of four pixels takes two bits more.
                blue[x] = ((-6596 * sum[0] - 22_189 * sum[1] + 28_785 * sum[2] + (128 << 18) + (1 << 17)) >> 18) as u8;
                red[x] = ((28_785 * sum[0] - 26_146 * sum[1] - 2639 * sum[2] + (128 << 18) + (1 << 17)) >> 18) as u8;
            }
        });
    }
}

/// ITU-R BT.709 luma in video range, 16 to 235.
fn luma_of([red, green, blue]: [i32; 3]) -> u8 {
    ((11_966 * red + 40_254 * green + 4064 * blue + (16 << 16) + (1 << 15)) >> 16) as u8
}

/// Puts the colour note into the sequence header of a coded picture, if it has one; says whether it is a keyframe.
pub fn tag_colours(coded: &[u8]) -> (Vec<u8>, bool) {
    let mut tagged = Vec::with_capacity(coded.len() + 16);
    let mut keyframe = false;
    for unit in units(coded) {
        tagged.extend_from_slice(&[0, 0, 0, 1]);
        match unit.first().map(|byte| byte & 0x1f) {
            Some(7) => tagged.extend_from_slice(&with_note(unit)),
            kind => {
                keyframe |= kind == Some(5);
                tagged.extend_from_slice(unit);
            }
        }
    }
    (tagged, keyframe)
}

/// The units of a stream, without the start codes (0 0 1 or 0 0 0 1) before them.
fn units(stream: &[u8]) -> Vec<&[u8]> {
    let mut starts = Vec::new();
    let mut i = 0;
    while i + 3 <= stream.len() {
        if stream[i..i + 3] == [0, 0, 1] {
            starts.push(i);
            i += 3;
        } else {
            i += 1;
        }
    }
    let ends = starts.iter().skip(1).copied().chain([stream.len()]);
    starts
        .iter()
        .zip(ends)
        .map(|(start, end)| {
            let unit = &stream[start + 3..end];
            // Zeros before the next start code belong to it.
            &unit[..unit.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1)]
        })
        .collect()
}

/// A sequence header with the colour note at its end; unchanged if it has a note already.
fn with_note(unit: &[u8]) -> Vec<u8> {
    // Take out the bytes that keep start codes from appearing.
    let mut plain = Vec::with_capacity(unit.len());
    for byte in unit {
        let escaped = *byte == 3 && plain.ends_with(&[0, 0]);
        if !escaped {
            plain.push(*byte);
        }
    }
    let mut bits: Vec<bool> = plain.iter().flat_map(|byte| (0..8).rev().map(move |i| byte >> i & 1 == 1)).collect();
    let Some(stop) = bits.iter().rposition(|bit| *bit) else { return unit.to_vec() };
    if stop == 0 || bits[stop - 1] {
        return unit.to_vec();
    }
    bits.truncate(stop - 1);
    let mut put = |value: u32, count: u32| bits.extend((0..count).rev().map(|i| value >> i & 1 == 1));
    put(1, 1); // there is a note
    put(0, 1); // no aspect ratio
    put(0, 1); // no overscan
    put(1, 1); // a video signal type:
    put(5, 3); // of no special format,
    put(0, 1); // in video range,
    put(1, 1); // with colours:
    put(1, 8); // primaries BT.709
    put(1, 8); // transfer BT.709, which players show as sRGB
    put(1, 8); // matrix BT.709
    put(0, 1); // no chroma location
    put(0, 1); // no timing
    put(0, 2); // no buffering parameters
    put(0, 1); // no picture structure
    put(0, 1); // no restrictions
    put(1, 1); // the end
    let mut tagged = Vec::with_capacity(bits.len() / 8 + 4);
    for chunk in bits.chunks(8) {
        let byte = chunk.iter().enumerate().fold(0u8, |byte, (i, bit)| byte | u8::from(*bit) << (7 - i));
        if byte <= 3 && tagged.ends_with(&[0, 0]) {
            tagged.push(3);
        }
        tagged.push(byte);
    }
    tagged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_and_white_are_the_ends_of_the_video_range() {
        let mut planes = Planes::default();
        for (pixel, luma) in [([0; 3], 16), ([255; 3], 235)] {
            planes.convert(&RgbImage { width: 2, height: 2, pixels: vec![pixel; 4] }, [2, 2]);
            assert_eq!((planes.luma[0], planes.blue[0], planes.red[0]), (luma, 128, 128));
        }
    }

    #[test]
    fn units_are_split_and_only_the_header_changes() {
        // A header that ends in "0 1 000000": no note, then the stop bit.
        let stream = [0, 0, 0, 1, 0x67, 0x42, 0x40, 0, 0, 1, 0x65, 9, 8];
        let (tagged, keyframe) = tag_colours(&stream);
        assert!(keyframe);
        assert!(tagged.starts_with(&[0, 0, 0, 1, 0x67, 0x42]));
        assert!(tagged.ends_with(&[0, 0, 0, 1, 0x65, 9, 8]));
        assert!(tagged.len() > stream.len() + 4);
    }
}
