//! Contact: what is close, what is about to meet, what has passed through.
//!
//! A [`Surface`] says who is joined to whom, sheets and meshed obstacles together; [`Contacts`] holds it with its trees
//! of boxes and answers queries about positions. Every answer is a function of the surface and the positions alone, in
//! the order of vertices, faces and edges: neither the number of threads nor earlier queries change a bit of it. Queries
//! allocate nothing once their buffers have grown. All lengths are in metres, between middle surfaces; what thickness
//! makes of a distance is said by [`Proximity::thickness`]. A plane needs no mesh: `scenery.rs`.
//!
//! Positions must be finite: a box of what is no number overlaps nothing.

mod continuous;
mod distance;
mod intersection;
mod laws;
mod proximity;
pub mod response;
pub mod scenery;
mod surface;
#[cfg(test)]
mod tests;
mod tree;

pub use continuous::Impact;
pub use intersection::Intersection;
pub use proximity::{Kind, Proximity};
pub use surface::{Body, Rows, Surface};

use crate::error::Error;
use continuous::{Goal, cannot_approach, idle, stay_apart, time_of_impact};
use glam::DVec3;
use proximity::Nearest;
use std::sync::atomic::{AtomicU64, Ordering};
use tree::{Bounds, Tree, Walk};

/// Share of its distance to the nearest other feature that a vertex may move. Below a half, two that come towards each
/// other do not meet; [Chen2025] has 0.45.
pub const SAFE_SHARE: f64 = 0.45;

/// Answers queries about a surface. Keeps its storage from query to query.
#[derive(Debug, Default)]
pub struct Contacts {
    surface: Surface,
    vertices: Tree,
    edges: Tree,
    triangles: Tree,
    proximity_walk: Walk<Proximity>,
    impact_walk: Walk<Impact>,
    intersection_walk: Walk<Intersection>,
    nearest: Nearest,
    proximities: Vec<Proximity>,
    safe_displacement: Vec<f64>,
    /// Where the last query of proximities was, and how far each vertex, with all it carries, was from anything [m].
    detected_at: Vec<DVec3>,
    clearance: Vec<f64>,
    lively: Vec<bool>,
    impacts: Vec<Impact>,
    intersections: Vec<Intersection>,
    triangle_pairs: Vec<[u32; 2]>,
}

impl Contacts {
    /// Takes up a surface. Positions [m] only make the trees good ones; the answers do not depend on them.
    pub fn build(surface: Surface, positions: &[DVec3]) -> Self {
        let mut contacts = Self { surface, ..Self::default() };
        contacts.plant(positions);
        contacts
    }

    /// Takes up a changed topology, as [`Surface::build`]; keeps its storage.
    pub fn rebuild(
        &mut self,
        triangles: &[[u32; 3]],
        bodies: &[Body],
        node_body: &[u32],
        thickness: &[f64],
        positions: &[DVec3],
    ) -> Result<(), Error> {
        self.surface.rebuild(triangles, bodies, node_body, thickness)?;
        self.plant(positions);
        Ok(())
    }

    fn plant(&mut self, positions: &[DVec3]) {
        let Self { surface, vertices, edges, triangles, .. } = self;
        check_length(surface, positions);
        vertices.rebuild(surface.vertices.iter().copied(), |i| [i], positions);
        edges.rebuild(0..surface.edges.len() as u32, |e| surface.edges[e as usize], positions);
        triangles.rebuild(0..surface.triangles.len() as u32, |t| surface.triangles[t as usize], positions);
    }

    /// Says what else does not touch, see [`Surface::restrict`].
    pub fn restrict(&mut self, origin: &[u32], own: bool) {
        self.surface.restrict(origin, own);
    }

    /// Who is joined to whom.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Every contact closer than `reach` [m], each once: vertex-face pairs by node and triangle, then edge-edge pairs by
    /// edge and edge. What counts as one contact is told in the head of the module `proximity`.
    pub fn proximities(&mut self, positions: &[DVec3], reach: f64) -> &[Proximity] {
        self.detect(positions, reach).0
    }

    /// What the last query of proximities found.
    pub fn last_proximities(&self) -> &[Proximity] {
        &self.proximities
    }

    /// What the last query of impacts found.
    pub fn last_impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// How far each vertex may move [m] such that, if none moves farther, no two features pass through each other:
    /// [`SAFE_SHARE`] of the distance from all it carries to the nearest other feature, as far as `reach` [m].
    /// Also for nodes without a triangle, which may move as far.
    pub fn safe_displacement(&mut self, positions: &[DVec3], reach: f64) -> &[f64] {
        self.detect(positions, reach).1
    }

    /// [`Self::proximities`] and [`Self::safe_displacement`] from one query.
    pub fn detect(&mut self, positions: &[DVec3], reach: f64) -> (&[Proximity], &[f64]) {
        // A vertex on its own has no triangle to be close to: the trees hold what a triangle uses.
        self.refit(positions, positions, reach);
        let Self { surface, vertices, edges, triangles, proximity_walk: walk, nearest, proximities, .. } = self;
        let reach_squared = reach * reach;
        nearest.reset(surface.node_count(), reach_squared);
        proximities.clear();
        walk.between(vertices, triangles, |i, t| {
            if !surface.may_touch_triangle(i, t) {
                return None;
            }
            proximity::vertex_face(surface, positions, nearest, reach_squared, i, t)
        });
        walk.gather(proximities);
        walk.within(edges, |e, f| {
            if !surface.may_touch_edge(e, f) {
                return None;
            }
            proximity::edges(surface, positions, nearest, reach_squared, e, f)
        });
        walk.gather(proximities);
        self.clearance.clear();
        self.clearance.extend((0..surface.node_count()).map(|i| nearest.of(i).sqrt()));
        self.detected_at.clear();
        self.detected_at.extend_from_slice(positions);
        self.safe_displacement.clear();
        self.safe_displacement.extend(self.clearance.iter().map(|distance| SAFE_SHARE * distance));
        (&self.proximities, &self.safe_displacement)
    }

    /// Every pair that comes closer than `separation` [m] on straight paths between two sets of positions [m], with the
    /// time it does, never late; in the order of [`Self::proximities`]. See [`Self::largest_safe_step`] for pairs that
    /// start closer.
    pub fn continuous(&mut self, before: &[DVec3], after: &[DVec3], separation: f64) -> &[Impact] {
        self.impacts(before, after, Goal::Keep(separation))
    }

    /// Every pair that touches on straight paths between two sets of positions [m]: where none did before, what has
    /// passed through. A miss by less than 1 nm counts.
    pub fn passed_through(&mut self, before: &[DVec3], after: &[DVec3]) -> &[Impact] {
        self.impacts(before, after, Goal::Tell)
    }

    /// Every pair that on straight paths between two sets of positions [m] loses most of its distance, or of `radius` [m]
    /// where that is less: up to the first of these, nothing passes through. In the order of [`Self::proximities`]. Faster
    /// from where proximities were last asked for: what is far apart there for its speed is then left aside.
    pub fn approaches(&mut self, before: &[DVec3], after: &[DVec3], radius: f64) -> &[Impact] {
        self.impacts(before, after, Goal::Approach(radius))
    }

    /// Largest share of the way from one set of positions [m] to another, 0 to 1, on which no pair comes closer than
    /// `separation` [m]. A pair that starts closer may halve its distance; a pair that touches already makes it 0.
    pub fn largest_safe_step(&mut self, before: &[DVec3], after: &[DVec3], separation: f64) -> f64 {
        self.refit(before, after, separation);
        // The time of a pair does not depend on `last`, only whether it is worked out to the end.
        let last = AtomicU64::new(1.0f64.to_bits());
        self.walk_paths(
            before,
            after,
            |_| true,
            |kind, _, _, start, end| {
                let so_far = f64::from_bits(last.load(Ordering::Relaxed));
                if let Some((time, ..)) = time_of_impact(kind, start, end, Goal::Keep(separation), so_far) {
                    last.fetch_min(time.to_bits(), Ordering::Relaxed);
                }
                None
            },
        );
        f64::from_bits(last.into_inner())
    }

    fn impacts(&mut self, before: &[DVec3], after: &[DVec3], goal: Goal) -> &[Impact] {
        let known = matches!(goal, Goal::Approach(_)) && self.detected_at == before;
        if known && !self.find_lively(before, after) {
            self.impacts.clear();
            return &self.impacts;
        }
        self.refit(before, after, goal.reach());
        let (clearance, lively) = (std::mem::take(&mut self.clearance), std::mem::take(&mut self.lively));
        let looked_at = |nodes: [u32; 4]| !known || nodes.iter().any(|i| lively[*i as usize]);
        self.walk_paths(before, after, looked_at, |kind, features, nodes, start, end| {
            if known && cannot_approach(kind, nodes.map(|i| clearance[i as usize]), start, end) {
                return None;
            }
            if stay_apart(kind, &start, &end, goal) {
                return None;
            }
            let (time, offset, weights) = time_of_impact(kind, start, end, goal, 1.0)?;
            let (distance, normal) = (offset.length(), offset.normalize_or_zero());
            Some(Impact { kind, features, nodes, time, weights, distance, normal })
        });
        (self.clearance, self.lively) = (clearance, lively);
        &self.impacts
    }

    /// Finds which nodes move far, beside the mean of all, for how far they are from anything: two that do not cannot
    /// approach each other, for a pair keeps the distance of the one that is farther from anything. Returns whether any do.
    fn find_lively(&mut self, before: &[DVec3], after: &[DVec3]) -> bool {
        let way = mean_way(before, after);
        let ways = before.iter().zip(after).map(|(before, after)| *after - *before - way);
        self.lively.clear();
        self.lively.extend(ways.zip(&self.clearance).map(|(way, clearance)| way.length() > 0.5 * idle(*clearance)));
        self.lively.contains(&true)
    }

    /// Shows every pair whose swept boxes meet and whose nodes are to be looked at, with these at the start and at the end;
    /// fills `impacts`.
    fn walk_paths(
        &mut self,
        before: &[DVec3],
        after: &[DVec3],
        looked_at: impl Fn([u32; 4]) -> bool + Sync,
        visit: impl Fn(Kind, [u32; 2], [u32; 4], [DVec3; 4], [DVec3; 4]) -> Option<Impact> + Sync,
    ) {
        let Self { surface, vertices, edges, triangles, impact_walk: walk, impacts, .. } = self;
        let show = |kind: Kind, features: [u32; 2], nodes: [u32; 4]| {
            if !looked_at(nodes) {
                return None;
            }
            let at = |positions: &[DVec3]| nodes.map(|i| positions[i as usize]);
            visit(kind, features, nodes, at(before), at(after))
        };
        impacts.clear();
        walk.between(vertices, triangles, |i, t| {
            let [a, b, c] = surface.triangles[t as usize];
            surface.may_touch_triangle(i, t).then(|| show(Kind::VertexFace, [i, t], [i, a, b, c])).flatten()
        });
        walk.gather(impacts);
        walk.within(edges, |e, f| {
            let ([i, j], [k, l]) = (surface.edges[e as usize], surface.edges[f as usize]);
            surface.may_touch_edge(e, f).then(|| show(Kind::EdgeEdge, [e, f], [i, j, k, l])).flatten()
        });
        walk.gather(impacts);
    }

    /// Every edge that meets a triangle now, in order of edge, then triangle.
    pub fn intersections(&mut self, positions: &[DVec3]) -> &[Intersection] {
        self.refit(positions, positions, 0.0);
        let Self { surface, edges, triangles, intersection_walk: walk, intersections, .. } = self;
        walk.between(edges, triangles, |edge, triangle| {
            let meet = intersection::intersect(surface, positions, edge, triangle);
            meet.then_some(Intersection { edge, triangle })
        });
        intersections.clear();
        walk.gather(intersections);
        intersections
    }

    /// Number of pairs of triangles that cut through each other now.
    pub fn intersecting_pairs(&mut self, positions: &[DVec3]) -> usize {
        self.intersections(positions);
        let Self { surface, intersections, triangle_pairs: pairs, .. } = self;
        pairs.clear();
        for Intersection { edge, triangle } in intersections {
            let owners = surface.edge_triangles.row(*edge as usize);
            pairs.extend(owners.iter().map(|t| [*t.min(triangle), *t.max(triangle)]));
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs.len()
    }

    /// Boxes around every path, such that two within `reach` [m] of each other overlap: paths as they look from what moves
    /// with the mean of all nodes, which are shorter and have the same distances.
    fn refit(&mut self, before: &[DVec3], after: &[DVec3], reach: f64) {
        let Self { surface, vertices, edges, triangles, .. } = self;
        check_length(surface, before);
        check_length(surface, after);
        let margin = 0.5 * reach;
        if std::ptr::eq(before, after) {
            vertices.refit(|i| Bounds::around(&[before[i as usize]], margin));
            edges.refit(|e| Bounds::around(&surface.ends(before, e), margin));
            triangles.refit(|t| Bounds::around(&surface.corners(before, t), margin));
            return;
        }
        let way = mean_way(before, after);
        vertices.refit(|i| Bounds::around(&[before[i as usize], after[i as usize] - way], margin));
        edges.refit(|e| {
            let ([a, b], [c, d]) = (surface.ends(before, e), surface.ends(after, e));
            Bounds::around(&[a, b, c - way, d - way], margin)
        });
        triangles.refit(|t| {
            let ([a, b, c], [d, e, f]) = (surface.corners(before, t), surface.corners(after, t));
            Bounds::around(&[a, b, c, d - way, e - way, f - way], margin)
        });
    }
}

/// Mean of the ways of all nodes [m].
fn mean_way(before: &[DVec3], after: &[DVec3]) -> DVec3 {
    let sum: DVec3 = before.iter().zip(after).map(|(before, after)| *after - *before).sum();
    sum / before.len().max(1) as f64
}

fn check_length(surface: &Surface, positions: &[DVec3]) {
    assert_eq!(positions.len(), surface.node_count(), "as many positions as nodes of the surface");
}
