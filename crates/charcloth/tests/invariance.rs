//! A scene looks the same at any resolution.

mod common;

use charcloth::scene::{Ignite, Scene, Shape, Side};
use charcloth::sheet::SheetState;
use charcloth::units::*;
use common::{build, sheet};

/// Fuel over what the nominal grammage would give, at each node.
fn noise(state: &SheetState, grammage: f64) -> Vec<f64> {
    (0..state.burn.len()).map(|i| state.burn.fuel_initial[i] / (grammage * state.burn.area[i])).collect()
}

#[test]
fn fuel_varies_the_same_over_the_sheet_on_any_mesh() {
    // Without cockle: the field is one of space, and meshes would meet it at slightly different heights.
    let on = |shape, spacing| {
        let mut scene = sheet(shape, 0.06, 0.048, spacing);
        scene.sheet.cockle = Some(Length(0.0));
        build(&scene).state().clone()
    };
    let meshes =
        [(Shape::Grid, 0.006), (Shape::Grid, 0.003), (Shape::Unstructured, 0.006), (Shape::Unstructured, 0.003)]
            .map(|(shape, spacing)| on(shape, spacing));
    let fields = meshes.each_ref().map(|state| noise(state, 0.08));
    for (a, field) in meshes.iter().zip(&fields) {
        let (low, high) = field.iter().fold((f64::MAX, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(low < 0.95 && high > 1.05, "the field is not flat: {low} to {high}");
        let mut compared = 0;
        for (b, other) in meshes.iter().zip(&fields) {
            for i in 0..a.motion.len() {
                for j in 0..b.motion.len() {
                    if a.motion.rest_position[i].distance(b.motion.rest_position[j]) < 1e-9 {
                        compared += 1;
                        // Points differ by rounding, and the field changes over millimetres.
                        assert!((field[i] - other[j]).abs() < 1e-6, "{} and {}", field[i], other[j]);
                    }
                }
            }
        }
        assert!(compared > 4 * 30, "{compared} points are on both of two meshes");
    }
}

/// A strip that burns from its lower end up; nothing moves.
fn strip(spacing: f64) -> Scene {
    let mut scene = sheet(Shape::Unstructured, 0.036, 0.12, spacing);
    scene.mechanics.moves = false;
    scene.ignite.push(Ignite { edge: Some(Side::Bottom), ..Ignite::default() });
    // A front wide against every spacing here: heat runs 9 mm ahead of it, D/V, and fuel burns over 27 mm, V t.
    scene.fire.diffusivity = Diffusivity(8e-5);
    scene.fire.burn_time = Time(3.0);
    scene
}

#[test]
fn the_burnt_part_of_a_strip_grows_alike_at_every_spacing() {
    let runs: Vec<Vec<f64>> = [0.006, 0.004, 0.003]
        .into_iter()
        .map(|spacing| {
            let mut simulation = build(&strip(spacing));
            (0..120)
                .map(|_| {
                    simulation.advance_frame().unwrap();
                    simulation.summary().burnt_area_fraction
                })
                .collect()
        })
        .collect();
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let last = runs[2][119];
    assert!((0.1..0.9).contains(&last), "the front is on its way: {last}");
    // Linear elements are of second order: the speed of a front of width l = D/V is off by a part (h/l)^2 times a
    // twelfth for conduction, and about as much for fuel that catches fire a node at a time; a quarter allows for both.
    for (run, spacing) in runs.iter().zip([6.0, 4.0]) {
        let order = (f64::powi(spacing, 2) - 9.0) / 81.0;
        let off = distance(run, &runs[2]);
        assert!(off < 0.25 * order * last, "{spacing} mm: off by {off}");
    }
}
