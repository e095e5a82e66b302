//! The reader that docs/cache.md prints works as it stands, with numpy and nothing else.

#[path = "../../charcloth-io/tests/common/skipped.rs"]
mod skipped;

use skipped::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The first Python program of the page.
fn program() -> String {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cache.md")).unwrap();
    let (_, rest) = page.split_once("```python\n").expect("the page has a Python program");
    rest.split_once("```").expect("the program ends").0.to_owned()
}

/// A Python that has numpy.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("PYTHON").map(PathBuf::from);
    let candidates = named.into_iter().chain(["python3", "python"].map(PathBuf::from));
    let works = |python: &PathBuf| {
        Command::new(python).args(["-c", "import numpy"]).output().is_ok_and(|output| output.status.success())
    };
    candidates.into_iter().find(works)
}

#[test]
fn the_reader_of_the_page_reads_a_run() {
    let Some(python) = python() else {
        return skipped("there is no python3 with numpy here (PYTHON may name one)");
    };
    let folder = std::env::temp_dir().join(format!("charcloth-python-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_charcloth"))
        .args(["run", "a4", "--set", "sheet.spacing=15mm", "--frames", "12", "-o", "run", "--no-movie", "--quiet"])
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    // Every array as cache.json says: its type, its shape, its rows.
    let every_array = r#"
rows = {"motion": len(frame["position"]), "burn": len(frame["fuel"]), "triangles": len(frame["triangle_corners"])}
for field in about["fields"]:
    array = frame[field["name"]]
    shape = tuple(rows[n] if n in rows else int(n) for n in field["shape"])
    assert array.shape == shape and array.dtype == field["dtype"], (field, array.shape, array.dtype)
assert sorted(frame.files) == sorted([f["name"] for f in about["fields"]] + ["number", "time"])
state = np.load("run/cache/checkpoint.npz")
assert state["frame"] == 12 and state["motion.position"].dtype == np.float64
assert np.array_equal(state["motion.position"].astype(np.float32), points)
print("SOUND")
"#;
    let output = Command::new(python).args(["-c", &(program() + every_array)]).current_dir(&folder).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.contains("nodes,") && out.contains("SOUND"), "{out}{error}");
    let _ = std::fs::remove_dir_all(&folder);
}
