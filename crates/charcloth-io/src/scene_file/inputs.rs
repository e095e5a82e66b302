//! What a scene names but does not hold: meshes and pictures.

use super::diagnostic::{Diagnostic, SceneError};
use super::tree::{Node, Place};
use super::{Case, File, Origin};
use crate::importers::{UNITS, coarse, likely_unit};
use crate::material_file::{self, MATERIALS};
use crate::mesh_sequence;
use charcloth::material::Material;
use charcloth::mesh::SurfaceMesh;
use charcloth::motion::MeshSequence;
use charcloth::registry::nearest;
use charcloth::scene::{LengthUnit, Model, Paint, PaintedGain, Scene};
use charcloth::sheet::bounds;
use charcloth::simulation::{GreyImage, Inputs};
use std::io;
use std::path::Path;

/// Reads meshes and pictures.
pub trait Loader {
    /// Reads a mesh and turns it to metres.
    fn mesh(&self, path: &Path, unit: LengthUnit) -> Result<SurfaceMesh, String>;
    /// Reads a picture as grey values.
    fn image(&self, path: &Path) -> Result<GreyImage, String>;
    /// Reads a sequence of meshes, with the points of a mesh that has been read.
    fn motion(&self, files: &Path, base: &Path, unit: LengthUnit) -> Result<MeshSequence, String> {
        mesh_sequence::read(files, base, unit).map_err(|error| error.to_string())
    }
}

/// Sheets smaller or larger than this are likelier in another unit [m].
const LIKELY_SIZE: std::ops::Range<f64> = 0.005..20.0;

impl Case {
    /// Reads what the scene names. Besides the inputs there may be warnings for the user.
    pub fn read_inputs(&self, loader: &dyn Loader) -> Result<(Inputs, Vec<String>), SceneError> {
        self.read_inputs_of(&self.scene, loader)
    }

    /// Reads what a variant of the scene names, such as the falsified one.
    pub fn read_inputs_of(&self, scene: &Scene, loader: &dyn Loader) -> Result<(Inputs, Vec<String>), SceneError> {
        let Origin { file, tree } = &self.origin;
        let point = |key: &str| file.point_at_key(tree, key, String::new());
        let mut inputs = Inputs::default();
        let mut warnings = Vec::new();
        let read_mesh = |key: &str, path: &Option<String>, unit: LengthUnit| match path {
            None => Ok(None),
            Some(path) => {
                let path = Path::new(path);
                check_there(point(key), path)?;
                let failed = |problem| SceneError::from(Diagnostic { problem, ..point(key) });
                loader.mesh(path, unit).map(Some).map_err(failed)
            }
        };
        inputs.mesh = read_mesh("sheet.mesh", &scene.sheet.mesh, scene.sheet.unit)?;
        inputs.rest_mesh = read_mesh("sheet.rest_mesh", &scene.sheet.rest_mesh, scene.sheet.unit)?;
        if let (Some(files), Some(base)) = (&scene.motion.files, &scene.sheet.mesh) {
            let failed = |problem| SceneError::from(Diagnostic { problem, ..point("motion.files") });
            let sequence = loader.motion(Path::new(files), Path::new(base), scene.sheet.unit);
            inputs.motion = Some(sequence.map_err(failed)?);
        }
        for (row, obstacle) in scene.obstacle.iter().enumerate() {
            if let Some(mesh) = read_mesh(&format!("obstacle.{row}.mesh"), &obstacle.mesh, obstacle.unit)? {
                inputs.obstacles.insert(obstacle.mesh.clone().unwrap_or_default(), mesh);
            }
            if let (Some(files), Some(base)) = (&obstacle.files, &obstacle.mesh) {
                let key = format!("obstacle.{row}.files");
                let failed = |problem| SceneError::from(Diagnostic { problem, ..point(&key) });
                let sequence = loader.motion(Path::new(files), Path::new(base), obstacle.unit).map_err(failed)?;
                inputs.obstacle_motions.insert(files.clone(), sequence);
            }
        }
        // Taken out of the meshes, so that nothing is said twice.
        for mesh in inputs.mesh.iter_mut().chain(&mut inputs.rest_mesh).chain(inputs.obstacles.values_mut()) {
            warnings.append(&mut mesh.remarks);
        }
        if let Some(warning) = inputs.mesh.as_ref().and_then(|mesh| unlikely_size(mesh, scene.sheet.unit)) {
            // The importer has its doubts about the size, too; here it is known what to try.
            warnings.retain(|remark| !remark.contains("sheet.unit"));
            warnings.insert(0, warning);
        } else if let Some(mesh) = inputs.mesh.as_ref().filter(|_| !scene.ignite.is_empty()) {
            warnings.extend(coarse(mesh, scene.sheet.burn_level));
        }
        for (key, path) in image_paths(&mut scene.clone()) {
            if !inputs.images.contains_key(path) {
                check_there(point(&key), Path::new(path))?;
                let failed = |problem| SceneError::from(Diagnostic { problem, ..point(&key) });
                inputs.images.insert(path.clone(), loader.image(Path::new(path)).map_err(failed)?);
            }
        }
        if scene.model == Model::Physical {
            inputs.material = Some(material(scene, file, tree)?);
        }
        Ok((inputs, warnings))
    }
}

/// The material that a scene names: a built-in one, or a file beside the scene.
pub(super) fn material(scene: &Scene, file: &File, tree: &Node) -> Result<Material, SceneError> {
    let name = &scene.sheet.material;
    let beside = file.folder.join(name);
    let name = if beside.is_file() { beside.to_string_lossy().into_owned() } else { name.clone() };
    material_file::open(&name).map_err(|mut error| {
        // Mistakes within a material are shown there; that there is none, here.
        if !MATERIALS.iter().any(|row| row.name == name)
            && !Path::new(&name).is_file()
            && let Some(diagnostic) = error.diagnostics.first_mut()
        {
            let Diagnostic { problem, hint, .. } = diagnostic.clone();
            *diagnostic =
                Diagnostic { hint, ..file.point_at_key(tree, "sheet.material", format!("{name}: {problem}")) };
        }
        error
    })
}

/// Every picture a scene names, with its key.
fn image_paths(scene: &mut Scene) -> Vec<(String, &mut String)> {
    let Scene { sheet, paint, ignite, .. } = scene;
    let Paint { fuel, moisture, thickness, strength, speed, noburn } = paint;
    fn gain(gain: &mut Option<PaintedGain>) -> Option<&mut String> {
        gain.as_mut()?.map.as_mut()
    }
    let mut all = vec![
        ("sheet.variation.map".to_owned(), sheet.variation.map.as_mut()),
        ("paint.fuel.map".to_owned(), gain(fuel)),
        ("paint.moisture.map".to_owned(), gain(moisture)),
        ("paint.thickness.map".to_owned(), gain(thickness)),
        ("paint.strength.map".to_owned(), gain(strength)),
        ("paint.speed.map".to_owned(), gain(speed)),
        ("paint.noburn.map".to_owned(), noburn.as_mut().and_then(|mask| mask.map.as_mut())),
    ];
    for (row, ignite) in ignite.iter_mut().enumerate() {
        all.push((format!("ignite.{row}.map"), ignite.map.as_mut()));
        let delay = ignite.delay.as_mut().and_then(|delay| delay.map.as_mut());
        all.push((format!("ignite.{row}.delay.map"), delay));
    }
    all.into_iter().filter_map(|(key, path)| Some((key, path?))).collect()
}

/// Says so where a mesh is of a size that sheets seldom have.
fn unlikely_size(mesh: &SurfaceMesh, unit: LengthUnit) -> Option<String> {
    let (low, high) = bounds(&mesh.positions);
    let size = (high - low).max_element();
    if !size.is_finite() || size <= 0.0 || LIKELY_SIZE.contains(&size) {
        return None;
    }
    let count = size / unit.metres();
    let (name, likely) = likely_unit(count);
    let there = UNITS.iter().find(|(_, u)| *u == unit).map_or("m", |(name, _)| name);
    Some(format!(
        "the mesh is {size:.3} m across with sheet.unit = \"{there}\"; with sheet.unit = \"{name}\" it would be {:.3} m",
        count * likely.metres()
    ))
}

/// An error at a key where there is no such file, with the nearest there is.
fn check_there(at: Diagnostic, path: &Path) -> Result<(), SceneError> {
    match std::fs::metadata(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(cannot_read(at, path, &error).into()),
    }
}

/// Says that a file cannot be read, and what there is instead.
pub(super) fn cannot_read(at: Diagnostic, path: &Path, error: &io::Error) -> Diagnostic {
    if error.kind() != io::ErrorKind::NotFound {
        return Diagnostic { problem: format!("{} cannot be read: {error}", path.display()), ..at };
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let wanted = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let problem = format!("there is no file {}", path.display());
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Diagnostic { problem, ..at }.hint(format!("the folder {} is not there either", folder.display()));
    };
    let mut names: Vec<String> =
        entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let hint = match nearest(&wanted, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean {near}?"),
        None => format!("{} has nothing of a like name", folder.display()),
    };
    Diagnostic { problem, ..at }.hint(hint)
}

/// Makes the paths of a scene absolute: those of the file count from its folder, those of `--set` from the current one.
pub(super) fn make_paths_absolute(scene: &mut Scene, tree: &Node, folder: &Path) {
    let absolute = |key: &str, path: &mut String| {
        let (node, _) = tree.nearest_to(key);
        let from = if matches!(node.place, Place::Override(_)) { Path::new("") } else { folder };
        if let Ok(full) = std::path::absolute(from.join(&path)) {
            *path = full.to_string_lossy().into_owned();
        }
    };
    let sheet = &mut scene.sheet;
    for (key, path) in [
        ("sheet.mesh", &mut sheet.mesh),
        ("sheet.rest_mesh", &mut sheet.rest_mesh),
        ("motion.files", &mut scene.motion.files),
    ] {
        if let Some(path) = path {
            absolute(key, path);
        }
    }
    for (row, obstacle) in scene.obstacle.iter_mut().enumerate() {
        for (key, path) in [("mesh", &mut obstacle.mesh), ("files", &mut obstacle.files)] {
            if let Some(path) = path {
                absolute(&format!("obstacle.{row}.{key}"), path);
            }
        }
    }
    for (key, path) in image_paths(scene) {
        absolute(&key, path);
    }
}
