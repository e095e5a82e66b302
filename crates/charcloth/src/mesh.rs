//! A surface as it comes from a file or a generator, before it becomes a sheet.

use crate::error::Error;
use glam::{DVec3, Vec2};
use std::collections::BTreeMap;

/// A triangle surface in metres: welded (one position a point), with texture coordinates by corner so that seams keep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Position of each point [m].
    pub positions: Vec<DVec3>,
    /// Three points each, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the corners of each triangle; empty where the source has none.
    pub corner_uv: Vec<[Vec2; 3]>,
    /// Face of the source that each triangle was cut from.
    pub source_face: Vec<u32>,
    /// Painted point attributes by name, 0 to 1: vertex colour channels, vertex groups.
    pub painted: BTreeMap<String, Vec<f32>>,
    /// Connected shell of each triangle, numbered from 0 in order of first triangle.
    pub shell: Vec<u32>,
    /// What the source had wrong and was put right: said to the user as it stands.
    pub remarks: Vec<String>,
}

/// Every side of every triangle, by edge: its two nodes, the lower first; the triangle; and the corner opposite.
pub(crate) fn sides_by_edge(corners: &[[u32; 3]]) -> Vec<([u32; 2], u32, u8)> {
    let mut sides = Vec::with_capacity(3 * corners.len());
    for (t, corners) in corners.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            sides.push(([i.min(j), i.max(j)], t as u32, k as u8));
        }
    }
    sides.sort_unstable();
    sides
}

impl SurfaceMesh {
    /// Number of shells.
    pub fn shell_count(&self) -> usize {
        self.shell.iter().max().map_or(0, |s| *s as usize + 1)
    }

    /// Area of one triangle [m2].
    pub fn triangle_area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.triangles[triangle].map(|i| self.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Numbers the connected shells (triangles that share a point belong together).
    pub fn number_shells(&mut self) {
        let mut root: Vec<u32> = (0..self.positions.len() as u32).collect();
        fn find(root: &mut [u32], mut i: u32) -> u32 {
            while root[i as usize] != i {
                root[i as usize] = root[root[i as usize] as usize];
                i = root[i as usize];
            }
            i
        }
        for [a, b, c] in &self.triangles {
            for other in [b, c] {
                let (x, y) = (find(&mut root, *a), find(&mut root, *other));
                root[x.max(y) as usize] = x.min(y);
            }
        }
        let mut number = BTreeMap::new();
        self.shell = Vec::with_capacity(self.triangles.len());
        for k in 0..self.triangles.len() {
            let r = find(&mut root, self.triangles[k][0]);
            let next = number.len() as u32;
            self.shell.push(*number.entry(r).or_insert(next));
        }
    }

    /// Checks everything the simulator relies on: indices, finite positions, lengths of the arrays, edges with at most
    /// two triangles. Importers repair what they can before; what is left is an error.
    pub fn validate(&self) -> Result<(), Error> {
        let count = self.positions.len();
        if self.triangles.is_empty() {
            return Err(Error::mesh("it has no triangles", "a sheet needs at least one face with an area"));
        }
        if let Some(k) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::mesh(
                format!("point {k} is not at a finite place ({:?})", self.positions[k]),
                "export the mesh again",
            ));
        }
        for (k, corners) in self.triangles.iter().enumerate() {
            if let Some(bad) = corners.iter().find(|c| **c as usize >= count) {
                return Err(Error::mesh(
                    format!("triangle {k} names point {bad}, but there are {count} points"),
                    "the file is damaged; export it again",
                ));
            }
            if self.triangle_area(k) <= 0.0 {
                return Err(Error::mesh(format!("triangle {k} has no area"), "remove degenerate faces"));
            }
        }
        if !self.corner_uv.is_empty() && self.corner_uv.len() != self.triangles.len() {
            return Err(Error::mesh("texture coordinates do not match the triangles", ""));
        }
        if self.source_face.len() != self.triangles.len() || self.shell.len() != self.triangles.len() {
            return Err(Error::mesh("face numbers or shells do not match the triangles", "call number_shells"));
        }
        let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for corners in &self.triangles {
            for k in 0..3 {
                let (i, j) = (corners[k], corners[(k + 1) % 3]);
                *uses.entry((i.min(j), i.max(j))).or_insert(0) += 1;
            }
        }
        if let Some(((i, j), n)) = uses.iter().find(|(_, n)| **n > 2) {
            let bad = uses.values().filter(|n| **n > 2).count();
            return Err(Error::mesh(
                format!(
                    "{bad} edges are shared by more than two faces, the first between points {i} and {j} ({n} faces)"
                ),
                "a sheet has one or two faces at an edge: split it into separate shells there",
            ));
        }
        Ok(())
    }
}
