//! A sheet that is animated already: where its points are to be, and how it is drawn there.
//!
//! Model: positions between two meshes of a sequence follow the cubic through them whose slopes are central differences
//! [CatmullRom1974], so that velocities are continuous (Eq. 12.10). A sheet that is drawn is pulled by a critically damped
//! spring on each node that also bears its weight, in proportion to its mass and to the stiffness that burning has left of it
//! (Eq. 12.11); what has come off is not pulled. Valid when: meshes are as close in time as what moves asks for. Cost: a
//! pass over the nodes a step; the meshes are held whole, 24 bytes a point and mesh.

use crate::effects::Forces;
use crate::scene::{Axis, Follow, Motion, Scene};
use crate::sheet::SheetState;
use glam::{DMat3, DVec3};

/// A sequence of meshes with the same points, in the order of the points of the sheet's mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshSequence {
    /// Places of all points [m], mesh by mesh.
    pub meshes: Vec<Vec<DVec3>>,
}

impl MeshSequence {
    /// Eq. 12.10: where a point is [m] at a place of the sequence, counted in meshes from the first on, with its first and
    /// second derivative by that.
    pub fn at(&self, point: usize, place: f64) -> [DVec3; 3] {
        let last = self.meshes.len() - 1;
        let k = (place as usize).min(last.saturating_sub(1));
        let of = |k: usize| self.meshes[k.min(last)][point];
        let (from, to) = (of(k), of(k + 1));
        // Slopes a mesh; at the ends the motion sets in and goes out.
        let (leaves, arrives) = (0.5 * (to - of(k.saturating_sub(1))), 0.5 * (of(k + 2) - from));
        let s = place - k as f64;
        let (square, cube) = (s * s, s * s * s);
        let position = from * (2.0 * cube - 3.0 * square + 1.0)
            + leaves * (cube - 2.0 * square + s)
            + to * (3.0 * square - 2.0 * cube)
            + arrives * (cube - square);
        let slope = (to - from) * (6.0 * s - 6.0 * square)
            + leaves * (3.0 * square - 4.0 * s + 1.0)
            + arrives * (3.0 * square - 2.0 * s);
        let bend = (to - from) * (6.0 - 12.0 * s) + leaves * (6.0 * s - 4.0) + arrives * (6.0 * s - 2.0);
        [position, slope, bend]
    }

    /// The place of the sequence at a time [s], of so many meshes a second from a time on; the first before, the last
    /// after.
    pub fn place(&self, time: f64, start: f64, fps: f64) -> f64 {
        ((time - start) * fps).clamp(0.0, (self.meshes.len() - 1) as f64)
    }
}

/// Where the points of a sheet are to be.
pub struct Guide {
    sequence: MeshSequence,
    motion: Motion,
    turn: DMat3,
    shift: DVec3,
    gravity: DVec3,
    /// Pieces with a lower number have not come off.
    pieces: u32,
    /// Nodes of pieces that have come off, as of a topology.
    loose: Vec<bool>,
    topology: Option<u64>,
}

impl Guide {
    /// The guide of a scene whose sheet was turned and shifted so, and has come in so many pieces.
    pub fn of(scene: &Scene, sequence: MeshSequence, (turn, shift): (DMat3, DVec3), pieces: u32) -> Self {
        let motion = scene.motion.clone();
        let up = if scene.up == Axis::Y { DVec3::Y } else { DVec3::Z };
        let gravity = -up * scene.gravity.0;
        Self { sequence, motion, turn, shift, gravity, pieces, loose: Vec::new(), topology: None }
    }

    /// Whether the sheet is where the motion has it.
    pub fn is_exact(&self) -> bool {
        self.motion.follow == Follow::Exactly
    }

    /// Where a point of the mesh is to be [m], and how fast it moves [m/s], at a time [s].
    pub fn at(&self, point: usize, time: f64) -> (DVec3, DVec3) {
        let [position, velocity, _] = self.course(point, time);
        (position, velocity)
    }

    /// Place [m], velocity [m/s] and acceleration [m/s2] that a point of the mesh is to have at a time [s].
    fn course(&self, point: usize, time: f64) -> [DVec3; 3] {
        let Motion { start, fps, .. } = &self.motion;
        let place = self.sequence.place(time, start.0, *fps);
        let [position, slope, bend] = self.sequence.at(point, place);
        let moving = place > 0.0 && place < (self.sequence.meshes.len() - 1) as f64;
        let rate = if moving { *fps } else { 0.0 };
        [self.turn * position + self.shift, self.turn * slope * rate, self.turn * bend * (rate * rate)]
    }

    /// Puts the whole sheet where it is to be at a time [s].
    pub fn place(&self, state: &mut SheetState, time: f64) {
        let SheetState { motion, before, .. } = state;
        for i in 0..motion.len() {
            (before.position[i], before.velocity[i]) = (motion.position[i], motion.velocity[i]);
            (motion.position[i], motion.velocity[i]) = self.at(motion.source[i] as usize, time);
        }
    }

    /// Takes what is held along to where it is to be at a time [s].
    pub fn lead(&self, state: &mut SheetState, time: f64) {
        let motion = &mut state.motion;
        for i in (0..motion.len()).filter(|i| motion.pinned[*i] != 0) {
            motion.position[i] = self.at(motion.source[i] as usize, time).0;
        }
    }

    /// Part of the pull at a time [s].
    fn pull_at(&self, time: f64) -> f64 {
        let keys = &self.motion.key;
        let after = keys.partition_point(|key| key.time.0 <= time);
        match (after.checked_sub(1).map(|before| &keys[before]), keys.get(after)) {
            (Some(a), Some(b)) => {
                let part = (time - a.time.0) / (b.time.0 - a.time.0);
                a.pull.0 + (b.pull.0 - a.pull.0) * part
            }
            (Some(alone), None) | (None, Some(alone)) => alone.pull.0,
            (None, None) => 1.0,
        }
    }

    /// Adds the pull towards where the sheet is to be at the end of a step from a time on [s] (Eq. 12.11).
    pub fn pull(&mut self, state: &SheetState, forces: &mut Forces, [time, dt]: [f64; 2], topology: u64) {
        let SheetState { motion, triangles, burn, .. } = state;
        if self.topology != Some(topology) || self.loose.len() != motion.len() {
            self.topology = Some(topology);
            self.loose.clear();
            self.loose.resize(motion.len(), false);
            for t in (0..triangles.len()).filter(|t| triangles.piece[*t] >= self.pieces) {
                triangles.corners[t].iter().for_each(|i| self.loose[*i as usize] = true);
            }
        }
        let part = self.pull_at(time + dt);
        // A spring faster than the step would overshoot.
        let rate = 1.0 / self.motion.pull_time.0.max(dt);
        for i in (0..motion.len()).filter(|i| motion.pinned[*i] == 0 && !self.loose[*i]) {
            let [target, speed, speeds_up] = self.course(motion.source[i] as usize, time + dt);
            let left = part * burn.stiffness[state.burn_node(i)];
            let holds = (state.mass(i) + forces.air_mass[i]) * left;
            let damping = 2.0 * holds * rate;
            let back = (target - motion.position[i]) * (rate * rate) + speeds_up;
            forces.force[i] += back * holds + speed * damping - self.gravity * (state.mass(i) * left);
            forces.drag[i] += damping;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Time;

    #[test]
    fn places_go_through_the_meshes_and_velocities_are_their_derivative() {
        let meshes = [0.0, 1.0, 3.0, 2.0].map(|x| vec![DVec3::new(x, 0.0, 0.0)]).to_vec();
        let mut scene = Scene::default();
        scene.motion.fps = 10.0;
        scene.motion.start = Time(0.5);
        let turn = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let guide = Guide::of(&scene, MeshSequence { meshes }, (turn, DVec3::Z), 1);
        for (time, y) in [(0.0, 0.0), (0.5, 0.0), (0.6, 1.0), (0.7, 3.0), (0.8, 2.0), (5.0, 2.0)] {
            assert!(guide.at(0, time).0.distance(DVec3::new(0.0, y, 1.0)) < 1e-12, "at {time} s");
        }
        for k in 0..40 {
            let (time, h) = (0.4 + 0.0125 * k as f64, 1e-6);
            let difference = (guide.at(0, time + h).0 - guide.at(0, time - h).0) / (2.0 * h);
            let error = difference.distance(guide.at(0, time).1);
            // Where the motion sets in and goes out, its speed does not.
            let ends = (time - 0.5).abs() < 2e-6 || (time - 0.8).abs() < 2e-6;
            assert!(ends || error < 1e-3, "{error} at {time} s");
        }
    }
}
