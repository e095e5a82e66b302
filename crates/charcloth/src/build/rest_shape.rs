//! The stress-free shape of the sheet.

use crate::error::Error;
use crate::mesh::SurfaceMesh;
use crate::scene::{Rest, Scene};
use crate::sheet::RestShapes;
use crate::shell::bending;
use crate::shell::membrane::RestTriangle;
use crate::simulation::Inputs;
use glam::{DVec2, DVec3};

/// Lengths of the sides of each triangle in the stress-free sheet, opposite to its corners [m].
pub(super) type RestSides = Vec<[f64; 3]>;

pub(super) struct RestShape {
    pub points: Vec<DVec3>,
    pub sides: RestSides,
}

/// The stress-free shape: a point for each node, and the lengths of the sides of each triangle.
pub(super) fn rest_shape(scene: &Scene, inputs: &Inputs, mesh: &SurfaceMesh) -> Result<RestShape, Error> {
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

/// The stress-free shape of each triangle: its sides, laid into the plane with the machine direction along x, and the
/// curvature of the surface there.
pub(super) fn rest_shapes(
    mesh: &SurfaceMesh,
    rest_position: &[DVec3],
    sides: &RestSides,
    machine: DVec3,
) -> RestShapes {
    let count = mesh.triangles.len();
    let one = vec![1.0; count];
    let mut shapes =
        RestShapes { thickness: one.clone(), strength: one.clone(), fibre: one, ..RestShapes::zeros(count) };
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
pub(super) fn heron(sides: [f64; 3]) -> f64 {
    let mut s = sides;
    s.sort_by(|x, y| y.total_cmp(x));
    let [a, b, c] = s;
    0.25 * ((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))).max(0.0).sqrt()
}
