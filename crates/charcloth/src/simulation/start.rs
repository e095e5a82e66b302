//! How a simulation is put together: from a scene, or from a scene and a saved state.

use super::{Flame, Scratch, Simulation};
use crate::build::{self, Built};
use crate::contact::scenery::Scenery;
use crate::counters::Stages;
use crate::crack::Cracks;
use crate::effects;
use crate::error::Error;
use crate::flow::Flow;
use crate::integrators::{Advanced, INTEGRATORS, MEETS};
use crate::kernels::VectorUnit;
use crate::material::Material;
use crate::measure;
use crate::mesh::SurfaceMesh;
use crate::motion::MeshSequence;
use crate::particles::Shed;
use crate::physical::Physical;
use crate::plume::Plume;
use crate::registry;
use crate::scene::{Model, Scene};
use crate::select;
use crate::sheet::SheetState;
use crate::thermo::Burning;
use std::collections::BTreeMap;

/// A grey picture, values 0 to 1, row by row from the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GreyImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values, 0 black to 1 white.
    pub values: Vec<f32>,
}

/// What a scene names but does not hold: meshes and pictures, already read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inputs {
    /// The mesh that `sheet.mesh` names.
    pub mesh: Option<SurfaceMesh>,
    /// The mesh that `sheet.rest_mesh` names.
    pub rest_mesh: Option<SurfaceMesh>,
    /// The meshes that `motion.files` names, their points in the order of those of `mesh`.
    pub motion: Option<MeshSequence>,
    /// Meshes of obstacles by the path the scene gives.
    pub obstacles: BTreeMap<String, SurfaceMesh>,
    /// How obstacles are animated, by the files the scene gives.
    pub obstacle_motions: BTreeMap<String, MeshSequence>,
    /// Pictures by the path the scene gives.
    pub images: BTreeMap<String, GreyImage>,
    /// The material that `sheet.material` names, for the physical model.
    pub material: Option<Material>,
}

/// Builds the physical model of a scene.
fn physical(scene: &Scene, inputs: &Inputs, built: &mut Built, flames: &[Flame]) -> Result<Physical, Error> {
    let name = &scene.sheet.material;
    let material = inputs.material.as_ref().ok_or_else(|| {
        Error::scene("sheet.material", format!("{name} was not read"), "hand it over in Inputs::material")
    })?;
    let heaters = scene.heater.iter().enumerate().map(|(row, heater)| select::heated(built, heater, row));
    let heaters = heaters.collect::<Result<_, Error>>()?;
    let pilots = flames.iter().map(|flame| (flame.nodes.clone(), flame.delay.clone())).collect();
    Physical::build(scene, material, built, pilots, heaters)
}

impl Simulation {
    /// Builds a scene: the state at frame 0.
    pub fn build(scene: &Scene, inputs: &Inputs) -> Result<Self, Error> {
        let mut built = build::sheet(scene, inputs)?;
        for (row, pin) in scene.pin.iter().enumerate() {
            for node in select::pinned(&built, pin, row)? {
                built.state.motion.pinned[node as usize] = 1;
            }
        }
        let mut flames = Vec::new();
        for (row, ignite) in scene.ignite.iter().enumerate() {
            let nodes = select::ignited(&built, inputs, ignite, row)?;
            flames.push(Flame {
                delay: select::delays(&built, inputs, ignite, row, &nodes)?,
                nodes,
                start: ignite.start.0,
                end: ignite.start.0 + ignite.length.0,
                temperature: ignite.temperature.0,
            });
        }
        measure::set_initial(scene, &mut built)?;
        let burning = Burning::of(scene);
        let mut physical = match scene.model {
            Model::Moidu2004 => None,
            Model::Physical => Some(physical(scene, inputs, &mut built, &flames)?),
        };
        let cracks = match &inputs.material {
            Some(material) if physical.is_some() && scene.crack.enabled && scene.mechanics.moves => {
                Some(Cracks::of(scene, material, &built.state.burn))
            }
            _ => None,
        };
        let flow = match &inputs.material {
            Some(material) if physical.is_some() && scene.mechanics.moves => Some(Flow::of(scene, material)),
            _ => None,
        };
        let state = &mut built.state;
        let heat =
            physical.as_ref().map_or_else(|| burning.heat_content(&state.burn), |model| model.heat_content(state));
        state.books.heat_initial[0] = heat;
        built.state.books.momentum_initial[0] = measure::momentum(&built.state);
        let integrator = registry::find(INTEGRATORS, &scene.mechanics.integrator, "mechanics.integrator")?;
        if integrator.name == "implicit" && scene.mechanics.moves && built.state.triangles.is_empty() {
            return Err(Error::scene(
                "mechanics.integrator",
                "a shell needs a surface, and a chain has none",
                "use sheet.shape = \"unstructured\" or \"grid\", or the integrator symplectic_euler",
            ));
        }
        let scenery = Scenery::of(scene, inputs)?;
        let meets = scene.mechanics.moves && (!scenery.is_empty() || scene.contact.self_contact == Some(true));
        if meets && !MEETS.contains(&integrator.name) {
            return Err(Error::scene(
                "mechanics.integrator",
                format!("{} does not know contact, and the scene has obstacles or self-contact", integrator.name),
                format!("use the integrator {}, or take them out", MEETS.join(" or ")),
            ));
        }
        let sheds = physical.is_some() && scene.mechanics.moves && !built.state.triangles.is_empty();
        let mut shed = sheds.then(|| Shed::of(scene, built.up, &scenery));
        if let Some(shed) = &mut shed {
            shed.measure(&mut built.state);
        }
        let mut mover = (integrator.item)(scene);
        if let Some(physical) = &mut physical {
            physical.meet(&scenery.planes);
        }
        mover.meet(scenery);
        if meets && mover.crossings(&built.state, 0).is_some_and(|pairs| pairs > 0) {
            return Err(Error::scene(
                if scene.obstacle.is_empty() { "sheet" } else { "obstacle" },
                "the sheet crosses itself or an obstacle at the start, and contact cannot undo that",
                "move the sheet or the obstacle (sheet.position, obstacle.position), or set contact.self_contact = false",
            ));
        }
        let mut simulation = Self {
            effects: effects::of_scene(scene),
            integrator: mover,
            meets,
            measures: measure::of_scene(scene, &built)?,
            warnings: built.remarks.clone(),
            scene: scene.clone(),
            built,
            burning,
            physical,
            flow,
            cracks,
            shed,
            plume: Plume::default(),
            flames,
            scratch: Scratch::default(),
            topology: 0,
            laid_out: None,
            stages: Stages::default(),
            wall: 0.0,
            resumed: false,
            last: Advanced::default(),
            iterations: [0; 2],
            last_step: 0.0,
            unit: VectorUnit::best(),
            parallel: rayon::current_num_threads() > 1,
        };
        simulation.warn_if_too_light();
        Ok(simulation)
    }

    /// Builds a scene and puts it into a state saved earlier; the run goes on with the same bits.
    pub fn resume(scene: &Scene, inputs: &Inputs, state: SheetState) -> Result<Self, Error> {
        let mut simulation = Self::build(scene, inputs)?;
        let built = &simulation.built.state;
        if state.books.len() != 1 || state.motion.len() < built.motion.len() {
            return Err(Error::Resume(format!(
                "the saved state has {} nodes, the scene {}: it is of another scene",
                state.motion.len(),
                built.motion.len()
            )));
        }
        let same = [
            state.triangles.len() == built.triangles.len(),
            state.springs.len() == built.springs.len(),
            state.burn_triangles.len() == built.burn_triangles.len(),
        ];
        if same.contains(&false) {
            return Err(Error::Resume("the saved state has other triangles or springs than the scene".to_owned()));
        }
        simulation.built.state = state;
        // What has been laid out for the state as built is stale.
        simulation.topology += 1;
        simulation.resumed = true;
        Ok(simulation)
    }
}
