//! How the sheet moves through a step.

pub mod implicit;
pub mod symplectic_euler;

use crate::contact::scenery::Scenery;
use crate::effects::{Forces, SpringFactors};
use crate::kernels::VectorUnit;
use crate::registry::Entry;
use crate::scene::Scene;
use crate::sheet::SheetState;
use crate::shell::Shell;

/// What an integrator reports of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Advanced {
    /// Substeps taken.
    pub substeps: u32,
    /// Springs that broke.
    pub broken: usize,
    /// Largest strain of a structural or shear spring at the end.
    pub strain_max: f64,
    /// Substep over the longest stable one; 0 for integrators that have none.
    pub courant: f64,
    /// Iterations of the nonlinear solver, and of the linear one in all.
    pub iterations: [u32; 2],
    /// Whether the nonlinear solver gave up before its tolerance.
    pub stalled: bool,
    /// Pairs of features that passed through each other.
    pub passed_through: usize,
}

/// What an integrator reads of a step.
pub struct Step<'a> {
    /// Stiffness and tension of the springs.
    pub factors: &'a SpringFactors,
    /// Forces from outside, held over the step.
    pub forces: &'a Forces,
    /// Length of the step [s].
    pub dt: f64,
    /// Substeps a scene forces.
    pub substeps: Option<u32>,
    /// Changes whenever springs or nodes have come or gone: caches of the topology are stale.
    pub topology: u64,
    /// Vector unit to use.
    pub unit: VectorUnit,
    /// Whether to share long loops among threads.
    pub parallel: bool,
}

/// Moves the sheet. What it keeps between steps is rebuilt from the state, so that a resumed run has the same bits.
pub trait Integrator: Send {
    /// Advances positions and velocities by one step; springs that give way are marked broken.
    fn advance(&mut self, state: &mut SheetState, step: &Step<'_>) -> Advanced;

    /// Takes up what is in the way; only asked of integrators that [`MEETS`] names.
    fn meet(&mut self, _scenery: Scenery) {}

    /// The shell as of the end of the last step, where there is one.
    fn shell(&self) -> Option<&Shell> {
        None
    }

    /// Pairs of triangles that cross now, of the sheets and of what is in the way; none where nothing is watched.
    fn crossings(&mut self, _state: &SheetState, _topology: u64) -> Option<usize> {
        None
    }
}

/// Integrators that know contact.
pub const MEETS: &[&str] = &["implicit"];

/// Builds an integrator from a scene.
pub type Build = fn(&Scene) -> Box<dyn Integrator>;

/// Every integrator.
pub static INTEGRATORS: &[Entry<Build>] = &[
    Entry {
        name: "symplectic_euler",
        about: "explicit, with Provot's limit on deformation: soft sheets, many small substeps",
        item: symplectic_euler::build,
    },
    Entry {
        name: "implicit",
        about: "second-order backward differences of an elastic shell: paper and cloth by their moduli, few large steps",
        item: implicit::build,
    },
];
