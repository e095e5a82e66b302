//! STL, binary or ASCII: bare triangles. The shared cleaning joins the corners that coincide.

use super::raw::RawMesh;
use crate::error::IoError;
use crate::files::read_whole;
use glam::DVec3;
use std::io::Cursor;
use std::path::Path;

/// Bytes before the first triangle of a binary file: a free header and the number of triangles.
const HEADER: usize = 80;
/// Bytes of one triangle in a binary file: normal, three corners, two bytes that nobody uses alike.
const TRIANGLE: usize = 50;

/// Reads the triangles of an STL file.
pub(super) fn read(path: &Path) -> Result<RawMesh, IoError> {
    let mut bytes = read_whole(path)?;
    if bytes.is_empty() {
        return Err(IoError::content(path, "the file is empty", "export the mesh again"));
    }
    if let Some(field) = bytes.get(HEADER..HEADER + 4) {
        let count = u32::from_le_bytes([field[0], field[1], field[2], field[3]]) as usize;
        // Some programs begin binary files with "solid", the mark of ASCII ones; the length tells them apart.
        if bytes.len() == HEADER + 4 + TRIANGLE * count {
            bytes[..HEADER].fill(0);
        }
    }
    let damaged = |error: std::io::Error| {
        IoError::content(path, format!("not a sound STL file ({error})"), "it may be cut short; export it again")
    };
    let mut cursor = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut cursor).map_err(damaged)?;
    let mut mesh = RawMesh::default();
    for triangle in triangles {
        for vertex in triangle.map_err(damaged)?.vertices {
            let [x, y, z] = vertex.0.map(f64::from);
            mesh.corners.push(mesh.positions.len() as u32);
            mesh.positions.push(DVec3::new(x, y, z));
        }
        mesh.face_ends.push(mesh.corners.len());
    }
    if mesh.face_ends.is_empty() {
        return Err(IoError::content(path, "it has no faces", "export the mesh again, with its geometry selected"));
    }
    Ok(mesh)
}
