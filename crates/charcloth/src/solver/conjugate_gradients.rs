//! Conjugate gradients in double precision, preconditioned by a multigrid cycle in single precision.
//!
//! Source: [HestenesStiefel1952]. Valid when: the matrix is symmetric positive definite. Cost: a product with the matrix
//! and a cycle an iteration. Sums are added up in fixed parts: the same bits on any number of threads.

use super::StepMatrix;
use super::blocks::{by_row_pairs, by_rows, sum_by_rows};
use super::multigrid::Multigrid;
use glam::DVec3;

/// Buffers that are kept between solutions.
#[derive(Debug, Clone, Default)]
pub struct ConjugateGradients {
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    sums: Vec<f64>,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Error over that at the start, in the norm of energy.
    pub relative: f64,
    /// Error that is small enough in any case [J].
    pub energy: f64,
    /// Most iterations.
    pub iterations: usize,
}

impl ConjugateGradients {
    /// Solves `A x = r`; leaves in `r` what is left of it. Returns the number of iterations, or none where the cycle is
    /// not positive, so that nothing it says can be trusted.
    pub fn solve(
        &mut self,
        matrix: &StepMatrix,
        multigrid: &mut Multigrid,
        r: &mut [DVec3],
        x: &mut [DVec3],
        tolerance: Tolerance,
        parallel: bool,
    ) -> Option<usize> {
        let rows = r.len();
        x.fill(DVec3::ZERO);
        for buffer in [&mut self.direction, &mut self.image] {
            buffer.resize(rows, DVec3::ZERO);
        }
        let Self { direction, image, sums } = self;
        let (mut start, mut before) = (0.0, 0.0);
        for iteration in 0..tolerance.iterations {
            // Single precision has seven digits but also a least number: the cycle sees residuals near one.
            let scale = r.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
            if scale == 0.0 || !scale.is_finite() {
                return Some(iteration);
            }
            let to_one = 1.0 / scale;
            let correction = multigrid.cycle(|i| (r[i] * to_one).as_vec3().extend(0.0), parallel);
            let preconditioned = |i: usize| correction[i].truncate().as_dvec3() * scale;
            let error = sum_by_rows(rows, parallel, sums, |part| part.map(|i| r[i].dot(preconditioned(i))).sum());
            if iteration == 0 {
                start = error;
            }
            if error.is_nan() || error < 0.0 {
                return None;
            }
            if error <= (tolerance.relative * tolerance.relative * start).max(tolerance.energy) {
                return Some(iteration);
            }
            let keep = if iteration == 0 { 0.0 } else { error / before };
            before = error;
            by_rows(direction, parallel, |first, direction| {
                for (k, direction) in direction.iter_mut().enumerate() {
                    *direction = preconditioned(first + k) + *direction * keep;
                }
            });
            matrix.multiply(direction, image, parallel);
            let curvature = sum_by_rows(rows, parallel, sums, |part| part.map(|i| direction[i].dot(image[i])).sum());
            let length = error / curvature;
            by_row_pairs(x, r, parallel, |i, x, r| {
                *x += direction[i] * length;
                *r -= image[i] * length;
            });
        }
        Some(tolerance.iterations)
    }
}
