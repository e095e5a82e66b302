//! The inner loops against themselves on other vector units and numbers of threads, and against slow obvious ones.

use charcloth::build;
use charcloth::effects::conduction::conductances;
use charcloth::effects::{Forces, SpringFactors};
use charcloth::integrators::{Advanced, INTEGRATORS, Step};
use charcloth::kernels::heat::conduct;
use charcloth::kernels::{LANES, Links, VectorUnit};
use charcloth::random::Random;
use charcloth::scene::{ConductionDistance, Scene};
use charcloth::sheet::{SheetState, SpringKind};
use charcloth::simulation::Inputs;
use charcloth::units::Length;
use glam::DVec3;

/// A crumpled, moving, partly warm sheet of irregular triangles with every ninth spring broken and some nodes pinned.
fn crumpled(spacing: f64) -> (Scene, SheetState) {
    let mut scene = Scene::default();
    scene.sheet.spacing = Length(spacing);
    scene.mechanics.strength.0 = 5.0;
    let mut state = build::sheet(&scene, &Inputs::default()).unwrap().state;
    let mut random = Random::new(7, 7);
    let mut any = |size: f64| {
        let mut component = || size * (2.0 * random.uniform() - 1.0);
        DVec3::new(component(), component(), component())
    };
    for i in 0..state.motion.len() {
        state.motion.position[i] += any(0.05 * spacing);
        state.motion.velocity[i] = any(0.1);
        state.motion.pinned[i] = u8::from(i % 97 == 0);
        state.burn.temperature[i] = 400.0 + any(100.0).x;
    }
    for s in (0..state.springs.len()).step_by(9) {
        state.springs.broken[s] = 1;
    }
    assert_ne!(state.motion.len() % LANES, 0, "the last slice should be part empty");
    (scene, state)
}

/// Stiffness, tension and drag of every spring, and weight and drag of every node.
fn loads(state: &SheetState) -> (SpringFactors, Forces) {
    let mut random = Random::new(8, 8);
    let springs = state.springs.len();
    let factors = SpringFactors {
        stiffness: (0..springs).map(|_| 0.5 + 0.5 * random.uniform()).collect(),
        tension: (0..springs).map(|_| 1e-4 * random.uniform()).collect(),
        drag: (0..springs).map(|_| 1e-5 * random.normal()).collect(),
        ..SpringFactors::default()
    };
    let nodes = 0..state.motion.len();
    let forces = Forces {
        force: nodes.clone().map(|i| DVec3::NEG_Y * 9.81 * state.mass(i)).collect(),
        drag: nodes.clone().map(|i| 3.0 * state.mass(i)).collect(),
        air_mass: vec![0.0; nodes.len()],
    };
    (factors, forces)
}

fn advance(
    scene: &Scene,
    state: &mut SheetState,
    unit: VectorUnit,
    parallel: bool,
    substeps: u32,
    dt: f64,
) -> Advanced {
    let (factors, forces) = loads(state);
    let step = Step { factors: &factors, forces: &forces, dt, substeps: Some(substeps), topology: 0, unit, parallel };
    (INTEGRATORS[0].item)(scene).advance(state, &step)
}

fn threads(count: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap()
}

#[test]
fn every_vector_unit_moves_the_sheet_to_the_same_bit() {
    let (scene, start) = crumpled(0.006);
    let mut reference = start.clone();
    let expected = advance(&scene, &mut reference, VectorUnit::Portable, false, 40, 2e-4);
    assert!(expected.broken > 0, "the test should break springs on the way");
    assert_ne!(reference.motion.position, start.motion.position);
    for unit in VectorUnit::available() {
        let mut state = start.clone();
        assert_eq!(advance(&scene, &mut state, unit, false, 40, 2e-4), expected, "{unit:?}");
        for i in 0..state.motion.len() {
            assert_eq!(state.motion.position[i], reference.motion.position[i], "{unit:?}: position of node {i}");
            assert_eq!(state.motion.velocity[i], reference.motion.velocity[i], "{unit:?}: velocity of node {i}");
        }
        assert_eq!(state.hash(), reference.hash(), "{unit:?}");
    }
}

#[test]
fn two_threads_move_the_sheet_to_the_same_bit_as_one() {
    // Enough nodes that the integrator shares the work.
    let (scene, start) = crumpled(0.0013);
    assert!(start.motion.len() > 40_000);
    let hashes = [1, 2, 3].map(|count| {
        let mut state = start.clone();
        threads(count).install(|| advance(&scene, &mut state, VectorUnit::best(), count > 1, 4, 4e-6));
        state.hash()
    });
    assert_eq!(hashes, [hashes[0]; 3]);
}

#[test]
fn one_substep_agrees_with_a_loop_over_springs() {
    let (mut scene, start) = crumpled(0.008);
    // No limit and no breakage: one substep of Eq. 6.6 and nothing else.
    scene.mechanics.deformation_limit.0 = 0.0;
    scene.mechanics.strength.0 = 0.0;
    let mut start = start;
    start.springs.strength.fill(0.0);
    let dt = 1e-5;
    let (factors, forces) = loads(&start);
    let mut force = forces.force.clone();
    let mut size = vec![0.0f64; start.motion.len()];
    for s in 0..start.springs.len() {
        if start.springs.broken[s] != 0 {
            continue;
        }
        let [i, j] = start.springs.ends[s].map(|i| i as usize);
        let held = |k: usize| start.motion.pinned[k] != 0;
        let velocity = |k: usize| if held(k) { DVec3::ZERO } else { start.motion.velocity[k] };
        let apart = start.motion.position[j] - start.motion.position[i];
        let (length, along) = (apart.length(), apart.normalize());
        let stiffness = start.springs.stiffness[s] * factors.stiffness[s];
        let damping = stiffness * scene.mechanics.spring_damping.0 * (velocity(j) - velocity(i)).dot(along);
        let pull = stiffness * (length - start.springs.rest_length[s]) + factors.tension[s] + damping;
        force[i] += (pull + factors.drag[s]) * along;
        force[j] -= (pull - factors.drag[s]) * along;
        // What rounding acts on: the force is a difference of K l and K L.
        let terms = 2.0 * stiffness * length + pull.abs();
        size[i] += terms;
        size[j] += terms;
    }
    let mut state = start.clone();
    advance(&scene, &mut state, VectorUnit::best(), false, 1, dt);
    for i in 0..state.motion.len() {
        if start.motion.pinned[i] != 0 {
            assert_eq!(state.motion.position[i], start.motion.position[i]);
            continue;
        }
        let mass = start.mass(i);
        let keep = 1.0 / (1.0 + dt * forces.drag[i] / mass);
        let velocity = (start.motion.velocity[i] + force[i] * (dt / mass)) * keep;
        let position = start.motion.position[i] + velocity * dt;
        // Some ten roundings to f32 in each term of the sum.
        let rounding = 10.0 * f64::from(f32::EPSILON) * size[i] * dt / mass;
        let error = state.motion.velocity[i].distance(velocity);
        assert!(error <= rounding, "velocity of node {i}: {error} over {rounding}");
        assert!(state.motion.position[i].distance(position) <= rounding * dt + 1e-16, "position of node {i}");
    }
}

#[test]
fn a_sheet_that_outgrows_the_grid_still_moves_the_same_on_every_unit() {
    // One spring lets go of everything: the ends part at a kilometre a second.
    let (mut scene, start) = crumpled(0.02);
    scene.mechanics.deformation_limit.0 = 0.0;
    let mut start = start;
    start.springs.strength.fill(0.0);
    let far = start.motion.len() / 2;
    for s in 0..start.springs.len() {
        start.springs.stiffness[s] = 1e-9;
        assert!(start.springs.kind[s] <= SpringKind::Flexion as u8);
    }
    start.motion.pinned[far] = 0;
    start.motion.velocity[far] = DVec3::new(0.0, 0.0, 1000.0);
    let states = VectorUnit::available().into_iter().map(|unit| {
        let mut state = start.clone();
        advance(&scene, &mut state, unit, false, 1000, 1e-2);
        state
    });
    let states: Vec<SheetState> = states.collect();
    assert!(states.iter().all(|s| s.hash() == states[0].hash()));
    // Nothing holds it back but drag of 3/s: v0 (1 - exp(-3 t))/3, to first order in the substep.
    let way = states[0].motion.position[far].z - start.motion.position[far].z;
    assert!((way / (1000.0 * (1.0 - (-0.03f64).exp()) / 3.0) - 1.0).abs() < 1e-3, "{way}");
}

#[test]
fn every_vector_unit_conducts_the_same_bits_and_agrees_with_a_loop_over_edges() {
    let (_, state) = crumpled(0.005);
    let edges = &state.burn_edges;
    let links = Links::build(state.burn.len(), &edges.ends, |e| e % 11 == 0);
    let mut rows = Vec::new();
    conductances(&state, &links, ConductionDistance::Current, &mut rows);
    let temperature = &state.burn.temperature;
    let heat = |unit: VectorUnit, parallel: bool| {
        let mut heat = vec![0.25; temperature.len()];
        conduct(&links, &rows, temperature, &mut heat, unit, parallel);
        heat
    };
    let expected = heat(VectorUnit::Portable, false);
    for unit in VectorUnit::available() {
        assert_eq!(heat(unit, false), expected, "{unit:?}");
        assert_eq!(threads(2).install(|| heat(unit, true)), expected, "{unit:?} on two threads");
    }
    let mut slow = vec![0.25; temperature.len()];
    let mut size = vec![1.0f64; temperature.len()];
    for e in (0..edges.len()).filter(|e| e % 11 != 0) {
        let [i, j] = edges.ends[e].map(|i| i as usize);
        let distance = state.motion.position[i].distance(state.motion.position[j]).max(0.1 * edges.rest_distance[e]);
        let flow = edges.conductance_length[e] / distance * (temperature[j] - temperature[i]);
        slow[i] += flow;
        slow[j] -= flow;
        size[i] += flow.abs();
        size[j] += flow.abs();
    }
    for i in 0..slow.len() {
        // Ten or so f64 roundings of terms of this size.
        assert!(
            (slow[i] - expected[i]).abs() <= 16.0 * f64::EPSILON * size[i],
            "node {i}: {} {}",
            slow[i],
            expected[i]
        );
    }
}
