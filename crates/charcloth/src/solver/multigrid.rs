//! Smoothed-aggregation multigrid for the matrices of implicit steps: a preconditioner whose cycles are in single precision.
//!
//! Model: aggregates of neighbouring nodes become the nodes of the next level, each a rigid body; prolongation smoothed by
//! one step of damped Jacobi; Galerkin products; Chebyshev smoothing. Source: [Vanek1996]; for cloth [Tamstorf2015].
//! A sheet's mass is often under the seventh digit of its stiffness. So products are taken of differences: what a node
//! is off the rigid motion of its neighbour; and what such a motion itself meets, mass and pins, stands apart as the
//! `ground` of a node, worked out in double precision. The patterns of all levels follow from the topology alone and are kept until
//! it changes. Cost: set-up about three products with the matrix, a cycle about six.

mod direct;
mod joints;
mod transfer;

use super::StepMatrix;
use super::blocks::{Pattern, by_block_rows, by_row_pairs, by_rows, on_widest_unit};
use super::galerkin::{Blocks, Row, Wide, finest_product_row, product_row, restricted_row};
use direct::Direct;
use glam::{DMat3, DVec3, Mat3A, Vec3A};
use joints::{Joints, Onward};
use transfer::{Transfer, add_rows, aggregates};

/// No aggregate: the node is fixed.
const NONE: u32 = u32::MAX;
/// Rows at and under which a level is the coarsest.
const DIRECT: usize = 48;
/// Degree of the Chebyshev smoother before and after the coarse correction.
const DEGREE: usize = 2;
/// Steps of Lanczos that estimate the largest eigenvalue of a level. // tuned: 5 to 12
const LANCZOS: usize = 7;
/// Factor over estimates. // tuned: 1.0 to 1.2
pub const CAUTION: f32 = 1.05;
/// Smallest eigenvalue that smoothing aims at, as a part of the largest.
const SMOOTHED: f32 = 1.0 / 8.0;
/// Least ground of a row, as a part of its stiffness, that single precision tells from nothing. What has less is taken to have
/// as much by the smoother; the coarsening goes by what it has. // tuned: some roundings of 6e-8, 2e-7 to 1e-6
const TOLD: f64 = 4e-7;

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
    /// The diagonal without contact, with what it lacks to be told from nothing.
    stiffness: Vec<DMat3>,
    inverse_diagonal: Vec<Mat3A>,
    /// What contact adds.
    joints: Joints,
    /// Where in `blocks` each diagonal stands.
    diagonal: Vec<u32>,
    /// Bound on the eigenvalues of D^-1 A.
    largest: f32,
    right: Vec<Vec3A>,
    solution: Vec<Vec3A>,
    residual: Vec<Vec3A>,
    step: Vec<Vec3A>,
    image: Vec<Vec3A>,
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
                stiffness: vec![DMat3::ZERO; rows],
                right: vec![Vec3A::ZERO; rows],
                solution: vec![Vec3A::ZERO; rows],
                residual: vec![Vec3A::ZERO; rows],
                step: vec![Vec3A::ZERO; rows],
                image: vec![Vec3A::ZERO; rows],
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

    /// Works out all that follows from the values of the matrix and the places of the nodes, but for its couplings: see
    /// [`Self::join`]. `caution` is by how much the largest eigenvalues are taken over their estimates; `CAUTION` mostly
    /// does. That of the finest level is estimated anew where `fresh`, as at the start of a step, and else kept.
    pub fn set_up(&mut self, matrix: &StepMatrix, position: &[DVec3], caution: f32, fresh: bool, parallel: bool) {
        let finest = &mut self.levels[0];
        finest.tie.iter_mut().zip(&matrix.tie).for_each(|(single, double)| *single = *double as f32);
        finest.position.iter_mut().zip(position).for_each(|(single, double)| *single = double.as_vec3a());
        for l in 0..self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let level = &mut fine[l];
            level.joints.clear();
            if l == 0 {
                level.take_finest(matrix, parallel);
            } else {
                level.take_coarse(parallel);
            }
            level.invert_diagonal(parallel);
            if l > 0 || fresh {
                level.largest = caution * level.largest_eigenvalue(parallel);
            }
            if let (Some(next), Some(_)) = (coarse.first_mut(), &level.transfer) {
                level.place_aggregates(next);
                level.smooth_prolongation(parallel);
                level.galerkin(matrix, &next.pattern, &mut next.exact, parallel);
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
        let coarsest = levels.last().expect("there is a level");
        let Level { pattern, exact, ties, joints, rows_a_node, .. } = coarsest;
        direct.clear();
        match levels.len() {
            1 => direct.add(pattern, |k| matrix.blocks[k].into(), ties, |k| matrix.tie[k]),
            _ => direct.add(pattern, |k| exact[k], ties, |_| 0.0),
        }
        joints.blocks(*rows_a_node, |rows, block| direct.add_block(rows, block));
        direct.factorise();
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
        let Transfer { restriction, transposed, .. } = transfer;
        by_rows(&mut next.right, parallel, |first, right| {
            right.fill(Vec3A::ZERO);
            add_rows(transposed, restriction, &level.residual, first, right);
        });
        self.descend(l + 1, parallel);
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let (level, next) = (&mut fine[l], &coarse[0]);
        let transfer = level.transfer.as_ref().expect("not the coarsest");
        by_rows(&mut level.solution, parallel, |first, solution| {
            add_rows(&transfer.pattern, &transfer.blocks, &next.solution, first, solution);
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

    /// Takes over the blocks of the finest level; leaves rough forces in `residual`.
    fn take_finest(&mut self, matrix: &StepMatrix, parallel: bool) {
        let Self { pattern, ties, blocks, ground, stiffness, residual, .. } = self;
        by_block_rows(pattern, blocks, parallel, |i, row| {
            let exact = &matrix.blocks[pattern.row(i)];
            row.iter_mut().zip(exact).for_each(|(single, double)| *single = double.as_mat3().into());
        });
        by_rows(residual, parallel, |first, rough| {
            for (k, rough) in rough.iter_mut().enumerate() {
                *rough = rough_force(&matrix.blocks[matrix.diagonal[first + k] as usize], first + k);
            }
        });
        by_row_pairs(ground, stiffness, parallel, |i, ground, stiffness| {
            let tied: f64 = matrix.tie[ties.row(i)].iter().sum();
            let sum: DMat3 = matrix.blocks[pattern.row(i)].iter().sum();
            let exact = sum + DMat3::from_diagonal(DVec3::splat(tied));
            let own = matrix.blocks[matrix.diagonal[i] as usize];
            let more = what_is_untold(&exact, &own);
            *ground = (exact + more).as_mat3().into();
            *stiffness = own + more;
        });
    }

    /// The same of another level, from what double precision has of them.
    fn take_coarse(&mut self, parallel: bool) {
        let Self { pattern, blocks, exact, ground, stiffness, diagonal, position, reach, residual, .. } = self;
        by_block_rows(pattern, blocks, parallel, |i, row| {
            row.iter_mut().zip(&exact[pattern.row(i)]).for_each(|(single, double)| *single = double.single());
        });
        by_rows(residual, parallel, |first, rough| {
            for (k, rough) in rough.iter_mut().enumerate() {
                *rough = rough_force(&exact[diagonal[first + k] as usize].into(), first + k);
            }
        });
        let grounds = ground.as_chunks_mut::<2>().0;
        by_row_pairs(grounds, stiffness, parallel, |i, ground, stiffness| {
            let own = position[i / 2];
            let [mut moves, mut turns] = [DMat3::ZERO; 2];
            let blocks = exact[pattern.row(i)].as_chunks::<2>().0;
            for (columns, blocks) in pattern.columns(i).as_chunks::<2>().0.iter().zip(blocks) {
                let arm = (position[columns[0] as usize / 2] - own) / *reach;
                let [along, about] = blocks.map(DMat3::from);
                moves += along;
                turns += along * turned(arm).as_dmat3() + about;
            }
            *stiffness = DMat3::from(exact[diagonal[i] as usize]);
            let like = if i % 2 == 0 { &mut moves } else { &mut turns };
            let more = what_is_untold(like, stiffness);
            *like += more;
            *stiffness += more;
            *ground = [moves, turns].map(|block| block.as_mat3().into());
        });
    }

    /// Inverses of the diagonal, with what contact adds to it.
    fn invert_diagonal(&mut self, parallel: bool) {
        let Self { rows_a_node, stiffness, inverse_diagonal, joints, largest, .. } = self;
        by_rows(inverse_diagonal, parallel, |first, inverse| {
            for (k, inverse) in inverse.iter_mut().enumerate() {
                let i = first + k;
                *inverse = inverted(stiffness[i] + joints.diagonal(*rows_a_node, i, *largest));
            }
        });
    }

    /// `image = A step`, or `A solution`.
    fn multiply(&mut self, of: Of, parallel: bool) {
        let (mut image, mut joints) = (std::mem::take(&mut self.image), std::mem::take(&mut self.joints));
        let x: &[Vec3A] = match of {
            Of::Step => &self.step,
            Of::Solution => &self.solution,
        };
        let joined = !joints.is_empty();
        if joined {
            joints.stretch(x, self.rows_a_node, parallel);
        }
        by_rows(&mut image, parallel, |first, image| {
            match self.rows_a_node {
                1 => self.multiply_finest(x, first, image),
                _ => self.multiply_bodies(x, first, image),
            }
            if joined {
                joints.add_pull(self.rows_a_node, first, image);
            }
        });
        self.joints = joints;
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

    /// Largest eigenvalue of D^-1 A, estimated from above by the method of Lanczos [Lanczos1950] from the
    /// forces in `residual` on.
    fn largest_eigenvalue(&mut self, parallel: bool) -> f32 {
        let dot = |a: &[Vec3A], b: &[Vec3A]| a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum::<f64>();
        // `residual` is a force, `step` the displacement that D makes of it; `solution` is the force before.
        self.solution.fill(Vec3A::ZERO);
        let (mut diagonal, mut beside) = ([0.0f64; LANCZOS], [0.0f64; LANCZOS + 1]);
        let mut steps = 0;
        loop {
            let Self { inverse_diagonal, residual, step, .. } = self;
            by_rows(step, parallel, |first, step| {
                for (k, step) in step.iter_mut().enumerate() {
                    *step = inverse_diagonal[first + k] * residual[first + k];
                }
            });
            let norm = dot(residual, step).max(0.0).sqrt();
            beside[steps] = norm;
            if steps == LANCZOS || norm <= 1e-6 * diagonal[0] {
                break;
            }
            let scale = (1.0 / norm) as f32;
            step.iter_mut().chain(residual.iter_mut()).for_each(|v| *v *= scale);
            self.multiply(Of::Step, parallel);
            let Self { residual, solution, step, image, .. } = self;
            let own = dot(step, image);
            diagonal[steps] = own;
            let (own, before) = (own as f32, if steps == 0 { 0.0 } else { beside[steps] as f32 });
            by_row_pairs(residual, solution, parallel, |i, residual, solution| {
                let next = image[i] - *residual * own - *solution * before;
                *solution = std::mem::replace(residual, next);
            });
            steps += 1;
        }
        if steps == 0 {
            return 1.0;
        }
        estimate_above(&diagonal[..steps], &beside[1..=steps]) as f32
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
            restriction,
            origin,
            product,
            product_blocks,
            product_at,
            first_product,
            coarse_at,
            first_coarse,
            mirror,
            ..
        } = transfer.as_mut().expect("not the coarsest");
        by_rows(restriction, parallel, |first, restriction| {
            for (restriction, k) in restriction.iter_mut().zip(&origin[first..]) {
                *restriction = prolongation[*k as usize].transpose();
            }
        });
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
        // From the diagonal on; what is before it is the mirror image.
        by_block_rows(coarse_pattern, coarse, parallel, |i, sums| {
            let row = transposed.row(i);
            let row = Row { columns: &transposed.column[row.clone()], values: &restriction[row] };
            restricted_row(row, right, i as u32, &coarse_at[first_coarse[i] as usize..], sums);
        });
        for i in 0..coarse_pattern.rows() {
            for k in coarse_pattern.row(i).take_while(|k| coarse_pattern.column[*k] < i as u32) {
                coarse[k] = coarse[mirror[k] as usize].transpose();
            }
        }
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

/// What a ground lacks to be told from nothing beside the stiffness of its row.
fn what_is_untold(ground: &DMat3, stiffness: &DMat3) -> DMat3 {
    let told = TOLD * mean(stiffness);
    DMat3::from_diagonal(DVec3::splat((told - least_eigenvalue(ground)).clamp(0.0, told.max(0.0))))
}

/// The least eigenvalue of the symmetric part of a block, by the cosine of a third of an angle.
fn least_eigenvalue(block: &DMat3) -> f64 {
    let middle = mean(block);
    let deviator = (*block + block.transpose()) * 0.5 - DMat3::from_diagonal(DVec3::splat(middle));
    let squares: f64 = deviator.to_cols_array().iter().map(|v| v * v).sum();
    let size = (squares / 6.0).sqrt();
    if size <= 0.0 {
        return middle;
    }
    let angle = (0.5 * (deviator * (1.0 / size)).determinant()).clamp(-1.0, 1.0).acos() / 3.0;
    middle + 2.0 * size * (angle + std::f64::consts::TAU / 3.0).cos()
}

fn mean(block: &DMat3) -> f64 {
    (block.x_axis.x + block.y_axis.y + block.z_axis.z) / 3.0
}

/// The inverse of a block of the diagonal; nothing for nothing, as where a body of one node turns.
fn inverted(block: DMat3) -> Mat3A {
    let size = mean(&block);
    if size <= 0.0 {
        return Mat3A::ZERO;
    }
    ((block * (1.0 / size)).inverse() * (1.0 / size)).as_mat3().into()
}

/// The largest eigenvalue of a symmetric matrix of three diagonals, and by how much that of the whole may be over it: what is
/// next beside the diagonal (the last number), by the part of the eigenvector that it meets.
fn estimate_above(diagonal: &[f64], beside: &[f64]) -> f64 {
    let steps = diagonal.len();
    // Eigenvalues over a number are as many as pivots under nought.
    let over = |x: f64| {
        let mut pivot = 1.0;
        (0..steps).any(|k| {
            let coupling = if k == 0 { 0.0 } else { beside[k - 1] * beside[k - 1] };
            pivot = x - diagonal[k] - coupling / pivot;
            pivot <= 0.0
        })
    };
    let reach = |k: usize| if k == 0 { 0.0 } else { beside[k - 1] };
    let most = |k: usize| diagonal[k] + reach(k) + if k + 1 < steps { beside[k] } else { 0.0 };
    let (mut low, mut high) = (0.0, (0..steps).map(most).fold(0.0, f64::max));
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if over(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let (mut before, mut last, mut squares) = (0.0, 1.0, 1.0);
    for k in 0..steps - 1 {
        let next = ((high - diagonal[k]) * last - reach(k) * before) / beside[k];
        (before, last) = (last, next);
        squares += next * next;
    }
    high + beside[steps - 1] * last.abs() / squares.sqrt()
}

/// A rough force on a row, which its block of the diagonal bears with an energy that is the same for all rows.
fn rough_force(stiffness: &DMat3, row: usize) -> Vec3A {
    let rough = |k: usize| f64::from((3 * row + k).wrapping_mul(2_654_435_761) as u32 >> 24) / 128.0 - 1.0;
    let m = stiffness;
    let root = |square: f64| square.max(0.0).sqrt();
    // By the Cholesky factor of the block.
    let first = root(m.x_axis.x);
    let (second, third) = if first > 0.0 { (m.x_axis.y / first, m.x_axis.z / first) } else { (0.0, 0.0) };
    let fourth = root(m.y_axis.y - second * second);
    let fifth = if fourth > 0.0 { (m.y_axis.z - third * second) / fourth } else { 0.0 };
    let last = root(m.z_axis.z - third * third - fifth * fifth);
    let [a, b, c] = [rough(0), rough(1), rough(2)];
    DVec3::new(first * a, second * a + fourth * b, third * a + fifth * b + last * c).as_vec3a()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_eigenvalue_of_a_block_is_that_of_its_axes() {
        for axes in [[3.0, 1.0, 1e-6], [2.0, 2.0, 2.0], [1.0, -0.5, 1.0], [5.0, 5.0, 0.0]] {
            let turn = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
            let block = turn * DMat3::from_diagonal(DVec3::from_array(axes)) * turn.transpose();
            let least = axes.into_iter().fold(f64::INFINITY, f64::min);
            assert!((least_eigenvalue(&block) - least).abs() < 1e-13, "{axes:?}: {}", least_eigenvalue(&block));
        }
    }

    #[test]
    fn the_largest_eigenvalue_of_three_diagonals_is_estimated_from_above() {
        // Second differences: 2 - 2 cos(k pi/(n + 1)).
        for n in [1usize, 2, 5, 9] {
            let largest_of = |n: usize| 2.0 + 2.0 * (std::f64::consts::PI / (n as f64 + 1.0)).cos();
            let mut beside = vec![1.0; n];
            beside[n - 1] = 0.0;
            assert!((estimate_above(&vec![2.0; n], &beside) - largest_of(n)).abs() < 1e-8, "{n}");
            beside[n - 1] = 1.0;
            let above = estimate_above(&vec![2.0; n], &beside);
            assert!(above > largest_of(n + 1) - 1e-8 && above < 5.0, "{n}: {above}");
        }
    }
}
