//! Scenes by name or by path.

use anyhow::bail;
use charcloth::registry::{Entry, nearest};
use charcloth_io::scene_file::{Case, SceneFile, load, load_text};
use std::path::Path;

macro_rules! scenes {
    ($($name:literal: $about:literal;)*) => {
        &[$(Entry { name: $name, about: $about, item: include_str!(concat!("../../../scenes/", $name, ".toml")) }),*]
    };
}

/// The scenes of the repository's `scenes` folder: text by name, the same as the path there without its ending.
pub const SCENES: &[Entry<&str>] = scenes! {
    "a4": "a sheet of A4 paper hung by its top corners, lit at a lower corner";
    "shrink": "heat draws the sheet in: a hem that burns throws folds";
    "curl": "heat pushes along the normal: the burning lip curls over";
    "tear": "a stretched sheet, lit in the middle, tears along cracks";
    "flake": "uneven sheet in a draught: thick places come off and fly";
    "corner": "a sheet of office paper lit at a lower corner, by the physical model";
    "hole": "a level sheet of office paper lit from below in the middle";
    "match": "a strip of card, held at one end and lit at the other";
    "letter": "a sheet of office paper on a table, lit at an edge";
    "book": "leaves that are held at the spine and lit at the outer edge";
    "pile": "leaves that lie loosely on one another, lit along an edge";
    "wrapped": "tissue that hangs round a ball, lit at its hem";
    "crumpled": "a leaf of newspaper, crumpled to a ball and lit at its foot";
    "curtain": "a cotton cloth in a draught, lit at a lower corner";
    "papers": "strips of tissue, newsprint, cotton and office paper, up and down";
    "figure1": "the sketch's Figure 1: wireframe and picture of the same frame";
    "drape": "a napkin falls over a ball and onto the table";
    "fold": "a ribbon set down on its edge folds onto itself";
    "stack": "twenty sheets fall onto a table and each other";
    "hang": "a sheet without fire swings from two corners: the race of the integrators";
    "validation/ignition_time": "cotton under a radiant heater catches fire";
    "validation/mesh": "the speed of a flame on other meshes";
    "validation/moisture": "paper of 0 to 20 % moisture";
    "validation/roughness": "fronts a thousand nodes wide through paper that is cloudy";
    "validation/spread_direction": "flames up, down and along office paper";
    "validation/spread_downward": "flames burn down papers of 19 to 120 g/m2";
    "validation/spread_grammage": "office paper of 15 to 300 g/m2";
    "validation/spread_gravity": "tissue at 0.05 to 3.5 times normal gravity";
    "validation/spread_one_face": "flames on one face only";
    "validation/spread_oxygen": "tissue in 15 to 100 % of oxygen";
    "validation/spread_pressure": "tissue at 15 to 101 kPa";
    "verification/burn_out": "a node is out after m0/k1, and all heat is accounted for";
    "verification/catenary": "a strip of soft sheet hangs as a chain does";
    "verification/eigenmode_decay": "modes of conduction on a grid";
    "verification/elastica": "a clamped strip sags under its own weight";
    "verification/energy_decay": "a swinging sheet loses its energy to its drag";
    "verification/flame_downward": "a flame burns down tissue at the measured speed";
    "verification/friction": "a sheet on a slope slides or stays";
    "verification/front_direction": "front speed along an axis and along the diagonal of a grid";
    "verification/front_speed": "front speed for five thresholds and three spacings";
    "verification/front_speed_with_loss": "front speed with heat lost, and going out";
    "verification/heater": "a heater warms a sheet, which loses heat to still air";
    "verification/modulus": "a strip stretches under its own weight, along, across and between";
    "verification/momentum": "the pairwise thermal force keeps momentum, the literal one does not";
    "verification/order_of_convergence": "heat and motion are of first order in the step";
    "verification/pendulum": "period of a pendulum at 10, 45 and 90 degrees";
    "verification/resting_height": "a sheet comes to rest on a table";
    "verification/spring_chain_dispersion": "standing waves of a chain of springs";
    "verification/spring_period": "period of one spring";
    "verification/strip_frequency": "a clamped strip swings";
    "verification/strain_limit": "Provot's limit on deformation";
    "verification/terminal_velocity": "a level sheet falls through air";
};

/// Where the scenes lie that say what must come out.
pub const VERIFICATION: &str = "verification/";

/// The scene that is burnt where none is named.
pub const DEFAULT: &str = "a4";

/// Opens a scene: a file, or a built-in one by name.
pub fn open(scene: &str, overrides: &[String]) -> anyhow::Result<SceneFile> {
    let path = Path::new(scene);
    if !path.is_file() {
        if let Some(row) = SCENES.iter().find(|row| row.name == scene) {
            return Ok(load_text(row.name, row.item, overrides)?);
        }
        if path.is_dir() {
            bail!("{scene} is a folder; name a scene file, such as {}", path.join("scene.toml").display());
        }
        let is_like_a_path = scene.ends_with(".toml") || scene.contains(['/', '\\']);
        if !is_like_a_path {
            let names: Vec<&str> = SCENES.iter().map(|row| row.name).collect();
            let guess = nearest(scene, names.iter().copied()).map(|near| format!("did you mean {near}? "));
            bail!(
                "\"{scene}\" is neither a file nor a built-in scene; {}there are: {}",
                guess.unwrap_or_default(),
                names.join(", ")
            );
        }
    }
    Ok(load(path, overrides)?)
}

/// The one case to run: the named one, or the only one.
pub fn one_case(mut file: SceneFile, name: Option<&str>) -> anyhow::Result<Case> {
    let names: Vec<String> = file.cases.iter().map(|case| case.name.clone()).collect();
    let index = match name {
        Some(name) => names.iter().position(|there| there == name),
        None if names.len() == 1 => Some(0),
        None => None,
    };
    match (index, name) {
        (Some(index), _) => Ok(file.cases.swap_remove(index)),
        (None, Some(name)) => {
            bail!("{} has no case \"{name}\"; there are: {}", file.path.display(), names.join(", "))
        }
        (None, None) => {
            bail!("{} has several cases; choose one with --case: {}", file.path.display(), names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn collect(folder: &Path, prefix: &str, names: &mut BTreeSet<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy();
            if path.is_dir() {
                collect(&path, &format!("{prefix}{name}/"), names);
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                names.insert(format!("{prefix}{name}"));
            }
        }
    }

    #[test]
    fn the_folder_and_the_table_agree() {
        let mut folder = BTreeSet::new();
        collect(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")), "", &mut folder);
        let table: BTreeSet<String> = SCENES.iter().map(|row| row.name.to_owned()).collect();
        assert_eq!(folder, table);
        assert!(table.contains(DEFAULT));
    }

    #[test]
    fn every_built_in_scene_can_be_opened_from_anywhere() {
        for row in SCENES {
            for case in open(row.name, &[]).unwrap_or_else(|error| panic!("{error}")).cases {
                assert!(case.scene.sheet.mesh.is_none(), "{}: a built-in scene has no files beside it", row.name);
                assert!(!case.scene.about.is_empty(), "{}", row.name);
                let checks = row.name.starts_with(VERIFICATION);
                assert!(!checks || (case.has_checks() && case.falsified.is_some()), "{}: {}", row.name, case.name);
            }
        }
    }
}
