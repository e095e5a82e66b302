//! What to simulate, as plain data. `charcloth-io` reads it from TOML; programs may fill it in directly.
//!
//! Every number is SI. Values are intensive (per width, per area, per mass): what each node and edge gets follows from
//! the mesh, so a scene looks the same at any resolution. The exception is `[fire.raw]`, for uniform grids.

macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$variant_doc])* $variant),* }
    };
}

mod contact;
mod fire;
mod mechanics;
mod motion;
mod output;
mod paint;
mod places;
mod sheet;

pub use contact::{Contact, Obstacle, ObstacleShape};
pub use fire::{ConductionDistance, Fire, HeatCapacityLaw, Heater, Raw, ThermalForce1};
pub use mechanics::{
    Crack, Curl, CurlLaw, DragLaw, LimitWeights, Mechanics, Shell, ThermalForce, ThermalForceLaw, Threshold, Wind,
    WindKey,
};
pub use motion::{Follow, Motion, PullKey};
pub use output::{Camera, Expect, Output, Probe, Style};
pub use paint::{Mask, Paint, PaintedGain, PaintedTime};
pub use places::{Corner, HalfSpace, Ignite, Pin, Region, Side};
pub use sheet::{Backing, Board, Edges, Face, LengthUnit, Pose, Rest, Shape, Sheet, Variation};

use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A point or vector in metres.
pub type Point = [Length; 3];

/// A whole scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// Short name, used for the output folder.
    pub name: String,
    /// One or two sentences: what it shows and how it departs from the real thing.
    pub about: String,
    /// The burning model.
    pub model: Model,
    /// Seed of everything random: formation noise, mesh jitter, gusts.
    pub seed: u64,
    /// Which way is up; gravity points the other way.
    pub up: Axis,
    /// The sheet: its shape or mesh, and what it is made of.
    pub sheet: Sheet,
    /// Heat, ignition and burning.
    pub fire: Fire,
    /// Springs, damping, limits, breakage.
    pub mechanics: Mechanics,
    /// Elasticity of the material, for integrators that take the sheet as a shell.
    pub shell: Shell,
    /// Cracks of the physical model, and what becomes of the pieces.
    pub crack: Crack,
    /// How heat pulls the sheet together.
    pub thermal_force: ThermalForce,
    /// How heat curls the sheet.
    pub curl: Curl,
    /// Gravity; 0 switches it off.
    pub gravity: Acceleration,
    /// Moving air.
    pub wind: Wind,
    /// Motion that the sheet has already.
    pub motion: Motion,
    /// What is painted on the sheet to direct the fire.
    pub paint: Paint,
    /// Where the sheet is held.
    pub pin: Vec<Pin>,
    /// What sheets do where they touch.
    pub contact: Contact,
    /// Solid things in the way.
    pub obstacle: Vec<Obstacle>,
    /// Where and when it is lit.
    pub ignite: Vec<Ignite>,
    /// Radiant heaters of the physical model.
    pub heater: Vec<Heater>,
    /// Frames and steps.
    pub time: TimeSettings,
    /// How the state differs from rest at the start.
    pub initial: Initial,
    /// Pictures.
    pub output: Output,
    /// Things to measure while running.
    pub probe: Vec<Probe>,
    /// What must come out, with tolerance and source; `charcloth check` compares.
    pub expect: Vec<Expect>,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            name: String::new(),
            about: String::new(),
            model: Model::default(),
            seed: 1,
            up: Axis::default(),
            sheet: Sheet::default(),
            fire: Fire::default(),
            mechanics: Mechanics::default(),
            shell: Shell::default(),
            crack: Crack::default(),
            thermal_force: ThermalForce::default(),
            curl: Curl::default(),
            gravity: Acceleration(9.81),
            wind: Wind::default(),
            motion: Motion::default(),
            paint: Paint::default(),
            pin: Vec::new(),
            contact: Contact::default(),
            obstacle: Vec::new(),
            ignite: Vec::new(),
            heater: Vec::new(),
            time: TimeSettings::default(),
            initial: Initial::default(),
            output: Output::default(),
            probe: Vec::new(),
            expect: Vec::new(),
        }
    }
}

choice! {
    /// Burning models.
    Model {
        /// The 2004 sketch, term by term (docs/physics.md).
        #[default]
        Moidu2004,
        /// Measured materials, chemistry and a closure for the flame (docs/physics.md, sections 13 to 15).
        Physical,
    }
}

choice! {
    /// A coordinate axis.
    Axis {
        /// The y axis, as in Houdini, Maya and glTF.
        #[default]
        Y,
        /// The z axis, as in Blender.
        Z,
    }
}

/// Frames and steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TimeSettings {
    /// Frames after the first, which is the start.
    pub frames: u32,
    /// Frames a second.
    pub fps: f64,
    /// Longest step of heat and chemistry; the step also stays stable by itself.
    pub step: Time,
    /// Substeps of motion in a step; left out, the sheet's stiffness and mass decide.
    pub substeps: Option<u32>,
}

impl Default for TimeSettings {
    fn default() -> Self {
        Self { frames: 192, fps: 24.0, step: Time(2e-3), substeps: None }
    }
}

/// How the state differs from rest at the start.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Initial {
    /// Velocity of every node that is not pinned.
    pub velocity: [Speed; 3],
    /// A temperature wave on a grid, added to ambient.
    pub temperature_wave: Option<Wave<Temperature>>,
    /// A standing wave of displacement on a grid or chain.
    pub displacement_wave: Option<DisplacementWave>,
    /// Stretches the sheet about its middle along x, y and z; 1 leaves it.
    pub stretch: Option<[f64; 3]>,
}

/// A cosine (insulated) mode on a grid: cos(k pi (i + 1/2)/N) along each direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wave<T> {
    /// Mode number along the width and along the height.
    pub mode: [u32; 2],
    /// Height of the wave.
    pub amplitude: T,
}

/// A sine mode between fixed ends: sin(k pi i/(N - 1)) along the width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DisplacementWave {
    /// Mode number.
    pub mode: u32,
    /// Height and direction of the wave.
    pub amplitude: Point,
}
