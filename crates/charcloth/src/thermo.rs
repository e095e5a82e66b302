//! Heat and fuel: from heat flows to temperatures, and from temperatures to fuel burnt.
//!
//! Model: Eq. 1.5 to 1.7, explicit Euler, with the crossing of the ignition temperature and the moment of burn-out found
//! within the step. Source: the 2004 sketch, S2 to S5 [Moidu2004]. Valid when: the step is below C_i / sum_j k_ij, so that
//! no new extremes appear (`longest_step`). Cost: one pass over the nodes.

use crate::effects::HeatRates;
use crate::kernels::VectorUnit;
use crate::scene::{Fire, HeatCapacityLaw, Scene};
use crate::sheet::{Books, BurnNodes, SheetState};
use std::ops::Range;

/// Most nodes worked on by one thread at a time. The halving of the nodes down to this does not depend on the number
/// of threads, so neither do the sums.
const CHUNK: usize = 4096;

/// Nodes looked at together, to see whether any burns; sums go by place in the block, and the places are added last.
const BLOCK: usize = 16;

/// What burning needs to know of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Burning {
    /// T0 [K].
    ignition_temperature: f64,
    /// k2 [J/kg].
    heat_of_combustion: f64,
    /// [K]
    ambient: f64,
    law: HeatCapacityLaw,
    ash_capacity: f64,
    ignite_within_step: bool,
}

/// When a step begins, how long it is, and how it is worked out.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// Simulated time at its beginning [s].
    pub time: f64,
    /// Its length [s].
    pub dt: f64,
    /// Vector unit to use.
    pub unit: VectorUnit,
    /// Whether to share the work among threads.
    pub parallel: bool,
}

/// What one step adds to the books.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    fuel_burnt: f64,
    heat_lost: f64,
    heat_carried: f64,
}

impl std::ops::Add for Sums {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            fuel_burnt: self.fuel_burnt + other.fuel_burnt,
            heat_lost: self.heat_lost + other.heat_lost,
            heat_carried: self.heat_carried + other.heat_carried,
        }
    }
}

/// A range of nodes: what a step changes, and what it reads.
struct Nodes<'a> {
    temperature: &'a mut [f64],
    fuel: &'a mut [f64],
    burn_rate: &'a mut [f64],
    heat_released: &'a mut [f64],
    peak_temperature: &'a mut [f64],
    ignited_at: &'a mut [f64],
    heat_capacity: &'a [f64],
    fuel_initial: &'a [f64],
    burn_rate_full: &'a [f64],
    within: &'a [f64],
    /// None where no effect loses heat.
    lost: Option<&'a [f64]>,
}

impl<'a> Nodes<'a> {
    fn split_at(self, middle: usize) -> (Self, Self) {
        macro_rules! halves {
            ($($changed:ident)*; $($read:ident)*) => {{
                $(let $changed = self.$changed.split_at_mut(middle);)*
                $(let $read = self.$read.split_at(middle);)*
                let lost = self.lost.map(|lost| lost.split_at(middle)).unzip();
                (
                    Self { lost: lost.0, $($changed: $changed.0,)* $($read: $read.0,)* },
                    Self { lost: lost.1, $($changed: $changed.1,)* $($read: $read.1,)* },
                )
            }};
        }
        halves!(temperature fuel burn_rate heat_released peak_temperature ignited_at;
                heat_capacity fuel_initial burn_rate_full within)
    }
}

impl Burning {
    /// Reads the scene.
    pub fn of(scene: &Scene) -> Self {
        let Fire { raw, .. } = &scene.fire;
        let k2 = raw.as_ref().and_then(|raw| raw.k2).unwrap_or(scene.fire.heat_of_combustion);
        Self {
            ignition_temperature: scene.fire.ignition_temperature.0,
            heat_of_combustion: k2.0,
            ambient: scene.fire.ambient_temperature.0,
            law: scene.fire.heat_capacity_law,
            ash_capacity: scene.fire.ash_capacity.0,
            ignite_within_step: scene.fire.ignite_within_step,
        }
    }

    /// Whether heat is conserved: under the literal law a burnt node is a reservoir of fixed temperature.
    pub fn conserves_energy(&self) -> bool {
        self.law != HeatCapacityLaw::Literal
    }

    /// Whether burning changes the heat capacity of a node.
    pub fn changes_capacity(&self) -> bool {
        self.law != HeatCapacityLaw::Constant
    }

    /// Heat capacity of a node with this fuel [J/K] (Eq. 1.5 a to c).
    #[inline]
    fn heat_capacity(&self, capacity_full: f64, fuel: f64, fuel_initial: f64) -> f64 {
        match self.law {
            HeatCapacityLaw::Constant => capacity_full,
            HeatCapacityLaw::Inverse => capacity_full * (fuel / fuel_initial).max(self.ash_capacity),
            // dT/dt = k3 m dQ/dt, read as a capacity: without fuel nothing warms the node any more.
            HeatCapacityLaw::Literal => capacity_full * fuel_initial / fuel,
        }
    }

    /// Heat capacity of a node as it is [J/K].
    pub fn capacity_of(&self, burn: &BurnNodes, node: usize) -> f64 {
        self.heat_capacity(burn.heat_capacity[node], burn.fuel[node], burn.fuel_initial[node])
    }

    /// Heat in the sheet over ambient [J].
    pub fn heat_content(&self, burn: &BurnNodes) -> f64 {
        (0..burn.len()).map(|i| self.capacity_of(burn, i) * (burn.temperature[i] - self.ambient)).sum()
    }

    /// Heat that a mass of fuel gives [J/kg].
    pub fn heat_of_combustion(&self) -> f64 {
        self.heat_of_combustion
    }

    /// Longest step without new extremes [s]: the least C_i / sum_j k_ij (Eq. 1.8).
    pub fn longest_step(&self, burn: &BurnNodes, stiffness: &[f64]) -> f64 {
        let mut fastest = [0.0f64; BLOCK];
        let mut look = |place: usize, rate: f64| {
            if rate > fastest[place] {
                fastest[place] = rate;
            }
        };
        let (blocks, _) = stiffness.as_chunks::<BLOCK>();
        let (capacities, _) = burn.heat_capacity.as_chunks::<BLOCK>();
        let mut done = 0;
        if self.law == HeatCapacityLaw::Constant {
            // The usual law, and a division a node: in blocks, for the vector unit.
            for (stiffness, capacity) in blocks.iter().zip(capacities) {
                for k in 0..BLOCK {
                    look(k, stiffness[k] / capacity[k]);
                }
            }
            done = blocks.len() * BLOCK;
        }
        for i in done..burn.len() {
            look(i % BLOCK, stiffness[i] / self.capacity_of(burn, i));
        }
        1.0 / fastest.into_iter().fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Advances temperature and fuel by a step under the given heat flows, and keeps the books.
    pub fn advance(&self, state: &mut SheetState, rates: &HeatRates, moment: Moment) {
        let BurnNodes {
            temperature,
            fuel,
            fuel_initial,
            burn_rate_full,
            burn_rate,
            heat_capacity,
            heat_released,
            peak_temperature,
            ignited_at,
            ..
        } = &mut state.burn;
        let nodes = Nodes {
            temperature,
            fuel,
            burn_rate,
            heat_released,
            peak_temperature,
            ignited_at,
            heat_capacity,
            fuel_initial,
            burn_rate_full,
            within: &rates.within,
            lost: (!rates.lost.is_empty()).then_some(&rates.lost[..]),
        };
        let sums = self.advance_range(nodes, moment);
        let Books { fuel_burnt, heat_released, heat_lost, heat_carried, .. } = &mut state.books;
        fuel_burnt[0] += sums.fuel_burnt;
        heat_released[0] += sums.fuel_burnt * self.heat_of_combustion;
        heat_lost[0] += sums.heat_lost;
        heat_carried[0] += sums.heat_carried;
    }

    fn advance_range(&self, nodes: Nodes<'_>, moment: Moment) -> Sums {
        let count = nodes.temperature.len();
        if count <= CHUNK {
            #[cfg(target_arch = "x86_64")]
            if moment.unit >= VectorUnit::Avx2 {
                // SAFETY: `VectorUnit::best` and `available` only name what the processor was found to have.
                return unsafe { self.advance_chunk_avx2(nodes, moment) };
            }
            return self.advance_chunk(nodes, moment);
        }
        let (low, high) = nodes.split_at((count / 2).next_multiple_of(64));
        let (low, high) = if moment.parallel {
            rayon::join(|| self.advance_range(low, moment), || self.advance_range(high, moment))
        } else {
            (self.advance_range(low, moment), self.advance_range(high, moment))
        };
        low + high
    }

    /// The same code, compiled for wider vectors: each operation is rounded alike.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_chunk_avx2(&self, nodes: Nodes<'_>, moment: Moment) -> Sums {
        self.advance_chunk(nodes, moment)
    }

    #[inline(always)]
    fn advance_chunk(&self, mut nodes: Nodes<'_>, moment: Moment) -> Sums {
        let Moment { time, dt, .. } = moment;
        let mut sums = Sums::default();
        let mut heat_lost = [0.0; BLOCK];
        let count = nodes.temperature.len();
        for first in (0..count).step_by(BLOCK) {
            if !self.warm_block(&mut nodes, first, dt, &mut heat_lost) {
                self.burn_block(&mut nodes, first..count.min(first + BLOCK), time, dt, &mut heat_lost, &mut sums);
            }
        }
        sums.heat_lost += heat_lost.iter().sum::<f64>();
        sums
    }

    /// Advances a full block in which no node burns; returns whether it was one. The same operations as for any other,
    /// without a branch a node.
    #[inline(always)]
    fn warm_block(&self, nodes: &mut Nodes<'_>, first: usize, dt: f64, heat_lost: &mut [f64; BLOCK]) -> bool {
        macro_rules! block {
            ($($column:ident)*) => {$(
                let Some($column) = nodes.$column.get(first..first + BLOCK) else { return false };
                let Ok($column) = <&[f64; BLOCK]>::try_from($column) else { return false };
            )*};
        }
        block!(temperature heat_capacity within peak_temperature);
        let capacity: [f64; BLOCK] = match self.law {
            HeatCapacityLaw::Constant => *heat_capacity,
            HeatCapacityLaw::Inverse => {
                block!(fuel fuel_initial);
                std::array::from_fn(|k| self.heat_capacity(heat_capacity[k], fuel[k], fuel_initial[k]))
            }
            HeatCapacityLaw::Literal => return false,
        };
        let mut lost = [0.0; BLOCK];
        if let Some(rates) = nodes.lost {
            lost.copy_from_slice(&rates[first..first + BLOCK]);
        }
        let threshold = self.ignition_temperature;
        let mut unlit = [0.0; BLOCK];
        let (mut rises, mut warm) = (0u64, 0u64);
        for k in 0..BLOCK {
            unlit[k] = temperature[k] + (dt * within[k] - dt * lost[k]) / capacity[k]; // Eq. 1.5
            rises |= u64::from(unlit[k] > peak_temperature[k]);
            warm |= u64::from(!((peak_temperature[k] <= threshold) & (unlit[k] <= threshold)));
        }
        // Where no node has ever been over the threshold, none has burnt: no need to look at its fuel.
        let mut burnt = 0u64;
        if warm != 0 {
            block!(fuel burn_rate);
            let mut burns = 0u64;
            for k in 0..BLOCK {
                let cold = (temperature[k] <= threshold) & (unlit[k] <= threshold);
                burns |= u64::from(!(cold | (fuel[k] == 0.0)));
                burnt |= u64::from(burn_rate[k] != 0.0);
            }
            if burns != 0 {
                return false;
            }
        }
        for (sum, lost) in heat_lost.iter_mut().zip(lost) {
            *sum += dt * lost;
        }
        nodes.temperature[first..first + BLOCK].copy_from_slice(&unlit);
        // What stays as it is need not go back to memory.
        if rises != 0 {
            for (peak, unlit) in nodes.peak_temperature[first..first + BLOCK].iter_mut().zip(unlit) {
                *peak = if unlit > *peak { unlit } else { *peak };
            }
        }
        if burnt != 0 {
            nodes.burn_rate[first..first + BLOCK].fill(0.0);
        }
        true
    }

    fn burn_block(
        &self,
        nodes: &mut Nodes<'_>,
        block: Range<usize>,
        time: f64,
        dt: f64,
        heat_lost: &mut [f64; BLOCK],
        sums: &mut Sums,
    ) {
        let threshold = self.ignition_temperature;
        for (place, i) in block.enumerate() {
            let (fuel, before) = (nodes.fuel[i], nodes.temperature[i]);
            let lost = dt * nodes.lost.map_or(0.0, |lost| lost[i]);
            heat_lost[place] += lost;
            if fuel == 0.0 && self.law == HeatCapacityLaw::Literal {
                nodes.burn_rate[i] = 0.0;
                continue;
            }
            let capacity = self.heat_capacity(nodes.heat_capacity[i], fuel, nodes.fuel_initial[i]);
            let unlit = before + (dt * nodes.within[i] - lost) / capacity; // Eq. 1.5
            if (before <= threshold && unlit <= threshold) || fuel == 0.0 {
                nodes.temperature[i] = unlit;
                nodes.peak_temperature[i] = nodes.peak_temperature[i].max(unlit);
                nodes.burn_rate[i] = 0.0;
                continue;
            }
            // Eq. 1.9: part of the step for which the node burns, all of it or what is left after it crosses T0.
            let burning = if before > threshold {
                1.0
            } else if self.ignite_within_step {
                (unlit - threshold) / (unlit - before)
            } else {
                0.0
            };
            // Eq. 1.6: at the full rate until nothing is left.
            let burnt = (nodes.burn_rate_full[i] * burning * dt).min(fuel);
            let heat = burnt * self.heat_of_combustion; // Eq. 1.7
            let after = unlit + heat / capacity;
            nodes.fuel[i] = fuel - burnt;
            nodes.burn_rate[i] = burnt / dt;
            nodes.heat_released[i] += heat;
            nodes.temperature[i] = after;
            nodes.peak_temperature[i] = nodes.peak_temperature[i].max(after);
            if nodes.ignited_at[i] < 0.0 && burnt > 0.0 {
                nodes.ignited_at[i] = time + (1.0 - burning) * dt;
            }
            sums.fuel_burnt += burnt;
            if self.law == HeatCapacityLaw::Inverse {
                let left = self.heat_capacity(nodes.heat_capacity[i], nodes.fuel[i], nodes.fuel_initial[i]);
                sums.heat_carried += (capacity - left) * (after - self.ambient);
            }
        }
    }
}
