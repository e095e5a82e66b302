//! `charcloth render`: draws frames of a run again, with another look, size or camera.

use super::{Outcome, Run, run::looks};
use crate::files::Files;
use crate::film::{Film, Shot};
use crate::frames::{CameraChange, Frames, parse_size};
use crate::{interrupt, run_folder};
use anyhow::{Context, bail};
use charcloth::contact::scenery::Scenery;
use charcloth::scene::Scene;
use charcloth_io::cache::CacheReader;
use charcloth_io::scene_file::{Case, load};
use clap::Args;
use indicatif::ProgressBar;
use std::path::PathBuf;

/// What to draw, and how.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder of a run
    cache: PathBuf,
    /// Look [default: that of the scene]
    #[arg(long, value_name = "LOOK", value_parser = looks())]
    style: Option<String>,
    /// One frame, as a PNG
    #[arg(long, value_name = "N", conflicts_with = "frames")]
    frame: Option<u32>,
    /// Frames of the movie, first and last [default: all]
    #[arg(long, value_name = "A..B")]
    frames: Option<Frames>,
    /// Width and height in pixels [default: those of the scene]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Camera as azimuth,elevation,zoom, such as "30deg,10deg,1.5"; what is left out stays
    #[arg(long, value_name = "A,E,Z", allow_hyphen_values = true)]
    camera: Option<CameraChange>,
    /// File to write [default: frame_00048.png or render.mp4 in the folder of the run]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What the sheet of a run meets.
fn scenery(case: &Case) -> anyhow::Result<Scenery> {
    if case.scene.obstacle.is_empty() {
        return Ok(Scenery::default());
    }
    Ok(Scenery::of(&case.scene, &case.read_inputs(&Files)?.0)?)
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        let cache = CacheReader::open(&self.cache)?;
        let folder = cache.folder().parent().map_or_else(PathBuf::new, PathBuf::from);
        let (mut scene, scenery) = match folder.join(run_folder::SCENE) {
            path if path.is_file() => {
                let case = load(&path, &[])?.cases.swap_remove(0);
                let scenery = scenery(&case).unwrap_or_else(|error| {
                    eprintln!("obstacles are not drawn: {error:#}");
                    Scenery::default()
                });
                (case.scene, scenery)
            }
            _ => (Scene::default(), Scenery::default()), // a cache on its own: the default camera
        };
        scene.time.fps = if cache.meta().fps > 0.0 { cache.meta().fps } else { scene.time.fps };
        scene.output.size = self.size.unwrap_or(scene.output.size);
        if let Some(change) = self.camera {
            change.apply(&mut scene.output.camera);
        }
        let shot = Shot { scene, scenery, look: self.style };

        let there = cache.frames()?;
        let Some(first) = there.first() else { bail!("{} has no frames yet", self.cache.display()) };
        let start = cache.frame(*first)?;
        if let Some(number) = self.frame {
            let frame = cache.frame(number)?;
            let path = self.output.unwrap_or_else(|| folder.join(format!("frame_{number:05}.png")));
            Film::build(&shot, &start, None)?.still(&frame, &path)?;
            println!("{}", path.display());
            return Ok(Outcome::Fine);
        }
        let range = self.frames.map_or(0..=u32::MAX, Frames::range);
        let wanted: Vec<u32> = there.iter().copied().filter(|number| range.contains(number)).collect();
        if wanted.is_empty() {
            bail!("none of these frames is there; there are frames {first} to {}", there[there.len() - 1]);
        }
        let path = self.output.unwrap_or_else(|| folder.join("render.mp4"));
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mp4")) {
            bail!("{} is to hold several frames: name an .mp4, or one frame with --frame", path.display());
        }
        interrupt::watch()?;
        let mut film = Film::build(&shot, &start, Some(&path))?;
        let bar = ProgressBar::new(wanted.len() as u64);
        for number in &wanted {
            film.frame(&cache.frame(*number)?, None)?;
            bar.inc(1);
            if interrupt::asked_to_stop() {
                break;
            }
        }
        bar.finish_and_clear();
        let movie = film.finish()?.context("there is no movie")?;
        println!("{}", movie.display());
        Ok(Outcome::Fine)
    }
}
