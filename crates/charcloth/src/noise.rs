//! Noise that sticks to the material: smooth random fields of the point in the stress-free sheet.
//!
//! Value noise on a cubic lattice, turned so that no sheet lies along the lattice and shows it. The lattice values come
//! from an integer hash, so the field is the same everywhere and always.

use glam::{Mat3, Vec3};

/// A turn without symmetry: about z, then x, by angles that fit no grid.
const TURN: Mat3 =
    Mat3::from_cols(Vec3::new(0.824, 0.463, 0.326), Vec3::new(-0.567, 0.672, 0.477), Vec3::new(0.002, -0.578, 0.816));

fn lattice(x: i32, y: i32, z: i32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77)
        ^ (z as u32).wrapping_mul(0xc2b2_ae3d);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    h ^= h >> 15;
    (h >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
}

/// Smooth noise, about -1 to 1, that varies over a distance of 1.
pub fn noise(point: Vec3) -> f32 {
    let point = TURN * point;
    // By hand: without SSE4.1, which a plain build may not assume, `floor` is a call.
    let [x, y, z] = point.to_array().map(|v| {
        let towards_zero = v as i32;
        towards_zero.wrapping_sub(i32::from(v < towards_zero as f32))
    });
    let f = point - Vec3::new(x as f32, y as f32, z as f32);
    let f = f * f * (3.0 - 2.0 * f);
    let (x1, y1, z1) = (x.wrapping_add(1), y.wrapping_add(1), z.wrapping_add(1));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let low = mix(mix(lattice(x, y, z), lattice(x1, y, z), f.x), mix(lattice(x, y1, z), lattice(x1, y1, z), f.x), f.y);
    let high =
        mix(mix(lattice(x, y, z1), lattice(x1, y, z1), f.x), mix(lattice(x, y1, z1), lattice(x1, y1, z1), f.x), f.y);
    mix(low, high, f.z)
}

/// Noise of several scales: `octaves` layers, each half as wide and `gain` times as strong as the one before, about
/// -1 to 1.
pub fn fractal(point: Vec3, octaves: u32, gain: f32) -> f32 {
    let (mut sum, mut weight, mut total, mut p) = (0.0, 1.0, 0.0, point);
    for _ in 0..octaves {
        sum += weight * noise(p);
        total += weight;
        weight *= gain;
        // The odd offset keeps the layers from lining up at the origin.
        p = p * 2.03 + Vec3::new(17.3, -9.1, 4.7);
    }
    // Averages of layers are narrower than one layer; widen them again.
    sum / total * 1.4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_bounded_and_centred() {
        let mut sum = 0.0;
        for i in 0..10_000 {
            let p = Vec3::new(i as f32 * 0.137, i as f32 * 0.071, 0.0);
            let here = noise(p);
            assert!((-1.0..=1.0).contains(&here));
            assert!((noise(p + Vec3::X * 1e-3) - here).abs() < 0.02, "noise jumps at {p}");
            sum += here;
        }
        assert!((sum / 10_000.0).abs() < 0.05);
    }
}
