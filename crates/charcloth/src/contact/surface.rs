//! Who is joined to whom on the surfaces that may touch: sheets and meshed obstacles together.
//!
//! Built from the live triangles, and rebuilt only when a tear or a burnt hole changes them. Edges are numbered by their
//! nodes, lower node first, so their order depends on nothing but the triangles.

use crate::error::Error;
use glam::DVec3;

/// Triangles, edges and vertices that may touch, with the body each node belongs to.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Nodes of each live triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Nodes of each edge, lower first, in ascending order.
    pub edges: Vec<[u32; 2]>,
    /// Nodes that some triangle uses, in ascending order.
    pub vertices: Vec<u32>,
    /// Edges of each triangle; the k-th joins its corners k and k + 1.
    pub triangle_edges: Vec<[u32; 3]>,
    /// Triangles at each edge.
    pub edge_triangles: Rows,
    /// Triangles at each node.
    pub node_triangles: Rows,
    /// What each body is.
    pub bodies: Vec<Body>,
    /// Body of each node.
    pub node_body: Vec<u32>,
    /// Thickness at each node [m].
    pub thickness: Vec<f64>,
    any_rigid: bool,
    /// Node that each node was the same as before a tear; empty where none was torn.
    origin: Vec<u32>,
    /// Whether pairs without a rigid body are left out.
    only_rigid: bool,
}

/// What contact needs to know of a body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Body {
    /// Moved from outside, in one piece: pairs between rigid bodies, and within one, are left out.
    pub rigid: bool,
}

/// Lists of whole numbers, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    first: Vec<u32>,
    values: Vec<u32>,
}

impl Rows {
    /// One list.
    #[inline]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.values[self.first[row] as usize..self.first[row + 1] as usize]
    }

    /// Fills the lists: `visit` names every (row, value) and is called twice. Values keep the order they are named in.
    fn fill(&mut self, rows: usize, visit: impl Fn(&mut dyn FnMut(u32, u32))) {
        self.first.clear();
        self.first.resize(rows + 2, 0);
        visit(&mut |row, _| self.first[row as usize + 2] += 1);
        for row in 0..rows {
            self.first[row + 2] += self.first[row + 1];
        }
        self.values.clear();
        self.values.resize(self.first[rows + 1] as usize, 0);
        visit(&mut |row, value| {
            let next = &mut self.first[row as usize + 1];
            self.values[*next as usize] = value;
            *next += 1;
        });
        self.first.pop();
    }
}

impl Surface {
    /// One sheet, of one thickness [m], that may touch itself.
    pub fn sheet(node_count: usize, triangles: &[[u32; 3]], thickness: f64) -> Result<Self, Error> {
        Self::build(triangles, &[Body::default()], &vec![0; node_count], &vec![thickness; node_count])
    }

    /// Several bodies together: the body of each node and the thickness there [m].
    pub fn build(triangles: &[[u32; 3]], bodies: &[Body], node_body: &[u32], thickness: &[f64]) -> Result<Self, Error> {
        let mut surface = Self::default();
        surface.rebuild(triangles, bodies, node_body, thickness)?;
        Ok(surface)
    }

    /// Takes up a changed topology; keeps its storage.
    pub fn rebuild(
        &mut self,
        triangles: &[[u32; 3]],
        bodies: &[Body],
        node_body: &[u32],
        thickness: &[f64],
    ) -> Result<(), Error> {
        check(triangles, bodies, node_body, thickness)?;
        self.triangles.clear();
        self.triangles.extend_from_slice(triangles);
        self.bodies.clear();
        self.bodies.extend_from_slice(bodies);
        self.any_rigid = bodies.iter().any(|body| body.rigid);
        self.node_body.clear();
        self.node_body.extend_from_slice(node_body);
        self.thickness.clear();
        self.thickness.extend_from_slice(thickness);
        self.origin.clear();
        self.only_rigid = false;
        self.number_edges(node_body.len());
        let triangles = &self.triangles;
        self.node_triangles.fill(node_body.len(), |name| {
            for (t, corners) in triangles.iter().enumerate() {
                corners.iter().for_each(|i| name(*i, t as u32));
            }
        });
        let triangle_edges = &self.triangle_edges;
        self.edge_triangles.fill(self.edges.len(), |name| {
            for (t, edges) in triangle_edges.iter().enumerate() {
                edges.iter().for_each(|e| name(*e, t as u32));
            }
        });
        self.vertices.clear();
        let used = (0..node_body.len()).filter(|i| !self.node_triangles.row(*i).is_empty());
        self.vertices.extend(used.map(|i| i as u32));
        Ok(())
    }

    /// Numbers the edges by lower node, then higher node.
    fn number_edges(&mut self, node_count: usize) {
        let Self { triangles, edges, triangle_edges, .. } = self;
        // Sides of triangles by their lower node; side 3 t + k joins corners k and k + 1 of triangle t.
        let ends = |side: u32| {
            let (corners, k) = (&triangles[side as usize / 3], side as usize % 3);
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            [i.min(j), i.max(j)]
        };
        let mut sides = Rows::default();
        sides.fill(node_count, |name| {
            for side in 0..3 * triangles.len() as u32 {
                name(ends(side)[0], side);
            }
        });
        edges.clear();
        triangle_edges.clear();
        triangle_edges.resize(triangles.len(), [0; 3]);
        for i in 0..node_count {
            let range = sides.first[i] as usize..sides.first[i + 1] as usize;
            let row = &mut sides.values[range];
            row.sort_unstable_by_key(|side| (ends(*side), *side));
            for side in row {
                if edges.last() != Some(&ends(*side)) {
                    edges.push(ends(*side));
                }
                triangle_edges[*side as usize / 3][*side as usize % 3] = edges.len() as u32 - 1;
            }
        }
    }

    /// Says which nodes were one before a tear: their features do not touch, for they start in the same place. Leaves
    /// out pairs without a rigid body unless `own`. To be said again after a rebuild.
    pub fn restrict(&mut self, origin: &[u32], own: bool) {
        self.origin.clear();
        if origin.iter().enumerate().any(|(i, from)| i != *from as usize) {
            self.origin.extend_from_slice(origin);
        }
        self.only_rigid = !own;
    }

    /// The node that a node was before a tear.
    #[inline(always)]
    fn of_origin(&self, node: u32) -> u32 {
        if self.origin.is_empty() { node } else { self.origin[node as usize] }
    }

    /// Number of nodes, used or not.
    pub fn node_count(&self) -> usize {
        self.node_body.len()
    }

    /// Whether a node belongs to a rigid body.
    #[inline]
    pub fn is_rigid(&self, node: u32) -> bool {
        self.any_rigid && self.bodies[self.node_body[node as usize] as usize].rigid
    }

    /// Where the corners of a triangle are [m].
    #[inline]
    pub(super) fn corners(&self, positions: &[DVec3], triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| positions[i as usize])
    }

    /// Where the ends of an edge are [m].
    #[inline]
    pub(super) fn ends(&self, positions: &[DVec3], edge: u32) -> [DVec3; 2] {
        self.edges[edge as usize].map(|i| positions[i as usize])
    }

    /// Whether a vertex and a triangle can touch: not its own corner, and not both rigid.
    #[inline(always)]
    pub(super) fn may_touch_triangle(&self, vertex: u32, triangle: u32) -> bool {
        let [i, j, k] = self.triangles[triangle as usize];
        let wanted = self.may_meet(vertex, i);
        let [i, j, k] = [i, j, k].map(|i| self.of_origin(i));
        let vertex = self.of_origin(vertex);
        let own = (i == vertex) | (j == vertex) | (k == vertex);
        !own && wanted
    }

    /// Whether two edges can touch: no shared end, and not both rigid.
    #[inline(always)]
    pub(super) fn may_touch_edge(&self, edge: u32, other: u32) -> bool {
        let ([i, j], [k, l]) = (self.edges[edge as usize], self.edges[other as usize]);
        let wanted = self.may_meet(i, k);
        let [i, j, k, l] = [i, j, k, l].map(|i| self.of_origin(i));
        // One branch for all four, for it is taken at random.
        let shared = (i == k) | (i == l) | (j == k) | (j == l);
        !shared && wanted
    }

    /// Whether the bodies of two nodes may touch.
    #[inline(always)]
    fn may_meet(&self, i: u32, j: u32) -> bool {
        if !self.any_rigid {
            return !self.only_rigid;
        }
        match (self.is_rigid(i), self.is_rigid(j)) {
            (true, true) => false,
            (false, false) => !self.only_rigid,
            _ => true,
        }
    }
}

fn check(triangles: &[[u32; 3]], bodies: &[Body], node_body: &[u32], thickness: &[f64]) -> Result<(), Error> {
    let count = node_body.len();
    if thickness.len() != count {
        let problem = format!("{count} nodes have a body, but {} a thickness", thickness.len());
        return Err(Error::mesh(problem, "give both for every node"));
    }
    if let Some(i) = node_body.iter().position(|b| *b as usize >= bodies.len()) {
        let problem = format!("node {i} belongs to body {}, but there are {} bodies", node_body[i], bodies.len());
        return Err(Error::mesh(problem, "number bodies from 0"));
    }
    for (t, [i, j, k]) in triangles.iter().enumerate() {
        if [i, j, k].iter().any(|i| **i as usize >= count) {
            return Err(Error::mesh(format!("triangle {t} names a node past the last of {count}"), ""));
        }
        if i == j || j == k || k == i {
            return Err(Error::mesh(format!("triangle {t} names node {i}, {j}, {k}"), "drop folded triangles"));
        }
        if [j, k].iter().any(|j| node_body[**j as usize] != node_body[*i as usize]) {
            return Err(Error::mesh(format!("triangle {t} belongs to more than one body"), ""));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_have_five_edges_in_order() {
        let surface = Surface::sheet(5, &[[3, 1, 0], [1, 3, 4]], 1e-4).unwrap();
        assert_eq!(surface.edges, [[0, 1], [0, 3], [1, 3], [1, 4], [3, 4]]);
        assert_eq!(surface.vertices, [0, 1, 3, 4]);
        assert_eq!(surface.triangle_edges, [[2, 0, 1], [2, 4, 3]]);
        assert_eq!(surface.edge_triangles.row(2), [0, 1]);
        assert_eq!(surface.edge_triangles.row(4), [1]);
        assert_eq!(surface.node_triangles.row(2), [0u32; 0]);
        assert_eq!(surface.node_triangles.row(3), [0, 1]);
    }

    #[test]
    fn bad_input_is_told_in_words() {
        assert!(Surface::sheet(3, &[[0, 1, 3]], 0.0).is_err());
        assert!(Surface::sheet(3, &[[0, 1, 1]], 0.0).is_err());
        let bodies = [Body::default(), Body { rigid: true }];
        assert!(Surface::build(&[[0, 1, 2]], &bodies, &[0, 0, 1], &[0.0; 3]).is_err());
        assert!(Surface::build(&[[0, 1, 2]], &bodies, &[0, 0, 2], &[0.0; 3]).is_err());
        assert!(Surface::build(&[[0, 1, 2]], &bodies, &[0, 0, 0], &[0.0; 2]).is_err());
    }
}
