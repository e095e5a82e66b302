//! Solid things that sheets meet: planes, and closed or open surfaces that move in one piece or as they are animated.
//!
//! Spheres and boxes become triangles, so that everything but a plane is met by one code: edges and corners of the sheet
//! and of the obstacle alike. Places are functions of time alone.

use crate::error::Error;
use crate::motion::MeshSequence;
use crate::scene::{Axis, Obstacle, ObstacleShape, Scene};
use crate::simulation::Inputs;
use glam::{DMat3, DQuat, DVec3};
use std::collections::BTreeMap;

/// Times the faces of an icosahedron are cut in four for a sphere. // tuned: facets of 2 degrees, off by 1e-3 of the radius
const SPHERE_CUTS: u32 = 4;

/// How an obstacle moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Motion {
    /// What it turns about at the start [m].
    pub origin: DVec3,
    /// [m/s]
    pub velocity: DVec3,
    /// [rad/s]
    pub spin: DVec3,
    /// When it stops [s].
    pub stop: f64,
}

impl Motion {
    /// Where a point of it is at a time [m], from where it was at the start.
    pub fn place(&self, point: DVec3, time: f64) -> DVec3 {
        if self.velocity == DVec3::ZERO && self.spin == DVec3::ZERO {
            return point;
        }
        let time = time.min(self.stop);
        self.origin + self.velocity * time + DQuat::from_scaled_axis(self.spin * time) * (point - self.origin)
    }

    /// Where a point that is there at a time [m] was at the start.
    pub fn back(&self, point: DVec3, time: f64) -> DVec3 {
        if self.velocity == DVec3::ZERO && self.spin == DVec3::ZERO {
            return point;
        }
        let time = time.min(self.stop);
        let turn = DQuat::from_scaled_axis(self.spin * -time);
        self.origin + turn * (point - self.origin - self.velocity * time)
    }
}

/// All that is below a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// A point of it at the start [m].
    pub point: DVec3,
    /// Unit vector out of it.
    pub normal: DVec3,
    /// How it moves; its normal stays.
    pub motion: Motion,
    /// When it is taken away [s].
    pub until: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

/// How far away a plane is that has been taken away [m].
const AWAY: f64 = 1e6;

impl Plane {
    /// A point of it at a time [m]: far below, and at rest, once it has been taken away.
    pub fn place(&self, time: f64) -> DVec3 {
        let [place, _] = self.way([time, time], 0.0);
        place
    }

    /// A point of it at the start and at the end of a step between two times [m], where it is so far behind at the start
    /// [s]. It is there to the end of the step in which it is taken away.
    pub fn way(&self, [before, after]: [f64; 2], lag: f64) -> [DVec3; 2] {
        if before >= self.until {
            return [self.motion.place(self.point, self.until) - self.normal * AWAY; 2];
        }
        [before - lag, after].map(|time| self.motion.place(self.point, time))
    }
}

/// How the points of a surface are animated, before it moves as a whole.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Course {
    /// Its points over time, as they stand in the scene.
    pub sequence: MeshSequence,
    /// Meshes a second.
    pub fps: f64,
    /// When the first is due [s].
    pub start: f64,
}

/// A surface that moves in one piece, or bends as well.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solid {
    /// Its points at the start [m].
    pub points: Vec<DVec3>,
    /// Corners of its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// How it moves.
    pub motion: Motion,
    /// How it is animated, where it does more than that.
    pub course: Option<Course>,
    /// Coefficient of friction.
    pub friction: f64,
}

impl Solid {
    /// Where a point of it is at a time [m].
    pub fn place(&self, point: usize, time: f64) -> DVec3 {
        let own = match &self.course {
            Some(Course { sequence, fps, start }) => sequence.at(point, sequence.place(time, *start, *fps))[0],
            None => self.points[point],
        };
        self.motion.place(own, time)
    }
}

/// Everything solid in a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scenery {
    /// Planes.
    pub planes: Vec<Plane>,
    /// Surfaces.
    pub solids: Vec<Solid>,
}

impl Scenery {
    /// The obstacles of a scene.
    pub fn of(scene: &Scene, inputs: &Inputs) -> Result<Self, Error> {
        let up = match scene.up {
            Axis::Y => DVec3::Y,
            Axis::Z => DVec3::Z,
        };
        let mut scenery = Self::default();
        for (row, obstacle) in scene.obstacle.iter().enumerate() {
            let friction = obstacle.friction.unwrap_or(scene.contact.friction).0;
            let origin = DVec3::from_array(obstacle.position.map(|q| q.0));
            let motion = Motion {
                origin,
                velocity: DVec3::from_array(obstacle.velocity.map(|q| q.0)),
                spin: DVec3::from_array(obstacle.spin.map(|q| q.0)),
                stop: obstacle.stop.map_or(f64::INFINITY, |q| q.0),
            };
            let [x, y, z] = obstacle.rotate.map(|angle| angle.0);
            let turn = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
            if obstacle.shape == ObstacleShape::Plane {
                let normal = turn * obstacle.normal.map_or(up, DVec3::from_array);
                let normal = normal.try_normalize().ok_or_else(|| {
                    Error::scene(format!("obstacle.{row}.normal"), "this is no direction", "write [0, 1, 0]")
                })?;
                let until = obstacle.until.map_or(f64::INFINITY, |q| q.0);
                scenery.planes.push(Plane { point: origin, normal, motion, until, friction });
                continue;
            }
            if obstacle.until.is_some() {
                return Err(Error::scene(
                    format!("obstacle.{row}.until"),
                    "only planes can be taken away",
                    "use shape = \"plane\", or let it move off with velocity",
                ));
            }
            let (points, triangles) = match obstacle.shape {
                ObstacleShape::Sphere => sphere(obstacle.radius.0),
                ObstacleShape::Box => block(DVec3::from_array(obstacle.size.map(|q| 0.5 * q.0))),
                _ => mesh(obstacle, row, inputs)?,
            };
            let put = |points: Vec<DVec3>| points.into_iter().map(|p| turn * p + origin).collect();
            let course = match &obstacle.files {
                Some(files) => {
                    let mut sequence = animated(files, points.len(), row, inputs)?;
                    sequence.meshes = sequence.meshes.into_iter().map(put).collect();
                    Some(Course { sequence, fps: obstacle.fps, start: obstacle.start.0 })
                }
                None => None,
            };
            scenery.solids.push(Solid { points: put(points), triangles, motion, course, friction });
        }
        Ok(scenery)
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty() && self.solids.is_empty()
    }
}

fn mesh(obstacle: &Obstacle, row: usize, inputs: &Inputs) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), Error> {
    let key = format!("obstacle.{row}.mesh");
    let path = obstacle.mesh.as_ref().ok_or_else(|| Error::scene(&*key, "no file is named", "add `mesh = ...`"))?;
    let mesh = inputs.obstacles.get(path).ok_or_else(|| {
        Error::scene(&*key, format!("{path} was not read"), "read it and hand it over in Inputs::obstacles")
    })?;
    mesh.validate()?;
    Ok((mesh.positions.clone(), mesh.triangles.clone()))
}

fn animated(files: &str, points: usize, row: usize, inputs: &Inputs) -> Result<MeshSequence, Error> {
    let key = format!("obstacle.{row}.files");
    let sequence = inputs.obstacle_motions.get(files).ok_or_else(|| {
        Error::scene(&*key, format!("{files} was not read"), "read it and hand it over in Inputs::obstacle_motions")
    })?;
    if sequence.meshes.is_empty() || sequence.meshes.iter().any(|mesh| mesh.len() != points) {
        return Err(Error::scene(key, "the sequence does not fit its mesh", "give meshes of the same points"));
    }
    Ok(sequence.clone())
}

/// A box about the origin.
fn block(half: DVec3) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    let corner = |k: u32| half * DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4));
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    ((0..8).map(corner).collect(), sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
}

/// A sphere about the origin, from an icosahedron.
fn sphere(radius: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let long = 0.5 * (1.0 + 5.0f64.sqrt());
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(-1.0, long), (1.0, long), (-1.0, -long), (1.0, -long)] {
        points.extend([DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)]);
    }
    // Faces are the triples of corners that are all an edge (of length 2) apart, turned outwards.
    let near = |i: usize, j: usize| points[i].distance_squared(points[j]) < 4.1;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let out = (points[j] - points[i]).cross(points[k] - points[i]).dot(points[i]) > 0.0;
                    let [j, k] = if out { [j, k] } else { [k, j] };
                    triangles.push([i, j, k].map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..SPHERE_CUTS {
        let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    points.push(points[i as usize].normalize() + points[j as usize].normalize());
                    points.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (points.into_iter().map(|p| p.normalize() * radius).collect(), triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(points: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
        let part = |[a, b, c]: &[u32; 3]| points[*a as usize].dot(points[*b as usize].cross(points[*c as usize])) / 6.0;
        triangles.iter().map(part).sum()
    }

    #[test]
    fn solids_are_closed_and_turned_outwards() {
        let (points, triangles) = block(DVec3::new(1.0, 2.0, 3.0));
        assert!((volume(&points, &triangles) - 48.0).abs() < 1e-12);
        let (points, triangles) = sphere(0.5);
        assert_eq!((points.len(), triangles.len()), (2562, 5120));
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        assert!((volume(&points, &triangles) / whole - 1.0).abs() < 3e-3);
    }

    #[test]
    fn a_plane_is_there_to_the_end_of_the_step_in_which_it_is_taken_away() {
        let motion = Motion { velocity: DVec3::Y, stop: f64::INFINITY, ..Motion::default() };
        let plane = Plane { point: DVec3::ZERO, normal: DVec3::Y, motion, until: 1.0, friction: 0.0 };
        assert_eq!(plane.way([0.9, 1.1], 0.0), [DVec3::Y * 0.9, DVec3::Y * 1.1]);
        assert_eq!(plane.way([0.9, 0.95], 0.1), [DVec3::Y * 0.8, DVec3::Y * 0.95]);
        let [before, after] = plane.way([1.0, 1.1], 0.05);
        assert!(before.y < -1e5 && before == after);
        assert!(plane.place(1.0).y < -1e5);
    }

    #[test]
    fn a_motion_turns_about_its_origin_and_stops() {
        let motion = Motion { origin: DVec3::X, velocity: DVec3::Y, spin: DVec3::Z, stop: 2.0 };
        assert!(motion.place(DVec3::X, 1.0).abs_diff_eq(DVec3::new(1.0, 1.0, 0.0), 1e-15));
        let point = DVec3::new(0.3, -0.7, 0.2);
        assert!(motion.back(motion.place(point, 1.3), 1.3).abs_diff_eq(point, 1e-15));
        assert_eq!(motion.place(DVec3::ZERO, 5.0), motion.place(DVec3::ZERO, 2.0));
    }
}
