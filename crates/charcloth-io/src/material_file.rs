//! Material files: TOML in which every number says where it is from, read with errors that point at the line.
//!
//! A file may say `based_on = "copy_paper_80"`: it then has all of that material but for what it gives itself. Tables are
//! merged key by key, a number with its source and the rows of `reactions` are replaced whole.

use crate::scene_file::tree::{Data, Node, Place};
use crate::scene_file::{Diagnostic, SceneError};
use charcloth::error::Error;
use charcloth::material::Material;
use charcloth::registry::{Entry, nearest};
use serde::Deserialize;
use std::path::Path;

macro_rules! materials {
    ($($name:literal: $about:literal;)*) => {
        &[$(Entry { name: $name, about: $about, item: include_str!(concat!("../../../materials/", $name, ".toml")) }),*]
    };
}

/// The materials of the repository's `materials` folder: text by name.
pub const MATERIALS: &[Entry<&str>] = materials! {
    "copy_paper_80": "office paper of 80 g/m2 with chalk filler";
    "newsprint_45": "newsprint of 45 g/m2";
    "tissue": "laboratory tissue of 18.7 g/m2, the sheet of most flame-spread measurements";
    "filter_paper": "filter paper of 75 g/m2, nearly pure cellulose";
    "card_200": "card of 200 g/m2";
    "cardboard_liner": "liner of corrugated board, kraft, 150 g/m2";
    "cotton_sheet": "cotton bed sheet of 120 g/m2";
    "denim": "cotton denim of 400 g/m2";
    "wool": "wool cloth of 235 g/m2";
    "polyester_cotton": "65/35 polyester and cotton of 120 g/m2";
};

/// How many materials a material may be based on, one on the other.
const DEEPEST: usize = 8;

/// Reads a material: a file, or a built-in one by name.
pub fn open(material: &str) -> Result<Material, SceneError> {
    let path = Path::new(material);
    if path.is_file() {
        return load(path);
    }
    match MATERIALS.iter().find(|row| row.name == material) {
        Some(row) => load_text(row.name, row.item),
        None => Err(Diagnostic::whole(material, "there is no such material, and no such file")
            .hint(choices(material))
            .into()),
    }
}

/// Reads a material file.
pub fn load(path: &Path) -> Result<Material, SceneError> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| {
        Diagnostic::whole(&name, format!("cannot be read: {error}")).hint("material files are TOML in UTF-8")
    })?;
    load_text(&name, &text)
}

/// Reads a material from text; the name is that of messages.
pub fn load_text(name: &str, text: &str) -> Result<Material, SceneError> {
    let tree = read_tree(name, text, DEEPEST)?;
    let point = |place: &Place, problem: String| Diagnostic::at(name, text, &[], place, problem);
    let material = Material::deserialize(&tree).map_err(|mistake| {
        let place = mistake.place.unwrap_or(Place::Nowhere);
        let shown = matches!(place, Place::File(_));
        let path = mistake.path.join(".");
        let problem = if shown || path.is_empty() { mistake.problem } else { format!("{path}: {}", mistake.problem) };
        point(&place, problem).hint(mistake.hint)
    })?;
    material.check().map_err(|error| match error {
        Error::Scene { key, problem, hint } => {
            let (node, _) = tree.nearest_to(&key);
            point(&node.key_place, format!("{key}: {problem}")).hint(hint)
        }
        other => Diagnostic::whole(name, other.to_string()),
    })?;
    Ok(material)
}

fn read_tree(name: &str, text: &str, deeper: usize) -> Result<Node, SceneError> {
    let mut tree = Node::parse(name, text)?;
    let Some(base) = tree.take("based_on") else { return Ok(tree) };
    let wrong = |problem: &str, hint: String| {
        SceneError::from(Diagnostic::at(name, text, &[], &base.place, problem.to_owned()).hint(hint))
    };
    let Data::Text(base_name) = &base.data else {
        return Err(wrong(
            "a material is based on another by its name",
            "write based_on = \"copy_paper_80\"".to_owned(),
        ));
    };
    let Some(row) = MATERIALS.iter().find(|row| row.name == *base_name) else {
        return Err(wrong(&format!("there is no built-in material \"{base_name}\""), choices(base_name)));
    };
    if deeper == 0 {
        return Err(wrong("materials are based on each other in a circle", "give one of them all its keys".to_owned()));
    }
    let mut whole = read_tree(row.name, row.item, deeper - 1)?;
    whole.move_to(&Place::Nowhere); // places of another file would point at the wrong text
    merge(&mut whole, tree);
    Ok(whole)
}

/// Puts one tree over another.
fn merge(below: &mut Node, above: Node) {
    let is_number = |entries: &[(String, Node)]| entries.iter().any(|(key, _)| key == "value");
    match (&mut below.data, above.data) {
        (Data::Table(there), Data::Table(entries)) if !is_number(&entries) => {
            for (key, node) in entries {
                match there.iter_mut().find(|(name, _)| *name == key) {
                    Some((_, place)) => merge(place, node),
                    None => there.push((key, node)),
                }
            }
            below.key_place = above.key_place;
            below.place = above.place;
        }
        (_, data) => *below = Node { data, ..above },
    }
}

fn choices(name: &str) -> String {
    let names: Vec<_> = MATERIALS.iter().map(|row| row.name).collect();
    match nearest(name, names.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"? There are: {}", names.join(", ")),
        None => format!("there are: {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests;
