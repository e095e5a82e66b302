//! Draws a run while it is simulated, on a thread of its own.
//!
//! Pictures are a by-product: where they cannot be made, the run goes on, and the reason is told at its end.

use crate::film::{Film, Shot};
use crate::run_folder;
use anyhow::anyhow;
use charcloth::frame::Frame;
use charcloth_io::cache::CacheReader;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Frames that may wait to be drawn; a slow renderer then slows the simulation, and memory stays bounded.
const QUEUE: usize = 3;

/// What is to be drawn.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Folder of the run.
    pub folder: PathBuf,
    /// How it is drawn.
    pub shot: Shot,
    /// Whether there is a movie.
    pub movie: bool,
    /// First frame of the movie.
    pub movie_from: u32,
    /// Frames kept as stills.
    pub stills: BTreeSet<u32>,
    /// A resumed run: frames up to this one are in the cache and are drawn first.
    pub resumed_from: Option<u32>,
}

/// What has been drawn.
#[derive(Debug, Clone, Default)]
pub struct Pictures {
    /// The movie.
    pub movie: Option<PathBuf>,
    /// The stills, in order.
    pub stills: Vec<PathBuf>,
}

/// The thread that draws.
#[derive(Debug)]
pub struct Preview {
    frames: Option<SyncSender<Frame>>,
    thread: Option<JoinHandle<anyhow::Result<Pictures>>>,
}

impl Preview {
    /// Starts to draw.
    pub fn start(plan: Plan) -> anyhow::Result<Self> {
        let (frames, waiting) = sync_channel(QUEUE);
        let thread = std::thread::Builder::new().name("preview".to_owned()).spawn(move || draw(&plan, &waiting))?;
        Ok(Self { frames: Some(frames), thread: Some(thread) })
    }

    /// Hands over a frame. A thread that has given up takes none, and says why at the end.
    pub fn frame(&mut self, frame: &Frame) {
        if self.frames.as_ref().is_some_and(|frames| frames.send(frame.clone()).is_err()) {
            self.frames = None;
        }
    }

    /// Waits until all is drawn. Called again, it has nothing to say.
    pub fn finish(&mut self) -> anyhow::Result<Pictures> {
        drop(self.frames.take());
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(Pictures::default()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(anyhow!("the renderer failed on this frame")),
        }
    }
}

/// The thread's side.
fn draw(plan: &Plan, waiting: &Receiver<Frame>) -> anyhow::Result<Pictures> {
    let mut pictures = Pictures::default();
    let mut film = None;
    if let Some(last) = plan.resumed_from {
        let cache = CacheReader::open(&plan.folder)?;
        for number in cache.frames()?.into_iter().filter(|number| *number <= last) {
            add(plan, &mut film, &cache.frame(number)?, &mut pictures)?;
        }
    }
    while let Ok(frame) = waiting.recv() {
        add(plan, &mut film, &frame, &mut pictures)?;
    }
    if let Some((film, count)) = film
        && count > 0
    {
        pictures.movie = film.finish()?;
    }
    Ok(pictures)
}

/// Draws one frame; the first sets the camera up.
fn add(plan: &Plan, film: &mut Option<(Film, u32)>, frame: &Frame, pictures: &mut Pictures) -> anyhow::Result<()> {
    let (film, count) = match film {
        Some(film) => film,
        None => {
            let movie = plan.folder.join(run_folder::MOVIE);
            film.insert((Film::build(&plan.shot, frame, plan.movie.then_some(movie.as_path()))?, 0))
        }
    };
    let still = plan.stills.contains(&frame.number).then(|| plan.folder.join(run_folder::still_name(frame.number)));
    let is_filmed = plan.movie && frame.number >= plan.movie_from;
    if is_filmed {
        *count += 1;
        film.frame(frame, still.as_deref())?;
    } else if let Some(path) = &still {
        film.still(frame, path)?;
    }
    pictures.stills.extend(still);
    Ok(())
}
