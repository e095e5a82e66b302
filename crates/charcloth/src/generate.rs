//! Built-in sheets: irregular rectangle, disc, grid, chain.

use crate::mesh::SurfaceMesh;
use crate::random::Random;
use crate::scene::Sheet;
use glam::{DMat3, DVec2, DVec3, Vec2};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A point of the triangulation that remembers its number.
struct Numbered {
    position: Point2<f64>,
    number: u32,
}

impl HasPosition for Numbered {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

fn triangulate(points: &[DVec2]) -> Vec<[u32; 3]> {
    let numbered = points
        .iter()
        .enumerate()
        .map(|(k, p)| Numbered { position: Point2::new(p.x, p.y), number: k as u32 })
        .collect();
    // Points are finite and inside the sheet, so insertion cannot fail.
    let triangulation = DelaunayTriangulation::<Numbered>::bulk_load(numbered).expect("finite points triangulate");
    triangulation.inner_faces().map(|face| face.vertices().map(|v| v.data().number)).collect()
}

/// Number of intervals of about `spacing` in a length, at least one.
pub fn intervals(length: f64, spacing: f64) -> usize {
    ((length / spacing).round() as usize).max(1)
}

/// Irregular triangles inside a closed boundary: jittered hexagonal points, smoothed twice towards their neighbours.
/// `inside` is the distance to the boundary, positive inside.
fn fill(boundary: Vec<DVec2>, size: DVec2, spacing: f64, seed: u64, inside: impl Fn(DVec2) -> f64) -> SurfaceMesh {
    let mut random = Random::new(seed, 0x6d65_7368);
    let fixed = boundary.len();
    let mut points = boundary;
    let row_height = spacing * 0.75f64.sqrt();
    for row in 0..=(size.y / row_height) as usize + 1 {
        let shift = if row % 2 == 0 { 0.25 } else { 0.75 };
        for column in 0..=(size.x / spacing) as usize + 1 {
            // tuned: a third of the spacing hides the lattice, and smoothing still gives good triangles
            let jitter = DVec2::new(random.uniform() - 0.5, random.uniform() - 0.5) * (2.0 * 0.33 * spacing);
            let place = DVec2::new((column as f64 + shift) * spacing, (row as f64 + 0.5) * row_height) - 0.5 * size;
            if inside(place + jitter) > 0.55 * spacing {
                points.push(place + jitter);
            }
        }
    }
    let mut triangles = triangulate(&points);
    for _ in 0..2 {
        let mut sum = vec![DVec2::ZERO; points.len()];
        let mut count = vec![0.0; points.len()];
        for corners in &triangles {
            for k in 0..3 {
                let (i, j) = (corners[k] as usize, corners[(k + 1) % 3] as usize);
                sum[i] += points[j];
                sum[j] += points[i];
                count[i] += 1.0;
                count[j] += 1.0;
            }
        }
        for i in fixed..points.len() {
            points[i] = points[i].lerp(sum[i] / count[i], 0.7);
        }
        triangles = triangulate(&points);
    }
    // Delaunay may bridge a curved boundary with slivers; a tenth of the regular height is no triangle.
    triangles.retain(|t| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (b - a).perp_dot(c - a) > 0.05 * longest * longest
    });
    flat(points, triangles, size)
}

fn flat(points: Vec<DVec2>, triangles: Vec<[u32; 3]>, size: DVec2) -> SurfaceMesh {
    let uv = |i: u32| ((points[i as usize] + 0.5 * size) / size).as_vec2();
    let corner_uv: Vec<[Vec2; 3]> = triangles.iter().map(|t| t.map(uv)).collect();
    let count = triangles.len();
    SurfaceMesh {
        positions: points.iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect(),
        source_face: (0..count as u32).collect(),
        shell: vec![0; count],
        triangles,
        corner_uv,
        ..SurfaceMesh::default()
    }
}

/// Rectangle about the origin in the x-y plane, of irregular triangles.
pub fn rectangle(width: f64, height: f64, spacing: f64, seed: u64) -> SurfaceMesh {
    let half = DVec2::new(width, height) / 2.0;
    let (columns, rows) = (intervals(width, spacing), intervals(height, spacing));
    let mut boundary = Vec::new();
    for (from, to, count) in [
        (DVec2::new(-half.x, -half.y), DVec2::new(half.x, -half.y), columns),
        (DVec2::new(half.x, -half.y), DVec2::new(half.x, half.y), rows),
        (DVec2::new(half.x, half.y), DVec2::new(-half.x, half.y), columns),
        (DVec2::new(-half.x, half.y), DVec2::new(-half.x, -half.y), rows),
    ] {
        boundary.extend((0..count).map(|k| from.lerp(to, k as f64 / count as f64)));
    }
    fill(boundary, 2.0 * half, spacing, seed, |p| {
        let away = half - p.abs();
        away.x.min(away.y)
    })
}

/// Disc about the origin in the x-y plane, of irregular triangles.
pub fn disc(radius: f64, spacing: f64, seed: u64) -> SurfaceMesh {
    let count = intervals(std::f64::consts::TAU * radius, spacing).max(6);
    let boundary =
        (0..count).map(|k| DVec2::from_angle(std::f64::consts::TAU * k as f64 / count as f64) * radius).collect();
    fill(boundary, DVec2::splat(2.0 * radius), spacing, seed, |p| radius - p.length())
}

/// Sheets one above the other, about the middle of them, each with a mesh of its own, turned by a random angle.
pub fn layers(sheet: &Sheet, seed: u64, make: impl Fn(u64) -> SurfaceMesh) -> SurfaceMesh {
    let mut all = make(seed);
    let middle = 0.5 * f64::from(sheet.layers.max(1) - 1);
    let height = |layer: u32| (f64::from(layer) - middle) * sheet.layer_distance.0;
    all.positions.iter_mut().for_each(|p| p.z += height(0));
    let mut random = Random::new(seed, 0x7475_726e);
    for layer in 1..sheet.layers {
        let mesh = make(seed.wrapping_add(u64::from(layer)));
        let turned = DMat3::from_rotation_z(sheet.layer_turn.0 * (2.0 * random.uniform() - 1.0));
        let (first, faces) = (all.positions.len() as u32, all.triangles.len() as u32);
        all.positions.extend(mesh.positions.iter().map(|p| turned * *p + DVec3::Z * height(layer)));
        all.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|i| first + i)));
        all.corner_uv.extend(mesh.corner_uv);
        all.source_face.extend(mesh.source_face.iter().map(|face| faces + face));
        all.shell.extend(mesh.shell.iter().map(|_| layer));
    }
    all
}

/// Square cells: `columns` by `rows` nodes, row by row from the bottom left, with alternating diagonals.
pub fn grid(columns: usize, rows: usize, spacing: DVec2) -> SurfaceMesh {
    let size = DVec2::new((columns - 1) as f64, (rows - 1) as f64) * spacing;
    let points = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| DVec2::new(i as f64, j as f64) * spacing - 0.5 * size))
        .collect();
    let mut triangles = Vec::new();
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let a = (j * columns + i) as u32;
            let (b, c, d) = (a + 1, a + 1 + columns as u32, a + columns as u32);
            if (i + j) % 2 == 0 {
                triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    flat(points, triangles, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_sheets_have_the_area_they_should_and_good_triangles() {
        for (mesh, area) in [
            (rectangle(0.21, 0.297, 0.004, 1), 0.21 * 0.297),
            // the polygon on 63 points: (n/2) sin(2 pi/n) r^2
            (disc(0.05, 0.005, 3), 31.5 * (std::f64::consts::TAU / 63.0).sin() * 0.0025),
            (grid(5, 4, DVec2::splat(0.1)), 0.12),
        ] {
            mesh.validate().unwrap();
            let sum: f64 = (0..mesh.triangles.len()).map(|t| mesh.triangle_area(t)).sum();
            assert!((sum - area).abs() < 1e-12, "{sum} {area}");
        }
        let mesh = rectangle(0.21, 0.297, 0.004, 1);
        let ideal = 0.21 * 0.297 / (0.004 * 0.004 * 0.75f64.sqrt());
        assert!((mesh.positions.len() as f64 / ideal - 1.0).abs() < 0.1, "{} {ideal}", mesh.positions.len());
    }

    #[test]
    fn layers_are_turned_by_no_more_than_they_should_and_each_by_its_own_angle() {
        let most = 0.2;
        let sheet = Sheet { layers: 4, layer_turn: crate::units::Angle(most), ..Sheet::default() };
        let mesh = layers(&sheet, 7, |_| grid(3, 3, DVec2::splat(0.1)));
        let angles: Vec<f64> = (0..4)
            .map(|layer| {
                let [a, b] = [0, 1].map(|i| mesh.positions[layer * 9 + i]);
                assert!((a.distance(b) - 0.1).abs() < 1e-12);
                (b - a).y.atan2((b - a).x)
            })
            .collect();
        assert_eq!(angles[0], 0.0);
        assert!(angles[1..].iter().all(|angle| *angle != 0.0 && angle.abs() <= most), "{angles:?}");
        assert!(angles[1] != angles[2] && angles[2] != angles[3]);
    }
}
