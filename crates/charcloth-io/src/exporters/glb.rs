//! The container of .glb files: a text that describes numbers, and the numbers.
//!
//! The text stands before the numbers but is complete only after them, so the numbers wait in a file of their own and
//! memory does not grow with them.

use crate::error::IoError;
use crate::files::{Durability, PARTIAL, write_streamed};
use glam::Vec3;
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The lengths in a .glb have 32 bits; some room is left for the text.
const MOST_BYTES: u64 = 0xf000_0000;

/// Types of number, by their numbers in OpenGL.
#[derive(Debug, Clone, Copy)]
pub(super) enum Component {
    UnsignedShort = 5123,
    UnsignedInt = 5125,
    Float = 5126,
}

/// What numbers are for, by their numbers in OpenGL.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// Attributes of vertices.
    Vertices = 34962,
    /// Vertices of faces.
    Faces = 34963,
    /// Keys of an animation, which have no number.
    Keys = 0,
}

/// A .glb that is being written.
#[derive(Debug)]
pub(super) struct Glb {
    path: PathBuf,
    waiting: PathBuf,
    out: BufWriter<File>,
    size: u64,
    views: Vec<Value>,
    /// What has been said about the numbers so far; `min` and `max` may be added.
    pub accessors: Vec<Value>,
}

impl Glb {
    /// Begins a file.
    pub fn begin(path: &Path) -> Result<Self, IoError> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(".numbers");
        name.push(PARTIAL);
        let waiting = path.with_file_name(name);
        let file = File::create(&waiting).map_err(|error| IoError::system("write", path, &error))?;
        let out = BufWriter::with_capacity(1 << 18, file);
        Ok(Self { path: path.to_path_buf(), waiting, out, size: 0, views: Vec::new(), accessors: Vec::new() })
    }

    /// Adds numbers, `count` of a type such as "VEC3", and says which accessor has them.
    pub fn add(
        &mut self,
        bytes: &[u8],
        target: Target,
        component: Component,
        count: usize,
        kind: &str,
    ) -> Result<usize, IoError> {
        if self.size + bytes.len() as u64 > MOST_BYTES {
            let hint = "export fewer frames with --frames, or a format for large runs such as usd";
            return Err(IoError::content(&self.path, "it would be larger than a .glb can be", hint));
        }
        self.out.write_all(bytes).map_err(|error| IoError::system("write", &self.path, &error))?;
        let mut view = json!({ "buffer": 0, "byteOffset": self.size, "byteLength": bytes.len() });
        if target != Target::Keys {
            view["target"] = json!(target as u32);
        }
        self.size += bytes.len() as u64;
        self.views.push(view);
        let view = self.views.len() - 1;
        let component = component as u32;
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        Ok(self.accessors.len() - 1)
    }

    /// Adds places of vertices, with the box around them.
    pub fn add_positions(&mut self, positions: &[Vec3]) -> Result<usize, IoError> {
        let numbers = floats(positions.iter().flat_map(|p| p.to_array()));
        let position = self.add(&numbers, Target::Vertices, Component::Float, positions.len(), "VEC3")?;
        let (low, high) =
            positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        self.accessors[position]["min"] = json!(low.to_array());
        self.accessors[position]["max"] = json!(high.to_array());
        Ok(position)
    }

    /// Writes the file: a head, the text with what has been said about the numbers, the numbers.
    pub fn finish(mut self, mut text: Value) -> Result<(), IoError> {
        self.out.flush().map_err(|error| IoError::system("write", &self.path, &error))?;
        text["asset"] = json!({ "version": "2.0", "generator": format!("Charcloth {}", env!("CARGO_PKG_VERSION")) });
        text["accessors"] = json!(std::mem::take(&mut self.accessors));
        text["bufferViews"] = json!(std::mem::take(&mut self.views));
        text["buffers"] = json!([{ "byteLength": self.size }]);
        let mut text = text.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut numbers = File::open(&self.waiting).map_err(|error| IoError::system("read", &self.waiting, &error))?;
        write_streamed(&self.path, Durability::Process, |out| {
            let total = 12 + 8 + text.len() as u64 + 8 + self.size;
            let total = u32::try_from(total).map_err(|_| io::Error::other("it is larger than a .glb can be"))?;
            out.write_all(b"glTF\x02\0\0\0")?;
            out.write_all(&total.to_le_bytes())?;
            out.write_all(&(text.len() as u32).to_le_bytes())?;
            out.write_all(b"JSON")?;
            out.write_all(&text)?;
            out.write_all(&(self.size as u32).to_le_bytes())?;
            out.write_all(b"BIN\0")?;
            io::copy(&mut numbers, out)?;
            Ok(())
        })
    }
}

impl Drop for Glb {
    fn drop(&mut self) {
        // Whether it can be removed does not matter: nothing reads it.
        let _ = fs::remove_file(&self.waiting);
    }
}

/// Bytes of single-precision numbers.
pub(super) fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_le_bytes).collect()
}

/// A quarter turn about x, from z-up to the y-up of glTF.
pub(super) fn z_up_rotation() -> Value {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    json!([-half, 0.0, 0.0, half])
}

/// The material that shows the colours of the vertices.
pub(super) fn paper() -> Value {
    json!({
        "name": "paper",
        "doubleSided": true,
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 },
    })
}
