//! Films of gas that rise along a sheet: how thick, how fast, and what heat they pass.
//!
//! Model: Eq. 14.6 to 14.11. Source: laminar natural convection [Ostrach1953] [Incropera2007] written with the scales of
//! the foot of a flame [Bhattacharjee1996], forced flow [Incropera2007], the edge of a plate between two planes by
//! conformal mapping [Cohn1954]. Valid when: laminar, films under about 0.5 m long. Cost: a few operations a node.

use super::Surroundings;
use super::properties::{self, GasProperties, PRANDTL};
use glam::DVec3;

/// Growth of the film: thickness^4 = foot^4 (1 + k run/foot). Far from the foot this is the local Nusselt number
/// 0.386 Ra^(1/4) of a vertical plate at Pr = 0.71 [Ostrach1953]: k = 0.386^-4 Pr.
const BUOYANT_GROWTH: f64 = 32.0;
/// The same in forced flow, thickness^2 = foot^2 (1 + k run/foot): local Nusselt number 0.332 Re^(1/2) Pr^(1/3)
/// [Incropera2007], k = 0.332^-2 Pr^(1/3).
const FORCED_GROWTH: f64 = 8.1;
/// Mean speed of the film over the scale at its foot, and its growth: U^2 = (0.33 scale)^2 (1 + run/foot). The integral
/// solution of natural convection has 0.33 sqrt(g beta dT x) as the mean over the layer at Pr = 0.71 [Squire1938], which
/// is 0.33 scale sqrt(x/foot).
pub const MEAN_SPEED: f64 = 0.33;
const SPEED_GROWTH: f64 = 1.0;
/// Length of a sheet for plain convection where there is no flame [m]: it enters with a power of 0 to 1/2.
const PLAIN_LENGTH: f64 = 0.1;
/// Films are no thicker than this [m]: without gravity or wind nothing else bounds them.
pub const THICKEST: f64 = 0.02;

/// Lengths that a film is measured by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Thickness at the foot by buoyancy and by wind [m]; infinite where there is none.
    buoyant: f64,
    forced: f64,
}

impl Scale {
    /// Of a gas and a speed of wind along the face, with the constant of the foot (Eq. 14.6).
    #[inline]
    pub fn of(gas: &GasProperties, wind: f64, foot: f64) -> Self {
        let scale = foot * gas.diffusivity;
        Self { buoyant: scale / gas.buoyant_speed.max(1e-9), forced: scale / wind.max(1e-9) }
    }

    /// Thickness of the film (Eq. 14.7) [m]: buoyant and forced heat transfer joined by cubes [Incropera2007].
    #[inline]
    pub fn thickness(&self, run: f64) -> f64 {
        let buoyant = 1.0 / (self.buoyant * (1.0 + BUOYANT_GROWTH * run / self.buoyant).sqrt().sqrt());
        let forced = 1.0 / (self.forced * (1.0 + FORCED_GROWTH * run / self.forced).sqrt());
        let both = if forced < 1e-3 * buoyant { buoyant } else { (buoyant.powi(3) + forced.powi(3)).cbrt() };
        (1.0 / both).min(THICKEST)
    }

    /// Buoyant speed over that at the foot (Eq. 14.8).
    #[inline]
    pub fn speed_growth(&self, run: f64) -> f64 {
        (1.0 + SPEED_GROWTH * run / self.buoyant).sqrt()
    }
}

/// Rate at which temperature falls ahead of a foot, against the stream or along it, whichever falls slower [1/m]:
/// the smaller root of alpha m^2 +- U m = sinks alpha/delta^2 (Eq. 14.10).
#[inline]
pub fn decay_rate(speed: f64, diffusivity: f64, thickness: f64, sinks: f64) -> f64 {
    let sink = sinks * diffusivity / (thickness * thickness);
    2.0 * sink / (speed + (speed * speed + 4.0 * diffusivity * sink).sqrt())
}

/// What divides the heat flux that leaves a film when gas blows out of the wall: x/(e^x - 1), x = m'' c/h
/// [Bird2002].
#[inline]
pub fn blowing(ratio: f64) -> f64 {
    if ratio < 1e-4 { 1.0 - 0.5 * ratio } else { ratio / ratio.exp_m1() }
}

/// How much more heat a strip of the sheet gets that begins so far from a free edge, over one inside, between flames that
/// stand off by `standoff` on both faces: the mean of 1/sqrt(1 - exp(-pi d/standoff)) over the strip (Eq. 14.11).
#[inline]
pub fn edge_factor(distance: f64, width: f64, standoff: f64) -> f64 {
    if !distance.is_finite() || distance > 3.0 * standoff + width {
        return 1.0;
    }
    let from = (distance - 0.5 * width).max(0.0);
    let to = distance + 0.5 * width;
    // The integral from the edge: (2 s/pi) arcosh(exp(pi d/2s)).
    let integral = |d: f64| {
        let x = 0.5 * std::f64::consts::PI * d / standoff;
        if x > 20.0 { x + std::f64::consts::LN_2 } else { x.exp().acosh() }
    };
    (integral(to) - integral(from)) * 2.0 * standoff / (std::f64::consts::PI * (to - from))
}

/// Heat transfer coefficient of a sheet without a flame [W/(m2 K)]: natural convection of a vertical plate
/// [Churchill1975] and forced flow along one, joined by cubes [Incropera2007].
pub fn plain_coefficient(surroundings: &Surroundings, surface: f64) -> f64 {
    let ambient = surroundings.temperature;
    let mean = 0.5 * (surface + ambient);
    let conductivity = properties::conductivity(mean);
    let density = surroundings.pressure / (287.05 * mean);
    let diffusivity = conductivity / (density * 1050.0);
    let buoyancy = surroundings.gravity.length() * (surface - ambient).abs() / mean;
    let rayleigh = buoyancy * PLAIN_LENGTH.powi(3) / (PRANDTL * diffusivity * diffusivity);
    let natural = 0.68 + 0.515 * rayleigh.sqrt().sqrt();
    let reynolds = surroundings.wind.length() * PLAIN_LENGTH / (PRANDTL * diffusivity);
    let forced = 0.664 * reynolds.sqrt() * PRANDTL.cbrt();
    (natural.powi(3) + forced.powi(3)).cbrt() * conductivity / PLAIN_LENGTH
}

/// [`plain_coefficient`] at temperatures 50 K apart, with straight lines between.
#[derive(Debug, Clone, Copy)]
pub struct PlainTable([f64; 40]);

impl PlainTable {
    /// Works it out for a room.
    pub fn of(surroundings: &Surroundings) -> Self {
        Self(std::array::from_fn(|k| plain_coefficient(surroundings, 100.0 + 50.0 * k as f64)))
    }

    /// At a temperature of the face [W/(m2 K)].
    #[inline]
    pub fn at(&self, surface: f64) -> f64 {
        let place = ((surface - 100.0) / 50.0).clamp(0.0, 38.999);
        let below = place as usize;
        self.0[below] + (place - below as f64) * (self.0[below + 1] - self.0[below])
    }
}

/// Where buoyancy drives the film on a face, over full gravity (Eq. 14.9): up along the sheet, and towards the hot gas
/// where it can rise off the face, away from it where the face holds it down.
#[inline]
pub fn drive(up: DVec3, outward: DVec3, gradient: DVec3, excess: f64, foot: f64, floor: f64) -> DVec3 {
    let lift = up.dot(outward);
    let along = up - lift * outward;
    // Half: the mean over the film of the pressure that hot gas builds up across it.
    let gradient = 0.5 * foot * (gradient - gradient.dot(outward) * outward);
    let scale = (gradient.length_squared() + excess * excess + floor * floor).sqrt();
    along + lift * gradient / scale
}
