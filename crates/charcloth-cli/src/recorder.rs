//! The sink of a run: every frame goes to the cache and to the renderer, and the user sees how far it is.

use crate::interrupt;
use crate::preview::{Pictures, Preview};
use crate::run_folder::human_time;
use charcloth::error::Error;
use charcloth::frame::{Frame, Sample, Sink};
use charcloth::sheet::SheetState;
use charcloth_io::cache::CacheWriter;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::time::Instant;

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
    pub fn new(cache: CacheWriter, preview: Option<Preview>, first: u32, last: u32, quiet: bool) -> Self {
        let last_frame = first.checked_sub(1);
        Self { cache, preview, progress: Progress::new(first, last, quiet), last_frame, interrupted: false }
    }

    /// Saves what there is, also after an error: the checkpoint and the pictures. Problems with pictures come back
    /// apart, for the frames are safe without them.
    pub fn close(&mut self) -> (Result<(), Error>, anyhow::Result<Pictures>) {
        self.progress.bar.finish_and_clear();
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

/// A bar on a terminal, a line every tenth of the run elsewhere.
struct Progress {
    bar: ProgressBar,
    first: u32,
    last: u32,
    quiet: bool,
    start: Instant,
    /// Whether it has been said how long the run will take.
    estimated: bool,
    tenths: u32,
}

impl Progress {
    fn new(first: u32, last: u32, quiet: bool) -> Self {
        let bar = if quiet || !std::io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            let style = ProgressStyle::with_template("{bar:30} frame {pos} of {len}, {msg}{eta} left");
            ProgressBar::new(u64::from(last)).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        };
        Self { bar, first, last, quiet, start: Instant::now(), estimated: false, tenths: 0 }
    }

    fn frame(&mut self, number: u32, history: &[Sample]) {
        let burning = history.iter().find(|sample| sample.name == "burning_nodes");
        let burning = burning.map_or(String::new(), |sample| format!("{} nodes burning, ", sample.value));
        self.bar.set_message(burning.clone());
        if number == self.first && number == 0 {
            self.start = Instant::now(); // frame 0 is the state before the first step and costs nothing
            self.bar.reset_eta();
            return;
        }
        self.bar.set_position(u64::from(number));
        if self.quiet {
            return;
        }
        let done = number - if self.first == 0 { 0 } else { self.first - 1 };
        let left =
            self.start.elapsed().as_secs_f64() / f64::from(done.max(1)) * f64::from(self.last - number.min(self.last));
        if !self.estimated {
            self.estimated = true;
            self.say(&format!("at the pace of the first frame it takes about {}", human_time(left)));
        }
        let tenths = (u64::from(number) * 10 / u64::from(self.last.max(1))) as u32;
        if self.bar.is_hidden() && tenths > self.tenths {
            self.tenths = tenths;
            eprintln!("frame {number} of {}, {burning}{} left", self.last, human_time(left));
        }
    }

    fn say(&self, text: &str) {
        if self.bar.is_hidden() { eprintln!("{text}") } else { self.bar.println(text) }
    }
}
