//! From a scene to the state at frame 0: the surface becomes nodes, springs and edges with intensive coefficients.
//!
//! Sources: springs by kind [Provot1995]; stiffness of a spring of a triangle mesh K = E h sum(A)/L^2 [VanGelder1998],
//! Eq. 6.2; edge conductance by the cotangent Laplacian [Pinkall1993], Eq. 1.2.

use crate::burn_mesh::{self, BurnMap, Refined};
use crate::error::Error;
use crate::generate;
use crate::homogenise;
use crate::layout;
use crate::mesh::SurfaceMesh;
use crate::random::RandomField;
use crate::scene::{Axis, Fire, Pose, Rest, Scene, Shape};
use crate::sheet::{
    Books, BurnEdges, BurnNodes, BurnTriangles, MotionBefore, MotionNodes, NONE, Pieces, RestShapes, SheetState,
    SpringKind, Springs, Triangles, bounds,
};
use crate::shell::bending;
use crate::shell::membrane::RestTriangle;
use crate::simulation::{GreyImage, Inputs};
use glam::{DMat3, DVec2, DVec3, Vec2};
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
    /// Direction that leads up.
    pub up: DVec3,
    /// Across and along the sheet as it lies at the start: directions of "right" and "top".
    pub right_top: [DVec3; 2],
    /// Middle of the sheet at the start [m].
    pub middle: DVec3,
    /// Remarks for the user.
    pub remarks: Vec<String>,
}

/// Lengths of the sides of each triangle in the stress-free sheet, opposite to its corners [m].
type RestSides = Vec<[f64; 3]>;

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
    // Lattices are for exact answers and for the sketch as it stands: they are flat.
    if !from_file && lattice.is_none() && description.cockle.0 > 0.0 {
        let field = RandomField::new(scene.seed, 0x636f_636b, description.cockle_length.0);
        for point in &mut mesh.positions {
            point.z += description.cockle.0 * field.at(*point);
        }
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
    let motion = MotionNodes {
        position: mesh.positions.clone(),
        rest_position: rest.points,
        source: order.clone(),
        burn_node: (0..node_count as u32).collect(),
        alive: vec![1; node_count],
        sheet: node_shells(&mesh, node_count),
        ..MotionNodes::zeros(node_count)
    };
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
    let (mut springs, mut burn_edges) = match lattice {
        Some(lattice) => lattice_springs(scene, &mesh, lattice),
        None => triangle_springs(scene, &mesh, &motion.rest_position, sides, &rest_area),
    };
    let mut places = BurnPlaces::of_motion_nodes(&motion, &triangles, lattice);
    let mut burn_triangles = BurnTriangles::default();
    if description.burn_level > 0 {
        check_burn_level(scene, &triangles)?;
        let refined = burn_mesh::refine(node_count, &triangles.corners, sides, &rest_area, description.burn_level);
        burn_edges = fine_edges(scene, &refined);
        // The heat that runs beside a spring runs along many edges.
        springs.edge.fill(NONE);
        places = BurnPlaces::of_burn_mesh(&refined, &motion, &triangles);
        burn_triangles = refined.triangles;
    }
    let burn = burn_nodes(scene, inputs, &places)?;
    let burn_uv = places.uv;
    let machine = machine_direction(scene, right_top);
    let before = MotionBefore { position: motion.position.clone(), velocity: motion.velocity.clone() };
    let rest_shapes = rest_shapes(&mesh, &motion.rest_position, sides, machine);
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
    let mut inert_mass = vec![0.0; node_count];
    map.gather(&state.motion.burn_node, &state.burn.fuel_initial, &mut inert_mass);
    inert_mass.iter_mut().for_each(|mass| *mass *= scene.mechanics.inert_fraction.0);
    state.motion.inert_mass = inert_mass;
    homogenise::carry_mass(&mut state, &map);
    let mut node_of_source = vec![0; node_count];
    for (node, source) in order.iter().enumerate() {
        node_of_source[*source as usize] = node as u32;
    }
    let (low, high) = bounds(&state.motion.position);
    let middle = 0.5 * (low + high);
    Ok(Built {
        state,
        lattice,
        middle,
        node_of_source,
        painted: mesh.painted,
        burn_uv,
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

struct RestShape {
    points: Vec<DVec3>,
    sides: RestSides,
}

/// The stress-free shape: a point for each node, and the lengths of the sides of each triangle.
fn rest_shape(scene: &Scene, inputs: &Inputs, mesh: &SurfaceMesh) -> Result<RestShape, Error> {
    let sides_of = |points: &[DVec3]| -> RestSides {
        mesh.triangles.iter().map(|t| triangle_sides(t.map(|i| points[i as usize]))).collect()
    };
    match scene.sheet.rest {
        Rest::AsItLies => Ok(RestShape { points: mesh.positions.clone(), sides: sides_of(&mesh.positions) }),
        Rest::Mesh => {
            let rest = inputs.rest_mesh.as_ref().ok_or_else(|| {
                Error::scene("sheet.rest_mesh", "there is none", "name the mesh with the stress-free shape")
            })?;
            if rest.positions.len() != mesh.positions.len() || rest.triangles != mesh.triangles {
                return Err(Error::scene(
                    "sheet.rest_mesh",
                    format!(
                        "it has {} points and {} triangles, the sheet {} and {}, or they are joined differently",
                        rest.positions.len(),
                        rest.triangles.len(),
                        mesh.positions.len(),
                        mesh.triangles.len()
                    ),
                    "it must be the same mesh with its points moved",
                ));
            }
            Ok(RestShape { points: rest.positions.clone(), sides: sides_of(&rest.positions) })
        }
        Rest::FlatByUv => {
            if mesh.corner_uv.is_empty() {
                return Err(Error::scene(
                    "sheet.rest",
                    "the mesh has no texture coordinates to lay it flat by",
                    "unwrap it, or use rest = \"as_it_lies\"",
                ));
            }
            // Texture coordinates have no size: scale each shell to the area it has as it lies.
            let shells = mesh.shell_count();
            let (mut area, mut uv_area) = (vec![0.0; shells], vec![0.0; shells]);
            for (t, shell) in mesh.shell.iter().enumerate() {
                let [a, b, c] = mesh.corner_uv[t].map(|p| p.as_dvec2());
                area[*shell as usize] += mesh.triangle_area(t);
                uv_area[*shell as usize] += 0.5 * (b - a).perp_dot(c - a).abs();
            }
            let mut points = vec![DVec3::ZERO; mesh.positions.len()];
            let mut sides = Vec::with_capacity(mesh.triangles.len());
            for (t, corners) in mesh.triangles.iter().enumerate() {
                let shell = mesh.shell[t] as usize;
                let scale = (area[shell] / uv_area[shell]).sqrt();
                let flat = mesh.corner_uv[t].map(|p| (p.as_dvec2() * scale).extend(0.0));
                for k in 0..3 {
                    points[corners[k] as usize] = flat[k];
                }
                sides.push(triangle_sides(flat));
            }
            Ok(RestShape { points, sides })
        }
    }
}

fn triangle_sides([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    [b.distance(c), c.distance(a), a.distance(b)]
}

/// The machine direction of the material, in the world.
fn machine_direction(scene: &Scene, [right, top]: [DVec3; 2]) -> DVec3 {
    let (sin, cos) = scene.shell.machine_direction.0.sin_cos();
    right * cos + top * sin
}

/// The stress-free shape of each triangle: its sides, laid into the plane with the machine direction along x, and the
/// curvature of the surface there.
fn rest_shapes(mesh: &SurfaceMesh, rest_position: &[DVec3], sides: &RestSides, machine: DVec3) -> RestShapes {
    let mut shapes = RestShapes::zeros(mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Where the machine direction stands on the triangle, any direction in its plane is as good.
        let mut along = machine - normal * machine.dot(normal);
        if along.length_squared() < 1e-6 {
            along = normal.any_orthonormal_vector();
        }
        let along = along.normalize();
        let across = normal.cross(along);
        let start = DVec2::new((b - a).dot(along), (b - a).dot(across)).normalize_or(DVec2::X);
        let [bc, ca, ab] = sides[t];
        let cosine = ((ab * ab + ca * ca - bc * bc) / (2.0 * ab * ca)).clamp(-1.0, 1.0);
        let turned = DVec2::new(cosine, (1.0 - cosine * cosine).sqrt());
        shapes.side_1[t] = (start * ab).extend(0.0);
        shapes.side_2[t] = (start.rotate(turned) * ca).extend(0.0);
    }
    let flat = rest_position.iter().all(|p| p.z == rest_position[0].z);
    if !flat && !mesh.triangles.is_empty() {
        let rest: Vec<RestTriangle> = (0..mesh.triangles.len())
            .map(|t| RestTriangle::new(shapes.side_1[t].truncate(), shapes.side_2[t].truncate()))
            .collect();
        shapes.curvature = bending::curvatures(&mesh.triangles, &rest, rest_position);
    }
    shapes
}

/// Area of a triangle from its sides, in the stable order of Kahan's form of Heron's formula [Kahan2014] [m2].
fn heron(sides: [f64; 3]) -> f64 {
    let mut s = sides;
    s.sort_by(|x, y| y.total_cmp(x));
    let [a, b, c] = s;
    0.25 * ((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))).max(0.0).sqrt()
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

fn node_uv(triangles: &Triangles, node_count: usize) -> Vec<Vec2> {
    let mut uv = vec![Vec2::ZERO; node_count];
    for (corners, corner_uv) in triangles.corners.iter().zip(&triangles.uv) {
        for k in 0..3 {
            uv[corners[k] as usize] = corner_uv[k];
        }
    }
    uv
}

/// Grey value of an image at a texture coordinate (v counts up), bilinear, clamped at the borders.
pub fn sample_image(image: &GreyImage, uv: Vec2) -> f32 {
    let (w, h) = (image.width.max(1), image.height.max(1));
    let x = (uv.x * w as f32 - 0.5).clamp(0.0, (w - 1) as f32);
    let y = ((1.0 - uv.y) * h as f32 - 0.5).clamp(0.0, (h - 1) as f32);
    let (i, j) = (x as usize, y as usize);
    let at = |i: usize, j: usize| image.values[j.min(h - 1) * w + i.min(w - 1)];
    let (fx, fy) = (x - i as f32, y - j as f32);
    let low = at(i, j) * (1.0 - fx) + at(i + 1, j) * fx;
    let high = at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx;
    low * (1.0 - fy) + high * fy
}

/// The image a key names.
pub fn image<'a>(inputs: &'a Inputs, key: &str, path: &str) -> Result<&'a GreyImage, Error> {
    inputs
        .images
        .get(path)
        .ok_or_else(|| Error::scene(key, format!("{path} was not read"), "hand it over in Inputs::images"))
}

/// Where the burn nodes lie: in the stress-free sheet, on its texture, and the area that each stands for.
struct BurnPlaces {
    rest_position: Vec<DVec3>,
    uv: Vec<Vec2>,
    area: Vec<f64>,
}

impl BurnPlaces {
    fn of_motion_nodes(motion: &MotionNodes, triangles: &Triangles, lattice: Option<Lattice>) -> Self {
        let mut area = area_of_nodes(motion.len(), &triangles.corners, &triangles.rest_area);
        if let Some(lattice) = lattice {
            for (i, area) in area.iter_mut().enumerate() {
                *area = lattice_area(lattice, i);
            }
        }
        Self { rest_position: motion.rest_position.clone(), uv: node_uv(triangles, motion.len()), area }
    }

    fn of_burn_mesh(refined: &Refined, motion: &MotionNodes, triangles: &Triangles) -> Self {
        let fine = &refined.triangles;
        let mut rest_position = vec![DVec3::ZERO; refined.nodes];
        let mut uv = vec![Vec2::ZERO; refined.nodes];
        for t in 0..fine.len() {
            let parent = fine.parent[t] as usize;
            let [a, b, c] = triangles.corners[parent].map(|i| motion.rest_position[i as usize]);
            let [uv_a, uv_b, uv_c] = triangles.uv[parent];
            for (i, place) in fine.corners[t].iter().zip(fine.place[t]) {
                let [x, y] = place.as_dvec2().to_array();
                rest_position[*i as usize] = a * (1.0 - x - y) + b * x + c * y;
                uv[*i as usize] = uv_a + (uv_b - uv_a) * place.x + (uv_c - uv_a) * place.y;
            }
        }
        Self { rest_position, uv, area: area_of_nodes(refined.nodes, &fine.corners, &fine.rest_area) }
    }
}

fn area_of_nodes(count: usize, corners: &[[u32; 3]], rest_area: &[f64]) -> Vec<f64> {
    let mut area = vec![0.0; count];
    for (corners, rest_area) in corners.iter().zip(rest_area) {
        for i in corners {
            area[*i as usize] += rest_area / 3.0;
        }
    }
    area
}

fn check_burn_level(scene: &Scene, triangles: &Triangles) -> Result<(), Error> {
    let level = scene.sheet.burn_level;
    let problem = if level > burn_mesh::FINEST {
        format!("{level} is finer than is built")
    } else if triangles.is_empty() {
        "a chain has no triangles to refine".to_owned()
    } else if scene.fire.raw.is_some() {
        "raw coefficients are per node of the mesh that moves".to_owned()
    } else {
        return Ok(());
    };
    Err(Error::scene("sheet.burn_level", problem, format!("use 0 to {}; 0 is the mesh that moves", burn_mesh::FINEST)))
}

fn fine_edges(scene: &Scene, refined: &Refined) -> BurnEdges {
    let material = SpringMaterial::of(scene);
    let mut edges = BurnEdges::default();
    for edge in &refined.edges {
        material.edge(&mut edges, edge.ends, edge.distance, edge.shape.max(0.0));
        if let Some(triangles) = edges.triangles.last_mut() {
            *triangles = edge.triangles;
        }
    }
    edges
}

fn burn_nodes(scene: &Scene, inputs: &Inputs, places: &BurnPlaces) -> Result<BurnNodes, Error> {
    let BurnPlaces { rest_position, uv, area } = places;
    let count = area.len();
    let Fire { raw, .. } = &scene.fire;
    let variation = &scene.sheet.variation;
    let field = RandomField::new(scene.seed, 0x6675_656c, variation.correlation_length.0);
    let map = variation.map.as_deref().map(|path| image(inputs, "sheet.variation.map", path)).transpose()?;
    let raw = raw.clone().unwrap_or_default();
    let ambient = scene.fire.ambient_temperature.0;
    let mut burn = BurnNodes {
        temperature: vec![ambient; count],
        peak_temperature: vec![ambient; count],
        ignited_at: vec![-1.0; count],
        particle: vec![NONE; count],
        ..BurnNodes::zeros(count)
    };
    for i in 0..count {
        let mut factor = 1.0;
        if variation.noise.0 > 0.0 {
            // Eq. 2.1. A sheet has no places without fibre: cut the Gaussian off well above zero.
            factor *= (1.0 + variation.noise.0 * field.at(rest_position[i])).max(0.2);
        }
        if let Some(map) = map {
            let grey = f64::from(sample_image(map, uv[i]));
            factor *= variation.map_low.0 + (variation.map_high.0 - variation.map_low.0) * grey;
        }
        let nominal = raw.node_fuel.map_or(scene.sheet.grammage.0 * area[i], |mass| mass.0);
        burn.area[i] = area[i];
        burn.fuel_initial[i] = nominal * factor;
        burn.fuel[i] = burn.fuel_initial[i];
        burn.burn_rate_full[i] = raw.k1.map_or(nominal / scene.fire.burn_time.0, |k1| k1.0);
        // Eq. 1.5: k3 m0 is the reciprocal of the node's heat capacity.
        burn.heat_capacity[i] =
            raw.k3.map_or(scene.fire.heat_capacity.0 * burn.fuel_initial[i], |k3| 1.0 / (k3.0 * burn.fuel_initial[i]));
    }
    Ok(burn)
}

/// Part of the cell of a lattice node that lies inside the sheet, along one direction.
fn inner_part(index: usize, count: usize) -> f64 {
    if count > 1 && (index == 0 || index == count - 1) { 0.5 } else { 1.0 }
}

fn lattice_area(lattice: Lattice, node: usize) -> f64 {
    let (i, j) = lattice.place(node);
    if lattice.rows == 1 {
        // A chain stands for a strip as wide as its spacing.
        return lattice.spacing.x * lattice.spacing.x * inner_part(i, lattice.columns);
    }
    lattice.spacing.x * lattice.spacing.y * inner_part(i, lattice.columns) * inner_part(j, lattice.rows)
}

/// What the springs of each kind are made of.
struct SpringMaterial {
    /// Tension per strain and width [N/m] or stiffness [N/m], by kind.
    modulus: [f64; 3],
    raw: [Option<f64>; 3],
    /// Strain that breaks a spring; 0 means none does.
    breaking_strain: f64,
    /// Conductance of a square of sheet [W/K].
    sheet_conductance: f64,
    raw_k0: Option<f64>,
}

impl SpringMaterial {
    fn of(scene: &Scene) -> Self {
        let mechanics = &scene.mechanics;
        let raw = scene.fire.raw.clone().unwrap_or_default();
        let fire = &scene.fire;
        Self {
            modulus: [mechanics.structural.0, mechanics.shear.0, mechanics.flexion.0],
            raw: [raw.structural, raw.shear, raw.flexion].map(|k| k.map(|k| k.0)),
            breaking_strain: if mechanics.structural.0 > 0.0 {
                mechanics.strength.0 / mechanics.structural.0
            } else {
                0.0
            },
            // Eq. 1.1: D = kappa / (grammage c)
            sheet_conductance: fire.diffusivity.0 * scene.sheet.grammage.0 * fire.heat_capacity.0,
            raw_k0: raw.k0.map(|k0| k0.0),
        }
    }

    /// Adds a spring whose stiffness is `shape` times the modulus of its kind.
    fn spring(&self, springs: &mut Springs, kind: SpringKind, ends: [u32; 2], length: f64, shape: f64, hold: Hold) {
        let stiffness = self.raw[kind as usize].unwrap_or(self.modulus[kind as usize] * shape);
        if stiffness <= 0.0 {
            return;
        }
        springs.ends.push(ends);
        springs.kind.push(kind as u8);
        springs.rest_length.push(length);
        springs.stiffness.push(stiffness);
        springs.strength.push(stiffness * length * self.breaking_strain);
        springs.broken.push(0);
        springs.edge.push(hold.edge);
        springs.carriers.push(hold.carriers);
        springs.needs_both.push(u8::from(hold.needs_both));
    }

    /// Adds an edge of the burn mesh whose conductance is `width_over_distance` squares of sheet side by side.
    fn edge(&self, edges: &mut BurnEdges, ends: [u32; 2], distance: f64, width_over_distance: f64) {
        edges.ends.push(ends);
        edges.rest_distance.push(distance);
        edges.conductance_length.push(self.raw_k0.unwrap_or(self.sheet_conductance * width_over_distance * distance));
        edges.cut.push(0);
        edges.triangles.push([NONE; 2]);
    }
}

/// What a spring hangs on: the edge it runs along and the triangles that carry it.
struct Hold {
    edge: u32,
    carriers: [u32; 2],
    needs_both: bool,
}

/// An edge of the surface and the one or two triangles at it, with the corners opposite.
struct SurfaceEdge {
    triangles: [u32; 2],
    opposite: [u32; 2],
}

fn surface_edges(mesh: &SurfaceMesh) -> BTreeMap<[u32; 2], SurfaceEdge> {
    let mut edges: BTreeMap<[u32; 2], SurfaceEdge> = BTreeMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let edge =
                edges.entry([i.min(j), i.max(j)]).or_insert(SurfaceEdge { triangles: [NONE; 2], opposite: [NONE; 2] });
            let slot = usize::from(edge.triangles[0] != NONE);
            edge.triangles[slot] = t as u32;
            edge.opposite[slot] = corners[k];
        }
    }
    edges
}

/// Structural springs along edges, flexion springs between the corners opposite an inner edge.
fn triangle_springs(
    scene: &Scene,
    mesh: &SurfaceMesh,
    rest_points: &[DVec3],
    sides: &RestSides,
    area: &[f64],
) -> (Springs, BurnEdges) {
    let material = SpringMaterial::of(scene);
    let (mut springs, mut edges) = (Springs::default(), BurnEdges::default());
    for (ends, edge) in &surface_edges(mesh) {
        let mut area_sum = 0.0;
        let mut cotangents = 0.0;
        let mut lengths = 0.0;
        let mut count = 0.0;
        for slot in 0..2 {
            let t = edge.triangles[slot];
            if t == NONE {
                continue;
            }
            let t = t as usize;
            let k = mesh.triangles[t].iter().position(|c| *c == edge.opposite[slot]).expect("a corner of its triangle");
            let (a, b, c) = (sides[t][k], sides[t][(k + 1) % 3], sides[t][(k + 2) % 3]);
            area_sum += area[t];
            cotangents += (b * b + c * c - a * a) / (4.0 * area[t]);
            lengths += a;
            count += 1.0;
        }
        // A seam of a flattened sheet may give an edge two lengths: the mean.
        let length = lengths / count;
        let number = edges.len() as u32;
        // Eq. 1.2; a negative weight (obtuse triangles) would let heat run uphill, so it is none.
        material.edge(&mut edges, *ends, length, (0.5 * cotangents).max(0.0));
        let hold = Hold { edge: number, carriers: edge.triangles, needs_both: false };
        // Eq. 6.2
        material.spring(&mut springs, SpringKind::Structural, *ends, length, area_sum / (length * length), hold);
        if edge.triangles[1] != NONE {
            let t = edge.triangles.map(|t| t as usize);
            let unfolded = unfolded_distance(mesh, sides, *ends, t, edge.opposite, length);
            // Laid flat by its texture coordinates the sheet has no crease at rest; else it has those it lies in.
            let across = match scene.sheet.rest {
                Rest::FlatByUv => unfolded,
                Rest::AsItLies | Rest::Mesh => {
                    let [c, d] = edge.opposite.map(|i| rest_points[i as usize]);
                    c.distance(d)
                }
            };
            let hold = Hold { edge: number, carriers: edge.triangles, needs_both: true };
            // A sharp crease makes the sheet no stiffer.
            let shape = area_sum / (unfolded * unfolded);
            material.spring(&mut springs, SpringKind::Flexion, edge.opposite, across, shape, hold);
        }
    }
    (springs, edges)
}

/// Distance of the corners opposite an edge, with the two stress-free triangles unfolded flat; a sheet that is folded
/// or curved at rest is pushed open by it.
fn unfolded_distance(
    mesh: &SurfaceMesh,
    sides: &RestSides,
    ends: [u32; 2],
    triangles: [usize; 2],
    opposite: [u32; 2],
    length: f64,
) -> f64 {
    // Sides from end 0 to each opposite corner, and from end 1.
    let mut place = [DVec2::ZERO; 2];
    for slot in 0..2 {
        let corners = mesh.triangles[triangles[slot]];
        let side_to = |end: u32| {
            let third = corners.iter().position(|c| *c != end && *c != opposite[slot]).expect("three corners");
            sides[triangles[slot]][third]
        };
        let (from_start, from_end) = (side_to(ends[0]), side_to(ends[1]));
        let x = (from_start * from_start + length * length - from_end * from_end) / (2.0 * length);
        let y = (from_start * from_start - x * x).max(0.0).sqrt();
        place[slot] = DVec2::new(x, if slot == 0 { y } else { -y });
    }
    place[0].distance(place[1])
}

/// Provot's three kinds of spring on a grid; a chain has structural ones only.
fn lattice_springs(scene: &Scene, mesh: &SurfaceMesh, lattice: Lattice) -> (Springs, BurnEdges) {
    let material = SpringMaterial::of(scene);
    let Lattice { columns, rows, spacing } = lattice;
    let (mut springs, mut edges) = (Springs::default(), BurnEdges::default());
    let surface = surface_edges(mesh);
    let carriers_of = |i: u32, j: u32| surface.get(&[i.min(j), i.max(j)]).map_or([NONE; 2], |e| e.triangles);
    let at = |i: usize, j: usize| (j * columns + i) as u32;
    for j in 0..rows {
        for i in 0..columns {
            let here = at(i, j);
            // Along the width, along the height: (next node, length, width of the strip the edge stands for).
            let steps = [
                (i + 1 < columns, 1, 0, spacing.x, if rows > 1 { spacing.y * inner_part(j, rows) } else { spacing.x }),
                (j + 1 < rows, 0, 1, spacing.y, spacing.x * inner_part(i, columns)),
            ];
            for (exists, di, dj, length, width) in steps {
                if !exists {
                    continue;
                }
                let next = at(i + di, j + dj);
                let number = edges.len() as u32;
                material.edge(&mut edges, [here, next], length, width / length);
                let hold = Hold { edge: number, carriers: carriers_of(here, next), needs_both: false };
                material.spring(&mut springs, SpringKind::Structural, [here, next], length, width / length, hold);
                if rows > 1 && i + 2 * di < columns && j + 2 * dj < rows {
                    let far = at(i + 2 * di, j + 2 * dj);
                    let first = carriers_of(here, next).into_iter().find(|t| *t != NONE).unwrap_or(NONE);
                    let second = carriers_of(next, far).into_iter().find(|t| *t != NONE).unwrap_or(NONE);
                    let hold = Hold { edge: NONE, carriers: [first, second], needs_both: true };
                    let shape = width / (2.0 * length);
                    material.spring(&mut springs, SpringKind::Flexion, [here, far], 2.0 * length, shape, hold);
                }
            }
            if i + 1 < columns && j + 1 < rows {
                let diagonal = spacing.length();
                for ends in [[here, at(i + 1, j + 1)], [at(i + 1, j), at(i, j + 1)]] {
                    let on_surface = carriers_of(ends[0], ends[1]);
                    let hold = if on_surface[0] != NONE {
                        Hold { edge: NONE, carriers: on_surface, needs_both: false }
                    } else {
                        let other =
                            if ends[0] == here { [at(i + 1, j), at(i, j + 1)] } else { [here, at(i + 1, j + 1)] };
                        let [t0, t1] = carriers_of(other[0], other[1]);
                        let holds = |t: u32, node: u32| mesh.triangles[t as usize].contains(&node);
                        let carriers = if holds(t0, ends[0]) { [t0, t1] } else { [t1, t0] };
                        Hold { edge: NONE, carriers, needs_both: true }
                    };
                    material.spring(&mut springs, SpringKind::Shear, ends, diagonal, 1.0, hold);
                }
            }
        }
    }
    (springs, edges)
}

/// Lowest and highest corner of a sheet along its own "right" and "top" [m].
pub fn sheet_extent(positions: &[DVec3], right_top: [DVec3; 2]) -> (DVec2, DVec2) {
    let flat: Vec<DVec3> =
        positions.iter().map(|p| DVec3::new(p.dot(right_top[0]), p.dot(right_top[1]), 0.0)).collect();
    let (low, high) = bounds(&flat);
    (low.truncate(), high.truncate())
}
