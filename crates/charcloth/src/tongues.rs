//! Tongues of flame above what gives off gas: where there is flame, for pictures and volumes of it.
//!
//! Model: the gas of a node rises in a flame as high as one of a long line of fire, H = 0.034 m (Q'/1 kW/m)^(2/3) [Yuan1996],
//! Q' the heat that is released around it, `sum q exp(-(r/R)^2)/(sqrt(pi) R)`, but no higher than the round laminar flame
//! of all that burns near, 0.5 mm/W (a candle of some 80 W has 4 cm [Hamins2005]; in proportion to the gas, whatever burns it
//! [Roper1977]). So a front has tall flames and a lone flake a small one. Air that is drawn in parts a line of fire into
//! tongues a centimetre wide: gas goes to the nearest ridge of a drifting noise on its way up, tongues are tall on ridges and
//! low between them, and their tips flicker some ten times a second, `f = 1.5 D^(-1/2)` 1/s for D of 2 cm [Pagni1990].
//! Only frames of models that tell fuel gas from glow have flames. Valid when: for pictures. Cost: five to fifty puffs a
//! burning node.

use crate::frame::Frame;
use crate::noise::noise;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Heat that a kilogram of fuel gas gives, as the height of flames needs it [kW s/kg].
const HEAT: f64 = 14e3;
/// Length of burning sheet that one flame draws its gas from, sqrt(pi) R [m].
const BURNING_LENGTH: f64 = 0.02; // tuned: copper to black of a front upward, 10 to 50 mm
/// Height of a round flame [m/kW].
const ROUND: f64 = 0.5; // tuned: 0.4 to 0.7
/// All within so many R feeds a round flame.
const NEAR: f64 = 3.0; // tuned: a line of fire must not count as a lone flake; 2 to 4
const HEIGHT: [f64; 2] = [0.003, 0.12]; // tuned: flames of thin paper are a few centimetres high
/// Breadths of tongues in low flames and in tall ones [m].
const BREADTH: [f32; 2] = [0.007, 0.014]; // tuned: by eye, a third of their height; 4 to 30 mm
/// Heights of flames that have such tongues [m].
const LOW_AND_TALL: [f64; 2] = [0.015, 0.05];
/// How fast tongues wander, and how fast their tips flicker [1/s].
const WANDERS: f32 = 4.0; // tuned: 1 to 6
const FLICKERS: f32 = 10.6;
/// Speed at which bulges climb a flame [m/s].
const CLIMBS: f32 = 0.6; // tuned: laminar flames of some centimetres rise at 0.3 to 1 m/s
/// Distance between puffs along a tongue [m], and most of them.
const SPACING: f64 = 0.002;
const MOST: f64 = 48.0;

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
    /// Height of its tongue [m].
    pub height: f32,
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
    let burns = |i: &usize| burn.burn_rate_full[*i] <= 0.0 && burn.burn_rate[*i] > 0.0 && burn.flame[*i] > 0.0;
    let around = Around::of(frame, (0..burn.len()).filter(burns));
    for i in (0..burn.len()).filter(burns) {
        let root = frame.motion.position[i];
        let from = root.as_vec3();
        let of_line = around.rate(root, 1.0) * HEAT / BURNING_LENGTH;
        let mean = (0.034 * of_line.powf(2.0 / 3.0)).min(ROUND * around.near(root) * HEAT);
        let mean = mean.clamp(HEIGHT[0], HEIGHT[1]);
        let tall = ((mean - LOW_AND_TALL[0]) / (LOW_AND_TALL[1] - LOW_AND_TALL[0])).clamp(0.0, 1.0) as f32;
        let breadth = BREADTH[0] + (BREADTH[1] - BREADTH[0]) * tall;
        // Tongues stand upright, so their noise varies slowly upwards. Breadths differ from node to node, scales must not.
        let flat = from - up_f32 * (0.7 * from.dot(up_f32));
        let drift = up_f32 * (time * WANDERS);
        let ridge = |point: Vec3| {
            let [narrow, wide] = BREADTH.map(|breadth| noise(point / breadth - drift));
            narrow + (wide - narrow) * tall
        };
        let here = ridge(flat);
        let step = 0.25 * breadth;
        let slope = |way: Vec3| (ridge(flat + way * step) - ridge(flat - way * step)) * 0.5 / 0.25;
        let to_ridge = (across * slope(across) + along * slope(along)).clamp_length_max(1.5) * (0.42 * breadth);
        let flicker = noise(flat / breadth + Vec3::splat(31.0) - up_f32 * (time * FLICKERS));
        let height = (mean as f32 * (0.85 + 0.80 * here + 0.30 * flicker)).max(HEIGHT[0] as f32);
        let count = (f64::from(height) / SPACING).ceil().min(MOST);
        // As wide as they are apart, and as nodes are, or a tongue is a string of beads.
        let apart = 0.8 * height / count as f32;
        let widest = (0.75 * burn.area[i].sqrt() as f32).max(0.08 * mean as f32).clamp(0.0012, 0.004);
        let share = (burn.burn_rate[i] / count) as f32;
        for k in 0..count as usize {
            // Puffs of neighbours are not at one height.
            let jitter = 0.5 + 0.5 * noise(from * 700.0 + Vec3::splat(k as f32));
            let rise = (k as f32 + jitter) / count as f32;
            let climb = rise * height;
            let wave = (flat + up_f32 * (climb - time * CLIMBS)) * 40.0;
            let sway = (across * noise(wave) + along * noise(wave + Vec3::splat(17.0))) * (0.16 * rise * climb);
            // Bulges climb, and pinch off the tip.
            let bulge = noise(flat / BREADTH[0] + up_f32 * ((climb - time * CLIMBS) / BREADTH[1]));
            let full = (PI * rise.powf(0.6)).sin().max(0.0) * (1.0 + 1.3 * rise.sqrt() * bulge).max(0.0);
            put(&Puff {
                place: root + up * f64::from(climb) + (sway + to_ridge * rise.powf(1.2)).as_dvec3(),
                width: (widest * (1.0 - 0.6 * rise)).max(apart),
                rise,
                gas: share * full,
                height,
            });
        }
    }
}

/// What burns, in cells as wide as a flame draws its gas from.
struct Around {
    /// Cell, gas that it gives off [kg/s], and the middle of that [m]; in the order of the cells.
    cells: Vec<([i64; 3], f64, DVec3)>,
    /// Gas given off near the middle of each [kg/s].
    near: Vec<f64>,
}

impl Around {
    const REACH: f64 = BURNING_LENGTH / 1.772_453_850_905_516; // over the root of pi

    fn cell(point: DVec3) -> [i64; 3] {
        (point / (0.5 * Self::REACH)).floor().as_i64vec3().to_array()
    }

    /// Of these nodes of a frame.
    fn of(frame: &Frame, nodes: impl Iterator<Item = usize>) -> Self {
        let mut all: Vec<([i64; 3], f64, DVec3)> = nodes
            .map(|i| (Self::cell(frame.motion.position[i]), frame.burn.burn_rate[i], frame.motion.position[i]))
            .collect();
        all.sort_by_key(|(cell, ..)| *cell);
        let of_cell = |same: &[([i64; 3], f64, DVec3)]| {
            let rate: f64 = same.iter().map(|(_, rate, _)| rate).sum();
            let middle = same.iter().map(|(_, rate, point)| *point * *rate).sum::<DVec3>() / rate;
            (same[0].0, rate, middle)
        };
        let mut around = Self { cells: all.chunk_by(|a, b| a.0 == b.0).map(of_cell).collect(), near: Vec::new() };
        around.near = around.cells.iter().map(|(.., middle)| around.rate(*middle, NEAR)).collect();
        around
    }

    /// Gas given off near a point that gives some off itself [kg/s].
    fn near(&self, point: DVec3) -> f64 {
        let cell = Self::cell(point);
        self.near[self.cells.partition_point(|(other, ..)| *other < cell)]
    }

    /// Gas given off around a point, the less counted the farther it is, over so many R [kg/s].
    fn rate(&self, point: DVec3, reach: f64) -> f64 {
        let cells = (4.0 * reach).ceil() as i64;
        let over = 1.0 / (reach * Self::REACH).powi(2);
        let [x, y, z] = Self::cell(point);
        let mut sum = 0.0;
        for (i, j) in (x - cells..=x + cells).flat_map(|i| (y - cells..=y + cells).map(move |j| (i, j))) {
            let first = self.cells.partition_point(|(cell, ..)| *cell < [i, j, z - cells]);
            for (_, rate, middle) in self.cells[first..].iter().take_while(|(cell, ..)| *cell <= [i, j, z + cells]) {
                sum += rate * (-middle.distance_squared(point) * over).exp();
            }
        }
        sum
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

    /// Nodes a millimetre apart that burn at 10 g/m2 s, and one far away that does not; the first is in the middle of
    /// the level square that they make.
    fn square(side: i32) -> Frame {
        let count = (side * side) as usize + 1;
        let mut frame = Frame { motion: MotionNodes::zeros(count), burn: BurnNodes::zeros(count), ..Frame::default() };
        let middle = DVec3::new(0.0, 0.1, -0.2);
        let steps =
            (0..side * side).map(|k| DVec3::new(f64::from(k % side - side / 2), 0.0, f64::from(k / side - side / 2)));
        let mut places: Vec<DVec3> = steps.map(|step| middle + step * 1e-3).collect();
        let own = places.iter().position(|place| *place == middle).unwrap();
        places.swap(0, own);
        for (i, place) in places.into_iter().enumerate() {
            frame.motion.position[i] = place;
            frame.burn.area[i] = 1e-6;
            (frame.burn.burn_rate[i], frame.burn.flame[i]) = (1e-8, 0.01);
        }
        frame.motion.position[count - 1] = middle + DVec3::X;
        frame.burn.area[count - 1] = 1e-6;
        frame
    }

    fn frame() -> Frame {
        square(1)
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
            let heights: Vec<f64> = puffs.iter().map(|p| (p.place - frame.motion.position[0]).dot(up)).collect();
            let top = heights.iter().copied().fold(0.0, f64::max);
            assert!(top > 0.4 * HEIGHT[0] && top <= 2.0 * HEIGHT[0], "alone it is as low as any: {top}");
            assert!(heights.is_sorted() && heights[0] >= 0.0);
            let aside = puffs.iter().map(|p| (p.place - frame.motion.position[0]).reject_from(up).length());
            // No farther than it is to a ridge.
            assert!(aside.fold(0.0, f64::max) < f64::from(BREADTH[0]));
            let gas: f32 = puffs.iter().map(|p| p.gas).sum();
            assert!((0.1e-8..1.5e-8).contains(&gas), "{gas}");
        }
    }

    #[test]
    fn flames_are_as_high_as_what_burns_around_them_feeds_them() {
        // 10 g/m2 s and 14 kJ/g over all that a flame draws from: 2.8 kW/m, 0.068 m, more or less by the licking.
        let frame = square(61);
        let rate = Around::of(&frame, 0..61 * 61).rate(frame.motion.position[0], 1.0);
        let of_line = rate * HEAT / BURNING_LENGTH;
        assert!((of_line / 2.8 - 1.0).abs() < 0.05, "{of_line} kW/m");
        let alone = Around::of(&frame, 0..1);
        for rate in [alone.rate(frame.motion.position[0], 1.0), alone.near(frame.motion.position[0])] {
            assert!((rate / 1e-8 - 1.0).abs() < 1e-12, "{rate} kg/s of its own");
        }
    }

    #[test]
    fn a_flake_has_a_small_flame_and_a_front_of_the_same_gas_a_tall_one() {
        // 3 x 3 nodes of 0.5 mg/s in all and 7 W: 3.5 mm as a round flame, where a line would have 17 mm.
        let mut frame = square(3);
        frame.burn.burn_rate[..9].fill(0.5e-6 / 9.0);
        let top = |frame: &Frame| all(frame, DVec3::Y).iter().map(|puff| puff.height).fold(0.0, f32::max);
        let flake = top(&frame);
        assert!((0.003..0.007).contains(&flake), "{flake} m");
        let front = top(&square(61));
        assert!((0.05..0.13).contains(&front), "{front} m");
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
