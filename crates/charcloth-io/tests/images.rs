//! Pictures in: grey values of PNG and JPEG, and what is refused.

mod common;

use charcloth_io::images::read_grey;
use common::Folder;
use png::{BitDepth, ColorType};

/// A PNG of the given samples.
fn png(width: u32, height: u32, color: ColorType, depth: BitDepth, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == ColorType::Indexed {
        encoder.set_palette(vec![255, 0, 0, 0, 255, 0, 0, 0, 255]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(samples).unwrap();
    writer.finish().unwrap();
    bytes
}

/// A JPEG of 8 x 8 pixels of one colour, given as its channels: grey, or Y, Cb and Cr. All there is of a block is its
/// mean, so the whole picture is a few bits.
fn jpeg(channels: &[u8]) -> Vec<u8> {
    let count = channels.len() as u8;
    let mut bytes = vec![0xff, 0xd8];
    let mut segment = |marker: u8, content: &[u8]| {
        bytes.extend([0xff, marker, 0, content.len() as u8 + 2]);
        bytes.extend(content);
    };
    segment(0xdb, &[&[0][..], &[1; 64]].concat()); // quantisation: none
    let mut frame = vec![8, 0, 8, 0, 8, count];
    (1..=count).for_each(|id| frame.extend([id, 0x11, 0]));
    segment(0xc0, &frame);
    // Huffman codes: size k of a mean is k in four bits; "no more of this block" is the bit 0.
    segment(0xc4, &[&[0x00, 0, 0, 0, 12][..], &[0; 12], &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]].concat());
    segment(0xc4, &[&[0x10, 1][..], &[0; 15], &[0]].concat());
    let mut scan = vec![count];
    (1..=count).for_each(|id| scan.extend([id, 0]));
    scan.extend([0, 63, 0]);
    segment(0xda, &scan);
    let mut bits = String::new();
    for channel in channels {
        let mean = 8 * (i32::from(*channel) - 128);
        let size = (32 - mean.unsigned_abs().leading_zeros()) as usize;
        let value = if mean < 0 { mean + (1 << size) - 1 } else { mean };
        bits += &format!("{size:04b}");
        if size > 0 {
            bits += &format!("{value:0size$b}");
        }
        bits += "0";
    }
    for byte in bits.as_bytes().chunks(8) {
        let byte = (0..8).fold(0, |sum, k| 2 * sum + byte.get(k).map_or(1, |bit| bit - b'0'));
        bytes.push(byte);
        if byte == 0xff {
            bytes.push(0);
        }
    }
    bytes.extend([0xff, 0xd9]);
    bytes
}

#[test]
fn png_values_come_in_at_8_and_16_bits_from_the_top_row_on() {
    let folder = Folder::new("png");
    let eight = png(3, 2, ColorType::Grayscale, BitDepth::Eight, &[0, 51, 102, 153, 204, 255]);
    let grey = read_grey(&folder.file("a.png", eight)).unwrap();
    assert_eq!((grey.width, grey.height), (3, 2));
    for (k, value) in grey.values.iter().enumerate() {
        assert!((value - 0.2 * k as f32).abs() < 1e-6, "{k}: {value}");
    }
    let sixteen = png(2, 1, ColorType::Grayscale, BitDepth::Sixteen, &[0, 1, 255, 255]);
    let grey = read_grey(&folder.file("a.png", sixteen)).unwrap();
    assert!((grey.values[0] - 1.0 / 65535.0).abs() < 1e-9 && grey.values[1] == 1.0);
}

#[test]
fn every_kind_of_png_is_read() {
    let folder = Folder::new("png-kinds");
    let primaries = [0.2126, 0.7152, 0.0722];
    let rgb = [255, 0, 0, 0, 255, 0, 0, 0, 255];
    let rgba = [255, 0, 0, 9, 0, 255, 0, 0, 0, 0, 255, 255];
    let kinds = [
        (png(3, 1, ColorType::Rgb, BitDepth::Eight, &rgb), primaries),
        (png(3, 1, ColorType::Rgba, BitDepth::Eight, &rgba), primaries),
        (png(3, 1, ColorType::Indexed, BitDepth::Two, &[0b0001_1000]), primaries),
        (png(3, 1, ColorType::Grayscale, BitDepth::One, &[0b1010_0000]), [1.0, 0.0, 1.0]),
        (png(3, 1, ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 0, 0, 255, 51, 7]), [1.0, 0.0, 0.2]),
    ];
    for (number, (bytes, expected)) in kinds.into_iter().enumerate() {
        let grey = read_grey(&folder.file("a.png", bytes)).unwrap();
        for (value, expected) in grey.values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-6, "{number}: {:?}", grey.values);
        }
    }
}

#[test]
fn colours_come_in_by_luminance_and_the_name_does_not_matter() {
    let folder = Folder::new("jpeg");
    // Green, by ITU-T T.871: Y = 150, Cb = 44, Cr = 21.
    let grey = read_grey(&folder.file("a.png", jpeg(&[150, 44, 21]))).unwrap();
    assert_eq!((grey.width, grey.height, grey.values.len()), (8, 8, 64));
    assert!(grey.values.iter().all(|v| (v - 0.7152).abs() < 0.02), "{:?}", grey.values[0]);
    let grey = read_grey(&folder.file("a.jpg", jpeg(&[51]))).unwrap();
    assert!(grey.values.len() == 64 && grey.values.iter().all(|v| (v - 0.2).abs() < 1e-6), "{:?}", grey.values[0]);
}

#[test]
fn bad_pictures_are_refused_in_the_right_words() {
    let folder = Folder::new("bad-picture");
    let message = |bytes: &[u8]| read_grey(&folder.file("a.png", bytes)).unwrap_err().to_string();
    assert!(message(b"").contains("a.png: the file is empty"));
    assert!(message(b"hello, this is text").contains("not a PNG or JPEG"));
    let bytes = png(40, 40, ColorType::Grayscale, BitDepth::Eight, &[7; 1600]);
    for length in 8..bytes.len() - 12 {
        let message = message(&bytes[..length]);
        assert!(message.contains("not a sound picture"), "{length}: {message}");
    }
    let bytes = jpeg(&[150, 44, 21]);
    for length in 3..bytes.len() - 20 {
        let message = message(&bytes[..length]);
        assert!(message.contains("not a sound picture"), "{length}: {message}");
    }
    assert!(read_grey(&folder.0.join("gone.png")).unwrap_err().to_string().starts_with("cannot read"));
}

#[test]
fn a_small_file_that_claims_to_be_huge_is_refused_before_it_takes_the_memory() {
    let folder = Folder::new("huge-picture");
    let mut claimed = png(1, 1, ColorType::Rgba, BitDepth::Sixteen, &[0; 8]);
    claimed[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let checksum = flate2_crc(&claimed[12..29]);
    claimed[29..33].copy_from_slice(&checksum.to_be_bytes());
    let message = read_grey(&folder.file("a.png", claimed)).unwrap_err().to_string();
    assert!(message.contains("the picture is too large; scale it down"), "{message}");
    let mut claimed = jpeg(&[51]);
    let size = claimed.windows(2).position(|w| w == [0xff, 0xc0]).unwrap() + 5;
    claimed[size..size + 4].copy_from_slice(&[0xff; 4]);
    let message = read_grey(&folder.file("a.jpg", claimed)).unwrap_err().to_string();
    assert!(message.contains("the picture is too large; scale it down"), "{message}");
}

fn flate2_crc(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}
