//! From what burns to what moves: how fuel left on the burn mesh weakens the springs of the motion mesh.
//!
//! Model: K/K0 = r + (1 - r) (m_i + m_j)/(m_i0 + m_j0), Eq. 7.1; a spring under a thousandth of its stiffness counts as
//! broken. Source: the 2004 sketch, S7 [Moidu2004]. The floor r for char is ours and 0 unless a scene sets it. Cost: one
//! pass over the springs.

use crate::effects::SpringFactors;
use crate::sheet::{BurnNodes, SheetState};

/// Part of its stiffness under which a spring counts as broken.
pub const BROKEN_BELOW: f64 = 1e-3;

/// Part of its stiffness that burning has left of what lies between some burn nodes, 1 for the unburnt sheet (Eq. 7.1).
#[inline]
pub fn stiffness_left<const N: usize>(burn: &BurnNodes, nodes: [usize; N], residual: f64) -> f64 {
    let fuel: f64 = nodes.iter().map(|i| burn.fuel[*i]).sum();
    let initial: f64 = nodes.iter().map(|i| burn.fuel_initial[*i]).sum();
    residual + (1.0 - residual) * (fuel / initial)
}

/// Sets the stiffness factor of every spring, clears the tensions, and marks springs that have burnt through as broken.
/// Returns whether any has.
pub fn spring_factors(state: &mut SheetState, residual_stiffness: f64, factors: &mut SpringFactors) -> bool {
    let SheetState { springs, burn, map, .. } = state;
    let count = springs.len();
    factors.stiffness.clear();
    for column in [&mut factors.tension, &mut factors.drag] {
        column.clear();
        column.resize(count, 0.0);
    }
    let mut any_broken = false;
    for s in 0..count {
        if springs.broken[s] != 0 {
            factors.stiffness.push(0.0);
            continue;
        }
        let factor = stiffness_left(burn, springs.ends[s].map(|end| map.burn_node(end as usize)), residual_stiffness);
        if factor < BROKEN_BELOW {
            springs.broken[s] = 1;
            any_broken = true;
            factors.stiffness.push(0.0);
        } else {
            factors.stiffness.push(factor);
        }
    }
    any_broken
}
