//! What a mesh file holds, for a look at it before it is burnt.

use super::{clean, importer_of};
use crate::error::IoError;
use charcloth::mesh::SurfaceMesh;
use charcloth::scene::LengthUnit;
use charcloth::sheet::bounds;
use glam::{DVec3, Vec2};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Units a mesh may count in, as scenes name them.
pub const UNITS: &[(&str, LengthUnit)] = &[
    ("m", LengthUnit::M),
    ("cm", LengthUnit::Cm),
    ("mm", LengthUnit::Mm),
    ("in", LengthUnit::In),
    ("ft", LengthUnit::Ft),
];

/// Sizes of sheets that need no second thought [m]: files in metres are the rule.
const USUAL_SIZE: std::ops::Range<f64> = 0.02..5.0;

/// Distance of points that burn over which a front of fire is lost between them [m].
const WIDE_EDGE: f64 = 0.006; // tuned: built-in scenes have 1 to 3.5 mm; at 6 mm fire still spreads, raggedly
/// The highest `sheet.burn_level`.
const MOST_BURN_LEVEL: u32 = 3;

/// What a mesh file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshReport {
    /// Name of the format.
    pub format: &'static str,
    /// Points and faces as they stand in the file.
    pub file_points: usize,
    /// Faces as they stand in the file.
    pub file_faces: usize,
    /// Width, height, depth in the unit of the file.
    pub size: DVec3,
    /// Unit that the rest is in: the one asked for, else the likeliest.
    pub unit: LengthUnit,
    /// Shortest, median and longest edge [m].
    pub edges: [f64; 3],
    /// Its connected shells, in order of first triangle.
    pub shells: Vec<Shell>,
    /// Lowest and highest texture coordinate; none where the file has none.
    pub uv: Option<[Vec2; 2]>,
    /// The surface as it would be burnt, with remarks on what had to be put right.
    pub mesh: SurfaceMesh,
}

/// A connected part of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shell {
    /// Number of triangles.
    pub triangles: usize,
    /// Area [m2].
    pub area: f64,
    /// Closed lines of border edges: none for a closed shell, one for a plain sheet, one more for each hole.
    pub borders: usize,
}

impl Shell {
    /// Number of holes.
    pub fn holes(&self) -> usize {
        self.borders.saturating_sub(1)
    }
}

/// The unit that makes a size in a file most like that of a sheet, and its name.
pub fn likely_unit(size: f64) -> (&'static str, LengthUnit) {
    if USUAL_SIZE.contains(&size) {
        return UNITS[0];
    }
    // The one nearest to 0.4 m, which tells A4 from a square metre in every unit.
    let off = |unit: LengthUnit| (size * unit.metres() / 0.4).ln().abs();
    UNITS.iter().copied().min_by(|(_, a), (_, b)| off(*a).total_cmp(&off(*b))).unwrap_or(UNITS[0])
}

/// Says so where faces are too large for a fire: the front of one is a few millimetres wide, and where it is between two
/// points nothing burns or all does. `burn_level` is how often edges are halved for what burns.
pub fn coarse(mesh: &SurfaceMesh, burn_level: u32) -> Option<String> {
    let sides = mesh.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
    let length = |(i, j): (u32, u32)| mesh.positions[i as usize].distance(mesh.positions[j as usize]);
    let mean = sides.map(length).sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64;
    let left = mean / 2f64.powi(burn_level as i32);
    (left > WIDE_EDGE).then(|| {
        let level = (burn_level..=MOST_BURN_LEVEL).find(|level| mean / 2f64.powi(*level as i32) <= WIDE_EDGE);
        let try_this = match level {
            Some(level) => format!("subdivide the mesh, or set sheet.burn_level={level}"),
            None => "subdivide the mesh".to_string(),
        };
        format!(
            "points that burn are {:.0} mm apart and a front of fire is a few millimetres wide: {try_this}",
            left * 1e3
        )
    })
}

/// Reads a mesh file and says what is in it. Without a unit the likeliest is taken; glTF and USD are
/// read in metres.
pub fn inspect(path: &Path, unit: Option<LengthUnit>) -> Result<MeshReport, IoError> {
    let importer = importer_of(path)?;
    let raw = (importer.item.read)(path)?;
    let (file_points, file_faces) = (raw.positions.len(), raw.face_ends.len());
    let used: Vec<DVec3> = raw.corners.iter().filter_map(|i| raw.positions.get(*i as usize)).copied().collect();
    let size = if used.is_empty() { DVec3::ZERO } else { bounds(&used).1 - bounds(&used).0 };
    let likely =
        if ["gltf", "usd"].contains(&importer.name) { LengthUnit::M } else { likely_unit(size.max_element()).1 };
    let unit = unit.unwrap_or(likely);
    let mesh = clean::clean(raw, unit, path)?;
    let uv = mesh.corner_uv.iter().flatten().fold(None, |box_: Option<[Vec2; 2]>, uv| {
        Some(box_.map_or([*uv; 2], |[low, high]| [low.min(*uv), high.max(*uv)]))
    });
    Ok(MeshReport {
        format: importer.name,
        file_points,
        file_faces,
        size,
        unit,
        edges: edges(&mesh),
        shells: shells(&mesh),
        uv,
        mesh,
    })
}

/// How many triangles have each edge, by its ends.
fn edge_uses(mesh: &SurfaceMesh) -> BTreeMap<(u32, u32), (u32, usize)> {
    let mut uses = BTreeMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            uses.entry((i.min(j), i.max(j))).or_insert((0, t)).0 += 1;
        }
    }
    uses
}

/// Shortest, median and longest edge [m].
fn edges(mesh: &SurfaceMesh) -> [f64; 3] {
    let length = |(i, j): &(u32, u32)| mesh.positions[*i as usize].distance(mesh.positions[*j as usize]);
    let mut lengths: Vec<f64> = edge_uses(mesh).keys().map(length).collect();
    lengths.sort_by(f64::total_cmp);
    match lengths.as_slice() {
        [] => [0.0; 3],
        [shortest, .., longest] => [*shortest, lengths[lengths.len() / 2], *longest],
        [only] => [*only; 3],
    }
}

fn shells(mesh: &SurfaceMesh) -> Vec<Shell> {
    let mut shells = vec![Shell::default(); mesh.shell_count()];
    for (t, shell) in mesh.shell.iter().enumerate() {
        shells[*shell as usize].triangles += 1;
        shells[*shell as usize].area += mesh.triangle_area(t);
    }
    // Border edges that meet at a point are of one line.
    let mut root: HashMap<u32, u32> = HashMap::new();
    fn find(root: &HashMap<u32, u32>, mut i: u32) -> u32 {
        while let Some(up) = root.get(&i).filter(|up| **up != i) {
            i = *up;
        }
        i
    }
    let borders: Vec<((u32, u32), usize)> =
        edge_uses(mesh).into_iter().filter(|(_, (uses, _))| *uses == 1).map(|(edge, (_, t))| (edge, t)).collect();
    for ((i, j), _) in &borders {
        let (a, b) = (find(&root, *i), find(&root, *j));
        root.insert(a.max(b), a.min(b));
        root.insert(*i, a.min(b));
        root.insert(*j, a.min(b));
    }
    let mut lines: Vec<(u32, u32)> = borders.iter().map(|((i, _), t)| (mesh.shell[*t], find(&root, *i))).collect();
    lines.sort_unstable();
    lines.dedup();
    lines.iter().for_each(|(shell, _)| shells[*shell as usize].borders += 1);
    shells
}
