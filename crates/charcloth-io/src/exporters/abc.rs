//! Alembic: the living surface of all frames as one mesh in one .abc file, and particles as points beside it.
//!
//! As in the .usdc, faces change from frame to frame and `.velocities` [m/s] carry motion blur. Alembic is y-up, so a
//! scene that is z-up is turned; its faces run clockwise seen from outside.

use super::abc_points::Points;
use super::abc_samples::{Columns, Place, Sample};
use super::ogawa::{OgawaWriter, Pod};
use super::quantities::{
    ORIGIN_WEIGHTS_BY_CORNER, ORIGINS, PIECES, QUANTITIES, Value as Of, linear_color, piece_count,
};
use super::sequence::Sequence;
use super::surface::Shape;
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::DVec3;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Writes `sheet.abc` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.abc");
    sequence.refuse_gaps(&path)?;
    let (up, step) = (sequence.meta().up, 1.0 / sequence.fps());
    let start = f64::from(sequence.numbers()[0]) * step;
    write_streamed(&path, Durability::Process, |out| {
        let mut file = OgawaWriter::begin(out)?;
        let mut sheet = Sheet { up, columns: Columns::default() };
        let mut particles = Points::default();
        while let Some(frame) = sequence.next(&path)? {
            let samples = sheet.samples(&frame);
            sheet.columns.add(&mut file, samples)?;
            particles.add(&mut file, &frame, up)?;
        }
        let about = format!(
            "FramesPerTimeUnit={};_ai_AlembicVersion=Alembic 1.8.3;_ai_Application=Charcloth {};_ai_Description={}",
            sequence.fps(),
            env!("CARGO_PKG_VERSION"),
            // Semicolons and equal signs part the texts.
            sequence.meta().scene.replace([';', '='], " ")
        );
        let mut objects = vec![sheet.columns.object(&mut file, "sheet", "AbcGeom_PolyMesh_v1")];
        if particles.any {
            objects.push(particles.columns.object(&mut file, "particles", "AbcGeom_Points_v1"));
        }
        file.finish(&objects, [start, step], &about)?;
        Ok(())
    })?;
    Ok(vec![path])
}

/// The mesh, with the frames so far.
struct Sheet {
    up: Axis,
    columns: Columns,
}

impl Sheet {
    /// Every property of the mesh in a frame.
    fn samples(&self, frame: &Frame) -> Vec<Sample> {
        let shape = Shape::of(frame);
        let (motion, triangles) = (&frame.motion, &frame.triangles);
        let nodes = || shape.nodes.iter().map(|i| *i as usize);
        let vectors = |value: &dyn Fn(usize) -> DVec3| {
            bytes(nodes().flat_map(|i| turned(self.up, value(i))).map(f32::to_le_bytes))
        };
        let normals = frame.normals();
        let bounds = bounds(nodes().map(|i| turned(self.up, motion.position[i])), |_| 0.0);
        // Clockwise: programs that turn them over again get the corners in their order.
        let faces = shape.faces.iter().flat_map(|[a, b, c]| [*c, *b, *a]);
        let mut numbers = HashMap::new();
        let (mut uv, mut uv_numbers) = (Vec::new(), Vec::new());
        for t in &shape.rows {
            let [a, b, c] = triangles.uv[*t as usize];
            for corner in [c, b, a] {
                let next = numbers.len() as u32;
                let number = *numbers.entry((corner.x.to_bits(), corner.y.to_bits())).or_insert(next);
                if number == next {
                    uv.extend(corner.to_array().iter().flat_map(|v| v.to_le_bytes()));
                }
                uv_numbers.extend(number.to_le_bytes());
            }
        }
        use {Place::*, Pod::*};
        let three = bytes(std::iter::repeat_n(3i32.to_le_bytes(), shape.faces.len()));
        let indexed = Indexed("uv", parameter("fvr", "float32_t", 2, "vector"));
        let mut all = vec![
            Sample(".selfBnds", Geometry, "interpretation=box".into(), Float64, 6, bounds),
            Sample("P", Geometry, point_metadata("point"), Float32, 3, vectors(&|i| motion.position[i])),
            Sample(".velocities", Geometry, point_metadata("vector"), Float32, 3, vectors(&|i| motion.velocity[i])),
            Sample(".faceIndices", Geometry, String::new(), Int32, 1, bytes(faces.map(u32::to_le_bytes))),
            Sample(".faceCounts", Geometry, String::new(), Int32, 1, three),
            Sample("N", Geometry, parameter("vtx", "float32_t", 3, "normal"), Float32, 3, vectors(&|i| normals[i])),
            Sample(".vals", indexed.clone(), parameter("fvr", "float32_t", 2, "vector"), Float32, 2, uv),
            Sample(".indices", indexed, String::new(), Uint32, 1, uv_numbers),
        ];
        for quantity in QUANTITIES {
            let values = nodes().map(|i| ((quantity.value)(frame, i) as f32).to_le_bytes());
            all.push(Sample(quantity.name, Arbitrary, parameter("vtx", "float32_t", 1, ""), Float32, 1, bytes(values)));
        }
        let color = bytes(nodes().flat_map(|i| linear_color(frame, i)).map(f32::to_le_bytes));
        all.push(Sample("Cd", Arbitrary, parameter("vtx", "float32_t", 3, "rgb"), Float32, 3, color));
        let rest = vectors(&|i| motion.rest_position[i]);
        all.push(Sample("rest", Arbitrary, parameter("vtx", "float32_t", 3, "point"), Float32, 3, rest));
        // Weights are no vector, which programs would turn with the mesh: three parameters.
        for (k, name) in ORIGIN_WEIGHTS_BY_CORNER.into_iter().enumerate() {
            let weights = bytes(nodes().map(|i| (frame.origins.origin_weights[i][k] as f32).to_le_bytes()));
            all.push(Sample(name, Arbitrary, parameter("vtx", "float32_t", 1, ""), Float32, 1, weights));
        }
        for origin in ORIGINS {
            let values = bytes(nodes().map(|i| (origin.value)(frame, i).to_le_bytes()));
            all.push(Sample(origin.name, Arbitrary, parameter("vtx", "int32_t", 1, ""), Int32, 1, values));
        }
        let by_node = [
            ("id", bytes(shape.nodes.iter().map(|i| i.to_le_bytes()))),
            ("source", bytes(nodes().map(|i| motion.source[i].to_le_bytes()))),
            ("alive", bytes(nodes().map(|i| u32::from(motion.alive[i]).to_le_bytes()))),
        ];
        all.extend(
            by_node.map(|(name, data)| Sample(name, Arbitrary, parameter("vtx", "int32_t", 1, ""), Int32, 1, data)),
        );
        let rows = |column: &[u32]| bytes(shape.rows.iter().map(|t| column[*t as usize].to_le_bytes()));
        let by_face = [
            ("piece", rows(&triangles.piece)),
            ("source_face", rows(&triangles.source_face)),
            ("sheet", rows(&triangles.sheet)),
        ];
        all.extend(
            by_face.map(|(name, data)| Sample(name, Arbitrary, parameter("uni", "int32_t", 1, ""), Int32, 1, data)),
        );
        // A value a piece, and each face says which: its number.
        let numbers = rows(&triangles.piece);
        for quantity in PIECES {
            let pieces = 0..piece_count(frame);
            let (kind, pod, values) = match quantity.value {
                Of::Number(value) => {
                    ("float32_t", Float32, bytes(pieces.map(|p| (value(frame, p) as f32).to_le_bytes())))
                }
                Of::Whole(value) => ("int32_t", Int32, bytes(pieces.map(|p| value(frame, p).to_le_bytes()))),
            };
            let indexed = ArbitraryIndexed(quantity.name, parameter("uni", kind, 1, ""));
            all.push(Sample(".vals", indexed.clone(), parameter("uni", kind, 1, ""), pod, 1, values));
            all.push(Sample(".indices", indexed, String::new(), Uint32, 1, numbers.clone()));
        }
        all
    }
}

/// A place or direction, y-up.
pub(super) fn turned(up: Axis, v: DVec3) -> [f32; 3] {
    let v = v.as_vec3();
    match up {
        Axis::Y => v.to_array(),
        Axis::Z => [v.x, v.z, -v.y],
    }
}

/// The box around places [m], each with a margin by its number [m].
pub(super) fn bounds(places: impl Iterator<Item = [f32; 3]>, margin: impl Fn(usize) -> f64) -> Vec<u8> {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for (number, place) in places.enumerate() {
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(f64::from(place[k]) - margin(number));
            bounds[1][k] = bounds[1][k].max(f64::from(place[k]) + margin(number));
        }
    }
    if bounds[0][0] > bounds[1][0] {
        bounds = [[0.0; 3]; 2];
    }
    bytes(bounds.concat().into_iter().map(f64::to_le_bytes))
}

/// Metadata of a property of points that is no geometry parameter.
pub(super) fn point_metadata(meaning: &str) -> String {
    format!("geoScope=vtx;interpretation={meaning}")
}

/// Metadata of a geometry parameter: by point, face or corner, its type, and what it means.
pub(super) fn parameter(scope: &str, pod: &str, extent: u32, meaning: &str) -> String {
    let meaning = if meaning.is_empty() { String::new() } else { format!("interpretation={meaning};") };
    format!("arrayExtent=1;geoScope={scope};{meaning}isGeomParam=true;podExtent={extent};podName={pod}")
}

/// Numbers as they lie in the file.
pub(super) fn bytes<const N: usize>(numbers: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    numbers.flatten().collect()
}
