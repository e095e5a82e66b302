//! From linear light to a picture: bloom, tone curve, sRGB.

use crate::image::RgbImage;
use glam::Vec3;
use glam::Vec3A as Light;
use rayon::prelude::*;

/// The bloom is worked out on pixels this many times as wide.
const COARSE: usize = 4;
/// The table from light to sRGB has 2^7 entries for each doubling of the light: it is read by the upper bits of the
/// number, which are its exponent and the first 7 bits of its fraction.
const DROPPED_BITS: u32 = 23 - 7;
/// Least and most light in the table; less is shown as this, which is black, and more as white.
const DARKEST: f32 = 1.0 / 8192.0;
const BRIGHTEST: f32 = 32.0;

/// How light becomes a picture.
#[derive(Debug, Clone)]
pub struct Post {
    table: Vec<f32>,
    over_bright: Vec<Light>,
    wide: Vec<Light>,
    swap: Vec<Light>,
}

impl Default for Post {
    fn default() -> Self {
        Self::build(filmic)
    }
}

impl Post {
    /// With a tone curve from scene light to display light, both linear.
    pub fn build(tone: fn(f32) -> f32) -> Self {
        let first = DARKEST.to_bits() >> DROPPED_BITS;
        let last = BRIGHTEST.to_bits() >> DROPPED_BITS;
        let table = (first..=last)
            .map(|i| {
                let middle = f32::from_bits((i << DROPPED_BITS) | (1 << (DROPPED_BITS - 1)));
                encode(tone(middle)) * 255.0
            })
            .collect();
        Self { table, over_bright: Vec::new(), wide: Vec::new(), swap: Vec::new() }
    }

    /// Spreads what is brighter than white over its surroundings, in linear light.
    pub fn bloom(&mut self, picture: &mut [Light], size: [u32; 2]) {
        let [width, height] = size.map(|side| side as usize);
        let (across, down) = (width.div_ceil(COARSE), height.div_ceil(COARSE));
        self.over_bright.resize(across * down, Light::ZERO);
        let source: &[Light] = picture;
        self.over_bright.par_chunks_mut(across).enumerate().for_each(|(row, cells)| {
            for (column, cell) in cells.iter_mut().enumerate() {
                let mut sum = Light::ZERO;
                for y in row * COARSE..((row + 1) * COARSE).min(height) {
                    for x in column * COARSE..((column + 1) * COARSE).min(width) {
                        sum += (source[y * width + x] - Light::ONE).max(Light::ZERO);
                    }
                }
                *cell = sum / (COARSE * COARSE) as f32;
            }
        });
        if self.over_bright.iter().all(|cell| *cell == Light::ZERO) {
            return;
        }
        // Widths are parts of the picture, so that a small picture is the large one seen from afar.
        let narrow = height as f32 / 240.0 / COARSE as f32;
        self.wide.clone_from(&self.over_bright);
        blur(&mut self.over_bright, &mut self.swap, across, down, narrow);
        blur(&mut self.wide, &mut self.swap, across, down, narrow * 5.0);
        for (tight, wide) in self.over_bright.iter_mut().zip(&self.wide) {
            // tuned: strong enough to read as glare, weak enough that char beside the line stays black.
            *tight = *tight * 0.22 + *wide * 0.16;
        }
        let glare = &self.over_bright;
        picture.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
            let (above, below, fy) = between(y, down);
            let (above, below) = (&glare[above * across..][..across], &glare[below * across..][..across]);
            for (x, pixel) in line.iter_mut().enumerate() {
                let (left, right, fx) = between(x, across);
                let (low, high) = (above[left].lerp(below[left], fy), above[right].lerp(below[right], fy));
                *pixel += low.lerp(high, fx);
            }
        });
    }

    /// Writes linear light into a picture of the same size.
    pub fn develop(&self, light: &[Light], image: &mut RgbImage) {
        let width = image.width as usize;
        image.pixels.par_chunks_mut(width).zip(light.par_chunks(width)).enumerate().for_each(|(y, (pixels, line))| {
            for (x, (pixel, light)) in pixels.iter_mut().zip(line).enumerate() {
                // Half a level of fixed grain hides the steps of the dark background.
                let grain = grain(x as u32, y as u32);
                let light = light.clamp(Light::splat(DARKEST), Light::splat(BRIGHTEST)).to_array();
                for c in 0..3 {
                    let i = (light[c].to_bits() >> DROPPED_BITS) - (DARKEST.to_bits() >> DROPPED_BITS);
                    pixel[c] = (self.table[i as usize] + grain) as u8;
                }
            }
        });
    }
}

/// A number from 0 to 1 for each pixel.
fn grain(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 13)).wrapping_mul(0x297a_2d39);
    0.25 + 0.5 * ((h >> 8) as f32 / 16_777_216.0)
}

/// Film-like curve with a toe and a shoulder: the rational fit to the ACES curve of [Narkowicz2016].
pub fn filmic(x: f32) -> f32 {
    ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
}

/// No curve: light is shown as it is.
pub fn plain(x: f32) -> f32 {
    x.min(1.0)
}

/// Linear light to sRGB [Iec1999].
fn encode(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// sRGB as bytes to linear light, for colours written down in design tools.
pub fn decode(bytes: [u8; 3]) -> Vec3 {
    Vec3::from_array(bytes.map(|b| {
        let x = f32::from(b) / 255.0;
        if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
    }))
}

/// Gaussian blur, columns then rows; `width` is the standard deviation in cells.
fn blur(cells: &mut [Light], swap: &mut Vec<Light>, across: usize, down: usize, width: f32) {
    let reach = (width * 3.0).ceil() as isize;
    let mut kernel: Vec<f32> =
        (-reach..=reach).map(|i| (-(i * i) as f32 / (2.0 * width * width).max(1e-6)).exp()).collect();
    let total: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= total);
    swap.resize(cells.len(), Light::ZERO);
    let source: &[Light] = cells;
    swap.par_chunks_mut(across).enumerate().for_each(|(y, line)| {
        line.fill(Light::ZERO);
        for (k, weight) in kernel.iter().enumerate() {
            let from = y as isize + k as isize - reach;
            if (0..down as isize).contains(&from) {
                let from = &source[from as usize * across..][..across];
                line.iter_mut().zip(from).for_each(|(cell, other)| *cell += *other * *weight);
            }
        }
    });
    let source: &[Light] = swap;
    cells.par_chunks_mut(across).zip(source.par_chunks(across)).for_each(|(line, from)| {
        line.fill(Light::ZERO);
        for (k, weight) in kernel.iter().enumerate() {
            let shift = k as isize - reach;
            let first = (-shift).clamp(0, across as isize) as usize;
            let last = (across as isize - shift).clamp(0, across as isize) as usize;
            for x in first..last {
                line[x] += from[(x as isize + shift) as usize] * *weight;
            }
        }
    });
}

/// The two coarse cells a fine pixel lies between, and how far it is on the way to the second.
#[inline]
fn between(i: usize, count: usize) -> (usize, usize, f32) {
    // Half a cell back, because values sit in the middle of their cells.
    let at = i + COARSE / 2;
    let second = (at / COARSE).min(count - 1);
    let first = (at / COARSE).saturating_sub(1).min(count - 1);
    (first, second, ((at % COARSE) as f32 + 0.5) / COARSE as f32)
}
