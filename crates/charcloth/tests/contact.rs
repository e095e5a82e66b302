//! Sheets that touch: the same bits however the work is shared out and after a resumption, and no way through.

mod common;

use charcloth::scene::{Obstacle, ObstacleShape, Pose, Scene, Shape};
use charcloth::simulation::{Inputs, Simulation};
use charcloth::units::*;
use common::sheet;

/// Three layers that fall onto a ball on a table which rises to meet them.
fn scene() -> Scene {
    let mut scene = sheet(Shape::Unstructured, 0.06, 0.06, 0.006);
    scene.sheet.pose = Pose::Lying;
    scene.sheet.layers = 3;
    scene.sheet.layer_distance = Length(0.003);
    scene.sheet.cockle = Some(Length(2e-4));
    scene.mechanics.integrator = "implicit".to_owned();
    scene.shell.thickness = Length(4e-4);
    scene.shell.modulus_along = Modulus(2e6);
    scene.shell.modulus_across = Modulus(2e6);
    scene.time.step = Time(7e-3);
    let place = |y: f64| [Length(0.0), Length(y), Length(0.0)];
    scene.obstacle = vec![
        Obstacle { shape: ObstacleShape::Sphere, radius: Length(0.02), position: place(-0.025), ..Obstacle::default() },
        Obstacle {
            position: place(-0.06),
            velocity: [Speed(0.0), Speed(0.2), Speed(0.0)],
            stop: Some(Time(0.1)),
            ..Obstacle::default()
        },
        Obstacle {
            shape: ObstacleShape::Box,
            size: [Length(0.02), Length(0.01), Length(0.02)],
            position: [Length(-0.05), Length(-0.02), Length(0.0)],
            velocity: [Speed(0.3), Speed(0.0), Speed(0.0)],
            spin: [Rate(0.0), Rate(3.0), Rate(0.0)],
            stop: Some(Time(0.1)),
            ..Obstacle::default()
        },
    ];
    scene.obstacle[0].position[0] = Length(0.015);
    scene
}

fn hash(scene: &Scene, threads: usize, frames: u32) -> u64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut simulation = Simulation::build(scene, &Inputs::default()).unwrap();
        (0..frames).for_each(|_| simulation.advance_frame().unwrap());
        simulation.state().hash()
    })
}

#[test]
fn nothing_passes_through_and_bits_are_the_same_on_any_threads_and_after_a_resumption() {
    let scene = scene();
    let mut simulation = Simulation::build(&scene, &Inputs::default()).unwrap();
    (0..4).for_each(|_| simulation.advance_frame().unwrap());
    let half_way = simulation.state().clone();
    (0..4).for_each(|_| simulation.advance_frame().unwrap());
    let summary = simulation.summary();
    assert_eq!((summary.intersecting_pairs_max, summary.passed_through), (Some(0), Some(0)));
    // Layers keep their order, and lie on the ball: without contact they would have fallen by half a metre.
    let state = simulation.state();
    let lowest = state.motion.position.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    assert!(lowest > -0.04, "{lowest}");
    let highest = state.motion.position.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    assert!(highest > -0.01 && highest < 0.02, "{highest}");
    let whole = state.hash();
    for threads in [1, 2, 3] {
        assert_eq!(hash(&scene, threads, 8), whole, "{threads} threads");
    }
    let mut resumed = Simulation::resume(&scene, &Inputs::default(), half_way).unwrap();
    (0..4).for_each(|_| resumed.advance_frame().unwrap());
    assert_eq!(resumed.state().hash(), whole);
}

/// A level plate at a height, that looks up (1) or down (-1) and rises.
fn plate(y: f64, normal: f64, speed: f64) -> Obstacle {
    Obstacle {
        position: [Length(0.0), Length(y), Length(0.0)],
        normal: Some([0.0, normal, 0.0]),
        velocity: [Speed(0.0), Speed(speed), Speed(0.0)],
        ..Obstacle::default()
    }
}

#[test]
fn paper_that_is_pressed_between_plates_does_not_stretch() {
    let mut scene = sheet(Shape::Unstructured, 0.02, 0.1, 0.005);
    scene.sheet.cockle = Some(Length(1e-3));
    scene.sheet.cockle_length = Length(0.06);
    scene.mechanics.integrator = "implicit".to_owned();
    scene.shell.thickness = Length(1e-4);
    scene.shell.modulus_along = Modulus(2e9);
    scene.shell.modulus_across = Modulus(2e9);
    scene.shell.newton_tolerance = Ratio(1e-2);
    scene.contact.self_contact = Some(true);
    scene.contact.modulus = Modulus(2e4);
    scene.contact.thickness = Some(Length(4e-4));
    scene.time.step = Time(0.014);
    scene.obstacle = vec![plate(-0.052, 1.0, 0.0), plate(0.052, -1.0, -0.1)];
    let mut simulation = Simulation::build(&scene, &Inputs::default()).unwrap();
    (0..20).for_each(|_| simulation.advance_frame().unwrap());
    let most = simulation.summary().strain_max;
    // The plate has gone 80 mm of 104. A guess that presses the strip together, or the work of the plate, taken as a measure of
    // what a step may leave unsolved, stretches it by 0.4 to 1.4 %.
    assert!(most > 1e-5 && most < 1e-3, "{most}");
}

#[test]
fn a_sheet_that_cannot_give_way_holds_up_what_presses_on_it() {
    let mut scene = sheet(Shape::Unstructured, 0.01, 0.01, 0.005);
    scene.sheet.pose = Pose::Lying;
    scene.mechanics.integrator = "implicit".to_owned();
    scene.time.step = Time(0.02);
    // The plates meet after 10 ms, and would be 6 mm past each other at the end.
    scene.obstacle = vec![plate(-5e-4, 1.0, 0.0), plate(5e-4, -1.0, -0.1)];
    let mut simulation = Simulation::build(&scene, &Inputs::default()).unwrap();
    (0..2).for_each(|_| simulation.advance_frame().unwrap());
    let summary = simulation.summary();
    assert_eq!((summary.intersecting_pairs_max, summary.passed_through), (Some(0), Some(0)));
    let state = simulation.state();
    assert!(state.motion.position.iter().all(|p| (p.y + 5e-4).abs() < 1e-4));
    assert!((state.books.scenery_lag[0] - (2.0 / 24.0 - 0.01)).abs() < 1e-3, "{}", state.books.scenery_lag[0]);
    assert!(simulation.warnings().iter().any(|warning| warning.contains("holds up")), "{:?}", simulation.warnings());
}

#[test]
fn what_cannot_be_is_said_in_words() {
    let mut explicit = scene();
    explicit.mechanics.integrator = "symplectic_euler".to_owned();
    let error = Simulation::build(&explicit, &Inputs::default()).err().unwrap().to_string();
    assert!(error.contains("contact") && error.contains("implicit"), "{error}");
    let mut inside = scene();
    inside.obstacle[0].position = [Length(0.0); 3];
    let error = Simulation::build(&inside, &Inputs::default()).err().unwrap().to_string();
    assert!(error.contains("crosses"), "{error}");
    let mut nameless = scene();
    nameless.obstacle[0].shape = ObstacleShape::Mesh;
    assert!(Simulation::build(&nameless, &Inputs::default()).is_err());
}

#[test]
fn a_sheet_that_meets_nothing_moves_as_without_contact() {
    let mut free = sheet(Shape::Unstructured, 0.05, 0.05, 0.006);
    free.mechanics.integrator = "implicit".to_owned();
    free.time.step = Time(7e-3);
    let mut watched = free.clone();
    watched.contact.self_contact = Some(true);
    let end = |scene: &Scene| {
        let mut simulation = Simulation::build(scene, &Inputs::default()).unwrap();
        (0..3).for_each(|_| simulation.advance_frame().unwrap());
        simulation.state().motion.position.clone()
    };
    let (a, b) = (end(&free), end(&watched));
    let away = a.iter().zip(&b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(away < 1e-6, "{away}");
}
