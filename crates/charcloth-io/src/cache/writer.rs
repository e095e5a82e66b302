//! Writes the cache of a run, frame by frame, such that a kill at any moment costs a few seconds of simulation.

use super::history::History;
use super::npz::{NpzWriter, Precision};
use super::{
    CHECKPOINT, CacheMeta, Checkpoint, FOLDER, HISTORY, META, checkpoint, frame_columns, frame_name, frame_number,
};
use crate::error::IoError;
use crate::files::{Durability, PARTIAL, create_folder, write_whole};
use charcloth::error::Error;
use charcloth::frame::{Frame, Sample, Sink};
use charcloth::scene::Axis;
use charcloth::sheet::SheetState;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Wall time between checkpoints: what a kill may cost. The first frame has one at once, and the next come at intervals
/// that double from `FIRST_INTERVAL` on, so that young runs can be taken up, too.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(3);
const FIRST_INTERVAL: Duration = Duration::from_millis(200);
/// Checkpoints of huge sheets come less often, so that writing them takes at most this part of the wall time.
const CHECKPOINT_SHARE: u32 = 20;
/// Deflate level of frames. tuned: see docs/cache.md for what the levels cost and save.
const FRAME_LEVEL: u8 = 1;

/// What a cache says about the run it is of.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunInfo {
    /// Name of the scene.
    pub scene: String,
    /// Frames a second.
    pub fps: f64,
    /// Which way is up.
    pub up: Axis,
}

/// A sink that writes every frame into the cache of a run, keeps a checkpoint, and writes the time history.
#[derive(Debug)]
pub struct CacheWriter {
    cache: PathBuf,
    history: History,
    checkpoint_every: Duration,
    /// Whether the interval still grows.
    young: bool,
    last_checkpoint: Instant,
    /// Frames written since the last checkpoint: they go to the disk before the next one does.
    unsynced: Vec<PathBuf>,
    /// The last frame's end, as long as no checkpoint holds it.
    pending: Option<Checkpoint>,
}

impl CacheWriter {
    /// Starts the cache of a run in a folder, which is made if need be. A folder that has a run already is refused:
    /// [`clear`] it, or [`CacheWriter::resume`].
    pub fn create(run: &Path, info: &RunInfo) -> Result<Self, IoError> {
        let cache = run.join(FOLDER);
        if cache.join(META).exists() {
            let hint = "resume it, have it overwritten, or name another output folder";
            return Err(IoError::content(run, "there is a run here already", hint));
        }
        create_folder(&cache)?;
        remove_partial(&cache)?;
        remove_partial(run)?;
        CacheMeta::of_this_version(info).write(&cache)?;
        Ok(Self::with(cache, History::create(run)))
    }

    /// Takes up a run that was stopped: drops frames and history rows behind the checkpoint, and hands the checkpoint
    /// back to go on from.
    pub fn resume(run: &Path, info: &RunInfo) -> Result<(Self, Checkpoint), IoError> {
        let (cache, _) = CacheMeta::find(run)?;
        let Some(checkpoint) = checkpoint::read(&cache)? else {
            let problem = "the run was stopped before its first checkpoint";
            return Err(IoError::content(run, problem, "run the scene from the start"));
        };
        remove_partial(&cache)?;
        remove_partial(run)?;
        remove_where(&cache, |name| frame_number(name).is_some_and(|number| number > checkpoint.frame))?;
        let history = History::resume(run, checkpoint.frame)?;
        CacheMeta::of_this_version(info).write(&cache)?;
        Ok((Self::with(cache, history), checkpoint))
    }

    fn with(cache: PathBuf, history: History) -> Self {
        Self {
            cache,
            history,
            checkpoint_every: Duration::ZERO,
            young: true,
            last_checkpoint: Instant::now(),
            unsynced: Vec::new(),
            pending: None,
        }
    }

    /// Changes the wall time between checkpoints from 3 s (less at first); zero writes one after every frame.
    pub fn checkpoint_every(mut self, interval: Duration) -> Self {
        self.checkpoint_every = interval;
        self.young = false;
        self
    }

    /// Writes a frame, its row of history and, when it is time, a checkpoint.
    pub fn write(&mut self, frame: &Frame, history: &[Sample], state: &SheetState) -> Result<(), IoError> {
        let path = self.cache.join(frame_name(frame.number));
        write_frame(&path, frame, FRAME_LEVEL)?;
        self.unsynced.push(path);
        self.history.add(frame.number, frame.time, history)?;
        if self.last_checkpoint.elapsed() >= self.checkpoint_every {
            self.pending = None;
            self.write_checkpoint(frame.number, frame.time, state)
        } else {
            self.pending = Some(Checkpoint { frame: frame.number, time: frame.time, state: state.clone() });
            Ok(())
        }
    }

    /// Writes the checkpoint of the last frame, unless it is there. Also worth calling when the simulation failed: the
    /// frames so far are then kept as they are.
    pub fn close(&mut self) -> Result<(), IoError> {
        match self.pending.take() {
            Some(last) => self.write_checkpoint(last.frame, last.time, &last.state),
            None => Ok(()),
        }
    }

    fn write_checkpoint(&mut self, frame: u32, time: f64, state: &SheetState) -> Result<(), IoError> {
        let start = Instant::now();
        // A checkpoint says that all frames before it are there; after a power cut too.
        for path in self.unsynced.drain(..) {
            let sync = File::open(&path).and_then(|file| file.sync_all());
            sync.map_err(|error| IoError::system("write", &path, &error))?;
        }
        self.history.sync()?;
        checkpoint::write(&self.cache, frame, time, state)?;
        if self.young {
            self.checkpoint_every = (2 * self.checkpoint_every).clamp(FIRST_INTERVAL, CHECKPOINT_EVERY);
            self.young = self.checkpoint_every < CHECKPOINT_EVERY;
        }
        if !self.checkpoint_every.is_zero() {
            self.checkpoint_every = self.checkpoint_every.max(start.elapsed() * CHECKPOINT_SHARE);
        }
        self.last_checkpoint = Instant::now();
        Ok(())
    }
}

impl Sink for CacheWriter {
    fn frame(&mut self, frame: &Frame, history: &[Sample], state: &SheetState) -> Result<ControlFlow<()>, Error> {
        self.write(frame, history, state)?;
        Ok(ControlFlow::Continue(()))
    }

    fn finish(&mut self) -> Result<(), Error> {
        Ok(self.close()?)
    }
}

/// Writes one frame file.
pub(super) fn write_frame(path: &Path, frame: &Frame, level: u8) -> Result<(), IoError> {
    write_whole(path, Durability::Process, |out| {
        let mut npz = NpzWriter::new(out, level);
        npz.u32("number", frame.number)?;
        npz.f64("time", frame.time)?;
        for (_, name, column) in frame_columns(frame) {
            npz.column(&name, &column.data, Precision::Single)?;
        }
        npz.finish()
    })
}

/// Removes the run in a folder, so that another can be written there: the files of the cache and the history, nothing
/// else. A folder without a run is left alone.
pub fn clear(run: &Path) -> Result<(), IoError> {
    let cache = run.join(FOLDER);
    // The description goes last: as long as it is there, the folder counts as a run.
    remove_where(&cache, |name| frame_number(name).is_some() || name == CHECKPOINT || name.ends_with(PARTIAL))?;
    remove_where(run, |name| name == HISTORY)?;
    remove_where(&cache, |name| name == META)
}

fn remove_partial(folder: &Path) -> Result<(), IoError> {
    remove_where(folder, |name| {
        name.strip_suffix(PARTIAL)
            .is_some_and(|whole| frame_number(whole).is_some() || [CHECKPOINT, META, HISTORY].contains(&whole))
    })
}

/// Removes the files of a folder whose name says so; a folder that is not there has none.
fn remove_where(folder: &Path, is_unwanted: impl Fn(&str) -> bool) -> Result<(), IoError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(IoError::system("read", folder, &error)),
    };
    for entry in entries {
        let entry = entry.map_err(|error| IoError::system("read", folder, &error))?;
        if is_unwanted(&entry.file_name().to_string_lossy()) {
            let path = entry.path();
            fs::remove_file(&path).map_err(|error| IoError::system("remove", &path, &error))?;
        }
    }
    Ok(())
}
