//! What surrounds the sheet: gases that take its volatiles and give it heat and oxygen.
//!
//! A gas sees the sheet as it stands in space, face by face, and answers per face. What it must remember from step to
//! step is in [`GasState`]; all else is rebuilt from that.

pub mod boundary_layer;
pub mod flame;
pub mod properties;
pub mod still_air;

use crate::registry::Entry;
use glam::DVec3;

/// The two faces of a sheet: the one its normals point away from comes first.
pub const FACES: usize = 2;

/// A number per face and node.
pub type PerFace<T> = [Vec<T>; FACES];

/// The sheet as the gas sees it; one row a node.
#[derive(Debug, Clone, Copy)]
pub struct SheetView<'a> {
    /// Nodes to look after, in order. At all others both faces have the temperature of the room and give off nothing, both
    /// films are at rest, and those of their neighbours too; nobody asks what they get.
    pub awake: &'a [u32],
    /// Where it is now [m]; right at the nodes that are awake and at their neighbours.
    pub position: &'a [DVec3],
    /// Unit normal now, at the nodes that are awake; zero where there is no surface.
    pub normal: &'a [DVec3],
    /// Area of one face, at rest [m2].
    pub area: &'a [f64],
    /// Neighbours of node i are `link_to[link_start[i]..link_start[i + 1]]`; both ends list a link.
    pub link_start: &'a [u32],
    /// The node at the other end.
    pub link_to: &'a [u32],
    /// Length at rest [m].
    pub link_length: &'a [f64],
    /// Width that the link stands for, length (cot a + cot b)/2, not under 0, alike at both ends [m].
    pub link_width: &'a [f64],
    /// Length of free edge that belongs to the node; 0 inside [m].
    pub edge_length: &'a [f64],
    /// Distance along the sheet to the nearest free edge; infinity where there is none [m].
    pub edge_distance: &'a [f64],
}

/// What the sheet does on its two faces; one row a node.
#[derive(Debug, Clone, Copy)]
pub struct FaceView<'a> {
    /// Temperature [K].
    pub temperature: [&'a [f64]; FACES],
    /// Fuel gas that comes out [kg/(m2 s)].
    pub volatile_flux: [&'a [f64]; FACES],
    /// All gas that comes out, steam and burnt gas too [kg/(m2 s)].
    pub gas_flux: [&'a [f64]; FACES],
    /// Part of the face that gas can reach: 0 where something lies on it.
    pub open: [&'a [f64]; FACES],
    /// Part of the face that an igniting flame covers.
    pub pilot: [&'a [f64]; FACES],
    /// Absorptivity and emissivity of both faces.
    pub emissivity: f64,
    /// Heat of combustion of the fuel gas [J/kg].
    pub heat_of_combustion: f64,
    /// Oxygen that it takes to burn [kg/kg].
    pub oxygen_demand: f64,
}

/// The room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// [K]
    pub temperature: f64,
    /// Mole fraction of oxygen.
    pub oxygen: f64,
    /// [Pa]
    pub pressure: f64,
    /// [m/s2]
    pub gravity: DVec3,
    /// [m/s]
    pub wind: DVec3,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self {
            temperature: 293.15,
            oxygen: 0.209,
            pressure: properties::ATMOSPHERE,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            wind: DVec3::ZERO,
        }
    }
}

/// What a gas remembers. State: columns to save and to carry over a split of nodes by copying.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GasState {
    /// Temperature of the film of gas on the face [K].
    pub temperature: PerFace<f64>,
    /// Mass fraction of unburnt volatiles in the film.
    pub fuel: PerFace<f64>,
    /// Way that the film has come since the foot of the flame [m].
    pub run: PerFace<f64>,
}

impl GasState {
    /// Still air on so many nodes.
    pub fn still(nodes: usize, surroundings: &Surroundings) -> Self {
        let all = |value: f64| std::array::from_fn(|_| vec![value; nodes]);
        Self { temperature: all(surroundings.temperature), fuel: all(0.0), run: all(0.0) }
    }
}

/// What a gas gives the sheet, held over the step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaceExchange {
    /// Net heat into the face at its present temperature, radiation counted [W/m2].
    pub heat_flux: PerFace<f64>,
    /// Its derivative by the temperature of the face, never positive [W/(m2 K)].
    pub heat_flux_slope: PerFace<f64>,
    /// Mole fraction of oxygen at the face.
    pub surface_oxygen: PerFace<f64>,
    /// Most oxygen that transport can bring to the face [kg/(m2 s)].
    pub oxygen_supply: PerFace<f64>,
    /// Presence of flame, 0 to 1.
    pub flame: PerFace<f64>,
    /// How far from the face the flame stands [m].
    pub standoff: PerFace<f64>,
    /// How far the flame reaches from the node, along the way of the gas above it [m].
    pub flame_height: PerFace<f64>,
    /// Velocity of the gas along the face [m/s].
    pub velocity: PerFace<DVec3>,
    /// Sums of the step.
    pub books: GasBooks,
}

impl FaceExchange {
    /// Makes room for so many nodes; does nothing if there is room.
    pub fn fit(&mut self, nodes: usize) {
        for face in 0..FACES {
            for column in [
                &mut self.heat_flux,
                &mut self.heat_flux_slope,
                &mut self.surface_oxygen,
                &mut self.oxygen_supply,
                &mut self.flame,
                &mut self.standoff,
                &mut self.flame_height,
            ] {
                column[face].resize(nodes, 0.0);
            }
            self.velocity[face].resize(nodes, DVec3::ZERO);
        }
    }
}

/// Rates over the whole sheet [W] and [kg/s].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GasBooks {
    /// Fuel gas that the faces gave [kg/s].
    pub fuel_in: f64,
    /// Of it, burnt in the film [kg/s].
    pub fuel_burnt: f64,
    /// Of it, left the sheet unburnt, to burn in the plume or not at all [kg/s].
    pub fuel_left: f64,
    /// Heat released in the film [W].
    pub heat_released: f64,
    /// Heat that went into the sheet, by gas and by radiation of the flame [W].
    pub heat_to_sheet: f64,
    /// Heat that the sheet radiates to the room, and the room not to it [W].
    pub heat_radiated: f64,
    /// Heat that went to the surroundings with gas and as radiation of the flame: released less to the sheet [W].
    pub heat_to_surroundings: f64,
    /// Rows that were worked on, over both faces.
    pub active: usize,
    /// Sweeps over them.
    pub sweeps: usize,
}

/// A gas: heat, oxygen and flames for a sheet.
pub trait Gas: Send + Sync {
    /// Advances what it remembers by dt, and fills in what it gives the sheet. Allocates nothing after the first call
    /// on as many nodes.
    fn advance(
        &mut self,
        sheet: &SheetView<'_>,
        faces: &FaceView<'_>,
        surroundings: &Surroundings,
        dt: f64,
        state: &mut GasState,
        exchange: &mut FaceExchange,
    );
}

/// Builds a gas.
pub type Build = fn() -> Box<dyn Gas>;

/// Every gas.
pub static GASES: &[Entry<Build>] = &[
    Entry {
        name: "flame",
        about: "a film of burning gas on each face feeds heat back to the sheet",
        item: || Box::new(flame::Flame::default()),
    },
    Entry {
        name: "still_air",
        about: "convection and radiation to a room in which nothing burns",
        item: || Box::new(still_air::StillAir),
    },
];
