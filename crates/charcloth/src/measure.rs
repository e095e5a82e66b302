//! What is measured while a scene runs: probes, time histories, and the special states that verification starts from.

use crate::build::{Built, Lattice, sheet_extent};
use crate::contact::{Contacts, Surface};
use crate::error::Error;
use crate::frame::Sample;
use crate::registry::{self, Entry};
use crate::scene::{Point, Probe, Scene};
use crate::sheet::SheetState;
use crate::tear;
use crate::thermo::Burning;
use glam::DVec3;
use std::f64::consts::PI;

/// Watches a run and comes to a number.
pub trait Measure: Send {
    /// Called after every step.
    fn observe(&mut self, _built: &Built) {}
    /// The number so far; not a number while there is none.
    fn value(&self, built: &Built) -> f64;
}

/// Measures by the names of their probes.
pub type Probes = Vec<(String, Box<dyn Measure>)>;

/// Builds a measure from its row in the scene.
pub type Build = fn(&Probe, &Scene, &Built) -> Result<Box<dyn Measure>, Error>;

/// Every measure.
pub static MEASURES: &[Entry<Build>] = &[
    Entry {
        name: "front_speed",
        about: "distance over difference of ignition times between the nodes nearest to `from` and `to` [m/s]",
        item: front_speed,
    },
    Entry {
        name: "temperature_mode",
        about: "height of the insulated cosine mode `mode` of a grid over its height at the start [1]",
        item: temperature_mode,
    },
    Entry {
        name: "ignition_time",
        about: "when `node`, or the node nearest to `from`, catches fire [s]",
        item: ignition_time,
    },
    Entry { name: "burn_out_time", about: "time from ignition to burn-out of `node` [s]", item: burn_out_time },
    Entry { name: "temperature", about: "temperature of `node` at the end [K]", item: temperature },
    Entry {
        name: "displacement",
        about: "way of `node`, or of the node nearest to `from`, along `direction` since the start, at the end [m]",
        item: displacement,
    },
    Entry {
        name: "period",
        about: "mean period of the motion of `node`, or of the sine mode `mode` of a chain, along `direction` [s]",
        item: period,
    },
    Entry {
        name: "momentum_change",
        about: "change of the momentum of the whole sheet along `direction`, or its size [kg m/s]",
        item: momentum_change,
    },
];

/// Length of the longest column of a grid over its length at rest.
pub fn stretch(built: &Built) -> Option<f64> {
    let lattice = built.lattice.filter(|lattice| lattice.rows > 1)?;
    let position = &built.state.motion.position;
    let length = |column: usize| -> f64 {
        let node = |row: usize| position[row * lattice.columns + column];
        (1..lattice.rows).map(|row| node(row).distance(node(row - 1))).sum()
    };
    let longest = (0..lattice.columns).map(length).fold(0.0, f64::max);
    Some(longest / (lattice.spacing.y * (lattice.rows - 1) as f64))
}

/// Pairs of live triangles that cross each other.
pub fn intersecting_pairs(state: &SheetState) -> usize {
    let triangles = &state.triangles;
    let live: Vec<[u32; 3]> =
        (0..triangles.len()).filter(|t| triangles.alive[*t] != 0).map(|t| triangles.corners[t]).collect();
    let positions = &state.motion.position;
    // Crossing is of the surfaces themselves: thickness plays no part.
    Surface::sheet(positions.len(), &live, 0.0)
        .map_or(0, |surface| Contacts::build(surface, positions).intersecting_pairs(positions))
}

/// The measures of a scene, by name of the probe.
pub fn of_scene(scene: &Scene, built: &Built) -> Result<Probes, Error> {
    scene
        .probe
        .iter()
        .enumerate()
        .map(|(row, probe)| {
            let entry = registry::find(MEASURES, &probe.measure, &format!("probe.{row}.measure"))?;
            Ok((probe.name.clone(), (entry.item)(probe, scene, built)?))
        })
        .collect()
}

fn missing(probe: &Probe, key: &str) -> Error {
    Error::scene(
        format!("probe \"{}\"", probe.name),
        format!("the measure {} needs `{key}`", probe.measure),
        "add it to the row",
    )
}

fn vector(point: &Point) -> DVec3 {
    DVec3::from_array(point.map(|length| length.0))
}

/// The node that a probe names, or the one nearest to its point `from` at the start.
fn node_of(probe: &Probe, built: &Built) -> Result<usize, Error> {
    if let (None, Some(point)) = (probe.node, &probe.from) {
        return Ok(nearest(&built.state.motion.position, vector(point)));
    }
    let source = probe.node.ok_or_else(|| missing(probe, "node"))?;
    built
        .node_of_source
        .get(source as usize)
        .map(|node| *node as usize)
        .ok_or_else(|| Error::scene(format!("probe \"{}\"", probe.name), format!("there is no node {source}"), ""))
}

/// The burn node that a probe names, or the one nearest to its point `from` at the start.
fn burn_node_of(probe: &Probe, built: &Built) -> Result<usize, Error> {
    match (probe.node, &probe.from) {
        (None, Some(point)) => Ok(nearest(&built.state.burn_positions(), vector(point))),
        _ => Ok(built.state.burn_node(node_of(probe, built)?)),
    }
}

fn nearest(positions: &[DVec3], point: DVec3) -> usize {
    let distance = |i: &usize| positions[*i].distance_squared(point);
    (0..positions.len()).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap_or(0)
}

struct FrontSpeed {
    nodes: [usize; 2],
    distance: f64,
}

fn front_speed(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    let from = vector(probe.from.as_ref().ok_or_else(|| missing(probe, "from"))?);
    let to = vector(probe.to.as_ref().ok_or_else(|| missing(probe, "to"))?);
    let positions = &built.state.burn_positions();
    let nodes = [nearest(positions, from), nearest(positions, to)];
    let along = (to - from).normalize_or_zero();
    let distance = (positions[nodes[1]] - positions[nodes[0]]).dot(along);
    Ok(Box::new(FrontSpeed { nodes, distance }))
}

impl Measure for FrontSpeed {
    fn value(&self, built: &Built) -> f64 {
        let [first, last] = self.nodes.map(|i| built.state.burn.ignited_at[i]);
        if first < 0.0 || last < 0.0 { f64::NAN } else { self.distance / (last - first) }
    }
}

/// Shape of an insulated mode: cos(k pi (i + 1/2)/N) along each direction.
fn cosine_mode(lattice: Lattice, mode: [u32; 2], node: usize) -> f64 {
    let (i, j) = lattice.place(node);
    let part = |k: u32, index: usize, count: usize| (f64::from(k) * PI * (index as f64 + 0.5) / count as f64).cos();
    part(mode[0], i, lattice.columns) * part(mode[1], j, lattice.rows)
}

/// Shape of a mode between fixed ends: sin(k pi i/(N - 1)).
fn sine_mode(lattice: Lattice, mode: u32, node: usize) -> f64 {
    (f64::from(mode) * PI * lattice.place(node).0 as f64 / (lattice.columns - 1) as f64).sin()
}

fn lattice_of(built: &Built, key: &str) -> Result<Lattice, Error> {
    built.lattice.ok_or_else(|| {
        Error::scene(key, "modes are those of a grid or chain", "set sheet.shape = \"grid\" or \"chain\"")
    })
}

struct TemperatureMode {
    mode: [u32; 2],
    lattice: Lattice,
    ambient: f64,
    at_start: f64,
}

fn temperature_mode(probe: &Probe, scene: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    let mode = probe.mode.ok_or_else(|| missing(probe, "mode"))?;
    let lattice = lattice_of(built, &format!("probe \"{}\"", probe.name))?;
    let ambient = scene.fire.ambient_temperature.0;
    let mut measure = TemperatureMode { mode, lattice, ambient, at_start: 1.0 };
    measure.at_start = measure.height(&built.state);
    Ok(Box::new(measure))
}

impl TemperatureMode {
    fn height(&self, state: &SheetState) -> f64 {
        let temperature = &state.burn.temperature;
        (0..temperature.len()).map(|i| (temperature[i] - self.ambient) * cosine_mode(self.lattice, self.mode, i)).sum()
    }
}

impl Measure for TemperatureMode {
    fn value(&self, built: &Built) -> f64 {
        self.height(&built.state) / self.at_start
    }
}

struct BurnOutTime {
    node: usize,
    /// Fuel and time of the last look before burn-out, and of burn-out.
    burnt_out_at: f64,
    before: (f64, f64),
}

fn burn_out_time(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    Ok(Box::new(BurnOutTime { node: burn_node_of(probe, built)?, burnt_out_at: f64::NAN, before: (0.0, 0.0) }))
}

impl Measure for BurnOutTime {
    fn observe(&mut self, built: &Built) {
        let state = &built.state;
        let (fuel, time) = (state.burn.fuel[self.node], state.books.time[0]);
        if fuel > 0.0 {
            self.before = (fuel, time);
        } else if self.burnt_out_at.is_nan() {
            // The last fuel goes at the full rate, so the moment within the step is known.
            self.burnt_out_at = self.before.1 + self.before.0 / state.burn.burn_rate_full[self.node];
        }
    }

    fn value(&self, built: &Built) -> f64 {
        self.burnt_out_at - built.state.burn.ignited_at[self.node]
    }
}

struct IgnitionTime(usize);

fn ignition_time(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    Ok(Box::new(IgnitionTime(burn_node_of(probe, built)?)))
}

impl Measure for IgnitionTime {
    fn value(&self, built: &Built) -> f64 {
        let time = built.state.burn.ignited_at[self.0];
        if time < 0.0 { f64::NAN } else { time }
    }
}

struct NodeTemperature(usize);

fn temperature(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    Ok(Box::new(NodeTemperature(burn_node_of(probe, built)?)))
}

impl Measure for NodeTemperature {
    fn value(&self, built: &Built) -> f64 {
        built.state.burn.temperature[self.0]
    }
}

struct Displacement {
    node: usize,
    direction: DVec3,
    start: DVec3,
}

fn direction_of(probe: &Probe) -> Result<DVec3, Error> {
    let direction = DVec3::from_array(probe.direction.ok_or_else(|| missing(probe, "direction"))?);
    Ok(direction.normalize_or_zero())
}

fn displacement(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    let node = node_of(probe, built)?;
    let start = built.state.motion.position[node];
    Ok(Box::new(Displacement { node, direction: direction_of(probe)?, start }))
}

impl Measure for Displacement {
    fn value(&self, built: &Built) -> f64 {
        (built.state.motion.position[self.node] - self.start).dot(self.direction)
    }
}

struct Period {
    node: Option<usize>,
    mode: u32,
    lattice: Option<Lattice>,
    direction: DVec3,
    rest: Vec<DVec3>,
    before: Option<(f64, f64)>,
    upward: Vec<f64>,
}

fn period(probe: &Probe, _: &Scene, built: &Built) -> Result<Box<dyn Measure>, Error> {
    let node = probe.node.map(|_| node_of(probe, built)).transpose()?;
    if node.is_none() && probe.mode.is_none() {
        return Err(missing(probe, "node` or `mode"));
    }
    // Where the sheet would lie at rest: as the lattice was laid, before any wave was put on it.
    let rest = match probe.from {
        Some(point) => vec![vector(&point); built.state.motion.len()],
        None => built.state.motion.rest_position.clone(),
    };
    Ok(Box::new(Period {
        node,
        mode: probe.mode.map_or(0, |mode| mode[0]),
        lattice: built.lattice,
        direction: direction_of(probe)?,
        rest,
        before: None,
        upward: Vec::new(),
    }))
}

impl Measure for Period {
    fn observe(&mut self, built: &Built) {
        let away = |i: usize| (built.state.motion.position[i] - self.rest[i]).dot(self.direction);
        let now = match (self.node, self.lattice) {
            (Some(node), _) => away(node),
            (None, Some(lattice)) => (0..self.rest.len()).map(|i| away(i) * sine_mode(lattice, self.mode, i)).sum(),
            _ => return,
        };
        let time = built.state.books.time[0];
        if let Some((before, time_before)) = self.before
            && before < 0.0
            && now >= 0.0
        {
            self.upward.push(time_before + (time - time_before) * before / (before - now));
        }
        self.before = Some((now, time));
    }

    fn value(&self, _: &Built) -> f64 {
        match self.upward.as_slice() {
            [first, .., last] => (last - first) / (self.upward.len() - 1) as f64,
            _ => f64::NAN,
        }
    }
}

struct MomentumChange(Option<DVec3>);

fn momentum_change(probe: &Probe, _: &Scene, _: &Built) -> Result<Box<dyn Measure>, Error> {
    Ok(Box::new(MomentumChange(probe.direction.map(DVec3::from_array))))
}

impl Measure for MomentumChange {
    fn value(&self, built: &Built) -> f64 {
        let change = momentum(&built.state) - built.state.books.momentum_initial[0];
        self.0.map_or(change.length(), |direction| change.dot(direction.normalize_or_zero()))
    }
}

/// Momentum of the whole sheet [kg m/s].
pub fn momentum(state: &SheetState) -> DVec3 {
    (0..state.motion.len()).map(|i| state.motion.velocity[i] * state.mass(i)).sum()
}

/// Part of the area that has burnt: each node's area by the part of its fuel that is gone.
pub fn burnt_area_fraction(state: &SheetState) -> f64 {
    let burn = &state.burn;
    let burnt: f64 = (0..burn.len()).map(|i| burn.area[i] * (1.0 - burn.fuel[i] / burn.fuel_initial[i])).sum();
    burnt / burn.area.iter().sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Largest distance of the sheet from the plane it lay in, over its diagonal; what has come off does not count.
pub fn out_of_plane(built: &Built) -> f64 {
    let state = &built.state;
    let [right, top] = built.right_top;
    let normal = right.cross(top).normalize_or_zero();
    let (low, high) = sheet_extent(&state.motion.rest_position, [DVec3::X, DVec3::Y]);
    let shells = state.triangles.sheet.iter().max().map_or(0, |s| s + 1);
    let mut farthest = 0.0f64;
    for t in 0..state.triangles.len() {
        if state.triangles.alive[t] != 0 && state.triangles.piece[t] < shells {
            for i in state.triangles.corners[t] {
                let away = (state.motion.position[i as usize] - built.middle).dot(normal);
                farthest = farthest.max(away.abs());
            }
        }
    }
    farthest / (high - low).length().max(f64::MIN_POSITIVE)
}

/// The time-history row of the frame reached.
pub fn history(built: &Built, burning: &Burning, lit_first: &[u32]) -> Vec<Sample> {
    let state = &built.state;
    let (burn, books) = (&state.burn, &state.books);
    let burning_nodes = burn.burn_rate.iter().filter(|rate| **rate > 0.0).count();
    let burning_area: f64 = (0..burn.len()).filter(|i| burn.burn_rate[*i] > 0.0).map(|i| burn.area[i]).sum();
    let rest_position = state.burn_rest_positions();
    let origin = lit_first.iter().map(|i| rest_position[*i as usize]).sum::<DVec3>() / (lit_first.len().max(1) as f64);
    let front = (0..burn.len())
        .filter(|i| burn.ignited_at[*i] >= 0.0)
        .map(|i| rest_position[i].distance(origin))
        .fold(0.0, f64::max);
    let hottest = burn.temperature.iter().copied().fold(0.0, f64::max);
    let fuel: f64 = burn.fuel.iter().sum();
    let inert: f64 = state.motion.inert_mass.iter().sum();
    let sample = |name, unit, value| Sample { name, unit, value };
    vec![
        sample("heat_release_rate", "W", burn.burn_rate.iter().sum::<f64>() * burning.heat_of_combustion()),
        sample("heat_released", "J", books.heat_released[0]),
        sample("mass", "kg", fuel + inert),
        sample("fuel", "kg", fuel),
        sample("fuel_burnt", "kg", books.fuel_burnt[0]),
        sample("burning_nodes", "1", burning_nodes as f64),
        sample("burning_area", "m2", burning_area),
        sample("burnt_area_fraction", "1", burnt_area_fraction(state)),
        sample("front_position", "m", if lit_first.is_empty() { 0.0 } else { front }),
        sample("temperature_max", "K", hottest),
        sample("pieces", "1", tear::pieces(state) as f64),
        sample("particles", "1", state.particles.len() as f64),
        sample("mass_of_particles", "kg", state.particles.mass.iter().sum()),
        sample("springs_broken", "1", state.springs.broken.iter().filter(|b| **b != 0).count() as f64),
        sample("strain_max", "1", books.strain_max[0]),
        sample("out_of_plane", "1", out_of_plane(built)),
    ]
}

/// Puts the sheet into the state that `[initial]` asks for.
pub fn set_initial(scene: &Scene, built: &mut Built) -> Result<(), Error> {
    let initial = &scene.initial;
    let lattice = match (&initial.temperature_wave, &initial.displacement_wave) {
        (None, None) => None,
        _ => Some(lattice_of(built, "initial")?),
    };
    let middle = built.middle;
    let SheetState { motion, burn, .. } = &mut built.state;
    for i in 0..motion.len() {
        if let Some(scale) = initial.stretch {
            motion.position[i] = middle + (motion.position[i] - middle) * DVec3::from_array(scale);
        }
        if motion.pinned[i] == 0 {
            motion.velocity[i] = DVec3::from_array(initial.velocity.map(|speed| speed.0));
        }
        if let Some(lattice) = lattice {
            if let Some(wave) = &initial.temperature_wave {
                let b = motion.burn_node[i] as usize;
                burn.temperature[b] += wave.amplitude.0 * cosine_mode(lattice, wave.mode, i);
                burn.peak_temperature[b] = burn.peak_temperature[b].max(burn.temperature[b]);
            }
            if let Some(wave) = &initial.displacement_wave {
                motion.position[i] += vector(&wave.amplitude) * sine_mode(lattice, wave.mode, i);
            }
        }
    }
    Ok(())
}
