//! What acts on the sheet. An effect reads the state and adds heat, tension or force; it writes no state, so effects
//! never depend on each other's order. They run in table order, so that sums are the same bits.

pub mod conduction;
pub mod cooling;
pub mod curl;
pub mod damping;
pub mod gravity;
pub mod thermal_force;
pub mod wind;

use crate::kernels::heat::ConductanceRow;
use crate::kernels::{Links, VectorUnit};
use crate::plume::Plume;
use crate::registry::Entry;
use crate::scene::Scene;
use crate::sheet::SheetState;
use glam::{DMat3, DVec2, DVec3};

/// What effects see: the state, and what follows from it.
pub struct Now<'a> {
    /// The state.
    pub state: &'a SheetState,
    /// Unit normal of each motion node; zero where it has no surface.
    pub normal: &'a [DVec3],
    /// Area of surface at each motion node, at rest [m2].
    pub area: &'a [f64],
    /// Who conducts to whom on the burn mesh.
    pub heat_links: &'a Links,
    /// Conductances along them [W/K].
    pub conductance: &'a [ConductanceRow],
    /// Simulated time [s].
    pub time: f64,
    /// Air that rises over flames.
    pub plume: &'a Plume,
    /// Direction that leads up.
    pub up: DVec3,
    /// Vector unit to use.
    pub unit: VectorUnit,
    /// Whether to share long loops among threads.
    pub parallel: bool,
}

/// Heat that flows into each burn node.
#[derive(Debug, Clone, Default)]
pub struct HeatRates {
    /// Heat that stays within the sheet: what one node gets, another gives [W].
    pub within: Vec<f64>,
    /// Heat that is lost to the surroundings [W]; empty until an effect asks for it by [`HeatRates::lost`].
    pub lost: Vec<f64>,
}

impl HeatRates {
    /// Nothing flows to any of so many nodes.
    pub fn clear(&mut self, nodes: usize) {
        self.within.clear();
        self.within.resize(nodes, 0.0);
        self.lost.clear();
    }

    /// Heat that is lost to the surroundings, to add to [W].
    pub fn lost(&mut self) -> &mut [f64] {
        self.lost.resize(self.within.len(), 0.0);
        &mut self.lost
    }
}

/// Forces on each motion node.
#[derive(Debug, Clone, Default)]
pub struct Forces {
    /// Force [N].
    pub force: Vec<DVec3>,
    /// Drag against all motion of the node, taken implicitly: force = -drag v [N s/m].
    pub drag: Vec<f64>,
    /// Mass of the air that has to go along with the node, and has no weight [kg]; for integrators that know it.
    pub air_mass: Vec<f64>,
}

impl Forces {
    /// Nothing acts on any of so many nodes.
    pub fn clear(&mut self, nodes: usize) {
        self.force.clear();
        self.force.resize(nodes, DVec3::ZERO);
        for numbers in [&mut self.drag, &mut self.air_mass] {
            numbers.clear();
            numbers.resize(nodes, 0.0);
        }
    }
}

/// Derivatives of the forces on each node by its own position and velocity.
#[derive(Debug, Clone, Default)]
pub struct ForceDerivatives {
    /// dF/dx [N/m].
    pub by_position: Vec<DMat3>,
    /// dF/dv [N s/m].
    pub by_velocity: Vec<DMat3>,
}

/// How heat and burning change each spring.
#[derive(Debug, Clone, Default)]
pub struct SpringFactors {
    /// Stiffness over that of the unburnt spring; 0 for a broken one.
    pub stiffness: Vec<f64>,
    /// Stiffness over that of the unburnt triangle.
    pub triangle: Vec<f64>,
    /// The same along each side of a triangle, opposite to its corners; empty where the burn mesh is no finer.
    pub sides: Vec<[f64; 3]>,
    /// Strain of each triangle without force, along the machine direction and across; empty where nothing shrinks.
    pub free_strain: Vec<DVec2>,
    /// Curvature that it gets from its faces, in the same directions [1/m]; empty where nothing curls.
    pub free_curvature: Vec<DVec2>,
    /// Part of its fibre that each triangle has left; empty where nothing shrinks.
    pub fibre: Vec<f64>,
    /// Part of its tension that each triangle keeps after what has flowed in the step; empty where nothing has.
    pub kept: Vec<f64>,
    /// Tension that pulls the two ends together [N].
    pub tension: Vec<f64>,
    /// Force on both ends in the direction from the first to the second [N]; it conserves no momentum.
    pub drag: Vec<f64>,
}

/// Something that acts on the sheet; every method has an empty default.
pub trait Effect: Send + Sync {
    /// Adds heat flows, once a heat step.
    fn add_heat(&self, _now: &Now<'_>, _rates: &mut HeatRates) {}
    /// Adds tensions of springs, once a step; `factors.stiffness` is set.
    fn add_tension(&self, _now: &Now<'_>, _factors: &mut SpringFactors) {}
    /// Adds forces, once a step, held over its substeps.
    fn add_forces(&self, _now: &Now<'_>, _forces: &mut Forces) {}
    /// Adds the derivatives of the same forces, for integrators that need them.
    fn add_force_derivatives(&self, _now: &Now<'_>, _derivatives: &mut ForceDerivatives) {}
    /// Longest step over which the effect may be held [s].
    fn longest_step(&self, _now: &Now<'_>) -> f64 {
        f64::INFINITY
    }
}

/// Builds an effect from a scene; none where the scene switches it off.
pub type Build = fn(&Scene) -> Option<Box<dyn Effect>>;

/// Every effect.
pub static EFFECTS: &[Entry<Build>] = &[
    Entry { name: "conduction", about: "heat flows along the sheet (S1)", item: conduction::build },
    Entry { name: "cooling", about: "the sheet loses heat to the room, Newton's law", item: cooling::build },
    Entry { name: "thermal_force", about: "heat pulls the sheet together (S6)", item: thermal_force::build },
    Entry { name: "curl", about: "heat pushes along the normal (S8)", item: curl::build },
    Entry { name: "gravity", about: "weight", item: gravity::build },
    Entry { name: "damping", about: "viscous damping of all motion", item: damping::build },
    Entry { name: "wind", about: "moving or still air pushes on the surface", item: wind::build },
];

/// The effects that a scene switches on, in table order.
pub fn of_scene(scene: &Scene) -> Vec<Box<dyn Effect>> {
    EFFECTS.iter().filter_map(|entry| (entry.item)(scene)).collect()
}
