//! USDZ: the .usdc of the run in a package, for Quick Look, augmented reality and the web.
//!
//! A package is a zip whose files are stored as they are and begin at multiples of 64 bytes, so that readers can use
//! them where they lie.

use super::sequence::Sequence;
use super::usd;
use crate::error::IoError;
use crate::files::{Durability, PARTIAL, write_streamed};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Files in a package begin at multiples of this.
const ALIGNMENT: u16 = 64;
/// Packages must do without the longer offsets that zip has for larger files.
const MOST_BYTES: u64 = 0xffff_0000;

/// Writes `sheet.usdz` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.usdz");
    let layer = folder.join(format!("sheet.usdc{PARTIAL}"));
    let packed = usd::write_file(sequence, None, &layer).and_then(|()| pack(&layer, &path));
    // The error to report is the first one; whether the layer can be removed does not matter.
    let _ = fs::remove_file(layer);
    packed.map(|()| vec![path])
}

fn pack(layer: &Path, path: &Path) -> Result<(), IoError> {
    let mut source = File::open(layer).map_err(|error| IoError::system("read", layer, &error))?;
    let size = source.metadata().map_err(|error| IoError::system("read", layer, &error))?.len();
    if size > MOST_BYTES {
        let hint = "export fewer frames with --frames, or the format usd, which has no limit";
        return Err(IoError::content(path, format!("{size} bytes are too many for a .usdz"), hint));
    }
    write_streamed(path, Durability::Process, |out| {
        let mut zip = ZipWriter::new(out);
        let options =
            SimpleFileOptions::default().compression_method(CompressionMethod::Stored).with_alignment(ALIGNMENT);
        zip.start_file("sheet.usdc", options).map_err(io::Error::from)?;
        io::copy(&mut source, &mut zip)?;
        zip.finish().map_err(io::Error::from)?;
        Ok(())
    })
}
