//! How the sheet moves: springs, shell, and what pulls, curls and blows it.

use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Newton iterations end when the energy they still gain has fallen to this part of the first gain, or where something
    /// touches to this part of the energy of motion, if that is less.
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
            linear_tolerance: Ratio(3e-2), // tuned: a third fewer linear iterations than 1e-2, as many of Newton, 1e-2 to 0.1
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
    /// Whether the hot air that rises over flames carries flakes and ash along.
    pub updraught: bool,
    /// The speed over time, in the place of `velocity`: linear between rows, as in the first and last before and after.
    pub key: Vec<WindKey>,
}

/// Speed of the air at a time.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindKey {
    /// When.
    pub time: Time,
    /// How fast the air moves then.
    pub velocity: [Speed; 3],
}

impl Default for Wind {
    fn default() -> Self {
        Self {
            velocity: [Speed(0.0); 3],
            law: DragLaw::default(),
            coefficient: DragCoefficient(0.6), // tuned: rho_air |v| / 2 at 1 m/s, 0.1 to 5
            gust: Ratio(0.0),
            gust_time: Time(0.5),
            updraught: true,
            key: Vec::new(),
        }
    }
}
