//! A Python with the readers that exports are checked with, in a virtual environment kept in the target folder.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// What is installed. OpenUSD reads .usdc, alembic3d .abc, trimesh .glb, OpenEXR and Pillow pictures, numpy the cache.
const PACKAGES: &[&str] =
    &["numpy==2.4.6", "usd-core==26.11", "trimesh==5.2.0", "OpenEXR==3.5.3", "pillow==13.0.0", "alembic3d==1.8.12.1"];

/// The Python to run the readers with; says why where there is none.
pub fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match PYTHON.get_or_init(environment) {
        Ok(python) => Some(python),
        Err(why) => {
            println!("SKIPPED: no Python with the readers ({why}); PYTHON may name a Python 3.11 or later");
            None
        }
    }
}

/// Makes the environment, unless it is there from an earlier run. It gets its name when it is complete.
fn environment() -> Result<PathBuf, String> {
    let versions: String = PACKAGES.join("-").chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("readers-{versions}"));
    let python = |folder: &Path| folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if python(&home).exists() {
        return Ok(python(&home));
    }
    let fresh = home.with_extension(std::process::id().to_string());
    let base = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let made = run(Command::new(base).args(["-m", "venv"]).arg(&fresh)).and_then(|()| {
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:"];
        run(Command::new(python(&fresh)).args(install).args(PACKAGES))
    });
    // Another test may have been quicker; then its environment is as good.
    let named = made.and_then(|()| std::fs::rename(&fresh, &home).map_err(|error| error.to_string()));
    if named.is_err() {
        let _ = std::fs::remove_dir_all(&fresh);
    }
    if python(&home).exists() { Ok(python(&home)) } else { named.map(|()| python(&home)) }
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
    if output.status.success() { Ok(()) } else { Err(last) }
}

/// Runs a reader of `tests/readers` with arguments; it must end well and say that all is sound.
pub fn read_with(reader: &str, arguments: &[&Path]) {
    let Some(python) = python() else { return };
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers").join(reader);
    let output = Command::new(python).arg(program).args(arguments).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.contains("SOUND"), "{reader}: {out}{error}");
}
