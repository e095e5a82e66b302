//! Random scenes: what no one thought of must still run to its end with the books closed.

use crate::material_file::MATERIALS;
use crate::scene_file::{Case, Loader, load_text};
use charcloth::mesh::SurfaceMesh;
use charcloth::random::Random;
use charcloth::scene::LengthUnit;
use charcloth::simulation::{GreyImage, Simulation, Summary};
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Errors of mass and energy under which the books count as closed.
const CLOSED: f64 = 1e-6;

/// Draws from a list.
fn pick<'a, T: ?Sized>(random: &mut Random, from: &[&'a T]) -> &'a T {
    from[((random.uniform() * from.len() as f64) as usize).min(from.len() - 1)]
}

fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

/// A vector of up to a size along each axis, as TOML.
fn vector(random: &mut Random, size: f64) -> String {
    let [x, y, z] = [0; 3].map(|_| between(random, -size, size));
    format!("[{x:.4}, {y:.4}, {z:.4}]")
}

/// The text of a small random scene; every seed has one of its own.
pub fn scene(seed: u64) -> String {
    let mut random = Random::new(seed, 0x6675_7a7a);
    let random = &mut random;
    let chance = |random: &mut Random, part: f64| random.uniform() < part;
    let physical = chance(random, 0.85);
    let contact = physical && chance(random, 0.5);
    let size = between(random, 0.02, 0.06);
    let mut text = format!("name = \"fuzz_{seed}\"\nseed = {seed}\n");
    let mut line = |written: std::fmt::Arguments<'_>| {
        text.write_fmt(written).expect("text can always be written");
        text.push('\n');
    };
    line(format_args!("model = \"{}\"", if physical { "physical" } else { "moidu2004" }));
    line(format_args!("gravity = {}", pick(random, &["0", "9.81", "9.81", "30"])));
    let up = pick(random, &["y", "y", "z"]);
    line(format_args!("up = \"{up}\""));

    let shape = pick(random, &["unstructured", "unstructured", "disc", "grid"]);
    line(format_args!("[sheet]\nshape = \"{shape}\""));
    line(format_args!("width = {size:.4}\nheight = {:.4}", size * between(random, 0.4, 1.5)));
    line(format_args!("radius = {:.4}\nspacing = {:.5}", 0.5 * size, size / between(random, 4.0, 10.0)));
    line(format_args!("pose = \"{}\"", pick(random, &["hanging", "lying"])));
    line(format_args!("burn_level = {}", pick(random, &["0", "1", "1", "2"])));
    line(format_args!("rotate = {}", vector(random, if contact { 0.3 } else { 3.0 })));
    if contact && shape != "grid" && chance(random, 0.4) {
        line(format_args!("layers = 3\nlayer_distance = \"4 mm\""));
    }
    if physical {
        let material = ((random.uniform() * MATERIALS.len() as f64) as usize).min(MATERIALS.len() - 1);
        line(format_args!("material = \"{}\"", MATERIALS[material].name));
        line(format_args!("backing = \"{}\"", pick(random, &["none", "none", "insulated"])));
        line(format_args!("edges = \"{}\"", pick(random, &["free", "free", "framed"])));
    }
    if chance(random, 0.3) {
        line(format_args!("cockle = {}", pick(random, &["0", "\"0.3 mm\""])));
    }

    line(format_args!("[mechanics]\nmoves = {}", pick(random, &["true", "true", "true", "true", "false"])));
    if chance(random, 0.5) {
        line(format_args!("strength = {:.1}", 10f64.powf(between(random, 0.5, 3.5))));
    }
    line(format_args!("[wind]\nvelocity = {}", vector(random, 1.5)));
    line(format_args!("gust = {}\ngust_time = 0.1", pick(random, &["0", "0.5", "2"])));
    if chance(random, 0.3) {
        for time in [0.0, 0.1, 0.2] {
            line(format_args!("[[wind.key]]\ntime = {time}\nvelocity = {}", vector(random, 3.0)));
        }
    }
    if physical {
        line(format_args!("[fire]\nhumidity = {:.2}", between(random, 0.0, 0.95)));
        line(format_args!("oxygen = {}", pick(random, &["0.0", "0.209", "0.209", "0.4", "0.99"])));
        line(format_args!("pressure = \"{} kPa\"", pick(random, &["30", "101.325", "101.325", "200"])));
        line(format_args!("speed_gain = {:.3}", pick(random, &[&1.0, &1.0, &0.3, &4.0])));
        line(format_args!("gas = \"{}\"", pick(random, &["flame", "flame", "flame", "still_air"])));
        if chance(random, 0.3) {
            let (face, flux) = (pick(random, &["front", "back"]), between(random, 10.0, 100.0));
            line(format_args!("[[heater]]\nface = \"{face}\"\nflux = \"{flux:.1} kW/m2\"\nlength = 0.3"));
        }
    }
    if contact {
        line(format_args!("[contact]\nself_contact = true\nfriction = {:.2}", between(random, 0.0, 1.0)));
        // Nothing may cross at the start: what is in the way lies lower than the sheet reaches, whatever its turn.
        let below = 1.2 * size + 0.01;
        let at = |height: f64| match up {
            "y" => format!("[[obstacle]]\nposition = [0, {height:.4}, 0]"),
            _ => format!("[[obstacle]]\nposition = [0, 0, {height:.4}]"),
        };
        match pick(random, &["none", "plane", "sphere", "box"]) {
            "plane" => line(format_args!("{}\nshape = \"plane\"", at(-below))),
            "sphere" => line(format_args!("{}\nshape = \"sphere\"\nradius = {size:.4}", at(-below - size))),
            "box" => line(format_args!("{}\nshape = \"box\"\nsize = [{size:.4}, 0.02, 0.02]", at(-below - 0.02))),
            _ => {}
        }
    }
    let pin = pick(random, &["", "edge = \"top\"", "corner = \"top_left\"", "point = [0, 0, 0]"]);
    if !pin.is_empty() {
        line(format_args!("[[pin]]\n{pin}\nradius = {:.4}", 0.3 * size));
    }
    let places = ["corner = \"bottom_left\"", "point = [0, 0, 0]", "edge = \"left\"", "nodes = [0, 1, 2]"];
    for _ in 0..(random.uniform() * 3.0) as usize {
        let place = pick(random, &places);
        let (start, length) = (between(random, 0.0, 0.1), between(random, 0.1, 0.4));
        line(format_args!("[[ignite]]\n{place}\nradius = {:.4}", between(random, 0.2, 0.6) * size));
        line(format_args!("start = {start:.3}\nlength = {length:.3}"));
    }
    line(format_args!("[time]\nframes = 8\nfps = 24\nstep = \"{} ms\"", pick(random, &["2", "5", "10"])));
    text
}

/// There are no files to read.
struct Nothing;

impl Loader for Nothing {
    fn mesh(&self, path: &Path, _: LengthUnit) -> Result<SurfaceMesh, String> {
        Err(format!("{} is not there", path.display()))
    }
    fn image(&self, path: &Path) -> Result<GreyImage, String> {
        Err(format!("{} is not there", path.display()))
    }
}

fn simulate(case: &Case) -> Result<Summary, String> {
    let (inputs, _) = case.read_inputs(&Nothing).map_err(|error| error.to_string())?;
    let mut simulation = Simulation::build(&case.scene, &inputs).map_err(|error| case.explain(&error).to_string())?;
    for _ in 0..case.scene.time.frames {
        simulation.advance_frame().map_err(|error| error.to_string())?;
    }
    Ok(simulation.summary())
}

/// Runs a scene to its end. The error says what is wrong with it: it was refused, it panicked, a number is not finite, the
/// books do not close, or sheets are where they cannot be.
pub fn try_scene(text: &str) -> Result<Summary, String> {
    let file = load_text("fuzz", text, &[]).map_err(|error| error.to_string())?;
    let case = &file.cases[0];
    let summary = catch_unwind(AssertUnwindSafe(|| simulate(case))).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<String>().cloned();
        let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        Err(format!("it panicked: {}", said.unwrap_or_default()))
    })?;
    let books = [("mass_error", Some(summary.mass_error)), ("energy_error", summary.energy_error)];
    for (name, error) in books {
        if let Some(error) = error
            && (error.is_nan() || error > CLOSED)
        {
            return Err(format!("{name} is {error:.2e}, over {CLOSED:.0e}"));
        }
    }
    for (name, pairs) in [
        ("intersecting pairs in some frame", summary.intersecting_pairs_max),
        ("pairs that passed through each other", summary.passed_through),
    ] {
        if let Some(pairs) = pairs.filter(|pairs| *pairs > 0) {
            return Err(format!("there are {pairs} {name}"));
        }
    }
    Ok(summary)
}
