//! What every row of the tables must do, whatever it is: one loop over each table.

mod common;

use charcloth::effects::conduction::conductances;
use charcloth::effects::{EFFECTS, Effect, ForceDerivatives, Forces, HeatRates, Now, SpringFactors};
use charcloth::frame::node_normals;
use charcloth::generate;
use charcloth::integrators::{INTEGRATORS, Step};
use charcloth::kernels::heat::ConductanceRow;
use charcloth::kernels::{Links, VectorUnit};
use charcloth::layout;
use charcloth::mesh::SurfaceMesh;
use charcloth::plume::Plume;
use charcloth::scene::{ConductionDistance, CurlLaw, Scene, Shape, ThermalForceLaw};
use charcloth::sheet::SheetState;
use charcloth::simulation::Simulation;
use charcloth::units::*;
use common::{build, disturb, relative_difference, sheet, shuffled, with_mesh};
use glam::{DMat3, DQuat, DVec3};
use std::collections::BTreeMap;

const AMBIENT: f64 = 293.15;

/// A small sheet with every effect switched on, once with each law of those that have several.
fn scenes() -> Vec<Scene> {
    let mut scene = sheet(Shape::Unstructured, 0.05, 0.04, 0.005);
    scene.fire.cooling_rate = Rate(0.5);
    scene.wind.velocity = [Speed(1.0), Speed(0.5), Speed(-2.0)];
    scene.wind.gust = Ratio(0.5);
    let mut other = scene.clone();
    other.curl.law = CurlLaw::Gradient;
    other.thermal_force.law = ThermalForceLaw::Literal;
    other.fire.distance = ConductionDistance::Current;
    vec![scene, other]
}

/// What an effect sees.
struct Stage {
    state: SheetState,
    normal: Vec<DVec3>,
    area: Vec<f64>,
    heat_links: Links,
    conductance: Vec<ConductanceRow>,
    plume: Plume,
}

impl Stage {
    fn of(scene: &Scene, mut state: SheetState, hottest: f64) -> Self {
        disturb(&mut state, AMBIENT, hottest);
        let heat_links = Links::build(state.burn.len(), &state.burn_edges.ends, |_| false);
        let mut conductance = Vec::new();
        conductances(&state, &heat_links, scene.fire.distance, &mut conductance);
        let normal = node_normals(&state.motion.position, &state.triangles);
        Self { normal, area: state.burn.area.clone(), heat_links, conductance, plume: Plume::default(), state }
    }

    fn now(&self) -> Now<'_> {
        Now {
            plume: &self.plume,
            state: &self.state,
            normal: &self.normal,
            area: &self.area,
            heat_links: &self.heat_links,
            conductance: &self.conductance,
            time: 0.123,
            up: DVec3::Y,
            unit: VectorUnit::best(),
            parallel: false,
        }
    }

    /// Everything an effect adds to buffers that are full of `before`, as vectors by node and by spring.
    fn added(&self, effect: &dyn Effect, before: f64) -> (Vec<DVec3>, Vec<DVec3>) {
        let (nodes, springs) = (self.state.motion.len(), self.state.springs.len());
        let full = |count| vec![before; count];
        let mut rates = HeatRates { within: full(nodes), lost: full(nodes) };
        let mut forces = Forces { force: vec![DVec3::splat(before); nodes], drag: full(nodes), air_mass: full(nodes) };
        let mut factors = SpringFactors {
            stiffness: vec![0.7; springs],
            tension: full(springs),
            drag: full(springs),
            ..SpringFactors::default()
        };
        let now = self.now();
        effect.add_heat(&now, &mut rates);
        effect.add_tension(&now, &mut factors);
        effect.add_forces(&now, &mut forces);
        assert!(factors.stiffness.iter().all(|s| *s == 0.7), "stiffness is not for effects to change");
        let heat = (0..nodes).map(|i| DVec3::new(rates.within[i], rates.lost[i], before));
        let drag = (0..nodes).map(|i| DVec3::new(forces.drag[i], forces.air_mass[i], before));
        let by_node = heat.chain(drag).chain(forces.force).map(|v| v - before).collect();
        let by_spring = (0..springs).map(|s| DVec3::new(factors.tension[s], factors.drag[s], before) - before);
        (by_node, by_spring.collect())
    }
}

/// Calls `test` with every effect that each scene switches on; every row of the table must be among them.
fn for_each_effect(test: impl Fn(&str, &Scene, &dyn Effect)) {
    let mut seen = Vec::new();
    for scene in scenes() {
        for row in EFFECTS {
            if let Some(effect) = (row.item)(&scene) {
                seen.push(row.name);
                test(row.name, &scene, effect.as_ref());
            }
        }
    }
    for row in EFFECTS {
        assert!(seen.contains(&row.name), "no scene here switches {} on", row.name);
    }
}

#[test]
fn effects_only_add() {
    for_each_effect(|name, scene, effect| {
        let stage = Stage::of(scene, build(scene).state().clone(), 1200.0);
        let (nodes, springs) = stage.added(effect, 0.0);
        assert!(nodes.iter().chain(&springs).any(|v| *v != DVec3::ZERO), "{name} does nothing here");
        for before in [1.0, -3.0] {
            let (onto_nodes, onto_springs) = stage.added(effect, before);
            for (a, b) in nodes.iter().chain(&springs).zip(onto_nodes.iter().chain(&onto_springs)) {
                // One rounding of the sum and one of taking `before` away again, a component.
                let rounding = 4.0 * f64::EPSILON * (before.abs() + a.length());
                assert!((*a - *b).length() <= rounding, "{name}: adds {a} to nothing and {b} to {before}");
            }
        }
    });
}

#[test]
fn effects_are_finite_in_the_cold_and_in_the_blaze() {
    for_each_effect(|name, scene, effect| {
        for hottest in [200.0, 3000.0] {
            let stage = Stage::of(scene, build(scene).state().clone(), hottest);
            let (nodes, springs) = stage.added(effect, 0.0);
            assert!(nodes.iter().chain(&springs).all(|v| v.is_finite()), "{name} at {hottest} K");
            assert!(effect.longest_step(&stage.now()) > 0.0, "{name} at {hottest} K");
        }
    });
}

#[test]
fn renumbering_the_nodes_renumbers_what_effects_add() {
    let mesh = generate::rectangle(0.05, 0.04, 0.005, 3);
    let order = shuffled(mesh.positions.len(), 5);
    let renumbered = layout::renumbered(&mesh, &order);
    for_each_effect(|name, scene, effect| {
        let stage = |mesh: &SurfaceMesh| {
            let (scene, inputs) = with_mesh(scene, mesh.clone());
            Stage::of(&scene, Simulation::build(&scene, &inputs).unwrap().state().clone(), 1200.0)
        };
        let (plain, other) = (stage(&mesh), stage(&renumbered));
        // Material points: by their number in the first mesh.
        let point_of = |stage: &Stage, i: usize| stage.state.motion.source[i] as usize;
        let point_of_other = |i: usize| order[point_of(&other, i)] as usize;
        let count = mesh.positions.len();
        let by_point = |values: &[DVec3], point: &dyn Fn(usize) -> usize| {
            let mut sorted = values.to_vec();
            for (k, value) in values.iter().enumerate() {
                sorted[k / count * count + point(k % count)] = *value;
            }
            sorted
        };
        let (nodes, springs) = plain.added(effect, 0.0);
        let (other_nodes, other_springs) = other.added(effect, 0.0);
        let a = by_point(&nodes, &|i| point_of(&plain, i));
        let b = by_point(&other_nodes, &point_of_other);
        // Sums over about ten neighbours of a node, taken in another order.
        let difference = relative_difference(a.into_iter(), b.into_iter());
        assert!(difference < 100.0 * f64::EPSILON, "{name}: nodes differ by {difference}");

        // Springs are known by their ends; what acts from the first end to the second turns round with them.
        let by_ends = |stage: &Stage, values: &[DVec3], point: &dyn Fn(usize) -> usize| {
            let springs = &stage.state.springs;
            let row = |s: usize| {
                let [i, j] = springs.ends[s].map(|i| point(i as usize));
                let turn = if i < j { 1.0 } else { -1.0 };
                ((springs.kind[s], i.min(j), i.max(j)), DVec3::new(values[s].x, turn * values[s].y, 0.0))
            };
            (0..springs.len()).map(row).collect::<BTreeMap<_, _>>()
        };
        let a = by_ends(&plain, &springs, &|i| point_of(&plain, i));
        let b = by_ends(&other, &other_springs, &point_of_other);
        assert!(a.keys().eq(b.keys()), "{name}: the springs are others");
        let difference = relative_difference(a.into_values(), b.into_values());
        assert!(difference < 100.0 * f64::EPSILON, "{name}: springs differ by {difference}");
    });
}

#[test]
fn force_derivatives_agree_with_finite_differences() {
    for_each_effect(|name, scene, effect| {
        let mut stage = Stage::of(scene, build(scene).state().clone(), 1200.0);
        let count = stage.state.motion.len();
        let mut derivatives =
            ForceDerivatives { by_position: vec![DMat3::ZERO; count], by_velocity: vec![DMat3::ZERO; count] };
        effect.add_force_derivatives(&stage.now(), &mut derivatives);
        let given = |by: &[DMat3]| by.iter().any(|m| *m != DMat3::ZERO);
        let force = |stage: &Stage, i: usize| {
            let mut forces =
                Forces { force: vec![DVec3::ZERO; count], drag: vec![0.0; count], air_mass: vec![0.0; count] };
            effect.add_forces(&stage.now(), &mut forces);
            forces.force[i] - forces.drag[i] * stage.state.motion.velocity[i]
        };
        for i in (0..count).step_by(count / 7) {
            for axis in 0..3 {
                let step = DVec3::AXES[axis] * 1e-3;
                for by_position in [true, false] {
                    let matrices = if by_position { &derivatives.by_position } else { &derivatives.by_velocity };
                    if by_position && !given(matrices) {
                        continue; // an effect may leave out how its force changes with the shape
                    }
                    let shift = |stage: &mut Stage, step: DVec3| {
                        let motion = &mut stage.state.motion;
                        (if by_position { &mut motion.position } else { &mut motion.velocity })[i] += step;
                    };
                    shift(&mut stage, step);
                    let after = force(&stage, i);
                    shift(&mut stage, -2.0 * step);
                    let before = force(&stage, i);
                    shift(&mut stage, step);
                    let difference = (after - before) / 2e-3;
                    let error = (difference - matrices[i].col(axis)).length();
                    // The forces are linear: what is left is the rounding of two forces over the step.
                    let rounding = 4.0 * f64::EPSILON * (after.length() + before.length()) / 2e-3;
                    assert!(error <= rounding + 1e-12 * difference.length(), "{name}: node {i}, axis {axis}: {error}");
                }
            }
        }
    });
}

/// A sheet at rest in each of the shapes, with a cockle: stress-free, but not flat.
fn sheets_at_rest() -> Vec<(Scene, SheetState)> {
    let with = |shape| {
        let mut scene = sheet(shape, 0.05, 0.04, 0.004);
        scene.sheet.radius = Length(0.02);
        scene.sheet.cockle = Some(Length(1e-3));
        scene.sheet.cockle_length = Length(0.126);
        let state = build(&scene).state().clone();
        (scene, state)
    };
    [Shape::Unstructured, Shape::Grid, Shape::Disc, Shape::Chain].map(with).into()
}

/// Advances a sheet without forces from outside by a hundredth of a second, with every integrator.
fn for_each_integrator(
    scene: &Scene,
    start: &SheetState,
    forces: DVec3,
    test: impl Fn(&str, &SheetState, &SheetState),
) {
    for row in INTEGRATORS {
        let mut state = start.clone();
        let springs = state.springs.len();
        let factors = SpringFactors {
            stiffness: vec![1.0; springs],
            tension: vec![0.0; springs],
            drag: vec![0.0; springs],
            triangle: vec![1.0; state.triangles.len()],
            ..SpringFactors::default()
        };
        let forces = Forces {
            force: vec![forces; state.motion.len()],
            drag: vec![0.0; state.motion.len()],
            air_mass: vec![0.0; state.motion.len()],
        };
        let unit = VectorUnit::best();
        let step =
            Step { factors: &factors, forces: &forces, dt: 2e-3, substeps: None, topology: 0, unit, parallel: false };
        let mut integrator = (row.item)(scene);
        for _ in 0..5 {
            integrator.advance(&mut state, &step);
        }
        test(row.name, start, &state);
    }
}

/// How far a sheet at rest may move: each spring's rest length is right to three roundings in single precision (its
/// stiffness, their product, the distance of its ends), they may add up along the sheet, and overshoot by as much. A
/// shell knows its rest curvature along the normal only; what of it lies in the surface goes with the square of the
/// slope, a sixth of the height (a cockle of 1 mm, of waves of 126 mm, 20 mm to a radian), times the height.
fn rest_tolerance(name: &str, state: &SheetState) -> f64 {
    let (low, high) = state.rest_bounds();
    let rounding = 2.0 * 3.0 * f64::from(f32::EPSILON) * (high - low).length();
    let height = high.z - low.z;
    if name == "implicit" { rounding + (height / 0.02).powi(2) / 36.0 * height } else { rounding }
}

#[test]
fn a_sheet_at_rest_stays_at_rest_wherever_it_is_and_however_it_is_turned() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    for (scene, rest) in sheets_at_rest() {
        for (turn, shift) in [(DQuat::IDENTITY, DVec3::ZERO), (turn, DVec3::ZERO), (turn, DVec3::new(3.0, -2.0, 1.0))] {
            let mut start = rest.clone();
            start.motion.position.iter_mut().for_each(|p| *p = turn * *p + shift);
            for_each_integrator(&scene, &start, DVec3::ZERO, |name, before, after| {
                let moved = before.motion.position.iter().zip(&after.motion.position);
                let farthest = moved.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                let tolerance = rest_tolerance(name, before);
                assert!(farthest <= tolerance, "{name}, {:?}: {farthest} over {tolerance}", scene.sheet.shape);
            });
        }
    }
}

#[test]
fn a_sheet_that_flies_keeps_its_speed_and_shape() {
    let speed = DVec3::new(0.7, -0.2, 0.4);
    for (scene, mut start) in sheets_at_rest() {
        start.motion.velocity.fill(speed);
        for_each_integrator(&scene, &start, DVec3::ZERO, |name, before, after| {
            let moved = before.motion.position.iter().zip(&after.motion.position);
            let off = moved.map(|(a, b)| (*b - *a - speed * 0.01).length()).fold(0.0, f64::max);
            let tolerance = rest_tolerance(name, before);
            assert!(off <= tolerance, "{name}, {:?}: {off} over {tolerance}", scene.sheet.shape);
        });
    }
}

#[test]
fn what_is_held_stays_where_it_is() {
    for (scene, mut start) in sheets_at_rest() {
        for i in (0..start.motion.len()).step_by(3) {
            start.motion.pinned[i] = 1;
        }
        start.motion.velocity.fill(DVec3::new(1.0, 2.0, 3.0));
        for_each_integrator(&scene, &start, DVec3::splat(1e-4), |name, before, after| {
            for i in (0..before.motion.len()).step_by(3) {
                // Positions are rounded to 2^-60 m, or to what f64 has where that is more.
                let moved = before.motion.position[i].distance(after.motion.position[i]);
                assert!(moved <= 2.0 * f64::EPSILON * 0.05, "{name}: node {i} has moved by {moved}");
                assert_eq!(after.motion.velocity[i], DVec3::ZERO, "{name}: node {i}");
            }
            assert_ne!(before.motion.position[1], after.motion.position[1], "{name}: the others move");
        });
    }
}

#[test]
fn springs_conserve_momentum_and_the_limit_does_not_move_the_middle() {
    for (mut scene, mut start) in sheets_at_rest() {
        // A tenth beyond the deformation limit at the start, so that the limit is at work.
        scene.mechanics.deformation_limit = Ratio(0.02);
        for i in 0..start.motion.len() {
            let p = start.motion.rest_position[i] * 300.0;
            start.motion.velocity[i] = DVec3::new(p.y.sin(), p.x.cos(), (p.x + p.y).sin());
            start.motion.position[i] *= DVec3::new(1.022, 1.0, 1.0);
        }
        let momentum = |state: &SheetState| charcloth::measure::momentum(state);
        let size = |state: &SheetState| {
            (0..state.motion.len()).map(|i| state.motion.velocity[i].length() * state.mass(i)).sum::<f64>()
        };
        let mass: f64 = (0..start.motion.len()).map(|i| start.mass(i)).sum();
        let middle = |state: &SheetState| {
            (0..state.motion.len()).map(|i| state.motion.position[i] * state.mass(i)).sum::<DVec3>() / mass
        };
        for_each_integrator(&scene, &start, DVec3::ZERO, |name, before, after| {
            let change = (momentum(after) - momentum(before)).length();
            // The force on a node is the sum of about a dozen links in single precision; over the steps each node
            // trades its whole momentum a hundred times at most.
            let tolerance = 12.0 * f64::from(f32::EPSILON) / 2.0 * 100.0 * size(before);
            assert!(change <= tolerance, "{name}, {:?}: {change} over {tolerance}", scene.sheet.shape);
            let way = middle(after) - middle(before) - momentum(before) / mass * 0.01;
            let tolerance = tolerance / mass * 0.01;
            assert!(way.length() <= tolerance, "{name}, {:?}: {} over {tolerance}", scene.sheet.shape, way.length());
        });
    }
}
