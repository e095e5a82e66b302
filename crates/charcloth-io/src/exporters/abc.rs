//! Alembic: the living surface of all frames as one mesh in one .abc file.
//!
//! As in the .usdc, faces change from frame to frame and `.velocities` [m/s] carry motion blur. Alembic is y-up, so a
//! scene that is z-up is turned; its faces run clockwise seen from outside.

use super::ogawa::{Item, OgawaWriter, Pod, Property};
use super::quantities::{ORIGIN_WEIGHTS_BY_CORNER, ORIGINS, QUANTITIES, linear_color};
use super::sequence::Sequence;
use super::surface::Shape;
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::DVec3;
use std::collections::HashMap;
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// Writes `sheet.abc` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.abc");
    sequence.refuse_gaps(&path)?;
    let (up, step) = (sequence.meta().up, 1.0 / sequence.fps());
    let start = f64::from(sequence.numbers()[0]) * step;
    write_streamed(&path, Durability::Process, |out| {
        let mut file = OgawaWriter::begin(out)?;
        let mut sheet = Sheet { up, columns: Vec::new() };
        while let Some(frame) = sequence.next(&path)? {
            sheet.add(&mut file, &frame)?;
        }
        let about = format!(
            "FramesPerTimeUnit={};_ai_AlembicVersion=Alembic 1.8.3;_ai_Application=Charcloth {};_ai_Description={}",
            sequence.fps(),
            env!("CARGO_PKG_VERSION"),
            // Semicolons and equal signs part the texts.
            sequence.meta().scene.replace([';', '='], " ")
        );
        let mesh = "schema=AbcGeom_PolyMesh_v1;schemaBaseType=AbcGeom_GeomBase_v1";
        let object = file.metadata(&format!("{mesh};schemaObjTitle=AbcGeom_PolyMesh_v1:.geom"));
        let items = sheet.items(&mut file, mesh);
        file.finish("sheet", object, &items, [start, step], &about)?;
        Ok(())
    })?;
    Ok(vec![path])
}

/// Where a property stands in the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Geometry,
    Uv,
    Arbitrary,
}

/// The mesh, with the frames so far.
struct Sheet {
    up: Axis,
    columns: Vec<(Place, Property)>,
}

/// Name, place, metadata, type and bytes of a property in a frame.
type Sample = (&'static str, Place, String, Pod, u32, Vec<u8>);

impl Sheet {
    fn add<W: Write + Seek>(&mut self, file: &mut OgawaWriter<W>, frame: &Frame) -> io::Result<()> {
        for (k, (name, place, metadata, pod, extent, bytes)) in self.samples(frame).into_iter().enumerate() {
            if k == self.columns.len() {
                let is_scalar = name == ".selfBnds";
                self.columns.push((place, file.property(name, &metadata, pod, extent, is_scalar)));
            }
            file.add_sample(&mut self.columns[k].1, bytes)?;
        }
        Ok(())
    }

    /// A place or direction, y-up.
    fn turned(&self, v: DVec3) -> [f32; 3] {
        let v = v.as_vec3();
        match self.up {
            Axis::Y => v.to_array(),
            Axis::Z => [v.x, v.z, -v.y],
        }
    }

    /// Every property of the mesh in a frame.
    fn samples(&self, frame: &Frame) -> Vec<Sample> {
        let shape = Shape::of(frame);
        let (motion, triangles) = (&frame.motion, &frame.triangles);
        let nodes = || shape.nodes.iter().map(|i| *i as usize);
        let vectors =
            |value: &dyn Fn(usize) -> DVec3| bytes(nodes().flat_map(|i| self.turned(value(i))).map(f32::to_le_bytes));
        let normals = frame.normals();
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for p in nodes().map(|i| self.turned(motion.position[i])) {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(f64::from(p[k]));
                bounds[1][k] = bounds[1][k].max(f64::from(p[k]));
            }
        }
        if shape.nodes.is_empty() {
            bounds = [[0.0; 3]; 2];
        }
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
        let mut all: Vec<Sample> = vec![
            (
                ".selfBnds",
                Geometry,
                "interpretation=box".into(),
                Float64,
                6,
                bytes(bounds.concat().into_iter().map(f64::to_le_bytes)),
            ),
            ("P", Geometry, "geoScope=vtx;interpretation=point".into(), Float32, 3, vectors(&|i| motion.position[i])),
            (
                ".velocities",
                Geometry,
                "geoScope=vtx;interpretation=vector".into(),
                Float32,
                3,
                vectors(&|i| motion.velocity[i]),
            ),
            (".faceIndices", Geometry, String::new(), Int32, 1, bytes(faces.map(u32::to_le_bytes))),
            (".faceCounts", Geometry, String::new(), Int32, 1, three),
            ("N", Geometry, parameter("vtx", "float32_t", 3, "normal"), Float32, 3, vectors(&|i| normals[i])),
            (".vals", Uv, parameter("fvr", "float32_t", 2, "vector"), Float32, 2, uv),
            (".indices", Uv, String::new(), Uint32, 1, uv_numbers),
        ];
        for quantity in QUANTITIES {
            let values = nodes().map(|i| ((quantity.value)(frame, i) as f32).to_le_bytes());
            all.push((quantity.name, Arbitrary, parameter("vtx", "float32_t", 1, ""), Float32, 1, bytes(values)));
        }
        let color = bytes(nodes().flat_map(|i| linear_color(frame, i)).map(f32::to_le_bytes));
        all.push(("Cd", Arbitrary, parameter("vtx", "float32_t", 3, "rgb"), Float32, 3, color));
        let rest = vectors(&|i| motion.rest_position[i]);
        all.push(("rest", Arbitrary, parameter("vtx", "float32_t", 3, "point"), Float32, 3, rest));
        // Weights are no vector, which programs would turn with the mesh: three parameters.
        for (k, name) in ORIGIN_WEIGHTS_BY_CORNER.into_iter().enumerate() {
            let weights = bytes(nodes().map(|i| (frame.origins.origin_weights[i][k] as f32).to_le_bytes()));
            all.push((name, Arbitrary, parameter("vtx", "float32_t", 1, ""), Float32, 1, weights));
        }
        for origin in ORIGINS {
            let values = bytes(nodes().map(|i| (origin.value)(frame, i).to_le_bytes()));
            all.push((origin.name, Arbitrary, parameter("vtx", "int32_t", 1, ""), Int32, 1, values));
        }
        let by_node = [
            ("id", bytes(shape.nodes.iter().map(|i| i.to_le_bytes()))),
            ("source", bytes(nodes().map(|i| motion.source[i].to_le_bytes()))),
            ("alive", bytes(nodes().map(|i| u32::from(motion.alive[i]).to_le_bytes()))),
        ];
        all.extend(by_node.map(|(name, data)| (name, Arbitrary, parameter("vtx", "int32_t", 1, ""), Int32, 1, data)));
        let rows = |column: &[u32]| bytes(shape.rows.iter().map(|t| column[*t as usize].to_le_bytes()));
        let by_face = [
            ("piece", rows(&triangles.piece)),
            ("source_face", rows(&triangles.source_face)),
            ("sheet", rows(&triangles.sheet)),
        ];
        all.extend(by_face.map(|(name, data)| (name, Arbitrary, parameter("uni", "int32_t", 1, ""), Int32, 1, data)));
        all
    }

    /// The tree of properties.
    fn items<W: Write + Seek>(self, file: &mut OgawaWriter<W>, mesh: &str) -> Vec<Item> {
        let (mut geometry, mut uv, mut arbitrary) = (Vec::new(), Vec::new(), Vec::new());
        for (place, property) in self.columns {
            let items = match place {
                Place::Geometry => &mut geometry,
                Place::Uv => &mut uv,
                Place::Arbitrary => &mut arbitrary,
            };
            items.push(Item::Property(property));
        }
        let metadata = file.metadata(&parameter("fvr", "float32_t", 2, "vector"));
        geometry.push(Item::Compound { name: "uv", metadata, items: uv });
        geometry.push(Item::Compound { name: ".arbGeomParams", metadata: 0, items: arbitrary });
        vec![Item::Compound { name: ".geom", metadata: file.metadata(mesh), items: geometry }]
    }
}

/// Metadata of a geometry parameter: by point, face or corner, its type, and what it means.
fn parameter(scope: &str, pod: &str, extent: u32, meaning: &str) -> String {
    let meaning = if meaning.is_empty() { String::new() } else { format!("interpretation={meaning};") };
    format!("arrayExtent=1;geoScope={scope};{meaning}isGeomParam=true;podExtent={extent};podName={pod}")
}

fn bytes<const N: usize>(numbers: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    numbers.flatten().collect()
}
