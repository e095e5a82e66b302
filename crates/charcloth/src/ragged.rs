//! Burn nodes put aside, so that what parts along the sides of motion triangles is ragged.
//!
//! Model: each burn node that is halfway between two others of the next coarser level lies beside their middle by a random
//! part of their distance, which makes sides random curves [Fournier1982] that both triangles share. A crack along a side of
//! the mesh that moves so leaves edges that fit each other and are as ragged as the burn mesh is fine. Edges of the sheet stay
//! straight. Heat is conducted as between the nodes in line. Valid when: for what is seen and where it is; a node is off by a
//! fifth of the distance to its neighbours at most a level. Cost: once, when the sheet is built.

use crate::burn_mesh::Refined;
use crate::random::Random;
use crate::sheet::NONE;
use glam::{DMat2, DVec2, Vec2};

/// How far a node lies aside, as a part of the distance to the two that it lies between.
const ASIDE: f64 = 0.2; // tuned: two levels move a node by under half of an edge, so that most triangles keep their turn; 0 to 0.25
/// Least part of its area that a triangle keeps.
const THINNEST: f64 = 0.2; // tuned: none is a needle; 0 to 0.5

/// Puts the burn nodes of a mesh aside that was refined `level` times; `sides` are those of each motion triangle from its
/// first corner to its second and third, in the plane of the material [m].
pub fn put_aside(refined: &mut Refined, sides: &[[DVec2; 2]], level: u32, seed: u64) {
    let cuts = 1usize << level;
    let mut held = vec![false; refined.nodes];
    for edge in refined.edges.iter().filter(|edge| edge.triangles[1] == NONE) {
        edge.ends.iter().for_each(|i| held[*i as usize] = true);
    }
    let row = cuts + 1;
    let mut nodes = vec![NONE; sides.len() * row * row];
    let triangles = &mut refined.triangles;
    for t in 0..triangles.len() {
        for (node, place) in triangles.corners[t].iter().zip(triangles.place[t]) {
            let [i, j] = [place.x, place.y].map(|part| (part * cuts as f32).round() as usize);
            nodes[(triangles.parent[t] as usize * row + j) * row + i] = *node;
        }
    }
    loop {
        let aside = displacements(&nodes, sides, level, &held, seed);
        let mut folded = false;
        for t in 0..triangles.len() {
            let [p, q] = sides[triangles.parent[t] as usize];
            let weights = DMat2::from_cols(p, q).inverse();
            triangles.aside[t] = triangles.corners[t].map(|i| (weights * aside[i as usize]).as_vec2());
            let area = |[a, b, c]: [Vec2; 3]| (b - a).perp_dot(c - a);
            let moved = std::array::from_fn(|k| triangles.place[t][k] + triangles.aside[t][k]);
            if f64::from(area(moved)) < THINNEST * f64::from(area(triangles.place[t])) {
                triangles.corners[t].iter().for_each(|i| held[*i as usize] = true);
                folded = true;
            }
        }
        if !folded {
            return;
        }
    }
}

/// How far each node lies aside [m]: halfway between what its two neighbours of the coarser level do, and some more by chance.
fn displacements(nodes: &[u32], sides: &[[DVec2; 2]], level: u32, held: &[bool], seed: u64) -> Vec<DVec2> {
    let row = (1usize << level) + 1;
    let mut aside = vec![DVec2::ZERO; held.len()];
    for finer in 1..=level {
        let step = 1usize << (level - finer);
        let (number, cuts) = (1usize << finer, (1usize << level) as f64);
        for (parent, [p, q]) in sides.iter().enumerate() {
            let at = |i: usize, j: usize| nodes[(parent * row + j * step) * row + i * step] as usize;
            for j in 0..=number {
                for i in 0..=number - j {
                    let [from, to] = match (i % 2, j % 2) {
                        (0, 0) => continue,
                        (1, 0) => [[i - 1, j], [i + 1, j]],
                        (0, _) => [[i, j - 1], [i, j + 1]],
                        _ => [[i + 1, j - 1], [i - 1, j + 1]],
                    };
                    let node = at(i, j);
                    if held[node] {
                        continue;
                    }
                    let apart = (*p * (to[0] as f64 - from[0] as f64) + *q * (to[1] as f64 - from[1] as f64)).length();
                    let reach = ASIDE * 0.5 * apart * step as f64 / cuts;
                    let mut random = Random::new(seed, (0x7261_6767 << 32) | node as u64);
                    let (length, angle) = (random.uniform().sqrt(), std::f64::consts::TAU * random.uniform());
                    let middle = 0.5 * (aside[at(from[0], from[1])] + aside[at(to[0], to[1])]);
                    aside[node] = middle + DVec2::from_angle(angle) * (length * reach);
                }
            }
        }
    }
    aside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::burn_mesh::{FINEST, refine};

    #[test]
    fn sides_are_ragged_edges_are_straight_and_no_triangle_turns_over() {
        let corners = [[0, 1, 2], [2, 1, 3]];
        let area = 0.75f64.sqrt() / 2.0;
        // The same frame for both: the second corner of the first lies along x.
        let (e, f) = (DVec2::X, DVec2::new(0.5, 0.75f64.sqrt()));
        let sides = [[e, f], [e - f, e]];
        for level in 1..=FINEST {
            let mut mesh = refine(4, &corners, &[[1.0; 3]; 2], &[area; 2], level);
            put_aside(&mut mesh, &sides, level, 7);
            let mut places: Vec<Option<DVec2>> = vec![None; mesh.nodes];
            let (mut moved, mut whole) = (0, 0.0);
            for t in 0..mesh.triangles.len() {
                let parent = mesh.triangles.parent[t] as usize;
                let origin = [DVec2::ZERO, f][parent];
                let points: Vec<DVec2> = (0..3)
                    .map(|k| {
                        let at = (mesh.triangles.place[t][k] + mesh.triangles.aside[t][k]).as_dvec2();
                        origin + sides[parent][0] * at.x + sides[parent][1] * at.y
                    })
                    .collect();
                for (i, point) in mesh.triangles.corners[t].iter().zip(&points) {
                    let known = places[*i as usize].get_or_insert(*point);
                    assert!(known.distance(*point) < 1e-6, "both triangles put a node at one place");
                }
                let own = (points[1] - points[0]).perp_dot(points[2] - points[0]) / 2.0;
                assert!(own > 0.1 * area / f64::from(1 << (2 * level)));
                whole += own;
                moved += usize::from(mesh.triangles.aside[t].iter().any(|aside| *aside != Vec2::ZERO));
            }
            assert!((whole / (2.0 * area) - 1.0).abs() < 1e-6, "the outline stays");
            // The middle of the side that both share, at any level; with it all triangles there.
            assert!(moved >= 4, "{moved}");
        }
    }
}
