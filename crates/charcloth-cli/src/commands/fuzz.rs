//! `charcloth fuzz`: runs random scenes to their end, and tells those that went wrong.

use super::{Outcome, Run, run::set_threads};
use charcloth_io::fuzz;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// What to try.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Number of scenes
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    /// Seed of the first scene; the next ones count up
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write the scenes into this folder, to be run or looked at
    #[arg(long, value_name = "FOLDER")]
    write: Option<PathBuf>,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        set_threads(self.threads)?;
        if let Some(folder) = &self.write {
            std::fs::create_dir_all(folder)?;
        }
        let mut out = std::io::stdout().lock();
        let (mut wrong, mut burnt, mut slowest) = (0u64, 0u64, (0.0, self.seed));
        for seed in (0..self.count).map(|k| self.seed.wrapping_add(k)) {
            let text = fuzz::scene(seed);
            if let Some(folder) = &self.write {
                std::fs::write(folder.join(format!("fuzz_{seed}.toml")), &text)?;
            }
            let start = Instant::now();
            match fuzz::try_scene(&text) {
                Ok(summary) => burnt += u64::from(summary.fuel_burnt_kg > 1e-3 * summary.fuel_initial_kg),
                Err(problem) => {
                    wrong += 1;
                    writeln!(out, "seed {seed}: {problem}")?;
                    out.flush()?;
                }
            }
            let wall = start.elapsed().as_secs_f64();
            if wall > slowest.0 {
                slowest = (wall, seed);
            }
        }
        let (wall, seed) = slowest;
        writeln!(
            out,
            "{} scenes, {burnt} of them burn, {wrong} went wrong; seed {seed} took longest, {wall:.1} s",
            self.count
        )?;
        if wrong > 0 {
            writeln!(out, "`charcloth fuzz --count 1 --seed N --write FOLDER` writes the scene of a seed")?;
        }
        Ok(if wrong > 0 { Outcome::CheckFailed } else { Outcome::Fine })
    }
}
