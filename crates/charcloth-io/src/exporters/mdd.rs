//! MDD point cache: the places of the fixed-topology twin frame by frame, beside an OBJ of it.
//!
//! Big endian: number of frames, number of points, the time of each frame [s], then three single-precision numbers a
//! point, frame by frame.

use super::sequence::Sequence;
use super::twin::Twin;
use super::twin_obj;
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes `sheet.mdd` and `sheet.obj` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.mdd");
    let twin = Twin::of(sequence, &path)?;
    twin_obj::refuse_another(&twin, sequence, folder)?;
    write_streamed(&path, Durability::Process, |out| {
        out.write_all(&(sequence.numbers().len() as u32).to_be_bytes())?;
        out.write_all(&(twin.len() as u32).to_be_bytes())?;
        for number in sequence.numbers() {
            let time = f64::from(number - sequence.numbers()[0]) / sequence.fps();
            out.write_all(&(time as f32).to_be_bytes())?;
        }
        for _ in 0..sequence.numbers().len() {
            let frame = sequence.next_needed(&path)?;
            for number in twin.pose(&frame).positions.iter().flat_map(|p| p.to_array()) {
                out.write_all(&number.to_be_bytes())?;
            }
        }
        Ok(())
    })?;
    let mesh = twin_obj::write(&twin, sequence, folder)?;
    Ok(vec![mesh, path])
}
