//! What several tests need: small sheets, and a state in the middle of everything.
#![allow(dead_code)] // no test file uses all of it

use charcloth::effects::{Forces, SpringFactors};
use charcloth::integrators::{INTEGRATORS, Integrator, Step};
use charcloth::kernels::VectorUnit;
use charcloth::mesh::SurfaceMesh;
use charcloth::random::Random;
use charcloth::scene::{Scene, Shape};
use charcloth::sheet::SheetState;
use charcloth::simulation::{Inputs, Simulation};
use charcloth::units::*;
use glam::{DVec2, DVec3};

/// A rectangle in metres, nothing lit and nothing held.
pub fn sheet(shape: Shape, width: f64, height: f64, spacing: f64) -> Scene {
    let mut scene = Scene::default();
    scene.sheet.shape = shape;
    scene.sheet.width = Length(width);
    scene.sheet.height = Length(height);
    scene.sheet.spacing = Length(spacing);
    scene
}

/// Builds a scene that needs no files.
pub fn build(scene: &Scene) -> Simulation {
    Simulation::build(scene, &Inputs::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The integrator `implicit` by itself, on a sheet that drag settles: what changes its rest shape is for the test to say.
pub struct Settler {
    /// The integrator.
    pub integrator: Box<dyn Integrator>,
    /// Of a sheet that nothing has happened to.
    pub factors: SpringFactors,
    forces: Forces,
}

impl Settler {
    /// With a drag on each node [kg/s].
    pub fn new(scene: &Scene, state: &SheetState, drag: f64) -> Self {
        let (nodes, springs, triangles) = (state.motion.len(), state.springs.len(), state.triangles.len());
        let row = INTEGRATORS.iter().find(|row| row.name == "implicit").unwrap();
        Self {
            integrator: (row.item)(scene),
            factors: SpringFactors {
                stiffness: vec![1.0; springs],
                tension: vec![0.0; springs],
                drag: vec![0.0; springs],
                triangle: vec![1.0; triangles],
                free_strain: vec![DVec2::ZERO; triangles],
                free_curvature: vec![DVec2::ZERO; triangles],
                ..SpringFactors::default()
            },
            forces: Forces { force: vec![DVec3::ZERO; nodes], drag: vec![drag; nodes], air_mass: vec![0.0; nodes] },
        }
    }

    /// Makes a step of 5 ms.
    pub fn advance(&mut self, state: &mut SheetState) {
        let step = Step {
            factors: &self.factors,
            forces: &self.forces,
            dt: 5e-3,
            substeps: None,
            topology: 0,
            unit: VectorUnit::best(),
            parallel: false,
        };
        self.integrator.advance(state, &step);
    }
}

/// The scene with its sheet given as a mesh.
pub fn with_mesh(scene: &Scene, mesh: SurfaceMesh) -> (Scene, Inputs) {
    let mut scene = scene.clone();
    scene.sheet.mesh = Some("sheet".to_owned());
    (scene, Inputs { mesh: Some(mesh), ..Inputs::default() })
}

/// Makes a state that is hot here and cold there, bent, moving and partly burnt: functions of the material point, so the
/// same on any numbering of the nodes.
pub fn disturb(state: &mut SheetState, ambient: f64, hottest: f64) {
    for i in 0..state.motion.len() {
        let p = state.motion.rest_position[i] * 40.0;
        let wave = DVec3::new((p.y + 1.0).sin(), (p.x * 1.3).cos(), (p.x - 0.7 * p.y).sin());
        state.motion.position[i] += wave * 1e-3;
        state.motion.velocity[i] = DVec3::new(wave.y, wave.z, wave.x) * 0.5;
        state.burn.temperature[i] = ambient + (hottest - ambient) * 0.5 * (1.0 + (p.x + p.y).sin());
        state.burn.fuel[i] = state.burn.fuel_initial[i] * (0.5 + 0.4 * (p.y - p.x).cos());
    }
}

/// An order of the numbers under `count` that has nothing to do with their size.
pub fn shuffled(count: usize, seed: u64) -> Vec<u32> {
    let mut random = Random::new(seed, 1);
    let mut order: Vec<u32> = (0..count as u32).collect();
    for k in (1..count).rev() {
        order.swap(k, (random.uniform() * (k + 1) as f64) as usize);
    }
    order
}

/// Largest distance of two values, over the largest size of either; 0 for nothing at all.
pub fn relative_difference(a: impl Iterator<Item = DVec3>, b: impl Iterator<Item = DVec3>) -> f64 {
    let (mut difference, mut size) = (0.0f64, 0.0f64);
    for (a, b) in a.zip(b) {
        difference = difference.max((a - b).length());
        size = size.max(a.length()).max(b.length());
    }
    if size == 0.0 { 0.0 } else { difference / size }
}
