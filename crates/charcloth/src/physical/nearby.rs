//! Faces close to others: what lies in front of a face keeps air from it and trades heat with it.
//!
//! Model: Eq. 15.10, the part of a face that air reaches by the gap before it; Eq. 15.11, conduction through the gas of the gap
//! and radiation between parallel grey faces [Incropera2007]. Valid when: faces lie about parallel, and gaps change little from
//! one frame to the next: they are looked for once a frame and after tears. Flames of one sheet do not lick another across
//! wider gaps. Cost: a sort of the nodes a frame, a few operations a close pair and step.

use crate::burn_mesh::BurnMap;
use crate::contact::scenery::Plane;
use crate::gases::properties::{STEFAN_BOLTZMANN, conductivity};
use crate::gases::{FACES, PerFace};
use crate::sheet::{NONE, SheetState};
use glam::{DVec3, I64Vec3};
use rayon::prelude::*;

/// Gap from which on air reaches all of a face [m]. // tuned: two films of a foot of flame and some more; 2 to 10 mm
const REACH: f64 = 5e-3;
/// Gap under which none does, and no smaller one is told apart [m]. // tuned: layers that touch are uneven; 0.1 to 1 mm
const CLOSED: f64 = 3e-4;
/// Faces that differ by less from the room trade no heat [K].
const COLD: f64 = 1.0;

/// A face and what lies before it.
#[derive(Debug, Clone, Copy)]
struct Pair {
    node: u32,
    face: u8,
    /// Node and face across the gap; no node where it is a plane.
    other: u32,
    other_face: u8,
    gap: f64,
}

/// What lies before each face, and the heat that crosses.
#[derive(Debug, Clone, Default)]
pub(super) struct Nearby {
    planes: Vec<Plane>,
    pairs: Vec<Pair>,
    /// Pairs across which heat flows in this step.
    live: Vec<u32>,
    /// Heat into each face [W].
    heat: PerFace<f64>,
    /// Number of those pairs at each face.
    partners: PerFace<f64>,
    /// Nodes that it reaches or comes from, some more than once.
    pub reached: Vec<u32>,
    /// Whether a node is to be awake for what lies before it.
    stirred: Vec<bool>,
    cells: Vec<(I64Vec3, u32)>,
}

/// What is known of a sheet in a search.
struct Search<'a> {
    position: &'a [DVec3],
    normal: &'a [DVec3],
    rest: &'a [DVec3],
    sheet: &'a [u32],
    cells: &'a [(I64Vec3, u32)],
    /// Side of a cell, and how far from straight before it another node may be [m].
    side: f64,
    aside: f64,
}

impl Nearby {
    /// Gives it the planes that faces may lie on.
    pub fn meet(&mut self, planes: &[Plane]) {
        self.planes = planes.to_vec();
    }

    /// Finds what lies before each face at a time [s], with burn nodes at these places and with these normals, and closes
    /// what it keeps the air from.
    pub fn look(
        &mut self,
        state: &SheetState,
        map: &BurnMap,
        [position, normal]: [&[DVec3]; 2],
        time: f64,
        open: &mut PerFace<f64>,
    ) {
        let count = state.burn.len();
        let at_rest = |i| map.interpolate(&state.triangles, &state.motion.rest_position, i);
        let rest: Vec<DVec3> = (0..count).map(at_rest).collect();
        let sheet_of = |i: usize| match map.parent.get(i) {
            Some(parent) => state.triangles.sheet[*parent as usize],
            None => state.motion.sheet[i],
        };
        let sheet: Vec<u32> = (0..count).map(sheet_of).collect();
        let alive = |i: usize| normal[i] != DVec3::ZERO;
        let area: f64 = state.burn.area.iter().sum();
        let aside = (area / count.max(1) as f64).sqrt();
        let side = REACH.hypot(aside);
        self.cells.clear();
        self.cells.extend((0..count).filter(|i| alive(*i)).map(|i| (cell(position[i], side), i as u32)));
        self.cells.par_sort_unstable_by_key(|(cell, i)| (cell.to_array(), *i));
        let search = Search { position, normal, rest: &rest, sheet: &sheet, cells: &self.cells, side, aside };
        let found: Vec<[Option<Pair>; FACES]> = (0..count)
            .into_par_iter()
            .map(|i| if alive(i) { self.planes_before(search.before(i), i, &search, time) } else { [None; FACES] })
            .collect();
        self.pairs.clear();
        for pair in found.into_iter().flatten().flatten() {
            let part = ((pair.gap - CLOSED) / (REACH - CLOSED)).clamp(0.0, 1.0); // Eq. 15.10
            open[usize::from(pair.face)][pair.node as usize] *= part;
            self.pairs.push(pair);
        }
        for column in self.heat.iter_mut().chain(&mut self.partners) {
            column.clear();
            column.resize(count, 0.0);
        }
        self.stirred.clear();
        self.stirred.resize(count, false);
        self.live.clear();
        self.reached.clear();
    }

    /// The same, or a plane that is nearer.
    fn planes_before(
        &self,
        mut before: [Option<Pair>; FACES],
        node: usize,
        search: &Search<'_>,
        time: f64,
    ) -> [Option<Pair>; FACES] {
        for plane in &self.planes {
            let gap = (search.position[node] - plane.place(time)).dot(plane.normal).max(0.0);
            // It lies before the face that looks down on it.
            let face = u8::from(search.normal[node].dot(plane.normal) > 0.0);
            let slot = &mut before[usize::from(face)];
            if gap < REACH && slot.is_none_or(|pair| gap < pair.gap) {
                *slot = Some(Pair { node: node as u32, face, other: NONE, other_face: 0, gap });
            }
        }
        before
    }

    /// Finds the pairs across which heat flows, and the nodes that it reaches.
    pub fn wake(&mut self, temperature: [&[f64]; FACES], room: f64) {
        for i in self.reached.drain(..) {
            self.stirred[i as usize] = false;
            self.heat.iter_mut().chain(&mut self.partners).for_each(|column| column[i as usize] = 0.0);
        }
        self.live.clear();
        let hot = |i: u32, face: u8| i != NONE && (temperature[usize::from(face)][i as usize] - room).abs() > COLD;
        for (k, pair) in self.pairs.iter().enumerate() {
            if hot(pair.node, pair.face) || hot(pair.other, pair.other_face) {
                self.live.push(k as u32);
                self.partners[usize::from(pair.face)][pair.node as usize] += 1.0;
                if pair.other != NONE {
                    self.partners[usize::from(pair.other_face)][pair.other as usize] += 1.0;
                }
                for i in [pair.node, pair.other].into_iter().filter(|i| *i != NONE) {
                    self.stirred[i as usize] = true;
                    self.reached.push(i);
                }
            }
        }
    }

    /// Whether a node is reached by heat across a gap.
    pub fn stirs(&self, node: usize) -> bool {
        self.stirred.get(node).is_some_and(|stirred| *stirred)
    }

    /// Heat across the gap into a face [W].
    pub fn heat(&self, face: usize, node: usize) -> f64 {
        self.heat[face].get(node).copied().unwrap_or(0.0)
    }

    /// Lets heat flow for a step [s] (Eq. 15.11): what one face gives, the other gets; a plane stays at the temperature of the
    /// room. `capacity` is that of a face of a node [J/K], of which each of its pairs has an equal part, and with that goes to
    /// its end as two bodies do by themselves: so no face gets hotter or colder than those around it, in any step.
    pub fn trade(
        &mut self,
        temperature: [&[f64]; FACES],
        capacity: impl Fn(usize, usize) -> f64,
        area: &[f64],
        [emissivity, room, dt]: [f64; 3],
    ) {
        let grey = 1.0 / (2.0 / emissivity - 1.0);
        for k in &self.live {
            let Pair { node, face, other, other_face, gap } = self.pairs[*k as usize];
            let (node, face, other_face) = (node as usize, usize::from(face), usize::from(other_face));
            let here = temperature[face][node];
            let there = if other == NONE { room } else { temperature[other_face][other as usize] };
            let radiation = grey * STEFAN_BOLTZMANN * (here * here + there * there) * (here + there);
            let exchange = area[node] * (conductivity(0.5 * (here + there)) / gap.max(CLOSED) + radiation);
            let own = capacity(face, node) / self.partners[face][node];
            if other == NONE {
                self.heat[face][node] += until(exchange, own, dt) * (there - here);
            } else {
                let theirs = capacity(other_face, other as usize) / self.partners[other_face][other as usize];
                let both = own * theirs / (own + theirs).max(f64::MIN_POSITIVE);
                // Seen from both sides, each counts for half.
                let heat = until(0.5 * exchange, both, dt) * (there - here);
                self.heat[face][node] += heat;
                self.heat[other_face][other as usize] -= heat;
            }
        }
    }
}

/// Mean exchange [W/K] over a step of what exchanges so much, with a heat capacity [J/K] that limits it, by the first difference of
/// temperature.
fn until(exchange: f64, capacity: f64, dt: f64) -> f64 {
    -capacity / dt * (-exchange * dt / capacity.max(f64::MIN_POSITIVE)).exp_m1()
}

fn cell(point: DVec3, side: f64) -> I64Vec3 {
    (point / side).floor().as_i64vec3()
}

impl Search<'_> {
    /// The nearest node before each face of a node, of another sheet or from far along its own.
    fn before(&self, node: usize) -> [Option<Pair>; FACES] {
        let (from, normal) = (self.position[node], self.normal[node]);
        let mut nearest: [Option<Pair>; FACES] = [None; FACES];
        let middle = cell(from, self.side);
        for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
            let low = (middle + I64Vec3::new(dx, dy, -1)).to_array();
            let high = (middle + I64Vec3::new(dx, dy, 1)).to_array();
            let first = self.cells.partition_point(|(cell, _)| cell.to_array() < low);
            for (_, other) in self.cells[first..].iter().take_while(|(cell, _)| cell.to_array() <= high) {
                let j = *other as usize;
                let way = self.position[j] - from;
                let along = way.dot(normal);
                let far_along = self.sheet[j] != self.sheet[node]
                    || self.rest[j].distance_squared(self.rest[node]) > (4.0 * REACH).powi(2);
                let gap = along.abs();
                if !far_along || gap > REACH || (way - along * normal).length() > self.aside {
                    continue;
                }
                let slot = &mut nearest[usize::from(along < 0.0)];
                if slot.is_none_or(|pair| gap < pair.gap) {
                    let other_face = u8::from(self.normal[j].dot(way) > 0.0);
                    let face = u8::from(along < 0.0);
                    *slot = Some(Pair { node: node as u32, face, other: *other, other_face, gap });
                }
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two nodes a millimetre apart, the first hot in front, which faces the back of the second.
    fn pair() -> Nearby {
        let towards = Pair { node: 0, face: 0, other: 1, other_face: 1, gap: 1e-3 };
        let back = Pair { node: 1, face: 1, other: 0, other_face: 0, gap: 1e-3 };
        Nearby {
            pairs: vec![towards, back],
            heat: [vec![0.0; 2], vec![0.0; 2]],
            partners: [vec![0.0; 2], vec![0.0; 2]],
            stirred: vec![false; 2],
            ..Nearby::default()
        }
    }

    #[test]
    fn what_one_face_gives_the_other_gets() {
        let mut nearby = pair();
        let (front, back) = ([800.0, 293.15], [293.15, 293.15]);
        let temperature = [front.as_slice(), &back];
        nearby.wake(temperature, 293.15);
        assert_eq!(nearby.reached, [0, 1, 1, 0]);
        assert!(nearby.stirs(0) && nearby.stirs(1));
        nearby.trade(temperature, |_, _| 1.0, &[1e-6, 2e-6], [1.0, 293.15, 1e-9]);
        // Each side sees an area of its own; the mean is what crosses, in a step too short for it to matter.
        let exchange = conductivity(0.5 * (800.0 + 293.15)) / 1e-3
            + STEFAN_BOLTZMANN * (800.0f64.powi(2) + 293.15f64.powi(2)) * (800.0 + 293.15);
        let expected = 1.5e-6 * exchange * (800.0 - 293.15);
        assert!((nearby.heat(1, 1) / expected - 1.0).abs() < 1e-12, "{} W", nearby.heat(1, 1));
        assert_eq!(nearby.heat(0, 0), -nearby.heat(1, 1));
        assert_eq!([nearby.heat(0, 1), nearby.heat(1, 0)], [0.0; 2]);
        // However long the step and light the faces, they meet at the mean by their capacities, and get no farther.
        let capacity = |face: usize, node: usize| if (face, node) == (0, 0) { 2e-9 } else { 1e-9 };
        nearby.wake(temperature, 293.15);
        nearby.trade(temperature, capacity, &[1e-6, 2e-6], [1.0, 293.15, 0.014]);
        let met =
            |face: usize, node: usize| temperature[face][node] + nearby.heat(face, node) * 0.014 / capacity(face, node);
        let mean = (2.0 * 800.0 + 293.15) / 3.0;
        assert!((met(0, 0) - mean).abs() < 1e-6 && (met(1, 1) - mean).abs() < 1e-6, "{} {}", met(0, 0), met(1, 1));
        // Once cold, nothing flows and nobody is called.
        nearby.wake([&[293.15; 2], &[293.15; 2]], 293.15);
        assert_eq!(nearby.reached.len(), 0);
        assert!(!nearby.stirs(0) && nearby.heat(1, 1) == 0.0);
    }
}
