//! From faces as a file has them to a surface that can burn: scaled, joined, cut into triangles, free of doubles.

use super::orientation::orient;
use super::polygons::triangulate;
use super::raw::RawMesh;
use crate::error::IoError;
use charcloth::mesh::SurfaceMesh;
use charcloth::scene::LengthUnit;
use charcloth::sheet::{NONE, bounds};
use glam::{DVec3, Vec2};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Points closer than this part of the diagonal of the mesh are one point. It is ten times the rounding of
/// single-precision coordinates, in which most files are written, and far below any real gap.
const WELD_TOLERANCE: f64 = 1e-6;

/// Sheets outside this range of sizes [m] are burnt, with a remark: most often the unit is wrong.
const LIKELY_SIZE: std::ops::Range<f64> = 2e-3..20.0;

/// Makes a surface in metres of the faces of a file.
pub(crate) fn clean(raw: RawMesh, unit: LengthUnit, path: &Path) -> Result<SurfaceMesh, IoError> {
    Ok(clean_with_points(raw, unit, path)?.0)
}

/// The same, with the point of the file that each point of the surface was.
pub(crate) fn clean_with_points(
    mut raw: RawMesh,
    unit: LengthUnit,
    path: &Path,
) -> Result<(SurfaceMesh, Vec<u32>), IoError> {
    check(&raw, path)?;
    for position in &mut raw.positions {
        *position *= unit.metres();
    }
    let used: Vec<DVec3> = raw.corners.iter().map(|i| raw.positions[*i as usize]).collect();
    let (low, high) = bounds(&used);
    let diagonal = low.distance(high);
    if diagonal == 0.0 || !diagonal.is_finite() {
        let problem = if diagonal == 0.0 { "it has zero size: all points lie at one place" } else { "it is too large" };
        return Err(IoError::content(path, problem, "check the scale the mesh was exported with"));
    }
    let mut remarks = std::mem::take(&mut raw.remarks);
    let longest = (high - low).max_element();
    if !LIKELY_SIZE.contains(&longest) {
        remarks.push(format!("the mesh is {longest:.4} m long: is its unit right? See sheet.unit"));
    }

    let tolerance = WELD_TOLERANCE * diagonal;
    let welded = weld(&raw, low, tolerance);
    let mut mesh = cut_faces(&raw, &welded, tolerance, &mut remarks);
    if mesh.triangles.is_empty() {
        return Err(IoError::content(path, "it has no face with an area", "a sheet needs at least one"));
    }
    orient(&mut mesh, &mut remarks);
    let points = gather_points(&mut mesh, &raw, &welded);
    mesh.number_shells();
    mesh.remarks = remarks;
    mesh.validate().map_err(|error| IoError::about(path, error))?;
    Ok((mesh, points))
}

/// Finds what cannot be put right.
fn check(raw: &RawMesh, path: &Path) -> Result<(), IoError> {
    let count = raw.positions.len();
    if count == 0 {
        return Err(IoError::content(path, "it has no points", "export the mesh again, with its geometry selected"));
    }
    if raw.face_ends.is_empty() {
        return Err(IoError::content(
            path,
            "it has no faces",
            "a sheet is a surface: points or lines alone cannot burn; export the mesh with its faces",
        ));
    }
    if count >= NONE as usize {
        return Err(IoError::content(path, format!("{count} points are too many"), "reduce the mesh"));
    }
    if let Some(k) = raw.positions.iter().position(|p| !p.is_finite()) {
        return Err(IoError::content(
            path,
            format!("point {k} is not at a finite place ({})", raw.positions[k]),
            "export the mesh again",
        ));
    }
    if let Some(k) = raw.corner_uv.iter().position(|uv| !uv.is_finite()) {
        let face = raw.face_ends.partition_point(|end| *end <= k);
        return Err(IoError::content(
            path,
            format!("face {face} has a texture coordinate that is not a finite number"),
            "unwrap the mesh again, or export it without texture coordinates",
        ));
    }
    for (name, values) in &raw.painted {
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            return Err(IoError::content(
                path,
                format!("the attribute {name} of point {k} is not a finite number"),
                "export the mesh again, or without that attribute",
            ));
        }
    }
    if let Some(k) = raw.corners.iter().position(|i| *i as usize >= count) {
        let face = raw.face_ends.partition_point(|end| *end <= k);
        return Err(IoError::content(
            path,
            format!("face {face} names point {}, but there are {count} points, counted from 0", raw.corners[k]),
            "the file is damaged; export it again",
        ));
    }
    Ok(())
}

/// For each point the first point of the file that lies at the same place. Points are taken in file order and joined
/// to a first point only, never in chains, so the outcome does not depend on anything but the file.
fn weld(raw: &RawMesh, low: DVec3, tolerance: f64) -> Vec<u32> {
    // Cells are wide against the tolerance, so that nearly always a single one has to be looked at.
    let cell = 8.0 * tolerance;
    let mut used = vec![false; raw.positions.len()];
    for i in &raw.corners {
        used[*i as usize] = true;
    }
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(raw.positions.len());
    let mut first = Vec::with_capacity(raw.positions.len());
    for (i, position) in raw.positions.iter().enumerate() {
        if !used[i] {
            first.push(i as u32);
            continue;
        }
        let place = |offset: f64| ((*position - low + offset) / cell).floor().to_array().map(|c| c as i64);
        let (from, to) = (place(-tolerance), place(tolerance));
        let mut nearest_first: Option<u32> = None;
        for x in from[0]..=to[0] {
            for y in from[1]..=to[1] {
                for z in from[2]..=to[2] {
                    for &other in cells.get(&[x, y, z]).into_iter().flatten() {
                        let near = raw.positions[other as usize].distance_squared(*position) <= tolerance * tolerance;
                        if near && nearest_first.is_none_or(|known| other < known) {
                            nearest_first = Some(other);
                        }
                    }
                }
            }
        }
        first.push(nearest_first.unwrap_or(i as u32));
        if nearest_first.is_none() {
            cells.entry(place(0.0)).or_default().push(i as u32);
        }
    }
    first
}

/// Cuts the faces into triangles on the welded points and drops those that are flat or there twice. Corners still
/// carry the numbers of the file.
fn cut_faces(raw: &RawMesh, welded: &[u32], tolerance: f64, remarks: &mut Vec<String>) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let has_uv = !raw.corner_uv.is_empty();
    let (mut degenerate, mut double) = (0_usize, 0_usize);
    let mut seen = HashSet::new();
    for (face, range) in raw.faces().enumerate() {
        // Neighbouring corners at one place are one corner.
        let mut ring: Vec<usize> = Vec::with_capacity(range.len());
        for corner in range {
            if ring.last().is_none_or(|last| point(raw, welded, *last) != point(raw, welded, corner)) {
                ring.push(corner);
            }
        }
        while ring.len() > 1 && point(raw, welded, ring[0]) == point(raw, welded, ring[ring.len() - 1]) {
            ring.pop();
        }
        if ring.len() < 3 {
            degenerate += 1;
            continue;
        }
        let places: Vec<DVec3> =
            ring.iter().map(|corner| raw.positions[point(raw, welded, *corner) as usize]).collect();
        for cut in triangulate(&places) {
            let corners = cut.map(|k| point(raw, welded, ring[k]));
            if is_degenerate(corners, cut.map(|k| places[k]), tolerance) {
                degenerate += 1;
                continue;
            }
            let mut sorted = corners;
            sorted.sort_unstable();
            if !seen.insert(sorted) {
                double += 1;
                continue;
            }
            mesh.triangles.push(corners);
            mesh.source_face.push(face as u32);
            if has_uv {
                mesh.corner_uv.push(cut.map(|k| raw.corner_uv[ring[k]]));
            }
        }
    }
    if degenerate > 0 {
        remarks.push(format!("{degenerate} degenerate triangles (no area, or a corner twice) were dropped"));
    }
    if double > 0 {
        remarks.push(format!("{double} duplicate triangles (same corners as another) were dropped"));
    }
    mesh
}

/// The welded point at a corner.
fn point(raw: &RawMesh, welded: &[u32], corner: usize) -> u32 {
    welded[raw.corners[corner] as usize]
}

/// Whether a triangle names a corner twice or is no higher than the distance at which points are one.
fn is_degenerate(corners: [u32; 3], places: [DVec3; 3], tolerance: f64) -> bool {
    let [a, b, c] = places;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let twice_area = (b - a).cross(c - a).length();
    corners[0] == corners[1]
        || corners[1] == corners[2]
        || corners[2] == corners[0]
        || twice_area <= tolerance * longest
}

/// Keeps the points that triangles use, in file order, and what is painted on them: the mean over the joined points.
fn gather_points(mesh: &mut SurfaceMesh, raw: &RawMesh, welded: &[u32]) -> Vec<u32> {
    let mut points = Vec::new();
    let mut number = vec![NONE; raw.positions.len()];
    for corners in &mesh.triangles {
        for i in corners {
            number[*i as usize] = 0;
        }
    }
    for i in 0..number.len() {
        if number[i] != NONE {
            number[i] = mesh.positions.len() as u32;
            mesh.positions.push(raw.positions[i]);
            points.push(i as u32);
        }
    }
    for i in mesh.triangles.iter_mut().flatten() {
        *i = number[*i as usize];
    }
    let mut used = vec![false; raw.positions.len()];
    for i in &raw.corners {
        used[*i as usize] = true;
    }
    let mut painted = BTreeMap::new();
    for (name, values) in &raw.painted {
        let mut sums = vec![(0.0_f64, 0_u32); mesh.positions.len()];
        for (i, value) in values.iter().enumerate() {
            let target = number[welded[i] as usize];
            if used[i] && target != NONE {
                let (sum, count) = &mut sums[target as usize];
                *sum += f64::from(*value);
                *count += 1;
            }
        }
        let means = sums.iter().map(|(sum, count)| (sum / f64::from((*count).max(1))) as f32).collect();
        painted.insert(name.clone(), means);
    }
    mesh.painted = painted;
    points
}

/// Turns a triangle over, its texture coordinates with it.
pub(super) fn turn_over(corners: &mut [u32; 3], uv: Option<&mut [Vec2; 3]>) {
    corners.swap(1, 2);
    if let Some(uv) = uv {
        uv.swap(1, 2);
    }
}
