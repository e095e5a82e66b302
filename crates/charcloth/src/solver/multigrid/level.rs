//! A level of the multigrid cycle: its matrix in single precision, products of differences, smoothing.

use super::NONE;
use super::galerkin::{Row, finest_product, product};
use super::joints::Joints;
use super::lanes::{Block, NO_BLOCK, Strip, Wide, cross, single, times, totals};
use super::spectrum::{LANCZOS, estimate_above, inverted, rough_force, what_is_untold};
use super::transfer::Transfer;
use crate::solver::StepMatrix;
use crate::solver::blocks::{Pattern, ROWS_A_TASK, by_block_rows, by_row_pairs, by_rows, on_widest_unit};
use glam::{DMat3, DVec3, Mat3A, Vec3A, Vec4};

/// Smallest eigenvalue that smoothing aims at, as a part of the largest.
const SMOOTHED: f32 = 1.0 / 8.0;
/// Rows whose products are at hand together: an even number, so that no body is cut in two.
const TOGETHER: usize = 64;

/// One level. Its nodes have one row each on the finest (a displacement), two on all others (a displacement and a
/// rotation).
#[derive(Default)]
pub struct Level {
    pub rows_a_node: usize,
    /// Where the nodes are, for rotations about the middle of an aggregate.
    pub position: Vec<Vec3A>,
    /// Unit of rotations: a rotation in this level is the displacement it gives at this distance.
    pub reach: f32,
    /// Which nodes each is linked to; on the finest level not to itself.
    pub links: Pattern,
    /// A block a link, on the finest level; two strips on all others, and the same in double precision.
    pub blocks: Vec<Block>,
    pub strips: Vec<Strip>,
    pub exact: Vec<[Wide; 2]>,
    /// Where the link of each node to itself is, on all levels but the finest.
    pub diagonal: Vec<u32>,
    /// For each link to a node before, the link back.
    pub mirror: Vec<u32>,
    /// Numbers that tie nodes in all directions alike, on the finest level only.
    pub ties: Pattern,
    pub tie: Vec<f32>,
    /// What a rigid motion of a node and all around it meets: a block on the finest level, two strips on all others.
    pub ground: Vec<Block>,
    pub grounds: Vec<Strip>,
    /// The diagonal without contact, with what it lacks to be told from nothing.
    pub stiffness: Vec<DMat3>,
    pub inverse_diagonal: Vec<Block>,
    /// What contact adds.
    pub joints: Joints,
    /// Bound on the eigenvalues of D^-1 A.
    pub largest: f32,
    pub right: Vec<Vec4>,
    pub solution: Vec<Vec4>,
    pub residual: Vec<Vec4>,
    pub step: Vec<Vec4>,
    /// Steps go through a second buffer, so that nodes do not see each other's new ones.
    pub next_step: Vec<Vec4>,
    pub transfer: Option<Transfer>,
}

impl Level {
    /// The finest level of a matrix.
    pub fn finest(matrix: &StepMatrix) -> Self {
        let off_diagonal = |i: usize| matrix.pattern.columns(i).iter().copied().filter(|j| *j != i as u32).collect();
        let links = Pattern::from_rows((0..matrix.pattern.rows()).map(off_diagonal));
        let (blocks, tie) = (vec![NO_BLOCK; links.blocks()], vec![0.0; matrix.ties.blocks()]);
        let nodes = links.rows();
        let level =
            Self { blocks, links, tie, ties: matrix.ties.clone(), ground: vec![NO_BLOCK; nodes], ..Self::default() };
        level.with_fields(1, nodes)
    }

    /// Another level of these links.
    pub fn of_bodies(links: Pattern) -> Self {
        let nodes = links.rows();
        let find =
            |i: usize, j: usize| links.find(i, j as u32).expect("links go both ways, and from each to itself") as u32;
        let diagonal = (0..nodes).map(|i| find(i, i)).collect();
        let mut mirror = vec![NONE; links.blocks()];
        for i in 0..nodes {
            for k in links.row(i).filter(|k| links.column[*k] < i as u32) {
                mirror[k] = find(links.column[k] as usize, i);
            }
        }
        let level = Self {
            strips: vec![Strip::ZERO; 2 * links.blocks()],
            exact: vec![[Wide::ZERO; 2]; links.blocks()],
            grounds: vec![Strip::ZERO; 2 * nodes],
            ties: Pattern::empty(nodes),
            diagonal,
            mirror,
            links,
            ..Self::default()
        };
        level.with_fields(2, nodes)
    }

    fn with_fields(mut self, rows_a_node: usize, nodes: usize) -> Self {
        let rows = rows_a_node * nodes;
        self.rows_a_node = rows_a_node;
        self.position = vec![Vec3A::ZERO; nodes];
        self.stiffness = vec![DMat3::ZERO; rows];
        self.inverse_diagonal = vec![NO_BLOCK; rows];
        for field in [&mut self.right, &mut self.solution, &mut self.residual, &mut self.step, &mut self.next_step] {
            *field = vec![Vec4::ZERO; rows];
        }
        self
    }

    /// Takes over the blocks of the finest level; leaves rough forces in `residual`.
    pub fn take_finest(&mut self, matrix: &StepMatrix, position: &[DVec3], parallel: bool) {
        self.tie.iter_mut().zip(&matrix.tie).for_each(|(single, double)| *single = *double as f32);
        self.position.iter_mut().zip(position).for_each(|(single, double)| *single = double.as_vec3a());
        let Self { links, ties, blocks, ground, stiffness, residual, .. } = self;
        by_block_rows(links, blocks, parallel, |i, row| {
            let exact = matrix.pattern.row(i).filter(|k| *k != matrix.diagonal[i] as usize);
            row.iter_mut().zip(exact).for_each(|(block, k)| *block = single(&matrix.blocks[k]));
        });
        by_row_pairs(ground, stiffness, parallel, |i, ground, stiffness| {
            let tied: f64 = matrix.tie[ties.row(i)].iter().sum();
            let sum: DMat3 = matrix.blocks[matrix.pattern.row(i)].iter().sum();
            let exact = sum + DMat3::from_diagonal(DVec3::splat(tied));
            let own = matrix.blocks[matrix.diagonal[i] as usize];
            let more = what_is_untold(&exact, &own);
            *ground = single(&(exact + more));
            *stiffness = own + more;
        });
        by_rows(residual, parallel, |first, rough| {
            for (k, rough) in rough.iter_mut().enumerate() {
                *rough = rough_force(&matrix.blocks[matrix.diagonal[first + k] as usize], first + k);
            }
        });
    }

    /// The same of another level, from what double precision has of them.
    pub fn take_bodies(&mut self, parallel: bool) {
        let Self { links, strips, exact, grounds, stiffness, diagonal, position, reach, residual, .. } = self;
        by_block_rows(links, strips.as_chunks_mut::<2>().0, parallel, |i, row| {
            row.iter_mut()
                .zip(&exact[links.row(i)])
                .for_each(|(single, double)| *single = double.map(|wide| wide.single()));
        });
        by_rows(residual, parallel, |first, rough| {
            for (k, rough) in rough.iter_mut().enumerate() {
                let (i, half) = ((first + k) / 2, (first + k) % 2);
                *rough = rough_force(&exact[diagonal[i] as usize][half].part(half), first + k);
            }
        });
        by_row_pairs(grounds, stiffness, parallel, |row, ground, stiffness| {
            let (i, half) = (row / 2, row % 2);
            let [mut moves, mut turns] = [DMat3::ZERO; 2];
            for k in links.row(i) {
                let arm = (position[links.column[k] as usize] - position[i]) / *reach;
                let along = exact[k][half].part(0);
                moves += along;
                turns += along * turned(arm).as_dmat3() + exact[k][half].part(1);
            }
            *stiffness = exact[diagonal[i] as usize][half].part(half);
            let like = if half == 0 { &mut moves } else { &mut turns };
            let more = what_is_untold(like, stiffness);
            *like += more;
            *stiffness += more;
            *ground = Strip::of(&single(&moves), &single(&turns));
        });
    }

    /// Inverses of the diagonal, with what contact adds to it.
    pub fn invert_diagonal(&mut self, parallel: bool) {
        let Self { rows_a_node, stiffness, inverse_diagonal, joints, largest, .. } = self;
        by_rows(inverse_diagonal, parallel, |first, inverse| {
            for (k, inverse) in inverse.iter_mut().enumerate() {
                let i = first + k;
                *inverse = inverted(stiffness[i] + joints.diagonal(*rows_a_node, i, *largest));
            }
        });
    }

    /// Runs `work(row, row of A x, the entries of the fields there)` over the rows of fields that begin with row `first`;
    /// joints are stretched by x already.
    fn sweep<const F: usize>(
        &self,
        x: &[Vec4],
        first: usize,
        mut fields: [&mut [Vec4]; F],
        parallel: bool,
        work: &(impl Fn(usize, Vec4, [&mut Vec4; F]) + Sync),
    ) {
        let rows = fields[0].len();
        if parallel && rows > ROWS_A_TASK {
            let middle = (rows / 2).next_multiple_of(TOGETHER);
            let high = fields.each_mut().map(|field| field.split_off_mut(middle..).expect("fields are as long"));
            rayon::join(
                || self.sweep(x, first, fields, true, work),
                || self.sweep(x, first + middle, high, true, work),
            );
            return;
        }
        let mut image = [Vec4::ZERO; TOGETHER];
        for start in (0..rows).step_by(TOGETHER) {
            let image = &mut image[..TOGETHER.min(rows - start)];
            match self.rows_a_node {
                1 => self.multiply_finest(x, first + start, image),
                _ => self.multiply_bodies(x, first + start, image),
            }
            if !self.joints.is_empty() {
                self.joints.add_pull(self.rows_a_node, first + start, image);
            }
            for (k, image) in image.iter().enumerate() {
                work(first + start + k, *image, fields.each_mut().map(|field| &mut field[start + k]));
            }
        }
    }

    /// Stretches the joints by a field, before its product.
    fn stretch(&mut self, x: &[Vec4], parallel: bool) {
        if !self.joints.is_empty() {
            self.joints.stretch(x, self.rows_a_node, parallel);
        }
    }

    /// Rows of `A x` from `first` on, of the finest level. Several sums at once, for an addition takes longer than what
    /// it adds.
    fn multiply_finest(&self, x: &[Vec4], first: usize, y: &mut [Vec4]) {
        let level = self;
        on_widest_unit!((level: &Level, x: &[Vec4], first: usize, y: &mut [Vec4]) {
            let Level { links, blocks, ties, tie, ground, .. } = level;
            for (k, y) in y.iter_mut().enumerate() {
                let i = first + k;
                let own = x[i];
                let row = ties.row(i);
                let mut tied = [Vec4::ZERO; 4];
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
                let mut sums = [ground[i][0] * own, ground[i][1] * own, ground[i][2] * own];
                let row = links.row(i);
                for (j, block) in links.column[row.clone()].iter().zip(&blocks[row]) {
                    let apart = x[*j as usize] - own;
                    for (sum, row) in sums.iter_mut().zip(block) {
                        *sum += *row * apart;
                    }
                }
                *y = totals(&sums) + ((tied[0] + tied[1]) + (tied[2] + tied[3]));
            }
        });
    }

    /// The same of another level, two rows a node.
    fn multiply_bodies(&self, x: &[Vec4], first: usize, y: &mut [Vec4]) {
        let level = self;
        on_widest_unit!((level: &Level, x: &[Vec4], first: usize, y: &mut [Vec4]) {
            let Level { links, strips, grounds, position, reach, .. } = level;
            let (bodies, strips) = (x.as_chunks::<2>().0, strips.as_chunks::<2>().0);
            for (k, y) in y.as_chunks_mut::<2>().0.iter_mut().enumerate() {
                let i = first / 2 + k;
                let [moves, turns] = bodies[i];
                // The turn over the unit of turns: what it moves at a distance.
                let turn = Vec3A::from_vec4(turns / *reach);
                let mut sums = [grounds[2 * i].meet(moves, turns), grounds[2 * i + 1].meet(moves, turns)];
                let row = links.row(i);
                for (j, strips) in links.column[row.clone()].iter().zip(&strips[row]) {
                    let j = *j as usize;
                    let along = bodies[j][0] - moves - turn.cross(position[j] - position[i]).extend(0.0);
                    let about = bodies[j][1] - turns;
                    for (sums, strip) in sums.iter_mut().zip(strips) {
                        for (sum, met) in sums.iter_mut().zip(strip.meet(along, about)) {
                            *sum += met;
                        }
                    }
                }
                *y = [totals(&sums[0]), totals(&sums[1])];
            }
        });
    }

    /// Two steps of Chebyshev iteration on the eigenvalues from `SMOOTHED` of the largest to the largest [Adams2003], from
    /// nothing or from the solution that is there.
    pub fn smooth(&mut self, from_nothing: bool, parallel: bool) {
        let (high, low) = (self.largest, self.largest * SMOOTHED);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = middle / half;
        let next = 1.0 / (2.0 * sigma - 1.0 / sigma);
        let (keep, take, start) = (next / sigma, 2.0 * next / half, 1.0 / middle);
        let [mut step, mut next_step, mut solution, mut residual] =
            [&mut self.step, &mut self.next_step, &mut self.solution, &mut self.residual].map(std::mem::take);
        if from_nothing {
            by_row_pairs(&mut step, &mut residual, parallel, |i, step, residual| {
                *residual = self.right[i];
                *step = times(&self.inverse_diagonal[i], *residual) * start;
            });
            solution.fill(Vec4::ZERO);
        } else {
            self.stretch(&solution, parallel);
            self.sweep(&solution, 0, [&mut step, &mut residual], parallel, &|i, image, [step, residual]| {
                *residual = self.right[i] - image;
                *step = times(&self.inverse_diagonal[i], *residual) * start;
            });
        }
        self.stretch(&step, parallel);
        let fields: [&mut [Vec4]; 3] = [&mut next_step, &mut residual, &mut solution];
        self.sweep(&step, 0, fields, parallel, &|i, image, [next_step, residual, solution]| {
            *residual -= image;
            *next_step = step[i] * keep + times(&self.inverse_diagonal[i], *residual) * take;
            *solution += step[i] + *next_step;
        });
        (self.step, self.next_step, self.solution, self.residual) = (step, next_step, solution, residual);
    }

    /// What is not yet solved, in `residual`, after smoothing.
    pub fn finish_residual(&mut self, parallel: bool) {
        let (step, mut residual) = (std::mem::take(&mut self.next_step), std::mem::take(&mut self.residual));
        self.stretch(&step, parallel);
        self.sweep(&step, 0, [&mut residual], parallel, &|_, image, [residual]| *residual -= image);
        (self.next_step, self.residual) = (step, residual);
    }

    /// Largest eigenvalue of D^-1 A, estimated from above by the method of Lanczos [Lanczos1950] from the
    /// forces in `residual` on.
    pub fn largest_eigenvalue(&mut self, parallel: bool) -> f32 {
        let dot = |a: &[Vec4], b: &[Vec4]| a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum::<f64>();
        // `residual` is a force, `step` the displacement that D makes of it; `solution` is the force before.
        self.solution.fill(Vec4::ZERO);
        let (mut diagonal, mut beside) = ([0.0f64; LANCZOS], [0.0f64; LANCZOS + 1]);
        let mut steps = 0;
        loop {
            let Self { inverse_diagonal, residual, step, .. } = self;
            by_rows(step, parallel, |first, step| {
                for (k, step) in step.iter_mut().enumerate() {
                    *step = times(&inverse_diagonal[first + k], residual[first + k]);
                }
            });
            let norm = dot(residual, step).max(0.0).sqrt();
            beside[steps] = norm;
            if steps == LANCZOS || norm <= 1e-6 * diagonal[0] {
                break;
            }
            let scale = (1.0 / norm) as f32;
            step.iter_mut().chain(residual.iter_mut()).for_each(|v| *v *= scale);
            let (step, mut image) = (std::mem::take(&mut self.step), std::mem::take(&mut self.next_step));
            self.stretch(&step, parallel);
            self.sweep(&step, 0, [&mut image], parallel, &|_, row, [image]| *image = row);
            (self.step, self.next_step) = (step, image);
            let Self { residual, solution, step, next_step: image, .. } = self;
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
    pub fn place_aggregates(&mut self, next: &mut Level) {
        let Self { position, transfer, reach, .. } = self;
        let transfer = transfer.as_mut().expect("not the coarsest");
        let Transfer { aggregate, size, .. } = &*transfer;
        next.position.fill(Vec3A::ZERO);
        let inside = || aggregate.iter().zip(position.iter()).filter(|(a, _)| **a != NONE);
        for (a, position) in inside() {
            next.position[*a as usize] += *position / size[*a as usize];
        }
        let squares: f64 = inside().map(|(a, p)| f64::from(p.distance_squared(next.position[*a as usize]))).sum();
        next.reach = (squares / position.len() as f64).sqrt().max(1e-30) as f32;
        transfer.place(position, &next.position, *reach, next.reach);
    }

    /// P = (1 - omega D^-1 A) P0.
    pub fn smooth_prolongation(&mut self, parallel: bool) {
        let mut transfer = self.transfer.take().expect("not the coarsest");
        let omega = 4.0 / 3.0 / self.largest;
        let mut strips = std::mem::take(&mut transfer.strips);
        // Strips of the links themselves are summed up first.
        let of_node = |i: usize, strips: &mut [Strip]| {
            strips.fill(Strip::ZERO);
            match self.rows_a_node {
                1 => self.meet_tentative_finest(&transfer, i, strips),
                _ => self.meet_tentative(&transfer, i, strips),
            }
            let own = usize::from(transfer.own[i]);
            for (at, strip) in strips.iter_mut().enumerate() {
                let half = at % self.rows_a_node;
                let scaled = self.inverse_diagonal[self.rows_a_node * i + half].map(|row| row * -omega);
                let [a, b, c] = [0, 1, 2].map(|r| strip.row(r));
                for (r, s) in scaled.into_iter().enumerate() {
                    strip.set(r, [0, 1].map(|h| a[h] * s.x + (b[h] * s.y + c[h] * s.z)));
                }
                if at / self.rows_a_node == own {
                    transfer.add_tentative(i, half, strip);
                }
            }
        };
        match self.rows_a_node {
            1 => by_block_rows(&transfer.pattern, &mut strips, parallel, |i, strips| {
                if !strips.is_empty() {
                    of_node(i, strips);
                }
            }),
            _ => by_block_rows(&transfer.pattern, strips.as_chunks_mut::<2>().0, parallel, |i, strips| {
                of_node(i, strips.as_flattened_mut());
            }),
        }
        transfer.strips = strips;
        self.transfer = Some(transfer);
    }

    /// A P0 for a node of the finest level.
    fn meet_tentative_finest(&self, transfer: &Transfer, i: usize, strips: &mut [Strip]) {
        let (level, to) = (self, transfer);
        on_widest_unit!((level: &Level, to: &Transfer, i: usize, strips: &mut [Strip]) {
            // The sum of the row, in differences from its ground, is that of its links and what is on the diagonal.
            let Level { links, blocks, ties, tie, ground, .. } = level;
            let own = to.own[i] as usize;
            let mut diagonal = ground[i];
            for k in links.row(i) {
                let at = to.smoothed_at[k];
                for (sum, row) in diagonal.iter_mut().zip(&blocks[k]) {
                    *sum -= *row;
                }
                if at != u8::MAX {
                    add_met(&mut strips[at as usize], &blocks[k], to.arm[links.column[k] as usize]);
                }
            }
            for k in ties.row(i) {
                let at = to.tied_at[k];
                for (lane, sum) in diagonal.iter_mut().enumerate() {
                    sum[lane] -= tie[k];
                }
                if at != u8::MAX {
                    let block = [Vec4::X, Vec4::Y, Vec4::Z].map(|axis| axis * tie[k]);
                    add_met(&mut strips[at as usize], &block, to.arm[ties.column[k] as usize]);
                }
            }
            add_met(&mut strips[own], &diagonal, to.arm[i]);
        });
    }

    /// A P0 for a node of another level.
    fn meet_tentative(&self, transfer: &Transfer, i: usize, strips: &mut [Strip]) {
        let (level, to) = (self, transfer);
        on_widest_unit!((level: &Level, to: &Transfer, i: usize, strips: &mut [Strip]) {
            let to_strips = strips.as_chunks_mut::<2>().0;
            for k in level.links.row(i) {
                let at = to.smoothed_at[k];
                if at == u8::MAX {
                    continue;
                }
                let arm = to.arm[level.links.column[k] as usize];
                for (sum, strip) in to_strips[at as usize].iter_mut().zip(&level.strips[2 * k..2 * k + 2]) {
                    for r in 0..3 {
                        let [moves, turns] = strip.row(r);
                        sum.add(r, [moves, cross(arm, moves) + turns * to.scale]);
                    }
                }
            }
        });
    }

    /// The matrix of the next level, P^T A P.
    pub fn coarsen(&mut self, matrix: &StepMatrix, next: &mut Level, parallel: bool) {
        let Self { rows_a_node, links, exact, ties, transfer, .. } = self;
        let transfer = transfer.as_mut().expect("not the coarsest");
        transfer.coarsen(&next.links, &mut next.exact, parallel, |i, prolongation, places, sums| {
            if *rows_a_node == 1 {
                let (row, tied) = (matrix.pattern.row(i), ties.row(i));
                let tied = Row { columns: &ties.column[tied.clone()], values: &matrix.tie[tied] };
                let row = Row { columns: &matrix.pattern.column[row.clone()], values: &matrix.blocks[row] };
                finest_product(row, tied, prolongation, places, sums);
            } else {
                let row = links.row(i);
                let row = Row { columns: &links.column[row.clone()], values: &exact[row] };
                product(row, prolongation, places, sums);
            }
        });
        // What is before the diagonal is the mirror image of what is after it.
        for i in 0..next.links.rows() {
            for k in next.links.row(i).take_while(|k| next.links.column[*k] < i as u32) {
                let back = next.exact[next.mirror[k] as usize];
                for half in 0..2 {
                    for turns in 0..2 {
                        next.exact[k][half].set_part(turns, back[turns].part(half).transpose());
                    }
                }
            }
        }
    }
}

/// `sum += block P0` for a node at the end of an arm.
#[inline(always)]
fn add_met(sum: &mut Strip, block: &Block, arm: Vec4) {
    for (r, row) in block.iter().enumerate() {
        sum.add(r, [*row, cross(arm, *row)]);
    }
}

/// How a turn moves the end of an arm.
pub fn turned(arm: Vec3A) -> Mat3A {
    Mat3A::from_cols(Vec3A::new(0.0, -arm.z, arm.y), Vec3A::new(arm.z, 0.0, -arm.x), Vec3A::new(-arm.y, arm.x, 0.0))
}
