//! Smoothed-aggregation multigrid for the matrices of implicit steps: a preconditioner in single precision.
//!
//! Model: aggregates of neighbouring nodes become the nodes of the next level; piecewise constant prolongation, smoothed
//! by one step of damped Jacobi; Galerkin products; Chebyshev smoothing. Source: [Vanek1996]; for cloth [Tamstorf2015].
//! The patterns of all levels follow from the topology alone and are kept until it changes; the values are new in every
//! step, for springs go slack and taut. Cost: set-up about three products with the matrix, a cycle about six.

use super::StepMatrix;
use super::blocks::{Pattern, block_row_times, by_block_rows, by_row_pairs, by_rows, multiply_rows, on_widest_unit};
use super::galerkin::{Blocks, Row, add_product, product_row, restricted_row};
use glam::{DVec3, Mat3A, Vec3A};

/// No aggregate: the node is fixed.
const NONE: u32 = u32::MAX;
/// Rows at and under which a level is solved directly.
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

/// From a level to the next.
struct Transfer {
    aggregate: Vec<u32>,
    /// Number of nodes of each aggregate.
    size: Vec<f32>,
    /// How a rotation of the aggregate moves each row.
    tentative: Vec<Mat3A>,
    /// Where the displacement of a row's own aggregate stands among the row's blocks of the prolongation.
    own: Vec<u8>,
    /// Prolongation.
    pattern: Pattern,
    blocks: Vec<Mat3A>,
    /// Where the displacement of the aggregate of each block's column stands among the row's blocks of the prolongation.
    smoothed_at: Vec<u8>,
    /// The same for each tie.
    tied_at: Vec<u8>,
    /// Restriction: the transpose, with the block of the prolongation each stands for.
    transposed: Pattern,
    origin: Vec<u32>,
    /// A times prolongation: pattern, values, and where each product goes within its row.
    product: Pattern,
    product_blocks: Vec<Mat3A>,
    product_at: Vec<u16>,
    first_product: Vec<u32>,
    /// Where each product of restriction and that goes within its row.
    coarse_at: Vec<u16>,
    first_coarse: Vec<u32>,
}

/// The levels of a matrix.
#[derive(Default)]
pub struct Multigrid {
    levels: Vec<Level>,
    /// Cholesky factor of the coarsest level, by rows.
    factor: Vec<f32>,
    scratch: Vec<f32>,
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
        Self { levels, ..Self::default() }
    }

    /// Works out all that follows from the values of the matrix and the places of the nodes. `caution` is by how much the
    /// largest eigenvalues are taken over their estimates; `CAUTION` mostly does. Estimates are made anew where
    /// `fresh`, as at the start of a step, and else follow from the last.
    pub fn set_up(&mut self, matrix: &StepMatrix, position: &[DVec3], caution: f32, fresh: bool, parallel: bool) {
        let finest = &mut self.levels[0];
        by_rows(&mut finest.blocks, parallel, |first, blocks| {
            for (k, block) in blocks.iter_mut().enumerate() {
                *block = matrix.blocks[first + k].as_mat3().into();
            }
        });
        finest.tie.iter_mut().zip(&matrix.tie).for_each(|(single, double)| *single = *double as f32);
        finest.position.iter_mut().zip(position).for_each(|(single, double)| *single = double.as_vec3a());
        for l in 0..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let level = &mut fine[l];
            let Level { inverse_diagonal, diagonal, blocks, .. } = level;
            by_rows(inverse_diagonal, parallel, |first, inverse| {
                for (k, inverse) in inverse.iter_mut().enumerate() {
                    *inverse = blocks[diagonal[first + k] as usize].inverse();
                }
            });
            let iterations = match (fresh, l) {
                (false, _) => POWER_AGAIN,
                (true, 0) => POWER_FINEST,
                (true, _) => POWER,
            };
            level.largest = caution * level.largest_eigenvalue(fresh, iterations, parallel);
            if let (Some(next), Some(_)) = (coarse.first_mut(), &level.transfer) {
                level.place_aggregates(next);
                level.smooth_prolongation(parallel);
                level.galerkin(&next.pattern, &mut next.blocks, parallel);
            }
        }
        self.factorise();
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

    /// Cholesky factorisation of the coarsest matrix, dense; none where it is too large for that.
    fn factorise(&mut self) {
        let level = self.levels.last().expect("there is a level");
        let nodes = level.pattern.rows();
        self.factor.clear();
        if nodes > 4 * DIRECT {
            return;
        }
        let n = 3 * nodes;
        self.factor.resize(n * n, 0.0);
        self.scratch.resize(n, 0.0);
        let factor = &mut self.factor;
        for i in 0..nodes {
            for k in level.pattern.row(i) {
                let j = level.pattern.column[k] as usize;
                let block = level.blocks[k].to_cols_array_2d();
                for (c, column) in block.iter().enumerate() {
                    for (r, value) in column.iter().enumerate() {
                        factor[(3 * i + r) * n + 3 * j + c] = *value;
                    }
                }
            }
        }
        for i in 0..n {
            for j in 0..=i {
                let (upper, lower) = factor.split_at_mut(i * n);
                let row_i = &mut lower[..n];
                let sum: f32 = if i == j {
                    row_i[..j].iter().map(|v| v * v).sum()
                } else {
                    upper[j * n..j * n + j].iter().zip(&row_i[..j]).map(|(a, b)| a * b).sum()
                };
                let value = row_i[j] - sum;
                row_i[j] = if i == j {
                    // Rounding can leave nothing of a tiny pivot; its own size then stands in.
                    value.max(1e-6 * row_i[j].abs()).max(f32::MIN_POSITIVE).sqrt()
                } else {
                    value / upper[j * n + j]
                };
            }
        }
    }

    fn solve_coarsest(&mut self, parallel: bool) {
        let level = self.levels.last_mut().expect("there is a level");
        if self.factor.is_empty() {
            level.smooth(true, parallel);
            for _ in 0..8 {
                level.smooth(false, parallel);
            }
            return;
        }
        let n = 3 * level.pattern.rows();
        let (factor, x) = (&self.factor, &mut self.scratch);
        for i in 0..n {
            let sum: f32 = (0..i).map(|j| factor[i * n + j] * x[j]).sum();
            x[i] = (level.right[i / 3][i % 3] - sum) / factor[i * n + i];
        }
        for i in (0..n).rev() {
            x[i] /= factor[i * n + i];
            let value = x[i];
            for j in 0..i {
                x[j] -= factor[i * n + j] * value;
            }
        }
        for (k, solution) in level.solution.iter_mut().enumerate() {
            *solution = Vec3A::new(x[3 * k], x[3 * k + 1], x[3 * k + 2]);
        }
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

    /// `image = A step`, or `A solution`.
    fn multiply(&mut self, of: Of, parallel: bool) {
        let Self { pattern, blocks, ties, tie, solution, step, image, .. } = self;
        let x: &[Vec3A] = match of {
            Of::Step => step,
            Of::Solution => solution,
        };
        by_rows(image, parallel, |first, image| multiply_rows(pattern, blocks, ties, tie, x, first, image));
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
            tentative[*rows_a_node * i] = Mat3A::from_cols(
                Vec3A::new(0.0, -arm.z, arm.y),
                Vec3A::new(arm.z, 0.0, -arm.x),
                Vec3A::new(-arm.y, arm.x, 0.0),
            );
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
                add_product(&mut prolongation[at + 1], &blocks[k], &tentative[j]);
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
    fn galerkin(&mut self, coarse_pattern: &Pattern, coarse: &mut [Mat3A], parallel: bool) {
        let Self { pattern, blocks, ties, tie, transfer, .. } = self;
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
            if !sums.is_empty() {
                let (row, tied) = (pattern.row(i), ties.row(i));
                let row = Row { columns: &pattern.column[row.clone()], values: &blocks[row] };
                let tied = Row { columns: &ties.column[tied.clone()], values: &tie[tied] };
                product_row(row, tied, right, &product_at[first_product[i] as usize..], sums);
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

/// Rows of the restriction of a field.
fn restrict_rows(
    transposed: &Pattern,
    origin: &[u32],
    blocks: &[Mat3A],
    field: &[Vec3A],
    first: usize,
    restricted: &mut [Vec3A],
) {
    on_widest_unit!((
        transposed: &Pattern,
        origin: &[u32],
        blocks: &[Mat3A],
        field: &[Vec3A],
        first: usize,
        restricted: &mut [Vec3A],
    ) {
        for (k, restricted) in restricted.iter_mut().enumerate() {
            let mut sums = [Vec3A::ZERO; 3];
            let row = transposed.row(first + k);
            for (j, m) in transposed.column[row.clone()].iter().zip(&origin[row]) {
                let (value, block) = (field[*j as usize], &blocks[*m as usize]);
                sums[0] += block.x_axis * value;
                sums[1] += block.y_axis * value;
                sums[2] += block.z_axis * value;
            }
            *restricted = Vec3A::from_array(sums.map(|sum| sum.element_sum()));
        }
    });
}

/// Adds rows of the prolongation of a coarse field.
fn prolongate_rows(pattern: &Pattern, blocks: &[Mat3A], coarse: &[Vec3A], first: usize, field: &mut [Vec3A]) {
    on_widest_unit!((pattern: &Pattern, blocks: &[Mat3A], coarse: &[Vec3A], first: usize, field: &mut [Vec3A]) {
        for (k, value) in field.iter_mut().enumerate() {
            *value += block_row_times(pattern, blocks, coarse, first + k);
        }
    });
}

/// Groups of nodes around nodes that are far enough apart: the aggregate of each node, and how many there are. Fixed
/// nodes are in none.
fn aggregates(graph: &Pattern, fixed: &[bool]) -> (Vec<u32>, usize) {
    let rows = graph.rows();
    let mut aggregate = vec![NONE; rows];
    let mut count = 0u32;
    let neighbours = |i: usize| graph.columns(i).iter().map(|j| *j as usize).filter(move |j| *j != i && !fixed[*j]);
    for i in 0..rows {
        if !fixed[i] && aggregate[i] == NONE && neighbours(i).all(|j| aggregate[j] == NONE) {
            aggregate[i] = count;
            neighbours(i).for_each(|j| aggregate[j] = count);
            count += 1;
        }
    }
    let cores = aggregate.clone();
    for i in 0..rows {
        if !fixed[i] && aggregate[i] == NONE {
            match neighbours(i).map(|j| cores[j]).filter(|a| *a != NONE).min() {
                Some(near) => aggregate[i] = near,
                None => {
                    aggregate[i] = count;
                    count += 1;
                }
            }
        }
    }
    (aggregate, count as usize)
}

impl Transfer {
    fn lay_out(matrix: &Pattern, ties: &Pattern, rows_a_node: usize, aggregate: Vec<u32>, count: usize) -> Self {
        let rows = matrix.rows();
        let aggregate_of = |row: u32| aggregate[row as usize / rows_a_node];
        let all_columns = |i: usize| matrix.columns(i).iter().chain(ties.columns(i)).copied();
        let pattern = Pattern::from_rows((0..rows).map(|i| {
            if aggregate_of(i as u32) == NONE {
                return Vec::new();
            }
            all_columns(i).map(aggregate_of).filter(|a| *a != NONE).flat_map(|a| [2 * a, 2 * a + 1]).collect()
        }));
        let place = |i: usize, j: u32| {
            let a = aggregate_of(j);
            let found = (a != NONE).then(|| pattern.find(i, 2 * a)).flatten();
            found.map_or(u8::MAX, |k| (k - pattern.first[i] as usize) as u8)
        };
        let own = (0..rows).map(|i| place(i, i as u32)).collect();
        let places = |of: &Pattern| {
            (0..rows).flat_map(|i| of.columns(i).iter().map(move |j| (i, *j))).map(|(i, j)| place(i, j)).collect()
        };
        let (smoothed_at, tied_at) = (places(matrix), places(ties));
        let product = Pattern::from_rows((0..rows).map(|i| {
            if pattern.row(i).is_empty() {
                return Vec::new();
            }
            all_columns(i).flat_map(|j| pattern.columns(j as usize)).copied().collect()
        }));
        let mut product_at = Vec::new();
        let mut first_product = Vec::with_capacity(rows);
        for i in 0..rows {
            first_product.push(product_at.len() as u32);
            for j in all_columns(i) {
                for a in pattern.columns(j as usize) {
                    // A fixed node has no row: its products fall away with it.
                    product_at.push(product.find(i, *a).map_or(0, |k| (k - product.first[i] as usize) as u16));
                }
            }
        }
        let mut size = vec![0.0; count];
        aggregate.iter().filter(|a| **a != NONE).for_each(|a| size[*a as usize] += 1.0);
        let (transposed, origin) = pattern.transposed(2 * count);
        Self {
            blocks: vec![Mat3A::ZERO; pattern.blocks()],
            product_blocks: vec![Mat3A::ZERO; product.blocks()],
            tentative: vec![Mat3A::ZERO; rows],
            own,
            size,
            aggregate,
            pattern,
            smoothed_at,
            tied_at,
            transposed,
            origin,
            product,
            product_at,
            first_product,
            coarse_at: Vec::new(),
            first_coarse: Vec::new(),
        }
    }

    fn coarse_pattern(&self) -> Pattern {
        Pattern::from_rows((0..self.transposed.rows()).map(|a| {
            self.transposed
                .columns(a)
                .iter()
                .flat_map(|i| self.product.columns(*i as usize))
                .copied()
                .chain([a as u32])
                .collect()
        }))
    }

    /// Which aggregates touch: the graph of the next level.
    fn coarse_graph(&self, graph: &Pattern, count: usize) -> Pattern {
        let mut rows: Vec<Vec<u32>> = (0..count as u32).map(|a| vec![a]).collect();
        for i in 0..graph.rows() {
            for j in graph.columns(i) {
                let (a, b) = (self.aggregate[i], self.aggregate[*j as usize]);
                if a != NONE && b != NONE {
                    rows[a as usize].push(b);
                }
            }
        }
        Pattern::from_rows(rows.into_iter())
    }

    fn place_coarse(&mut self, coarse: &Pattern) {
        for a in 0..coarse.rows() {
            self.first_coarse.push(self.coarse_at.len() as u32);
            for i in self.transposed.columns(a) {
                for b in self.product.columns(*i as usize) {
                    let place = coarse.find(a, *b).expect("the pattern holds every product");
                    self.coarse_at.push((place - coarse.first[a] as usize) as u16);
                }
            }
        }
    }
}
