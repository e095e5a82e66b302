//! The physical model looks after those nodes alone where something happens; that, threads and stops change no bit.

mod common;

use charcloth::scene::Scene;
use charcloth::sheet::SheetState;
use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::scene_file;
use common::NoFiles;

/// A strip that lights at its foot and burns through, on a finer burn mesh, with a heater on one face.
const MOVING: &str = r#"
model = "physical"
gravity = 9.81
[sheet]
material = "tissue"
width = "20 mm"
height = "40 mm"
spacing = "4 mm"
burn_level = 2
cockle = "0.2 mm"
[[pin]]
corner = "top_left"
radius = "5 mm"
[[ignite]]
corner = "bottom_left"
radius = "5 mm"
length = "0.2 s"
[[heater]]
flux = "30 kW/m2"
point = [0, "10 mm", 0]
radius = "6 mm"
start = "0.1 s"
length = "0.2 s"
[time]
step = "4 ms"
frames = 16
"#;

/// The same without motion, with every node one that moves.
const STILL: &str = r#"
model = "physical"
[sheet]
material = "tissue"
width = "15 mm"
height = "30 mm"
spacing = "1 mm"
cockle = 0
[mechanics]
moves = false
[[ignite]]
edge = "top"
length = "0.2 s"
[time]
step = "4 ms"
frames = 16
"#;

fn open(text: &str) -> (Scene, Inputs) {
    let file = scene_file::load_text("physical.toml", text, &[]).unwrap();
    let (inputs, _) = file.cases[0].read_inputs(&NoFiles).unwrap();
    (file.cases[0].scene.clone(), inputs)
}

/// The states at the start and after each frame.
fn run(text: &str, threads: usize, all_awake: bool) -> Vec<SheetState> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let (scene, inputs) = open(text);
        let mut simulation = Simulation::build(&scene, &inputs).unwrap();
        simulation.keep_all_awake(all_awake);
        let mut states = vec![simulation.state().clone()];
        for _ in 0..scene.time.frames {
            simulation.advance_frame().unwrap();
            states.push(simulation.state().clone());
        }
        states
    })
}

fn hashes(states: &[SheetState]) -> Vec<u64> {
    states.iter().map(SheetState::hash).collect()
}

#[test]
fn what_sleeps_changes_no_bit_nor_do_threads() {
    for text in [MOVING, STILL] {
        let states = run(text, 2, false);
        let last = states.last().unwrap();
        assert!(last.books.volatiles_burnt[0] > 0.0, "the scene is one that burns");
        // Soon after it is lit; a flame that climbs reaches all of a small sheet later.
        let asleep = |i: &usize| states[3].front.temperature[*i] == states[0].front.temperature[0];
        assert!((0..last.burn.len()).any(|i| asleep(&i)), "part of it sleeps");
        assert_eq!(hashes(&states), hashes(&run(text, 2, true)), "all awake");
        assert_eq!(hashes(&states), hashes(&run(text, 1, false)), "one thread");
    }
}

#[test]
fn a_state_that_is_taken_up_again_goes_on_with_the_same_bits() {
    for text in [MOVING, STILL] {
        let states = run(text, 2, false);
        let (scene, inputs) = open(text);
        for start in [0, 5, 11] {
            let mut resumed = Simulation::resume(&scene, &inputs, states[start].clone()).unwrap();
            for frame in start + 1..states.len() {
                resumed.advance_frame().unwrap();
                assert_eq!(resumed.state().hash(), states[frame].hash(), "resumed at {start}, frame {frame}");
            }
        }
    }
}
