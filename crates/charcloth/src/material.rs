//! Materials: every number that describes a paper or cloth, and where it is from.
//!
//! A [`Material`] is plain data in SI. Each number is a [`Sourced`] one: it has the key of a source, or says that it was
//! tuned, why, and within what range. `charcloth-io` reads materials from TOML.

use crate::chemistry::{ChemistryData, Moisture, Reaction};
use crate::error::Error;
use crate::substances::{Masses, SUBSTANCE_TABLE, SUBSTANCES, SpecificHeat, Substance};
use crate::units::{
    BendingStiffness, Conductivity, Grammage, Length, Modulus, MolarEnergy, Rate, Ratio, SpecificEnergy,
    SpecificHeatSlope, Temperature,
};
use serde::Deserialize;
use serde::de::{Deserializer, Error as _, MapAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// Where a number is from.
#[derive(Debug, Clone, PartialEq)]
pub enum Basis<Q> {
    /// Read in, or worked out from, a source: a key of `docs/references.md`, perhaps with words after it.
    Source(String),
    /// Chosen.
    Tuned {
        /// Why this value.
        why: String,
        /// Between what values it may lie.
        range: [Q; 2],
    },
}

/// A number with its basis.
#[derive(Debug, Clone, PartialEq)]
pub struct Sourced<Q> {
    /// The number, in SI.
    pub value: Q,
    /// Where it is from.
    pub basis: Basis<Q>,
}

impl<'de, Q: Deserialize<'de> + PartialOrd + Copy> Deserialize<'de> for Sourced<Q> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SourcedVisitor(PhantomData))
    }
}

struct SourcedVisitor<Q>(PhantomData<Q>);

/// Keys of a number.
#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "lowercase")]
enum SourcedKey {
    Value,
    Source,
    Tuned,
    Range,
}

/// What stands behind `; expected` goes into the hint of a message.
const NO_SOURCE: &str = "a number needs its source; expected { value = ..., source = \"Key of docs/references.md\" } or \
                         { value = ..., tuned = \"why\", range = [low, high] }";

impl<'de, Q: Deserialize<'de> + PartialOrd + Copy> Visitor<'de> for SourcedVisitor<Q> {
    type Value = Sourced<Q>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{ value = ..., source = \"...\" } or { value = ..., tuned = \"why\", range = [low, high] }")
    }

    fn visit_f64<E: serde::de::Error>(self, _: f64) -> Result<Self::Value, E> {
        Err(E::custom(NO_SOURCE))
    }

    fn visit_i64<E: serde::de::Error>(self, _: i64) -> Result<Self::Value, E> {
        Err(E::custom(NO_SOURCE))
    }

    fn visit_u64<E: serde::de::Error>(self, _: u64) -> Result<Self::Value, E> {
        Err(E::custom(NO_SOURCE))
    }

    fn visit_str<E: serde::de::Error>(self, _: &str) -> Result<Self::Value, E> {
        Err(E::custom(NO_SOURCE))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let (mut value, mut source, mut tuned) = (None, None::<String>, None::<String>);
        let mut range: Option<[Q; 2]> = None;
        while let Some(key) = map.next_key()? {
            match key {
                SourcedKey::Value => value = Some(map.next_value::<Q>()?),
                SourcedKey::Source => source = Some(map.next_value()?),
                SourcedKey::Tuned => tuned = Some(map.next_value()?),
                SourcedKey::Range => range = Some(map.next_value()?),
            }
        }
        let value = value.ok_or_else(|| A::Error::missing_field("value"))?;
        let basis = match (source, tuned, range) {
            (Some(key), None, None) if key.trim().is_empty() => {
                return Err(A::Error::custom("the source is empty; expected a key of docs/references.md"));
            }
            (Some(key), None, None) => Basis::Source(key),
            (None, Some(why), Some(range)) => {
                if !(range[0] <= value && value <= range[1]) {
                    return Err(A::Error::custom(
                        "the value is not within its range; expected range = [low, high] around it",
                    ));
                }
                Basis::Tuned { why, range }
            }
            (None, Some(_), None) => {
                return Err(A::Error::custom("a tuned number needs its range; expected range = [low, high] as well"));
            }
            (None, None, _) => return Err(A::Error::custom(NO_SOURCE)),
            (Some(_), _, _) => {
                return Err(A::Error::custom("a number is either from a source or tuned; expected one of the two"));
            }
        };
        Ok(Sourced { value, basis })
    }
}

/// A kind of paper or cloth.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name, as scenes write it.
    pub name: String,
    /// One line about it.
    pub about: String,
    /// The sheet as it comes.
    pub sheet: Sheet,
    /// Parts of the dry sheet.
    pub composition: Composition,
    /// Moisture.
    pub moisture: MoistureOf,
    /// Heat.
    pub thermal: Thermal,
    /// What complete burning gives and takes.
    pub combustion: Combustion,
    /// Reactions, but for drying.
    pub reactions: Vec<ReactionOf>,
    /// Strength and stiffness.
    pub mechanics: Mechanics,
}

/// The sheet as it comes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// Mass per area, in balance with a room of 50 % relative humidity [kg/m2].
    pub grammage: Sourced<Grammage>,
    /// Thickness [m].
    pub thickness: Sourced<Length>,
    /// Formation: standard deviation of local grammage over its mean.
    pub formation: Sourced<Ratio>,
    /// Formation: length over which local grammage is alike [m].
    pub formation_length: Sourced<Length>,
    /// Cockle: standard deviation of the height of the sheet over its surface [m].
    pub cockle: Option<Sourced<Length>>,
    /// Cockle: wavelength [m].
    pub cockle_length: Option<Sourced<Length>>,
}

/// Parts of the dry sheet; they add up to 1.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Composition {
    /// The fibre that burns.
    pub fibre: Sourced<Ratio>,
    /// A second fibre, or a coating.
    pub polymer: Option<Sourced<Ratio>>,
    /// Mineral filler.
    pub filler: Option<Sourced<Ratio>>,
    /// Mineral that nothing happens to.
    pub ash: Option<Sourced<Ratio>>,
}

/// Moisture and drying (Eq. 13.6, 13.7).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoistureOf {
    /// At 50 % relative humidity [kg per kg of dry sheet].
    pub at_half_humidity: Sourced<Ratio>,
    /// Exponent of the sorption isotherm.
    pub isotherm_exponent: Sourced<Ratio>,
    /// Frequency factor of drying [1/s].
    pub frequency: Sourced<Rate>,
    /// Activation energy of drying [J/mol].
    pub activation_energy: Sourced<MolarEnergy>,
    /// Heat that drying takes [J per kg of water].
    pub heat: Sourced<SpecificEnergy>,
}

/// How heat goes into the sheet and through it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    /// Conductivity in the plane, along the machine or warp [W/(m K)].
    pub conductivity_machine: Sourced<Conductivity>,
    /// Conductivity in the plane, across it [W/(m K)].
    pub conductivity_cross: Sourced<Conductivity>,
    /// Conductivity through the thickness [W/(m K)].
    pub conductivity_through: Sourced<Conductivity>,
    /// Emissivity, and absorptivity for what is as warm as the sheet.
    pub emissivity: Sourced<Ratio>,
    /// Absorptivity for the light of flames (1000 to 2000 K).
    pub absorptivity: Sourced<Ratio>,
    /// Emissivity and absorptivity of char.
    pub char_emissivity: Sourced<Ratio>,
    /// Emissivity and absorptivity of ash.
    pub ash_emissivity: Sourced<Ratio>,
    /// Specific heat of the fibre at 25 degC, where it is not cellulose [J/(kg K)].
    pub fibre_specific_heat: Option<Sourced<crate::units::SpecificHeat>>,
    /// Its rise with temperature [J/(kg K2)].
    pub fibre_specific_heat_slope: Option<Sourced<SpecificHeatSlope>>,
    /// Specific heat of the polymer at 25 degC, where it is not polyester [J/(kg K)].
    pub polymer_specific_heat: Option<Sourced<crate::units::SpecificHeat>>,
}

/// What complete burning gives and takes, water as vapour.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Combustion {
    /// Heat of the fibre [J/kg].
    pub fibre_heat: Sourced<SpecificEnergy>,
    /// Oxygen that it takes [kg/kg].
    pub fibre_oxygen: Sourced<Ratio>,
    /// Heat of the polymer [J/kg].
    pub polymer_heat: Option<Sourced<SpecificEnergy>>,
    /// Oxygen that it takes [kg/kg].
    pub polymer_oxygen: Option<Sourced<Ratio>>,
    /// Heat of char, young and old [J/kg].
    pub char_heat: Sourced<SpecificEnergy>,
    /// Oxygen that it takes [kg/kg].
    pub char_oxygen: Sourced<Ratio>,
    /// Heat that the breakdown of the filler takes up [J/kg].
    pub filler_breakdown: Option<Sourced<SpecificEnergy>>,
}

/// A reaction of a material.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReactionOf {
    /// Name.
    pub name: String,
    /// What is used up.
    pub reactant: String,
    /// Condensed products [kg/kg], by name.
    #[serde(default)]
    pub products: Products,
    /// Part of the gas made that is fuel.
    pub fuel_fraction: Sourced<Ratio>,
    /// Oxygen taken up [kg/kg].
    pub oxygen: Option<Sourced<Ratio>>,
    /// Power of the oxygen mole fraction.
    pub oxygen_exponent: Option<Sourced<Ratio>>,
    /// Frequency factor [1/s].
    pub frequency: Sourced<Rate>,
    /// Activation energy [J/mol].
    pub activation_energy: Sourced<MolarEnergy>,
    /// Order in the reactant.
    pub order: Sourced<Ratio>,
    /// Heat given out [J/kg]; negative where it is taken up.
    pub heat: Option<Sourced<SpecificEnergy>>,
    /// Temperature at which `heat` holds [K]; 25 degC if not given.
    pub heat_temperature: Option<Sourced<Temperature>>,
}

/// Yields of condensed products [kg/kg].
#[derive(Debug, Clone, PartialEq, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Products {
    /// Of a second fibre (an intermediate).
    pub polymer: Option<Sourced<Ratio>>,
    /// Of char that still loses gas.
    pub young_char: Option<Sourced<Ratio>>,
    /// Of char.
    pub char: Option<Sourced<Ratio>>,
    /// Of ash.
    pub ash: Option<Sourced<Ratio>>,
}

/// Strength and stiffness of the sheet, unburnt, and what burning makes of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mechanics {
    /// Young's modulus along the machine direction or warp [Pa].
    pub modulus_machine: Sourced<Modulus>,
    /// Young's modulus across [Pa].
    pub modulus_cross: Sourced<Modulus>,
    /// Shear modulus in the plane [Pa].
    pub shear_modulus: Sourced<Modulus>,
    /// Geometric mean of the two Poisson ratios.
    pub poisson: Sourced<Ratio>,
    /// Bending stiffness along the machine direction or warp, per width [N m].
    pub bending_machine: Sourced<BendingStiffness>,
    /// Bending stiffness across, per width [N m].
    pub bending_cross: Sourced<BendingStiffness>,
    /// Tensile strength along the machine direction or warp [Pa].
    pub strength_machine: Sourced<Modulus>,
    /// Tensile strength across [Pa].
    pub strength_cross: Sourced<Modulus>,
    /// Expansion from 20 to 75 % relative humidity, along.
    pub wetting_machine: Sourced<Ratio>,
    /// Expansion from 20 to 75 % relative humidity, across.
    pub wetting_cross: Sourced<Ratio>,
    /// Linear shrinkage in the plane when all fibre has become char.
    pub char_shrinkage: Sourced<Ratio>,
    /// Modulus of char over that of the sheet.
    pub char_stiffness: Sourced<Ratio>,
    /// Strength of char over that of the sheet.
    pub char_strength: Sourced<Ratio>,
    /// Length over which tension is averaged where it is asked whether the sheet cracks [m].
    pub crack_length: Sourced<Length>,
    /// Strain of the faces past which bending stays as a crease; left out where the sheet always comes back, as cloth does.
    pub crease_strain: Option<Sourced<Ratio>>,
}

/// A part that may be left out: then there is none.
fn part(part: &Option<Sourced<Ratio>>) -> f64 {
    part.as_ref().map_or(0.0, |part| part.value.0)
}

impl Composition {
    fn masses(&self) -> Masses {
        let mut masses = [0.0; SUBSTANCES];
        masses[Substance::Fibre as usize] = self.fibre.value.0;
        masses[Substance::Polymer as usize] = part(&self.polymer);
        masses[Substance::Filler as usize] = part(&self.filler);
        masses[Substance::Ash as usize] = part(&self.ash);
        masses
    }
}

impl Products {
    fn masses(&self) -> Masses {
        let mut masses = [0.0; SUBSTANCES];
        masses[Substance::Polymer as usize] = part(&self.polymer);
        masses[Substance::YoungChar as usize] = part(&self.young_char);
        masses[Substance::Char as usize] = part(&self.char);
        masses[Substance::Ash as usize] = part(&self.ash);
        masses
    }
}

impl Material {
    /// Dry mass per area [kg/m2]: the grammage without the moisture of 50 % relative humidity.
    pub fn dry_grammage(&self) -> f64 {
        self.sheet.grammage.value.0 / (1.0 + self.moisture.at_half_humidity.value.0)
    }

    /// Char that the fibre of a dry sheet leaves when it is heated without oxygen [kg per kg of dry sheet].
    pub fn char_yield(&self) -> f64 {
        let of = |name: &str| {
            let mut without_oxygen = self.reactions.iter().filter(|row| row.reactant == name && row.oxygen.is_none());
            without_oxygen.next().map_or(0.0, |row| part(&row.products.young_char) + part(&row.products.char))
        };
        self.composition.fibre.value.0 * of("fibre") + part(&self.composition.polymer) * of("polymer")
    }

    /// The chemistry of the material.
    pub fn chemistry(&self) -> Result<ChemistryData, Error> {
        let mut specific_heats = SUBSTANCE_TABLE.map(|row| row.specific_heat);
        let Thermal { fibre_specific_heat, fibre_specific_heat_slope, polymer_specific_heat, .. } = &self.thermal;
        let fibre = &mut specific_heats[Substance::Fibre as usize];
        *fibre = SpecificHeat {
            at_reference: fibre_specific_heat.as_ref().map_or(fibre.at_reference, |heat| heat.value.0),
            slope: fibre_specific_heat_slope.as_ref().map_or(fibre.slope, |slope| slope.value.0),
        };
        if let Some(heat) = polymer_specific_heat {
            specific_heats[Substance::Polymer as usize].at_reference = heat.value.0;
        }
        let Combustion { fibre_heat, fibre_oxygen, char_heat, char_oxygen, .. } = &self.combustion;
        let Combustion { polymer_heat, polymer_oxygen, filler_breakdown, .. } = &self.combustion;
        let mut heats_of_combustion = [0.0; SUBSTANCES];
        let mut oxygen_demands = [0.0; SUBSTANCES];
        for (substance, heat, oxygen) in [
            (Substance::Fibre, fibre_heat.value.0, fibre_oxygen.value.0),
            (Substance::Polymer, polymer_heat.as_ref().map_or(0.0, |heat| heat.value.0), part(polymer_oxygen)),
            (Substance::YoungChar, char_heat.value.0, char_oxygen.value.0),
            (Substance::Char, char_heat.value.0, char_oxygen.value.0),
            (Substance::Filler, filler_breakdown.as_ref().map_or(0.0, |heat| -heat.value.0), 0.0),
        ] {
            heats_of_combustion[substance as usize] = heat;
            oxygen_demands[substance as usize] = oxygen;
        }
        let reactions = self.reactions.iter().enumerate().map(|(row, reaction)| {
            let reactant = Substance::named(&reaction.reactant).ok_or_else(|| {
                let names = SUBSTANCE_TABLE.map(|row| row.name).join(", ");
                let problem = format!("\"{}\" is no substance", reaction.reactant);
                Error::scene(format!("reactions.{row}.reactant"), problem, format!("there are: {names}"))
            })?;
            Ok(Reaction {
                name: reaction.name.clone(),
                reactant,
                products: reaction.products.masses(),
                fuel_fraction: reaction.fuel_fraction.value.0,
                oxygen: part(&reaction.oxygen),
                frequency: reaction.frequency.value.0,
                activation_energy: reaction.activation_energy.value.0,
                order: reaction.order.value.0,
                oxygen_exponent: part(&reaction.oxygen_exponent),
                heat: reaction.heat.as_ref().map(|heat| heat.value.0),
                heat_temperature: reaction
                    .heat_temperature
                    .as_ref()
                    .map_or(crate::substances::REFERENCE_TEMPERATURE, |temperature| temperature.value.0),
            })
        });
        Ok(ChemistryData {
            composition: self.composition.masses(),
            specific_heats,
            heats_of_combustion,
            oxygen_demands,
            moisture: Moisture {
                at_half_humidity: self.moisture.at_half_humidity.value.0,
                isotherm_exponent: self.moisture.isotherm_exponent.value.0,
                frequency: self.moisture.frequency.value.0,
                activation_energy: self.moisture.activation_energy.value.0,
                heat: self.moisture.heat.value.0,
            },
            reactions: reactions.collect::<Result<_, Error>>()?,
        })
    }

    /// Checks what the types do not: signs, sums, and that the chemistry closes. Errors name the key.
    pub fn check(&self) -> Result<(), Error> {
        let Sheet { grammage, thickness, formation, formation_length, cockle, cockle_length } = &self.sheet;
        let Mechanics { modulus_machine, modulus_cross, shear_modulus, strength_machine, strength_cross, .. } =
            &self.mechanics;
        let Mechanics { bending_machine, bending_cross, poisson, .. } = &self.mechanics;
        for (key, value) in [
            ("sheet.grammage", grammage.value.0),
            ("sheet.thickness", thickness.value.0),
            ("sheet.formation_length", formation_length.value.0),
            ("sheet.cockle_length", cockle_length.as_ref().map_or(1.0, |it| it.value.0)),
            ("moisture.isotherm_exponent", self.moisture.isotherm_exponent.value.0),
            ("thermal.conductivity_machine", self.thermal.conductivity_machine.value.0),
            ("thermal.conductivity_cross", self.thermal.conductivity_cross.value.0),
            ("thermal.conductivity_through", self.thermal.conductivity_through.value.0),
            ("mechanics.modulus_machine", modulus_machine.value.0),
            ("mechanics.modulus_cross", modulus_cross.value.0),
            ("mechanics.shear_modulus", shear_modulus.value.0),
            ("mechanics.strength_machine", strength_machine.value.0),
            ("mechanics.strength_cross", strength_cross.value.0),
            ("mechanics.bending_machine", bending_machine.value.0),
            ("mechanics.bending_cross", bending_cross.value.0),
            ("mechanics.crack_length", self.mechanics.crack_length.value.0),
            ("mechanics.crease_strain", self.mechanics.crease_strain.as_ref().map_or(1.0, |strain| strain.value.0)),
        ] {
            if value <= 0.0 {
                return Err(Error::scene(key, format!("{value} is not over 0"), "give a value over 0"));
            }
        }
        for (key, value) in [
            ("sheet.formation", formation.value.0),
            ("sheet.cockle", cockle.as_ref().map_or(0.0, |it| it.value.0)),
            ("moisture.at_half_humidity", self.moisture.at_half_humidity.value.0),
            ("thermal.emissivity", self.thermal.emissivity.value.0),
            ("thermal.absorptivity", self.thermal.absorptivity.value.0),
            ("thermal.char_emissivity", self.thermal.char_emissivity.value.0),
            ("thermal.ash_emissivity", self.thermal.ash_emissivity.value.0),
            ("mechanics.poisson", poisson.value.0),
            ("mechanics.char_shrinkage", self.mechanics.char_shrinkage.value.0),
            ("mechanics.char_stiffness", self.mechanics.char_stiffness.value.0),
            ("mechanics.char_strength", self.mechanics.char_strength.value.0),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::scene(
                    key,
                    format!("{value} is not within 0 to 1"),
                    "a part is 0 to 1, or 0 to 100 %",
                ));
            }
        }
        let total: f64 = self.composition.masses().iter().sum();
        if (total - 1.0).abs() > 1e-6 {
            let problem = format!("the parts add up to {total}, not to 1");
            return Err(Error::scene("composition", problem, "change one of fibre, polymer, filler and ash"));
        }
        let data = self.chemistry()?;
        let room = crate::chemistry::Room { temperature: 293.15, relative_humidity: 0.5 };
        if let Err(problem) = crate::chemistry::Chemistry::build(&data, room) {
            return Err(Error::scene("reactions", problem, "see Eq. 13.3 to 13.5 in docs/physics.md"));
        }
        Ok(())
    }
}
