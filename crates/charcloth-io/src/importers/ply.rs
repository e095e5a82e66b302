//! Stanford PLY, ASCII and both binary orders: any polygons, texture coordinates by point or corner, colours, and every
//! further floating-point number of a point as a painted attribute.

use super::raw::RawMesh;
use crate::error::IoError;
use crate::files::read_whole;
use glam::{DVec3, Vec2};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};
use std::path::Path;

/// One point: its numbers in the order of the header.
struct Numbers(Vec<f64>);

/// One face: its corners, and their texture coordinates where the file has them by corner.
#[derive(Default)]
struct Polygon {
    corners: Vec<i64>,
    uv: Vec<f64>,
}

/// An element that is read over.
struct Skipped;

impl PropertyAccess for Numbers {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, _name: &str, property: Property) -> PropertyAccessResult {
        // Lists hold the place, so that the order stays that of the header.
        self.0.push(scalar(&property).unwrap_or(0.0));
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Polygon {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "vertex_indices" | "vertex_index" => self.corners = list(&property).iter().map(|v| *v as i64).collect(),
            "texcoord" => self.uv = list(&property),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

/// Reads the faces of a PLY file.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let bytes = read_whole(path)?;
    if bytes.is_empty() {
        return Err(IoError::content(path, "the file is empty", "export the mesh again"));
    }
    let damaged = |error: ParseError| {
        // The line is said before, and what stands below the first one is for programmers.
        let words = error.to_string();
        let words = words.lines().next().unwrap_or_default();
        let words = words.split_once(": ").filter(|(at, _)| at.starts_with("Line ")).map_or(words, |(_, rest)| rest);
        IoError::Content {
            path: path.to_path_buf(),
            line: error.line(),
            problem: format!("not a sound PLY file ({})", words.trim_end_matches('.')),
            hint: "it may be cut short; export it again".to_string(),
        }
    };
    let mut reader = Reader::new(bytes.as_slice());
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(damaged)?;
    let mut points = Vec::new();
    let mut faces = Vec::new();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                points = Parser::<Numbers>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(damaged)?;
            }
            "face" => {
                faces = Parser::<Polygon>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(damaged)?;
            }
            _ => {
                Parser::<Skipped>::new().read_payload_for_element(&mut reader, element, &header).map_err(damaged)?;
            }
        }
    }
    if faces.is_empty() && header.elements.contains_key("tristrips") {
        return Err(IoError::content(path, "it has triangle strips, which are not read", "export it with plain faces"));
    }
    let Some(vertex) = header.elements.get("vertex") else {
        return Err(IoError::content(path, "it has no element \"vertex\"", "export the mesh again as PLY"));
    };
    assemble(vertex, &points, &faces, path)
}

fn assemble(vertex: &ElementDef, points: &[Numbers], faces: &[Polygon], path: &Path) -> Result<RawMesh, IoError> {
    let names: Vec<&str> = vertex.properties.values().map(|p| p.name.as_str()).collect();
    let place = |name: &str| names.iter().position(|n| *n == name);
    let columns = |wanted: &[&str]| wanted.iter().map(|name| place(name)).collect::<Option<Vec<usize>>>();
    let Some(xyz) = columns(&["x", "y", "z"]) else {
        return Err(IoError::content(path, "its points have no x, y and z", "export the mesh again as PLY"));
    };
    let number = |point: &Numbers, column: usize| point.0.get(column).copied().unwrap_or(f64::NAN);
    let mut mesh = RawMesh {
        positions: points.iter().map(|p| DVec3::new(number(p, xyz[0]), number(p, xyz[1]), number(p, xyz[2]))).collect(),
        ..RawMesh::default()
    };
    for (k, face) in faces.iter().enumerate() {
        for corner in &face.corners {
            let corner = u32::try_from(*corner).map_err(|_| {
                let problem = format!("face {k} names point {corner}, but there are {} points", points.len());
                IoError::content(path, problem, "the file is damaged; export it again")
            })?;
            mesh.corners.push(corner);
        }
        mesh.face_ends.push(mesh.corners.len());
    }

    let uv_names = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
    let uv = uv_names.iter().find_map(|names| columns(names));
    if !faces.is_empty() && faces.iter().all(|f| f.uv.len() == 2 * f.corners.len()) {
        mesh.corner_uv =
            faces.iter().flat_map(|f| f.uv.chunks_exact(2)).map(|c| Vec2::new(c[0] as f32, c[1] as f32)).collect();
    } else if let Some(uv) = &uv {
        let at = |i: &u32| {
            points.get(*i as usize).map_or(Vec2::ZERO, |p| Vec2::new(number(p, uv[0]) as f32, number(p, uv[1]) as f32))
        };
        mesh.corner_uv = mesh.corners.iter().map(at).collect();
    }

    let color_names = [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];
    let color = color_names.iter().find_map(|names| columns(names));
    if let Some(color) = &color {
        let full = vertex.properties.values().nth(color[0]).map_or(1.0, |p| full_scale(&p.data_type));
        let colors: Vec<[f32; 3]> =
            points.iter().map(|p| std::array::from_fn(|k| (number(p, color[k]) / full) as f32)).collect();
        mesh.paint_colors(&colors);
    }
    let taken = [xyz, uv.unwrap_or_default(), color.unwrap_or_default()].concat();
    for (column, property) in vertex.properties.values().enumerate() {
        let is_normal = ["nx", "ny", "nz"].contains(&property.name.as_str());
        let is_float = matches!(property.data_type, PropertyType::Scalar(ScalarType::Float | ScalarType::Double));
        if property.name == "alpha" {
            let full = full_scale(&property.data_type);
            let alpha = points.iter().map(|p| (number(p, column) / full) as f32).collect();
            mesh.painted.insert("color.a".to_string(), alpha);
        } else if is_float && !is_normal && !taken.contains(&column) {
            let values = points.iter().map(|p| number(p, column) as f32).collect();
            mesh.painted.insert(property.name.clone(), values);
        }
    }
    Ok(mesh)
}

/// The number that stands for 1 in a colour of this type.
fn full_scale(kind: &PropertyType) -> f64 {
    match kind {
        PropertyType::Scalar(ScalarType::Float | ScalarType::Double) => 1.0,
        PropertyType::Scalar(ScalarType::UShort | ScalarType::Short) => 65535.0,
        _ => 255.0,
    }
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match property {
        Property::Char(v) => f64::from(*v),
        Property::UChar(v) => f64::from(*v),
        Property::Short(v) => f64::from(*v),
        Property::UShort(v) => f64::from(*v),
        Property::Int(v) => f64::from(*v),
        Property::UInt(v) => f64::from(*v),
        Property::Float(v) => f64::from(*v),
        Property::Double(v) => *v,
        _ => return None,
    })
}

/// The numbers of a list; whole numbers of up to 32 bits are exact in `f64`.
fn list(property: &Property) -> Vec<f64> {
    match property {
        Property::ListChar(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListUChar(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListShort(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListUShort(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListInt(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListUInt(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListFloat(v) => v.iter().map(|x| f64::from(*x)).collect(),
        Property::ListDouble(v) => v.clone(),
        _ => Vec::new(),
    }
}
