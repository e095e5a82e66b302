//! Draws a made-up burning sheet, to look at the looks without a simulation:
//!
//! ```text
//! cargo run --release -p charcloth-render --example still -- shaded still.png [reached mm] [spacing mm] [zoom] [azimuth]
//! cargo run --release -p charcloth-render --example still -- split film.mp4
//! ```

#[path = "../tests/burning/mod.rs"]
mod burning;

use charcloth::scene::{Axis, Camera};
use charcloth_render::{MovieWriter, Renderer, write_png};
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

const SIZE: [u32; 2] = [960, 720];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let look = arguments.first().map_or("shaded", String::as_str);
    let path = PathBuf::from(arguments.get(1).map_or("still.png", String::as_str));
    let number = |i: usize, default: f64| arguments.get(i).map_or(Ok(default), |text| text.parse::<f64>());
    let (reached, spacing) = (number(2, 110.0)? / 1000.0, number(3, 2.7)? / 1000.0);
    let mut camera = Camera { zoom: number(4, 1.0)?, ..Camera::default() };
    camera.azimuth.0 = number(5, camera.azimuth.0)?;
    let frame = burning::sheet(spacing, reached);
    let bounds = burning::start_bounds(&frame);
    let mut renderer = Renderer::with_look(&camera, Axis::Y, bounds, SIZE, look)?;
    if path.extension().is_some_and(|end| end == "mp4") {
        let frames: Vec<_> = (0..100).map(|i| burning::sheet(spacing, 0.01 + 0.0015 * f64::from(i))).collect();
        let start = Instant::now();
        let images = frames.iter().map(|frame| renderer.render(frame)).collect::<Result<Vec<_>, _>>()?;
        let drawing = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let mut movie = MovieWriter::create(&path, SIZE[0], SIZE[1], 25.0)?;
        for image in &images {
            movie.frame(image)?;
        }
        movie.finish()?;
        let encoding = start.elapsed().as_secs_f64();
        let count = images.len() as f64;
        println!("{:.1} frames/s drawn, {:.1} frames/s encoded", count / drawing, count / encoding);
        return Ok(());
    }
    let mut image = renderer.render(&frame)?;
    let start = Instant::now();
    for _ in 0..10 {
        renderer.render_into(&frame, &mut image)?;
    }
    println!("{} triangles, {:.1} ms a frame", frame.triangles.len(), start.elapsed().as_secs_f64() * 100.0);
    write_png(&path, &image)?;
    Ok(())
}
