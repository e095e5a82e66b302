//! Where two features come closest: vertex and triangle, edge and edge.
//!
//! Model: the regions of the triangle by barycentric signs, and the clamped least-squares solution for two segments
//! [Ericson2005], 5.1.5 and 5.1.9; the determinant of the second as a squared cross product, which keeps its digits
//! where edges are nearly parallel. Valid for any input; a triangle without area is taken as its three edges.
//! Cost: about 10 and 15 ns.

use glam::DVec3;

/// The part of a triangle that is closest to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// Its inside.
    Face,
    /// The inside of its edge from corner k to corner k + 1.
    Edge(u8),
    /// Its corner k.
    Corner(u8),
}

/// Where two features come closest.
#[derive(Debug, Clone, Copy)]
pub struct Closest<R> {
    /// From the closest point of the second feature to that of the first [m].
    pub offset: DVec3,
    /// Share of each node: those of the first feature add up to 1, those of the second to -1.
    pub weights: [f64; 4],
    /// Which part of the features it is.
    pub region: R,
}

/// Closest points of a vertex and a triangle (a, b, c).
#[inline]
pub fn vertex_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> Closest<Region> {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let corner = |k: u8, offset: DVec3| {
        let mut weights = [1.0, 0.0, 0.0, 0.0];
        weights[k as usize + 1] = -1.0;
        Closest { offset, weights, region: Region::Corner(k) }
    };
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return corner(0, ap);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return corner(1, bp);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return corner(2, cp);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let v = d1 / (d1 - d3);
        return Closest { offset: ap - v * ab, weights: [1.0, v - 1.0, -v, 0.0], region: Region::Edge(0) };
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        let w = d2 / (d2 - d6);
        return Closest { offset: ap - w * ac, weights: [1.0, w - 1.0, 0.0, -w], region: Region::Edge(2) };
    }
    let va = d3 * d6 - d5 * d4;
    let (along, back) = (d4 - d3, d5 - d6);
    if va <= 0.0 && along >= 0.0 && back >= 0.0 && along + back > 0.0 {
        let w = along / (along + back);
        return Closest { offset: bp - w * (c - b), weights: [1.0, 0.0, w - 1.0, -w], region: Region::Edge(1) };
    }
    let sum = va + vb + vc;
    let normal = ab.cross(ac);
    let area_squared = normal.length_squared();
    // The sine of the angle at a corner below which a triangle counts as its edges: 1e-7.
    if sum > 0.0 && area_squared > 1e-14 * ab.length_squared() * ac.length_squared() {
        let (v, w) = (vb / sum, vc / sum);
        // Along the normal, not through the weights, which are poor in a sliver.
        let offset = normal * (ap.dot(normal) / area_squared);
        return Closest { offset, weights: [1.0, v + w - 1.0, -v, -w], region: Region::Face };
    }
    flat_triangle(p, [a, b, c])
}

/// The same for a triangle without area: the closest of its edges.
#[cold]
fn flat_triangle(p: DVec3, corners: [DVec3; 3]) -> Closest<Region> {
    let edge = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let v = share((b - a).dot(p - a), (b - a).length_squared());
        let mut weights = [1.0, 0.0, 0.0, 0.0];
        weights[k + 1] = v - 1.0;
        weights[(k + 1) % 3 + 1] = -v;
        let region = match v {
            0.0 => Region::Corner(k as u8),
            1.0 => Region::Corner((k as u8 + 1) % 3),
            _ => Region::Edge(k as u8),
        };
        Closest { offset: (p - a) - v * (b - a), weights, region }
    };
    let closer = |x: Closest<Region>, y: Closest<Region>| {
        if y.offset.length_squared() < x.offset.length_squared() { y } else { x }
    };
    closer(closer(edge(0), edge(1)), edge(2))
}

/// Closest points of two edges; the region says whether both are inside their edge. None where the straight lines
/// through them are already farther apart than the square root of `reach_squared` [m2].
#[inline]
pub fn edge_edge([a0, a1]: [DVec3; 2], [b0, b1]: [DVec3; 2], reach_squared: f64) -> Option<Closest<bool>> {
    let (u, v, r) = (a1 - a0, b1 - b0, a0 - b0);
    let normal = u.cross(v);
    let determinant = normal.length_squared();
    let between = r.dot(normal);
    let (uu, vv) = (u.length_squared(), v.length_squared());
    // Edges so nearly parallel that their normal may be mostly rounding: the sine of their angle is below 1e-6.
    let parallel = determinant <= 1e-12 * uu * vv;
    if !parallel && between * between > 1.0001 * reach_squared * determinant {
        return None;
    }
    let (uv, ur, vr) = (u.dot(v), u.dot(r), v.dot(r));
    // Parallel to rounding: all of s are alike, but for the ends.
    let free = if determinant > 1e-24 * uu * vv { normal.dot(v.cross(r)) / determinant } else { 0.0 };
    let mut s = free.clamp(0.0, 1.0);
    let mut t = (uv * s + vr) / vv;
    // Also where the second edge is a point and t is no number.
    if !(0.0..=1.0).contains(&t) {
        t = if t > 1.0 { 1.0 } else { 0.0 };
        s = share(uv * t - ur, uu);
    }
    // What is inside by no more than rounding is an end, or a vertex above the other edge would be named as well.
    let inside = [s, t].iter().all(|share| (1e-10..=1.0 - 1e-10).contains(share));
    // Inside, along the normal, not through the weights, whose rounding would turn a short offset.
    let offset = if inside && !parallel { normal * (between / determinant) } else { r + s * u - t * v };
    Some(Closest { offset, weights: [1.0 - s, s, t - 1.0, -t], region: inside })
}

/// A ratio, cut to 0 to 1; 0 where the whole is nothing.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn point(random: &mut Random) -> DVec3 {
        DVec3::new(random.uniform(), random.uniform(), random.uniform())
    }

    fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
        let along = share((p - a).dot(b - a), (b - a).length_squared());
        p.distance(a + along * (b - a))
    }

    /// By cases: all six ends and sides, and the inside where the foot of the perpendicular falls into it.
    fn slow_vertex_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let sides = to_segment(p, a, b).min(to_segment(p, b, c)).min(to_segment(p, c, a));
        let n = (b - a).cross(c - a);
        if n.length_squared() < 1e-28 {
            return sides;
        }
        let foot = p - n * ((p - a).dot(n) / n.length_squared());
        let within = [(a, b), (b, c), (c, a)].iter().all(|(i, j)| (*j - *i).cross(foot - *i).dot(n) >= 0.0);
        if within { (p - a).dot(n).abs() / n.length() } else { sides }
    }

    fn slow_edge_edge([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
        let ends = to_segment(a, c, d).min(to_segment(b, c, d)).min(to_segment(c, a, b)).min(to_segment(d, a, b));
        let n = (b - a).cross(d - c);
        if n.length_squared() < 1e-28 {
            return ends;
        }
        // Both lines cross as seen along n.
        let (s, t) =
            ((c - a).cross(d - c).dot(n) / n.length_squared(), (c - a).cross(b - a).dot(n) / n.length_squared());
        let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        if inside { (c - a).dot(n).abs() / n.length() } else { ends }
    }

    /// Points in general and in every special position: shared, in line, in plane, parallel.
    fn points(random: &mut Random) -> [DVec3; 4] {
        let mut p = [0; 4].map(|_| point(random));
        match random.bits() % 8 {
            0 => p[1] = p[0],
            1 => p[2] = p[3],
            2 => p[3] = p[2] + (p[1] - p[0]) * random.normal(),
            3 => p[3] = p[1] + (p[2] - p[1]) * random.normal(),
            4 => p.iter_mut().for_each(|p| p.z = 0.5),
            5 => p.iter_mut().for_each(|p| *p = (*p * 3.0).floor() / 3.0),
            6 => p[3] = p[2] + (p[1] - p[0]) * random.normal() + 1e-7 * point(random),
            _ => {}
        }
        p
    }

    #[test]
    fn distances_are_those_of_the_slow_way() {
        let mut random = Random::new(2, 1);
        for _ in 0..1_000_000 {
            let [p, a, b, c] = points(&mut random);
            let fast = vertex_triangle(p, [a, b, c]);
            let slow = slow_vertex_triangle(p, [a, b, c]);
            // A triangle counts as its edges where its height is below 1e-7 of its sides.
            assert!((fast.offset.length() - slow).abs() < 3e-7, "{} {slow} {:?}", fast.offset.length(), [p, a, b, c]);
            check(&fast.weights, fast.offset, [p, a, b, c], 1);
            let fast = edge_edge([p, a], [b, c], f64::INFINITY).unwrap();
            let slow = slow_edge_edge([p, a], [b, c]);
            assert!((fast.offset.length() - slow).abs() < 1e-7, "{} {slow} {:?}", fast.offset.length(), [p, a, b, c]);
            check(&fast.weights, fast.offset, [p, a, b, c], 2);
            assert!(edge_edge([p, a], [b, c], slow * slow + 1e-15).is_some());
        }
    }

    fn check(weights: &[f64; 4], offset: DVec3, points: [DVec3; 4], first: usize) {
        let sum: DVec3 = (0..4).map(|k| weights[k] * points[k]).sum();
        // Weights in a sliver are good to a hundredth.
        assert!(sum.abs_diff_eq(offset, 1e-2));
        let sliver = (points[2] - points[1]).cross(points[3] - points[1]).length() < 1e-4;
        assert!(sliver || sum.abs_diff_eq(offset, 1e-8));
        assert!((weights[..first].iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!((weights[first..].iter().sum::<f64>() + 1.0).abs() < 1e-15);
        assert!(weights[..first].iter().all(|w| *w >= 0.0) && weights[first..].iter().all(|w| *w <= 1e-15));
    }
}
