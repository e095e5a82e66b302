//! The frames of an export, one in memory at a time.

use super::Progress;
use crate::cache::{CacheMeta, CacheReader};
use crate::error::IoError;
use charcloth::frame::Frame;
use std::fmt;
use std::ops::ControlFlow;
use std::path::Path;

/// Frames of a cache in turn, for formats that hold several.
pub struct Sequence<'a> {
    cache: &'a CacheReader,
    numbers: Vec<u32>,
    done: usize,
    progress: &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
}

impl<'a> Sequence<'a> {
    /// Frames of these numbers; there must be one at least.
    pub(super) fn new(
        cache: &'a CacheReader,
        numbers: Vec<u32>,
        progress: &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
    ) -> Self {
        assert!(!numbers.is_empty(), "a sequence has a first frame");
        Self { cache, numbers, done: 0, progress }
    }

    /// What the cache says about the run.
    pub(super) fn meta(&self) -> &CacheMeta {
        self.cache.meta()
    }

    /// Frames a second; caches that do not say are taken to be film.
    pub(super) fn fps(&self) -> f64 {
        if self.meta().fps > 0.0 { self.meta().fps } else { 24.0 }
    }

    /// The next frame, for the file that is being written; none once all are used up or the user wants no more.
    pub(super) fn next(&mut self, path: &Path) -> Result<Option<Frame>, IoError> {
        if self.done > 0 {
            let now = Progress { done: self.done, total: self.numbers.len(), path };
            if (self.progress)(now).is_break() {
                return Ok(None);
            }
        }
        let Some(number) = self.numbers.get(self.done) else { return Ok(None) };
        self.done += 1;
        self.cache.frame(*number).map(Some)
    }
}

impl fmt::Debug for Sequence<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Sequence").field("numbers", &self.numbers).field("done", &self.done).finish_non_exhaustive()
    }
}
