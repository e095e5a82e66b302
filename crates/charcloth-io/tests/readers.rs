//! Exports of a real run, read by the programs they are for. What each reader compares is said in `readers/`.

mod common;

use charcloth::scene::Axis;
use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo};
use charcloth_io::exporters::{ExportOptions, export};
use common::node;
use common::python::read_with;
use common::{Folder, tearing_scene};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Frames of the run.
const LAST: u32 = 14;

/// A run that tears, simulated once for all tests.
fn run() -> &'static Folder {
    static RUN: OnceLock<Folder> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = Folder::new("readers-run");
        let mut scene = tearing_scene();
        scene.up = Axis::Z;
        let info = RunInfo { scene: "torn \"paper\"".into(), fps: 24.0, up: scene.up };
        let mut writer = CacheWriter::create(&folder.0, &info).unwrap();
        Simulation::build(&scene, &Inputs::default()).unwrap().run(LAST, &mut writer).unwrap();
        folder
    })
}

/// Exports the run into a folder and lists the files, after having looked that nothing else is there, and that a second
/// time gives the same bytes.
fn exported(format: &str, folder: &Folder) -> Vec<PathBuf> {
    let options = ExportOptions { resolution: 128, ..ExportOptions::default() };
    let cache = CacheReader::open(&run().0).unwrap();
    let write = || export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Continue(())).unwrap();
    let contents = |files: &[PathBuf]| files.iter().map(|file| std::fs::read(file).unwrap()).collect::<Vec<_>>();
    let files = write();
    let before = contents(&files);
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), files.len(), "{format}: something else is there");
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
fn the_gltf_validator_finds_nothing_and_trimesh_reads_every_frame() {
    let folder = Folder::new("gltf");
    let files = exported("gltf", &folder);
    node::read_with("gltf.js", &files[0]);
    read_with("gltf.py", &[&run().0, &files[0]]);
}

#[test]
fn the_twin_is_where_the_cache_says() {
    for (format, files) in [("pc2", 2), ("mdd", 2), ("vat", 5)] {
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
    for format in ["usd", "usdz", "abc", "gltf", "maps"] {
        let folder = Folder::new(format!("stopped-{format}").as_str());
        let files = export(&cache, format, &options, &folder.0, &mut |_| ControlFlow::Break(())).unwrap();
        assert!(files.iter().all(|file| file.is_file()), "{format}");
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), files.len(), "{format}");
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
