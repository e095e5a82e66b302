//! What a run hands out: frames, time histories, and the sinks that take them.

use crate::error::Error;
use crate::sheet::{BurnNodes, MotionNodes, SheetState, Triangles};
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
    /// What burns, by node id.
    pub burn: BurnNodes,
    /// The surface; triangles with `alive` 0 have been cut from it.
    pub triangles: Triangles,
}

impl Frame {
    /// A copy of the visible part of a state.
    pub fn of(state: &SheetState, number: u32, time: f64) -> Self {
        Self {
            number,
            time,
            motion: state.motion.clone(),
            burn: state.burn.clone(),
            triangles: state.triangles.clone(),
        }
    }

    /// Area-weighted unit normal of each node, zero where it has no triangle left.
    pub fn normals(&self) -> Vec<DVec3> {
        node_normals(&self.motion.position, &self.triangles)
    }
}

/// Area-weighted unit normals of the nodes; zero where a node has no triangle left.
pub fn node_normals(position: &[DVec3], triangles: &Triangles) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; position.len()];
    for (t, corners) in triangles.corners.iter().enumerate() {
        if triangles.alive[t] == 0 {
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
