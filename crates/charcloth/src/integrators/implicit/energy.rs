//! What a step minimises, and its slope.

use super::Implicit;
use crate::sheet::SheetState;
use crate::solver::blocks::{by_rows, sum_by_rows};
use glam::DVec3;

/// Largest change of step length over which differences of second order are taken.
const STEADY: f64 = 1.5;

impl Implicit {
    /// Eq. 12.8: the step as one of implicit Euler, from a mixture of the last two states and so much shorter [s].
    pub(super) fn look_back(&mut self, state: &SheetState, dt: f64) -> f64 {
        let before = state.books.step_before[0];
        let ratio = if before > 0.0 { dt / before } else { f64::INFINITY };
        let steady = (1.0 / STEADY..=STEADY).contains(&ratio);
        let (now, then, length) = if steady {
            let lead = (1.0 + 2.0 * ratio) / (1.0 + ratio);
            ((1.0 + ratio) / lead, -ratio * ratio / (1.0 + ratio) / lead, 1.0 / lead)
        } else {
            (1.0, 0.0, 1.0)
        };
        for i in 0..state.motion.len() {
            self.position[i] = state.motion.position[i];
            if self.fixed[i] {
                (self.from[i], self.speed_from[i]) = (self.position[i], DVec3::ZERO);
                self.speed[i] = DVec3::ZERO;
                continue;
            }
            self.from[i] = state.motion.position[i] * now + state.before.position[i] * then;
            self.speed_from[i] = state.motion.velocity[i] * now + state.before.velocity[i] * then;
            self.speed[i] = state.motion.velocity[i];
        }
        dt * length
    }

    /// Eq. 12.9: the energy whose minimum is the step, at the candidate velocity; forces and stiffness are there for it.
    pub(super) fn energy(&mut self, h: f64, damping: f64, parallel: bool) -> f64 {
        for i in 0..self.position.len() {
            if !self.fixed[i] {
                self.position[i] = self.from[i] + self.candidate[i] * h;
            }
        }
        let elastic = self.shell.respond(&self.position, parallel);
        if damping > 0.0 {
            self.shell.bend(&self.candidate, &mut self.bent, parallel);
        }
        let Self { candidate, speed_from, position, push, bent, mass, drag, sums, .. } = self;
        let of_node = |i: usize| {
            0.5 * mass[i] * candidate[i].distance_squared(speed_from[i])
                + 0.5 * h * drag[i] * candidate[i].length_squared()
                + 0.5 * h * damping * candidate[i].dot(bent[i])
                - push[i].dot(position[i])
        };
        elastic + sum_by_rows(candidate.len(), parallel, sums, |part| part.map(of_node).sum())
    }

    /// What is not yet in balance at the last candidate: minus the gradient of the energy.
    pub(super) fn take_residual(&mut self, h: f64, damping: f64, parallel: bool) {
        let Self { residual, shell, candidate, speed_from, push, bent, mass, drag, fixed, .. } = self;
        by_rows(residual, parallel, |first, residual| {
            for (k, residual) in residual.iter_mut().enumerate() {
                let i = first + k;
                *residual = if fixed[i] {
                    DVec3::ZERO
                } else {
                    (shell.force(i) + push[i] - candidate[i] * drag[i] - bent[i] * damping) * h
                        - (candidate[i] - speed_from[i]) * mass[i]
                };
            }
        });
    }
}
