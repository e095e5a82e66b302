//! Air in which nothing burns.
//!
//! Model: Eq. 14.12 and 14.13 without a flame. Source: [Churchill1975]. Valid when: there is no flame, or none is
//! wanted. Cost: one pass over the nodes that are awake.

use super::properties::STEFAN_BOLTZMANN;
use super::{FACES, FaceExchange, FaceView, Gas, GasBooks, GasState, SheetView, Surroundings, boundary_layer};

/// Convection and radiation to a room.
#[derive(Debug, Clone, Copy, Default)]
pub struct StillAir;

impl Gas for StillAir {
    fn advance(
        &mut self,
        sheet: &SheetView<'_>,
        faces: &FaceView<'_>,
        surroundings: &Surroundings,
        _dt: f64,
        _state: &mut GasState,
        exchange: &mut FaceExchange,
    ) {
        exchange.fit(sheet.area.len());
        let table = boundary_layer::PlainTable::of(surroundings);
        let mut books = GasBooks::default();
        for face in 0..FACES {
            for i in sheet.awake {
                let i = *i as usize;
                let answer = plain(faces, surroundings, &table, face, i);
                let area = sheet.area[i];
                exchange.heat_flux[face][i] = answer.convection - answer.radiation;
                exchange.heat_flux_slope[face][i] = answer.slope;
                exchange.surface_oxygen[face][i] = surroundings.oxygen * faces.open[face][i];
                exchange.oxygen_supply[face][i] = answer.oxygen_supply;
                exchange.flame[face][i] = 0.0;
                exchange.standoff[face][i] = 0.0;
                exchange.flame_height[face][i] = 0.0;
                exchange.velocity[face][i] = surroundings.wind;
                books.fuel_in += area * faces.volatile_flux[face][i];
                books.heat_to_sheet += area * answer.convection;
                books.heat_radiated += area * answer.radiation;
            }
        }
        books.fuel_left = books.fuel_in;
        books.heat_to_surroundings = -books.heat_to_sheet;
        exchange.books = books;
    }
}

/// What a face without a flame gets [W/m2], [W/(m2 K)], [kg/(m2 s)].
pub(super) struct Plain {
    pub convection: f64,
    pub radiation: f64,
    pub slope: f64,
    pub oxygen_supply: f64,
}

/// A face without a flame.
#[inline]
pub(super) fn plain(
    faces: &FaceView<'_>,
    surroundings: &Surroundings,
    table: &boundary_layer::PlainTable,
    face: usize,
    i: usize,
) -> Plain {
    let (temperature, open) = (faces.temperature[face][i], faces.open[face][i]);
    let ambient = surroundings.temperature;
    let coefficient = open * table.at(temperature);
    let emissive = open * faces.emissivity * STEFAN_BOLTZMANN;
    Plain {
        convection: coefficient * (ambient - temperature),
        radiation: emissive * (temperature.powi(4) - ambient.powi(4)),
        slope: -coefficient - 4.0 * emissive * temperature.powi(3),
        oxygen_supply: coefficient / 1050.0 * super::properties::oxygen_mass_fraction(surroundings.oxygen),
    }
}
