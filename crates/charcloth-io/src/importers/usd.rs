//! OpenUSD: .usdc, .usda, either of them as .usd, and packages (.usdz): the one mesh of a file, where its prims put it.
//!
//! Read by a few hundred lines of our own: the library at hand does not declare this compiler, changes its interface with
//! each release, and has no way to bound what a damaged file makes it do. Values without a time count, else the earliest
//! sample. What a file takes from others (references, payloads, variants) is not followed.

use super::raw::RawMesh;
use super::usd_layer::{Attribute, Layer, Prim, Value};
use super::{usd_crate, usd_text};
use crate::error::IoError;
use crate::files::read_whole;
use glam::{DMat4, DQuat, DVec3, Vec2};
use std::collections::BTreeSet;
use std::io::{Cursor, Read};
use std::path::Path;

/// Largest layer in a package [bytes].
const MOST_BYTES: u64 = 1 << 32;
/// What a length is where a file does not say [m].
const FALLBACK_UNIT: f64 = 0.01;
const AGAIN: &str = "export the mesh again as USD";

/// Reads the mesh of a USD file in metres, y up.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let bytes = read_whole(path)?;
    let failed = |problem: String| IoError::content(path, problem, AGAIN);
    let bytes = if bytes.starts_with(b"PK") { unpack(bytes).map_err(failed)? } else { bytes };
    let layer = if bytes.starts_with(usd_crate::MARK) {
        usd_crate::read(&bytes).map_err(|problem| failed(format!("not a sound .usdc file: {problem}")))?
    } else if bytes.starts_with(usd_text::MARK) {
        usd_text::read(&String::from_utf8_lossy(&bytes)).map_err(|(line, problem)| {
            IoError::at_line(path, line, format!("not a sound .usda file: {problem}"), AGAIN)
        })?
    } else {
        return Err(failed("not a USD file: it begins like neither a .usdc, a .usda nor a .usdz".to_string()));
    };
    let mesh = one_mesh(&layer).map_err(|(problem, hint)| IoError::content(path, problem, hint))?;
    raw_mesh(&layer, mesh).map_err(|problem| IoError::content(path, format!("{}: {problem}", mesh.path), AGAIN))
}

/// The first layer of a package.
fn unpack(bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let damaged = |error: &dyn std::fmt::Display| format!("not a sound .usdz package ({error})");
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    for k in 0..zip.len() {
        let file = zip.by_index(k).map_err(|error| damaged(&error))?;
        let is_layer = file.name().is_ok_and(|name| [".usd", ".usda", ".usdc"].iter().any(|end| name.ends_with(end)));
        if is_layer {
            let mut layer = Vec::new();
            file.take(MOST_BYTES).read_to_end(&mut layer).map_err(|error| damaged(&error))?;
            return Ok(layer);
        }
    }
    Err("the package has no USD file in it".to_string())
}

/// The mesh of a file; the error has a hint.
fn one_mesh(layer: &Layer) -> Result<&Prim, (String, String)> {
    let is_hidden = |prim: &Prim| {
        let visibility = prim.attributes.get("visibility").and_then(|a| a.value.as_ref()?.text());
        !prim.is_defined || visibility == Some("invisible")
    };
    let hidden: BTreeSet<&str> =
        layer.prims.iter().filter(|prim| is_hidden(prim)).map(|prim| prim.path.as_str()).collect();
    let is_shown = |prim: &Prim| !hidden.contains("/") && !with_parents(&prim.path).any(|path| hidden.contains(path));
    let meshes: Vec<&Prim> = layer.prims.iter().filter(|prim| prim.type_name == "Mesh" && is_shown(prim)).collect();
    match meshes.as_slice() {
        [mesh] => Ok(mesh),
        [] => {
            let elsewhere = layer.prims.iter().find(|prim| !prim.taken.is_empty());
            Err(match elsewhere {
                Some(prim) => {
                    let problem =
                        format!("it has no mesh of its own: {} takes {} from elsewhere", prim.path, prim.taken);
                    (problem, "flatten it into one file (usdcat --flatten -o flat.usdc)".to_string())
                }
                None => {
                    ("it has no mesh that is shown".to_string(), "export it with its geometry selected".to_string())
                }
            })
        }
        several => {
            const MOST: usize = 8;
            let names: Vec<&str> = several.iter().take(MOST).map(|prim| prim.path.as_str()).collect();
            let more = if several.len() > MOST { ", and more" } else { "" };
            let problem = format!("it has {} meshes, and one sheet is read: {}{more}", several.len(), names.join(", "));
            Err((problem, "export one of them, or join them".to_string()))
        }
    }
}

/// A path and those above it, less the root.
fn with_parents(path: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(path), |path| path.rsplit_once('/').map(|(above, _)| above))
        .filter(|path| !path.is_empty())
}

fn raw_mesh(layer: &Layer, prim: &Prim) -> Result<RawMesh, String> {
    let mut mesh = RawMesh::default();
    let numbers = |name: &str| {
        let value = prim.attributes.get(name).and_then(|attribute| attribute.value.as_ref());
        value.and_then(Value::numbers).unwrap_or_default()
    };
    let unit = layer.metadata.get("metersPerUnit").and_then(|value| value.numbers()?.first().copied());
    let unit = match unit {
        Some(unit) if unit > 0.0 && unit.is_finite() => unit,
        Some(unit) => return Err(format!("metersPerUnit is {unit}")),
        None => {
            mesh.remarks
                .push(format!("the file does not say its metersPerUnit: taken as {FALLBACK_UNIT}, as USD has it"));
            FALLBACK_UNIT
        }
    };
    let is_z_up = layer.metadata.get("upAxis").and_then(Value::text) == Some("Z");
    if is_z_up {
        mesh.remarks.push("the file is z-up and was turned to y-up".to_string());
    }
    let place = placement(layer, prim)?;
    for point in numbers("points").chunks(3) {
        let [x, y, z] = *point else { return Err("its points are not in threes".to_string()) };
        let point = place.transform_point3(DVec3::new(x, y, z)) * unit;
        mesh.positions.push(if is_z_up { DVec3::new(point.x, point.z, -point.y) } else { point });
    }
    let indices = numbers("faceVertexIndices");
    let index = |number: f64| if number >= 0.0 { number as u32 } else { u32::MAX };
    mesh.corners = indices.iter().map(|number| index(*number)).collect();
    let mut end = 0usize;
    for count in numbers("faceVertexCounts") {
        if *count < 3.0 {
            return Err(format!("face {} has {count} corners instead of 3 or more", mesh.face_ends.len()));
        }
        end += *count as usize;
        mesh.face_ends.push(end);
    }
    if end != mesh.corners.len() {
        return Err(format!("its faces count {end} corners, but there are {}", mesh.corners.len()));
    }
    if let Some((name, attribute)) = texture_coordinates(prim) {
        match corner_uv(prim, name, attribute, &mesh) {
            Ok(uv) => mesh.corner_uv = uv,
            Err(problem) => mesh.remarks.push(format!("its texture coordinates {name} were left out: {problem}")),
        }
    }
    paint(prim, &mut mesh);
    if prim.attributes.get("points").is_some_and(|points| points.is_animated) {
        mesh.remarks.push("the mesh is animated: its first time sample was taken".to_string());
    }
    let scheme = prim.attributes.get("subdivisionScheme").and_then(|a| a.value.as_ref()?.text());
    if let Some(scheme) = scheme.filter(|scheme| *scheme != "none") {
        mesh.remarks.push(format!("it is a subdivision surface ({scheme}): its cage is what burns"));
    }
    let is_left_handed =
        prim.attributes.get("orientation").and_then(|a| a.value.as_ref()?.text()) == Some("leftHanded");
    // A mirror turns faces over as well.
    if is_left_handed != (place.determinant() < 0.0) {
        let faces: Vec<_> = mesh.faces().collect();
        for face in faces {
            mesh.corners[face.clone()].reverse();
            if !mesh.corner_uv.is_empty() {
                mesh.corner_uv[face].reverse();
            }
        }
    }
    Ok(mesh)
}

/// `primvars:st`, or else the first that has the type of texture coordinates.
fn texture_coordinates(prim: &Prim) -> Option<(&str, &Attribute)> {
    let named = prim.attributes.get_key_value("primvars:st");
    let typed =
        || prim.attributes.iter().find(|(name, a)| name.starts_with("primvars:") && a.type_name == "texCoord2f[]");
    named.or_else(typed).map(|(name, attribute)| (name.as_str(), attribute))
}

fn corner_uv(prim: &Prim, name: &str, attribute: &Attribute, mesh: &RawMesh) -> Result<Vec<Vec2>, String> {
    let numbers = attribute.value.as_ref().and_then(Value::numbers).ok_or("they have no value")?;
    let uv: Vec<Vec2> = numbers.chunks_exact(2).map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32)).collect();
    let indices = prim.attributes.get(&format!("{name}:indices")).and_then(|a| a.value.as_ref()?.numbers());
    let row = |k: usize| -> Result<Vec2, String> {
        let row = match indices {
            Some(indices) => indices.get(k).map(|row| *row as usize).ok_or("there are too few indices")?,
            None => k,
        };
        uv.get(row).copied().ok_or(format!("there is no row {row}"))
    };
    match attribute.interpolation.as_str() {
        "faceVarying" => (0..mesh.corners.len()).map(row).collect(),
        "vertex" | "varying" => mesh.corners.iter().map(|i| row(*i as usize)).collect(),
        other => Err(format!("they are spread as \"{other}\"")),
    }
}

/// Numbers and colours by point.
fn paint(prim: &Prim, mesh: &mut RawMesh) {
    for (name, attribute) in &prim.attributes {
        let Some(short) = name.strip_prefix("primvars:").filter(|name| !name.contains(':')) else { continue };
        let by_point = ["vertex", "varying"].contains(&attribute.interpolation.as_str());
        let is_indexed = prim.attributes.contains_key(&format!("{name}:indices"));
        let Some(Value::Numbers(numbers)) = attribute.value.as_ref().filter(|_| by_point && !is_indexed) else {
            continue;
        };
        match attribute.type_name.as_str() {
            "float[]" | "double[]" | "half[]" if numbers.len() == mesh.positions.len() => {
                mesh.painted.insert(short.to_string(), numbers.iter().map(|v| *v as f32).collect());
            }
            // Files have one colour as a rule; of several, that to be shown counts.
            "color3f[]" | "color4f[]" if short == "displayColor" || !mesh.painted.contains_key("color") => {
                let width = if attribute.type_name == "color4f[]" { 4 } else { 3 };
                let colors: Vec<[f32; 3]> =
                    numbers.chunks_exact(width).map(|c| [0, 1, 2].map(|k| c[k] as f32)).collect();
                if colors.len() == mesh.positions.len() {
                    mesh.paint_colors(&colors);
                }
            }
            _ => {}
        }
    }
}

/// Where the prims above a mesh and its own operations put it.
fn placement(layer: &Layer, mesh: &Prim) -> Result<DMat4, String> {
    let mut place = DMat4::IDENTITY;
    // Parents stand before children.
    for prim in &layer.prims {
        if prim.path != mesh.path && !mesh.path.starts_with(&format!("{}/", prim.path)) {
            continue;
        }
        let Some(Value::Texts(order)) = prim.attributes.get("xformOpOrder").and_then(|a| a.value.as_ref()) else {
            continue;
        };
        for name in order {
            if name == "!resetXformStack!" {
                place = DMat4::IDENTITY;
                continue;
            }
            let (inverse, plain) = name.strip_prefix("!invert!").map_or((false, name.as_str()), |plain| (true, plain));
            let value = prim.attributes.get(plain).and_then(|a| a.value.as_ref()?.numbers());
            let value = value.ok_or(format!("{} has no value at {}", plain, prim.path))?;
            let operation = operation(plain, value).ok_or(format!("{plain} at {} is not understood", prim.path))?;
            place *= if inverse { operation.inverse() } else { operation };
        }
    }
    if place.is_finite() { Ok(place) } else { Err("it is put at no finite place".to_string()) }
}

/// The matrix of an operation, for columns.
fn operation(name: &str, value: &[f64]) -> Option<DMat4> {
    let kind = name.strip_prefix("xformOp:")?.split(':').next()?;
    let about = |axis: char, degrees: f64| match axis {
        'X' => DMat4::from_rotation_x(degrees.to_radians()),
        'Y' => DMat4::from_rotation_y(degrees.to_radians()),
        _ => DMat4::from_rotation_z(degrees.to_radians()),
    };
    match (kind, value) {
        ("translate", [x, y, z]) => Some(DMat4::from_translation(DVec3::new(*x, *y, *z))),
        ("scale", [x, y, z]) => Some(DMat4::from_scale(DVec3::new(*x, *y, *z))),
        // Imaginary parts first.
        ("orient", [x, y, z, w]) => Some(DMat4::from_quat(DQuat::from_xyzw(*x, *y, *z, *w).normalize())),
        // Rows there, columns here.
        ("transform", rows) => rows.try_into().ok().map(|rows: &[f64; 16]| DMat4::from_cols_array(rows)),
        _ => {
            let axes = kind.strip_prefix("rotate")?;
            let sound = axes.len() == value.len() && axes.chars().all(|axis| "XYZ".contains(axis));
            // The first axis is turned about first; the three angles stand as x, y, z.
            let angle =
                |k: usize, axis: char| if value.len() == 3 { value["XYZ".find(axis).unwrap_or(k)] } else { value[k] };
            let turns = axes.chars().enumerate().map(|(k, axis)| about(axis, angle(k, axis)));
            sound.then(|| turns.fold(DMat4::IDENTITY, |before, turn| turn * before))
        }
    }
}
