//! Heat pulls the sheet together.
//!
//! Model: F_i = sum_j k4 (T_j - T_i)/d_ij n_ij (literal, Eq. 6.3a), or a tension k4 (mean T - T_ambient)/d_ij K/K0 along
//! the edge (pairwise, Eq. 6.3b), with k4 = K0 d^2 alpha. Source: the 2004 sketch, first term of S6 [Moidu2004]; the
//! pairwise form is ours, because the literal one conserves no momentum. Cost: one pass over the structural springs.

use super::{Effect, Now, SpringFactors};
use crate::scene::{Model, Scene, ThermalForceLaw};
use crate::sheet::SpringKind;

struct ThermalForce {
    literal: bool,
    /// alpha [1/K], where k4 is not given raw.
    contraction: f64,
    /// k4 [N m/K], the same for every edge.
    raw: Option<f64>,
    /// [K]
    ambient: f64,
}

/// The scene's thermal force; none with `law = "off"`.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    if scene.model == Model::Physical {
        return None;
    }
    if scene.thermal_force.law == ThermalForceLaw::Off || !scene.mechanics.moves {
        return None;
    }
    Some(Box::new(ThermalForce {
        literal: scene.thermal_force.law == ThermalForceLaw::Literal,
        contraction: scene.thermal_force.contraction.0,
        raw: scene.fire.raw.as_ref().and_then(|raw| raw.k4).map(|k4| k4.0),
        ambient: scene.fire.ambient_temperature.0,
    }))
}

impl Effect for ThermalForce {
    fn add_tension(&self, now: &Now<'_>, factors: &mut SpringFactors) {
        let springs = &now.state.springs;
        let temperature = &now.state.burn.temperature;
        for s in 0..springs.len() {
            if springs.kind[s] != SpringKind::Structural as u8 || springs.broken[s] != 0 {
                continue;
            }
            let [i, j] = springs.ends[s].map(|end| temperature[now.state.burn_node(end as usize)]);
            let distance = springs.rest_length[s];
            let k4 = self.raw.unwrap_or(springs.stiffness[s] * distance * distance * self.contraction);
            if self.literal {
                factors.drag[s] += k4 * (j - i) / distance; // Eq. 6.3a
            } else {
                factors.tension[s] += k4 * (0.5 * (i + j) - self.ambient) / distance * factors.stiffness[s]; // Eq. 6.3b
            }
        }
    }
}
