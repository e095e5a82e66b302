//! Faces with more than three corners, cut into triangles.
//!
//! Quads are cut along the shorter diagonal that lies inside; other polygons by clipping ears, shortest cut first while
//! they are small. Concave faces stay inside their outline.

use glam::DVec3;

/// Up to so many corners the best ear is looked for; beyond, the first one is taken.
const BEST_EAR_LIMIT: usize = 64;

/// Cuts a polygon, given by the places of its corners, into triangles of corner numbers.
pub(crate) fn triangulate(places: &[DVec3]) -> Vec<[usize; 3]> {
    match places.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        4 => quad(places),
        _ => clip_ears(places),
    }
}

/// Twice the area of a triangle along a normal; negative where it is turned over.
fn signed_area(normal: DVec3, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    (b - a).cross(c - a).dot(normal)
}

/// Newell's normal: right for concave and slightly warped polygons too.
fn newell_normal(places: &[DVec3]) -> DVec3 {
    let first = places[0];
    let mut sum = DVec3::ZERO;
    for k in 1..places.len() - 1 {
        sum += (places[k] - first).cross(places[k + 1] - first);
    }
    sum.normalize_or_zero()
}

fn quad(p: &[DVec3]) -> Vec<[usize; 3]> {
    let normal = newell_normal(p);
    let along_02 = vec![[0, 1, 2], [0, 2, 3]];
    let along_13 = vec![[0, 1, 3], [1, 2, 3]];
    let inside = |cut: &[[usize; 3]]| cut.iter().all(|[a, b, c]| signed_area(normal, p[*a], p[*b], p[*c]) > 0.0);
    match (inside(&along_02), inside(&along_13)) {
        (true, false) => along_02,
        (false, true) => along_13,
        // On a tie the first diagonal, so that a regular grid of quads is cut the same way throughout.
        _ if p[0].distance_squared(p[2]) <= p[1].distance_squared(p[3]) * (1.0 + 1e-6) => along_02,
        _ => along_13,
    }
}

fn clip_ears(places: &[DVec3]) -> Vec<[usize; 3]> {
    let normal = newell_normal(places);
    let mut ring: Vec<usize> = (0..places.len()).collect();
    let mut triangles = Vec::with_capacity(places.len() - 2);
    while ring.len() > 3 {
        let count = ring.len();
        let mut best: Option<(f64, usize)> = None;
        for k in 0..count {
            let [a, b, c] = [ring[(k + count - 1) % count], ring[k], ring[(k + 1) % count]];
            if !is_ear(places, &ring, normal, a, b, c) {
                continue;
            }
            let cut = places[a].distance_squared(places[c]);
            if best.is_none_or(|(shortest, _)| cut < shortest) {
                best = Some((cut, k));
            }
            if count > BEST_EAR_LIMIT {
                break;
            }
        }
        // A polygon that crosses itself may have no ear; cutting anywhere ends it, and the remark on flat triangles
        // or the check of the edges says the rest.
        let k = best.map_or(0, |(_, k)| k);
        triangles.push([ring[(k + count - 1) % count], ring[k], ring[(k + 1) % count]]);
        ring.remove(k);
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

/// Whether the corner `b` can be cut off: it points outwards and no other corner lies in the cut.
fn is_ear(places: &[DVec3], ring: &[usize], normal: DVec3, a: usize, b: usize, c: usize) -> bool {
    let [pa, pb, pc] = [places[a], places[b], places[c]];
    if signed_area(normal, pa, pb, pc) <= 0.0 {
        return false;
    }
    ring.iter().all(|&other| {
        let p = places[other];
        // Corners at the same place (the two sides of a slit) do not block.
        if p == pa || p == pb || p == pc {
            return true;
        }
        let outside = |from: DVec3, to: DVec3| signed_area(normal, from, to, p) < 0.0;
        outside(pa, pb) || outside(pb, pc) || outside(pc, pa)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(places: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|[a, b, c]| 0.5 * signed_area(DVec3::Z, places[*a], places[*b], places[*c])).sum()
    }

    #[test]
    fn a_quad_is_cut_along_its_shorter_diagonal() {
        let kite = [(0.0, 0.0), (1.0, -0.2), (2.0, 0.0), (1.0, 0.2)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(triangulate(&kite), [[0, 1, 3], [1, 2, 3]]);
    }

    #[test]
    fn a_concave_quad_is_cut_inside_even_if_that_is_longer() {
        let dart = [(0.0, 0.0), (1.0, -2.0), (0.0, 1.0), (-1.0, -2.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let triangles = triangulate(&dart);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!((area(&dart, &triangles) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_concave_polygon_keeps_its_area_and_no_triangle_turns_over() {
        let star: Vec<DVec3> = (0..20)
            .map(|k| {
                let (radius, angle) = (if k % 2 == 0 { 1.0 } else { 0.3 }, k as f64 * std::f64::consts::TAU / 20.0);
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            })
            .collect();
        let triangles = triangulate(&star);
        assert_eq!(triangles.len(), 18);
        // Ten kites of two triangles with the sides 1 and 0.3 and the angle tau / 20 between them.
        let expected = 20.0 * 0.5 * 0.3 * (std::f64::consts::TAU / 20.0).sin();
        assert!((area(&star, &triangles) - expected).abs() < 1e-12);
        assert!(triangles.iter().all(|t| area(&star, &[*t]) > 0.0));
    }

    #[test]
    fn a_polygon_of_many_corners_and_a_collapsed_one_come_to_an_end() {
        let ring: Vec<DVec3> = (0..500).map(|k| DVec3::new((k as f64).cos(), (k as f64).sin(), 0.0)).collect();
        assert_eq!(triangulate(&ring).len(), 498);
        assert_eq!(triangulate(&[DVec3::ONE; 9]).len(), 7);
    }
}
