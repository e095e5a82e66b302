//! Viscous damping of all motion.
//!
//! Model: F_i = -c m_i v_i, Eq. 6.5. Source: the viscous damping of [Provot1995], per mass, so that it does not depend on
//! the mesh. Taken implicitly: it never makes a step unstable. Cost: one pass over the nodes.

use super::{Effect, ForceDerivatives, Forces, Now};
use crate::scene::Scene;
use glam::DMat3;

struct Damping {
    /// c [1/s]
    rate: f64,
}

/// Damping with the scene's rate; none at 0.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    let rate = scene.mechanics.damping.0;
    (rate > 0.0 && scene.mechanics.moves).then(|| Box::new(Damping { rate }) as Box<dyn Effect>)
}

impl Effect for Damping {
    fn add_forces(&self, now: &Now<'_>, forces: &mut Forces) {
        for i in 0..forces.drag.len() {
            forces.drag[i] += self.rate * now.state.mass(i);
        }
    }

    fn add_force_derivatives(&self, now: &Now<'_>, derivatives: &mut ForceDerivatives) {
        for (i, by_velocity) in derivatives.by_velocity.iter_mut().enumerate() {
            *by_velocity -= DMat3::IDENTITY * (self.rate * now.state.mass(i));
        }
    }
}
