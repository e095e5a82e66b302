//! Wavefront OBJ: shape, texture coordinates and normals of the living surface.

use super::surface::Surface;
use crate::error::IoError;
use crate::files::{Durability, write_whole};
use charcloth::frame::Frame;
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

/// Writes a frame as OBJ. Places are single precision, in the shortest digits that give the same number back.
pub(super) fn write(frame: &Frame, path: &Path) -> Result<(), IoError> {
    let surface = Surface::of(frame);
    let normals = frame.normals();
    write_whole(path, Durability::Process, |out| {
        writeln!(out, "# Charcloth {}", env!("CARGO_PKG_VERSION"))?;
        writeln!(out, "# frame {}, time {} s", frame.number, frame.time)?;
        writeln!(out, "# places in metres")?;
        // Places and normals once a node, texture coordinates once each: OBJ has an index for either.
        let mut place_of = Vec::with_capacity(surface.vertices.len());
        let mut last = None;
        let mut places = 0;
        for (node, _) in &surface.vertices {
            if last != Some(*node) {
                let p = frame.motion.position[*node as usize].as_vec3();
                writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
                last = Some(*node);
                places += 1;
            }
            place_of.push(places);
        }
        let mut uv_numbers = HashMap::new();
        let mut uv_of = Vec::with_capacity(surface.vertices.len());
        for (_, uv) in &surface.vertices {
            let next = uv_numbers.len() + 1;
            let number = *uv_numbers.entry((uv.x.to_bits(), uv.y.to_bits())).or_insert(next);
            if number == next {
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
            uv_of.push(number);
        }
        last = None;
        for (node, _) in &surface.vertices {
            if last != Some(*node) {
                let n = normals[*node as usize].as_vec3();
                writeln!(out, "vn {} {} {}", n.x, n.y, n.z)?;
                last = Some(*node);
            }
        }
        for face in &surface.faces {
            let [a, b, c] = face.map(|v| {
                let (place, uv) = (place_of[v as usize], uv_of[v as usize]);
                format!("{place}/{uv}/{place}")
            });
            writeln!(out, "f {a} {b} {c}")?;
        }
        Ok(())
    })
}
