//! Weight.
//!
//! Model: F_i = -m_i g up, Eq. 6.5c, m_i the fuel left and what does not burn. Cost: one pass over the nodes.

use super::{Effect, Forces, Now};
use crate::scene::Scene;

struct Gravity {
    /// [m/s2]
    acceleration: f64,
}

/// Weight with the scene's gravity; none at 0.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    let acceleration = scene.gravity.0;
    (acceleration != 0.0 && scene.mechanics.moves).then(|| Box::new(Gravity { acceleration }) as Box<dyn Effect>)
}

impl Effect for Gravity {
    fn add_forces(&self, now: &Now<'_>, forces: &mut Forces) {
        for i in 0..forces.force.len() {
            forces.force[i] -= now.up * (self.acceleration * now.state.mass(i));
        }
    }
}
