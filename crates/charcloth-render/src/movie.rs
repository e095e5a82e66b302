//! Movies: H.264 in MP4, in pure Rust, on a thread of its own so that encoding overlaps drawing.
//!
//! The film is High profile, 4:2:0, BT.709, with a keyframe every second at most and its header in front, so that
//! browsers, editors and phones play it. Odd sides lose their last row or column: the format has none.

use crate::error::RenderError;
use crate::image::RgbImage;
use crate::picture::temporary_name;
use crate::video_signal::{Planes, tag_colours};
use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use rusty_h264_common::YuvPlanes;
use rusty_h264_encoder::{Encoder, EncoderConfig, Preset};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Quantiser of the encoder, 0 (lossless, huge) to 51.
/// tuned: 16 to 26; 20 keeps burning paper over 40 dB at 1 to 3 Mbit/s.
const QUANTISER: u8 = 20;
/// Pictures that may wait for the encoder.
const QUEUE: usize = 3;

/// Writes a movie, picture by picture.
#[derive(Debug)]
pub struct MovieWriter {
    path: PathBuf,
    size: [u32; 2],
    pictures: Option<SyncSender<RgbImage>>,
    used: Receiver<RgbImage>,
    encoder: Option<JoinHandle<Result<(), RenderError>>>,
    count: u64,
}

impl MovieWriter {
    /// Opens a movie for pictures of this size [pixels] and rate [frames/s]. The file appears when it is finished.
    pub fn create(path: &Path, width: u32, height: u32, frames_per_second: f64) -> Result<Self, RenderError> {
        // The format counts in macroblocks of 16 and needs one of them; H.264 ends at level 6.2.
        if width < 16 || height < 16 || width > 8192 || height > 4320 {
            return Err(RenderError::movie(
                path,
                format!("a movie of {width} x {height} pixels cannot be made; take 16 x 16 to 8192 x 4320"),
            ));
        }
        if !(frames_per_second.is_finite() && (0.1..=1000.0).contains(&frames_per_second)) {
            return Err(RenderError::movie(
                path,
                format!("{frames_per_second} frames a second cannot be filmed; take 0.1 to 1000"),
            ));
        }
        let temporary = temporary_name(path);
        let file = File::create(&temporary).map_err(|e| RenderError::file(path, e))?;
        let film = Film::build(path, file, [width & !1, height & !1], frames_per_second)?;
        let (pictures, waiting) = sync_channel::<RgbImage>(QUEUE);
        let (give_back, used) = sync_channel::<RgbImage>(QUEUE + 1);
        let encoder = std::thread::Builder::new()
            .name("movie".into())
            .spawn(move || film.run(&waiting, &give_back))
            .map_err(|e| RenderError::file(path, e))?;
        Ok(Self {
            path: path.to_path_buf(),
            size: [width, height],
            pictures: Some(pictures),
            used,
            encoder: Some(encoder),
            count: 0,
        })
    }

    /// Adds a picture. Waits while the encoder is more than a few pictures behind.
    pub fn frame(&mut self, image: &RgbImage) -> Result<(), RenderError> {
        let [width, height] = self.size;
        if [image.width, image.height] != self.size || image.pixels.len() != width as usize * height as usize {
            let (got_width, got_height) = (image.width, image.height);
            return Err(RenderError::MovieSize { width, height, got_width, got_height });
        }
        let mut copy = self.used.try_recv().unwrap_or_default();
        copy.clone_from(image);
        let sent = self.pictures.as_ref().is_some_and(|pictures| pictures.send(copy).is_ok());
        if !sent {
            // The encoder only hangs up early when it has failed; its error says why.
            self.join()?;
            return Err(RenderError::movie(&self.path, "the encoder has stopped"));
        }
        self.count += 1;
        Ok(())
    }

    /// Ends the movie and gives it its name.
    pub fn finish(mut self) -> Result<(), RenderError> {
        self.join()?;
        if self.count == 0 {
            return Err(RenderError::movie(&self.path, "the movie has no pictures, so no file was written"));
        }
        std::fs::rename(temporary_name(&self.path), &self.path).map_err(|e| RenderError::file(&self.path, e))?;
        Ok(())
    }

    fn join(&mut self) -> Result<(), RenderError> {
        drop(self.pictures.take());
        match self.encoder.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(RenderError::movie(&self.path, "the encoder failed on this picture")),
        }
    }
}

impl Drop for MovieWriter {
    fn drop(&mut self) {
        // Errors were told by `finish`; what is left is an unfinished file, or nothing.
        let _ = self.join();
        let _ = std::fs::remove_file(temporary_name(&self.path));
    }
}

/// The encoder's side: pictures in, file out.
struct Film {
    path: PathBuf,
    size: [u32; 2],
    frames_per_second: f64,
    encoder: Encoder,
    muxer: Muxer<BufWriter<File>>,
}

impl Film {
    fn build(path: &Path, file: File, size: [u32; 2], frames_per_second: f64) -> Result<Self, RenderError> {
        let [width, height] = size;
        let mut config = EncoderConfig::new(width as usize, height as usize);
        config.preset = Preset::Fast;
        config.qp = QUANTISER;
        config.bitrate = 0;
        config.framerate = frames_per_second as f32;
        config.gop_size = frames_per_second.round().clamp(1.0, 250.0) as u32;
        // One picture in, one picture out, in order: nothing to flush, and no decode times to keep.
        config.bframes = 0;
        config.bframes_adaptive = false;
        config.scenecut = 0;
        config.lookahead = 0;
        config.mbtree = false;
        config.level_idc = level(size, frames_per_second);
        let encoder = Encoder::new(config).map_err(|e| RenderError::movie(path, format!("{e:?}")))?;
        let muxer = MuxerBuilder::new(BufWriter::new(file))
            .video(VideoCodec::H264, width, height, frames_per_second)
            .with_fast_start(true)
            .build()
            .map_err(|e| RenderError::movie(path, e))?;
        Ok(Self { path: path.to_path_buf(), size, frames_per_second, encoder, muxer })
    }

    fn run(mut self, pictures: &Receiver<RgbImage>, give_back: &SyncSender<RgbImage>) -> Result<(), RenderError> {
        let mut planes = Planes::default();
        let mut number = 0u64;
        while let Ok(image) = pictures.recv() {
            planes.convert(&image, self.size);
            let _ = give_back.try_send(image);
            let [width, height] = self.size.map(|side| side as usize);
            let picture = YuvPlanes {
                width,
                height,
                y: &planes.luma,
                u: &planes.blue,
                v: &planes.red,
                stride_y: width,
                stride_c: width / 2,
            };
            let coded =
                self.encoder.encode_planes(&picture).map_err(|e| RenderError::movie(&self.path, format!("{e:?}")))?;
            let (coded, keyframe) = tag_colours(&coded);
            let time = number as f64 / self.frames_per_second;
            self.muxer.write_video(time, &coded, keyframe).map_err(|e| RenderError::movie(&self.path, e))?;
            number += 1;
        }
        if number > 0 {
            self.muxer.finish().map_err(|e| RenderError::movie(&self.path, e))?;
        }
        Ok(())
    }
}

/// The least H.264 level that holds the picture and the rate (ITU-T H.264, table A-1), times ten.
fn level([width, height]: [u32; 2], frames_per_second: f64) -> u8 {
    let blocks = f64::from(width.div_ceil(16) * height.div_ceil(16));
    let rate = blocks * frames_per_second;
    const LEVELS: [(u8, f64, f64); 9] = [
        (30, 1620.0, 40_500.0),
        (31, 3600.0, 108_000.0),
        (32, 5120.0, 216_000.0),
        (40, 8192.0, 245_760.0),
        (42, 8704.0, 522_240.0),
        (51, 36_864.0, 983_040.0),
        (52, 36_864.0, 2_073_600.0),
        (60, 139_264.0, 4_177_920.0),
        (61, 139_264.0, 8_355_840.0),
    ];
    LEVELS.iter().find(|(_, most, fastest)| blocks <= *most && rate <= *fastest).map_or(62, |(level, ..)| *level)
}
