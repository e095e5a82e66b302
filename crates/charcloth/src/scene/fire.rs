//! Heat, ignition and burning.

use super::{Face, Point, Region};
use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

choice! {
    /// How the heat capacity follows the fuel (S5).
    HeatCapacityLaw {
        /// dT/dt = k3 m dQ/dt, as the text has it: a node without fuel keeps its temperature for ever.
        Literal,
        /// dT/dt = k3 m0 dQ/dt: the exact front speeds hold for this one.
        #[default]
        Constant,
        /// dT/dt = dQ/dt / (c m), with a floor for ash.
        Inverse,
    }
}

choice! {
    /// Which distance heat is conducted over (S1).
    ConductionDistance {
        /// The distance at rest: heat runs through the material.
        #[default]
        Rest,
        /// The distance now, not under a tenth of that at rest.
        Current,
    }
}

/// Heat, ignition and burning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Fire {
    /// Temperature of the room and of the sheet at the start.
    pub ambient_temperature: Temperature,
    /// Gas around the sheet in the physical model, one of `charcloth list gases`.
    pub gas: String,
    /// Relative humidity of the room, in the physical model.
    pub humidity: Ratio,
    /// Mole fraction of oxygen in the room, in the physical model.
    pub oxygen: Ratio,
    /// Pressure of the room, in the physical model.
    pub pressure: Pressure,
    /// Factor on the speed at which fire spreads and burns out, in the physical model: an artist's, 1 is nature.
    pub speed_gain: Ratio,
    /// Temperature above which fuel burns (T0).
    pub ignition_temperature: Temperature,
    /// Time in which sheet of the nominal grammage burns out.
    pub burn_time: Time,
    /// Heat released by a mass of fuel, as far as it stays in the sheet.
    pub heat_of_combustion: SpecificEnergy,
    /// Heat capacity of a mass of unburnt sheet.
    pub heat_capacity: SpecificHeat,
    /// How the heat capacity follows the fuel.
    pub heat_capacity_law: HeatCapacityLaw,
    /// Least heat capacity under `heat_capacity_law = "inverse"`, as a part of that at the start.
    pub ash_capacity: Ratio,
    /// Effective in-sheet diffusivity; it stands for the heat that comes back through the gas.
    pub diffusivity: Diffusivity,
    /// Which distance heat is conducted over.
    pub distance: ConductionDistance,
    /// Rate at which a sheet loses its excess temperature to the room (Newton's law); 0 in the text of 2004.
    pub cooling_rate: Rate,
    /// Catch fire within a time step, at the moment the threshold is crossed, and not only with the next step.
    pub ignite_within_step: bool,
    /// The coefficients of the text as they stand, per node. Uniform grids and chains only.
    pub raw: Option<Raw>,
}

impl Default for Fire {
    fn default() -> Self {
        Self {
            ambient_temperature: Temperature(293.15),
            gas: "flame".to_owned(),
            humidity: Ratio(0.5),
            oxygen: Ratio(0.209),
            pressure: Pressure(101_325.0),
            speed_gain: Ratio(1.0),
            ignition_temperature: Temperature(623.15), // fast loss of mass of cotton, 330 to 350 degC [Fsri2022]
            burn_time: Time(1.5),                      // from V = 2.7 mm/s and a burning length of 4 mm, Eq. 4.1
            heat_of_combustion: SpecificEnergy(1.17e6), // gives a burnt rise of 900 K, Eq. 4.1
            heat_capacity: SpecificHeat(1300.0), // 1.22 to 1.45 kJ/(kg K) for cotton at room temperature [Fsri2022]
            heat_capacity_law: HeatCapacityLaw::default(),
            ash_capacity: Ratio(0.1),         // tuned: ash of paper is 1 to 20 % of its mass
            diffusivity: Diffusivity(4.3e-6), // from V = 2.7 mm/s and a preheat length of 1.6 mm, Eq. 4.1
            distance: ConductionDistance::default(),
            cooling_rate: Rate(0.0),
            ignite_within_step: true,
            raw: None,
        }
    }
}

/// The coefficients of the 2004 text as they stand, the same for every node. What is left out follows from the
/// intensive values.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Raw {
    /// Fuel of a node at the start (m0).
    pub node_fuel: Option<Mass>,
    /// Conduction (k0): q = k0 dT/dx.
    pub k0: Option<ConductanceLength>,
    /// Fuel loss (k1).
    pub k1: Option<MassRate>,
    /// Heat per mass (k2).
    pub k2: Option<SpecificEnergy>,
    /// Heating (k3): dT/dt = k3 m dQ/dt.
    pub k3: Option<HeatingCoefficient>,
    /// Thermal force (k4): F = k4 dT/dx.
    pub k4: Option<ThermalForce1>,
    /// Curl (k5): F = k5 (T - T_ambient).
    pub k5: Option<ForcePerKelvin>,
    /// Stiffness of structural springs (K0).
    pub structural: Option<ForcePerWidth>,
    /// Stiffness of shear springs.
    pub shear: Option<ForcePerWidth>,
    /// Stiffness of flexion springs.
    pub flexion: Option<ForcePerWidth>,
}

/// The raw k4 [N m/K].
pub type ThermalForce1 = crate::units::ThermalForce;

/// A radiant heater: a flux that falls on part of one face.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Heater {
    /// The face it shines on.
    pub face: Face,
    /// What falls on it.
    pub flux: HeatFlux,
    /// A point, with `radius`.
    pub point: Option<Point>,
    /// Reach of `point`.
    pub radius: Length,
    /// A box.
    #[serde(rename = "box")]
    pub region: Option<Region>,
    /// When it begins.
    pub start: Time,
    /// How long it lasts.
    pub length: Time,
}
