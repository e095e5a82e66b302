//! Tongues of flame above what gives off gas: where there is flame, for pictures and volumes of it.
//!
//! Model: each node feeds a tongue by its burn rate; its height is that of a line flame, H = 0.034 m (Q'/1 kW/m)^(2/3)
//! [Yuan1996], by the heat that is released around it: `Q' = sum q exp(-(r/R)^2)/(sqrt(pi) R)`, which is that of a long line of
//! fire, and of a wide one as far as a flame draws from; of a lone flake it is what the flake gives. Tongues rise from burning nodes, lick
//! and sway. Only frames of models that tell fuel gas from glow have flames. Valid when: for pictures. Cost: three to thirty
//! puffs a burning node.

use crate::frame::Frame;
use crate::noise::noise;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Heat that a kilogram of fuel gas gives, as the height of flames needs it [kW s/kg].
const HEAT: f64 = 14e3;
/// Length of burning sheet that one flame draws its gas from, sqrt(pi) R [m].
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
    let burns = |i: &usize| burn.burn_rate_full[*i] <= 0.0 && burn.burn_rate[*i] > 0.0 && burn.flame[*i] > 0.0;
    let around = Around::of(frame, (0..burn.len()).filter(burns));
    for i in (0..burn.len()).filter(burns) {
        let root = frame.motion.position[i];
        let from = root.as_vec3();
        // Neighbours lick together: tongues are a centimetre or so wide.
        let tongue = noise(from * 90.0 + Vec3::new(0.0, -time * 3.0, time * 2.2));
        let of_line = around.rate(root) * HEAT / BURNING_LENGTH;
        let height = 0.034 * of_line.powf(2.0 / 3.0) * (1.0 + 0.55 * f64::from(tongue));
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

/// What burns, in cells as wide as a flame draws its gas from.
struct Around {
    /// Cell, gas that it gives off [kg/s], and the middle of that [m]; in the order of the cells.
    cells: Vec<([i64; 3], f64, DVec3)>,
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
        Self { cells: all.chunk_by(|a, b| a.0 == b.0).map(of_cell).collect() }
    }

    /// Gas given off around a point, the less counted the farther it is [kg/s].
    fn rate(&self, point: DVec3) -> f64 {
        const CELLS: i64 = 4;
        let [x, y, z] = Self::cell(point);
        let mut sum = 0.0;
        for (i, j) in (x - CELLS..=x + CELLS).flat_map(|i| (y - CELLS..=y + CELLS).map(move |j| (i, j))) {
            let first = self.cells.partition_point(|(cell, ..)| *cell < [i, j, z - CELLS]);
            for (_, rate, middle) in self.cells[first..].iter().take_while(|(cell, ..)| *cell <= [i, j, z + CELLS]) {
                sum += rate * (-(middle.distance_squared(point) / (Self::REACH * Self::REACH))).exp();
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
            assert!(top > 0.5 * HEIGHT[0] && top <= HEIGHT[0], "alone it is as low as any: {top}");
            assert!(heights.is_sorted() && heights[0] >= 0.0);
            let aside = puffs.iter().map(|p| (p.place - frame.motion.position[0]).reject_from(up).length());
            assert!(aside.fold(0.0, f64::max) < 0.35 * top);
            let gas: f32 = puffs.iter().map(|p| p.gas).sum();
            assert!((0.4e-8..1e-8).contains(&gas), "{gas}");
        }
    }

    #[test]
    fn flames_are_as_high_as_what_burns_around_them_feeds_them() {
        // 10 g/m2 s and 14 kJ/g over all that a flame draws from: 2.8 kW/m, 0.068 m, more or less by the licking.
        let frame = square(61);
        let rate = Around::of(&frame, 0..61 * 61).rate(frame.motion.position[0]);
        let of_line = rate * HEAT / BURNING_LENGTH;
        assert!((of_line / 2.8 - 1.0).abs() < 0.05, "{of_line} kW/m");
        let rate = Around::of(&frame, 0..1).rate(frame.motion.position[0]);
        assert!((rate / 1e-8 - 1.0).abs() < 1e-12, "{rate} kg/s of its own");
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
