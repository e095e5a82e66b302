//! Exports of a real run, read by the programs they are for. What each reader compares is said in `readers/`.

mod common;

use charcloth::frame::{Frame, Sample, Sink};
use charcloth::scene::{Axis, LengthUnit};
use charcloth::sheet::{Particles, SheetState};
use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo};
use charcloth_io::exporters::{EXPORTERS, ExportOptions, export};
use charcloth_io::importers::read_mesh;
use common::node;
use common::python::{python, read_with};
use common::{Folder, tearing_scene};
use glam::DVec3;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Frames of the run.
const LAST: u32 = 14;

/// A run that tears, simulated once for all tests.
fn run() -> &'static Folder {
    static RUN: OnceLock<Folder> = OnceLock::new();
    RUN.get_or_init(|| simulate("readers-run", 0))
}

/// The same with a burn mesh finer than the one that moves.
fn fine_run() -> &'static Folder {
    static RUN: OnceLock<Folder> = OnceLock::new();
    RUN.get_or_init(|| simulate("readers-fine", 1))
}

/// The same again, in which something comes off: particles that are made up, more in each frame, and pieces that weigh.
fn shedding_run() -> &'static Folder {
    static RUN: OnceLock<Folder> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = Folder::new("readers-shedding");
        let (mut scene, name) = (tearing_scene(), "torn".into());
        scene.up = Axis::Z;
        let writer = CacheWriter::create(&folder.0, &RunInfo { scene: name, fps: 24.0, up: scene.up }).unwrap();
        Simulation::build(&scene, &Inputs::default()).unwrap().run(LAST, &mut Shedding(writer)).unwrap();
        folder
    })
}

struct Shedding(CacheWriter);

impl Sink for Shedding {
    fn frame(
        &mut self,
        frame: &Frame,
        history: &[Sample],
        state: &SheetState,
    ) -> Result<ControlFlow<()>, charcloth::error::Error> {
        let mut frame = frame.clone();
        // None in the first frames; then enough for the file to compress what it may.
        let mut particles = Particles::zeros(7 * frame.number.saturating_sub(4) as usize);
        for p in 0..particles.len() {
            let noise = |k: usize| ((17 * p + k + 1) as f64 * 0.618_033_988_749_895).fract();
            particles.velocity[p] = DVec3::new(noise(0), noise(1) - 0.5, -noise(2));
            particles.position[p] = DVec3::new(0.1 * noise(3), 0.1, 1.0) + particles.velocity[p] * frame.time;
            (particles.mass[p], particles.area[p]) = (1e-7 * noise(4), 1e-5 * noise(5));
            (particles.temperature[p], particles.birth[p]) = (300.0 + 900.0 * noise(6), 0.1 * noise(7));
            (particles.parent[p], particles.lies[p]) = ((p % 3) as u32, (p % 2) as u8);
        }
        frame.particles = particles;
        for p in 0..frame.pieces.len() {
            (frame.pieces.mass[p], frame.pieces.area[p]) = (1e-5 / (p as f64 + 1.1), 1e-4 / (p as f64 + 1.3));
            frame.pieces.temperature[p] = 300.0 + 10.1 * p as f64 + frame.time;
        }
        self.0.frame(&frame, history, state)
    }
    fn finish(&mut self) -> Result<(), charcloth::error::Error> {
        self.0.finish()
    }
}

fn simulate(name: &str, burn_level: u32) -> Folder {
    let folder = Folder::new(name);
    let mut scene = tearing_scene();
    scene.up = Axis::Z;
    scene.sheet.burn_level = burn_level;
    let info = RunInfo { scene: "torn \"paper\"".into(), fps: 24.0, up: scene.up };
    let mut writer = CacheWriter::create(&folder.0, &info).unwrap();
    Simulation::build(&scene, &Inputs::default()).unwrap().run(LAST, &mut writer).unwrap();
    folder
}

/// Exports the run into a folder and lists the files, after having looked that nothing else is there, and that a second
/// time gives the same bytes.
fn exported(format: &str, folder: &Folder) -> Vec<PathBuf> {
    let options = ExportOptions { resolution: 128, ..ExportOptions::default() };
    let cache = CacheReader::open(&run().0).unwrap();
    let write = || export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap().files;
    let contents = |files: &[PathBuf]| files.iter().map(|file| std::fs::read(file).unwrap()).collect::<Vec<_>>();
    let files = write();
    let before = contents(&files);
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), files.len() + 1, "{format}: more than files and list");
    write();
    assert!(before == contents(&files), "{format}: another time, other bytes");
    files
}

#[test]
fn openusd_reads_every_frame() {
    for format in ["usd", "usdz"] {
        let folder = Folder::new(format);
        let files = exported(format, &folder);
        assert_eq!(files.len(), 1);
        read_with("usd.py", &[&run().0, &files[0]]);
    }
}

#[test]
fn openusd_and_alembic_read_a_fine_burn_mesh() {
    read_by_openusd_and_alembic(fine_run());
}

#[test]
fn openusd_and_alembic_read_what_comes_off() {
    read_by_openusd_and_alembic(shedding_run());
}

fn read_by_openusd_and_alembic(run: &Folder) {
    for (format, reader) in [("usd", "usd.py"), ("abc", "abc.py")] {
        let folder = Folder::new(&format!("{}-{format}", run.0.file_name().unwrap().display()));
        let cache = CacheReader::open(&run.0).unwrap();
        let options = ExportOptions::default();
        let exported = export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap();
        read_with(reader, &[&run.0, &exported.files[0]]);
    }
}

#[test]
fn what_openusd_writes_is_read() {
    let folder = Folder::new("usd-written");
    read_with("usd_written.py", &[&folder.0]);
    if python().is_none() {
        return;
    }
    // The same mesh as OBJ, in metres, y up.
    let expected = read_mesh(&folder.0.join("expected.obj"), LengthUnit::M).unwrap();
    for name in ["text.usda", "crate.usdc", "crate.usd", "text.usd", "package.usdz", "samples.usdc"] {
        let mesh = read_mesh(&folder.0.join(name), LengthUnit::M).unwrap();
        assert_eq!(mesh.triangles, expected.triangles, "{name}");
        assert_eq!(mesh.corner_uv, expected.corner_uv, "{name}");
        for (place, there) in mesh.positions.iter().zip(&expected.positions) {
            // Single precision in the files.
            assert!(place.distance(*there) < 1e-6, "{name}: {place}, {there}");
        }
        let painted: Vec<usize> = ["whole", "few", "many"].map(|name| mesh.painted[name].len()).to_vec();
        assert_eq!(painted, [mesh.positions.len(); 3], "{name}");
        for i in 0..mesh.positions.len() {
            let values = ["whole", "few", "many"].map(|name| mesh.painted[name][i]);
            assert_eq!(values, [i as f32, [0.5, 0.25, 1e-3][i % 3], 1.0 / (i as f32 + 3.0)], "{name}");
        }
    }
}

#[test]
fn what_alembic_writes_is_read() {
    let folder = Folder::new("abc-written");
    read_with("abc_written.py", &[&folder.0]);
    if python().is_none() {
        return;
    }
    let read = |name: String| read_mesh(&folder.0.join(name), LengthUnit::M);
    for name in ["corners", "alone", "mirrored"] {
        let [mesh, expected] = ["abc", "obj"].map(|ending| read(format!("{name}.{ending}")).unwrap());
        assert_eq!(mesh.triangles, expected.triangles, "{name}");
        assert_eq!(mesh.corner_uv, expected.corner_uv, "{name}");
        for (i, (place, there)) in mesh.positions.iter().zip(&expected.positions).enumerate() {
            // Nine digits in the OBJ.
            assert!(place.distance(*there) < 1e-8, "{name}: {place}, {there}");
            let painted = ["pin", "color.r", "color.g"].map(|attribute| mesh.painted[attribute][i]);
            assert_eq!(painted, [i as f32 / 64.0, i as f32 / 1024.0, 0.5], "{name}");
        }
        let is_animated = mesh.remarks.iter().any(|remark| remark.contains("first sample"));
        assert_eq!(is_animated, name == "corners", "{:?}", mesh.remarks);
    }
    let message = read("two.abc".to_string()).unwrap_err().to_string();
    assert!(message.contains("2 meshes") && message.contains("/world/paper/left, /world/paper/right"), "{message}");
}

#[test]
fn the_gltf_validator_finds_nothing_and_trimesh_reads_every_frame() {
    let folder = Folder::new("gltf");
    let files = exported("gltf", &folder);
    node::read_with("gltf.js", &files[0]);
    read_with("gltf.py", &[&run().0, &files[0]]);
}

#[test]
fn the_twin_is_where_the_cache_says() {
    for (format, files) in [("pc2", 2), ("mdd", 2), ("vat", 5), ("usd_twin", 1)] {
        let folder = Folder::new(format);
        assert_eq!(exported(format, &folder).len(), files, "{format}");
        read_with("twin.py", &[&run().0, Path::new(format), &folder.0]);
        if format == "vat" {
            node::read_with("gltf.js", &folder.0.join("sheet.glb"));
        }
    }
}

#[test]
fn what_needs_all_frames_is_not_written_without_them() {
    let options = ExportOptions { resolution: 64, ..ExportOptions::default() };
    let cache = CacheReader::open(&run().0).unwrap();
    for format in ["pc2", "mdd", "vat"] {
        let folder = Folder::new(format!("stopped-{format}").as_str());
        let message =
            export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Break(())).unwrap_err().to_string();
        assert!(message.contains("stopped"), "{message}");
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0, "{format}");
    }
    // The others keep what they have.
    for format in ["usd", "usdz", "usd_twin", "abc", "gltf", "maps"] {
        let folder = Folder::new(format!("stopped-{format}").as_str());
        let files = export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Break(())).unwrap().files;
        assert!(files.iter().all(|file| file.is_file()), "{format}");
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), files.len() + 1, "{format}");
    }
}

#[test]
fn maps_show_what_the_cache_has() {
    let folder = Folder::new("maps");
    assert_eq!(exported("maps", &folder).len(), 3 + 2 * (LAST as usize + 1));
    read_with("maps.py", &[&run().0, &folder.0]);
}

#[test]
fn alembic_reads_every_frame() {
    let folder = Folder::new("abc");
    let files = exported("abc", &folder);
    read_with("abc.py", &[&run().0, &files[0]]);
}

#[test]
fn a_damaged_frame_is_named_and_leaves_nothing_half_written() {
    let damaged = Folder::new("damaged");
    let cache = damaged.0.join("cache");
    std::fs::create_dir(&cache).unwrap();
    for entry in std::fs::read_dir(run().0.join("cache")).unwrap() {
        let file = entry.unwrap().path();
        std::fs::copy(&file, cache.join(file.file_name().unwrap())).unwrap();
    }
    let frame = cache.join("frame_00003.npz");
    let bytes = std::fs::read(&frame).unwrap();
    let export_all = |what: &str| {
        // The model of this run has no flames; `exporters.rs` does the same with one that has.
        for row in EXPORTERS.iter().filter(|row| row.name != "vdb") {
            let folder = Folder::new(&format!("damaged-{}", row.name));
            // What was there before stays as it was.
            let old = folder.0.join(format!("sheet.{}", row.item.extension));
            std::fs::write(&old, "old").unwrap();
            let reader = CacheReader::open(&damaged.0).unwrap();
            let options = ExportOptions { resolution: 16, force: true, ..ExportOptions::default() };
            let result = export(&reader, row.name, &options, &folder.0, &mut |_| ControlFlow::Continue(()));
            let gaps_are_fine = ["ply", "obj", "usd", "usdz", "gltf", "maps"].contains(&row.name);
            if what == "missing" && gaps_are_fine {
                result.unwrap();
                continue;
            }
            let message = result.unwrap_err().to_string();
            assert!(message.contains("frame_00003.npz") || message.contains("frame 3"), "{}: {message}", row.name);
            assert_eq!(std::fs::read_to_string(&old).unwrap(), "old", "{}", row.name);
            let left = std::fs::read_dir(&folder.0).unwrap().map(|entry| entry.unwrap().file_name());
            let left: Vec<String> = left.map(|name| name.to_string_lossy().into_owned()).collect();
            assert!(!left.iter().any(|name| name.ends_with(".partial")), "{}: {left:?}", row.name);
        }
    };
    std::fs::write(&frame, &bytes[..bytes.len() / 2]).unwrap();
    export_all("cut short");
    std::fs::remove_file(&frame).unwrap();
    export_all("missing");
}

#[test]
fn mean_velocities_are_those_from_frame_to_frame() {
    for run in [run(), shedding_run()] {
        let folder = Folder::new("mean");
        let cache = CacheReader::open(&run.0).unwrap();
        let options = ExportOptions { mean_velocities: true, ..ExportOptions::default() };
        let files = export(&cache, "usd", &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap().files;
        read_with("velocities.py", &[&run.0, &files[0]]);
    }
}
