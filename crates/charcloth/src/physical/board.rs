//! A board behind the sheet: heat that goes into its depth.
//!
//! Model: Eq. 15.9, conduction into the depth alone, in layers that double in thickness, implicit in time. Source:
//! [Incropera2007]. Valid when: the board is thicker than the layers together (63 times the first) or the times are short.
//! Cost: six layers a node.

use crate::scene::Board as Sizes;
use crate::sheet::BoardNodes;

/// Layers in the depth.
pub const LAYERS: usize = 6;
/// Thickness of the first [m]; each has twice that of the one before. In milliseconds heat gets as deep as half of it,
/// in a minute not through all.
const FIRST: f64 = 0.15e-3;

/// Conductances and capacities per area.
#[derive(Debug, Clone)]
pub struct Board {
    /// From the sheet into the first layer, and from layer to layer [W/(m2 K)].
    conductance: [f64; LAYERS],
    /// Of the layers [J/(m2 K)].
    capacity: [f64; LAYERS],
}

impl Board {
    /// Of a board and the gas between it and the sheet, of this conductivity [W/(m K)].
    pub fn of(sizes: &Sizes, gas_conductivity: f64) -> Self {
        let thickness = |k: usize| FIRST * f64::from(1_u32 << k);
        let half = |k: usize| 0.5 * thickness(k) / sizes.conductivity.0;
        Self {
            conductance: std::array::from_fn(|k| {
                let before = if k == 0 { sizes.gap.0 / gas_conductivity } else { half(k - 1) };
                1.0 / (before + half(k))
            }),
            capacity: std::array::from_fn(|k| thickness(k) * sizes.density.0 * sizes.heat_capacity.0),
        }
    }

    /// A step with a face of this capacity [J/(m2 K)] and temperature [K] before it: temperatures of the layers go on [K],
    /// and what the face gives them comes back [J/m2].
    pub fn advance(&self, face_capacity: f64, face: f64, layers: &mut [f64; LAYERS], dt: f64) -> f64 {
        // From the deepest layer up, each as a straight line of the one above: T = a + b T_above.
        let mut lines = [(0.0, 0.0); LAYERS];
        let mut below = (0.0, 0.0, 0.0);
        for k in (0..LAYERS).rev() {
            let stored = self.capacity[k] / dt;
            let (conductance, a, b) = below;
            let sum = stored + self.conductance[k] + conductance * (1.0 - b);
            lines[k] = ((stored * layers[k] + conductance * a) / sum, self.conductance[k] / sum);
            below = (self.conductance[k], lines[k].0, lines[k].1);
        }
        let (conductance, a, b) = below;
        let stored = face_capacity / dt;
        let after = (stored * face + conductance * a) / (stored + conductance * (1.0 - b));
        let mut above = after;
        for (layer, (a, b)) in layers.iter_mut().zip(lines) {
            *layer = a + b * above;
            above = *layer;
        }
        dt * conductance * (after - layers[0])
    }
}

/// Temperatures of the layers under a node [K].
pub fn layers(nodes: &BoardNodes, i: usize) -> [f64; LAYERS] {
    [&nodes.layer_1, &nodes.layer_2, &nodes.layer_3, &nodes.layer_4, &nodes.layer_5, &nodes.layer_6]
        .map(|column| column[i])
}

/// Puts them back.
pub fn set_layers(nodes: &mut BoardNodes, i: usize, layers: &[f64; LAYERS]) {
    let BoardNodes { layer_1, layer_2, layer_3, layer_4, layer_5, layer_6, .. } = nodes;
    for (column, layer) in [layer_1, layer_2, layer_3, layer_4, layer_5, layer_6].into_iter().zip(layers) {
        column[i] = *layer;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Conductivity, Density, Length, SpecificHeat};

    #[test]
    fn a_face_held_hot_gives_as_much_as_a_half_space_takes() {
        let sizes = Sizes {
            conductivity: Conductivity(0.12),
            density: Density(740.0),
            heat_capacity: SpecificHeat(1000.0),
            gap: Length(0.0),
        };
        let board = Board::of(&sizes, 0.03);
        let mut layers = [300.0; LAYERS];
        let (mut given, dt) = (0.0, 0.002);
        for step in 1..=5000 {
            given += board.advance(1e12, 400.0, &mut layers, dt);
            if step == 500 || step == 5000 {
                // 2 e dT sqrt(t/pi) with e = sqrt(k rho c) [Incropera2007].
                let effusivity = (0.12_f64 * 740.0 * 1000.0).sqrt();
                let exact = 2.0 * effusivity * 100.0 * (f64::from(step) * dt / std::f64::consts::PI).sqrt();
                // Layers that double are coarse at any time: 5 % is theirs.
                assert!((given / exact - 1.0).abs() < 0.06, "{given} of {exact} J/m2 after {step} steps");
            }
        }
        let stored: f64 = layers.iter().zip(board.capacity).map(|(t, c)| (t - 300.0) * c).sum();
        assert!((stored / given - 1.0).abs() < 1e-9);
    }
}
