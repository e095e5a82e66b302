//! Virtual environments of Python, kept in the target folder.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Python of an environment that has these packages. It is made unless it is there from an earlier run, and gets its
/// name when it is complete. The error says why there is none.
pub fn with_packages(packages: &[&str]) -> Result<PathBuf, String> {
    let versions: String = packages.join("-").chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("readers-{versions}"));
    let python = |folder: &Path| folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if python(&home).exists() {
        return Ok(python(&home));
    }
    let fresh = home.with_extension(std::process::id().to_string());
    let made = run(Command::new(base()).args(["-m", "venv"]).arg(&fresh)).and_then(|()| {
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:"];
        run(Command::new(python(&fresh)).args(install).args(packages))
    });
    // Another test may have been quicker; then its environment is as good.
    let named = made.and_then(|()| std::fs::rename(&fresh, &home).map_err(|error| error.to_string()));
    if named.is_err() {
        let _ = std::fs::remove_dir_all(&fresh);
    }
    if python(&home).exists() { Ok(python(&home)) } else { named.map(|()| python(&home)) }
}

/// The Python that environments are made with.
pub fn base() -> OsString {
    std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into())
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
    let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
    if output.status.success() { Ok(()) } else { Err(last) }
}
