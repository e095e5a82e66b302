//! Paper is never perfectly flat: cockle is on where nobody says otherwise, of the size the material says, and frozen in.

mod common;

use charcloth::mesh::SurfaceMesh;
use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::scene_file::load_text;
use common::NoFiles;
use glam::DVec3;

/// Office paper that floats: nothing pulls on it.
const SCENE: &str = r#"
model = "physical"
gravity = 0
[sheet]
width = "120 mm"
height = "120 mm"
spacing = "5 mm"
[time]
frames = 4
step = "10 ms"
"#;

fn build(overrides: &[&str], mesh: Option<SurfaceMesh>) -> Simulation {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let mut case = load_text("float", SCENE, &overrides).unwrap_or_else(|error| panic!("{error}")).cases.remove(0);
    let (inputs, _) = case.read_inputs(&NoFiles).unwrap_or_else(|error| panic!("{error}"));
    if mesh.is_some() {
        case.scene.sheet.mesh = Some("sheet".to_owned());
        // A scene file that names a mesh takes no cockle from its material.
        if !overrides.iter().any(|it| it.contains("cockle")) {
            case.scene.sheet.cockle = None;
        }
    }
    Simulation::build(&case.scene, &Inputs { mesh, ..inputs }).unwrap_or_else(|error| panic!("{error}"))
}

/// Standard deviation of the height.
fn height(simulation: &Simulation) -> f64 {
    let position = &simulation.state().motion.position;
    let mean = position.iter().map(|p| p.z).sum::<f64>() / position.len() as f64;
    (position.iter().map(|p| (p.z - mean).powi(2)).sum::<f64>() / position.len() as f64).sqrt()
}

#[test]
fn sheets_are_cockled_by_their_material_unless_told_otherwise() {
    // 0.1 mm less the waves under 20 mm, a third of them; over some thirty patches of independent height.
    let paper = height(&build(&[], None));
    assert!((0.05e-3..0.12e-3).contains(&paper), "{paper}");
    let card = height(&build(&["sheet.material=card_200"], None));
    assert!(card > 0.0 && card < 0.7 * paper, "{card} of card, {paper} of paper");
    let grid = height(&build(&["sheet.shape=grid"], None));
    assert!((0.05e-3..0.12e-3).contains(&grid), "{grid}");
    assert_eq!(height(&build(&["sheet.cockle=0"], None)), 0.0);
    assert_ne!(height(&build(&["seed=2"], None)), paper, "another seed, another sheet");
}

#[test]
fn a_mesh_from_a_file_is_meant_as_it_is() {
    let flat = build(&["sheet.cockle=0"], None);
    let state = flat.state();
    let mesh = SurfaceMesh {
        positions: state.motion.position.clone(),
        triangles: state.triangles.corners.clone(),
        shell: vec![0; state.triangles.len()],
        source_face: (0..state.triangles.len() as u32).collect(),
        ..SurfaceMesh::default()
    };
    assert_eq!(height(&build(&[], Some(mesh.clone()))), 0.0);
    let asked = height(&build(&["sheet.cockle=0.1mm"], Some(mesh)));
    assert!((0.05e-3..0.12e-3).contains(&asked), "{asked}");
}

#[test]
fn cockle_is_frozen_in() {
    let mut sheet = build(&[], None);
    let before: Vec<DVec3> = sheet.state().motion.position.clone();
    (0..4).for_each(|_| sheet.advance_frame().unwrap_or_else(|error| panic!("{error}")));
    let after = &sheet.state().motion.position;
    let farthest = before.iter().zip(after).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    // The rest curvature is known along the normal; what of it lies in the surface is a slope squared of the height.
    assert!(farthest < 2e-6, "a sheet that nothing acts on moved by {farthest} m; its cockle is {} m", height(&sheet));
}
