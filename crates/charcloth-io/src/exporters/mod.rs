//! Frames out, to files that other programs open. One file a format.

mod look;
mod obj;
mod ply;
mod surface;

pub use look::display_color;

use crate::cache::CacheReader;
use crate::error::IoError;
use crate::files::create_folder;
use charcloth::frame::Frame;
use charcloth::registry::{Entry, nearest};
use std::ops::{ControlFlow, RangeInclusive};
use std::path::{Path, PathBuf};

/// A format that frames can be written in.
#[derive(Debug)]
pub struct Exporter {
    /// File name ending, without the dot.
    pub extension: &'static str,
    /// Writes the living surface of a frame.
    pub write: fn(&Frame, &Path) -> Result<(), IoError>,
}

/// Formats that frames can be written in.
pub const EXPORTERS: &[Entry<Exporter>] = &[
    Entry {
        name: "ply",
        about: "binary PLY with every quantity of the nodes: Blender, MeshLab, trimesh, Houdini by conversion",
        item: Exporter { extension: "ply", write: ply::write },
    },
    Entry {
        name: "obj",
        about: "Wavefront OBJ with texture coordinates and normals: opens everywhere, carries the shape only",
        item: Exporter { extension: "obj", write: obj::write },
    },
];

/// Writes one frame in the format that the ending of the name tells.
pub fn write_frame(frame: &Frame, path: &Path) -> Result<(), IoError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    (find(&ending, path)?.item.write)(frame, path)
}

/// How far an export is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress<'a> {
    /// Frames written so far.
    pub done: usize,
    /// Frames to write in all.
    pub total: usize,
    /// The file written last.
    pub path: &'a Path,
}

/// Writes frames of a cache as `frame_00000.<ending>` into a folder and lists the files.
///
/// `frames` limits which; none means all there are. `progress` is called after each file and may stop the export; what
/// is written by then is kept and listed.
pub fn export(
    cache: &CacheReader,
    format: &str,
    frames: Option<RangeInclusive<u32>>,
    folder: &Path,
    progress: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Vec<PathBuf>, IoError> {
    let exporter = &find(format, folder)?.item;
    let available = cache.frames()?;
    let wanted: Vec<u32> =
        available.iter().copied().filter(|n| frames.as_ref().is_none_or(|range| range.contains(n))).collect();
    if wanted.is_empty() {
        let hint = match (available.first(), available.last()) {
            (Some(first), Some(last)) => format!("there are frames {first} to {last}"),
            _ => "the run has not finished its first frame yet".to_string(),
        };
        return Err(IoError::content(cache.folder(), "it has none of the frames asked for", hint));
    }
    create_folder(folder)?;
    let mut written = Vec::with_capacity(wanted.len());
    for number in &wanted {
        let path = folder.join(format!("frame_{number:05}.{}", exporter.extension));
        (exporter.write)(&cache.frame(*number)?, &path)?;
        written.push(path);
        let now = Progress { done: written.len(), total: wanted.len(), path: &written[written.len() - 1] };
        if progress(now).is_break() {
            break;
        }
    }
    Ok(written)
}

fn find(format: &str, path: &Path) -> Result<&'static Entry<Exporter>, IoError> {
    EXPORTERS.iter().find(|row| row.name == format).ok_or_else(|| {
        let names = || EXPORTERS.iter().map(|row| row.name);
        let guess = nearest(format, names()).map(|near| format!("did you mean {near}? ")).unwrap_or_default();
        let hint = format!("{guess}there are: {}", names().collect::<Vec<_>>().join(", "));
        IoError::content(path, format!("\"{format}\" is not a format frames can be written in"), hint)
    })
}
