//! What a run came to.

use super::Simulation;
use crate::counters::peak_memory_bytes;
use crate::fields::Data;
use crate::integrators::symplectic_euler::strains;
use crate::scene::Model;
use crate::{ledger, measure, tear};
use serde::Serialize;
use std::collections::BTreeMap;

/// What a run came to; `summary.json` is this, key for key.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(non_snake_case)] // keys carry their units
#[allow(missing_docs)] // the keys are described in docs/cache.md
pub struct Summary {
    pub version: String,
    pub scene: String,
    pub model: String,
    pub seed: u64,
    pub frames: u32,
    pub nodes: usize,
    pub triangles: usize,
    pub springs: usize,
    pub threads: usize,
    pub time_step_s: f64,
    pub substeps: u32,
    /// Iterations of Newton's method and of the linear solver since the start or the resumption, where motion is implicit.
    pub newton_iterations: u64,
    pub linear_iterations: u64,
    pub wall_s: f64,
    pub stage_wall_s: BTreeMap<String, f64>,
    pub fuel_initial_kg: f64,
    pub fuel_burnt_kg: f64,
    pub heat_released_J: f64,
    /// None where the model has no conserved energy (literal heat capacity).
    pub energy_error: Option<f64>,
    pub mass_error: f64,
    /// Where every joule and every gram went: the books, key by key with its unit, and what is there now.
    pub books: BTreeMap<String, f64>,
    pub burnt_area_fraction: f64,
    pub springs_broken: usize,
    pub pieces: usize,
    pub strain_max: f64,
    pub strain_p99: f64,
    /// Largest distance of a node from the plane the sheet lay in, over the diagonal of the sheet.
    pub out_of_plane: f64,
    /// Length of the longest column of a grid over its length at rest; none for other sheets.
    pub stretch: Option<f64>,
    /// Pairs of triangles that cross each other in the last frame.
    pub intersecting_pairs: usize,
    /// The most at the end of any frame, obstacles among them, and pairs that passed through each other in any step;
    /// none without contact.
    pub intersecting_pairs_max: Option<u32>,
    pub passed_through: Option<u32>,
    pub peak_memory_bytes: u64,
    pub warnings: Vec<String>,
}

impl Summary {
    /// A quantity by its key, where it is a number.
    pub fn value(&self, key: &str) -> Option<f64> {
        Some(match key {
            "frames" => f64::from(self.frames),
            "nodes" => self.nodes as f64,
            "triangles" => self.triangles as f64,
            "springs" => self.springs as f64,
            "time_step_s" => self.time_step_s,
            "substeps" => f64::from(self.substeps),
            "fuel_initial_kg" => self.fuel_initial_kg,
            "fuel_burnt_kg" => self.fuel_burnt_kg,
            "heat_released_J" => self.heat_released_J,
            "energy_error" => self.energy_error?,
            "mass_error" => self.mass_error,
            "burnt_area_fraction" => self.burnt_area_fraction,
            "springs_broken" => self.springs_broken as f64,
            "pieces" => self.pieces as f64,
            "strain_max" => self.strain_max,
            "strain_p99" => self.strain_p99,
            "out_of_plane" => self.out_of_plane,
            "stretch" => self.stretch?,
            "intersecting_pairs" => self.intersecting_pairs as f64,
            "intersecting_pairs_max" => f64::from(self.intersecting_pairs_max?),
            "passed_through" => f64::from(self.passed_through?),
            "newton_iterations" => self.newton_iterations as f64,
            _ => return None,
        })
    }

    /// Keys that are numbers a scene may expect something of.
    pub const NUMBERS: &'static [&'static str] = &[
        "frames",
        "nodes",
        "triangles",
        "springs",
        "time_step_s",
        "substeps",
        "fuel_initial_kg",
        "fuel_burnt_kg",
        "heat_released_J",
        "energy_error",
        "mass_error",
        "burnt_area_fraction",
        "springs_broken",
        "pieces",
        "strain_max",
        "strain_p99",
        "out_of_plane",
        "stretch",
        "intersecting_pairs",
        "intersecting_pairs_max",
        "passed_through",
        "newton_iterations",
    ];
}

impl Simulation {
    /// What the run came to so far.
    pub fn summary(&self) -> Summary {
        let state = &self.built.state;
        let mut all_strains: Vec<f64> = strains(state).collect();
        all_strains.sort_unstable_by(f64::total_cmp);
        let p99 = all_strains.get(all_strains.len().saturating_sub(1) * 99 / 100).copied().unwrap_or(0.0);
        Summary {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: self.scene.name.clone(),
            model: match self.scene.model {
                Model::Moidu2004 => "moidu2004".to_owned(),
                Model::Physical => "physical".to_owned(),
            },
            seed: self.scene.seed,
            frames: self.frame_number(),
            nodes: state.motion.len(),
            triangles: state.triangles.len(),
            springs: state.springs.len(),
            threads: rayon::current_num_threads(),
            time_step_s: self.last_step,
            substeps: self.last.substeps,
            newton_iterations: self.iterations[0],
            linear_iterations: self.iterations[1],
            wall_s: self.wall,
            stage_wall_s: self.stages.seconds(),
            fuel_initial_kg: state.burn.fuel_initial.iter().sum(),
            fuel_burnt_kg: state.books.fuel_burnt[0],
            heat_released_J: state.books.heat_released[0],
            energy_error: match &self.physical {
                Some(physical) => Some(physical.energy_error(state)),
                None => ledger::energy_error(state, &self.burning),
            },
            mass_error: self.physical.as_ref().map_or_else(|| ledger::mass_error(state), |it| it.mass_error(state)),
            books: self.books(),
            burnt_area_fraction: measure::burnt_area_fraction(state),
            springs_broken: state.springs.broken.iter().filter(|b| **b != 0).count(),
            pieces: tear::pieces(state),
            strain_max: state.books.strain_max[0],
            strain_p99: p99,
            out_of_plane: measure::out_of_plane(&self.built),
            stretch: measure::stretch(&self.built),
            intersecting_pairs: measure::intersecting_pairs(state),
            intersecting_pairs_max: self.meets.then(|| state.books.crossings_max[0]),
            passed_through: self.meets.then(|| state.books.passed_through[0]),
            peak_memory_bytes: peak_memory_bytes(),
            warnings: self.warnings.clone(),
        }
    }

    /// Every book that is kept, by its name and unit, and what the sheet holds now.
    fn books(&self) -> BTreeMap<String, f64> {
        let state = &self.built.state;
        let mut books = BTreeMap::new();
        for column in state.books.columns().into_iter().filter(|column| ["J", "kg"].contains(&column.unit)) {
            if let Data::F64(value) = column.data {
                books.insert(format!("{}_{}", column.name, column.unit), value[0]);
            }
        }
        let heat = match &self.physical {
            Some(physical) => physical.heat_content(state),
            None => self.burning.heat_content(&state.burn),
        };
        books.insert("heat_in_sheet_J".to_owned(), heat);
        let mass = if self.physical.is_some() { &state.burn.mass } else { &state.burn.fuel };
        books.insert("mass_of_sheet_kg".to_owned(), mass.iter().sum());
        books
    }
}
