//! A sheet that is animated already burns: exactly where its motion has it, or drawn to it and let go where it has burnt.

mod common;

use charcloth::effects::Forces;
use charcloth::mesh::SurfaceMesh;
use charcloth::motion::{Guide, MeshSequence};
use charcloth::scene::LengthUnit;
use charcloth::simulation::{GreyImage, Inputs, Simulation};
use charcloth_io::importers::read_mesh;
use charcloth_io::mesh_sequence;
use charcloth_io::scene_file::{Case, Loader, load};
use common::Folder;
use glam::{DMat3, DVec3};
use std::fmt::Write;
use std::path::Path;

const COLUMNS: usize = 9;
const MESHES: usize = 6;

/// Where a point of mesh `k` is: the sheet swings about its upper edge.
fn place(i: usize, k: usize) -> DVec3 {
    let (x, y) = ((i % COLUMNS) as f64 * 0.003, (i / COLUMNS) as f64 * 0.003);
    let down = 0.024 - y;
    let angle = 0.1 * (k as f64).powi(2) / 5.0;
    DVec3::new(x, 0.024 - down * angle.cos(), down * angle.sin())
}

fn obj(k: usize) -> String {
    let mut text = String::from("# a point that no face uses comes first\nv 9 9 9\n");
    for i in 0..COLUMNS * COLUMNS {
        let p = place(i, k) * 1000.0;
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for j in 0..COLUMNS - 1 {
        for i in 0..COLUMNS - 1 {
            let a = j * COLUMNS + i + 2;
            writeln!(text, "f {} {} {} {}", a, a + 1, a + 1 + COLUMNS, a + COLUMNS).unwrap();
        }
    }
    text
}

fn folder(name: &str, follow: &str) -> Folder {
    let folder = Folder::new(name);
    std::fs::create_dir(folder.0.join("swing")).unwrap();
    for k in 0..MESHES {
        folder.file(&format!("swing/sheet_{:04}.obj", k + 8), obj(k));
    }
    let scene = format!(
        r#"
model = "physical"
sheet = {{ material = "tissue", unit = "mm", burn_level = 1 }}
motion = {{ files = "swing", fps = 24, follow = "{follow}" }}
time = {{ frames = 12, step = "4 ms" }}
wind.coefficient = 0.1
[[pin]]
edge = "top"
[[ignite]]
corner = "bottom_left"
radius = "6 mm"
length = "0.3 s"
"#
    );
    folder.file("scene.toml", scene);
    folder
}

/// Reads from the disk.
struct Disk;

impl Loader for Disk {
    fn mesh(&self, path: &Path, unit: LengthUnit) -> Result<SurfaceMesh, String> {
        read_mesh(path, unit).map_err(|error| error.to_string())
    }
    fn image(&self, _: &Path) -> Result<GreyImage, String> {
        Err("there are no pictures here".to_owned())
    }
}

fn open(folder: &Folder, overrides: &[&str]) -> (Case, Inputs) {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let file = load(&folder.0.join("scene.toml"), &overrides).unwrap_or_else(|error| panic!("{error}"));
    let case = file.cases.into_iter().next().unwrap();
    let (inputs, _) = case.read_inputs(&Disk).unwrap_or_else(|error| panic!("{error}"));
    (case, inputs)
}

fn advance(simulation: &mut Simulation, frames: u32) {
    (0..frames).for_each(|_| simulation.advance_frame().unwrap_or_else(|error| panic!("{error}")));
}

#[test]
fn a_sheet_that_follows_exactly_is_where_its_meshes_are_and_burns() {
    let folder = folder("exactly", "exactly");
    let (case, inputs) = open(&folder, &[]);
    let mut simulation = Simulation::build(&case.scene, &inputs).unwrap();
    for k in 0..MESHES + 2 {
        let motion = &simulation.state().motion;
        for i in 0..motion.len() {
            let expected = place(motion.source[i] as usize, k.min(MESHES - 1));
            let error = motion.position[i].distance(expected);
            assert!(error < 1e-9, "mesh {k}, node {i}: {error}");
        }
        if k == 2 {
            // Where the slopes of both sides meet, the velocity is the central difference of the meshes.
            for i in 0..motion.len() {
                let source = motion.source[i] as usize;
                let central = (place(source, 3) - place(source, 1)) * 12.0;
                assert!(motion.velocity[i].distance(central) < 1e-6, "node {i}");
            }
        }
        advance(&mut simulation, 1);
    }
    let (mut halfway, _) = (Simulation::build(&case.scene, &inputs).unwrap(), ());
    advance(&mut halfway, 3);
    let mut resumed = Simulation::resume(&case.scene, &inputs, halfway.state().clone()).unwrap();
    advance(&mut resumed, MESHES as u32 + 2 - 3);
    assert_eq!(resumed.state().hash(), simulation.state().hash());
    let summary = simulation.summary();
    assert!(summary.fuel_burnt_kg > 0.01 * summary.fuel_initial_kg, "{} kg burnt", summary.fuel_burnt_kg);
    assert!(summary.mass_error < 1e-11 && summary.energy_error.unwrap() < 1e-11);
}

#[test]
fn a_sheet_that_is_drawn_goes_with_its_motion_until_the_pull_ends() {
    let folder = folder("drawn", "drawn");
    let off = |overrides: &[&str]| {
        let (case, inputs) = open(&folder, overrides);
        let mut simulation = Simulation::build(&case.scene, &inputs).unwrap();
        advance(&mut simulation, 10);
        let motion = &simulation.state().motion;
        let distance = |i: usize| motion.position[i].distance(place(motion.source[i] as usize, MESHES - 1));
        (0..motion.len()).map(distance).fold(0.0, f64::max)
    };
    let (drawn, free) = (off(&["ignite=[]"]), off(&["ignite=[]", "motion.key=[{ time = 0, pull = 0 }]"]));
    assert!(drawn < 0.5e-3, "{drawn} m off its motion");
    assert!(free > 4e-3, "without the pull it is {free} m off");
    let (case, inputs) = open(&folder, &[]);
    let run = |halt: Option<u32>| {
        let mut simulation = Simulation::build(&case.scene, &inputs).unwrap();
        let halt = halt.unwrap_or(10);
        advance(&mut simulation, halt);
        let mut simulation = Simulation::resume(&case.scene, &inputs, simulation.state().clone()).unwrap();
        advance(&mut simulation, 10 - halt);
        simulation.state().hash()
    };
    assert_eq!(run(None), run(Some(4)), "bits after a resumption");
}

/// A tray of four triangles rises by 2 mm a mesh, then bulges by 5 mm in its middle, under a sheet that rests on it.
#[test]
fn an_obstacle_that_bends_lifts_the_sheet_on_it() {
    let folder = Folder::new("tray");
    std::fs::create_dir(folder.0.join("tray")).unwrap();
    for k in 0..5u32 {
        let (rim, middle) = (2.0 * f64::from(k.min(3)), if k < 4 { 2.0 * f64::from(k) } else { 11.0 });
        let corners = [[-30, -30], [30, -30], [30, 30], [-30, 30]].map(|[x, z]| format!("v {x} {rim} {z}\n")).concat();
        let faces = "f 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n";
        folder.file(&format!("tray/tray_{k:02}.obj"), format!("{corners}v 0 {middle} 0\n{faces}"));
    }
    folder.file(
        "scene.toml",
        r#"
thermal_force.law = "off"
curl.law = "off"
sheet = { shape = "grid", width = "40 mm", height = "40 mm", spacing = "5 mm", pose = "lying", position = [0, "1 mm", 0], cockle = 0, variation = { noise = 0 } }
mechanics = { integrator = "implicit", damping = 5.0 }
shell = { modulus_along = "20 MPa", modulus_across = "20 MPa" }
time = { frames = 12, step = "7 ms" }
[[obstacle]]
shape = "mesh"
files = "tray"
unit = "mm"
fps = 12
"#,
    );
    let (case, inputs) = open(&folder, &[]);
    assert_eq!(inputs.obstacle_motions.len(), 1);
    let mut simulation = Simulation::build(&case.scene, &inputs).unwrap();
    advance(&mut simulation, 12);
    let (heights, summary) = (simulation.state().motion.position.iter().map(|p| p.y), simulation.summary());
    let (lowest, highest) =
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
    assert!(highest > 11e-3, "it rests at {highest} m on a tray whose middle is at 11 mm");
    assert!(lowest > 6e-3, "{lowest} m is below the rim");
    assert_eq!((summary.intersecting_pairs_max, summary.passed_through), (Some(0), Some(0)));
    folder.file("tray/tray_04.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
    let file = load(&folder.0.join("scene.toml"), &[]).unwrap();
    let text = file.cases[0].read_inputs(&Disk).map(|_| ()).unwrap_err().to_string();
    assert!(text.contains("tray_04.obj") && text.contains("scene.toml:10"), "{text}");
}

#[test]
fn what_has_burnt_or_come_off_is_let_go() {
    let folder = folder("let_go", "drawn");
    let (case, inputs) = open(&folder, &[]);
    let simulation = Simulation::build(&case.scene, &inputs).unwrap();
    let mut state = simulation.state().clone();
    let moved = inputs.motion.clone().unwrap().meshes.swap_remove(MESHES - 1);
    let sequence = MeshSequence { meshes: vec![moved] };
    let mut guide = Guide::of(&case.scene, sequence, (DMat3::IDENTITY, DVec3::ZERO), 1);
    let mut pull = |state: &_, topology| {
        let mut forces = Forces { force: vec![DVec3::ZERO; 81], drag: vec![0.0; 81], air_mass: vec![0.0; 81] };
        guide.pull(state, &mut forces, [0.0, 0.004], topology);
        forces.force.iter().map(|force| force.length()).collect::<Vec<f64>>()
    };
    let whole = pull(&state, 0);
    let free: Vec<usize> = (0..81).filter(|i| state.motion.pinned[*i] == 0).collect();
    assert!(free.iter().all(|i| whole[*i] > 0.0));
    for i in &free {
        let burn_node = state.burn_node(*i);
        state.burn.stiffness[burn_node] = if i % 2 == 0 { 0.0 } else { 0.5 };
    }
    let burnt = pull(&state, 0);
    for i in &free {
        let expected = if i % 2 == 0 { 0.0 } else { 0.5 * whole[*i] };
        assert!((burnt[*i] - expected).abs() <= 1e-12 * whole[*i], "node {i}");
    }
    let piece = state.triangles.corners[0];
    state.triangles.piece[0] = 1;
    let cut = pull(&state, 1);
    assert!(piece.iter().all(|i| cut[*i as usize] == 0.0), "what has come off is not pulled");
    assert!(cut.iter().sum::<f64>() > 0.0);
}

#[test]
fn sequences_that_do_not_fit_are_told_by_the_file() {
    let error = |folder: &Folder| {
        let path = folder.0.join("swing");
        mesh_sequence::files(&path).and_then(|files| mesh_sequence::read(&path, &files[0], LengthUnit::M)).unwrap_err()
    };
    let gap = folder("gap", "exactly");
    std::fs::remove_file(gap.0.join("swing/sheet_0010.obj")).unwrap();
    let text = error(&gap).to_string();
    assert!(text.contains("number 10 is missing"), "{text}");
    let fewer = folder("fewer", "exactly");
    fewer.file("swing/sheet_0010.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let text = error(&fewer).to_string();
    assert!(text.contains("sheet_0010.obj") && text.contains("3 points and 1 faces"), "{text}");
    let other = folder("other", "exactly");
    let swapped = obj(2).replace("f 2 3 12 11\n", "f 3 2 12 11\n");
    assert_ne!(swapped, obj(2));
    other.file("swing/sheet_0010.obj", swapped);
    let text = error(&other).to_string();
    assert!(text.contains("joined otherwise"), "{text}");
    std::fs::remove_dir_all(gap.0.join("swing")).unwrap();
    let text = load(&gap.0.join("scene.toml"), &[]).map(|_| ()).unwrap_err().to_string();
    assert!(text.contains("scene.toml:4") && text.contains("swing"), "{text}");
}
