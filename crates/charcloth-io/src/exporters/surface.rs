//! The living surface of a frame as file formats want it: vertices that carry one texture coordinate each.

use charcloth::frame::Frame;
use glam::Vec2;
use std::collections::HashMap;

/// Vertices and faces of the living surface.
pub(super) struct Surface {
    /// Node and texture coordinate of each vertex, by node. A node has several only where a texture seam runs.
    pub vertices: Vec<(u32, Vec2)>,
    /// Vertices of each face.
    pub faces: Vec<[u32; 3]>,
    /// Row of each face in the triangle table.
    pub rows: Vec<u32>,
}

impl Surface {
    /// The surface of a frame; a frame without triangles at all (a chain) gives its living nodes.
    pub fn of(frame: &Frame) -> Self {
        let triangles = &frame.triangles;
        let mut number: HashMap<(u32, u32, u32), u32> = HashMap::new();
        let mut surface = Self { vertices: Vec::new(), faces: Vec::new(), rows: Vec::new() };
        for (t, corners) in triangles.corners.iter().enumerate() {
            if triangles.alive[t] == 0 {
                continue;
            }
            surface.faces.push(std::array::from_fn(|k| {
                let uv = triangles.uv[t][k];
                *number.entry((corners[k], uv.x.to_bits(), uv.y.to_bits())).or_insert_with(|| {
                    surface.vertices.push((corners[k], uv));
                    surface.vertices.len() as u32 - 1
                })
            }));
            surface.rows.push(t as u32);
        }
        if triangles.is_empty() {
            let alive = (0..frame.motion.len()).filter(|i| frame.motion.alive[*i] != 0);
            surface.vertices = alive.map(|i| (i as u32, Vec2::ZERO)).collect();
        }
        surface.sort_by_node();
        surface
    }

    /// Puts the vertices in the order of their nodes, seams in the order of their first use.
    fn sort_by_node(&mut self) {
        let mut order: Vec<u32> = (0..self.vertices.len() as u32).collect();
        order.sort_by_key(|v| self.vertices[*v as usize].0);
        let mut place = vec![0; order.len()];
        for (k, v) in order.iter().enumerate() {
            place[*v as usize] = k as u32;
        }
        self.vertices = order.iter().map(|v| self.vertices[*v as usize]).collect();
        for v in self.faces.iter_mut().flatten() {
            *v = place[*v as usize];
        }
    }
}

/// The living surface of a frame for formats that have texture coordinates by corner: a point a node.
pub(super) struct Shape {
    /// Node of each point, ascending.
    pub nodes: Vec<u32>,
    /// Points of each face.
    pub faces: Vec<[u32; 3]>,
    /// Row of each face in the triangle table.
    pub rows: Vec<u32>,
}

impl Shape {
    /// The surface of a frame; a frame without triangles at all (a chain) gives its living nodes.
    pub fn of(frame: &Frame) -> Self {
        let (motion, triangles) = (&frame.motion, &frame.triangles);
        let rows: Vec<u32> = (0..triangles.len() as u32).filter(|t| triangles.alive[*t as usize] != 0).collect();
        let mut used = vec![false; motion.len()];
        if triangles.is_empty() {
            used.iter_mut().zip(&motion.alive).for_each(|(used, alive)| *used = *alive != 0);
        }
        for i in rows.iter().flat_map(|t| triangles.corners[*t as usize]) {
            used[i as usize] = true;
        }
        let nodes: Vec<u32> = (0..used.len() as u32).filter(|i| used[*i as usize]).collect();
        let mut point = vec![0; used.len()];
        nodes.iter().enumerate().for_each(|(k, i)| point[*i as usize] = k as u32);
        let faces = rows.iter().map(|t| triangles.corners[*t as usize].map(|i| point[i as usize])).collect();
        Self { nodes, faces, rows }
    }
}
