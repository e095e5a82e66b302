//! `charcloth export`: frames of a run as files for other programs.

use super::{Outcome, Run};
use crate::frames::Frames;
use crate::interrupt;
use crate::progress::{Style, tell};
use anyhow::Context;
use charcloth::units::Length;
use charcloth_io::cache::CacheReader;
use charcloth_io::exporters::{EXPORTERS, ExportOptions, Exported, export};
use clap::Args;
use clap::builder::PossibleValuesParser;
use indicatif::ProgressBar;
use serde_json::json;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// What to write, and where to.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder of a run
    cache: PathBuf,
    /// Format; `charcloth list formats` says what each carries
    #[arg(long, value_name = "FORMAT", value_parser = PossibleValuesParser::new(EXPORTERS.iter().map(|row| row.name)))]
    format: String,
    /// First and last frame [default: all]; others of an earlier export in the folder are removed
    #[arg(long, value_name = "A..B")]
    frames: Option<Frames>,
    /// Folder to write into [default: a folder named as the format in that of the run]
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Width and height of maps, in texels
    #[arg(long, value_name = "N", default_value_t = ExportOptions::default().resolution)]
    resolution: u32,
    /// How far maps go beyond the borders of the texture's patches, in texels
    #[arg(long, value_name = "N", default_value_t = ExportOptions::default().gutter)]
    gutter: u32,
    /// Side of the voxels of flames
    #[arg(long, value_name = "LENGTH", default_value = "2mm", value_parser = Length::parse)]
    voxel: Length,
    /// Velocities from frame to frame, not of the moment: motion blur without the trembling of the sheet within a frame
    #[arg(long)]
    mean_velocities: bool,
    /// Replace files in the folder that no export wrote
    #[arg(long)]
    force: bool,
    /// How to say how far it is: words, or json for programs, one object a line
    #[arg(long, value_name = "HOW", value_enum, default_value_t, hide_possible_values = true)]
    progress: Style,
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        let cache = CacheReader::open(&self.cache)?;
        let folder = self.output.unwrap_or_else(|| cache.folder().with_file_name(&self.format));
        let options = ExportOptions {
            frames: self.frames.map(Frames::range),
            resolution: self.resolution,
            gutter: self.gutter,
            voxel: self.voxel.0,
            mean_velocities: self.mean_velocities,
            force: self.force,
        };
        interrupt::watch()?;
        let json = self.progress == Style::Json;
        let bar = if json { ProgressBar::hidden() } else { ProgressBar::new(0) };
        let mut progress = |now: charcloth_io::exporters::Progress<'_>| {
            bar.set_length(now.total as u64);
            bar.set_position(now.done as u64);
            if json {
                tell(&json!({ "event": "frame", "done": now.done, "total": now.total }));
            }
            if interrupt::asked_to_stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let Exported { files: written, removed } = export(&cache, &self.format, &options, &folder, &mut progress)?;
        bar.finish_and_clear();
        let first = written.first().context("nothing was written")?;
        if json {
            tell(
                &json!({ "event": "end", "files": &written, "removed": removed, "stopped": interrupt::asked_to_stop() }),
            );
        } else {
            println!("{} files from {}", written.len(), first.display());
            if removed > 0 {
                println!("{removed} files of an earlier export removed");
            }
        }
        Ok(Outcome::Fine)
    }
}
