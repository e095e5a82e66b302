//! The step, and the run around it.

mod advice;
mod burning;
mod start;
mod summary;

pub use start::{GreyImage, Inputs};
pub use summary::Summary;

use crate::build::Built;
use crate::burn_mesh::BurnMap;
use crate::counters::Stages;
use crate::crack::Cracks;
use crate::effects::conduction::conductances;
use crate::effects::{Effect, Forces, HeatRates, Now, SpringFactors};
use crate::error::Error;
use crate::flow::Flow;
use crate::frame::{Frame, Sample, Sink, fine_normals, node_normals};
use crate::homogenise;
use crate::integrators::{Advanced, Integrator, Step};
use crate::kernels::heat::ConductanceRow;
use crate::kernels::{Links, VectorUnit};
use crate::ledger;
use crate::measure::{self, Probes};
use crate::motion::Guide;
use crate::particles::Shed;
use crate::physical::Physical;
use crate::plume::Plume;
use crate::scene::{Model, Scene};
use crate::sheet::SheetState;
use crate::tear;
use crate::thermo::Burning;
use glam::DVec3;
use std::time::Instant;

/// A flame held to some nodes for a while.
struct Flame {
    nodes: Vec<u32>,
    /// How much later it is held to each of them [s]; empty for nought.
    delay: Vec<f64>,
    start: f64,
    end: f64,
    temperature: f64,
}

/// Buffers that follow from the state: never saved, never read before they are written.
#[derive(Default)]
struct Scratch {
    normal: Vec<DVec3>,
    area: Vec<f64>,
    map: BurnMap,
    /// Places and normals of the nodes of a finer burn mesh.
    burn_position: Vec<DVec3>,
    burn_normal: Vec<DVec3>,
    heat_links: Links,
    conductance: Vec<ConductanceRow>,
    /// Sum of conductances at each burn node [W/K].
    conductance_sum: Vec<f64>,
    /// Longest heat step [s], while heat capacities and conductances stay as they are.
    longest_heat_step: Option<f64>,
    rates: HeatRates,
    forces: Forces,
    factors: SpringFactors,
    /// Whether burnt mass and stiffness have been brought up to date since motion last looked at them.
    shown: bool,
}

/// A running simulation.
pub struct Simulation {
    scene: Scene,
    built: Built,
    effects: Vec<Box<dyn Effect>>,
    integrator: Box<dyn Integrator>,
    burning: Burning,
    /// The physical model, where the scene asks for it; it takes the place of `burning`.
    physical: Option<Physical>,
    /// What gives way without parting, in the physical model.
    flow: Option<Flow>,
    /// Cracks, where the sheet can have any.
    cracks: Option<Cracks>,
    /// What comes off, in the physical model.
    shed: Option<Shed>,
    /// Air that rises over flames; of the state at the start of the frame.
    plume: Plume,
    flames: Vec<Flame>,
    measures: Probes,
    scratch: Scratch,
    /// Counts changes of the topology; scratch laid out for another is stale.
    topology: u64,
    laid_out: Option<u64>,
    stages: Stages,
    wall: f64,
    /// Whether anything may touch.
    meets: bool,
    /// Whether it goes on from a saved state.
    resumed: bool,
    last: Advanced,
    /// Nonlinear and linear iterations of implicit motion.
    iterations: [u64; 2],
    last_step: f64,
    warnings: Vec<String>,
    unit: VectorUnit,
    parallel: bool,
}

impl Simulation {
    /// Uses a certain vector unit; every one gives the same bits.
    pub fn set_vector_unit(&mut self, unit: VectorUnit) {
        self.unit = unit;
    }

    /// Has the physical model look after every node in every step, which is slow and gives the same bits.
    pub fn keep_all_awake(&mut self, all: bool) {
        if let Some(physical) = &mut self.physical {
            physical.keep_all_awake(all);
        }
    }

    /// Number of the frame reached.
    pub fn frame_number(&self) -> u32 {
        self.built.state.books.frame[0]
    }

    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.built.state.books.time[0]
    }

    /// The scene, as built.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// A copy of what can be seen now.
    pub fn frame(&self) -> Frame {
        Frame::of(&self.built.state, self.frame_number(), self.time())
    }

    /// The full state, to resume from.
    pub fn state(&self) -> &SheetState {
        &self.built.state
    }

    /// What the user should know: repairs to the mesh, an unstable forced step.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Value of a probe so far.
    pub fn probe(&self, name: &str) -> Option<f64> {
        let (_, measure) = self.measures.iter().find(|(known, _)| known == name)?;
        Some(measure.value(&self.built))
    }

    /// Simulates one frame.
    pub fn advance_frame(&mut self) -> Result<(), Error> {
        let start = Instant::now();
        let frame_time = 1.0 / self.scene.time.fps;
        let heat_before = self.built.state.books.heat_of_flames[0];
        if !self.lay_out() {
            self.look_around();
        }
        if self.scene.wind.updraught {
            self.plume = Plume::of(&self.built.state, self.built.up);
        }
        let longest = {
            let now = self.now();
            let by_effects = self.effects.iter().map(|e| e.longest_step(&now)).fold(f64::INFINITY, f64::min);
            self.scene.time.step.0.min(by_effects)
        };
        // A hair over a whole number of steps is rounding.
        let steps = (frame_time / longest - 1e-9).ceil().max(1.0);
        for _ in 0..steps as u64 {
            self.step(frame_time / steps);
        }
        self.burn_through();
        // Sums of steps drift in the last digits; the clock does not.
        let books = &mut self.built.state.books;
        books.frame[0] += 1;
        books.power_of_flames[0] = (books.heat_of_flames[0] - heat_before) / frame_time;
        books.time[0] = f64::from(books.frame[0]) * frame_time;
        if self.meets {
            let Self { built: Built { state, .. }, integrator, stages, topology, .. } = self;
            // Boxes of what is not finite overlap nothing; the books tell of it below.
            let crossings = stages.time("audit", || integrator.crossings(state, *topology)).unwrap_or(0) as u32;
            state.books.crossings_max[0] = state.books.crossings_max[0].max(crossings);
        }
        let result = ledger::check_finite(&self.built.state, |field| self.likeliest_cause(field));
        self.wall += start.elapsed().as_secs_f64();
        result
    }

    /// One step of heat, fuel and motion.
    fn step(&mut self, dt: f64) {
        self.lay_out();
        if self.scene.mechanics.moves {
            let state = &self.built.state;
            self.scratch.normal = node_normals(&state.motion.position, &state.triangles);
        }
        // 1. Heat, fuel and gas, in as many parts as they need.
        match self.scene.model {
            Model::Moidu2004 => self.burn(dt),
            Model::Physical => self.burn_physically(dt),
        }
        if self.scene.mechanics.moves {
            // 2. Burnt sheet is weaker, and hot sheet pulls together.
            self.weaken();
            // 3. Forces from outside, held for the step.
            self.add_forces();
            // 4. Motion, in substeps: springs need far shorter steps than heat.
            self.follow(dt);
            let Self { built: Built { state, guide, .. }, integrator, scratch, stages, scene, topology, .. } = self;
            let Scratch { factors, forces, .. } = scratch;
            let (unit, parallel) = (self.unit, self.parallel);
            let led = guide.as_ref().is_some_and(Guide::is_exact);
            let step = Step { factors, forces, dt, substeps: scene.time.substeps, topology: *topology, unit, parallel };
            if !led {
                self.last = stages.time("motion", || integrator.advance(state, &step));
                if let (Some(flow), Some(shell), false) = (&self.flow, integrator.shell(), self.last.stalled) {
                    stages.time("flow", || flow.advance(state, shell, factors));
                }
            }
            for (sum, new) in self.iterations.iter_mut().zip(self.last.iterations) {
                *sum += u64::from(new);
            }
            let books = &mut self.built.state.books;
            books.passed_through[0] += self.last.passed_through as u32;
            books.strain_max[0] = books.strain_max[0].max(self.last.strain_max);
            if let Some(shed) = &self.shed {
                let SheetState { particles, books, .. } = &mut self.built.state;
                let plume = &self.plume;
                self.stages.time("particles", || shed.advance(particles, plume, books.time[0], dt));
            }
            // 5. Where springs have given way, the sheet comes apart.
            let changed = self.stages.time("tear", || tear::split(&mut self.built.state));
            // The shell knows nothing of what has just come off, and tensions of a step that is not solved are none.
            if changed || self.last.broken > 0 || (!self.last.stalled && self.crack()) {
                self.topology += 1;
            }
            self.warn_if_unstable();
        }
        self.built.state.books.time[0] += dt;
        self.last_step = dt;
        // 6. Those who measure have a look.
        let Self { built, measures, .. } = self;
        for (_, measure) in measures {
            measure.observe(built);
        }
    }

    /// Takes a sheet that is animated already along: all of it, or what is held, with a pull on the rest.
    fn follow(&mut self, dt: f64) {
        let Self { built: Built { state, guide: Some(guide), .. }, scratch, topology, .. } = self else { return };
        let time = state.books.time[0];
        if guide.is_exact() {
            guide.place(state, time + dt);
        } else {
            guide.lead(state, time + dt);
            guide.pull(state, &mut scratch.forces, [time, dt], *topology);
        }
    }

    /// Parts the sheet where it is pulled harder than it bears. Returns whether it has.
    fn crack(&mut self) -> bool {
        let Self { built: Built { state, .. }, integrator, cracks, scratch, topology, stages, .. } = self;
        let (Some(cracks), Some(shell)) = (cracks, integrator.shell()) else { return false };
        stages.time("crack", || cracks.advance(state, shell, &scratch.factors, *topology))
    }

    /// Lays out what follows from the topology, if that has changed.
    fn lay_out(&mut self) -> bool {
        if self.laid_out == Some(self.topology) {
            return false;
        }
        let Self { built: Built { state, .. }, scratch, scene, .. } = self;
        scratch.map.lay_out(state);
        self.laid_out = Some(self.topology);
        scratch.area.clear();
        scratch.area.resize(state.motion.len(), 0.0);
        for t in 0..state.triangles.len() {
            if state.triangles.alive[t] != 0 {
                for i in state.triangles.corners[t] {
                    scratch.area[i as usize] += state.triangles.rest_area[t] / 3.0;
                }
            }
        }
        scratch.normal = node_normals(&state.motion.position, &state.triangles);
        scratch.burn_position.clear();
        scratch.shown = true;
        match &mut self.physical {
            Some(physical) => {
                physical.lay_out(state);
                self.look_around();
            }
            None => {
                let edges = &state.burn_edges;
                scratch.heat_links = Links::build(state.burn.len(), &edges.ends, |e| edges.cut[e] != 0);
                conductances(state, &scratch.heat_links, scene.fire.distance, &mut scratch.conductance);
                self.sum_conductances();
            }
        }
        true
    }

    /// Finds what lies close before the faces of sheets that touch things.
    fn look_around(&mut self) {
        let Self { built: Built { state, .. }, physical: Some(physical), scratch, stages, meets: true, .. } = self
        else {
            return;
        };
        stages.time("nearby", || {
            let place = |i| scratch.map.interpolate(&state.triangles, &state.motion.position, i);
            let position: Vec<DVec3> = (0..state.burn.len()).map(place).collect();
            let normal = if state.has_fine_burn_mesh() {
                fine_normals(&position, &state.burn_triangles)
            } else {
                node_normals(&state.motion.position, &state.triangles)
            };
            physical.look_around(state, &scratch.map, [&position, &normal], state.books.time[0]);
        });
    }

    fn now(&self) -> Now<'_> {
        Now {
            state: &self.built.state,
            normal: &self.scratch.normal,
            area: &self.scratch.area,
            heat_links: &self.scratch.heat_links,
            conductance: &self.scratch.conductance,
            time: self.time(),
            plume: &self.plume,
            up: self.built.up,
            unit: self.unit,
            parallel: self.parallel,
        }
    }

    fn weaken(&mut self) {
        let start = Instant::now();
        let mut factors = std::mem::take(&mut self.scratch.factors);
        let residual = self.scene.mechanics.residual_stiffness.0;
        // The physical model shows motion what has burnt once a frame.
        let fresh = std::mem::take(&mut self.scratch.shown) || self.physical.is_none();
        if fresh {
            homogenise::carry_mass(&mut self.built.state, &self.scratch.map);
        }
        let burnt_through = homogenise::factors(&mut self.built.state, residual, fresh, &mut factors);
        if burnt_through {
            self.topology += 1;
        }
        if let Some(physical) = &self.physical {
            physical.shrink(&self.built.state, &mut factors);
        }
        let now = self.now();
        for effect in &self.effects {
            effect.add_tension(&now, &mut factors);
        }
        self.scratch.factors = factors;
        self.stages.add("weaken", start);
    }

    fn add_forces(&mut self) {
        let start = Instant::now();
        let state = &self.built.state;
        let mut forces = std::mem::take(&mut self.scratch.forces);
        let count = state.motion.len();
        forces.clear(count);
        let now = self.now();
        for effect in &self.effects {
            effect.add_forces(&now, &mut forces);
        }
        self.scratch.forces = forces;
        self.stages.add("forces", start);
    }

    /// The time-history row of the frame reached.
    pub fn history(&self) -> Vec<Sample> {
        measure::history(&self.built, &self.burning, &self.flames.first().map_or(Vec::new(), |f| f.nodes.clone()))
    }

    /// Hands frame 0 (unless resumed) and all frames up to `last` to a sink.
    pub fn run(&mut self, last: u32, sink: &mut dyn Sink) -> Result<(), Error> {
        // A resumed run has handed over the frame it goes on from.
        let mut hand_over = self.frame_number() == 0 && !self.resumed;
        loop {
            if hand_over && sink.frame(&self.frame(), &self.history(), &self.built.state)?.is_break() {
                break;
            }
            if self.frame_number() >= last {
                break;
            }
            self.advance_frame()?;
            hand_over = true;
        }
        sink.finish()
    }
}
