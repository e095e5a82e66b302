//! Painted controls: what an artist lays on the sheet changes what it is made of, and nothing else, so books close.
//!
//! A speed gain g makes a place burn as a sheet of 1/g of its grammage and thickness does, since fire goes over thin sheets
//! at a speed that falls with the grammage (Eq. 15.7); flames stay as high, and the sheet as heavy, thick and stiff.

use super::{image, sample_image};
use crate::burn_mesh::BurnMap;
use crate::error::Error;
use crate::scene::{PaintedGain, Scene};
use crate::sheet::{NONE, SheetState};
use crate::simulation::Inputs;
use glam::Vec2;
use std::collections::BTreeMap;

/// Factors outside of this are taken for mistakes.
const SENSIBLE: std::ops::RangeInclusive<f64> = 0.02..=50.0;

/// Where painted values are found.
pub(crate) struct Canvas<'a> {
    pub inputs: &'a Inputs,
    pub state: &'a SheetState,
    pub painted: &'a BTreeMap<String, Vec<f32>>,
    pub burn_uv: &'a [Vec2],
    pub map: &'a BurnMap,
}

/// Where a painted value comes from, with the key for errors.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub key: &'a str,
    pub group: Option<&'a str>,
    pub map: Option<&'a str>,
}

impl Canvas<'_> {
    /// A painted attribute, at motion nodes.
    fn group(&self, key: &str, name: &str) -> Result<Vec<f64>, Error> {
        let painted = self.painted.get(name).ok_or_else(|| {
            let names: Vec<_> = self.painted.keys().map(String::as_str).collect();
            let hint = if names.is_empty() {
                "the mesh has no painted attributes".to_owned()
            } else {
                format!("the mesh has: {}", names.join(", "))
            };
            Error::scene(format!("{key}.group"), format!("\"{name}\" is not painted on the mesh"), hint)
        })?;
        Ok(painted.iter().map(|value| f64::from(*value)).collect())
    }

    /// What is painted at each burn node.
    pub fn at_burn_nodes(&self, source: Source<'_>) -> Result<Vec<f64>, Error> {
        let Source { key, .. } = source;
        match (source.group, source.map) {
            (Some(name), None) => {
                let painted = self.group(key, name)?;
                let at = |i| self.map.interpolate(&self.state.triangles, &painted, i);
                Ok((0..self.state.burn.len()).map(at).collect())
            }
            (None, Some(path)) => {
                let picture = image(self.inputs, &format!("{key}.map"), path)?;
                Ok(self.burn_uv.iter().map(|uv| f64::from(sample_image(picture, *uv))).collect())
            }
            _ => Err(neither(key)),
        }
    }

    /// What is painted on each motion triangle, the mean of its corners.
    fn on_triangles(&self, source: Source<'_>) -> Result<Vec<f64>, Error> {
        let Source { key, .. } = source;
        let triangles = &self.state.triangles;
        match (source.group, source.map) {
            (Some(name), None) => {
                let painted = self.group(key, name)?;
                let mean = |corners: &[u32; 3]| corners.iter().map(|i| painted[*i as usize]).sum::<f64>() / 3.0;
                Ok(triangles.corners.iter().map(mean).collect())
            }
            (None, Some(path)) => {
                let picture = image(self.inputs, &format!("{key}.map"), path)?;
                let at = |uv: &Vec2| f64::from(sample_image(picture, *uv));
                Ok(triangles.uv.iter().map(|uv| uv.iter().map(at).sum::<f64>() / 3.0).collect())
            }
            _ => Err(neither(key)),
        }
    }
}

fn neither(key: &str) -> Error {
    Error::scene(key, "paint comes from one of two places", "give either `group` or `map`")
}

/// From paint to factors, each of a size that can be meant; `least` is the smallest that can.
fn gains(key: &str, paint: &PaintedGain, values: Vec<f64>, least: f64) -> Result<Vec<f64>, Error> {
    let gains: Vec<f64> = values.iter().map(|value| paint.low.0 + (paint.high.0 - paint.low.0) * value).collect();
    match gains.iter().find(|gain| !(least..=*SENSIBLE.end()).contains(*gain)) {
        Some(gain) => Err(Error::scene(
            key,
            format!("the paint comes to a factor of {gain} somewhere"),
            format!("set `low` and `high` so that all of it is from {least} to {}", SENSIBLE.end()),
        )),
        None => Ok(gains),
    }
}

/// Applies all painted controls to a sheet as built. Returns the factor on the moisture of each burn node; empty for 1.
pub(super) fn apply(
    scene: &Scene,
    inputs: &Inputs,
    state: &mut SheetState,
    painted: &BTreeMap<String, Vec<f32>>,
    burn_uv: &[Vec2],
    map: &BurnMap,
) -> Result<Vec<f64>, Error> {
    let paint = &scene.paint;
    fn source<'a>(key: &'a str, gain: &'a PaintedGain) -> Source<'a> {
        Source { key, group: gain.group.as_deref(), map: gain.map.as_deref() }
    }
    let canvas = Canvas { inputs, state, painted, burn_uv, map };
    let at_nodes = |key, gain: &Option<PaintedGain>, least| match gain {
        None => Ok(None),
        Some(gain) => gains(key, gain, canvas.at_burn_nodes(source(key, gain))?, least).map(Some),
    };
    let on_triangles = |key, gain: &Option<PaintedGain>| match gain {
        None => Ok(None),
        Some(gain) => gains(key, gain, canvas.on_triangles(source(key, gain))?, *SENSIBLE.start()).map(Some),
    };
    let least = *SENSIBLE.start();
    let fuel = at_nodes("paint.fuel", &paint.fuel, least)?;
    let moisture = at_nodes("paint.moisture", &paint.moisture, 0.0)?;
    let speed = at_nodes("paint.speed", &paint.speed, least)?;
    let thick = at_nodes("paint.thickness", &paint.thickness, least)?;
    let thickness = on_triangles("paint.thickness", &paint.thickness)?;
    let strength = on_triangles("paint.strength", &paint.strength)?;
    let noburn = match &paint.noburn {
        None => None,
        Some(mask) => {
            let source = Source { key: "paint.noburn", group: mask.group.as_deref(), map: mask.map.as_deref() };
            Some(canvas.at_burn_nodes(source)?)
        }
    };
    let of = |column: &Option<Vec<f64>>, i: usize| column.as_ref().map_or(1.0, |column| column[i]);
    let burn = &mut state.burn;
    for i in 0..burn.len() {
        let speed = scene.fire.speed_gain.0 * of(&speed, i);
        let thickness = of(&thick, i) / speed;
        let mass = of(&fuel, i) * thickness;
        burn.speed[i] = speed;
        burn.thickness[i] = thickness;
        for column in [&mut burn.fuel_initial, &mut burn.fuel, &mut burn.heat_capacity] {
            column[i] *= mass;
        }
        burn.noburn[i] = u8::from(noburn.as_ref().is_some_and(|noburn| noburn[i] > 0.5));
    }
    if let Some(thickness) = thickness {
        state.rest.thickness = thickness;
    }
    if let Some(strength) = strength {
        let springs = &mut state.springs;
        for (spring, carriers) in springs.strength.iter_mut().zip(&springs.carriers) {
            let carriers = carriers.iter().filter(|t| **t != NONE);
            let (sum, count) = carriers.fold((0.0, 0.0), |(sum, count), t| (sum + strength[*t as usize], count + 1.0));
            *spring *= if count > 0.0 { sum / count } else { 1.0 };
        }
        state.rest.strength = strength;
    }
    Ok(moisture.unwrap_or_default())
}
