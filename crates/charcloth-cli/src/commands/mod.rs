//! The sub-commands: one file each, one row each.

mod bench;
mod check;
mod export;
mod fuzz;
mod import_check;
mod list;
mod new;
mod render;
mod run;
mod schema;

use charcloth::registry::Entry;
use clap::{ArgMatches, Args, Command};

/// How a command ended, if not with an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All is well.
    Fine,
    /// A check failed.
    CheckFailed,
}

/// A sub-command: the arguments it takes and what it does with them.
#[derive(Debug)]
pub struct Subcommand {
    /// Adds its arguments.
    pub arguments: fn(Command) -> Command,
    /// Runs it.
    pub run: fn(&ArgMatches) -> anyhow::Result<Outcome>,
}

/// What each file of this folder has: arguments that can be run.
trait Run: Args {
    fn run(self) -> anyhow::Result<Outcome>;
}

const fn subcommand<T: Run>() -> Subcommand {
    Subcommand { arguments: T::augment_args, run: |matches| T::from_arg_matches(matches)?.run() }
}

/// Every sub-command, in the order of the help.
pub const COMMANDS: &[Entry<Subcommand>] = &[
    Entry { name: "run", about: "Simulate a scene: frames, time history, movie", item: subcommand::<run::Arguments>() },
    Entry { name: "render", about: "Draw frames of a run again", item: subcommand::<render::Arguments>() },
    Entry {
        name: "export",
        about: "Write frames of a run for other programs",
        item: subcommand::<export::Arguments>(),
    },
    Entry {
        name: "import-check",
        about: "Look at a mesh file before burning it",
        item: subcommand::<import_check::Arguments>(),
    },
    Entry {
        name: "check",
        about: "Run scenes and compare with what they expect",
        item: subcommand::<check::Arguments>(),
    },
    Entry { name: "new", about: "Start a scene of your own", item: subcommand::<new::Arguments>() },
    Entry { name: "list", about: "List what can be chosen by name", item: subcommand::<list::Arguments>() },
    Entry {
        name: "schema",
        about: "Print the JSON Schema of scenes, for editors",
        item: subcommand::<schema::Arguments>(),
    },
    Entry {
        name: "bench",
        about: "Time the stages of a simulation, writing nothing",
        item: subcommand::<bench::Arguments>(),
    },
    Entry {
        name: "fuzz",
        about: "Run random scenes to their end, and tell what went wrong",
        item: subcommand::<fuzz::Arguments>(),
    },
];

#[cfg(test)]
mod tests {
    use super::COMMANDS;
    use std::collections::BTreeSet;

    #[test]
    fn the_folder_and_the_table_agree() {
        let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/src/commands")).unwrap();
        let files: BTreeSet<String> = folder
            .map(|entry| entry.unwrap().file_name().into_string().unwrap().trim_end_matches(".rs").to_owned())
            .filter(|name| name != "mod")
            .collect();
        let table: BTreeSet<String> = COMMANDS.iter().map(|row| row.name.replace('-', "_")).collect();
        assert_eq!(files, table);
        assert_eq!(table.len(), COMMANDS.len(), "a name is there twice");
    }
}
