//! Conduction along the sheet.
//!
//! Model: q_ij = k_ij (T_j - T_i), k_ij = k0/d_ij, Eq. 1.3. Source: the 2004 sketch, S1 [Moidu2004]. Valid when: D
//! stands for heat that comes back through the gas, see docs/physics.md. Cost: one pass over the links of the burn
//! mesh.

use super::{Effect, HeatRates, Now};
use crate::kernels::Links;
use crate::kernels::heat::{ConductanceRow, conduct};
use crate::scene::{ConductionDistance, Model, Scene};
use crate::sheet::SheetState;

struct Conduction;

/// Conduction is always on; a diffusivity of 0 makes it nothing.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    if scene.model == Model::Physical {
        return None;
    }
    Some(Box::new(Conduction))
}

impl Effect for Conduction {
    fn add_heat(&self, now: &Now<'_>, rates: &mut HeatRates) {
        let temperature = &now.state.burn.temperature;
        conduct(now.heat_links, now.conductance, temperature, &mut rates.within, now.unit, now.parallel);
    }
}

/// Fills in the conductance of every link [W/K]: k0 over the distance, none where the sheet is parted.
pub fn conductances(state: &SheetState, links: &Links, distance: ConductionDistance, rows: &mut Vec<ConductanceRow>) {
    rows.clear();
    rows.resize(links.rows(), ConductanceRow::default());
    let edges = &state.burn_edges;
    for (e, places) in links.of_element.iter().enumerate() {
        if places[0][0] == u32::MAX {
            continue;
        }
        let distance = match distance {
            ConductionDistance::Rest => edges.rest_distance[e],
            ConductionDistance::Current => {
                let [i, j] = edges.ends[e].map(|i| state.motion.position[i as usize]);
                // A crushed edge would conduct without bound: a tenth of its length at rest is the least.
                i.distance(j).max(0.1 * edges.rest_distance[e])
            }
        };
        for [row, lane] in places {
            rows[*row as usize].0[*lane as usize] = edges.conductance_length[e] / distance;
        }
    }
}
