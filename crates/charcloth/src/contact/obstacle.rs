//! Obstacles without a mesh: planes, spheres and boxes.
//!
//! Model: signed distance, negative inside, with its gradient as the normal. All three are convex, so their distance is
//! a convex function, and its tangent is a lower bound on any straight path. Valid for points: a face of the sheet may
//! still be pierced by a box corner or a sphere smaller than its triangles. Give such a thing a mesh instead.
//! Cost: some nanoseconds a point.

use glam::{DQuat, DVec3};

/// A solid that moves from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Obstacle {
    /// Everything below a plane.
    Plane {
        /// A point of it [m].
        point: DVec3,
        /// Unit vector out of the solid.
        normal: DVec3,
        /// Velocity [m/s].
        velocity: DVec3,
    },
    /// A ball.
    Sphere {
        /// Its centre [m].
        centre: DVec3,
        /// Its radius [m].
        radius: f64,
        /// Velocity of the centre [m/s].
        velocity: DVec3,
        /// Angular velocity [rad/s].
        spin: DVec3,
    },
    /// A box in any direction.
    Box {
        /// Its centre [m].
        centre: DVec3,
        /// Half of its sides [m].
        half_size: DVec3,
        /// From its own axes to those of the world.
        rotation: DQuat,
        /// Velocity of the centre [m/s].
        velocity: DVec3,
        /// Angular velocity [rad/s].
        spin: DVec3,
    },
}

impl Obstacle {
    /// Signed distance of a point to the surface [m], and the unit normal out of it there.
    pub fn distance(&self, point: DVec3) -> (f64, DVec3) {
        let (distance, normal) = self.distance_within(self.in_own_axes(point));
        match self {
            Self::Box { rotation, .. } => (distance, *rotation * normal),
            _ => (distance, normal),
        }
    }

    /// Velocity of the material of the obstacle at a point [m/s].
    pub fn velocity(&self, at: DVec3) -> DVec3 {
        match self {
            Self::Plane { velocity, .. } => *velocity,
            Self::Sphere { centre, velocity, spin, .. } | Self::Box { centre, velocity, spin, .. } => {
                *velocity + spin.cross(at - *centre)
            }
        }
    }

    /// The obstacle a time later [s], at its present velocity and spin.
    pub fn moved(&self, time: f64) -> Self {
        let mut moved = *self;
        match &mut moved {
            Self::Plane { point, velocity, .. } => *point += *velocity * time,
            Self::Sphere { centre, velocity, .. } => *centre += *velocity * time,
            Self::Box { centre, rotation, velocity, spin, .. } => {
                *centre += *velocity * time;
                *rotation = (DQuat::from_scaled_axis(*spin * time) * *rotation).normalize();
            }
        }
        moved
    }

    /// Largest share of the way from `before` to `after`, made while the obstacle moves for `time` [s], on which a point
    /// stays `separation` [m] away; a point that is closer already may halve its distance. 0 inside, 1 at most.
    /// The path is straight as seen from the obstacle.
    pub fn largest_safe_step(&self, before: DVec3, after: DVec3, time: f64, separation: f64) -> f64 {
        let (start, end) = (self.in_own_axes(before), self.moved(time).in_own_axes(after));
        let way = end - start;
        let distance = self.distance_within(start).0;
        let floor = if distance > separation { separation } else { 0.5 * distance };
        let mut share = 0.0;
        // tuned: five steps are usual, and stopping early is safe
        for _ in 0..100 {
            let (distance, normal) = self.distance_within(start + share * way);
            let (gap, rate) = (distance - floor, normal.dot(way));
            if distance <= 0.0 || gap < 0.0 || gap.is_nan() {
                return share;
            }
            if rate >= 0.0 {
                return 1.0;
            }
            if gap <= 1e-3 * floor {
                return share;
            }
            share -= gap / rate;
            if share >= 1.0 {
                return 1.0;
            }
        }
        share
    }

    /// A point as seen from the obstacle [m].
    fn in_own_axes(&self, at: DVec3) -> DVec3 {
        match self {
            Self::Plane { point, .. } => at - *point,
            Self::Sphere { centre, .. } => at - *centre,
            Self::Box { centre, rotation, .. } => rotation.conjugate() * (at - *centre),
        }
    }

    /// Signed distance [m] and normal, all in the obstacle's own axes.
    fn distance_within(&self, point: DVec3) -> (f64, DVec3) {
        match self {
            Self::Plane { normal, .. } => (point.dot(*normal), *normal),
            Self::Sphere { radius, .. } => (point.length() - radius, point.try_normalize().unwrap_or(DVec3::Z)),
            Self::Box { half_size, .. } => {
                let past = point.abs() - *half_size;
                let outwards = DVec3::ONE.copysign(point);
                let outside = past.max(DVec3::ZERO);
                match outside.try_normalize() {
                    Some(normal) => (outside.length(), normal * outwards),
                    None => {
                        let axis = past.max_position();
                        (past[axis], DVec3::AXES[axis] * outwards)
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn obstacles() -> [Obstacle; 3] {
        let (velocity, spin) = (DVec3::new(0.1, -0.2, 0.3), DVec3::new(1.0, 2.0, -1.0));
        let (centre, rotation) = (DVec3::new(0.1, 0.2, 0.0), DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(1.0));
        [
            Obstacle::Plane { point: centre, normal: DVec3::new(0.6, 0.0, 0.8), velocity },
            Obstacle::Sphere { centre, radius: 0.3, velocity, spin },
            Obstacle::Box { centre, half_size: DVec3::new(0.3, 0.2, 0.1), rotation, velocity, spin },
        ]
    }

    fn point(random: &mut Random) -> DVec3 {
        DVec3::new(random.normal(), random.normal(), random.normal())
    }

    #[test]
    fn the_normal_is_the_gradient_and_the_foot_is_on_the_surface() {
        let mut random = Random::new(6, 1);
        for obstacle in obstacles() {
            for _ in 0..10_000 {
                let p = 0.5 * point(&mut random);
                let (distance, normal) = obstacle.distance(p);
                assert!((normal.length() - 1.0).abs() < 1e-12);
                let foot = p - distance * normal;
                assert!(obstacle.distance(foot).0.abs() < 1e-12);
                // Tangent of a convex function; 1-Lipschitz.
                let q = 0.5 * point(&mut random);
                let there = obstacle.distance(q).0;
                assert!(there >= distance + normal.dot(q - p) - 1e-12);
                assert!((there - distance).abs() <= p.distance(q) + 1e-12);
            }
        }
    }

    #[test]
    fn the_surface_moves_as_it_says() {
        let mut random = Random::new(7, 1);
        let time = 1e-6;
        for obstacle in obstacles() {
            for _ in 0..1000 {
                let p = 0.5 * point(&mut random);
                // A point that goes with the material keeps its distance.
                let after = p + time * obstacle.velocity(p);
                let change = obstacle.moved(time).distance(after).0 - obstacle.distance(p).0;
                assert!(change.abs() < 1e-10, "{obstacle:?} {change}");
            }
        }
    }

    #[test]
    fn a_safe_step_is_safe_and_not_much_too_short() {
        let mut random = Random::new(8, 1);
        for obstacle in obstacles() {
            let mut still = obstacle;
            match &mut still {
                Obstacle::Plane { .. } => {}
                Obstacle::Sphere { spin, .. } | Obstacle::Box { spin, .. } => *spin = DVec3::ZERO,
            }
            for _ in 0..5000 {
                let (p, q) = (0.5 * point(&mut random), 0.5 * point(&mut random));
                let start = still.distance(p).0;
                let share = still.largest_safe_step(p, q, 0.5, 0.01);
                if start <= 0.0 {
                    assert_eq!(share, 0.0);
                    continue;
                }
                let floor = if start > 0.01 { 0.01 } else { 0.5 * start };
                let at = |s: f64| still.moved(0.5 * s).distance(p + s * (q - p)).0;
                assert!((0..=100).all(|k| at(share * k as f64 / 100.0) >= floor - 1e-12));
                assert!(share == 1.0 || at(share) <= 1.01 * floor);
            }
        }
    }
}
