//! Direct solution of the coarsest level, a connected part at a time, by Cholesky factors in double precision.

use super::lanes::Wide;
use crate::solver::StepMatrix;
use crate::solver::blocks::Pattern;
use glam::{DMat3, DVec3, Vec4};

/// Most rows of a part that is solved directly.
const MOST_ROWS: usize = 192;
/// Pivot that is nothing but rounding, as a part of what it was before elimination.
const LEAST_PIVOT: f64 = 1e-10;

/// Connected parts of a matrix, and their factors.
#[derive(Default)]
pub struct Direct {
    parts: Vec<Part>,
    /// Part and place in it of each row; `u32::MAX` for rows of parts that are too large.
    place: Vec<[u32; 2]>,
    /// Cholesky factors by rows, one after the other.
    factor: Vec<f64>,
    scratch: Vec<f64>,
}

struct Part {
    rows: Vec<u32>,
    first: usize,
}

impl Direct {
    /// Finds the parts of a matrix whose nodes are linked by these patterns and have so many rows each.
    pub fn lay_out(links: &Pattern, ties: &Pattern, rows_a_node: usize) -> Self {
        let nodes = links.rows();
        let mut place = vec![[u32::MAX; 2]; nodes * rows_a_node];
        let mut seen = vec![false; nodes];
        let (mut parts, mut size, mut found) = (Vec::new(), 0, Vec::new());
        for start in 0..nodes {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            found.push(start as u32);
            let mut rows = Vec::new();
            while let Some(i) = found.pop() {
                rows.extend((0..rows_a_node).map(|half| (i as usize * rows_a_node + half) as u32));
                for j in links.columns(i as usize).iter().chain(ties.columns(i as usize)) {
                    if !std::mem::replace(&mut seen[*j as usize], true) {
                        found.push(*j);
                    }
                }
            }
            if rows.len() > MOST_ROWS {
                continue;
            }
            rows.sort_unstable();
            for (k, i) in rows.iter().enumerate() {
                place[*i as usize] = [parts.len() as u32, k as u32];
            }
            let first = size;
            size += (3 * rows.len()).pow(2);
            parts.push(Part { rows, first });
        }
        Self { parts, place, factor: vec![0.0; size], scratch: Vec::new() }
    }

    /// Whether there are parts too large to be solved here.
    pub fn leaves_some(&self) -> bool {
        self.place.iter().any(|place| place[0] == u32::MAX)
    }

    /// Takes everything out of the matrix.
    pub fn clear(&mut self) {
        self.factor.fill(0.0);
    }

    /// Adds a matrix of blocks and ties, without its couplings.
    pub fn add_matrix(&mut self, matrix: &StepMatrix) {
        let StepMatrix { pattern, blocks, ties, tie, .. } = matrix;
        for i in 0..pattern.rows() {
            for k in pattern.row(i) {
                self.add_block([i, pattern.column[k] as usize], blocks[k]);
            }
            for k in ties.row(i) {
                self.add_block([i, ties.column[k] as usize], DMat3::from_diagonal(DVec3::splat(tie[k])));
            }
        }
    }

    /// Adds a matrix of bodies that are linked so.
    pub fn add_bodies(&mut self, links: &Pattern, strips: &[[Wide; 2]]) {
        for i in 0..links.rows() {
            for k in links.row(i) {
                let j = links.column[k] as usize;
                for (half, strip) in strips[k].iter().enumerate() {
                    for turns in 0..2 {
                        self.add_block([2 * i + half, 2 * j + turns], strip.part(turns));
                    }
                }
            }
        }
    }

    /// Adds a block at a row and column of the matrix; what ties different parts is left out.
    pub fn add_block(&mut self, rows: [usize; 2], block: DMat3) {
        let [[part, i], [other, j]] = rows.map(|row| self.place[row]);
        if part != other || part == u32::MAX {
            return;
        }
        let Part { rows, first } = &self.parts[part as usize];
        let n = 3 * rows.len();
        for (c, column) in block.to_cols_array_2d().iter().enumerate() {
            for (r, value) in column.iter().enumerate() {
                self.factor[first + (3 * i as usize + r) * n + 3 * j as usize + c] += *value;
            }
        }
    }

    /// Factorises the matrix.
    pub fn factorise(&mut self) {
        for part in &self.parts {
            let n = 3 * part.rows.len();
            cholesky(&mut self.factor[part.first..part.first + n * n], n);
        }
    }

    /// Solves for what is factorised; leaves the other rows alone.
    pub fn solve(&mut self, right: &[Vec4], solution: &mut [Vec4]) {
        let Self { parts, factor, scratch: x, .. } = self;
        for part in parts {
            let n = 3 * part.rows.len();
            let factor = &factor[part.first..part.first + n * n];
            x.clear();
            x.extend(part.rows.iter().flat_map(|i| right[*i as usize].truncate().to_array()).map(f64::from));
            for i in 0..n {
                x[i] = (x[i] - dot(&factor[i * n..i * n + i], &x[..i])) / factor[i * n + i];
            }
            for i in (0..n).rev() {
                x[i] /= factor[i * n + i];
                let value = x[i];
                for (x, factor) in x[..i].iter_mut().zip(&factor[i * n..]) {
                    *x -= factor * value;
                }
            }
            for (k, i) in part.rows.iter().enumerate() {
                solution[*i as usize] = Vec4::new(x[3 * k] as f32, x[3 * k + 1] as f32, x[3 * k + 2] as f32, 0.0);
            }
        }
    }
}

/// Turns the lower half of a matrix by rows into its Cholesky factor.
fn cholesky(factor: &mut [f64], n: usize) {
    for i in 0..n {
        let (upper, lower) = factor.split_at_mut(i * n);
        let row = &mut lower[..n];
        for j in 0..i {
            row[j] = (row[j] - dot(&row[..j], &upper[j * n..j * n + j])) / upper[j * n + j];
        }
        let value = row[i] - dot(&row[..i], &row[..i]);
        // What has no stiffness, as where a body on a line turns about it, does not move.
        row[i] = if value > LEAST_PIVOT * row[i] { value.sqrt() } else { f64::INFINITY };
    }
}

/// Four sums at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, rest_of_a), (b, rest_of_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = rest_of_a.iter().zip(rest_of_b).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_solved_each_by_itself_with_what_ties_them() {
        // Two parts: rows 0 and 2, tied; row 1 alone.
        let pattern = Pattern::from_rows((0..3).map(|i| vec![i]));
        let ties = Pattern::from_rows([vec![2], vec![], vec![0]].into_iter());
        let block = DMat3::from_cols_array_2d(&[[4.0, 1.0, 0.0], [1.0, 5.0, 2.0], [0.0, 2.0, 6.0]]);
        let mut matrix = StepMatrix::zeros(pattern, ties);
        matrix.blocks.fill(block);
        matrix.tie.fill(-1.5);
        let mut direct = Direct::lay_out(&matrix.pattern, &matrix.ties, 1);
        assert!(!direct.leaves_some());
        direct.add_matrix(&matrix);
        direct.factorise();
        let right = [[1.0, 2.0, 3.0], [-1.0, 0.5, 0.0], [0.0, -2.0, 1.0]].map(|[x, y, z]| Vec4::new(x, y, z, 0.0));
        let mut x = [Vec4::ZERO; 3];
        direct.solve(&right, &mut x);
        let times = |x: Vec4| (block.as_mat3() * x.truncate()).extend(0.0);
        let images = [times(x[0]) - 1.5 * x[2], times(x[1]), times(x[2]) - 1.5 * x[0]];
        for (image, right) in images.iter().zip(&right) {
            assert!(image.distance(*right) < 1e-5, "{image} is not {right}");
        }
    }
}
