//! From a scene to the state at frame 0: the surface becomes nodes, springs and edges with intensive coefficients.
//!
//! Sources: springs by kind [Provot1995]; stiffness of a spring of a triangle mesh K = E h sum(A)/L^2 [VanGelder1998],
//! Eq. 6.2; edge conductance by the cotangent Laplacian [Pinkall1993], Eq. 1.2.

mod burn_nodes;
mod paint;
mod rest_shape;
mod springs;

pub use burn_nodes::{image, sample_image};
pub(crate) use paint::{Canvas, Source};

use crate::burn_mesh::{self, BurnMap};
use crate::error::Error;
use crate::generate;
use crate::homogenise;
use crate::layout;
use crate::mesh::SurfaceMesh;
use crate::motion::Guide;
use crate::ragged;
use crate::random::RandomField;
use crate::scene::{Axis, Model, Pose, Scene, Shape};
use crate::sheet::{Books, BurnTriangles, MotionBefore, MotionNodes, NONE, Pieces, SheetState, Triangles, bounds};
use crate::simulation::Inputs;
use burn_nodes::{BurnPlaces, burn_nodes, check_burn_level, fine_edges};
use glam::{DMat3, DVec2, DVec3, Vec2};
use rest_shape::{heron, rest_shape, rest_shapes};
use springs::{lattice_springs, triangle_springs};
use std::collections::BTreeMap;

/// Regular layout of a grid or chain, for what only they can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Nodes along the width.
    pub columns: usize,
    /// Nodes along the height.
    pub rows: usize,
    /// Distance of nodes along width and height [m].
    pub spacing: DVec2,
}

impl Lattice {
    /// Column and row of a node.
    pub fn place(&self, node: usize) -> (usize, usize) {
        (node % self.columns, node / self.columns)
    }
}

/// A sheet as built, with what the scene needs to know of it besides its state.
pub struct Built {
    /// The state at frame 0, before ignition.
    pub state: SheetState,
    /// Layout, if regular.
    pub lattice: Option<Lattice>,
    /// Node that each point of the input became.
    pub node_of_source: Vec<u32>,
    /// Painted attributes by node.
    pub painted: BTreeMap<String, Vec<f32>>,
    /// Texture coordinates by burn node (of one of its corners), for maps.
    pub burn_uv: Vec<Vec2>,
    /// Motion that the sheet has already.
    pub guide: Option<Guide>,
    /// Painted factor on the moisture of each burn node; empty for 1.
    pub moisture: Vec<f64>,
    /// Direction that leads up.
    pub up: DVec3,
    /// Across and along the sheet as it lies at the start: directions of "right" and "top".
    pub right_top: [DVec3; 2],
    /// Middle of the sheet at the start [m].
    pub middle: DVec3,
    /// Remarks for the user.
    pub remarks: Vec<String>,
}

/// Builds the sheet of a scene.
pub fn sheet(scene: &Scene, inputs: &Inputs) -> Result<Built, Error> {
    let description = &scene.sheet;
    let up = match scene.up {
        Axis::Y => DVec3::Y,
        Axis::Z => DVec3::Z,
    };
    let from_file = description.mesh.is_some();
    if scene.fire.raw.is_some() && (from_file || !matches!(description.shape, Shape::Grid | Shape::Chain)) {
        return Err(Error::scene(
            "fire.raw",
            "raw coefficients are per node and only mean something on a uniform grid or chain",
            "give burn_time, heat_of_combustion, diffusivity and the rest, or set sheet.shape = \"grid\"",
        ));
    }
    let (mut mesh, lattice) = surface(scene, inputs)?;
    // Springs of a lattice are for exact answers and for the sketch as it stands: they are flat.
    if lattice.is_none() || scene.model == Model::Physical {
        cockle(scene, &mut mesh);
    }
    let mut rest = rest_shape(scene, inputs, &mesh)?;
    // Lattices are in a good order as they are, and tests count on it.
    let order = match lattice {
        Some(_) => (0..mesh.positions.len() as u32).collect(),
        None => layout::order(&mesh),
    };
    mesh = layout::renumbered(&mesh, &order);
    rest.points = order.iter().map(|i| rest.points[*i as usize]).collect();
    let to_world = if from_file { DMat3::IDENTITY } else { pose(description.pose, scene.up) };
    let [rx, ry, rz] = description.rotate.map(|angle| angle.0);
    let turn = DMat3::from_rotation_z(rz) * DMat3::from_rotation_y(ry) * DMat3::from_rotation_x(rx) * to_world;
    let shift = DVec3::from_array(description.position.map(|length| length.0));
    for point in &mut mesh.positions {
        *point = turn * *point + shift;
    }
    let right_top = right_top(from_file, description.pose, up, scene.up, turn * to_world.transpose());

    let node_count = mesh.positions.len();
    let mut motion = MotionNodes {
        position: mesh.positions.clone(),
        rest_position: rest.points,
        source: order.clone(),
        burn_node: (0..node_count as u32).collect(),
        alive: vec![1; node_count],
        sheet: node_shells(&mesh, node_count),
        ..MotionNodes::zeros(node_count)
    };
    let guide = guide(scene, inputs, &mesh, (turn, shift))?;
    if let Some(guide) = &guide {
        for i in 0..node_count {
            (motion.position[i], motion.velocity[i]) = guide.at(order[i] as usize, 0.0);
        }
    }
    let sides = &rest.sides;
    let rest_area: Vec<f64> = sides.iter().map(|s| heron(*s)).collect();
    if let Some(t) = rest_area.iter().position(|a| a.is_nan() || *a <= 0.0) {
        return Err(Error::mesh(
            format!("triangle {t} has no area in its stress-free shape"),
            "check sheet.rest: the texture coordinates or the rest mesh fold it to a line",
        ));
    }
    let triangle_count = mesh.triangles.len();
    let triangles = Triangles {
        corners: mesh.triangles.clone(),
        uv: if mesh.corner_uv.is_empty() { vec![[Vec2::ZERO; 3]; triangle_count] } else { mesh.corner_uv.clone() },
        source_face: mesh.source_face.clone(),
        sheet: mesh.shell.clone(),
        rest_area: rest_area.clone(),
        alive: vec![1; triangle_count],
        piece: mesh.shell.clone(),
        parted: vec![0; triangle_count],
    };
    let machine = machine_direction(scene, right_top);
    let rest_shapes = rest_shapes(&mesh, &motion.rest_position, sides, machine);
    let (mut springs, mut burn_edges) = match lattice {
        Some(lattice) => lattice_springs(scene, &mesh, lattice),
        None => triangle_springs(scene, &mesh, &motion.rest_position, sides, &rest_area),
    };
    let mut places = BurnPlaces::of_motion_nodes(&motion, &triangles, lattice);
    let mut burn_triangles = BurnTriangles::default();
    if description.burn_level > 0 {
        check_burn_level(scene, &triangles)?;
        let mut refined = burn_mesh::refine(node_count, &triangles.corners, sides, &rest_area, description.burn_level);
        if scene.model == Model::Physical && scene.mechanics.moves && scene.crack.enabled {
            let plane = |t: usize| [rest_shapes.side_1[t].truncate(), rest_shapes.side_2[t].truncate()];
            let planes: Vec<[DVec2; 2]> = (0..triangle_count).map(plane).collect();
            ragged::put_aside(&mut refined, &planes, description.burn_level, scene.seed);
        }
        places = BurnPlaces::of_burn_mesh(&refined, &motion, &triangles);
        let order = layout::along_curve(&places.rest_position);
        let numbers = layout::numbers(&order);
        places = places.renumbered(&order);
        refined.renumber(&numbers);
        motion.burn_node.copy_from_slice(&numbers[..node_count]);
        burn_edges = fine_edges(scene, &refined);
        // The heat that runs beside a spring runs along many edges.
        springs.edge.fill(NONE);
        burn_triangles = refined.triangles;
    }
    let burn = burn_nodes(scene, inputs, &places)?;
    let burn_uv = places.uv;
    let before = MotionBefore { position: motion.position.clone(), velocity: motion.velocity.clone() };
    let mut books = Books::zeros(1);
    books.next_piece[0] = mesh.shell_count() as u32;
    let shells = mesh.shell_count();
    let pieces = Pieces { parent: vec![NONE; shells], ..Pieces::zeros(shells) };
    let mut state = SheetState {
        pieces,
        motion,
        before,
        burn,
        burn_edges,
        burn_triangles,
        springs,
        triangles,
        rest: rest_shapes,
        books,
        ..SheetState::default()
    };
    let mut map = BurnMap::default();
    map.lay_out(&state);
    let moisture = paint::apply(scene, inputs, &mut state, &mesh.painted, &burn_uv, &map)?;
    let mut inert_mass = vec![0.0; node_count];
    map.gather(&state.motion.burn_node, |i| state.burn.fuel_initial[i], &mut inert_mass);
    inert_mass.iter_mut().for_each(|mass| *mass *= scene.mechanics.inert_fraction.0);
    state.motion.inert_mass = inert_mass;
    homogenise::carry_mass(&mut state, &map);
    let (low, high) = bounds(&state.motion.position);
    let middle = 0.5 * (low + high);
    Ok(Built {
        state,
        lattice,
        middle,
        node_of_source: layout::numbers(&order),
        painted: mesh.painted,
        burn_uv,
        guide,
        moisture,
        up,
        right_top,
        remarks: mesh.remarks,
    })
}

/// The surface of the scene in the coordinates of its own, and its layout if it is regular.
fn surface(scene: &Scene, inputs: &Inputs) -> Result<(SurfaceMesh, Option<Lattice>), Error> {
    let sheet = &scene.sheet;
    if let Some(path) = &sheet.mesh {
        let mesh = inputs.mesh.clone().ok_or_else(|| {
            Error::scene("sheet.mesh", format!("{path} was not read"), "read it and hand it over in Inputs::mesh")
        })?;
        mesh.validate()?;
        return Ok((mesh, None));
    }
    let positive = [
        ("sheet.width", sheet.width.0),
        ("sheet.height", sheet.height.0),
        ("sheet.radius", sheet.radius.0),
        ("sheet.spacing", sheet.node_distance()),
        ("sheet.grammage", sheet.grammage.0),
    ];
    if let Some((key, value)) = positive.iter().find(|(_, value)| value.is_nan() || *value <= 0.0) {
        return Err(Error::scene(*key, format!("{value} is not a size"), "it must be over zero"));
    }
    let (width, height, spacing) = (sheet.width.0, sheet.height.0, sheet.node_distance());
    match sheet.shape {
        Shape::Unstructured => {
            Ok((generate::layers(sheet, scene.seed, |seed| generate::rectangle(width, height, spacing, seed)), None))
        }
        Shape::Disc => {
            Ok((generate::layers(sheet, scene.seed, |seed| generate::disc(sheet.radius.0, spacing, seed)), None))
        }
        Shape::Grid => {
            let (columns, rows) = (generate::intervals(width, spacing), generate::intervals(height, spacing));
            let spacing = DVec2::new(width / columns as f64, height / rows as f64);
            let lattice = Lattice { columns: columns + 1, rows: rows + 1, spacing };
            Ok((generate::grid(columns + 1, rows + 1, spacing), Some(lattice)))
        }
        Shape::Chain => {
            let columns = generate::intervals(width, spacing);
            let spacing = DVec2::new(width / columns as f64, 0.0);
            let positions = (0..=columns).map(|i| DVec3::X * ((i as f64 - 0.5 * columns as f64) * spacing.x)).collect();
            let lattice = Lattice { columns: columns + 1, rows: 1, spacing };
            Ok((SurfaceMesh { positions, ..SurfaceMesh::default() }, Some(lattice)))
        }
    }
}

/// What leads a sheet that is animated already; none where the scene names no motion.
fn guide(scene: &Scene, inputs: &Inputs, mesh: &SurfaceMesh, placed: (DMat3, DVec3)) -> Result<Option<Guide>, Error> {
    let Some(files) = &scene.motion.files else { return Ok(None) };
    let sequence = inputs.motion.clone().filter(|sequence| !sequence.meshes.is_empty()).ok_or_else(|| {
        Error::scene("motion.files", format!("{files} was not read"), "read it and hand it over in Inputs::motion")
    })?;
    let wrong = sequence.meshes.iter().position(|points| points.len() != mesh.positions.len());
    match wrong {
        Some(k) => Err(Error::scene(
            "motion.files",
            format!("mesh {k} has {} points, the sheet {}", sequence.meshes[k].len(), mesh.positions.len()),
            "all must be the same mesh with its points moved",
        )),
        None => Ok(Some(Guide::of(scene, sequence, placed, mesh.shell_count() as u32))),
    }
}

/// Waves of the height of the sheet over its surface (Eq. 2.3), no shorter than the mesh can show.
fn cockle(scene: &Scene, mesh: &mut SurfaceMesh) {
    let (height, length) = (scene.sheet.cockle_height(), scene.sheet.cockle_length.0);
    if height <= 0.0 || mesh.triangles.is_empty() {
        return;
    }
    let built_in = scene.sheet.mesh.is_none();
    let sides = mesh.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    let lengths = sides.map(|ends| {
        let [a, b] = ends.map(|i| mesh.positions[*i as usize]);
        a.distance(b)
    });
    let side = lengths.sum::<f64>() / (3 * mesh.triangles.len()) as f64;
    // tuned: four nodes to a wave are what tells its height to a tenth or so; 3 to 8
    let field = RandomField::band(scene.seed, 0x636f_636b, length, built_in, 4.0 * side);
    if built_in {
        mesh.positions.iter_mut().for_each(|point| point.z += height * field.at(*point));
        return;
    }
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
        corners.iter().for_each(|i| normals[*i as usize] += (b - a).cross(c - a));
    }
    for (point, normal) in mesh.positions.iter_mut().zip(normals) {
        *point += normal.normalize_or_zero() * (height * field.at(*point));
    }
}

/// From the plane a built-in sheet is made in (width x, height y) to the world.
fn pose(pose: Pose, up: Axis) -> DMat3 {
    match (pose, up) {
        (Pose::Hanging, Axis::Y) | (Pose::Lying, Axis::Z) => DMat3::IDENTITY,
        (Pose::Hanging, Axis::Z) => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        (Pose::Lying, Axis::Y) => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    }
}

fn right_top(from_file: bool, pose: Pose, up: DVec3, axis: Axis, turn: DMat3) -> [DVec3; 2] {
    let top = match (from_file, pose, axis) {
        (true, ..) | (_, Pose::Hanging, _) => up,
        (_, Pose::Lying, Axis::Y) => DVec3::NEG_Z,
        (_, Pose::Lying, Axis::Z) => DVec3::Y,
    };
    if from_file { [DVec3::X, top] } else { [turn * DVec3::X, turn * top] }
}

/// The machine direction of the material, in the world.
fn machine_direction(scene: &Scene, [right, top]: [DVec3; 2]) -> DVec3 {
    let (sin, cos) = scene.shell.machine_direction.0.sin_cos();
    right * cos + top * sin
}

fn node_shells(mesh: &SurfaceMesh, node_count: usize) -> Vec<u32> {
    let mut shells = vec![0; node_count];
    for (corners, shell) in mesh.triangles.iter().zip(&mesh.shell) {
        for i in corners {
            shells[*i as usize] = *shell;
        }
    }
    shells
}

/// Lowest and highest corner of a sheet along its own "right" and "top" [m].
pub fn sheet_extent(positions: &[DVec3], right_top: [DVec3; 2]) -> (DVec2, DVec2) {
    let flat: Vec<DVec3> =
        positions.iter().map(|p| DVec3::new(p.dot(right_top[0]), p.dot(right_top[1]), 0.0)).collect();
    let (low, high) = bounds(&flat);
    (low.truncate(), high.truncate())
}
