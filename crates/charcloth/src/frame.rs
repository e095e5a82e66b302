//! What a run hands out: frames, time histories, and the sinks that take them.

use crate::burn_mesh::BurnMap;
use crate::error::Error;
use crate::sheet::{BurnNodes, BurnTriangles, MotionNodes, NONE, Origins, Particles, Pieces, SheetState, Triangles};
use glam::DVec3;
use std::ops::ControlFlow;

/// One frame of film: a copy of everything that can be seen or exported.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// Frame number; 0 is the start.
    pub number: u32,
    /// Simulated time [s].
    pub time: f64,
    /// What moves, by node id.
    pub motion: MotionNodes,
    /// What burns, by the same node id.
    pub burn: BurnNodes,
    /// The surface; triangles with `alive` 0 have been cut from it.
    pub triangles: Triangles,
    /// Where on the input mesh each node comes from, by the same node id.
    pub origins: Origins,
    /// Connected pieces, by number.
    pub pieces: Pieces,
    /// What has come off and is too small to be sheet.
    pub particles: Particles,
}

impl Origins {
    /// Origins of nodes that are corners of the triangles of the input. The first live triangle at a node says which
    /// face; any other puts it at the same place.
    pub fn of_corners(nodes: &MotionNodes, triangles: &Triangles) -> Self {
        let mut origins = Self::zeros(nodes.len());
        origins.origin_face.fill(NONE);
        for i in 0..nodes.len() {
            origins.origin_points[i] = [nodes.source[i]; 3];
            origins.origin_weights[i] = DVec3::X;
        }
        let of_state = |alive: bool| (0..triangles.len()).rev().filter(move |t| (triangles.alive[*t] != 0) == alive);
        for t in of_state(false).chain(of_state(true)) {
            for (k, node) in triangles.corners[t].into_iter().enumerate() {
                origins.set(node as usize, nodes, triangles, t, DVec3::AXES[k]);
            }
        }
        origins
    }

    /// Origins of the nodes of a finer burn mesh on the triangles that carry it.
    fn on_triangles(map: &BurnMap, nodes: &MotionNodes, triangles: &Triangles) -> Self {
        let mut origins = Self::zeros(map.parent.len());
        for (i, parent) in map.parent.iter().enumerate() {
            origins.set(i, nodes, triangles, *parent as usize, map.weights[i]);
        }
        origins
    }

    /// Puts a node on a triangle.
    fn set(&mut self, node: usize, nodes: &MotionNodes, triangles: &Triangles, t: usize, weights: DVec3) {
        self.origin_face[node] = triangles.source_face[t];
        self.origin_points[node] = triangles.corners[t].map(|i| nodes.source[i as usize]);
        self.origin_weights[node] = weights;
    }
}

/// The burn mesh with what moves carried over to its nodes.
fn of_burn_mesh(state: &SheetState) -> (MotionNodes, Triangles, Origins) {
    let SheetState { motion, burn, triangles, burn_triangles: fine, .. } = state;
    let mut map = BurnMap::default();
    map.lay_out(state);
    let normal = node_normals(&motion.position, triangles);
    let mut nodes = MotionNodes::zeros(burn.len());
    let inert: f64 = motion.inert_mass.iter().sum();
    let inert_of_fuel = inert / burn.fuel_initial.iter().sum::<f64>();
    for i in 0..burn.len() {
        nodes.burn_node[i] = i as u32;
        nodes.carried_mass[i] = burn.fuel[i];
        nodes.inert_mass[i] = burn.fuel_initial[i] * inert_of_fuel;
        nodes.position[i] = map.position(triangles, &motion.position, &normal, i);
        nodes.velocity[i] = map.interpolate(triangles, &motion.velocity, i);
        nodes.rest_position[i] = map.interpolate(triangles, &motion.rest_position, i);
        nodes.alive[i] = u8::from(map.held[i]);
        // What cannot be mixed is that of the nearest corner.
        let corners = triangles.corners[map.parent[i] as usize];
        let nearest = corners[map.weights[i].max_position()] as usize;
        nodes.source[i] = motion.source[nearest];
        nodes.sheet[i] = motion.sheet[nearest];
        nodes.pinned[i] = u8::from(map.weights[i].max_element() == 1.0 && motion.pinned[nearest] != 0);
    }
    let mut surface = Triangles {
        corners: fine.corners.clone(),
        rest_area: fine.rest_area.clone(),
        alive: fine.alive.clone(),
        ..Triangles::zeros(fine.len())
    };
    for (t, parent) in fine.parent.iter().enumerate() {
        let parent = *parent as usize;
        let [a, b, c] = triangles.uv[parent];
        surface.uv[t] = std::array::from_fn(|k| {
            let at = fine.place[t][k] + fine.aside[t][k];
            a + (b - a) * at.x + (c - a) * at.y
        });
        surface.source_face[t] = triangles.source_face[parent];
        surface.sheet[t] = triangles.sheet[parent];
        surface.piece[t] = triangles.piece[parent];
        surface.parted[t] = triangles.parted[parent];
    }
    (nodes, surface, Origins::on_triangles(&map, motion, triangles))
}

impl Frame {
    /// A copy of the visible part of a state.
    pub fn of(state: &SheetState, number: u32, time: f64) -> Self {
        let (motion, triangles, origins) = if state.has_fine_burn_mesh() {
            of_burn_mesh(state)
        } else {
            let origins = Origins::of_corners(&state.motion, &state.triangles);
            (state.motion.clone(), state.triangles.clone(), origins)
        };
        let (pieces, particles) = (state.pieces.clone(), state.particles.clone());
        Self { number, time, motion, burn: state.burn.clone(), triangles, origins, pieces, particles }
    }

    /// Area-weighted unit normal of each node, zero where it has no triangle left.
    pub fn normals(&self) -> Vec<DVec3> {
        node_normals(&self.motion.position, &self.triangles)
    }
}

/// Area-weighted unit normals of the nodes; zero where a node has no triangle left.
pub fn node_normals(position: &[DVec3], triangles: &Triangles) -> Vec<DVec3> {
    normals(position, &triangles.corners, &triangles.alive)
}

fn normals(position: &[DVec3], corners: &[[u32; 3]], alive: &[u8]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; position.len()];
    for (t, corners) in corners.iter().enumerate() {
        if alive[t] == 0 {
            continue;
        }
        let [a, b, c] = corners.map(|i| position[i as usize]);
        let twice_area = (b - a).cross(c - a);
        for i in corners {
            normals[*i as usize] += twice_area;
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or_zero();
    }
    normals
}

/// Area-weighted unit normals of the nodes of a finer burn mesh, as [`node_normals`].
pub(crate) fn fine_normals(position: &[DVec3], triangles: &BurnTriangles) -> Vec<DVec3> {
    normals(position, &triangles.corners, &triangles.alive)
}

/// One value of a time history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Column name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value at the end of the frame.
    pub value: f64,
}

/// Where frames go: a file writer, a renderer, a test. Sinks never change the simulation.
pub trait Sink {
    /// Takes one finished frame and its time-history row, with the full state to resume from. May ask to stop.
    fn frame(&mut self, frame: &Frame, history: &[Sample], state: &SheetState) -> Result<ControlFlow<()>, Error>;
    /// The run is over, finished or stopped.
    fn finish(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// Throws frames away: for benchmarks and checks.
#[derive(Debug, Default, Clone, Copy)]
pub struct Null;

impl Sink for Null {
    fn frame(&mut self, _: &Frame, _: &[Sample], _: &SheetState) -> Result<ControlFlow<()>, Error> {
        Ok(ControlFlow::Continue(()))
    }
}
