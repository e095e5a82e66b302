//! The step, and the run around it.

mod summary;

pub use summary::Summary;

use crate::build::{self, Built};
use crate::burn_mesh::BurnMap;
use crate::contact::scenery::Scenery;
use crate::counters::Stages;
use crate::crack::Cracks;
use crate::effects::conduction::conductances;
use crate::effects::{self, Effect, Forces, HeatRates, Now, SpringFactors};
use crate::error::Error;
use crate::flow::Flow;
use crate::frame::{Frame, Sample, Sink, fine_normals, node_normals};
use crate::homogenise;
use crate::integrators::{Advanced, INTEGRATORS, Integrator, MEETS, Step};
use crate::kernels::heat::ConductanceRow;
use crate::kernels::{Links, VectorUnit};
use crate::ledger;
use crate::material::Material;
use crate::measure::{self, Probes};
use crate::mesh::SurfaceMesh;
use crate::motion::{Guide, MeshSequence};
use crate::particles::Shed;
use crate::physical::Physical;
use crate::plume::Plume;
use crate::registry;
use crate::scene::{Model, Scene};
use crate::select;
use crate::sheet::SheetState;
use crate::tear;
use crate::thermo::{Burning, Moment};
use glam::DVec3;
use std::collections::BTreeMap;
use std::time::Instant;

/// A grey picture, values 0 to 1, row by row from the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GreyImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values, 0 black to 1 white.
    pub values: Vec<f32>,
}

/// What a scene names but does not hold: meshes and pictures, already read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inputs {
    /// The mesh that `sheet.mesh` names.
    pub mesh: Option<SurfaceMesh>,
    /// The mesh that `sheet.rest_mesh` names.
    pub rest_mesh: Option<SurfaceMesh>,
    /// The meshes that `motion.files` names, their points in the order of those of `mesh`.
    pub motion: Option<MeshSequence>,
    /// Meshes of obstacles by the path the scene gives.
    pub obstacles: BTreeMap<String, SurfaceMesh>,
    /// How obstacles are animated, by the files the scene gives.
    pub obstacle_motions: BTreeMap<String, MeshSequence>,
    /// Pictures by the path the scene gives.
    pub images: BTreeMap<String, GreyImage>,
    /// The material that `sheet.material` names, for the physical model.
    pub material: Option<Material>,
}

/// Builds the physical model of a scene.
fn physical(scene: &Scene, inputs: &Inputs, built: &mut Built, flames: &[Flame]) -> Result<Physical, Error> {
    let name = &scene.sheet.material;
    let material = inputs.material.as_ref().ok_or_else(|| {
        Error::scene("sheet.material", format!("{name} was not read"), "hand it over in Inputs::material")
    })?;
    let heaters = scene.heater.iter().enumerate().map(|(row, heater)| select::heated(built, heater, row));
    let heaters = heaters.collect::<Result<_, Error>>()?;
    let pilots = flames.iter().map(|flame| (flame.nodes.clone(), flame.delay.clone())).collect();
    Physical::build(scene, material, built, pilots, heaters)
}

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
    /// Builds a scene: the state at frame 0.
    pub fn build(scene: &Scene, inputs: &Inputs) -> Result<Self, Error> {
        let mut built = build::sheet(scene, inputs)?;
        for (row, pin) in scene.pin.iter().enumerate() {
            for node in select::pinned(&built, pin, row)? {
                built.state.motion.pinned[node as usize] = 1;
            }
        }
        let mut flames = Vec::new();
        for (row, ignite) in scene.ignite.iter().enumerate() {
            let nodes = select::ignited(&built, inputs, ignite, row)?;
            flames.push(Flame {
                delay: select::delays(&built, inputs, ignite, row, &nodes)?,
                nodes,
                start: ignite.start.0,
                end: ignite.start.0 + ignite.length.0,
                temperature: ignite.temperature.0,
            });
        }
        measure::set_initial(scene, &mut built)?;
        let burning = Burning::of(scene);
        let mut physical = match scene.model {
            Model::Moidu2004 => None,
            Model::Physical => Some(physical(scene, inputs, &mut built, &flames)?),
        };
        let cracks = match &inputs.material {
            Some(material) if physical.is_some() && scene.crack.enabled && scene.mechanics.moves => {
                Some(Cracks::of(scene, material, &built.state.burn))
            }
            _ => None,
        };
        let flow = match &inputs.material {
            Some(material) if physical.is_some() && scene.mechanics.moves => Some(Flow::of(scene, material)),
            _ => None,
        };
        let state = &mut built.state;
        let heat =
            physical.as_ref().map_or_else(|| burning.heat_content(&state.burn), |model| model.heat_content(state));
        state.books.heat_initial[0] = heat;
        built.state.books.momentum_initial[0] = measure::momentum(&built.state);
        let integrator = registry::find(INTEGRATORS, &scene.mechanics.integrator, "mechanics.integrator")?;
        if integrator.name == "implicit" && scene.mechanics.moves && built.state.triangles.is_empty() {
            return Err(Error::scene(
                "mechanics.integrator",
                "a shell needs a surface, and a chain has none",
                "use sheet.shape = \"unstructured\" or \"grid\", or the integrator symplectic_euler",
            ));
        }
        let scenery = Scenery::of(scene, inputs)?;
        let meets = scene.mechanics.moves && (!scenery.is_empty() || scene.contact.self_contact == Some(true));
        if meets && !MEETS.contains(&integrator.name) {
            return Err(Error::scene(
                "mechanics.integrator",
                format!("{} does not know contact, and the scene has obstacles or self-contact", integrator.name),
                format!("use the integrator {}, or take them out", MEETS.join(" or ")),
            ));
        }
        let sheds = physical.is_some() && scene.mechanics.moves && !built.state.triangles.is_empty();
        let mut shed = sheds.then(|| Shed::of(scene, built.up, &scenery));
        if let Some(shed) = &mut shed {
            shed.measure(&mut built.state);
        }
        let mut mover = (integrator.item)(scene);
        if let Some(physical) = &mut physical {
            physical.meet(&scenery.planes);
        }
        mover.meet(scenery);
        if meets && mover.crossings(&built.state, 0).is_some_and(|pairs| pairs > 0) {
            return Err(Error::scene(
                if scene.obstacle.is_empty() { "sheet" } else { "obstacle" },
                "the sheet crosses itself or an obstacle at the start, and contact cannot undo that",
                "move the sheet or the obstacle (sheet.position, obstacle.position), or set contact.self_contact = false",
            ));
        }
        let mut simulation = Self {
            effects: effects::of_scene(scene),
            integrator: mover,
            meets,
            measures: measure::of_scene(scene, &built)?,
            warnings: built.remarks.clone(),
            scene: scene.clone(),
            built,
            burning,
            physical,
            flow,
            cracks,
            shed,
            plume: Plume::default(),
            flames,
            scratch: Scratch::default(),
            topology: 0,
            laid_out: None,
            stages: Stages::default(),
            wall: 0.0,
            resumed: false,
            last: Advanced::default(),
            iterations: [0; 2],
            last_step: 0.0,
            unit: VectorUnit::best(),
            parallel: rayon::current_num_threads() > 1,
        };
        simulation.warn_if_too_light();
        Ok(simulation)
    }

    /// Builds a scene and puts it into a state saved earlier; the run goes on with the same bits.
    pub fn resume(scene: &Scene, inputs: &Inputs, state: SheetState) -> Result<Self, Error> {
        let mut simulation = Self::build(scene, inputs)?;
        let built = &simulation.built.state;
        if state.books.len() != 1 || state.motion.len() < built.motion.len() {
            return Err(Error::Resume(format!(
                "the saved state has {} nodes, the scene {}: it is of another scene",
                state.motion.len(),
                built.motion.len()
            )));
        }
        let same = [
            state.triangles.len() == built.triangles.len(),
            state.springs.len() == built.springs.len(),
            state.burn_triangles.len() == built.burn_triangles.len(),
        ];
        if same.contains(&false) {
            return Err(Error::Resume("the saved state has other triangles or springs than the scene".to_owned()));
        }
        simulation.built.state = state;
        // What has been laid out for the state as built is stale.
        simulation.topology += 1;
        simulation.resumed = true;
        Ok(simulation)
    }

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

    /// Heat and fuel of the 2004 model, in as many parts as heat needs to bring no new extremes.
    fn burn(&mut self, dt: f64) {
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
    fn burn_physically(&mut self, dt: f64) {
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

    /// Brings what pictures and mechanics see of burning up to date, and takes what has burnt through out of a finer burn
    /// mesh. Once a frame will do: only pictures tell a triangle without fuel from none.
    fn burn_through(&mut self) {
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

    /// Conductance that leads to each node, for the length of heat steps.
    fn sum_conductances(&mut self) {
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

    /// Longest heat step that brings no new extremes [s].
    fn longest_heat_step(&mut self) -> f64 {
        if self.scene.fire.distance == crate::scene::ConductionDistance::Current {
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

    fn warn_once(&mut self, warning: String, about: &str) {
        if !self.warnings.iter().any(|known| known.starts_with(about)) {
            self.warnings.push(warning);
        }
    }

    fn warn_if_unstable(&mut self) {
        if self.last.stalled {
            let about = "time.step: motion is not solved to its tolerance";
            let message = format!("{about} (first at {:.4} s); shorten time.step", self.time());
            self.warn_once(message, about);
        }
        if self.last.courant > 1.0 {
            let about = "time.substeps: the forced substep is unstable";
            let message = format!(
                "{about}: it is {:.2} times the longest stable one (first at {:.4} s); leave substeps out, or ask for {} \
                 and more",
                self.last.courant,
                self.time(),
                (f64::from(self.last.substeps) * self.last.courant).ceil()
            );
            self.warn_once(message, about);
        }
    }

    fn warn_if_too_light(&mut self) {
        if self.scene.mechanics.moves && self.scene.mechanics.inert_fraction.0 <= 0.0 {
            let about = "mechanics.inert_fraction: at 0 a burnt node has no mass and no step is stable";
            self.warn_once(format!("{about}; 0.1 is the default"), about);
        }
    }

    fn likeliest_cause(&self, field: &str) -> String {
        let unstable = self.last.courant > 1.0;
        match field {
            "position" | "velocity" if unstable => format!(
                "time.substeps forces a substep {:.1} times the longest stable one; leave it out",
                self.last.courant
            ),
            "position" | "velocity" => {
                "forces too strong for the sheet: lower curl.pressure, thermal_force.contraction or the wind, or shorten \
                 time.step"
                    .to_owned()
            }
            "temperature" | "peak_temperature" => {
                "heat of combustion too large for the heat capacity: check fire.heat_of_combustion and \
                 fire.heat_capacity"
                    .to_owned()
            }
            _ => "a value of the scene out of all proportion".to_owned(),
        }
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
