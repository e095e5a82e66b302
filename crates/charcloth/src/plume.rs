//! Hot air that rises over a fire, and carries along what is light.
//!
//! Model: Eq. 17.9, the three zones of a fire's plume [McCaffrey1979], as wide as it draws in air [Morton1956]. All flames of
//! a scene are one fire, at their middle. It carries what has come off: along the sheet that burns it clings to both faces,
//! and pushes neither. Source: as cited. Valid when: the air is still but for the fire. Cost: a pass over the motion nodes a frame, an exponential a node and step.

use crate::sheet::{NONE, SheetState};
use glam::DVec3;

/// Width of the profile of speed, to where it has fallen to 1/e, over the height: 6/5 of an entrainment of 0.1 [Morton1956].
const SPREAD: f64 = 0.12;
/// Heights over power^(2/5) at which the flame ends, and at which it has never reached [m/kW^(2/5)] [McCaffrey1979].
const FLAME: f64 = 0.08;
const PLUME: f64 = 0.20;

/// The rising air of one fire.
#[derive(Debug, Clone, Default)]
pub struct Plume {
    base: DVec3,
    up: DVec3,
    /// [kW]
    power: f64,
    /// How wide the fire itself is [m].
    width: f64,
    /// Whether each motion node belongs to a piece that has come off.
    loose: Vec<bool>,
}

impl Plume {
    /// The plume over what burns in a state, which gives off `power_of_flames`.
    pub fn of(state: &SheetState, up: DVec3) -> Self {
        let power = state.books.power_of_flames[0] / 1e3;
        if power <= 0.0 {
            return Self::default();
        }
        // Flames stand on nodes, the taller the more of them.
        let flames = || {
            let height = |i: usize| state.burn.flame[state.burn_node(i)];
            let nodes = (0..state.motion.len()).filter(|i| state.motion.alive[*i] != 0);
            nodes.map(move |i| (state.motion.position[i], height(i))).filter(|(_, height)| *height > 0.0)
        };
        let (sum, weight) = flames().fold((DVec3::ZERO, 0.0), |(sum, all), (p, w)| (sum + p * w, all + w));
        if weight <= 0.0 {
            return Self::default();
        }
        let base = sum / weight;
        let spread: f64 = flames().map(|(p, w)| w * (p - base).reject_from_normalized(up).length_squared()).sum();
        let mut loose = vec![false; state.motion.len()];
        for (corners, piece) in state.triangles.corners.iter().zip(&state.triangles.piece) {
            if state.pieces.parent[*piece as usize] != NONE {
                corners.iter().for_each(|i| loose[*i as usize] = true);
            }
        }
        Self { base, up, power, width: (spread / weight).sqrt(), loose }
    }

    /// Velocity of the air at a motion node [m/s].
    #[inline]
    pub fn at_node(&self, node: usize, point: DVec3) -> DVec3 {
        if self.loose.get(node).is_some_and(|loose| *loose) { self.velocity(point) } else { DVec3::ZERO }
    }

    /// Velocity of the air at a point [m/s].
    #[inline]
    pub fn velocity(&self, point: DVec3) -> DVec3 {
        let height = (point - self.base).dot(self.up);
        if self.power <= 0.0 || height <= 0.0 {
            return DVec3::ZERO;
        }
        let width = self.width + SPREAD * height;
        let aside = (point - self.base).reject_from_normalized(self.up).length_squared() / (width * width);
        self.up * (self.axial_speed(height) * (-aside).exp())
    }

    /// Speed on the axis at a height [m/s].
    fn axial_speed(&self, height: f64) -> f64 {
        let zone = height / self.power.powf(0.4);
        if zone < FLAME {
            6.84 * height.sqrt()
        } else if zone < PLUME {
            1.93 * self.power.powf(0.2)
        } else {
            1.12 * (self.power / height).cbrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zones_of_a_plume_join() {
        let plume = Plume { base: DVec3::ZERO, up: DVec3::Y, power: 0.07, width: 0.01, loose: Vec::new() };
        for zone in [FLAME, PLUME] {
            let height = zone * plume.power.powf(0.4);
            let (under, over) = (plume.axial_speed(height * 0.999), plume.axial_speed(height * 1.001));
            // The fits of the three zones meet within the scatter of what they are fitted to.
            assert!((under / over - 1.0).abs() < 0.03, "{under} and {over} m/s");
        }
        let speed = |point| plume.velocity(point).y;
        assert!(speed(DVec3::new(0.0, 0.1, 0.0)) > speed(DVec3::new(0.02, 0.1, 0.0)));
        assert_eq!(speed(DVec3::new(0.0, -0.1, 0.0)), 0.0);
    }
}
