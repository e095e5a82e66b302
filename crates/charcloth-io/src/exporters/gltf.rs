//! glTF 2.0: all frames in one .glb, each a mesh of its own that is shown for its time.
//!
//! A node whose scale is animated to zero is not drawn; glTF names this as the way to animate visibility. Morph targets
//! would move one mesh instead, but viewers that morph colours are few, and a sheet whose colour stays is not seen to
//! burn; nor could its faces change. What a frame has in common with the one before (texture coordinates, faces) is
//! written once.

use super::quantities::{char, linear_color, temperature};
use super::sequence::Sequence;
use super::surface::Surface;
use crate::error::IoError;
use crate::files::{Durability, Failure, PARTIAL, write_streamed};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::Vec3;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Component types and buffer targets, by their numbers in OpenGL.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// The lengths in a .glb have 32 bits; some room is left for the text.
const MOST_BYTES: u64 = 0xf000_0000;

/// Writes `sheet.glb` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.glb");
    // The text that describes the numbers stands before them, so the numbers wait in a file.
    let waiting = folder.join(format!("sheet.bin{PARTIAL}"));
    let written = write_numbers(sequence, &waiting, &path).and_then(|(text, size)| join(&text, size, &waiting, &path));
    let _ = fs::remove_file(waiting);
    written.map(|()| vec![path])
}

/// The buffer and what has been said about it so far.
struct Document {
    out: BufWriter<File>,
    size: u64,
    views: Vec<Value>,
    accessors: Vec<Value>,
    /// Bytes and accessors of what the last frame may share with the next: texture coordinates, faces.
    shared: [(Vec<u8>, usize); 2],
}

fn write_numbers(sequence: &mut Sequence<'_>, waiting: &Path, path: &Path) -> Result<(Value, u64), IoError> {
    let failed = |failure: Failure| match failure {
        Failure::Write(error) => IoError::system("write", path, &error),
        Failure::Source(error) => error,
    };
    let file = File::create(waiting).map_err(|error| IoError::system("write", path, &error))?;
    let mut document = Document {
        out: BufWriter::with_capacity(1 << 18, file),
        size: 0,
        views: Vec::new(),
        accessors: Vec::new(),
        shared: Default::default(),
    };
    let mut meshes = Vec::new();
    // Frame number of each mesh, and of the end of its time.
    let mut shown: Vec<(u32, Option<u32>)> = Vec::new();
    let mut first = None;
    while let Some(frame) = sequence.next(path)? {
        first.get_or_insert(frame.number);
        if let Some(before) = shown.last_mut() {
            before.1.get_or_insert(frame.number);
        }
        let surface = Surface::of(&frame);
        // glTF has no empty meshes: frames with nothing left show nothing.
        if !surface.faces.is_empty() {
            let primitive = document.primitive(&frame, &surface).map_err(|error| failed(error.into()))?;
            meshes.push(json!({ "name": format!("frame_{:05}", frame.number), "primitives": [primitive] }));
            shown.push((frame.number, None));
        }
        if document.size > MOST_BYTES {
            let hint = "export fewer frames with --frames, or a format for large runs such as usd";
            return Err(IoError::content(path, "it would be larger than a .glb can be", hint));
        }
    }
    if meshes.is_empty() {
        return Err(IoError::content(path, "there is no living face in these frames", "choose others with --frames"));
    }
    let seconds = |number: u32| f64::from(number - first.unwrap_or_default()) / sequence.fps();
    let animation = document.animation(&shown, &seconds).map_err(|error| failed(error.into()))?;
    document.out.flush().map_err(|error| failed(error.into()))?;
    let mut nodes: Vec<Value> = shown
        .iter()
        .enumerate()
        .map(|(k, (number, _))| {
            let scale = if k == 0 { 1.0 } else { 0.0 };
            json!({ "name": format!("frame_{number:05}"), "mesh": k, "scale": [scale, scale, scale] })
        })
        .collect();
    let mut top = json!({ "name": "charcloth", "children": (0..nodes.len()).collect::<Vec<_>>() });
    if sequence.meta().up == Axis::Z {
        // glTF is y-up: a quarter turn about x.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        top["rotation"] = json!([-half, 0.0, 0.0, half]);
    }
    nodes.push(top);
    let mut text = json!({
        "asset": { "version": "2.0", "generator": format!("Charcloth {}", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": sequence.meta().scene, "nodes": [nodes.len() - 1] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{
            "name": "paper",
            "doubleSided": true,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 },
        }],
        "accessors": document.accessors,
        "bufferViews": document.views,
        "buffers": [{ "byteLength": document.size }],
    });
    if shown.len() > 1 {
        text["animations"] = json!([animation]);
    }
    Ok((text, document.size))
}

impl Document {
    /// The mesh of a frame.
    fn primitive(&mut self, frame: &Frame, surface: &Surface) -> io::Result<Value> {
        let node = |v: &(u32, glam::Vec2)| v.0 as usize;
        let vertices = &surface.vertices;
        let count = vertices.len();
        let positions: Vec<Vec3> = vertices.iter().map(|v| frame.motion.position[node(v)].as_vec3()).collect();
        let normals = frame.normals();
        // A node whose triangles have no area has no normal; any will do, as long as it is one.
        let normals = vertices.iter().map(|v| normals[node(v)].as_vec3().normalize_or(Vec3::Z));
        let (low, high) =
            positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        let position = floats(positions.iter().flat_map(|p| p.to_array()));
        let position = self.accessor(&position, ARRAY_BUFFER, FLOAT, count, "VEC3")?;
        self.accessors[position]["min"] = json!(low.to_array());
        self.accessors[position]["max"] = json!(high.to_array());
        let normal = self.accessor(&floats(normals.flat_map(|n| n.to_array())), ARRAY_BUFFER, FLOAT, count, "VEC3")?;
        // Its texture coordinates count from the top.
        let uv = floats(vertices.iter().flat_map(|(_, uv)| [uv.x, 1.0 - uv.y]));
        let uv = self.shared(0, uv, ARRAY_BUFFER, FLOAT, count, "VEC2")?;
        let color = vertices.iter().flat_map(|v| {
            let [r, g, b] = linear_color(frame, node(v)).map(|c| (c * 65535.0).round() as u16);
            [r, g, b, u16::MAX]
        });
        let color: Vec<u8> = color.flat_map(u16::to_le_bytes).collect();
        let color = self.accessor(&color, ARRAY_BUFFER, UNSIGNED_SHORT, count, "VEC4")?;
        self.accessors[color]["normalized"] = json!(true);
        let mut scalar = |value: fn(&Frame, usize) -> f64| {
            let bytes = floats(vertices.iter().map(|v| value(frame, node(v)) as f32));
            self.accessor(&bytes, ARRAY_BUFFER, FLOAT, count, "SCALAR")
        };
        let (temperature, char) = (scalar(temperature)?, scalar(char)?);
        let faces: Vec<u8> = surface.faces.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let faces = self.shared(1, faces, ELEMENT_ARRAY_BUFFER, UNSIGNED_INT, 3 * surface.faces.len(), "SCALAR")?;
        Ok(json!({
            "attributes": {
                "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color,
                "_TEMPERATURE": temperature, "_CHAR": char,
            },
            "indices": faces,
            "material": 0,
        }))
    }

    /// Shows each mesh from its frame to the next.
    fn animation(&mut self, shown: &[(u32, Option<u32>)], seconds: &dyn Fn(u32) -> f64) -> io::Result<Value> {
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for (k, (number, end)) in shown.iter().enumerate() {
            let mut keys = Vec::new();
            if seconds(*number) > 0.0 {
                keys.push((0.0, 0.0));
            }
            keys.push((seconds(*number) as f32, 1.0));
            keys.extend(end.map(|end| (seconds(end) as f32, 0.0)));
            let times = floats(keys.iter().map(|(time, _)| *time));
            let input = self.accessor(&times, 0, FLOAT, keys.len(), "SCALAR")?;
            self.accessors[input]["min"] = json!([keys[0].0]);
            self.accessors[input]["max"] = json!([keys[keys.len() - 1].0]);
            let scales = floats(keys.iter().flat_map(|(_, scale)| [*scale; 3]));
            let output = self.accessor(&scales, 0, FLOAT, keys.len(), "VEC3")?;
            samplers.push(json!({ "input": input, "output": output, "interpolation": "STEP" }));
            channels.push(json!({ "sampler": k, "target": { "node": k, "path": "scale" } }));
        }
        Ok(json!({ "name": "burn", "samplers": samplers, "channels": channels }))
    }

    /// Adds numbers to the buffer, unless the last frame had the same.
    fn shared(
        &mut self,
        which: usize,
        bytes: Vec<u8>,
        target: u32,
        component: u32,
        count: usize,
        kind: &str,
    ) -> io::Result<usize> {
        if self.shared[which].0 != bytes {
            let accessor = self.accessor(&bytes, target, component, count, kind)?;
            self.shared[which] = (bytes, accessor);
        }
        Ok(self.shared[which].1)
    }

    /// Adds numbers to the buffer and says which accessor has them. A target of 0 is none.
    fn accessor(&mut self, bytes: &[u8], target: u32, component: u32, count: usize, kind: &str) -> io::Result<usize> {
        self.out.write_all(bytes)?;
        let mut view = json!({ "buffer": 0, "byteOffset": self.size, "byteLength": bytes.len() });
        if target != 0 {
            view["target"] = json!(target);
        }
        self.size += bytes.len() as u64;
        self.views.push(view);
        let view = self.views.len() - 1;
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        Ok(self.accessors.len() - 1)
    }
}

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

/// Writes the .glb: a head, the text, the numbers.
fn join(text: &Value, size: u64, numbers: &Path, path: &Path) -> Result<(), IoError> {
    let mut numbers = File::open(numbers).map_err(|error| IoError::system("read", numbers, &error))?;
    let mut text = text.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    write_streamed(path, Durability::Process, |out| {
        let total = 12 + 8 + text.len() as u64 + 8 + size;
        out.write_all(b"glTF\x02\0\0\0")?;
        out.write_all(&(total as u32).to_le_bytes())?;
        out.write_all(&(text.len() as u32).to_le_bytes())?;
        out.write_all(b"JSON")?;
        out.write_all(&text)?;
        out.write_all(&(size as u32).to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        io::copy(&mut numbers, out)?;
        Ok(())
    })
}
