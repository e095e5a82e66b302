//! The same bits, however the work is shared out.

mod common;

use charcloth::error::Error;
use charcloth::frame::{Frame, Sample, Sink};
use charcloth::kernels::VectorUnit;
use charcloth::scene::{Corner, Ignite, Pin, Scene, Shape};
use charcloth::sheet::SheetState;
use charcloth::simulation::{Inputs, Simulation};
use charcloth::units::*;
use common::{build, sheet};
use std::ops::ControlFlow;

/// A sheet that burns, curls and tears within a few frames.
fn burning() -> Scene {
    let mut scene = sheet(Shape::Unstructured, 0.06, 0.05, 0.004);
    scene.fire.burn_time = Time(0.1);
    scene.fire.diffusivity = Diffusivity(4e-5);
    scene.fire.cooling_rate = Rate(0.2);
    scene.mechanics.strength = ForcePerWidth(2.0);
    scene.wind.gust = Ratio(0.5);
    scene.wind.velocity = [Speed(0.0), Speed(0.0), Speed(1.0)];
    scene.pin.push(Pin { corner: Some(Corner::TopLeft), radius: Length(0.006), ..Pin::default() });
    scene.ignite.push(Ignite { corner: Some(Corner::BottomRight), radius: Length(0.015), ..Ignite::default() });
    scene
}

/// The same as an elastic shell, soft enough to tear.
fn burning_shell() -> Scene {
    let mut scene = burning();
    scene.mechanics.integrator = "implicit".to_owned();
    scene.mechanics.strength = ForcePerWidth(0.5);
    scene.shell.modulus_along = Modulus(1e6);
    scene.shell.modulus_across = Modulus(5e5);
    scene.time.step = Time(1e-2);
    scene
}

/// The hash of the state after some frames on some threads, and whether nodes have split.
fn hash(scene: &Scene, threads: usize, frames: u32) -> (u64, bool) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut simulation = build(scene);
        let nodes = simulation.state().motion.len();
        (0..frames).for_each(|_| simulation.advance_frame().unwrap());
        (simulation.state().hash(), simulation.state().motion.len() > nodes)
    })
}

#[test]
fn a_torn_and_burning_sheet_is_the_same_on_one_thread_and_on_several_and_the_second_time() {
    for scene in [burning(), burning_shell()] {
        let integrator = &scene.mechanics.integrator;
        let (first, torn) = hash(&scene, 1, 12);
        assert!(torn, "{integrator}: the scene is one that tears");
        for threads in [1, 2, 3] {
            assert_eq!(hash(&scene, threads, 12).0, first, "{integrator}, {threads} threads");
        }
    }
}

#[test]
fn sheets_large_enough_to_be_shared_among_threads_give_the_same_bits() {
    // Soft springs and short frames: few substeps. 34,000 nodes are past the point where a second thread takes part.
    let mut scene = burning();
    scene.sheet.width = Length(0.2);
    scene.sheet.height = Length(0.15);
    scene.sheet.spacing = Length(0.001);
    scene.mechanics.structural = ForcePerWidth(1.0);
    scene.mechanics.flexion = ForcePerWidth(0.1);
    scene.mechanics.strength = ForcePerWidth(0.05);
    scene.time.fps = 2000.0;
    let (first, _) = hash(&scene, 1, 2);
    assert_eq!(hash(&scene, 2, 2).0, first);

    // 7,700 nodes are, with steps of a shell.
    scene.mechanics.integrator = "implicit".to_owned();
    scene.sheet.spacing = Length(0.0021);
    scene.time.fps = 200.0;
    scene.time.step = Time(5e-3);
    let (first, _) = hash(&scene, 1, 2);
    assert_eq!(hash(&scene, 2, 2).0, first);
}

#[test]
fn every_vector_unit_gives_the_same_bits() {
    let run = |unit| {
        let mut simulation = build(&burning());
        simulation.set_vector_unit(unit);
        (0..6).for_each(|_| simulation.advance_frame().unwrap());
        simulation.state().hash()
    };
    let hashes: Vec<(VectorUnit, u64)> = VectorUnit::available().into_iter().map(|unit| (unit, run(unit))).collect();
    assert!(hashes.iter().all(|(_, hash)| *hash == hashes[0].1), "{hashes:?}");
}

#[test]
fn a_state_that_is_taken_up_again_goes_on_with_the_same_bits() {
    for scene in [burning(), burning_shell()] {
        resume_with_the_same_bits(&scene);
    }
}

fn resume_with_the_same_bits(scene: &Scene) {
    let mut straight = build(scene);
    let mut states = vec![straight.state().clone()];
    for _ in 0..10 {
        straight.advance_frame().unwrap();
        states.push(straight.state().clone());
    }
    for start in [0, 3, 7] {
        let mut resumed = Simulation::resume(scene, &Inputs::default(), states[start].clone()).unwrap();
        for frame in start + 1..states.len() {
            resumed.advance_frame().unwrap();
            assert_eq!(resumed.state().hash(), states[frame].hash(), "resumed at {start}, frame {frame}");
        }
        assert_eq!(resumed.history(), straight.history());
    }
}

#[test]
fn a_resumed_run_does_not_hand_over_the_frame_it_goes_on_from() {
    struct Numbers(Vec<u32>);
    impl Sink for Numbers {
        fn frame(&mut self, frame: &Frame, _: &[Sample], _: &SheetState) -> Result<ControlFlow<()>, Error> {
            self.0.push(frame.number);
            Ok(ControlFlow::Continue(()))
        }
    }
    let scene = burning();
    let start = build(&scene).state().clone();
    let mut numbers = Numbers(Vec::new());
    Simulation::resume(&scene, &Inputs::default(), start).unwrap().run(2, &mut numbers).unwrap();
    assert_eq!(numbers.0, [1, 2]);
}
