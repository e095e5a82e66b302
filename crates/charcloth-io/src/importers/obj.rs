//! Wavefront OBJ: `v` (with colours behind the place), `vt` and `f`; groups and materials do not cut the surface.
//!
//! Read by our own hundred lines: the libraries at hand renumber the points by group and by first use, which would move
//! what a scene pins by index, round to single precision, and do not say in which line an error is.

use super::raw::RawMesh;
use crate::error::IoError;
use crate::files::read_whole;
use glam::{DVec3, Vec2};
use std::path::Path;

/// A part of a file in the making.
#[derive(Default)]
struct Parts {
    mesh: RawMesh,
    uv: Vec<Vec2>,
    colors: Vec<Option<[f32; 3]>>,
    corner_uv: Vec<Option<Vec2>>,
}

/// Reads the faces of an OBJ file.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let bytes = read_whole(path)?;
    // Names and comments may be in any encoding; what counts is ASCII.
    let text = String::from_utf8_lossy(&bytes);
    if text.trim().is_empty() {
        return Err(IoError::content(path, "the file is empty", "export the mesh again"));
    }
    let mut parts = Parts::default();
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        // A backslash at the end joins the next line on.
        let mut joined = line.trim_end().to_string();
        while joined.ends_with('\\') {
            joined.pop();
            joined.push(' ');
            joined.push_str(lines.next().map_or("", |(_, more)| more.trim_end()));
        }
        let statement = joined.split('#').next().unwrap_or_default();
        parts
            .take(statement)
            .map_err(|problem| IoError::at_line(path, number + 1, problem, "export the mesh again as OBJ"))?;
    }
    Ok(parts.finish())
}

impl Parts {
    fn take(&mut self, statement: &str) -> Result<(), String> {
        let mut words = statement.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let numbers = numbers(words)?;
                if numbers.len() < 3 {
                    return Err(format!("a point has {} coordinates instead of 3", numbers.len()));
                }
                self.mesh.positions.push(DVec3::new(numbers[0], numbers[1], numbers[2]));
                // A fourth number is a weight; colours come in threes.
                let color = (numbers.len() == 6).then(|| [numbers[3] as f32, numbers[4] as f32, numbers[5] as f32]);
                self.colors.push(color);
            }
            Some("vt") => {
                let numbers = numbers(words)?;
                let u = *numbers.first().ok_or("a texture coordinate has no numbers")?;
                self.uv.push(Vec2::new(u as f32, numbers.get(1).copied().unwrap_or(0.0) as f32));
            }
            Some("f") => {
                let before = self.mesh.corners.len();
                for word in words {
                    let mut indices = word.split('/');
                    let point = index(indices.next().unwrap_or_default(), self.mesh.positions.len(), "point")?;
                    let uv = match indices.next() {
                        None | Some("") => None,
                        Some(text) => Some(self.uv[index(text, self.uv.len(), "texture coordinate")? as usize]),
                    };
                    self.mesh.corners.push(point);
                    self.corner_uv.push(uv);
                }
                let count = self.mesh.corners.len() - before;
                if count < 3 {
                    return Err(format!("a face has {count} corners instead of 3 or more"));
                }
                self.mesh.face_ends.push(self.mesh.corners.len());
            }
            // Normals, groups, names, materials, smoothing, lines, points, curves: nothing a sheet needs.
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self) -> RawMesh {
        let without = self.corner_uv.iter().filter(|uv| uv.is_none()).count();
        if without < self.corner_uv.len() {
            if without > 0 {
                let remark = format!("{without} face corners have no texture coordinate and got (0, 0)");
                self.mesh.remarks.push(remark);
            }
            self.mesh.corner_uv = self.corner_uv.iter().map(|uv| uv.unwrap_or_default()).collect();
        }
        if self.colors.iter().any(Option::is_some) {
            let colors: Vec<_> = self.colors.iter().map(|c| c.unwrap_or_default()).collect();
            self.mesh.paint_colors(&colors);
        }
        self.mesh
    }
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>) -> Result<Vec<f64>, String> {
    words.map(|word| word.parse().map_err(|_| format!("\"{word}\" is not a number"))).collect()
}

/// An index, counted from 1, or back from the last one where it is negative; the answer counts from 0.
fn index(text: &str, count: usize, what: &str) -> Result<u32, String> {
    let number: i64 = text.parse().map_err(|_| format!("\"{text}\" is not the number of a {what}"))?;
    let place = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
    match place.and_then(|p| u32::try_from(p).ok()) {
        Some(place) if (place as usize) < count => Ok(place),
        _ => Err(format!("a face names {what} {number}, but there are {count} so far")),
    }
}
