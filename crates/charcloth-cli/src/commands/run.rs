//! `charcloth run`: simulates a scene and leaves frames, time history, pictures and a summary.

use super::{Outcome, Run};
use crate::files::Files;
use crate::film::Shot;
use crate::frames::Frames;
use crate::preview::{Pictures, Plan, Preview};
use crate::progress::{Report, Style, tell};
use crate::recorder::Recorder;
use crate::run_folder::{self, human_bytes, human_time};
use crate::{interrupt, scenes};
use anyhow::{Context, bail};
use charcloth::contact::scenery::Scenery;
use charcloth::scene::Output;
use charcloth::simulation::Simulation;
use charcloth_io::cache::{CacheWriter, RunInfo};
use charcloth_io::scene_file::{Case, load};
use charcloth_render::LOOKS;
use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What to burn, where to, how.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Scene file or built-in scene [default: a4]; with --resume, the folder of the run
    scene: Option<String>,
    /// Folder for the run [default: runs/SCENE, numbered on where that is taken]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Change a key of the scene, such as sheet.spacing=2mm or pin.0.radius=5mm
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "resume")]
    overrides: Vec<String>,
    /// Case of a file that has several
    #[arg(long, value_name = "NAME", conflicts_with = "resume")]
    case: Option<String>,
    /// Last frame, or the frames to film: 96 or 24..96
    #[arg(long, value_name = "A..B")]
    frames: Option<Frames>,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Go on with a run that was stopped, or make it longer with --frames
    #[arg(long)]
    resume: bool,
    /// Replace the run in the folder
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Look of the pictures [default: that of the scene]
    #[arg(long, value_name = "LOOK", value_parser = looks())]
    style: Option<String>,
    /// Make no movie
    #[arg(long)]
    no_movie: bool,
    /// How to say how far it is: words, or json for programs, one object a line
    #[arg(
        long,
        value_name = "HOW",
        value_enum,
        default_value_t,
        conflicts_with = "quiet",
        hide_possible_values = true
    )]
    progress: Style,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// The names of the looks, for clap to check and suggest.
pub(super) fn looks() -> PossibleValuesParser {
    PossibleValuesParser::new(LOOKS.iter().map(|row| row.name))
}

/// Sets how many threads work.
pub(super) fn set_threads(threads: Option<u16>) -> anyhow::Result<()> {
    let threads = threads.map_or(0, usize::from); // 0 leaves it to rayon
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start threads")
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        set_threads(self.threads)?;
        let (mut case, folder) = if self.resume { self.stopped_run()? } else { self.fresh_run()? };
        if let Some(last) = self.frames.and_then(|frames| frames.last) {
            case.scene.time.frames = last;
        }
        let scene = &case.scene;
        let (inputs, mut warnings) = case.read_inputs(&Files)?;
        let info = RunInfo { scene: scene.name.clone(), fps: scene.time.fps, up: scene.up };

        let (mut simulation, cache, resumed_from) = if self.resume {
            let (cache, checkpoint) = CacheWriter::resume(&folder, &info)?;
            if checkpoint.frame > scene.time.frames {
                bail!("the run has reached frame {} already; ask for more with --frames", checkpoint.frame);
            }
            let simulation =
                Simulation::resume(scene, &inputs, checkpoint.state).map_err(|error| case.explain(&error))?;
            (simulation, cache, Some(checkpoint.frame))
        } else {
            // Built before anything is written: a scene that cannot be simulated leaves no folder behind.
            let simulation = Simulation::build(scene, &inputs).map_err(|error| case.explain(&error))?;
            std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
            if self.force {
                run_folder::clear(&folder)?;
            }
            (simulation, CacheWriter::create(&folder, &info)?, None)
        };
        run_folder::save_scene(&folder, scene)?;
        warnings.extend(simulation.warnings().iter().cloned());
        let last = scene.time.frames;
        self.introduce(&case, &simulation, &folder, resumed_from, &warnings);

        interrupt::watch()?;
        let scenery = Scenery::of(&case.scene, &inputs).map_err(|error| case.explain(&error))?;
        let preview = self.preview(&case, scenery, &folder, resumed_from)?;
        let first = resumed_from.map_or(0, |frame| frame + 1);
        let report = self.report();
        let mut recorder = Recorder::new(cache, preview, first, last, report);
        let simulated = simulation.run(last, &mut recorder);
        let (cached, pictures) = recorder.close();

        let mut summary = simulation.summary();
        for warning in warnings {
            if !summary.warnings.contains(&warning) {
                summary.warnings.push(warning);
            }
        }
        summary.warnings.extend(simulated.as_ref().err().map(ToString::to_string));
        let pictures = pictures.unwrap_or_else(|error| {
            let warning = format!("no pictures: {error:#}");
            report.warn(&warning);
            summary.warnings.push(warning);
            Pictures::default()
        });
        let text = serde_json::to_string_pretty(&summary)? + "\n";
        let saved = run_folder::write_whole(&folder.join(run_folder::SUMMARY), text.as_bytes());
        // What went wrong first is told; the rest follows from it.
        if let Err(error) = simulated {
            bail!(
                "{error}{}",
                recorder
                    .last_frame
                    .map_or(String::new(), |frame| { format!("\n{} has frames 0 to {frame}", folder.display()) })
            );
        }
        cached?;
        saved?;
        if report == Report::Json {
            tell(&json!({
                "event": "end", "frame": recorder.last_frame, "last": last, "stopped": recorder.interrupted,
                "wall_s": summary.wall_s, "burnt_area_fraction": summary.burnt_area_fraction
            }));
        } else if recorder.interrupted {
            eprintln!(
                "stopped after frame {} of {last}; go on with\n\n  charcloth run --resume {}",
                recorder.last_frame.unwrap_or(0),
                folder.display()
            );
        } else if report == Report::Words {
            conclude(&folder, &pictures, summary.wall_s, summary.burnt_area_fraction);
        }
        Ok(Outcome::Fine)
    }
}

impl Arguments {
    fn report(&self) -> Report {
        Report::new(self.progress, self.quiet)
    }

    fn fresh_run(&self) -> anyhow::Result<(Case, PathBuf)> {
        let file = scenes::open(self.scene.as_deref().unwrap_or(scenes::DEFAULT), &self.overrides)?;
        let case = scenes::one_case(file, self.case.as_deref())?;
        let name = match case.name == case.scene.name {
            true => case.name.clone(),
            false => format!("{}-{}", case.scene.name, case.name),
        };
        let folder = run_folder::choose(self.output.clone(), &name, self.force)?;
        Ok((case, folder))
    }

    /// The run to go on with: a folder, or the last one of a scene.
    fn stopped_run(&self) -> anyhow::Result<(Case, PathBuf)> {
        let name = self.scene.as_deref().unwrap_or(scenes::DEFAULT);
        let folder = match &self.output {
            Some(folder) => folder.clone(),
            None if Path::new(name).is_dir() => PathBuf::from(name),
            None => latest_run(name),
        };
        let path = folder.join(run_folder::SCENE);
        if !path.is_file() {
            bail!("{} holds no run to go on with; name its folder: charcloth run --resume DIR", folder.display());
        }
        let case = scenes::one_case(load(&path, &[])?, None)?;
        Ok((case, folder))
    }

    fn introduce(
        &self,
        case: &Case,
        simulation: &Simulation,
        folder: &Path,
        resumed_from: Option<u32>,
        warnings: &[String],
    ) {
        let report = self.report();
        for warning in warnings {
            report.warn(warning);
        }
        let last = case.scene.time.frames;
        let frame = simulation.frame();
        match report {
            Report::Nobody => return,
            Report::Json => {
                return tell(&json!({
                    "event": "start", "scene": case.name, "folder": folder, "nodes": frame.motion.len(), "last": last,
                    "resumed_from": resumed_from
                }));
            }
            Report::Words => {}
        }
        let frames_left = u64::from(last.saturating_sub(resumed_from.unwrap_or(0))) + 1;
        let disk = human_bytes(run_folder::frame_bytes(&frame) * frames_left);
        let about = if case.scene.about.is_empty() { String::new() } else { format!(": {}", case.scene.about) };
        println!("{}{about}", case.name);
        let from = resumed_from.map_or(String::new(), |frame| format!(", going on from frame {frame}"));
        println!("{} nodes, {last} frames{from}, at most {disk} of disk in {}", frame.motion.len(), folder.display());
    }

    fn preview(
        &self,
        case: &Case,
        scenery: Scenery,
        folder: &Path,
        resumed_from: Option<u32>,
    ) -> anyhow::Result<Option<Preview>> {
        let last = case.scene.time.frames;
        let stills = chosen_stills(&case.scene.output, last);
        if self.no_movie && stills.is_empty() {
            return Ok(None);
        }
        let plan = Plan {
            folder: folder.to_owned(),
            shot: Shot { scene: case.scene.clone(), scenery, look: self.style.clone() },
            movie: !self.no_movie,
            movie_from: self.frames.filter(|frames| !frames.single).and_then(|frames| frames.first).unwrap_or(0),
            stills,
            resumed_from,
        };
        Preview::start(plan).map(Some)
    }
}

/// Which frames are kept as stills: those the scene names, or five spread over the run.
fn chosen_stills(output: &Output, last: u32) -> BTreeSet<u32> {
    match &output.stills {
        Some(stills) => stills.iter().copied().collect(),
        None => (0..5).map(|k| (u64::from(last) * k / 4) as u32).collect(),
    }
}

/// The highest numbered folder of a scene's runs.
fn latest_run(name: &str) -> PathBuf {
    let first = Path::new("runs").join(Path::new(name).file_stem().unwrap_or_default());
    let numbered =
        |number: u32| first.with_file_name(format!("{}-{number}", first.file_name().unwrap_or_default().display()));
    (2..).map(numbered).take_while(|folder| folder.exists()).last().unwrap_or(first)
}

fn conclude(folder: &Path, pictures: &Pictures, wall: f64, burnt: f64) {
    println!("burnt {:.0} % of the sheet; simulated in {}", burnt * 100.0, human_time(wall));
    println!("frames   {}", folder.join("cache").display());
    println!("numbers  {} and history.csv", folder.join(run_folder::SUMMARY).display());
    if let (Some(first), Some(last)) = (pictures.stills.first(), pictures.stills.last()) {
        println!("stills   {} to {}", first.display(), last.file_name().unwrap_or_default().display());
    }
    if let Some(movie) = &pictures.movie {
        println!("movie    {}", movie.display());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_stills_are_spread_over_the_run() {
        let chosen = |last| chosen_stills(&Output::default(), last).into_iter().collect::<Vec<_>>();
        assert_eq!(chosen(192), [0, 48, 96, 144, 192]);
        assert_eq!(chosen(1), [0, 1]);
        let named = Output { stills: Some(vec![7, 3]), ..Output::default() };
        assert_eq!(chosen_stills(&named, 9).into_iter().collect::<Vec<_>>(), [3, 7]);
    }
}
