//! Smoothed-aggregation multigrid for the matrices of implicit steps: a preconditioner whose cycles are in single precision.
//!
//! Model: aggregates of neighbouring nodes become the nodes of the next level, each a rigid body; prolongation smoothed by
//! one step of damped Jacobi; Galerkin products; Chebyshev smoothing. Source: [Vanek1996]; for cloth [Tamstorf2015].
//! A sheet's mass is often under the seventh digit of its stiffness. So products are taken of differences: what a node
//! is off the rigid motion of its neighbour; and what such a motion itself meets, mass and pins, stands apart as the
//! `ground` of a node, worked out in double precision. The patterns of all levels follow from the topology alone and are kept until
//! it changes. Cost: set-up about three products with the matrix, a cycle about six.

mod direct;
mod transfer;

use super::StepMatrix;
use super::blocks::{Pattern, by_block_rows, by_row_pairs, by_rows, on_widest_unit};
use super::galerkin::{Blocks, Row, Wide, finest_product_row, product_row, restricted_row};
use direct::Direct;
use glam::{DMat3, DVec3, Mat3A, Vec3A};
use transfer::{Transfer, aggregates, prolongate_rows, restrict_rows};

/// No aggregate: the node is fixed.
const NONE: u32 = u32::MAX;
/// Rows at and under which a level is the coarsest.
const DIRECT: usize = 48;
/// Degree of the Chebyshev smoother before and after the coarse correction.
const DEGREE: usize = 2;
/// Iterations that estimate the largest eigenvalue of the finest level, and of the others, where they are cheap.
const POWER_FINEST: usize = 8;
const POWER: usize = 20;
/// The same from the vector of the last estimate on.
const POWER_AGAIN: usize = 3;
/// Factor over estimates from below. // tuned: 1.05 to 1.3
pub const CAUTION: f32 = 1.15;
/// Smallest eigenvalue that smoothing aims at, as a part of the largest.
const SMOOTHED: f32 = 1.0 / 8.0;
/// What is added to a block of the diagonal before it is inverted, as a part of its mean: a body on a line does not turn about it.
const SOFT: f64 = 1e-9;

/// One level. Its nodes have one row each on the finest (a displacement), two on all others (a displacement and a
/// rotation).
#[derive(Default)]
struct Level {
    rows_a_node: usize,
    /// Where the nodes are, for rotations about the middle of an aggregate.
    position: Vec<Vec3A>,
    /// Unit of rotations: a rotation in this level is the displacement it gives at this distance.
    reach: f32,
    pattern: Pattern,
    blocks: Vec<Mat3A>,
    /// The same in double precision, on all levels but the finest, where the matrix itself has them.
    exact: Vec<Wide>,
    /// What a rigid motion of a node and all around it meets: a block for each row of the node and kind of motion.
    ground: Vec<Mat3A>,
    /// Numbers that tie nodes in all directions alike, on the finest level only.
    ties: Pattern,
    tie: Vec<f32>,
    inverse_diagonal: Vec<Mat3A>,
    /// Where in `blocks` each diagonal stands.
    diagonal: Vec<u32>,
    /// Bound on the eigenvalues of D^-1 A.
    largest: f32,
    right: Vec<Vec3A>,
    solution: Vec<Vec3A>,
    residual: Vec<Vec3A>,
    step: Vec<Vec3A>,
    image: Vec<Vec3A>,
    /// Close to the eigenvector of the largest eigenvalue.
    roughest: Vec<Vec3A>,
    transfer: Option<Transfer>,
}

/// What a matrix is multiplied with.
#[derive(Clone, Copy)]
enum Of {
    Step,
    Solution,
}

/// The levels of a matrix.
#[derive(Default)]
pub struct Multigrid {
    levels: Vec<Level>,
    direct: Direct,
}

impl Multigrid {
    /// Lays out the levels of a matrix; `fixed` nodes take no part.
    pub fn lay_out(matrix: &StepMatrix, fixed: &[bool]) -> Self {
        let mut levels = Vec::new();
        let mut fixed = fixed.to_vec();
        let (mut pattern, mut ties) = (matrix.pattern.clone(), matrix.ties.clone());
        let mut graph = Pattern::from_rows((0..pattern.rows()).map(|i| [pattern.columns(i), ties.columns(i)].concat()));
        let mut rows_a_node = 1;
        loop {
            let rows = pattern.rows();
            let nodes = graph.rows();
            let diagonal =
                (0..rows).map(|i| pattern.find(i, i as u32).expect("a matrix has its diagonal") as u32).collect();
            let mut level = Level {
                rows_a_node,
                position: vec![Vec3A::ZERO; nodes],
                diagonal,
                blocks: vec![Mat3A::ZERO; pattern.blocks()],
                exact: vec![Wide::ZERO; if rows_a_node == 1 { 0 } else { pattern.blocks() }],
                ground: vec![Mat3A::ZERO; rows * rows_a_node],
                tie: vec![0.0; ties.blocks()],
                inverse_diagonal: vec![Mat3A::ZERO; rows],
                right: vec![Vec3A::ZERO; rows],
                solution: vec![Vec3A::ZERO; rows],
                residual: vec![Vec3A::ZERO; rows],
                step: vec![Vec3A::ZERO; rows],
                image: vec![Vec3A::ZERO; rows],
                roughest: vec![Vec3A::ZERO; rows],
                pattern,
                ties,
                ..Level::default()
            };
            let (aggregate, count) = aggregates(&graph, &fixed);
            if rows <= DIRECT || count * 10 > nodes * 9 || levels.len() > 12 {
                levels.push(level);
                break;
            }
            let mut transfer = Transfer::lay_out(&level.pattern, &level.ties, rows_a_node, aggregate, count);
            let coarse = transfer.coarse_pattern();
            transfer.place_coarse(&coarse);
            graph = transfer.coarse_graph(&graph, count);
            level.transfer = Some(transfer);
            levels.push(level);
            fixed = vec![false; count];
            pattern = coarse;
            ties = Pattern::empty(pattern.rows());
            rows_a_node = 2;
        }
        let coarsest: &Level = levels.last().expect("there is a level");
        let direct = Direct::lay_out(&coarsest.pattern, &coarsest.ties);
        Self { levels, direct }
    }

    /// Works out all that follows from the values of the matrix and the places of the nodes. `caution` is by how much the
    /// largest eigenvalues are taken over their estimates; `CAUTION` mostly does. Estimates are made anew where
    /// `fresh`, as at the start of a step, and else follow from the last.
    pub fn set_up(&mut self, matrix: &StepMatrix, position: &[DVec3], caution: f32, fresh: bool, parallel: bool) {
        let finest = &mut self.levels[0];
        finest.tie.iter_mut().zip(&matrix.tie).for_each(|(single, double)| *single = *double as f32);
        finest.position.iter_mut().zip(position).for_each(|(single, double)| *single = double.as_vec3a());
        for l in 0..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let level = &mut fine[l];
            if l == 0 {
                level.take_finest(matrix, parallel);
            } else {
                level.take_coarse(parallel);
            }
            let iterations = match (fresh, l) {
                (false, _) => POWER_AGAIN,
                (true, 0) => POWER_FINEST,
                (true, _) => POWER,
            };
            level.largest = caution * level.largest_eigenvalue(fresh, iterations, parallel);
            if let (Some(next), Some(_)) = (coarse.first_mut(), &level.transfer) {
                level.place_aggregates(next);
                level.smooth_prolongation(parallel);
                level.galerkin(matrix, &next.pattern, &mut next.exact, parallel);
            }
        }
        let Self { levels, direct } = self;
        match levels.as_slice() {
            [only] => direct.factorise(&only.pattern, |k| matrix.blocks[k].into(), &only.ties, |k| matrix.tie[k]),
            [.., coarsest] => direct.factorise(&coarsest.pattern, |k| coarsest.exact[k], &coarsest.ties, |_| 0.0),
            [] => unreachable!("there is a level"),
        }
    }

    /// One V-cycle: an approximation of `A^-1 right`.
    pub fn cycle(&mut self, right: &[Vec3A], parallel: bool) -> &[Vec3A] {
        self.levels[0].right.copy_from_slice(right);
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
        level.take_residual(parallel);
        let transfer = level.transfer.as_ref().expect("not the coarsest");
        let Transfer { blocks, transposed, origin, .. } = transfer;
        by_rows(&mut next.right, parallel, |first, right| {
            restrict_rows(transposed, origin, blocks, &level.residual, first, right);
        });
        self.descend(l + 1, parallel);
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &coarse[0]);
        let transfer = level.transfer.as_ref().expect("not the coarsest");
        by_rows(&mut level.solution, parallel, |first, solution| {
            prolongate_rows(&transfer.pattern, &transfer.blocks, &next.solution, first, solution);
        });
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

impl Level {
    /// Chebyshev iteration on the eigenvalues from `SMOOTHED` of the largest to the largest [Adams2003].
    fn smooth(&mut self, from_nothing: bool, parallel: bool) {
        let (high, low) = (self.largest, self.largest * SMOOTHED);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = middle / half;
        let mut rho = 1.0 / sigma;
        // The residual and first step; steps go through a second buffer, so that rows do not see each other's new ones.
        if from_nothing {
            let Self { inverse_diagonal, right, solution, residual, step, .. } = self;
            by_row_pairs(step, solution, parallel, |i, step, solution| {
                *step = inverse_diagonal[i] * right[i] / middle;
                *solution = *step;
            });
            residual.copy_from_slice(right);
        } else {
            self.take_residual(parallel);
            let Self { inverse_diagonal, solution, residual, step, .. } = self;
            by_row_pairs(step, solution, parallel, |i, step, solution| {
                *step = inverse_diagonal[i] * residual[i] / middle;
                *solution += *step;
            });
        }
        for _ in 1..DEGREE {
            let next = 1.0 / (2.0 * sigma - rho);
            let (keep, take) = (next * rho, 2.0 * next / half);
            self.multiply(Of::Step, parallel);
            let Self { inverse_diagonal, solution, residual, step, image, .. } = self;
            by_row_pairs(residual, step, parallel, |i, residual, step| {
                *residual -= image[i];
                *step = *step * keep + inverse_diagonal[i] * *residual * take;
            });
            by_rows(solution, parallel, |first, solution| {
                for (k, solution) in solution.iter_mut().enumerate() {
                    *solution += step[first + k];
                }
            });
            rho = next;
        }
    }

    /// Takes over the blocks of the finest level.
    fn take_finest(&mut self, matrix: &StepMatrix, parallel: bool) {
        let Self { pattern, ties, blocks, ground, inverse_diagonal, .. } = self;
        by_block_rows(pattern, blocks, parallel, |i, row| {
            let exact = &matrix.blocks[pattern.row(i)];
            row.iter_mut().zip(exact).for_each(|(single, double)| *single = double.as_mat3().into());
        });
        by_row_pairs(ground, inverse_diagonal, parallel, |i, ground, inverse| {
            let tied: f64 = matrix.tie[ties.row(i)].iter().sum();
            let sum: DMat3 = matrix.blocks[pattern.row(i)].iter().sum();
            *ground = (sum + DMat3::from_diagonal(DVec3::splat(tied))).as_mat3().into();
            *inverse = inverted(matrix.blocks[matrix.diagonal[i] as usize]);
        });
    }

    /// The same of another level, from what double precision has of them.
    fn take_coarse(&mut self, parallel: bool) {
        let Self { pattern, blocks, exact, ground, inverse_diagonal, diagonal, position, reach, .. } = self;
        by_block_rows(pattern, blocks, parallel, |i, row| {
            row.iter_mut().zip(&exact[pattern.row(i)]).for_each(|(single, double)| *single = double.single());
        });
        by_rows(ground.as_chunks_mut::<2>().0, parallel, |first, ground| {
            for (k, ground) in ground.iter_mut().enumerate() {
                let i = first + k;
                let own = position[i / 2];
                let [mut moves, mut turns] = [DMat3::ZERO; 2];
                let blocks = exact[pattern.row(i)].as_chunks::<2>().0;
                for (columns, blocks) in pattern.columns(i).as_chunks::<2>().0.iter().zip(blocks) {
                    let arm = (position[columns[0] as usize / 2] - own) / *reach;
                    let [along, about] = blocks.map(DMat3::from);
                    moves += along;
                    turns += along * turned(arm).as_dmat3() + about;
                }
                *ground = [moves, turns].map(|block| block.as_mat3().into());
            }
        });
        by_rows(inverse_diagonal, parallel, |first, inverse| {
            for (k, inverse) in inverse.iter_mut().enumerate() {
                *inverse = inverted(exact[diagonal[first + k] as usize].into());
            }
        });
    }

    /// `image = A step`, or `A solution`.
    fn multiply(&mut self, of: Of, parallel: bool) {
        let mut image = std::mem::take(&mut self.image);
        let x: &[Vec3A] = match of {
            Of::Step => &self.step,
            Of::Solution => &self.solution,
        };
        by_rows(&mut image, parallel, |first, image| match self.rows_a_node {
            1 => self.multiply_finest(x, first, image),
            _ => self.multiply_bodies(x, first, image),
        });
        self.image = image;
    }

    /// Rows of `A x` from `first` on, of the finest level. Several sums at once, for an addition takes longer than what
    /// it adds.
    fn multiply_finest(&self, x: &[Vec3A], first: usize, y: &mut [Vec3A]) {
        let level = self;
        on_widest_unit!((level: &Level, x: &[Vec3A], first: usize, y: &mut [Vec3A]) {
            let Level { pattern, blocks, ties, tie, ground, .. } = level;
            for (k, y) in y.iter_mut().enumerate() {
                let i = first + k;
                let own = x[i];
                let row = ties.row(i);
                let mut tied = [Vec3A::ZERO; 4];
                let (columns, values) = (&ties.column[row.clone()], &tie[row]);
                let (fours, rest) = columns.as_chunks::<4>();
                let (four_values, rest_of_values) = values.as_chunks::<4>();
                for (columns, values) in fours.iter().zip(four_values) {
                    for lane in 0..4 {
                        tied[lane] += (x[columns[lane] as usize] - own) * values[lane];
                    }
                }
                for (column, value) in rest.iter().zip(rest_of_values) {
                    tied[0] += (x[*column as usize] - own) * *value;
                }
                let row = pattern.row(i);
                let mut sums = [Vec3A::ZERO; 3];
                for (j, block) in pattern.column[row.clone()].iter().zip(&blocks[row]) {
                    add_image(&mut sums, block, x[*j as usize] - own);
                }
                add_image(&mut sums, &ground[i], own);
                *y = ((sums[0] + sums[1]) + sums[2]) + ((tied[0] + tied[1]) + (tied[2] + tied[3]));
            }
        });
    }

    /// The same of another level, two rows a node.
    fn multiply_bodies(&self, x: &[Vec3A], first: usize, y: &mut [Vec3A]) {
        let level = self;
        on_widest_unit!((level: &Level, x: &[Vec3A], first: usize, y: &mut [Vec3A]) {
            let Level { pattern, blocks, ground, position, reach, .. } = level;
            for (k, y) in y.as_chunks_mut::<2>().0.iter_mut().enumerate() {
                let i = first / 2 + k;
                let (moves, turns) = (x[2 * i], x[2 * i + 1]);
                // The turn over the unit of turns: what it moves at a distance.
                let turn = turns / *reach;
                let [upper, lower] = [pattern.row(2 * i), pattern.row(2 * i + 1)];
                let columns = pattern.column[upper.clone()].as_chunks::<2>().0;
                let [upper, lower] = [upper, lower].map(|row| blocks[row].as_chunks::<2>().0);
                let mut sums = [[Vec3A::ZERO; 3]; 2];
                for ((columns, upper), lower) in columns.iter().zip(upper).zip(lower) {
                    let j = columns[0] as usize / 2;
                    let along = x[2 * j] - moves - turn.cross(position[j] - position[i]);
                    let about = x[2 * j + 1] - turns;
                    for (sums, blocks) in sums.iter_mut().zip([upper, lower]) {
                        add_image(sums, &blocks[0], along);
                        add_image(sums, &blocks[1], about);
                    }
                }
                for (half, sums) in sums.iter_mut().enumerate() {
                    add_image(sums, &ground[4 * i + 2 * half], moves);
                    add_image(sums, &ground[4 * i + 2 * half + 1], turns);
                    y[half] = (sums[0] + sums[1]) + sums[2];
                }
            }
        });
    }

    /// `residual = right - A solution`.
    fn take_residual(&mut self, parallel: bool) {
        self.multiply(Of::Solution, parallel);
        let Self { right, residual, image, .. } = self;
        by_rows(residual, parallel, |first, residual| {
            for (k, residual) in residual.iter_mut().enumerate() {
                *residual = right[first + k] - image[first + k];
            }
        });
    }

    /// Largest eigenvalue of D^-1 A by power iteration, from a fixed rough vector where `fresh`, else from the last one.
    fn largest_eigenvalue(&mut self, fresh: bool, iterations: usize, parallel: bool) -> f32 {
        let rough = |k: usize| (k.wrapping_mul(2_654_435_761) >> 7 & 0xff) as f32 / 128.0 - 1.0;
        if fresh {
            for (i, v) in self.roughest.iter_mut().enumerate() {
                *v = Vec3A::new(rough(3 * i), rough(3 * i + 1), rough(3 * i + 2));
            }
        }
        self.step.copy_from_slice(&self.roughest);
        let mut largest = 1.0f32;
        for _ in 0..iterations {
            self.multiply(Of::Step, parallel);
            let Self { inverse_diagonal, residual, step, image, .. } = self;
            by_rows(residual, parallel, |first, scaled| {
                for (k, scaled) in scaled.iter_mut().enumerate() {
                    *scaled = inverse_diagonal[first + k] * image[first + k];
                }
            });
            let norm = |v: &[Vec3A]| v.iter().map(|v| f64::from(v.length_squared())).sum::<f64>().sqrt();
            let (before, after) = (norm(step), norm(residual));
            if before == 0.0 || after == 0.0 {
                break;
            }
            largest = (after / before) as f32;
            let scale = (1.0 / after) as f32;
            step.iter_mut().zip(residual.iter()).for_each(|(v, image)| *v = *image * scale);
        }
        self.roughest.copy_from_slice(&self.step);
        largest
    }

    /// The middle of each aggregate, and how rigid motions of it move its nodes.
    fn place_aggregates(&mut self, next: &mut Level) {
        let Self { position, transfer, rows_a_node, reach, .. } = self;
        let Transfer { aggregate, tentative, size, .. } = transfer.as_mut().expect("not the coarsest");
        next.position.fill(Vec3A::ZERO);
        let inside = || aggregate.iter().zip(position.iter()).filter(|(a, _)| **a != NONE);
        for (a, position) in inside() {
            next.position[*a as usize] += *position / size[*a as usize];
        }
        let squares: f64 = inside().map(|(a, p)| f64::from(p.distance_squared(next.position[*a as usize]))).sum();
        next.reach = (squares / position.len() as f64).sqrt().max(1e-30) as f32;
        for (i, (a, p)) in aggregate.iter().zip(position.iter()).enumerate().filter(|(_, (a, _))| **a != NONE) {
            let arm = (*p - next.position[*a as usize]) / next.reach;
            tentative[*rows_a_node * i] = turned(arm);
            if *rows_a_node == 2 {
                tentative[2 * i + 1] = Mat3A::from_diagonal(glam::Vec3::splat(*reach / next.reach));
            }
        }
    }

    /// P = (1 - omega D^-1 A) P0.
    fn smooth_prolongation(&mut self, parallel: bool) {
        let Self { pattern, blocks, ties, tie, inverse_diagonal, transfer, largest, rows_a_node, .. } = self;
        let transfer = transfer.as_mut().expect("not the coarsest");
        let omega = 4.0 / 3.0 / *largest;
        let Transfer { own, tentative, pattern: to, blocks: prolongation, smoothed_at, tied_at, .. } = transfer;
        by_block_rows(to, prolongation, parallel, |i, prolongation| {
            prolongation.fill(Mat3A::ZERO);
            if prolongation.is_empty() {
                return;
            }
            for k in pattern.row(i) {
                let at = smoothed_at[k] as usize;
                if at == usize::from(u8::MAX) {
                    continue;
                }
                let j = pattern.column[k] as usize;
                // A rotation of the node comes from the rotation of the aggregate alone.
                let turns = *rows_a_node == 2 && j % 2 == 1;
                if !turns {
                    prolongation[at] += blocks[k];
                }
                prolongation[at + 1] += blocks[k] * tentative[j];
            }
            for k in ties.row(i) {
                let at = tied_at[k] as usize;
                if at != usize::from(u8::MAX) {
                    prolongation[at] += Mat3A::from_diagonal(glam::Vec3::splat(tie[k]));
                    prolongation[at + 1] += tentative[ties.column[k] as usize] * tie[k];
                }
            }
            let scaled = inverse_diagonal[i] * -omega;
            prolongation.iter_mut().for_each(|block| *block = scaled * *block);
            let at = own[i] as usize;
            if !(*rows_a_node == 2 && i % 2 == 1) {
                prolongation[at] += Mat3A::IDENTITY;
            }
            prolongation[at + 1] += tentative[i];
        });
    }

    /// The matrix of the next level, P^T A P.
    fn galerkin(&mut self, matrix: &StepMatrix, coarse_pattern: &Pattern, coarse: &mut [Wide], parallel: bool) {
        let Self { rows_a_node, pattern, exact, ties, transfer, .. } = self;
        let Transfer {
            pattern: to,
            blocks: prolongation,
            transposed,
            origin,
            product,
            product_blocks,
            product_at,
            first_product,
            coarse_at,
            first_coarse,
            ..
        } = transfer.as_mut().expect("not the coarsest");
        let right = Blocks { pattern: to, values: prolongation };
        by_block_rows(product, product_blocks, parallel, |i, sums| {
            if sums.is_empty() {
                return;
            }
            let (row, places) = (pattern.row(i), &product_at[first_product[i] as usize..]);
            let columns = &pattern.column[row.clone()];
            if *rows_a_node == 1 {
                let tied = ties.row(i);
                let tied = Row { columns: &ties.column[tied.clone()], values: &matrix.tie[tied] };
                finest_product_row(Row { columns, values: &matrix.blocks[row] }, tied, right, places, sums);
            } else {
                product_row(Row { columns, values: &exact[row] }, right, places, sums);
            }
        });
        let right = Blocks { pattern: product, values: product_blocks };
        by_block_rows(coarse_pattern, coarse, parallel, |i, sums| {
            let row = transposed.row(i);
            let row = Row { columns: &transposed.column[row.clone()], values: &origin[row] };
            restricted_row(row, prolongation, right, &coarse_at[first_coarse[i] as usize..], sums);
        });
    }
}

/// `sums += block x`, a sum for each column.
#[inline(always)]
fn add_image(sums: &mut [Vec3A; 3], block: &Mat3A, x: Vec3A) {
    sums[0] += block.x_axis * x.x;
    sums[1] += block.y_axis * x.y;
    sums[2] += block.z_axis * x.z;
}

/// How a turn moves the end of an arm.
fn turned(arm: Vec3A) -> Mat3A {
    Mat3A::from_cols(Vec3A::new(0.0, -arm.z, arm.y), Vec3A::new(arm.z, 0.0, -arm.x), Vec3A::new(-arm.y, arm.x, 0.0))
}

/// The inverse of a block of the diagonal; nothing for nothing.
fn inverted(block: DMat3) -> Mat3A {
    let mean = (block.x_axis.x + block.y_axis.y + block.z_axis.z) / 3.0;
    if mean <= 0.0 {
        return Mat3A::ZERO;
    }
    let scaled = block * (1.0 / mean) + DMat3::from_diagonal(DVec3::splat(SOFT));
    (scaled.inverse() * (1.0 / mean)).as_mat3().into()
}
