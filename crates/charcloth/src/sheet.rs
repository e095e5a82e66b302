//! The state of a sheet: two meshes, each a set of tables, and the map between them.
//!
//! What moves (`MotionNodes`, `Springs`, `Triangles`) sits on the **motion mesh**; what burns (`BurnNodes`,
//! `BurnEdges`, `BurnTriangles`) on the **burn mesh**. At level 0 the burn mesh is the motion mesh, and has no triangles
//! of its own; at level r each motion triangle carries 4^r burn triangles, and [`crate::burn_mesh::BurnMap`] goes from
//! one mesh to the other.
//!
//! Rows are never renumbered within a run: holes are masks (`alive`), tears append. The row number of a node is its id.

use crate::burn_mesh::BurnMap;
use crate::fields;
use crate::fields::{Column, Fnv};
use glam::DVec3;

/// "No such element", where an index is expected.
pub const NONE: u32 = u32::MAX;

/// Kinds of spring, after [Provot1995].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum SpringKind {
    /// Along an edge of the mesh.
    Structural = 0,
    /// Across a cell of a grid.
    Shear = 1,
    /// Over an inner edge, or two steps on along a grid line.
    Flexion = 2,
}

fields! {
    /// What moves, per node of the motion mesh.
    pub struct MotionNodes {
        /// Where the node is.
        position: DVec3, "m", Copy;
        /// How fast it moves.
        velocity: DVec3, "m/s", Copy;
        /// Mass that does not burn; the inertial mass is this and what burns.
        inert_mass: f64, "kg", Share;
        /// Mass of what burns there, as it is now: the share of the burn nodes around that the node carries.
        carried_mass: f64, "kg", Share;
        /// Where the node lies in the stress-free sheet; material fields such as noise are functions of it.
        rest_position: DVec3, "m", Copy;
        /// The node of the burn mesh at the same place.
        burn_node: u32, "1", Copy;
        /// Node of the input mesh that this one is, or was split from.
        source: u32, "1", Copy;
        /// Which shell of the input the node belongs to.
        sheet: u32, "1", Copy;
        /// 1 where the node is held in place.
        pinned: u8, "1", Copy;
        /// 1 while the node belongs to the surface, 0 once it is ash that has come off.
        alive: u8, "1", Copy;
    }
}

fields! {
    /// Where each node was a step ago, for integrators that look back.
    pub struct MotionBefore {
        /// Where the node was.
        position: DVec3, "m", Copy;
        /// How fast it moved.
        velocity: DVec3, "m/s", Copy;
    }
}

fields! {
    /// What burns, per node of the burn mesh.
    pub struct BurnNodes {
        /// Temperature.
        temperature: f64, "K", Copy;
        /// Fuel left.
        fuel: f64, "kg", Share;
        /// Fuel at the start.
        fuel_initial: f64, "kg", Share;
        /// Fuel that turns to gas in a second while the node burns (k1 of the 2004 model).
        burn_rate_full: f64, "kg/s", Share;
        /// Fuel that turns to gas in a second now.
        burn_rate: f64, "kg/s", Share;
        /// Heat that takes the node up by one kelvin while all its fuel is there.
        heat_capacity: f64, "J/K", Share;
        /// Heat released so far.
        heat_released: f64, "J", Share;
        /// Highest temperature so far; paper browns by it.
        peak_temperature: f64, "K", Copy;
        /// Time at which the node first caught fire; -1 before.
        ignited_at: f64, "s", Copy;
        /// Area of sheet the node stands for, at rest.
        area: f64, "m2", Share;
        /// Mass of all that is there.
        mass: f64, "kg", Share;
        /// How far the sheet has turned to char, 0 to 1.
        charred: f64, "1", Copy;
        /// How far the char has gone, 0 to 1.
        ashed: f64, "1", Copy;
        /// Part of its stiffness that burning has left.
        stiffness: f64, "1", Copy;
        /// How far the flame on the node reaches; 0 without one.
        flame: f64, "m", Copy;
        /// Thickness by which it burns, over that of the sheet.
        thickness: f64, "1", Copy;
        /// How much faster it burns than it is heavy: it weighs this times the mass that burns.
        speed: f64, "1", Copy;
        /// 1 where it must not burn.
        noburn: u8, "1", Copy;
        /// Particle that the node has gone off with; 4294967295 for none.
        particle: u32, "1", Copy;
    }
}

fields! {
    /// One face of what burns in the physical model, per node of the burn mesh: half of the sheet's thickness, and the
    /// film of gas on it. Without rows in other models.
    pub struct FaceNodes {
        /// Temperature of the half-layer.
        temperature: f64, "K", Copy;
        /// Moisture.
        water: f64, "kg", Share;
        /// Fibre.
        fibre: f64, "kg", Share;
        /// Second fibre or coating.
        polymer: f64, "kg", Share;
        /// Char that still loses gas.
        young_char: f64, "kg", Share;
        /// Char that only oxygen takes.
        char: f64, "kg", Share;
        /// Mineral filler.
        filler: f64, "kg", Share;
        /// Ash.
        ash: f64, "kg", Share;
        /// Dry mass at the start.
        dry_mass: f64, "kg", Share;
        /// Fuel gas that the face gave off in the last step.
        volatile_rate: f64, "kg/s", Share;
        /// All gas that it gave off in the last step.
        gas_rate: f64, "kg/s", Share;
        /// Temperature of the film of gas on the face.
        film_temperature: f64, "K", Copy;
        /// Mass fraction of unburnt fuel gas in the film.
        film_fuel: f64, "1", Copy;
        /// Way that the film has come since the foot of the flame.
        film_run: f64, "m", Copy;
        /// Length of free edge at the node, as cut from the roll.
        edge_length: f64, "m", Share;
        /// Distance along the sheet to the nearest free edge; a large number where there is none near.
        edge_distance: f64, "m", Copy;
    }
}

fields! {
    /// Board behind each burn node, from the sheet into its depth. Without rows where there is none.
    pub struct BoardNodes {
        /// Temperature of the first layer.
        layer_1: f64, "K", Copy;
        /// Of the second, twice as thick.
        layer_2: f64, "K", Copy;
        /// And so on.
        layer_3: f64, "K", Copy;
        /// Fourth.
        layer_4: f64, "K", Copy;
        /// Fifth.
        layer_5: f64, "K", Copy;
        /// Last.
        layer_6: f64, "K", Copy;
    }
}

fields! {
    /// Who conducts heat to whom, per edge of the burn mesh.
    pub struct BurnEdges {
        /// The two nodes.
        ends: [u32; 2], "1", Copy;
        /// Distance between them at rest.
        rest_distance: f64, "m", Copy;
        /// Heat per second and kelvin of difference, times the distance (k0 of the 2004 model).
        conductance_length: f64, "W m/K", Copy;
        /// 1 once the sheet is parted between the two nodes.
        cut: u8, "1", Copy;
        /// Burn triangles at the edge; none at level 0.
        triangles: [u32; 2], "1", Copy;
    }
}

fields! {
    /// Triangles of the burn mesh; none at level 0, where those of the motion mesh serve.
    pub struct BurnTriangles {
        /// The three burn nodes, anticlockwise seen from outside.
        corners: [u32; 3], "1", Copy;
        /// Triangle of the motion mesh that carries it.
        parent: u32, "1", Copy;
        /// Where each corner lies on it: the weights of the second and of the third corner of the parent.
        place: [glam::Vec2; 3], "1", Copy;
        /// How far beside that place, in the same weights, it is put, so that what parts there is ragged.
        aside: [glam::Vec2; 3], "1", Copy;
        /// Area at rest.
        rest_area: f64, "m2", Copy;
        /// 1 while the triangle is part of the surface.
        alive: u8, "1", Copy;
    }
}

fields! {
    /// Springs of the motion mesh.
    pub struct Springs {
        /// The two nodes.
        ends: [u32; 2], "1", Copy;
        /// 0 structural, 1 shear, 2 flexion.
        kind: u8, "1", Copy;
        /// Length without force.
        rest_length: f64, "m", Copy;
        /// Stiffness of the unburnt spring (K0 of the 2004 model).
        stiffness: f64, "N/m", Copy;
        /// Force that breaks the unburnt spring; 0 means it never breaks.
        strength: f64, "N", Copy;
        /// 1 once the spring has given way.
        broken: u8, "1", Copy;
        /// Edge of the burn mesh along a structural spring; none where the burn mesh is finer.
        edge: u32, "1", Copy;
        /// Triangles that carry the spring; the first holds the first end, the second the second.
        carriers: [u32; 2], "1", Copy;
        /// 1 where the spring needs both its triangles (it bends over their common edge), 0 where one will do.
        needs_both: u8, "1", Copy;
    }
}

fields! {
    /// Triangles of the motion mesh.
    pub struct Triangles {
        /// The three nodes, anticlockwise seen from outside.
        corners: [u32; 3], "1", Copy;
        /// Texture coordinates of the three corners.
        uv: [glam::Vec2; 3], "1", Copy;
        /// Face of the input file the triangle was cut from.
        source_face: u32, "1", Copy;
        /// Which shell of the input the triangle belongs to.
        sheet: u32, "1", Copy;
        /// Area at rest.
        rest_area: f64, "m2", Copy;
        /// 1 while the triangle is part of the surface.
        alive: u8, "1", Copy;
        /// Connected piece the triangle belongs to; 0 is the largest of the start, flakes count up.
        piece: u32, "1", Copy;
        /// Sides along which the sheet has cracked: 1, 2 and 4 for those opposite to the first, second and third corner.
        parted: u8, "1", Copy;
    }
}

fields! {
    /// Where on the input mesh each node of a frame comes from: a place on a triangle between three of its points. Tears
    /// and finer burn meshes do not change it. Worked out for frames, never part of the state.
    pub struct Origins {
        /// Face of the input mesh; none for a chain.
        origin_face: u32, "1", Copy;
        /// Points of the input mesh at the corners of the triangle that the face was cut into there.
        origin_points: [u32; 3], "1", Copy;
        /// Barycentric weights of the three points; their sum is 1.
        origin_weights: DVec3, "1", Copy;
    }
}

fields! {
    /// The stress-free shape of each triangle of the motion mesh.
    pub struct RestShapes {
        /// Side from the first corner to the second, in the plane of the material: x along the machine direction, z nought.
        side_1: DVec3, "m", Copy;
        /// Side from the first corner to the third.
        side_2: DVec3, "m", Copy;
        /// Curvature without force: along the machine direction, across it, and twice the twist.
        curvature: DVec3, "1/m", Copy;
        /// Strain that has flowed and does not come back: along the machine direction, across it, and shear.
        flow: DVec3, "1", Copy;
        /// Part of its fibre that was left when it last flowed.
        fibre: f64, "1", Copy;
        /// Thickness over that of the sheet.
        thickness: f64, "1", Copy;
        /// Strength over that of the sheet.
        strength: f64, "1", Copy;
    }
}

fields! {
    /// Connected pieces, one row each, the row number being the number of the piece: first the sheets of the start, then
    /// what comes off. Masses, areas and temperatures are those at the end of a frame.
    pub struct Pieces {
        /// Number of the piece that it came off; 4294967295 for a sheet of the start.
        parent: u32, "1", Copy;
        /// When it came off.
        birth: f64, "s", Copy;
        /// Mass; 0 once there is nothing left of it, or nothing that counts as a piece.
        mass: f64, "kg", Copy;
        /// Area at rest.
        area: f64, "m2", Copy;
        /// Mean temperature, by mass.
        temperature: f64, "K", Copy;
    }
}

fields! {
    /// Pieces too small to be sheet: ash and crumbs of char, each moving as one. Their mass, heat and chemistry stay with
    /// their burn nodes; masses, areas and temperatures here are sums of those at the end of a frame.
    pub struct Particles {
        /// Where it is.
        position: DVec3, "m", Copy;
        /// How fast it moves.
        velocity: DVec3, "m/s", Copy;
        /// Mass.
        mass: f64, "kg", Copy;
        /// Area of sheet that it was, at rest.
        area: f64, "m2", Copy;
        /// Mean temperature, by mass.
        temperature: f64, "K", Copy;
        /// Number of the piece that it came off.
        parent: u32, "1", Copy;
        /// When it came off.
        birth: f64, "s", Copy;
        /// 1 once it lies on something.
        lies: u8, "1", Copy;
    }
}

fields! {
    /// The books: one row of sums since the start, and the clock.
    pub struct Books {
        /// Simulated time.
        time: f64, "s", Copy;
        /// Frame reached.
        frame: u32, "1", Copy;
        /// Fuel turned to gas.
        fuel_burnt: f64, "kg", Copy;
        /// Heat released by it.
        heat_released: f64, "J", Copy;
        /// Heat put in by igniting flames.
        heat_of_ignition: f64, "J", Copy;
        /// Heat lost to the surroundings.
        heat_lost: f64, "J", Copy;
        /// Heat that left with the gas, where the heat capacity follows the fuel.
        heat_carried: f64, "J", Copy;
        /// Heat in the sheet at the start, over ambient.
        heat_initial: f64, "J", Copy;
        /// Heat from gas and surroundings, less what the sheet radiates.
        heat_from_gas: f64, "J", Copy;
        /// Heat from radiant heaters.
        heat_from_heaters: f64, "J", Copy;
        /// Heat that went into a board behind the sheet.
        heat_to_board: f64, "J", Copy;
        /// Heat of drying; negative.
        heat_of_drying: f64, "J", Copy;
        /// Heat of reactions without oxygen; negative where they take heat up.
        heat_of_pyrolysis: f64, "J", Copy;
        /// Heat of reactions of the sheet with oxygen.
        heat_of_oxidation: f64, "J", Copy;
        /// Heat released in flames.
        heat_of_flames: f64, "J", Copy;
        /// Mean heat release of flames in the last frame.
        power_of_flames: f64, "W", Copy;
        /// Of the heat of flames, what did not go to the sheet.
        heat_of_flames_lost: f64, "J", Copy;
        /// Mass of the sheet at the start.
        mass_initial: f64, "kg", Copy;
        /// Fuel gas given off.
        volatiles: f64, "kg", Copy;
        /// Fuel gas that burnt in flames on the sheet.
        volatiles_burnt: f64, "kg", Copy;
        /// Water vapour of drying.
        steam: f64, "kg", Copy;
        /// Burnt gas made within the sheet.
        oxides: f64, "kg", Copy;
        /// Oxygen that the sheet took up.
        oxygen_taken: f64, "kg", Copy;
        /// Largest strain of any structural or shear spring so far.
        strain_max: f64, "1", Copy;
        /// Number the next piece gets.
        next_piece: u32, "1", Copy;
        /// Length of the last step of motion; 0 where there was none that can be looked back on.
        step_before: f64, "s", Copy;
        /// How far obstacles are behind their time, held up by sheets; 0 where all steps are solved.
        scenery_lag: f64, "s", Copy;
        /// Most pairs of triangles that crossed at the end of a frame; counted where there is contact.
        crossings_max: u32, "1", Copy;
        /// Pairs of features that have passed through each other; counted where there is contact.
        passed_through: u32, "1", Copy;
        /// Momentum of the whole sheet at the start, along each axis.
        momentum_initial: DVec3, "kg m/s", Copy;
    }
}

/// Everything that changes from step to step, and with it everything needed to go on from here.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SheetState {
    /// What moves.
    pub motion: MotionNodes,
    /// What burns.
    pub burn: BurnNodes,
    /// Who conducts to whom.
    pub burn_edges: BurnEdges,
    /// The surface that burns, where it is finer than the one that moves.
    pub burn_triangles: BurnTriangles,
    /// The face that normals point away from, in the physical model.
    pub front: FaceNodes,
    /// The other face.
    pub back: FaceNodes,
    /// What lies behind the back, where that takes up heat.
    pub board: BoardNodes,
    /// Who pulls on whom.
    pub springs: Springs,
    /// The surface.
    pub triangles: Triangles,
    /// Where nodes were a step ago.
    pub before: MotionBefore,
    /// Stress-free shapes of the triangles.
    pub rest: RestShapes,
    /// Connected pieces.
    pub pieces: Pieces,
    /// What has come off and is too small to be sheet.
    pub particles: Particles,
    /// Sums since the start.
    pub books: Books,
}

impl SheetState {
    /// Every table with its name.
    pub fn tables(&self) -> [(&'static str, Vec<Column<'_>>); 14] {
        [
            ("motion", self.motion.columns()),
            ("burn", self.burn.columns()),
            ("burn_edges", self.burn_edges.columns()),
            ("burn_triangles", self.burn_triangles.columns()),
            ("front", self.front.columns()),
            ("back", self.back.columns()),
            ("board", self.board.columns()),
            ("springs", self.springs.columns()),
            ("triangles", self.triangles.columns()),
            ("before", self.before.columns()),
            ("rest", self.rest.columns()),
            ("pieces", self.pieces.columns()),
            ("particles", self.particles.columns()),
            ("books", self.books.columns()),
        ]
    }

    /// Every column of every table, to be filled from a snapshot: `(table, column, data)`.
    pub fn columns_mut(&mut self) -> Vec<(&'static str, &'static str, fields::DataMut<'_>)> {
        let mut all = Vec::new();
        all.extend(self.motion.columns_mut().into_iter().map(|(n, d)| ("motion", n, d)));
        all.extend(self.burn.columns_mut().into_iter().map(|(n, d)| ("burn", n, d)));
        all.extend(self.burn_edges.columns_mut().into_iter().map(|(n, d)| ("burn_edges", n, d)));
        all.extend(self.burn_triangles.columns_mut().into_iter().map(|(n, d)| ("burn_triangles", n, d)));
        all.extend(self.front.columns_mut().into_iter().map(|(n, d)| ("front", n, d)));
        all.extend(self.back.columns_mut().into_iter().map(|(n, d)| ("back", n, d)));
        all.extend(self.board.columns_mut().into_iter().map(|(n, d)| ("board", n, d)));
        all.extend(self.springs.columns_mut().into_iter().map(|(n, d)| ("springs", n, d)));
        all.extend(self.triangles.columns_mut().into_iter().map(|(n, d)| ("triangles", n, d)));
        all.extend(self.before.columns_mut().into_iter().map(|(n, d)| ("before", n, d)));
        all.extend(self.rest.columns_mut().into_iter().map(|(n, d)| ("rest", n, d)));
        all.extend(self.pieces.columns_mut().into_iter().map(|(n, d)| ("pieces", n, d)));
        all.extend(self.particles.columns_mut().into_iter().map(|(n, d)| ("particles", n, d)));
        all.extend(self.books.columns_mut().into_iter().map(|(n, d)| ("books", n, d)));
        all
    }

    /// A hash of every bit of the state.
    pub fn hash(&self) -> u64 {
        let mut hash = Fnv::default();
        for (_, columns) in self.tables() {
            for column in columns {
                column.data.hash_into(&mut hash);
            }
        }
        hash.0
    }

    /// Inertial mass of a node [kg]: what burns there and what does not.
    #[inline]
    pub fn mass(&self, node: usize) -> f64 {
        self.motion.inert_mass[node] + self.motion.carried_mass[node]
    }

    /// The burn node at a motion node.
    #[inline]
    pub fn burn_node(&self, motion_node: usize) -> usize {
        self.motion.burn_node[motion_node] as usize
    }

    /// Where each burn node is [m], linear over the motion triangles.
    pub fn burn_positions(&self) -> Vec<DVec3> {
        self.at_burn_nodes(&self.motion.position)
    }

    /// Where each burn node lies in the stress-free sheet [m].
    pub fn burn_rest_positions(&self) -> Vec<DVec3> {
        self.at_burn_nodes(&self.motion.rest_position)
    }

    fn at_burn_nodes(&self, at_motion_nodes: &[DVec3]) -> Vec<DVec3> {
        let mut map = BurnMap::default();
        map.lay_out(self);
        (0..self.burn.len()).map(|i| map.interpolate(&self.triangles, at_motion_nodes, i)).collect()
    }

    /// Splits a burn node: a new last one takes this part of what is shared.
    pub fn split_burn_node(&mut self, burn_node: usize, part: f64) {
        self.burn.split(burn_node, part);
        for face in [&mut self.front, &mut self.back] {
            if !face.is_empty() {
                face.split(burn_node, part);
            }
        }
        if !self.board.is_empty() {
            self.board.split(burn_node, part);
        }
    }

    /// Whether the sheet has faces, as in the physical model.
    #[inline]
    pub fn has_faces(&self) -> bool {
        !self.front.is_empty()
    }

    /// Whether the burn mesh is finer than the motion mesh.
    #[inline]
    pub fn has_fine_burn_mesh(&self) -> bool {
        !self.burn_triangles.is_empty()
    }

    /// Box around the nodes at rest: lowest and highest corner [m].
    pub fn rest_bounds(&self) -> (DVec3, DVec3) {
        bounds(&self.motion.rest_position)
    }
}

/// Box around some points: lowest and highest corner [m].
pub fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
}
