//! `charcloth check`: runs scenes and compares what comes out with what they expect.

use super::{Outcome, Run, run::set_threads};
use crate::files::Files;
use crate::scenes::{self, SCENES, VERIFICATION};
use anyhow::{Context, bail};
use charcloth::check::{self, CheckRow};
use charcloth::error::Error;
use charcloth::scene::Scene;
use charcloth_io::scene_file::{Case, SceneFile};
use clap::Args;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::io::Write;
use std::path::Path;
use std::sync::mpsc::channel;

/// What to check.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Scene files, folders of them, or built-in scenes [default: the built-in verification scenes]
    scenes: Vec<String>,
    /// Change a key of every scene, such as mechanics.integrator=xpbd
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Apply the `falsify` overrides of the scenes and demand that at least one check of each case fails
    #[arg(long)]
    falsify: bool,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

/// A case to run, with what is printed above its rows.
struct Task {
    title: String,
    case: Case,
}

/// What a case came to.
type Verdict = anyhow::Result<Vec<CheckRow>>;

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        set_threads(self.threads)?;
        let tasks = self.tasks()?;
        let mut out = std::io::stdout().lock();
        let mut count = Count::default();
        let (send, receive) = channel();
        std::thread::scope(|scope| -> anyhow::Result<()> {
            let tasks = &tasks;
            let numbers: Vec<usize> = (0..tasks.len()).collect();
            scope.spawn(move || {
                numbers.par_iter().for_each_with(send, |send, number| {
                    // Nobody listens any more where printing has failed; that error is told.
                    let _ = send.send((*number, verdict(&tasks[*number].case, self.falsify)));
                });
            });
            // Cases end in any order and are printed in theirs.
            let mut waiting: Vec<Option<Verdict>> = tasks.iter().map(|_| None).collect();
            let mut next = 0;
            for (number, verdict) in receive {
                waiting[number] = Some(verdict);
                while let Some(verdict) = waiting.get_mut(next).and_then(Option::take) {
                    writeln!(out, "{}", tasks[next].title)?;
                    print_verdict(&mut out, verdict, self.falsify, &mut count)?;
                    next += 1;
                }
            }
            Ok(())
        })?;
        writeln!(out, "{} passed, {} failed", count.passed, count.failed)?;
        out.flush()?;
        if count.errors > 0 {
            bail!("{} of {} cases could not be run", count.errors, tasks.len());
        }
        Ok(if count.failed > 0 { Outcome::CheckFailed } else { Outcome::Fine })
    }
}

impl Arguments {
    fn tasks(&self) -> anyhow::Result<Vec<Task>> {
        let mut names = Vec::new();
        for scene in &self.scenes {
            match Path::new(scene).is_dir() {
                true => collect(Path::new(scene), &mut names)?,
                false => names.push(scene.clone()),
            }
        }
        if self.scenes.is_empty() {
            names.extend(SCENES.iter().map(|row| row.name.to_owned()).filter(|name| name.starts_with(VERIFICATION)));
        }
        if names.is_empty() {
            bail!("there is no scene to check; name scene files or folders that hold *.toml");
        }
        let mut tasks = Vec::new();
        for name in names {
            let SceneFile { cases, .. } = scenes::open(&name, &self.overrides)?;
            let several = cases.len() > 1;
            let mut any = false;
            for case in cases {
                if !case.has_checks() {
                    bail!("{name}: {} expects nothing; add [[expect]] rows to check it", case.name);
                }
                if self.falsify && case.falsified.is_none() {
                    continue;
                }
                any = true;
                let title = if several { format!("{name}: {}", case.name) } else { name.clone() };
                tasks.push(Task { title, case });
            }
            if !any {
                bail!("{name} has no `falsify`; add the overrides under which its checks must fail");
            }
        }
        Ok(tasks)
    }
}

/// Every scene file in a folder and those inside, by name.
fn collect(folder: &Path, names: &mut Vec<String>) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            collect(&path, names)?;
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            names.push(path.display().to_string());
        }
    }
    Ok(())
}

fn verdict(case: &Case, falsify: bool) -> Verdict {
    let scene: &Scene = if falsify { case.falsified.as_ref().context("there is no `falsify`")? } else { &case.scene };
    let (inputs, _) = case.read_inputs_of(scene, &Files)?;
    match check::run(scene, &inputs) {
        // A falsified run that blows up has been caught, too.
        Err(error @ Error::NotFinite { .. }) if falsify => Ok(vec![CheckRow {
            quantity: "finite state".to_owned(),
            expected: "finite".to_owned(),
            got: f64::NAN,
            error: f64::NAN,
            tolerance: 0.0,
            source: error.to_string(),
            pass: false,
        }]),
        result => Ok(result.map_err(|error| case.explain(&error))?),
    }
}

#[derive(Default)]
struct Count {
    passed: usize,
    failed: usize,
    errors: usize,
}

impl Count {
    fn add(&mut self, pass: bool) {
        if pass { self.passed += 1 } else { self.failed += 1 }
    }
}

fn print_verdict(out: &mut impl Write, verdict: Verdict, falsify: bool, count: &mut Count) -> anyhow::Result<()> {
    match verdict {
        Err(error) => {
            count.add(false);
            count.errors += 1;
            writeln!(out, "  error: {error:#}")?;
        }
        Ok(rows) if falsify => {
            print_rows(out, &rows)?;
            let caught = rows.iter().any(|row| !row.pass);
            count.add(caught);
            writeln!(out, "  {}", if caught { "caught, as it must be" } else { "NOT CAUGHT: every check passed" })?;
        }
        Ok(rows) => {
            print_rows(out, &rows)?;
            rows.iter().for_each(|row| count.add(row.pass));
        }
    }
    Ok(())
}

/// A table, its columns as wide as they must be.
fn print_rows(out: &mut impl Write, rows: &[CheckRow]) -> std::io::Result<()> {
    let number = |value: f64| if value.abs() < 1e-99 { "0".to_owned() } else { format_number(value) };
    let mut table = vec![["", "quantity", "expected", "got", "error", "tolerance", "source"].map(str::to_owned)];
    table.extend(rows.iter().map(|row| {
        [
            if row.pass { "pass" } else { "FAIL" }.to_owned(),
            row.quantity.clone(),
            row.expected.clone(),
            number(row.got),
            number(row.error),
            number(row.tolerance),
            row.source.clone(),
        ]
    }));
    let width = |column: usize| table.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..6).map(width).collect();
    for row in &table {
        write!(out, " ")?;
        for (cell, width) in row.iter().zip(&widths) {
            write!(out, " {cell:width$} ")?;
        }
        writeln!(out, " {}", row[6])?;
    }
    Ok(())
}

/// Six significant digits, in powers of ten where plain digits would be long.
fn format_number(value: f64) -> String {
    let magnitude = value.abs();
    if value.is_finite() && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.4e}");
    }
    let decimals = if value.is_finite() { (5 - magnitude.log10().floor() as i32).clamp(0, 9) as usize } else { 0 };
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pass: bool) -> CheckRow {
        CheckRow {
            quantity: "front_speed".to_owned(),
            expected: "0.0027".to_owned(),
            got: 0.002_712_3,
            error: 1.2e-5,
            tolerance: 1e-4,
            source: "Eq. 3".to_owned(),
            pass,
        }
    }

    #[test]
    fn rows_are_counted_and_printed() {
        let mut out = Vec::new();
        let mut count = Count::default();
        print_verdict(&mut out, Ok(vec![row(true), row(false)]), false, &mut count).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!((count.passed, count.failed), (1, 1));
        for word in ["FAIL", "pass", "front_speed", "0.0027123 ", "1.2000e-5", "Eq. 3"] {
            assert!(text.contains(word), "{word} in {text}");
        }
    }

    #[test]
    fn a_falsified_case_passes_when_a_row_fails() {
        let mut count = Count::default();
        print_verdict(&mut Vec::new(), Ok(vec![row(true), row(false)]), true, &mut count).unwrap();
        print_verdict(&mut Vec::new(), Ok(vec![row(true)]), true, &mut count).unwrap();
        assert_eq!((count.passed, count.failed), (1, 1));
    }

    #[test]
    fn numbers_have_six_digits() {
        let shown = [(1.0, "1"), (-12.5, "-12.5"), (1_234_567.0, "1.2346e6"), (f64::NAN, "NaN")];
        for (value, text) in shown {
            assert_eq!(format_number(value), text);
        }
    }
}
