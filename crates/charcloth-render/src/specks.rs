//! What has come off and is too small to be sheet: dark specks, and sparks while they are hot.
//!
//! Model: a particle covers as much of a pixel as its area does, half of it on average as it tumbles; it is dark, and hot
//! ones shine in the colour of embers. Specks are drawn over the sheet, before and behind it alike. Valid when: for
//! pictures. Cost: a few pixels a particle.

use crate::camera::Camera;
use charcloth::frame::Frame;
use glam::{Vec3, Vec3A};

/// Colour of specks that are cold, between char and ash.
const COLD: Vec3 = Vec3::new(0.035, 0.032, 0.030);
/// Temperature from which they shine, and from which they do so fully [K].
const SHINES: [f32; 2] = [750.0, 900.0]; // tuned: char is seen to glow in a dim room from 500 degC on

/// Draws the particles of a frame over a picture [W x H, row by row]; `ember` is the colour of a temperature [K].
pub fn add(frame: &Frame, camera: &Camera, picture: &mut [Vec3A], ember: impl Fn(f32) -> Vec3) {
    let particles = &frame.particles;
    let [across, down] = camera.size.map(|size| size as i64);
    for p in 0..particles.mass.len() {
        let at = camera.project(particles.position[p]);
        if at.inverse_depth <= 0.0 || particles.mass[p] <= 0.0 {
            continue;
        }
        // Eq. 17.8: half of the area of a plate that tumbles is seen.
        let pixels = 0.5 * particles.area[p] * (camera.focal_length * at.inverse_depth).powi(2);
        let radius = (pixels / std::f64::consts::PI).sqrt();
        let temperature = particles.temperature[p] as f32;
        let shine = ((temperature - SHINES[0]) / (SHINES[1] - SHINES[0])).clamp(0.0, 1.0);
        let colour = Vec3A::from(COLD.lerp(ember(temperature), shine));
        let reach = (radius + 1.0).ceil() as i64;
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        for row in (y - reach).max(0)..(y + reach + 1).min(down) {
            for column in (x - reach).max(0)..(x + reach + 1).min(across) {
                let away = (column as f64 + 0.5 - at.x).hypot(row as f64 + 0.5 - at.y);
                // A speck under a pixel wide covers part of it.
                let cover = (radius + 0.5 - away).clamp(0.0, 1.0).min(4.0 * pixels) as f32;
                let pixel = &mut picture[(row * across + column) as usize];
                *pixel = pixel.lerp(colour, cover);
            }
        }
    }
}
