//! A made-up burning sheet, for tests and for looking at the looks: an A4 sheet with a fire that has come some way from
//! its lower right corner. No physics: distances from a wandering front give temperature, fuel and rate.

use charcloth::frame::Frame;
use charcloth::noise::fractal;
use charcloth::sheet::{BurnNodes, MotionNodes, Triangles, bounds};
use glam::{DVec3, Vec3};

/// Width and height of the sheet [m].
const SIDES: [f64; 2] = [0.210, 0.297];
/// Depth of the burning band, from ignition to nothing left [m].
const BAND: f64 = 0.004;

fn wobble(x: f64, y: f64, width: f64, seed: f32) -> f64 {
    f64::from(fractal(Vec3::new((x / width) as f32 + seed, (y / width) as f32, seed * 0.7), 3, 0.5))
}

/// The sheet with its fire `reached` metres from the corner, of triangles with sides of about `spacing` metres.
pub fn sheet(spacing: f64, reached: f64) -> Frame {
    let columns = (SIDES[0] / spacing).round().max(2.0) as usize;
    let rows = (SIDES[1] / (spacing * 0.866)).round().max(2.0) as usize;
    let count = (columns + 1) * (rows + 1);
    let mut motion = MotionNodes::zeros(count);
    let mut burn = BurnNodes::zeros(count);
    let cell = [SIDES[0] / columns as f64, SIDES[1] / rows as f64];
    for j in 0..=rows {
        for i in 0..=columns {
            let k = j * (columns + 1) + i;
            let border = i == 0 || j == 0 || i == columns || j == rows;
            let (mut u, mut v) = (i as f64 * cell[0], j as f64 * cell[1]);
            if !border {
                u += cell[0] * (if j % 2 == 0 { 0.25 } else { -0.25 });
                u += cell[0] * 0.28 * wobble(u, v, spacing * 0.7, 3.0);
                v += cell[1] * 0.28 * wobble(u, v, spacing * 0.7, 8.0);
            }
            let from_corner = (SIDES[0] - u).hypot(v * 0.72);
            // How far the fire has passed this point; less than 0 before it.
            let passed = reached - from_corner + 0.016 * wobble(u, v, 0.05, 1.0) + 0.003 * wobble(u, v, 0.009, 5.0);
            let near = (-(passed.min(0.0) / 0.018).powi(2)).exp();
            let curl = (passed.max(-0.03) + 0.03).powi(2) * 6.0 * (0.8 + 0.5 * wobble(u, v, 0.06, 2.0));
            let bend = 0.012 * (u / SIDES[0] * 5.0 + v * 4.0).sin() * (1.2 - v / SIDES[1]);
            let wrinkle = 0.0035 * near * wobble(u, v, 0.012, 6.0);
            motion.rest_position[k] = DVec3::new(u - SIDES[0] / 2.0, v - SIDES[1] / 2.0, 0.0);
            motion.position[k] =
                motion.rest_position[k] + DVec3::new(-curl * 0.5, curl * 0.6, bend + curl * 1.6 + wrinkle);
            motion.alive[k] = 1;
            let area = cell[0] * cell[1];
            burn.area[k] = area;
            burn.fuel_initial[k] = 0.08 * area * (1.0 + 0.08 * wobble(u, v, 0.004, 9.0));
            burn.fuel[k] = burn.fuel_initial[k] * (1.0 - passed / BAND).clamp(0.0, 1.0);
            burn.burn_rate_full[k] = burn.fuel_initial[k] / 1.5;
            burn.heat_capacity[k] = 1300.0 * burn.fuel_initial[k];
            burn.ignited_at[k] = -1.0;
            burn.temperature[k] =
                293.15 + 330.0 * (passed.min(0.0) / 0.0016).exp() + 580.0 * (passed / BAND).clamp(0.0, 1.0);
            burn.peak_temperature[k] = burn.temperature[k];
            if passed > 0.0 {
                burn.ignited_at[k] = 0.0;
                if burn.fuel[k] > 0.0 {
                    burn.burn_rate[k] = burn.burn_rate_full[k];
                }
            }
        }
    }
    let mut triangles = Triangles::default();
    for j in 0..rows {
        for i in 0..columns {
            let a = (j * (columns + 1) + i) as u32;
            let (b, c, d) = (a + 1, a + columns as u32 + 1, a + columns as u32 + 2);
            let halves = if j % 2 == 0 { [[a, b, c], [b, d, c]] } else { [[a, b, d], [a, d, c]] };
            for corners in halves {
                triangles.corners.push(corners);
                triangles.uv.push(Default::default());
                triangles.source_face.push(0);
                triangles.sheet.push(0);
                triangles.rest_area.push(cell[0] * cell[1] / 2.0);
                triangles.alive.push(u8::from(corners.iter().any(|k| burn.fuel[*k as usize] > 0.0)));
                triangles.piece.push(0);
                triangles.parted.push(0);
            }
        }
    }
    Frame { number: 0, time: reached / 0.03, motion, burn, triangles, ..Frame::default() }
}

/// Lowest and highest corner of the sheet before it burns [m].
pub fn start_bounds(frame: &Frame) -> (DVec3, DVec3) {
    bounds(&frame.motion.rest_position)
}
