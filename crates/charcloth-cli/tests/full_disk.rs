//! No room, no right to write, what is there already, and caches that are not sound: an error that says so, and nothing
//! half written under its final name.
#![cfg(unix)]

mod common;
#[path = "../../charcloth-io/tests/common/skipped.rs"]
mod skipped;

use charcloth_io::cache::CacheReader;
use charcloth_io::exporters::EXPORTERS;
use common::{FLAMES, Folder, SMALL, run};
use skipped::skipped;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output};

const NOBODY: u32 = 65534;

/// A sheet that runs in an instant and leaves no stills.
fn small() -> String {
    format!("{SMALL}stills = []\n")
}

/// A folder with a scene and a run of it.
fn with_run(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("small.toml", small());
    let (code, _, error) = run(&folder.0, &["run", "small.toml", "-o", "run", "--no-movie", "-q"]);
    assert_eq!(code, 0, "{error}");
    folder
}

/// The run that a format is exported from: flames are of one model only.
fn run_for(format: &str, folder: &Folder) -> &'static str {
    if format != "vdb" {
        return "run";
    }
    if !folder.0.join("flames").exists() {
        folder.write("flames.toml", FLAMES);
        let (code, _, error) = run(&folder.0, &["run", "flames.toml", "-o", "flames", "--no-movie", "-q"]);
        assert_eq!(code, 0, "{error}");
    }
    "flames"
}

/// The command under a shell that sets a limit first.
fn limited(folder: &Path, shell: &str, arguments: &[&str]) -> Output {
    let script = format!("{shell} exec \"$0\" \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_charcloth")]).args(arguments).current_dir(folder);
    command.output().unwrap()
}

/// An error of one paragraph that holds these words, and no panic.
fn fails(output: &Output, words: &[&str]) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    for word in words {
        assert!(error.contains(word), "{word:?} is not in\n{error}");
    }
    for word in ["panicked", "ZipWriter"] {
        assert!(!error.contains(word), "{error}");
    }
}

/// Files of a folder and the folders in it, those that are half written included.
fn files(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names = Vec::new();
    for entry in entries.map(Result::unwrap) {
        let name = entry.file_name().to_string_lossy().into_owned();
        match entry.path().is_dir() {
            true => names.extend(files(&entry.path()).into_iter().map(|inner| format!("{name}/{inner}"))),
            false => names.push(name),
        }
    }
    names.sort();
    names
}

#[test]
fn files_that_may_not_grow_are_not_left_half_written() {
    let folder = with_run("grow");
    // 2 kB a file: less than any export.
    let limit = "trap '' XFSZ; ulimit -f 4;";
    for row in EXPORTERS {
        let out = format!("out-{}", row.name);
        let source = run_for(row.name, &folder);
        let arguments = ["export", source, "--format", row.name, "--resolution", "64", "-o", &out];
        fails(&limited(&folder.0, limit, &arguments), &["cannot write", &out, "File too large"]);
        // Of a format with a file a frame, those before the one that did not fit are whole and stay.
        let left = files(&folder.0.join(&out));
        assert!(!left.iter().any(|name| name.ends_with(".partial") || name.starts_with("sheet")), "{left:?}");
    }
    let output = limited(&folder.0, limit, &["run", "small.toml", "-o", "more"]);
    fails(&output, &["cannot write", "more/"]);
    let left = files(&folder.0.join("more"));
    assert!(!left.iter().any(|name| name.ends_with(".partial") || name.ends_with(".npz")), "{left:?}");
}

#[test]
fn a_full_disk_ends_a_run_that_goes_on_when_there_is_room() {
    let folder = with_run("full");
    let disk = folder.0.join("disk");
    std::fs::create_dir(&disk).unwrap();
    // A disk of 200 kB, which only this command and its children see.
    let mounted = |then: &str| {
        let script = format!("mount -t tmpfs -o size=200k tmpfs disk || exit 77; {then}");
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", &script, env!("CARGO_BIN_EXE_charcloth")]);
        command.current_dir(&folder.0).output()
    };
    match mounted("true") {
        Ok(output) if output.status.success() => {}
        other => return skipped(format_args!("no disk can be mounted here ({other:?})")),
    }
    let output =
        mounted("\"$0\" run small.toml -o disk/run --frames 40 --no-movie; code=$?; cp -r disk/run kept; exit $code");
    fails(
        &output.unwrap(),
        &["cannot write disk/run/cache/frame_", "No space left on device", "make room", "has frames 0 to"],
    );
    let kept = folder.0.join("kept");
    assert!(!files(&kept).iter().any(|name| name.ends_with(".partial")), "{:?}", files(&kept));
    let cache = CacheReader::open(&kept).unwrap();
    let frames = cache.frames().unwrap();
    assert!(!frames.is_empty() && frames.len() < 41);
    frames.iter().for_each(|number| drop(cache.frame(*number).unwrap()));
    for arguments in [
        &["run", "--resume", "kept", "--no-movie", "-q"][..],
        &["run", "small.toml", "-o", "whole", "--frames", "40", "--no-movie", "-q"],
    ] {
        assert_eq!(run(&folder.0, arguments).0, 0, "{arguments:?}");
    }
    for name in files(&folder.0.join("whole/cache")) {
        let [kept, whole] =
            ["kept", "whole"].map(|run| std::fs::read(folder.0.join(run).join("cache").join(&name)).unwrap());
        assert!(kept == whole, "{name} differs");
    }

    for row in EXPORTERS {
        let then = format!(
            "head -c 190000 /dev/zero > disk/full; \"$0\" export {} --format {1} --resolution 128 -o disk/out; \
             code=$?; rm -rf out-{1}; cp -r disk/out out-{1}; exit $code",
            run_for(row.name, &folder),
            row.name
        );
        fails(&mounted(&then).unwrap(), &["cannot write disk/out/", "No space left on device", "make room"]);
        let left = files(&folder.0.join(format!("out-{}", row.name)));
        assert!(!left.iter().any(|name| name.ends_with(".partial")), "{}: {left:?}", row.name);
    }
}

#[test]
fn a_folder_that_may_not_be_written_is_named() {
    let folder = with_run("read-only");
    let locked = folder.0.join("locked");
    std::fs::create_dir(&locked).unwrap();
    std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(0o555)).unwrap();
    // Whoever may do anything is made somebody who may not.
    let program = folder.0.join("charcloth");
    std::fs::copy(env!("CARGO_BIN_EXE_charcloth"), &program).unwrap();
    let all_may = std::fs::metadata(&folder.0).unwrap();
    let start = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        command.args(arguments).current_dir(&folder.0);
        if all_may.uid() == 0 {
            command.uid(NOBODY);
        }
        command.output()
    };
    match start(&["--version"]) {
        Ok(output) if output.status.success() => {}
        other => return skipped(format_args!("the command cannot be run as another user ({other:?})")),
    }
    for out in ["locked", "locked/new"] {
        for row in EXPORTERS {
            let source = run_for(row.name, &folder);
            let output = start(&["export", source, "--format", row.name, "-o", out]).unwrap();
            fails(&output, &["locked", "Permission denied"]);
        }
        fails(&start(&["run", "small.toml", "-o", out]).unwrap(), &["locked", "Permission denied"]);
    }
    assert_eq!(files(&locked), [""; 0]);
    // A file where a folder should be.
    fails(&start(&["export", "run", "--format", "usd", "-o", "small.toml"]).unwrap(), &["small.toml"]);
    fails(&start(&["run", "small.toml", "-o", "small.toml/run"]).unwrap(), &["small.toml/run"]);
    assert_eq!(std::fs::read_to_string(folder.0.join("small.toml")).unwrap(), small());
}

#[test]
fn an_export_takes_the_place_of_the_one_before_and_of_nothing_else() {
    let folder = with_run("existing");
    std::fs::create_dir(folder.0.join("run/usd")).unwrap();
    folder.write("run/usd/notes.txt", "mine");
    for row in EXPORTERS {
        let source = run_for(row.name, &folder);
        let dir = folder.0.join(source).join(row.name);
        let export = |frames: &str| {
            let arguments = ["export", source, "--format", row.name, "--frames", frames, "--resolution", "64"];
            let (code, _, error) = run(&folder.0, &arguments);
            assert_eq!(code, 0, "{error}");
            files(&dir)
                .into_iter()
                .map(|name| (name.clone(), std::fs::read(dir.join(name)).unwrap()))
                .collect::<Vec<_>>()
        };
        let (first, other, again) = (export("0..4"), export("0..3"), export("0..4"));
        assert!(first.len() > 1 || first != other, "{}", row.name);
        assert!(first == again, "{}", row.name);
    }
    assert_eq!(std::fs::read_to_string(folder.0.join("run/usd/notes.txt")).unwrap(), "mine");
}

#[test]
fn a_cache_that_is_not_sound_is_refused_in_words() {
    let folder = with_run("bad-cache");
    let cache = folder.0.join("run/cache");
    let (about, frame, checkpoint) =
        (cache.join("cache.json"), cache.join("frame_00003.npz"), cache.join("checkpoint.npz"));
    let refused = |arguments: &[&str], words: &[&str]| {
        let (code, _, error) = run(&folder.0, arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        assert!(!error.contains("panicked"), "{error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: {word:?} is not in\n{error}");
        }
        assert_eq!(files(&folder.0.join("run/usd")), [""; 0], "{error}");
    };
    let export = ["export", "run", "--format", "usd"];
    let resume = ["run", "--resume", "run", "--frames", "9", "--no-movie"];
    let kept = [&about, &frame, &checkpoint].map(|file| std::fs::read(file).unwrap());
    let damage: &[(&Path, &[u8], &[&str], &str)] = &[
        (&about, b"", &export, "cache.json"),
        (&about, b"{\"format\": \"else\"}", &export, "cache.json"),
        (&about, b"{\"format\": \"charcloth-cache\", \"version\": 999}", &export, "cache.json"),
        (&frame, b"", &export, "frame_00003.npz"),
        (&frame, b"PK\x03\x04 and then nothing of the kind", &export, "frame_00003.npz"),
        (&frame, &kept[1][..kept[1].len() - 30], &export, "frame_00003.npz"),
        (&checkpoint, b"", &resume, "checkpoint.npz"),
        (&checkpoint, &kept[2][..kept[2].len() / 2], &resume, "checkpoint.npz"),
    ];
    for (file, bytes, arguments, word) in damage {
        let sound = std::fs::read(file).unwrap();
        std::fs::write(file, bytes).unwrap();
        refused(arguments, &[word]);
        std::fs::write(file, sound).unwrap();
    }
    // A bit that has flipped in what is read is found by its checksum.
    let mut flipped = kept[1].clone();
    flipped[1000] ^= 0x10; // among the positions, which come first
    std::fs::write(&frame, flipped).unwrap();
    refused(&export, &["frame_00003.npz"]);
    std::fs::write(&frame, &kept[1]).unwrap();
    std::fs::create_dir(folder.0.join("empty")).unwrap();
    refused(&["export", "empty", "--format", "usd"], &["empty"]);
    refused(&["export", "small.toml", "--format", "usd"], &["small.toml"]);
    let (code, _, error) = run(&folder.0, &export);
    assert_eq!(code, 0, "whole again: {error}");
}
