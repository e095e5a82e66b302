//! Sheets that lie close: what burns lights what it touches, also after a resumption, and nothing else.

mod common;

use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::scene_file::load_text;
use common::NoFiles;

/// Two strips of tissue, one over the other, held all over; a flame is put to an end of the upper one.
const SCENE: &str = r#"
model = "physical"
[sheet]
material = "tissue"
width = "30 mm"
height = "8 mm"
spacing = "2 mm"
pose = "lying"
layers = 2
layer_distance = "1 mm"
cockle = 0
variation.noise = 0
[contact]
self_contact = true
[crack]
enabled = false
[time]
frames = 36
step = "4 ms"
[[pin]]
box = { low = [-1, -1, -1], high = [1, 1, 1] }
[[ignite]]
box = { low = ["10 mm", 0, -1], high = [1, 1, 1] }
length = "0.3 s"
"#;

fn build(distance: &str) -> (Simulation, Inputs, charcloth::scene::Scene) {
    let overrides = [format!("sheet.layer_distance={distance}")];
    let case = load_text("close", SCENE, &overrides).unwrap_or_else(|error| panic!("{error}")).cases.remove(0);
    let (inputs, _) = case.read_inputs(&NoFiles).unwrap_or_else(|error| panic!("{error}"));
    let simulation = Simulation::build(&case.scene, &inputs).unwrap_or_else(|error| panic!("{error}"));
    (simulation, inputs, case.scene)
}

fn advance(simulation: &mut Simulation, frames: u32) {
    (0..frames).for_each(|_| simulation.advance_frame().unwrap_or_else(|error| panic!("{error}")));
}

/// Highest temperature that the lower and the upper strip have had [K].
fn peaks(simulation: &Simulation) -> [f64; 2] {
    let state = simulation.state();
    let mut peaks = [0.0f64; 2];
    for i in 0..state.burn.len() {
        let peak = &mut peaks[usize::from(state.motion.position[i].y > 0.0)];
        *peak = peak.max(state.burn.peak_temperature[i]);
    }
    peaks
}

#[test]
fn a_burning_sheet_lights_one_it_nearly_touches_and_the_books_close() {
    let mut close = build("0.6 mm").0;
    advance(&mut close, 36);
    let [lower, upper] = peaks(&close);
    println!("close: {lower:.0} K under {upper:.0} K");
    assert!(upper > 700.0, "the upper strip burns, {upper} K");
    assert!(lower > 550.0, "the lower strip is scorched, {lower} K");
    let summary = close.summary();
    assert!(summary.mass_error < 1e-12, "{}", summary.mass_error);
    assert!(summary.energy_error.unwrap() < 1e-12, "{:?}", summary.energy_error);

    let mut apart = build("20 mm").0;
    advance(&mut apart, 36);
    let [lower, upper] = peaks(&apart);
    println!("apart: {lower:.0} K under {upper:.0} K");
    assert!(upper > 700.0, "the upper strip burns, {upper} K");
    assert!(lower < 294.0, "nothing reaches the lower strip, {lower} K");
}

#[test]
fn what_lies_close_is_the_same_after_a_resumption() {
    let (mut whole, inputs, scene) = build("0.6 mm");
    advance(&mut whole, 7);
    let mut resumed = Simulation::resume(&scene, &inputs, whole.state().clone()).unwrap();
    advance(&mut whole, 8);
    advance(&mut resumed, 8);
    assert_eq!(resumed.state().hash(), whole.state().hash());
}
