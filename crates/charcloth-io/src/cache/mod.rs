//! The cache of a run: frames to look at, a checkpoint to go on from, the time history. The format is described in
//! `docs/cache.md`.
//!
//! ```text
//! run/
//!   history.csv            one row a frame
//!   cache/
//!     cache.json           what the arrays are
//!     frame_00000.npz ...  what can be seen, single precision
//!     checkpoint.npz       everything, full precision
//! ```
//!
//! Everything appears whole or not at all, so a cache can be read while the run goes on, and a run that was killed can
//! be taken up from its last checkpoint with the same bits.

mod checkpoint;
mod history;
mod meta;
mod npy;
mod npz;
mod reader;
mod writer;

pub use checkpoint::Checkpoint;
pub use meta::{CacheMeta, FieldMeta};
pub use reader::CacheReader;
pub use writer::{CacheWriter, RunInfo, clear};

use charcloth::fields::{Column, DataMut};
use charcloth::frame::Frame;

/// Name of the format, as `cache.json` gives it.
pub const FORMAT: &str = "charcloth-cache";
/// Version of the format that this version of the program writes; it reads this and older ones.
pub const VERSION: u32 = 1;

/// Folder of the frames inside the folder of a run.
const FOLDER: &str = "cache";
/// File that says what the arrays are.
const META: &str = "cache.json";
/// File to go on from.
const CHECKPOINT: &str = "checkpoint.npz";
/// Time history, in the folder of the run.
const HISTORY: &str = "history.csv";

/// File name of a frame.
fn frame_name(number: u32) -> String {
    format!("frame_{number:05}.npz")
}

/// Frame number of a file name, if it is the name of a finished frame.
fn frame_number(name: &str) -> Option<u32> {
    let digits = name.strip_prefix("frame_")?.strip_suffix(".npz")?;
    if digits.len() < 5 || !digits.bytes().all(|b| b.is_ascii_digit()) { None } else { digits.parse().ok() }
}

/// Name of the array that holds a column of a table: node columns keep their own, the others are marked.
fn array_name(table: &str, column: &str) -> String {
    match table {
        "triangles" => format!("triangle_{column}"),
        "pieces" => format!("piece_{column}"),
        "particles" => format!("particle_{column}"),
        _ => column.to_string(),
    }
}

/// Whether a frame may be without this array: older ones are.
fn may_be_missing(array: &str) -> bool {
    array.starts_with("piece_") || array.starts_with("particle") || array == "triangle_parted"
}

/// Every column of a frame: table, array name, column.
fn frame_columns(frame: &Frame) -> Vec<(&'static str, String, Column<'_>)> {
    let tables = [
        ("motion", frame.motion.columns()),
        ("burn", frame.burn.columns()),
        ("origins", frame.origins.columns()),
        ("triangles", frame.triangles.columns()),
        ("pieces", frame.pieces.columns()),
        ("particles", frame.particles.columns()),
    ];
    let mut all = Vec::new();
    for (table, columns) in tables {
        all.extend(columns.into_iter().map(|column| (table, array_name(table, column.name), column)));
    }
    all
}

/// Every column of a frame that caches of all versions have, to be filled: array name, data.
fn frame_columns_mut(frame: &mut Frame) -> Vec<(String, DataMut<'_>)> {
    let tables = [
        ("motion", frame.motion.columns_mut()),
        ("burn", frame.burn.columns_mut()),
        ("triangles", frame.triangles.columns_mut()),
        ("pieces", frame.pieces.columns_mut()),
        ("particles", frame.particles.columns_mut()),
    ];
    let mut all = Vec::new();
    for (table, columns) in tables {
        all.extend(columns.into_iter().map(|(name, data)| (array_name(table, name), data)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_columns_share_an_array() {
        let frame = Frame::default();
        let names: Vec<String> = frame_columns(&frame).into_iter().map(|(_, name, _)| name).collect();
        let set: BTreeSet<&str> = names.iter().map(String::as_str).chain(["time", "number"]).collect();
        assert_eq!(set.len(), names.len() + 2, "{names:?}");
    }

    #[test]
    fn only_finished_frames_have_a_number() {
        assert_eq!(frame_number(&frame_name(7)), Some(7));
        assert_eq!(frame_number(&frame_name(123_456)), Some(123_456));
        for name in ["frame_00001.npz.partial", "frame_1.npz", "frame_0000x.npz", "checkpoint.npz"] {
            assert_eq!(frame_number(name), None, "{name}");
        }
    }
}
