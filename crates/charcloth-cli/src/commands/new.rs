//! `charcloth new`: a folder with a scene to change.

use super::{Outcome, Run};
use crate::scenes::SCENES;
use anyhow::{Context, bail};
use charcloth::registry::Entry;
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// The template without `--template`: comments on the keys that are changed most.
const STARTER: Entry<&str> = Entry {
    name: "starter",
    about: "the common keys, with comments",
    item: include_str!("../../templates/starter.toml"),
};

const SCENE: &str = "scene.toml";
const SCHEMA: &str = "charcloth.schema.json";

/// Where to, and what.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder to make; the scene takes its name
    folder: PathBuf,
    /// What to begin with: a built-in scene, or a commented starter
    #[arg(long, value_name = "NAME", default_value = STARTER.name, value_parser = template_names())]
    template: String,
}

fn template_names() -> PossibleValuesParser {
    PossibleValuesParser::new(std::iter::once(STARTER.name).chain(SCENES.iter().map(|row| row.name)))
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        let text = std::iter::once(&STARTER).chain(SCENES).find(|row| row.name == self.template);
        let Some(text) = text.map(|row| row.item) else { bail!("there is no template {}", self.template) };
        let path = self.folder.join(SCENE);
        fs::create_dir_all(&self.folder)
            .with_context(|| format!("cannot make the folder {}", self.folder.display()))?;
        let name = std::path::absolute(&self.folder)?;
        let name = name.file_name().map_or("scene".into(), |name| name.to_string_lossy());
        let file = fs::OpenOptions::new().write(true).create_new(true).open(&path);
        let mut file = match file {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                bail!("{} is there already and is left as it is; name another folder", path.display())
            }
            file => file.with_context(|| format!("cannot write {}", path.display()))?,
        };
        file.write_all(with_name(text, &name).as_bytes())
            .with_context(|| format!("cannot write {}", path.display()))?;
        let schema = self.folder.join(SCHEMA);
        fs::write(&schema, charcloth_io::scene_file::schema())
            .with_context(|| format!("cannot write {}", schema.display()))?;
        println!("wrote {}; burn it with\n\n  charcloth run {}", path.display(), path.display());
        Ok(Outcome::Fine)
    }
}

/// The text of a template with the name of the new scene, and with a line that lets editors check it.
fn with_name(text: &str, name: &str) -> String {
    let mut lines = vec![format!("#:schema ./{SCHEMA}")];
    let mut in_head = true;
    for line in text.lines().filter(|line| !line.starts_with("#:schema")) {
        in_head &= !line.trim_start().starts_with('[');
        if in_head && line.split('=').next().is_some_and(|key| key.trim() == "name") {
            // A TOML basic string takes the escapes of a JSON string.
            lines.push(format!("name = {}", serde_json::Value::from(name)));
        } else {
            lines.push(line.to_owned());
        }
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use charcloth_io::scene_file::load_text;

    #[test]
    fn every_template_takes_any_name() {
        for row in std::iter::once(&STARTER).chain(SCENES) {
            for name in ["letter", "with \"quotes\" and \\", "a\nb"] {
                let file = load_text("new.toml", &with_name(row.item, name), &[]).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(file.cases[0].scene.name, name, "{}", row.name);
            }
        }
    }
}
