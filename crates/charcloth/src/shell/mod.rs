//! The sheet as a thin elastic shell: triangles that resist stretching and shear, patches that resist bending.
//!
//! Moduli are of the material, so nothing here depends on the mesh. Rest shapes and rest curvatures are state.

pub mod bending;
pub mod membrane;

use crate::effects::SpringFactors;
use crate::scene;
use crate::sheet::{NONE, SheetState};
use crate::solver::StepMatrix;
use crate::solver::blocks::{Columns, Pattern, by_block_rows, by_rows, sum_by_rows};
use bending::Bending;
use glam::{DMat3, DVec2, DVec3};
use membrane::{MembraneStiffness, Response, RestTriangle, respond};
use rayon::prelude::*;

/// Triangles that one thread takes at a time.
const TRIANGLES_A_TASK: usize = 1024;
/// Steps in which bending follows the loss of stiffness: each change takes all of the bending matrix anew.
const BENDING_STEPS: f64 = 64.0;
/// No step: the bending matrix is yet to be made.
const UNKNOWN_STEP: u8 = u8::MAX;
/// Part of its length to which heat shrinks a side at most. // tuned: charred paper keeps 70 %, 0.3 to 0.7
const SHORTEST: f64 = 0.4;

/// A shell laid out for a topology. All of it follows from the state.
#[derive(Default)]
pub struct Shell {
    /// Live triangles, by number, and their corners.
    triangles: Vec<u32>,
    corners: Vec<[u32; 3]>,
    rest: Vec<RestTriangle>,
    stiffness: Vec<MembraneStiffness>,
    responses: Vec<Response>,
    /// Corners of triangles at each node: triangle times four and corner.
    at_node: Pattern,
    /// For each block off the diagonal, the two responses it is the sum of: triangle times eight, pair of corners times
    /// two, and whether it is transposed.
    sources: Vec<[u32; 2]>,
    bending: Bending,
    /// Stiffness left of each triangle, in steps, as the bending matrix has it.
    bending_steps: Vec<u8>,
    sums: Vec<f64>,
}

impl Shell {
    /// Lays the shell out for the live triangles of a sheet, and the matrix of its steps.
    pub fn lay_out(state: &SheetState, material: &scene::Shell, fixed: &[bool]) -> (Self, StepMatrix) {
        let nodes = state.motion.len();
        let triangles: Vec<u32> =
            (0..state.triangles.len()).filter(|t| state.triangles.alive[*t] != 0).map(|t| t as u32).collect();
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| state.triangles.corners[*t as usize]).collect();
        let rest: Vec<RestTriangle> =
            triangles.iter().map(|t| RestTriangle::new(rest_side(state, 1, *t), rest_side(state, 2, *t))).collect();
        let at_node = corners_at_nodes(nodes, &corners);
        let mut pattern = Pattern::empty(0);
        let mut columns = Columns::new(nodes);
        for i in 0..nodes {
            let near = at_node.columns(i).iter().flat_map(|place| corners[*place as usize / 4]);
            pattern.push_row(columns.collect(i, near.chain([i as u32])));
        }
        let mut sources = vec![[NONE; 2]; pattern.blocks()];
        for (t, corners) in corners.iter().enumerate() {
            for a in 0..3 {
                for b in (0..3).filter(|b| *b != a) {
                    let block = pattern.find(corners[a] as usize, corners[b]).expect("the pattern holds every edge");
                    let pair = if a.min(b) == 0 { a.max(b) - 1 } else { 2 };
                    let source = &mut sources[block];
                    // An edge of more than two triangles keeps the last two: such surfaces are cut open on import.
                    source[usize::from(source[0] != NONE)] = (8 * t + 2 * pair + usize::from(a > b)) as u32;
                }
            }
        }
        let material_stiffness = MembraneStiffness::of(material);
        let mut bending = Bending::lay_out(nodes, &corners, &rest, &material_stiffness, material.thickness.0, fixed);
        bending.thicken(|k| state.rest.thickness[triangles[k] as usize]);
        let shell = Self {
            stiffness: vec![MembraneStiffness::default(); triangles.len()],
            responses: vec![Response::default(); triangles.len()],
            bending_steps: vec![UNKNOWN_STEP; triangles.len()],
            at_node,
            triangles,
            corners,
            rest,
            sources,
            bending,
            sums: Vec::new(),
        };
        let matrix = StepMatrix::zeros(pattern, shell.bending.pattern.clone());
        (shell, matrix)
    }

    /// Takes over stiffness and rest shapes from the state: what burning has left of
    /// it and what it has shrunk by are in `factors`. `contraction` is what heat takes off lengths [1/K], over
    /// `ambient` [K].
    pub fn update(
        &mut self,
        state: &SheetState,
        material: &scene::Shell,
        factors: &SpringFactors,
        contraction: f64,
        ambient: f64,
    ) {
        let whole = MembraneStiffness::of(material);
        let mut changed = false;
        for (k, corners) in self.corners.iter().enumerate() {
            let nodes = corners.map(|i| state.burn_node(i as usize));
            let left = factors.triangle[self.triangles[k] as usize];
            self.stiffness[k] = whole.scaled(left * state.rest.thickness[self.triangles[k] as usize]);
            let temperature = nodes.iter().map(|i| state.burn.temperature[*i]).sum::<f64>() / 3.0;
            let scale = (1.0 - contraction * (temperature - ambient)).clamp(SHORTEST, 1.0 / SHORTEST);
            let t = self.triangles[k];
            let free = factors.free_strain.get(t as usize).copied().unwrap_or_default();
            let scale = (DVec2::splat(scale) + free).max(DVec2::splat(SHORTEST));
            let flow = state.rest.flow[t as usize];
            let side = |side: u8| {
                let side = rest_side(state, side, t);
                scale * side + DVec2::new(flow.x * side.x + flow.z * side.y, flow.z * side.x + flow.y * side.y)
            };
            self.rest[k] = RestTriangle::new(side(1), side(2));
            let step = (left * BENDING_STEPS).ceil() as u8;
            changed |= self.bending_steps[k] != step;
            self.bending_steps[k] = step;
        }
        if changed {
            self.bending.assemble(|t| f64::from(self.bending_steps[t]) / BENDING_STEPS);
        }
        for (k, t) in self.triangles.iter().enumerate() {
            let free = factors.free_curvature.get(*t as usize).copied().unwrap_or_default();
            self.bending.set_rest_curvature(k, state.rest.curvature[*t as usize] + free.extend(0.0));
        }
    }

    /// Works out forces and stiffness at these positions, and the elastic energy [J].
    pub fn respond(&mut self, position: &[DVec3], parallel: bool) -> f64 {
        let Self { corners, rest, stiffness, responses, bending, sums, .. } = self;
        let part = |first: usize, responses: &mut [Response]| {
            for (k, response) in responses.iter_mut().enumerate() {
                let t = first + k;
                *response = respond(&rest[t], &stiffness[t], corners[t].map(|i| position[i as usize]));
            }
        };
        if parallel {
            let tasks = responses.par_chunks_mut(TRIANGLES_A_TASK).enumerate();
            tasks.for_each(|(task, responses)| part(task * TRIANGLES_A_TASK, responses));
        } else {
            part(0, responses);
        }
        let stretching = sum_by_rows(responses.len(), parallel, sums, |part| part.map(|t| responses[t].energy).sum());
        bending.respond(position, corners, parallel);
        let bent = sum_by_rows(position.len(), parallel, sums, |part| {
            part.map(|i| -0.5 * position[i].dot(bending.force[i])).sum()
        });
        stretching + bent + bending.rest_energy
    }

    /// Elastic force on a node, as of the last response [N].
    #[inline]
    pub fn force(&self, node: usize) -> DVec3 {
        let mut force = self.bending.force[node] + self.bending.rest_force[node];
        for place in self.at_node.columns(node) {
            let [second, third] = self.responses[(place / 4) as usize].force;
            force += match place % 4 {
                0 => -(second + third),
                1 => second,
                _ => third,
            };
        }
        force
    }

    /// Fills in the matrix M + a K + b B, K that of the membrane and B that of bending, as of the last response. `mass` is
    /// the diagonal M; fixed nodes are left out.
    pub fn assemble(&self, matrix: &mut StepMatrix, mass: &[f64], [a, b]: [f64; 2], fixed: &[bool], parallel: bool) {
        let StepMatrix { pattern, blocks, diagonal, ties, tie, .. } = matrix;
        by_block_rows(pattern, blocks, parallel, |i, row| {
            let first = pattern.first[i] as usize;
            let own = diagonal[i] as usize - first;
            if fixed[i] {
                row.fill(DMat3::ZERO);
                row[own] = DMat3::IDENTITY;
                return;
            }
            let mut sum = DMat3::ZERO;
            for (k, block) in row.iter_mut().enumerate() {
                if k == own {
                    continue;
                }
                let mut total = DMat3::ZERO;
                for source in self.sources[first + k] {
                    if source != NONE {
                        let response = &self.responses[(source / 8) as usize].stiffness[(source / 2 % 4) as usize];
                        total += if source % 2 == 1 { response.transpose() } else { *response };
                    }
                }
                sum -= total;
                *block = if fixed[pattern.column[first + k] as usize] { DMat3::ZERO } else { total * a };
            }
            row[own] = sum * a + DMat3::from_diagonal(DVec3::splat(mass[i] + self.bending.diagonal[i] * b));
        });
        by_block_rows(ties, tie, parallel, |i, row| {
            let first = ties.first[i] as usize;
            for (k, tie) in row.iter_mut().enumerate() {
                let free = !fixed[i] && !fixed[ties.column[first + k] as usize];
                *tie = if free { self.bending.value[first + k] * b } else { 0.0 };
            }
        });
    }

    /// Tension per width along the line between two corners of a live triangle [N/m], as of the last response; `t` is its
    /// number in the sheet.
    pub fn tension_along(&self, t: u32, ends: [u32; 2]) -> Option<f64> {
        let k = self.triangles.binary_search(&t).ok()?;
        let [u, v] = self.rest[k].side;
        let place = |i: u32| Some([DVec2::ZERO, u, v][self.corners[k].iter().position(|corner| *corner == i)?]);
        let direction = (place(ends[1])? - place(ends[0])?).normalize();
        let [along, across, shear] = self.responses[k].tension;
        let (x, y) = (direction.x, direction.y);
        Some(along * x * x + across * y * y + 2.0 * shear * x * y)
    }

    /// Live triangles, by their numbers in the sheet.
    pub fn triangles(&self) -> &[u32] {
        &self.triangles
    }

    /// Tension per width of the live triangle in this place, in material axes: along, across, shear [N/m], as of the last
    /// response.
    pub fn tension(&self, k: usize) -> [f64; 3] {
        self.responses[k].tension
    }

    /// What a curvature, as (xx, yy, 2 xy) [1/m], adds to the stress on one face and takes off the other, times the
    /// thickness [m]: a tension per width of the live triangle in this place [N/m].
    pub fn face_tension(&self, k: usize, curvature: DVec3, thickness: f64) -> [f64; 3] {
        let MembraneStiffness { q11, q22, q12, q66 } = self.stiffness[k];
        let DVec3 { x, y, z } = curvature * (0.5 * thickness);
        [q11 * x + q12 * y, q12 * x + q22 * y, q66 * z]
    }

    /// Curvature of the live triangle in this place, as (xx, yy, 2 xy) [1/m].
    pub fn curvature(&self, k: usize, position: &[DVec3]) -> DVec3 {
        let [a, b, c] = self.corners[k].map(|i| position[i as usize]);
        self.bending.curvature(k, position, (b - a).cross(c - a).normalize_or_zero())
    }

    /// Product of the bending matrix with a field of the nodes, for damping.
    pub fn bend(&self, x: &[DVec3], y: &mut [DVec3], parallel: bool) {
        by_rows(y, parallel, |first, y| {
            for (k, y) in y.iter_mut().enumerate() {
                *y = self.bending.row_times(x, first + k);
            }
        });
    }
}

/// Which corners of triangles are at each node: four times the triangle, and the place of the corner.
fn corners_at_nodes(nodes: usize, corners: &[[u32; 3]]) -> Pattern {
    let mut triangles = Pattern::empty(0);
    corners.iter().for_each(|corners| triangles.push_row(corners));
    let mut at_node = triangles.transposed(nodes);
    for i in 0..nodes {
        for k in at_node.row(i) {
            let t = at_node.column[k];
            let corner = corners[t as usize].iter().position(|j| *j == i as u32).expect("a corner of the triangle");
            at_node.column[k] = 4 * t + corner as u32;
        }
    }
    at_node
}

fn rest_side(state: &SheetState, side: u8, t: u32) -> DVec2 {
    let column = if side == 1 { &state.rest.side_1 } else { &state.rest.side_2 };
    column[t as usize].truncate()
}
