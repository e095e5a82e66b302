//! What the gas is like: transport properties of hot air, temperature of a flame, speed of its reactions.
//!
//! Model: Eq. 14.1 to 14.5. Source: each number has its own. Valid when: the gas is mostly nitrogen, oxygen and their
//! products, 0.1 to 1 atm, flames of 1400 to 3100 K. Cost: once a step.

use super::Surroundings;

/// Stefan and Boltzmann's constant [W/(m2 K4)] [Bipm2019].
pub const STEFAN_BOLTZMANN: f64 = 5.670_374e-8;
/// Standard atmosphere [Pa] [Bipm2019].
pub const ATMOSPHERE: f64 = 101_325.0;
/// Heat released per mass of oxygen [J/kg], within 5 % for all common fuels [Huggett1980].
pub const HEAT_PER_OXYGEN: f64 = 13.1e6;

/// Conductivity of air at 300 K [W/(m K)], and the power of temperature by which it grows: 0.0263 at 300 K, 0.0763 at
/// 1200 K [Incropera2007].
const CONDUCTIVITY_300: f64 = 0.0263;
const CONDUCTIVITY_POWER: f64 = 0.768;
/// Heat capacity of air at 1200 K [J/(kg K)] [Incropera2007].
const HEAT_CAPACITY: f64 = 1175.0;
/// Gas constant of air [J/(kg K)].
const GAS_CONSTANT: f64 = 287.05;
/// Prandtl number of air, near 0.7 from 300 to 1500 K [Incropera2007].
pub const PRANDTL: f64 = 0.71;

/// Mean heat capacity of burnt gas from 300 K to 2250 K without dissociation [J/(kg K)], what dissociation adds at a rise
/// of 1950 K, and the power by which that grows. Chosen so that cellulose burns at 2250 K in air and at 3050 K in oxygen,
/// as chemical equilibrium has it within 50 K.
const BURNT_CAPACITY: f64 = 1260.0;
const DISSOCIATION: f64 = 40.0;
const DISSOCIATION_RISE: f64 = 1950.0;
const DISSOCIATION_POWER: i32 = 11;

/// Temperature at which volatiles leave the sheet, for the heat they bring [K]; the flame is hardly sensitive to it.
const VOLATILE_TEMPERATURE: f64 = 700.0;

/// Activation temperature of the gas reaction [K]: 33 kcal/mol over the gas constant, in the range of 30 to 40 that
/// one-step models of hydrocarbon and polymer flames use [Westbrook1981].
const ACTIVATION_TEMPERATURE: f64 = 16_600.0;
/// Temperature at which diffusion flames go out [K]: near 1300 degC, 1500 to 1650 K over many fuels [Quintiere2004].
const CRITICAL_TEMPERATURE: f64 = 1573.0;
/// Reaction over diffusion at the turning point of the upper branch: x/(1 - x) with x (1 - x) = T^2/(T_a (T - T_wall)),
/// 1/6 in a flame that goes out [Linan1974].
const CRITICAL_DAMKOHLER: f64 = 3.7;

/// Rounds to find what part reacts, and the change at which it is found: three in air, more towards the turning point.
const MOST_ROUNDS: usize = 30;
const SETTLED: f64 = 1e-4;

/// The gas of a scene as the closure needs it; follows from the surroundings and the fuel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GasProperties {
    /// Of the room [K].
    pub ambient: f64,
    /// Oxygen, mass over mass of the surrounding gas.
    pub oxygen_mass_fraction: f64,
    /// Density of the surrounding gas [kg/m3].
    pub ambient_density: f64,
    /// Conductivity at the mean of flame and room [W/(m K)].
    pub conductivity: f64,
    /// Heat capacity there [J/(kg K)].
    pub heat_capacity: f64,
    /// Density there [kg/m3].
    pub density: f64,
    /// Diffusivity of heat there [m2/s]; of mass too, at a Lewis number of 1.
    pub diffusivity: f64,
    /// Mass of oxygen that a mass of volatiles takes.
    pub oxygen_demand: f64,
    /// Mixture fraction at which volatiles and oxygen are matched.
    pub stoichiometric: f64,
    /// How many times nearer the flame stands to the air than to the sheet.
    pub leverage: f64,
    /// Thickness of the film over the distance from face to flame.
    pub nearness: f64,
    /// Temperature of the flame if it lost nothing [K].
    pub adiabatic: f64,
    /// Its enthalpy as a temperature, dissociation counted as heat [K].
    pub potential: f64,
    /// Temperature of a flame that heats a pyrolysing sheet and loses nothing else [K].
    pub flame: f64,
    /// Speed scale of buoyancy at the foot of a flame in full gravity [m/s].
    pub buoyant_speed: f64,
    /// Reaction over diffusion at the critical temperature, over thickness squared [1/m2].
    damkohler: f64,
}

/// Conductivity of air [W/(m K)].
pub fn conductivity(temperature: f64) -> f64 {
    CONDUCTIVITY_300 * (temperature / 300.0).powf(CONDUCTIVITY_POWER)
}

/// Temperature that stoichiometric gas reaches [K], from the heat of its oxygen, and the one it would reach if nothing
/// dissociated (Eq. 14.2): what has dissociated gives its heat to the face when it recombines on the way there.
fn adiabatic_temperature(oxygen: f64, stoichiometric: f64, ambient: f64) -> (f64, f64) {
    // Heat per mass of the mixture: its oxygen is what it has of the surrounding gas.
    let heat = (1.0 - stoichiometric) * oxygen * HEAT_PER_OXYGEN;
    let unburnt = ambient + stoichiometric * (VOLATILE_TEMPERATURE - ambient).max(0.0);
    // Newton on rise (c + d (rise/r)^n) = heat: convex and monotonic, so it converges from above.
    let mut rise = heat / BURNT_CAPACITY;
    for _ in 0..40 {
        let power = (rise / DISSOCIATION_RISE).powi(DISSOCIATION_POWER);
        let excess = rise * (BURNT_CAPACITY + DISSOCIATION * power) - heat;
        rise -= excess / (BURNT_CAPACITY + f64::from(DISSOCIATION_POWER + 1) * DISSOCIATION * power);
    }
    (unburnt + rise, unburnt + heat / BURNT_CAPACITY)
}

/// Mass fraction of oxygen in a mixture with nitrogen.
pub fn oxygen_mass_fraction(mole_fraction: f64) -> f64 {
    let x = mole_fraction.clamp(0.0, 1.0);
    31.998 * x / (31.998 * x + 28.16 * (1.0 - x))
}

impl GasProperties {
    /// Works them out; the foot of a flame is a film of `foot` alpha/U (Eq. 14.6).
    pub fn of(surroundings: &Surroundings, oxygen_demand: f64, foot: f64) -> Self {
        let air = Surroundings {
            oxygen: 0.209,
            temperature: 298.15,
            pressure: ATMOSPHERE,
            gravity: glam::DVec3::Y * -9.81,
            ..*surroundings
        };
        let reference = Self::without_reaction(&air, oxygen_demand);
        // Eq. 14.5: a flame goes out at the critical temperature at its foot in air at 1 g and 1 atm; other flames by how
        // well they are fed, against how fast diffusion takes heat from their reaction zone.
        let thickness = foot * reference.diffusivity / reference.buoyant_speed;
        let properties = Self::without_reaction(surroundings, oxygen_demand);
        let damkohler = CRITICAL_DAMKOHLER / (thickness * thickness) * properties.reactivity(surroundings)
            / reference.reactivity(&air);
        Self { damkohler, ..properties }
    }

    fn without_reaction(surroundings: &Surroundings, oxygen_demand: f64) -> Self {
        let ambient = surroundings.temperature;
        let oxygen = oxygen_mass_fraction(surroundings.oxygen).max(1e-4);
        let stoichiometric = oxygen / (oxygen + oxygen_demand); // Eq. 14.1
        let leverage = oxygen_demand / oxygen;
        let (adiabatic, potential) = adiabatic_temperature(oxygen, stoichiometric, ambient);
        let flame = (leverage * adiabatic + VOLATILE_TEMPERATURE) / (leverage + 1.0);
        let mean = 0.5 * (flame + ambient);
        let density = surroundings.pressure / (GAS_CONSTANT * mean);
        let conductivity = conductivity(mean);
        let diffusivity = conductivity / (density * HEAT_CAPACITY);
        let buoyancy = surroundings.gravity.length() * (flame - ambient).max(0.0) / ambient;
        Self {
            ambient,
            oxygen_mass_fraction: oxygen,
            ambient_density: surroundings.pressure / (GAS_CONSTANT * ambient),
            conductivity,
            heat_capacity: HEAT_CAPACITY,
            density,
            diffusivity,
            oxygen_demand,
            stoichiometric,
            leverage,
            nearness: 1.0 / (1.0 - stoichiometric),
            adiabatic,
            potential,
            flame,
            buoyant_speed: (diffusivity * buoyancy).cbrt(), // Eq. 14.6
            damkohler: 0.0,
        }
    }

    /// What a reaction of second order in a thin zone goes with, over diffusion, at one temperature of flame [Linan1974]
    /// [Pa s/m2].
    fn reactivity(&self, surroundings: &Surroundings) -> f64 {
        let Self { stoichiometric: z, diffusivity, oxygen_mass_fraction, .. } = *self;
        surroundings.pressure * oxygen_mass_fraction * (z / (1.0 - z)).powi(2) / diffusivity
    }

    /// Part of what diffusion brings together that reacts in a film of a thickness on a wall, if its flame has the
    /// temperature `burnt` where all reacts (Eq. 14.5).
    ///
    /// Oxygen that leaks through cools the flame, and more leaks. From above Newton's steps end on the upper branch, and past
    /// its turning point they fall through to the lower one.
    #[inline]
    pub fn reacting_part(&self, wall: f64, burnt: f64, thickness: f64) -> f64 {
        let mut part = 1.0;
        for _ in 0..MOST_ROUNDS {
            let temperature = wall + (burnt - wall) * part;
            let reacts = self.completeness(temperature, thickness);
            let slope = reacts * (1.0 - reacts) * ACTIVATION_TEMPERATURE * (burnt - wall) / (temperature * temperature);
            let step = if slope < 1.0 { (reacts - part) / (1.0 - slope) } else { reacts - part };
            part = (part + step).max(0.0);
            if step.abs() < SETTLED {
                break;
            }
        }
        part
    }

    /// The same where the gas has a temperature.
    #[inline]
    fn completeness(&self, temperature: f64, thickness: f64) -> f64 {
        let exponent = ACTIVATION_TEMPERATURE * (1.0 / CRITICAL_TEMPERATURE - 1.0 / temperature);
        let damkohler = self.damkohler * thickness * thickness * exponent.min(50.0).exp();
        damkohler / (1.0 + damkohler)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOOT: f64 = 0.86;
    const WALL: f64 = 650.0;

    fn gas(oxygen: f64, pressure: f64) -> GasProperties {
        let gravity = glam::DVec3::Y * -9.81;
        let room = Surroundings { temperature: 298.15, oxygen, pressure, gravity, wind: glam::DVec3::ZERO };
        GasProperties::of(&room, 1.19, FOOT)
    }

    /// The temperature of flame, where all reacts, at which the upper branch ends [K].
    fn turning_point(gas: &GasProperties, thickness: f64) -> f64 {
        let (mut out, mut burns) = (WALL, 4000.0);
        while burns - out > 0.5 {
            let middle = 0.5 * (out + burns);
            *(if gas.reacting_part(WALL, middle, thickness) > 0.3 { &mut burns } else { &mut out }) = middle;
        }
        burns
    }

    #[test]
    fn at_the_foot_in_air_the_flame_goes_out_at_the_critical_temperature() {
        let air = gas(0.209, ATMOSPHERE);
        let foot = FOOT * air.diffusivity / air.buoyant_speed;
        let part = air.completeness(CRITICAL_TEMPERATURE, foot);
        assert!((part - CRITICAL_DAMKOHLER / (1.0 + CRITICAL_DAMKOHLER)).abs() < 1e-12);
        // The turning point by itself: where d eta/d T' of 14.5 is that of T' = T_s + eta (T_f - T_s).
        let at_turn =
            WALL + air.reacting_part(WALL, turning_point(&air, foot), foot) * (turning_point(&air, foot) - WALL);
        assert!((at_turn / CRITICAL_TEMPERATURE - 1.0).abs() < 0.02, "{at_turn} K");
    }

    #[test]
    fn thin_films_thin_air_and_little_oxygen_put_a_flame_out_hotter() {
        let air = gas(0.209, ATMOSPHERE);
        let foot = FOOT * air.diffusivity / air.buoyant_speed;
        let here = turning_point(&air, foot);
        for (what, higher) in [
            ("half as thick", turning_point(&air, 0.5 * foot)),
            ("half the pressure", turning_point(&gas(0.209, 0.5 * ATMOSPHERE), foot)),
            ("less oxygen", turning_point(&gas(0.17, ATMOSPHERE), foot)),
        ] {
            assert!(higher > here + 20.0, "{what}: {higher} K after {here} K");
        }
        assert!(turning_point(&air, 2.0 * foot) < here - 20.0);
    }

    #[test]
    fn all_reacts_in_hot_flames_and_nothing_in_cold_gas() {
        let air = gas(0.209, ATMOSPHERE);
        let foot = FOOT * air.diffusivity / air.buoyant_speed;
        assert!(air.reacting_part(WALL, air.flame, foot) > 0.9);
        assert!(air.reacting_part(WALL, 1200.0, foot) < 0.02);
    }
}
