//! The books close while everything happens at once: fire, cooling, tears.

mod common;

use charcloth::scene::{Corner, HeatCapacityLaw, Ignite, Pin, Scene, Shape};
use charcloth::units::*;
use common::{build, sheet};

fn burning(law: HeatCapacityLaw, shape: Shape) -> Scene {
    let mut scene = sheet(shape, 0.05, 0.04, 0.004);
    scene.fire.heat_capacity_law = law;
    scene.fire.burn_time = Time(0.1);
    scene.fire.diffusivity = Diffusivity(4e-5);
    scene.fire.cooling_rate = Rate(0.5);
    scene.mechanics.strength = ForcePerWidth(2.0);
    scene.pin.push(Pin { corner: Some(Corner::TopLeft), radius: Length(0.006), ..Pin::default() });
    for (corner, start) in [(Corner::BottomRight, 0.0), (Corner::TopRight, 0.2)] {
        let start = Time(start);
        scene.ignite.push(Ignite { corner: Some(corner), radius: Length(0.012), start, ..Ignite::default() });
    }
    scene
}

#[test]
fn mass_and_energy_are_accounted_for_to_rounding() {
    for shape in [Shape::Unstructured, Shape::Grid] {
        for law in [HeatCapacityLaw::Constant, HeatCapacityLaw::Inverse, HeatCapacityLaw::Literal] {
            let mut simulation = build(&burning(law, shape));
            for _ in 0..24 {
                simulation.advance_frame().unwrap();
                let summary = simulation.summary();
                // Tens of thousands of roundings, each of a part in 1e16 of what a node has.
                assert!(summary.mass_error < 1e-12, "{law:?}: {}", summary.mass_error);
                match law {
                    // A node without fuel has no heat capacity left: there is nothing to conserve.
                    HeatCapacityLaw::Literal => assert_eq!(summary.energy_error, None),
                    _ => assert!(summary.energy_error.unwrap() < 1e-9, "{law:?}: {:?}", summary.energy_error),
                }
            }
            let (summary, state) = (simulation.summary(), simulation.state());
            let books = &state.books;
            assert!(summary.burnt_area_fraction > 0.1 && summary.springs_broken > 0, "{law:?}: {summary:?}");
            assert!(books.heat_lost[0] > 0.0 && books.heat_of_ignition[0] > 0.0);
            // The books of the nodes and of the whole agree.
            let released: f64 = state.burn.heat_released.iter().sum();
            assert!((released - summary.heat_released_J).abs() < 1e-11 * released);
        }
    }
}
