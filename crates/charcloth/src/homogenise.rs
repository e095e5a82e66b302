//! From what burns to what moves: how fuel left on the burn mesh weakens the motion mesh, and the mass that it carries.
//!
//! Model: K/K0 = r + (1 - r) (m_i + m_j)/(m_i0 + m_j0), Eq. 7.1; a spring under a thousandth of its stiffness counts as
//! broken. On a finer burn mesh each motion triangle has a stiffness along each of its sides: the harmonic mean along a
//! row of burn triangles, since they pull in series, and the mean over rows, which pull side by side (Eq. 7.2). So a
//! hairline that has burnt through cuts, and a hole inside a triangle weakens it. Source: the 2004 sketch, S7
//! [Moidu2004]; bounds in series and in parallel [Hill1952]. The floor r for char is ours and 0 unless a scene
//! sets it. Cost: one pass over springs, and over the burn triangles where there are any.

use crate::burn_mesh::BurnMap;
use crate::effects::SpringFactors;
use crate::physical::Physical;
use crate::sheet::{BurnNodes, NONE, SheetState};

/// Part of its stiffness under which a spring counts as broken.
pub const BROKEN_BELOW: f64 = 1e-3;

/// The same in the physical model, where char that has nearly burnt away still hangs together.
pub const NOTHING_LEFT: f64 = 1e-5; // tuned: under the least of char, 1.2e-5, and over that of a gap; 5e-6 to 1.2e-5

/// Part of its stiffness that burning has left of what lies between some burn nodes, 1 for the unburnt sheet (Eq. 7.1).
#[inline]
pub fn stiffness_left<const N: usize>(burn: &BurnNodes, nodes: [usize; N], residual: f64) -> f64 {
    let fuel: f64 = nodes.iter().map(|i| burn.fuel[*i]).sum();
    let initial: f64 = nodes.iter().map(|i| burn.fuel_initial[*i]).sum();
    residual + (1.0 - residual) * (fuel / initial)
}

/// Part of its stiffness that burning has left of what lies between some burn nodes.
#[inline]
fn left<const N: usize>(state: &SheetState, nodes: [usize; N], residual: f64) -> f64 {
    if state.has_faces() {
        // Eq. 15.4: the chemistry says what each node has left.
        nodes.iter().map(|i| state.burn.stiffness[*i]).sum::<f64>() / N as f64
    } else {
        stiffness_left(&state.burn, nodes, residual)
    }
}

/// Gathers at each motion node the mass of what burns there.
pub fn carry_mass(state: &mut SheetState, map: &BurnMap) {
    let mass = if state.has_faces() { &state.burn.mass } else { &state.burn.fuel };
    let speed = &state.burn.speed;
    map.gather(&state.motion.burn_node, |i| speed[i] * mass[i], &mut state.motion.carried_mass);
}

/// Brings the columns of the burn nodes that pictures see up to date, in the 2004 model: what has burnt is char and ash
/// in one.
pub fn show(state: &mut SheetState) {
    let BurnNodes { fuel, fuel_initial, mass, charred, ashed, stiffness, .. } = &mut state.burn;
    for i in 0..fuel.len() {
        let left = fuel[i] / fuel_initial[i];
        mass[i] = fuel[i];
        charred[i] = 1.0 - left;
        ashed[i] = 1.0 - left;
        stiffness[i] = left;
    }
}

/// Cuts away what has burnt through on a finer burn mesh: triangles that have an edge with a thousandth of its fuel left.
/// Returns whether any has.
pub fn burn_through(state: &mut SheetState, residual_stiffness: f64) -> bool {
    let faces = state.has_faces();
    let SheetState { burn, burn_triangles: fine, triangles, motion, .. } = state;
    let mut fresh = false;
    if faces && fine.is_empty() {
        for t in 0..triangles.len() {
            let nodes = triangles.corners[t].map(|i| motion.burn_node[i as usize] as usize);
            if triangles.alive[t] != 0 && !Physical::holds(burn, nodes) {
                triangles.alive[t] = 0;
                fresh = true;
            }
        }
    }
    for t in 0..fine.len() {
        if fine.alive[t] == 0 {
            continue;
        }
        let [a, b, c] = fine.corners[t].map(|i| i as usize);
        if faces {
            if !Physical::holds(burn, [a, b, c]) {
                fine.alive[t] = 0;
                fresh = true;
            }
            continue;
        }
        let weakest = [[a, b], [b, c], [c, a]].map(|ends| stiffness_left(burn, ends, residual_stiffness));
        if weakest.into_iter().fold(f64::INFINITY, f64::min) < BROKEN_BELOW {
            fine.alive[t] = 0;
            fresh = true;
        }
    }
    fresh
}

/// Sets the stiffness factor of every spring and triangle, clears the tensions, and marks springs that have burnt
/// through as broken. Returns whether any has. What a finer burn mesh has left is worked out only if it is `fresh`.
pub fn factors(state: &mut SheetState, residual_stiffness: f64, fresh: bool, factors: &mut SpringFactors) -> bool {
    let count = state.springs.len();
    factors.stiffness.clear();
    for column in [&mut factors.tension, &mut factors.drag] {
        column.clear();
        column.resize(count, 0.0);
    }
    if state.has_fine_burn_mesh() {
        if fresh {
            of_fine_triangles(state, residual_stiffness, factors);
        }
    } else {
        factors.sides.clear();
        factors.triangle.clear();
        factors.triangle.extend(state.triangles.corners.iter().map(|corners| {
            let nodes = corners.map(|i| state.burn_node(i as usize));
            left(state, nodes, residual_stiffness)
        }));
    }
    let mut any_broken = false;
    let broken_below = if state.has_faces() { NOTHING_LEFT } else { BROKEN_BELOW };
    for s in 0..count {
        let SheetState { springs, triangles, .. } = &*state;
        if springs.broken[s] != 0 {
            factors.stiffness.push(0.0);
            continue;
        }
        let factor = if factors.sides.is_empty() {
            left(state, springs.ends[s].map(|end| state.burn_node(end as usize)), residual_stiffness)
        } else {
            let carriers = springs.carriers[s].into_iter().filter(|t| *t != NONE).map(|t| t as usize);
            let of_carrier = |t: usize| {
                let side = triangles.corners[t].iter().position(|i| !springs.ends[s].contains(i));
                // A spring that crosses a triangle goes along none of its sides.
                match side {
                    Some(side) if springs.needs_both[s] == 0 => factors.sides[t][side],
                    _ => factors.triangle[t],
                }
            };
            let live = carriers.filter(|t| triangles.alive[*t] != 0);
            let (sum, number) = live.fold((0.0, 0.0), |(sum, number), t| (sum + of_carrier(t), number + 1.0));
            if number > 0.0 { sum / number } else { 0.0 }
        };
        if factor < broken_below {
            state.springs.broken[s] = 1;
            any_broken = true;
            factors.stiffness.push(0.0);
        } else {
            factors.stiffness.push(factor);
        }
    }
    any_broken
}

/// Stiffness left of each motion triangle along each of its sides, by the burn triangles that it carries (Eq. 7.2); the
/// least of the three for what knows no sides.
fn of_fine_triangles(state: &SheetState, residual: f64, factors: &mut SpringFactors) {
    let SheetState { burn_triangles: fine, triangles, .. } = state;
    factors.sides.clear();
    factors.sides.resize(triangles.len(), [0.0; 3]);
    factors.triangle.clear();
    let burn = &state.burn;
    let (faces, exact) = (state.has_faces(), residual + (1.0 - residual) == 1.0);
    let is_whole = |i: usize| {
        if faces { burn.stiffness[i] == 1.0 } else { exact && burn.fuel[i] == burn.fuel_initial[i] }
    };
    let mut t = 0;
    for (parent, sides) in factors.sides.iter_mut().enumerate() {
        let first = t;
        while t < fine.len() && fine.parent[t] as usize == parent {
            t += 1;
        }
        let carried = first..t;
        // Nothing has burnt of most: all that follows would come to 1 exactly.
        if t > first
            && carried.clone().all(|t| fine.alive[t] != 0 && fine.corners[t].iter().all(|i| is_whole(*i as usize)))
        {
            *sides = [1.0; 3];
            factors.triangle.push(1.0);
            continue;
        }
        let cuts = ((t - first) as f64).sqrt().round().max(1.0);
        // Sum of compliance and number of triangles of each row along each side; the rows count from the corner opposite.
        let mut rows = [[(0.0f64, 0.0f64); 1 << crate::burn_mesh::FINEST]; 3];
        for t in carried {
            let nodes = fine.corners[t].map(|i| i as usize);
            let stiffness = if fine.alive[t] != 0 { left(state, nodes, residual) } else { 0.0 };
            let middle = (fine.place[t][0] + fine.place[t][1] + fine.place[t][2]).as_dvec2() / 3.0;
            let towards = [1.0 - middle.x - middle.y, middle.x, middle.y];
            for side in 0..3 {
                let row = ((1.0 - towards[side]) * cuts) as usize;
                let row = &mut rows[side][row.min(rows[side].len() - 1)];
                // Less than a thousandth is none; a row with a gap has no stiffness to speak of.
                row.0 += 1.0 / stiffness.max(1e-6);
                row.1 += 1.0;
            }
        }
        for side in 0..3 {
            let (mut sum, mut number) = (0.0, 0.0);
            for (compliance, count) in rows[side].into_iter().filter(|(_, count)| *count > 0.0) {
                sum += count * (count / compliance);
                number += count;
            }
            sides[side] = if number > 0.0 { sum / number } else { 0.0 };
        }
        factors.triangle.push(sides[0].min(sides[1]).min(sides[2]));
    }
}
