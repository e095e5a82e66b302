//! Sheets that shrink on one face bend as two layers do.

mod common;

use charcloth::frame::node_normals;
use charcloth::scene::{Region, Shape};
use charcloth::sheet::SheetState;
use charcloth::units::*;
use common::{Settler, build, sheet};
use glam::{DVec2, DVec3};

/// A strip clamped at its left end that settles under a curvature without force along its length [1/m]; the turn of its
/// normal from one end of its free part to the other, over the length, is the curvature it takes.
fn settled_curvature(free: f64) -> f64 {
    let mut scene = sheet(Shape::Grid, 0.04, 0.006, 0.001);
    scene.gravity = Acceleration(0.0);
    scene.mechanics.integrator = "implicit".to_owned();
    scene.shell.poisson = Ratio(0.0);
    scene.shell.machine_direction = Angle(0.0);
    let hold = Region { low: [-1.0, -1.0, -1.0].map(Length), high: [Length(-0.0179), Length(1.0), Length(1.0)] };
    scene.pin.push(charcloth::scene::Pin { region: Some(hold), ..Default::default() });
    let mut state: SheetState = build(&scene).state().clone();
    let mut settler = Settler::new(&scene, &state, 2e-5);
    for k in 0..400 {
        // Slowly, or it rolls up and catches on another shape.
        settler.factors.free_curvature.fill(DVec2::new(free * (f64::from(k) / 200.0).min(1.0), 0.0));
        settler.advance(&mut state);
    }
    let normals = node_normals(&state.motion.position, &state.triangles);
    let near = |x: f64| {
        let distance = |i: &usize| (state.motion.rest_position[*i] - DVec3::new(x, 0.0, 0.0)).length();
        (0..state.motion.len()).min_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap()
    };
    let (from, to) = (near(-0.010), near(0.010));
    let turn = normals[from].cross(normals[to]).y.atan2(normals[from].dot(normals[to]));
    -turn / (state.motion.rest_position[to].x - state.motion.rest_position[from].x)
}

#[test]
fn a_strip_takes_the_curvature_of_its_faces_towards_the_one_that_shrinks_and_the_mirror_image_for_the_other() {
    // Eq. 15.6: a difference of 0.2 % between two layers of 0.05 mm, as of a sheet dried on its front.
    let free = 1.5 * 0.002 / 1e-4;
    let curvature = settled_curvature(free);
    assert!((curvature / free - 1.0).abs() < 0.03, "{curvature} instead of {free}");
    let mirrored = settled_curvature(-free);
    assert!((curvature + mirrored).abs() < 1e-6 * free, "{curvature} and {mirrored}");
}
