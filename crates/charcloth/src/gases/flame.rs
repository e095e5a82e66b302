//! Flames: a film of gas on each face that carries heat and fuel along the sheet, burns, and gives heat back.
//!
//! Model: Eq. 14.6 to 14.20, mean values over the thickness of the film, thin-fuel theory at its foot [DeRis1969]
//! [Delichatsios1986] and laminar natural convection along it [Ahmad1978] [Pagni1977]. No speed of spread enters. Valid
//! when: flames are laminar, burning lengths to about 0.3 m. Cost: about 30 operations a link and sweep, only near
//! flames. Each row gathers from its own links and from what was before the sweep, in fixed chunks.

use super::boundary_layer as layer;
use super::properties::{GasProperties, STEFAN_BOLTZMANN};
use super::still_air::plain;
use super::{FACES, FaceExchange, FaceView, Gas, GasBooks, GasState, SheetView, Surroundings};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The closure and its buffers.
#[derive(Debug, Clone)]
pub struct Flame {
    /// Thickness of the film at the foot of a flame over alpha/U (Eq. 14.7): the one calibrated constant.
    pub foot: f64,
    /// Absorption coefficient of flame gas [1/m].
    pub absorption: f64,
    /// Sweeps end when no temperature changes by more [K].
    pub tolerance: f64,
    /// Most sweeps in a step.
    pub most_sweeps: usize,
    scratch: [Scratch; FACES],
}

impl Default for Flame {
    fn default() -> Self {
        Self {
            foot: FOOT,
            absorption: ABSORPTION,
            tolerance: 0.1,
            most_sweeps: 40,
            scratch: std::array::from_fn(|_| Scratch::default()),
        }
    }
}

/// tuned: on the speed of one flame, downward on tissue of 18.7 g/m2 in air, 11.3 mm/s [Elimami2026]; 1 by its scale,
/// sensible from 0.7 to 2.
const FOOT: f64 = 0.86;
/// Planck mean absorption of the products of a fuel with 1:1 carbon dioxide and water near 1800 K, about 3 to 5 1/m at
/// 1 atm [Tien1968]; soot of thin paper flames is little.
const ABSORPTION: f64 = 4.0;
/// Films light between these temperatures [K]: hot gas lights most fuels in air within milliseconds from about 1000 K
/// [Laurendeau1982]; 100 K more or less changes the speed of tissue by 1 %.
const IGNITION_BEGINS: f64 = 850.0;
const IGNITION_ENDS: f64 = 1050.0;
/// How firmly a flame holds the film at its temperature, over the exchange with the face: it stands R = 4.9 times nearer
/// to the air than to the face (Eq. 14.1 in air). Speeds depend on it: 3 gives 7.8 mm/s and 8 gives 14.2 where 5 gives
/// 11.3, so it is fixed before [`FOOT`] is found.
const HOLD: f64 = 5.0;
/// Fuel at the face over its mean in a film of the thickness that passes the heat: profile (1 - y/2 delta)^2 [Squire1938].
const WALL_OVER_FILM: f64 = 1.5;
/// Correction of the conductance on meshes that do not resolve the film, first and second order in spacing over its
/// decay length: one flame then has one speed within 2 % from 0.1 to 1.6 mm.
const COARSE: f64 = 0.2;
const COARSER: f64 = 0.5;
/// Faces this much over the room are looked after by the film [K].
const WARM: f64 = 40.0;
/// Gas this much over the room is carried along [K].
const HOT: f64 = 2.0;

/// Rows that one thread works on at a time.
const CHUNK: usize = 256;
/// One thread does so many rows faster than several.
const ALONE: usize = 512;
/// No row.
const NONE: u32 = u32::MAX;

#[derive(Debug, Clone, Default)]
struct Scratch {
    /// Nodes worked on, one a row.
    active: Vec<u32>,
    /// Row of each node, if it has one.
    row_of: Vec<u32>,
    flows: Vec<Flow>,
    chunks: Vec<Chunk>,
    /// Films of the rows before and after a sweep; one more row is a film at rest.
    films: Vec<Film>,
    films_after: Vec<Film>,
    /// Greatest change of temperature in each chunk in the sweep before [K].
    changes: Vec<f64>,
}

/// Rows that one thread works on, and their links one after the other.
#[derive(Debug, Clone, Default)]
struct Chunk {
    rows: Vec<Row>,
    links: Vec<Link>,
    /// Number of the first.
    first: usize,
    /// Chunks of this face and of the other whose films it reads.
    near: Vec<u32>,
    opposite: Vec<u32>,
    /// Greatest change of temperature in a sweep [K].
    change: f64,
}

/// What a film remembers: temperature [K], mass fraction of fuel, run [m].
#[derive(Debug, Clone, Copy, Default)]
struct Film {
    temperature: f64,
    fuel: f64,
    run: f64,
}

/// Velocity [m/s] and thickness [m] of a film, and how its temperature rises along the sheet, over that of a flame [1/m].
#[derive(Debug, Clone, Copy, Default)]
struct Flow {
    velocity: DVec3,
    thickness: f64,
    gradient: DVec3,
}

/// What a sweep needs of a link.
#[derive(Debug, Clone, Copy)]
struct Link {
    /// Row at the other end.
    to: u32,
    /// Mass that flows in [kg/s].
    inflow: f64,
    /// What is exchanged and flows in, as heat over temperature [W/K] and as mass [kg/s].
    heat: f64,
    mass: f64,
}

/// What a sweep needs of an active node; it does not change from sweep to sweep.
#[derive(Debug, Clone, Default)]
struct Row {
    node: u32,
    /// Row of the node on the other face.
    other: u32,
    /// Its film when the step began.
    begun: Film,
    /// Its links in those of its chunk.
    links: Range<u32>,
    /// Temperature of the face [K], and how much of it an igniting flame covers.
    wall: f64,
    pilot: f64,
    /// Fuel gas that comes out [kg/s].
    emitted: f64,
    /// Heat capacity of its film over the step [W/K].
    storage: f64,
    /// Sum of conductances along the sheet and round its edge [W/K].
    conductance: f64,
    /// To the other face round a free edge [W/K].
    around: f64,
    /// Mass flows in and out along the sheet [kg/s].
    inflow: f64,
    outflow: f64,
    /// Across the film, area x edge factor x conductivity/thickness [W/K].
    across: f64,
    /// Without flame, twice area x plain coefficient [W/K].
    plain: f64,
    /// Fresh air drawn in over a free edge [W/K].
    fresh: f64,
    /// Part of the heat to the wall that blowing leaves.
    blowing: f64,
    /// Emissivity of the film.
    emissivity: f64,
    /// What it radiates to both sides over temperature^4 [W/K4].
    radiance: f64,
    /// Speed times mass in the film per length, for its run [kg m/s over m].
    carried: f64,
    thickness: f64,
    /// Part of what could burn that does, once alight.
    completeness: f64,
    /// Temperature of the flame over that of the face [K].
    flame_rise: f64,
}

impl Scratch {
    /// Makes the films after a sweep those before the next. Returns the greatest change of temperature [K].
    fn accept_sweep(&mut self) -> f64 {
        std::mem::swap(&mut self.films, &mut self.films_after);
        let chunks = &self.chunks[..self.changes.len()];
        for (change, chunk) in self.changes.iter_mut().zip(chunks) {
            *change = chunk.change;
        }
        self.changes.iter().copied().fold(0.0, f64::max)
    }
}

impl Gas for Flame {
    fn advance(
        &mut self,
        sheet: &SheetView<'_>,
        faces: &FaceView<'_>,
        surroundings: &Surroundings,
        dt: f64,
        state: &mut GasState,
        exchange: &mut FaceExchange,
    ) {
        exchange.fit(sheet.area.len());
        let gas = GasProperties::of(surroundings, faces.oxygen_demand, self.foot);
        let plain = layer::PlainTable::of(surroundings);
        let step = Step { sheet, faces, surroundings, gas, dt, foot: self.foot, absorption: self.absorption, plain };
        let [front, back] = &mut self.scratch;
        step.find_active(0, state, front);
        step.find_active(1, state, back);
        step.find_flow(0, state, front);
        step.find_flow(1, state, back);
        step.find_links(0, front, back);
        step.find_links(1, back, front);
        let mut sweeps = 0;
        while sweeps < self.most_sweeps {
            // Both faces are read before either is written.
            step.sweep(front, back, self.tolerance);
            step.sweep(back, front, self.tolerance);
            let change = front.accept_sweep().max(back.accept_sweep());
            sweeps += 1;
            if change < self.tolerance {
                break;
            }
        }
        let mut books = GasBooks { sweeps, ..GasBooks::default() };
        for (face, scratch) in [front, back].into_iter().enumerate() {
            books.active += scratch.active.len();
            step.accept(face, state, scratch);
            step.answer(face, scratch, exchange, &mut books);
        }
        books.heat_released = books.fuel_burnt * faces.heat_of_combustion;
        books.heat_to_surroundings = books.heat_released - books.heat_to_sheet;
        exchange.books = books;
    }
}

/// One step: all that is read.
struct Step<'a> {
    sheet: &'a SheetView<'a>,
    faces: &'a FaceView<'a>,
    surroundings: &'a Surroundings,
    gas: GasProperties,
    dt: f64,
    foot: f64,
    absorption: f64,
    plain: layer::PlainTable,
}

/// How a film burns.
#[derive(Debug, Clone, Copy)]
struct Burning {
    /// Presence of flame: fuel enough for one at the face, and reaction fast enough.
    flame: f64,
    /// How firmly it holds the film at its temperature [W/K].
    hold: f64,
    /// Fuel burnt per mass fraction of it [kg/s].
    consumption: f64,
    /// Unburnt fuel that leaves through the film's outer side, per mass fraction [kg/s].
    escape: f64,
}

/// Adds the chunk of a row to a list, once.
fn note(chunks: &mut Vec<u32>, row: u32) {
    let chunk = row / CHUNK as u32;
    if !chunks.contains(&chunk) {
        chunks.push(chunk);
    }
}

impl Step<'_> {
    fn links(&self, i: usize) -> Range<usize> {
        self.sheet.link_start[i] as usize..self.sheet.link_start[i + 1] as usize
    }

    fn find_active(&self, face: usize, state: &mut GasState, scratch: &mut Scratch) {
        let ambient = self.gas.ambient;
        let Scratch { active, row_of, flows, chunks, films, films_after, changes } = scratch;
        active.iter().for_each(|i| row_of[*i as usize] = NONE);
        row_of.resize(self.sheet.area.len(), NONE);
        active.clear();
        films.clear();
        for i in self.sheet.awake {
            let i = *i as usize;
            let film = &state.temperature[face];
            let alive = self.faces.open[face][i] > 0.0 && self.sheet.normal[i] != DVec3::ZERO;
            let hot = |i: usize| film[i] > ambient + HOT;
            let is_active = alive
                && (hot(i)
                    || self.faces.temperature[face][i] > ambient + WARM
                    || self.faces.pilot[face][i] > 0.0
                    || self.faces.volatile_flux[face][i] > 1e-6
                    || self.links(i).any(|l| hot(self.sheet.link_to[l] as usize)));
            if is_active {
                row_of[i] = active.len() as u32;
                active.push(i as u32);
                films.push(Film { temperature: film[i], fuel: state.fuel[face][i], run: state.run[face][i] });
            } else {
                state.temperature[face][i] = ambient;
                state.fuel[face][i] = 0.0;
                state.run[face][i] = 0.0;
            }
        }
        films.push(Film { temperature: ambient, fuel: 0.0, run: 0.0 });
        films_after.clone_from(films);
        flows.resize(active.len(), Flow::default());
        let count = active.len().div_ceil(CHUNK);
        for k in chunks.len()..count {
            chunks.push(Chunk { first: k * CHUNK, ..Chunk::default() });
        }
        changes.clear();
        changes.resize(count, f64::INFINITY);
    }

    /// Thickness and velocity of the film at each active node and its neighbours (Eq. 14.6 to 14.9).
    fn find_flow(&self, face: usize, state: &GasState, scratch: &mut Scratch) {
        let Surroundings { gravity, wind, .. } = *self.surroundings;
        let weight = gravity.length();
        let up = if weight > 0.0 { -gravity / weight } else { DVec3::ZERO };
        let film = &state.temperature[face];
        let span = (self.gas.flame - self.gas.ambient).max(1.0);
        let Scratch { active, flows, .. } = scratch;
        let of_node = |i: usize| {
            let outward = if face == 0 { self.sheet.normal[i] } else { -self.sheet.normal[i] };
            let mut gradient = DVec3::ZERO;
            for l in self.links(i) {
                let j = self.sheet.link_to[l] as usize;
                let along = (self.sheet.position[j] - self.sheet.position[i]).normalize_or_zero();
                gradient += 0.5 * self.sheet.link_width[l] * (film[j] - film[i]) * along;
            }
            gradient /= self.sheet.area[i] * span;
            let excess = ((film[i] - self.gas.ambient) / span).max(0.0);
            let run = state.run[face][i];
            let wind = wind - wind.dot(outward) * outward;
            let scale = layer::Scale::of(&self.gas, wind.length(), self.foot);
            let foot = scale.thickness(0.0);
            let drive = layer::drive(up, outward, gradient, excess, foot, 0.02);
            let strength = drive.length();
            let growth = scale.speed_growth(run);
            let buoyant = if strength > 1e-9 {
                drive * (self.gas.buoyant_speed * growth / strength.cbrt().powi(2))
            } else {
                DVec3::ZERO
            };
            let velocity = layer::MEAN_SPEED * (buoyant + wind);
            Flow { velocity, thickness: scale.thickness(run), gradient }
        };
        let of_chunk = |(flows, active): (&mut [Flow], &[u32])| {
            for (flow, i) in flows.iter_mut().zip(active) {
                *flow = of_node(*i as usize);
            }
        };
        if active.len() > ALONE {
            flows.par_chunks_mut(CHUNK).zip(active.par_chunks(CHUNK)).for_each(of_chunk);
        } else {
            of_chunk((flows, active));
        }
    }

    /// Conductances and mass flows of the links of active nodes (Eq. 14.14, 14.15), and what is fixed in their rows.
    fn find_links(&self, face: usize, scratch: &mut Scratch, other: &Scratch) {
        let Scratch { active, row_of, flows, chunks, films, .. } = scratch;
        let (row_of, flows, films) = (&*row_of, &*flows, &*films);
        let (at_rest, other_at_rest) = (active.len() as u32, other.active.len() as u32);
        let of_chunk = |(chunk, active): (&mut Chunk, &[u32])| {
            chunk.rows.clear();
            chunk.links.clear();
            chunk.near.clear();
            chunk.near.push((chunk.first / CHUNK) as u32);
            chunk.opposite.clear();
            for i in active {
                let i = *i as usize;
                let mut row = self.row(face, i, row_of, flows, at_rest, &mut chunk.links);
                row.begun = films[row_of[i] as usize];
                row.other = match other.row_of[i] {
                    NONE => other_at_rest,
                    row => {
                        note(&mut chunk.opposite, row);
                        row
                    }
                };
                chunk.rows.push(row);
            }
            for link in chunk.links.iter().filter(|link| link.to != at_rest) {
                note(&mut chunk.near, link.to);
            }
        };
        let count = active.len().div_ceil(CHUNK);
        if active.len() > ALONE {
            chunks[..count].par_iter_mut().zip(active.par_chunks(CHUNK)).for_each(of_chunk);
        } else {
            chunks[..count].iter_mut().zip(active.chunks(CHUNK)).for_each(of_chunk);
        }
    }

    fn row(&self, face: usize, i: usize, row_of: &[u32], flows: &[Flow], at_rest: u32, links: &mut Vec<Link>) -> Row {
        let gas = &self.gas;
        let Flow { velocity: here, thickness, gradient: own_gradient } = flows[row_of[i] as usize];
        let first = links.len() as u32;
        let mut row = Row { node: i as u32, links: first..first + self.links(i).len() as u32, ..Row::default() };
        for l in self.links(i) {
            let j = self.sheet.link_to[l] as usize;
            let (to, other, velocity, gradient) = match row_of[j] {
                NONE => (at_rest, thickness, here, own_gradient),
                to => {
                    let there = flows[to as usize];
                    (to, there.thickness, 0.5 * (here + there.velocity), own_gradient + there.gradient)
                }
            };
            let mean = 0.5 * (thickness + other);
            let along = (self.sheet.position[j] - self.sheet.position[i]).normalize_or_zero();
            let speed = velocity.dot(along);
            let (length, width) = (self.sheet.link_length[l], self.sheet.link_width[l]);
            // Ahead of a foot the film cools along its gradient, so a link is as coarse as it reaches that way.
            let way = gradient.normalize_or_zero();
            let decay = layer::decay_rate(velocity.dot(way).abs(), gas.diffusivity, mean, 1.0);
            let open = self.faces.open[face][j].min(self.faces.open[face][i]);
            let reach = length * decay * way.dot(along).abs();
            let conductance =
                open * gas.conductivity * mean * width / length * (1.0 + COARSE * reach + COARSER * reach * reach);
            let flow = open * gas.density * mean * width * speed;
            let inflow = (-flow).max(0.0);
            let heat = conductance + gas.heat_capacity * inflow;
            links.push(Link { to, inflow, heat, mass: heat / gas.heat_capacity });
            row.conductance += conductance;
            row.inflow += inflow;
            row.outflow += flow.max(0.0);
        }
        row.wall = self.faces.temperature[face][i];
        row.pilot = self.faces.pilot[face][i];
        row.emitted = self.faces.volatile_flux[face][i] * self.sheet.area[i] * self.faces.open[face][i];
        let area = self.sheet.area[i] * self.faces.open[face][i];
        let factor = layer::edge_factor(self.sheet.edge_distance[i], self.sheet.area[i].sqrt(), thickness);
        row.storage = gas.density * gas.heat_capacity * thickness * area / self.dt;
        row.around = gas.conductivity * self.sheet.edge_length[i] / std::f64::consts::PI;
        row.conductance += row.around;
        row.across = area * factor * gas.conductivity / thickness;
        row.plain = 2.0 * area * self.plain.at(row.wall);
        if self.sheet.edge_length[i] > 0.0 {
            row.fresh = gas.heat_capacity * (row.outflow - row.inflow).max(0.0);
        }
        row.blowing = layer::blowing(self.faces.gas_flux[face][i] * area * gas.heat_capacity / row.across.max(1e-30));
        row.emissivity =
            -(-self.absorption * self.surroundings.pressure / super::properties::ATMOSPHERE * thickness).exp_m1();
        row.radiance = 2.0 * area * row.emissivity * STEFAN_BOLTZMANN;
        row.carried = gas.density * thickness * here.length() * area;
        row.thickness = thickness;
        (row.completeness, row.flame_rise) = self.reaction(&row, row.wall);
        row
    }

    /// Part of what could burn that does in a film that is alight, and the temperature of its flame over that of the face
    /// (Eq. 14.4, 14.5).
    fn reaction(&self, row: &Row, wall: f64) -> (f64, f64) {
        let gas = &self.gas;
        let loss = row.radiance / row.across.max(1e-30);
        let mut burnt = gas.flame;
        for _ in 0..2 {
            burnt = (gas.leverage * gas.adiabatic + row.blowing * wall)
                / (gas.leverage + row.blowing + loss * burnt.powi(3));
        }
        let completeness = gas.reacting_part(wall, burnt, row.thickness);
        (completeness, (burnt - wall).max(1.0))
    }

    /// How the film burns at a temperature and mass fraction of fuel (Eq. 14.18).
    #[inline]
    fn burning(&self, row: &Row, film: f64, fuel: f64) -> Burning {
        let lit = ((film - IGNITION_BEGINS) / (IGNITION_ENDS - IGNITION_BEGINS)).clamp(0.0, 1.0).max(row.pilot);
        let completeness = row.completeness * lit;
        let diffusion = row.across / self.gas.heat_capacity * WALL_OVER_FILM;
        // The flame is all there once its fuel can pay for the heat that the face takes.
        let power = diffusion * fuel * self.faces.heat_of_combustion;
        let paid = power / (row.across.max(1e-30) * row.flame_rise);
        let flame = completeness * paid.min(1.0);
        let hold = HOLD * row.across * flame;
        // Heat that the film takes up is paid in fuel, also where that is more than diffusion feeds: what has mixed
        // ahead of the foot burns at once.
        let missing = (self.gas.potential - film).max(0.0);
        let mixed = hold * missing / (self.faces.heat_of_combustion * fuel.max(1e-12));
        Burning {
            flame,
            hold,
            consumption: (diffusion * completeness).max(mixed),
            escape: diffusion * (1.0 - completeness),
        }
    }

    /// One sweep over a face, films into films after: each chunk is relaxed by itself, forth and back, between what the others
    /// were before; one that has come to rest, and all around it, waits. Chunks are the same on any number of threads, so the
    /// bits are.
    fn sweep(&self, scratch: &mut Scratch, other: &Scratch, tolerance: f64) {
        let Scratch { active, chunks, films, films_after, changes, .. } = scratch;
        let (films, changes) = (&*films, &*changes);
        let rests = |changes: &[f64], chunks: &[u32]| chunks.iter().all(|k| changes[*k as usize] < tolerance);
        let of_chunk = |(chunk, after): (&mut Chunk, &mut [Film])| {
            let Chunk { rows, links, first, near, opposite, change } = chunk;
            let before = &films[*first..*first + after.len()];
            after.copy_from_slice(before);
            if rests(changes, near) && rests(&other.changes, opposite) {
                *change = 0.0;
                return;
            }
            let mut relax = |k: usize| {
                let row = &rows[k];
                let links = &links[row.links.start as usize..row.links.end as usize];
                // Within the chunk what is newest, from other chunks what was before the sweep.
                let film_of = |to: u32| after.get((to as usize).wrapping_sub(*first)).unwrap_or(&films[to as usize]);
                let film = self.swept(row, &after[k], links, film_of, &other.films);
                let change = (film.temperature - after[k].temperature).abs();
                after[k] = film;
                change
            };
            let there = (0..rows.len()).map(&mut relax).fold(0.0, f64::max);
            let back = (0..rows.len()).rev().map(&mut relax).fold(0.0, f64::max);
            *change = there.max(back);
        };
        let (rows, count) = (active.len(), active.len().div_ceil(CHUNK));
        let (chunks, after) = (&mut chunks[..count], &mut films_after[..rows]);
        if rows > ALONE {
            chunks.par_iter_mut().zip(after.par_chunks_mut(CHUNK)).for_each(of_chunk);
        } else {
            chunks.iter_mut().zip(after.chunks_mut(CHUNK)).for_each(of_chunk);
        }
    }

    /// A film after a sweep.
    #[inline]
    fn swept<'a>(
        &self,
        row: &Row,
        here: &Film,
        links: &[Link],
        film_of: impl Fn(u32) -> &'a Film,
        other: &[Film],
    ) -> Film {
        let (gas, ambient) = (&self.gas, self.gas.ambient);
        let span = (gas.flame - ambient).max(1.0);
        let Film { temperature: film, fuel: unburnt, run } = *here;
        let over = &other[row.other as usize];
        let (mut heat, mut mass, mut came) = (row.around * over.temperature, 0.0, 0.0);
        mass += row.around / gas.heat_capacity * over.fuel;
        for link in links {
            let next = film_of(link.to);
            heat += link.heat * next.temperature;
            mass += link.mass * next.fuel;
            came += link.inflow * next.run;
        }
        let burning = self.burning(row, film, unburnt);
        // Eq. 14.16: heat of the film.
        let begun = run / (run + row.thickness);
        let near = 1.0 + burning.flame * (gas.nearness - 1.0);
        let (to_wall, out) = if film > row.wall {
            (row.across * row.blowing * near, row.across * begun * (1.0 - burning.flame))
        } else {
            (row.plain, row.plain * (1.0 - burning.flame))
        };
        let lit = HOLD * row.across * row.pilot;
        let radiated = burning.flame * row.radiance * film.min(gas.adiabatic).powi(3);
        let sources = row.storage * row.begun.temperature
            + heat
            + to_wall * row.wall
            + (out + row.fresh) * ambient
            + burning.hold * gas.potential
            + lit * gas.flame;
        let sinks = row.storage
            + row.conductance
            + gas.heat_capacity * row.inflow
            + to_wall
            + out
            + row.fresh
            + burning.hold
            + lit
            + radiated;
        let temperature = sources / sinks;
        // Eq. 14.17: fuel in the film.
        let leaves = self.leaving(row, unburnt);
        let sources = row.storage / gas.heat_capacity * row.begun.fuel + mass + row.emitted;
        let sinks = (row.storage + row.conductance) / gas.heat_capacity
            + row.outflow
            + leaves
            + burning.consumption
            + burning.escape;
        let fuel = sources / sinks.max(1e-30);
        // Eq. 14.19: run of the film since the foot.
        let warmth = ((film - ambient) / span).clamp(0.0, 1.0);
        let goes_on = (burning.flame + begun * (4.0 * warmth).min(1.0)).min(1.0);
        let through = row.inflow.max(row.outflow);
        let sinks = through + row.carried * (1.0 - goes_on) / row.thickness;
        let run = if sinks > 0.0 { ((came + row.carried * goes_on) / sinks).min(2.0) } else { 0.0 };
        Film { temperature, fuel, run }
    }

    /// Rate at which gas leaves the face for the plume, per mass fraction [kg/s]: what streams together from all sides,
    /// and what a film that is all fuel cannot hold.
    #[inline]
    fn leaving(&self, row: &Row, fuel: f64) -> f64 {
        (row.inflow - row.outflow).max(0.0) + row.emitted * fuel * fuel
    }

    fn accept(&self, face: usize, state: &mut GasState, scratch: &Scratch) {
        for (i, film) in scratch.active.iter().zip(&scratch.films) {
            let i = *i as usize;
            state.temperature[face][i] = film.temperature;
            state.fuel[face][i] = film.fuel;
            state.run[face][i] = film.run;
        }
    }

    /// What the sheet gets of the film (Eq. 14.12, 14.13, 14.20).
    fn answer(&self, face: usize, scratch: &Scratch, exchange: &mut FaceExchange, books: &mut GasBooks) {
        let (gas, ambient) = (&self.gas, self.gas.ambient);
        for i in self.sheet.awake {
            let i = *i as usize;
            if scratch.row_of[i] != NONE {
                continue;
            }
            let answer = plain(self.faces, self.surroundings, &self.plain, face, i);
            exchange.heat_flux[face][i] = answer.convection - answer.radiation;
            exchange.heat_flux_slope[face][i] = answer.slope;
            exchange.surface_oxygen[face][i] = self.surroundings.oxygen * self.faces.open[face][i];
            exchange.oxygen_supply[face][i] = answer.oxygen_supply;
            exchange.flame[face][i] = 0.0;
            exchange.standoff[face][i] = 0.0;
            exchange.flame_height[face][i] = 0.0;
            exchange.velocity[face][i] = DVec3::ZERO;
            books.fuel_in += self.sheet.area[i] * self.faces.volatile_flux[face][i];
            books.fuel_left += self.sheet.area[i] * self.faces.volatile_flux[face][i];
            books.heat_to_sheet += self.sheet.area[i] * answer.convection;
            books.heat_radiated += self.sheet.area[i] * answer.radiation;
        }
        let count = scratch.active.len().div_ceil(CHUNK);
        let rows = scratch.chunks[..count].iter().flat_map(|chunk| &chunk.rows);
        for (k, (row, film)) in rows.zip(&scratch.films).enumerate() {
            let (i, wall) = (row.node as usize, row.wall);
            let Film { temperature: film, fuel, .. } = *film;
            let (area, open) = (self.sheet.area[i], self.faces.open[face][i]);
            let burning = self.burning(row, film, fuel);
            let near = 1.0 + burning.flame * (gas.nearness - 1.0);
            let to_wall = if film > wall { row.across * row.blowing * near } else { row.plain } / area;
            let emissive = open * self.faces.emissivity * STEFAN_BOLTZMANN;
            let from_flame = emissive * burning.flame * row.emissivity * film.min(gas.adiabatic).powi(4);
            let convection = to_wall * (film - wall) + from_flame;
            let radiation = emissive * (wall.powi(4) - ambient.powi(4));
            exchange.heat_flux[face][i] = convection - radiation;
            exchange.heat_flux_slope[face][i] = -to_wall - 4.0 * emissive * wall.powi(3);
            let air = 1.0 - burning.flame;
            let transfer = if film > wall { row.across * row.blowing } else { 0.5 * row.plain } / area;
            exchange.surface_oxygen[face][i] = self.surroundings.oxygen * open * air;
            exchange.oxygen_supply[face][i] = air * transfer / gas.heat_capacity * gas.oxygen_mass_fraction;
            exchange.flame[face][i] = burning.flame;
            exchange.standoff[face][i] = row.thickness * (1.0 - gas.stoichiometric);
            exchange.velocity[face][i] = scratch.flows[k].velocity;
            let left = fuel * self.leaving(row, fuel);
            // A sheet of flame on both sides of what leaves burns it at the rate of diffusion.
            let rate = 2.0 * gas.conductivity / (gas.heat_capacity * row.thickness) * area.sqrt();
            exchange.flame_height[face][i] = row.thickness + left * burning.flame.max(0.05) / rate;
            books.fuel_in += row.emitted;
            books.fuel_burnt += fuel * burning.consumption;
            books.fuel_left += left + fuel * burning.escape;
            books.heat_to_sheet += area * convection;
            books.heat_radiated += area * radiation;
        }
    }
}
