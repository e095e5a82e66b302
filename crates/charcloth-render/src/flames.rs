//! Flames above what gives off gas: soft light that rises from burning nodes, in tongues that lick and sway.
//!
//! Model: each node feeds a tongue by its burn rate; its height is that of a line flame, H = 0.034 m (Q'/1 kW/m)^(2/3)
//! [Yuan1996], over the length that burns. Light is added without regard to what is in front: flames stand on both
//! faces of the sheet. Only frames of models that tell fuel gas from glow have flames. Valid when: for pictures. Cost: three to
//! thirty soft dots a burning node.

use crate::camera::Camera;
use crate::noise::noise;
use charcloth::frame::Frame;
use glam::{DVec3, Vec3, Vec3A};

/// Heat that a kilogram of fuel gas gives, as the height of flames needs it [kW s/kg].
const HEAT: f64 = 14e3;
/// Length over which a sheet burns at a front [m].
const BURNING_LENGTH: f64 = 0.02; // tuned: copper to black of a front upward, 10 to 50 mm
const HEIGHT: [f64; 2] = [0.008, 0.12]; // tuned: flames of thin paper are a few centimetres high
/// Light of a gram a second.
const BRIGHTNESS: f64 = 12e3; // tuned: by eye, bright over the sheet but not white all over
/// Distance between dots along a tongue [m], and most of them.
const SPACING: f64 = 0.003;
const DOTS: f64 = 32.0;

/// Colours from the root of a flame to its tip.
const ROOT: Vec3 = Vec3::new(0.10, 0.16, 0.42);
const MIDDLE: Vec3 = Vec3::new(1.0, 0.62, 0.22);
const TIP: Vec3 = Vec3::new(0.95, 0.30, 0.05);

/// Adds the light of flames to a picture [W x H, row by row].
pub fn add(frame: &Frame, camera: &Camera, light: &mut [Vec3A]) {
    let burn = &frame.burn;
    let time = frame.time as f32;
    for i in 0..burn.len() {
        if burn.burn_rate_full[i] > 0.0 || burn.burn_rate[i] <= 0.0 || burn.flame[i] <= 0.0 {
            continue;
        }
        let flux = burn.burn_rate[i] / burn.area[i].max(f64::MIN_POSITIVE);
        let root = frame.motion.position[i];
        let place = (root - camera.target).as_vec3();
        // Neighbours lick together: tongues are a centimetre or so wide.
        let tongue = noise(place * 90.0 + Vec3::new(0.0, -time * 3.0, time * 2.2));
        let height = 0.034 * (flux * HEAT * BURNING_LENGTH).powf(2.0 / 3.0) * (1.0 + 0.55 * f64::from(tongue));
        let height = height.clamp(HEIGHT[0], HEIGHT[1]);
        let dots = (height / SPACING).ceil().min(DOTS);
        // Dots as wide as they are apart, or a tongue is a string of beads.
        let narrowest = (0.8 * height / dots) as f32;
        let share = (burn.burn_rate[i] * 1e3 * BRIGHTNESS / dots) as f32;
        for k in 0..dots as usize {
            // Dots of neighbours are not at one height.
            let jitter = 0.5 + 0.5 * noise(place * 700.0 + Vec3::splat(k as f32));
            let s = (k as f32 + jitter) / dots as f32;
            let rise = f64::from(s) * height;
            let up = place + camera.up.as_vec3() * rise as f32;
            let wave = up * 45.0 - camera.up.as_vec3() * (time * 9.0);
            let sway = Vec3::new(noise(wave), 0.0, noise(wave + Vec3::splat(17.0))) * (0.22 * s * height as f32);
            let width = 0.0035 * (0.45 + (std::f32::consts::PI * s.sqrt()).sin()) * (1.0 - 0.55 * s);
            let width = width.max(narrowest);
            let colour = if s < 0.18 { ROOT.lerp(MIDDLE, s / 0.18) } else { MIDDLE.lerp(TIP, (s - 0.18) / 0.82) };
            let strength = share * (std::f32::consts::PI * s.powf(0.6)).sin().max(0.0);
            dot(camera, root + camera.up * rise + sway.as_dvec3(), width, (colour * strength).into(), light);
        }
    }
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
