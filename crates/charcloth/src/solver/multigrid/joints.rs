//! Contact as a level of the multigrid cycle feels it: blocks that meet weighted sums of its nodes.
//!
//! Model: a joint says how far two points, or a point and what is held, come apart: the sum of `weight` times the
//! displacement of each node that takes part, and of its turn across a `lever`. On the next level the node moves with its
//! aggregate as with a rigid body, so a joint there is one between bodies, and no pattern has to hold it: contact comes
//! and goes within a step. What a row gets of the diagonal is so much that no eigenvalue of D^-1 A rises over
//! its bound without contact: `x^T J^T B J x <= (sum of |J|) x^T |J| B x`, by the inequality of Cauchy.
//! Valid when: contact does not dwarf the sheet by more than single precision can tell. Cost: with as many joints as
//! nodes, about a seventh of a cycle.

use super::level::turned;
use crate::solver::blocks::by_rows;
use crate::solver::couplings::Coupling;
use glam::{DMat3, Mat3A, Vec3A, Vec4};

/// Sum of weights, of one body, that is but rounding.
const LEAST_WEIGHT: f32 = 1e-5;

/// How a node takes part in a joint.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    /// How a turn of the node takes part, over the unit of turns of the level.
    lever: Vec3A,
    weight: f32,
    node: u32,
    joint: u32,
}

/// The joints of a level.
#[derive(Debug, Clone, Default)]
pub struct Joints {
    /// Parts of each joint, and the end.
    first: Vec<u32>,
    parts: Vec<Part>,
    blocks: Vec<Mat3A>,
    /// Sum of all weights and levers of each joint.
    reach: Vec<f32>,
    /// Parts of each node, and the end.
    first_of_node: Vec<u32>,
    of_node: Vec<u32>,
    pull: Vec<Vec3A>,
}

/// What a node of a level moves with on the next, and how long units of turns are.
pub struct Onward<'a> {
    pub aggregate: &'a [u32],
    /// Where the nodes of either level are [m].
    pub position: [&'a [Vec3A]; 2],
    /// The units of turns of either level [m].
    pub reach: [f32; 2],
}

impl Joints {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Takes up the joints of the finest level, which has so many nodes.
    pub fn take(&mut self, ties: &[Coupling], nodes: usize) {
        self.clear();
        for tie in ties {
            for (node, weight) in tie.nodes.iter().zip(tie.weights).filter(|(_, weight)| *weight != 0.0) {
                self.add(Part { weight: weight as f32, node: *node, ..Part::default() });
            }
            self.close(tie.block.as_mat3().into());
        }
        self.index(nodes);
    }

    /// Takes up those of the level before, as the bodies of this one feel them.
    pub fn follow(&mut self, finer: &Self, onward: &Onward<'_>, nodes: usize) {
        self.clear();
        let Onward { aggregate, position: [fine, coarse], reach: [unit, next_unit] } = onward;
        for joint in 0..finer.blocks.len() {
            let from = self.parts.len();
            for part in finer.of(joint) {
                let node = aggregate[part.node as usize];
                let arm = fine[part.node as usize] - coarse[node as usize];
                let lever = (part.lever * *unit + arm * part.weight) / *next_unit;
                match self.parts[from..].iter_mut().find(|other| other.node == node) {
                    Some(other) => {
                        other.weight += part.weight;
                        other.lever += lever;
                    }
                    None => self.add(Part { lever, weight: part.weight, node, joint: 0 }),
                }
            }
            // Both sides on the same body: nothing that it does takes them apart.
            if self.parts.len() == from + 1 && self.parts[from].weight.abs() < LEAST_WEIGHT {
                self.parts.truncate(from);
            }
            if self.parts.len() > from {
                self.close(finer.blocks[joint]);
            }
        }
        self.index(nodes);
    }

    /// Takes everything out; keeps the storage.
    pub fn clear(&mut self) {
        let Self { first, parts, blocks, reach, .. } = self;
        parts.clear();
        blocks.clear();
        reach.clear();
        first.clear();
        first.push(0);
    }

    fn add(&mut self, part: Part) {
        self.parts.push(Part { joint: self.blocks.len() as u32, ..part });
    }

    /// Ends the joint to which parts were added.
    fn close(&mut self, block: Mat3A) {
        let from = self.first[self.blocks.len()] as usize;
        self.reach.push(self.parts[from..].iter().map(|part| part.weight.abs() + part.lever.length()).sum());
        self.blocks.push(block);
        self.first.push(self.parts.len() as u32);
    }

    /// Finds the parts of each node.
    fn index(&mut self, nodes: usize) {
        let Self { parts, blocks, first_of_node: first, of_node, pull, .. } = self;
        first.clear();
        first.resize(nodes + 2, 0);
        parts.iter().for_each(|part| first[part.node as usize + 2] += 1);
        for i in 0..nodes {
            first[i + 2] += first[i + 1];
        }
        of_node.clear();
        of_node.resize(parts.len(), 0);
        for (p, part) in parts.iter().enumerate() {
            let next = &mut first[part.node as usize + 1];
            of_node[*next as usize] = p as u32;
            *next += 1;
        }
        first.pop();
        pull.resize(blocks.len(), Vec3A::ZERO);
    }

    fn of(&self, joint: usize) -> &[Part] {
        &self.parts[self.first[joint] as usize..self.first[joint + 1] as usize]
    }

    fn of_node(&self, node: usize) -> impl Iterator<Item = &Part> {
        let range = self.first_of_node[node] as usize..self.first_of_node[node + 1] as usize;
        self.of_node[range].iter().map(|p| &self.parts[*p as usize])
    }

    /// Works out with what force each joint pulls, of a field with so many rows a node.
    pub fn stretch(&mut self, x: &[Vec4], rows_a_node: usize, parallel: bool) {
        let mut pull = std::mem::take(&mut self.pull);
        by_rows(&mut pull, parallel, |first, pull| {
            for (k, pull) in pull.iter_mut().enumerate() {
                let mut apart = Vec3A::ZERO;
                for part in self.of(first + k) {
                    let row = rows_a_node * part.node as usize;
                    apart += Vec3A::from_vec4(x[row]) * part.weight;
                    if rows_a_node == 2 {
                        apart += Vec3A::from_vec4(x[row + 1]).cross(part.lever);
                    }
                }
                *pull = self.blocks[first + k] * apart;
            }
        });
        self.pull = pull;
    }

    /// Adds what the joints, stretched, pull at rows from `first` on.
    pub fn add_pull(&self, rows_a_node: usize, first: usize, y: &mut [Vec4]) {
        for (k, rows) in y.chunks_exact_mut(rows_a_node).enumerate() {
            for part in self.of_node(first / rows_a_node + k) {
                let pull = self.pull[part.joint as usize];
                rows[0] += (pull * part.weight).extend(0.0);
                if let Some(turns) = rows.get_mut(1) {
                    *turns += part.lever.cross(pull).extend(0.0);
                }
            }
        }
    }

    /// What a row gets of the diagonal; `largest` is the bound on eigenvalues.
    pub fn diagonal(&self, rows_a_node: usize, row: usize, largest: f32) -> DMat3 {
        if self.is_empty() {
            return DMat3::ZERO;
        }
        let of_part = |part: &Part| {
            let (block, reach) = (self.blocks[part.joint as usize], self.reach[part.joint as usize]);
            if row.is_multiple_of(rows_a_node) {
                return block * (part.weight.abs() * reach);
            }
            let (lever, length) = (turned(part.lever), part.lever.length());
            if length > 0.0 { lever.transpose() * block * lever * (reach / length) } else { Mat3A::ZERO }
        };
        let sum: Mat3A = self.of_node(row / rows_a_node).map(of_part).sum();
        sum.as_dmat3() * (1.0 / f64::from(largest))
    }

    /// Calls `add` with every block that the joints have between two rows.
    pub fn blocks(&self, rows_a_node: usize, mut add: impl FnMut([usize; 2], DMat3)) {
        for (joint, block) in self.blocks.iter().enumerate() {
            for one in self.of(joint) {
                for other in self.of(joint) {
                    let [i, j] = [one, other].map(|part| rows_a_node * part.node as usize);
                    add([i, j], (*block * (one.weight * other.weight)).as_dmat3());
                    if rows_a_node == 2 {
                        let [arm, other_arm] = [turned(one.lever).transpose(), turned(other.lever)];
                        add([i, j + 1], (*block * other_arm * one.weight).as_dmat3());
                        add([i + 1, j], (arm * *block * other.weight).as_dmat3());
                        add([i + 1, j + 1], (arm * *block * other_arm).as_dmat3());
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::DVec3;

    const NODES: usize = 12;
    const BODIES: usize = 3;

    struct Pair {
        fine: Joints,
        coarse: Joints,
        aggregate: Vec<u32>,
        position: [Vec<Vec3A>; 2],
        reach: f32,
    }

    /// Joints of a vertex with a face, of two edges, and of a vertex with what is held; three bodies of four nodes.
    fn pair(random: &mut Random) -> Pair {
        let mut vector = || DVec3::new(random.normal(), random.normal(), random.normal());
        let mut block = || {
            let [a, b] = [vector(), vector()];
            let outer = |n: DVec3| DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            outer(a) + outer(b) * 0.1
        };
        let ties = [
            Coupling { nodes: [0, 4, 5, 6], weights: [1.0, -0.2, -0.5, -0.3], block: block() },
            Coupling { nodes: [1, 2, 8, 9], weights: [0.4, 0.6, -0.7, -0.3], block: block() },
            Coupling { nodes: [7, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0], block: block() },
            // Within a body: there is nothing of it on the next level.
            Coupling { nodes: [0, 1, 2, 3], weights: [1.0, -0.2, -0.5, -0.3], block: block() },
        ];
        let position: Vec<Vec3A> = (0..NODES).map(|_| vector().as_vec3a()).collect();
        let middles: Vec<Vec3A> = position.chunks(4).map(|part| part.iter().sum::<Vec3A>() / 4.0).collect();
        let aggregate: Vec<u32> = (0..NODES as u32).map(|i| i / 4).collect();
        let (mut fine, mut coarse) = (Joints::default(), Joints::default());
        fine.take(&ties, NODES);
        let reach = 0.7;
        let onward = Onward { aggregate: &aggregate, position: [&position, &middles], reach: [0.0, reach] };
        coarse.follow(&fine, &onward, BODIES);
        Pair { fine, coarse, aggregate, position: [position, middles], reach }
    }

    fn energy(joints: &mut Joints, x: &[Vec4], rows_a_node: usize) -> f32 {
        let mut y = vec![Vec4::ZERO; x.len()];
        joints.stretch(x, rows_a_node, false);
        joints.add_pull(rows_a_node, 0, &mut y);
        x.iter().zip(&y).map(|(x, y)| x.dot(*y)).sum()
    }

    #[test]
    fn bodies_feel_what_their_nodes_do() {
        let mut random = Random::new(11, 1);
        let Pair { mut fine, mut coarse, aggregate, position: [nodes, middles], reach } = pair(&mut random);
        assert_eq!(coarse.blocks.len(), 3);
        // Small beside all else: the joint within a body, which a turn of it alone meets.
        fine.blocks[3] = Mat3A::ZERO;
        let mut random_vector = || DVec3::new(random.normal(), random.normal(), random.normal()).as_vec3().extend(0.0);
        let moves: Vec<Vec4> = (0..2 * BODIES).map(|_| random_vector()).collect();
        let follows = |i: usize| {
            let body = aggregate[i] as usize;
            let turn = Vec3A::from_vec4(moves[2 * body + 1]);
            moves[2 * body] + (turn.cross(nodes[i] - middles[body]) / reach).extend(0.0)
        };
        let x: Vec<Vec4> = (0..NODES).map(follows).collect();
        let [of_nodes, of_bodies] = [energy(&mut fine, &x, 1), energy(&mut coarse, &moves, 2)];
        assert!((of_nodes - of_bodies).abs() < 1e-4 * of_nodes, "{of_nodes} and {of_bodies}");
        // Blocks, as the coarsest level takes them, say the same.
        let mut sum = 0.0;
        coarse.blocks(2, |[i, j], block| {
            sum += moves[i].truncate().as_dvec3().dot(block * moves[j].truncate().as_dvec3())
        });
        assert!((sum - f64::from(of_bodies)).abs() < 1e-4 * sum, "{sum} and {of_bodies}");
    }

    #[test]
    fn the_share_of_the_diagonal_bounds_eigenvalues() {
        let mut random = Random::new(12, 1);
        let Pair { mut fine, mut coarse, .. } = pair(&mut random);
        let largest = 2.5;
        let mut most = 0.0f64;
        for _ in 0..2000 {
            let vector = |random: &mut Random| DVec3::new(random.normal(), random.normal(), random.normal());
            for (joints, rows_a_node, rows) in [(&mut fine, 1, NODES), (&mut coarse, 2, 2 * BODIES)] {
                let x: Vec<DVec3> = (0..rows).map(|_| vector(&mut random)).collect();
                let single: Vec<Vec4> = x.iter().map(|x| x.as_vec3().extend(0.0)).collect();
                let meets = f64::from(energy(joints, &single, rows_a_node));
                let bears: f64 = (0..rows).map(|i| x[i].dot(joints.diagonal(rows_a_node, i, largest) * x[i])).sum();
                most = most.max(meets / bears);
            }
        }
        assert!(most <= f64::from(largest) * 1.0001 && most > 0.5 * f64::from(largest), "{most}");
    }
}
