//! Smoothed-aggregation multigrid for the matrices of implicit steps: a preconditioner whose cycles are in single precision.
//!
//! Model: aggregates of neighbouring nodes become the nodes of the next level, each a rigid body; prolongation smoothed by
//! one step of damped Jacobi; Galerkin products; Chebyshev smoothing. Source: [Vanek1996]; for cloth [Tamstorf2015].
//! A sheet's mass is often under the seventh digit of its stiffness. So products are taken of differences: what a node
//! is off the rigid motion of its neighbour; and what such a motion itself meets, mass and pins, stands apart as the
//! `ground` of a node, worked out in double precision. The patterns of all levels follow from the topology alone and are kept until
//! it changes. Cost: a cycle takes about seven products of the finest level in single precision, set-up about seven cycles.

mod direct;
mod galerkin;
mod joints;
mod lanes;
mod level;
mod spectrum;
mod transfer;

use super::StepMatrix;
use super::blocks::{Columns, Pattern};
use direct::Direct;
use glam::{DVec3, Vec4};
use joints::Onward;
use level::Level;
use transfer::{Transfer, aggregates};

/// No aggregate: the node is fixed.
const NONE: u32 = u32::MAX;
/// Rows at and under which a level is the coarsest.
const DIRECT: usize = 48;
/// Most levels.
const LEVELS: usize = 14;
/// Factor over estimates. // tuned: 1.0 to 1.2
pub const CAUTION: f32 = 1.05;

/// The levels of a matrix.
#[derive(Default)]
pub struct Multigrid {
    levels: Vec<Level>,
    direct: Direct,
}

impl Multigrid {
    /// Lays out the levels of a matrix; `fixed` nodes take no part.
    pub fn lay_out(matrix: &StepMatrix, fixed: &[bool]) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        let mut fixed = fixed.to_vec();
        let mut level = Level::finest(matrix);
        let mut graph = Pattern::empty(0);
        let mut columns = Columns::new(fixed.len());
        for i in 0..fixed.len() {
            let near = matrix.pattern.columns(i).iter().chain(matrix.ties.columns(i)).copied();
            graph.push_row(columns.collect(i, near));
        }
        loop {
            let nodes = graph.rows();
            let (aggregate, count) = aggregates(&graph, &fixed);
            if level.right.len() <= DIRECT || count * 10 > nodes * 9 || levels.len() + 1 >= LEVELS {
                levels.push(level);
                break;
            }
            let pattern = if levels.is_empty() { &matrix.pattern } else { &level.links };
            let patterns = [pattern, &level.ties, &level.links];
            let mut transfer = Transfer::lay_out(patterns, level.rows_a_node, aggregate, count);
            let coarse = transfer.lay_out_coarse();
            graph = transfer.coarse_graph(&graph, count);
            level.transfer = Some(transfer);
            levels.push(level);
            fixed = vec![false; count];
            level = Level::of_bodies(coarse);
        }
        let coarsest: &Level = levels.last().expect("there is a level");
        let direct = Direct::lay_out(&coarsest.links, &coarsest.ties, coarsest.rows_a_node);
        Self { levels, direct }
    }

    /// Works out all that follows from the values of the matrix and the places of the nodes, but for its couplings: see
    /// [`Self::join`]. `caution` is by how much the largest eigenvalues are taken over their estimates; `CAUTION` mostly
    /// does. That of the finest level is estimated anew where `fresh`, as at the start of a step, and else kept.
    pub fn set_up(&mut self, matrix: &StepMatrix, position: &[DVec3], caution: f32, fresh: bool, parallel: bool) {
        for l in 0..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let level = &mut fine[l];
            level.joints.clear();
            match l {
                0 => level.take_finest(matrix, position, parallel),
                _ => level.take_bodies(parallel),
            }
            level.invert_diagonal(parallel);
            if l > 0 || fresh {
                level.largest = caution * level.largest_eigenvalue(parallel);
            }
            if let Some(next) = coarse.first_mut() {
                level.place_aggregates(next);
                level.smooth_prolongation(parallel);
                level.coarsen(matrix, next, parallel);
            }
        }
        self.factorise(matrix);
    }

    /// Takes up the couplings of the matrix, in place of those taken up before.
    pub fn join(&mut self, matrix: &StepMatrix, parallel: bool) {
        if matrix.couplings.is_empty() && self.levels[0].joints.is_empty() {
            return;
        }
        for l in 0..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(l);
            let level = &mut coarse[0];
            let nodes = level.position.len();
            match fine.last() {
                None => level.joints.take(matrix.couplings.ties(), nodes),
                Some(finer) => {
                    let onward = Onward {
                        aggregate: &finer.transfer.as_ref().expect("not the coarsest").aggregate,
                        position: [&finer.position, &level.position],
                        reach: [finer.reach, level.reach],
                    };
                    level.joints.follow(&finer.joints, &onward, nodes);
                }
            }
            level.invert_diagonal(parallel);
        }
        self.factorise(matrix);
    }

    fn factorise(&mut self, matrix: &StepMatrix) {
        let Self { levels, direct } = self;
        let Level { links, exact, joints, rows_a_node, .. } = levels.last().expect("there is a level");
        direct.clear();
        match rows_a_node {
            1 => direct.add_matrix(matrix),
            _ => direct.add_bodies(links, exact),
        }
        joints.blocks(*rows_a_node, |rows, block| direct.add_block(rows, block));
        direct.factorise();
    }

    /// One V-cycle: an approximation of `A^-1 right`, where `right` gives the rows of the right side.
    pub fn cycle(&mut self, right: impl Fn(usize) -> Vec4 + Sync, parallel: bool) -> &[Vec4] {
        super::blocks::by_rows(&mut self.levels[0].right, parallel, |first, rows| {
            rows.iter_mut().enumerate().for_each(|(k, row)| *row = right(first + k));
        });
        self.descend(0, parallel);
        &self.levels[0].solution
    }

    fn descend(&mut self, l: usize, parallel: bool) {
        if l + 1 == self.levels.len() {
            self.solve_coarsest(parallel);
            return;
        }
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &mut coarse[0]);
        level.smooth(true, parallel);
        level.finish_residual(parallel);
        let transfer = level.transfer.as_ref().expect("not the coarsest");
        transfer.restrict(&level.residual, next.right.as_chunks_mut::<2>().0, parallel);
        self.descend(l + 1, parallel);
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &coarse[0]);
        let transfer = level.transfer.as_ref().expect("not the coarsest");
        transfer.prolong(&next.solution, &mut level.solution, parallel);
        level.smooth(false, parallel);
    }

    fn solve_coarsest(&mut self, parallel: bool) {
        let level = self.levels.last_mut().expect("there is a level");
        if self.direct.leaves_some() {
            level.smooth(true, parallel);
            for _ in 0..8 {
                level.smooth(false, parallel);
            }
        }
        self.direct.solve(&level.right, &mut level.solution);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::solver::conjugate_gradients::{ConjugateGradients, Tolerance};
    use glam::DMat3;

    /// Enough for more than one part of a coarsening.
    const SIDE: usize = 100;

    /// Nodes of a wavy net, the first row of them held; blocks along its sides and diagonals, ties to nodes beyond, and mass.
    fn net() -> (StepMatrix, Vec<DVec3>, Vec<bool>) {
        let mut random = Random::new(5, 1);
        let mut uneven = || 0.2 * (random.uniform() - 0.5);
        let place = |i: usize| (i / SIDE, i % SIDE);
        let position = |i: usize| {
            let (row, column) = place(i);
            DVec3::new(row as f64 + uneven(), column as f64 + uneven(), (0.3 * row as f64).sin())
        };
        let count = SIDE * SIDE;
        let position: Vec<DVec3> = (0..count).map(position).collect();
        let near = |i: usize, reach: usize| {
            let around = |k: usize| k.saturating_sub(reach)..(k + reach + 1).min(SIDE);
            let (row, column) = place(i);
            around(row).flat_map(|r| around(column).map(move |c| (r * SIDE + c) as u32)).collect::<Vec<_>>()
        };
        let fixed: Vec<bool> = (0..count).map(|i| i < SIDE).collect();
        let pattern = Pattern::from_rows((0..count).map(|i| near(i, 1)));
        let ties = Pattern::from_rows(
            (0..count)
                .map(|i| near(i, 2).into_iter().filter(|j| place(*j as usize).0.abs_diff(place(i).0) == 2).collect()),
        );
        let mut matrix = StepMatrix::zeros(pattern, ties);
        for i in 0..count {
            let diagonal = matrix.diagonal[i] as usize;
            matrix.blocks[diagonal] += DMat3::from_diagonal(DVec3::splat(1e-3));
            for k in matrix.pattern.row(i).filter(|k| *k != diagonal) {
                let j = matrix.pattern.column[k] as usize;
                let along = (position[j] - position[i]).normalize();
                let block = DMat3::from_cols(along * along.x, along * along.y, along * along.z);
                matrix.blocks[diagonal] += block;
                matrix.blocks[k] -= if fixed[i] || fixed[j] { DMat3::ZERO } else { block };
            }
            for k in matrix.ties.row(i) {
                let tie = if fixed[i] || fixed[matrix.ties.column[k] as usize] { 0.0 } else { 1e-3 };
                matrix.blocks[diagonal] += DMat3::from_diagonal(DVec3::splat(tie));
                matrix.tie[k] -= tie;
            }
        }
        (matrix, position, fixed)
    }

    fn energy_of_bodies(level: &Level, x: &[Vec4]) -> f64 {
        let mut energy = 0.0;
        for i in 0..level.links.rows() {
            for k in level.links.row(i) {
                let j = level.links.column[k] as usize;
                for half in 0..2 {
                    let own = x[2 * i + half].truncate().as_dvec3();
                    let image = level.exact[k][half].part(0) * x[2 * j].truncate().as_dvec3()
                        + level.exact[k][half].part(1) * x[2 * j + 1].truncate().as_dvec3();
                    energy += own.dot(image);
                }
            }
        }
        energy
    }

    /// P^T A P by its definition: what moves of bodies make of the nodes costs as much energy on either level.
    #[test]
    fn levels_have_the_energy_of_what_they_stand_for() {
        let (matrix, position, fixed) = net();
        let mut multigrid = Multigrid::lay_out(&matrix, &fixed);
        assert!(multigrid.levels.len() > 2, "{} levels", multigrid.levels.len());
        multigrid.set_up(&matrix, &position, CAUTION, true, false);
        let mut random = Random::new(6, 1);
        let mut vector = || DVec3::new(random.normal(), random.normal(), random.normal()).as_vec3().extend(0.0);
        for fine in 0..multigrid.levels.len() - 1 {
            let [level, next] = [&multigrid.levels[fine], &multigrid.levels[fine + 1]];
            let moves: Vec<Vec4> = next.right.iter().map(|_| vector()).collect();
            let mut field = vec![Vec4::ZERO; level.right.len()];
            level.transfer.as_ref().unwrap().prolong(&moves, &mut field, false);
            let of_nodes = match fine {
                0 => {
                    let field: Vec<DVec3> = field.iter().map(|v| v.truncate().as_dvec3()).collect();
                    let mut image = field.clone();
                    matrix.multiply(&field, &mut image, false);
                    field.iter().zip(&image).map(|(x, y)| x.dot(*y)).sum()
                }
                _ => energy_of_bodies(level, &field),
            };
            let of_bodies = energy_of_bodies(next, &moves);
            assert!((of_nodes / of_bodies - 1.0).abs() < 1e-5, "level {fine}: {of_nodes} and {of_bodies}");
            // Restriction is the transpose of prolongation.
            let force: Vec<Vec4> = field.iter().map(|_| vector()).collect();
            let mut passed_on = vec![[Vec4::ZERO; 2]; next.right.len() / 2];
            level.transfer.as_ref().unwrap().restrict(&force, &mut passed_on, false);
            let dot = |a: &[Vec4], b: &[Vec4]| a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum::<f64>();
            let [works, passed] = [dot(&field, &force), dot(&moves, passed_on.as_flattened())];
            assert!((works - passed).abs() < 1e-4 * works.abs().max(10.0), "level {fine}: {works} and {passed}");
        }
    }

    #[test]
    fn a_few_cycles_solve_and_threads_change_no_bit() {
        let (matrix, position, fixed) = net();
        let mut random = Random::new(7, 1);
        let force = |i: usize| if fixed[i] { DVec3::ZERO } else { DVec3::splat(random.normal()) };
        let force: Vec<DVec3> = (0..position.len()).map(force).collect();
        let solutions = [false, true].map(|parallel| {
            let mut multigrid = Multigrid::lay_out(&matrix, &fixed);
            multigrid.set_up(&matrix, &position, CAUTION, true, parallel);
            let (mut left, mut solution) = (force.clone(), force.clone());
            let tolerance = Tolerance { relative: 1e-6, energy: 0.0, iterations: 100 };
            let mut linear = ConjugateGradients::default();
            let iterations = linear.solve(&matrix, &mut multigrid, &mut left, &mut solution, tolerance, parallel);
            assert!(iterations.unwrap() < 30, "{iterations:?}");
            let mut image = solution.clone();
            matrix.multiply(&solution, &mut image, parallel);
            let most = force.iter().zip(&image).map(|(force, image)| force.distance(*image)).fold(0.0, f64::max);
            assert!(most < 1e-2, "{most}");
            solution
        });
        assert_eq!(solutions[0], solutions[1]);
    }
}
