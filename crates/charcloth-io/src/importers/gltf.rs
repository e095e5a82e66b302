//! glTF 2.0, `.gltf` with its buffers beside it or inside, and `.glb`: the meshes of the default scene, put where its
//! nodes say. Pictures and materials are not read.

use super::gltf_document::{Accessor, Buffer, Document, Kind, Node, Primitive};
use super::raw::RawMesh;
use crate::error::IoError;
use crate::files::read_whole;
use glam::{DMat4, DVec3, Vec2};
use std::path::Path;

/// Kinds of mesh, by number; those below are points and lines.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// What is known of a file while its nodes are walked.
struct Walk<'a> {
    path: &'a Path,
    document: &'a Document,
    buffers: Vec<Vec<u8>>,
    mesh: RawMesh,
    colors: Vec<[f32; 3]>,
    has_colors: bool,
    has_uv: bool,
    skipped: usize,
    skins: usize,
}

/// Reads the faces of a glTF file.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let bytes = read_whole(path)?;
    if bytes.is_empty() {
        return Err(IoError::content(path, "the file is empty", "export the mesh again"));
    }
    let (document, binary) = Document::read(&bytes).map_err(|problem| {
        let hint = "it may be cut short, or use compression: export it again without";
        IoError::content(path, format!("not a sound glTF file ({problem})"), hint)
    })?;
    let buffers = read_buffers(&document.buffers, binary, path)?;
    let mut walk = Walk {
        path,
        document: &document,
        buffers,
        mesh: RawMesh::default(),
        colors: Vec::new(),
        has_colors: false,
        has_uv: false,
        skipped: 0,
        skins: 0,
    };
    let Some(scene) = document.scenes.get(document.scene.unwrap_or(0)) else {
        return Err(IoError::content(path, "it has no scene", "export it with the objects in a scene"));
    };
    // A stack of our own, for nodes may be nested as deep as they like; each may stand in the scene only once.
    let mut visited = vec![false; document.nodes.len()];
    let mut waiting: Vec<(usize, DMat4)> = scene.nodes.iter().map(|node| (*node, DMat4::IDENTITY)).collect();
    waiting.reverse();
    while let Some((number, parent)) = waiting.pop() {
        let Some(node) = document.nodes.get(number) else {
            return Err(walk.error(format!("there is no node {number}")));
        };
        if std::mem::replace(&mut visited[number], true) {
            return Err(walk.error(format!("node {number} has two parents")));
        }
        let place = walk.node(node, parent)?;
        let children = waiting.len();
        waiting.extend(node.children.iter().map(|child| (*child, place)));
        waiting[children..].reverse();
    }
    Ok(walk.finish())
}

impl Walk<'_> {
    fn error(&self, problem: impl Into<String>) -> IoError {
        IoError::content(self.path, problem, "the file is damaged or made in an unusual way; export it again")
    }

    /// Reads the meshes of a node and says where the node is.
    fn node(&mut self, node: &Node, parent: DMat4) -> Result<DMat4, IoError> {
        let place = parent * node.place();
        if let Some(number) = node.mesh {
            self.skins += usize::from(node.skin.is_some());
            let document = self.document;
            let mesh = document.meshes.get(number).ok_or_else(|| self.error(format!("there is no mesh {number}")))?;
            for primitive in &mesh.primitives {
                self.primitive(primitive, place)?;
            }
        }
        Ok(place)
    }

    fn accessor(&self, number: usize) -> Result<&Accessor, IoError> {
        let accessor = self.document.accessors.get(number);
        accessor.ok_or_else(|| self.error(format!("a mesh names accessor {number}, which is not there")))
    }

    fn primitive(&mut self, primitive: &Primitive, place: DMat4) -> Result<(), IoError> {
        let mode = primitive.mode;
        if mode < TRIANGLES {
            self.skipped += 1;
            return Ok(());
        }
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let Some(accessor) = attribute("POSITION") else {
            return Err(self.error("a mesh has no positions"));
        };
        let positions = self.numbers(accessor, 3)?;
        let first = self.mesh.positions.len() as u32;
        let count = positions.len() / 3;
        self.mesh
            .positions
            .extend(positions.chunks_exact(3).map(|p| place.transform_point3(DVec3::new(p[0], p[1], p[2]))));

        let uv: Vec<Vec2> = match attribute("TEXCOORD_0") {
            // glTF counts v from the top of the picture, everything else here from the bottom.
            Some(accessor) => {
                self.has_uv = true;
                let numbers = self.numbers(accessor, 2)?;
                numbers.chunks_exact(2).map(|c| Vec2::new(c[0] as f32, 1.0 - c[1] as f32)).collect()
            }
            None => vec![Vec2::ZERO; count],
        };
        if let Some(accessor) = attribute("COLOR_0") {
            self.has_colors = true;
            let width = self.accessor(accessor)?.width();
            if !(3..=4).contains(&width) {
                return Err(self.error("a mesh has colours of neither three nor four numbers"));
            }
            let numbers = self.numbers(accessor, width)?;
            self.colors.extend(numbers.chunks_exact(width).map(|c| [c[0] as f32, c[1] as f32, c[2] as f32]));
        }
        // A mesh without colours among coloured ones counts as unpainted.
        self.colors.resize(self.mesh.positions.len(), [0.0; 3]);
        self.painted(primitive, first as usize)?;
        if uv.len() != count || self.mesh.positions.len() != self.colors.len() {
            return Err(self.error("a mesh has attributes of different lengths"));
        }

        let indices: Vec<u32> = match primitive.indices {
            Some(accessor) => self.numbers(accessor, 1)?.iter().map(|i| *i as u32).collect(),
            None => (0..count as u32).collect(),
        };
        if let Some(bad) = indices.iter().find(|i| **i as usize >= count) {
            return Err(self.error(format!("a mesh names point {bad}, but it has {count} points")));
        }
        let mut triangles: Vec<[u32; 3]> = match mode {
            TRIANGLES => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            STRIP => {
                let turned = |(k, c): (usize, &[u32])| if k % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] };
                indices.windows(3).enumerate().map(turned).collect()
            }
            FAN => indices.windows(2).skip(1).map(|c| [indices[0], c[0], c[1]]).collect(),
            other => return Err(self.error(format!("a mesh is of the unknown kind {other}"))),
        };
        // A mirroring node turns its faces over (glTF 2.0, section 3.7.4).
        if place.determinant() < 0.0 {
            triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        for corner in triangles.iter().flatten() {
            self.mesh.corners.push(first + corner);
            self.mesh.corner_uv.push(uv[*corner as usize]);
        }
        for k in 0..triangles.len() {
            self.mesh.face_ends.push(self.mesh.corners.len() - 3 * (triangles.len() - 1 - k));
        }
        Ok(())
    }

    /// Custom attributes of one number a point, such as a painted weight: `_IGNITE` is painted as `ignite`.
    fn painted(&mut self, primitive: &Primitive, first: usize) -> Result<(), IoError> {
        for (name, accessor) in &primitive.attributes {
            if let Some(name) = name.strip_prefix('_')
                && self.accessor(*accessor)?.width() == 1
            {
                let numbers = self.numbers(*accessor, 1)?;
                let values = self.mesh.painted.entry(name.to_lowercase()).or_default();
                values.resize(first, 0.0);
                values.extend(numbers.iter().map(|v| *v as f32));
            }
        }
        let count = self.mesh.positions.len();
        self.mesh.painted.values_mut().for_each(|values| values.resize(count, 0.0));
        Ok(())
    }

    /// The numbers of an accessor, rows one after the other; every offset is checked against the buffer.
    fn numbers(&self, index: usize, width: usize) -> Result<Vec<f64>, IoError> {
        let accessor = self.accessor(index)?;
        if accessor.width() != width {
            return Err(self.error(format!("accessor {index} does not have {width} numbers a row")));
        }
        if accessor.sparse.is_some() {
            let hint = "export it without sparse accessors (shape keys applied)";
            return Err(IoError::content(self.path, "it uses sparse accessors, which are not read", hint));
        }
        let view = accessor.buffer_view.and_then(|view| self.document.buffer_views.get(view));
        let Some((view, kind)) = view.zip(accessor.kind()) else {
            return Err(self.error(format!("accessor {index} has no data")));
        };
        let outside = || self.error(format!("accessor {index} reaches beyond its buffer"));
        let view_end = view.byte_offset.checked_add(view.byte_length).ok_or_else(outside)?;
        let data = self.buffers.get(view.buffer).and_then(|buffer| buffer.get(view.byte_offset..view_end));
        let data = data.ok_or_else(outside)?;
        let (size, row) = (kind.size(), kind.size() * width);
        // Rows that all lie in one place would go on for ever.
        let stride = view.byte_stride.filter(|stride| *stride > 0).unwrap_or(row);
        let mut numbers = Vec::with_capacity(accessor.count.min(data.len()) * width);
        for k in 0..accessor.count {
            let start = stride.checked_mul(k).and_then(|s| s.checked_add(accessor.byte_offset)).ok_or_else(outside)?;
            let bytes = start.checked_add(row).and_then(|end| data.get(start..end)).ok_or_else(outside)?;
            numbers.extend(bytes.chunks_exact(size).map(|b| number(kind, b, accessor.normalized)));
        }
        Ok(numbers)
    }

    fn finish(mut self) -> RawMesh {
        if self.has_colors {
            self.mesh.paint_colors(&self.colors);
        }
        if !self.has_uv {
            self.mesh.corner_uv.clear();
        }
        if self.skipped > 0 {
            self.mesh.remarks.push(format!("{} parts made of points or lines were left out", self.skipped));
        }
        if self.skins > 0 {
            self.mesh.remarks.push("the mesh has a skeleton; it is read in its rest pose".to_string());
        }
        self.mesh
    }
}

/// One number of an accessor; normalised whole numbers run from 0 (or -1) to 1.
fn number(kind: Kind, bytes: &[u8], normalized: bool) -> f64 {
    let (value, full): (f64, f64) = match (kind, bytes) {
        (Kind::I8, [a]) => (f64::from(i8::from_le_bytes([*a])), f64::from(i8::MAX)),
        (Kind::U8, [a]) => (f64::from(*a), f64::from(u8::MAX)),
        (Kind::I16, [a, b]) => (f64::from(i16::from_le_bytes([*a, *b])), f64::from(i16::MAX)),
        (Kind::U16, [a, b]) => (f64::from(u16::from_le_bytes([*a, *b])), f64::from(u16::MAX)),
        (Kind::U32, [a, b, c, d]) => (f64::from(u32::from_le_bytes([*a, *b, *c, *d])), f64::from(u32::MAX)),
        (Kind::F32, [a, b, c, d]) => return f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        _ => return f64::NAN, // the bytes are cut by the size of the kind
    };
    if normalized { (value / full).max(-1.0) } else { value }
}

fn read_buffers(buffers: &[Buffer], mut binary: Option<Vec<u8>>, path: &Path) -> Result<Vec<Vec<u8>>, IoError> {
    let mut all = Vec::new();
    for (number, buffer) in buffers.iter().enumerate() {
        let data = match &buffer.uri {
            Some(address) => read_address(address, path)?,
            None => binary.take().ok_or_else(|| {
                IoError::content(path, "its binary part is missing", "export it again, or as .gltf with its .bin")
            })?,
        };
        if data.len() < buffer.byte_length {
            let problem = format!("buffer {number} has {} bytes instead of {}", data.len(), buffer.byte_length);
            return Err(IoError::content(path, problem, "it is cut short; export it again"));
        }
        all.push(data);
    }
    Ok(all)
}

/// Data inside the address, or in a file beside the glTF file.
fn read_address(address: &str, path: &Path) -> Result<Vec<u8>, IoError> {
    let unsound = |what: &str| IoError::content(path, format!("a buffer {what}"), "export it again as .glb");
    if let Some(data) = address.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else {
            return Err(unsound("is written in a way other than base64"));
        };
        return decode_base64(text).ok_or_else(|| unsound("is not sound base64"));
    }
    if address.contains("://") {
        return Err(unsound(&format!("lies elsewhere ({address}), only files beside the mesh are read")));
    }
    let name = decode_percent(address).ok_or_else(|| unsound("has a name that is not sound"))?;
    read_whole(&path.parent().unwrap_or(Path::new("")).join(name))
}

/// RFC 4648, section 4.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for symbol in text.trim_end_matches('=').bytes() {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
            bits &= (1 << count) - 1;
        }
    }
    Some(bytes)
}

/// RFC 3986, section 2.1.
fn decode_percent(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, more)) = rest.split_first() {
        rest = more;
        if *first == b'%' {
            let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &rest[2..];
        } else {
            bytes.push(*first);
        }
    }
    String::from_utf8(bytes).ok()
}
