//! OpenVDB: where pictures have flames, as a volume a frame, for programs that light and shade fire themselves.
//!
//! `flame` is how dense it is, 0 to 1, and `temperature` [K] is that of what shines, where there is flame. Both are those
//! of the tongues in pictures ([`charcloth::tongues`]), which are a look and no gas that was solved. Cost: a few hundred
//! voxels a puff.

use super::numbered;
use super::sequence::Sequence;
use super::vdb_grid::{Grid, write as write_grids};
use crate::error::IoError;
use crate::files::{Durability, write_whole};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use charcloth::tongues::{Puff, has_flames, puffs};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Sides that voxels can have [m].
const SIDES: std::ops::RangeInclusive<f64> = 2e-4..=0.05;
/// Widths of a puff within which it counts: it has 1 % of its density there.
const REACH: f64 = 2.15;
/// Gas in a volume that is dense [kg/(s m3)].
const DENSE: f32 = 1.0; // tuned: 0.3 to 3, by eye
/// Thinnest flame that is written.
const THINNEST: f32 = 1e-3;
/// Temperatures at the root and the tip [K].
const ROOT: f32 = 1900.0; // tuned: 1600 to 2000, soot that shines yellow
const TIP: f32 = 1300.0; // tuned: 1000 to 1500, soot that cools to red

/// Gas [kg/(s m3)], and gas times temperature, of the voxels of cubes of 8^3, by the place of the cube.
type Sums = BTreeMap<[i32; 3], Box<[[f32; 2]; 512]>>;

/// Writes `flames_00000.vdb` a frame into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let voxel = sequence.options().voxel;
    if !SIDES.contains(&voxel) {
        let hint = format!("choose --voxel from {} to {} mm", SIDES.start() * 1e3, SIDES.end() * 1e3);
        return Err(IoError::content(folder, format!("voxels of {voxel} m cannot be made"), hint));
    }
    if !has_flames(&sequence.first()?) {
        let problem = "the model of this run has no flames: its paper glows";
        return Err(IoError::content(folder, problem, "run a scene with model = \"physical\""));
    }
    let mut files = Vec::new();
    let up = match sequence.meta().up {
        Axis::Y => DVec3::Y,
        Axis::Z => DVec3::Z,
    };
    let mut path = folder.to_path_buf();
    while let Some(frame) = sequence.next(&path)? {
        path = folder.join(numbered("flames", frame.number, "vdb"));
        let grids = volume(&frame, up, voxel);
        write_whole(&path, Durability::Process, |out| write_grids(&grids, out))?;
        files.push(path.clone());
    }
    Ok(files)
}

/// Density and temperature of the flames of a frame.
fn volume(frame: &Frame, up: DVec3, voxel: f64) -> [Grid; 2] {
    let mut sums = Sums::new();
    puffs(frame, up, &mut |puff| add(&mut sums, puff, voxel));
    let [mut flame, mut temperature] = ["flame", "temperature"].map(|name| Grid::new(name, voxel));
    for (cube, values) in &sums {
        for (k, [gas, heat]) in values.iter().enumerate() {
            let dense = 1.0 - (-gas / DENSE).exp();
            if dense >= THINNEST {
                let k = k as i32;
                let at = [8 * cube[0] + (k >> 6), 8 * cube[1] + (k >> 3 & 7), 8 * cube[2] + (k & 7)];
                *flame.at(at) = dense;
                *temperature.at(at) = heat / gas;
            }
        }
    }
    [flame, temperature]
}

/// Adds a puff to the voxels that it reaches.
fn add(sums: &mut Sums, puff: &Puff, voxel: f64) {
    // Narrower than a voxel it would be missed, or counted several times over.
    let width = f64::from(puff.width).max(0.75 * voxel);
    let density = f64::from(puff.gas) / (std::f64::consts::PI.powf(1.5) * width.powi(3));
    let temperature = ROOT + (TIP - ROOT) * puff.rise;
    let corner = |side: f64| ((puff.place + side * REACH * width) / voxel).round().as_ivec3().to_array();
    let (low, high) = (corner(-1.0), corner(1.0));
    // A Gauss curve in space is the product of those along the axes.
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let fall = |k: i32| (-((f64::from(k) * voxel - puff.place[axis]) / width).powi(2)).exp();
        (low[axis]..=high[axis]).map(fall).collect::<Vec<f64>>()
    });
    let cubes = |axis: usize| (low[axis] >> 3)..=(high[axis] >> 3);
    for cube in cubes(0).flat_map(|x| cubes(1).flat_map(move |y| cubes(2).map(move |z| [x, y, z]))) {
        let values = sums.entry(cube).or_insert_with(|| Box::new([[0.0; 2]; 512]));
        let span = |axis: usize| low[axis].max(8 * cube[axis])..=high[axis].min(8 * cube[axis] + 7);
        for i in span(0) {
            for j in span(1) {
                let across = density * x[(i - low[0]) as usize] * y[(j - low[1]) as usize];
                let row = (((i & 7) << 6) | ((j & 7) << 3)) as usize;
                for k in span(2) {
                    let here = (across * z[(k - low[2]) as usize]) as f32;
                    let value = &mut values[row | (k & 7) as usize];
                    value[0] += here;
                    value[1] += here * temperature;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use charcloth::sheet::{BurnNodes, MotionNodes};

    #[test]
    fn voxels_hold_what_the_puffs_add_up_to() {
        let mut frame = Frame { motion: MotionNodes::zeros(2), burn: BurnNodes::zeros(2), ..Frame::default() };
        for i in 0..2 {
            frame.motion.position[i] = DVec3::new(0.013 * i as f64 - 0.004, -0.03, 0.5);
            (frame.burn.area[i], frame.burn.burn_rate[i], frame.burn.flame[i]) = (1e-4, 1e-6, 0.01);
        }
        for voxel in [2e-3, 3e-3, 8e-3] {
            let [mut flame, mut temperature] = volume(&frame, DVec3::Z, voxel);
            let mut there = 0;
            let range = |low: f64, high: f64| (low / voxel) as i32..(high / voxel) as i32;
            let places = range(-0.02, 0.03).flat_map(|x| range(-0.05, -0.01).map(move |y| (x, y)));
            for (x, y, z) in places.flat_map(|(x, y)| range(0.49, 0.62).map(move |z| (x, y, z))) {
                // All that counts, without regard to reach.
                let place = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * voxel;
                let (mut gas, mut heat, mut cut) = (0.0, 0.0, 0.0);
                puffs(&frame, DVec3::Z, &mut |puff| {
                    let width = f64::from(puff.width).max(0.75 * voxel);
                    let here = f64::from(puff.gas) / (std::f64::consts::PI.powf(1.5) * width.powi(3))
                        * (-(place - puff.place).length_squared() / (width * width)).exp();
                    gas += here;
                    heat += here * f64::from(ROOT + (TIP - ROOT) * puff.rise);
                    // Beyond the reach at the corners of its box, and half a voxel that rounding may take.
                    let away = (place - puff.place).abs().max_element() / width;
                    cut += if away > REACH - 0.5 * voxel / width { here } else { 0.0 };
                });
                let dense = |gas: f64| 1.0 - (-gas / f64::from(DENSE)).exp();
                let at = [x, y, z];
                if dense(gas - cut) < 1.01 * f64::from(THINNEST) {
                    continue;
                }
                there += 1;
                let value = f64::from(*flame.at(at));
                assert!((dense(gas - cut) - 1e-5..dense(gas) + 1e-5).contains(&value), "{at:?} {value} {gas} {cut}");
                if cut < 1e-6 * gas {
                    assert!((f64::from(*temperature.at(at)) - heat / gas).abs() < 0.1, "{at:?}");
                }
            }
            assert!(there > 20, "{voxel}: {there}");
        }
    }
}
