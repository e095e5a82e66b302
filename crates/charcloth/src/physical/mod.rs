//! The physical model: two faces of sheet, their chemistry, and the gas around them.
//!
//! Model: each burn node has two half-layers (`FaceNodes`), each with one temperature and its masses; they exchange heat
//! through the thickness, and along the sheet by conduction with the grain (Eq. 15.1 to 15.3); the gas says what each
//! face gets (docs/physics.md, section 14), the chemistry what becomes of it (section 13). No speed of spread enters.
//! Sources: with the equations. Valid when: the sheet is thin (Biot number of the half-layer under 0.2). Cost: a
//! microsecond a burning node and step; nodes at rest are not looked at (`awake.rs`).

mod awake;
mod balance;
mod board;
mod conduction;
mod layout;
mod nearby;
mod show;
mod shrinkage;

use crate::build::Built;
use crate::burn_mesh::BurnMap;
use crate::chemistry::{Chemistry, Layer, Released, Room, Surroundings};
use crate::contact::scenery::Plane;
use crate::effects::wind::Air;
use crate::error::Error;
use crate::gases::{self, FACES, FaceExchange, FaceView, Gas, GasState, SheetView};
use crate::material::Material;
use crate::registry;
use crate::scene::{Backing, Edges, Scene};
use crate::sheet::{BoardNodes, Books, FaceNodes, SheetState};
use crate::substances::{Masses, Substance};
use awake::Awake;
use board::Board;
use conduction::Conduction;
use glam::DVec3;
use layout::Layout;
use nearby::Nearby;
use rayon::prelude::*;
use shrinkage::Shrinkage;
use std::ops::Range;

/// A half-layer whose temperature is so close to the room's that it is taken to be there [K].
// tuned: far under what any reaction or picture tells, 1e-9 to 1e-3
const ASLEEP: f64 = 1e-6;

/// Nodes that one thread works on at a time.
const CHUNK: usize = 128;

/// What must not burn warms to this and refuses further heat [K]: paper begins to brown above.
// tuned: under where cellulose loses mass or stiffness within minutes; 400 to 450 K
const REFUSES_HEAT: f64 = 423.15;

/// A radiant heater over part of the sheet.
struct Heater {
    nodes: Vec<u32>,
    /// When it shines [s].
    spell: Range<f64>,
    face: usize,
    /// What the sheet absorbs [W/m2].
    flux: f64,
}

/// A flame held to some nodes for a while.
struct Pilot {
    nodes: Vec<u32>,
    /// How much later it is held to each of them [s]; empty for nought.
    delay: Vec<f64>,
    /// When it is held [s].
    spell: Range<f64>,
}

impl Pilot {
    /// Nodes that it is held to at a time [s].
    fn held(&self, time: f64) -> impl Iterator<Item = u32> + '_ {
        let begun = self.spell.start <= time && (!self.delay.is_empty() || time < self.spell.end);
        let late = move |k: usize| self.delay.get(k).copied().unwrap_or(0.0);
        let nodes = if begun { self.nodes.as_slice() } else { &[] };
        let now = move |(k, _): &(usize, &u32)| self.spell.contains(&(time - late(*k)));
        nodes.iter().enumerate().filter(now).map(|(_, i)| *i)
    }
}

/// What a burning node works on during a step.
#[derive(Clone, Copy)]
struct Work {
    node: u32,
    layers: [Layer; FACES],
    around: [Surroundings; FACES],
    released: [Released; FACES],
    /// Conductance through the thickness [W/K].
    through: f64,
    /// Whether it must not burn.
    noburn: bool,
    /// Heat conducted to it along the sheet [W].
    conducted: f64,
    area: f64,
    /// Temperatures of the board behind it [K], and what it took [J].
    board: [f64; board::LAYERS],
    to_board: f64,
}

/// The model of a scene, and its buffers.
pub struct Physical {
    chemistry: Chemistry,
    gas: Box<dyn Gas>,
    room: gases::Surroundings,
    air: Air,
    emissivity: f64,
    heat_of_combustion: f64,
    oxygen_demand: f64,
    /// Conductance through the thickness over the area of a node [W/(m2 K)].
    through: f64,
    shrinkage: Shrinkage,
    /// Water of the sheet in its room [kg per kg of dry sheet].
    water: f64,
    /// Stiffness of char over that of the sheet.
    char_stiffness: f64,
    /// Char that the fibre of a dry sheet may leave, per dry mass [kg/kg].
    char_yield: f64,
    /// Fibre and polymer of a dry sheet [kg/kg].
    burns: f64,
    backing: Backing,
    board: Option<Board>,
    heaters: Vec<Heater>,
    pilots: Vec<Pilot>,
    layout: Layout,
    conduction: Conduction,
    open: [Vec<f64>; FACES],
    pilot: [Vec<f64>; FACES],
    heater: [Vec<f64>; FACES],
    volatile_flux: [Vec<f64>; FACES],
    gas_flux: [Vec<f64>; FACES],
    exchange: FaceExchange,
    nearby: Nearby,
    awake: Awake,
    /// Heat conducted along the sheet into each node that is awake [W].
    conducted: Vec<f64>,
    work: Vec<Work>,
    /// Nodes to show.
    shown: Vec<u32>,
}

fn masses(face: &FaceNodes, i: usize) -> Masses {
    let mut masses = [0.0; crate::substances::SUBSTANCES];
    for (substance, column) in [
        (Substance::Water, &face.water),
        (Substance::Fibre, &face.fibre),
        (Substance::Polymer, &face.polymer),
        (Substance::YoungChar, &face.young_char),
        (Substance::Char, &face.char),
        (Substance::Filler, &face.filler),
        (Substance::Ash, &face.ash),
    ] {
        masses[substance as usize] = column[i];
    }
    masses
}

fn set_masses(face: &mut FaceNodes, i: usize, masses: &Masses) {
    for (substance, column) in [
        (Substance::Water, &mut face.water),
        (Substance::Fibre, &mut face.fibre),
        (Substance::Polymer, &mut face.polymer),
        (Substance::YoungChar, &mut face.young_char),
        (Substance::Char, &mut face.char),
        (Substance::Filler, &mut face.filler),
        (Substance::Ash, &mut face.ash),
    ] {
        column[i] = masses[substance as usize];
    }
}

fn layer(face: &FaceNodes, i: usize) -> Layer {
    Layer { masses: masses(face, i), temperature: face.temperature[i], dry_mass: face.dry_mass[i] }
}

impl Physical {
    /// Builds the model, and fills in the faces of a sheet at rest in its room. `pilots` are the nodes of each flame that
    /// is held to it, with their delays [s], `heaters` those of each heater.
    pub fn build(
        scene: &Scene,
        material: &Material,
        built: &mut Built,
        pilots: Vec<(Vec<u32>, Vec<f64>)>,
        heaters: Vec<Vec<u32>>,
    ) -> Result<Self, Error> {
        let room = Room { temperature: scene.fire.ambient_temperature.0, relative_humidity: scene.fire.humidity.0 };
        let data = material.chemistry()?;
        let mut chemistry =
            Chemistry::build(&data, room).map_err(|problem| Error::scene("sheet.material", problem, "see its file"))?;
        // tuned: heat is held over a step to some per mille; 2e-5 to 1e-3
        chemistry.tolerance = 2e-4;
        let (heat_of_combustion, oxygen_demand) = chemistry.volatiles().unwrap_or((0.0, 1.0));
        let gas = registry::find(gases::GASES, &scene.fire.gas, "fire.gas")?;
        let composition = chemistry.composition();
        let burns = composition[Substance::Fibre as usize] + composition[Substance::Polymer as usize];
        let mut physical = Self {
            gas: (gas.item)(),
            room: gases::Surroundings {
                temperature: room.temperature,
                oxygen: scene.fire.oxygen.0,
                pressure: scene.fire.pressure.0,
                gravity: -built.up * scene.gravity.0,
                wind: DVec3::ZERO,
            },
            air: Air::of(scene),
            emissivity: material.thermal.emissivity.value.0,
            heat_of_combustion,
            oxygen_demand,
            // From the middle of one half-layer to that of the other.
            through: material.thermal.conductivity_through.value.0 / (0.5 * scene.shell.thickness.0),
            shrinkage: Shrinkage::of(material, scene.shell.thickness.0),
            water: composition[Substance::Water as usize],
            char_stiffness: material.mechanics.char_stiffness.value.0,
            char_yield: material.char_yield(),
            burns,
            backing: scene.sheet.backing,
            board: (scene.sheet.backing == Backing::Board)
                .then(|| Board::of(&scene.sheet.board, gases::properties::conductivity(room.temperature))),
            heaters: Vec::new(),
            pilots: Vec::new(),
            layout: Layout::default(),
            conduction: Conduction::default(),
            open: Default::default(),
            pilot: Default::default(),
            heater: Default::default(),
            volatile_flux: Default::default(),
            gas_flux: Default::default(),
            exchange: FaceExchange::default(),
            nearby: Nearby::default(),
            awake: Awake::default(),
            conducted: Vec::new(),
            work: Vec::new(),
            shown: Vec::new(),
            chemistry,
        };
        for (row, nodes) in scene.heater.iter().zip(heaters) {
            let absorbed = material.thermal.absorptivity.value.0 * row.flux.0;
            let spell = row.start.0..row.start.0 + row.length.0;
            physical.heaters.push(Heater { nodes, spell, face: usize::from(row.face as u8), flux: absorbed });
        }
        for (row, (nodes, delay)) in scene.ignite.iter().zip(pilots) {
            physical.pilots.push(Pilot { nodes, delay, spell: row.start.0..row.start.0 + row.length.0 });
        }
        let machine = scene.shell.thickness.0 * material.thermal.conductivity_machine.value.0;
        let cross = scene.shell.thickness.0 * material.thermal.conductivity_cross.value.0;
        physical.conduction.sheet_conductance = [machine, cross];
        physical.fill(&mut built.state, &built.moisture, scene.sheet.edges == Edges::Framed);
        Ok(physical)
    }

    /// The sheet in balance with the room, but for what painted `moisture` gives each node; empty for 1.
    fn fill(&mut self, state: &mut SheetState, moisture: &[f64], framed: bool) {
        let count = state.burn.len();
        let wet: f64 = self.chemistry.composition().iter().sum();
        let edges = layout::free_edges(state);
        let room = self.room.temperature;
        let film = GasState::still(1, &self.room);
        for face in 0..FACES {
            let mut nodes = FaceNodes::zeros(count);
            for i in 0..count {
                // `fuel_initial` is grammage times area times formation, moisture and filler and all.
                let dry_mass = 0.5 * state.burn.fuel_initial[i] / wet;
                let mut layer = self.chemistry.layer(dry_mass);
                layer.masses[Substance::Water as usize] *= moisture.get(i).copied().unwrap_or(1.0);
                nodes.dry_mass[i] = dry_mass;
                nodes.temperature[i] = room;
                set_masses(&mut nodes, i, &layer.masses);
                nodes.film_temperature[i] = film.temperature[face][0];
                let [length, distance] =
                    if framed { [0.0, layout::NOWHERE] } else { [edges.length[i], edges.distance[i]] };
                nodes.edge_length[i] = length;
                nodes.edge_distance[i] = distance;
            }
            *(if face == 0 { &mut state.front } else { &mut state.back }) = nodes;
        }
        if self.board.is_some() {
            state.board = BoardNodes::zeros(count);
            (0..count).for_each(|i| board::set_layers(&mut state.board, i, &[room; board::LAYERS]));
        }
        for i in 0..count {
            state.burn.fuel_initial[i] = self.fuel(state, i);
            // No rate is the full one here.
            state.burn.burn_rate_full[i] = 0.0;
        }
        self.show(state, true);
        state.books.mass_initial[0] = state.burn.mass.iter().sum();
        state.motion.inert_mass.fill(0.0);
    }

    /// What can still burn at a node [kg].
    fn fuel(&self, state: &SheetState, i: usize) -> f64 {
        let of = |face: &FaceNodes| face.fibre[i] + face.polymer[i] + face.young_char[i] + face.char[i];
        of(&state.front) + of(&state.back)
    }

    /// Longest step [s]: no new extremes by conduction, and a front that moves less than the film is thick.
    pub fn longest_step(&self) -> f64 {
        self.conduction.longest_step().min(5e-3) // tuned: fronts move under half a millimetre; 1 to 5 ms
    }

    /// Lays out what follows from the topology.
    pub fn lay_out(&mut self, state: &SheetState) {
        self.layout.build(state);
        self.conduction.build(state, &self.layout, &self.chemistry);
        let count = state.burn.len();
        self.uncover(count);
        for face in 0..FACES {
            for column in [&mut self.pilot, &mut self.heater, &mut self.volatile_flux, &mut self.gas_flux] {
                column[face].clear();
                column[face].resize(count, 0.0);
            }
        }
        self.awake.lose(count);
    }

    /// Lets air reach all of each face, but what a board lies behind.
    fn uncover(&mut self, count: usize) {
        let closed_back = self.backing != Backing::None;
        for (face, open) in self.open.iter_mut().enumerate() {
            open.clear();
            open.resize(count, if face == 1 && closed_back { 0.0 } else { 1.0 });
        }
    }

    /// Gives it the planes that the sheet may lie on.
    pub fn meet(&mut self, planes: &[Plane]) {
        self.nearby.meet(planes);
    }

    /// Finds what lies close before each face (Eq. 15.10), at a time [s], with burn nodes at these places and with these
    /// normals.
    pub fn look_around(&mut self, state: &SheetState, map: &BurnMap, placed: [&[DVec3]; 2], time: f64) {
        self.uncover(state.burn.len());
        self.nearby.look(state, map, placed, time, &mut self.open);
    }

    /// Looks after every node in every step, or after those alone where something happens; the bits are the same.
    pub fn keep_all_awake(&mut self, all: bool) {
        self.awake.all = all;
        self.awake.lose(self.layout.start.len().saturating_sub(1));
    }

    /// Finds the nodes where something happens in a step from a time on [s]. To be called before each step.
    pub fn wake(&mut self, state: &SheetState, time: f64) {
        self.hold(time);
        let SheetState { front, back, .. } = state;
        let room = self.room.temperature;
        self.nearby.wake([&front.temperature, &back.temperature], room);
        let stirs = |i: usize| {
            self.nearby.stirs(i)
                || [front, back].into_iter().enumerate().any(|(face, nodes)| {
                    nodes.temperature[i] != room
                        || nodes.film_temperature[i] != room
                        || nodes.volatile_rate[i] != 0.0
                        || nodes.film_fuel[i] != 0.0
                        || nodes.film_run[i] != 0.0
                        || self.pilot[face][i] != 0.0
                        || self.heater[face][i] != 0.0
                })
        };
        let pilots = self.pilots.iter().flat_map(|pilot| pilot.held(time));
        let heaters = self.heaters.iter().filter(|heater| heater.spell.contains(&time));
        let held = pilots.chain(heaters.flat_map(|heater| heater.nodes.iter().copied()));
        let held = held.chain(self.nearby.reached.iter().copied());
        self.awake.find(&self.layout, stirs, held.map(|i| i as usize));
        // What sleeps has no flame.
        for i in &self.awake.fallen_asleep {
            for face in 0..FACES {
                for column in [&mut self.exchange.flame[face], &mut self.exchange.flame_height[face]] {
                    column[*i as usize] = 0.0;
                }
            }
        }
    }

    /// Nodes that are awake, and the same with their neighbours.
    pub fn awake(&mut self) -> [&[u32]; 2] {
        self.awake.find_near(&self.layout);
        [&self.awake.nodes, &self.awake.near]
    }

    /// Advances heat, chemistry and gas by a step from a time on [s], with burn nodes at these places and with these
    /// normals: those that are awake, and places of their neighbours.
    pub fn advance(&mut self, state: &mut SheetState, position: &[DVec3], normal: &[DVec3], time: f64, dt: f64) {
        self.room.wind = self.air.velocity(time);
        self.ask_gas(state, position, normal, dt);
        self.conduction.conduct(&state.burn.temperature, &self.layout, &self.awake.nodes, &mut self.conducted);
        let SheetState { burn, front, back, .. } = &*state;
        let temperature = [front.temperature.as_slice(), &back.temperature];
        let faces = [front, back];
        let capacity =
            |face: usize, i: usize| self.chemistry.heat_capacity(&masses(faces[face], i), faces[face].temperature[i]);
        self.nearby.trade(temperature, capacity, &burn.area, [self.emissivity, self.room.temperature, dt]);
        self.gather(state);
        let (chemistry, board) = (&self.chemistry, self.board.as_ref());
        let of_chunk = |chunk: &mut [Work]| chunk.iter_mut().for_each(|work| work.advance(chemistry, board, dt));
        self.work.par_chunks_mut(CHUNK).for_each(of_chunk);
        self.scatter(state, time, dt);
    }

    /// Marks what flames and heaters reach.
    fn hold(&mut self, time: f64) {
        for face in 0..FACES {
            for pilot in &self.pilots {
                pilot.nodes.iter().for_each(|i| self.pilot[face][*i as usize] = 0.0);
            }
        }
        for i in self.pilots.iter().flat_map(|pilot| pilot.held(time)) {
            self.pilot.iter_mut().for_each(|column| column[i as usize] = 1.0);
        }
        for heater in &self.heaters {
            heater.nodes.iter().for_each(|i| self.heater[heater.face][*i as usize] = 0.0);
        }
        for heater in self.heaters.iter().filter(|heater| heater.spell.contains(&time)) {
            heater.nodes.iter().for_each(|i| self.heater[heater.face][*i as usize] += heater.flux);
        }
    }

    fn ask_gas(&mut self, state: &mut SheetState, position: &[DVec3], normal: &[DVec3], dt: f64) {
        let SheetState { burn, front, back, books, .. } = state;
        let faces = [&mut *front, &mut *back];
        for (face, nodes) in faces.iter().enumerate() {
            for i in &self.awake.nodes {
                let i = *i as usize;
                self.volatile_flux[face][i] = nodes.volatile_rate[i] / burn.area[i];
                self.gas_flux[face][i] = nodes.gas_rate[i] / burn.area[i];
            }
        }
        let [front, back] = faces;
        let mut film = GasState {
            temperature: [std::mem::take(&mut front.film_temperature), std::mem::take(&mut back.film_temperature)],
            fuel: [std::mem::take(&mut front.film_fuel), std::mem::take(&mut back.film_fuel)],
            run: [std::mem::take(&mut front.film_run), std::mem::take(&mut back.film_run)],
        };
        let Layout { start, to, length, width, .. } = &self.layout;
        let sheet = SheetView {
            awake: &self.awake.nodes,
            position,
            normal,
            area: &burn.area,
            link_start: start,
            link_to: to,
            link_length: length,
            link_width: width,
            edge_length: &front.edge_length,
            edge_distance: &front.edge_distance,
        };
        let view = FaceView {
            temperature: [&front.temperature, &back.temperature],
            volatile_flux: self.volatile_flux.each_ref().map(Vec::as_slice),
            gas_flux: self.gas_flux.each_ref().map(Vec::as_slice),
            open: self.open.each_ref().map(Vec::as_slice),
            pilot: self.pilot.each_ref().map(Vec::as_slice),
            emissivity: self.emissivity,
            heat_of_combustion: self.heat_of_combustion,
            oxygen_demand: self.oxygen_demand,
        };
        self.gas.advance(&sheet, &view, &self.room, dt, &mut film, &mut self.exchange);
        [front.film_temperature, back.film_temperature] = film.temperature;
        [front.film_fuel, back.film_fuel] = film.fuel;
        [front.film_run, back.film_run] = film.run;
        let gas = &self.exchange.books;
        books.heat_of_flames[0] += gas.heat_released * dt;
        books.heat_of_flames_lost[0] += gas.heat_to_surroundings * dt;
        books.volatiles_burnt[0] += gas.fuel_burnt * dt;
    }

    /// Collects the nodes that anything happens to: those that are not at the temperature of the room, or are being
    /// heated. For all others a step changes nothing.
    fn gather(&mut self, state: &SheetState) {
        let SheetState { burn, front, back, board, .. } = state;
        let faces = [front, back];
        let room = self.room.temperature;
        self.work.clear();
        for (i, conducted) in self.awake.nodes.iter().zip(&self.conducted) {
            let (i, conducted) = (*i as usize, *conducted);
            let heated = |face: usize| {
                faces[face].temperature[i] != room
                    || self.exchange.heat_flux[face][i] != 0.0
                    || self.heater[face][i] != 0.0
                    || self.nearby.heat(face, i) != 0.0
            };
            if !(heated(0) || heated(1) || conducted != 0.0) {
                continue;
            }
            let area = burn.area[i];
            let around = |face: usize| Surroundings {
                heat: area * (self.exchange.heat_flux[face][i] + self.heater[face][i])
                    + self.nearby.heat(face, i)
                    + 0.5 * conducted,
                heat_slope: area * self.exchange.heat_flux_slope[face][i],
                about: faces[face].temperature[i],
                oxygen_fraction: self.exchange.surface_oxygen[face][i],
                oxygen_supply: area * self.exchange.oxygen_supply[face][i],
            };
            self.work.push(Work {
                node: i as u32,
                layers: [layer(front, i), layer(back, i)],
                around: [around(0), around(1)],
                released: [Released::default(); FACES],
                through: self.through * area / burn.thickness[i],
                noburn: burn.noburn[i] != 0,
                conducted,
                area,
                board: if self.board.is_some() { board::layers(board, i) } else { Default::default() },
                to_board: 0.0,
            });
        }
    }

    fn scatter(&mut self, state: &mut SheetState, time: f64, dt: f64) {
        let SheetState { burn, front, back, board, books, .. } = state;
        let room = self.room.temperature;
        let mut sums = Released::default();
        let (mut heaters, mut conducted, mut to_board) = (0.0, 0.0, 0.0);
        for work in &mut self.work {
            let i = work.node as usize;
            let mut fuel_gas = 0.0;
            for (face, nodes) in [&mut *front, &mut *back].into_iter().enumerate() {
                let (layer, released) = (&mut work.layers[face], &mut work.released[face]);
                if (layer.temperature - room).abs() < ASLEEP {
                    // What little heat there is goes to the room.
                    let before = self.chemistry.sensible_heat(&layer.masses, layer.temperature);
                    layer.temperature = room;
                    released.heat_in += self.chemistry.sensible_heat(&layer.masses, room) - before;
                }
                nodes.temperature[i] = layer.temperature;
                set_masses(nodes, i, &layer.masses);
                nodes.volatile_rate[i] = released.volatiles / dt;
                nodes.gas_rate[i] = (released.volatiles + released.steam + released.oxides) / dt;
                heaters += self.heater[face][i] * burn.area[i] * dt;
                fuel_gas += released.volatiles;
                add(&mut sums, released);
            }
            conducted += work.conducted * dt;
            if self.board.is_some() {
                board::set_layers(board, i, &work.board);
                to_board += work.to_board;
            }
            let mean = 0.5 * (front.temperature[i] + back.temperature[i]);
            burn.temperature[i] = mean;
            burn.peak_temperature[i] = burn.peak_temperature[i].max(front.temperature[i]).max(back.temperature[i]);
            burn.burn_rate[i] = fuel_gas / dt;
            let flame = self.exchange.flame[0][i].max(self.exchange.flame[1][i]);
            if burn.ignited_at[i] < 0.0 && flame > 0.5 && fuel_gas > 0.0 {
                burn.ignited_at[i] = time;
            }
        }
        let Books { heat_from_gas, heat_from_heaters, heat_of_drying, heat_of_pyrolysis, .. } = books;
        heat_from_gas[0] += sums.heat_in - heaters - conducted;
        heat_from_heaters[0] += heaters;
        books.heat_to_board[0] += to_board;
        heat_of_drying[0] += sums.heat_of_drying;
        heat_of_pyrolysis[0] += sums.heat_of_pyrolysis;
        let Books { heat_of_oxidation, heat_carried, volatiles, steam, oxides, oxygen_taken, .. } = books;
        heat_of_oxidation[0] += sums.heat_of_oxidation;
        heat_carried[0] += sums.heat_carried;
        volatiles[0] += sums.volatiles;
        steam[0] += sums.steam;
        oxides[0] += sums.oxides;
        oxygen_taken[0] += sums.oxygen_taken;
        books.fuel_burnt[0] = books.volatiles[0] + books.oxides[0];
        books.heat_released[0] = books.heat_of_flames[0] + books.heat_of_oxidation[0];
    }
}

fn add(sums: &mut Released, released: &Released) {
    let Released { volatiles, steam, oxides, oxygen_taken, .. } = released;
    sums.volatiles += volatiles;
    sums.steam += steam;
    sums.oxides += oxides;
    sums.oxygen_taken += oxygen_taken;
    sums.heat_in += released.heat_in;
    sums.heat_of_drying += released.heat_of_drying;
    sums.heat_of_pyrolysis += released.heat_of_pyrolysis;
    sums.heat_of_oxidation += released.heat_of_oxidation;
    sums.heat_carried += released.heat_carried;
}

impl Work {
    /// Half of the exchange through the thickness, the chemistry of each face, the other half: second order in the step.
    fn advance(&mut self, chemistry: &Chemistry, board: Option<&Board>, dt: f64) {
        let [front, back] = &mut self.layers;
        if self.noburn {
            chemistry.exchange(front, back, self.through, dt);
            self.released[0] = chemistry.warm(front, &self.around[0], dt, REFUSES_HEAT);
            self.released[1] = chemistry.warm(back, &self.around[1], dt, REFUSES_HEAT);
        } else {
            chemistry.exchange(front, back, self.through, 0.5 * dt);
            self.released[0] = chemistry.advance(front, &self.around[0], dt);
            self.released[1] = chemistry.advance(back, &self.around[1], dt);
            chemistry.exchange(front, back, self.through, 0.5 * dt);
        }
        if let Some(board) = board {
            self.to_board = self.area * warm_board(chemistry, board, back, self.area, &mut self.board, dt);
        }
    }
}

/// A board takes heat from the half-layer that lies on it [J/m2].
fn warm_board(
    chemistry: &Chemistry,
    board: &Board,
    back: &mut Layer,
    area: f64,
    layers: &mut [f64; board::LAYERS],
    dt: f64,
) -> f64 {
    let capacity = chemistry.heat_capacity(&back.masses, back.temperature) / area;
    if capacity <= 0.0 {
        return 0.0;
    }
    let flow = board.advance(capacity, back.temperature, layers, dt);
    let heat = chemistry.sensible_heat(&back.masses, back.temperature) - flow * area;
    back.temperature = chemistry.temperature(&back.masses, heat);
    flow
}
