//! Heat lost to the room.
//!
//! Model: q_i = -lambda C_i0 (T_i - T_ambient), Eq. 1.4. Source: Newton's law of cooling; not in the sketch of 2004, so
//! it is off unless a scene asks for it. Valid when: small excess temperatures, or lambda fitted to the range that
//! matters; lambda dt under 1. Cost: one pass over the nodes.

use super::{Effect, HeatRates, Now};
use crate::scene::{HeatCapacityLaw, Model, Scene};

struct Cooling {
    /// lambda [1/s].
    rate: f64,
    /// [K]
    ambient: f64,
    /// Least heat capacity of a node, over that at the start.
    least_capacity: f64,
}

/// Cooling with the scene's rate; none at a rate of 0.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    if scene.model == Model::Physical {
        return None;
    }
    let (rate, ambient) = (scene.fire.cooling_rate.0, scene.fire.ambient_temperature.0);
    let least_capacity = match scene.fire.heat_capacity_law {
        HeatCapacityLaw::Inverse => scene.fire.ash_capacity.0.min(1.0),
        HeatCapacityLaw::Constant | HeatCapacityLaw::Literal => 1.0,
    };
    (rate > 0.0).then(|| Box::new(Cooling { rate, ambient, least_capacity }) as Box<dyn Effect>)
}

impl Effect for Cooling {
    fn longest_step(&self, _: &Now<'_>) -> f64 {
        // Held over a step, cooling must not take a node below ambient; half its excess is safe. Ash has the least
        // heat capacity.
        0.5 * self.least_capacity / self.rate
    }

    fn add_heat(&self, now: &Now<'_>, rates: &mut HeatRates) {
        let burn = &now.state.burn;
        let lost = rates.lost();
        for i in 0..burn.len() {
            let loss = self.rate * burn.heat_capacity[i]; // Eq. 1.4
            lost[i] += loss * (burn.temperature[i] - self.ambient);
        }
    }
}
