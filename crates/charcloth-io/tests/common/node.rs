//! Node.js with the readers that exports are checked with, kept in the target folder.

use super::skipped::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// What is installed: the glTF validator of Khronos.
const PACKAGES: &[&str] = &["gltf-validator@2.0.0-dev.3.10"];

/// The folder of the packages; says why where there is none.
fn packages() -> Option<&'static Path> {
    static PACKAGES: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match PACKAGES.get_or_init(install) {
        Ok(folder) => Some(folder),
        Err(why) => {
            skipped(format_args!("no Node.js with the readers ({why})"));
            None
        }
    }
}

fn install() -> Result<PathBuf, String> {
    let versions: String = PACKAGES.join("-").chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
    let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("node-{versions}"));
    let folder = home.join("node_modules");
    if folder.exists() {
        return Ok(folder);
    }
    let fresh = home.with_extension(std::process::id().to_string());
    std::fs::create_dir_all(&fresh).map_err(|error| error.to_string())?;
    let npm = if cfg!(windows) { "npm.cmd" } else { "npm" };
    let installed =
        Command::new(npm).args(["install", "--silent", "--no-audit", "--prefix"]).arg(&fresh).args(PACKAGES).output();
    let sound = installed.map_err(|error| format!("npm: {error}")).and_then(|output| {
        let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
        if output.status.success() { Ok(()) } else { Err(last) }
    });
    // Another test may have been quicker; then its folder is as good.
    let named = sound.and_then(|()| std::fs::rename(&fresh, &home).map_err(|error| error.to_string()));
    if named.is_err() {
        let _ = std::fs::remove_dir_all(&fresh);
    }
    if folder.exists() { Ok(folder) } else { named.map(|()| folder) }
}

/// Runs a reader of `tests/readers` on a file; it must end well and say that all is sound.
pub fn read_with(reader: &str, file: &Path) {
    let Some(packages) = packages() else { return };
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers").join(reader);
    let output = Command::new("node").arg(program).arg(packages).arg(file).output().unwrap();
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.contains("SOUND"), "{reader}: {out}{error}");
}
