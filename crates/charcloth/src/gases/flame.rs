//! Flames: a film of gas on each face that carries heat and fuel along the sheet, burns, and gives heat back.
//!
//! Model: Eq. 14.6 to 14.20, mean values over the thickness of the film, thin-fuel theory at its foot [DeRis1969]
//! [Delichatsios1986] and laminar natural convection along it [Ahmad1978] [Pagni1977]. No speed of spread enters. Valid
//! when: flames are laminar, burning lengths to about 0.3 m. Cost: about 30 operations a link and sweep, only near
//! flames.

use super::boundary_layer as layer;
use super::properties::{GasProperties, STEFAN_BOLTZMANN};
use super::still_air::plain;
use super::{FACES, FaceExchange, FaceView, Gas, GasBooks, GasState, SheetView, Surroundings};
use glam::DVec3;

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
            tolerance: 1.0,
            most_sweeps: 12,
            scratch: std::array::from_fn(|_| Scratch::default()),
        }
    }
}

/// tuned: on the speed of one flame, downward on tissue of 18.7 g/m2 in air, 11.3 mm/s [Elimami2026]; 1 by its scale,
/// sensible from 0.7 to 2.
const FOOT: f64 = 0.95;
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
/// Correction of meshes coarser than the film, found by comparing 2 mm with 0.25 mm; nothing at 0.5 mm.
const COARSE: f64 = 0.8;
/// Faces this much over the room are looked after by the film [K].
const WARM: f64 = 40.0;
/// Gas this much over the room is carried along [K].
const HOT: f64 = 2.0;

#[derive(Debug, Clone, Default)]
struct Scratch {
    /// Rows worked on.
    active: Vec<u32>,
    is_active: Vec<bool>,
    rows: Vec<Row>,
    conductance: Vec<f64>,
    inflow: Vec<f64>,
    velocity: Vec<DVec3>,
    thickness: Vec<f64>,
    temperature: Vec<f64>,
    fuel: Vec<f64>,
    run: Vec<f64>,
}

/// What a sweep needs of an active node; it does not change from sweep to sweep.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
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
        let gas = GasProperties::of(surroundings, faces.oxygen_demand);
        let plain = layer::PlainTable::of(surroundings);
        let step = Step { sheet, faces, surroundings, gas, dt, foot: self.foot, absorption: self.absorption, plain };
        for face in 0..FACES {
            step.find_active(face, state, &mut self.scratch[face]);
            step.find_flow(face, state, &mut self.scratch[face]);
            step.find_links(face, &mut self.scratch[face]);
        }
        let mut sweeps = 0;
        while sweeps < self.most_sweeps {
            let mut change: f64 = 0.0;
            for face in 0..FACES {
                change = change.max(step.sweep(face, state, &mut self.scratch[face]));
            }
            // Both faces are read before either is written.
            for face in 0..FACES {
                step.accept(face, state, &self.scratch[face]);
            }
            sweeps += 1;
            if change < self.tolerance {
                break;
            }
        }
        let mut books = GasBooks { sweeps, ..GasBooks::default() };
        for face in 0..FACES {
            books.active += self.scratch[face].active.len();
            step.answer(face, state, &self.scratch[face], exchange, &mut books);
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

impl Step<'_> {
    fn links(&self, i: usize) -> std::ops::Range<usize> {
        self.sheet.link_start[i] as usize..self.sheet.link_start[i + 1] as usize
    }

    fn find_active(&self, face: usize, state: &mut GasState, scratch: &mut Scratch) {
        let nodes = self.sheet.area.len();
        let ambient = self.gas.ambient;
        scratch.is_active.resize(nodes, false);
        scratch.thickness.resize(nodes, 0.0);
        scratch.velocity.resize(nodes, DVec3::ZERO);
        scratch.conductance.resize(self.sheet.link_to.len(), 0.0);
        scratch.inflow.resize(self.sheet.link_to.len(), 0.0);
        scratch.active.clear();
        for i in 0..nodes {
            let film = &state.temperature[face];
            let alive = self.faces.open[face][i] > 0.0 && self.sheet.normal[i] != DVec3::ZERO;
            let hot = |i: usize| film[i] > ambient + HOT;
            scratch.is_active[i] = alive
                && (hot(i)
                    || self.faces.temperature[face][i] > ambient + WARM
                    || self.faces.pilot[face][i] > 0.0
                    || self.faces.volatile_flux[face][i] > 1e-6
                    || self.links(i).any(|l| hot(self.sheet.link_to[l] as usize)));
            if scratch.is_active[i] {
                scratch.active.push(i as u32);
            } else {
                state.temperature[face][i] = ambient;
                state.fuel[face][i] = 0.0;
                state.run[face][i] = 0.0;
            }
        }
        for column in [&mut scratch.temperature, &mut scratch.fuel, &mut scratch.run] {
            column.resize(scratch.active.len(), 0.0);
        }
        scratch.rows.resize(scratch.active.len(), Row::default());
    }

    /// Thickness and velocity of the film at each active node and its neighbours (Eq. 14.6 to 14.9).
    fn find_flow(&self, face: usize, state: &GasState, scratch: &mut Scratch) {
        let Surroundings { gravity, wind, .. } = *self.surroundings;
        let weight = gravity.length();
        let up = if weight > 0.0 { -gravity / weight } else { DVec3::ZERO };
        let film = &state.temperature[face];
        let span = (self.gas.flame - self.gas.ambient).max(1.0);
        for k in 0..scratch.active.len() {
            let i = scratch.active[k] as usize;
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
            scratch.velocity[i] = layer::MEAN_SPEED * (buoyant + wind);
            scratch.thickness[i] = scale.thickness(run);
        }
    }

    /// Conductances and mass flows of the links of active nodes (Eq. 14.14, 14.15), and what is fixed in their rows.
    fn find_links(&self, face: usize, scratch: &mut Scratch) {
        let gas = &self.gas;
        for k in 0..scratch.active.len() {
            let i = scratch.active[k] as usize;
            let thickness = scratch.thickness[i];
            let mut row = Row::default();
            for l in self.links(i) {
                let j = self.sheet.link_to[l] as usize;
                let both = scratch.is_active[j];
                let (other, velocity) = if both {
                    (scratch.thickness[j], 0.5 * (scratch.velocity[i] + scratch.velocity[j]))
                } else {
                    (thickness, scratch.velocity[i])
                };
                let mean = 0.5 * (thickness + other);
                let along = (self.sheet.position[j] - self.sheet.position[i]).normalize_or_zero();
                let speed = velocity.dot(along);
                let (length, width) = (self.sheet.link_length[l], self.sheet.link_width[l]);
                let decay = layer::decay_rate(speed.abs(), gas.diffusivity, mean, 1.0);
                let open = self.faces.open[face][j].min(self.faces.open[face][i]);
                let reach = length * decay;
                let conductance =
                    open * gas.conductivity * mean * width / length * (1.0 + reach + COARSE * reach * reach);
                let flow = open * gas.density * mean * width * speed;
                scratch.conductance[l] = conductance;
                scratch.inflow[l] = (-flow).max(0.0);
                row.conductance += conductance;
                row.inflow += (-flow).max(0.0);
                row.outflow += flow.max(0.0);
            }
            let area = self.sheet.area[i] * self.faces.open[face][i];
            let factor = layer::edge_factor(self.sheet.edge_distance[i], self.sheet.area[i].sqrt(), thickness);
            row.storage = gas.density * gas.heat_capacity * thickness * area / self.dt;
            row.around = gas.conductivity * self.sheet.edge_length[i] / std::f64::consts::PI;
            row.conductance += row.around;
            row.across = area * factor * gas.conductivity / thickness;
            row.plain = 2.0 * area * self.plain.at(self.faces.temperature[face][i]);
            if self.sheet.edge_length[i] > 0.0 {
                row.fresh = gas.heat_capacity * (row.outflow - row.inflow).max(0.0);
            }
            row.blowing =
                layer::blowing(self.faces.gas_flux[face][i] * area * gas.heat_capacity / row.across.max(1e-30));
            row.emissivity =
                -(-self.absorption * self.surroundings.pressure / super::properties::ATMOSPHERE * thickness).exp_m1();
            row.radiance = 2.0 * area * row.emissivity * STEFAN_BOLTZMANN;
            row.carried = gas.density * thickness * scratch.velocity[i].length() * area;
            row.thickness = thickness;
            (row.completeness, row.flame_rise) = self.reaction(&row, self.faces.temperature[face][i]);
            scratch.rows[k] = row;
        }
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
        // Oxygen that leaks through cools the flame, and more leaks: the upper branch of Eq. 14.5, from above.
        let mut completeness = 1.0;
        for _ in 0..6 {
            completeness = gas.completeness(wall + (burnt - wall) * completeness, row.thickness);
        }
        (completeness, (burnt - wall).max(1.0))
    }

    /// How the film burns at a temperature and mass fraction of fuel (Eq. 14.18).
    #[inline]
    fn burning(&self, row: &Row, film: f64, fuel: f64, pilot: f64) -> Burning {
        let lit = ((film - IGNITION_BEGINS) / (IGNITION_ENDS - IGNITION_BEGINS)).clamp(0.0, 1.0).max(pilot);
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

    /// One Jacobi sweep over a face: from the state into the scratch. Returns the greatest change of temperature.
    fn sweep(&self, face: usize, state: &GasState, scratch: &mut Scratch) -> f64 {
        let Scratch { active, rows, conductance, inflow, temperature, fuel, run, .. } = scratch;
        let (film, unburnt, runs) = (&state.temperature[face], &state.fuel[face], &state.run[face]);
        let (gas, ambient) = (&self.gas, self.gas.ambient);
        let span = (gas.flame - ambient).max(1.0);
        let mut greatest: f64 = 0.0;
        for k in 0..active.len() {
            let (i, row) = (active[k] as usize, &rows[k]);
            let (mut heat, mut mass, mut came) = (row.around * state.temperature[1 - face][i], 0.0, 0.0);
            mass += row.around / gas.heat_capacity * state.fuel[1 - face][i];
            for l in self.links(i) {
                let j = self.sheet.link_to[l] as usize;
                let carried = conductance[l] + gas.heat_capacity * inflow[l];
                heat += carried * film[j];
                mass += carried / gas.heat_capacity * unburnt[j];
                came += inflow[l] * runs[j];
            }
            let wall = self.faces.temperature[face][i];
            let pilot = self.faces.pilot[face][i];
            let burning = self.burning(row, film[i], unburnt[i], pilot);
            // Eq. 14.16: heat of the film.
            let begun = runs[i] / (runs[i] + row.thickness);
            let near = 1.0 + burning.flame * (gas.nearness - 1.0);
            let (to_wall, out) = if film[i] > wall {
                (row.across * row.blowing * near, row.across * begun * (1.0 - burning.flame))
            } else {
                (row.plain, row.plain * (1.0 - burning.flame))
            };
            let lit = HOLD * row.across * pilot;
            let radiated = burning.flame * row.radiance * film[i].min(gas.adiabatic).powi(3);
            let sources = row.storage * film[i]
                + heat
                + to_wall * wall
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
            let after = sources / sinks;
            greatest = greatest.max((after - film[i]).abs());
            temperature[k] = after;
            // Eq. 14.17: fuel in the film.
            let emitted = self.faces.volatile_flux[face][i] * self.sheet.area[i] * self.faces.open[face][i];
            let leaves = self.leaving(row, emitted, unburnt[i]);
            let sources = row.storage / gas.heat_capacity * unburnt[i] + mass + emitted;
            let sinks = (row.storage + row.conductance) / gas.heat_capacity
                + row.outflow
                + leaves
                + burning.consumption
                + burning.escape;
            fuel[k] = sources / sinks.max(1e-30);
            // Eq. 14.19: run of the film since the foot.
            let warmth = ((film[i] - ambient) / span).clamp(0.0, 1.0);
            let goes_on = (burning.flame + begun * (4.0 * warmth).min(1.0)).min(1.0);
            let through = row.inflow.max(row.outflow);
            let sinks = through + row.carried * (1.0 - goes_on) / row.thickness;
            run[k] = if sinks > 0.0 { ((came + row.carried * goes_on) / sinks).min(2.0) } else { 0.0 };
        }
        greatest
    }

    /// Rate at which gas leaves the face for the plume, per mass fraction [kg/s]: what streams together from all sides,
    /// and what a film that is all fuel cannot hold.
    #[inline]
    fn leaving(&self, row: &Row, emitted: f64, fuel: f64) -> f64 {
        (row.inflow - row.outflow).max(0.0) + emitted * fuel * fuel
    }

    fn accept(&self, face: usize, state: &mut GasState, scratch: &Scratch) {
        for k in 0..scratch.active.len() {
            let i = scratch.active[k] as usize;
            state.temperature[face][i] = scratch.temperature[k];
            state.fuel[face][i] = scratch.fuel[k];
            state.run[face][i] = scratch.run[k];
        }
    }

    /// What the sheet gets of the film (Eq. 14.12, 14.13, 14.20).
    fn answer(
        &self,
        face: usize,
        state: &GasState,
        scratch: &Scratch,
        exchange: &mut FaceExchange,
        books: &mut GasBooks,
    ) {
        let (gas, ambient) = (&self.gas, self.gas.ambient);
        for i in 0..self.sheet.area.len() {
            if scratch.is_active[i] {
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
        for k in 0..scratch.active.len() {
            let (i, row) = (scratch.active[k] as usize, &scratch.rows[k]);
            let (film, fuel) = (state.temperature[face][i], state.fuel[face][i]);
            let (wall, open) = (self.faces.temperature[face][i], self.faces.open[face][i]);
            let area = self.sheet.area[i];
            let burning = self.burning(row, film, fuel, self.faces.pilot[face][i]);
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
            exchange.velocity[face][i] = scratch.velocity[i];
            let emitted = self.faces.volatile_flux[face][i] * area * open;
            let left = fuel * self.leaving(row, emitted, fuel);
            // A sheet of flame on both sides of what leaves burns it at the rate of diffusion.
            let rate = 2.0 * gas.conductivity / (gas.heat_capacity * row.thickness) * area.sqrt();
            exchange.flame_height[face][i] = row.thickness + left * burning.flame.max(0.05) / rate;
            books.fuel_in += emitted;
            books.fuel_burnt += fuel * burning.consumption;
            books.fuel_left += left + fuel * burning.escape;
            books.heat_to_sheet += area * convection;
            books.heat_radiated += area * radiation;
        }
    }
}
