//! Motion as a sequence of numbered meshes: the same points and faces in each, moved.

use crate::error::IoError;
use crate::importers::clean::clean_with_points;
use crate::importers::{IMPORTERS, read_raw};
use charcloth::motion::MeshSequence;
use charcloth::scene::LengthUnit;
use std::path::{Path, PathBuf};

/// The number at the end of a name.
fn number(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.len() - stem.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    stem[stem.len() - digits..].parse().ok()
}

/// The files of a sequence, in order: those of a folder, or those that fit a path with one `*`. Their numbers count up by
/// one.
pub fn files(sequence: &Path) -> Result<Vec<PathBuf>, IoError> {
    let name = sequence.file_name().unwrap_or_default().to_string_lossy();
    let (folder, wanted) = match name.split_once('*') {
        Some((before, after)) => (sequence.parent().unwrap_or(Path::new("")), Some((before, after))),
        None => (sequence, None),
    };
    let entries = std::fs::read_dir(folder).map_err(|error| IoError::system("read", folder, &error))?;
    let is_mesh = |path: &Path| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        IMPORTERS.iter().any(|row| row.item.extensions.contains(&ending.as_str()))
    };
    let fits = |path: &Path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        wanted.is_none_or(|(before, after)| {
            name.len() >= before.len() + after.len() && name.starts_with(before) && name.ends_with(after)
        })
    };
    let mut found: Vec<(u64, PathBuf)> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| is_mesh(path) && fits(path))
        .filter_map(|path| Some((number(&path)?, path)))
        .collect();
    found.sort();
    if found.is_empty() {
        let hint = "name a folder of meshes such as sheet_0001.obj, or their path with * for the number";
        return Err(IoError::content(sequence, "there are no numbered meshes here", hint));
    }
    for pair in found.windows(2) {
        let [(before, first), (after, second)] = pair else { continue };
        let two = || format!("{} and {}", first.display(), second.display());
        if before == after {
            let hint = "name one sequence, with * for the number: \"folder/sheet_*.obj\"";
            return Err(IoError::content(sequence, format!("{} have the same number", two()), hint));
        }
        if before + 1 != *after {
            let problem = format!("number {} is missing, between {}", before + 1, two());
            return Err(IoError::content(sequence, problem, "export the sequence again, every frame of it"));
        }
    }
    Ok(found.into_iter().map(|(_, path)| path).collect())
}

/// Reads a sequence: the places of the points that a base mesh has once it is put right, in each of the meshes. All are
/// held, 24 bytes a point and mesh.
pub fn read(sequence: &Path, base: &Path, unit: LengthUnit) -> Result<MeshSequence, IoError> {
    let files = files(sequence)?;
    let of_base = read_raw(base)?;
    let (_, points) = clean_with_points(of_base.clone(), unit, base)?;
    let mut meshes = Vec::with_capacity(files.len());
    for path in &files {
        let raw = read_raw(path)?;
        let count = |points: usize, faces: usize| format!("{points} points and {faces} faces");
        let (here, there) = ([&raw, &of_base]).map(|raw| (raw.positions.len(), raw.face_ends.len())).into();
        if here != there {
            let problem =
                format!("it has {}, {} has {}", count(here.0, here.1), base.display(), count(there.0, there.1));
            return Err(IoError::content(path, problem, "all must be the same mesh with its points moved"));
        }
        if raw.corners != of_base.corners || raw.face_ends != of_base.face_ends {
            let problem = format!("its points are joined otherwise than those of {}", base.display());
            let hint = "export the sequence with the order of points kept (no triangulation or merging a frame)";
            return Err(IoError::content(path, problem, hint));
        }
        if let Some(k) = raw.positions.iter().position(|p| !p.is_finite()) {
            return Err(IoError::content(path, format!("point {k} is not at a finite place"), "export it again"));
        }
        meshes.push(points.iter().map(|i| raw.positions[*i as usize] * unit.metres()).collect());
    }
    Ok(MeshSequence { meshes })
}
