//! The two inner loops on a sheet of their own: `charcloth bench --kernels`.
//!
//! What is timed is what `run` does: `Integrator::advance` with damping, breakage alarms and a stiffness for each
//! spring; and whole frames of heat and fuel without motion. The sheet is an irregular rectangle whose points come in
//! random order, as those of a mesh file may; the program renumbers them.

use anyhow::Context;
use charcloth::effects::{Forces, SpringFactors};
use charcloth::generate;
use charcloth::integrators::{INTEGRATORS, Step};
use charcloth::kernels::VectorUnit;
use charcloth::layout;
use charcloth::mesh::SurfaceMesh;
use charcloth::random::Random;
use charcloth::scene::Scene;
use charcloth::sheet::SheetState;
use charcloth::simulation::{Inputs, Simulation};
use charcloth::units::{Length, Time};
use std::time::Instant;

/// Repetitions of each measurement.
const REPETITIONS: usize = 7;
/// Substeps of motion in one.
const SUBSTEPS: u32 = 64;
/// Steps of heat in one.
const HEAT_STEPS: u32 = 64;

/// Prints millions of springs and edges a second for each vector unit and number of threads.
pub fn report(nodes: usize, threads: &[usize]) -> anyhow::Result<String> {
    let (scene, inputs) = shuffled_sheet(nodes);
    let mut text = String::new();
    for count in threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(*count).build().context("cannot start threads")?;
        pool.install(|| -> anyhow::Result<()> {
            let simulation = Simulation::build(&scene, &inputs)?;
            if text.is_empty() {
                let state = simulation.state();
                text = format!(
                    "{} nodes in random order, {} springs, {} edges; median [best] of {REPETITIONS}\n",
                    state.motion.len(),
                    state.springs.len(),
                    state.burn_edges.len()
                );
            }
            for unit in VectorUnit::available() {
                let springs = springs(simulation.state(), &scene, unit, *count > 1);
                let heat = heat(&scene, &inputs, simulation.state(), unit)?;
                for (name, rate) in [("springs", springs), ("edges", heat)] {
                    let Rate { wall, processor } = rate;
                    let unit = format!("{unit:?}").to_lowercase();
                    text.push_str(&format!(
                        "RESULT charcloth {name} unit={unit} threads={count} wall={:.1} [{:.1}] cpu={:.1} [{:.1}] M{name}/s\n",
                        wall.0, wall.1, processor.0, processor.1
                    ));
                }
            }
            Ok(())
        })?;
    }
    Ok(text)
}

/// Millions a second, median and best: by the clock, and by the time the calling thread had a processor.
struct Rate {
    wall: (f64, f64),
    processor: (f64, f64),
}

/// A sheet of about so many nodes, its points in random order.
fn shuffled_sheet(nodes: usize) -> (Scene, Inputs) {
    let mut scene = Scene::default();
    let sheet = &mut scene.sheet;
    let spacing = (sheet.width.0 * sheet.height.0 / (nodes as f64 * 0.75f64.sqrt())).sqrt();
    let (width, height) = (sheet.width.0, sheet.height.0);
    sheet.spacing = Length(spacing);
    sheet.mesh = Some("shuffled".to_owned());
    scene.mechanics.strength.0 = 1e3;
    scene.time.step = Time(2e-3);
    scene.time.fps = 1.0 / (2e-3 * f64::from(HEAT_STEPS));
    let mesh = generate::rectangle(width, height, spacing, 1);
    let mut random = Random::new(1, 2);
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, (random.uniform() * (k + 1) as f64) as usize);
    }
    let mut mesh: SurfaceMesh = layout::renumbered(&mesh, &order);
    for point in &mut mesh.positions {
        point.z = 1e-5 * (random.uniform() - 0.5);
    }
    (scene, Inputs { mesh: Some(mesh), ..Inputs::default() })
}

fn springs(state: &SheetState, scene: &Scene, unit: VectorUnit, parallel: bool) -> Rate {
    let mut state = state.clone();
    let (springs, nodes) = (state.springs.len(), state.motion.len());
    let factors = SpringFactors {
        stiffness: vec![1.0; springs],
        tension: vec![0.0; springs],
        drag: vec![0.0; springs],
        ..SpringFactors::default()
    };
    let mut forces = Forces {
        force: vec![Default::default(); nodes],
        drag: (0..nodes).map(|i| scene.mechanics.damping.0 * state.mass(i)).collect(),
        air_mass: vec![0.0; nodes],
    };
    for i in 0..nodes {
        forces.force[i].y = -scene.gravity.0 * state.mass(i);
    }
    let step =
        Step { factors: &factors, forces: &forces, dt: 1e-4, substeps: Some(SUBSTEPS), topology: 0, unit, parallel };
    let mut integrator = (INTEGRATORS[0].item)(scene);
    measure(springs as f64 * f64::from(SUBSTEPS) * 1e-6, || {
        integrator.advance(&mut state, &step);
    })
}

fn heat(scene: &Scene, inputs: &Inputs, state: &SheetState, unit: VectorUnit) -> anyhow::Result<Rate> {
    let mut scene = scene.clone();
    scene.mechanics.moves = false;
    let mut state = state.clone();
    let mut random = Random::new(1, 3);
    // Under the ignition temperature throughout: every node conducts, and none burns.
    state.burn.temperature.iter_mut().for_each(|t| *t += 200.0 * random.uniform());
    let edges = state.burn_edges.len() as f64;
    let mut simulation = Simulation::resume(&scene, inputs, state)?;
    simulation.set_vector_unit(unit);
    Ok(measure(edges * f64::from(HEAT_STEPS) * 1e-6, || {
        simulation.advance_frame().expect("heat without fire stays finite")
    }))
}

/// Times a piece of work that does so many million things, often enough for clocks that tick in milliseconds.
fn measure(millions: f64, mut work: impl FnMut()) -> Rate {
    work();
    let rounds = (10.0 / millions).ceil().max(1.0);
    let (mut wall, mut processor) = (Vec::new(), Vec::new());
    for _ in 0..REPETITIONS {
        let (start, start_processor) = (Instant::now(), processor_time());
        (0..rounds as usize).for_each(|_| work());
        wall.push(start.elapsed().as_secs_f64() / rounds);
        processor.push((processor_time() - start_processor) / rounds);
    }
    let rate = |mut seconds: Vec<f64>| {
        seconds.sort_by(f64::total_cmp);
        (millions / seconds[REPETITIONS / 2], millions / seconds[0])
    };
    Rate { wall: rate(wall), processor: rate(processor) }
}

/// Time that this thread has had a processor [s]; 0 where the system does not say.
fn processor_time() -> f64 {
    let read = || -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
    };
    read().unwrap_or(0.0)
}
