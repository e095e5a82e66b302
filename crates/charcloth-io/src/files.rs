//! Files that are there whole or not at all: written under a temporary name next to the target, then renamed.

use crate::error::IoError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Ending of files that are still being written; nothing reads them, and a later run removes what a crash left.
pub(crate) const PARTIAL: &str = ".partial";

/// Whether the bytes must be on the disk, not only with the system, before the file gets its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Durability {
    /// Survives a crash of this program.
    Process,
    /// Survives a crash of the machine.
    Machine,
}

/// Why a file that is made of others could not be written.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The file itself could not be written.
    Write(io::Error),
    /// What it is made of could not be had.
    Source(IoError),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Write(error)
    }
}

impl From<IoError> for Failure {
    fn from(error: IoError) -> Self {
        Self::Source(error)
    }
}

/// The file under its temporary name. After the first error it takes in whatever comes: archives end themselves when
/// they are dropped, and would say on the terminal that they cannot.
pub(crate) struct Target {
    file: File,
    failed: bool,
}

impl Target {
    fn note<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        self.failed |= result.as_ref().is_err_and(|error| error.kind() != io::ErrorKind::Interrupted);
        result
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failed {
            return Ok(bytes.len());
        }
        let written = self.file.write(bytes);
        self.note(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.file.flush();
        self.note(flushed)
    }
}

impl Seek for Target {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = self.file.seek(to);
        self.note(place)
    }
}

/// Writes a file whole or not at all; what was there before stays until the new one is complete.
pub(crate) fn write_whole(
    path: &Path,
    durability: Durability,
    write: impl FnOnce(&mut BufWriter<Target>) -> io::Result<()>,
) -> Result<(), IoError> {
    write_streamed(path, durability, |out| Ok(write(out)?))
}

/// As [`write_whole`], for files whose source is read while they are written.
pub(crate) fn write_streamed(
    path: &Path,
    durability: Durability,
    write: impl FnOnce(&mut BufWriter<Target>) -> Result<(), Failure>,
) -> Result<(), IoError> {
    let partial = partial_name(path);
    let attempt = || -> Result<(), Failure> {
        let mut writer = BufWriter::with_capacity(1 << 18, Target { file: File::create(&partial)?, failed: false });
        write(&mut writer)?;
        writer.flush()?;
        let target = writer.get_ref();
        if target.failed {
            return Err(io::Error::other("part of it was not written").into());
        }
        if durability == Durability::Machine {
            target.file.sync_all()?;
        }
        drop(writer);
        fs::rename(&partial, path)?;
        if durability == Durability::Machine {
            sync_folder(path);
        }
        Ok(())
    };
    attempt().map_err(|error| {
        // The error to report is the first one; whether the leftover can be removed does not matter.
        let _ = fs::remove_file(&partial);
        match error {
            Failure::Write(error) => IoError::system("write", path, &error),
            Failure::Source(error) => error,
        }
    })
}

/// Name under which a file is written before it is complete.
fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(PARTIAL);
    path.with_file_name(name)
}

/// Makes a rename last. Some systems cannot open folders; there the rename is as durable as it gets.
fn sync_folder(path: &Path) {
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty())
        && let Ok(handle) = File::open(folder)
    {
        let _ = handle.sync_all();
    }
}

/// Reads a whole file.
pub(crate) fn read_whole(path: &Path) -> Result<Vec<u8>, IoError> {
    fs::read(path).map_err(|error| IoError::system("read", path, &error))
}

/// Creates a folder and those above it.
pub(crate) fn create_folder(path: &Path) -> Result<(), IoError> {
    fs::create_dir_all(path).map_err(|error| IoError::system("create", path, &error))
}
