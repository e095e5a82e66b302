//! A tiled rasteriser: which triangle each sample of each pixel sees, and what colour that makes.
//!
//! Model: four samples a pixel on a rotated grid, each with its own depth and coverage; the look is asked for a colour
//! once for each surface a pixel sees, not once a sample. Corners are snapped to 1/256 pixel and edges are tested in
//! integers with the top-left rule, so neighbouring triangles neither overlap nor leave gaps.
//!
//! Bands of tiles are drawn in parallel, each from its own list of triangles in table order: the pixels are the same on
//! any number of threads.

use crate::camera::Camera;
use glam::{DVec3, Vec3A};
use rayon::prelude::*;

/// Samples a pixel.
pub const SAMPLES: usize = 4;
/// Side of a tile [pixels].
const TILE: usize = 32;
/// Steps of the fixed-point grid in a pixel.
const STEPS: i32 = 256;
/// Where the samples are, in steps from the middle of the pixel: a grid turned by about 27 degrees.
const OFFSETS: [[i32; 2]; SAMPLES] = [[-32, -96], [96, -32], [-96, 32], [32, 96]];
/// Corners farther out than this are dropped [pixels]; with it every product below fits 64 bits.
const FAR_OUT: f64 = 65536.0;
/// Two samples of a pixel are of one surface if their depths differ by less than this part.
/// tuned: 0.2 to 2 %; 0.5 % is 4 mm at 0.8 m, more than a pixel of a sheet seen at 80 degrees.
const SAME_SURFACE: f32 = 0.005;
const NO_TRIANGLE: u32 = u32::MAX;

/// Triangles less wide than this are tested in 32 bits [pixels]: 48 pixels are 12288 steps, and the sum of two products
/// of such lengths stays under 2^30.
const SMALL: i32 = 48;

/// Integers that hold edge functions.
trait Edge: Copy + std::ops::Add<Output = Self> + std::ops::BitOr<Output = Self> {
    fn narrow(value: i64) -> Self;
    fn is_negative(self) -> bool;
    fn to_f32(self) -> f32;
}

macro_rules! edge {
    ($($integer:ty),*) => {$(
        impl Edge for $integer {
            #[inline]
            fn narrow(value: i64) -> Self {
                value as Self
            }
            #[inline]
            fn is_negative(self) -> bool {
                self < 0
            }
            #[inline]
            fn to_f32(self) -> f32 {
                self as f32
            }
        }
    )*};
}
edge!(i32, i64);

/// A piece of a triangle that a pixel sees.
#[derive(Debug, Clone, Copy)]
pub struct Fragment {
    /// Row of the triangle in the list that is drawn.
    pub triangle: usize,
    /// Weights of the three corners in space.
    pub weights: [f32; 3],
    /// Weights of the three corners on the picture.
    pub flat_weights: [f32; 3],
    /// Whether the anticlockwise side is seen.
    pub front: bool,
}

/// Gives colours to what the rasteriser finds.
pub trait Shader: Sync {
    /// Asks for a colour for every sample instead of every surface: for patterns thinner than a pixel.
    const EVERY_SAMPLE: bool = false;
    /// Whether `keeps` may say no anywhere on this triangle.
    fn may_cut(&self, _triangle: usize) -> bool {
        false
    }
    /// Whether the triangle is there at this point.
    fn keeps(&self, _triangle: usize, _weights: [f32; 3]) -> bool {
        true
    }
    /// Colour of a fragment, linear light.
    fn shade(&self, fragment: &Fragment) -> Vec3A;
    /// Colour where there is no sheet, linear light; `x` and `y` run from 0 to 1 over the picture. It is asked for once
    /// and kept, so it must not change from frame to frame.
    fn background(&self, x: f32, y: f32) -> Vec3A;
}

/// A corner on the picture.
#[derive(Debug, Clone, Copy, Default)]
struct Corner {
    x: i32,
    y: i32,
    inverse_depth: f32,
    visible: bool,
}

/// A triangle on the picture, ready for the sample test.
#[derive(Debug, Clone, Copy, Default)]
struct Setup {
    /// Steps of the three edge functions along x and y: `edge(x, y) = constant + x * along_x + y * along_y`.
    along_x: [i64; 3],
    along_y: [i64; 3],
    constant: [i64; 3],
    /// 1 where points exactly on the edge belong to the neighbour.
    bias: [i64; 3],
    inverse_depth: [f32; 3],
    /// One over twice the area in steps.
    inverse_area: f32,
    /// First and last pixel column and row that can be touched; empty when the first is greater.
    columns: [i32; 2],
    rows: [i32; 2],
    front: bool,
    /// Whether all of it is on the picture, so that columns and rows tell its size.
    whole: bool,
}

/// Depth and triangle of every sample of a tile.
#[derive(Debug, Clone)]
struct Tile {
    inverse_depth: Vec<f32>,
    triangle: Vec<u32>,
}

/// The rasteriser and its buffers.
#[derive(Debug, Clone, Default)]
pub struct Raster {
    corners: Vec<Corner>,
    setups: Vec<Setup>,
    bin_start: Vec<u32>,
    bin_next: Vec<u32>,
    bins: Vec<u32>,
    tiles: Vec<Tile>,
    background: Vec<Vec3A>,
    /// Inverse depth of what each pixel saw last, the nearest of its samples [1/m]; 0 for the background.
    pub depth: Vec<f32>,
}

impl Raster {
    /// Draws triangles over the background; `picture` takes a colour in linear light for each pixel.
    pub fn draw<S: Shader>(
        &mut self,
        camera: &Camera,
        position: &[DVec3],
        triangles: &[[u32; 3]],
        shader: &S,
        picture: &mut Vec<Vec3A>,
    ) {
        let [width, height] = camera.size.map(|side| side as usize);
        picture.resize(width * height, Vec3A::ZERO);
        if self.background.len() != picture.len() {
            self.background.clear();
            self.background.extend((0..width * height).map(|i| {
                let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                shader.background(x / width as f32, y / height as f32)
            }));
        }
        position.par_iter().map(|p| snap(camera, *p)).collect_into_vec(&mut self.corners);
        let corners = &self.corners;
        triangles
            .par_iter()
            .map(|t| Setup::build(t.map(|i| corners[i as usize]), width as i32, height as i32))
            .collect_into_vec(&mut self.setups);
        let tiles_across = width.div_ceil(TILE);
        let tiles_down = height.div_ceil(TILE);
        self.sort_into_bins(tiles_across, tiles_down);
        self.tiles.resize(
            tiles_down,
            Tile {
                inverse_depth: vec![0.0; TILE * TILE * SAMPLES],
                triangle: vec![NO_TRIANGLE; TILE * TILE * SAMPLES],
            },
        );
        let (setups, bins, bin_start, background) = (&self.setups, &self.bins, &self.bin_start, &self.background);
        self.depth.resize(width * height, 0.0);
        let bands = picture.par_chunks_mut(width * TILE).zip(self.depth.par_chunks_mut(width * TILE));
        bands.zip(&mut self.tiles).enumerate().for_each(|(band, ((pixels, depth), tile))| {
            depth.fill(0.0);
            for column in 0..tiles_across {
                let bin = band * tiles_across + column;
                let inside = &bins[bin_start[bin] as usize..bin_start[bin + 1] as usize];
                let origin = [column * TILE, band * TILE];
                let size = [TILE.min(width - origin[0]), TILE.min(height - origin[1])];
                if !inside.is_empty() {
                    tile.inverse_depth.fill(0.0);
                    tile.triangle.fill(NO_TRIANGLE);
                    for t in inside {
                        tile.cover(*t, &setups[*t as usize], origin, size, shader);
                    }
                }
                for row in 0..size[1] {
                    let line = &mut pixels[row * width + origin[0]..][..size[0]];
                    let behind = &background[(origin[1] + row) * width + origin[0]..][..size[0]];
                    if inside.is_empty() {
                        line.copy_from_slice(behind);
                        continue;
                    }
                    for (x, pixel) in line.iter_mut().enumerate() {
                        let place = [(origin[0] + x) as i64, (origin[1] + row) as i64];
                        let first = (row * TILE + x) * SAMPLES;
                        *pixel = tile.resolve(first, setups, place, shader, behind[x]);
                        let samples = &tile.inverse_depth[first..first + SAMPLES];
                        depth[row * width + origin[0] + x] = samples.iter().copied().fold(0.0, f32::max);
                    }
                }
            }
        });
    }

    /// Lists the triangles of each tile, in table order.
    fn sort_into_bins(&mut self, across: usize, down: usize) {
        let tile = TILE as i32;
        self.bin_start.clear();
        self.bin_start.resize(across * down + 1, 0);
        let touched = |setup: &Setup| {
            let [first, last] = setup.columns.map(|c| (c / tile) as usize);
            let [top, bottom] = setup.rows.map(|r| (r / tile) as usize);
            let empty = setup.columns[0] > setup.columns[1] || setup.rows[0] > setup.rows[1];
            let rows = if empty { 0..0 } else { top..bottom + 1 };
            rows.flat_map(move |r| (first..last + 1).map(move |c| r * across + c))
        };
        for setup in &self.setups {
            for bin in touched(setup) {
                self.bin_start[bin + 1] += 1;
            }
        }
        for bin in 0..across * down {
            self.bin_start[bin + 1] += self.bin_start[bin];
        }
        self.bin_next.clear();
        self.bin_next.extend_from_slice(&self.bin_start[..across * down]);
        self.bins.clear();
        self.bins.resize(self.bin_start[across * down] as usize, 0);
        for (t, setup) in self.setups.iter().enumerate() {
            for bin in touched(setup) {
                self.bins[self.bin_next[bin] as usize] = t as u32;
                self.bin_next[bin] += 1;
            }
        }
    }
}

/// A point on the fixed-point grid.
fn snap(camera: &Camera, point: DVec3) -> Corner {
    let projected = camera.project(point);
    // What is nearer than a hundredth of the sheet is on the lens.
    let near = 1.0 / (0.01 * camera.radius);
    if !(projected.inverse_depth > 0.0 && projected.inverse_depth < near)
        || projected.x.abs() > FAR_OUT
        || projected.y.abs() > FAR_OUT
    {
        return Corner::default();
    }
    let steps = f64::from(STEPS);
    Corner {
        x: (projected.x * steps).round() as i32,
        y: (projected.y * steps).round() as i32,
        inverse_depth: projected.inverse_depth as f32,
        visible: true,
    }
}

impl Setup {
    fn build(corners: [Corner; 3], width: i32, height: i32) -> Self {
        let nothing = Self { columns: [1, 0], rows: [1, 0], ..Self::default() };
        if corners.iter().any(|c| !c.visible) {
            return nothing;
        }
        let x = corners.map(|c| i64::from(c.x));
        let y = corners.map(|c| i64::from(c.y));
        let twice_area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
        if twice_area == 0 {
            return nothing;
        }
        let sign = twice_area.signum();
        let mut setup = Self {
            inverse_depth: corners.map(|c| c.inverse_depth),
            inverse_area: 1.0 / (twice_area * sign) as f32,
            // Rows run downwards, so anticlockwise in space is clockwise in numbers.
            front: sign < 0,
            ..nothing
        };
        for k in 0..3 {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let (dx, dy) = ((x[b] - x[a]) * sign, (y[b] - y[a]) * sign);
            setup.along_x[k] = -dy;
            setup.along_y[k] = dx;
            setup.constant[k] = dy * x[a] - dx * y[a];
            setup.bias[k] = i64::from(!(dy < 0 || (dy == 0 && dx > 0)));
        }
        let range = |values: [i64; 3], size: i32| {
            let low = values.into_iter().min().unwrap_or(0);
            let high = values.into_iter().max().unwrap_or(0);
            let steps = i64::from(STEPS);
            [low.div_euclid(steps).max(0) as i32, high.div_euclid(steps).min(i64::from(size) - 1) as i32]
        };
        let on =
            |values: [i64; 3], size: i32| values.iter().all(|v| (0..i64::from(size) * i64::from(STEPS)).contains(v));
        setup.whole = on(x, width) && on(y, height);
        setup.columns = range(x, width);
        setup.rows = range(y, height);
        setup
    }

    /// The three edge functions at a point in steps.
    #[inline]
    fn edges(&self, x: i64, y: i64) -> [i64; 3] {
        std::array::from_fn(|k| self.constant[k] + self.along_x[k] * x + self.along_y[k] * y)
    }

    /// Weights on the picture, from the edge functions.
    #[inline]
    fn flat_weights(&self, edges: [i64; 3]) -> [f32; 3] {
        edges.map(|e| e as f32 * self.inverse_area)
    }

    #[inline]
    fn inverse_depth(&self, flat: [f32; 3]) -> f32 {
        flat[0] * self.inverse_depth[0] + flat[1] * self.inverse_depth[1] + flat[2] * self.inverse_depth[2]
    }

    /// Weights in space: those on the picture, each over its corner's depth.
    #[inline]
    fn weights(&self, flat: [f32; 3]) -> [f32; 3] {
        let scale = 1.0 / self.inverse_depth(flat);
        std::array::from_fn(|k| flat[k] * self.inverse_depth[k] * scale)
    }
}

impl Tile {
    /// Marks the samples that a triangle covers.
    fn cover<S: Shader>(&mut self, t: u32, setup: &Setup, origin: [usize; 2], size: [usize; 2], shader: &S) {
        let [left, top] = origin.map(|o| o as i32);
        let columns = [setup.columns[0].max(left), setup.columns[1].min(left + size[0] as i32 - 1)];
        let rows = [setup.rows[0].max(top), setup.rows[1].min(top + size[1] as i32 - 1)];
        let extent = (setup.columns[1] - setup.columns[0]).max(setup.rows[1] - setup.rows[0]);
        let small = extent < SMALL && setup.whole;
        if small {
            self.cover_with::<i32, S>(t, setup, columns, rows, origin, shader);
        } else {
            self.cover_with::<i64, S>(t, setup, columns, rows, origin, shader);
        }
    }

    /// The same with edge functions in the given integers.
    fn cover_with<I: Edge, S: Shader>(
        &mut self,
        t: u32,
        setup: &Setup,
        columns: [i32; 2],
        rows: [i32; 2],
        origin: [usize; 2],
        shader: &S,
    ) {
        let may_cut = shader.may_cut(t as usize);
        let steps = i64::from(STEPS);
        let offsets: [[I; SAMPLES]; 3] = std::array::from_fn(|k| {
            OFFSETS.map(|[x, y]| {
                I::narrow(setup.along_x[k] * i64::from(x) + setup.along_y[k] * i64::from(y) - setup.bias[k])
            })
        });
        let across = setup.along_x.map(|along| I::narrow(along * steps));
        for row in rows[0]..=rows[1] {
            let mut middle = setup
                .edges(i64::from(columns[0]) * steps + steps / 2, i64::from(row) * steps + steps / 2)
                .map(I::narrow);
            let line = (row as usize - origin[1]) * TILE;
            for column in columns[0]..=columns[1] {
                let first = (line + column as usize - origin[0]) * SAMPLES;
                let edges: [[I; SAMPLES]; 3] =
                    std::array::from_fn(|k| std::array::from_fn(|s| middle[k] + offsets[k][s]));
                let inside: [bool; SAMPLES] =
                    std::array::from_fn(|s| !(edges[0][s] | edges[1][s] | edges[2][s]).is_negative());
                if inside != [false; SAMPLES] {
                    for s in (0..SAMPLES).filter(|s| inside[*s]) {
                        let flat: [f32; 3] = std::array::from_fn(|k| edges[k][s].to_f32() * setup.inverse_area);
                        let inverse_depth = setup.inverse_depth(flat);
                        if inverse_depth > self.inverse_depth[first + s]
                            && (!may_cut || shader.keeps(t as usize, setup.weights(flat)))
                        {
                            self.inverse_depth[first + s] = inverse_depth;
                            self.triangle[first + s] = t;
                        }
                    }
                }
                for k in 0..3 {
                    middle[k] = middle[k] + across[k];
                }
            }
        }
    }

    /// Colour of a pixel from its samples: one call of the shader for each surface in it.
    #[inline]
    fn resolve<S: Shader>(
        &self,
        first: usize,
        setups: &[Setup],
        pixel: [i64; 2],
        shader: &S,
        background: Vec3A,
    ) -> Vec3A {
        let ids = &self.triangle[first..first + SAMPLES];
        if *ids == [NO_TRIANGLE; SAMPLES] {
            return background;
        }
        let depths = &self.inverse_depth[first..first + SAMPLES];
        let mut colour = Vec3A::ZERO;
        let mut done = [false; SAMPLES];
        let mut empty = 0;
        for s in 0..SAMPLES {
            if done[s] {
                continue;
            }
            if ids[s] == NO_TRIANGLE {
                empty += 1;
                continue;
            }
            let mut count = 0;
            let setup = &setups[ids[s] as usize];
            // The shade is taken in the middle of the samples that see this very triangle, so never outside it.
            let (mut x, mut y, mut own) = (0, 0, 0);
            for other in s..SAMPLES {
                let same = ids[other] == ids[s] && (!S::EVERY_SAMPLE || other == s);
                let near = !S::EVERY_SAMPLE
                    && ids[other] != NO_TRIANGLE
                    && setups[ids[other] as usize].front == setup.front
                    && (depths[other] - depths[s]).abs() < SAME_SURFACE * depths[s];
                if !done[other] && (same || near) {
                    done[other] = true;
                    count += 1;
                    if same {
                        x += i64::from(OFFSETS[other][0]);
                        y += i64::from(OFFSETS[other][1]);
                        own += 1;
                    }
                }
            }
            let steps = i64::from(STEPS);
            let edges = setup.edges(pixel[0] * steps + steps / 2 + x / own, pixel[1] * steps + steps / 2 + y / own);
            let flat_weights = setup.flat_weights(edges);
            let weights = setup.weights(flat_weights);
            let fragment = Fragment { triangle: ids[s] as usize, weights, flat_weights, front: setup.front };
            colour += shader.shade(&fragment) * (count as f32 / SAMPLES as f32);
        }
        if empty > 0 {
            colour += background * (empty as f32 / SAMPLES as f32);
        }
        colour
    }
}
