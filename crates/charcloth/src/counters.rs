//! How long the stages of the step take, and how much memory the program has used.

use std::collections::BTreeMap;
use std::time::Instant;

/// Wall time by stage [s].
#[derive(Debug, Clone, Default)]
pub struct Stages {
    seconds: BTreeMap<&'static str, f64>,
}

impl Stages {
    /// Runs `work` and adds its wall time to a stage.
    pub fn time<T>(&mut self, stage: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(stage, start);
        result
    }

    /// Adds the wall time since `start` to a stage.
    pub fn add(&mut self, stage: &'static str, start: Instant) {
        *self.seconds.entry(stage).or_insert(0.0) += start.elapsed().as_secs_f64();
    }

    /// Wall time by stage [s].
    pub fn seconds(&self) -> BTreeMap<String, f64> {
        self.seconds.iter().map(|(name, seconds)| ((*name).to_owned(), *seconds)).collect()
    }
}

/// Most memory the program has held so far [bytes]; 0 where the system does not tell.
pub fn peak_memory_bytes() -> u64 {
    std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|status| {
            let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
            line.split_whitespace().nth(1)?.parse::<u64>().ok()
        })
        .map_or(0, |kibibytes| kibibytes * 1024)
}
