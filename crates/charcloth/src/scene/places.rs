//! Where the sheet is held and lit.

use super::{PaintedTime, Point};
use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Painted: how much later each place is lit. A row that has this and names no place lights the whole sheet.
    pub delay: Option<PaintedTime>,
    /// How long the flame is held there.
    pub length: Time,
    /// How hot the flame makes the sheet.
    pub temperature: Temperature,
}

impl Ignite {
    /// Whether the row says where the sheet is lit.
    pub fn names_a_place(&self) -> bool {
        !self.nodes.is_empty()
            || self.region.is_some()
            || self.edge.is_some()
            || self.corner.is_some()
            || self.point.is_some()
            || self.half_space.is_some()
            || self.group.is_some()
            || self.map.is_some()
    }
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
            delay: None,
            length: Time(0.5),
            temperature: Temperature(1100.0), // tuned: a match heats paper well past ignition, 900 to 1300
        }
    }
}
