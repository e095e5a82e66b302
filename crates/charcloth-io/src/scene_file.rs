//! Scene files: TOML with cases and overrides, and errors that point at the line.
//!
//! A file is a [`Scene`], and besides may have `[[case]]` rows (variants of it, each with a `set` of overrides and
//! further `expect` and `probe` rows) and `falsify` overrides, under which its checks must fail. Both are gone when the
//! scene is read. Everything goes through one tree that remembers where each key was written (`tree.rs`).

mod diagnostic;
mod inputs;
pub(crate) mod read;
mod schema;
pub(crate) mod tree;
mod validate;

pub use diagnostic::{Diagnostic, SceneError};
pub use inputs::Loader;
pub use schema::schema;
pub use validate::{Finding, validate};

use crate::mesh_sequence;
use charcloth::material::Material;
use charcloth::scene::{CurlLaw, DragLaw, Model, Scene, ThermalForceLaw};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tree::{Data, Node, Place};

/// A file that has been read: one case, or several.
#[derive(Debug, Clone)]
pub struct SceneFile {
    /// The file, or the name of a built-in scene.
    pub path: PathBuf,
    /// Its cases, at least one.
    pub cases: Vec<Case>,
}

/// One scene of a file.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name of the case; that of the scene where the file has no cases.
    pub name: String,
    /// The scene. Paths of meshes and pictures in it are absolute.
    pub scene: Scene,
    /// The scene with its `falsify` overrides, under which the checks must fail.
    pub falsified: Option<Scene>,
    origin: Origin,
}

/// What is needed to point at a key of a case.
#[derive(Debug, Clone)]
struct Origin {
    file: Arc<File>,
    tree: Node,
}

/// The text of a scene and the overrides it is read with.
#[derive(Debug)]
struct File {
    name: String,
    text: String,
    folder: PathBuf,
    overrides: Vec<String>,
}

/// Reads a scene file. Overrides are `key=value` with a dotted key.
pub fn load(path: &Path, overrides: &[String]) -> Result<SceneFile, SceneError> {
    let name = path.display().to_string();
    let text = std::fs::read(path).map_err(|error| inputs::cannot_read(Diagnostic::whole(&name, ""), path, &error))?;
    let text = String::from_utf8(text).map_err(|error| {
        let line = error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        Diagnostic::whole(&name, format!("line {line} is not UTF-8 text")).hint("scene files are TOML; is this one?")
    })?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    read_file(File { name, text, folder, overrides: overrides.to_vec() })
}

/// Reads a scene from text; paths in it are relative to the current directory.
pub fn load_text(name: &str, text: &str, overrides: &[String]) -> Result<SceneFile, SceneError> {
    let folder = PathBuf::new();
    read_file(File { name: name.to_owned(), text: text.to_owned(), folder, overrides: overrides.to_vec() })
}

fn read_file(file: File) -> Result<SceneFile, SceneError> {
    let file = Arc::new(file);
    let mut base = Node::parse(&file.name, &file.text)?;
    let defaults = toml::Value::try_from(Scene::default()).ok().map(|value| Node::of_value(&value));
    let falsify = base.take("falsify");
    let rows = match base.take("case") {
        None => vec![CaseRow::default()],
        Some(node) => case_rows(&file, node)?,
    };
    let mut cases = Vec::new();
    for row in rows {
        let mut tree = base.clone();
        if let Some(set) = &row.set {
            apply(&file, &mut tree, set, defaults.as_ref())?;
        }
        tree.append("expect", row.expect);
        tree.append("probe", row.probe);
        for (number, text) in file.overrides.iter().enumerate() {
            apply_argument(&file, &mut tree, number, text, defaults.as_ref())?;
        }
        let falsify: Vec<&Node> = falsify.iter().chain(&row.falsify).collect();
        let falsified = if falsify.is_empty() {
            None
        } else {
            let mut tree = tree.clone();
            for set in falsify {
                apply(&file, &mut tree, set, defaults.as_ref())?;
            }
            Some(read_scene(&file, &tree)?)
        };
        let scene = read_scene(&file, &tree)?;
        let name = row.name.unwrap_or_else(|| scene.name.clone());
        cases.push(Case { name, scene, falsified, origin: Origin { file: Arc::clone(&file), tree } });
    }
    Ok(SceneFile { path: PathBuf::from(&file.name), cases })
}

/// A `[[case]]` row taken apart.
#[derive(Default)]
struct CaseRow {
    name: Option<String>,
    set: Option<Node>,
    expect: Vec<Node>,
    probe: Vec<Node>,
    falsify: Option<Node>,
}

fn case_rows(file: &File, node: Node) -> Result<Vec<CaseRow>, SceneError> {
    let wrong =
        |place: &Place, problem: &str, hint: &str| SceneError::from(file.point(place, problem.to_owned()).hint(hint));
    let Data::Rows(rows) = node.data else {
        return Err(wrong(&node.key_place, "cases are rows", "write [[case]] in two brackets"));
    };
    if rows.is_empty() {
        return Err(wrong(&node.key_place, "there are no cases here", "leave `case` out, or add [[case]] rows"));
    }
    let mut cases = Vec::new();
    for row in rows {
        let Data::Table(entries) = row.data else {
            return Err(wrong(&row.place, "a case is a table", "write [[case]] in two brackets"));
        };
        let mut case = CaseRow::default();
        for (key, node) in entries {
            match (key.as_str(), node.data) {
                ("name", Data::Text(name)) => case.name = Some(name),
                ("set", data @ Data::Table(_)) => case.set = Some(Node { data, ..node }),
                ("falsify", data @ Data::Table(_)) => case.falsify = Some(Node { data, ..node }),
                ("expect", Data::Rows(rows)) => case.expect = rows,
                ("probe", Data::Rows(rows)) => case.probe = rows,
                ("name", _) => return Err(wrong(&node.place, "the name of a case is text", "put it in quotes")),
                ("set" | "falsify", _) => {
                    let hint = "write { \"sheet.spacing\" = \"2 mm\" }";
                    return Err(wrong(&node.place, "overrides are a table of dotted keys", hint));
                }
                ("expect" | "probe", _) => {
                    return Err(wrong(&node.place, "these are rows", &format!("write [[case.{key}]] in two brackets")));
                }
                _ => {
                    let keys = ["name", "set", "expect", "probe", "falsify"];
                    let hint = match charcloth::registry::nearest(&key, keys.into_iter()) {
                        Some(near) => format!("did you mean `{near}`?"),
                        None => format!("a case has {}; other keys go into `set`", keys.join(", ")),
                    };
                    return Err(wrong(&node.key_place, &format!("there is no key `{key}` in a case"), &hint));
                }
            }
        }
        if case.name.is_none() {
            return Err(wrong(&row.place, "this case has no name", "add `name = ...`"));
        }
        cases.push(case);
    }
    Ok(cases)
}

/// Applies a table of dotted keys.
fn apply(file: &File, tree: &mut Node, set: &Node, defaults: Option<&Node>) -> Result<(), SceneError> {
    let Data::Table(entries) = &set.data else {
        let hint = "write { \"sheet.spacing\" = \"2 mm\" }";
        return Err(file.point(&set.place, "overrides are a table of dotted keys".to_owned()).hint(hint).into());
    };
    for (key, value) in entries {
        tree.set(key, value.clone(), defaults).map_err(|problem| file.point(&value.key_place, problem))?;
    }
    Ok(())
}

/// Applies a `key=value` argument.
fn apply_argument(
    file: &File,
    tree: &mut Node,
    number: usize,
    text: &str,
    defaults: Option<&Node>,
) -> Result<(), SceneError> {
    let wrong = |problem: String| file.point(&Place::Override(number), problem);
    let (key, value) = text
        .split_once('=')
        .ok_or_else(|| wrong("there is no `=` in it".to_owned()).hint("write key=value, such as sheet.spacing=2mm"))?;
    let value = Node::parse_override(number, value).map_err(|problem| {
        wrong(format!("`{value}` cannot be read: {problem}")).hint("text inside [ ] needs quotes")
    })?;
    tree.set(key.trim(), value, defaults).map_err(|problem| wrong(problem).into())
}

/// Reads a scene from the tree, checks its values, and makes its paths absolute.
fn read_scene(file: &File, tree: &Node) -> Result<Scene, SceneError> {
    let mut scene = Scene::deserialize(tree).map_err(|mistake| {
        let place = mistake.place.unwrap_or(Place::Nowhere);
        let shown = matches!(place, Place::File(_));
        let diagnostic = file.point(&place, mistake.problem).hint(mistake.hint);
        match mistake.path.join(".") {
            path if shown || path.is_empty() => diagnostic,
            path => Diagnostic { problem: format!("{path}: {}", diagnostic.problem), ..diagnostic },
        }
    })?;
    inputs::make_paths_absolute(&mut scene, tree, &file.folder);
    let first_of = |files: &str, key: &str| -> Result<String, SceneError> {
        let first = mesh_sequence::files(Path::new(files)).map(|mut files| files.swap_remove(0));
        let first = first.map_err(|error| file.point_at_key(tree, key, error.to_string()))?;
        Ok(first.to_string_lossy().into_owned())
    };
    if let (Some(files), None) = (&scene.motion.files, &scene.sheet.mesh) {
        scene.sheet.mesh = Some(first_of(files, "motion.files")?);
    }
    for (row, obstacle) in scene.obstacle.iter_mut().enumerate() {
        if let (Some(files), None) = (&obstacle.files, &obstacle.mesh) {
            obstacle.mesh = Some(first_of(files, &format!("obstacle.{row}.files"))?);
        }
    }
    if scene.model == Model::Physical {
        let material = inputs::material(&scene, file, tree)?;
        use_material(&mut scene, &material, |key| tree.nearest_to(key).1);
    }
    if scene.name.is_empty() {
        let stem = Path::new(&file.name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        scene.name = stem.unwrap_or_else(|| "scene".to_owned());
    }
    let diagnostics: Vec<Diagnostic> = validate(&scene)
        .into_iter()
        .map(|Finding { key, problem, hint }| file.point_at_key(tree, &key, problem).hint(hint))
        .collect();
    if !diagnostics.is_empty() {
        return Err(SceneError { diagnostics });
    }
    Ok(scene)
}

/// Takes over from a material what the scene does not say itself.
fn use_material(scene: &mut Scene, material: &Material, is_said: impl Fn(&str) -> bool) {
    let Material { sheet, mechanics, .. } = material;
    let Scene { sheet: to, shell, mechanics: springs, curl, thermal_force, wind, .. } = scene;
    macro_rules! take {
        ($($key:literal: $place:expr, $value:expr;)*) => {
            $(if !is_said($key) { $place = $value; })*
        };
    }
    take! {
        "sheet.grammage": to.grammage, sheet.grammage.value;
        "sheet.variation.noise": to.variation.noise, sheet.formation.value;
        "sheet.variation.correlation_length": to.variation.correlation_length, sheet.formation_length.value;
        "sheet.cockle_length": to.cockle_length, sheet.cockle_length.as_ref().map_or(to.cockle_length, |it| it.value);
        "shell.thickness": shell.thickness, sheet.thickness.value;
        "shell.modulus_along": shell.modulus_along, mechanics.modulus_machine.value;
        "shell.modulus_across": shell.modulus_across, mechanics.modulus_cross.value;
        "shell.shear_modulus": shell.shear_modulus, Some(mechanics.shear_modulus.value);
        "shell.poisson": shell.poisson, mechanics.poisson.value;
        "mechanics.integrator": springs.integrator, "implicit".to_owned();
        // Heat neither pulls nor curls here: what burns does.
        "wind.law": wind.law, DragLaw::Plate;
        "curl.law": curl.law, CurlLaw::Off;
        "thermal_force.law": thermal_force.law, ThermalForceLaw::Off;
    }
    // Meshes from files are meant as they are.
    if to.mesh.is_none() && to.cockle.is_none() {
        to.cockle = sheet.cockle.as_ref().map(|it| it.value);
    }
}

impl File {
    fn point(&self, place: &Place, problem: String) -> Diagnostic {
        Diagnostic::at(&self.name, &self.text, &self.overrides, place, problem)
    }

    /// Points at the value of a key; where it is not written, at the table it would be in.
    fn point_at_key(&self, tree: &Node, key: &str, problem: String) -> Diagnostic {
        let (node, exact) = tree.nearest_to(key);
        // The place of a table of the file is its header or the whole of an inline table: its key is the better target.
        let is_table = matches!(node.data, Data::Table(_) | Data::Rows(_));
        let place = if is_table { &node.key_place } else { &node.place };
        let problem = if exact && matches!(place, Place::File(_)) { problem } else { format!("{key}: {problem}") };
        self.point(place, problem)
    }
}

impl Case {
    /// Shows an error of the simulator at the line of the key it names.
    pub fn explain(&self, error: &charcloth::error::Error) -> SceneError {
        let Origin { file, tree } = &self.origin;
        match error {
            charcloth::error::Error::Scene { key, problem, hint } => {
                file.point_at_key(tree, key, problem.clone()).hint(hint.clone()).into()
            }
            charcloth::error::Error::Mesh { problem, hint } => {
                file.point_at_key(tree, "sheet.mesh", problem.clone()).hint(hint.clone()).into()
            }
            other => Diagnostic::whole(&file.name, other.to_string()).into(),
        }
    }

    /// Whether `charcloth check` has anything to compare.
    pub fn has_checks(&self) -> bool {
        !self.scene.expect.is_empty()
    }
}

/// A scene as a file that reads back as the same scene.
pub fn write_scene(scene: &Scene) -> Result<String, String> {
    toml::to_string(scene).map_err(|error| format!("scene {}: {error}", scene.name))
}

#[cfg(test)]
mod tests;
