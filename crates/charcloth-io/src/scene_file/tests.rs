//! Scene files: what is read, what is refused, and how it is pointed at.

use super::*;
use charcloth::scene::{Corner, Shape};

fn read(text: &str, overrides: &[&str]) -> Result<SceneFile, SceneError> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    load_text("test.toml", text, &overrides)
}

fn scene(text: &str, overrides: &[&str]) -> Scene {
    read(text, overrides).unwrap_or_else(|error| panic!("{error}")).cases.remove(0).scene
}

#[test]
fn an_empty_file_is_the_default_scene() {
    assert_eq!(scene("", &[]), Scene { name: "test".to_owned(), ..Scene::default() });
}

#[test]
fn quantities_and_rows_are_read() {
    let scene =
        scene("[sheet]\nspacing = \"2 mm\"\nshape = \"grid\"\n[[pin]]\ncorner = \"top_left\"\n[time]\nfps = 30\n", &[]);
    assert_eq!(scene.sheet.spacing.0, 0.002);
    assert_eq!(scene.sheet.shape, Shape::Grid);
    assert_eq!(scene.pin[0].corner, Some(Corner::TopLeft));
    assert_eq!(scene.time.fps, 30.0);
}

#[test]
fn overrides_take_toml_and_bare_words() {
    let text = "[[pin]]\nedge = \"top\"\n";
    let overrides = [
        "sheet.spacing=2mm",
        "sheet.width=25 cm",
        "sheet.shape=grid",
        "seed=7",
        "pin.0.radius=5mm",
        "wind.velocity.0=2",
        "ignite.0.corner=bottom_right",
        "ignite.0.half_space={ point = [0, 0, 0], normal = [1, 0, 0] }",
        "sheet.position=[1, \"2 mm\", 3]",
        "name=2026-01-02",
        "fire.raw.k0=1e-6",
    ];
    let scene = scene(text, &overrides);
    assert_eq!(scene.sheet.spacing.0, 0.002);
    assert_eq!(scene.sheet.width.0, 0.25);
    assert_eq!(scene.seed, 7);
    assert_eq!(scene.pin[0].radius.0, 0.005);
    assert_eq!(scene.wind.velocity.map(|q| q.0), [2.0, 0.0, 0.0]);
    assert_eq!(scene.ignite[0].corner, Some(Corner::BottomRight));
    assert!(scene.ignite[0].half_space.is_some());
    assert_eq!(scene.sheet.position[1].0, 0.002);
    assert_eq!(scene.name, "2026-01-02");
    assert_eq!(scene.fire.raw.unwrap().k0.unwrap().0, 1e-6);
    assert!(self::scene(text, &["pin=[]"]).pin.is_empty());
}

#[test]
fn a_scene_overrides_its_material() {
    let text = "model = \"physical\"\n[sheet]\nmaterial = \"tissue\"\ngrammage = 0.05\nvariation.noise = 0\n";
    let file = read(text, &["shell.thickness=0.2mm"]).unwrap();
    let scene = &file.cases[0].scene;
    assert_eq!((scene.sheet.grammage.0, scene.sheet.variation.noise.0, scene.shell.thickness.0), (0.05, 0.0, 0.2e-3));
    // What it does not say is the material's: the wave length of the crepe.
    assert_eq!(scene.sheet.variation.correlation_length.0, 1e-3);
}

#[test]
fn cases_change_the_base_and_add_rows() {
    let text = r#"
        falsify = { "fire.diffusivity" = 1e-5 }
        [[expect]]
        quantity = "pieces"
        at_least = 1
        source = "a sheet is one piece"
        [[ignite]]
        edge = "left"
        [[case]]
        name = "coarse"
        set = { "sheet.spacing" = "6 mm", "ignite.0.temperature" = 900, sheet = { grammage = 0.1 } }
        [[case]]
        name = "fine"
        falsify = { seed = 9 }
        [case.set]
        sheet.spacing = 0.002
        [[case.probe]]
        name = "here"
        measure = "temperature"
        [[case.expect]]
        quantity = "order of here"
        value = 1.0
        tolerance = 0.1
        source = "made up"
    "#;
    let file = read(text, &["time.frames=3"]).unwrap();
    let [coarse, fine] = &file.cases[..] else { panic!("two cases") };
    assert_eq!((coarse.name.as_str(), coarse.scene.sheet.spacing.0), ("coarse", 0.006));
    assert_eq!(coarse.scene.ignite[0].temperature.0, 900.0);
    assert_eq!((coarse.scene.sheet.grammage.0, coarse.scene.sheet.width.0), (0.1, 0.21));
    assert_eq!((coarse.scene.expect.len(), fine.scene.expect.len()), (1, 2));
    assert_eq!((fine.scene.sheet.spacing.0, fine.scene.time.frames), (0.002, 3));
    let falsified = fine.falsified.as_ref().unwrap();
    assert_eq!((falsified.seed, falsified.fire.diffusivity.0), (9, 1e-5));
    assert_eq!(coarse.falsified.as_ref().unwrap().seed, 1);
}

#[test]
fn a_scene_written_out_reads_back_as_itself() {
    let before = scene(
        include_str!("../../../../scenes/a4.toml"),
        &["fire.raw.k1=1e-7", "sheet.shape=grid", "output.stills=[1, 2]"],
    );
    assert_eq!(scene(&write_scene(&before).unwrap(), &[]), before);
}

/// File, overrides, line and column, text pointed at, and words of the message.
type Wrong = (&'static str, &'static [&'static str], Option<(usize, usize)>, &'static str, &'static [&'static str]);

const WRONG: &[Wrong] = &[
    // Keys.
    ("seed = 1\n[sheet]\ngrammmage = 1\n", &[], Some((3, 1)), "grammmage", &["did you mean `grammage`?"]),
    ("[sheet.variation]\nnnoise = 1\n", &[], Some((2, 1)), "nnoise", &["`noise`"]),
    ("sheet.variation.bogus_key = 1\n", &[], Some((1, 17)), "bogus_key", &["there are: noise, correlation_length"]),
    ("[shet]\nwidth = 1\n", &[], Some((1, 2)), "shet", &["`sheet`"]),
    ("[[ignite]]\ncorner = \"top_left\"\ntemprature = 900\n", &[], Some((3, 1)), "temprature", &["`temperature`"]),
    ("", &["sheet.spacingg=2mm"], None, "", &["--set sheet.spacingg=2mm", "`spacing`"]),
    ("", &["sheet.spacing"], None, "", &["--set sheet.spacing", "key=value"]),
    ("", &["pin.1.radius=1"], None, "", &["pin", "no row 1"]),
    ("", &["seed.x=1"], None, "", &["--set seed.x=1"]),
    ("", &["a..b=1"], None, "", &["dotted key"]),
    ("", &["pin=[oops]"], None, "", &["--set pin=[oops]", "quotes"]),
    ("[[case]]\nname = \"a\"\nsett = {}\n", &[], Some((3, 1)), "sett", &["`set`"]),
    (
        "[[case]]\nname = \"a\"\nset = { \"sheet.sspacing\" = 1 }\n",
        &[],
        Some((3, 9)),
        "\"sheet.sspacing\"",
        &["`spacing`"],
    ),
    ("[[case]]\nset = {}\n", &[], Some((1, 1)), "[[case]]", &["name"]),
    // Quantities.
    ("[sheet]\nwidth = \"5 s\"\n", &[], Some((2, 9)), "\"5 s\"", &["a time", "a length", "5 mm"]),
    ("[sheet]\nwidth = \"5 furlong\"\n", &[], Some((2, 9)), "\"5 furlong\"", &["furlong", "a length"]),
    ("[sheet]\nposition = [0, 0, \"1 K\"]\n", &[], Some((2, 19)), "\"1 K\"", &["a temperature"]),
    ("", &["sheet.spacing=2kg"], None, "", &["--set sheet.spacing=2kg", "a mass", "a length"]),
    ("[sheet]\nwidth = 2 mm\n", &[], Some((2, 9)), "2 mm", &["quotes: \"2 mm\""]),
    ("[sheet]\nwidth = nan\n", &[], Some((2, 9)), "nan", &["finite"]),
    // Types.
    ("[sheet]\nwidth = true\n", &[], Some((2, 9)), "true", &["a length in m", "5 mm"]),
    ("[time]\nframes = 2.5\n", &[], Some((2, 10)), "2.5", &["whole number"]),
    ("[time]\nframes = -2\n", &[], Some((2, 10)), "-2", &["whole number"]),
    ("[output]\nsize = [1, 2, 3]\n", &[], Some((2, 8)), "[1, 2, 3]", &["2 values"]),
    ("[output]\nsize = [100]\n", &[], Some((2, 8)), "[100]", &["2"]),
    ("name = 5\n", &[], Some((1, 8)), "5", &["text in quotes"]),
    ("sheet = 5\n", &[], Some((1, 9)), "5", &["table"]),
    ("pin = { edge = \"top\" }\n", &[], Some((1, 7)), "{ edge = \"top\" }", &["array"]),
    ("[[ignite]]\nhalf_space = { point = [0, 0, 0] }\n", &[], Some((2, 14)), "{ point = [0, 0, 0] }", &["`normal`"]),
    // Choices.
    ("[sheet]\nshape = \"gird\"\n", &[], Some((2, 9)), "\"gird\"", &["did you mean \"grid\"", "chain"]),
    ("up = 3\n", &[], Some((1, 6)), "3", &["y, z"]),
    // Impossible values.
    ("[sheet]\nwidth = \"-5 mm\"\n", &[], Some((2, 9)), "\"-5 mm\"", &["not over 0"]),
    ("[sheet]\nspacing = \"1 m\"\n", &[], Some((2, 11)), "\"1 m\"", &["do not fit"]),
    ("[sheet]\nspacing = \"10 um\"\n", &[], Some((2, 11)), "\"10 um\"", &["million nodes"]),
    ("[sheet]\nrest = \"mesh\"\n", &[], Some((2, 8)), "\"mesh\"", &["rest_mesh"]),
    ("[sheet.variation]\nnoise = 1\n", &[], Some((2, 9)), "1", &["under 1"]),
    ("[fire]\nignition_temperature = \"10 degC\"\n", &[], Some((2, 24)), "\"10 degC\"", &["room"]),
    ("[fire]\nburn_time = 0\n", &[], Some((2, 13)), "0", &["not over 0"]),
    ("[fire.raw]\nk0 = 1\n", &[], Some((1, 7)), "raw", &["grid"]),
    ("[mechanics]\ninert_fraction = 0\n", &[], Some((2, 18)), "0", &["no mass"]),
    ("[mechanics]\ndeformation_limit = -0.1\n", &[], Some((2, 21)), "-0.1", &["under 0"]),
    ("[[pin]]\nradius = 1\n", &[], Some((1, 1)), "[[pin]]", &["names no part"]),
    ("[[ignite]]\nstart = 1\n", &[], Some((1, 1)), "[[ignite]]", &["names no part"]),
    ("[time]\nframes = 0\n", &[], Some((2, 10)), "0", &["nothing to see"]),
    ("[time]\nfps = inf\n", &[], Some((2, 7)), "inf", &["frames a second"]),
    ("[output]\nsize = [15, 20]\n", &[], Some((2, 1)), "size", &["even"]),
    ("[output.camera]\nzoom = 0\n", &[], Some((2, 8)), "0", &["zoom"]),
    (
        "[[expect]]\nquantity = \"piece\"\nvalue = 1\ntolerance = 0\nsource = \"x\"\n",
        &[],
        Some((2, 12)),
        "\"piece\"",
        &["\"pieces\""],
    ),
    ("[[expect]]\nquantity = \"pieces\"\nvalue = 1\nsource = \"x\"\n", &[], Some((3, 9)), "1", &["tolerance"]),
    ("[[expect]]\nquantity = \"pieces\"\nat_most = 1\n", &[], Some((1, 1)), "[[expect]]", &["source"]),
    ("[[expect]]\nquantity = \"pieces\"\nsource = \"x\"\n", &[], Some((1, 1)), "[[expect]]", &["at_least"]),
    (
        "[[probe]]\nname = \"a\"\nmeasure = \"x\"\n[[probe]]\nname = \"a\"\nmeasure = \"x\"\n",
        &[],
        Some((5, 8)),
        "\"a\"",
        &["two probes"],
    ),
    ("", &["time.fps=0"], None, "", &["--set time.fps=0", "time.fps"]),
    // No TOML.
    ("[sheet\n", &[], Some((1, 7)), "", &["TOML"]),
    ("name = a4\n", &[], Some((1, 8)), "a4", &["\"a4\""]),
    ("seed = 1\nseed = 2\n", &[], Some((2, 1)), "seed", &["duplicate"]),
];

#[test]
fn every_mistake_is_pointed_at() {
    let mut failures = Vec::new();
    for (text, overrides, position, pointed, words) in WRONG {
        let Err(error) = read(text, overrides) else {
            failures.push(format!("{text:?} {overrides:?} was taken"));
            continue;
        };
        let first = &error.diagnostics[0];
        let shown = error.to_string();
        let column = first.position.map_or(0, |(_, column)| column - 1);
        let under: String = first.line_text.chars().skip(column).take(first.width).collect();
        let fine = first.position == *position
            && (pointed.is_empty() || under == *pointed)
            && words.iter().all(|word| shown.contains(word));
        if !fine {
            failures.push(format!(
                "{text:?} {overrides:?}: wanted {position:?} {pointed:?} {words:?}, got {under:?}\n{shown}"
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}

#[test]
fn the_message_shows_the_line_with_carets() {
    let error = read("seed = 1\n[sheet]\n  grammmage = 1\n", &[]).unwrap_err();
    let expected = "test.toml:3:3: there is no key `grammmage` here\n  3 |   grammmage = 1\n    |   ^^^^^^^^^\n  try: did you mean `grammage`?";
    assert_eq!(error.to_string(), expected);
    assert!(error.render(true).contains("\x1b["));
}

#[test]
fn no_text_makes_the_reader_panic() {
    // Cut, doubled and spliced pieces of a scene: each is read or refused.
    let text = include_str!("../../../../scenes/a4.toml");
    let lines: Vec<&str> = text.lines().collect();
    for k in 0..text.len() {
        if text.is_char_boundary(k) {
            let _ = read(&text[..k], &[]);
            let _ = read(&text[k..], &[]);
        }
    }
    for i in 0..lines.len() {
        for j in 0..lines.len() {
            let _ = read(&format!("{}\n{}\nµ = °", lines[i], lines[j]), &[lines[j]]);
        }
    }
    for path in ["0", "pin", "pin.0", "pin.99999999999999999999", "sheet.position.7", "x.y.z.0.1", ".", "", "="] {
        for value in ["", "[", "{}", "[[]]", "{ a = 1 }", "1e999", "\u{0}", "a\nb = 1"] {
            let _ = read(text, &[&format!("{path}={value}")]);
        }
    }
}

#[test]
fn a_missing_file_names_its_neighbour() {
    let folder = std::env::temp_dir().join(format!("charcloth-scene-file-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("sheet.obj"), "").unwrap();
    std::fs::write(folder.join("a.toml"), "[sheet]\nmesh = \"shet.obj\"\n").unwrap();
    std::fs::write(folder.join("binary.toml"), [b'\n', 0xff]).unwrap();
    let error = load(&folder.join("b.toml"), &[]).unwrap_err().to_string();
    assert!(error.contains("there is no file") && error.contains("did you mean a.toml?"), "{error}");
    assert!(load(&folder.join("binary.toml"), &[]).unwrap_err().to_string().contains("line 2"));
    struct Nothing;
    impl Loader for Nothing {
        fn mesh(&self, _: &Path, _: charcloth::scene::LengthUnit) -> Result<charcloth::mesh::SurfaceMesh, String> {
            let positions = vec![glam::DVec3::ZERO, glam::DVec3::X * 210.0, glam::DVec3::Y * 297.0];
            Ok(charcloth::mesh::SurfaceMesh { positions, ..Default::default() })
        }
        fn image(&self, _: &Path) -> Result<charcloth::simulation::GreyImage, String> {
            Err("no picture".to_owned())
        }
    }
    let file = load(&folder.join("a.toml"), &[]).unwrap();
    let error = file.cases[0].read_inputs(&Nothing).unwrap_err().to_string();
    assert!(error.contains("a.toml:2:8") && error.contains("did you mean sheet.obj?"), "{error}");
    std::fs::write(folder.join("a.toml"), "[sheet]\nmesh = \"sheet.obj\"\nvariation.map = \"sheet.obj\"\n").unwrap();
    let file = load(&folder.join("a.toml"), &[]).unwrap();
    let error = file.cases[0].read_inputs(&Nothing).unwrap_err().to_string();
    assert!(error.contains("a.toml:3:17: no picture"), "{error}");
    std::fs::write(folder.join("a.toml"), "[sheet]\nmesh = \"sheet.obj\"\n").unwrap();
    let (_, warnings) = load(&folder.join("a.toml"), &[]).unwrap().cases[0].read_inputs(&Nothing).unwrap();
    assert!(warnings[0].contains("sheet.unit = \"mm\""), "{warnings:?}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn an_error_of_the_simulator_is_shown_at_its_key() {
    let file = read("[mechanics]\nintegrator = \"warp\"\n", &[]).unwrap();
    let error = charcloth::error::Error::scene("mechanics.integrator", "\"warp\" is not known", "there are: none");
    let shown = file.cases[0].explain(&error).to_string();
    assert!(shown.contains("test.toml:2:14: \"warp\" is not known") && shown.contains("try: there are"), "{shown}");
}

/// Every scene of the repository, with its text.
fn scenes() -> Vec<(PathBuf, String)> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, found);
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                found.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    collect(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")), &mut paths);
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

#[test]
fn every_scene_passes_the_schema_and_the_reader() {
    let schema: serde_json::Value = serde_json::from_str(&schema()).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    let json = |text: &str| serde_json::to_value(toml::from_str::<toml::Table>(text).unwrap()).unwrap();
    let scenes = scenes();
    assert!(!scenes.is_empty());
    for (path, text) in scenes {
        let errors: Vec<String> = validator.iter_errors(&json(&text)).map(|error| error.to_string()).collect();
        assert!(errors.is_empty(), "{}: {errors:?}", path.display());
        load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
    }
    let with_case = "falsify = { seed = 2 }\n[[case]]\nname = \"a\"\nset = { \"sheet.spacing\" = \"2 mm\" }\n[[case.expect]]\nquantity = \"pieces\"\n";
    assert!(validator.is_valid(&json(with_case)));
    assert!(!validator.is_valid(&json("[sheet]\ngrammmage = 1\n")), "an unknown key");
    assert!(!validator.is_valid(&json("[sheet]\nshape = \"gird\"\n")), "an unknown choice");
    assert!(!validator.is_valid(&json("[sheet]\nwidth = true\n")), "a wrong type");
    assert!(!validator.is_valid(&json("[[case]]\nsett = 1\n")), "an unknown key of a case");
}
