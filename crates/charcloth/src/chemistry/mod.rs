//! Drying, pyrolysis and glow of one half-layer of sheet, with the temperature that goes with them.
//!
//! Model: Arrhenius reactions of any order between condensed substances, gases and oxygen from the face (Eq. 13.3 to
//! 13.8), and the balance of sensible heat (Eq. 13.2). Source: the form is that of [Kashiwagi1992]; each number is the
//! material's. Valid when: the half-layer has one temperature; gas leaves as it is made. Cost: a cold half-layer about
//! ten nanoseconds, a hot one under a microsecond for each substep.

mod step;

use crate::substances::{Gas, Masses, REFERENCE_TEMPERATURE, SUBSTANCES, SpecificHeat, Substance};

/// Estimated error of a substep, in parts of the dry mass.
/// tuned: 1e-6 to 1e-3; at this value a whole burn is right to about 1e-3 (see the tests)
const TOLERANCE: f64 = 2e-5;

/// Most reactions of a material.
pub const REACTIONS: usize = 12;

/// Molar gas constant [J/(mol K)] [Bipm2019].
pub const GAS_CONSTANT: f64 = 8.314_462_618;

/// Molar mass of water [kg/mol].
const WATER_MOLAR_MASS: f64 = 0.018_015;

/// A reaction slower than this, per mass of reactant, is left out [1/s]: in a minute it would do 6e-6.
const IDLE_RATE: f64 = 1e-7;

/// Drying slower than this, per dry mass, is left out of a sheet that is otherwise cold [1/s]: in a minute it would
/// change the mass by 6e-5. Rooms change the moisture of paper more.
const IDLE_DRYING: f64 = 1e-6;

/// A reaction: what burns, what it gives, and how fast (Eq. 13.3).
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Name, for messages and tables.
    pub name: String,
    /// What is used up.
    pub reactant: Substance,
    /// Condensed products [kg per kg of reactant].
    pub products: Masses,
    /// Part of the gas made that is fuel; the rest is burnt gas.
    pub fuel_fraction: f64,
    /// Oxygen taken up [kg per kg of reactant].
    pub oxygen: f64,
    /// Frequency factor A [1/s].
    pub frequency: f64,
    /// Activation energy E [J/mol].
    pub activation_energy: f64,
    /// Order n in the mass of reactant.
    pub order: f64,
    /// Power of the oxygen mole fraction; 0 for a reaction that needs none.
    pub oxygen_exponent: f64,
    /// Heat given out at `heat_temperature` [J per kg of reactant]; negative where heat is taken up. None where no fuel
    /// gas is made: the heats of combustion of what goes in and comes out then say it.
    pub heat: Option<f64>,
    /// Temperature at which `heat` holds [K].
    pub heat_temperature: f64,
}

/// Moisture and how it leaves (Eq. 13.6 to 13.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moisture {
    /// Equilibrium moisture at 50 % relative humidity [kg per kg of dry sheet].
    pub at_half_humidity: f64,
    /// Exponent b of the sorption isotherm (Eq. 13.6).
    pub isotherm_exponent: f64,
    /// Frequency factor of drying [1/s].
    pub frequency: f64,
    /// Activation energy of drying [J/mol].
    pub activation_energy: f64,
    /// Heat that drying takes up at 298.15 K [J per kg of water].
    pub heat: f64,
}

/// The room that the sheet has come to balance with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// Its temperature [K].
    pub temperature: f64,
    /// Its relative humidity, 0 to 1.
    pub relative_humidity: f64,
}

/// All that chemistry needs to know of a material.
#[derive(Debug, Clone, PartialEq)]
pub struct ChemistryData {
    /// Parts of the dry sheet [kg per kg]; they add up to 1, without water.
    pub composition: Masses,
    /// Specific heats.
    pub specific_heats: [SpecificHeat; SUBSTANCES],
    /// Heat that complete burning gives at 298.15 K, with water as vapour [J/kg]. That of water is set by the moisture.
    pub heats_of_combustion: [f64; SUBSTANCES],
    /// Oxygen that complete burning takes [kg/kg].
    pub oxygen_demands: [f64; SUBSTANCES],
    /// Moisture.
    pub moisture: Moisture,
    /// Reactions, but for drying.
    pub reactions: Vec<Reaction>,
}

/// Which book the heat of a reaction goes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Drying,
    Pyrolysis,
    Oxidation,
}

/// A reaction, ready to be advanced. Gases and heats are per kg of reactant.
#[derive(Debug, Clone, Copy)]
struct Prepared {
    kind: Kind,
    reactant: usize,
    products: Masses,
    /// The products, and the reactant that goes.
    change: Masses,
    volatiles: f64,
    oxides: f64,
    steam: f64,
    oxygen: f64,
    /// At 298.15 K [J/kg].
    heat: f64,
    volatile_energy: f64,
    volatile_oxygen: f64,
    /// Heat capacity of the gas that leaves less that of the oxygen that comes [J/(kg K)].
    gas_heat_capacity: f64,
    log_frequency: f64,
    /// E/R [K].
    activation_temperature: f64,
    order: f64,
    oxygen_exponent: f64,
    /// Reference mass of the order [kg per kg of dry sheet]: what there is of the reactant, or what there may be.
    scale: f64,
    /// The reaction is left out below this [K].
    idle_below: f64,
}

/// The chemistry of a material in a room: tables for [`Chemistry::advance`], made once.
#[derive(Debug, Clone)]
pub struct Chemistry {
    /// Estimated error of a substep past which it is made shorter, in parts of the dry mass.
    pub tolerance: f64,
    reactions: [Prepared; REACTIONS],
    count: usize,
    composition: Masses,
    specific_heats: [SpecificHeat; SUBSTANCES],
    combustion: Masses,
    room: Room,
    /// Equilibrium moisture of the room [kg per kg of what takes up water].
    moisture_ratio: f64,
    /// Fall of the equilibrium moisture with 1/T [K].
    moisture_slope: f64,
    /// Below this no reaction uses up the substance, but for drying [K].
    idle_below: [f64; SUBSTANCES],
    /// Drying is idle, too, below this, for a sheet no wetter than the room makes it [K].
    idle_below_wet: f64,
}

/// One half-layer of one node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Mass of each substance [kg].
    pub masses: Masses,
    /// Temperature [K].
    pub temperature: f64,
    /// Dry mass at the start [kg]: the scale of rates whose order is not 1. Never changes.
    pub dry_mass: f64,
}

/// What surrounds a half-layer during a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Net heat into the layer when it is at the temperature `about` [W].
    pub heat: f64,
    /// Change of `heat` with the temperature of the layer [W/K]; negative where the surroundings hold it.
    pub heat_slope: f64,
    /// Temperature that `heat` belongs to [K].
    pub about: f64,
    /// Mole fraction of oxygen at the face: 0.21 in air, 0 under a flame.
    pub oxygen_fraction: f64,
    /// Most oxygen that can get to the face [kg/s]: per area and second, times the area of the face. Infinity is no
    /// limit.
    pub oxygen_supply: f64,
}

/// What a half-layer gave and took during a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Released {
    /// Fuel gas given off [kg].
    pub volatiles: f64,
    /// Water vapour given off by drying [kg].
    pub steam: f64,
    /// Burnt gas given off [kg].
    pub oxides: f64,
    /// Oxygen taken up [kg].
    pub oxygen_taken: f64,
    /// Heat that complete burning of the fuel gas would give at 298.15 K [J].
    pub volatile_energy: f64,
    /// Oxygen that it would take [kg].
    pub volatile_oxygen: f64,
    /// Heat that came from the surroundings [J].
    pub heat_in: f64,
    /// Heat of drying at 298.15 K [J]; negative.
    pub heat_of_drying: f64,
    /// Heat of reactions without oxygen at 298.15 K [J]; negative where they take heat up.
    pub heat_of_pyrolysis: f64,
    /// Heat of reactions with oxygen at 298.15 K [J].
    pub heat_of_oxidation: f64,
    /// Sensible heat over 298.15 K that gas took out, less what oxygen brought [J].
    pub heat_carried: f64,
    /// Substeps that it took.
    pub substeps: u32,
}

impl Moisture {
    /// Moisture in balance with a relative humidity [kg per kg of dry sheet].
    pub fn equilibrium(&self, relative_humidity: f64) -> f64 {
        // Eq. 13.6 [Henderson1952]: 1 - phi = exp(-a M^b), with a from the moisture at 50 %.
        let humidity = relative_humidity.clamp(0.0, 0.98);
        self.at_half_humidity * ((1.0 - humidity).ln() / 0.5f64.ln()).powf(1.0 / self.isotherm_exponent)
    }
}

impl Chemistry {
    /// Checks and prepares the chemistry of a material in a room.
    pub fn build(data: &ChemistryData, room: Room) -> Result<Self, String> {
        if data.reactions.len() + 1 > REACTIONS {
            return Err(format!("{} reactions are more than {}", data.reactions.len(), REACTIONS - 1));
        }
        let total: f64 = data.composition.iter().sum();
        if (total - 1.0).abs() > 1e-6 || data.composition.iter().any(|part| *part < 0.0) {
            return Err(format!("the parts of the dry sheet add up to {total}, not to 1"));
        }
        if data.composition[Substance::Water as usize] != 0.0 {
            return Err("water is no part of the dry sheet: say what moisture it has".to_owned());
        }
        let mut combustion = data.heats_of_combustion;
        combustion[Substance::Water as usize] = -data.moisture.heat;
        let scales = scales(data);
        let mut reactions = [drying(&data.moisture); REACTIONS];
        for (place, reaction) in data.reactions.iter().enumerate() {
            reactions[place + 1] = prepare(reaction, data, &combustion, scales[reaction.reactant as usize])
                .map_err(|problem| format!("reaction \"{}\": {problem}", reaction.name))?;
        }
        let count = data.reactions.len() + 1;
        let takes_up_water =
            data.composition[Substance::Fibre as usize] + data.composition[Substance::Polymer as usize];
        let moisture = data.moisture.equilibrium(room.relative_humidity);
        let moisture_ratio = if takes_up_water > 0.0 { moisture / takes_up_water } else { 0.0 };
        let mut chemistry = Self {
            tolerance: TOLERANCE,
            reactions,
            count,
            composition: data.composition.map(|part| part / total),
            specific_heats: data.specific_heats,
            combustion,
            room,
            moisture_ratio,
            // Eq. 13.7: for a dry sheet phi goes as M^b, and at constant vapour pressure as exp(L/(R T)).
            moisture_slope: data.moisture.heat * WATER_MOLAR_MASS / (GAS_CONSTANT * data.moisture.isotherm_exponent),
            idle_below: [f64::INFINITY; SUBSTANCES],
            idle_below_wet: 0.0,
        };
        for reaction in &reactions[1..count] {
            let idle = &mut chemistry.idle_below[reaction.reactant];
            *idle = idle.min(reaction.idle_below);
        }
        chemistry.idle_below_wet = chemistry.find_idle_below_wet(moisture);
        Ok(chemistry)
    }

    /// Up to where a sheet as wet as the room makes it dries more slowly than [`IDLE_DRYING`].
    fn find_idle_below_wet(&self, moisture: f64) -> f64 {
        let too_fast = |temperature: f64| {
            let left = 1.0 - self.moisture_at(temperature) / self.moisture_ratio.max(f64::MIN_POSITIVE);
            self.reactions[0].rate(temperature) * moisture * left > IDLE_DRYING
        };
        let (mut idle, mut fast) = (self.room.temperature, self.room.temperature + 300.0);
        if !too_fast(fast) {
            return fast;
        }
        for _ in 0..60 {
            let middle = 0.5 * (idle + fast);
            if too_fast(middle) { fast = middle } else { idle = middle }
        }
        idle
    }

    /// Below this no substance that is there reacts [K], but for drying.
    #[inline]
    fn idle_temperature(&self, masses: &Masses) -> f64 {
        let mut idle = f64::INFINITY;
        for k in 0..SUBSTANCES {
            let below = if masses[k] > 0.0 { self.idle_below[k] } else { f64::INFINITY };
            idle = if below < idle { below } else { idle };
        }
        idle
    }

    /// Moisture in balance with the room's vapour at a temperature of the sheet [kg per kg of what takes up water].
    #[inline]
    fn moisture_at(&self, temperature: f64) -> f64 {
        // Eq. 13.7
        self.moisture_ratio * (self.moisture_slope * (1.0 / temperature - 1.0 / self.room.temperature)).min(0.0).exp()
    }

    /// Masses of a layer in balance with the room, per kg of its dry mass.
    pub fn composition(&self) -> Masses {
        let mut masses = self.composition;
        let takes_up_water = masses[Substance::Fibre as usize] + masses[Substance::Polymer as usize];
        masses[Substance::Water as usize] = self.moisture_ratio * takes_up_water;
        masses
    }

    /// A layer of a dry mass [kg] in balance with the room.
    pub fn layer(&self, dry_mass: f64) -> Layer {
        let masses = self.composition().map(|part| part * dry_mass);
        Layer { masses, temperature: self.room.temperature, dry_mass }
    }

    /// The room.
    pub fn room(&self) -> Room {
        self.room
    }

    /// Heat capacity at 298.15 K and its rise with temperature [J/K], [J/K2].
    #[inline]
    fn capacities(&self, masses: &Masses) -> (f64, f64) {
        let (mut constant, mut slope) = (0.0, 0.0);
        for k in 0..SUBSTANCES {
            constant += masses[k] * self.specific_heats[k].at_reference;
            slope += masses[k] * self.specific_heats[k].slope;
        }
        (constant, slope)
    }

    /// Heat capacity [J/K] (Eq. 13.1).
    pub fn heat_capacity(&self, masses: &Masses, temperature: f64) -> f64 {
        let (constant, slope) = self.capacities(masses);
        constant + slope * (temperature - REFERENCE_TEMPERATURE)
    }

    /// Sensible heat over 298.15 K [J] (Eq. 13.2).
    pub fn sensible_heat(&self, masses: &Masses, temperature: f64) -> f64 {
        let (constant, slope) = self.capacities(masses);
        let over = temperature - REFERENCE_TEMPERATURE;
        over * (constant + 0.5 * slope * over)
    }

    /// Temperature of a layer with a sensible heat over 298.15 K [K]; that of reference for a layer without mass.
    pub fn temperature(&self, masses: &Masses, sensible_heat: f64) -> f64 {
        let (constant, slope) = self.capacities(masses);
        REFERENCE_TEMPERATURE + over_reference(constant, slope, sensible_heat)
    }

    /// Heat that complete burning would give at 298.15 K [J]; moisture counts negative, for it must be dried.
    pub fn chemical_energy(&self, masses: &Masses) -> f64 {
        masses.iter().zip(self.combustion).map(|(mass, heat)| mass * heat).sum()
    }

    /// Sensible heat of a gas over 298.15 K [J/kg].
    pub fn gas_heat(&self, gas: Gas, temperature: f64) -> f64 {
        gas.specific_heat() * (temperature - REFERENCE_TEMPERATURE)
    }

    /// Heat of combustion at 298.15 K [J/kg] and oxygen demand [kg/kg] of the fuel gas of the first reaction that gives
    /// any without oxygen.
    pub fn volatiles(&self) -> Option<(f64, f64)> {
        let pyrolysis = self.reactions[..self.count].iter().find(|r| r.kind == Kind::Pyrolysis && r.volatiles > 0.0)?;
        Some((pyrolysis.volatile_energy / pyrolysis.volatiles, pyrolysis.volatile_oxygen / pyrolysis.volatiles))
    }

    /// Lets heat flow through the thickness, from the front to the back layer: exact for heat capacities held at their
    /// values at the start. Returns the heat that went to the back [J].
    pub fn exchange(&self, front: &mut Layer, back: &mut Layer, conductance: f64, dt: f64) -> f64 {
        let front_capacity = self.heat_capacity(&front.masses, front.temperature);
        let back_capacity = self.heat_capacity(&back.masses, back.temperature);
        if front_capacity <= 0.0 || back_capacity <= 0.0 {
            return 0.0;
        }
        // Eq. 13.11
        let both = front_capacity * back_capacity / (front_capacity + back_capacity);
        let flow = -both * (front.temperature - back.temperature) * (-conductance * dt / both).exp_m1();
        front.temperature =
            self.temperature(&front.masses, self.sensible_heat(&front.masses, front.temperature) - flow);
        back.temperature = self.temperature(&back.masses, self.sensible_heat(&back.masses, back.temperature) + flow);
        flow
    }
}

/// How much warmer than the reference a layer of these capacities is [K]: Eq. 13.2 turned round.
#[inline]
fn over_reference(constant: f64, slope: f64, sensible_heat: f64) -> f64 {
    let root = (constant * constant + 2.0 * slope * sensible_heat).max(0.0).sqrt();
    if constant + root > 0.0 { 2.0 * sensible_heat / (constant + root) } else { 0.0 }
}

/// Most of each substance that there is at the start or that can come of it, per dry mass: the scale of orders.
fn scales(data: &ChemistryData) -> Masses {
    let mut scales = data.composition;
    // Products of products need another round each; a chain is no longer than the table.
    for _ in 0..SUBSTANCES {
        let mut made = data.composition;
        for product in 0..SUBSTANCES {
            let most = data.reactions.iter().map(|r| (r.reactant as usize, r.products[product]));
            let mut by_reactant = [0.0f64; SUBSTANCES];
            for (reactant, share) in most {
                by_reactant[reactant] = by_reactant[reactant].max(share);
            }
            made[product] += (0..SUBSTANCES).map(|reactant| scales[reactant] * by_reactant[reactant]).sum::<f64>();
        }
        scales = made;
    }
    scales.map(|scale| if scale > 0.0 { scale } else { 1.0 })
}

/// Products less the reactant, by mass of it.
fn minus(products: &Masses, reactant: usize) -> Masses {
    let mut change = *products;
    change[reactant] -= 1.0;
    change
}

fn drying(moisture: &Moisture) -> Prepared {
    Prepared {
        kind: Kind::Drying,
        reactant: Substance::Water as usize,
        products: [0.0; SUBSTANCES],
        change: minus(&[0.0; SUBSTANCES], Substance::Water as usize),
        volatiles: 0.0,
        oxides: 0.0,
        steam: 1.0,
        oxygen: 0.0,
        heat: -moisture.heat,
        volatile_energy: 0.0,
        volatile_oxygen: 0.0,
        gas_heat_capacity: Gas::Steam.specific_heat(),
        log_frequency: moisture.frequency.ln(),
        activation_temperature: moisture.activation_energy / GAS_CONSTANT,
        order: 1.0,
        oxygen_exponent: 0.0,
        scale: 1.0,
        idle_below: 0.0,
    }
}

fn prepare(reaction: &Reaction, data: &ChemistryData, combustion: &Masses, scale: f64) -> Result<Prepared, String> {
    let Reaction { reactant, products, fuel_fraction, oxygen, .. } = reaction;
    let reactant = *reactant as usize;
    if reactant == Substance::Water as usize || products[Substance::Water as usize] != 0.0 {
        return Err("water takes part in drying only".to_owned());
    }
    if products[reactant] != 0.0 {
        return Err("what is used up cannot be a product".to_owned());
    }
    if products.iter().any(|part| *part < 0.0) || *oxygen < 0.0 || !(0.0..=1.0).contains(fuel_fraction) {
        return Err("yields and oxygen are 0 or more, the fuel fraction is 0 to 1".to_owned());
    }
    if !(reaction.frequency > 0.0 && reaction.activation_energy >= 0.0 && reaction.order > 0.0) {
        return Err("the frequency factor and the order must be over 0, the activation energy not under".to_owned());
    }
    if (*oxygen > 0.0) != (reaction.oxygen_exponent > 0.0) {
        return Err("oxygen that is taken needs an oxygen exponent over 0, and the other way round".to_owned());
    }
    let gas = 1.0 + oxygen - products.iter().sum::<f64>();
    if gas < -1e-12 {
        return Err(format!("the products weigh {} kg more than what goes in", -gas));
    }
    let gas = gas.max(0.0);
    let (volatiles, oxides) = (gas * fuel_fraction, gas * (1.0 - fuel_fraction));
    let carried = volatiles * Gas::Volatiles.specific_heat() + oxides * Gas::Oxides.specific_heat();
    let gas_heat_capacity = carried - oxygen * Gas::Oxygen.specific_heat();
    // Kirchhoff's law, from the temperature at which the heat was given to that of reference.
    let (from, to) = (reaction.heat_temperature - REFERENCE_TEMPERATURE, &data.specific_heats);
    let sensible = |k: usize| from * (to[k].at_reference + 0.5 * to[k].slope * from);
    let products_heat: f64 = (0..SUBSTANCES).map(|k| products[k] * sensible(k)).sum();
    // Eq. 13.5, Hess's law: what the solids lose and is not set free now leaves as fuel.
    let lost = combustion[reactant] - (0..SUBSTANCES).map(|k| products[k] * combustion[k]).sum::<f64>();
    let heat = match (reaction.heat, volatiles > 0.0) {
        (Some(heat), true) => heat + products_heat + gas_heat_capacity * from - sensible(reactant),
        (None, true) => return Err("a reaction that gives fuel gas needs a heat".to_owned()),
        (Some(_), false) => return Err("without fuel gas the heat follows from the heats of combustion".to_owned()),
        (None, false) => lost,
    };
    let volatile_energy = lost - heat;
    let demand: f64 = (0..SUBSTANCES).map(|k| products[k] * data.oxygen_demands[k]).sum();
    let volatile_oxygen = data.oxygen_demands[reactant] - demand - oxygen;
    if volatiles == 0.0 {
        // Burnt gas burns no further, so the oxygen must close by itself.
        if volatile_oxygen.abs() > 1e-6 {
            return Err(format!(
                "takes {oxygen} kg of oxygen a kilogram, but the demands ask for {volatile_oxygen:+.4} kg"
            ));
        }
    } else if volatile_energy < 0.0 || volatile_oxygen < 0.0 {
        return Err(format!(
            "its gas would burn with {volatile_energy:.0} J and {volatile_oxygen:.4} kg of oxygen a kilogram: \
             the heat or the oxygen taken is too much for the heats of combustion"
        ));
    }
    let log_frequency = reaction.frequency.ln();
    let activation_temperature = reaction.activation_energy / GAS_CONSTANT;
    let log_ratio = log_frequency - IDLE_RATE.ln();
    Ok(Prepared {
        kind: if *oxygen > 0.0 { Kind::Oxidation } else { Kind::Pyrolysis },
        reactant,
        products: *products,
        change: minus(products, reactant),
        volatiles,
        oxides,
        steam: 0.0,
        oxygen: *oxygen,
        heat,
        volatile_energy,
        volatile_oxygen,
        gas_heat_capacity,
        log_frequency,
        activation_temperature,
        order: reaction.order,
        oxygen_exponent: reaction.oxygen_exponent,
        scale,
        idle_below: if log_ratio > 0.0 { activation_temperature / log_ratio } else { f64::INFINITY },
    })
}

impl Prepared {
    /// k = A exp(-E/(R T)) [1/s].
    #[inline]
    fn rate(&self, temperature: f64) -> f64 {
        (self.log_frequency - self.activation_temperature / temperature).exp()
    }
}

#[cfg(test)]
mod tests;
