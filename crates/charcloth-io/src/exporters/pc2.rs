//! PC2 point cache: the places of the fixed-topology twin frame by frame, beside an OBJ of it.
//!
//! A head of 32 bytes, little endian: "POINTCACHE2" and a zero byte, version 1, number of points, first frame, frames a
//! sample, number of samples. Then three single-precision numbers a point, sample by sample.

use super::sequence::Sequence;
use super::twin::Twin;
use super::twin_obj;
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes `sheet.pc2` and `sheet.obj` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.pc2");
    let twin = Twin::of(sequence, &path)?;
    twin_obj::refuse_another(&twin, sequence, folder)?;
    write_streamed(&path, Durability::Process, |out| {
        out.write_all(b"POINTCACHE2\0")?;
        out.write_all(&1u32.to_le_bytes())?;
        out.write_all(&(twin.len() as u32).to_le_bytes())?;
        out.write_all(&(sequence.numbers()[0] as f32).to_le_bytes())?;
        out.write_all(&1f32.to_le_bytes())?;
        out.write_all(&(sequence.numbers().len() as u32).to_le_bytes())?;
        for _ in 0..sequence.numbers().len() {
            let frame = sequence.next_needed(&path)?;
            for number in twin.pose(&frame).positions.iter().flat_map(|p| p.to_array()) {
                out.write_all(&number.to_le_bytes())?;
            }
        }
        Ok(())
    })?;
    let mesh = twin_obj::write(&twin, sequence, folder)?;
    Ok(vec![mesh, path])
}
