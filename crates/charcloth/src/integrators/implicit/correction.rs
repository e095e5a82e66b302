//! The correction of a Newton iteration: solved for, looked along, and solved for again where it would change what
//! touches.

use super::super::Advanced;
use super::Implicit;
use crate::solver::blocks::sum_by_rows;
use crate::solver::conjugate_gradients::Tolerance;
use crate::solver::multigrid::CAUTION;
use glam::DVec3;

/// How many times the correction of an iteration is solved for again to mind what it would meet: past the second time only
/// while less than a share of it can be made.
// tuned: 2 to 6; one less costs half more where a sheet folds, four times always cost double in a stack; share 0.1 to 0.5
const FORESIGHT: usize = 4;
const ENOUGH: f64 = 0.25;
/// Most iterations of a linear system.
const LINEAR: usize = 300;
/// The same where there is a correction to fall back on. // tuned: 30 to 300
const LINEAR_MORE: usize = 100;
/// Factor on estimated eigenvalues past which the solver gives up.
const MOST_CAUTION: f32 = 10.0;

/// Energy that a correction gains, by the slope [J]; `sums` is to work with.
pub(super) fn gain(slope: &[DVec3], correction: &[DVec3], sums: &mut Vec<f64>, parallel: bool) -> f64 {
    sum_by_rows(slope.len(), parallel, sums, |part| part.map(|i| slope[i].dot(correction[i])).sum())
}

impl Implicit {
    /// Finds the correction of an iteration, and the share of it that may be made: solved for again where it would
    /// change what touches.
    pub(super) fn find_correction(
        &mut self,
        h: f64,
        damping: f64,
        [relative, energy]: [f64; 2],
        halves: bool,
        parallel: bool,
        report: &mut Advanced,
    ) -> f64 {
        std::mem::swap(&mut self.outer, &mut self.residual);
        let mut tolerance = Tolerance { relative, energy, iterations: LINEAR };
        let mut best = 0.0;
        for round in 0..=FORESIGHT {
            self.correct(h, damping, round > 0, tolerance, parallel, report);
            if round == 0 {
                std::mem::swap(&mut self.honest, &mut self.residual);
            }
            if self.lost && best > 0.0 {
                // What the round before found will do.
                self.lost = false;
                std::mem::swap(&mut self.correction, &mut self.best);
                break;
            }
            if self.lost && halves {
                return 0.0;
            }
            let Some(contact) = &mut self.contact else { return 1.0 };
            if round == 0 {
                let gain = gain(&self.honest, &self.correction, &mut self.sums, parallel);
                // Later rounds begin with the last correction: what counts is the error against nothing at all.
                tolerance = Tolerance { relative: 0.0, energy: energy.max(relative * relative * gain), ..tolerance };
            }
            if round == 0 && contact.foresee(&self.correction, h) {
                continue;
            }
            for i in 0..self.speed.len() {
                self.candidate[i] = self.position[i] + self.correction[i] * h;
            }
            let share = contact.safe_share(&self.candidate);
            if best > 0.0 && share <= best {
                std::mem::swap(&mut self.correction, &mut self.best);
                break;
            }
            best = share;
            tolerance.iterations = LINEAR_MORE;
            if share == 1.0 || round == FORESIGHT || (round > 1 && share > ENOUGH) || !contact.expect() {
                break;
            }
            self.best.copy_from_slice(&self.correction);
        }
        best
    }

    /// Solves for the correction that brings forces into balance, with those of contact; from the last one on where that
    /// is `near`.
    fn correct(
        &mut self,
        h: f64,
        damping: f64,
        near: bool,
        tolerance: Tolerance,
        parallel: bool,
        report: &mut Advanced,
    ) {
        if !near {
            self.shell.assemble(&mut self.matrix, &self.diagonal, [h * h, h * h + h * damping], &self.fixed, parallel);
        }
        self.residual.copy_from_slice(&self.outer);
        if let Some(contact) = &self.contact {
            contact.add_forces(&mut self.residual, h);
            contact.couple(&mut self.matrix, h * h);
        }
        if near {
            self.known.copy_from_slice(&self.correction);
            self.matrix.multiply(&self.known, &mut self.correction, parallel);
            for i in 0..self.residual.len() {
                self.residual[i] -= self.correction[i];
            }
        }
        let iterations = self.solve_linear(tolerance, near, parallel);
        self.fresh = false;
        report.iterations[1] += iterations as u32;
        // What is left of it is no step that anyone asked for.
        self.lost |= iterations >= tolerance.iterations;
        if near {
            for i in 0..self.residual.len() {
                self.correction[i] += self.known[i];
            }
        }
        self.balance_momentum();
    }

    /// Solves for the correction of a Newton iteration. Returns the number of iterations.
    fn solve_linear(&mut self, tolerance: Tolerance, near: bool, parallel: bool) -> usize {
        let Self { matrix, multigrid, position, linear, residual, rest_of_residual, correction, fresh, .. } = self;
        let mut caution = CAUTION;
        loop {
            // A correction near the last one differs by what touches alone.
            if !near || caution > CAUTION {
                multigrid.set_up(matrix, position, caution, *fresh || caution > CAUTION, parallel);
            }
            multigrid.join(matrix, parallel);
            rest_of_residual.copy_from_slice(residual);
            if let Some(iterations) = linear.solve(matrix, multigrid, rest_of_residual, correction, tolerance, parallel)
            {
                return iterations;
            }
            // Smoothing overshoots where the largest eigenvalue was underestimated.
            caution *= 1.5;
            if caution > MOST_CAUTION {
                return LINEAR;
            }
        }
    }
}
