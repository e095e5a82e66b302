//! The burn mesh: finer triangles on those that move, and the way from one mesh to the other.
//!
//! At level r each side of a motion triangle is cut into 2^r, so that it carries 4^r burn triangles, all similar to it.
//! `MotionNodes::burn_node` says which burn node lies at a motion node. Tears change both meshes, so
//! the map is written out (parent triangle and place on it), and never worked out from numbers. Positions are
//! interpolated by Phong tessellation [Boubekeur2008]: a burn node is drawn towards the planes through the corners of its
//! parent, so that a coarse moving mesh looks round; along an edge they depend on its two ends alone, so nothing gapes.

use crate::mesh::sides_by_edge;
use crate::sheet::{BurnEdges, BurnTriangles, NONE, SheetState, Triangles};
use crate::tear::triangles_at_nodes;
use glam::{DVec3, Vec2};

/// Finest level that is built: 64 burn triangles a motion triangle.
pub const FINEST: u32 = 3;

/// Part of the way from the flat triangle to the tangent planes that a burn node is drawn.
const ROUNDNESS: f64 = 0.75; // [Boubekeur2008]: 3/4

/// A burn mesh as built: everything but the coefficients of heat.
pub struct Refined {
    /// The triangles.
    pub triangles: BurnTriangles,
    /// The edges, with the shape of each: half the sum of the cotangents opposite [1].
    pub edges: Vec<RefinedEdge>,
    /// Number of nodes.
    pub nodes: usize,
}

/// An edge of a burn mesh.
pub struct RefinedEdge {
    /// The two nodes, the lower first.
    pub ends: [u32; 2],
    /// Triangles at it.
    pub triangles: [u32; 2],
    /// Its length at rest [m].
    pub distance: f64,
    /// Squares of sheet side by side that conduct along it (Eq. 1.2), not cut off at nought.
    pub shape: f64,
}

impl Refined {
    /// Gives each node its number of these.
    pub fn renumber(&mut self, number: &[u32]) {
        self.triangles.corners.iter_mut().flatten().for_each(|i| *i = number[*i as usize]);
        for edge in &mut self.edges {
            let [a, b] = edge.ends.map(|i| number[i as usize]);
            edge.ends = [a.min(b), a.max(b)];
        }
        self.edges.sort_unstable_by_key(|edge| edge.ends);
    }
}

/// Refines triangles; nodes of the motion mesh come first. `sides` are the lengths of the sides of each at rest [m],
/// opposite to its corners.
pub fn refine(nodes: usize, corners: &[[u32; 3]], sides: &[[f64; 3]], areas: &[f64], level: u32) -> Refined {
    let cuts = 1usize << level;
    let mut edges: Vec<[u32; 2]> =
        corners.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]].map(|[i, j]| [*i.min(j), *i.max(j)])).collect();
    edges.sort_unstable();
    edges.dedup();
    let first_inner = nodes + edges.len() * (cuts - 1);
    let inner = (cuts - 1) * (cuts.max(2) - 2) / 2;
    // Node `step` of `cuts` on the way from one corner to another.
    let on_edge = |from: u32, to: u32, step: usize| -> u32 {
        let edge = edges.binary_search(&[from.min(to), from.max(to)]).expect("every edge is listed");
        let step = if from < to { step } else { cuts - step };
        (nodes + edge * (cuts - 1) + step - 1) as u32
    };
    let mut triangles = BurnTriangles::default();
    for (parent, [a, b, c]) in corners.iter().copied().enumerate() {
        // Node i of `cuts` steps towards b and j towards c.
        let node = |i: usize, j: usize| -> u32 {
            match (i, j) {
                (0, 0) => a,
                (0, _) if j == cuts => c,
                (0, _) => on_edge(a, c, j),
                (_, 0) if i == cuts => b,
                (_, 0) => on_edge(a, b, i),
                _ if i + j == cuts => on_edge(b, c, j),
                _ => {
                    let before: usize = (1..j).map(|row| cuts - 1 - row).sum();
                    (first_inner + parent * inner + before + i - 1) as u32
                }
            }
        };
        let place = |i: usize, j: usize| Vec2::new(i as f32, j as f32) / cuts as f32;
        // Corner k of each is as wide as corner k of the parent.
        let mut add = |at: [[usize; 2]; 3]| {
            triangles.corners.push(at.map(|[i, j]| node(i, j)));
            triangles.place.push(at.map(|[i, j]| place(i, j)));
            triangles.aside.push([Vec2::ZERO; 3]);
            triangles.parent.push(parent as u32);
            triangles.rest_area.push(areas[parent] / (cuts * cuts) as f64);
            triangles.alive.push(1);
        };
        for j in 0..cuts {
            for i in 0..cuts - j {
                add([[i, j], [i + 1, j], [i, j + 1]]);
                if i + j + 1 < cuts {
                    add([[i + 1, j + 1], [i, j + 1], [i + 1, j]]);
                }
            }
        }
    }
    let edges = refined_edges(&triangles, sides, areas, cuts as f64);
    Refined { triangles, edges, nodes: first_inner + corners.len() * inner }
}

fn refined_edges(triangles: &BurnTriangles, sides: &[[f64; 3]], areas: &[f64], cuts: f64) -> Vec<RefinedEdge> {
    sides_by_edge(&triangles.corners)
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same| {
            let mut edge = RefinedEdge { ends: same[0].0, triangles: [NONE; 2], distance: 0.0, shape: 0.0 };
            for (slot, (_, t, k)) in same.iter().enumerate() {
                let parent = triangles.parent[*t as usize] as usize;
                let k = usize::from(*k);
                let (a, b, c) = (sides[parent][k], sides[parent][(k + 1) % 3], sides[parent][(k + 2) % 3]);
                edge.triangles[slot.min(1)] = *t;
                edge.distance += a / cuts / same.len() as f64;
                edge.shape += 0.5 * (b * b + c * c - a * a) / (4.0 * areas[parent]);
            }
            edge
        })
        .collect()
}

/// The way from burn nodes to motion nodes and back: follows from the state.
#[derive(Debug, Clone, Default)]
pub struct BurnMap {
    /// Motion triangle that carries each burn node, or carried it last.
    pub parent: Vec<u32>,
    /// Weights of its three corners.
    pub weights: Vec<DVec3>,
    /// Whether the node has a live triangle.
    pub held: Vec<bool>,
    /// Burn nodes at each motion node, `first[i]..first[i + 1]` of `shares`.
    first: Vec<u32>,
    /// Burn node, and the part of it that the motion node carries.
    shares: Vec<(u32, f64)>,
    /// Live burn triangles at each burn node, `first_around[i]..first_around[i + 1]` of `around`, in order.
    first_around: Vec<u32>,
    around: Vec<u32>,
}

impl BurnMap {
    /// Writes the map out; for a burn mesh that is the motion mesh it stays empty.
    pub fn lay_out(&mut self, state: &SheetState) {
        let Self { parent, weights, held, first, shares, first_around, around } = self;
        parent.clear();
        weights.clear();
        held.clear();
        first.clear();
        shares.clear();
        first_around.clear();
        around.clear();
        if !state.has_fine_burn_mesh() {
            return;
        }
        parent.resize(state.burn.len(), 0);
        weights.resize(state.burn.len(), DVec3::ZERO);
        held.resize(state.burn.len(), false);
        let triangles = &state.burn_triangles;
        // The first live triangle that has the node says where it lies; any other puts it at the same place, but for what a
        // node that is put aside gets from the angle between two triangles.
        for t in (0..triangles.len()).rev() {
            let alive = triangles.alive[t] != 0;
            for (k, i) in triangles.corners[t].iter().enumerate() {
                let i = *i as usize;
                if alive || !held[i] {
                    let [x, y] = (triangles.place[t][k] + triangles.aside[t][k]).as_dvec2().to_array();
                    parent[i] = triangles.parent[t];
                    weights[i] = DVec3::new(1.0 - x - y, x, y);
                    held[i] = alive;
                }
            }
        }
        (*first_around, *around) = triangles_at_nodes(state.burn.len(), &triangles.corners, &triangles.alive);
        first.resize(state.motion.len() + 1, 0);
        let carriers = |b: usize| {
            let corners = state.triangles.corners[parent[b] as usize];
            let weights = if held[b] { weights[b].to_array() } else { [0.0; 3] };
            corners.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0)
        };
        for b in 0..state.burn.len() {
            carriers(b).for_each(|(i, _)| first[i as usize + 1] += 1);
        }
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut next = first.clone();
        shares.resize(first[first.len() - 1] as usize, (0, 0.0));
        for b in 0..state.burn.len() {
            for (i, weight) in carriers(b) {
                shares[next[i as usize] as usize] = (b as u32, weight);
                next[i as usize] += 1;
            }
        }
    }

    /// Area-weighted unit normal of a burn node by the places of its neighbours; zero where it has no triangle left.
    pub fn normal(&self, corners: &[[u32; 3]], position: &[DVec3], burn_node: usize) -> DVec3 {
        let around = self.first_around[burn_node] as usize..self.first_around[burn_node + 1] as usize;
        let mut sum = DVec3::ZERO;
        for t in &self.around[around] {
            let [a, b, c] = corners[*t as usize].map(|i| position[i as usize]);
            sum += (b - a).cross(c - a);
        }
        sum.normalize_or_zero()
    }

    /// Gathers a quantity of burn nodes at each motion node, each by the part that the motion node carries. The whole is
    /// kept, but for nodes that have come off.
    pub fn gather(&self, burn_node: &[u32], of_burn_node: impl Fn(usize) -> f64, gathered: &mut [f64]) {
        if self.first.is_empty() {
            for (sum, b) in gathered.iter_mut().zip(burn_node) {
                *sum = of_burn_node(*b as usize);
            }
            return;
        }
        for (i, sum) in gathered.iter_mut().enumerate() {
            let shares = &self.shares[self.first[i] as usize..self.first[i + 1] as usize];
            *sum = shares.iter().map(|(b, weight)| weight * of_burn_node(*b as usize)).sum();
        }
    }

    /// A quantity of motion nodes at a burn node, linear over each triangle.
    pub fn interpolate<T>(&self, triangles: &Triangles, at: &[T], burn_node: usize) -> T
    where
        T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        let Some(parent) = self.parent.get(burn_node) else { return at[burn_node] };
        let [a, b, c] = triangles.corners[*parent as usize].map(|i| at[i as usize]);
        let weights = self.weights[burn_node];
        a * weights.x + b * weights.y + c * weights.z
    }

    /// Where a burn node is [m], drawn towards the planes through the corners of its parent.
    pub fn position(&self, triangles: &Triangles, position: &[DVec3], normal: &[DVec3], burn_node: usize) -> DVec3 {
        let flat = self.interpolate(triangles, position, burn_node);
        let Some(parent) = self.parent.get(burn_node) else { return flat };
        let corners = triangles.corners[*parent as usize];
        let round: DVec3 = corners
            .iter()
            .zip(self.weights[burn_node].to_array())
            .map(|(i, weight)| {
                let (corner, normal) = (position[*i as usize], normal[*i as usize]);
                weight * (flat - normal * normal.dot(flat - corner))
            })
            .sum();
        flat.lerp(round, ROUNDNESS)
    }
}

/// Cuts away the burn triangles whose parents are cut, and the parents all of whose burn triangles are. Returns whether
/// there was any of either.
pub fn cut_with_parents(state: &mut SheetState) -> [bool; 2] {
    let SheetState { triangles, burn_triangles: fine, .. } = state;
    let mut carries = vec![false; triangles.len()];
    let mut cut = [false; 2];
    for t in 0..fine.len() {
        let parent = fine.parent[t] as usize;
        if fine.alive[t] != 0 && triangles.alive[parent] == 0 {
            fine.alive[t] = 0;
            cut[0] = true;
        }
        carries[parent] |= fine.alive[t] != 0;
    }
    for (alive, carries) in triangles.alive.iter_mut().zip(carries) {
        if *alive != 0 && !carries {
            *alive = 0;
            cut[1] = true;
        }
    }
    cut
}

/// Edges without a live triangle conduct no more. Returns whether there was a fresh one.
pub fn cut_edges(edges: &mut BurnEdges, triangles: &BurnTriangles) -> bool {
    let mut fresh = false;
    for e in 0..edges.len() {
        let held = edges.triangles[e].iter().any(|t| *t != NONE && triangles.alive[*t as usize] != 0);
        if !held && edges.cut[e] == 0 {
            edges.cut[e] = 1;
            fresh = true;
        }
    }
    fresh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refined_pair_of_triangles_shares_the_nodes_of_its_edge() {
        let corners = [[0, 1, 2], [2, 1, 3]];
        let sides = [[1.0; 3]; 2];
        let area = 0.75f64.sqrt() / 2.0;
        for level in 1..=FINEST {
            let cuts = 1usize << level;
            let mesh = refine(4, &corners, &sides, &[area; 2], level);
            assert_eq!(mesh.triangles.len(), 2 * cuts * cuts);
            // A rhombus of `cuts` by `cuts` cells.
            assert_eq!(mesh.nodes, (cuts + 1) * (cuts + 1));
            assert_eq!(mesh.edges.len(), mesh.nodes + mesh.triangles.len() - 1, "Euler");
            let mut used = vec![false; mesh.nodes];
            mesh.triangles.corners.iter().flatten().for_each(|i| used[*i as usize] = true);
            assert!(used.iter().all(|used| *used));
            let whole: f64 = mesh.triangles.rest_area.iter().sum();
            // One rounding a term.
            assert!((whole - 2.0 * area).abs() < mesh.triangles.len() as f64 * f64::EPSILON);
            for edge in &mesh.edges {
                assert!((edge.distance - 1.0 / cuts as f64).abs() < 1e-15);
                let both = if edge.triangles[1] == NONE { 1.0 } else { 2.0 };
                assert!((edge.shape - both * 0.5 / 3f64.sqrt()).abs() < 1e-12);
            }
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.triangles.place[t];
                assert!((b - a).perp_dot(c - a) > 0.0, "every triangle is turned like its parent");
            }
        }
    }
}
