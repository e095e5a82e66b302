//! Pairs that are close: vertex and face, edge and edge.
//!
//! Model: every vertex-face and edge-edge pair without a shared node whose distance is below the reach. A contact is
//! named once, and only where the distance is least: an edge-edge pair counts where both closest points are inside the
//! edges, for else a vertex is closer to a face; a vertex above an edge or a corner of several faces counts for the
//! face that is closest, lower number first, as in offset geometric contact [Chen2025]. A vertex that shares a triangle
//! with the closest edge or corner is no contact: the sheet does not touch itself in its own plane, however fine the mesh.
//! The distances that bound a step leave nothing out. Valid when: positions are finite. Cost: see the walk of the
//! tree, and 20 ns a pair of overlapping boxes.

use super::distance::{Closest, Region, edge_edge, vertex_triangle};
use super::surface::Surface;
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// What meets what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// A vertex, then the three corners of a face.
    VertexFace,
    /// The two ends of an edge, then those of another.
    EdgeEdge,
}

/// Two features that are close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proximity {
    /// What meets what.
    pub kind: Kind,
    /// Node and triangle, or edge and edge, in the numbers of the surface.
    pub features: [u32; 2],
    /// Nodes of the first feature, then of the second.
    pub nodes: [u32; 4],
    /// Share of each node in the closest points: those of the first feature add up to 1, those of the second to -1.
    pub weights: [f64; 4],
    /// Distance of the closest points [m].
    pub distance: f64,
    /// Unit vector from the second feature to the first. At no distance, the normal of the face or of both edges.
    pub normal: DVec3,
}

impl Proximity {
    /// Distance that the thickness of the two features keeps between their middle surfaces [m].
    pub fn thickness(&self, surface: &Surface) -> f64 {
        let half = |k: usize| 0.5 * self.weights[k].abs() * surface.thickness[self.nodes[k] as usize];
        half(0) + half(1) + half(2) + half(3)
    }
}

/// Squared distance of each node, with all it carries, to what it might touch [m2]. A minimum of numbers is the same in
/// any order, so threads may share it.
#[derive(Debug, Default)]
pub(super) struct Nearest(Vec<AtomicU64>);

impl Nearest {
    /// Starts again from a squared distance [m2].
    pub fn reset(&mut self, node_count: usize, distance_squared: f64) {
        self.0.clear();
        self.0.resize_with(node_count, || AtomicU64::new(distance_squared.to_bits()));
    }

    /// Squared distance of one node [m2].
    pub fn of(&self, node: usize) -> f64 {
        f64::from_bits(self.0[node].load(Ordering::Relaxed))
    }

    fn lower(&self, nodes: [u32; 4], distance_squared: f64) {
        // Numbers that are not negative are in the order of their bits.
        let bits = distance_squared.to_bits();
        for i in nodes {
            let nearest = &self.0[i as usize];
            if nearest.load(Ordering::Relaxed) > bits {
                nearest.fetch_min(bits, Ordering::Relaxed);
            }
        }
    }
}

/// Looks at one pair of a vertex and a face that may touch, closer than the square root of `reach_squared` [m2].
pub(super) fn vertex_face(
    surface: &Surface,
    positions: &[DVec3],
    nearest: &Nearest,
    reach_squared: f64,
    vertex: u32,
    face: u32,
) -> Option<Proximity> {
    let corners = surface.corners(positions, face);
    let closest = vertex_triangle(positions[vertex as usize], corners);
    let distance_squared = closest.offset.length_squared();
    if distance_squared >= reach_squared {
        return None;
    }
    let [a, b, c] = surface.triangles[face as usize];
    let nodes = [vertex, a, b, c];
    nearest.lower(nodes, distance_squared);
    if !is_least(surface, positions, vertex, face, distance_squared, closest.region) {
        return None;
    }
    let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    Some(proximity(Kind::VertexFace, [vertex, face], nodes, closest, across))
}

/// Looks at one pair of edges that may touch, closer than the square root of `reach_squared` [m2].
pub(super) fn edges(
    surface: &Surface,
    positions: &[DVec3],
    nearest: &Nearest,
    reach_squared: f64,
    first: u32,
    second: u32,
) -> Option<Proximity> {
    let (a, b) = (surface.ends(positions, first), surface.ends(positions, second));
    let closest = edge_edge(a, b, reach_squared)?;
    let distance_squared = closest.offset.length_squared();
    if distance_squared >= reach_squared {
        return None;
    }
    let ([i, j], [k, l]) = (surface.edges[first as usize], surface.edges[second as usize]);
    nearest.lower([i, j, k, l], distance_squared);
    let across = (a[1] - a[0]).cross(b[1] - b[0]);
    closest.region.then(|| proximity(Kind::EdgeEdge, [first, second], [i, j, k, l], closest, across))
}

fn proximity<R>(kind: Kind, features: [u32; 2], nodes: [u32; 4], closest: Closest<R>, across: DVec3) -> Proximity {
    let distance = closest.offset.length();
    let normal = closest.offset.try_normalize().unwrap_or(across.normalize_or_zero());
    Proximity { kind, features, nodes, weights: closest.weights, distance, normal }
}

/// Whether no face around the closest point is closer to the vertex, or as close with a lower number.
fn is_least(
    surface: &Surface,
    positions: &[DVec3],
    vertex: u32,
    face: u32,
    distance_squared: f64,
    region: Region,
) -> bool {
    let around = match region {
        Region::Face => return true,
        Region::Edge(k) => surface.edge_triangles.row(surface.triangle_edges[face as usize][k as usize] as usize),
        Region::Corner(k) => surface.node_triangles.row(surface.triangles[face as usize][k as usize] as usize),
    };
    for other in around {
        if *other == face {
            continue;
        }
        if surface.triangles[*other as usize].contains(&vertex) {
            return false;
        }
        let corners = surface.corners(positions, *other);
        let there = vertex_triangle(positions[vertex as usize], corners).offset.length_squared();
        if there < distance_squared || (there == distance_squared && *other < face) {
            return false;
        }
    }
    let Region::Corner(k) = region else {
        return true;
    };
    // Two vertices that are closest to each other: the lower one names the contact.
    let corner = surface.triangles[face as usize][k as usize];
    corner > vertex || !sees_corner(surface, positions, corner, vertex)
}

/// Whether the closest point to a vertex on the faces around another is that other vertex.
fn sees_corner(surface: &Surface, positions: &[DVec3], vertex: u32, other: u32) -> bool {
    let mut least = (f64::INFINITY, false);
    for face in surface.node_triangles.row(other as usize) {
        let closest = vertex_triangle(positions[vertex as usize], surface.corners(positions, *face));
        let distance_squared = closest.offset.length_squared();
        if distance_squared < least.0 {
            let corners = &surface.triangles[*face as usize];
            let is_corner = matches!(closest.region, Region::Corner(k) if corners[k as usize] == other);
            least = (distance_squared, is_corner);
        }
    }
    least.1
}
