//! Blender, without a window: the add-on burns a plane from end to end, and files of `charcloth export` are imported.
//! What is compared is said in `blender/`.
//!
//! Blender comes as the Python package `bpy`, which exists for one version of Python only and takes 1 GB of disk, so
//! these tests run when they are asked for: `CHARCLOTH_BLENDER=1`, or another version in place of the 1.

mod common;
#[path = "../../charcloth-io/tests/common/environment.rs"]
mod environment;
#[path = "../../charcloth-io/tests/common/skipped.rs"]
mod skipped;

use charcloth::scene::LengthUnit;
use charcloth_io::exporters::vdb_grid::{Grid, write};
use charcloth_io::importers::read_mesh;
use common::{Folder, run};
use skipped::skipped;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// What is installed unless another is asked for (400 MB to fetch, 1 GB on the disk), and the Python it is built for.
const VERSION: &str = "5.0.1";
const PYTHON: &str = "3.11";
/// Frames of the run that is imported.
const LAST: &str = "40";

/// A Python that has Blender; says why where there is none.
fn blender() -> Option<&'static Path> {
    static BLENDER: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match BLENDER.get_or_init(find) {
        Ok(python) => Some(python),
        Err(why) => {
            skipped(format_args!("no Blender ({why})"));
            None
        }
    }
}

fn find() -> Result<PathBuf, String> {
    let asked = std::env::var("CHARCLOTH_BLENDER").unwrap_or_default();
    let bpy = match asked.as_str() {
        "" | "0" => return Err("CHARCLOTH_BLENDER=1 asks for it; it takes 1 GB of disk".to_owned()),
        "1" => format!("bpy=={VERSION}"),
        version => format!("bpy=={version}"),
    };
    let version = "import sys; print('%d.%d' % sys.version_info[:2])";
    let output = Command::new(environment::base()).args(["-c", version]).output().map_err(|error| error.to_string())?;
    let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    match version == PYTHON {
        true => environment::with_packages(&[&bpy]),
        false => Err(format!("{bpy} is for Python {PYTHON}, this is {version}; PYTHON may name another")),
    }
}

/// Runs a script in Blender, which keeps its settings in a folder of the test.
fn in_blender(python: &Path, folder: &Path, script: &str, arguments: &[&Path]) -> Output {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/blender").join(script);
    let mut command = Command::new(python);
    command.arg(script).args(arguments).env("BLENDER_USER_RESOURCES", folder.join("user")).current_dir(folder);
    command.output().unwrap()
}

fn check(output: &Output, word: &str) {
    let (out, error) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.contains(word), "{out}{error}");
}

fn package(python: &Path, folder: &Path) -> PathBuf {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../blender/package.py");
    std::fs::create_dir_all(folder).unwrap();
    let output = Command::new(python).arg(script).arg(folder).output().unwrap();
    check(&output, "charcloth-blender-");
    PathBuf::from(String::from_utf8_lossy(&output.stdout).trim())
}

#[test]
fn presets_are_the_materials_of_the_program() {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let (code, materials, error) = run(&home, &["list", "materials"]);
    assert_eq!(code, 0, "{error}");
    let script = home.join("crates/charcloth-cli/tests/blender/presets.py");
    let newer = "import sys; sys.exit(sys.version_info < (3, 11))";
    match Command::new(environment::base()).args(["-B", "-c", newer]).status() {
        Ok(status) if status.success() => {
            let output = Command::new(environment::base()).arg("-B").arg(script).arg(&home).arg(materials).output();
            check(&output.unwrap(), "SOUND");
        }
        _ => skipped(format_args!("no Python 3.11 or later; PYTHON may name one")),
    }
}

#[test]
fn the_add_on_burns_a_plane() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-add-on");
    let archive = package(python, &folder.0.join("one"));
    let again = package(python, &folder.0.join("two"));
    assert!(std::fs::read(&archive).unwrap() == std::fs::read(again).unwrap(), "the archive has the same bytes");
    let program = Path::new(env!("CARGO_BIN_EXE_charcloth"));
    check(&in_blender(python, &folder.0, "addon.py", &[&archive, program, &folder.0.join("out")]), "SOUND");
}

#[test]
fn blender_imports_usd_and_alembic() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-files");
    // On a burn mesh finer than the one that moves, points lie within the faces of the input.
    let sets = ["--set", "up=z", "--set", "sheet.spacing=12mm", "--set", "sheet.burn_level=1"];
    let scene = [&["run", "a4"], &sets[..], &["--frames", LAST, "--no-movie", "-o", "run"]].concat();
    let exports = ["usd", "abc"].map(|format| ["export", "run", "--format", format, "--mean-velocities"]);
    for arguments in std::iter::once(&scene[..]).chain(exports.iter().map(|export| &export[..])) {
        let (code, out, error) = run(&folder.0, arguments);
        assert_eq!(code, 0, "{out}{error}");
    }
    check(&in_blender(python, &folder.0, "files.py", &[&folder.0.join("run"), Path::new(LAST)]), "SOUND");
}

#[test]
fn usd_that_blender_exports_is_read() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-usd");
    check(&in_blender(python, &folder.0, "usd_written.py", &[&folder.0]), "SOUND");
    // The same mesh as OBJ, in metres, y up.
    let expected = read_mesh(&folder.0.join("expected.obj"), LengthUnit::M).unwrap();
    for name in ["z_up.usdc", "y_up.usda", "package.usdz"] {
        let mesh = read_mesh(&folder.0.join(name), LengthUnit::M).unwrap();
        assert_eq!(mesh.triangles, expected.triangles, "{name}");
        assert_eq!(mesh.corner_uv, expected.corner_uv, "{name}");
        for (i, (place, there)) in mesh.positions.iter().zip(&expected.positions).enumerate() {
            // Single precision in the files, and angles in degrees.
            assert!(place.distance(*there) < 1e-6, "{name}: {place}, {there}");
            let painted = ["pin", "color.r", "color.g"].map(|attribute| mesh.painted[attribute][i]);
            assert_eq!(painted, [i as f32 / 64.0, i as f32 / 128.0, 0.5], "{name}");
        }
    }
}

#[test]
fn alembic_that_blender_exports_is_read() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-abc");
    check(&in_blender(python, &folder.0, "abc_written.py", &[&folder.0]), "SOUND");
    let [mesh, expected] =
        ["sheet.abc", "expected.obj"].map(|name| read_mesh(&folder.0.join(name), LengthUnit::M).unwrap());
    assert_eq!(mesh.triangles, expected.triangles);
    assert_eq!(mesh.corner_uv, expected.corner_uv);
    for (place, there) in mesh.positions.iter().zip(&expected.positions) {
        assert!(place.distance(*there) < 1e-6, "{place}, {there}");
    }
}

#[test]
fn openvdb_reads_grids_to_the_bit() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-vdb");
    let mut bits = 12345u64;
    let mut random = || {
        // Marsaglia's xorshift: any numbers will do.
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        bits
    };
    let mut grids = ["flame", "temperature"].map(|name| Grid::new(name, 0.0017));
    let mut expected = String::new();
    for k in 0..3000u64 {
        // Near the origin, around it, and in other cubes of 4096 voxels.
        let span = [20, 400, 20_000][k as usize % 3];
        let at = [0; 3].map(|_| (random() % (2 * span)) as i32 - span as i32);
        let values = [(k + 1) as f32 / 3001.0, 300.0 + (random() % 4096) as f32 / 7.0];
        for (grid, value) in grids.iter_mut().zip(values) {
            *grid.at(at) = value;
        }
        expected += &format!("{} {} {} {} {}\n", at[0], at[1], at[2], values[0].to_bits(), values[1].to_bits());
    }
    std::fs::write(folder.0.join("expected.txt"), expected).unwrap();
    let mut bytes = Vec::new();
    write(&grids, &mut bytes).unwrap();
    std::fs::write(folder.0.join("grids.vdb"), &bytes).unwrap();
    let mut again = Vec::new();
    write(&grids, &mut again).unwrap();
    assert!(bytes == again, "the file has the same bytes");
    write(&[Grid::new("flame", 0.002)], &mut std::fs::File::create(folder.0.join("empty.vdb")).unwrap()).unwrap();
    check(&in_blender(python, &folder.0, "grids.py", &[&folder.0]), "SOUND");
}

#[test]
fn blender_shows_flames() {
    let Some(python) = blender() else { return };
    let folder = Folder::new("blender-flames");
    let steps: [&[&str]; 2] = [
        &["run", "match", "--set", "up=z", "--frames", "20", "--no-movie", "-o", "run"],
        &["export", "run", "--format", "vdb", "--frames", "18..20"],
    ];
    for arguments in steps {
        let (code, out, error) = run(&folder.0, arguments);
        assert_eq!(code, 0, "{out}{error}");
    }
    check(&in_blender(python, &folder.0, "flames.py", &[&folder.0.join("run")]), "SOUND");
}
