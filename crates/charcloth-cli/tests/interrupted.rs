//! A run that is killed at any moment and taken up again leaves what an uninterrupted one leaves; one that blows up
//! keeps what it had.
#![cfg(unix)]

use charcloth::random::Random;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("charcloth-interrupted-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn charcloth(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_charcloth"));
    command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    charcloth(folder, arguments).output().unwrap()
}

/// A sheet that burns and tears, in forty frames that take about a second.
const SCENE: &str = r#"
[sheet]
width = "60 mm"
height = "60 mm"
spacing = "3 mm"

[fire]
burn_time = "0.2 s"
diffusivity = "30 mm2/s"

[mechanics]
strength = "2 N/m"

[[pin]]
corner = "top_left"
radius = "6 mm"

[[ignite]]
corner = "bottom_right"
radius = "15 mm"

[time]
frames = 40
"#;

#[test]
fn a_run_killed_at_random_moments_ends_with_the_same_bytes() {
    let folder = Folder::new("kill");
    std::fs::write(folder.0.join("scene.toml"), SCENE).unwrap();
    let start = Instant::now();
    let whole = run(&folder.0, &["run", "scene.toml", "-o", "whole", "--no-movie", "--quiet"]);
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
    let wall = start.elapsed();

    let mut random = Random::new(u64::from(std::process::id()), 1);
    for kill in 0..3 {
        let arguments: &[&str] = match kill {
            0 => &["run", "scene.toml", "-o", "killed", "--no-movie", "--quiet"],
            _ => &["run", "--resume", "killed", "--no-movie", "--quiet"],
        };
        let mut child = charcloth(&folder.0, arguments).spawn().unwrap();
        // Not before there is anything to go on from, then at any moment of what is left.
        let patience = Instant::now();
        while !folder.0.join("killed/cache/checkpoint.npz").exists() && patience.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(wall.mul_f64(random.uniform() / 2.0));
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
    }
    let last = run(&folder.0, &["run", "--resume", "killed", "--no-movie", "--quiet"]);
    assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));

    let names = |run: &str| {
        let entries = std::fs::read_dir(folder.0.join(run).join("cache")).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names("killed"), names("whole"), "nothing half written is left");
    let files = names("whole").into_iter().map(|name| format!("cache/{name}"));
    for name in files.chain(["history.csv", "scene.toml"].map(str::to_owned)) {
        let [killed, whole] = ["killed", "whole"].map(|run| std::fs::read(folder.0.join(run).join(&name)).unwrap());
        assert!(killed == whole, "{name} differs from that of the uninterrupted run");
    }
}

#[test]
fn a_run_that_is_asked_to_stop_says_how_to_go_on() {
    let folder = Folder::new("stop");
    std::fs::write(folder.0.join("scene.toml"), SCENE.replace("frames = 40", "frames = 4000")).unwrap();
    let child = charcloth(&folder.0, &["run", "scene.toml", "-o", "run", "--no-movie"]).spawn().unwrap();
    let patience = Instant::now();
    while !folder.0.join("run/cache/frame_00002.npz").exists() && patience.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    let asked = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(asked.success());
    let output = child.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && error.contains("charcloth run --resume run"), "{error}");
    assert!(folder.0.join("run/cache/checkpoint.npz").exists() && folder.0.join("run/summary.json").exists());
}

#[test]
fn a_run_that_blows_up_ends_with_2_and_keeps_its_frames() {
    let folder = Folder::new("unstable");
    // Stiff, and nothing that gives way.
    let mechanics = "structural = \"1e4 N/m\"\ndeformation_limit = 0\n";
    let scene = SCENE.replace("strength = \"2 N/m\"\n", mechanics);
    std::fs::write(folder.0.join("scene.toml"), scene.replace("frames = 40", "frames = 40\nsubsteps = 1")).unwrap();
    let output = run(&folder.0, &["run", "scene.toml", "-o", "run", "--no-movie"]);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    for words in ["has grown past all bounds", "of node", "(frame ", "time.substeps", "run has frames 0 to"] {
        assert!(error.contains(words), "{words:?} is not in\n{error}");
    }
    assert!(!error.contains("panicked"), "{error}");
    let summary = std::fs::read_to_string(folder.0.join("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("the forced substep is unstable") && warnings.contains("past all bounds"), "{warnings}");
    let cache = charcloth_io::cache::CacheReader::open(&folder.0.join("run")).unwrap();
    let frames = cache.frames().unwrap();
    assert!(!frames.is_empty());
    for number in frames {
        let frame = cache.frame(number).unwrap();
        assert!(frame.motion.position.iter().all(|p| p.is_finite()), "frame {number}");
    }
}
