//! `charcloth list`: what can be chosen by name, read from the tables themselves.

use super::{Outcome, Run};
use crate::scenes::SCENES;
use charcloth::effects::EFFECTS;
use charcloth::gases::GASES;
use charcloth::integrators::INTEGRATORS;
use charcloth::measure::MEASURES;
use charcloth::registry::Entry;
use charcloth_io::exporters::EXPORTERS;
use charcloth_io::importers::IMPORTERS;
use charcloth_io::material_file::MATERIALS;
use charcloth_render::LOOKS;
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::io::Write;

/// Name and one line about each row of a table.
type Lines = Vec<(&'static str, &'static str)>;

fn lines<T>(table: &'static [Entry<T>]) -> Lines {
    table.iter().map(|row| (row.name, row.about)).collect()
}

/// Every table there is, in the order of printing. A new table is one row here.
const LISTS: &[Entry<fn() -> Lines>] = &[
    Entry { name: "scenes", about: "built-in scenes, for `charcloth run NAME`", item: || lines(SCENES) },
    Entry { name: "effects", about: "what acts on the sheet, switched by the scene", item: || lines(EFFECTS) },
    Entry {
        name: "integrators",
        about: "ways to move the sheet, for mechanics.integrator",
        item: || lines(INTEGRATORS),
    },
    Entry { name: "materials", about: "what a sheet is made of, for sheet.material", item: || lines(MATERIALS) },
    Entry {
        name: "gases",
        about: "what surrounds the sheet in the physical model, for fire.gas",
        item: || lines(GASES),
    },
    Entry { name: "measures", about: "what a [[probe]] can measure", item: || lines(MEASURES) },
    Entry { name: "looks", about: "ways to draw, for --style", item: || lines(LOOKS) },
    Entry { name: "formats", about: "files written, for `charcloth export --format`", item: || lines(EXPORTERS) },
    Entry { name: "meshes", about: "mesh files read, for sheet.mesh", item: || lines(IMPORTERS) },
];

/// Which table.
#[derive(Debug, Args)]
pub struct Arguments {
    /// One table only
    #[arg(value_name = "TABLE", value_parser = PossibleValuesParser::new(LISTS.iter().map(|row| row.name)))]
    table: Option<String>,
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        let mut out = std::io::stdout().lock();
        for list in LISTS.iter().filter(|list| self.table.as_deref().is_none_or(|name| name == list.name)) {
            if self.table.is_none() {
                writeln!(out, "{}: {}", list.name, list.about)?;
            }
            let rows = (list.item)();
            let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
            for (name, about) in rows {
                writeln!(out, "  {name:width$}  {about}")?;
            }
        }
        Ok(Outcome::Fine)
    }
}
