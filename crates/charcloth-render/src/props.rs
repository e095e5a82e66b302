//! What sheets meet, as it is seen: solids as they are, planes as tops of tables that fade into the dark.

use crate::camera::Camera;
use charcloth::contact::scenery::{Motion, Scenery, Solid};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// How far a plane is seen, in radii of the sheet. // tuned: its end must not be seen, 2 to 6
const FAR: f64 = 4.0;
/// Cells of a plane along each side: few enough to be cheap, small enough to be cut off behind the eye unseen.
const CELLS: usize = 32;
/// Cosine of the angle between faces over which an edge is seen as one.
const SHARP: f64 = 0.8; // tuned: facets of a sphere are round, edges of a box are not; 0.6 to 0.95

/// Obstacles as triangles; planes come first.
#[derive(Debug, Clone, Default)]
pub struct Props {
    points: Vec<DVec3>,
    /// Points and triangles that move as one.
    parts: Vec<(Range<usize>, Range<usize>, Motion)>,
    /// Solids that bend: their part, and how.
    bending: Vec<(usize, Solid)>,
    normals: Vec<[DVec3; 3]>,
    /// Corners of all triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles that belong to planes.
    pub flat: usize,
    /// Where the points are now [m].
    pub place: Vec<DVec3>,
    /// The same from the camera's target.
    pub position: Vec<Vec3>,
    /// Unit normals at the corners of each triangle, now.
    pub normal: Vec<[Vec3; 3]>,
    /// How far from the target planes have faded [m].
    pub far: f32,
}

impl Props {
    /// The obstacles of a scene before a camera.
    pub fn build(scenery: &Scenery, camera: &Camera) -> Self {
        let mut props = Self { far: (FAR * camera.radius) as f32, ..Self::default() };
        // What is taken away is a hand that is not in the picture.
        for plane in scenery.planes.iter().filter(|plane| plane.until == f64::INFINITY) {
            let middle = camera.target - plane.normal * plane.normal.dot(camera.target - plane.point);
            let (across, along) = plane.normal.any_orthonormal_pair();
            let cell = 2.0 * FAR * camera.radius / CELLS as f64;
            let at = |k: usize| (k as f64 - 0.5 * CELLS as f64) * cell;
            let side = CELLS + 1;
            let points = (0..side * side).map(|k| middle + across * at(k % side) + along * at(k / side)).collect();
            let square = |k: usize| {
                let [a, b, c, d] = [k, k + 1, k + side, k + side + 1].map(|i| i as u32);
                [[a, b, c], [b, d, c]]
            };
            let triangles = (0..CELLS * CELLS).flat_map(|k| square(k % CELLS + k / CELLS * side)).collect();
            props.add(points, triangles, plane.motion);
        }
        props.flat = props.triangles.len();
        for solid in &scenery.solids {
            if solid.course.is_some() {
                props.bending.push((props.parts.len(), solid.clone()));
            }
            props.add(solid.points.clone(), solid.triangles.clone(), solid.motion);
        }
        props
    }

    fn add(&mut self, points: Vec<DVec3>, triangles: Vec<[u32; 3]>, motion: Motion) {
        self.normals.extend(smooth_normals(&points, &triangles));
        let (first, first_triangle) = (self.points.len(), self.triangles.len());
        self.triangles.extend(triangles.iter().map(|corners| corners.map(|i| i + first as u32)));
        self.points.extend(points);
        self.parts.push((first..self.points.len(), first_triangle..self.triangles.len(), motion));
    }

    /// Puts everything where it is at a time [s].
    pub fn move_to(&mut self, time: f64, target: DVec3) {
        self.place.clone_from(&self.points);
        self.normal.clear();
        for (points, triangles, motion) in &self.parts {
            self.place[points.clone()].iter_mut().for_each(|point| *point = motion.place(*point, time));
            let turned = |normal: DVec3| {
                (motion.place(motion.origin + normal, time) - motion.place(motion.origin, time)).as_vec3()
            };
            self.normal.extend(self.normals[triangles.clone()].iter().map(|normals| normals.map(turned)));
        }
        for (part, solid) in &self.bending {
            let (points, triangles, _) = &self.parts[*part];
            for (k, place) in self.place[points.clone()].iter_mut().enumerate() {
                *place = solid.place(k, time);
            }
            let smooth = smooth_normals(&self.place[points.clone()], &solid.triangles);
            for (normal, smooth) in self.normal[triangles.clone()].iter_mut().zip(smooth) {
                *normal = smooth.map(|normal| normal.as_vec3());
            }
        }
        self.position.clear();
        self.position.extend(self.place.iter().map(|point| (*point - target).as_vec3()));
    }
}

/// Normals at the corners of each triangle: means over the faces around a point that are turned alike.
fn smooth_normals(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
    let face = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| points[i as usize]);
        (b - a).cross(c - a)
    };
    let faces: Vec<DVec3> = triangles.iter().map(face).collect();
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (t, corners) in triangles.iter().enumerate() {
        corners.iter().for_each(|i| around[*i as usize].push(t));
    }
    let of_corners = |(t, corners): (usize, &[u32; 3])| {
        let own = faces[t].normalize_or(DVec3::Y);
        corners.map(|i| {
            let near = around[i as usize].iter().map(|u| faces[*u]);
            let alike = near.filter(|other| other.normalize_or_zero().dot(own) > SHARP);
            alike.sum::<DVec3>().normalize_or(own)
        })
    };
    triangles.iter().enumerate().map(of_corners).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;
    use charcloth::contact::scenery::Solid;
    use charcloth::scene::{Axis, Camera as Settings};

    #[test]
    fn edges_of_a_box_are_sharp_and_it_turns_with_its_motion() {
        let bounds = (DVec3::splat(-0.1), DVec3::splat(0.1));
        let view =
            View { settings: Settings::default(), up: Axis::Y, bounds, size: [64, 48], scenery: Scenery::default() };
        let camera = Camera::build(&view).unwrap();
        let motion = Motion { spin: DVec3::Y, stop: f64::INFINITY, ..Motion::default() };
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let scenery = Scenery {
            solids: vec![Solid { points, triangles, motion, course: None, friction: 0.0 }],
            ..Scenery::default()
        };
        let mut props = Props::build(&scenery, &camera);
        props.move_to(0.0, DVec3::ZERO);
        assert_eq!(props.normal, [[Vec3::Z; 3], [Vec3::X; 3]]);
        props.move_to(std::f64::consts::FRAC_PI_2, DVec3::ZERO);
        for normal in props.normal[0] {
            assert!(normal.distance(Vec3::X) < 1e-6, "{normal}");
        }
        assert!(props.position[1].distance(-Vec3::Z) < 1e-6, "{}", props.position[1]);
    }
}
