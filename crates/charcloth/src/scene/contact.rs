//! What sheets touch.

use super::{LengthUnit, Point};
use crate::units::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Mesh file (OBJ, PLY, STL, glTF, USD), relative to the scene file.
    pub mesh: Option<String>,
    /// A folder of numbered meshes, or their path with one `*` in the place of the number, relative to the scene file: the
    /// obstacle bends as they do. Its mesh is the first of them, unless `mesh` gives it.
    pub files: Option<String>,
    /// Meshes a second.
    pub fps: f64,
    /// When the first of them is due.
    pub start: Time,
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
    /// When a plane is taken away; left out, never. Such a plane is not drawn.
    pub until: Option<Time>,
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
            files: None,
            fps: 24.0,
            start: Time(0.0),
            unit: LengthUnit::default(),
            rotate: [Angle(0.0); 3],
            velocity: [Speed(0.0); 3],
            spin: [Rate(0.0); 3],
            stop: None,
            until: None,
            friction: None,
        }
    }
}
