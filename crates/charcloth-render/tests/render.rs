//! Pictures: one snapshot a look, the same pixels on any number of threads, depth order, and errors in words.
//!
//! Snapshots are made anew with `CHARCLOTH_MINT=1`. Where one fails, the picture and its difference are written to the
//! test folder under `target`.

mod burning;

use charcloth::frame::Frame;
use charcloth::scene::{Axis, Camera};
use charcloth_render::{LOOKS, RenderError, Renderer, RgbImage, write_png};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Largest difference of a channel, and of the mean over all: processors may round the last bit of a square root or a
/// power differently, which moves a sample over an edge at most.
const TOLERANCE: u8 = 24;
const MEAN_TOLERANCE: f64 = 0.5;

fn renderer(frame: &Frame, size: [u32; 2], look: &str) -> Renderer {
    Renderer::with_look(&Camera::default(), Axis::Y, burning::start_bounds(frame), size, look).unwrap()
}

fn read_png(path: &Path) -> RgbImage {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes[..info.buffer_size()].chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    RgbImage { width: info.width, height: info.height, pixels }
}

#[test]
fn each_look_draws_its_snapshot() {
    let frame = burning::sheet(0.006, 0.13);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    let mut failed = Vec::new();
    for entry in LOOKS {
        let golden = folder.join(format!("{}.png", entry.name));
        let got = renderer(&frame, [64, 64], entry.name).render(&frame).unwrap();
        if std::env::var_os("CHARCLOTH_MINT").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            write_png(&golden, &got).unwrap();
            continue;
        }
        let wanted = read_png(&golden);
        assert_eq!((wanted.width, wanted.height), (got.width, got.height));
        let mut difference = got.clone();
        for (pixel, wanted) in difference.pixels.iter_mut().zip(&wanted.pixels) {
            *pixel = std::array::from_fn(|c| pixel[c].abs_diff(wanted[c]));
        }
        let channels = difference.pixels.as_flattened();
        let largest = channels.iter().copied().max().unwrap_or(0);
        let mean = channels.iter().map(|d| f64::from(*d)).sum::<f64>() / channels.len() as f64;
        if largest > TOLERANCE || mean > MEAN_TOLERANCE {
            let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
            difference.pixels.iter_mut().for_each(|p| *p = p.map(|d| d.saturating_mul(8)));
            let [picture, contrast] = ["", "_difference"].map(|end| out.join(format!("{}{end}.png", entry.name)));
            write_png(&picture, &got).unwrap();
            write_png(&contrast, &difference).unwrap();
            failed.push(format!(
                "{}: off by {largest} at most and {mean:.2} in the mean; see {} and {}",
                entry.name,
                picture.display(),
                contrast.display()
            ));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn one_and_two_threads_draw_the_same_pixels() {
    let frame = burning::sheet(0.005, 0.13);
    for entry in LOOKS {
        let pictures = [1, 2, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| renderer(&frame, [200, 150], entry.name).render(&frame).unwrap())
        });
        assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2], "{} depends on the threads", entry.name);
    }
}

#[test]
fn buffers_that_are_used_again_change_nothing() {
    let (early, late) = (burning::sheet(0.006, 0.05), burning::sheet(0.006, 0.16));
    for entry in LOOKS {
        let mut used = renderer(&late, [96, 72], entry.name);
        used.render(&early).unwrap();
        let fresh = renderer(&late, [96, 72], entry.name).render(&late).unwrap();
        assert!(used.render(&late).unwrap() == fresh, "{} remembers the frame before", entry.name);
    }
}

#[test]
fn every_file_of_looks_has_a_row_and_every_style_a_look() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/looks");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .filter(|name| name != "mod")
        .collect();
    let mut rows: Vec<String> = LOOKS.iter().map(|entry| entry.name.to_string()).collect();
    files.sort();
    rows.sort();
    assert_eq!(files, rows);
}

/// A white or a charred sheet, moved `nearer` [m] to the camera.
fn plain_sheet(nearer: f64, charred: bool) -> Frame {
    let mut frame = burning::sheet(0.02, -1.0);
    for k in 0..frame.motion.len() {
        frame.motion.position[k] = frame.motion.rest_position[k] + DVec3::Z * nearer;
        if charred {
            frame.burn.peak_temperature[k] = 900.0;
            frame.burn.fuel[k] *= 0.5;
        }
    }
    frame
}

fn both(first: &Frame, second: &Frame) -> Frame {
    let mut frame = first.clone();
    let offset = first.motion.len() as u32;
    frame.motion.position.extend(&second.motion.position);
    frame.motion.velocity.extend(&second.motion.velocity);
    frame.motion.inert_mass.extend(&second.motion.inert_mass);
    frame.motion.carried_mass.extend(&second.motion.carried_mass);
    frame.motion.burn_node.extend(second.motion.burn_node.iter().map(|i| i + offset));
    frame.motion.rest_position.extend(&second.motion.rest_position);
    frame.motion.source.extend(&second.motion.source);
    frame.motion.sheet.extend(&second.motion.sheet);
    frame.motion.pinned.extend(&second.motion.pinned);
    frame.motion.alive.extend(&second.motion.alive);
    let (burn, other) = (&mut frame.burn, &second.burn);
    burn.temperature.extend(&other.temperature);
    burn.fuel.extend(&other.fuel);
    burn.fuel_initial.extend(&other.fuel_initial);
    burn.burn_rate_full.extend(&other.burn_rate_full);
    burn.burn_rate.extend(&other.burn_rate);
    burn.heat_capacity.extend(&other.heat_capacity);
    burn.heat_released.extend(&other.heat_released);
    burn.peak_temperature.extend(&other.peak_temperature);
    burn.ignited_at.extend(&other.ignited_at);
    burn.area.extend(&other.area);
    burn.mass.extend(&other.mass);
    burn.charred.extend(&other.charred);
    burn.ashed.extend(&other.ashed);
    burn.stiffness.extend(&other.stiffness);
    burn.flame.extend(&other.flame);
    burn.thickness.extend(&other.thickness);
    burn.speed.extend(&other.speed);
    burn.noburn.extend(&other.noburn);
    burn.particle.extend(&other.particle);
    let (triangles, other) = (&mut frame.triangles, &second.triangles);
    triangles.corners.extend(other.corners.iter().map(|corners| corners.map(|i| i + offset)));
    triangles.uv.extend(&other.uv);
    triangles.source_face.extend(&other.source_face);
    triangles.sheet.extend(&other.sheet);
    triangles.rest_area.extend(&other.rest_area);
    triangles.alive.extend(&other.alive);
    triangles.piece.extend(&other.piece);
    triangles.parted.extend(&other.parted);
    frame
}

fn middle_of(frame: &Frame) -> u8 {
    let mut camera = Camera::default();
    (camera.azimuth.0, camera.elevation.0) = (0.0, 0.0);
    let bounds = burning::start_bounds(frame);
    let mut renderer = Renderer::with_look(&camera, Axis::Y, bounds, [64, 64], "shaded").unwrap();
    renderer.render(frame).unwrap().pixels[32 * 64 + 32][1]
}

#[test]
fn what_is_nearer_hides_what_is_farther() {
    let (white, black) = (plain_sheet(0.0, false), plain_sheet(0.02, true));
    let (bright, dark) = (middle_of(&white), middle_of(&black));
    assert!(bright > 150 && dark < 80, "white paper is {bright}, char {dark}");
    let near = |image: u8, wanted: u8| image.abs_diff(wanted) < 12;
    assert!(near(middle_of(&both(&white, &black)), dark), "the table order decides, not the depth");
    assert!(near(middle_of(&both(&black, &white)), dark), "the table order decides, not the depth");
    let behind = plain_sheet(-0.02, true);
    assert!(near(middle_of(&both(&behind, &white)), bright));
    assert!(near(middle_of(&both(&white, &behind)), bright));
}

#[test]
fn a_sheet_that_has_burnt_away_leaves_the_background() {
    let mut frame = burning::sheet(0.02, 0.0);
    frame.triangles.alive.fill(0);
    for entry in LOOKS {
        let picture = renderer(&frame, [64, 48], entry.name).render(&frame).unwrap();
        assert!(picture.pixels[24 * 64 + 16].iter().max() > Some(&8), "{} draws nothing", entry.name);
    }
}

#[test]
fn bad_input_is_an_error_that_says_what_is_wrong() {
    let frame = burning::sheet(0.02, 0.1);
    let bounds = burning::start_bounds(&frame);
    let camera = Camera::default();
    let build = |camera: &Camera, bounds, size, look: &str| Renderer::with_look(camera, Axis::Y, bounds, size, look);
    let said = |result: Result<Renderer, RenderError>| result.err().expect("must fail").to_string();
    for entry in LOOKS {
        for size in [[0, 64], [64, 0], [0, 0], [64, 1 << 20]] {
            assert!(said(build(&camera, bounds, size, entry.name)).contains("pixels cannot be drawn"));
        }
        assert!(build(&camera, bounds, [1, 1], entry.name).unwrap().render(&frame).is_ok());
        let mut renderer = renderer(&frame, [64, 48], entry.name);
        let mut fails = |frame: &Frame| renderer.render(frame).unwrap_err().to_string();
        assert!(fails(&Frame::default()).contains("has no nodes"));
        let mut broken = frame.clone();
        broken.motion.position[7].y = f64::NAN;
        assert!(fails(&broken).contains("position of node 7"));
        let mut broken = frame.clone();
        broken.burn.temperature[3] = f64::INFINITY;
        assert!(fails(&broken).contains("temperature of node 3"));
        let mut broken = frame.clone();
        broken.burn.fuel.pop();
        assert!(fails(&broken).contains("burn.fuel has"));
        let mut broken = frame.clone();
        broken.triangles.corners[0][1] = 1_000_000;
        assert!(fails(&broken).contains("1000000"));
        // A frame that failed leaves the renderer fit for the next.
        assert!(renderer.render(&frame).is_ok());
    }
    assert!(said(build(&camera, bounds, [64, 64], "shadde")).contains("shaded"));
    let nowhere = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    assert!(said(build(&camera, nowhere, [64, 64], "shaded")).contains("bounds"));
    for (zoom, angle) in [(0.0, 0.6), (f64::NAN, 0.6), (1.0, 0.0), (1.0, 4.0), (1.0, f64::NAN)] {
        let mut camera = Camera { zoom, ..Camera::default() };
        camera.field_of_view.0 = angle;
        assert!(said(build(&camera, bounds, [64, 64], "shaded")).contains("output.camera"));
    }
}

#[test]
fn far_flung_nodes_are_left_out_without_harm() {
    let mut frame = burning::sheet(0.02, 0.1);
    let bounds = burning::start_bounds(&frame);
    for (k, place) in [1e30, -1e30, 1e6, 0.9, 5.0].into_iter().enumerate() {
        frame.motion.position[k * 3] = DVec3::new(place, place, place);
    }
    for entry in LOOKS {
        let mut renderer = Renderer::with_look(&Camera::default(), Axis::Z, bounds, [64, 48], entry.name).unwrap();
        renderer.render(&frame).unwrap();
    }
}
