//! The mesh of a twin as Wavefront OBJ, which point caches and their like move.

use super::twin::{Pose, Twin};
use crate::error::IoError;
use crate::files::{Durability, write_whole};
use charcloth::frame::Frame;
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

/// Writes the twin as it is in a frame; its points are the places in order.
pub(super) fn write(twin: &Twin, pose: &Pose, frame: &Frame, path: &Path) -> Result<(), IoError> {
    write_whole(path, Durability::Process, |out| {
        writeln!(out, "# Charcloth {}", env!("CARGO_PKG_VERSION"))?;
        writeln!(out, "# frame {}, places in metres; keep the order of the points on import", frame.number)?;
        writeln!(out, "o sheet")?;
        for p in &pose.positions {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        let mut numbers = HashMap::new();
        let mut corners = Vec::with_capacity(twin.faces.len());
        for t in &twin.rows {
            let mut face = [0; 3];
            for (number, uv) in face.iter_mut().zip(frame.triangles.uv[*t as usize]) {
                let next = numbers.len() + 1;
                *number = *numbers.entry((uv.x.to_bits(), uv.y.to_bits())).or_insert(next);
                if *number == next {
                    writeln!(out, "vt {} {}", uv.x, uv.y)?;
                }
            }
            corners.push(face);
        }
        writeln!(out, "s 1")?;
        for (face, uv) in twin.faces.iter().zip(&corners) {
            let [a, b, c] = std::array::from_fn(|k| format!("{}/{}", face[k] + 1, uv[k]));
            writeln!(out, "f {a} {b} {c}")?;
        }
        Ok(())
    })
}
