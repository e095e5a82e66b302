//! Heat curls the sheet.
//!
//! Model: F_i = k5 (T_i - T_ambient) N_i (Eq. 8.1), or k5 l |grad T| N_i (Eq. 8.2), k5 a pressure per kelvin times the area
//! of the node. Source: the 2004 sketch says only "external curling forces normal to the particle"; the laws are ours.
//! Valid when: as a knob; curl that follows from the two faces of the sheet is physics of its own. Cost: one pass over
//! the nodes, and over the triangles for the gradient.

use super::{Effect, Forces, Now};
use crate::scene::{CurlLaw, Model, Scene};

struct Curl {
    gradient: bool,
    /// [Pa/K]
    pressure: f64,
    /// k5 [N/K], the same for every node.
    raw: Option<f64>,
    /// Length that makes a temperature difference of a gradient [m].
    gradient_length: f64,
    /// [K]
    ambient: f64,
}

/// The scene's curl; none with `law = "off"`.
pub fn build(scene: &Scene) -> Option<Box<dyn Effect>> {
    if scene.model == Model::Physical {
        return None;
    }
    let curl = &scene.curl;
    if curl.law == CurlLaw::Off || !scene.mechanics.moves {
        return None;
    }
    Some(Box::new(Curl {
        gradient: curl.law == CurlLaw::Gradient,
        pressure: curl.pressure.0,
        raw: scene.fire.raw.as_ref().and_then(|raw| raw.k5).map(|k5| k5.0),
        gradient_length: curl.gradient_length.0,
        ambient: scene.fire.ambient_temperature.0,
    }))
}

impl Effect for Curl {
    fn add_forces(&self, now: &Now<'_>, forces: &mut Forces) {
        let burn = &now.state.burn;
        let gradient = self.gradient.then(|| gradient_sizes(now));
        for i in 0..forces.force.len() {
            let k5 = self.raw.unwrap_or(self.pressure * now.area[i]);
            let difference = match &gradient {
                Some(gradient) => gradient[i] * self.gradient_length, // Eq. 8.2
                None => burn.temperature[now.state.burn_node(i)] - self.ambient, // Eq. 8.1
            };
            forces.force[i] += now.normal[i] * (k5 * difference);
        }
    }
}

/// Size of the temperature gradient in the sheet at each node: the mean over its triangles, by area [K/m].
fn gradient_sizes(now: &Now<'_>) -> Vec<f64> {
    let (triangles, motion) = (&now.state.triangles, &now.state.motion);
    let (mut sum, mut weight) = (vec![0.0; motion.len()], vec![0.0; motion.len()]);
    for t in 0..triangles.len() {
        if triangles.alive[t] == 0 {
            continue;
        }
        let corners = triangles.corners[t].map(|i| i as usize);
        let [a, b, c] = corners.map(|i| motion.position[i]);
        let [ta, tb, tc] = corners.map(|i| now.state.burn.temperature[now.state.burn_node(i)]);
        let normal = (b - a).cross(c - a);
        let twice_area_squared = normal.length_squared().max(f64::MIN_POSITIVE);
        // Linear interpolation: grad T = sum T_k (n x opposite edge) / (2 A)^2
        let gradient = normal.cross((c - b) * ta + (a - c) * tb + (b - a) * tc) / twice_area_squared;
        for i in corners {
            sum[i] += gradient.length() * triangles.rest_area[t];
            weight[i] += triangles.rest_area[t];
        }
    }
    for (sum, weight) in sum.iter_mut().zip(weight) {
        *sum /= f64::max(weight, f64::MIN_POSITIVE);
    }
    sum
}
