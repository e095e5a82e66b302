//! The books: mass and energy balance, and the first number that is not finite.

use crate::error::Error;
use crate::sheet::SheetState;
use crate::thermo::Burning;

/// Part of the fuel at the start that the books cannot account for.
pub fn mass_error(state: &SheetState) -> f64 {
    let initial: f64 = state.burn.fuel_initial.iter().sum();
    let left: f64 = state.burn.fuel.iter().sum();
    ((left + state.books.fuel_burnt[0]) - initial).abs() / initial.max(f64::MIN_POSITIVE)
}

/// Heat that the books cannot account for, as a part of the heat that has gone in; none where heat is not conserved.
pub fn energy_error(state: &SheetState, burning: &Burning) -> Option<f64> {
    if !burning.conserves_energy() {
        return None;
    }
    let books = &state.books;
    let went_in = books.heat_initial[0] + books.heat_released[0] + books.heat_of_ignition[0];
    let went_out = books.heat_lost[0] + books.heat_carried[0];
    let is_there = burning.heat_content(&state.burn);
    Some((is_there + went_out - went_in).abs() / went_in.abs().max(f64::MIN_POSITIVE))
}

/// Temperature that no flame has [K]: a run that gets there has left the ground of its models, though it may still count.
const NO_FLAME: f64 = 1e5;

/// Stops the run where a state column holds a number that is not finite, or a temperature that is no temperature, at the
/// end of the frame it came up in.
pub fn check_finite(state: &SheetState, cause: impl Fn(&str) -> String) -> Result<(), Error> {
    for (_, columns) in state.tables() {
        for column in columns {
            let limit = if column.unit == "K" { NO_FLAME } else { f64::INFINITY };
            if let Some(node) = column.data.first_beyond(limit) {
                return Err(Error::NotFinite {
                    field: column.name,
                    node,
                    time: state.books.time[0],
                    frame: state.books.frame[0],
                    cause: cause(column.name),
                });
            }
        }
    }
    Ok(())
}
