//! The cache: what is read is what was written, a run resumes with the same bits, and damage is told, not hidden.

mod common;

use charcloth::frame::{Frame, Sample, Sink};
use charcloth::sheet::SheetState;
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo, VERSION, clear};
use common::{Folder, sheet};
use std::fs;
use std::path::Path;
use std::time::Duration;

fn info() -> RunInfo {
    RunInfo { scene: "corner".into(), fps: 24.0, ..RunInfo::default() }
}

/// The state at a frame of a pretended run.
fn state_at(number: u32) -> SheetState {
    let mut state = sheet(7);
    state.burn.temperature.iter_mut().for_each(|t| *t += f64::from(number) / 3.0);
    state.motion.velocity.iter_mut().for_each(|v| *v *= 1.0 / f64::from(number + 1));
    state
}

fn history_at(number: u32) -> [Sample; 3] {
    [
        Sample { name: "time", unit: "s", value: f64::from(number) / 24.0 },
        Sample { name: "fuel", unit: "kg", value: 1e-6 / f64::from(number + 1) },
        Sample { name: "pieces", unit: "1", value: f64::from(number) },
    ]
}

fn write(writer: &mut CacheWriter, number: u32) {
    let state = state_at(number);
    let frame = Frame::of(&state, number, f64::from(number) / 24.0);
    assert!(writer.frame(&frame, &history_at(number), &state).unwrap().is_continue());
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().to_string()).collect();
    names.sort();
    names
}

/// A run of four frames, stopped well.
fn run(name: &str) -> Folder {
    let folder = Folder::new(name);
    let mut writer = CacheWriter::create(&folder.0, &info()).unwrap();
    (0..4).for_each(|number| write(&mut writer, number));
    writer.finish().unwrap();
    folder
}

#[test]
fn frames_come_back_at_single_precision() {
    let folder = run("frames");
    for place in [folder.0.clone(), folder.0.join("cache")] {
        let cache = CacheReader::open(&place).unwrap();
        assert_eq!(cache.frames().unwrap(), [0, 1, 2, 3]);
        assert_eq!((cache.meta().scene.as_str(), cache.meta().fps, cache.meta().version), ("corner", 24.0, VERSION));
        let (frame, state) = (cache.frame(2).unwrap(), state_at(2));
        assert_eq!((frame.number, frame.time), (2, 2.0 / 24.0));
        assert_eq!(frame.triangles.corners, state.triangles.corners);
        assert_eq!(frame.triangles.uv, state.triangles.uv);
        assert_eq!(frame.motion.alive, state.motion.alive);
        for i in 0..state.motion.len() {
            assert_eq!(frame.motion.position[i].as_vec3(), state.motion.position[i].as_vec3());
            assert_eq!(frame.burn.temperature[i], f64::from(state.burn.temperature[i] as f32));
        }
    }
    assert_eq!(
        names(&folder.0.join("cache")),
        ["cache.json", "checkpoint.npz", "frame_00000.npz", "frame_00001.npz", "frame_00002.npz", "frame_00003.npz"]
    );
}

#[test]
fn the_description_lists_every_array_of_a_frame() {
    let folder = run("meta");
    let cache = CacheReader::open(&folder.0).unwrap();
    let field = |name: &str| cache.meta().fields.iter().find(|f| f.name == name).unwrap();
    let velocity = field("velocity");
    assert_eq!((velocity.unit.as_str(), velocity.dtype.as_str()), ("m/s", "float32"));
    assert_eq!(velocity.shape, ["motion", "3"]);
    assert_eq!(field("triangle_uv").shape, ["triangles", "3", "2"]);
    assert_eq!(field("triangle_corners").dtype, "uint32");
    assert!(cache.meta().fields.iter().all(|f| !f.about.is_empty() && !f.unit.is_empty()));
}

#[test]
fn the_checkpoint_has_every_bit_of_the_last_frame() {
    let folder = run("checkpoint");
    let checkpoint = CacheReader::open(&folder.0).unwrap().checkpoint().unwrap().unwrap();
    assert_eq!((checkpoint.frame, checkpoint.time), (3, 3.0 / 24.0));
    assert_eq!(checkpoint.state, state_at(3));
    assert_eq!(checkpoint.state.hash(), state_at(3).hash());
}

#[test]
fn a_killed_run_goes_on_from_its_checkpoint_as_if_nothing_had_happened() {
    let folder = Folder::new("resume");
    let cache = folder.0.join("cache");
    // A run that is killed in frame 5: the checkpoint is of frame 2, frame 5 and a history row are half written.
    let mut writer = CacheWriter::create(&folder.0, &info()).unwrap().checkpoint_every(Duration::ZERO);
    (0..3).for_each(|number| write(&mut writer, number));
    writer = writer.checkpoint_every(Duration::from_secs(3600));
    (3..5).for_each(|number| write(&mut writer, number));
    drop(writer);
    fs::write(cache.join("frame_00005.npz.partial"), "half").unwrap();
    fs::write(cache.join("checkpoint.npz.partial"), "half").unwrap();
    let mut text = fs::read_to_string(folder.0.join("history.csv")).unwrap();
    text += "5,0.2083";
    fs::write(folder.0.join("history.csv"), text).unwrap();
    assert_eq!(CacheReader::open(&folder.0).unwrap().frames().unwrap(), [0, 1, 2, 3, 4]);

    let (mut writer, checkpoint) = CacheWriter::resume(&folder.0, &info()).unwrap();
    assert_eq!((checkpoint.frame, checkpoint.state.hash()), (2, state_at(2).hash()));
    assert_eq!(CacheReader::open(&folder.0).unwrap().frames().unwrap(), [0, 1, 2]);
    (3..8).for_each(|number| write(&mut writer, number));
    writer.finish().unwrap();

    let straight = Folder::new("straight");
    let mut writer = CacheWriter::create(&straight.0, &info()).unwrap();
    (0..8).for_each(|number| write(&mut writer, number));
    writer.finish().unwrap();
    assert_eq!(names(&cache), names(&straight.0.join("cache")));
    for name in names(&cache) {
        let pair = [&cache, &straight.0.join("cache")].map(|c| fs::read(c.join(&name)).unwrap());
        assert!(pair[0] == pair[1], "{name} differs");
    }
    let histories = [&folder, &straight].map(|f| fs::read_to_string(f.0.join("history.csv")).unwrap());
    assert_eq!(histories[0], histories[1]);
    assert!(histories[0].starts_with("frame,time [s],fuel [kg],pieces [1]\n0,0,1e-6,0\n1,0.0416"), "{}", histories[0]);
    assert_eq!(histories[0].lines().count(), 9);
}

#[test]
fn a_run_is_neither_overwritten_nor_resumed_by_mistake() {
    let folder = run("again");
    let message = CacheWriter::create(&folder.0, &info()).unwrap_err().to_string();
    assert!(message.contains("there is a run here already") && message.contains("resume"), "{message}");
    folder.file("notes.txt", "mine");
    clear(&folder.0).unwrap();
    assert_eq!(names(&folder.0), ["cache", "notes.txt"]);
    let mut writer = CacheWriter::create(&folder.0, &info()).unwrap();
    let message = CacheWriter::resume(&folder.0, &info()).unwrap_err().to_string();
    assert!(message.contains("before its first checkpoint"), "{message}");
    write(&mut writer, 0);
    let other = [Sample { name: "other", unit: "1", value: 0.0 }];
    let state = state_at(1);
    let message = writer.write(&Frame::of(&state, 1, 0.0), &other, &state).unwrap_err().to_string();
    assert!(message.contains("history.csv:1: its columns are not those of this run"), "{message}");
    let message = CacheReader::open(&folder.0.join("nowhere")).unwrap_err().to_string();
    assert!(message.contains("there is no cache here"), "{message}");
}

#[test]
fn a_damaged_checkpoint_is_refused_wherever_the_damage_is() {
    let folder = run("damage");
    let path = folder.0.join("cache/checkpoint.npz");
    let bytes = fs::read(&path).unwrap();
    let cache = CacheReader::open(&folder.0).unwrap();
    let good = state_at(3).hash();
    for place in (0..bytes.len()).step_by(97) {
        let mut changed = bytes.clone();
        changed[place] ^= 0x10;
        fs::write(&path, &changed).unwrap();
        match cache.checkpoint() {
            // A bit in the zip records that nothing depends on, such as a date.
            Ok(checkpoint) => assert_eq!(checkpoint.unwrap().state.hash(), good, "{place}"),
            Err(error) => assert!(error.to_string().contains("cannot go on from this checkpoint"), "{place}: {error}"),
        }
    }
    for length in (0..bytes.len()).step_by(bytes.len() / 60) {
        fs::write(&path, &bytes[..length]).unwrap();
        let message = cache.checkpoint().unwrap_err().to_string();
        assert!(message.contains("run the scene from the start"), "{length}: {message}");
        assert!(CacheWriter::resume(&folder.0, &info()).is_err(), "{length}");
    }
    assert_eq!(cache.frames().unwrap().len(), 4);
}

#[test]
fn a_damaged_frame_is_told_and_never_panics() {
    let folder = run("frame-damage");
    let path = folder.0.join("cache/frame_00001.npz");
    let bytes = fs::read(&path).unwrap();
    let cache = CacheReader::open(&folder.0).unwrap();
    for place in (0..bytes.len()).step_by(41) {
        let mut changed = bytes.clone();
        changed[place] ^= 0x10;
        fs::write(&path, &changed).unwrap();
        let _ = cache.frame(1);
        fs::write(&path, &bytes[..place]).unwrap();
        let message = cache.frame(1).unwrap_err().to_string();
        assert!(message.contains("frame_00001.npz"), "{message}");
    }
    let message = cache.frame(9).unwrap_err().to_string();
    assert!(message.contains("there is no frame 9") && message.contains("0 to 3"), "{message}");
}

/// Copies the arrays of a frame file but one, and adds one.
fn rewrite(path: &Path, without: &str, with: &str) {
    use std::io::{Cursor, Read, Write};
    let mut old = zip::ZipArchive::new(Cursor::new(fs::read(path).unwrap())).unwrap();
    let mut new = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for k in 0..old.len() {
        let mut file = old.by_index(k).unwrap();
        let name = file.name().unwrap().to_string();
        if name != format!("{without}.npy") {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).unwrap();
            for name in std::iter::once(name.clone()).chain((name == "time.npy").then(|| format!("{with}.npy"))) {
                new.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
                new.write_all(&bytes).unwrap();
            }
        }
    }
    fs::write(path, new.finish().unwrap().into_inner()).unwrap();
}

#[test]
fn arrays_may_be_added_by_others_but_not_be_missing() {
    let folder = run("columns");
    let cache = CacheReader::open(&folder.0).unwrap();
    let path = folder.0.join("cache/frame_00001.npz");
    rewrite(&path, "", "smoke");
    assert_eq!(cache.frame(1).unwrap().triangles.corners, state_at(1).triangles.corners);
    rewrite(&path, "temperature", "smoke2");
    let message = cache.frame(1).unwrap_err().to_string();
    assert!(message.contains("it has no array temperature"), "{message}");
    // A checkpoint with a column that would be lost is refused.
    rewrite(&folder.0.join("cache/checkpoint.npz"), "", "motion.spin");
    let message = cache.checkpoint().unwrap_err().to_string();
    assert!(message.contains("motion.spin"), "{message}");
}

#[test]
fn caches_of_another_kind_or_time_are_told_apart() {
    let folder = run("versions");
    let path = folder.0.join("cache/cache.json");
    let text = fs::read_to_string(&path).unwrap();
    let cases = [
        (text.replace("\"version\": 1", "\"version\": 2"), "format version 2, this program reads up to 1"),
        (text.replace("charcloth-cache", "other"), "not a cache of Charcloth"),
        (text.replace("\"version\": 1,", ""), "version is missing"),
        (text[..text.len() / 2].to_string(), "not a sound cache.json"),
        (String::new(), "not a sound cache.json"),
    ];
    for (text, words) in cases {
        fs::write(&path, text).unwrap();
        let message = CacheReader::open(&folder.0).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

/// What the compression levels cost: run with `--ignored --nocapture` and `--release`.
#[test]
#[ignore = "a measurement"]
fn measure_frames_and_checkpoints() {
    let folder = Folder::new("measure");
    let state = sheet(223); // 49,729 nodes, 98,568 triangles
    let frame = Frame::of(&state, 0, 0.0);
    let mut writer = CacheWriter::create(&folder.0, &info()).unwrap().checkpoint_every(Duration::from_secs(3600));
    let start = std::time::Instant::now();
    for number in 0..10 {
        writer.write(&Frame { number, ..frame.clone() }, &[], &state).unwrap();
    }
    println!("frame: {:?} each, {} bytes", start.elapsed() / 10, size(&folder.0.join("cache/frame_00000.npz")));
    let start = std::time::Instant::now();
    writer.finish().unwrap();
    println!("checkpoint: {:?}, {} bytes", start.elapsed(), size(&folder.0.join("cache/checkpoint.npz")));
    let cache = CacheReader::open(&folder.0).unwrap();
    let start = std::time::Instant::now();
    (0..10).for_each(|number| assert_eq!(cache.frame(number).unwrap().motion.len(), 49_729));
    println!("reading a frame: {:?}", start.elapsed() / 10);
}

fn size(path: &Path) -> u64 {
    fs::metadata(path).unwrap().len()
}
