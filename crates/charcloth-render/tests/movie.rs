//! Movies: the file holds every picture, its header comes first, keyframes are regular, and nothing is left behind on
//! failure. The boxes are read by hand: ISO/IEC 14496-12.

mod burning;

use charcloth::scene::{Axis, Camera};
use charcloth_render::{MovieWriter, Renderer, RgbImage};
use std::path::PathBuf;

fn out(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn number(bytes: &[u8], at: usize) -> u32 {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// The contents of the box at the end of a path of boxes.
fn find<'a>(mut bytes: &'a [u8], path: &[&str]) -> Option<&'a [u8]> {
    let (first, rest) = path.split_first()?;
    while bytes.len() >= 8 {
        let size = number(bytes, 0) as usize;
        if &bytes[4..8] == first.as_bytes() {
            let inside = &bytes[8..size];
            return if rest.is_empty() { Some(inside) } else { find(inside, rest) };
        }
        bytes = &bytes[size.max(8)..];
    }
    None
}

fn table<'a>(film: &'a [u8], name: &str) -> &'a [u8] {
    find(film, &["moov", "trak", "mdia", "minf", "stbl", name]).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn a_movie_has_every_picture_and_a_keyframe_each_second() {
    let start = burning::sheet(0.008, 0.0);
    let size = [97, 65];
    let mut renderer =
        Renderer::with_look(&Camera::default(), Axis::Y, burning::start_bounds(&start), size, "shaded").unwrap();
    let path = out("burning.mp4");
    let mut movie = MovieWriter::create(&path, size[0], size[1], 10.0).unwrap();
    for i in 0..23 {
        movie.frame(&renderer.render(&burning::sheet(0.008, 0.01 * f64::from(i))).unwrap()).unwrap();
    }
    movie.finish().unwrap();
    assert!(!out("burning.mp4.part").exists());
    let film = std::fs::read(&path).unwrap();

    assert_eq!(number(table(&film, "stsz"), 8), 23, "samples");
    let keyframes = table(&film, "stss");
    assert_eq!((number(keyframes, 4), number(keyframes, 8), number(keyframes, 12)), (3, 1, 11), "keyframes");
    let header = find(&film, &["moov", "trak", "tkhd"]).unwrap();
    let sides = [number(header, header.len() - 8) >> 16, number(header, header.len() - 4) >> 16];
    assert_eq!(sides, [96, 64], "odd sides lose their last row and column");
    let media = find(&film, &["moov", "trak", "mdia", "mdhd"]).unwrap();
    let (ticks, duration) = (number(media, 12), number(media, 16));
    assert!((f64::from(duration) / f64::from(ticks) - 2.3).abs() < 0.02, "duration");
    let place = |name: &[u8]| film.windows(4).position(|bytes| bytes == name).unwrap();
    assert!(place(b"moov") < place(b"mdat"), "the header must come first, for players that stream");
}

#[test]
fn failures_are_told_and_leave_no_file() {
    let bad = |width, height, rate| MovieWriter::create(&out("bad.mp4"), width, height, rate).unwrap_err().to_string();
    assert!(bad(0, 64, 25.0).contains("cannot be made"));
    assert!(bad(64, 64, f64::NAN).contains("cannot be filmed"));
    assert!(MovieWriter::create(&out("no/such/folder/a.mp4"), 64, 64, 25.0).is_err());

    let mut movie = MovieWriter::create(&out("bad.mp4"), 64, 64, 25.0).unwrap();
    let error = movie.frame(&RgbImage::black(32, 64).unwrap()).unwrap_err().to_string();
    assert!(error.contains("does not fit"), "{error}");
    assert!(movie.finish().unwrap_err().to_string().contains("no pictures"));

    let mut movie = MovieWriter::create(&out("bad.mp4"), 64, 64, 25.0).unwrap();
    movie.frame(&RgbImage::black(64, 64).unwrap()).unwrap();
    drop(movie);
    assert!(!out("bad.mp4").exists() && !out("bad.mp4.part").exists(), "an unfinished movie must not stay");
}
