//! OpenUSD of the fixed-topology twin: one mesh whose points move and whose faces stay.

use super::sequence::Sequence;
use super::twin::Twin;
use super::usd;
use crate::error::IoError;
use std::path::{Path, PathBuf};

/// Writes `twin.usdc` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("twin.usdc");
    let twin = Twin::of(sequence, &path)?;
    usd::write_file(sequence, Some(&twin), &path)?;
    Ok(vec![path])
}
