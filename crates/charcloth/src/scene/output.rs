//! Pictures, probes and expectations.

use super::Point;
use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
