//! From frames to picture files: the one place that knows the renderer.

use anyhow::Context;
use charcloth::contact::scenery::Scenery;
use charcloth::frame::Frame;
use charcloth::scene::Scene;
use charcloth::sheet::bounds;
use charcloth_render::image::RgbImage;
use charcloth_render::{MovieWriter, Renderer, View, look_of, write_png};
use std::path::{Path, PathBuf};

/// How a run is to be drawn.
#[derive(Debug, Clone)]
pub struct Shot {
    /// The scene: camera, size, frames a second.
    pub scene: Scene,
    /// What the sheet meets.
    pub scenery: Scenery,
    /// A look by name, if not that of the scene.
    pub look: Option<String>,
}

/// Draws frames and writes them as stills and into a movie.
pub struct Film {
    renderer: Renderer,
    image: RgbImage,
    movie: Option<(PathBuf, MovieWriter)>,
}

impl Film {
    /// Sets the camera up before the sheet as it lies in the first frame.
    pub fn build(shot: &Shot, first: &Frame, movie: Option<&Path>) -> anyhow::Result<Self> {
        let Scene { output, up, time, .. } = &shot.scene;
        let view = View {
            settings: output.camera.clone(),
            up: *up,
            bounds: bounds(&first.motion.position),
            size: output.size,
            scenery: shot.scenery.clone(),
        };
        let renderer = Renderer::of(&view, shot.look.as_deref().unwrap_or(look_of(output.style)))?;
        let [width, height] = output.size;
        let create = |path: &Path| -> anyhow::Result<_> {
            Ok((path.to_owned(), MovieWriter::create(path, width, height, time.fps)?))
        };
        Ok(Self { renderer, image: RgbImage::black(width, height)?, movie: movie.map(create).transpose()? })
    }

    /// Draws a frame into the movie, and into a still, if one is named.
    pub fn frame(&mut self, frame: &Frame, still: Option<&Path>) -> anyhow::Result<()> {
        self.renderer.render_into(frame, &mut self.image)?;
        if let Some(path) = still {
            write_png(path, &self.image)?;
        }
        if let Some((_, movie)) = &mut self.movie {
            movie.frame(&self.image)?;
        }
        Ok(())
    }

    /// Draws a frame into a still only.
    pub fn still(&mut self, frame: &Frame, path: &Path) -> anyhow::Result<()> {
        self.renderer.render_into(frame, &mut self.image)?;
        Ok(write_png(path, &self.image)?)
    }

    /// Ends the movie; its file is there then.
    pub fn finish(self) -> anyhow::Result<Option<PathBuf>> {
        let Some((path, movie)) = self.movie else { return Ok(None) };
        movie.finish().context("the movie could not be finished")?;
        Ok(Some(path))
    }
}
