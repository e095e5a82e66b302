//! Air pushes on the surface.
//!
//! Model: F_i = C A_i [n . (u - v)] n, Eq. 6.5b, u the wind with gusts. Source: [Provot1995]. Valid when: as a knob; drag that
//! is quadratic in the speed is physics of its own. Gusts are a sum of three sines of incommensurate periods, seeded.
//! Cost: one pass over the nodes.

use super::{Effect, ForceDerivatives, Forces, Now};
use crate::random::Random;
use crate::scene::Scene;
use glam::{DMat3, DVec3};

struct Wind {
    /// Mean velocity of the air [m/s].
    velocity: DVec3,
    /// C [Pa s/m]
    coefficient: f64,
    /// Part of the speed that gusts add.
    gust: f64,
    /// Angular frequency [rad/s] and phase of each sine.
    sines: [(f64, f64); 3],
}

/// The scene's wind; none with a coefficient of 0.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    let wind = &scene.wind;
    if wind.coefficient.0 == 0.0 || !scene.mechanics.moves {
        return None;
    }
    let mut random = Random::new(scene.seed, 0x7769_6e64);
    let base = std::f64::consts::PI / wind.gust_time.0.max(1e-6); // half a period is one gust
    // tuned: ratios of the golden mean never fall into step
    let sines = [1.0, 1.618_034, 0.618_034].map(|ratio| (base * ratio, std::f64::consts::TAU * random.uniform()));
    Some(Box::new(Wind {
        velocity: DVec3::from_array(wind.velocity.map(|speed| speed.0)),
        coefficient: wind.coefficient.0,
        gust: wind.gust.0,
        sines,
    }))
}

impl Wind {
    fn air(&self, time: f64) -> DVec3 {
        let gust: f64 = self.sines.iter().map(|(frequency, phase)| (frequency * time + phase).sin()).sum();
        self.velocity * (1.0 + self.gust * gust / 3.0f64.sqrt())
    }
}

impl Effect for Wind {
    fn add_forces(&self, now: &Now<'_>, forces: &mut Forces) {
        let air = self.air(now.time);
        for i in 0..forces.force.len() {
            let normal = now.normal[i];
            let relative = air - now.state.motion.velocity[i];
            forces.force[i] += normal * (self.coefficient * now.area[i] * normal.dot(relative)); // Eq. 6.5b
        }
    }

    fn add_force_derivatives(&self, now: &Now<'_>, derivatives: &mut ForceDerivatives) {
        for (i, by_velocity) in derivatives.by_velocity.iter_mut().enumerate() {
            let normal = now.normal[i];
            let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
            *by_velocity -= outer * (self.coefficient * now.area[i]);
        }
    }

    fn longest_step(&self, now: &Now<'_>) -> f64 {
        // Held over a step, drag turns the velocity round when it takes more than all of it; half is safe.
        let mut fastest = 0.0f64;
        for i in 0..now.area.len() {
            fastest = fastest.max(self.coefficient * now.area[i] / now.state.mass(i).max(f64::MIN_POSITIVE));
        }
        0.5 / fastest.max(f64::MIN_POSITIVE)
    }
}
