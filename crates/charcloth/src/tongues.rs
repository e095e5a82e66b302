//! Tongues of flame above what gives off gas: where there is flame, for pictures and volumes of it.
//!
//! Model: each node feeds a tongue by its burn rate; its height is that of a line flame, H = 0.034 m (Q'/1 kW/m)^(2/3)
//! [Yuan1996], over the length that burns. Tongues rise from burning nodes, lick and sway. Only frames of models that tell
//! fuel gas from glow have flames. Valid when: for pictures. Cost: three to thirty puffs a burning node.

use crate::frame::Frame;
use crate::noise::noise;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Heat that a kilogram of fuel gas gives, as the height of flames needs it [kW s/kg].
const HEAT: f64 = 14e3;
/// Length over which a sheet burns at a front [m].
const BURNING_LENGTH: f64 = 0.02; // tuned: copper to black of a front upward, 10 to 50 mm
const HEIGHT: [f64; 2] = [0.008, 0.12]; // tuned: flames of thin paper are a few centimetres high
/// Distance between puffs along a tongue [m], and most of them.
const SPACING: f64 = 0.003;
const MOST: f64 = 32.0;

/// A round piece of flame that thins out from its middle as exp(-(distance / width)^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Puff {
    /// Middle [m].
    pub place: DVec3,
    /// Distance at which it is thinner by e [m].
    pub width: f32,
    /// How far up its tongue it is: 0 at the root, 1 at the tip.
    pub rise: f32,
    /// Share of the gas of its node, which fades towards root and tip [kg/s].
    pub gas: f32,
}

/// Whether the model of a frame tells fuel gas from glow, so that flames can be shown.
pub fn has_flames(frame: &Frame) -> bool {
    frame.burn.burn_rate_full.iter().all(|rate| *rate <= 0.0)
}

/// Calls `put` with the puffs of all flames of a frame; `up` has length 1.
pub fn puffs(frame: &Frame, up: DVec3, put: &mut dyn FnMut(&Puff)) {
    let burn = &frame.burn;
    let time = frame.time as f32;
    let (up_f32, [across, along]) = (up.as_vec3(), level(up));
    for i in 0..burn.len() {
        if burn.burn_rate_full[i] > 0.0 || burn.burn_rate[i] <= 0.0 || burn.flame[i] <= 0.0 {
            continue;
        }
        let flux = burn.burn_rate[i] / burn.area[i].max(f64::MIN_POSITIVE);
        let root = frame.motion.position[i];
        let from = root.as_vec3();
        // Neighbours lick together: tongues are a centimetre or so wide.
        let tongue = noise(from * 90.0 + Vec3::new(0.0, -time * 3.0, time * 2.2));
        let height = 0.034 * (flux * HEAT * BURNING_LENGTH).powf(2.0 / 3.0) * (1.0 + 0.55 * f64::from(tongue));
        let height = height.clamp(HEIGHT[0], HEIGHT[1]);
        let count = (height / SPACING).ceil().min(MOST);
        // As wide as they are apart, or a tongue is a string of beads.
        let narrowest = (0.8 * height / count) as f32;
        let share = (burn.burn_rate[i] / count) as f32;
        for k in 0..count as usize {
            // Puffs of neighbours are not at one height.
            let jitter = 0.5 + 0.5 * noise(from * 700.0 + Vec3::splat(k as f32));
            let rise = (k as f32 + jitter) / count as f32;
            let climb = f64::from(rise) * height;
            let wave = (from + up_f32 * climb as f32) * 45.0 - up_f32 * (time * 9.0);
            let sway = (across * noise(wave) + along * noise(wave + Vec3::splat(17.0))) * (0.22 * rise * height as f32);
            let width = 0.0035 * (0.45 + (PI * rise.sqrt()).sin()) * (1.0 - 0.55 * rise);
            put(&Puff {
                place: root + up * climb + sway.as_dvec3(),
                width: width.max(narrowest),
                rise,
                gas: share * (PI * rise.powf(0.6)).sin().max(0.0),
            });
        }
    }
}

/// Two directions across the one that is up.
fn level(up: DVec3) -> [Vec3; 2] {
    let across = if up.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
    let across = (across - up * across.dot(up)).normalize();
    [across.as_vec3(), across.cross(up).as_vec3()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sheet::{BurnNodes, MotionNodes};

    /// A node that burns at 10 g/m2 s, 1 mm2 wide.
    fn frame() -> Frame {
        let mut frame = Frame { motion: MotionNodes::zeros(2), burn: BurnNodes::zeros(2), ..Frame::default() };
        for i in 0..2 {
            frame.motion.position[i] = DVec3::new(0.3 * i as f64, 0.1, -0.2);
            frame.burn.area[i] = 1e-6;
        }
        (frame.burn.burn_rate[0], frame.burn.flame[0]) = (1e-8, 0.01);
        frame
    }

    fn all(frame: &Frame, up: DVec3) -> Vec<Puff> {
        let mut all = Vec::new();
        puffs(frame, up, &mut |puff| all.push(*puff));
        all
    }

    #[test]
    fn a_tongue_rises_from_its_node_as_high_as_a_line_flame() {
        for up in [DVec3::Y, DVec3::Z] {
            let frame = frame();
            let puffs = all(&frame, up);
            // 2.8 kW/m over 20 mm: 0.068 m, more or less by the licking.
            let heights: Vec<f64> = puffs.iter().map(|p| (p.place - frame.motion.position[0]).dot(up)).collect();
            let top = heights.iter().copied().fold(0.0, f64::max);
            assert!((0.45 * 0.068..1.55 * 0.068).contains(&top), "{top}");
            assert!(heights.is_sorted() && heights[0] >= 0.0);
            let aside = puffs.iter().map(|p| (p.place - frame.motion.position[0]).reject_from(up).length());
            assert!(aside.fold(0.0, f64::max) < 0.35 * top);
            let gas: f32 = puffs.iter().map(|p| p.gas).sum();
            assert!((0.4e-8..1e-8).contains(&gas), "{gas}");
        }
    }

    #[test]
    fn no_flame_stands_on_glow_or_on_what_does_not_burn() {
        let mut frame = frame();
        assert!(has_flames(&frame));
        frame.burn.flame[0] = 0.0;
        assert!(all(&frame, DVec3::Y).is_empty());
        frame.burn.flame[0] = 0.01;
        frame.burn.burn_rate_full[0] = 1e-8;
        assert!(all(&frame, DVec3::Y).is_empty() && !has_flames(&frame));
    }
}
