//! The command line from outside: help, exit codes, and messages that say where and what to try.

mod common;

use common::{Folder, run};

const COMMANDS: [&str; 10] =
    ["run", "render", "export", "import-check", "check", "new", "list", "schema", "bench", "fuzz"];

#[test]
fn help_names_every_command() {
    let folder = Folder::new("help");
    let (code, out, _) = run(&folder.0, &["--help"]);
    assert_eq!(code, 0);
    for command in COMMANDS {
        assert!(out.contains(&format!("\n  {command} ")), "{command} in {out}");
        let (code, help, _) = run(&folder.0, &[command, "--help"]);
        assert!(code == 0 && help.contains("Usage: charcloth"), "{command}: {help}");
    }
    let (code, out, _) = run(&folder.0, &["--version"]);
    assert_eq!((code, out.trim()), (0, concat!("charcloth ", env!("CARGO_PKG_VERSION"))));
    let (code, _, error) = run(&folder.0, &[]);
    assert!(code == 2 && error.contains("Usage: charcloth"), "{error}");
}

#[test]
fn wrong_usage_ends_with_2_and_a_suggestion() {
    let folder = Folder::new("usage");
    folder.write("fine.toml", "");
    folder.write("cases.toml", "[[case]]\nname = \"coarse\"\n[[case]]\nname = \"fine\"\n");
    let wrong: &[(&[&str], &[&str])] = &[
        (&["rendr"], &["render"]),
        (&["run", "--ouptut", "x"], &["--output"]),
        (&["run", "b4"], &["did you mean a4?", "there are: a4"]),
        (&["run", "fin.toml"], &["there is no file", "did you mean fine.toml?"]),
        (&["run", "."], &["folder"]),
        (&["run", "cases.toml"], &["--case", "coarse, fine"]),
        (&["run", "cases.toml", "--case", "fien"], &["coarse, fine"]),
        (&["run", "--frames", "9..3"], &["3..9"]),
        (&["run", "--threads", "0"], &["--threads"]),
        (&["run", "--style", "shadde"], &["shaded"]),
        (&["run", "--resume", "nowhere"], &["no run to go on with"]),
        (&["run", "--resume", "--set", "seed=2"], &["--set"]),
        (&["run", "--set", "sheet.spacng=2mm"], &["--set sheet.spacng=2mm", "`spacing`"]),
        (&["run", "--set", "sheet.mesh=shet.obj"], &["--set sheet.mesh=shet.obj", "there is no file"]),
        (&["render", "nowhere"], &["nowhere"]),
        (&["render", ".", "--size", "9"], &["960x720"]),
        (&["render", ".", "--camera", "1 m"], &["angle"]),
        (&["export", ".", "--format", "ojb"], &["obj"]),
        (&["export", "nowhere", "--format", "obj"], &["nowhere"]),
        (&["list", "looksz"], &["looks"]),
        (&["new", "x", "--template", "startr"], &["starter"]),
        (&["check", "fine.toml"], &["expects nothing"]),
        (&["check", "nowhere.toml"], &["there is no file"]),
        (&["bench", "b4"], &["a4"]),
    ];
    for (arguments, words) in wrong {
        let (code, _, error) = run(&folder.0, arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        for word in *words {
            assert!(error.contains(word), "{arguments:?}: {word:?} is not in\n{error}");
        }
        assert!(!error.contains("panicked"), "{arguments:?}: {error}");
    }
    assert!(!folder.0.join("runs").exists(), "a run that cannot start leaves no folder");
}

#[test]
fn a_scene_that_cannot_run_is_pointed_at() {
    let folder = Folder::new("scenes");
    folder.write("sheet.obj", "");
    let wrong: &[(&str, &str, &[&str])] = &[
        ("[sheet]\ngrammmage = 1\n", "2:1", &["grammmage = 1", "^^^^^^^^^\n", "did you mean `grammage`?"]),
        ("[sheet]\nwidth = \"5 s\"\n", "2:9", &["^^^^^\n", "a time", "a length"]),
        ("[sheet]\nwidth = true\n", "2:9", &["^^^^\n", "a length"]),
        ("[sheet]\nwidth = \"-1 m\"\n", "2:9", &["^^^^^^\n", "not over 0"]),
        ("[sheet]\nshape = \"gird\"\n", "2:9", &["^^^^^^\n", "did you mean \"grid\""]),
        ("[sheet]\nwidth = 2 mm\n", "2:9", &["quotes"]),
        ("[sheet]\nmesh = \"shet.obj\"\n", "2:8", &["^^^^^^^^^^\n", "did you mean sheet.obj?"]),
        ("[sheet.variation]\nmap = \"a.png\"\n", "2:7", &["^^^^^^^\n", "there is no file"]),
        ("[[pin]]\nradius = 1\n", "1:1", &["[[pin]]", "names no part"]),
    ];
    for (text, place, words) in wrong {
        folder.write("wrong.toml", text);
        let (code, _, error) = run(&folder.0, &["run", "wrong.toml"]);
        assert_eq!(code, 2, "{text}: {error}");
        assert!(error.starts_with(&format!("error: wrong.toml:{place}: ")), "{text}: {error}");
        for word in *words {
            assert!(error.contains(word), "{text}: {word:?} is not in\n{error}");
        }
        assert!(error.contains("\n  try: "), "{text}: {error}");
    }
    for bytes in [&[0xff, 0xfe][..], &[0][..], b"\xef\xbb\xbf[[[["] {
        folder.write("wrong.toml", bytes);
        let (code, _, error) = run(&folder.0, &["run", "wrong.toml"]);
        assert!(code == 2 && error.contains("wrong.toml"), "{bytes:?}: {error}");
    }
    assert!(!folder.0.join("runs").exists(), "a run that cannot start leaves no folder");
}

#[test]
fn list_prints_every_row_of_every_table() {
    let folder = Folder::new("list");
    let (code, out, _) = run(&folder.0, &["list"]);
    assert_eq!(code, 0);
    let rows = charcloth_render::LOOKS.iter().map(|row| (row.name, row.about));
    let rows = rows.chain(charcloth_io::exporters::EXPORTERS.iter().map(|row| (row.name, row.about)));
    let rows = rows.chain(charcloth_io::importers::IMPORTERS.iter().map(|row| (row.name, row.about)));
    let rows = rows.chain(charcloth::effects::EFFECTS.iter().map(|row| (row.name, row.about)));
    let rows = rows.chain(charcloth::integrators::INTEGRATORS.iter().map(|row| (row.name, row.about)));
    let rows = rows.chain(charcloth::measure::MEASURES.iter().map(|row| (row.name, row.about)));
    for (name, about) in rows {
        assert!(out.lines().any(|line| line.trim_start().starts_with(name) && line.ends_with(about)), "{name}: {out}");
    }
    let (_, looks, _) = run(&folder.0, &["list", "looks"]);
    assert_eq!(looks.lines().count(), charcloth_render::LOOKS.len());
}

#[test]
fn the_schema_is_json() {
    let folder = Folder::new("schema");
    let (code, out, _) = run(&folder.0, &["schema"]);
    assert_eq!(code, 0);
    let schema: serde_json::Value = serde_json::from_str(&out).unwrap();
    for key in ["sheet", "fire", "case", "falsify"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
}

#[test]
fn a_new_scene_reads_and_is_not_overwritten() {
    let folder = Folder::new("new");
    for template in ["starter", "a4"] {
        let (code, out, error) = run(&folder.0, &["new", template, "--template", template]);
        assert_eq!(code, 0, "{error}");
        assert!(out.contains("charcloth run"), "{out}");
        let path = folder.0.join(template).join("scene.toml");
        let before = std::fs::read_to_string(&path).unwrap();
        assert!(before.starts_with("#:schema ./charcloth.schema.json\n"), "{before}");
        let file = charcloth_io::scene_file::load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.cases[0].scene.name, template);
        let (code, _, error) = run(&folder.0, &["new", template]);
        assert!(code == 2 && error.contains("there already"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), before);
    }
}

#[test]
fn a_mesh_is_looked_at_before_it_burns() {
    let folder = Folder::new("import-check");
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../charcloth-io/tests/meshes/lampshade_mm.ply");
    let (code, out, error) = run(&folder.0, &["import-check", mesh]);
    assert_eq!(code, 0, "{error}");
    for fact in ["ply, 2366 points", "sheet.unit=mm", "holes 1;", "coordinates from (0.000, 0.000)", "frames", "memory"]
    {
        assert!(out.contains(fact), "{fact} in {out}");
    }
    let (_, out, _) = run(&folder.0, &["import-check", mesh, "--unit", "cm", "--no-estimate"]);
    assert!(out.contains("cm, as you say") && !out.contains("memory"), "{out}");
    let (code, _, error) = run(&folder.0, &["import-check", "none.obj"]);
    assert!(code == 2 && error.contains("none.obj"), "{error}");
    folder.write("empty.ply", "");
    let (code, _, error) = run(&folder.0, &["import-check", "empty.ply"]);
    assert!(code == 2 && error.contains("empty.ply"), "{error}");
}
