//! Maps: what burns, as pictures in the space of the texture coordinates, for shaders on a mesh of one's own.
//!
//! Texture coordinates belong to the corners of triangles and never change, so which triangle a texel shows is found
//! out once. Around the covered texels a gutter repeats the nearest of them, so that filters do not mix in what lies
//! between the patches of a texture.

use super::pictures::{write_exr, write_png};
use super::quantities::{char, temperature};
use super::sequence::Sequence;
use super::{each, numbered};
use crate::error::IoError;
use crate::files::{Durability, write_whole};
use charcloth::frame::Frame;
use charcloth::sheet::{NONE, Triangles};
use glam::{DVec2, DVec3};
use png::{BitDepth, ColorType};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Sides that maps can have [texels].
const SIDES: std::ops::RangeInclusive<u32> = 16..=8192;
/// Temperature that is white in the PNG [K]; what is hotter is white, too. tuned: paper burns at up to some 1300 K.
const WHITE: f64 = 1500.0;
/// "Never" in the PNG of arrival times.
const NEVER: u16 = u16::MAX;

/// Names of the files of frames of these numbers.
pub(super) fn files(frames: &[u32]) -> Vec<String> {
    let mut names = ["maps.json", "arrival.exr", "arrival.png"].map(String::from).to_vec();
    ["exr", "png"].iter().for_each(|extension| names.extend(each(frames, "burn", extension)));
    names
}

/// Which triangle each texel shows, row by row from the top.
struct Coverage {
    side: usize,
    /// Row in the triangle table; `NONE` where the texture shows nothing.
    triangle: Vec<u32>,
    /// Weights of the first two corners; the third has the rest.
    weights: Vec<[f32; 2]>,
}

/// Writes `burn_00000.exr` and `burn_00000.png` a frame, `arrival.exr`, `arrival.png` and `maps.json` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let (side, gutter) = (sequence.options().resolution, sequence.options().gutter);
    if !SIDES.contains(&side) {
        let problem = format!("maps of {side} texels cannot be made");
        let hint = format!("choose a resolution from {} to {}", SIDES.start(), SIDES.end());
        return Err(IoError::content(folder, problem, hint));
    }
    let first = sequence.first()?;
    let mut coverage = Coverage::of(&first.triangles, side as usize);
    if coverage.triangle.iter().all(|t| *t == NONE) {
        let problem = "no texture coordinates between 0 and 1: there is nothing to draw";
        return Err(IoError::content(folder, problem, "unwrap the mesh before it is burnt"));
    }
    coverage.grow(gutter);
    drop(first);

    let (mut files, mut numbers, mut duration) = (Vec::new(), Vec::new(), 0.0);
    let mut path = folder.join("maps.json");
    while let Some(frame) = sequence.next(&path)? {
        let texel = |y: usize, x: usize| coverage.sample(&frame, y, x);
        path = folder.join(numbered("burn", frame.number, "exr"));
        write_exr(&path, [coverage.side; 2], &["B", "G", "R"], &mut |y, row| {
            for x in 0..coverage.side {
                let [temperature, char, alive] = texel(y, x);
                for (channel, sample) in [alive, char, temperature].into_iter().enumerate() {
                    row[channel * coverage.side + x] = sample as f32;
                }
            }
            Ok(())
        })?;
        files.push(path.clone());
        let picture = folder.join(numbered("burn", frame.number, "png"));
        write_png(&picture, [coverage.side; 2], ColorType::Rgb, BitDepth::Eight, &mut |y, row| {
            for (x, bytes) in row.chunks_exact_mut(3).enumerate() {
                let [temperature, char, alive] = texel(y, x);
                bytes.copy_from_slice(&[temperature / WHITE, char, alive].map(|v| (v * 255.0).round() as u8));
            }
            Ok(())
        })?;
        files.push(picture);
        numbers.push(frame.number);
        duration = frame.time;
    }
    // The last frame knows when each node caught fire.
    let last = sequence.last()?;
    let path = folder.join("arrival.exr");
    write_exr(&path, [coverage.side; 2], &["Y"], &mut |y, row| {
        row.iter_mut().enumerate().for_each(|(x, sample)| *sample = coverage.arrival(&last, y, x) as f32);
        Ok(())
    })?;
    files.push(path);
    let path = folder.join("arrival.png");
    let end = last.time.max(f64::MIN_POSITIVE);
    write_png(&path, [coverage.side; 2], ColorType::Grayscale, BitDepth::Sixteen, &mut |y, row| {
        for (x, bytes) in row.chunks_exact_mut(2).enumerate() {
            let time = coverage.arrival(&last, y, x);
            let grey = if time < 0.0 { NEVER } else { (time / end * f64::from(NEVER - 1)).round() as u16 };
            bytes.copy_from_slice(&grey.to_be_bytes());
        }
        Ok(())
    })?;
    files.push(path);
    let text = json!({
        "format": "charcloth-maps",
        "version": 1,
        "scene": sequence.meta().scene,
        "fps": sequence.fps(),
        "frames": numbers,
        "last_time": duration,
        "resolution": side,
        "gutter": gutter,
        "about": "row 0 is the top, where the second texture coordinate is 1",
        "burn_exr": { "R": "temperature [K], 0 where the texture shows nothing", "G": "char, 0 to 1", "B": "alive, 0 or 1" },
        "burn_png": { "R": format!("temperature, 255 is {WHITE} K"), "G": "char, 255 is 1", "B": "alive, 255 is 1" },
        "arrival_exr": { "Y": "time at which the place caught fire [s], -1 where it has not" },
        "arrival_png": { "grey": format!("the same, 0 to {} is 0 to {end} s, {NEVER} where it has not", NEVER - 1) },
    });
    let path = folder.join("maps.json");
    write_whole(&path, Durability::Process, |out| {
        serde_json::to_writer_pretty(&mut *out, &text)?;
        out.write_all(b"\n")
    })?;
    files.insert(0, path);
    Ok(files)
}

impl Coverage {
    /// Finds the triangle at the centre of each texel; where several lie, the first.
    fn of(triangles: &Triangles, side: usize) -> Self {
        let mut coverage = Self { side, triangle: vec![NONE; side * side], weights: vec![[0.0; 2]; side * side] };
        for (t, uv) in triangles.uv.iter().enumerate() {
            if triangles.alive[t] != 0 {
                coverage.draw(t as u32, uv.map(|uv| DVec2::new(f64::from(uv.x), 1.0 - f64::from(uv.y)) * side as f64));
            }
        }
        coverage
    }

    /// Draws a triangle, its corners in texels.
    fn draw(&mut self, t: u32, [a, b, c]: [DVec2; 3]) {
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let low = a.min(b).min(c).max(DVec2::ZERO);
        let high = a.max(b).max(c).min(DVec2::splat(self.side as f64));
        for y in low.y.floor() as usize..high.y.ceil() as usize {
            for x in low.x.floor() as usize..high.x.ceil() as usize {
                let place = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let first = (b - place).perp_dot(c - place) / area;
                let second = (c - place).perp_dot(a - place) / area;
                let texel = y * self.side + x;
                // A texel on an edge is covered; rounding must leave no gap between neighbours.
                let inside = first.min(second).min(1.0 - first - second) >= -1e-9;
                if inside && self.triangle[texel] == NONE {
                    self.triangle[texel] = t;
                    self.weights[texel] = [first as f32, second as f32];
                }
            }
        }
    }

    /// Lets texels that show nothing show what the nearest one shows, up to a distance in texels.
    fn grow(&mut self, gutter: u32) {
        let side = self.side;
        let mut edge: Vec<usize> = (0..side * side).filter(|texel| self.triangle[*texel] != NONE).collect();
        for _ in 0..gutter {
            let mut fresh = Vec::new();
            for texel in edge {
                let (x, y) = (texel % side, texel / side);
                let beside = [
                    (x > 0).then(|| texel - 1),
                    (x + 1 < side).then(|| texel + 1),
                    (y > 0).then(|| texel - side),
                    (y + 1 < side).then(|| texel + side),
                ];
                for other in beside.into_iter().flatten() {
                    if self.triangle[other] == NONE {
                        self.triangle[other] = self.triangle[texel];
                        self.weights[other] = self.weights[texel];
                        fresh.push(other);
                    }
                }
            }
            edge = fresh;
        }
    }

    /// Nodes that a texel shows in a frame and their weights, with the row of the triangle.
    fn nodes(&self, frame: &Frame, y: usize, x: usize) -> Option<(usize, [usize; 3], [f64; 3])> {
        let texel = y * self.side + x;
        let t = self.triangle[texel] as usize;
        (self.triangle[texel] != NONE).then(|| {
            let [first, second] = self.weights[texel].map(f64::from);
            (t, frame.triangles.corners[t].map(|i| i as usize), [first, second, 1.0 - first - second])
        })
    }

    /// Temperature [K], char and whether it is alive at a texel.
    fn sample(&self, frame: &Frame, y: usize, x: usize) -> [f64; 3] {
        let Some((t, nodes, weights)) = self.nodes(frame, y, x) else { return [0.0; 3] };
        let weights = DVec3::from_array(weights);
        let mean = |value: fn(&Frame, usize) -> f64| weights.dot(DVec3::from_array(nodes.map(|i| value(frame, i))));
        [mean(temperature), mean(char).clamp(0.0, 1.0), f64::from(frame.triangles.alive[t])]
    }

    /// Time at which a texel caught fire, -1 where it has not [s]. The nearest corner says whether it has.
    fn arrival(&self, frame: &Frame, y: usize, x: usize) -> f64 {
        let Some((_, nodes, weights)) = self.nodes(frame, y, x) else { return -1.0 };
        let times = nodes.map(|i| frame.burn.ignited_at[i]);
        let nearest = (0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
        if times[nearest] < 0.0 {
            return -1.0;
        }
        let lit = || (0..3).filter(|k| times[*k] >= 0.0);
        lit().map(|k| weights[k] * times[k]).sum::<f64>() / lit().map(|k| weights[k]).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn the_gutter_repeats_the_nearest_texel() {
        let mut triangles = Triangles::zeros(2);
        triangles.alive.fill(1);
        // Two halves of the lower left quarter of the texture.
        triangles.uv[0] = [Vec2::ZERO, Vec2::new(0.5, 0.0), Vec2::new(0.5, 0.5)];
        triangles.uv[1] = [Vec2::ZERO, Vec2::new(0.5, 0.5), Vec2::new(0.0, 0.5)];
        let mut coverage = Coverage::of(&triangles, 16);
        let covered = |coverage: &Coverage| coverage.triangle.iter().filter(|t| **t != NONE).count();
        assert_eq!(covered(&coverage), 64);
        // The lower left is the last row, first column.
        assert_ne!(coverage.triangle[15 * 16], NONE);
        assert_eq!(coverage.triangle[15 * 16 + 7], 0);
        assert_eq!(coverage.triangle[8 * 16], 1);
        coverage.grow(2);
        assert_eq!(covered(&coverage), 64 + 2 * 16 + 1);
        assert_eq!(coverage.triangle[15 * 16 + 9], 0);
        assert_eq!(coverage.weights[15 * 16 + 9], coverage.weights[15 * 16 + 7]);
        assert_eq!(coverage.triangle[15 * 16 + 10], NONE);
    }
}
