//! A run that blows up says so, and why.

mod common;

use charcloth::error::Error;
use charcloth::frame::{Frame, Sample, Sink};
use charcloth::scene::{Corner, Ignite, Scene, Shape};
use charcloth::sheet::SheetState;
use charcloth::units::*;
use common::{build, sheet};
use std::ops::ControlFlow;

/// A stiff sheet with a substep that is far too long for it.
fn unstable() -> Scene {
    let mut scene = sheet(Shape::Unstructured, 0.05, 0.04, 0.004);
    scene.mechanics.structural = ForcePerWidth(1e4);
    // Provot's limit would hold the sheet together by force.
    scene.mechanics.deformation_limit = Ratio(0.0);
    scene.time.substeps = Some(1);
    scene.ignite.push(Ignite { corner: Some(Corner::BottomLeft), radius: Length(0.01), ..Ignite::default() });
    scene
}

#[derive(Default)]
struct Kept(Vec<u32>);

impl Sink for Kept {
    fn frame(&mut self, frame: &Frame, _: &[Sample], state: &SheetState) -> Result<ControlFlow<()>, Error> {
        assert!(frame.motion.position.iter().all(|p| p.is_finite()));
        assert_eq!(state.books.frame[0], frame.number);
        self.0.push(frame.number);
        Ok(ControlFlow::Continue(()))
    }
}

#[test]
fn an_unstable_run_stops_and_names_field_node_time_and_cause() {
    let mut simulation = build(&unstable());
    let mut kept = Kept::default();
    let error = simulation.run(48, &mut kept).unwrap_err();
    let Error::NotFinite { field, node, time, frame, ref cause } = error else { panic!("{error}") };
    assert!(field == "position" || field == "velocity", "{field}");
    assert!(node < simulation.state().motion.len());
    assert!(frame >= 1 && time > 0.0 && time <= f64::from(frame) / 24.0 + 1e-12);
    assert!(cause.contains("time.substeps"), "{cause}");
    assert_eq!(kept.0, (0..frame).collect::<Vec<_>>(), "the frames before it are handed over, and no other");
    for words in [field, &format!("node {node} "), "time.substeps", "frames before it are kept"] {
        assert!(error.to_string().contains(words), "{words} in {error}");
    }
    let warnings = simulation.warnings().join("\n");
    assert!(warnings.contains("the forced substep is unstable") && warnings.contains("ask for"), "{warnings}");
}

#[test]
fn the_substeps_a_warning_asks_for_are_enough() {
    let mut scene = unstable();
    let mut simulation = build(&scene);
    let _ = simulation.run(48, &mut Kept::default());
    let warnings = simulation.warnings().join("\n");
    let asked: u32 = warnings.split("ask for ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    scene.time.substeps = Some(2 * asked); // burning makes the sheet lighter, which the first warning cannot know
    let mut simulation = build(&scene);
    simulation.run(1, &mut Kept::default()).unwrap();
    assert!(simulation.warnings().is_empty(), "{:?}", simulation.warnings());
}

#[test]
fn a_temperature_that_is_none_stops_the_run_though_it_is_a_number() {
    let mut scene = sheet(Shape::Unstructured, 0.05, 0.04, 0.004);
    scene.fire.heat_of_combustion = SpecificEnergy(1e12);
    scene.ignite.push(Ignite { corner: Some(Corner::BottomLeft), radius: Length(0.01), ..Ignite::default() });
    let mut simulation = build(&scene);
    let error = simulation.run(48, &mut Kept::default()).unwrap_err();
    let Error::NotFinite { field, ref cause, .. } = error else { panic!("{error}") };
    assert!(field == "temperature" || field == "peak_temperature", "{field}");
    assert!(cause.contains("fire.heat_of_combustion"), "{cause}");
}
