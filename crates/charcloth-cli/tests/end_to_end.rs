//! Whole runs: simulate, stop, go on, draw, export, check.

mod common;

use charcloth_io::exporters::{EXPORTERS, Writer};
use common::{FLAMES, Folder, SMALL, run};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn fine(folder: &Path, arguments: &[&str]) -> (String, String) {
    let (code, out, error) = run(folder, arguments);
    assert_eq!(code, 0, "{arguments:?}\n{out}\n{error}");
    (out, error)
}

fn read(path: impl AsRef<Path>) -> Vec<u8> {
    std::fs::read(path.as_ref()).unwrap_or_else(|error| panic!("{}: {error}", path.as_ref().display()))
}

fn summary(run: &Path) -> serde_json::Value {
    serde_json::from_slice(&read(run.join("summary.json"))).unwrap()
}

#[test]
fn a_run_leaves_everything_it_promises() {
    let folder = Folder::new("run");
    folder.write("small.toml", SMALL);
    let (out, _) = fine(&folder.0, &["run", "small.toml", "--set", "seed=5"]);
    let dir = folder.0.join("runs/small");
    assert!(out.contains("nodes, 8 frames") && out.contains("runs/small/preview.mp4"), "{out}");
    assert_eq!(&read(dir.join("preview.mp4"))[4..8], b"ftyp");
    for still in [0, 2, 4, 6, 8] {
        assert_eq!(&read(dir.join(format!("still_{still:05}.png")))[..4], b"\x89PNG");
    }
    let history = String::from_utf8(read(dir.join("history.csv"))).unwrap();
    assert_eq!(history.lines().count(), 1 + 9);
    let summary = summary(&dir);
    assert_eq!((&summary["frames"], &summary["seed"], &summary["scene"]), (&8.into(), &5.into(), &"small".into()));
    assert!(summary["fuel_burnt_kg"].as_f64().unwrap() > 0.0, "{summary}");
    // The scene as run holds its overrides and reads back.
    let scene = charcloth_io::scene_file::load(&dir.join("scene.toml"), &[]).unwrap().cases.remove(0).scene;
    assert_eq!(scene.seed, 5);
    let (_, error) = fine(&folder.0, &["run", "small.toml", "--quiet", "--no-movie", "--frames", "2"]);
    assert!(error.is_empty(), "{error}");
    let second = folder.0.join("runs/small-2");
    assert!(second.join("still_00002.png").exists() && !second.join("preview.mp4").exists());

    let (code, _, error) = run(&folder.0, &["run", "small.toml", "-o", "runs/small"]);
    assert!(code == 2 && error.contains("--resume runs/small") && error.contains("--force"), "{error}");
    fine(&folder.0, &["run", "small.toml", "-o", "runs/small", "--force", "--frames", "1"]);
    assert!(dir.join("still_00001.png").exists() && !dir.join("still_00008.png").exists());
    assert_eq!(charcloth_io::cache::CacheReader::open(&dir).unwrap().frames().unwrap(), [0, 1]);
}

#[test]
fn a_resumed_run_has_the_same_bits() {
    let folder = Folder::new("resume");
    folder.write("small.toml", SMALL);
    fine(&folder.0, &["run", "small.toml", "-o", "whole"]);
    fine(&folder.0, &["run", "small.toml", "-o", "parts", "--frames", "3"]);
    let (out, _) = fine(&folder.0, &["run", "--resume", "parts", "--frames", "8"]);
    assert!(out.contains("going on from frame 3"), "{out}");
    let (whole, parts) = (folder.0.join("whole"), folder.0.join("parts"));
    for frame in 0..=8 {
        let name = format!("cache/frame_{frame:05}.npz");
        assert!(read(whole.join(&name)) == read(parts.join(&name)), "{name} differs");
    }
    // Stills of frames before the stop are drawn again from the cache, in its precision; the last one is not.
    for name in ["history.csv", "scene.toml", "still_00008.png"] {
        assert!(read(whole.join(name)) == read(parts.join(name)), "{name} differs");
    }
    assert_eq!(&read(parts.join("preview.mp4"))[4..8], b"ftyp");
    let (code, _, error) = run(&folder.0, &["run", "--resume", "parts", "--frames", "5"]);
    assert!(code == 2 && error.contains("has reached frame 8"), "{error}");
}

#[test]
fn programs_read_how_far_it_is() {
    let folder = Folder::new("progress");
    folder.write("small.toml", SMALL);
    let events = |arguments: &[&str]| -> Vec<serde_json::Value> {
        let (out, error) = fine(&folder.0, &[arguments, &["--progress", "json"]].concat());
        assert_eq!(error, "", "all is told in events");
        out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let run = events(&["run", "small.toml", "-o", "run", "--no-movie", "--set", "time.substeps=1000"]);
    assert_eq!((&run[0]["event"], &run[0]["scene"], &run[0]["last"]), (&"start".into(), &"small".into(), &8.into()));
    let frames: Vec<_> = run.iter().filter(|event| event["event"] == "frame").collect();
    assert!(frames.iter().zip(0..).all(|(event, number)| event["frame"] == number && event["last"] == 8));
    assert!(frames.len() == 9 && frames[8]["left_s"] == 0.0 && frames[8]["burning_nodes"].is_number(), "{frames:?}");
    let end = &run[run.len() - 1];
    assert_eq!((&end["event"], &end["frame"], &end["stopped"]), (&"end".into(), &8.into(), &false.into()));

    let more = events(&["run", "--resume", "run", "--no-movie", "--frames", "9"]);
    assert_eq!((&more[0]["resumed_from"], &more[1]["frame"]), (&8.into(), &9.into()));

    let export = events(&["export", "run", "--format", "usd"]);
    assert!(export[..10].iter().zip(1..).all(|(event, done)| event["done"] == done && event["total"] == 10));
    assert_eq!(export[10]["files"][0], "run/usd/sheet.usdc");

    folder.write("warns.toml", SMALL.replace("60 mm", "60 m").replace("6 mm", "6 m").replace("15 mm", "15 m"));
    let warned = events(&["run", "warns.toml", "--no-movie", "--frames", "1", "--set", "time.substeps=1"]);
    assert!(warned.iter().all(|event| event["event"] != "warning" || event["text"].is_string()), "{warned:?}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_saves_and_says_how_to_go_on() {
    let folder = Folder::new("interrupt");
    folder.write("small.toml", SMALL);
    for signal in ["-INT", "-TERM"] {
        let dir = folder.0.join(format!("stopped{signal}"));
        let child = Command::new(env!("CARGO_BIN_EXE_charcloth"))
            .args(["run", "small.toml", "--frames", "100000", "-o"])
            .arg(&dir)
            .current_dir(&folder.0)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while !dir.join("cache/frame_00002.npz").exists() {
            assert!(start.elapsed() < Duration::from_secs(60), "no frame came");
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{error}");
        assert!(error.contains(&format!("charcloth run --resume {}", dir.display())), "{error}");
        let reached = summary(&dir)["frames"].as_u64().unwrap();
        let last = (reached + 2).to_string();
        fine(&folder.0, &["run", "--resume", &dir.display().to_string(), "--frames", &last, "-q"]);
        assert_eq!(summary(&dir)["frames"], reached + 2);
    }
}

#[test]
fn a_run_that_blows_up_keeps_its_frames() {
    let folder = Folder::new("blow-up");
    folder.write("small.toml", SMALL);
    let overrides =
        ["mechanics.structural=1e9", "time.substeps=1", "mechanics.deformation_limit=0", "initial.velocity=[0, 0, 5]"];
    let mut arguments = vec!["run", "small.toml", "--frames", "200"];
    overrides.iter().for_each(|text| arguments.extend(["--set", *text]));
    let (code, _, error) = run(&folder.0, &arguments);
    assert!(code == 2 && error.contains("has grown past all bounds"), "{error}");
    let dir = folder.0.join("runs/small");
    assert!(dir.join("cache/frame_00000.npz").exists());
    let warnings = summary(&dir)["warnings"].to_string();
    assert!(warnings.contains("has grown past all bounds"), "{warnings}");
}

#[test]
fn frames_are_drawn_and_exported() {
    let folder = Folder::new("pictures");
    folder.write("small.toml", SMALL);
    fine(&folder.0, &["run", "small.toml", "--no-movie", "--frames", "4", "-q"]);
    let dir = folder.0.join("runs/small");
    let (out, _) =
        fine(&folder.0, &["render", "runs/small", "--frame", "2", "--style", "wireframe", "--size", "80x60"]);
    assert_eq!(out.trim(), "runs/small/frame_00002.png");
    let png = read(dir.join("frame_00002.png"));
    assert_eq!((&png[16..20], &png[20..24]), (&80_u32.to_be_bytes()[..], &60_u32.to_be_bytes()[..]));
    fine(&folder.0, &["render", "runs/small", "--frames", "1..3", "--camera", "-30deg,10deg,1.5", "-o", "turn.mp4"]);
    assert_eq!(&read(folder.0.join("turn.mp4"))[4..8], b"ftyp");
    let (code, _, error) = run(&folder.0, &["render", "runs/small", "--frames", "7..9"]);
    assert!(code == 2 && error.contains("frames 0 to 4"), "{error}");
    let (code, _, error) = run(&folder.0, &["render", "runs/small", "-o", "film.avi"]);
    assert!(code == 2 && error.contains(".mp4"), "{error}");
    folder.write("flames.toml", FLAMES);
    fine(&folder.0, &["run", "flames.toml", "-o", "runs/flames", "--no-movie", "-q"]);
    for row in EXPORTERS {
        // Flames are of one model only.
        let source = if row.name == "vdb" { "runs/flames" } else { "runs/small" };
        let arguments = ["export", source, "--format", row.name, "--frames", "1..2", "--resolution", "64"];
        let (out, _) = fine(&folder.0, &arguments);
        let dir = folder.0.join(source);
        let written = std::fs::read_dir(dir.join(row.name)).unwrap().map(|entry| entry.unwrap().path());
        let written: Vec<_> = written.filter(|file| !file.ends_with("export.json")).collect();
        assert!(out.starts_with(&format!("{} files", written.len())), "{out}");
        assert!(written.iter().any(|file| file.extension().is_some_and(|ending| ending == row.item.extension)));
        if let Writer::EachFrame(_) = row.item.write {
            assert!(dir.join(row.name).join(format!("frame_00002.{}", row.item.extension)).exists());
        }
    }
}

/// A sheet that only warms and burns, with checks that hold, and what breaks them.
const CHECKED: &str = r#"
name = "checked"
falsify = { "sheet.spacing" = "10 mm" }
[sheet]
shape = "grid"
width = "60 mm"
height = "30 mm"
spacing = "6 mm"
[sheet.variation]
noise = 0
[mechanics]
moves = false
[[ignite]]
edge = "left"
[time]
frames = 1
[[case]]
name = "good"
[[case.expect]]
quantity = "nodes"
value = 66
tolerance = 0
source = "11 by 6 nodes"
[[case.expect]]
quantity = "mass_error"
at_most = 1e-9
source = "mass is conserved to rounding"
"#;

#[test]
fn checks_pass_fail_and_are_falsified() {
    let folder = Folder::new("check");
    folder.write("checked.toml", CHECKED);
    let last = |out: &str| out.lines().last().unwrap().to_owned();
    let (out, _) = fine(&folder.0, &["check", "checked.toml"]);
    assert_eq!(last(&out), "2 passed, 0 failed", "{out}");
    assert!(out.contains("11 by 6 nodes") && out.contains("quantity"), "{out}");
    let (out, _) = fine(&folder.0, &["check", ".", "--falsify"]);
    assert_eq!(last(&out), "1 passed, 0 failed", "{out}");
    let (code, out, error) = run(&folder.0, &["check", "checked.toml", "--set", "sheet.spacing=5mm"]);
    assert_eq!((code, last(&out).as_str()), (1, "1 passed, 1 failed"), "{out}{error}");
    assert!(out.contains("FAIL  nodes"), "{out}");
    folder.write("checked.toml", CHECKED.replace("\"10 mm\"", "\"6 mm\""));
    let (code, out, _) = run(&folder.0, &["check", "checked.toml", "--falsify"]);
    assert_eq!((code, last(&out).as_str()), (1, "0 passed, 1 failed"), "{out}");
    folder.write("checked.toml", CHECKED.replace("falsify = ", "# "));
    let (code, _, error) = run(&folder.0, &["check", "checked.toml", "--falsify"]);
    assert!(code == 2 && error.contains("falsify"), "{error}");
    let (code, out, error) = run(&folder.0, &["check", "checked.toml", "--set", "mechanics.integrator=warp"]);
    assert!(code == 2 && out.contains("--set mechanics.integrator=warp"), "{out}{error}");
    assert_eq!(last(&out), "0 passed, 1 failed", "{out}");
}

#[test]
fn a_mesh_beside_the_scene_is_found_from_anywhere() {
    let folder = Folder::new("mesh");
    std::fs::create_dir_all(folder.0.join("scenes")).unwrap();
    let quad = "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nv 50 50 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
    folder.write("scenes/quad.obj", quad);
    folder.write("scenes/a.toml", "[sheet]\nmesh = \"quad.obj\"\n[[pin]]\nedge = \"top\"\n[output]\nsize = [64, 48]\n");
    let (_, error) = fine(&folder.0, &["run", "scenes/a.toml", "--set", "sheet.unit=mm", "--frames", "1", "-o", "out"]);
    assert!(!error.contains("warning"), "{error}");
    let (_, error) = fine(&folder.0, &["run", "scenes/a.toml", "--frames", "0", "-o", "big"]);
    assert!(error.matches("warning").count() == 1 && error.contains("sheet.unit = \"cm\""), "{error}");
    // The folder of the run may be moved: the mesh is named by its full path there.
    std::fs::rename(folder.0.join("out"), folder.0.join("scenes/out")).unwrap();
    fine(&folder.0, &["run", "--resume", "scenes/out", "--frames", "2", "-q"]);
}

#[test]
fn a_new_scene_burns_and_is_timed() {
    let folder = Folder::new("bench");
    fine(&folder.0, &["new", "mine"]);
    let coarse = ["--set", "sheet.spacing=12mm", "--frames", "2"];
    fine(&folder.0, &[&["run", "mine/scene.toml", "-q", "--set", "output.size=[64, 48]"], &coarse[..]].concat());
    assert!(folder.0.join("runs/mine/preview.mp4").exists());
    let (out, _) = fine(&folder.0, &[&["bench", "mine/scene.toml"], &coarse[..]].concat());
    for word in ["nodes", "all frames", "node substeps a second", "s_per_frame="] {
        assert!(out.contains(word), "{word} in {out}");
    }
}
