//! The checkpoint: every column of every table in full precision, so that a run goes on with the same bits.

use super::npz::{NpzReader, NpzWriter, Precision};
use super::{CHECKPOINT, VERSION};
use crate::error::IoError;
use crate::files::{Durability, read_whole, write_whole};
use charcloth::sheet::SheetState;
use std::collections::BTreeMap;
use std::path::Path;

/// Names beside those of the columns.
const OWN_NAMES: [&str; 4] = ["version", "frame", "time", "hash"];

/// A state to go on from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Checkpoint {
    /// The frame whose end it is.
    pub frame: u32,
    /// Simulated time [s].
    pub time: f64,
    /// Everything that changes from step to step.
    pub state: SheetState,
}

/// Writes a checkpoint; the one before stays until this one is on the disk.
pub(super) fn write(cache: &Path, frame: u32, time: f64, state: &SheetState) -> Result<(), IoError> {
    write_whole(&cache.join(CHECKPOINT), Durability::Machine, |out| {
        // Stored, not deflated: the low bits of a double are noise and hardly compress.
        let mut npz = NpzWriter::new(out, 0);
        npz.u32("version", VERSION)?;
        npz.u32("frame", frame)?;
        npz.f64("time", time)?;
        npz.u64("hash", state.hash())?;
        for (table, columns) in state.tables() {
            for column in columns {
                npz.column(&format!("{table}.{}", column.name), &column.data, Precision::Full)?;
            }
        }
        npz.finish()
    })
}

/// Reads the checkpoint of a cache folder, if there is one, and makes sure that it is whole.
pub(super) fn read(cache: &Path) -> Result<Option<Checkpoint>, IoError> {
    let path = cache.join(CHECKPOINT);
    if !path.exists() {
        return Ok(None);
    }
    read_checked(read_whole(&path)?).map(Some).map_err(|problem| {
        IoError::content(&path, format!("cannot go on from this checkpoint: {problem}"), "run the scene from the start")
    })
}

fn read_checked(bytes: Vec<u8>) -> Result<Checkpoint, String> {
    let mut npz = NpzReader::new(bytes)?;
    let version = npz.number("version")?;
    if version > f64::from(VERSION) {
        return Err(format!("it is of format version {version}, this program reads up to {VERSION}"));
    }
    let mut checkpoint =
        Checkpoint { frame: npz.number("frame")? as u32, time: npz.number("time")?, state: SheetState::default() };
    let mut known: Vec<String> = OWN_NAMES.map(str::to_string).to_vec();
    for (table, column, data) in checkpoint.state.columns_mut() {
        let name = format!("{table}.{column}");
        npz.fill(&name, data)
            .map_err(|problem| format!("{problem}; another version of charcloth may have written it"))?;
        known.push(name);
    }
    // A column this version does not know would be lost, and the run would go on differently.
    if let Some(unknown) = npz.names().iter().find(|name| !known.contains(name)) {
        return Err(format!("it has the array {unknown}, which this version of charcloth does not know"));
    }
    let mut rows = BTreeMap::new();
    for (table, columns) in checkpoint.state.tables() {
        for column in columns {
            if *rows.entry(table).or_insert(column.data.len()) != column.data.len() {
                return Err(format!("the columns of {table} are not of one length"));
            }
        }
    }
    let hash = npz.word("hash")?;
    if checkpoint.state.hash() != hash {
        return Err("its content is not what was written (the hash differs); the file is damaged".to_string());
    }
    Ok(checkpoint)
}
