//! Light of flames: the soft puffs of [`charcloth::tongues`], blue at the root, white-yellow, and red at the tip.
//!
//! Light is added without regard to what is in front: flames stand on both faces of the sheet.

use crate::camera::Camera;
use charcloth::frame::Frame;
use charcloth::tongues::puffs;
use glam::{DVec3, Vec3, Vec3A};

/// Light of a gram a second.
const BRIGHTNESS: f32 = 12e3; // tuned: by eye, bright over the sheet but not white all over

/// Colours from the root of a flame to its tip.
const ROOT: Vec3 = Vec3::new(0.10, 0.16, 0.42);
const MIDDLE: Vec3 = Vec3::new(1.0, 0.62, 0.22);
const TIP: Vec3 = Vec3::new(0.95, 0.30, 0.05);

/// Adds the light of flames to a picture [W x H, row by row].
pub fn add(frame: &Frame, camera: &Camera, light: &mut [Vec3A]) {
    puffs(frame, camera.up, &mut |puff| {
        let s = puff.rise;
        let colour = if s < 0.18 { ROOT.lerp(MIDDLE, s / 0.18) } else { MIDDLE.lerp(TIP, (s - 0.18) / 0.82) };
        dot(camera, puff.place, puff.width, (colour * (puff.gas * 1e3 * BRIGHTNESS)).into(), light);
    });
}

/// A soft dot of light at a place [m], of a width [m].
fn dot(camera: &Camera, place: DVec3, width: f32, light: Vec3A, picture: &mut [Vec3A]) {
    let at = camera.project(place);
    if at.inverse_depth <= 0.0 {
        return;
    }
    let radius = (f64::from(width) * camera.focal_length * at.inverse_depth).max(0.7);
    let [across, down] = camera.size.map(|size| size as i64);
    let reach = (2.2 * radius).ceil() as i64;
    let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
    // The same light in all, however many pixels it falls on: a gram a second shines alike near and far.
    let pixel = 1e-3 * camera.focal_length * at.inverse_depth;
    let peak = (16.0 * pixel * pixel / (std::f64::consts::PI * radius * radius)) as f32;
    for row in (y - reach).max(0)..(y + reach + 1).min(down) {
        for column in (x - reach).max(0)..(x + reach + 1).min(across) {
            let away = (column as f64 + 0.5 - at.x).powi(2) + (row as f64 + 0.5 - at.y).powi(2);
            let fall = (-(away / (radius * radius)) as f32).exp();
            picture[(row * across + column) as usize] += light * (peak * fall);
        }
    }
}
