//! Twins: every query against all pairs, on small meshes of many kinds; and what the answers promise.

use super::continuous::{Goal, time_of_impact};
use super::proximity::{self, Nearest};
use super::*;
use crate::random::Random;

fn point(random: &mut Random) -> DVec3 {
    DVec3::new(random.normal(), random.normal(), random.normal())
}

/// A grid of n by n cells of side 1, two triangles each.
fn grid(n: usize, first: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let at = |i: usize, j: usize| first + (i * (n + 1) + j) as u32;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=n {
        for j in 0..=n {
            positions.push(DVec3::new(j as f64, i as f64, 0.0));
            if i < n && j < n {
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)];
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    (positions, triangles)
}

/// A small case: a soup, a crumpled sheet, a sheet with holes, two sheets one above the other, a sheet and a rigid
/// body, or a sheet exactly flat or exactly folded.
fn case(random: &mut Random) -> (Surface, Vec<DVec3>) {
    let n = 2 + (random.bits() % 4) as usize;
    let (mut positions, mut triangles) = grid(n, 0);
    let mut bodies = vec![Body::default()];
    let mut body = vec![0; positions.len()];
    match random.bits() % 7 {
        0 => {
            let count = positions.len() as u64;
            for corners in &mut triangles {
                let i = random.bits() % count;
                let mut corner = |k: u64| ((i + k + random.bits() % (count / 3)) % count) as u32;
                *corners = [corner(0), corner(count / 3), corner(2 * count / 3)];
            }
            triangles.iter_mut().for_each(|corners| corners.sort_unstable());
            triangles.sort_unstable();
            triangles.dedup();
            positions.iter_mut().for_each(|p| *p = 2.0 * point(random));
        }
        1 => positions.iter_mut().for_each(|p| *p = 0.5 * *p + 0.5 * point(random)),
        2 => {
            triangles.retain(|_| random.uniform() < 0.6);
            positions.iter_mut().for_each(|p| *p += 0.3 * point(random));
        }
        kind @ (3 | 4) => {
            let (others, more) = grid(n, positions.len() as u32);
            triangles.extend(more);
            positions.iter_mut().for_each(|p| *p += 0.1 * point(random));
            let shift = DVec3::new(0.3, 0.4, 0.25);
            positions.extend(others.iter().map(|p| *p + shift + 0.1 * point(random)));
            body.resize(positions.len(), 1);
            bodies.push(Body { rigid: kind == 4 });
        }
        5 => {}
        _ => positions.iter_mut().for_each(|p| {
            let floor = p.x.rem_euclid(2.0);
            *p = DVec3::new(if floor < 1.0 { floor } else { 2.0 - floor }, p.y, 0.2 * p.x);
        }),
    }
    let surface = Surface::build(&triangles, &bodies, &body, &vec![0.1; positions.len()]).unwrap();
    (surface, positions)
}

#[test]
fn proximities_are_those_of_all_pairs() {
    let mut random = Random::new(11, 1);
    let (mut faces, mut edges) = (0, 0);
    for _ in 0..4000 {
        let (surface, positions) = case(&mut random);
        let reach = 0.1 + 0.6 * random.uniform();
        let mut nearest = Nearest::default();
        nearest.reset(surface.node_count(), reach * reach);
        let mut expected = Vec::new();
        for i in &surface.vertices {
            for t in 0..surface.triangles.len() as u32 {
                if surface.may_touch_triangle(*i, t) {
                    expected.extend(proximity::vertex_face(&surface, &positions, &nearest, reach * reach, *i, t));
                }
            }
        }
        faces += expected.len();
        for e in 0..surface.edges.len() as u32 {
            for f in e + 1..surface.edges.len() as u32 {
                if surface.may_touch_edge(e, f) {
                    expected.extend(proximity::edges(&surface, &positions, &nearest, reach * reach, e, f));
                }
            }
        }
        edges += expected.len();
        let count = surface.node_count();
        let mut contacts = Contacts::build(surface, &positions);
        let (found, safe) = contacts.detect(&positions, reach);
        assert_eq!(found, expected);
        for i in 0..count {
            assert_eq!(safe[i], SAFE_SHARE * nearest.of(i).sqrt());
        }
        assert!(found.is_sorted_by_key(|p| (p.kind, p.features)));
        for p in found {
            let sum: DVec3 = (0..4).map(|k| p.weights[k] * positions[p.nodes[k] as usize]).sum();
            assert!(sum.abs_diff_eq(p.distance * p.normal, 1e-7), "{p:?} {sum}");
            assert!(p.weights.iter().sum::<f64>().abs() < 1e-15 && p.distance < reach);
            assert!(p.distance == 0.0 || (p.normal.length() - 1.0).abs() < 1e-12);
        }
    }
    assert!(faces > 20_000 && edges > 50_000, "{faces} {edges}");
}

/// Closest points of two features, from a proximity.
fn closest_points(p: &Proximity, positions: &[DVec3]) -> [DVec3; 2] {
    let first = if p.kind == Kind::VertexFace { 1 } else { 2 };
    let sum = |range: std::ops::Range<usize>| -> DVec3 {
        range.map(|k| p.weights[k].abs() * positions[p.nodes[k] as usize]).sum()
    };
    [sum(0..first), sum(first..4)]
}

/// Lowest node of the piece that each node belongs to.
fn pieces(surface: &Surface) -> Vec<u32> {
    let mut piece: Vec<u32> = (0..surface.node_count() as u32).collect();
    loop {
        let before = piece.clone();
        for [i, j] in surface.edges.iter().map(|ends| ends.map(|i| i as usize)) {
            let least = piece[i].min(piece[j]);
            (piece[i], piece[j]) = (least, least);
        }
        if piece == before {
            return piece;
        }
    }
}

#[test]
fn each_contact_is_named_once_and_none_is_lost() {
    let mut random = Random::new(12, 1);
    let mut checked = 0;
    for _ in 0..3000 {
        let (surface, positions) = case(&mut random);
        let reach = 0.2 + 0.5 * random.uniform();
        let mut contacts = Contacts::build(surface, &positions);
        let found = contacts.proximities(&positions, reach).to_vec();
        let surface = contacts.surface();
        // Once: no two have the same two closest points.
        let mut points: Vec<[DVec3; 2]> = found.iter().map(|p| closest_points(p, &positions)).collect();
        points.iter_mut().for_each(|[p, q]| {
            if p.to_array().map(f64::to_bits) > q.to_array().map(f64::to_bits) {
                std::mem::swap(p, q);
            }
        });
        for (k, [p, q]) in points.iter().enumerate() {
            let again = points[..k].iter().any(|[r, s]| p.abs_diff_eq(*r, 1e-12) && q.abs_diff_eq(*s, 1e-12));
            // Points that touch are everywhere in flat cases.
            assert!(!again || found[k].distance < 1e-12, "{:?}", found[k]);
        }
        // None lost: the point closest to a vertex on another piece is named, by this vertex or by one it meets there.
        let piece = pieces(surface);
        for i in &surface.vertices {
            for other in 0..surface.node_count() as u32 {
                let of_piece = |t: &u32| piece[surface.triangles[*t as usize][0] as usize] == other;
                let free = (0..surface.triangles.len() as u32).filter(of_piece);
                let free = free.filter(|t| piece[*i as usize] != other && surface.may_touch_triangle(*i, *t));
                let distance = |t: u32| {
                    let closest = distance::vertex_triangle(positions[*i as usize], surface.corners(&positions, t));
                    closest.offset.length()
                };
                let nearest = free.map(distance).fold(f64::INFINITY, f64::min);
                if nearest < reach {
                    checked += 1;
                    let named = |p: &Proximity| {
                        let meets = p.nodes[0] == *i || p.nodes[1..].contains(i) && piece[p.nodes[0] as usize] == other;
                        p.kind == Kind::VertexFace && meets && p.distance == nearest
                    };
                    assert!(found.iter().any(named), "vertex {i} {nearest}");
                }
            }
        }
    }
    assert!(checked > 5000, "{checked}");
}

#[test]
fn neither_threads_nor_trees_change_a_bit() {
    let mut random = Random::new(13, 1);
    let (flat, triangles) = grid(40, 0);
    let positions: Vec<DVec3> = flat
        .iter()
        .map(|p| {
            let floor = p.x.rem_euclid(8.0);
            DVec3::new(if floor < 4.0 { floor } else { 8.0 - floor }, p.y, 0.1 * p.x) + 0.02 * point(&mut random)
        })
        .collect();
    let after: Vec<DVec3> = positions.iter().map(|p| *p + 0.2 * point(&mut random)).collect();
    let answers = |contacts: &mut Contacts| {
        let (found, safe) = contacts.detect(&positions, 0.8);
        let (found, safe) = (found.to_vec(), safe.to_vec());
        let impacts = contacts.continuous(&positions, &after, 0.01).to_vec();
        let step = contacts.largest_safe_step(&positions, &after, 0.01).to_bits();
        let through = contacts.passed_through(&positions, &after).to_vec();
        let pairs = contacts.intersecting_pairs(&after);
        // Text of a number says every bit of it.
        format!("{found:?} {safe:?} {impacts:?} {step} {through:?} {pairs} {:?}", contacts.intersections(&after))
    };
    let surface = Surface::sheet(flat.len(), &triangles, 0.0).unwrap();
    let expected = answers(&mut Contacts::build(surface.clone(), &positions));
    let mut used = Contacts::build(surface.clone(), &flat);
    for threads in [1, 2, 3, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            assert!(answers(&mut used) == expected);
            assert!(answers(&mut Contacts::build(surface.clone(), &after)) == expected);
        });
    }
}

#[test]
fn impacts_are_those_of_all_pairs_and_the_safe_step_is_the_first() {
    let mut random = Random::new(14, 1);
    let (mut hits, mut through) = (0, 0);
    for _ in 0..3000 {
        let (surface, before) = case(&mut random);
        let after: Vec<DVec3> = before.iter().map(|p| *p + 0.2 * point(&mut random)).collect();
        let separation = 0.02;
        let mut first = 1.0f64;
        let mut contacts = Contacts::build(surface.clone(), &before);
        let found = contacts.continuous(&before, &after, separation).to_vec();
        let told = contacts.passed_through(&before, &after).to_vec();
        let mut left: &[Impact] = &found;
        let mut left_told: &[Impact] = &told;
        let mut check = |kind: Kind, features: [u32; 2], nodes: [u32; 4]| {
            let at = |x: &[DVec3]| nodes.map(|i| x[i as usize]);
            for (goal, left) in [(Goal::Keep(separation), &mut left), (Goal::Tell, &mut left_told)] {
                let named = left.first().filter(|impact| (impact.kind, impact.features) == (kind, features));
                let Some((time, ..)) = time_of_impact(kind, at(&before), at(&after), goal, 1.0) else {
                    assert!(named.is_none());
                    continue;
                };
                if matches!(goal, Goal::Keep(_)) {
                    first = first.min(time);
                }
                if let Some(impact) = named {
                    assert_eq!((impact.time, impact.nodes), (time, nodes));
                    *left = &left[1..];
                } else {
                    // A pair may be left out that only comes within the conservative tenth of the separation.
                    let share = if let Goal::Keep(_) = goal { time } else { -1.0 };
                    assert!(share >= 0.0, "missed");
                    assert!((0..=200).all(|k| {
                        let share = k as f64 / 200.0;
                        let x: [DVec3; 4] = std::array::from_fn(|k| at(&before)[k].lerp(at(&after)[k], share));
                        let offset = match kind {
                            Kind::VertexFace => distance::vertex_triangle(x[0], [x[1], x[2], x[3]]).offset,
                            Kind::EdgeEdge => {
                                distance::edge_edge([x[0], x[1]], [x[2], x[3]], f64::INFINITY).unwrap().offset
                            }
                        };
                        offset.length() >= 0.999 * separation
                    }));
                }
            }
        };
        for i in &surface.vertices {
            for t in 0..surface.triangles.len() as u32 {
                let [a, b, c] = surface.triangles[t as usize];
                if surface.may_touch_triangle(*i, t) {
                    check(Kind::VertexFace, [*i, t], [*i, a, b, c]);
                }
            }
        }
        for e in 0..surface.edges.len() as u32 {
            for f in e + 1..surface.edges.len() as u32 {
                let ([i, j], [k, l]) = (surface.edges[e as usize], surface.edges[f as usize]);
                if surface.may_touch_edge(e, f) {
                    check(Kind::EdgeEdge, [e, f], [i, j, k, l]);
                }
            }
        }
        assert!(left.is_empty() && left_told.is_empty());
        hits += found.len();
        through += told.len();
        let step = contacts.largest_safe_step(&before, &after, separation);
        let least = found.iter().map(|impact| impact.time).fold(1.0, f64::min);
        assert_eq!(step, least);
        assert!(first <= step);
    }
    assert!(hits > 50_000 && through > 10_000, "{hits} {through}");
}

#[test]
fn a_safe_step_never_makes_an_intersection() {
    let mut random = Random::new(15, 1);
    let (mut clean, mut shortened, mut prevented) = (0, 0, 0);
    for _ in 0..6000 {
        let (surface, before) = case(&mut random);
        let mut contacts = Contacts::build(surface, &before);
        if contacts.intersecting_pairs(&before) > 0 {
            continue;
        }
        clean += 1;
        let after: Vec<DVec3> = before.iter().map(|p| *p + 0.3 * point(&mut random)).collect();
        let step = contacts.largest_safe_step(&before, &after, 0.0);
        shortened += (step < 1.0) as u32;
        let at =
            |share: f64| -> Vec<DVec3> { before.iter().zip(&after).map(|(p, q)| *p + share * (*q - *p)).collect() };
        for k in 1..=8 {
            assert_eq!(contacts.intersecting_pairs(&at(step * k as f64 / 8.0)), 0);
        }
        assert!(contacts.passed_through(&before, &at(step)).is_empty());
        // A state that cuts through itself was reached through an impact.
        if contacts.intersecting_pairs(&after) > 0 {
            prevented += 1;
            assert!(!contacts.passed_through(&before, &after).is_empty());
        }
    }
    assert!(clean > 2000 && shortened > 1000 && prevented > 1000, "{clean} {shortened} {prevented}");
}

#[test]
fn within_the_safe_displacement_nothing_passes_through() {
    let mut random = Random::new(16, 1);
    let mut steps = 0;
    for _ in 0..4000 {
        let (surface, mut positions) = case(&mut random);
        let reach = 0.05 + random.uniform();
        let mut contacts = Contacts::build(surface, &positions);
        if contacts.intersecting_pairs(&positions) > 0 {
            continue;
        }
        // Towards one goal, so that things are pressed together.
        let goal: Vec<DVec3> = positions.iter().map(|p| 0.2 * *p + point(&mut random)).collect();
        for _ in 0..5 {
            steps += 1;
            let safe = contacts.safe_displacement(&positions, reach);
            let after: Vec<DVec3> = (0..positions.len())
                .map(|i| positions[i] + (goal[i] - positions[i]).normalize_or_zero() * safe[i])
                .collect();
            assert!(contacts.passed_through(&positions, &after).is_empty());
            assert_eq!(contacts.intersecting_pairs(&after), 0);
            positions = after;
        }
    }
    assert!(steps > 5000, "{steps}");
}

#[test]
fn intersections_are_those_of_all_pairs() {
    let mut random = Random::new(17, 1);
    let mut hits = 0;
    for _ in 0..3000 {
        let (surface, positions) = case(&mut random);
        let mut expected = Vec::new();
        for edge in 0..surface.edges.len() as u32 {
            for triangle in 0..surface.triangles.len() as u32 {
                if intersection::intersect(&surface, &positions, edge, triangle) {
                    expected.push(Intersection { edge, triangle });
                }
            }
        }
        hits += expected.len();
        let mut contacts = Contacts::build(surface, &positions);
        assert_eq!(contacts.intersections(&positions), expected);
        assert_eq!(contacts.intersecting_pairs(&positions) > 0, !expected.is_empty());
    }
    assert!(hits > 10_000, "{hits}");
}

#[test]
fn a_sheet_that_falls_through_another_is_told() {
    let (mut positions, mut triangles) = grid(6, 0);
    let count = positions.len();
    let (above, more) = grid(6, count as u32);
    positions.extend(above.iter().map(|p| *p + DVec3::new(0.3, 0.2, 0.5)));
    triangles.extend(more);
    let surface = Surface::sheet(positions.len(), &triangles, 1e-4).unwrap();
    let mut contacts = Contacts::build(surface, &positions);
    let mut after = positions.clone();
    after[count..].iter_mut().for_each(|p| p.z = -0.5);
    assert_eq!(contacts.intersecting_pairs(&positions) + contacts.intersecting_pairs(&after), 0);
    let through = contacts.passed_through(&positions, &after);
    assert!(!through.is_empty() && through.iter().all(|impact| (impact.time - 0.5).abs() < 1e-8));
    let step = contacts.largest_safe_step(&positions, &after, 0.1);
    assert!(step > 0.38 && step <= 0.4, "{step}");
    after[count..].iter_mut().for_each(|p| p.z = 0.0);
    assert!(contacts.intersecting_pairs(&after) > 50);
}

#[test]
fn a_flat_sheet_does_not_touch_itself_however_fine_it_is() {
    let (positions, triangles) = grid(8, 0);
    let mut contacts = Contacts::build(Surface::sheet(positions.len(), &triangles, 1e-4).unwrap(), &positions);
    assert!(contacts.proximities(&positions, 0.99).is_empty());
    assert_eq!(contacts.intersecting_pairs(&positions), 0);
    // What bounds a step is the height of a triangle's neighbour.
    let least = contacts.safe_displacement(&positions, 5.0).iter().copied().fold(f64::INFINITY, f64::min);
    assert!((least - SAFE_SHARE * 0.5f64.sqrt()).abs() < 1e-12, "{least}");
}

#[test]
fn nothing_at_all_is_no_trouble() {
    let mut contacts = Contacts::build(Surface::sheet(3, &[], 1e-4).unwrap(), &[DVec3::ZERO; 3]);
    let x = [DVec3::ZERO; 3];
    assert!(contacts.proximities(&x, 1.0).is_empty());
    assert_eq!(contacts.safe_displacement(&x, 1.0), [0.45; 3]);
    assert_eq!(contacts.largest_safe_step(&x, &x, 1.0), 1.0);
    assert_eq!(contacts.intersecting_pairs(&x), 0);
}

#[test]
fn thickness_is_shared_by_the_weights() {
    let triangles = [[0, 1, 2], [3, 4, 5]];
    let x = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.25, 0.25, 0.1), DVec3::Z + DVec3::X, DVec3::Z + DVec3::Y];
    let bodies = [Body::default(), Body { rigid: true }];
    let surface =
        Surface::build(&triangles, &bodies, &[0, 0, 0, 1, 1, 1], &[2e-4, 2e-4, 2e-4, 1e-3, 0.0, 0.0]).unwrap();
    let mut contacts = Contacts::build(surface, &x);
    let found = contacts.proximities(&x, 0.2)[0];
    assert_eq!((found.kind, found.nodes), (Kind::VertexFace, [3, 0, 1, 2]));
    assert!((found.distance - 0.1).abs() < 1e-15 && found.normal.abs_diff_eq(DVec3::Z, 1e-15));
    assert!((found.thickness(contacts.surface()) - 6e-4).abs() < 1e-15);
}
