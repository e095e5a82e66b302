//! Mesh files in, surfaces out. One file a format; what all formats need is put right in one place afterwards.

mod alembic;
pub(crate) mod clean;
mod gltf;
mod gltf_document;
mod obj;
mod ogawa;
mod orientation;
mod ply;
mod polygons;
mod raw;
mod report;
mod stl;
mod usd;
mod usd_crate;
mod usd_layer;
mod usd_text;

pub use raw::RawMesh;
pub use report::{MeshReport, Shell, UNITS, coarse, inspect, likely_unit};

use crate::error::IoError;
use charcloth::mesh::SurfaceMesh;
use charcloth::registry::Entry;
use charcloth::scene::LengthUnit;
use std::path::Path;

/// A mesh format that can be read.
#[derive(Debug)]
pub struct Importer {
    /// File name endings, in small letters, without the dot.
    pub extensions: &'static [&'static str],
    /// Reads the faces of a file as they stand in it.
    pub read: fn(&Path) -> Result<RawMesh, IoError>,
}

/// Mesh formats that can be read.
pub const IMPORTERS: &[Entry<Importer>] = &[
    Entry {
        name: "obj",
        about: "Wavefront OBJ: polygons, texture coordinates, vertex colours",
        item: Importer { extensions: &["obj"], read: obj::read },
    },
    Entry {
        name: "ply",
        about: "Stanford PLY, ASCII or binary: polygons, texture coordinates, colours and painted attributes",
        item: Importer { extensions: &["ply"], read: ply::read },
    },
    Entry {
        name: "stl",
        about: "STL, ASCII or binary: bare triangles, joined where corners coincide",
        item: Importer { extensions: &["stl"], read: stl::read },
    },
    Entry {
        name: "gltf",
        about: "glTF 2.0, .gltf or .glb: the meshes of the default scene, where its nodes put them",
        item: Importer { extensions: &["gltf", "glb"], read: gltf::read },
    },
    Entry {
        name: "usd",
        about: "OpenUSD, .usd, .usda, .usdc or .usdz: the one mesh in it, where its prims put it, at its first time",
        item: Importer { extensions: &["usd", "usda", "usdc", "usdz"], read: usd::read },
    },
    Entry {
        name: "alembic",
        about: "Alembic, .abc (Ogawa): the one mesh in it, where its transforms put it, at its first sample",
        item: Importer { extensions: &["abc"], read: alembic::read },
    },
];

/// Reads a mesh file, the format told by its ending, and makes a surface in metres of it.
///
/// Points that coincide (within a millionth of the diagonal) become one, which joins texture seams and the loose
/// triangles of STL; texture coordinates stay with the corners. The joined points keep the order in which they first
/// stand in the file, less those that no face uses, and **an index that a scene pins is an index into these**. Faces
/// are cut into triangles; `source_face` counts the faces of the file from 0. What had to be put right is said in
/// `remarks`.
pub fn read_mesh(path: &Path, unit: LengthUnit) -> Result<SurfaceMesh, IoError> {
    clean::clean((importer_of(path)?.item.read)(path)?, unit, path)
}

/// A mesh file as it stands, before anything is put right.
pub(crate) fn read_raw(path: &Path) -> Result<RawMesh, IoError> {
    (importer_of(path)?.item.read)(path)
}

/// The row of the format that the ending of a name tells.
fn importer_of(path: &Path) -> Result<&'static Entry<Importer>, IoError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    IMPORTERS.iter().find(|row| row.item.extensions.contains(&ending.as_str())).ok_or_else(|| {
        let known: Vec<_> = IMPORTERS.iter().flat_map(|row| row.item.extensions).map(|e| format!(".{e}")).collect();
        let problem = match ending.as_str() {
            "" => "the name has no ending that tells the mesh format".to_string(),
            _ => format!("meshes ending in .{ending} cannot be read"),
        };
        IoError::content(path, problem, format!("export it as one of {}", known.join(", ")))
    })
}
