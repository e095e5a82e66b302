//! Frames out, to files that other programs open. One file a format.

mod abc;
mod abc_points;
mod abc_samples;
mod glb;
mod gltf;
mod listing;
mod look;
mod maps;
mod mdd;
mod obj;
mod ogawa;
mod pc2;
mod pictures;
mod ply;
mod quantities;
mod sequence;
mod surface;
mod twin;
mod twin_obj;
mod usd;
mod usd_crate;
mod usd_points;
mod usd_samples;
mod usd_twin;
mod usdz;
mod vat;
mod vdb;
pub mod vdb_grid;

pub use look::display_color;

use crate::cache::CacheReader;
use crate::error::IoError;
use crate::files::create_folder;
use charcloth::frame::Frame;
use charcloth::registry::{Entry, nearest};
use listing::Claim;
pub use sequence::Sequence;
use std::ops::{ControlFlow, RangeInclusive};
use std::path::{Path, PathBuf};

/// A format that frames can be written in.
#[derive(Debug)]
pub struct Exporter {
    /// File name ending, without the dot.
    pub extension: &'static str,
    /// Names of the files that frames of these numbers are written into.
    pub files: fn(&[u32]) -> Vec<String>,
    /// Writes frames.
    pub write: Writer,
}

/// How a format takes frames.
#[derive(Debug)]
pub enum Writer {
    /// Writes the living surface of one frame into a file.
    EachFrame(fn(&Frame, &Path) -> Result<(), IoError>),
    /// Writes all frames into a folder and lists the files, those to open first.
    AllFrames(fn(&mut Sequence<'_>, &Path) -> Result<Vec<PathBuf>, IoError>),
}

/// Formats that frames can be written in.
pub const EXPORTERS: &[Entry<Exporter>] = &[
    Entry {
        name: "ply",
        about: "binary PLY with every quantity of the nodes: Blender, MeshLab, trimesh, Houdini by conversion",
        item: Exporter {
            extension: "ply",
            files: |frames| each(frames, "frame", "ply"),
            write: Writer::EachFrame(ply::write),
        },
    },
    Entry {
        name: "obj",
        about: "Wavefront OBJ with texture coordinates and normals: opens everywhere, carries the shape only",
        item: Exporter {
            extension: "obj",
            files: |frames| each(frames, "frame", "obj"),
            write: Writer::EachFrame(obj::write),
        },
    },
    Entry {
        name: "usd",
        about: "OpenUSD, all frames in one .usdc with changing topology: Blender, Houdini, Maya, Unreal, usdview",
        item: Exporter {
            extension: "usdc",
            files: |_| vec!["sheet.usdc".into()],
            write: Writer::AllFrames(usd::write),
        },
    },
    Entry {
        name: "usdz",
        about: "the same in one package: Quick Look, augmented reality",
        item: Exporter {
            extension: "usdz",
            files: |_| vec!["sheet.usdz".into()],
            write: Writer::AllFrames(usdz::write),
        },
    },
    Entry {
        name: "abc",
        about: "Alembic, all frames in one .abc with changing topology: Blender, Houdini, Maya",
        item: Exporter { extension: "abc", files: |_| vec!["sheet.abc".into()], write: Writer::AllFrames(abc::write) },
    },
    Entry {
        name: "gltf",
        about: "glTF 2.0, all frames in one .glb, each shown in its time: web pages, game engines",
        item: Exporter { extension: "glb", files: |_| vec!["sheet.glb".into()], write: Writer::AllFrames(gltf::write) },
    },
    Entry {
        name: "usd_twin",
        about: "OpenUSD with the same points and faces in all frames: engines that cannot take others",
        item: Exporter {
            extension: "usdc",
            files: |_| vec!["twin.usdc".into()],
            write: Writer::AllFrames(usd_twin::write),
        },
    },
    Entry {
        name: "pc2",
        about: "point cache with an OBJ that it moves, of the same points in all frames: Blender, 3ds Max, Maya",
        item: Exporter {
            extension: "pc2",
            files: |_| vec!["sheet.obj".into(), "sheet.pc2".into()],
            write: Writer::AllFrames(pc2::write),
        },
    },
    Entry {
        name: "mdd",
        about: "the same in the older MDD: Blender, LightWave, Cinema 4D",
        item: Exporter {
            extension: "mdd",
            files: |_| vec!["sheet.obj".into(), "sheet.mdd".into()],
            write: Writer::AllFrames(mdd::write),
        },
    },
    Entry {
        name: "vat",
        about: "vertex animation textures with the mesh that they move: Unreal, Unity, Godot",
        item: Exporter { extension: "exr", files: vat::files, write: Writer::AllFrames(vat::write) },
    },
    Entry {
        name: "maps",
        about: "temperature, char and holes as pictures over the texture, and when each place caught fire: shaders",
        item: Exporter { extension: "exr", files: maps::files, write: Writer::AllFrames(maps::write) },
    },
    Entry {
        name: "vdb",
        about: "OpenVDB, the flames of each frame as a volume: Blender, Houdini, Maya, Unreal",
        item: Exporter {
            extension: "vdb",
            files: |frames| each(frames, "flames", "vdb"),
            write: Writer::AllFrames(vdb::write),
        },
    },
];

/// What can be chosen about an export.
#[derive(Debug, Clone, PartialEq)]
pub struct ExportOptions {
    /// First and last frame; none means all there are.
    pub frames: Option<RangeInclusive<u32>>,
    /// Width and height of maps [texels].
    pub resolution: u32,
    /// How far maps go beyond the borders of the texture's patches [texels].
    pub gutter: u32,
    /// Side of the voxels of volumes [m].
    pub voxel: f64,
    /// Velocities from the frame before to the frame after, in place of those at the moment itself.
    pub mean_velocities: bool,
    /// Replace files that no export of ours wrote, in place of refusing.
    pub force: bool,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self { frames: None, resolution: 1024, gutter: 8, voxel: 2e-3, mean_velocities: false, force: false }
    }
}

/// Writes one frame in the format that the ending of the name tells.
pub fn write_frame(frame: &Frame, path: &Path) -> Result<(), IoError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match find(&ending, path)?.item.write {
        Writer::EachFrame(write) => write(frame, path),
        Writer::AllFrames(_) => {
            let hint = "export the run into a folder";
            Err(IoError::content(path, format!("{ending} holds all frames of a run, not one"), hint))
        }
    }
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

/// What an export has written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The files, those to open first.
    pub files: Vec<PathBuf>,
    /// Files of an earlier export in the format that this one does not have, and that were removed.
    pub removed: usize,
}

/// Writes frames of a cache into a folder: `frame_00000.<ending>` where a format has a file a frame.
///
/// The folder then has what this export wrote in the format and nothing of an earlier one: which files those are stands
/// in `export.json` there. A file in the way that is not listed is an error, unless `options.force`. The mesh that point
/// caches of several formats move is theirs together, as long as it is the same.
///
/// `progress` is called after each file and may stop the export; what is written by then is kept and listed.
pub fn export(
    cache: &CacheReader,
    format: &str,
    options: &ExportOptions,
    folder: &Path,
    progress: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Exported, IoError> {
    let row = find(format, folder)?;
    let available = cache.frames()?;
    let wanted: Vec<u32> =
        available.iter().copied().filter(|n| options.frames.as_ref().is_none_or(|range| range.contains(n))).collect();
    if wanted.is_empty() {
        let hint = match (available.first(), available.last()) {
            (Some(first), Some(last)) => format!("there are frames {first} to {last}"),
            _ => "the run has not finished its first frame yet".to_string(),
        };
        return Err(IoError::content(cache.folder(), "it has none of the frames asked for", hint));
    }
    create_folder(folder)?;
    let claim = Claim::begin(folder, row.name, &(row.item.files)(&wanted), options.force)?;
    let files = match row.item.write {
        Writer::EachFrame(write) => write_each(cache, &wanted, row.item.extension, write, folder, progress),
        Writer::AllFrames(write) => {
            let mut sequence = Sequence::new(cache, wanted, options, progress);
            sequence.keep(claim.shared());
            write(&mut sequence, folder)
        }
    };
    match files {
        Ok(files) => Ok(Exported { removed: claim.finish(&files)?, files }),
        Err(error) => {
            claim.abandon();
            Err(error)
        }
    }
}

fn write_each(
    cache: &CacheReader,
    wanted: &[u32],
    extension: &str,
    write: fn(&Frame, &Path) -> Result<(), IoError>,
    folder: &Path,
    progress: &mut dyn FnMut(Progress<'_>) -> ControlFlow<()>,
) -> Result<Vec<PathBuf>, IoError> {
    let mut written = Vec::with_capacity(wanted.len());
    for number in wanted {
        let path = folder.join(numbered("frame", *number, extension));
        write(&cache.frame(*number)?, &path)?;
        written.push(path);
        let now = Progress { done: written.len(), total: wanted.len(), path: &written[written.len() - 1] };
        if progress(now).is_break() {
            break;
        }
    }
    Ok(written)
}

/// Name of the file of a frame.
fn numbered(stem: &str, frame: u32, extension: &str) -> String {
    format!("{stem}_{frame:05}.{extension}")
}

/// Names of files, one a frame.
fn each(frames: &[u32], stem: &str, extension: &str) -> Vec<String> {
    frames.iter().map(|number| numbered(stem, *number, extension)).collect()
}

fn find(format: &str, path: &Path) -> Result<&'static Entry<Exporter>, IoError> {
    EXPORTERS.iter().find(|row| row.name == format).ok_or_else(|| {
        let names = || EXPORTERS.iter().map(|row| row.name);
        let guess = nearest(format, names()).map(|near| format!("did you mean {near}? ")).unwrap_or_default();
        let hint = format!("{guess}there are: {}", names().collect::<Vec<_>>().join(", "));
        IoError::content(path, format!("\"{format}\" is not a format frames can be written in"), hint)
    })
}
