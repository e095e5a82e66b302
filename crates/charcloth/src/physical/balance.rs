//! What the books of heat and mass must come to.

use super::{Physical, masses};
use crate::sheet::{FaceNodes, SheetState};

impl Physical {
    /// Heat in the sheet, over 25 degC [J].
    pub fn heat_content(&self, state: &SheetState) -> f64 {
        let of = |face: &FaceNodes| -> f64 {
            (0..face.len()).map(|i| self.chemistry.sensible_heat(&masses(face, i), face.temperature[i])).sum()
        };
        of(&state.front) + of(&state.back)
    }

    /// Heat that the books cannot account for, as a part of all that was there and has been exchanged.
    pub fn energy_error(&self, state: &SheetState) -> f64 {
        let books = &state.books;
        let exchanged = [
            books.heat_from_gas[0],
            books.heat_from_heaters[0],
            books.heat_of_drying[0],
            books.heat_of_pyrolysis[0],
            books.heat_of_oxidation[0],
            -books.heat_carried[0],
            -books.heat_to_board[0],
        ];
        let change = self.heat_content(state) - books.heat_initial[0];
        let size: f64 = exchanged.iter().map(|heat| heat.abs()).sum();
        let size = size + books.heat_initial[0].abs();
        (change - exchanged.iter().sum::<f64>()).abs() / size.max(f64::MIN_POSITIVE)
    }

    /// Mass that the books cannot account for, as a part of that at the start.
    pub fn mass_error(&self, state: &SheetState) -> f64 {
        let books = &state.books;
        let now: f64 = state.burn.mass.iter().sum();
        let left = books.volatiles[0] + books.steam[0] + books.oxides[0] - books.oxygen_taken[0];
        (now + left - books.mass_initial[0]).abs() / books.mass_initial[0].max(f64::MIN_POSITIVE)
    }

    /// Heat that a mass of fuel gas gives [J/kg].
    pub fn heat_of_combustion(&self) -> f64 {
        self.heat_of_combustion
    }
}
