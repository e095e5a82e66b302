//! Light of flames: the soft puffs of [`charcloth::tongues`], blue at the root, yellow, and orange at the tip.
//!
//! Model: puffs are gathered into how much flame there is along the line of sight of each pixel. Where there is any, soot
//! shines as a black body of its temperature (`glow.rs`) does, times the little that so thin a flame emits of that
//! (Eq. 14.4: kappa delta); it is hottest in the body and cools towards the tip, which so turns orange and fades. The foot
//! has no soot yet and is blue. What is in front hides flames; flames hide nothing. Valid when: for pictures. Cost: some
//! hundred pixels a puff.

use crate::camera::Camera;
use crate::glow::black_body;
use charcloth::frame::Frame;
use charcloth::tongues::{Puff, puffs};
use glam::Vec3A;

/// Gas that is burning along a line of sight, an area, at which there is flame [kg/(s m2)].
const DENSE: f32 = 2.2e-3; // tuned: a front gives off some 0.2 g/(m s) for a flame of 6 cm; 1e-3 to 6e-3
/// Part of the light of a black body that a flame emits: 4 1/m times some millimetres.
const EMITS: f32 = 0.02;
/// Temperatures of soot in the body of a flame and at its tip [K].
const BODY: f32 = 1700.0; // tuned: 1650 to 1900, soot in flames of wood and wax
const TIP: f32 = 1400.0; // tuned: 1300 to 1500
/// Light of the blue foot.
const FOOT: Vec3A = Vec3A::new(0.02, 0.045, 0.15);
/// How far behind the middle of a puff a surface hides it, in widths of the puff.
const INTO: f64 = 3.0; // tuned: flames stand on the sheet, some millimetres thick

/// The light of flames, and its buffers.
#[derive(Debug, Clone, Default)]
pub struct Flames {
    /// For each pixel: gas with soot, that times its temperature over that of the tip, gas without soot.
    along: Vec<Vec3A>,
}

fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl Flames {
    /// Adds the light of flames to a picture [W x H, row by row], with the inverse depth [1/m] of what is seen.
    pub fn add(&mut self, frame: &Frame, camera: &Camera, depth: &[f32], light: &mut [Vec3A]) {
        self.along.clear();
        let mut any = false;
        puffs(frame, camera.up, &mut |puff| {
            if !any {
                self.along.resize(light.len(), Vec3A::ZERO);
                any = true;
            }
            self.gather(puff, camera, depth);
        });
        for (pixel, along) in light.iter_mut().zip(&self.along) {
            let [gas, hot, foot] = along.to_array();
            if gas + foot <= 0.0 {
                continue;
            }
            // Thicker flame shines more, but not in proportion: it reaches around itself and lies in folds.
            let there = |gas: f32| {
                let dense = gas / DENSE;
                (1.0 - (-dense * dense).exp()) * (0.35 + 0.65 * dense / (dense + 2.0))
            };
            let temperature = TIP + (BODY - TIP) * hot / gas.max(f32::MIN_POSITIVE);
            *pixel += Vec3A::from(black_body(temperature)) * (EMITS * there(gas)) + FOOT * there(foot);
        }
    }

    /// Adds a puff to what is along each line of sight.
    fn gather(&mut self, puff: &Puff, camera: &Camera, depth: &[f32]) {
        let at = camera.project(puff.place);
        if at.inverse_depth <= 0.0 {
            return;
        }
        let scale = camera.focal_length * at.inverse_depth;
        let radius = (f64::from(puff.width) * scale).max(0.7);
        // A flame under a pixel wide covers part of it.
        let real = (radius / scale) as f32;
        let peak = puff.gas / (std::f32::consts::PI * real * real);
        let soot = smooth(0.01, 0.18, puff.rise);
        let hot = 1.0 - smooth(0.30, 1.0, puff.rise);
        let of_puff = Vec3A::new(peak * soot, peak * soot * hot, peak * (1.0 - soot));
        let hides = (1.0 / (1.0 / at.inverse_depth - INTO * f64::from(puff.width))) as f32;
        let [across, down] = camera.size.map(|size| size as i64);
        let reach = (2.2 * radius).ceil() as i64;
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        for row in (y - reach).max(0)..(y + reach + 1).min(down) {
            for column in (x - reach).max(0)..(x + reach + 1).min(across) {
                let pixel = (row * across + column) as usize;
                if depth[pixel] > hides {
                    continue;
                }
                let away = (column as f64 + 0.5 - at.x).powi(2) + (row as f64 + 0.5 - at.y).powi(2);
                self.along[pixel] += of_puff * (-(away / (radius * radius)) as f32).exp();
            }
        }
    }
}
