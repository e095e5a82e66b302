//! Explicit motion of springs, with Provot's limit on deformation and breakage.
//!
//! Model: springs with damping (Eq. 6.1, 6.4), symplectic Euler (Eq. 6.6), substep from a bound on the highest frequency
//! (Eq. 6.7), deformation limit (Eq. 6.8), breakage (Eq. 9.1). Source: [Provot1995]; the bound by Gershgorin's theorem
//! [Gershgorin1931]. Valid when: springs are soft; for real paper substeps would be microseconds. Cost: one pass over
//! the links a substep; springs past their limit or strength are dealt with one by one, in order.

use super::{Advanced, Integrator, Step};
use crate::kernels::springs::{Drive, SpringBuffers, SubstepSettings, substep};
use crate::kernels::{LANES, Links};
use crate::scene::{LimitWeights, Mechanics, Scene, Threshold};
use crate::sheet::{SheetState, SpringKind};
use glam::DVec3;

/// tuned: a tenth below the bound, for masses and stiffnesses change within a step, 0.5 to 0.95
const SAFETY: f64 = 0.9;

/// Fewest nodes for which a second thread pays for its start. // tuned: measured on two cores, 4000 to 50000
const PARALLEL_FROM: usize = 30_000;

struct SymplecticEuler {
    mechanics: Mechanics,
    topology: Option<u64>,
    links: Links,
    buffers: SpringBuffers,
    /// Springs at each node: first of each in `spring_of`, and the end.
    first_spring: Vec<u32>,
    spring_of: Vec<u32>,
    /// Springs to look at in this sweep and the next, and which are listed already.
    queue: [Vec<u32>; 2],
    listed: Vec<u8>,
}

/// Builds the integrator.
pub fn build(scene: &Scene) -> Box<dyn Integrator> {
    Box::new(SymplecticEuler {
        mechanics: scene.mechanics.clone(),
        topology: None,
        links: Links::default(),
        buffers: SpringBuffers::default(),
        first_spring: Vec::new(),
        spring_of: Vec::new(),
        queue: Default::default(),
        listed: Vec::new(),
    })
}

impl Integrator for SymplecticEuler {
    fn advance(&mut self, state: &mut SheetState, step: &Step<'_>) -> Advanced {
        if self.topology != Some(step.topology) {
            self.relink(state);
            self.topology = Some(step.topology);
        }
        let longest = self.longest_substep(state, step);
        let substeps = step.substeps.unwrap_or((step.dt / (SAFETY * longest)).ceil().clamp(1.0, 1e6) as u32).max(1);
        let dt = step.dt / f64::from(substeps);
        self.choose_grid(state);
        self.load_nodes(state, step, dt);
        self.load_links(state, step);
        let settings = SubstepSettings {
            dt,
            spring_damping: self.mechanics.spring_damping.0,
            unit: step.unit,
            parallel: step.parallel && state.motion.len() >= PARALLEL_FROM,
        };
        let mut broken = 0;
        let mut before = 0;
        for _ in 0..substeps {
            let alarm = substep(&self.links, &mut self.buffers, before, settings);
            // An alarm speaks of the lengths before the substep; what it then finds are the lengths after.
            before = 1 - before;
            if alarm {
                broken += self.look_at_alarms(state, step, before);
            }
        }
        self.store(state);
        Advanced { substeps, broken, strain_max: strain_max(state), courant: dt / longest, ..Advanced::default() }
    }
}

impl SymplecticEuler {
    /// Lays out links and the springs of each node anew.
    fn relink(&mut self, state: &SheetState) {
        let springs = &state.springs;
        let count = state.motion.len();
        self.links = Links::build(count, &springs.ends, |s| springs.broken[s] != 0);
        self.buffers.fit(&self.links);
        let mut degree = vec![0u32; count + 1];
        for s in 0..springs.len() {
            if springs.broken[s] == 0 {
                springs.ends[s].iter().for_each(|i| degree[*i as usize + 1] += 1);
            }
        }
        for i in 0..count {
            degree[i + 1] += degree[i];
        }
        self.first_spring = degree.clone();
        self.spring_of = vec![0; degree[count] as usize];
        for s in 0..springs.len() {
            if springs.broken[s] == 0 {
                for i in springs.ends[s] {
                    self.spring_of[degree[i as usize] as usize] = s as u32;
                    degree[i as usize] += 1;
                }
            }
        }
        self.listed = vec![0; springs.len()];
    }

    /// Longest stable substep [s], Eq. 6.7: no mode is faster than omega^2 = max_i 2 sum_j K_ij / m_i; damping along the
    /// springs shortens the bound 2/omega by sqrt(1 + z^2) - z, z = beta omega / 2.
    fn longest_substep(&self, state: &SheetState, step: &Step<'_>) -> f64 {
        let mut fastest = 0.0f64;
        for i in 0..state.motion.len() {
            let links = self.first_spring[i] as usize..self.first_spring[i + 1] as usize;
            let stiffness: f64 = self.spring_of[links]
                .iter()
                .map(|s| state.springs.stiffness[*s as usize] * step.factors.stiffness[*s as usize])
                .sum();
            if stiffness > 0.0 && state.motion.pinned[i] == 0 {
                fastest = fastest.max(2.0 * stiffness / state.mass(i));
            }
        }
        let omega = fastest.sqrt();
        let z = 0.5 * self.mechanics.spring_damping.0 * omega;
        2.0 / omega.max(f64::MIN_POSITIVE) * ((1.0 + z * z).sqrt() - z)
    }

    /// Chooses the grid that neighbours see positions on, by the springs as they are.
    fn choose_grid(&mut self, state: &SheetState) {
        let springs = &state.springs;
        let mut longest_squared = 0.0f64;
        for s in 0..springs.len() {
            if springs.broken[s] == 0 {
                let [i, j] = springs.ends[s].map(|i| state.motion.position[i as usize]);
                longest_squared = longest_squared.max(i.distance_squared(j)).max(springs.rest_length[s].powi(2));
            }
        }
        let farthest = state.motion.position.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        self.buffers.choose_grid(longest_squared.sqrt(), farthest);
    }

    /// Fills in the nodes for the substeps of one step.
    fn load_nodes(&mut self, state: &SheetState, step: &Step<'_>, dt: f64) {
        for i in 0..state.motion.len() {
            let held = state.motion.pinned[i] != 0 || state.motion.alive[i] == 0;
            let reciprocal_mass = if held { 0.0 } else { 1.0 / state.mass(i) };
            let velocity = if held { DVec3::ZERO } else { state.motion.velocity[i] };
            self.buffers.put(i, state.motion.position[i].to_array(), velocity.to_array(), 0);
            let Drive { force, impulse, keep } = &mut self.buffers.drive[i / LANES];
            let lane = i % LANES;
            for axis in 0..3 {
                force[axis][lane] = step.forces.force[i][axis];
            }
            impulse[lane] = dt * reciprocal_mass;
            keep[lane] = 1.0 / (1.0 + dt * step.forces.drag[i] * reciprocal_mass);
        }
    }

    /// Fills in the coefficients of the links for the substeps of one step.
    fn load_links(&mut self, state: &SheetState, step: &Step<'_>) {
        let (grid, range) = (self.buffers.grid, self.buffers.range());
        for (s, places) in self.links.of_element.iter().enumerate() {
            if places[0][0] == u32::MAX || state.springs.broken[s] != 0 {
                continue;
            }
            let stiffness = state.springs.stiffness[s] * step.factors.stiffness[s];
            let natural = step.factors.tension[s] - stiffness * state.springs.rest_length[s];
            let alarm = (alarm_length(&self.mechanics, state, step, s).min(range) / grid) as f32;
            for (end, [row, lane]) in places.iter().enumerate() {
                let drag = if end == 0 { step.factors.drag[s] } else { -step.factors.drag[s] };
                let row = &mut self.buffers.rows[*row as usize];
                row.stiffness[*lane as usize] = (stiffness * grid) as f32;
                row.constant[*lane as usize] = (natural + drag) as f32;
                row.alarm_squared[*lane as usize] = alarm * alarm;
            }
        }
    }

    /// Goes over to a coarser grid, for springs that have outgrown the one there is.
    fn coarsen_grid(&mut self, state: &SheetState, step: &Step<'_>, longest: f64, side: usize) {
        let count = state.motion.len();
        let farthest = (0..count).flat_map(|i| self.buffers.position(i)).fold(0.0, |far: f64, x| far.max(x.abs()));
        self.buffers.choose_grid(longest, farthest);
        for i in 0..count {
            let (position, velocity) = (self.buffers.position(i), self.buffers.velocity(i));
            self.buffers.put(i, position, velocity, side);
        }
        self.load_links(state, step);
    }

    fn store(&self, state: &mut SheetState) {
        for i in 0..state.motion.len() {
            state.motion.position[i] = DVec3::from_array(self.buffers.position(i));
            state.motion.velocity[i] = DVec3::from_array(self.buffers.velocity(i));
        }
    }

    /// Breaks the springs that are past their strength and pulls back those past the limit, in the order of springs, and
    /// again where that has stretched others, up to the number of sweeps. Returns the number that broke.
    fn look_at_alarms(&mut self, state: &mut SheetState, step: &Step<'_>, side: usize) -> usize {
        let mut now = std::mem::take(&mut self.queue[0]);
        let mut next = std::mem::take(&mut self.queue[1]);
        now.clear();
        for slice in 0..self.links.slices() {
            if self.buffers.alarm[slice] != 0 {
                for i in slice * LANES..((slice + 1) * LANES).min(state.motion.len()) {
                    self.list_springs_of(i, &mut now);
                }
            }
        }
        let mut broken = 0;
        let mut longest = 0.0f64;
        for sweep in 0..=self.mechanics.limit_sweeps {
            now.sort_unstable();
            next.clear();
            for s in &now {
                self.listed[*s as usize] = 0;
            }
            for s in &now {
                let s = *s as usize;
                if state.springs.broken[s] != 0 {
                    continue;
                }
                let [i, j] = state.springs.ends[s].map(|i| i as usize);
                let length = distance(&self.buffers, i, j);
                longest = longest.max(length);
                if length > breaking_length(&self.mechanics, state, step, s) {
                    state.springs.broken[s] = 1;
                    self.unlink(s);
                    broken += 1;
                } else if sweep < self.mechanics.limit_sweeps && self.pull_back(state, s, side) {
                    self.list_springs_of(i, &mut next);
                    self.list_springs_of(j, &mut next);
                }
            }
            if next.is_empty() {
                break;
            }
            std::mem::swap(&mut now, &mut next);
        }
        for s in next.iter().chain(&now) {
            self.listed[*s as usize] = 0;
        }
        self.queue = [now, next];
        // Half of the range: an alarm speaks of the lengths before the substep.
        if longest > 0.5 * self.buffers.range() {
            self.coarsen_grid(state, step, longest, side);
        }
        broken
    }

    fn list_springs_of(&mut self, node: usize, list: &mut Vec<u32>) {
        for s in &self.spring_of[self.first_spring[node] as usize..self.first_spring[node + 1] as usize] {
            if self.listed[*s as usize] == 0 {
                self.listed[*s as usize] = 1;
                list.push(*s);
            }
        }
    }

    /// Takes a broken spring out of the links, without laying them out anew.
    fn unlink(&mut self, s: usize) {
        for [row, lane] in self.links.of_element[s] {
            let row = &mut self.buffers.rows[row as usize];
            row.stiffness[lane as usize] = 0.0;
            row.constant[lane as usize] = 0.0;
            row.alarm_squared[lane as usize] = f32::MAX;
        }
    }

    /// Eq. 6.8: moves the ends of a spring past the limit back along it, and takes away the speed at which they part.
    fn pull_back(&mut self, state: &SheetState, s: usize, side: usize) -> bool {
        let limit = limit_length(&self.mechanics, state, s);
        let [i, j] = state.springs.ends[s].map(|i| i as usize);
        let length = distance(&self.buffers, i, j);
        // A nanometre over is rounding, not stretch.
        if length <= limit * (1.0 + 1e-9) {
            return false;
        }
        let [wi, wj] = [i, j].map(|i| self.buffers.drive[i / LANES].impulse[i % LANES]);
        if wi + wj == 0.0 {
            return false;
        }
        let (part_i, part_j) = match self.mechanics.limit_weights {
            LimitWeights::Mass => (wi / (wi + wj), wj / (wi + wj)),
            LimitWeights::Equal if wi == 0.0 => (0.0, 1.0),
            LimitWeights::Equal if wj == 0.0 => (1.0, 0.0),
            LimitWeights::Equal => (0.5, 0.5),
        };
        let excess = length - limit;
        let [mut at_i, mut at_j] = [i, j].map(|i| self.buffers.position(i));
        let [mut moves_i, mut moves_j] = [i, j].map(|i| self.buffers.velocity(i));
        let direction: [f64; 3] = std::array::from_fn(|axis| (at_j[axis] - at_i[axis]) / length);
        let parting: f64 = (0..3).map(|axis| direction[axis] * (moves_j[axis] - moves_i[axis])).sum();
        let impulse = parting.max(0.0) / (wi + wj);
        for axis in 0..3 {
            at_i[axis] += part_i * excess * direction[axis];
            at_j[axis] -= part_j * excess * direction[axis];
            moves_i[axis] += wi * impulse * direction[axis];
            moves_j[axis] -= wj * impulse * direction[axis];
        }
        self.buffers.put(i, at_i, moves_i, side);
        self.buffers.put(j, at_j, moves_j, side);
        true
    }
}

fn distance(buffers: &SpringBuffers, i: usize, j: usize) -> f64 {
    let [a, b] = [i, j].map(|i| buffers.position(i));
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// Length at which somebody must look at a spring [m].
fn alarm_length(mechanics: &Mechanics, state: &SheetState, step: &Step<'_>, s: usize) -> f64 {
    limit_length(mechanics, state, s).min(breaking_length(mechanics, state, step, s))
}

/// Length past which a spring is pulled back [m]; infinite for flexion springs and where the limit is off.
fn limit_length(mechanics: &Mechanics, state: &SheetState, s: usize) -> f64 {
    if mechanics.deformation_limit.0 <= 0.0 || state.springs.kind[s] == SpringKind::Flexion as u8 {
        return f64::INFINITY;
    }
    state.springs.rest_length[s] * (1.0 + mechanics.deformation_limit.0)
}

/// Length at which the force of a spring, its own and by heat, reaches what breaks it [m] (Eq. 9.1).
fn breaking_length(mechanics: &Mechanics, state: &SheetState, step: &Step<'_>, s: usize) -> f64 {
    let factor = step.factors.stiffness[s];
    let stiffness = state.springs.stiffness[s] * factor;
    let strength = match mechanics.threshold {
        Threshold::Scaled => state.springs.strength[s] * factor,
        Threshold::Fixed => state.springs.strength[s],
    };
    if strength <= 0.0 || stiffness <= 0.0 {
        return f64::INFINITY;
    }
    state.springs.rest_length[s] + (strength - step.factors.tension[s]) / stiffness
}

/// Largest strain of any unbroken structural or shear spring.
pub fn strain_max(state: &SheetState) -> f64 {
    strains(state).fold(0.0, f64::max)
}

/// Strains of the unbroken structural and shear springs.
pub fn strains(state: &SheetState) -> impl Iterator<Item = f64> + '_ {
    let springs = &state.springs;
    (0..springs.len()).filter(|s| springs.broken[*s] == 0 && springs.kind[*s] != SpringKind::Flexion as u8).map(|s| {
        let [i, j] = springs.ends[s].map(|i| state.motion.position[i as usize]);
        i.distance(j) / springs.rest_length[s] - 1.0
    })
}
