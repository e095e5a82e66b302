//! The sheet: its shape, and what it is made of.

use super::Point;
use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
        /// An insulator that takes no heat and lets no gas through.
        Insulated,
        /// A board that takes up heat, of `sheet.board`; no gas gets between.
        Board,
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
    /// Mesh file (OBJ, PLY, STL, glTF, USD), relative to the scene file.
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
    /// The board, where that is one.
    pub board: Board,
    /// What is at its edges, in the physical model.
    pub edges: Edges,
    /// Sheets one above the other, alike but for their mesh.
    pub layers: u32,
    /// Distance between them.
    pub layer_distance: Length,
    /// Each layer but the first is turned about its middle by a random angle of up to this, as in a pile laid down by hand.
    pub layer_turn: Angle,
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
    /// Standard deviation of the height of the sheet over its surface: paper is never perfectly flat, and a perfectly flat
    /// sheet has no reason to buckle to either side. It is the stress-free shape. Left out: that of the material, or
    /// 0.1 mm, on built-in sheets, and 0 on meshes from files, which are meant as they are.
    pub cockle: Option<Length>,
    /// Wavelength of the cockle; waves are from half to twice as long.
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
            board: Board::default(),
            edges: Edges::default(),
            layers: 1,
            layer_distance: Length(0.002),
            layer_turn: Angle(0.0),
            pose: Pose::default(),
            position: [Length(0.0); 3],
            rotate: [Angle(0.0); 3],
            grammage: Grammage(0.080),
            variation: Variation::default(),
            cockle: None,
            cockle_length: Length(0.025), // tuned: cockles of paper are 5 to 50 mm wide, 10 to 50 mm
        }
    }
}

impl Sheet {
    /// Distance between neighbouring nodes [m], by `segments` or `spacing`.
    pub fn node_distance(&self) -> f64 {
        self.segments.map_or(self.spacing.0, |segments| self.width.0 / f64::from(segments.max(1)))
    }

    /// Standard deviation of the height of the sheet over its surface [m], by `cockle` or its default.
    pub fn cockle_height(&self) -> f64 {
        // tuned: no measured value was found; from trough to crest office paper is wavy by tenths of a millimetre, which is
        // four times this; 0.02 to 0.3 mm
        self.cockle.map_or(if self.mesh.is_some() { 0.0 } else { 1e-4 }, |height| height.0)
    }
}

/// A board that the sheet lies on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Board {
    /// Conductivity.
    pub conductivity: Conductivity,
    /// Density.
    pub density: Density,
    /// Heat capacity per mass.
    pub heat_capacity: SpecificHeat,
    /// Mean distance between it and the sheet, filled with air: neither is quite even.
    pub gap: Length,
}

impl Default for Board {
    /// Calcium silicate board as fire laboratories use it.
    fn default() -> Self {
        Self {
            conductivity: Conductivity(0.12),    // tuned: by kind and density, 0.05 to 0.2 W/(m K)
            density: Density(740.0),             // tuned: 200 to 900 kg/m3
            heat_capacity: SpecificHeat(1000.0), // tuned: silicates have 800 to 1200 J/(kg K)
            gap: Length(0.0005), // tuned: cloth uneven by 0.3 mm RMS that touches at its lowest places, 0.1 to 1 mm
        }
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
