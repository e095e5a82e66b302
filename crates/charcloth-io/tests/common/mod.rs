//! What several tests need: a folder that goes away, and a small sheet in mid-burn.
#![allow(dead_code)] // no test file uses all of it

pub mod environment;
pub mod node;
pub mod python;
pub mod skipped;

use charcloth::mesh::SurfaceMesh;
use charcloth::scene::{Corner, Ignite, LengthUnit, Pin, Scene};
use charcloth::sheet::{BurnEdges, BurnNodes, MotionNodes, SheetState, Springs, Triangles};
use charcloth::simulation::GreyImage;
use charcloth::units::*;
use charcloth_io::scene_file::Loader;
use glam::{DVec3, Vec2};
use std::path::{Path, PathBuf};

/// A folder of its own for a test, removed when it ends.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("charcloth-io-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Writes a file into the folder.
    pub fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A loader for scenes that name no files.
pub struct NoFiles;

impl Loader for NoFiles {
    fn mesh(&self, path: &Path, _: LengthUnit) -> Result<SurfaceMesh, String> {
        Err(format!("{} is not to be read here", path.display()))
    }
    fn image(&self, path: &Path) -> Result<GreyImage, String> {
        Err(format!("{} is not to be read here", path.display()))
    }
}

/// A mesh kept with the tests.
pub fn mesh_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes").join(name)
}

/// A grid of `n` by `n` nodes, with a texture seam down the middle, burnt towards one side. Every number has low bits.
pub fn sheet(n: usize) -> SheetState {
    let noise = |k: usize| ((k as f64 + 1.0) * 0.618_033_988_749_895).fract();
    let count = n * n;
    let mut state = SheetState {
        motion: MotionNodes::zeros(count),
        burn: BurnNodes::zeros(count),
        burn_edges: BurnEdges::zeros(2 * count),
        springs: Springs::zeros(6 * count),
        triangles: Triangles::zeros(2 * (n - 1) * (n - 1)),
        ..SheetState::default()
    };
    for i in 0..count {
        let (x, y) = ((i % n) as f64 / n as f64, (i / n) as f64 / n as f64);
        state.motion.position[i] = DVec3::new(0.21 * x, 0.297 * y, 0.01 * noise(i));
        state.motion.rest_position[i] = DVec3::new(0.21 * x, 0.297 * y, 0.0);
        state.motion.velocity[i] = DVec3::new(noise(i), -noise(i + 7), 1e-9 * noise(i + 9));
        state.motion.inert_mass[i] = 1e-7 * noise(i + 1);
        state.motion.alive[i] = 1;
        state.motion.source[i] = i as u32;
        state.burn.temperature[i] = 293.15 + 700.0 * noise(i) * x;
        state.burn.peak_temperature[i] = 300.0 + 700.0 * x;
        state.burn.fuel_initial[i] = 1e-6;
        state.burn.fuel[i] = 1e-6 * (1.0 - x * noise(i));
        state.burn.ignited_at[i] = if x > 0.5 { 0.25 } else { -1.0 };
    }
    for s in 0..state.springs.len() {
        state.springs.rest_length[s] = 0.001 * (1.0 + noise(s));
        state.springs.ends[s] = [(s % count) as u32, ((s + 1) % count) as u32];
    }
    let mut t = 0;
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let a = (j * n + i) as u32;
            let (b, c, d) = (a + 1, a + 1 + n as u32, a + n as u32);
            for corners in [[a, b, c], [a, c, d]] {
                state.triangles.corners[t] = corners;
                // Right of the middle lies another patch of texture.
                let shift = if i >= (n - 1) / 2 { 0.5 } else { 0.0 };
                state.triangles.uv[t] = corners.map(|k| {
                    let k = k as usize;
                    Vec2::new((k % n) as f32 / n as f32 + shift, (k / n) as f32 / n as f32)
                });
                state.triangles.alive[t] = 1;
                state.triangles.source_face[t] = (t / 2) as u32;
                state.triangles.rest_area[t] = 1e-5;
                t += 1;
            }
        }
    }
    // One corner has burnt away.
    state.triangles.alive[t - 1] = 0;
    state
}

/// A small sheet that burns and tears within a few frames.
pub fn tearing_scene() -> Scene {
    let mut scene = Scene::default();
    scene.sheet.width = Length(0.05);
    scene.sheet.height = Length(0.05);
    scene.sheet.spacing = Length(0.004);
    scene.fire.burn_time = Time(0.1);
    scene.fire.diffusivity = Diffusivity(4e-5);
    scene.mechanics.strength = ForcePerWidth(2.0);
    scene.pin.push(Pin { corner: Some(Corner::TopLeft), radius: Length(0.006), ..Pin::default() });
    scene.ignite.push(Ignite { corner: Some(Corner::BottomRight), radius: Length(0.015), ..Ignite::default() });
    scene
}
