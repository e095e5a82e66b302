//! The physical model with a material of the library: books, bits, and a fire that goes out without oxygen.

mod common;

use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::scene_file::{Case, load_text};
use common::NoFiles;

/// A small piece of tissue, lit at a lower corner, that moves, shrinks and burns away.
const SCENE: &str = r#"
model = "physical"
[sheet]
material = "tissue"
width = "24 mm"
height = "24 mm"
spacing = "3 mm"
burn_level = 1
[time]
frames = 20
step = "4 ms"
[[pin]]
edge = "top"
[[ignite]]
corner = "bottom_left"
radius = "5 mm"
length = "0.3 s"
[output]
stills = []
"#;

fn case(overrides: &[&str]) -> Case {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    load_text("tissue", SCENE, &overrides).unwrap_or_else(|error| panic!("{error}")).cases.remove(0)
}

fn build(case: &Case) -> (Simulation, Inputs) {
    let (inputs, _) = case.read_inputs(&NoFiles).unwrap_or_else(|error| panic!("{error}"));
    (Simulation::build(&case.scene, &inputs).unwrap_or_else(|error| panic!("{error}")), inputs)
}

fn advance(simulation: &mut Simulation, frames: u32) {
    (0..frames).for_each(|_| simulation.advance_frame().unwrap_or_else(|error| panic!("{error}")));
}

#[test]
fn mass_and_energy_close_and_the_bits_are_the_same_on_any_threads_and_after_a_resumption() {
    let case = case(&[]);
    let on_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = build(&case).0;
            advance(&mut simulation, 16);
            simulation
        })
    };
    let whole = on_threads(1);
    let summary = whole.summary();
    assert!(summary.mass_error < 1e-12, "{}", summary.mass_error);
    assert!(summary.energy_error.unwrap() < 1e-12, "{:?}", summary.energy_error);
    assert!(summary.fuel_burnt_kg > 0.02 * summary.fuel_initial_kg, "it burns");
    assert_eq!(on_threads(2).state().hash(), whole.state().hash());
    let (mut halfway, inputs) = build(&case);
    advance(&mut halfway, 9);
    let mut resumed = Simulation::resume(&case.scene, &inputs, halfway.state().clone()).unwrap();
    advance(&mut resumed, 7);
    assert_eq!(resumed.state().hash(), whole.state().hash());
}

#[test]
fn without_oxygen_nothing_catches_fire() {
    let burnt = |overrides: &[&str]| {
        let mut simulation = build(&case(overrides)).0;
        advance(&mut simulation, 20);
        simulation.summary().burnt_area_fraction
    };
    let (air, nitrogen) = (burnt(&[]), burnt(&["fire.oxygen=0.0"]));
    assert!(air > 2.0 * nitrogen, "{air} in air, {nitrogen} in nitrogen");
}

#[test]
fn a_material_that_is_not_there_is_an_error_at_its_line() {
    let text = SCENE.replace("\"tissue\"", "\"tisue\"");
    let error = load_text("tissue", &text, &[]).unwrap_err().to_string();
    assert!(error.contains("tissue:4") && error.contains("did you mean"), "{error}");
}
