//! A sheet that is animated already.

use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

choice! {
    /// How the sheet goes with its motion.
    Follow {
        /// It is where the motion has it, and only burns.
        #[default]
        Exactly,
        /// It is drawn to where the motion has it, and let go where it has burnt or has come off.
        Drawn,
    }
}

/// Motion from a sequence of meshes with the same points and faces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// A folder of numbered meshes, or their path with one `*` in the place of the number; relative to the scene file.
    /// The sheet is the first of them, unless `sheet.mesh` gives it with another shape at rest.
    pub files: Option<String>,
    /// Meshes a second.
    pub fps: f64,
    /// When the first of them is due; before, the sheet is as in the first, after the last as in the last.
    pub start: Time,
    /// How the sheet goes with it.
    pub follow: Follow,
    /// Time in which a sheet that is drawn goes back to its motion.
    pub pull_time: Time,
    /// Part of the pull over time, linear between rows; left out, all of it.
    pub key: Vec<PullKey>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            files: None,
            fps: 24.0,
            start: Time(0.0),
            follow: Follow::default(),
            pull_time: Time(0.03), // tuned: under a frame of film, so that what is whole looks animated; 10 to 300 ms
            key: Vec::new(),
        }
    }
}

/// Part of the pull at a time.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PullKey {
    /// When.
    pub time: Time,
    /// Part of the pull, 0 to 1.
    pub pull: Ratio,
}
