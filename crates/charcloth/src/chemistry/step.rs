//! One half-layer through one step: substeps as long as an estimate of their error allows.
//!
//! Model: within a substep the temperature goes from its start to an end that is solved for; each reaction advances by
//! its closed form for the integral of k over that path, in a symmetric sweep (Eq. 13.9); the end follows from the heat
//! balance (Eq. 13.10). Valid when: any step; masses stay positive and the books close whatever the step. Cost: two or
//! three sweeps a substep.

use super::{Chemistry, Kind, Layer, REACTIONS, Released, Surroundings, over_reference};
use crate::substances::{Masses, REFERENCE_TEMPERATURE, SUBSTANCES, Substance};

/// What is left of a reactant below this part of the dry mass goes with the rest, for no tail lasts for ever.
const LAST: f64 = 1e-12;

/// No layer gets colder than this [K]; it then gives less heat than it was told to.
const COLDEST: f64 = 100.0;

/// A step is cut into about so many parts at most; then errors are accepted, the books being exact all the same.
const MOST_SUBSTEPS: f64 = 4096.0;

/// Rounds in which the end of a substep is looked for, before the substep is made shorter.
const ROUNDS: usize = 8;

/// Reactions slower than this within a substep do nothing.
const NOTHING: f64 = 1e-13;

/// A layer may get so much warmer than foreseen before the list of its reactions is made again [K].
const HEADROOM: f64 = 20.0;

/// Reactions that matter in a step, and what they share.
struct Active {
    list: [usize; REACTIONS],
    count: usize,
    /// X^m of the oxygen at the face.
    oxygen_factor: [f64; REACTIONS],
    takes_oxygen: bool,
}

/// A path of temperature over a time, with the rates at its start.
struct Path {
    start: f64,
    rates: [f64; REACTIONS],
    /// How much more the end counts than the start, 0 to 1: a layer held by its surroundings is at the end soon.
    lean: f64,
    time: f64,
}

/// How far reactions go along a path.
#[derive(Clone, Copy)]
struct Sweep {
    masses: Masses,
    extent: [f64; REACTIONS],
    /// [kg]
    oxygen_taken: f64,
    /// Heat set free less sensible heat carried off [J].
    heat: f64,
}

/// A substep that may be accepted.
struct Outcome {
    sweep: Sweep,
    /// Temperature at which gas left [K].
    middle: f64,
    temperature: f64,
    heat_in: f64,
    error: f64,
}

impl Chemistry {
    /// Advances a half-layer by a step [s]. The books of [`Released`] close to rounding, whatever the step.
    #[inline]
    pub fn advance(&self, layer: &mut Layer, surroundings: &Surroundings, dt: f64) -> Released {
        let (constant, slope) = self.capacities(&layer.masses);
        if constant <= 0.0 {
            return Released::default();
        }
        let balance = Balance::of(constant, slope, layer.temperature, surroundings, dt);
        let (after, heat_in) = balance.close(constant, slope, 0.0);
        // Temperature moves one way within the step, so nothing reacts on the way either.
        let warmest = layer.temperature.max(after);
        let water = layer.masses[Substance::Water as usize];
        let no_wetter = water <= self.moisture_ratio * takes_up_water(&layer.masses) * (1.0 + 1e-9);
        if warmest < self.idle_temperature(&layer.masses)
            && (water == 0.0 || (warmest < self.idle_below_wet && no_wetter))
        {
            layer.temperature = after;
            return Released { heat_in, ..Released::default() };
        }
        self.advance_hot(layer, surroundings, dt, warmest)
    }

    /// Advances a half-layer that must not react: it warms to a temperature [K] and takes up no more heat than that.
    pub fn warm(&self, layer: &mut Layer, surroundings: &Surroundings, dt: f64, most: f64) -> Released {
        let (constant, slope) = self.capacities(&layer.masses);
        if constant <= 0.0 {
            return Released::default();
        }
        let balance = Balance::of(constant, slope, layer.temperature, surroundings, dt);
        let (after, mut heat_in) = balance.close(constant, slope, 0.0);
        let before = layer.temperature;
        layer.temperature = after.min(most.max(before));
        if layer.temperature < after {
            heat_in = self.sensible_heat(&layer.masses, layer.temperature) - self.sensible_heat(&layer.masses, before);
        }
        Released { heat_in, ..Released::default() }
    }

    fn advance_hot(&self, layer: &mut Layer, surroundings: &Surroundings, dt: f64, warmest: f64) -> Released {
        let mut warmest = warmest;
        let mut active = self.active(&layer.masses, surroundings, warmest);
        let mut released = Released::default();
        let (mut left, mut part) = (dt, dt);
        let shortest = dt / MOST_SUBSTEPS;
        while left > 0.0 {
            part = part.min(left);
            let forced = part <= shortest;
            let outcome = self.substep(layer, &active, surroundings, part, forced);
            if outcome.error > self.tolerance && !forced {
                part = (part * shorter(outcome.error, self.tolerance)).max(shortest);
                continue;
            }
            if outcome.temperature > warmest + HEADROOM {
                warmest = outcome.temperature;
                active = self.active(&layer.masses, surroundings, warmest);
                continue;
            }
            self.book(&mut released, &active, &outcome.sweep, outcome.middle);
            layer.masses = outcome.sweep.masses;
            layer.temperature = outcome.temperature;
            released.heat_in += outcome.heat_in;
            left -= part;
            part = (part * longer(outcome.error, self.tolerance)).max(shortest);
        }
        released
    }

    /// Advances a half-layer whose temperature is led from where it is to an end at a constant rate, as in a
    /// thermobalance, or held, by whatever heat this takes (`heat_in`). Only the oxygen of the surroundings is looked at.
    pub fn advance_led(&self, layer: &mut Layer, end: f64, surroundings: &Surroundings, dt: f64) -> Released {
        let start = layer.temperature;
        let active = self.active(&layer.masses, surroundings, start.max(end));
        let mut released = Released::default();
        let (mut done, mut part) = (0.0, 1.0f64);
        while done < 1.0 {
            part = part.min(1.0 - done);
            let (before, forced) = (layer.temperature, part * MOST_SUBSTEPS <= 1.0);
            let after = if part >= 1.0 - done { end } else { start + (end - start) * (done + part) };
            let (before_sweep, path) = self.begin(layer, &active, surroundings, 0.0, part * dt);
            let mut share = before_sweep.share;
            let mut sweep = self.react(layer, &active, &path, after, share);
            for _ in 0..ROUNDS {
                let share_before = share;
                share = oxygen_share(&sweep, share, surroundings, path.time);
                if agrees(share_before, share) {
                    share = share_before;
                    break;
                }
                sweep = self.react(layer, &active, &path, after, share);
            }
            while sweep.oxygen_taken > surroundings.oxygen_supply * path.time {
                share *= 0.9;
                sweep = self.react(layer, &active, &path, after, share);
            }
            let error = self.error(layer, &active, &path, &sweep, after, 0.0, share);
            if error > self.tolerance && !forced {
                part = (part * shorter(error, self.tolerance)).max(1.0 / MOST_SUBSTEPS);
                continue;
            }
            let sensible = self.sensible_heat(&layer.masses, before);
            self.book(&mut released, &active, &sweep, 0.5 * (before + after));
            layer.masses = sweep.masses;
            layer.temperature = after;
            released.heat_in += self.sensible_heat(&layer.masses, after) - sensible - sweep.heat;
            done = if part >= 1.0 - done { 1.0 } else { done + part };
            part = (part * longer(error, self.tolerance)).max(1.0 / MOST_SUBSTEPS);
        }
        released
    }

    fn active(&self, masses: &Masses, surroundings: &Surroundings, warmest: f64) -> Active {
        let mut active =
            Active { list: [0; REACTIONS], count: 0, oxygen_factor: [1.0; REACTIONS], takes_oxygen: false };
        let mut there = 0u32;
        for k in 0..SUBSTANCES {
            there |= u32::from(masses[k] > 0.0) << k;
        }
        let air = surroundings.oxygen_fraction > 0.0 && surroundings.oxygen_supply > 0.0;
        let log_oxygen = if air { surroundings.oxygen_fraction.ln() } else { 0.0 };
        for index in 0..self.count {
            let reaction = &self.reactions[index];
            let oxidises = reaction.kind == Kind::Oxidation;
            let idle = warmest + HEADROOM < reaction.idle_below;
            if there >> reaction.reactant & 1 == 0 || idle || (oxidises && !air) {
                continue;
            }
            // What a step makes may react within it, so products count as there.
            for k in 0..SUBSTANCES {
                there |= u32::from(reaction.products[k] > 0.0) << k;
            }
            if oxidises {
                active.takes_oxygen = true;
                active.oxygen_factor[index] = (reaction.oxygen_exponent * log_oxygen).exp();
            }
            active.list[active.count] = index;
            active.count += 1;
        }
        active
    }

    /// Rates at the start of a substep, and the power and oxygen that go with them.
    fn begin(
        &self,
        layer: &Layer,
        active: &Active,
        surroundings: &Surroundings,
        lean: f64,
        time: f64,
    ) -> (Start, Path) {
        let mut path = Path { start: layer.temperature, rates: [0.0; REACTIONS], lean, time };
        let over = layer.temperature - REFERENCE_TEMPERATURE;
        let (mut wanted, mut power, mut power_by_oxygen) = (0.0, 0.0, 0.0);
        let damp = self.damp(active, layer.temperature);
        for &index in &active.list[..active.count] {
            let reaction = &self.reactions[index];
            let rate = reaction.rate(layer.temperature) * active.oxygen_factor[index];
            path.rates[index] = rate;
            let mass = self.free_mass(&layer.masses, index, damp);
            let mut speed = rate * mass;
            if reaction.order != 1.0 && mass > 0.0 {
                speed *= to_power(mass / (reaction.scale * layer.dry_mass), reaction.order - 1.0);
            }
            let speed = speed.min(mass / time);
            let heat = speed * (reaction.heat - reaction.gas_heat_capacity * over);
            if reaction.oxygen > 0.0 {
                wanted += speed * reaction.oxygen;
                power_by_oxygen += heat;
            } else {
                power += heat;
            }
        }
        let share = if wanted > 0.0 { 1.0 / (1.0 + wanted / surroundings.oxygen_supply) } else { 1.0 };
        (Start { power: power + share * power_by_oxygen, share }, path)
    }

    /// What there is to react: for water, what is over the balance with the room, `damp` per mass of what takes up water.
    #[inline]
    fn free_mass(&self, masses: &Masses, index: usize, damp: f64) -> f64 {
        let reactant = self.reactions[index].reactant;
        if index == 0 {
            return (masses[reactant] - damp * takes_up_water(masses)).max(0.0);
        }
        masses[reactant]
    }

    /// Moisture in balance with the room, where drying is among the reactions [kg per kg of what takes up water].
    #[inline]
    fn damp(&self, active: &Active, temperature: f64) -> f64 {
        // The list is in order, and drying is the first.
        if active.count > 0 && active.list[0] == 0 { self.moisture_at(temperature) } else { 0.0 }
    }

    /// All reactions along a path: half of each in order, half in the opposite order (Eq. 13.9) [Strang1968]. A reaction
    /// by itself is exact. `share` is the part of their own rate that reactions with oxygen can go at.
    fn react(&self, layer: &Layer, active: &Active, path: &Path, end: f64, share: f64) -> Sweep {
        let mut halves = [0.0; REACTIONS];
        let steepness = 1.0 / path.start - 1.0 / end;
        let list = &active.list[..active.count];
        for &index in list {
            let reaction = &self.reactions[index];
            let before = path.rates[index];
            // Eq. 13.8: the mean of exp over a straight line is the logarithmic mean of its ends.
            let rise = reaction.activation_temperature * steepness;
            let (mean, after) = if rise.abs() < 1e-3 {
                (before * (1.0 + rise * (0.5 + rise * (1.0 / 6.0))), before * (1.0 + rise + 0.5 * rise * rise))
            } else {
                let after = reaction.rate(end) * active.oxygen_factor[index];
                ((after - before) / rise, after)
            };
            let rate = (mean + path.lean * (after - mean)) * if reaction.oxygen > 0.0 { share } else { 1.0 };
            halves[index] = 0.5 * path.time * rate;
        }
        let mut sweep = Sweep { masses: layer.masses, extent: [0.0; REACTIONS], oxygen_taken: 0.0, heat: 0.0 };
        let middle = 0.5 * (path.start + end);
        let damp = self.damp(active, middle);
        for &index in list.iter().chain(list.iter().rev()) {
            if halves[index] > NOTHING {
                self.react_one(&mut sweep, layer, index, damp, halves[index]);
            }
        }
        let over = middle - REFERENCE_TEMPERATURE;
        for &index in list {
            let reaction = &self.reactions[index];
            sweep.oxygen_taken += sweep.extent[index] * reaction.oxygen;
            sweep.heat += sweep.extent[index] * (reaction.heat - reaction.gas_heat_capacity * over);
        }
        sweep
    }

    /// One reaction for an integral of its rate, by its closed form (Eq. 13.4).
    #[inline]
    fn react_one(&self, sweep: &mut Sweep, layer: &Layer, index: usize, damp: f64, integral: f64) {
        let reaction = &self.reactions[index];
        let free = self.free_mass(&sweep.masses, index, damp);
        if free <= 0.0 {
            return;
        }
        let mut used = free * lost_part(reaction.order, integral, free / (reaction.scale * layer.dry_mass));
        let there = sweep.masses[reaction.reactant];
        if there - used < LAST * layer.dry_mass {
            used = there;
        }
        // One by one would be waited for by the pairs that the processor adds.
        for k in 0..SUBSTANCES {
            sweep.masses[k] += used * reaction.change[k];
        }
        sweep.extent[index] += used;
    }

    /// Finds the end of a substep: temperature and share of oxygen together, by the secant of the heat balance.
    fn substep(&self, layer: &Layer, active: &Active, surroundings: &Surroundings, time: f64, forced: bool) -> Outcome {
        let (constant, slope) = self.capacities(&layer.masses);
        let balance = Balance::of(constant, slope, layer.temperature, surroundings, time);
        let lean = 2.0 * balance.weight - 1.0;
        let (start, path) = self.begin(layer, active, surroundings, lean.clamp(0.0, 1.0), time);
        let predicted = balance.predict(constant, slope, start.power * time);
        let mut guess = predicted;
        let mut share = start.share;
        let mut before: Option<(f64, f64)> = None;
        let mut converged = false;
        let mut sweep;
        let mut closed;
        let mut rounds = 0;
        loop {
            sweep = self.react(layer, active, &path, guess, share);
            let (constant, slope) = self.capacities(&sweep.masses);
            closed = balance.close(constant, slope, sweep.heat);
            let residual = closed.0 - guess;
            let share_after = oxygen_share(&sweep, share, surroundings, time);
            let oxygen_agrees = agrees(share, share_after);
            rounds += 1;
            if residual.abs() <= self.tolerance * (25.0 + 10.0 * (guess - layer.temperature).abs()) && oxygen_agrees {
                converged = true;
                break;
            }
            if rounds == ROUNDS {
                break;
            }
            let mut step = residual;
            if let Some((guess_before, residual_before)) = before {
                let secant = (residual - residual_before) / (guess - guess_before);
                // A balance that does not fall has no end near by: then only the plain iteration is safe.
                if secant < -0.1 {
                    step = -residual / secant;
                }
            }
            before = Some((guess, residual));
            share = share_after;
            guess = (guess + step).max(COLDEST);
        }
        if !converged && forced {
            while sweep.oxygen_taken > surroundings.oxygen_supply * time {
                share *= 0.5;
                sweep = self.react(layer, active, &path, guess, share);
            }
            let (constant, slope) = self.capacities(&sweep.masses);
            closed = balance.close(constant, slope, sweep.heat);
        }
        let (temperature, heat_in) = closed;
        let curvature = (temperature - predicted).abs();
        let error = if converged {
            self.error(layer, active, &path, &sweep, temperature, curvature, share)
        } else {
            f64::INFINITY
        };
        Outcome { sweep, middle: 0.5 * (layer.temperature + guess), temperature, heat_in, error }
    }

    /// Estimated error of a substep, in parts of the dry mass; it falls with the third power of its length.
    fn error(
        &self,
        layer: &Layer,
        active: &Active,
        path: &Path,
        sweep: &Sweep,
        end: f64,
        curvature: f64,
        share: f64,
    ) -> f64 {
        let steepness = (1.0 / path.start - 1.0 / end).abs();
        let warm = path.start.max(end);
        let (mut error, mut all, mut largest) = (0.0, 0.0f64, 0.0f64);
        let mut squares = 0.0;
        for &index in &active.list[..active.count] {
            let extent = sweep.extent[index];
            if extent <= 0.0 {
                continue;
            }
            let reaction = &self.reactions[index];
            let part = extent / layer.dry_mass;
            let rise = reaction.activation_temperature * steepness;
            // A bent path, of which the ends are right; and, with room to spare, what is not straight about 1/T.
            let bent = reaction.activation_temperature * curvature / (warm * warm) * (1.0 / 6.0);
            let used = extent / (extent + sweep.masses[reaction.reactant]);
            let limited = if reaction.oxygen > 0.0 { used * used * (1.0 - share) / 12.0 } else { 0.0 };
            error += part * (bent + 0.02 * rise * rise + limited);
            all += used;
            squares += used * used;
            largest = largest.max(part);
        }
        // Reactions one after the other instead of together: the error of a symmetric sweep is of third order.
        error + largest * (all * all - squares) * all / 24.0
    }

    fn book(&self, released: &mut Released, active: &Active, sweep: &Sweep, middle: f64) {
        let over = middle - REFERENCE_TEMPERATURE;
        released.substeps += 1;
        for &index in &active.list[..active.count] {
            let extent = sweep.extent[index];
            let reaction = &self.reactions[index];
            released.volatiles += extent * reaction.volatiles;
            released.steam += extent * reaction.steam;
            released.oxides += extent * reaction.oxides;
            released.oxygen_taken += extent * reaction.oxygen;
            released.volatile_energy += extent * reaction.volatile_energy;
            released.volatile_oxygen += extent * reaction.volatile_oxygen;
            released.heat_carried += extent * reaction.gas_heat_capacity * over;
            let heat = extent * reaction.heat;
            match reaction.kind {
                Kind::Drying => released.heat_of_drying += heat,
                Kind::Pyrolysis => released.heat_of_pyrolysis += heat,
                Kind::Oxidation => released.heat_of_oxidation += heat,
            }
        }
    }
}

/// What reactions would do if they went on as at the start.
struct Start {
    /// Heat set free less what gas carries off [W].
    power: f64,
    share: f64,
}

/// The heat balance of a substep (Eq. 13.10): sensible heat after = `before + heat + given (end - start)`.
struct Balance {
    start: f64,
    /// Sensible heat at the start [J].
    before: f64,
    /// Heat from the surroundings if the layer stayed at its temperature [J].
    heat: f64,
    /// Change of it with the temperature at the end [J/K].
    given: f64,
    /// Weight of the end in the mean temperature.
    weight: f64,
}

impl Balance {
    #[inline]
    fn of(constant: f64, slope: f64, start: f64, surroundings: &Surroundings, time: f64) -> Self {
        let over = start - REFERENCE_TEMPERATURE;
        let Surroundings { heat, heat_slope, about, .. } = surroundings;
        let weight = weight_of_end(-heat_slope * time / (constant + slope * over));
        Self {
            start,
            before: over * (constant + 0.5 * slope * over),
            heat: time * (heat + heat_slope * (start - about)),
            given: time * heat_slope * weight,
            weight,
        }
    }

    /// Temperature at the end and heat from the surroundings, for capacities and heat of reactions.
    #[inline]
    fn close(&self, constant: f64, slope: f64, of_reactions: f64) -> (f64, f64) {
        if constant <= 0.0 {
            return (self.start, 0.0);
        }
        // over (constant + slope/2 over) = before + heat + of_reactions + given (over - over_start)
        let over_start = self.start - REFERENCE_TEMPERATURE;
        let known = self.before + self.heat + of_reactions - self.given * over_start;
        let over = over_reference(constant - self.given, slope, known);
        let end = REFERENCE_TEMPERATURE + over;
        if -self.given < constant && end >= COLDEST {
            return (end, self.heat + self.given * (over - over_start));
        }
        // Where the surroundings hold the layer, that would be a small difference of large numbers.
        let over = over.max(COLDEST - REFERENCE_TEMPERATURE);
        (end.max(COLDEST), over * (constant + 0.5 * slope * over) - self.before - of_reactions)
    }

    /// The end for the masses of the start.
    fn predict(&self, constant: f64, slope: f64, of_reactions: f64) -> f64 {
        self.close(constant, slope, of_reactions).0
    }
}

/// Weight of the end in the mean over an exponential approach at rate x: 1/(1 - exp(-x)) - 1/x, 1/2 at x = 0.
#[inline]
fn weight_of_end(x: f64) -> f64 {
    if x.abs() < 0.25 {
        let square = x * x;
        return 0.5 + x * (1.0 / 12.0 - square * (1.0 / 720.0 - square * (1.0 / 30240.0 - square / 1_209_600.0)));
    }
    -1.0 / (-x).exp_m1() - 1.0 / x
}

#[inline]
fn takes_up_water(masses: &Masses) -> f64 {
    masses[Substance::Fibre as usize] + masses[Substance::Polymer as usize]
}

/// Part of a reactant that is lost for an integral of its rate; `filling` is its mass over that of its order (Eq. 13.4).
#[inline]
fn lost_part(order: f64, integral: f64, filling: f64) -> f64 {
    if order == 1.0 {
        return lost_exponentially(integral);
    }
    let power = order - 1.0;
    let grown = integral * to_power(filling, power);
    let argument = power * grown;
    if argument <= -1.0 {
        return 1.0;
    }
    if argument.abs() < 1e-3 {
        let series = 1.0 - argument * (0.5 - argument * (1.0 / 3.0 - argument * (0.25 - argument * 0.2)));
        return lost_exponentially(grown * series);
    }
    lost_exponentially(argument.ln_1p() / power)
}

/// x^p for x over 0: right to a few parts in 1e16, and twice as fast as `powf`.
#[inline]
fn to_power(x: f64, p: f64) -> f64 {
    (p * x.ln()).exp()
}

/// 1 - exp(-x), for x from 0.
#[inline]
fn lost_exponentially(x: f64) -> f64 {
    if x < 1e-3 {
        return x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0))));
    }
    -(-x).exp_m1()
}

/// Share of their own rate at which reactions with oxygen can go, from what a sweep at another share took: Eq. 13.5b,
/// 1/(1/kinetic + 1/transport).
#[inline]
fn oxygen_share(sweep: &Sweep, share: f64, surroundings: &Surroundings, time: f64) -> f64 {
    if sweep.oxygen_taken <= 0.0 {
        return share;
    }
    1.0 / (1.0 + sweep.oxygen_taken / (share * surroundings.oxygen_supply * time))
}

/// Whether two shares of oxygen are one: near enough, and near enough for the supply not to be passed, of which a sweep
/// at the first takes the part `share / share_after - share`.
#[inline]
fn agrees(share: f64, share_after: f64) -> bool {
    (share_after - share).abs() <= 1e-4 * share && share - share_after <= 0.5 * share * share
}

/// By how much to shorten a substep whose error was too large.
fn shorter(error: f64, tolerance: f64) -> f64 {
    if error.is_finite() { (0.9 * (tolerance / error).cbrt()).clamp(0.1, 0.7) } else { 0.25 }
}

/// By how much the next substep may be longer.
fn longer(error: f64, tolerance: f64) -> f64 {
    (0.9 * (tolerance / error.max(1e-30)).cbrt()).clamp(0.5, 4.0)
}
