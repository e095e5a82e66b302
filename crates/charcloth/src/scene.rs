//! What to simulate, as plain data. `charcloth-io` reads it from TOML; programs may fill it in directly.
//!
//! Every number is SI. Values are intensive (per width, per area, per mass): what each node and edge gets follows from
//! the mesh, so a scene looks the same at any resolution. The exception is `[fire.raw]`, for uniform grids.

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

macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$variant_doc])* $variant),* }
    };
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
    /// A face of the sheet.
    Face {
        /// The one its normals point away from.
        #[default]
        Front,
        /// The other.
        Back,
    }
}

choice! {
    /// What is at the edges of the sheet.
    Edges {
        /// Air: flames reach round them, and fire runs faster along them.
        #[default]
        Free,
        /// A frame that keeps gas from going round, as laboratories have it.
        Framed,
    }
}

choice! {
    /// What lies against the back of the sheet.
    Backing {
        /// Nothing: air on both faces.
        #[default]
        None,
        /// An insulating board: no heat and no gas goes through the back.
        Insulated,
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

choice! {
    /// Built-in sheets.
    Shape {
        /// Rectangle of irregular triangles, so that fronts follow no grid.
        #[default]
        Unstructured,
        /// Rectangle of square cells with structural, shear and flexion springs, as in Provot 1995.
        Grid,
        /// Disc of irregular triangles.
        Disc,
        /// A single row of nodes joined by structural springs.
        Chain,
    }
}

choice! {
    /// How a built-in sheet is placed.
    Pose {
        /// Upright: width along x, height along up.
        #[default]
        Hanging,
        /// Flat on the ground plane.
        Lying,
    }
}

choice! {
    /// What length a mesh file counts in.
    LengthUnit {
        /// Metres.
        #[default]
        M,
        /// Centimetres.
        Cm,
        /// Millimetres.
        Mm,
        /// Inches.
        In,
        /// Feet.
        Ft,
    }
}

impl LengthUnit {
    /// Metres in one of these.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}

choice! {
    /// Which shape of the sheet is free of stress.
    Rest {
        /// The mesh as it lies.
        #[default]
        AsItLies,
        /// The mesh laid flat by its texture coordinates, scaled to keep its area.
        FlatByUv,
        /// The points of a second mesh, `sheet.rest_mesh`.
        Mesh,
    }
}

/// The sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sheet {
    /// Built-in shape, where no `mesh` is given.
    pub shape: Shape,
    /// Mesh file (OBJ, PLY, STL, glTF, GLB), relative to the scene file.
    pub mesh: Option<String>,
    /// What length the mesh file counts in.
    pub unit: LengthUnit,
    /// Which shape is free of stress.
    pub rest: Rest,
    /// Mesh file with the stress-free shape, for `rest = "mesh"`.
    pub rest_mesh: Option<String>,
    /// Width of a rectangle, length of a chain.
    pub width: Length,
    /// Height of a rectangle.
    pub height: Length,
    /// Radius of a disc.
    pub radius: Length,
    /// Distance between neighbouring nodes.
    pub spacing: Length,
    /// Number of segments along the width; given, it takes the place of `spacing`.
    pub segments: Option<u32>,
    /// How much finer the burn mesh is than the mesh that moves: each level halves the distance of nodes. 0 to 3.
    pub burn_level: u32,
    /// Material of the physical model, one of `charcloth list materials` or a file; gives grammage, thickness, moduli and
    /// formation where the scene does not.
    pub material: String,
    /// What lies against the back of the sheet, in the physical model.
    pub backing: Backing,
    /// What is at its edges, in the physical model.
    pub edges: Edges,
    /// Sheets one above the other, alike but for their mesh.
    pub layers: u32,
    /// Distance between them.
    pub layer_distance: Length,
    /// How a built-in sheet is placed.
    pub pose: Pose,
    /// Where the middle of the sheet (the origin of a mesh file) is put.
    pub position: Point,
    /// Turned about x, then y, then z.
    pub rotate: [Angle; 3],
    /// Mass per area.
    pub grammage: Grammage,
    /// How fuel varies over the sheet.
    pub variation: Variation,
    /// Standard deviation of the height of built-in sheets: paper is never perfectly flat, and a perfectly flat sheet has
    /// no reason to buckle to either side. It is the stress-free shape.
    pub cockle: Length,
    /// Correlation length of the cockle.
    pub cockle_length: Length,
}

impl Default for Sheet {
    fn default() -> Self {
        Self {
            shape: Shape::default(),
            mesh: None,
            unit: LengthUnit::default(),
            rest: Rest::default(),
            rest_mesh: None,
            width: Length(0.210), // ISO 216: A4
            height: Length(0.297),
            radius: Length(0.1),
            spacing: Length(0.003),
            segments: None,
            burn_level: 0,
            material: "copy_paper_80".to_owned(),
            backing: Backing::default(),
            edges: Edges::default(),
            layers: 1,
            layer_distance: Length(0.002),
            pose: Pose::default(),
            position: [Length(0.0); 3],
            rotate: [Angle(0.0); 3],
            grammage: Grammage(0.080),
            variation: Variation::default(),
            cockle: Length(2e-4), // tuned: copy paper at rest is wavy by tenths of a millimetre, 0 to 1 mm
            cockle_length: Length(0.02), // tuned: over centimetres, 10 to 50 mm
        }
    }
}

impl Sheet {
    /// Distance between neighbouring nodes [m], by `segments` or `spacing`.
    pub fn node_distance(&self) -> f64 {
        self.segments.map_or(self.spacing.0, |segments| self.width.0 / f64::from(segments.max(1)))
    }
}

/// How fuel varies over the sheet: formation noise, a map, or both (they multiply).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Variation {
    /// Standard deviation of the noise, as a part of the grammage. Paper is cloudy: 5 to 10 %.
    pub noise: Ratio,
    /// Correlation length of the noise, a function of the material point: the same field on every mesh.
    pub correlation_length: Length,
    /// Grey image laid on by texture coordinates: black is `map_low` times the grammage, white `map_high` times.
    pub map: Option<String>,
    /// Factor where the map is black.
    pub map_low: Ratio,
    /// Factor where the map is white.
    pub map_high: Ratio,
}

impl Default for Variation {
    fn default() -> Self {
        Self {
            noise: Ratio(0.08),                // tuned: middle of the 5 to 10 % local variation of paper formation
            correlation_length: Length(0.004), // tuned: formation clouds of paper are millimetres wide, 2 to 8 mm
            map: None,
            map_low: Ratio(0.5),
            map_high: Ratio(1.5),
        }
    }
}

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

choice! {
    /// When a spring breaks (S9).
    Threshold {
        /// The threshold weakens with the spring.
        #[default]
        Scaled,
        /// The threshold stays: the literal reading.
        Fixed,
    }
}

choice! {
    /// How the two free ends of an over-stretched spring share the way back.
    LimitWeights {
        /// By their masses, so that momentum is kept.
        #[default]
        Mass,
        /// Half each, as in Provot 1995.
        Equal,
    }
}

/// Springs, damping, limits, breakage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Mechanics {
    /// Whether the sheet moves at all; off, only heat and fuel are simulated.
    pub moves: bool,
    /// Time integrator, one of `charcloth list integrators`.
    pub integrator: String,
    /// Stiffness of structural springs, as tension per strain and width of sheet.
    pub structural: ForcePerWidth,
    /// Stiffness of shear springs (grids).
    pub shear: ForcePerWidth,
    /// Stiffness of flexion springs.
    pub flexion: ForcePerWidth,
    /// Viscous damping of all motion: the rate at which a free node loses its speed.
    pub damping: Rate,
    /// Damping along springs, as a part of their stiffness.
    pub spring_damping: Time,
    /// Mass that does not burn, as a part of the fuel at the start. At 0 a burnt node has no mass and no step is stable.
    pub inert_fraction: Ratio,
    /// Stretch past which springs are pulled back at once (Provot's deformation rate); 0 switches the limit off.
    pub deformation_limit: Ratio,
    /// Most sweeps of the limit over the springs that are past it, per substep.
    pub limit_sweeps: u32,
    /// How two free ends share the way back.
    pub limit_weights: LimitWeights,
    /// Tension per width that breaks the unburnt sheet; 0 means nothing tears.
    pub strength: ForcePerWidth,
    /// Whether the breaking threshold weakens with the spring.
    pub threshold: Threshold,
    /// Stiffness that char keeps, as a part of that of the sheet. 0 is the text of 2004: burnt sheet carries nothing.
    pub residual_stiffness: Ratio,
}

impl Default for Mechanics {
    fn default() -> Self {
        Self {
            moves: true,
            integrator: "symplectic_euler".to_owned(),
            structural: ForcePerWidth(100.0), // tuned: soft for paper (3e5 N/m), as explicit steps must be; 20 to 500
            shear: ForcePerWidth(50.0),       // tuned: half the structural stiffness makes a grid isotropic
            flexion: ForcePerWidth(10.0),     // tuned: a tenth of the structural stiffness, 1 to 50
            damping: Rate(1.0),               // tuned: sheets of paper stop swinging within seconds, 0.2 to 5
            spring_damping: Time(5e-6),       // tuned: a few per cent of critical for the stiffest mode, 0 to 20 us
            inert_fraction: Ratio(0.1),
            deformation_limit: Ratio(0.10), // Provot 1995: 10 %
            limit_sweeps: 8,
            limit_weights: LimitWeights::default(),
            strength: ForcePerWidth(0.0),
            threshold: Threshold::default(),
            residual_stiffness: Ratio(0.0),
        }
    }
}

/// Elasticity of the material: orthotropic, by moduli and thickness. The integrator `implicit` uses it in place of the
/// stiffness of springs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Shell {
    /// Thickness of the sheet.
    pub thickness: Length,
    /// Young's modulus in the machine direction.
    pub modulus_along: Modulus,
    /// Young's modulus across it.
    pub modulus_across: Modulus,
    /// Poisson's ratio, the geometric mean of the two directions.
    pub poisson: Ratio,
    /// Shear modulus; left out, that of an isotropic sheet with the geometric mean of the moduli.
    pub shear_modulus: Option<Modulus>,
    /// The machine direction, from "right" towards "top" of the sheet as it lies at the start.
    pub machine_direction: Angle,
    /// Damping of bending, as a part of its stiffness.
    pub bending_damping: Time,
    /// Newton iterations end when the energy they still gain has fallen to this part of the first gain.
    pub newton_tolerance: Ratio,
    /// Conjugate gradients end at this part of the error at the start, in the norm of energy.
    pub linear_tolerance: Ratio,
}

impl Default for Shell {
    fn default() -> Self {
        Self {
            thickness: Length(1.0e-4),       // 80 g/m2 copy paper of 800 kg/m3
            modulus_along: Modulus(6.5e9),   // tuned: copy paper, machine direction, 5 to 8 GPa
            modulus_across: Modulus(2.75e9), // tuned: copy paper, cross direction, 2 to 3.5 GPa
            poisson: Ratio(0.29),            // tuned: geometric mean of paper, 0.2 to 0.4
            shear_modulus: None,
            machine_direction: Angle(std::f64::consts::FRAC_PI_2),
            bending_damping: Time(5e-4), // tuned: takes the rattle out of creases, 0 to 5 ms
            newton_tolerance: Ratio(1e-3),
            linear_tolerance: Ratio(1e-2),
        }
    }
}

/// Cracks, in the physical model with the integrator `implicit`; by the strengths of the material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Crack {
    /// Whether the sheet cracks.
    pub enabled: bool,
    /// Pieces smaller than this become particles.
    pub particle_area: Area,
}

impl Default for Crack {
    fn default() -> Self {
        // tuned: two triangles of a mesh of 5 mm; 0.1 to 50 mm2
        Self { enabled: true, particle_area: Area(2e-5) }
    }
}

choice! {
    /// How heat pulls (first term of S6).
    ThermalForceLaw {
        /// A tension along each edge by its mean temperature: conserves momentum.
        #[default]
        Pairwise,
        /// k4 (Tj - Ti)/d on both ends in the same direction, as the text has it: a drag towards heat.
        Literal,
        /// None.
        Off,
    }
}

/// How heat pulls the sheet together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ThermalForce {
    /// The law.
    pub law: ThermalForceLaw,
    /// Strain by which a free edge contracts for a kelvin above ambient: k4 = K0 d^2 times this.
    pub contraction: PerKelvin,
}

impl Default for ThermalForce {
    fn default() -> Self {
        // tuned: 20 to 30 % shrinkage of charred paper over a rise of about 900 K
        Self { law: ThermalForceLaw::default(), contraction: PerKelvin(2.5e-4) }
    }
}

choice! {
    /// How heat curls (S8).
    CurlLaw {
        /// k5 (T - T_ambient) along the normal.
        #[default]
        Temperature,
        /// k5 times the in-sheet temperature gradient along the normal.
        Gradient,
        /// None.
        Off,
    }
}

/// How heat curls the sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Curl {
    /// The law.
    pub law: CurlLaw,
    /// Pressure along the normal for a kelvin above ambient; a negative one curls to the other side.
    pub pressure: PressurePerKelvin,
    /// Length that makes a difference of a gradient, for `law = "gradient"`.
    pub gradient_length: Length,
}

impl Default for Curl {
    fn default() -> Self {
        // tuned: at a rise of 900 K a few times the sheet's own weight per area of 0.8 Pa, 0 to 0.02
        Self { law: CurlLaw::default(), pressure: PressurePerKelvin(0.003), gradient_length: Length(0.001) }
    }
}

choice! {
    /// How air brakes and pushes the sheet.
    DragLaw {
        /// By the speed, with the coefficient C (Eq. 6.5b).
        #[default]
        Linear,
        /// By its square, as a plate broadside to the air (Eq. 17.7); default in the physical model.
        Plate,
    }
}

/// Moving air: F = C [n . (u - v)] n per area (Provot 1995).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Wind {
    /// Speed of the air.
    pub velocity: [Speed; 3],
    /// How air brakes and pushes the sheet.
    pub law: DragLaw,
    /// The coefficient C of the linear law; also slows a sheet that moves in still air. At 0 there is no air, by either law.
    pub coefficient: DragCoefficient,
    /// How much gusts add or take away, as a part of the speed.
    pub gust: Ratio,
    /// How long a gust lasts.
    pub gust_time: Time,
}

impl Default for Wind {
    fn default() -> Self {
        Self {
            velocity: [Speed(0.0); 3],
            law: DragLaw::default(),
            coefficient: DragCoefficient(0.6), // tuned: rho_air |v| / 2 at 1 m/s, 0.1 to 5
            gust: Ratio(0.0),
            gust_time: Time(0.5),
        }
    }
}

choice! {
    /// A side of the sheet, in the plane it lies in at the start.
    Side {
        /// Lowest along up (or towards the viewer where it lies flat).
        #[default]
        Bottom,
        /// Highest.
        Top,
        /// Lowest x.
        Left,
        /// Highest x.
        Right,
    }
}

choice! {
    /// A corner of the sheet.
    Corner {
        /// Bottom left.
        #[default]
        BottomLeft,
        /// Bottom right.
        BottomRight,
        /// Top left.
        TopLeft,
        /// Top right.
        TopRight,
    }
}

/// A box with faces along the axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Lowest corner.
    pub low: Point,
    /// Highest corner.
    pub high: Point,
}

/// Half of space: the side of `point` that `normal` points away from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point on the plane.
    pub point: Point,
    /// The direction that leads out.
    pub normal: [f64; 3],
}

/// Where the sheet is held. Several choices in one row are joined: a node that any of them names is held.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Pin {
    /// Nodes by index: of the mesh file, or row by row from the bottom left of a grid.
    pub nodes: Vec<u32>,
    /// Nodes in a box.
    #[serde(rename = "box")]
    pub region: Option<Region>,
    /// Nodes on a side.
    pub edge: Option<Side>,
    /// Nodes by a corner, within `radius`.
    pub corner: Option<Corner>,
    /// Nodes by a point, within `radius`.
    pub point: Option<Point>,
    /// Reach of `corner` and `point`; nought takes the nearest node.
    pub radius: Length,
    /// Painted attribute of the mesh; nodes where it is over one half.
    pub group: Option<String>,
}

/// What sheets do where they touch obstacles, themselves and each other. Needs the integrator `implicit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Contact {
    /// Whether sheets touch themselves and each other. Left out: where the scene has an obstacle, for what hangs freely
    /// seldom meets itself, and looking for it takes time.
    pub self_contact: Option<bool>,
    /// Distance that two layers keep; left out, `shell.thickness`.
    pub thickness: Option<Length>,
    /// Coefficient of friction.
    pub friction: Ratio,
    /// Pressure per part of the thickness that it takes off a layer.
    pub modulus: Modulus,
    /// Speed under which sliding counts as sticking: friction grows up to it.
    pub slip: Speed,
}

impl Default for Contact {
    fn default() -> Self {
        Self {
            self_contact: None,
            thickness: None,
            friction: Ratio(0.4), // tuned: paper on paper, 0.3 to 0.6
            // tuned: soft enough for stacks to be solved fast; what is pressed harder still keeps off; 0.1 to 5 kPa
            modulus: Modulus(500.0),
            slip: Speed(1e-3), // tuned: creeps by a millimetre a second at most; 0.1 to 5 mm/s
        }
    }
}

choice! {
    /// Shapes of obstacles.
    ObstacleShape {
        /// All that is below a plane.
        #[default]
        Plane,
        /// A ball.
        Sphere,
        /// A box.
        Box,
        /// A surface from a file.
        Mesh,
    }
}

/// A solid thing that sheets meet and do not move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Obstacle {
    /// Its shape.
    pub shape: ObstacleShape,
    /// A point of a plane, the middle of a sphere or box, the origin of a mesh file.
    pub position: Point,
    /// Direction out of a plane; left out, up.
    pub normal: Option<[f64; 3]>,
    /// Radius of a sphere.
    pub radius: Length,
    /// Sides of a box.
    pub size: Point,
    /// Mesh file (OBJ, PLY, STL, glTF, GLB), relative to the scene file.
    pub mesh: Option<String>,
    /// What length the mesh file counts in.
    pub unit: LengthUnit,
    /// Turned about x, then y, then z.
    pub rotate: [Angle; 3],
    /// How fast it moves.
    pub velocity: [Speed; 3],
    /// How fast it turns, about each axis through `position`.
    pub spin: [Rate; 3],
    /// When it stops; left out, never.
    pub stop: Option<Time>,
    /// Coefficient of friction; left out, that of `[contact]`.
    pub friction: Option<Ratio>,
}

impl Default for Obstacle {
    fn default() -> Self {
        Self {
            shape: ObstacleShape::default(),
            position: [Length(0.0); 3],
            normal: None,
            radius: Length(0.05),
            size: [Length(0.1); 3],
            mesh: None,
            unit: LengthUnit::default(),
            rotate: [Angle(0.0); 3],
            velocity: [Speed(0.0); 3],
            spin: [Rate(0.0); 3],
            stop: None,
            friction: None,
        }
    }
}

/// Where and when the sheet is lit. Several choices in one row are joined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Ignite {
    /// Nodes by index.
    pub nodes: Vec<u32>,
    /// A point, with `radius`.
    pub point: Option<Point>,
    /// A corner, with `radius`.
    pub corner: Option<Corner>,
    /// Reach of `point` and `corner`; nought takes the nearest node.
    pub radius: Length,
    /// A side of the sheet.
    pub edge: Option<Side>,
    /// A box.
    #[serde(rename = "box")]
    pub region: Option<Region>,
    /// Half of space.
    pub half_space: Option<HalfSpace>,
    /// Painted attribute of the mesh; nodes where it is over one half.
    pub group: Option<String>,
    /// Grey image laid on by texture coordinates; nodes where it is over one half.
    pub map: Option<String>,
    /// When it is lit.
    pub start: Time,
    /// How long the flame is held there.
    pub length: Time,
    /// How hot the flame makes the sheet.
    pub temperature: Temperature,
}

impl Default for Ignite {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            point: None,
            corner: None,
            radius: Length(0.0),
            edge: None,
            region: None,
            half_space: None,
            group: None,
            map: None,
            start: Time(0.0),
            length: Time(0.5),
            temperature: Temperature(1100.0), // tuned: a match heats paper well past ignition, 900 to 1300
        }
    }
}

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

choice! {
    /// How frames are drawn.
    Style {
        /// White sheet, brown scorch, black char, glow at the front.
        #[default]
        Shaded,
        /// The mesh, coloured by temperature.
        Wireframe,
        /// Wireframe left, shaded right.
        Split,
    }
}

/// Pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Output {
    /// How frames are drawn.
    pub style: Style,
    /// Width and height of pictures [pixels].
    pub size: [u32; 2],
    /// Frames kept as stills; left out, five spread over the run.
    pub stills: Option<Vec<u32>>,
    /// The camera.
    pub camera: Camera,
}

impl Default for Output {
    fn default() -> Self {
        Self { style: Style::default(), size: [960, 720], stills: None, camera: Camera::default() }
    }
}

/// The camera looks at the middle of the sheet as it lies at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Camera {
    /// Direction it looks from, about the up axis; 0 looks along -z (y up) or +y (z up).
    pub azimuth: Angle,
    /// Height it looks from, over the horizon.
    pub elevation: Angle,
    /// Over 1 comes nearer, under 1 goes back.
    pub zoom: f64,
    /// Vertical field of view.
    pub field_of_view: Angle,
    /// Added to the point it looks at.
    pub shift: Point,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            azimuth: Angle(0.4),
            elevation: Angle(0.25),
            zoom: 1.0,
            field_of_view: Angle(0.6),
            shift: [Length(0.0); 3],
        }
    }
}

/// Something to measure while running; `charcloth list measures` has the kinds and what they use.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Probe {
    /// Name by which `expect` refers to it.
    pub name: String,
    /// Kind of measurement.
    pub measure: String,
    /// A node.
    pub node: Option<u32>,
    /// First point.
    pub from: Option<Point>,
    /// Second point.
    pub to: Option<Point>,
    /// Mode number.
    pub mode: Option<[u32; 2]>,
    /// Direction.
    pub direction: Option<[f64; 3]>,
}

/// What must come out: `value` within `tolerance`, or `at_least`, or `at_most`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Expect {
    /// A key of the summary, or the name of a probe.
    pub quantity: String,
    /// Expected value, SI.
    pub value: Option<f64>,
    /// Largest allowed distance from `value`, SI.
    pub tolerance: Option<f64>,
    /// Largest allowed distance from `value`, as a part of it.
    pub relative_tolerance: Option<Ratio>,
    /// Least allowed value, SI.
    pub at_least: Option<f64>,
    /// Greatest allowed value, SI.
    pub at_most: Option<f64>,
    /// Where the expectation and its tolerance come from.
    pub source: String,
}
