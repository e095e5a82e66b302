//! What burns at a node, in the names and units that other programs know.

use super::look::{darkness, display_color, linear};
use charcloth::frame::Frame;
use charcloth::sheet::NONE;

/// A number that a node has in every frame.
pub(super) struct Quantity {
    /// Name in files.
    pub name: &'static str,
    /// One sentence on what it is, with its unit.
    pub about: &'static str,
    /// Value at a node.
    pub value: fn(&Frame, usize) -> f64,
}

/// The numbers that every format carries which can.
pub(super) const QUANTITIES: &[Quantity] = &[
    Quantity { name: "temperature", about: "Temperature [K]", value: temperature },
    Quantity {
        name: "fuel",
        about: "Fraction of the fuel that is left, 1 to 0",
        value: |frame, i| 1.0 - burnt(frame, i),
    },
    Quantity { name: "burn", about: "Fraction of the fuel that is gone, 0 to 1", value: burnt },
    Quantity { name: "char", about: "How dark the paper is: 0 white, 0.5 scorched brown, 1 char", value: char },
    Quantity {
        name: "ash",
        about: "Fraction of the char that is gone to ash, 0 to 1",
        value: |frame, i| frame.burn.ashed[i],
    },
    Quantity { name: "age", about: "Time since the node caught fire, -1 before [s]", value: age },
];

/// Temperature of a node [K].
pub(super) fn temperature(frame: &Frame, node: usize) -> f64 {
    frame.burn.temperature[node]
}

/// Fraction of the fuel of a node that is gone.
pub(super) fn burnt(frame: &Frame, node: usize) -> f64 {
    let (left, initial) = (frame.burn.fuel[node], frame.burn.fuel_initial[node]);
    if initial > 0.0 { 1.0 - left / initial } else { 0.0 }
}

/// How dark a node is, 0 to 1.
pub(super) fn char(frame: &Frame, node: usize) -> f64 {
    darkness(frame.burn.peak_temperature[node], frame.burn.charred[node])
}

/// Time since a node caught fire, -1 before [s].
pub(super) fn age(frame: &Frame, node: usize) -> f64 {
    let ignited_at = frame.burn.ignited_at[node];
    if ignited_at < 0.0 { -1.0 } else { frame.time - ignited_at }
}

/// Colour of a node, sRGB.
pub(super) fn color(frame: &Frame, node: usize) -> [u8; 3] {
    display_color(frame.burn.peak_temperature[node], frame.burn.charred[node])
}

/// Colour of a node, linear.
pub(super) fn linear_color(frame: &Frame, node: usize) -> [f32; 3] {
    color(frame, node).map(linear)
}

/// A whole number that a node has in every frame: the parts of where on the input mesh it comes from.
pub(super) struct Origin {
    /// Name in files.
    pub name: &'static str,
    /// One sentence on what it is.
    pub about: &'static str,
    /// Value at a node.
    pub value: fn(&Frame, usize) -> u32,
}

/// Where on the input mesh a node comes from; [`ORIGIN_WEIGHTS`] weigh the three points.
pub(super) const ORIGINS: &[Origin] = &[
    Origin {
        name: "origin_face",
        about: "Face of the input mesh that the point lies on",
        value: |frame, i| frame.origins.origin_face[i],
    },
    Origin {
        name: "origin_a",
        about: "First point of the input mesh around it",
        value: |frame, i| frame.origins.origin_points[i][0],
    },
    Origin { name: "origin_b", about: "Second point around it", value: |frame, i| frame.origins.origin_points[i][1] },
    Origin { name: "origin_c", about: "Third point around it", value: |frame, i| frame.origins.origin_points[i][2] },
];

/// Name of the barycentric weights of the three points.
pub(super) const ORIGIN_WEIGHTS: &str = "origin_weights";
/// Their names where each is an attribute of its own.
pub(super) const ORIGIN_WEIGHTS_BY_CORNER: [&str; 3] = ["origin_weights_a", "origin_weights_b", "origin_weights_c"];
/// What they are.
pub(super) const ABOUT_ORIGIN_WEIGHTS: &str = "Barycentric weights of the three points of the input mesh";

/// A quantity of a piece or particle, by its row.
pub(super) struct Shed {
    /// Name in files.
    pub name: &'static str,
    /// One sentence on what it is, with its unit.
    pub about: &'static str,
    /// Its value.
    pub value: Value,
}

/// The value of a quantity of a piece or particle.
pub(super) enum Value {
    /// With a fraction.
    Number(fn(&Frame, usize) -> f64),
    /// The number of another row; [`NONE`] is -1 in files.
    Whole(fn(&Frame, usize) -> u32),
}

/// What is known of each piece, beside its number. Faces refer to it by that number.
pub(super) const PIECES: &[Shed] = &[
    Shed {
        name: "piece_parent",
        about: "Piece that it came off, -1 for a sheet of the start",
        value: Value::Whole(|frame, p| frame.pieces.parent.get(p).copied().unwrap_or(NONE)),
    },
    Shed {
        name: "piece_birth",
        about: "When it came off [s]",
        value: Value::Number(|frame, p| row(&frame.pieces.birth, p)),
    },
    Shed { name: "piece_mass", about: "Its mass [kg]", value: Value::Number(|frame, p| row(&frame.pieces.mass, p)) },
    Shed {
        name: "piece_area",
        about: "Its area at rest [m2]",
        value: Value::Number(|frame, p| row(&frame.pieces.area, p)),
    },
    Shed {
        name: "piece_temperature",
        about: "Its mean temperature [K]",
        value: Value::Number(|frame, p| row(&frame.pieces.temperature, p)),
    },
];

/// Pieces that a frame has, or names.
pub(super) fn piece_count(frame: &Frame) -> usize {
    let named = frame.triangles.piece.iter().zip(&frame.triangles.alive).filter(|(_, alive)| **alive != 0);
    named.map(|(piece, _)| *piece as usize + 1).max().unwrap_or(0).max(frame.pieces.len())
}

/// What is known of each particle, beside place, velocity and number.
pub(super) const PARTICLES: &[Shed] = &[
    Shed { name: "parent", about: "Piece that it came off", value: Value::Whole(|frame, p| frame.particles.parent[p]) },
    Shed { name: "birth", about: "When it came off [s]", value: Value::Number(|frame, p| frame.particles.birth[p]) },
    Shed {
        name: "age",
        about: "Time since it came off [s]",
        value: Value::Number(|frame, p| frame.time - frame.particles.birth[p]),
    },
    Shed { name: "mass", about: "Mass [kg]", value: Value::Number(|frame, p| frame.particles.mass[p]) },
    Shed {
        name: "area",
        about: "Area of sheet that it was, at rest [m2]",
        value: Value::Number(|frame, p| frame.particles.area[p]),
    },
    Shed {
        name: "temperature",
        about: "Mean temperature [K]",
        value: Value::Number(|frame, p| frame.particles.temperature[p]),
    },
    Shed {
        name: "lies",
        about: "1 once it lies on something",
        value: Value::Whole(|frame, p| u32::from(frame.particles.lies[p])),
    },
];

/// Diameter of a disc of an area [m].
pub(super) fn disc_width(area: f64) -> f64 {
    2.0 * (area.max(0.0) / std::f64::consts::PI).sqrt()
}

/// Colour of char, linear.
pub(super) fn linear_char() -> [f32; 3] {
    display_color(0.0, 1.0).map(linear)
}

fn row(column: &[f64], number: usize) -> f64 {
    column.get(number).copied().unwrap_or(0.0)
}
