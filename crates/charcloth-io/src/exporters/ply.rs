//! Binary PLY, little endian: the living surface with every quantity of its nodes.
//!
//! Places are `x y z`, velocities `vx vy vz`, normals `nx ny nz`, texture coordinates `s t`; beside the columns of the
//! tables stand `id` (the node), the quantities that all formats have (`fuel`, `burn`, `char`...) and a display colour.
//! Particles, where there are any, go as points into a file beside it. A column added to a table is written without a
//! change here.

use super::quantities::{ABOUT_ORIGIN_WEIGHTS, ORIGIN_WEIGHTS_BY_CORNER, ORIGINS, QUANTITIES, color};
use super::surface::Surface;
use crate::error::IoError;
use crate::files::{Durability, write_whole};
use charcloth::fields::{Column, Data};
use charcloth::frame::Frame;
use std::io::Write;
use std::path::Path;

/// Names that other programs know, for columns that have them; the rest keep their own.
const TRADE_NAMES: &[(&str, &[&str])] = &[
    ("position", &["x", "y", "z"]),
    ("velocity", &["vx", "vy", "vz"]),
    ("rest_position", &["rest_x", "rest_y", "rest_z"]),
    ("heat_released", &["heat"]),
    ("fuel", &["fuel_mass"]),
];

/// A property of the vertices: its header line, its unit, and how it goes into the file.
struct Property<'a> {
    kind: &'static str,
    name: String,
    about: String,
    append: Append<'a>,
}

/// Appends the value of a vertex to its row in the file.
type Append<'a> = Box<dyn Fn(usize, &mut Vec<u8>) + 'a>;

/// Writes a frame as PLY.
pub(super) fn write(frame: &Frame, path: &Path) -> Result<(), IoError> {
    let surface = Surface::of(frame);
    let properties = properties(frame, &surface);
    let triangles = &frame.triangles;
    write_whole(path, Durability::Process, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        writeln!(out, "comment Charcloth {}", env!("CARGO_PKG_VERSION"))?;
        writeln!(out, "comment frame {}, time {} s", frame.number, frame.time)?;
        writeln!(out, "comment SI units, places in metres")?;
        for property in properties.iter().filter(|p| !p.about.is_empty()) {
            writeln!(out, "comment {}: {}", property.name, property.about)?;
        }
        writeln!(out, "element vertex {}", surface.vertices.len())?;
        for property in &properties {
            writeln!(out, "property {} {}", property.kind, property.name)?;
        }
        writeln!(out, "element face {}", surface.faces.len())?;
        writeln!(out, "property list uchar int vertex_indices")?;
        writeln!(out, "property uint piece\nproperty uint source_face\nproperty uint sheet\nend_header")?;
        let mut row = Vec::new();
        for v in 0..surface.vertices.len() {
            row.clear();
            for property in &properties {
                (property.append)(v, &mut row);
            }
            out.write_all(&row)?;
        }
        for (face, t) in surface.faces.iter().zip(&surface.rows) {
            let t = *t as usize;
            row.clear();
            row.push(3);
            face.iter().for_each(|v| row.extend(v.to_le_bytes()));
            for column in [&triangles.piece, &triangles.source_face, &triangles.sheet] {
                row.extend(column[t].to_le_bytes());
            }
            out.write_all(&row)?;
        }
        Ok(())
    })?;
    if frame.particles.is_empty() { Ok(()) } else { write_particles(frame, &path.with_extension("particles.ply")) }
}

/// Writes the particles of a frame as points, every column of theirs and their number.
fn write_particles(frame: &Frame, path: &Path) -> Result<(), IoError> {
    let mut properties = Vec::new();
    for column in frame.particles.columns() {
        add_column(&mut properties, &column, |p| p);
    }
    properties.push(Property {
        kind: "uint",
        name: "id".to_string(),
        about: "number of the particle, the same in all frames".to_string(),
        append: Box::new(|p, row| row.extend((p as u32).to_le_bytes())),
    });
    write_whole(path, Durability::Process, |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        writeln!(out, "comment frame {}, time {} s: what is too small to be sheet", frame.number, frame.time)?;
        for property in properties.iter().filter(|p| !p.about.is_empty()) {
            writeln!(out, "comment {}: {}", property.name, property.about)?;
        }
        writeln!(out, "element vertex {}", frame.particles.len())?;
        for property in &properties {
            writeln!(out, "property {} {}", property.kind, property.name)?;
        }
        writeln!(out, "end_header")?;
        let mut row = Vec::new();
        for p in 0..frame.particles.len() {
            row.clear();
            properties.iter().for_each(|property| (property.append)(p, &mut row));
            out.write_all(&row)?;
        }
        Ok(())
    })
}

fn properties<'a>(frame: &'a Frame, surface: &'a Surface) -> Vec<Property<'a>> {
    let node = |v: usize| surface.vertices[v].0 as usize;
    let mut all = Vec::new();
    for column in frame.motion.columns() {
        add_column(&mut all, &column, node);
        // Readers find normals and texture coordinates easiest right behind the place.
        if column.name == "position" {
            add_shading(&mut all, frame, surface);
        }
    }
    for column in frame.burn.columns() {
        add_column(&mut all, &column, node);
    }
    all.push(Property {
        kind: "uint",
        name: "id".to_string(),
        about: "number of the node, the same in all frames".to_string(),
        append: Box::new(move |v, row| row.extend(surface.vertices[v].0.to_le_bytes())),
    });
    for origin in ORIGINS {
        all.push(Property {
            kind: "uint",
            name: origin.name.to_string(),
            about: origin.about.to_string(),
            append: Box::new(move |v, row| row.extend((origin.value)(frame, node(v)).to_le_bytes())),
        });
    }
    for (k, name) in ORIGIN_WEIGHTS_BY_CORNER.into_iter().enumerate() {
        let about = if k == 0 { ABOUT_ORIGIN_WEIGHTS } else { "" };
        add_float(&mut all, name, about, move |v| frame.origins.origin_weights[node(v)][k]);
    }
    for quantity in QUANTITIES {
        if all.iter().all(|property| property.name != quantity.name) {
            add_float(&mut all, quantity.name, quantity.about, move |v| (quantity.value)(frame, node(v)));
        }
    }
    for (k, name) in ["red", "green", "blue"].into_iter().enumerate() {
        all.push(Property {
            kind: "uchar",
            name: name.to_string(),
            about: String::new(),
            append: Box::new(move |v, row| row.push(color(frame, node(v))[k])),
        });
    }
    all
}

fn add_shading<'a>(all: &mut Vec<Property<'a>>, frame: &'a Frame, surface: &'a Surface) {
    let normals = std::rc::Rc::new(frame.normals());
    for (k, name) in ["nx", "ny", "nz"].into_iter().enumerate() {
        let normals = normals.clone();
        add_float(all, name, "", move |v| normals[surface.vertices[v].0 as usize][k]);
    }
    for (k, name) in ["s", "t"].into_iter().enumerate() {
        add_float(all, name, "", move |v| f64::from(surface.vertices[v].1[k]));
    }
}

fn add_float<'a>(all: &mut Vec<Property<'a>>, name: &str, about: &str, value: impl Fn(usize) -> f64 + 'a) {
    all.push(Property {
        kind: "float",
        name: name.to_string(),
        about: about.to_string(),
        append: Box::new(move |v, row| row.extend((value(v) as f32).to_le_bytes())),
    });
}

/// Adds a column of a table, `row_of` telling its row for a vertex.
fn add_column<'a>(all: &mut Vec<Property<'a>>, column: &Column<'a>, row_of: impl Fn(usize) -> usize + Copy + 'a) {
    let unit = if column.unit == "1" { String::new() } else { format!(" [{}]", column.unit) };
    let about = format!("{}{unit}", column.about.trim_end_matches('.'));
    let trade = TRADE_NAMES.iter().find(|(name, _)| *name == column.name).map(|(_, names)| *names);
    match column.data {
        Data::F64(values) => {
            add_float(all, trade.map_or(column.name, |names| names[0]), &about, move |v| values[row_of(v)]);
        }
        Data::F64x3(values) => {
            for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
                let name = trade.map_or_else(|| format!("{}_{axis}", column.name), |names| names[k].to_string());
                // Said once for the three.
                add_float(all, &name, if k == 0 { &about } else { "" }, move |v| values[row_of(v)][k]);
            }
        }
        Data::U32(values) => all.push(Property {
            kind: "uint",
            name: column.name.to_string(),
            about,
            append: Box::new(move |v, row| row.extend(values[row_of(v)].to_le_bytes())),
        }),
        Data::U8(values) => all.push(Property {
            kind: "uchar",
            name: column.name.to_string(),
            about,
            append: Box::new(move |v, row| row.push(values[row_of(v)])),
        }),
        // Node numbers and corners say nothing once nodes have become vertices.
        Data::U32x2(_) | Data::U32x3(_) | Data::F32x3x2(_) => {}
    }
}
