//! Air pushes on the surface.
//!
//! Model: F_i = C A_i [n . (u - v)] n, Eq. 6.5b, u the wind with gusts, with a C that is a knob [Provot1995]; or with that of a
//! plate, Eq. 17.7, which grows with the speed [Hoerner1965]: its part across the stream is the lift. Flames add the air that
//! rises over them (`plume.rs`). Valid when: the sheet does not change the wind. Gusts are a sum of three sines of incommensurate periods, seeded. Cost: one pass over the nodes.

use super::{Effect, ForceDerivatives, Forces, Now};
use crate::particles::density_of_air;
use crate::random::Random;
use crate::scene::{DragLaw, Scene};
use crate::units::Speed;
use glam::{DMat3, DVec3};

/// Drag coefficient of a flat plate broadside to the air. [Hoerner1965]: 1.17 for discs and squares
pub const PLATE_DRAG: f64 = 1.17;
/// Part of its speed that the force on a plate may take from a node in a step: held over it, a half is stable.
const MOST_OF_SPEED: f64 = 0.5;
/// Length of the waves whose air goes along with the sheet [m], Eq. 17.12. // tuned: the shortest that a sheet of nodes every
/// few millimetres makes, 2 to 20 mm; longer ones move more air
const SHORT_WAVE: f64 = 5e-3;

struct Wind {
    air: Air,
    /// C [Pa s/m], or what makes it of a speed [kg/m3].
    coefficient: f64,
    law: DragLaw,
    /// Mass of the air that goes along, an area [kg/m2].
    goes_along: f64,
    /// Longest step of the scene [s].
    step: f64,
}

/// The wind over time.
#[derive(Debug, Clone)]
pub struct Air {
    /// Mean velocity of the air at certain times [s, m/s]; at least one row.
    keys: Vec<(f64, DVec3)>,
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
    let coefficient = match wind.law {
        DragLaw::Linear => wind.coefficient.0,
        DragLaw::Plate => 0.5 * density_of_air(scene) * PLATE_DRAG,
    };
    // Eq. 17.12 [Lamb1932]
    let goes_along = match wind.law {
        DragLaw::Linear => 0.0,
        DragLaw::Plate => density_of_air(scene) * SHORT_WAVE / std::f64::consts::PI,
    };
    Some(Box::new(Wind { air: Air::of(scene), coefficient, law: wind.law, goes_along, step: scene.time.step.0 }))
}

impl Air {
    /// The wind of a scene.
    pub fn of(scene: &Scene) -> Self {
        let wind = &scene.wind;
        let vector = |velocity: [Speed; 3]| DVec3::from_array(velocity.map(|speed| speed.0));
        let mut keys: Vec<(f64, DVec3)> = wind.key.iter().map(|key| (key.time.0, vector(key.velocity))).collect();
        if keys.is_empty() {
            keys.push((0.0, vector(wind.velocity)));
        }
        let mut random = Random::new(scene.seed, 0x7769_6e64);
        let base = std::f64::consts::PI / wind.gust_time.0.max(1e-6); // half a period is one gust
        // tuned: ratios of the golden mean never fall into step
        let sines = [1.0, 1.618_034, 0.618_034].map(|ratio| (base * ratio, std::f64::consts::TAU * random.uniform()));
        Self { keys, gust: wind.gust.0, sines }
    }

    /// Velocity of the air at a time [m/s].
    pub fn velocity(&self, time: f64) -> DVec3 {
        let after = self.keys.partition_point(|(at, _)| *at <= time);
        let mean = match (after.checked_sub(1).map(|before| self.keys[before]), self.keys.get(after)) {
            (Some((from, start)), Some((to, end))) => start.lerp(*end, (time - from) / (to - from)),
            (Some((_, alone)), None) => alone,
            (None, Some((_, alone))) => *alone,
            (None, None) => DVec3::ZERO,
        };
        let gust: f64 = self.sines.iter().map(|(frequency, phase)| (frequency * time + phase).sin()).sum();
        mean * (1.0 + self.gust * gust / 3.0f64.sqrt())
    }
}

impl Wind {
    /// Force on a node along its normal over its speed along it [N s/m], both against the air.
    fn rate(&self, now: &Now<'_>, i: usize, against: DVec3) -> f64 {
        match self.law {
            DragLaw::Linear => self.coefficient * now.area[i],
            // Eq. 17.7, no more than takes half of the speed in a step.
            DragLaw::Plate => {
                let mass = now.state.mass(i) + self.goes_along * now.area[i];
                let most = MOST_OF_SPEED * mass / self.step;
                (self.coefficient * against.length() * now.area[i]).min(most)
            }
        }
    }
}

impl Effect for Wind {
    fn add_forces(&self, now: &Now<'_>, forces: &mut Forces) {
        let air = self.air.velocity(now.time);
        for i in 0..forces.force.len() {
            let normal = now.normal[i];
            let against = air + now.plume.at_node(i, now.state.motion.position[i]) - now.state.motion.velocity[i];
            forces.force[i] += normal * (self.rate(now, i, against) * normal.dot(against)); // Eq. 6.5b
            forces.air_mass[i] += self.goes_along * now.area[i];
        }
    }

    fn add_force_derivatives(&self, now: &Now<'_>, derivatives: &mut ForceDerivatives) {
        let air = self.air.velocity(now.time);
        for (i, by_velocity) in derivatives.by_velocity.iter_mut().enumerate() {
            let normal = now.normal[i];
            let against = air + now.plume.at_node(i, now.state.motion.position[i]) - now.state.motion.velocity[i];
            let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
            // Up to twice as much by the law of plates: what the speed itself does to the rate is left out.
            *by_velocity -= outer * self.rate(now, i, against);
        }
    }

    fn longest_step(&self, now: &Now<'_>) -> f64 {
        if self.law == DragLaw::Plate {
            return f64::INFINITY;
        }
        // Held over a step, drag turns the velocity round when it takes more than all of it; half is safe.
        let mut fastest = 0.0f64;
        for i in 0..now.area.len() {
            fastest = fastest.max(self.coefficient * now.area[i] / now.state.mass(i).max(f64::MIN_POSITIVE));
        }
        0.5 / fastest.max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::WindKey;
    use crate::units::{Ratio, Time};

    #[test]
    fn keyed_wind_is_linear_between_its_keys_and_gusts_go_with_the_seed() {
        let mut scene = Scene::default();
        let key = |time, x| WindKey { time: Time(time), velocity: [Speed(x), Speed(0.0), Speed(0.0)] };
        scene.wind.velocity = [Speed(99.0); 3];
        scene.wind.key = vec![key(1.0, 2.0), key(3.0, -2.0)];
        let air = Air::of(&scene);
        for (time, x) in [(0.0, 2.0), (1.0, 2.0), (1.5, 1.0), (2.0, 0.0), (3.0, -2.0), (9.0, -2.0)] {
            assert_eq!(air.velocity(time), DVec3::X * x, "at {time} s");
        }
        scene.wind.gust = Ratio(0.5);
        let gusts = |seed: u64| Air::of(&Scene { seed, ..scene.clone() }).velocity(0.7);
        assert_ne!(gusts(1), DVec3::X * 2.0);
        assert_eq!(gusts(1), gusts(1));
        assert_ne!(gusts(1), gusts(2));
    }
}
