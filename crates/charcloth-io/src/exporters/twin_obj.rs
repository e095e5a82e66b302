//! The mesh of a twin as Wavefront OBJ, which point caches and their like move.

use super::sequence::Sequence;
use super::twin::{Pose, Twin};
use crate::error::IoError;
use crate::files::{Durability, read_whole, write_whole};
use charcloth::frame::Frame;
use std::collections::HashMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Name of the file.
pub(super) const NAME: &str = "sheet.obj";

/// Fails where a point cache of another format has the file, too, and it is of other frames.
pub(super) fn refuse_another(twin: &Twin, sequence: &Sequence<'_>, folder: &Path) -> Result<(), IoError> {
    if !sequence.keeps(NAME) {
        return Ok(());
    }
    let (path, first) = (folder.join(NAME), sequence.first()?);
    let mut text = Vec::new();
    write_to(&mut text, twin, &twin.pose(&first), &first).map_err(|error| IoError::system("write", &path, &error))?;
    if read_whole(&path)? == text {
        return Ok(());
    }
    let problem = "a point cache of another format moves this mesh, and that of these frames is another";
    let hint = "export the same frames, or into another folder with --output, or replace it with --force";
    Err(IoError::content(&path, problem, hint))
}

/// Writes the twin as it is in the first frame, unless it is there.
pub(super) fn write(twin: &Twin, sequence: &Sequence<'_>, folder: &Path) -> Result<PathBuf, IoError> {
    let (path, first) = (folder.join(NAME), sequence.first()?);
    if !sequence.keeps(NAME) {
        let pose = twin.pose(&first);
        write_whole(&path, Durability::Process, |out| write_to(out, twin, &pose, &first))?;
    }
    Ok(path)
}

/// The points are the places of the twin in order.
fn write_to(out: &mut impl Write, twin: &Twin, pose: &Pose, frame: &Frame) -> io::Result<()> {
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
}
