//! `history.csv`: one row a frame, for plots. Columns are told by their head: name and unit.

use super::HISTORY;
use crate::error::IoError;
use crate::files::{Durability, read_whole, write_whole};
use charcloth::frame::Sample;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes the time history of a run.
#[derive(Debug)]
pub(super) struct History {
    path: PathBuf,
    file: Option<File>,
    /// Head of the file, once a row has been written.
    head: Option<String>,
    /// Bytes of the complete rows.
    length: u64,
}

impl History {
    /// A history that starts anew with its first row.
    pub fn create(run: &Path) -> Self {
        Self { path: run.join(HISTORY), file: None, head: None, length: 0 }
    }

    /// Takes up a history, dropping the rows behind a frame and a row that a crash left half written.
    pub fn resume(run: &Path, last_frame: u32) -> Result<Self, IoError> {
        let mut history = Self::create(run);
        if !history.path.exists() {
            return Ok(history);
        }
        let bytes = read_whole(&history.path)?;
        let text = String::from_utf8_lossy(&bytes);
        let mut kept = String::new();
        for line in text.split_inclusive('\n').filter(|line| line.ends_with('\n')) {
            if history.head.is_none() {
                history.head = Some(line.to_string());
            } else {
                let frame = line.split(',').next().and_then(|number| number.parse::<u32>().ok());
                if frame.is_none_or(|frame| frame > last_frame) {
                    continue;
                }
            }
            kept.push_str(line);
        }
        write_whole(&history.path, Durability::Machine, |out| out.write_all(kept.as_bytes()))?;
        history.length = kept.len() as u64;
        Ok(history)
    }

    /// Adds the row of a frame.
    pub fn add(&mut self, frame: u32, time: f64, samples: &[Sample]) -> Result<(), IoError> {
        // A sample that repeats what stands first is left out.
        let samples = || samples.iter().filter(|s| s.name != "frame" && s.name != "time");
        let mut head = String::from("frame,time [s]");
        let mut row = format!("{frame},{}", number(time));
        for sample in samples() {
            head.push_str(&format!(",{} [{}]", sample.name, sample.unit));
            row.push_str(&format!(",{}", number(sample.value)));
        }
        head.push('\n');
        row.push('\n');
        match &self.head {
            None => {
                write_whole(&self.path, Durability::Process, |out| out.write_all(head.as_bytes()))?;
                self.length = head.len() as u64;
                self.head = Some(head);
            }
            Some(known) if *known == head => {}
            Some(_) => {
                let hint = "another version of charcloth wrote it: run the scene from the start";
                return Err(IoError::at_line(&self.path, 1, "its columns are not those of this run", hint));
            }
        }
        let failed = |error: std::io::Error| IoError::system("write", &self.path, &error);
        if self.file.is_none() {
            self.file = Some(OpenOptions::new().append(true).open(&self.path).map_err(failed)?);
        }
        if let Some(file) = &mut self.file
            && let Err(error) = file.write_all(row.as_bytes())
        {
            // A full disk may have taken half the row.
            let _ = file.set_len(self.length);
            return Err(failed(error));
        }
        self.length += row.len() as u64;
        Ok(())
    }

    /// Brings the rows to the disk.
    pub fn sync(&self) -> Result<(), IoError> {
        match &self.file {
            Some(file) => file.sync_all().map_err(|error| IoError::system("write", &self.path, &error)),
            None => Ok(()),
        }
    }
}

/// The shortest digits that give the same number back, with an exponent where that is the shorter.
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-4..1e15).contains(&size) || !size.is_finite() {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}
