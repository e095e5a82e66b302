//! Implicit motion of an elastic shell.
//!
//! Model: backward differences of second order for position and velocity (Eq. 12.8), each step the minimum of an energy
//! (Eq. 12.9) that is found by Newton's method with a line search; linear systems by conjugate gradients with a multigrid
//! preconditioner (`correction.rs`). Where the sheet touches, itself or what is in the way, contact has its part in that energy, and no
//! iteration goes so far that anything passes through (`contact/response.rs`).
//! Source: [Curtiss1952] for the differences; [Martin2011] for the energy. Valid when: steps resolve the
//! motion that matters; stiffness sets no limit. Burnt sheet loses stiffness by Eq. 7.1, heat shortens lengths by
//! the contraction of Eq. 6.3b; springs carry nothing, but where the shell's tension along one passes its strength, it breaks.
//! Cost: a few products with a sparse matrix an iteration.

mod correction;
mod energy;
mod pieces;
mod strength;
mod tolerance;

use super::symplectic_euler::strain_max;
use super::{Advanced, Integrator, Step};
use crate::contact::response::Response;
use crate::contact::scenery::Scenery;
use crate::scene::{Scene, ThermalForceLaw};
use crate::sheet::SheetState;
use crate::shell::Shell;
use crate::solver::StepMatrix;
use crate::solver::conjugate_gradients::ConjugateGradients;
use crate::solver::multigrid::Multigrid;
use glam::DVec3;
use tolerance::Measure;

/// Most Newton iterations a step, the same where something touches, and most halvings of an iteration's length.
const NEWTON: usize = 20;
const NEWTON_IN_CONTACT: usize = 60;
const HALVINGS: usize = 12;
/// Share of an iteration under which the scenery counts as held up by the sheet. // tuned: 0.01 to 0.3
const RELUCTANT: f64 = 0.1;
/// How many times a step that is not solved is halved at most.
const MOST_HALVED: u32 = 4;
/// Fewest nodes for which a second thread pays for its start. // tuned: 2000 to 10000
const PARALLEL_FROM: usize = 3000;

struct Implicit {
    scene: Scene,
    topology: Option<u64>,
    shell: Shell,
    matrix: StepMatrix,
    multigrid: Multigrid,
    linear: ConjugateGradients,
    fixed: Vec<bool>,
    mass: Vec<f64>,
    drag: Vec<f64>,
    /// Mass and drag of each node, as they stand in the matrix.
    diagonal: Vec<f64>,
    /// Where a step of no length would end, and how fast.
    from: Vec<DVec3>,
    speed_from: Vec<DVec3>,
    speed: Vec<DVec3>,
    candidate: Vec<DVec3>,
    position: Vec<DVec3>,
    push: Vec<DVec3>,
    bent: Vec<DVec3>,
    residual: Vec<DVec3>,
    rest_of_residual: Vec<DVec3>,
    /// The residual without contact, and with it but without what is only expected.
    outer: Vec<DVec3>,
    honest: Vec<DVec3>,
    /// The correction that can be followed the farthest.
    best: Vec<DVec3>,
    /// Whether the step has yet to estimate the largest eigenvalue of its matrix.
    fresh: bool,
    /// Whether a linear system of the step was not solved.
    lost: bool,
    /// The correction that a solution goes on from.
    known: Vec<DVec3>,
    correction: Vec<DVec3>,
    sums: Vec<f64>,
    /// Connected piece of each node, and whether it hangs on nothing.
    piece: Vec<u32>,
    floats: Vec<bool>,
    /// What is not in balance of each piece, and its mass and drag.
    piece_sums: Vec<(DVec3, f64)>,
    /// Pieces that something touches.
    touched: Vec<bool>,
    contact: Option<Response>,
}

/// Builds the integrator.
pub fn build(scene: &Scene) -> Box<dyn Integrator> {
    Box::new(Implicit {
        scene: scene.clone(),
        topology: None,
        shell: Shell::default(),
        matrix: StepMatrix::default(),
        multigrid: Multigrid::default(),
        linear: ConjugateGradients::default(),
        fixed: Vec::new(),
        mass: Vec::new(),
        drag: Vec::new(),
        diagonal: Vec::new(),
        from: Vec::new(),
        speed_from: Vec::new(),
        speed: Vec::new(),
        candidate: Vec::new(),
        position: Vec::new(),
        push: Vec::new(),
        bent: Vec::new(),
        residual: Vec::new(),
        rest_of_residual: Vec::new(),
        outer: Vec::new(),
        honest: Vec::new(),
        best: Vec::new(),
        fresh: true,
        lost: false,
        known: Vec::new(),
        correction: Vec::new(),
        sums: Vec::new(),
        piece: Vec::new(),
        floats: Vec::new(),
        piece_sums: Vec::new(),
        touched: Vec::new(),
        contact: None,
    })
}

impl Integrator for Implicit {
    fn advance(&mut self, state: &mut SheetState, step: &Step<'_>) -> Advanced {
        let substeps = step.substeps.unwrap_or(1).max(1);
        let mut report = Advanced::default();
        if self.topology != Some(step.topology) {
            self.lay_out(state);
            self.topology = Some(step.topology);
        }
        let Scene { shell: material, thermal_force, fire, .. } = &self.scene;
        let contraction =
            if thermal_force.law == ThermalForceLaw::Pairwise { thermal_force.contraction.0 } else { 0.0 };
        self.shell.update(state, material, step.factors, contraction, fire.ambient_temperature.0);
        self.load(state, step);
        let parallel = step.parallel && state.motion.len() >= PARALLEL_FROM;
        for substep in 0..substeps {
            let dt = step.dt / f64::from(substeps);
            let time = state.books.time[0] + f64::from(substep) * dt;
            self.stride(state, [time, dt], MOST_HALVED, parallel, &mut report);
        }
        report.broken = self.break_springs(state, step);
        report.strain_max = strain_max(state);
        report
    }

    fn meet(&mut self, scenery: Scenery) {
        self.contact = Response::of(&self.scene, scenery);
    }

    fn shell(&self) -> Option<&Shell> {
        Some(&self.shell)
    }

    fn crossings(&mut self, state: &SheetState, topology: u64) -> Option<usize> {
        self.contact.as_ref()?;
        if self.topology != Some(topology) {
            self.lay_out(state);
            self.topology = Some(topology);
        }
        Some(self.contact.as_mut()?.crossings(&state.motion.position, state.books.time[0], state.books.scenery_lag[0]))
    }
}

impl Implicit {
    fn lay_out(&mut self, state: &SheetState) {
        let count = state.motion.len();
        self.fixed.clear();
        self.fixed.extend((0..count).map(|i| state.motion.pinned[i] != 0 || state.motion.alive[i] == 0));
        (self.shell, self.matrix) = Shell::lay_out(state, &self.scene.shell, &self.fixed);
        self.multigrid = Multigrid::lay_out(&self.matrix, &self.fixed);
        self.find_pieces();
        if let Some(contact) = &mut self.contact {
            contact.lay_out(state, &self.fixed);
        }
        for buffer in [
            &mut self.from,
            &mut self.speed_from,
            &mut self.speed,
            &mut self.candidate,
            &mut self.position,
            &mut self.push,
            &mut self.bent,
            &mut self.residual,
            &mut self.rest_of_residual,
            &mut self.outer,
            &mut self.honest,
            &mut self.best,
            &mut self.known,
            &mut self.correction,
        ] {
            buffer.clear();
            buffer.resize(count, DVec3::ZERO);
        }
    }

    /// Takes over masses and outer forces.
    fn load(&mut self, state: &SheetState, step: &Step<'_>) {
        let count = state.motion.len();
        self.mass.clear();
        self.mass.extend((0..count).map(|i| state.mass(i) + step.forces.air_mass[i]));
        self.drag.clear();
        self.drag.extend_from_slice(&step.forces.drag);
        self.push.copy_from_slice(&step.forces.force);
        for s in 0..state.springs.len() {
            let drag = step.factors.drag[s];
            if drag != 0.0 && state.springs.broken[s] == 0 {
                let [i, j] = state.springs.ends[s].map(|i| i as usize);
                let along = (state.motion.position[j] - state.motion.position[i]).normalize_or_zero();
                self.push[i] += along * drag;
                self.push[j] += along * drag;
            }
        }
    }

    /// Goes from a time on by a step [s], in two halves where it is not solved whole, and so on so many times.
    fn stride(
        &mut self,
        state: &mut SheetState,
        [time, dt]: [f64; 2],
        halvings: u32,
        parallel: bool,
        report: &mut Advanced,
    ) {
        let h = self.look_back(state, dt);
        if let Some(contact) = &mut self.contact {
            contact.begin(&state.motion.position, [time, time + dt], state.books.scenery_lag[0]);
        }
        let solved =
            self.solve(h, halvings > 0, parallel, report) && self.contact.as_ref().is_none_or(Response::has_arrived);
        if !solved && halvings > 0 {
            for start in [time, time + 0.5 * dt] {
                self.stride(state, [start, 0.5 * dt], halvings - 1, parallel, report);
            }
            return;
        }
        report.stalled |= !solved;
        report.substeps += 1;
        if let Some(contact) = &mut self.contact {
            report.passed_through += contact.passed_through();
            state.books.scenery_lag[0] = contact.lag();
        }
        self.store(state, dt);
    }

    /// Finds the velocity at the end of a step of implicit Euler. Returns whether it has been found; gives up early where the
    /// step may be halved.
    fn solve(&mut self, h: f64, halves: bool, parallel: bool, report: &mut Advanced) -> bool {
        self.lost = false;
        let pace = self.pace(h, parallel);
        if pace.moving < pace.falling {
            // Speeds so small are for the most part what earlier steps have left unsolved: to begin where the sheet is costs
            // less than to go on with them.
            for i in (0..self.speed.len()).filter(|i| !self.fixed[*i]) {
                self.speed[i] = (self.position[i] - self.from[i]) / h;
            }
        }
        if self.contact.is_some() {
            self.start_apart(h);
        }
        self.candidate.copy_from_slice(&self.speed);
        let damping = self.scene.shell.bending_damping.0;
        let mut energy = self.energy(h, damping, parallel);
        let mut measure = Measure::of(&self.scene.shell, &pace, self.contact.as_ref());
        self.fresh = true;
        let iterations = if self.contact.is_some() { NEWTON_IN_CONTACT } else { NEWTON };
        for _ in 0..iterations {
            if let Some(contact) = &mut self.contact {
                contact.detect(&self.speed, h);
                energy += contact.energy(&self.position, &self.speed, h);
            }
            self.take_residual(h, damping, parallel);
            self.diagonal.clear();
            self.diagonal.extend(self.mass.iter().zip(&self.drag).map(|(mass, drag)| mass + h * drag));
            let carried = self.contact.as_ref().is_some_and(Response::is_under_way);
            let share = self.find_correction(h, damping, measure.linear(carried), halves, parallel, report);
            report.iterations[0] += 1;
            if self.lost && halves {
                return false;
            }
            let gain = correction::gain(&self.honest, &self.correction, &mut self.sums, parallel);
            if !carried {
                measure.take(gain);
            }
            let arrived = self.contact.as_ref().is_none_or(Response::has_arrived);
            // What carries the sheet along does work on it, and the energy may rise.
            let asked = (!carried).then_some(gain);
            let (length, fell) = self.search(h, damping, share, asked, &mut energy, parallel);
            if !fell && arrived {
                return measure.is_still(gain) && !self.lost;
            }
            self.speed.copy_from_slice(&self.candidate);
            if let Some(contact) = &mut self.contact {
                contact.go(&self.position, length);
                // What gets nowhere against the sheet waits until that has made way.
                contact.wait(if carried { length < RELUCTANT } else { fell && length < 1.0 });
            }
            if length == 1.0 && arrived && measure.is_enough(gain) {
                return !self.lost;
            }
        }
        false
    }

    /// Looks along the correction, from a share of it on, for where the energy is as much lower as the gain asks for, if
    /// any does [Armijo1966]. Returns the length and whether there is such a place; puts the candidate there, or back, and
    /// `energy` to that without contact: what touches there is yet to be found.
    fn search(
        &mut self,
        h: f64,
        damping: f64,
        share: f64,
        gain: Option<f64>,
        energy: &mut f64,
        parallel: bool,
    ) -> (f64, bool) {
        let mut length = share;
        for _ in 0..HALVINGS {
            for i in 0..self.speed.len() {
                self.candidate[i] = self.speed[i] + self.correction[i] * length;
            }
            let outer = self.energy(h, damping, parallel);
            let touching =
                self.contact.as_ref().map_or(0.0, |contact| contact.energy(&self.position, &self.candidate, h));
            let falls = |gain| outer + touching <= *energy - 1e-4 * length * gain + 1e-13 * energy.abs();
            if gain.is_none_or(falls) {
                *energy = outer;
                return (length, true);
            }
            length *= 0.5;
        }
        self.candidate.copy_from_slice(&self.speed);
        *energy = self.energy(h, damping, parallel);
        (length, false)
    }

    /// Takes the first guess back to where nothing has yet passed through anything.
    fn start_apart(&mut self, h: f64) {
        let Self { contact: Some(contact), position, speed, from, fixed, candidate, .. } = self else { return };
        for i in 0..position.len() {
            candidate[i] = if fixed[i] { position[i] } else { from[i] + speed[i] * h };
        }
        let share = contact.safe_share(candidate);
        if share < 1.0 {
            for i in (0..position.len()).filter(|i| !fixed[*i]) {
                let still = (position[i] - from[i]) / h;
                speed[i] = still + (speed[i] - still) * share;
                candidate[i] = from[i] + speed[i] * h;
            }
        }
        contact.go(candidate, share);
    }

    fn store(&self, state: &mut SheetState, dt: f64) {
        for i in 0..state.motion.len() {
            state.before.position[i] = state.motion.position[i];
            state.before.velocity[i] = state.motion.velocity[i];
            state.motion.position[i] = self.position[i];
            state.motion.velocity[i] = self.speed[i];
        }
        state.books.step_before[0] = dt;
    }
}
