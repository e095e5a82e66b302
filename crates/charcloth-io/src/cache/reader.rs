//! Reads the cache of a run, also while the run goes on.

use super::npz::NpzReader;
use super::{CacheMeta, Checkpoint, checkpoint, frame_columns_mut, frame_name, frame_number, may_be_missing};
use crate::error::IoError;
use crate::files::read_whole;
use charcloth::fields::DataMut;
use charcloth::frame::Frame;
use charcloth::sheet::{NONE, Origins};
use std::fs;
use std::path::{Path, PathBuf};

/// What to try where a frame cannot be read.
const DAMAGED: &str = "it may be damaged or of another version: run the scene again, or resume it";

/// A cache to read frames from.
#[derive(Debug, Clone, PartialEq)]
pub struct CacheReader {
    cache: PathBuf,
    meta: CacheMeta,
}

impl CacheReader {
    /// Opens a cache; the folder may be that of the run or the one with the frames.
    pub fn open(folder: &Path) -> Result<Self, IoError> {
        let (cache, meta) = CacheMeta::find(folder)?;
        Ok(Self { cache, meta })
    }

    /// The folder of the frames.
    pub fn folder(&self) -> &Path {
        &self.cache
    }

    /// What the cache says about itself: scene, frames a second, fields.
    pub fn meta(&self) -> &CacheMeta {
        &self.meta
    }

    /// Numbers of the frames that are there now, in order. A run that goes on adds to them.
    pub fn frames(&self) -> Result<Vec<u32>, IoError> {
        let failed = |error| IoError::system("read", &self.cache, &error);
        let mut numbers = Vec::new();
        for entry in fs::read_dir(&self.cache).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name();
            numbers.extend(frame_number(&name.to_string_lossy()));
        }
        numbers.sort_unstable();
        Ok(numbers)
    }

    /// One frame, at the precision of the cache. Arrays that this version does not know are left aside.
    pub fn frame(&self, number: u32) -> Result<Frame, IoError> {
        let path = self.cache.join(frame_name(number));
        if !path.exists() {
            let frames = self.frames()?;
            let hint = match (frames.first(), frames.last()) {
                (Some(first), Some(last)) => format!("there are frames {first} to {last}"),
                _ => "the run has not finished its first frame yet".to_string(),
            };
            return Err(IoError::content(&self.cache, format!("there is no frame {number}"), hint));
        }
        let frame = read_frame(read_whole(&path)?).map_err(|problem| IoError::content(&path, problem, DAMAGED))?;
        Ok(frame)
    }

    /// Flags of the triangles of a frame, without the rest of it: 1 while a triangle is part of the surface.
    pub fn triangles_alive(&self, number: u32) -> Result<Vec<u8>, IoError> {
        let path = self.cache.join(frame_name(number));
        let mut flags = Vec::new();
        NpzReader::new(read_whole(&path)?)
            .and_then(|mut npz| npz.fill("triangle_alive", DataMut::U8(&mut flags)))
            .map_err(|problem| IoError::content(&path, problem, DAMAGED))?;
        Ok(flags)
    }

    /// The state to go on from, if the run has written one.
    pub fn checkpoint(&self) -> Result<Option<Checkpoint>, IoError> {
        checkpoint::read(&self.cache)
    }
}

fn read_frame(bytes: Vec<u8>) -> Result<Frame, String> {
    let mut npz = NpzReader::new(bytes)?;
    let mut frame = Frame { number: npz.number("number")? as u32, time: npz.number("time")?, ..Frame::default() };
    let names = npz.names();
    for (name, data) in frame_columns_mut(&mut frame) {
        if names.contains(&name) || !may_be_missing(&name) {
            npz.fill(&name, data)?;
        }
    }
    // Caches of earlier versions know the point of the input that a node comes from, but not the place between points.
    if npz.has("origin_face") {
        for (name, data) in frame.origins.columns_mut() {
            npz.fill(name, data)?;
        }
    } else {
        frame.origins = Origins::of_corners(&frame.motion, &frame.triangles);
    }
    frame.burn.particle.resize(frame.motion.len(), NONE);
    frame.triangles.parted.resize(frame.triangles.len(), 0);
    let one_length = |columns: Vec<charcloth::fields::Column<'_>>, rows: usize| {
        columns
            .iter()
            .find(|c| c.data.len() != rows)
            .map_or(Ok(()), |c| Err(format!("the array {} has {} rows where others have {rows}", c.name, c.data.len())))
    };
    one_length(frame.motion.columns(), frame.motion.len())?;
    one_length(frame.burn.columns(), frame.motion.len())?;
    one_length(frame.origins.columns(), frame.motion.len())?;
    one_length(frame.triangles.columns(), frame.triangles.len())?;
    one_length(frame.pieces.columns(), frame.pieces.len())?;
    one_length(frame.particles.columns(), frame.particles.len())?;
    let nodes = frame.motion.len();
    if let Some(bad) = frame.triangles.corners.iter().flatten().find(|i| **i as usize >= nodes) {
        return Err(format!("a triangle names node {bad}, but there are {nodes} nodes"));
    }
    Ok(frame)
}
