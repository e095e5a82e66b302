//! The frames of an export, one in memory at a time.

use super::{ExportOptions, Progress};
use crate::cache::{CacheMeta, CacheReader};
use crate::error::IoError;
use charcloth::frame::Frame;
use glam::DVec3;
use std::fmt;
use std::ops::ControlFlow;
use std::path::Path;

/// Frames of a cache in turn, for formats that hold several.
pub struct Sequence<'a> {
    cache: &'a CacheReader,
    numbers: Vec<u32>,
    options: &'a ExportOptions,
    /// Names of files that must stay as they are.
    kept: Vec<String>,
    /// Times that the frames are gone through.
    passes: usize,
    done: usize,
    /// Triangles of the first frame; later ones must have as many at least.
    triangles: usize,
    /// Time and places of nodes and particles of the frame before, and the frame after, for mean velocities.
    before: Option<(f64, Vec<DVec3>, Vec<DVec3>)>,
    ahead: Option<Frame>,
    progress: &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
}

impl<'a> Sequence<'a> {
    /// Frames of these numbers; there must be one at least.
    pub(super) fn new(
        cache: &'a CacheReader,
        numbers: Vec<u32>,
        options: &'a ExportOptions,
        progress: &'a mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
    ) -> Self {
        assert!(!numbers.is_empty(), "a sequence has a first frame");
        let kept = Vec::new();
        Self { cache, numbers, options, kept, passes: 1, done: 0, triangles: 0, before: None, ahead: None, progress }
    }

    /// What the cache says about the run.
    pub(super) fn meta(&self) -> &CacheMeta {
        self.cache.meta()
    }

    /// What the user has chosen.
    pub(super) fn options(&self) -> &ExportOptions {
        self.options
    }

    /// Says which files an export in another format needs as they are.
    pub(super) fn keep(&mut self, names: &[String]) {
        self.kept = names.to_vec();
    }

    /// Whether a file must stay as it is.
    pub(super) fn keeps(&self, name: &str) -> bool {
        self.kept.iter().any(|kept| kept == name)
    }

    /// Frames a second; caches that do not say are taken to be film.
    pub(super) fn fps(&self) -> f64 {
        if self.meta().fps > 0.0 { self.meta().fps } else { 24.0 }
    }

    /// Numbers of all frames of the sequence, in order.
    pub(super) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// Fails where frames are missing, for formats that count them.
    pub(super) fn refuse_gaps(&self, path: &Path) -> Result<(), IoError> {
        self.numbers.windows(2).find(|pair| pair[1] != pair[0] + 1).map_or(Ok(()), |gap| {
            let problem = format!("frame {} is missing, and the format has no gaps", gap[0] + 1);
            Err(IoError::content(path, problem, "export the frames before or after it with --frames"))
        })
    }

    /// The first frame, which is not used up.
    pub(super) fn first(&self) -> Result<Frame, IoError> {
        self.cache.frame(self.numbers[0])
    }

    /// The last frame, which is not used up: nodes and triangles are only ever added, so it knows them all.
    pub(super) fn last(&self) -> Result<Frame, IoError> {
        self.cache.frame(self.numbers[self.numbers.len() - 1])
    }

    /// Flags of the triangles of a frame: 1 while a triangle is part of the surface.
    pub(super) fn triangles_alive(&self, number: u32) -> Result<Vec<u8>, IoError> {
        self.cache.triangles_alive(number)
    }

    /// Says that the frames are gone through more than once, for the progress that is told.
    pub(super) fn plan(&mut self, passes: usize) {
        self.passes = passes;
    }

    /// The next frame, for a file that is of no use without all of them. Further passes begin anew.
    pub(super) fn next_needed(&mut self, path: &Path) -> Result<Frame, IoError> {
        self.next(path)?.ok_or_else(|| {
            let problem = "the export was stopped, and the format needs all frames: the file is not written";
            IoError::content(path, problem, "export fewer with --frames")
        })
    }

    /// The next frame, for the file that is being written; none once all are used up or the user wants no more.
    pub(super) fn next(&mut self, path: &Path) -> Result<Option<Frame>, IoError> {
        if self.done > 0 {
            let now = Progress { done: self.done, total: self.passes * self.numbers.len(), path };
            if (self.progress)(now).is_break() {
                return Ok(None);
            }
        }
        if self.done == self.passes * self.numbers.len() {
            return Ok(None);
        }
        let at = self.done % self.numbers.len();
        let number = self.numbers[at];
        if at == 0 {
            (self.before, self.ahead) = (None, None);
        }
        let mut frame = match self.ahead.take() {
            Some(frame) => frame,
            None => self.cache.frame(number)?,
        };
        if at == 0 {
            self.triangles = frame.triangles.len();
        }
        self.done += 1;
        if self.options.mean_velocities {
            self.ahead = self.numbers.get(at + 1).map(|number| self.cache.frame(*number)).transpose()?;
            self.average_velocities(&mut frame);
        }
        if frame.triangles.len() < self.triangles {
            let problem = format!("frame {number} has fewer triangles than the first");
            return Err(IoError::content(self.cache.folder(), problem, "it is of another run: run the scene again"));
        }
        Ok(Some(frame))
    }

    /// Replaces the velocities of a frame by the mean ones from the frame before to the frame after, as far as
    /// nodes and particles are there; one without either keeps its own.
    fn average_velocities(&mut self, frame: &mut Frame) {
        let (before, ahead) = (self.before.as_ref(), self.ahead.as_ref());
        average(
            &mut frame.motion.velocity,
            (frame.time, &frame.motion.position),
            before.map(|(time, nodes, _)| (*time, nodes.as_slice())),
            ahead.map(|frame| (frame.time, frame.motion.position.as_slice())),
        );
        average(
            &mut frame.particles.velocity,
            (frame.time, &frame.particles.position),
            before.map(|(time, _, particles)| (*time, particles.as_slice())),
            ahead.map(|frame| (frame.time, frame.particles.position.as_slice())),
        );
        self.before = Some((frame.time, frame.motion.position.clone(), frame.particles.position.clone()));
    }
}

/// Mean velocities [m/s] between what is known of times [s] and places [m] at them. Rows are names.
fn average(
    velocity: &mut [DVec3],
    (time, here): (f64, &[DVec3]),
    before: Option<(f64, &[DVec3])>,
    after: Option<(f64, &[DVec3])>,
) {
    for i in 0..velocity.len() {
        let at = |frame: Option<(f64, &[DVec3])>| {
            frame.and_then(|(time, places)| Some((time, *places.get(i)?))).unwrap_or((time, here[i]))
        };
        let ((from, start), (to, end)) = (at(before), at(after));
        if to > from {
            velocity[i] = (end - start) / (to - from);
        }
    }
}

impl fmt::Debug for Sequence<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Sequence").field("numbers", &self.numbers).field("done", &self.done).finish_non_exhaustive()
    }
}
