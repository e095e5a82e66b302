//! What the tests of the command share: a folder each, and the command itself.
#![allow(dead_code)] // no test file uses all of it

use std::path::{Path, PathBuf};
use std::process::Command;

/// A sheet that runs in an instant; its last table is `[output]`.
pub const SMALL: &str = r#"
name = "small"
[sheet]
width = "60 mm"
height = "60 mm"
spacing = "6 mm"
[[pin]]
edge = "top"
[[ignite]]
corner = "bottom_left"
radius = "15 mm"
[time]
frames = 8
[output]
size = [64, 48]
"#;

/// A sheet of tissue that flames within two seconds, of the model that has flames.
pub const FLAMES: &str = r#"
name = "flames"
model = "physical"
[sheet]
material = "tissue"
width = "30 mm"
height = "30 mm"
spacing = "5 mm"
burn_level = 1
[[pin]]
corner = "top_left"
radius = "8 mm"
[[ignite]]
corner = "bottom_left"
radius = "12 mm"
length = "0.5 s"
[time]
frames = 4
fps = 4
[output]
stills = []
"#;

/// A folder of its own for a test, removed at its end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("charcloth-cli-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.0.join(name), text).unwrap();
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Exit code, standard output and standard error of the command.
pub fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_charcloth")).args(arguments).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}
