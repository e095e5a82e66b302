//! Which nodes a scene means by a point, a corner, a side, a box, a painted group or a map.

use crate::build::{Built, Canvas, Source, image, sample_image, sheet_extent};
use crate::burn_mesh::BurnMap;
use crate::error::Error;
use crate::scene::{Corner, HalfSpace, Heater, Ignite, Pin, Point, Region, Side};
use crate::simulation::Inputs;
use glam::DVec3;

fn vector(point: &Point) -> DVec3 {
    DVec3::from_array(point.map(|length| length.0))
}

/// Collects the nodes that a row of a scene names, in ascending order, each once.
struct Selection<'a> {
    built: &'a Built,
    /// Key of the row, for errors.
    key: &'a str,
    /// Where the nodes are [m].
    positions: Vec<DVec3>,
    /// Where the nodes of a finer burn mesh lie on the motion mesh; empty for motion nodes.
    map: BurnMap,
    chosen: Vec<bool>,
}

impl<'a> Selection<'a> {
    fn of_motion_nodes(built: &'a Built, key: &'a str) -> Self {
        let positions = built.state.motion.position.clone();
        Self { built, key, chosen: vec![false; positions.len()], positions, map: BurnMap::default() }
    }

    fn of_burn_nodes(built: &'a Built, key: &'a str) -> Self {
        let mut map = BurnMap::default();
        map.lay_out(&built.state);
        let state = &built.state;
        let at = |i| map.interpolate(&state.triangles, &state.motion.position, i);
        let positions: Vec<DVec3> = (0..state.burn.len()).map(at).collect();
        Self { built, key, chosen: vec![false; positions.len()], positions, map }
    }

    fn by_index(&mut self, nodes: &[u32]) -> Result<(), Error> {
        let count = self.built.node_of_source.len();
        for node in nodes {
            let number = self.built.node_of_source.get(*node as usize).ok_or_else(|| {
                Error::scene(
                    format!("{}.nodes", self.key),
                    format!("there is no node {node}"),
                    format!("the sheet has nodes 0 to {}", count - 1),
                )
            })?;
            self.chosen[*number as usize] = true;
        }
        Ok(())
    }

    fn where_true(&mut self, inside: impl Fn(DVec3) -> bool) {
        for (chosen, position) in self.chosen.iter_mut().zip(&self.positions) {
            *chosen |= inside(*position);
        }
    }

    fn near(&mut self, point: DVec3, radius: f64) {
        if radius > 0.0 {
            self.where_true(|p| p.distance_squared(point) <= radius * radius);
        } else {
            let positions = &self.positions;
            let distance = |i: &usize| positions[*i].distance_squared(point);
            let nearest = (0..positions.len()).min_by(|i, j| distance(i).total_cmp(&distance(j)));
            if let Some(nearest) = nearest {
                self.chosen[nearest] = true;
            }
        }
    }

    fn corner(&mut self, corner: Corner, radius: f64) {
        let [right, top] = self.built.right_top;
        let (low, high) = sheet_extent(&self.positions, self.built.right_top);
        let x = if matches!(corner, Corner::BottomLeft | Corner::TopLeft) { low.x } else { high.x };
        let y = if matches!(corner, Corner::BottomLeft | Corner::BottomRight) { low.y } else { high.y };
        // The node nearest to the corner of the extent, seen along the sheet's normal.
        let distance = |p: DVec3| (p.dot(right) - x).powi(2) + (p.dot(top) - y).powi(2);
        let nearest = self.positions.iter().copied().min_by(|p, q| distance(*p).total_cmp(&distance(*q)));
        if let Some(nearest) = nearest {
            self.near(nearest, radius.max(f64::MIN_POSITIVE));
        }
    }

    fn edge(&mut self, side: Side) {
        let [right, top] = self.built.right_top;
        let (low, high) = sheet_extent(&self.positions, self.built.right_top);
        let reach = 1e-6 * (high - low).length();
        self.where_true(|p| match side {
            Side::Left => p.dot(right) <= low.x + reach,
            Side::Right => p.dot(right) >= high.x - reach,
            Side::Bottom => p.dot(top) <= low.y + reach,
            Side::Top => p.dot(top) >= high.y - reach,
        });
    }

    fn region(&mut self, region: &Region) {
        let (low, high) = (vector(&region.low), vector(&region.high));
        self.where_true(|p| p.cmpge(low).all() && p.cmple(high).all());
    }

    fn half_space(&mut self, half: &HalfSpace) {
        let (point, normal) = (vector(&half.point), DVec3::from_array(half.normal));
        self.where_true(|p| (p - point).dot(normal) < 0.0);
    }

    fn group(&mut self, name: &str) -> Result<(), Error> {
        let painted = self.built.painted.get(name).ok_or_else(|| {
            let names: Vec<_> = self.built.painted.keys().map(String::as_str).collect();
            let hint = if names.is_empty() {
                "the mesh has no painted attributes".to_owned()
            } else {
                format!("the mesh has: {}", names.join(", "))
            };
            Error::scene(format!("{}.group", self.key), format!("\"{name}\" is not painted on the mesh"), hint)
        })?;
        let painted: Vec<f64> = painted.iter().map(|value| f64::from(*value)).collect();
        for i in 0..self.chosen.len() {
            self.chosen[i] |= self.map.interpolate(&self.built.state.triangles, &painted, i) > 0.5;
        }
        Ok(())
    }

    fn finish(self) -> Result<Vec<u32>, Error> {
        let nodes: Vec<u32> = (0..self.chosen.len() as u32).filter(|i| self.chosen[*i as usize]).collect();
        if nodes.is_empty() {
            return Err(Error::scene(
                self.key,
                "it names no node of the sheet",
                "move or widen it (radius, box), or remove the row",
            ));
        }
        Ok(nodes)
    }
}

/// Nodes that row `row` of `[[pin]]` holds.
pub fn pinned(built: &Built, pin: &Pin, row: usize) -> Result<Vec<u32>, Error> {
    let key = format!("pin.{row}");
    let mut selection = Selection::of_motion_nodes(built, &key);
    selection.by_index(&pin.nodes)?;
    if let Some(region) = &pin.region {
        selection.region(region);
    }
    if let Some(side) = pin.edge {
        selection.edge(side);
    }
    if let Some(corner) = pin.corner {
        selection.corner(corner, pin.radius.0);
    }
    if let Some(point) = &pin.point {
        selection.near(vector(point), pin.radius.0);
    }
    if let Some(group) = &pin.group {
        selection.group(group)?;
    }
    selection.finish()
}

/// Burn nodes that row `row` of `[[heater]]` shines on; all of them if it names no place.
pub fn heated(built: &Built, heater: &Heater, row: usize) -> Result<Vec<u32>, Error> {
    let key = format!("heater.{row}");
    let mut selection = Selection::of_burn_nodes(built, &key);
    if heater.region.is_none() && heater.point.is_none() {
        selection.where_true(|_| true);
    }
    if let Some(region) = &heater.region {
        selection.region(region);
    }
    if let Some(point) = &heater.point {
        selection.near(vector(point), heater.radius.0);
    }
    selection.finish()
}

/// Burn nodes that row `row` of `[[ignite]]` lights.
pub fn ignited(built: &Built, inputs: &Inputs, ignite: &Ignite, row: usize) -> Result<Vec<u32>, Error> {
    let key = format!("ignite.{row}");
    let mut selection = Selection::of_burn_nodes(built, &key);
    selection.by_index(&ignite.nodes)?;
    if !ignite.names_a_place() {
        selection.where_true(|_| true);
    }
    if let Some(region) = &ignite.region {
        selection.region(region);
    }
    if let Some(half) = &ignite.half_space {
        selection.half_space(half);
    }
    if let Some(side) = ignite.edge {
        selection.edge(side);
    }
    if let Some(corner) = ignite.corner {
        selection.corner(corner, ignite.radius.0);
    }
    if let Some(point) = &ignite.point {
        selection.near(vector(point), ignite.radius.0);
    }
    if let Some(group) = &ignite.group {
        selection.group(group)?;
    }
    if let Some(path) = &ignite.map {
        let map = image(inputs, &format!("{key}.map"), path)?;
        for i in 0..selection.chosen.len() {
            selection.chosen[i] |= sample_image(map, built.burn_uv[i]) > 0.5;
        }
    }
    selection.finish()
}

/// How much later than its row says each of the nodes that row `row` of `[[ignite]]` lights is lit [s]; empty for nought.
pub fn delays(built: &Built, inputs: &Inputs, ignite: &Ignite, row: usize, nodes: &[u32]) -> Result<Vec<f64>, Error> {
    let Some(delay) = &ignite.delay else { return Ok(Vec::new()) };
    let key = format!("ignite.{row}.delay");
    let mut map = BurnMap::default();
    map.lay_out(&built.state);
    let Built { state, painted, burn_uv, .. } = built;
    let canvas = Canvas { inputs, state, painted, burn_uv, map: &map };
    let source = Source { key: &key, group: delay.group.as_deref(), map: delay.map.as_deref() };
    let values = canvas.at_burn_nodes(source)?;
    let times: Vec<f64> =
        nodes.iter().map(|i| delay.low.0 + (delay.high.0 - delay.low.0) * values[*i as usize]).collect();
    match times.iter().find(|time| !time.is_finite() || **time < 0.0) {
        Some(time) => Err(Error::scene(
            key,
            format!("the paint comes to a delay of {time} s somewhere"),
            "set `low` and `high` so that none is under 0",
        )),
        None => Ok(times),
    }
}
