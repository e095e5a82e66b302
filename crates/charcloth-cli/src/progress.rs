//! How far a command is: for people a bar or lines, for programs one JSON object a line.

use crate::run_folder::human_time;
use charcloth::frame::Sample;
use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::io::{IsTerminal, Write};
use std::time::Instant;

/// What `--progress` chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Style {
    /// A bar on a terminal, lines elsewhere.
    #[default]
    Words,
    /// One JSON object a line on standard output, and nothing else there.
    Json,
}

/// Who is told how far a command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Report {
    /// Nobody.
    Nobody,
    /// People.
    Words,
    /// A program.
    Json,
}

impl Report {
    /// From what was asked for on the command line.
    pub fn new(style: Style, quiet: bool) -> Self {
        match (quiet, style) {
            (true, _) => Self::Nobody,
            (false, Style::Words) => Self::Words,
            (false, Style::Json) => Self::Json,
        }
    }

    /// A warning: to standard error for people, also for quiet ones; an event for a program.
    pub fn warn(self, text: &str) {
        match self {
            Self::Json => tell(&json!({ "event": "warning", "text": text })),
            Self::Nobody | Self::Words => eprintln!("warning: {text}"),
        }
    }
}

/// Writes one event on a line of its own. A program that has stopped listening stops nothing.
pub fn tell(event: &Value) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{event}").and_then(|()| out.flush());
}

/// A bar on a terminal, a line every tenth of the run elsewhere, or an event a frame.
pub struct Progress {
    bar: ProgressBar,
    first: u32,
    /// Last frame there will be.
    pub last: u32,
    report: Report,
    start: Instant,
    /// Whether it has been said how long the run will take.
    estimated: bool,
    tenths: u32,
}

impl Progress {
    /// Of the frames from `first` to `last`.
    pub fn new(first: u32, last: u32, report: Report) -> Self {
        let bar = if report != Report::Words || !std::io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            let style = ProgressStyle::with_template("{bar:30} frame {pos} of {len}, {msg}{eta} left");
            ProgressBar::new(u64::from(last)).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        };
        Self { bar, first, last, report, start: Instant::now(), estimated: false, tenths: 0 }
    }

    /// A frame is done.
    pub fn frame(&mut self, number: u32, history: &[Sample]) {
        let burning = history.iter().find(|sample| sample.name == "burning_nodes").map(|sample| sample.value);
        if number == self.first && number == 0 {
            self.start = Instant::now(); // frame 0 is the state before the first step and costs nothing
            self.bar.reset_eta();
        }
        let done = number - if self.first == 0 { 0 } else { self.first - 1 };
        let left = (done > 0).then(|| {
            self.start.elapsed().as_secs_f64() / f64::from(done) * f64::from(self.last - number.min(self.last))
        });
        match self.report {
            Report::Nobody => {}
            Report::Json => tell(&json!({
                "event": "frame", "frame": number, "last": self.last, "burning_nodes": burning, "left_s": left
            })),
            Report::Words => self.say_frame(number, burning, left),
        }
    }

    /// The bar is taken away.
    pub fn close(&self) {
        self.bar.finish_and_clear();
    }

    fn say_frame(&mut self, number: u32, burning: Option<f64>, left: Option<f64>) {
        let burning = burning.map_or(String::new(), |nodes| format!("{nodes} nodes burning, "));
        self.bar.set_message(burning.clone());
        let Some(left) = left else { return };
        self.bar.set_position(u64::from(number));
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
