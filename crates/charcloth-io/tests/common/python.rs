//! A Python with the readers that exports are checked with.

use super::environment;
use super::skipped::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// What is installed. OpenUSD reads .usdc, alembic3d .abc, trimesh .glb, OpenEXR and Pillow pictures, numpy the cache.
const PACKAGES: &[&str] =
    &["numpy==2.4.6", "usd-core==26.11", "trimesh==5.2.0", "OpenEXR==3.5.3", "pillow==13.0.0", "alembic3d==1.8.12.1"];

/// The Python to run the readers with; says why where there is none.
pub fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match PYTHON.get_or_init(|| environment::with_packages(PACKAGES)) {
        Ok(python) => Some(python),
        Err(why) => {
            skipped(format_args!("no Python with the readers ({why}); PYTHON may name a Python 3.11 or later"));
            None
        }
    }
}

/// Runs a reader of `tests/readers` with arguments; it must end well and say that all is sound.
pub fn read_with(reader: &str, arguments: &[&Path]) {
    let Some(python) = python() else { return };
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers").join(reader);
    let output = Command::new(python).arg(program).args(arguments).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.contains("SOUND"), "{reader}: {out}{error}");
}
