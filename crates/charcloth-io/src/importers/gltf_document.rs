//! The description inside a glTF file, as far as a surface needs it, and the two-part container `.glb`.
//!
//! Every number in it that names something is checked when it is followed, never before.

use glam::{DMat4, DQuat, DVec3};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The mark of a `.glb`, and of its two parts.
const CONTAINER: &[u8] = b"glTF";
const JSON: [u8; 4] = *b"JSON";
const BINARY: [u8; 4] = *b"BIN\0";

/// Extensions that a file may require and that change nothing of its surface, by what they begin with. Quantised
/// positions are plain numbers of another type.
const HARMLESS: [&str; 5] = ["KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_mesh_quantization", "EXT_texture_"];

/// The description.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document {
    pub asset: Asset,
    pub scene: Option<usize>,
    pub scenes: Vec<Scene>,
    pub nodes: Vec<Node>,
    pub meshes: Vec<Mesh>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<BufferView>,
    pub buffers: Vec<Buffer>,
    pub extensions_required: Vec<String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    pub version: String,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    /// 4 triangles, 5 a strip, 6 a fan; below that points and lines.
    #[serde(default = "triangles")]
    pub mode: u32,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<serde::de::IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

impl Document {
    /// Reads the description of a `.gltf` or `.glb`, told apart by their content, and the binary part of the latter.
    pub fn read(bytes: &[u8]) -> Result<(Self, Option<Vec<u8>>), String> {
        let (json, binary) = if bytes.starts_with(CONTAINER) { parts(bytes)? } else { (bytes, None) };
        let document: Self = serde_json::from_slice(json).map_err(|error| error.to_string())?;
        if !document.asset.version.starts_with("2.") {
            return Err(format!("it is of version \"{}\", only 2 is read", document.asset.version));
        }
        let is_harmless = |name: &String| HARMLESS.iter().any(|harmless| name.starts_with(harmless));
        if let Some(name) = document.extensions_required.iter().find(|name| !is_harmless(name)) {
            return Err(format!("it requires the extension {name}, which is not read"));
        }
        let count = document.accessors.len();
        let mut accessors = document.meshes.iter().flat_map(|m| &m.primitives).flat_map(|p| p.attributes.values());
        if let Some(bad) = accessors.find(|index| **index >= count) {
            return Err(format!("a mesh names accessor {bad}, but there are {count}"));
        }
        Ok((document, binary.map(<[u8]>::to_vec)))
    }
}

/// The parts of a container (glTF 2.0, section 4.4).
fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if word(4) != Some(2) {
        return Err("its container is not of version 2".to_owned());
    }
    let mut found = [None, None];
    let mut at = 12;
    while let Some(length) = word(at) {
        let start = at + 8;
        let end = start.checked_add(length as usize).filter(|end| *end <= bytes.len());
        let end = end.ok_or("a part of it reaches beyond its end")?;
        for (part, mark) in found.iter_mut().zip([JSON, BINARY]) {
            if bytes[at + 4..start] == mark && part.is_none() {
                *part = Some(&bytes[start..end]);
            }
        }
        at = end;
    }
    let [json, binary] = found;
    Ok((json.ok_or("it has no description")?, binary))
}

impl Node {
    /// Where the node is put, seen from its parent (glTF 2.0, section 3.5.3).
    pub fn place(&self) -> DMat4 {
        match &self.matrix {
            Some(columns) => DMat4::from_cols_array(columns),
            None => DMat4::from_scale_rotation_translation(
                self.scale.map_or(DVec3::ONE, DVec3::from_array),
                self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array),
                self.translation.map_or(DVec3::ZERO, DVec3::from_array),
            ),
        }
    }
}

/// Types of numbers, by the words of OpenGL that the format uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Accessor {
    /// Type of the numbers, if it is one of those there are.
    pub fn kind(&self) -> Option<Kind> {
        let kinds = [Kind::I8, Kind::U8, Kind::I16, Kind::U16];
        match self.component_type {
            5125 => Some(Kind::U32),
            5126 => Some(Kind::F32),
            other => kinds.get(other.checked_sub(5120)? as usize).copied(),
        }
    }

    /// Numbers in a row; 0 for what is not a row of numbers.
    pub fn width(&self) -> usize {
        match self.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 0,
        }
    }
}

impl Kind {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}
