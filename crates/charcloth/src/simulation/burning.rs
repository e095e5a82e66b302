//! Heat, fuel and gas of a step: of either model, in as many parts as it needs.

use super::{Flame, Scratch, Simulation};
use crate::build::Built;
use crate::effects::conduction::conductances;
use crate::frame::fine_normals;
use crate::homogenise;
use crate::scene::ConductionDistance;
use crate::tear;
use crate::thermo::Moment;
use glam::DVec3;
use std::time::Instant;

impl Simulation {
    /// Heat and fuel of the 2004 model, in as many parts as heat needs to bring no new extremes.
    pub(super) fn burn(&mut self, dt: f64) {
        let (parallel, unit) = (self.parallel, self.unit);
        let heat_steps = (dt / self.longest_heat_step() - 1e-9).ceil().max(1.0);
        let heat_dt = dt / heat_steps;
        for part in 0..heat_steps as u64 {
            let time = self.time() + part as f64 * heat_dt;
            let moment = Moment { time, dt: heat_dt, unit, parallel };
            self.hold_flames(time);
            self.add_heat();
            let Self { built: Built { state, .. }, burning, scratch, stages, .. } = self;
            stages.time("burn", || burning.advance(state, &scratch.rates, moment));
        }
    }

    /// Heat, chemistry and gas of the physical model, in parts that each can hold.
    pub(super) fn burn_physically(&mut self, dt: f64) {
        let Self { built: Built { state, .. }, physical, scratch, stages, scene, .. } = self;
        let Some(physical) = physical else { return };
        let Scratch { map, normal, burn_position, burn_normal, .. } = scratch;
        let (fine, moves) = (state.has_fine_burn_mesh(), scene.mechanics.moves);
        let parts = (dt / physical.longest_step() - 1e-9).ceil().max(1.0);
        let start = state.books.time[0];
        for part in 0..parts as u64 {
            let moment = start + part as f64 * (dt / parts);
            stages.time("wake", || physical.wake(state, moment));
            if !fine {
                stages.time("burn", || {
                    let position = std::mem::take(&mut state.motion.position);
                    physical.advance(state, &position, normal, moment, dt / parts);
                    state.motion.position = position;
                });
                continue;
            }
            stages.time("place", || {
                let place = |i| map.position(&state.triangles, &state.motion.position, normal, i);
                if moves {
                    for column in [&mut *burn_position, &mut *burn_normal] {
                        column.resize(state.burn.len(), DVec3::ZERO);
                    }
                    let [awake, near] = physical.awake();
                    near.iter().for_each(|i| burn_position[*i as usize] = place(*i as usize));
                    for i in awake.iter().map(|i| *i as usize) {
                        burn_normal[i] = map.normal(&state.burn_triangles.corners, burn_position, i);
                    }
                } else if burn_position.len() != state.burn.len() {
                    burn_position.clear();
                    burn_position.extend((0..state.burn.len()).map(place));
                    *burn_normal = fine_normals(burn_position, &state.burn_triangles);
                }
            });
            stages.time("burn", || physical.advance(state, burn_position, burn_normal, moment, dt / parts));
        }
    }

    /// Heats the nodes that a flame is held to.
    fn hold_flames(&mut self, time: f64) {
        let state = &mut self.built.state;
        let begun = |flame: &&Flame| flame.start <= time && (time < flame.end || !flame.delay.is_empty());
        for flame in self.flames.iter().filter(begun) {
            for (k, i) in flame.nodes.iter().enumerate() {
                let i = *i as usize;
                let since = time - flame.delay.get(k).copied().unwrap_or(0.0);
                if !(flame.start..flame.end).contains(&since) {
                    continue;
                }
                if state.burn.temperature[i] >= flame.temperature {
                    continue;
                }
                let given = self.burning.capacity_of(&state.burn, i) * (flame.temperature - state.burn.temperature[i]);
                state.burn.temperature[i] = flame.temperature;
                state.burn.peak_temperature[i] = state.burn.peak_temperature[i].max(flame.temperature);
                if state.burn.ignited_at[i] < 0.0 && flame.temperature > self.scene.fire.ignition_temperature.0 {
                    state.burn.ignited_at[i] = time;
                }
                state.books.heat_of_ignition[0] += given;
            }
        }
    }

    fn add_heat(&mut self) {
        let mut rates = std::mem::take(&mut self.scratch.rates);
        let count = self.built.state.burn.len();
        rates.clear(count);
        let start = Instant::now();
        let now = self.now();
        for effect in &self.effects {
            effect.add_heat(&now, &mut rates);
        }
        self.stages.add("heat", start);
        self.scratch.rates = rates;
    }

    /// Longest heat step that brings no new extremes [s].
    fn longest_heat_step(&mut self) -> f64 {
        if self.scene.fire.distance == ConductionDistance::Current {
            let Self { built: Built { state, .. }, scratch, scene, .. } = self;
            conductances(state, &scratch.heat_links, scene.fire.distance, &mut scratch.conductance);
            self.sum_conductances();
        }
        let scratch = &mut self.scratch;
        if self.burning.changes_capacity() {
            scratch.longest_heat_step = None;
        }
        *scratch.longest_heat_step.get_or_insert_with(|| {
            let longest = self.burning.longest_step(&self.built.state.burn, &scratch.conductance_sum);
            // tuned: at the bound itself one node may take the mean of its neighbours; nine tenths keeps some of its own
            0.9 * longest
        })
    }

    /// Conductance that leads to each node, for the length of heat steps.
    pub(super) fn sum_conductances(&mut self) {
        let Self { built: Built { state, .. }, scratch, .. } = self;
        scratch.longest_heat_step = None;
        scratch.conductance_sum.clear();
        scratch.conductance_sum.resize(state.burn.len(), 0.0);
        let edges = &state.burn_edges;
        for (e, places) in scratch.heat_links.of_element.iter().enumerate() {
            if places[0][0] != u32::MAX {
                let [row, lane] = places[0];
                let conductance = scratch.conductance[row as usize].0[lane as usize];
                edges.ends[e].iter().for_each(|i| scratch.conductance_sum[*i as usize] += conductance);
            }
        }
    }

    /// Brings what pictures and mechanics see of burning up to date, and takes what has burnt through out of a finer burn
    /// mesh. Once a frame will do: only pictures tell a triangle without fuel from none.
    pub(super) fn burn_through(&mut self) {
        let split = self.laid_out != Some(self.topology);
        let state = &mut self.built.state;
        self.scratch.shown = true;
        match &mut self.physical {
            Some(physical) => physical.show(state, split),
            None => homogenise::show(state),
        }
        if homogenise::burn_through(state, self.scene.mechanics.residual_stiffness.0) {
            tear::split(state);
            if !state.has_fine_burn_mesh() {
                tear::part(state);
            }
            self.topology += 1;
        }
        if let Some(shed) = &mut self.shed {
            if shed.cut(state) {
                self.topology += 1;
            }
            shed.gather(state);
            shed.measure(state);
        }
    }
}
