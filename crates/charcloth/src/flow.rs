//! What gives way without parting: fibre flows while it breaks down, and sheet that is bent too sharply keeps a crease.
//!
//! Model: while its chains fall apart, the elastic strain of a triangle is lost at a rate that goes with that of charring
//! (Eq. 17.10): the chains break some thirty times as fast as they turn into gas and char [Bradbury1979], so it is all but
//! without tension, in whatever shape it is held, until its last tenth hardens as char. Bending past what the fibre bears stays (Eq. 17.11), the
//! perfectly plastic hinge. What has flowed is part of the rest shape, which is state. Valid when: the sheet is thin, and
//! char that has formed is brittle (`crack.rs`). Cost: one pass over the triangles a step.

use crate::effects::SpringFactors;
use crate::material::Material;
use crate::scene::Scene;
use crate::sheet::SheetState;
use crate::shell::Shell;
use crate::shell::membrane::MembraneStiffness;
use glam::DVec3;

/// Rate at which chains of cellulose break over that at which they turn into gas and char, where sheet burns.
// tuned: the ratio of the rates of [Bradbury1979] is 36 to 37 at 700 K; 8 (at 600 K) to 65 (at 750 K)
const CHAINS_BREAK: f64 = 33.0;
/// Part of its fibre under which a triangle is char, which flows no more. What it still shrinks by pulls, and cracks it.
const CHAR: f64 = 0.1; // tuned: a tenth of the shrinkage, some 2 % of strain, is left to pull; 0.02 to 0.2
/// How far a triangle may flow: longer, shorter, and in shear.
// tuned: twice what char shrinks by, so that a side never turns over; 0.25 to 0.5
const LONGER: f64 = 0.5;
const SHORTER: f64 = -0.15;
const SHEARED: f64 = 0.2;

/// What flows and creases in a scene.
pub struct Flow {
    /// Membrane of the whole sheet [N/m].
    whole: MembraneStiffness,
    /// Curvature that whole sheet bears and comes back from [1/m].
    crease: f64,
}

impl Flow {
    /// Of a scene with a material.
    pub fn of(scene: &Scene, material: &Material) -> Self {
        let strain = material.mechanics.crease_strain.as_ref().map_or(f64::INFINITY, |strain| strain.value.0);
        let thickness = scene.shell.thickness.0;
        Self { whole: MembraneStiffness::of(&scene.shell), crease: 2.0 * strain / thickness }
    }

    /// Lets flow what has burnt since the last step, and what is bent too far; to be called after a step of motion.
    pub fn advance(&self, state: &mut SheetState, shell: &Shell, factors: &mut SpringFactors) {
        factors.kept.clear();
        factors.kept.resize(state.triangles.len(), 1.0);
        let creases = self.crease.is_finite();
        for (k, t) in shell.triangles().iter().enumerate() {
            let t = *t as usize;
            let (before, left) = (state.rest.fibre[t], factors.fibre.get(t).copied().unwrap_or(1.0));
            let burns = left < before && before > CHAR;
            // What is flat and whole creases nowhere.
            if !burns && (!creases || left <= CHAR) {
                continue;
            }
            state.rest.fibre[t] = left.min(before);
            let free = factors.free_curvature.get(t).copied().unwrap_or_default().extend(0.0);
            let bent = shell.curvature(k, &state.motion.position) - state.rest.curvature[t] - free;
            let mut kept = 1.0;
            if burns {
                kept = (left.max(CHAR) / before).powf(CHAINS_BREAK); // Eq. 17.10
                let strain = self.strain(shell.tension(k), factors.triangle[t] * state.rest.thickness[t]);
                // Strain counts from the shape that has shrunk and flowed.
                let free = factors.free_strain.get(t).copied().unwrap_or_default();
                let flow = &mut state.rest.flow[t];
                let scale = 1.0 + 0.5 * (free.x + free.y + flow.x + flow.y);
                let low = DVec3::new(SHORTER, SHORTER, -SHEARED);
                let high = DVec3::new(LONGER, LONGER, SHEARED);
                *flow = (*flow + strain * (scale * (1.0 - kept))).clamp(low, high);
                state.rest.curvature[t] += bent * (1.0 - kept);
            }
            factors.kept[t] = kept;
            // Eq. 17.11: only what is still fibre creases.
            let (sharp, bears) = (kept * greatest(bent), self.crease / state.rest.thickness[t]);
            if sharp > bears {
                state.rest.curvature[t] += bent * (left * (kept - bears / greatest(bent)));
            }
        }
    }

    /// Elastic strain under a tension [N/m] of sheet so many times as stiff as the whole: along, across, and half the shear angle.
    fn strain(&self, [along, across, shear]: [f64; 3], left: f64) -> DVec3 {
        if left <= 0.0 {
            return DVec3::ZERO;
        }
        let MembraneStiffness { q11, q22, q12, q66 } = self.whole;
        let determinant = q11 * q22 - q12 * q12;
        let (e11, e22) = ((q22 * along - q12 * across) / determinant, (q11 * across - q12 * along) / determinant);
        DVec3::new(e11, e22, 0.5 * shear / q66) / left
    }
}

/// Greatest size of a principal curvature, of (xx, yy, 2 xy) [1/m].
fn greatest(curvature: DVec3) -> f64 {
    let (mean, half) = (0.5 * (curvature.x + curvature.y), 0.5 * (curvature.x - curvature.y));
    mean.abs() + half.hypot(0.5 * curvature.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn principal_curvatures_do_not_depend_on_the_axes() {
        // A cylinder of radius 10 mm, and the same turned by 45 degrees: xx = yy = xy = 50.
        assert_eq!(greatest(DVec3::new(100.0, 0.0, 0.0)), 100.0);
        assert_eq!(greatest(DVec3::new(50.0, 50.0, 100.0)), 100.0);
        assert_eq!(greatest(DVec3::new(0.0, -100.0, 0.0)), 100.0);
    }

    #[test]
    fn the_strain_under_a_tension_is_that_of_the_moduli() {
        let scene = Scene::default();
        let flow = Flow { whole: MembraneStiffness::of(&scene.shell), crease: 1.0 };
        let MembraneStiffness { q11, q22, q12, q66 } = flow.whole.scaled(0.5);
        let strain = DVec3::new(1e-3, -2e-3, 5e-4);
        let tension = [q11 * strain.x + q12 * strain.y, q12 * strain.x + q22 * strain.y, 2.0 * q66 * strain.z];
        assert!(flow.strain(tension, 0.5).abs_diff_eq(strain, 1e-15));
        assert_eq!(flow.strain(tension, 0.0), DVec3::ZERO);
    }
}
