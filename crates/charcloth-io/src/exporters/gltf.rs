//! glTF 2.0: all frames in one .glb, each a mesh of its own that is shown for its time.
//!
//! A node whose scale is animated to zero is not drawn; glTF names this as the way to animate visibility. Morph targets
//! would move one mesh instead, but viewers that morph colours are few, and a sheet whose colour stays is not seen to
//! burn; nor could its faces change. What a frame has in common with the one before (texture coordinates, faces) is
//! written once.

use super::glb::{Component, Glb, Target, floats, paper, z_up_rotation};
use super::quantities::{char, linear_color, temperature};
use super::sequence::Sequence;
use super::surface::Surface;
use crate::error::IoError;
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Writes `sheet.glb` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.glb");
    let mut meshes = Meshes { glb: Glb::begin(&path)?, shared: Default::default() };
    let mut written = Vec::new();
    // Frame number of each mesh, and of the end of its time.
    let mut shown: Vec<(u32, Option<u32>)> = Vec::new();
    let mut first = None;
    while let Some(frame) = sequence.next(&path)? {
        first.get_or_insert(frame.number);
        if let Some(before) = shown.last_mut() {
            before.1.get_or_insert(frame.number);
        }
        let surface = Surface::of(&frame);
        // glTF has no empty meshes: frames with nothing left show nothing.
        if !surface.faces.is_empty() {
            let primitive = meshes.primitive(&frame, &surface)?;
            written.push(json!({ "name": format!("frame_{:05}", frame.number), "primitives": [primitive] }));
            shown.push((frame.number, None));
        }
    }
    if written.is_empty() {
        return Err(IoError::content(&path, "there is no living face in these frames", "choose others with --frames"));
    }
    let seconds = |number: u32| f64::from(number - first.unwrap_or_default()) / sequence.fps();
    let animation = animation(&mut meshes.glb, &shown, &seconds)?;
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
        top["rotation"] = z_up_rotation();
    }
    nodes.push(top);
    let mut text = json!({
        "scene": 0,
        "scenes": [{ "name": sequence.meta().scene, "nodes": [nodes.len() - 1] }],
        "nodes": nodes,
        "meshes": written,
        "materials": [paper()],
    });
    if shown.len() > 1 {
        text["animations"] = json!([animation]);
    }
    meshes.glb.finish(text)?;
    Ok(vec![path])
}

/// The file, and the bytes and accessors of what the last frame may share with the next: texture coordinates, faces.
struct Meshes {
    glb: Glb,
    shared: [(Vec<u8>, usize); 2],
}

impl Meshes {
    /// The mesh of a frame.
    fn primitive(&mut self, frame: &Frame, surface: &Surface) -> Result<Value, IoError> {
        let node = |v: &(u32, Vec2)| v.0 as usize;
        let vertices = &surface.vertices;
        let count = vertices.len();
        let positions: Vec<Vec3> = vertices.iter().map(|v| frame.motion.position[node(v)].as_vec3()).collect();
        let position = self.glb.add_positions(&positions)?;
        let normals = frame.normals();
        // A node whose triangles have no area has no normal; any will do, as long as it is one.
        let normals = vertices.iter().map(|v| normals[node(v)].as_vec3().normalize_or(Vec3::Z));
        let numbers = floats(normals.flat_map(|n| n.to_array()));
        let normal = self.glb.add(&numbers, Target::Vertices, Component::Float, count, "VEC3")?;
        // Its texture coordinates count from the top.
        let uv = floats(vertices.iter().flat_map(|(_, uv)| [uv.x, 1.0 - uv.y]));
        let uv = self.shared(0, uv, Target::Vertices, Component::Float, count, "VEC2")?;
        let color = vertices.iter().flat_map(|v| {
            let [r, g, b] = linear_color(frame, node(v)).map(|c| (c * 65535.0).round() as u16);
            [r, g, b, u16::MAX]
        });
        let color: Vec<u8> = color.flat_map(u16::to_le_bytes).collect();
        let color = self.glb.add(&color, Target::Vertices, Component::UnsignedShort, count, "VEC4")?;
        self.glb.accessors[color]["normalized"] = json!(true);
        let mut scalar = |value: fn(&Frame, usize) -> f64| {
            let bytes = floats(vertices.iter().map(|v| value(frame, node(v)) as f32));
            self.glb.add(&bytes, Target::Vertices, Component::Float, count, "SCALAR")
        };
        let (temperature, char) = (scalar(temperature)?, scalar(char)?);
        let faces: Vec<u8> = surface.faces.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let corners = 3 * surface.faces.len();
        let faces = self.shared(1, faces, Target::Faces, Component::UnsignedInt, corners, "SCALAR")?;
        Ok(json!({
            "attributes": {
                "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color,
                "_TEMPERATURE": temperature, "_CHAR": char,
            },
            "indices": faces,
            "material": 0,
        }))
    }

    /// Adds numbers, unless the last frame had the same.
    fn shared(
        &mut self,
        which: usize,
        bytes: Vec<u8>,
        target: Target,
        component: Component,
        count: usize,
        kind: &str,
    ) -> Result<usize, IoError> {
        if self.shared[which].0 != bytes {
            let accessor = self.glb.add(&bytes, target, component, count, kind)?;
            self.shared[which] = (bytes, accessor);
        }
        Ok(self.shared[which].1)
    }
}

/// Shows each mesh from its frame to the next.
fn animation(glb: &mut Glb, shown: &[(u32, Option<u32>)], seconds: &dyn Fn(u32) -> f64) -> Result<Value, IoError> {
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (k, (number, end)) in shown.iter().enumerate() {
        let mut keys = Vec::new();
        if seconds(*number) > 0.0 {
            keys.push((0.0, 0.0));
        }
        keys.push((seconds(*number) as f32, 1.0));
        keys.extend(end.map(|end| (seconds(end) as f32, 0.0)));
        let times = floats(keys.iter().map(|(time, _)| *time));
        let input = glb.add(&times, Target::Keys, Component::Float, keys.len(), "SCALAR")?;
        glb.accessors[input]["min"] = json!([keys[0].0]);
        glb.accessors[input]["max"] = json!([keys[keys.len() - 1].0]);
        let scales = floats(keys.iter().flat_map(|(_, scale)| [*scale; 3]));
        let output = glb.add(&scales, Target::Keys, Component::Float, keys.len(), "VEC3")?;
        samplers.push(json!({ "input": input, "output": output, "interpolation": "STEP" }));
        channels.push(json!({ "sampler": k, "target": { "node": k, "path": "scale" } }));
    }
    Ok(json!({ "name": "burn", "samplers": samplers, "channels": channels }))
}
