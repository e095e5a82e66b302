//! Code and documents agree: citations, equation numbers, tables and paths.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The top folder of the repository.
fn top() -> PathBuf {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a crate lies in `crates`");
    crates.parent().expect("`crates` lies in the top folder").to_owned()
}

/// Every file with an ending below a folder, in order; build folders are left out.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("a folder can be listed").path()).collect();
    paths.sort();
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|there| there == ending) {
            found.push(path);
        }
    }
    found
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Sources of all crates, with their text.
fn sources() -> Vec<(PathBuf, String)> {
    files(&top().join("crates"), "rs").into_iter().map(|path| (path.clone(), read(&path))).collect()
}

/// Documents in `docs`, with their text.
fn documents() -> Vec<(PathBuf, String)> {
    files(&top().join("docs"), "md").into_iter().map(|path| (path.clone(), read(&path))).collect()
}

/// Scenes, with their text: expectations name their source.
fn scenes() -> Vec<(PathBuf, String)> {
    files(&top().join("scenes"), "toml").into_iter().map(|path| (path.clone(), read(&path))).collect()
}

/// Citation keys in a text: in brackets, a capital, letters, a year of four digits.
fn keys(text: &str) -> BTreeSet<String> {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(inside, _)| inside));
    let is_key = |word: &&str| {
        let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
        word.len() == name.len() + 4
            && name.starts_with(|c: char| c.is_ascii_uppercase())
            && name.chars().all(|c| c.is_ascii_alphabetic())
    };
    inside.filter(is_key).map(str::to_owned).collect()
}

/// An equation number such as 6.5b at the start of a text, and what follows it.
fn number(text: &str) -> Option<(&str, &str)> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let chapter = digits(text);
    let equation = digits(text[chapter..].strip_prefix('.')?);
    if chapter == 0 || equation == 0 {
        return None;
    }
    let mut end = chapter + 1 + equation;
    let mut after = text[end..].chars();
    // One small letter belongs to the number, a word does not.
    if after.next().is_some_and(|c| c.is_ascii_lowercase()) && !after.next().is_some_and(|c| c.is_ascii_alphanumeric())
    {
        end += 1;
    }
    Some((&text[..end], &text[end..]))
}

/// Numbers of the equations a text cites: "Eq. 1.2", and those that follow after ", ", " to " or " and ".
fn cited(text: &str) -> BTreeSet<String> {
    let mut numbers = BTreeSet::new();
    for rest in text.split("Eq. ").skip(1) {
        let mut next = number(rest);
        while let Some((label, after)) = next {
            numbers.insert(label.to_owned());
            next = [", ", " to ", " and "].iter().find_map(|joint| number(after.strip_prefix(joint)?));
        }
    }
    numbers
}

/// Numbers of the equations that the physics document has, each in bold brackets.
fn defined(physics: &str) -> Vec<String> {
    let labels = physics.split("**(").skip(1).filter_map(|rest| rest.split_once(")**").map(|(label, _)| label));
    labels.filter(|label| number(label).is_some_and(|(_, after)| after.is_empty())).map(str::to_owned).collect()
}

#[test]
fn citations_and_references_agree() {
    let references = top().join("docs/references.md");
    let listed = keys(&read(&references));
    let mut cited: BTreeMap<String, PathBuf> = BTreeMap::new();
    for (path, text) in sources().into_iter().chain(documents()).chain(scenes()).filter(|(path, _)| *path != references)
    {
        for key in keys(&text) {
            cited.entry(key).or_insert_with(|| path.clone());
        }
    }
    for (key, path) in &cited {
        assert!(listed.contains(key), "{} cites [{key}]: add its source to docs/references.md", path.display());
    }
    for key in &listed {
        assert!(cited.contains_key(key), "docs/references.md has [{key}], which nothing cites");
    }
    assert!(!listed.is_empty());
}

#[test]
fn every_cited_equation_is_there_once() {
    let labels = defined(&read(&top().join("docs/physics.md")));
    let unique: BTreeSet<&String> = labels.iter().collect();
    for label in &unique {
        let count = labels.iter().filter(|there| there == label).count();
        assert_eq!(count, 1, "docs/physics.md has equation {label} {count} times");
    }
    // "Eq. 1.5" may stand for 1.5a, 1.5b and 1.5c.
    let known = |wanted: &str| {
        let variant =
            |label: &str| label.strip_prefix(wanted).is_some_and(|rest| rest.chars().all(char::is_alphabetic));
        unique.iter().any(|label| variant(label))
    };
    for (path, text) in sources().into_iter().chain(documents()).chain(scenes()) {
        for wanted in cited(&text) {
            assert!(known(&wanted), "{} cites equation {wanted}, which docs/physics.md does not have", path.display());
        }
    }
    assert!(!labels.is_empty());
}

const IMPORT_HELPERS: &[&str] = &[
    "clean",
    "gltf_document",
    "ogawa",
    "orientation",
    "polygons",
    "raw",
    "report",
    "usd_crate",
    "usd_layer",
    "usd_text",
];

const EXPORT_HELPERS: &[&str] = &[
    "abc_points",
    "abc_samples",
    "glb",
    "listing",
    "look",
    "ogawa",
    "pictures",
    "quantities",
    "sequence",
    "surface",
    "twin",
    "twin_obj",
    "usd_crate",
    "usd_points",
    "usd_samples",
    "vdb_grid",
];

/// Folders whose `mod.rs` has a table, and the files in them that are no row of it but help the others.
const TABLES: &[(&str, &[&str])] = &[
    ("charcloth/src/effects", &[]),
    ("charcloth/src/integrators", &[]),
    ("charcloth-io/src/importers", IMPORT_HELPERS),
    ("charcloth-io/src/exporters", EXPORT_HELPERS),
    ("charcloth-render/src/looks", &[]),
    ("charcloth-cli/src/commands", &[]),
];

#[test]
fn every_file_of_a_table_is_a_row_of_it() {
    for (folder, helpers) in TABLES {
        let path = top().join("crates").join(folder);
        let table = read(&path.join("mod.rs"));
        let stem = |path: &PathBuf| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let all = files(&path, "rs");
        // What is in a folder within belongs to the file of that name beside it.
        let (own, parts): (Vec<_>, Vec<_>) = all.iter().partition(|file| file.parent() == Some(&path));
        let mut names: BTreeSet<String> = own.into_iter().filter_map(stem).collect();
        for part in parts {
            let whole = part.parent().and_then(|folder| stem(&folder.to_path_buf())).unwrap_or_default();
            assert!(names.contains(&whole), "{} is part of nothing in {folder}", part.display());
        }
        names.remove("mod");
        for helper in *helpers {
            assert!(names.remove(*helper), "{folder}/{helper}.rs is gone: take it out of this test");
        }
        let rows: BTreeSet<String> = quoted(&table, " name: \"").map(|name| name.replace('-', "_")).collect();
        assert_eq!(names, rows, "files and rows of the table in {folder}/mod.rs differ");
    }
}

/// What a text has between single backticks, outside of code blocks.
fn code_words(text: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut in_block = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_block = !in_block;
        } else if !in_block {
            words.extend(line.split('`').skip(1).step_by(2).map(str::to_owned));
        }
    }
    words
}

#[test]
fn the_architecture_names_only_paths_that_exist() {
    let top = top();
    let text = read(&top.join("ARCHITECTURE.md"));
    let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(link, _)| link.to_owned()));
    let is_path = |word: &String| {
        let plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "/._-<>*".contains(c));
        plain && (word.contains('/') || [".rs", ".md", ".toml"].iter().any(|ending| word.ends_with(ending)))
    };
    let roots: Vec<PathBuf> = ["", "crates", "crates/charcloth", "crates/charcloth/src", "crates/charcloth-io/src"]
        .into_iter()
        .chain(["crates/charcloth-render/src", "crates/charcloth-cli/src"])
        .map(|folder| top.join(folder))
        .collect();
    let mut count = 0;
    for word in code_words(&text).into_iter().filter(is_path).chain(links) {
        // `effects/<name>.rs` is a place for a file to come: its folder must be there.
        let fixed: Vec<&str> = word.split('/').take_while(|part| !part.contains(['<', '*'])).collect();
        let path = fixed.join("/");
        assert!(roots.iter().any(|root| root.join(&path).exists()), "ARCHITECTURE.md names {word}, which is not there");
        count += 1;
    }
    assert!(count > 0);
}

/// What a text has between each place of `before` and the quotation mark after it.
fn quoted<'a>(text: &'a str, before: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(before).skip(1).filter_map(|rest| rest.split_once('"').map(|(inside, _)| inside))
}

#[test]
fn the_readme_has_the_table_of_commands() {
    let table = read(&top().join("crates/charcloth-cli/src/commands/mod.rs"));
    let readme = read(&top().join("README.md"));
    for (name, about) in quoted(&table, " name: \"").zip(quoted(&table, " about: \"")) {
        let row = format!("| `{name}` | {about} |");
        assert!(readme.contains(&row), "README.md lacks the row {row}");
    }
}

#[test]
fn citations_are_found_in_text() {
    let text = "by [Provot1995], a link [1], units [m2], `[u32; 3]`, [Provot19955] and [provot1995]";
    assert_eq!(keys(text), ["Provot1995".to_owned()].into());
    let text = "Eq. 1.5 to 1.7; Eq. 6.1, 6.4, Eq. 6.5b: and Eq. 8.2 a word, Eq. 3, Eq. 10.10. Eq. 1.5 a to c";
    let numbers = ["1.5", "1.7", "6.1", "6.4", "6.5b", "8.2", "10.10"].map(str::to_owned);
    assert_eq!(cited(text), numbers.into());
    assert_eq!(defined("**(1.5a)** and **(not one)** and **(2.1)**"), ["1.5a", "2.1"]);
}
