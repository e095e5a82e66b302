//! What an artist paints on the sheet.

use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where painted values come from: an attribute of the points of a mesh, or a picture laid on by texture coordinates.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Mask {
    /// Painted attribute of the mesh; where it is over one half.
    pub group: Option<String>,
    /// Grey picture by texture coordinates; where it is over one half.
    pub map: Option<String>,
}

/// A painted factor: `low` where the paint is 0 or black, `high` where it is 1 or white, linear between and beyond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PaintedGain {
    /// Painted attribute of the mesh.
    pub group: Option<String>,
    /// Grey picture by texture coordinates.
    pub map: Option<String>,
    /// Factor where the paint is 0 or black.
    pub low: Ratio,
    /// Factor where the paint is 1 or white.
    pub high: Ratio,
}

impl Default for PaintedGain {
    fn default() -> Self {
        Self { group: None, map: None, low: Ratio(0.0), high: Ratio(1.0) }
    }
}

/// A painted time: `low` where the paint is 0 or black, `high` where it is 1 or white, linear between and beyond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PaintedTime {
    /// Painted attribute of the mesh.
    pub group: Option<String>,
    /// Grey picture by texture coordinates.
    pub map: Option<String>,
    /// Time where the paint is 0 or black.
    pub low: Time,
    /// Time where the paint is 1 or white.
    pub high: Time,
}

impl Default for PaintedTime {
    fn default() -> Self {
        Self { group: None, map: None, low: Time(0.0), high: Time(1.0) }
    }
}

/// Painted controls. Each acts on what the sheet is made of at the start, so the books close whatever is painted. All but
/// `fuel` need the physical model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Paint {
    /// Factor on the grammage.
    pub fuel: Option<PaintedGain>,
    /// Factor on the moisture.
    pub moisture: Option<PaintedGain>,
    /// Factor on the thickness, and the grammage with it: stiffer by as much, in bending by its cube.
    pub thickness: Option<PaintedGain>,
    /// Factor on the strength.
    pub strength: Option<PaintedGain>,
    /// Factor on the speed at which fire spreads and burns out, besides `fire.speed_gain`.
    pub speed: Option<PaintedGain>,
    /// What must not burn: it warms to 150 degC and refuses further heat.
    pub noburn: Option<Mask>,
}
