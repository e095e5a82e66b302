//! Conduction along the sheet, with the grain.
//!
//! Model: linear finite elements with lumped heat capacity, in the coordinates of each triangle's grain (Eq. 15.2). Where
//! a weight is negative (obtuse in those coordinates) its flux runs from cold to hot; such fluxes are limited so that no
//! node passes the extremes of its neighbours [Kuzmin2009]. Converges at second order where the field is smooth, and
//! brings no new extremes anywhere. Valid when: the step is under `longest_step`. Cost: one pass over the links of the
//! nodes that are awake, a second over those that have a negative one.

use super::layout::{Layout, sides};
use crate::chemistry::Chemistry;
use crate::sheet::SheetState;
use glam::DVec3;

/// Least heat capacity that burning leaves of a node: ash and filler.
const LEAST_CAPACITY: f64 = 0.05; // tuned: ash of tissue and cotton is under 1 %, with char 10 %; a safety of the step

/// Conductances of the links of a [`Layout`], and what limits them.
#[derive(Debug, Clone, Default)]
pub(super) struct Conduction {
    /// Conductance of a square of sheet along and across the grain [W/K]: conductivity times thickness.
    pub sheet_conductance: [f64; 2],
    /// Of each link, may be negative [W/K].
    conductance: Vec<f64>,
    /// Whether a node has a negative link.
    limited: Vec<bool>,
    /// Part of the flux that each node may take in, and give, against the fall of temperature.
    rising: Vec<f64>,
    falling: Vec<f64>,
    longest_step: f64,
}

impl Conduction {
    /// Works the conductances out.
    pub fn build(&mut self, state: &SheetState, layout: &Layout, chemistry: &Chemistry) {
        let [along, across] = self.sheet_conductance;
        self.conductance.clear();
        self.conductance.resize(layout.to.len(), 0.0);
        let mut put = |[i, j]: [u32; 2], conductance: f64| {
            let thickness = 0.5 * (state.burn.thickness[i as usize] + state.burn.thickness[j as usize]);
            let conductance = conductance * thickness;
            for (from, to) in [(i, j), (j, i)] {
                let place = layout.links(from as usize).find(|l| layout.to[*l] == to).expect("both ends list a link");
                self.conductance[place] = conductance;
            }
        };
        if state.triangles.is_empty() {
            let edges = &state.burn_edges;
            for e in (0..edges.len()).filter(|e| edges.cut[*e] == 0) {
                put(edges.ends[e], along);
            }
        }
        for same in sides(state).chunk_by(|a, b| a.ends == b.ends) {
            let conductance = same.iter().map(|side| {
                let [p, q] = [state.rest.side_1[side.parent as usize], state.rest.side_2[side.parent as usize]];
                // Lengths count in the way that heat goes: shorter where it goes easily.
                let shrink = |v: DVec3| DVec3::new(v.x / along.sqrt(), v.y / across.sqrt(), 0.0);
                let points = [DVec3::ZERO, shrink(p), shrink(q)];
                let k = usize::from(side.opposite);
                let (u, v) = (points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k]);
                0.5 * (along * across).sqrt() * u.dot(v) / u.cross(v).length()
            });
            put(same[0].ends, conductance.sum());
        }
        self.limited.clear();
        let mut fastest = 0.0f64;
        for i in 0..state.burn.len() {
            let positive: f64 = layout.links(i).map(|l| self.conductance[l].max(0.0)).sum();
            self.limited.push(layout.links(i).any(|l| self.conductance[l] < 0.0));
            let dry_mass = state.front.dry_mass[i] + state.back.dry_mass[i];
            let capacity = chemistry.heat_capacity(&chemistry.layer(dry_mass).masses, chemistry.room().temperature);
            // The limiter lets through as much again as the positive links carry.
            fastest = fastest.max(2.0 * positive / (LEAST_CAPACITY * capacity));
        }
        self.rising.clear();
        self.rising.resize(state.burn.len(), 1.0);
        self.falling.clone_from(&self.rising);
        self.longest_step = 1.0 / fastest.max(f64::MIN_POSITIVE);
    }

    /// Longest step that brings no new extremes [s].
    pub fn longest_step(&self) -> f64 {
        if self.conductance.is_empty() { f64::INFINITY } else { self.longest_step }
    }

    /// Heat conducted into each node that is awake [W] (Eq. 15.2). All others are as warm as their neighbours.
    pub fn conduct(&mut self, temperature: &[f64], layout: &Layout, awake: &[u32], heat: &mut Vec<f64>) {
        heat.clear();
        for i in awake.iter().map(|i| *i as usize).filter(|i| self.limited[*i]) {
            let (mut most, mut least) = (0.0f64, 0.0f64);
            let (mut gains, mut losses, mut positive) = (0.0, 0.0, 0.0);
            for l in layout.links(i) {
                let difference = temperature[layout.to[l] as usize] - temperature[i];
                most = most.max(difference);
                least = least.min(difference);
                positive += self.conductance[l].max(0.0);
                if self.conductance[l] < 0.0 {
                    let flux = self.conductance[l] * difference;
                    gains += flux.max(0.0);
                    losses += flux.min(0.0);
                }
            }
            self.rising[i] = if gains > 0.0 { (positive * most / gains).min(1.0) } else { 1.0 };
            self.falling[i] = if losses < 0.0 { (positive * least / losses).min(1.0) } else { 1.0 };
        }
        for i in awake.iter().map(|i| *i as usize) {
            let here = temperature[i];
            let mut sum = 0.0;
            for l in layout.links(i) {
                let j = layout.to[l] as usize;
                let flux = self.conductance[l] * (temperature[j] - here);
                sum += if self.conductance[l] >= 0.0 {
                    flux
                } else if flux > 0.0 {
                    flux * self.rising[i].min(self.falling[j])
                } else {
                    flux * self.falling[i].min(self.rising[j])
                };
            }
            heat.push(sum);
        }
    }
}
