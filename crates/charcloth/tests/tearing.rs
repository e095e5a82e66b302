//! Where springs give way: what is cut, what is split, what is kept.

mod common;

use charcloth::random::Random;
use charcloth::scene::{CurlLaw, Pin, Region, Scene, Shape, Side};
use charcloth::sheet::{NONE, SheetState, SpringKind};
use charcloth::simulation::Simulation;
use charcloth::tear;
use charcloth::units::*;
use common::{build, sheet};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// What no tear may change: masses, fuel, areas and heat capacities in all.
fn totals(state: &SheetState) -> [f64; 5] {
    let burn = &state.burn;
    [&state.motion.inert_mass, &burn.fuel, &burn.fuel_initial, &burn.area, &burn.heat_capacity].map(|v| v.iter().sum())
}

/// Compares a torn state with the one at the start, and with itself, in the slow and obvious way.
fn check(start: &SheetState, state: &SheetState) {
    let (motion, springs, triangles) = (&state.motion, &state.springs, &state.triangles);
    for (table, columns) in state.tables() {
        assert!(columns.iter().all(|c| c.data.len() == columns[0].data.len()), "{table} is ragged");
    }
    assert_eq!(motion.len(), state.burn.len());
    let lengths = |s: &SheetState| [s.springs.len(), s.triangles.len(), s.burn_edges.len()];
    assert_eq!(lengths(start), lengths(state), "only nodes are added");

    // Ids: old rows are what they were, new ones say where they come from.
    let old = start.motion.len();
    assert_eq!(motion.source[..old], start.motion.source[..]);
    assert_eq!(motion.rest_position[..old], start.motion.rest_position[..]);
    for i in old..motion.len() {
        let parent = start.motion.source.iter().position(|s| *s == motion.source[i]).expect("a node of the start");
        assert_eq!(motion.rest_position[i], start.motion.rest_position[parent]);
        assert_eq!(motion.pinned[i], motion.pinned[parent], "a copy of a pinned node is pinned");
    }
    for (before, now) in totals(start).into_iter().zip(totals(state)) {
        // One rounding a share and one a term of the sum.
        let rounding = 4.0 * motion.len() as f64 * f64::EPSILON * before;
        assert!((before - now).abs() <= rounding, "{before} became {now}");
    }

    let alive = |t: u32| t != NONE && triangles.alive[t as usize] != 0;
    let has = |t: u32, i: u32| alive(t) && triangles.corners[t as usize].contains(&i);
    for t in 0..triangles.len() {
        let [a, b, c] = triangles.corners[t];
        assert!(a != b && b != c && c != a);
        for (corner, first) in triangles.corners[t].iter().zip(start.triangles.corners[t]) {
            assert_eq!(motion.source[*corner as usize], start.motion.source[first as usize]);
            assert!(triangles.alive[t] == 0 || motion.alive[*corner as usize] == 1);
        }
    }
    for s in 0..springs.len() {
        let (ends, [first, second]) = (springs.ends[s], springs.carriers[s]);
        let on_surface = [first, second] != [NONE; 2];
        if springs.broken[s] != 0 {
            if springs.kind[s] == SpringKind::Structural as u8 {
                assert!(!alive(first) && !alive(second), "spring {s}: the sheet is cut along a broken edge");
                assert_eq!(state.burn_edges.cut[springs.edge[s] as usize], 1, "no heat crosses a cut");
            }
        } else if on_surface && springs.needs_both[s] != 0 {
            assert!(has(first, ends[0]) && has(second, ends[1]), "spring {s} holds on to nothing");
            let share = triangles.corners[first as usize].iter().any(|i| has(second, *i));
            assert!(share, "spring {s} bridges a cut");
        } else if on_surface {
            let carried = [first, second].into_iter().any(|t| has(t, ends[0]) && has(t, ends[1]));
            assert!(carried, "spring {s} holds on to nothing");
            if springs.edge[s] != NONE {
                assert_eq!(state.burn_edges.ends[springs.edge[s] as usize], ends, "heat and force go one way");
            }
        }
    }

    // Around each node the surface hangs together: one fan.
    let mut around: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for t in (0..triangles.len()).filter(|t| triangles.alive[*t] != 0) {
        triangles.corners[t].iter().for_each(|i| around.entry(*i).or_default().push(t));
    }
    for (node, at) in &around {
        let joined =
            |a: usize, b: usize| triangles.corners[a].iter().any(|i| i != node && triangles.corners[b].contains(i));
        assert_eq!(count_groups(at, joined), 1, "node {node} holds two parts together");
    }
    for i in 0..motion.len() {
        assert!(triangles.is_empty() || around.contains_key(&(i as u32)) == (motion.alive[i] == 1), "node {i}");
    }
    // Pieces: a number each, and as many as there are.
    let living: Vec<usize> = (0..triangles.len()).filter(|t| triangles.alive[*t] != 0).collect();
    let joined = |a: usize, b: usize| triangles.corners[a].iter().any(|i| triangles.corners[b].contains(i));
    assert_eq!(tear::pieces(state), count_groups(&living, joined));
    for (k, a) in living.iter().enumerate() {
        for b in &living[..k] {
            assert!(!joined(*a, *b) || triangles.piece[*a] == triangles.piece[*b], "triangles {a} and {b}");
        }
    }
}

/// Number of groups that hang together.
fn count_groups(members: &[usize], joined: impl Fn(usize, usize) -> bool) -> usize {
    let mut left: BTreeSet<usize> = members.iter().copied().collect();
    let mut groups = 0;
    while let Some(first) = left.pop_first() {
        groups += 1;
        let mut waiting = vec![first];
        while let Some(a) = waiting.pop() {
            let near: Vec<usize> = left.iter().copied().filter(|b| joined(a, *b)).collect();
            left.retain(|b| !near.contains(b));
            waiting.extend(near);
        }
    }
    groups
}

/// Breaks the structural springs whose middle, at rest, is where `at` says.
fn break_where(state: &mut SheetState, at: impl Fn(DVec3) -> bool) {
    for s in 0..state.springs.len() {
        let [i, j] = state.springs.ends[s].map(|i| state.motion.rest_position[i as usize]);
        if state.springs.kind[s] == SpringKind::Structural as u8 && at(0.5 * (i + j)) {
            state.springs.broken[s] = 1;
        }
    }
}

/// Nothing but weight and springs.
fn quiet(shape: Shape, width: f64, height: f64, spacing: f64) -> Scene {
    let mut scene = sheet(shape, width, height, spacing);
    scene.wind.coefficient = DragCoefficient(0.0);
    scene.mechanics.damping = Rate(0.0);
    scene.curl.law = CurlLaw::Off;
    scene
}

#[test]
fn springs_broken_at_random_leave_a_sound_sheet_at_every_stage() {
    for (shape, seed) in [(Shape::Unstructured, 1), (Shape::Unstructured, 2), (Shape::Grid, 3), (Shape::Disc, 4)] {
        let mut scene = sheet(shape, 0.04, 0.03, 0.004);
        scene.sheet.radius = Length(0.02);
        scene.seed = seed;
        let start = build(&scene).state().clone();
        let mut state = start.clone();
        let mut random = Random::new(seed, 2);
        let mut last = [0, 0];
        for round in 0..40 {
            for _ in 0..1 + round / 8 {
                let s = (random.uniform() * state.springs.len() as f64) as usize;
                state.springs.broken[s] = 1;
            }
            tear::split(&mut state);
            check(&start, &state);
            assert!(!tear::split(&mut state), "a second look finds nothing new");
            let now = [state.motion.len(), state.books.next_piece[0] as usize];
            assert!(now[0] >= last[0] && now[1] >= last[1]);
            last = now;
        }
        assert!(last[0] > start.motion.len() && last[1] > 1, "{shape:?}: it came apart: {last:?}");
    }
}

#[test]
fn what_a_split_node_has_is_shared_by_area() {
    let mut scene = sheet(Shape::Unstructured, 0.04, 0.03, 0.004);
    scene.sheet.variation.noise = Ratio(0.0);
    let mut state = build(&scene).state().clone();
    let start = state.clone();
    break_where(&mut state, |p| p.x.abs() < 0.004);
    tear::split(&mut state);
    check(&start, &state);
    let burn = &state.burn;
    for i in 0..burn.len() {
        let full = 0.08 * burn.area[i];
        assert!((burn.fuel[i] - full).abs() < 1e-12 * full);
        assert!((state.motion.inert_mass[i] - 0.1 * full).abs() < 1e-12 * full);
        assert!((burn.heat_capacity[i] - 1300.0 * full).abs() < 1300.0 * 1e-12 * full);
        assert!((burn.burn_rate_full[i] - full / 1.5).abs() < 1e-12 * full);
    }
}

#[test]
fn a_cut_across_leaves_two_pieces_and_no_spring_over_it() {
    for shape in [Shape::Grid, Shape::Unstructured] {
        let start = build(&quiet(shape, 0.04, 0.03, 0.003)).state().clone();
        let mut state = start.clone();
        assert_eq!(tear::pieces(&state), 1);
        break_where(&mut state, |p| p.x.abs() < 0.003);
        tear::split(&mut state);
        check(&start, &state);
        let side = |t: usize| start.motion.rest_position[start.triangles.corners[t][0] as usize].x > 0.0;
        let pieces: BTreeSet<(bool, u32)> = (0..state.triangles.len())
            .filter(|t| state.triangles.alive[*t] != 0)
            .map(|t| (side(t), state.triangles.piece[t]))
            .collect();
        // Scraps beside the cut may have come off on their own; the two halves are the largest, and are apart.
        assert!(pieces.len() >= 2 && pieces.len() == tear::pieces(&state), "{shape:?}: {pieces:?}");
        for s in (0..state.springs.len()).filter(|s| state.springs.broken[*s] == 0) {
            let [a, b] = state.springs.ends[s].map(|i| state.motion.rest_position[i as usize].x);
            assert!(a * b >= 0.0, "{shape:?}: spring {s} from {a} to {b}");
        }
    }
}

#[test]
fn a_slit_along_one_line_of_a_grid_takes_the_flexion_springs_over_it() {
    // Springs that run down the middle column break; those across the column do not, but their triangles are gone.
    let start = build(&quiet(Shape::Grid, 0.04, 0.04, 0.004)).state().clone();
    let mut state = start.clone();
    break_where(&mut state, |p| p.x.abs() < 1e-6 && p.y > -0.011);
    tear::split(&mut state);
    check(&start, &state);
    let across = (0..state.springs.len()).filter(|s| {
        let [a, b] = state.springs.ends[*s].map(|i| state.motion.rest_position[i as usize]);
        state.springs.kind[*s] == SpringKind::Flexion as u8 && a.x * b.x < 0.0 && a.y > -0.009
    });
    for s in across {
        assert_eq!(state.springs.broken[s], 1, "flexion spring {s} bridges the slit");
    }
}

#[test]
fn a_pinned_node_that_splits_stays_pinned_in_every_copy() {
    let mut scene = quiet(Shape::Grid, 0.04, 0.03, 0.005);
    // A node where eight triangles meet: those beside the cut go, two on each side stay.
    scene.pin.push(Pin { point: Some([0.0, -0.005, 0.0].map(Length)), ..Pin::default() });
    let mut state = build(&scene).state().clone();
    let start = state.clone();
    let pinned = |state: &SheetState| -> Vec<usize> {
        (0..state.motion.len()).filter(|i| state.motion.pinned[*i] == 1).collect()
    };
    let [pin] = pinned(&state)[..] else { panic!("one node is pinned") };
    let x = state.motion.rest_position[pin].x;
    break_where(&mut state, |p| (p.x - x).abs() < 1e-6);
    tear::split(&mut state);
    check(&start, &state);
    let copies = pinned(&state);
    assert!(copies.iter().all(|i| state.motion.source[*i] == state.motion.source[pin]));
    let with_surface = copies.iter().filter(|i| state.motion.alive[**i] == 1).count();
    assert!(copies.len() == 2 && with_surface == 2, "{copies:?}");
}

/// A strip held at its upper edge that is too weak for its weight.
fn weak_strip(shape: Shape) -> Scene {
    let mut scene = quiet(shape, 0.02, 0.08, 0.004);
    scene.pin.push(Pin { edge: Some(Side::Top), ..Pin::default() });
    // The weight of the whole strip is 0.088 kg/m2 g 0.08 m = 0.07 N a metre of width.
    scene.mechanics.strength = ForcePerWidth(0.05);
    scene
}

/// Advances frame by frame and checks each, until the number of nodes and pieces has not changed for `quiet` frames.
fn run_until_quiet(simulation: &mut Simulation, quiet: u32) -> SheetState {
    let start = simulation.state().clone();
    let broken = |state: &SheetState| state.springs.broken.iter().filter(|b| **b != 0).count();
    let mut unchanged = 0;
    for _ in 0..60 {
        let before = broken(simulation.state());
        simulation.advance_frame().unwrap();
        check(&start, simulation.state());
        unchanged = if broken(simulation.state()) == before && before > 0 { unchanged + 1 } else { 0 };
        if unchanged == quiet {
            break;
        }
    }
    start
}

#[test]
fn a_strip_too_weak_for_its_weight_parts_and_the_lower_part_falls_as_a_body() {
    for shape in [Shape::Unstructured, Shape::Grid] {
        let mut simulation = build(&weak_strip(shape));
        run_until_quiet(&mut simulation, 3);
        let before = simulation.state().clone();
        let summary = simulation.summary();
        assert!(summary.springs_broken > 0, "{shape:?}: {summary:?}");
        assert_eq!(summary.pieces, tear::pieces(&before));
        // The largest piece without a pinned node.
        let triangles = &before.triangles;
        let mut area: BTreeMap<u32, f64> = BTreeMap::new();
        for t in (0..triangles.len()).filter(|t| triangles.alive[*t] != 0) {
            *area.entry(triangles.piece[t]).or_default() += triangles.rest_area[t];
        }
        let nodes_of = |piece: u32| -> BTreeSet<usize> {
            (0..triangles.len())
                .filter(|t| triangles.alive[*t] != 0 && triangles.piece[*t] == piece)
                .flat_map(|t| triangles.corners[t].map(|i| i as usize))
                .collect()
        };
        area.retain(|piece, _| nodes_of(*piece).iter().all(|i| before.motion.pinned[*i] == 0));
        let (piece, _) = area.iter().max_by(|a, b| a.1.total_cmp(b.1)).expect("a piece has come off");
        let nodes = nodes_of(*piece);
        let mass: f64 = nodes.iter().map(|i| before.mass(*i)).sum();
        let speed =
            |state: &SheetState| nodes.iter().map(|i| state.motion.velocity[*i] * state.mass(*i)).sum::<DVec3>() / mass;
        simulation.advance_frame().unwrap();
        assert_eq!(simulation.state().springs.broken, before.springs.broken, "{shape:?}: nothing breaks any more");
        let gained = speed(simulation.state()) - speed(&before);
        let expected = DVec3::new(0.0, -9.81 / 24.0, 0.0);
        // Forces between its nodes cancel but for the rounding of their sums, a dozen links in single precision; they
        // are at most some hundred times the weight of a node.
        assert!((gained - expected).length() < 1e-4 * expected.length(), "{shape:?}: {gained}");
        assert!(speed(simulation.state()).y < -0.1, "{shape:?}: it falls");
    }
}

#[test]
fn a_chain_parts_where_it_is_weakest_and_neither_force_nor_heat_crosses_the_gap() {
    let mut scene = quiet(Shape::Chain, 0.05, 0.01, 0.005);
    // One end of the chain is held, the other hangs from it.
    scene.sheet.rotate = [Angle(0.0), Angle(0.0), Angle(-std::f64::consts::FRAC_PI_2)];
    let low = [Length(-1.0), Length(0.0245), Length(-1.0)];
    scene.pin.push(Pin { region: Some(Region { low, high: [Length(1.0); 3] }), ..Pin::default() });
    scene.mechanics.strength = ForcePerWidth(0.02);
    let mut simulation = build(&scene);
    let start = run_until_quiet(&mut simulation, 3);
    let state = simulation.state();
    let lowest = state.motion.position.iter().map(|p| p.y).fold(0.0, f64::min);
    assert!(state.springs.broken.contains(&1) && lowest < -0.05, "the lower part has fallen to {lowest}");
    assert!(state.motion.alive.iter().all(|alive| *alive == 1), "a chain has no surface to lose");
    for s in 0..state.springs.len() {
        assert_eq!(state.springs.broken[s], state.burn_edges.cut[state.springs.edge[s] as usize], "spring {s}");
    }
    assert_eq!(totals(&start), totals(state));
}
