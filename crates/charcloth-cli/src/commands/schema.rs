//! `charcloth schema`: the JSON Schema of scene files, by which editors check and complete them.

use super::{Outcome, Run};
use clap::Args;
use std::io::Write;

/// Takes nothing.
#[derive(Debug, Args)]
#[command(after_help = "Save it beside a scene and begin the scene with `#:schema ./charcloth.schema.json`: \
                        Even Better TOML and Taplo read that.")]
pub struct Arguments {}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        std::io::stdout().write_all(charcloth_io::scene_file::schema().as_bytes())?;
        Ok(Outcome::Fine)
    }
}
