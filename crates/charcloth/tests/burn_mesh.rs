//! A burn mesh finer than the mesh that moves: what one hands to the other, and what a tear leaves.

mod common;

use charcloth::burn_mesh::BurnMap;
use charcloth::frame::Frame;
use charcloth::scene::{Corner, Ignite, Pin, Scene, Shape};
use charcloth::sheet::{NONE, SheetState};
use charcloth::simulation::{Inputs, Simulation};
use charcloth::units::*;
use common::{build, sheet};
use glam::DVec3;

/// A sheet of coarse triangles that burns and tears within a few frames.
fn burning(level: u32) -> Scene {
    let mut scene = sheet(Shape::Unstructured, 0.06, 0.05, 0.006);
    scene.sheet.burn_level = level;
    scene.fire.burn_time = Time(0.1);
    scene.fire.diffusivity = Diffusivity(4e-5);
    scene.mechanics.strength = ForcePerWidth(1.0);
    scene.pin.push(Pin { corner: Some(Corner::TopLeft), radius: Length(0.008), ..Pin::default() });
    scene.ignite.push(Ignite { corner: Some(Corner::BottomRight), radius: Length(0.01), ..Ignite::default() });
    scene
}

fn run(scene: &Scene, frames: u32) -> Simulation {
    let mut simulation = build(scene);
    (0..frames).for_each(|_| simulation.advance_frame().unwrap_or_else(|error| panic!("{error}")));
    simulation
}

/// What has to hold of any state with a fine burn mesh.
fn check(state: &SheetState) {
    let (fine, edges, triangles) = (&state.burn_triangles, &state.burn_edges, &state.triangles);
    for (table, columns) in state.tables() {
        assert!(columns.iter().all(|c| c.data.len() == columns[0].data.len()), "{table} is ragged");
    }
    let mut map = BurnMap::default();
    map.lay_out(state);
    for t in (0..fine.len()).filter(|t| fine.alive[*t] != 0) {
        let parent = fine.parent[t] as usize;
        assert_eq!(triangles.alive[parent], 1, "what moves carries what burns");
        let at = triangles.corners[parent].map(|i| state.motion.rest_position[i as usize]);
        for (i, place) in fine.corners[t].iter().zip(fine.place[t]) {
            let [x, y] = place.as_dvec2().to_array();
            let by_triangle = at[0] * (1.0 - x - y) + at[1] * x + at[2] * y;
            let by_map = map.interpolate(triangles, &state.motion.rest_position, *i as usize);
            assert!(map.held[*i as usize]);
            assert!(by_triangle.distance(by_map) < 1e-12, "a node has one place, whichever triangle is asked");
        }
    }
    for e in 0..edges.len() {
        let mut live = edges.triangles[e].into_iter().filter(|t| *t != NONE && fine.alive[*t as usize] != 0);
        assert_eq!(edges.cut[e] == 0, live.clone().next().is_some(), "heat runs where there is sheet");
        assert!(live.all(|t| edges.ends[e].iter().all(|i| fine.corners[t as usize].contains(i))));
    }
    for t in (0..triangles.len()).filter(|t| triangles.alive[*t] != 0) {
        for i in triangles.corners[t] {
            let at = map.interpolate(triangles, &state.motion.rest_position, state.burn_node(i as usize));
            assert!(at.distance(state.motion.rest_position[i as usize]) < 1e-12);
        }
    }
}

#[test]
fn masses_and_heat_go_from_one_mesh_to_the_other_whole() {
    for level in 0..=3 {
        let simulation = build(&burning(level));
        let state = simulation.state();
        let sum = |values: &[f64]| values.iter().sum::<f64>();
        let fuel = sum(&state.burn.fuel);
        assert!((sum(&state.motion.carried_mass) - fuel).abs() < 1e-13 * fuel, "level {level}");
        assert!((sum(&state.motion.inert_mass) - 0.1 * fuel).abs() < 1e-13 * fuel, "level {level}");
        let area = sum(&state.triangles.rest_area);
        assert!((sum(&state.burn.area) - area).abs() < 1e-13 * area, "level {level}");
        assert_eq!(state.burn_triangles.len(), if level == 0 { 0 } else { state.triangles.len() << (2 * level) });
        if level > 0 {
            check(state);
        }
    }
}

#[test]
fn a_torn_sheet_keeps_its_fuel_and_both_meshes_fit_together() {
    for level in 1..=2 {
        let mut simulation = run(&burning(level), 20);
        let (motion, burn) = {
            let start = build(&burning(level));
            (start.state().motion.len(), start.state().burn.len())
        };
        let state = simulation.state();
        assert!(state.motion.len() > motion && state.burn.len() > burn, "the scene is one that tears both meshes");
        check(state);
        assert!(simulation.summary().mass_error < 1e-12);
        assert!(simulation.summary().energy_error.unwrap() < 1e-12);
        simulation.advance_frame().unwrap();
        check(simulation.state());
    }
}

#[test]
fn a_frame_is_the_burn_mesh_on_a_round_surface() {
    let mut scene = burning(2);
    scene.ignite.clear();
    let simulation = build(&scene);
    let mut state = simulation.state().clone();
    // A cylinder of 50 mm about the y axis: chords of 6 mm sag by 0.09 mm.
    for p in &mut state.motion.position {
        let angle = p.x / 0.05;
        *p = DVec3::new(0.05 * angle.sin(), p.y, 0.05 * angle.cos());
    }
    let frame = Frame::of(&state, 0, 0.0);
    assert_eq!(frame.motion.len(), frame.burn.len());
    assert_eq!(frame.triangles.len(), state.burn_triangles.len());
    let flat = state.burn_positions();
    let off = |p: &DVec3| (DVec3::new(p.x, 0.0, p.z).length() - 0.05).abs();
    let inner: Vec<usize> = (0..flat.len())
        .filter(|i| flat[*i].x.abs() < 0.02 && (frame.motion.rest_position[*i].y).abs() < 0.018)
        .collect();
    let worst = |points: &[DVec3]| inner.iter().map(|i| off(&points[*i])).fold(0.0, f64::max);
    assert!(worst(&frame.motion.position) < 0.6 * worst(&flat), "{} {}", worst(&frame.motion.position), worst(&flat));
    for i in 0..state.motion.len() {
        assert!(frame.motion.position[state.burn_node(i)].distance(state.motion.position[i]) < 1e-15);
    }
}

#[test]
fn every_node_of_a_frame_knows_its_place_on_the_input_also_after_tears() {
    for (level, frames) in [(0, 0), (0, 14), (2, 0), (2, 14)] {
        let simulation = run(&burning(level), frames);
        let start = build(&burning(level));
        // Points of the input by their number there.
        let (motion, triangles) = (&start.state().motion, &start.state().triangles);
        let mut input = vec![DVec3::NAN; motion.len()];
        (0..motion.len()).for_each(|i| input[motion.source[i] as usize] = motion.rest_position[i]);
        let mut faces = vec![[NONE; 3]; triangles.len()];
        for t in 0..triangles.len() {
            faces[triangles.source_face[t] as usize] = triangles.corners[t].map(|i| motion.source[i as usize]);
        }
        let frame = simulation.frame();
        assert_eq!(frames > 0, frame.motion.len() > start.frame().motion.len(), "the scene is one that tears");
        for i in 0..frame.motion.len() {
            let (face, points) = (frame.origins.origin_face[i], frame.origins.origin_points[i]);
            let weights = frame.origins.origin_weights[i];
            assert!((weights.element_sum() - 1.0).abs() < 1e-15 && weights.min_element() >= 0.0, "{weights}");
            assert_eq!(faces[face as usize], points, "the points are those of the face");
            let place: DVec3 = points.iter().zip(weights.to_array()).map(|(k, w)| w * input[*k as usize]).sum();
            // Lengths of some 0.05 m, a handful of roundings.
            assert!(place.distance(frame.motion.rest_position[i]) < 1e-16, "level {level}, node {i}");
        }
        for t in 0..frame.triangles.len() {
            if frame.triangles.alive[t] != 0 {
                // A node on an edge lies on either face at it; inside, there is no choice.
                let inner = |i: &&u32| frame.origins.origin_weights[**i as usize].min_element() > 0.0;
                for i in frame.triangles.corners[t].iter().filter(inner) {
                    assert_eq!(frame.origins.origin_face[*i as usize], frame.triangles.source_face[t]);
                }
            }
        }
    }
}

#[test]
fn a_hairline_that_has_burnt_through_cuts_and_a_hole_weakens() {
    let mut scene = burning(2);
    scene.ignite.clear();
    let simulation = build(&scene);
    let mut state = simulation.state().clone();
    // Burn one row of triangles along the first side of triangle 0, all but a millionth.
    let fine = &state.burn_triangles;
    let row: Vec<usize> = (0..fine.len())
        .filter(|t| {
            fine.parent[*t] == 0 && (fine.place[*t][0].y + fine.place[*t][1].y + fine.place[*t][2].y) / 3.0 > 0.5
        })
        .filter(|t| (fine.place[*t][0].y + fine.place[*t][1].y + fine.place[*t][2].y) / 3.0 < 0.75)
        .collect();
    assert_eq!(row.len(), 3);
    let mut factors = charcloth::effects::SpringFactors::default();
    charcloth::homogenise::factors(&mut state, 0.0, true, &mut factors);
    assert!((factors.triangle[0] - 1.0).abs() < 1e-12);
    for t in row {
        state.burn_triangles.alive[t] = 0;
    }
    charcloth::homogenise::factors(&mut state, 0.0, true, &mut factors);
    // The row lies along the side opposite to corner 2: that side keeps the other three rows (1, 5 and 7 of 16).
    assert!((factors.sides[0][2] - 13.0 / 16.0).abs() < 1e-4, "{:?}", factors.sides[0]);
    assert!(factors.sides[0][0] < 0.5 && factors.sides[0][1] < 0.5, "{:?}", factors.sides[0]);
    assert_eq!(factors.triangle[0], factors.sides[0].into_iter().fold(1.0, f64::min));
}

#[test]
fn the_same_bits_on_any_threads_and_after_a_resumption() {
    let scene = burning(2);
    let on_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&scene, 12).state().hash())
    };
    let whole = on_threads(1);
    assert_eq!(on_threads(2), whole);
    let halfway = run(&scene, 7).state().clone();
    let mut resumed = Simulation::resume(&scene, &Inputs::default(), halfway).unwrap();
    (7..12).for_each(|_| resumed.advance_frame().unwrap());
    assert_eq!(resumed.state().hash(), whole);
    let coarse = Simulation::resume(&burning(0), &Inputs::default(), resumed.state().clone());
    assert!(coarse.is_err(), "a state with a burn mesh is of another scene than one without");
}

#[test]
fn levels_that_are_not_built_are_refused() {
    let mut scene = burning(4);
    let error = |scene: &Scene| Simulation::build(scene, &Inputs::default()).err().unwrap().to_string();
    assert!(error(&scene).contains("sheet.burn_level"));
    scene = sheet(Shape::Chain, 0.1, 0.1, 0.01);
    scene.sheet.burn_level = 1;
    assert!(error(&scene).contains("chain"));
}
