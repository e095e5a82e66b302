//! Which triangles cut through each other now.
//!
//! Model: two triangles intersect where an edge of one meets the other; signs of orientation determinants, exact for the
//! positions as given [Shewchuk1997]. Touching counts, also in one plane. Pairs of an edge and a triangle that share a
//! node are left out, as those of two rigid bodies. Valid when: positions are finite. Cost: 30 ns a pair of
//! overlapping boxes; more where four points lie in one plane exactly.

use super::surface::Surface;
use glam::{DVec2, DVec3};
use robust::{Coord, Coord3D, orient2d, orient3d};

/// An edge that passes through a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Intersection {
    /// The edge, in the numbers of the surface.
    pub edge: u32,
    /// The triangle, likewise.
    pub triangle: u32,
}

/// Whether an edge of the surface and a triangle of it intersect.
pub(super) fn intersect(surface: &Surface, positions: &[DVec3], edge: u32, triangle: u32) -> bool {
    let [i, j] = surface.edges[edge as usize];
    surface.may_touch_triangle(i, triangle)
        && surface.may_touch_triangle(j, triangle)
        && segment_meets_triangle(surface.ends(positions, edge), surface.corners(positions, triangle))
}

fn segment_meets_triangle([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let (side_p, side_q) = (side(a, b, c, p), side(a, b, c, q));
    if side_p == 0.0 && side_q == 0.0 {
        return meet_in_plane([p, q], [a, b, c]);
    }
    if (side_p > 0.0 && side_q > 0.0) || (side_p < 0.0 && side_q < 0.0) {
        return false;
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    turns.iter().all(|s| *s >= 0.0) || turns.iter().all(|s| *s <= 0.0)
}

/// All five points are in one plane: look at it along the axis that is closest to its normal.
fn meet_in_plane([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a).abs();
    let flat = |x: DVec3| match normal.max_position() {
        0 => DVec2::new(x.y, x.z),
        1 => DVec2::new(x.z, x.x),
        _ => DVec2::new(x.x, x.y),
    };
    let (ends, corners) = ([p, q].map(flat), [a, b, c].map(flat));
    let sides = [[0, 1], [1, 2], [2, 0]].map(|s| s.map(|k| corners[k]));
    let within = |x: DVec2| {
        let turns = sides.map(|[i, j]| turn(i, j, x));
        turns.iter().all(|s| *s >= 0.0) || turns.iter().all(|s| *s <= 0.0)
    };
    ends.iter().any(|x| within(*x)) || sides.iter().any(|side| segments_meet(ends, *side))
}

fn segments_meet([p, q]: [DVec2; 2], [a, b]: [DVec2; 2]) -> bool {
    let boxes = p.min(q).cmple(a.max(b)).all() && a.min(b).cmple(p.max(q)).all();
    boxes && turn(p, q, a) * turn(p, q, b) <= 0.0 && turn(a, b, p) * turn(a, b, q) <= 0.0
}

/// Sign of the side of the plane (a, b, c) that p is on: 1, -1, or 0 on it.
fn side(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> f64 {
    let point = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    sign(orient3d(point(a), point(b), point(c), point(p)))
}

fn turn(a: DVec2, b: DVec2, p: DVec2) -> f64 {
    let point = |p: DVec2| Coord { x: p.x, y: p.y };
    sign(orient2d(point(a), point(b), point(p)))
}

fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// The same question in whole numbers, where determinants are exact.
    fn slow([p, q]: [[i64; 3]; 2], t: [[i64; 3]; 3]) -> bool {
        let minus = |a: [i64; 3], b: [i64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let cross = |a: [i64; 3], b: [i64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let dot = |a: [i64; 3], b: [i64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
        let (hp, hq) = (dot(n, minus(p, t[0])), dot(n, minus(q, t[0])));
        assert!(hp != 0 || hq != 0);
        if hp.signum() * hq.signum() > 0 {
            return false;
        }
        // The point where the line meets the plane, times hp - hq.
        let w = hp - hq;
        let x: [i64; 3] = std::array::from_fn(|k| hp * q[k] - hq * p[k]);
        (0..3).all(|k| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let from_a: [i64; 3] = std::array::from_fn(|k| x[k] - w * a[k]);
            dot(cross(minus(b, a), from_a), n).signum() * w.signum() >= 0
        })
    }

    #[test]
    fn answers_are_those_of_whole_numbers() {
        let mut random = Random::new(5, 1);
        let (mut hits, mut misses) = (0, 0);
        while hits < 50_000 {
            let mut point = || [0; 3].map(|_| (random.bits() % 9) as i64 - 4);
            let x: [[i64; 3]; 5] = [0; 5].map(|_| point());
            let y = x.map(|p| DVec3::from_array(p.map(|c| c as f64)));
            let flat = |k: usize| side(y[2], y[3], y[4], y[k]) == 0.0;
            if flat(0) && flat(1) {
                continue;
            }
            let expected = slow([x[0], x[1]], [x[2], x[3], x[4]]);
            assert_eq!(segment_meets_triangle([y[0], y[1]], [y[2], y[3], y[4]]), expected, "{x:?}");
            if expected { hits += 1 } else { misses += 1 }
        }
        assert!(misses > 50_000);
    }

    #[test]
    fn in_one_plane() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let meets =
            |p: [f64; 2], q: [f64; 2]| segment_meets_triangle([p, q].map(|[x, y]| DVec3::new(x, y, 0.0)), triangle);
        assert!(meets([0.2, 0.2], [0.3, 0.3]));
        assert!(meets([-1.0, 0.3], [2.0, 0.3]));
        assert!(meets([0.2, 0.2], [5.0, 5.0]));
        assert!(meets([0.5, 0.5], [5.0, 5.0]));
        assert!(!meets([0.6, 0.6], [5.0, 5.0]));
        assert!(!meets([2.0, 0.0], [3.0, 0.0]));
        assert!(!meets([-1.0, 0.5], [0.5, -1.0]));
    }
}
