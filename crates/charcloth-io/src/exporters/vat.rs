//! Vertex animation textures: the fixed-topology twin as pictures that a vertex shader moves a mesh by.
//!
//! A point is a column and a row within a frame, frames stand one below the other. The mesh is a .glb whose second
//! texture coordinates are the centre of the point's texel in the first frame; `vat.json` says all that a shader must
//! know.

use super::glb::{Component, Glb, Target, floats, paper, z_up_rotation};
use super::pictures::{write_exr, write_png};
use super::quantities::color;
use super::sequence::Sequence;
use super::twin::{Pose, Twin};
use crate::error::IoError;
use crate::files::{Durability, Failure, write_whole};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::{Vec2, Vec3};
use png::{BitDepth, ColorType};
use serde_json::json;
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Widths to choose from; graphics processors take textures up to the last.
const SIDES: [usize; 7] = [256, 512, 1024, 2048, 4096, 8192, 16384];

const FILES: [&str; 5] = ["vat.json", "sheet.glb", "positions.exr", "normals.png", "colors.png"];

/// Names of the files.
pub(super) fn files(_: &[u32]) -> Vec<String> {
    FILES.map(String::from).to_vec()
}

/// Where points and frames are in the pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    points: usize,
    frames: usize,
    width: usize,
    rows_per_frame: usize,
}

impl Layout {
    /// The narrowest layout that is not higher than wide; none where no texture is large enough.
    fn of(points: usize, frames: usize) -> Option<Self> {
        let layout = |width: usize| Self { points, frames, width, rows_per_frame: points.div_ceil(width) };
        SIDES.into_iter().map(layout).find(|layout| layout.height() <= layout.width)
    }

    fn height(&self) -> usize {
        self.frames * self.rows_per_frame
    }

    fn size(&self) -> [usize; 2] {
        [self.width, self.height()]
    }

    /// Points of a row of the pictures.
    fn row(&self, y: usize) -> std::ops::Range<usize> {
        let from = (y % self.rows_per_frame) * self.width;
        from..self.points.min(from + self.width)
    }

    /// Centre of the texel of a point in the first frame, counted from the top.
    fn texel(&self, point: usize) -> Vec2 {
        let (x, y) = (point % self.width, point / self.width);
        Vec2::new((x as f32 + 0.5) / self.width as f32, (y as f32 + 0.5) / self.height() as f32)
    }
}

/// Writes `vat.json`, `sheet.glb`, `positions.exr`, `normals.png` and `colors.png` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let [about, mesh, positions, normals, colors] = FILES.map(|name| folder.join(name));
    let twin = Twin::of(sequence, &positions)?;
    let frames = sequence.numbers().len();
    let Some(layout) = Layout::of(twin.len(), frames) else {
        let problem = format!("{} points in {frames} frames are too many for a texture", twin.len());
        return Err(IoError::content(&positions, problem, "export fewer frames with --frames, or a coarser sheet"));
    };
    sequence.plan(3);
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut now = None;
    write_exr(&positions, layout.size(), &["A", "B", "G", "R"], &mut |y, row| {
        let (_, pose) = at_row(&mut now, sequence, &twin, layout, y, &positions)?;
        row.fill(0.0);
        for (x, point) in layout.row(y).enumerate() {
            let place = pose.positions[point];
            (low, high) = (low.min(place), high.max(place));
            let alive = f32::from(u8::from(pose.alive[point]));
            for (channel, sample) in [alive, place.z, place.y, place.x].into_iter().enumerate() {
                row[channel * layout.width + x] = sample;
            }
        }
        Ok(())
    })?;
    now = None;
    write_png(&normals, layout.size(), ColorType::Rgb, BitDepth::Eight, &mut |y, row| {
        let (_, pose) = at_row(&mut now, sequence, &twin, layout, y, &normals)?;
        row.fill(128);
        for (texel, point) in row.chunks_exact_mut(3).zip(layout.row(y)) {
            texel.copy_from_slice(&pose.normals[point].to_array().map(|n| (127.5 + 127.5 * n).round() as u8));
        }
        Ok(())
    })?;
    now = None;
    write_png(&colors, layout.size(), ColorType::Rgba, BitDepth::Eight, &mut |y, row| {
        let (frame, pose) = at_row(&mut now, sequence, &twin, layout, y, &colors)?;
        row.fill(0);
        for (texel, point) in row.chunks_exact_mut(4).zip(layout.row(y)) {
            let [r, g, b] = color(frame, pose.nodes[point] as usize);
            texel.copy_from_slice(&[r, g, b, if pose.alive[point] { 255 } else { 0 }]);
        }
        Ok(())
    })?;
    let first = sequence.first()?;
    write_mesh(&twin, &first, layout, sequence.meta().up, &mesh)?;
    let text = json!({
        "format": "charcloth-vat",
        "version": 1,
        "scene": sequence.meta().scene,
        "fps": sequence.fps(),
        "first_frame": sequence.numbers()[0],
        "frames": layout.frames,
        "points": layout.points,
        "width": layout.width,
        "height": layout.height(),
        "rows_per_frame": layout.rows_per_frame,
        "up": sequence.meta().up,
        "metres_per_unit": 1.0,
        "bounds": [low.to_array(), high.to_array()],
        "mesh": { "file": "sheet.glb", "about": "TEXCOORD_0 is the texture, TEXCOORD_1 the centre of the point's texel \
            in the first frame, counted from the top; add frame * rows_per_frame / height to its second component" },
        "positions": { "file": "positions.exr", "about": "R G B are x y z [m], A is 1 while the point is alive; sample \
            without filter" },
        "normals": { "file": "normals.png", "about": "R G B are 0.5 + 0.5 * x y z" },
        "colors": { "file": "colors.png", "about": "R G B are sRGB, A is 1 while the point is alive" },
    });
    write_whole(&about, Durability::Process, |out| {
        serde_json::to_writer_pretty(&mut *out, &text)?;
        out.write_all(b"\n")
    })?;
    Ok(vec![about, mesh, positions, normals, colors])
}

/// The frame that a row of the pictures is of, and the pose of the twin in it.
fn at_row<'a>(
    now: &'a mut Option<(Frame, Pose)>,
    sequence: &mut Sequence<'_>,
    twin: &Twin,
    layout: Layout,
    y: usize,
    path: &Path,
) -> Result<&'a (Frame, Pose), Failure> {
    if now.is_none() || y.is_multiple_of(layout.rows_per_frame) {
        let frame = sequence.next_needed(path)?;
        let pose = twin.pose(&frame);
        return Ok(now.insert((frame, pose)));
    }
    Ok(now.as_ref().expect("a row before has read the frame"))
}

/// The mesh that the pictures move, as it is in a frame.
fn write_mesh(twin: &Twin, frame: &Frame, layout: Layout, up: Axis, path: &Path) -> Result<(), IoError> {
    // A point has several vertices only where a texture seam runs.
    let mut numbers = HashMap::new();
    let mut vertices: Vec<(u32, Vec2)> = Vec::new();
    let mut faces = Vec::with_capacity(12 * twin.faces.len());
    for (face, t) in twin.faces.iter().zip(&twin.rows) {
        for (point, uv) in face.iter().zip(frame.triangles.uv[*t as usize]) {
            let number = *numbers.entry((*point, uv.x.to_bits(), uv.y.to_bits())).or_insert_with(|| {
                vertices.push((*point, uv));
                vertices.len() as u32 - 1
            });
            faces.extend(number.to_le_bytes());
        }
    }
    let pose = twin.pose(frame);
    let count = vertices.len();
    let mut glb = Glb::begin(path)?;
    let positions: Vec<Vec3> = vertices.iter().map(|(point, _)| pose.positions[*point as usize]).collect();
    let position = glb.add_positions(&positions)?;
    let normals = floats(vertices.iter().flat_map(|(point, _)| pose.normals[*point as usize].to_array()));
    let normal = glb.add(&normals, Target::Vertices, Component::Float, count, "VEC3")?;
    let uv = floats(vertices.iter().flat_map(|(_, uv)| [uv.x, 1.0 - uv.y]));
    let uv = glb.add(&uv, Target::Vertices, Component::Float, count, "VEC2")?;
    let texel = floats(vertices.iter().flat_map(|(point, _)| layout.texel(*point as usize).to_array()));
    let texel = glb.add(&texel, Target::Vertices, Component::Float, count, "VEC2")?;
    let faces = glb.add(&faces, Target::Faces, Component::UnsignedInt, 3 * twin.faces.len(), "SCALAR")?;
    let mut node = json!({ "name": "sheet", "mesh": 0 });
    if up == Axis::Z {
        node["rotation"] = z_up_rotation();
    }
    glb.finish(json!({
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [{ "name": "sheet", "primitives": [{
            "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "TEXCOORD_1": texel },
            "indices": faces,
            "material": 0,
        }] }],
        "materials": [paper()],
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_as_small_as_they_can_be() {
        let layout = Layout::of(1000, 24).unwrap();
        assert_eq!((layout.width, layout.rows_per_frame, layout.height()), (256, 4, 96));
        assert_eq!(layout.row(3), 768..1000);
        assert_eq!(layout.row(5), 256..512);
        assert_eq!(layout.texel(257), Vec2::new(1.5 / 256.0, 1.5 / 96.0));
        assert_eq!(Layout::of(60_000, 240).unwrap().width, 4096);
        assert_eq!(Layout::of(2_000_000, 240), None);
    }
}
