//! Faces as they stand in a file, before anything is put right.

use glam::{DVec3, Vec2};
use std::collections::BTreeMap;

/// What an importer reads: points and polygons in the unit and order of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RawMesh {
    /// Position of each point, in the unit of the file.
    pub positions: Vec<DVec3>,
    /// Points of all faces, one face after the other.
    pub corners: Vec<u32>,
    /// Texture coordinates of all corners; empty where the file has none.
    pub corner_uv: Vec<Vec2>,
    /// Where each face ends in `corners`.
    pub face_ends: Vec<usize>,
    /// Painted point attributes by name.
    pub painted: BTreeMap<String, Vec<f32>>,
    /// What the user should know about the file.
    pub remarks: Vec<String>,
}

impl RawMesh {
    /// The range of `corners` that each face has.
    pub(crate) fn faces(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.face_ends.iter().scan(0, |start, end| Some(std::mem::replace(start, *end)..*end))
    }

    /// Adds point colours, 0 to 1, as the painted attributes `color.r`, `color.g`, `color.b` and their luminance
    /// `color`.
    pub(crate) fn paint_colors(&mut self, colors: &[[f32; 3]]) {
        for (channel, name) in ["color.r", "color.g", "color.b"].into_iter().enumerate() {
            self.painted.insert(name.to_string(), colors.iter().map(|c| c[channel]).collect());
        }
        // Rec. ITU-R BT.709-6, item 3.2: luminance weights of the three primaries.
        let luminance = |c: &[f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        self.painted.insert("color".to_string(), colors.iter().map(luminance).collect());
    }
}
