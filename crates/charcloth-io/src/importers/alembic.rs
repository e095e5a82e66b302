//! Alembic (.abc): the one mesh of a file, where its transforms put it, at its first sample.
//!
//! Alembic is y-up and names no unit. Faces run clockwise seen from outside and are turned over. Files in the older
//! container, HDF5, are not read.

use super::ogawa::{MARK, Object, Ogawa, Property, value_of};
use super::raw::RawMesh;
use crate::error::IoError;
use crate::files::read_whole;
use glam::{DMat4, DVec3, Vec2};
use std::path::Path;

const AGAIN: &str = "export the mesh again as Alembic";
/// What files in the older container begin with.
const HDF5: &[u8] = b"\x89HDF";
/// Levels of objects, more than any program makes; a damaged file may go round in circles.
const MOST_LEVELS: usize = 64;
/// Names of meshes in an error.
const MOST_NAMES: usize = 8;

/// Reads the mesh of an Alembic file in the unit of the file.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let bytes = read_whole(path)?;
    if bytes.starts_with(HDF5) {
        let problem = "it is Alembic in its older container, HDF5, which is not read";
        return Err(IoError::content(path, problem, "export it again as Ogawa, the default of today's programs"));
    }
    if !bytes.starts_with(MARK) {
        return Err(IoError::content(path, "not an Alembic file: it does not begin like one", AGAIN));
    }
    let damaged = |problem: String| IoError::content(path, format!("not a sound .abc file: {problem}"), AGAIN);
    let (file, top) = Ogawa::open(&bytes).map_err(damaged)?;
    let mut search = Search { file: &file, meshes: Vec::new(), left: bytes.len() / 16 };
    search.below(&top, DMat4::IDENTITY, 0).map_err(damaged)?;
    match search.meshes.as_slice() {
        [(mesh, place)] => raw_mesh(&file, mesh, *place)
            .map_err(|problem| IoError::content(path, format!("{}: {problem}", mesh.path), AGAIN)),
        [] => Err(IoError::content(
            path,
            "it has no mesh that is shown",
            "export it with its geometry selected, as a mesh",
        )),
        several => {
            let names: Vec<&str> = several.iter().take(MOST_NAMES).map(|(mesh, _)| mesh.path.as_str()).collect();
            let more = if several.len() > MOST_NAMES { ", and more" } else { "" };
            let problem = format!("it has {} meshes, and one sheet is read: {}{more}", several.len(), names.join(", "));
            Err(IoError::content(path, problem, "export one of them, or join them"))
        }
    }
}

/// The meshes that are shown, and where they are put.
struct Search<'a> {
    file: &'a Ogawa<'a>,
    meshes: Vec<(Object, DMat4)>,
    /// Objects that the bytes can account for.
    left: usize,
}

impl Search<'_> {
    fn below(&mut self, object: &Object, place: DMat4, level: usize) -> Result<(), String> {
        for child in self.file.children(object)? {
            if level == MOST_LEVELS || self.left == 0 {
                return Err("its objects go round in circles".to_string());
            }
            self.left -= 1;
            let properties = self.file.properties(&child)?;
            if let Some(visible) = named(&properties, "visible")
                && self.file.numbers(visible)?.first() == Some(&0.0)
            {
                continue;
            }
            let schema = value_of(&child.metadata, "schema").unwrap_or_default();
            let mut place = place;
            if schema.starts_with("AbcGeom_Xform")
                && let Some(transform) = named(&properties, ".xform")
            {
                let (own, inherits) =
                    transformation(self.file, transform).map_err(|problem| format!("{}: {problem}", child.path))?;
                place = if inherits { place * own } else { own };
            }
            if ["AbcGeom_PolyMesh", "AbcGeom_SubD"].iter().any(|mesh| schema.starts_with(mesh)) {
                self.meshes.push((child.clone(), place));
            }
            self.below(&child, place, level + 1)?;
        }
        Ok(())
    }
}

fn named<'a>(properties: &'a [Property], name: &str) -> Option<&'a Property> {
    properties.iter().find(|property| property.name == name)
}

/// The matrix of a transform, for columns, and whether those above count as well.
fn transformation(file: &Ogawa, transform: &Property) -> Result<(DMat4, bool), String> {
    let parts = file.parts(transform)?;
    let numbers = |name: &str| named(&parts, name).map_or(Ok(Vec::new()), |part| file.numbers(part));
    let inherits = numbers(".inherits")?.first() != Some(&0.0);
    let values = numbers(".vals")?;
    let mut values = values.as_slice();
    let mut place = DMat4::IDENTITY;
    for operation in numbers(".ops")? {
        // The lower half says what the operation was for.
        let kind = operation as u8 >> 4;
        let count = match kind {
            0 | 1 => 3,
            2 => 4,
            3 => 16,
            4..=6 => 1,
            _ => return Err(format!("its transform has an operation {kind} that is not understood")),
        };
        let (own, rest) = values.split_at_checked(count).ok_or("its transform has too few numbers")?;
        values = rest;
        place *= match (kind, own) {
            (0, [x, y, z]) => DMat4::from_scale(DVec3::new(*x, *y, *z)),
            (1, [x, y, z]) => DMat4::from_translation(DVec3::new(*x, *y, *z)),
            (2, [x, y, z, degrees]) => {
                let axis = DVec3::new(*x, *y, *z).try_normalize().ok_or("its transform turns about no axis")?;
                DMat4::from_axis_angle(axis, degrees.to_radians())
            }
            // Rows there, columns here.
            (3, rows) => DMat4::from_cols_slice(rows),
            (_, degrees) => DMat4::from_axis_angle(DVec3::AXES[usize::from(kind) - 4], degrees[0].to_radians()),
        };
    }
    if place.is_finite() { Ok((place, inherits)) } else { Err("it is put at no finite place".to_string()) }
}

fn raw_mesh(file: &Ogawa, object: &Object, place: DMat4) -> Result<RawMesh, String> {
    let properties = file.properties(object)?;
    let geometry = named(&properties, ".geom").ok_or("it has no geometry")?;
    let parts = file.parts(geometry)?;
    let numbers = |name: &str| named(&parts, name).map_or(Ok(Vec::new()), |part| file.numbers(part));
    let mut mesh = RawMesh::default();
    for point in numbers("P")?.chunks(3) {
        let [x, y, z] = *point else { return Err("its points are not in threes".to_string()) };
        mesh.positions.push(place.transform_point3(DVec3::new(x, y, z)));
    }
    let index = |number: f64| if number >= 0.0 { number as u32 } else { u32::MAX };
    let in_file: Vec<u32> = numbers(".faceIndices")?.into_iter().map(index).collect();
    let mut end = 0usize;
    for count in numbers(".faceCounts")? {
        if count < 3.0 {
            return Err(format!("face {} has {count} corners instead of 3 or more", mesh.face_ends.len()));
        }
        end += count as usize;
        mesh.face_ends.push(end);
    }
    if end != in_file.len() {
        return Err(format!("its faces count {end} corners, but there are {}", in_file.len()));
    }
    // A mirror turns faces over as well.
    let is_mirrored = place.determinant() < 0.0;
    let turned = |face: std::ops::Range<usize>| {
        let (first, end) = (face.start, face.end);
        face.map(move |k| if is_mirrored { k } else { first + end - 1 - k })
    };
    let order: Vec<usize> = mesh.faces().flat_map(turned).collect();
    mesh.corners = order.iter().map(|k| in_file[*k]).collect();
    if let Some(uv) = named(&parts, "uv") {
        let column = Column::read(file, uv)?;
        match column.by_corner(&in_file, mesh.positions.len()) {
            Ok(rows) => {
                let pair = |k: &usize| column.row(rows[*k]).map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32));
                mesh.corner_uv = order.iter().map(pair).collect::<Option<_>>().unwrap_or_default();
            }
            Err(problem) => mesh.remarks.push(format!("its texture coordinates were left out: {problem}")),
        }
    }
    if let Some(arbitrary) = named(&parts, ".arbGeomParams") {
        for property in file.parts(arbitrary)? {
            paint(&property.name, &Column::read(file, &property)?, &mut mesh);
        }
    }
    if ["P", ".faceIndices"].iter().any(|name| named(&parts, name).is_some_and(|part| part.is_animated)) {
        mesh.remarks.push("the mesh is animated: its first sample was taken".to_string());
    }
    Ok(mesh)
}

/// A geometry parameter: values, each for itself or by their numbers.
struct Column {
    values: Vec<f64>,
    indices: Option<Vec<f64>>,
    width: usize,
    is_float: bool,
    is_by_point: bool,
}

impl Column {
    fn read(file: &Ogawa, property: &Property) -> Result<Self, String> {
        let scope = value_of(&property.metadata, "geoScope");
        let parts = file.parts(property)?;
        let values = named(&parts, ".vals").unwrap_or(property);
        let indices = named(&parts, ".indices").map(|indices| file.numbers(indices)).transpose()?;
        Ok(Self {
            values: file.numbers(values)?,
            indices,
            width: values.extent.max(1),
            is_float: values.is_float(),
            is_by_point: matches!(scope, Some("vtx" | "var")),
        })
    }

    fn row(&self, row: usize) -> Option<&[f64]> {
        self.values.get(row * self.width..(row + 1) * self.width)
    }

    fn rows(&self) -> usize {
        self.indices.as_ref().map_or(self.values.len() / self.width, Vec::len)
    }

    /// The row of the values that the k-th point or corner has.
    fn number(&self, k: usize) -> Result<usize, String> {
        let row = self.indices.as_ref().map_or(Some(k), |indices| indices.get(k).map(|row| *row as usize));
        row.filter(|row| self.row(*row).is_some()).ok_or(format!("there is none for number {k}"))
    }

    /// The rows of all corners.
    fn by_corner(&self, corners: &[u32], points: usize) -> Result<Vec<usize>, String> {
        if self.width != 2 {
            return Err(format!("they have {} numbers", self.width));
        }
        match self.rows() {
            rows if rows == points && self.is_by_point => corners.iter().map(|i| self.number(*i as usize)).collect(),
            rows if rows == corners.len() => (0..rows).map(|k| self.number(k)).collect(),
            rows => Err(format!("there are {rows} of them for {} corners", corners.len())),
        }
    }
}

/// Numbers and colours by point.
fn paint(name: &str, column: &Column, mesh: &mut RawMesh) {
    let count = mesh.positions.len();
    if !column.is_by_point || !column.is_float || column.rows() != count {
        return;
    }
    let Ok(rows) = (0..count).map(|k| column.number(k)).collect::<Result<Vec<_>, _>>() else { return };
    let values = |row: &usize| column.row(*row).unwrap_or_default().iter().map(|v| *v as f32).collect::<Vec<_>>();
    match column.width {
        1 => {
            mesh.painted.insert(name.to_string(), rows.iter().map(|row| values(row)[0]).collect());
        }
        3 | 4 if name == "Cd" => {
            let colors: Vec<[f32; 3]> = rows.iter().map(|row| [0, 1, 2].map(|k| values(row)[k])).collect();
            mesh.paint_colors(&colors);
        }
        _ => {}
    }
}
