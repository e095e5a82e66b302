//! The `charcloth` command: simulates, films, exports and checks burning sheets.
//!
//! Each sub-command is a file in [`commands`] and a row of its table. What they share: [`scenes`] finds scenes by name
//! or path, [`files`] reads what a scene names, [`run_folder`] is the layout of a run on disk, [`recorder`] takes the
//! frames of a run, [`preview`] and [`film`] draw them, [`progress`]
//! says how far it is, [`frames`] is how frames are named on the command line.

mod commands;
mod files;
mod film;
mod frames;
mod interrupt;
mod preview;
mod progress;
mod recorder;
mod run_folder;
mod scenes;

use charcloth_io::scene_file::SceneError;
use clap::Command;
use commands::{COMMANDS, Outcome};
use std::io::IsTerminal;
use std::process::ExitCode;

/// The command line as clap knows it, one sub-command a row of the table.
fn command_line() -> Command {
    let command = Command::new("charcloth")
        .version(env!("CARGO_PKG_VERSION"))
        .about("Burns sheets of paper and cloth: simulation, pictures, exports and checks.")
        .after_help(
            "First steps: `charcloth run` burns a sheet of A4; `charcloth new my_scene` starts one of your own.",
        )
        .subcommand_required(true)
        .arg_required_else_help(true);
    COMMANDS
        .iter()
        .fold(command, |command, row| command.subcommand((row.item.arguments)(Command::new(row.name).about(row.about))))
}

fn main() -> ExitCode {
    let matches = command_line().get_matches();
    let Some((name, matches)) = matches.subcommand() else { return ExitCode::from(2) };
    let Some(row) = COMMANDS.iter().find(|row| row.name == name) else { return ExitCode::from(2) };
    match (row.item.run)(matches) {
        Ok(Outcome::Fine) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        // `charcloth list | head` closes the pipe: nobody is left to tell.
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}", describe(&error));
            ExitCode::from(2)
        }
    }
}

/// An error as the user sees it; in colour where a terminal shows it.
fn describe(error: &anyhow::Error) -> String {
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let head = if colour { "\x1b[1;31merror\x1b[0m" } else { "error" };
    match error.downcast_ref::<SceneError>() {
        Some(scene) => format!("{head}: {}", scene.render(colour)),
        None => format!("{head}: {error:#}"),
    }
}

fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<std::io::Error>())
        .any(|cause| cause.kind() == std::io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_line_is_consistent() {
        super::command_line().debug_assert();
    }
}
