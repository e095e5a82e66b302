//! The folder of a run: where it is and what is in it.
//!
//! ```text
//! runs/a4/
//!   scene.toml       the scene as run, all overrides in it
//!   cache/           frames and the checkpoint (docs/cache.md)
//!   history.csv      one row a frame
//!   summary.json     what the run came to
//!   preview.mp4      the movie
//!   still_00048.png  stills
//! ```

use anyhow::{Context, bail};
use charcloth::fields::Data;
use charcloth::frame::Frame;
use charcloth::scene::Scene;
use charcloth_io::cache;
use charcloth_io::scene_file::write_scene;
use std::fs;
use std::path::{Path, PathBuf};

/// The scene as run.
pub const SCENE: &str = "scene.toml";
/// What the run came to.
pub const SUMMARY: &str = "summary.json";
/// The movie.
pub const MOVIE: &str = "preview.mp4";

/// File name of a still.
pub fn still_name(frame: u32) -> String {
    format!("still_{frame:05}.png")
}

/// The folder for a new run: the named one, or `runs/<name>`, numbered on where that is taken.
pub fn choose(named: Option<PathBuf>, name: &str, force: bool) -> anyhow::Result<PathBuf> {
    if let Some(folder) = named {
        if is_run(&folder) && !force {
            bail!(
                "{0} holds a run already; `charcloth run --resume {0}` goes on with it, --force replaces it, \
                 -o names another folder",
                folder.display()
            );
        }
        return Ok(folder);
    }
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '-' }).collect();
    let first = Path::new("runs").join(if plain.is_empty() { "scene" } else { &plain });
    if force || !first.exists() {
        return Ok(first);
    }
    (2..100_000)
        .map(|number| first.with_file_name(format!("{plain}-{number}")))
        .find(|folder| !folder.exists())
        .context("there are too many runs of this scene; clear some away or name a folder with -o")
}

/// Whether a folder holds a run.
pub fn is_run(folder: &Path) -> bool {
    folder.join(SCENE).exists() || cache::CacheReader::open(folder).is_ok()
}

/// Clears what an earlier run has left, and nothing else.
pub fn clear(folder: &Path) -> anyhow::Result<()> {
    cache::clear(folder)?;
    for entry in fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let number = name.strip_prefix("still_").and_then(|rest| rest.strip_suffix(".png"));
        let is_still = number.is_some_and(|number| number.len() >= 5 && number.bytes().all(|b| b.is_ascii_digit()));
        if is_still || [SCENE, SUMMARY, MOVIE].contains(&name.as_str()) {
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    Ok(())
}

/// Writes the scene as run.
pub fn save_scene(folder: &Path, scene: &Scene) -> anyhow::Result<()> {
    let text = write_scene(scene).map_err(anyhow::Error::msg)?;
    write_whole(&folder.join(SCENE), text.as_bytes())
}

/// Writes a file under another name and renames it, so that it is there whole or not at all.
pub fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path)).map_err(|error| {
        let _ = fs::remove_file(&partial); // the first error is the one to tell
        anyhow::Error::new(error).context(format!("cannot write {}", path.display()))
    })
}

/// Bytes of a frame in the cache before it is compressed: floating point numbers are stored in single precision.
pub fn frame_bytes(frame: &Frame) -> u64 {
    let columns = [frame.motion.columns(), frame.burn.columns(), frame.triangles.columns()];
    let bytes = columns.iter().flatten().map(|column| {
        let row = match column.data {
            Data::U8(_) => 1,
            Data::F64(_) | Data::U32(_) => 4,
            Data::U32x2(_) => 8,
            Data::F64x3(_) | Data::U32x3(_) => 12,
            Data::F32x3x2(_) => 24,
        };
        row * column.data.len() as u64
    });
    bytes.sum()
}

/// A number of bytes, for people.
pub fn human_bytes(bytes: u64) -> String {
    let units = ["kB", "MB", "GB", "TB"];
    let mut value = bytes as f64 / 1000.0;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    format!("{value:.*} {}", usize::from(value < 10.0), units[unit])
}

/// A number of seconds, for people.
pub fn human_time(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_written_for_people() {
        assert_eq!(human_bytes(512), "0.5 kB");
        assert_eq!(human_bytes(34_400_000), "34 MB");
        assert_eq!(human_time(3.25), "3.2 s");
        assert_eq!(human_time(300.0), "5 min");
    }

    #[test]
    fn clearing_takes_only_what_a_run_has_left() {
        let folder = std::env::temp_dir().join(format!("charcloth-run-folder-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mine = ["notes.txt", "still_life.png", "still_1.png"];
        for name in mine.iter().chain(&["still_00048.png", SCENE, SUMMARY, MOVIE]) {
            fs::write(folder.join(name), "x").unwrap();
        }
        assert!(choose(Some(folder.clone()), "a", false).unwrap_err().to_string().contains("--resume"));
        assert_eq!(choose(Some(folder.clone()), "a", true).unwrap(), folder);
        clear(&folder).unwrap();
        let left = fs::read_dir(&folder).unwrap().count();
        assert!(left == mine.len() && mine.iter().all(|name| folder.join(name).exists()));
        fs::remove_dir_all(&folder).unwrap();
    }
}
