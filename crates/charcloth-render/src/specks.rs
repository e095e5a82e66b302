//! What has come off and is too small to be sheet: dark shards, and sparks while they are hot.
//!
//! Model: a particle is a shard of sheet with as much area as it has, of a shape of its own, that turns as it flies and lies
//! flat where it lies; it is dark, and hot ones shine as black bodies do. A shard under a pixel is a speck that covers as
//! much of it, half of its area on average as it tumbles. Sheet in front hides it. Valid
//! when: for pictures. Cost: a few pixels a particle.

use crate::camera::Camera;
use crate::glow::black_body;
use charcloth::frame::Frame;
use charcloth::random::Random;
use glam::{DQuat, DVec2, DVec3, Vec3, Vec3A};
use std::f64::consts::{PI, TAU};

/// Colours of shards that are cold: char, and what is nearly ash.
const COLD: [Vec3; 2] = [Vec3::new(0.022, 0.020, 0.019), Vec3::new(0.11, 0.105, 0.10)];
/// How much hotter its hottest part is than a shard on average, the one whose light is seen [K].
const RIM: f32 = 120.0; // tuned: shards burn at their rims; 0 to 300
/// Corners of a shard.
const CORNERS: usize = 6;
/// How unlike its corners are in their distance from the middle, as a part of it.
const UNEVEN: f64 = 0.55; // tuned: by eye, shards and not discs; 0.3 to 0.7
/// Turns a second, least and most.
const TURNS: [f64; 2] = [1.0, 5.0]; // tuned: flakes flutter at some hertz; 0.5 to 10
/// Points along each side of a pixel that are looked at.
const SAMPLES: usize = 3;

/// The corners of a shard around its middle [m], of an area [m2] and as old as this [s].
fn shard(name: u64, area: f64, age: Option<f64>, up: DVec3) -> [DVec3; CORNERS] {
    let mut random = Random::new(0x7368_6172, name);
    let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
    let lengths: [f64; CORNERS] = std::array::from_fn(|_| between(1.0 - UNEVEN, 1.0 + UNEVEN));
    let turned: [f64; CORNERS] = std::array::from_fn(|k| TAU * (k as f64 + between(-0.35, 0.35)) / CORNERS as f64);
    let flat: [DVec2; CORNERS] = std::array::from_fn(|k| DVec2::from_angle(turned[k]) * lengths[k]);
    let own: f64 = (0..CORNERS).map(|k| 0.5 * flat[k].perp_dot(flat[(k + 1) % CORNERS])).sum();
    let scale = (area / own.abs().max(f64::MIN_POSITIVE)).sqrt();
    let mut axis = || DVec3::new(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)).normalize_or(up);
    let (start, about) = (axis(), axis());
    let (across, along) = match age {
        Some(age) => {
            let turn = DQuat::from_axis_angle(about, TAU * between(TURNS[0], TURNS[1]) * age);
            let (across, along) = start.any_orthonormal_pair();
            (turn * across, turn * along)
        }
        None => up.any_orthonormal_pair(),
    };
    flat.map(|corner| (across * corner.x + along * corner.y) * scale)
}

/// Whether a point is within a polygon, by the sides that a line from it crosses.
fn within(point: DVec2, corners: &[DVec2; CORNERS]) -> bool {
    let mut inside = false;
    for k in 0..CORNERS {
        let (a, b) = (corners[k], corners[(k + 1) % CORNERS]);
        if (a.y > point.y) != (b.y > point.y) && point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y) {
            inside = !inside;
        }
    }
    inside
}

/// Draws the particles of a frame over a picture [W x H, row by row], with the inverse depth [1/m] of what is seen.
pub fn add(frame: &Frame, camera: &Camera, depth: &[f32], picture: &mut [Vec3A]) {
    let particles = &frame.particles;
    let [across, down] = camera.size.map(|size| size as i64);
    for p in 0..particles.mass.len() {
        let (place, area) = (particles.position[p], particles.area[p]);
        let at = camera.project(place);
        if at.inverse_depth <= 0.0 || particles.mass[p] <= 0.0 {
            continue;
        }
        let temperature = particles.temperature[p] as f32;
        let cold = COLD[0].lerp(COLD[1], Random::new(0x746f_6e65, p as u64).uniform() as f32);
        let colour = Vec3A::from(cold + black_body(temperature + RIM));
        // Eq. 17.8: half of the area of a plate that tumbles is seen.
        let pixels = 0.5 * area * (camera.focal_length * at.inverse_depth).powi(2);
        let radius = (pixels / PI).sqrt();
        let age = (particles.lies[p] == 0).then(|| frame.time - particles.birth[p]);
        let middle = DVec2::new(at.x, at.y);
        let corners = shard(p as u64, area, age, camera.up).map(|corner| {
            let seen = camera.project(place + corner);
            if seen.inverse_depth > 0.0 { DVec2::new(seen.x, seen.y) } else { middle }
        });
        let reach = 1 + corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max).ceil() as i64;
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        let hides = (1.0 / (1.0 / at.inverse_depth - area.sqrt())) as f32;
        for row in (y - reach).max(0)..(y + reach + 1).min(down) {
            for column in (x - reach).max(0)..(x + reach + 1).min(across) {
                let corner = DVec2::new(column as f64, row as f64);
                let cover = if radius < 1.0 {
                    // A speck under a pixel wide covers part of it.
                    let away = (corner + 0.5).distance(middle);
                    (radius + 0.5 - away).clamp(0.0, 1.0).min(4.0 * pixels)
                } else {
                    let at = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
                    let samples = (0..SAMPLES * SAMPLES).map(|k| corner + DVec2::new(at(k % SAMPLES), at(k / SAMPLES)));
                    samples.filter(|point| within(*point, &corners)).count() as f64 / (SAMPLES * SAMPLES) as f64
                };
                let pixel = (row * across + column) as usize;
                if depth[pixel] > hides {
                    continue;
                }
                let pixel = &mut picture[pixel];
                *pixel = pixel.lerp(colour, cover as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_has_its_area_whichever_way_it_has_turned() {
        for (name, age) in [(1, None), (2, Some(0.0)), (3, Some(0.7))] {
            let corners = shard(name, 3e-6, age, DVec3::Y);
            let area: DVec3 = (0..CORNERS).map(|k| 0.5 * corners[k].cross(corners[(k + 1) % CORNERS])).sum();
            assert!((area.length() / 3e-6 - 1.0).abs() < 1e-9, "{area}");
            let flat = area.normalize().dot(DVec3::Y).abs() > 1.0 - 1e-12;
            assert_eq!(flat, age.is_none(), "what lies lies flat");
        }
    }
}
