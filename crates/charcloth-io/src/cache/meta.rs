//! `cache.json`: what the arrays of a cache are.

use super::npz::{Precision, layout};
use super::{FOLDER, FORMAT, META, RunInfo, VERSION, frame_columns};
use crate::error::IoError;
use crate::files::{Durability, read_whole, write_whole};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What `cache.json` says.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CacheMeta {
    /// Name of the format.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Version of the program that wrote it.
    #[serde(default)]
    pub charcloth: String,
    /// Name of the scene.
    #[serde(default)]
    pub scene: String,
    /// Frames a second.
    #[serde(default)]
    pub fps: f64,
    /// Which way is up; caches that do not say are y-up, as scenes are unless they say.
    #[serde(default)]
    pub up: Axis,
    /// The arrays of a frame.
    #[serde(default)]
    pub fields: Vec<FieldMeta>,
}

/// One array of a frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FieldMeta {
    /// Name of the array in the frame files.
    pub name: String,
    /// Table the column is of: motion and burn have a row a node, triangles a row a triangle.
    #[serde(default)]
    pub table: String,
    /// SI unit; "1" for pure numbers.
    #[serde(default)]
    pub unit: String,
    /// Type of the numbers, by numpy's name.
    #[serde(default)]
    pub dtype: String,
    /// Shape, the number of rows written as its table: `["motion", "3"]`.
    #[serde(default)]
    pub shape: Vec<String>,
    /// One sentence on what it is.
    #[serde(default)]
    pub about: String,
}

impl CacheMeta {
    /// What this version of the program writes.
    pub(super) fn of_this_version(run: &RunInfo) -> Self {
        let frame = Frame::default();
        let fields = frame_columns(&frame)
            .into_iter()
            .map(|(table, name, column)| {
                let (kind, row) = layout(&column.data, Precision::Single);
                FieldMeta {
                    name,
                    table: table.to_string(),
                    unit: column.unit.to_string(),
                    dtype: kind.name().to_string(),
                    shape: std::iter::once(table.to_string()).chain(row.iter().map(u64::to_string)).collect(),
                    about: column.about.to_string(),
                }
            })
            .collect();
        Self {
            format: FORMAT.to_string(),
            version: VERSION,
            charcloth: env!("CARGO_PKG_VERSION").to_string(),
            scene: run.scene.clone(),
            fps: run.fps,
            up: run.up,
            fields,
        }
    }

    /// Writes `cache.json` into the cache folder.
    pub(super) fn write(&self, cache: &Path) -> Result<(), IoError> {
        write_whole(&cache.join(META), Durability::Machine, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            out.write_all(b"\n")
        })
    }

    /// Reads `cache.json`; the folder may be that of the run or that of the cache. Gives back the cache folder too.
    pub(super) fn find(folder: &Path) -> Result<(PathBuf, Self), IoError> {
        let candidates = [folder.join(FOLDER), folder.to_path_buf()];
        let Some(cache) = candidates.into_iter().find(|c| c.join(META).is_file()) else {
            let problem = format!("there is no cache here ({FOLDER}/{META} is missing)");
            return Err(IoError::content(folder, problem, "name the output folder of a run"));
        };
        let path = cache.join(META);
        let damaged = |error: serde_json::Error| {
            let problem = format!("not a sound {META} ({error})");
            IoError::at_line(&path, error.line(), problem, "run the scene again, or restore the file from another run")
        };
        let value: serde_json::Value = serde_json::from_slice(&read_whole(&path)?).map_err(damaged)?;
        // Name and version are looked at before anything else, for the rest may be different in another version.
        if value["format"] != FORMAT {
            return Err(IoError::content(&path, "this is not a cache of Charcloth", "name the output folder of a run"));
        }
        match value["version"].as_u64() {
            Some(version) if version <= u64::from(VERSION) => {}
            Some(version) => {
                let problem = format!("the cache is of format version {version}, this program reads up to {VERSION}");
                return Err(IoError::content(&path, problem, "use a newer charcloth"));
            }
            None => return Err(IoError::content(&path, "the format version is missing", "run the scene again")),
        }
        let meta = serde_json::from_value(value).map_err(damaged)?;
        Ok((cache, meta))
    }
}
