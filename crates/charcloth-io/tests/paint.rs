//! What artists paint: each control does what an unpainted sheet of that make would do, and the books close.

mod common;

use charcloth::scene::{Mask, PaintedGain, PaintedTime, Scene};
use charcloth::simulation::{GreyImage, Inputs, Simulation};
use charcloth::units::{Ratio, Time};
use charcloth_io::scene_file::load_text;
use common::NoFiles;

/// A small piece of tissue, lit at a lower corner, that moves and burns.
const SCENE: &str = r#"
model = "physical"
[sheet]
material = "tissue"
width = "24 mm"
height = "24 mm"
spacing = "4 mm"
burn_level = 1
[time]
frames = 12
step = "4 ms"
[[pin]]
edge = "top"
[[ignite]]
corner = "bottom_left"
radius = "5 mm"
length = "0.3 s"
"#;

/// A picture that is black at the left and white at the right, linear over the texture.
fn left_to_right() -> GreyImage {
    let values = (0..64).map(|i| i as f32 / 63.0).collect();
    GreyImage { width: 64, height: 1, values }
}

fn run(overrides: &[&str], paint: impl Fn(&mut Scene), frames: u32) -> Simulation {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let mut case = load_text("painted", SCENE, &overrides).unwrap_or_else(|error| panic!("{error}")).cases.remove(0);
    let (mut inputs, _): (Inputs, _) = case.read_inputs(&NoFiles).unwrap_or_else(|error| panic!("{error}"));
    inputs.images.insert("paint".to_owned(), left_to_right());
    paint(&mut case.scene);
    let mut simulation = Simulation::build(&case.scene, &inputs).unwrap_or_else(|error| panic!("{error}"));
    (0..frames).for_each(|_| simulation.advance_frame().unwrap_or_else(|error| panic!("{error}")));
    let summary = simulation.summary();
    assert!(summary.mass_error < 1e-11, "{}", summary.mass_error);
    assert!(frames == 0 || summary.energy_error.unwrap() < 1e-11, "{:?}", summary.energy_error);
    simulation
}

fn gain(low: f64, high: f64) -> Option<PaintedGain> {
    Some(PaintedGain { map: Some("paint".to_owned()), low: Ratio(low), high: Ratio(high), ..PaintedGain::default() })
}

/// Largest difference of two columns, over the largest size.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().chain(b).fold(f64::MIN_POSITIVE, |size, x| size.max(x.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

#[test]
fn a_sheet_painted_twice_as_thick_is_one_of_twice_the_grammage_and_thickness() {
    let painted = run(&[], |scene| scene.paint.thickness = gain(2.0, 2.0), 6);
    let made = run(&["sheet.grammage=37.4 g/m2", "shell.thickness=0.15mm"], |_| {}, 6);
    let plain = run(&[], |_| {}, 6);
    let of = |simulation: &Simulation| {
        let state = simulation.state();
        let flat: Vec<f64> = state.motion.position.iter().flat_map(|p| p.to_array()).collect();
        (state.burn.temperature.clone(), state.burn.mass.clone(), flat)
    };
    let [a, b, c] = [&painted, &made, &plain].map(of);
    let far = [difference(&a.0, &b.0), difference(&a.1, &b.1), difference(&a.2, &b.2)];
    assert!(far.iter().all(|far| *far < 1e-6), "temperature, mass, position differ by {far:?}");
    let far = [difference(&a.0, &c.0), difference(&a.1, &c.1), difference(&a.2, &c.2)];
    assert!(far.iter().all(|far| *far > 1e-4), "the plain sheet differs by {far:?} only");
}

#[test]
fn a_speed_gain_burns_like_a_thinner_sheet_that_weighs_as_much() {
    let still = "mechanics.moves=false";
    let gained = run(&[still], |scene| scene.fire.speed_gain = Ratio(2.0), 8);
    let thin = run(&[still, "sheet.grammage=9.35 g/m2", "shell.thickness=0.0375mm"], |_| {}, 8);
    let plain = run(&[still], |_| {}, 8);
    let temperature = |simulation: &Simulation| simulation.state().burn.temperature.clone();
    let far = difference(&temperature(&gained), &temperature(&thin));
    assert!(far < 1e-9, "temperatures differ by {far}");
    let left = |simulation: &Simulation| {
        let burn = &simulation.state().burn;
        burn.fuel.iter().sum::<f64>() / burn.fuel_initial.iter().sum::<f64>()
    };
    assert!(1.0 - left(&gained) > 1.5 * (1.0 - left(&plain)), "{} and {} left", left(&gained), left(&plain));
    let weight = |gain: f64| {
        let simulation = run(&[], |scene| scene.fire.speed_gain = Ratio(gain), 0);
        (0..simulation.state().motion.len()).map(|i| simulation.state().mass(i)).sum::<f64>()
    };
    assert!((weight(3.0) / weight(1.0) - 1.0).abs() < 1e-12, "{} {}", weight(3.0), weight(1.0));
}

#[test]
fn fuel_moisture_and_speed_follow_the_paint() {
    let plain = run(&[], |_| {}, 0);
    let ratio = |painted: &Simulation, of: fn(&Simulation, usize) -> f64| {
        let place = |i: usize| plain.state().burn_rest_positions()[i].x / 0.024 + 0.5;
        let nodes = (0..plain.state().burn.len()).map(|i| (place(i), of(painted, i) / of(&plain, i)));
        nodes.collect::<Vec<_>>()
    };
    let fuel = run(&[], |scene| scene.paint.fuel = gain(0.5, 1.5), 0);
    let moisture = run(&[], |scene| scene.paint.moisture = gain(0.0, 4.0), 0);
    let speed = run(&[], |scene| scene.paint.speed = gain(1.0, 3.0), 0);
    // A picture of 64 pixels is level in the outer half of its first and last.
    for (place, factor) in ratio(&fuel, |it, i| it.state().burn.fuel_initial[i]) {
        assert!((factor - (0.5 + place)).abs() < 0.02, "fuel at {place}: {factor}");
    }
    for (place, factor) in ratio(&moisture, |it, i| it.state().front.water[i]) {
        assert!((factor - 4.0 * place).abs() < 0.06, "moisture at {place}: {factor}");
    }
    for (place, factor) in ratio(&speed, |it, i| it.state().burn.mass[i]) {
        assert!((1.0 / factor - (1.0 + 2.0 * place)).abs() < 0.04, "speed at {place}: {factor}");
    }
    run(&[], |scene| scene.paint.moisture = gain(0.0, 4.0), 6);
}

#[test]
fn what_must_not_burn_does_not() {
    let keep = |scene: &mut Scene| scene.paint.noburn = Some(Mask { map: Some("paint".to_owned()), group: None });
    let everywhere = ["ignite.0.edge=bottom", "ignite.0.length=2"];
    let kept = run(&everywhere, keep, 36);
    let burn = &kept.state().burn;
    let mut masked = 0;
    for i in 0..burn.len() {
        if burn.noburn[i] != 0 {
            masked += 1;
            assert_eq!(burn.fuel[i], burn.fuel_initial[i], "node {i}");
            assert!(burn.peak_temperature[i] <= 423.15 && burn.stiffness[i] == 1.0, "{}", burn.peak_temperature[i]);
        }
    }
    let hot = (0..burn.len()).filter(|i| burn.noburn[*i] != 0 && burn.peak_temperature[*i] > 400.0).count();
    assert!(masked > burn.len() / 3 && hot > 0, "{masked} of {} are masked, {hot} were heated", burn.len());
    let left = |simulation: &Simulation| simulation.state().burn.fuel.iter().sum::<f64>();
    assert!(left(&kept) > 1.3 * left(&run(&everywhere, |_| {}, 36)), "without the mask it burns");
}

#[test]
fn painted_strength_is_strength() {
    let pulled = ["mechanics.strength=20", "initial.stretch=[1.002, 1.0, 1.0]", "pin=[]", "ignite=[]"];
    let held = ["pin.0.edge=left", "pin.1.edge=right"];
    let overrides: Vec<&str> = pulled.into_iter().chain(held).collect();
    let broken = |overrides: &[&str], paint: &dyn Fn(&mut Scene)| {
        run(overrides, paint, 1).state().springs.broken.iter().filter(|broken| **broken != 0).count()
    };
    let halved: Vec<&str> =
        overrides.iter().map(|it| if it.contains("strength") { "mechanics.strength=10" } else { *it }).collect();
    let (whole, half) = (broken(&overrides, &|_| {}), broken(&halved, &|_| {}));
    let painted = broken(&overrides, &|scene| scene.paint.strength = gain(0.5, 0.5));
    assert!(half > whole, "{half} break at half the strength, {whole} at the whole");
    assert_eq!(painted, half);
}

#[test]
fn painted_delays_say_when_each_place_is_lit() {
    let delay = PaintedTime { map: Some("paint".to_owned()), low: Time(0.0), high: Time(1.0), group: None };
    let paint = |scene: &mut Scene| {
        scene.ignite[0].corner = None;
        scene.ignite[0].delay = Some(delay.clone());
    };
    let lit = run(&["mechanics.moves=false"], paint, 40);
    let state = lit.state();
    for (i, place) in state.burn_rest_positions().iter().enumerate() {
        let (due, there) = (place.x / 0.024 + 0.5, state.burn.ignited_at[i]);
        // Tissue takes a few tenths of a second under a pilot; the front of its neighbours may be a little ahead.
        assert!((due - 0.25..due + 0.5).contains(&there), "due at {due} s, caught fire at {there} s");
    }
}

#[test]
fn mistakes_are_shown_at_their_line() {
    let error = |added: &str, overrides: &[String]| {
        let text = format!("{SCENE}{added}");
        load_text("painted", &text, overrides).map(|_| ()).expect_err("a mistake").to_string()
    };
    let neither = error("[paint.fuel]\nlow = 0.5\n", &[]);
    assert!(neither.contains("painted:18") && neither.contains("either `group` or `map`"), "{neither}");
    let negative = error("[paint.moisture]\nmap = \"a.png\"\nlow = -1\n", &[]);
    assert!(negative.contains("painted:20") && negative.contains("under 0"), "{negative}");
    let old = error("[paint.speed]\ngroup = \"fast\"\n", &["model=moidu2004".to_owned()]);
    assert!(old.contains("only the physical model"), "{old}");
    let mixed = "[[wind.key]]\ntime = 1\nvelocity = [1, 0, 0]\n[[wind.key]]\ntime = 1\nvelocity = [1, 0, 0]\n";
    let order = error(mixed, &[]);
    assert!(order.contains("painted:22") && order.contains("order of their times"), "{order}");
    // What only the mesh can tell comes when the sheet is built.
    let text = format!("{SCENE}[paint.fuel]\ngroup = \"thick\"\n");
    let case = load_text("painted", &text, &[]).unwrap_or_else(|error| panic!("{error}")).cases.remove(0);
    let (inputs, _) = case.read_inputs(&NoFiles).unwrap_or_else(|error| panic!("{error}"));
    let unknown = Simulation::build(&case.scene, &inputs).map(|_| ()).expect_err("no such attribute");
    let unknown = case.explain(&unknown).to_string();
    assert!(unknown.contains("painted:19") && unknown.contains("not painted"), "{unknown}");
}
