//! The sink of a run: every frame goes to the cache and to the renderer, and the user sees how far it is.

use crate::interrupt;
use crate::preview::{Pictures, Preview};
use crate::progress::{Progress, Report};
use charcloth::error::Error;
use charcloth::frame::{Frame, Sample, Sink};
use charcloth::sheet::SheetState;
use charcloth_io::cache::CacheWriter;
use std::ops::ControlFlow;

/// Takes the frames of a run.
pub struct Recorder {
    cache: CacheWriter,
    preview: Option<Preview>,
    progress: Progress,
    /// Last frame that was written, if any was.
    pub last_frame: Option<u32>,
    /// Whether the run was ended by the user.
    pub interrupted: bool,
}

impl Recorder {
    /// Takes frames from `first` to `last`.
    pub fn new(cache: CacheWriter, preview: Option<Preview>, first: u32, last: u32, report: Report) -> Self {
        let last_frame = first.checked_sub(1);
        Self { cache, preview, progress: Progress::new(first, last, report), last_frame, interrupted: false }
    }

    /// Saves what there is, also after an error: the checkpoint and the pictures. Problems with pictures come back
    /// apart, for the frames are safe without them.
    pub fn close(&mut self) -> (Result<(), Error>, anyhow::Result<Pictures>) {
        self.progress.close();
        let cache = self.cache.finish();
        let pictures = self.preview.as_mut().map_or(Ok(Pictures::default()), Preview::finish);
        (cache, pictures)
    }
}

impl Sink for Recorder {
    fn frame(&mut self, frame: &Frame, history: &[Sample], state: &SheetState) -> Result<ControlFlow<()>, Error> {
        let flow = self.cache.frame(frame, history, state)?;
        self.last_frame = Some(frame.number);
        if let Some(preview) = &mut self.preview {
            preview.frame(frame);
        }
        self.progress.frame(frame.number, history);
        self.interrupted = interrupt::asked_to_stop() && frame.number < self.progress.last;
        Ok(if self.interrupted { ControlFlow::Break(()) } else { flow })
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.cache.finish()
    }
}
