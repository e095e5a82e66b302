//! Values that can be read but not simulated: each is found before a run starts, and named by its key.

use charcloth::check::ORDER_OF;
use charcloth::scene::*;
use charcloth::simulation::Summary;
use std::collections::BTreeSet;

/// One impossible value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Dotted key.
    pub key: String,
    /// What is wrong with it.
    pub problem: String,
    /// What to try.
    pub hint: String,
}

/// More nodes than any machine at hand would finish.
const MOST_NODES: f64 = 20e6;

/// Checks every value of a scene that has a range of its own, or that contradicts another.
pub fn validate(scene: &Scene) -> Vec<Finding> {
    let mut findings = Findings(Vec::new());
    sheet(scene, &mut findings);
    fire(scene, &mut findings);
    mechanics(scene, &mut findings);
    forces(scene, &mut findings);
    places(scene, &mut findings);
    paint(scene, &mut findings);
    motion(scene, &mut findings);
    contact(scene, &mut findings);
    time(scene, &mut findings);
    output(&scene.output, &mut findings);
    checks(scene, &mut findings);
    findings.0
}

struct Findings(Vec<Finding>);

impl Findings {
    fn add(&mut self, key: impl Into<String>, problem: impl Into<String>, hint: impl Into<String>) {
        self.0.push(Finding { key: key.into(), problem: problem.into(), hint: hint.into() });
    }

    fn positive(&mut self, key: &str, value: f64, example: &str) {
        if value.is_nan() || value <= 0.0 {
            self.add(key, format!("{value} is not over 0"), format!("write a positive value, such as {example}"));
        }
    }

    fn not_negative(&mut self, key: &str, value: f64) {
        if value.is_nan() || value < 0.0 {
            self.add(key, format!("{value} is under 0"), "write 0 or a positive value");
        }
    }

    fn between(&mut self, key: &str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.add(key, format!("{value} is not between {low} and {high}"), format!("write {low} to {high}"));
        }
    }

    fn finite(&mut self, key: &str, values: &[f64]) {
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            self.add(key, format!("{value} is not a finite number"), "write an ordinary number");
        }
    }
}

/// Whether the sheet is a uniform grid or chain made here, which is what the raw coefficients are defined on.
fn is_uniform(sheet: &Sheet) -> bool {
    sheet.mesh.is_none() && matches!(sheet.shape, Shape::Grid | Shape::Chain)
}

/// About how many nodes a built-in sheet will have.
fn estimated_nodes(sheet: &Sheet) -> f64 {
    let spacing = sheet.node_distance();
    let (width, height, radius) = (sheet.width.0, sheet.height.0, sheet.radius.0);
    // A node of a mesh of near-equilateral triangles stands for an area of sqrt(3)/2 spacing^2.
    let cell = 0.75_f64.sqrt() * spacing * spacing / f64::from(sheet.layers.max(1));
    match sheet.shape {
        Shape::Unstructured => width * height / cell,
        Shape::Grid => (width / spacing + 1.0) * (height / spacing + 1.0),
        Shape::Disc => std::f64::consts::PI * radius * radius / cell,
        Shape::Chain => width / spacing + 1.0,
    }
}

fn sheet(scene: &Scene, findings: &mut Findings) {
    let sheet = &scene.sheet;
    let before = findings.0.len();
    findings.positive("sheet.grammage", sheet.grammage.0, "\"80 g/m2\"");
    if sheet.mesh.is_none() {
        let sizes = [
            ("sheet.width", sheet.width.0, sheet.shape != Shape::Disc),
            ("sheet.height", sheet.height.0, matches!(sheet.shape, Shape::Unstructured | Shape::Grid)),
            ("sheet.radius", sheet.radius.0, sheet.shape == Shape::Disc),
        ];
        for (key, size, _) in sizes.iter().filter(|(_, _, used)| *used) {
            findings.positive(key, *size, "\"210 mm\"");
        }
        if sheet.segments == Some(0) {
            findings.add(
                "sheet.segments",
                "0 is no number of segments".to_owned(),
                "write 1 or more, such as 128".to_owned(),
            );
        }
        findings.positive("sheet.spacing", sheet.node_distance(), "\"3 mm\"");
        if sheet.layers == 0 {
            findings.add("sheet.layers", "0 layers are no sheet", "write 1 or more");
        }
        if sheet.layers > 1 {
            findings.positive("sheet.layer_distance", sheet.layer_distance.0, "\"2 mm\"");
            findings.not_negative("sheet.layer_turn", sheet.layer_turn.0);
        }
        if findings.0.len() == before {
            let smallest = sizes.iter().filter(|(_, _, used)| *used).map(|(_, size, _)| *size).fold(f64::MAX, f64::min);
            if sheet.node_distance() > smallest {
                findings.add(
                    "sheet.spacing",
                    format!("nodes {} m apart do not fit into a sheet {smallest} m across", sheet.node_distance()),
                    format!("write a spacing well under the size, such as {}", smallest / 50.0),
                );
            }
            let nodes = estimated_nodes(sheet);
            if nodes > MOST_NODES {
                let enough = sheet.node_distance()
                    * if sheet.shape == Shape::Chain { nodes / 1e5 } else { (nodes / 1e5).sqrt() };
                findings.add(
                    "sheet.spacing",
                    format!("this spacing makes about {:.0} million nodes; 20 million is the most", nodes / 1e6),
                    format!("a spacing of {enough:.1e} m makes about 100 thousand"),
                );
            }
        }
    }
    let cockle = sheet.cockle_height();
    findings.not_negative("sheet.cockle", cockle);
    if cockle > 0.0 {
        findings.positive("sheet.cockle_length", sheet.cockle_length.0, "\"25 mm\"");
        if sheet.rest != Rest::AsItLies && sheet.mesh.is_some() {
            let hint = "use rest = \"as_it_lies\", or leave the cockle out";
            findings.add("sheet.cockle", "a stress-free shape of its own says how the sheet is cockled", hint);
        }
    }
    if sheet.layers > 1 && (sheet.mesh.is_some() || matches!(sheet.shape, Shape::Grid | Shape::Chain)) {
        findings.add(
            "sheet.layers",
            "only irregular rectangles and discs come in layers",
            "use shape = \"unstructured\" or \"disc\", or a mesh file that holds several sheets",
        );
    }
    if sheet.rest == Rest::Mesh && sheet.rest_mesh.is_none() {
        findings.add(
            "sheet.rest",
            "the stress-free shape is to come from a mesh, but none is named",
            "add `rest_mesh = \"file.obj\"`",
        );
    }
    if sheet.rest != Rest::Mesh && sheet.rest_mesh.is_some() {
        findings.add("sheet.rest_mesh", "this mesh would not be used", "add `rest = \"mesh\"`");
    }
    if sheet.rest == Rest::Mesh && sheet.rest_mesh.is_some() && sheet.mesh.is_none() {
        findings.add(
            "sheet.rest_mesh",
            "a stress-free mesh needs a mesh whose points it matches",
            "add `mesh = \"file.obj\"`",
        );
    }
    if sheet.backing == Backing::Board {
        let board = &sheet.board;
        findings.positive("sheet.board.conductivity", board.conductivity.0, "\"0.12 W/(m K)\"");
        findings.positive("sheet.board.density", board.density.0, "\"740 kg/m3\"");
        findings.positive("sheet.board.heat_capacity", board.heat_capacity.0, "\"1000 J/(kg K)\"");
        findings.not_negative("sheet.board.gap", board.gap.0);
    }
    let variation = &sheet.variation;
    if variation.noise.0 < 0.0 || variation.noise.0 >= 1.0 {
        findings.add(
            "sheet.variation.noise",
            format!("{} is not from 0 to under 1", variation.noise.0),
            "paper has 5 to 10 %: write \"8 %\"",
        );
    }
    if variation.noise.0 > 0.0 {
        findings.positive("sheet.variation.correlation_length", variation.correlation_length.0, "\"4 mm\"");
    }
    findings.not_negative("sheet.variation.map_low", variation.map_low.0);
    findings.not_negative("sheet.variation.map_high", variation.map_high.0);
}

fn fire(scene: &Scene, findings: &mut Findings) {
    let fire = &scene.fire;
    findings.positive("fire.ambient_temperature", fire.ambient_temperature.0, "\"20 degC\"");
    if fire.ignition_temperature <= fire.ambient_temperature {
        findings.add(
            "fire.ignition_temperature",
            format!(
                "the sheet ignites at {} K, which is not over the {} K of the room",
                fire.ignition_temperature.0, fire.ambient_temperature.0
            ),
            "paper ignites at \"350 degC\"",
        );
    }
    findings.positive("fire.burn_time", fire.burn_time.0, "\"1.5 s\"");
    findings.not_negative("fire.heat_of_combustion", fire.heat_of_combustion.0);
    findings.positive("fire.heat_capacity", fire.heat_capacity.0, "\"1300 J/(kg K)\"");
    if fire.heat_capacity_law == HeatCapacityLaw::Inverse {
        findings.positive("fire.ash_capacity", fire.ash_capacity.0, "0.1");
        findings.between("fire.ash_capacity", fire.ash_capacity.0.max(1e-300), 0.0, 1.0);
    }
    findings.not_negative("fire.diffusivity", fire.diffusivity.0);
    findings.not_negative("fire.cooling_rate", fire.cooling_rate.0);
    findings.between("fire.oxygen", fire.oxygen.0, 0.0, 1.0);
    findings.between("fire.humidity", fire.humidity.0, 0.0, 1.0);
    findings.positive("fire.pressure", fire.pressure.0, "\"101.3 kPa\"");
    for (row, heater) in scene.heater.iter().enumerate() {
        let key = format!("heater.{row}");
        if scene.model != Model::Physical {
            findings.add(&key, "only the physical model has heaters", "write `model = \"physical\"`");
        }
        findings.positive(&format!("{key}.flux"), heater.flux.0, "\"25 kW/m2\"");
        findings.positive(&format!("{key}.length"), heater.length.0, "\"10 s\"");
        findings.not_negative(&format!("{key}.start"), heater.start.0);
        findings.not_negative(&format!("{key}.radius"), heater.radius.0);
        region(&key, heater.region.as_ref(), findings);
    }
    if scene.model == Model::Physical {
        let layers = [
            ("thermal_force.law", scene.thermal_force.law != ThermalForceLaw::Off),
            ("curl.law", scene.curl.law != CurlLaw::Off),
        ];
        for (key, on) in layers {
            if on {
                findings.add(key, "it is a law of the 2004 model", "leave it out, or write `model = \"moidu2004\"`");
            }
        }
        if fire.raw.is_some() {
            findings.add("fire.raw", "raw coefficients are those of the 2004 model", "leave [fire.raw] out");
        }
    }
    if let Some(raw) = &fire.raw {
        if !is_uniform(&scene.sheet) {
            findings.add(
                "fire.raw",
                "raw coefficients are per node and mean nothing on a sheet whose nodes differ",
                "use `sheet.shape = \"grid\"` or \"chain\" and no mesh, or leave [fire.raw] out",
            );
        }
        let coefficients = [
            ("fire.raw.node_fuel", raw.node_fuel.map(|q| q.0), true),
            ("fire.raw.k0", raw.k0.map(|q| q.0), false),
            ("fire.raw.k1", raw.k1.map(|q| q.0), false),
            ("fire.raw.k2", raw.k2.map(|q| q.0), false),
            ("fire.raw.k3", raw.k3.map(|q| q.0), false),
            ("fire.raw.structural", raw.structural.map(|q| q.0), false),
            ("fire.raw.shear", raw.shear.map(|q| q.0), false),
            ("fire.raw.flexion", raw.flexion.map(|q| q.0), false),
        ];
        for (key, value, over_zero) in coefficients {
            match (value, over_zero) {
                (Some(value), true) => findings.positive(key, value, "\"1e-6 kg\""),
                (Some(value), false) => findings.not_negative(key, value),
                (None, _) => {}
            }
        }
    }
}

fn mechanics(scene: &Scene, findings: &mut Findings) {
    let mechanics = &scene.mechanics;
    for (key, value) in [
        ("mechanics.structural", mechanics.structural.0),
        ("mechanics.shear", mechanics.shear.0),
        ("mechanics.flexion", mechanics.flexion.0),
        ("mechanics.damping", mechanics.damping.0),
        ("mechanics.spring_damping", mechanics.spring_damping.0),
        ("mechanics.deformation_limit", mechanics.deformation_limit.0),
        ("mechanics.strength", mechanics.strength.0),
    ] {
        findings.not_negative(key, value);
    }
    findings.between("mechanics.residual_stiffness", mechanics.residual_stiffness.0, 0.0, 1.0);
    findings.not_negative("mechanics.inert_fraction", mechanics.inert_fraction.0);
    if mechanics.moves && mechanics.inert_fraction.0 == 0.0 {
        findings.add(
            "mechanics.inert_fraction",
            "at 0 a burnt node has no mass, and no time step is stable",
            "write \"10 %\", or `moves = false` for heat and fuel only",
        );
    }
    // Looser, what is left of each step adds up: a sheet that swings gains energy.
    findings.between("shell.newton_tolerance", scene.shell.newton_tolerance.0, 1e-12, 0.05);
    findings.between("shell.linear_tolerance", scene.shell.linear_tolerance.0, 1e-12, 0.1);
}

fn forces(scene: &Scene, findings: &mut Findings) {
    if scene.curl.law == CurlLaw::Gradient {
        findings.positive("curl.gradient_length", scene.curl.gradient_length.0, "\"1 mm\"");
    }
    findings.not_negative("wind.coefficient", scene.wind.coefficient.0);
    findings.between("wind.gust", scene.wind.gust.0, 0.0, 10.0);
    if scene.wind.gust.0 > 0.0 {
        findings.positive("wind.gust_time", scene.wind.gust_time.0, "\"0.5 s\"");
    }
    in_order("wind.key", scene.wind.key.iter().map(|key| key.time.0), findings);
    if let Some(stretch) = scene.initial.stretch
        && !stretch.iter().all(|factor| factor.is_finite() && *factor > 0.0)
    {
        findings.add(
            "initial.stretch",
            format!("{stretch:?} is not three factors over 0"),
            "[1.0, 1.0, 1.0] leaves the sheet",
        );
    }
}

fn places(scene: &Scene, findings: &mut Findings) {
    let ways = "nodes, box, edge, corner, point or group";
    for (row, pin) in scene.pin.iter().enumerate() {
        let key = format!("pin.{row}");
        findings.not_negative(&format!("{key}.radius"), pin.radius.0);
        let named = !pin.nodes.is_empty()
            || pin.region.is_some()
            || pin.edge.is_some()
            || pin.corner.is_some()
            || pin.point.is_some()
            || pin.group.is_some();
        if !named {
            findings.add(&key, "this row names no part of the sheet to hold", format!("add {ways}"));
        }
        region(&key, pin.region.as_ref(), findings);
    }
    for (row, ignite) in scene.ignite.iter().enumerate() {
        let key = format!("ignite.{row}");
        findings.not_negative(&format!("{key}.radius"), ignite.radius.0);
        if let Some(delay) = &ignite.delay {
            source(&format!("{key}.delay"), &delay.group, &delay.map, findings);
        } else if !ignite.names_a_place() {
            findings.add(
                &key,
                "this row names no part of the sheet to light",
                format!("add {ways}, half_space or map"),
            );
        }
        region(&key, ignite.region.as_ref(), findings);
        findings.not_negative(&format!("{key}.start"), ignite.start.0);
        findings.not_negative(&format!("{key}.length"), ignite.length.0);
        findings.positive(&format!("{key}.temperature"), ignite.temperature.0, "1100");
        if let Some(half_space) = &ignite.half_space {
            let normal = half_space.normal;
            if !(normal.iter().map(|c| c * c).sum::<f64>() > 0.0 && normal.iter().all(|c| c.is_finite())) {
                let hint = "write a vector such as [1.0, 0.0, 0.0]";
                findings.add(format!("{key}.half_space.normal"), "this is no direction", hint);
            }
        }
    }
}

fn motion(scene: &Scene, findings: &mut Findings) {
    let motion = &scene.motion;
    if motion.files.is_none() {
        return;
    }
    if !(motion.fps > 0.0 && motion.fps.is_finite()) {
        findings.add("motion.fps", format!("{} is no number of meshes a second", motion.fps), "write 24");
    }
    findings.positive("motion.pull_time", motion.pull_time.0, "\"30 ms\"");
    for (row, key) in motion.key.iter().enumerate() {
        findings.between(&format!("motion.key.{row}.pull"), key.pull.0, 0.0, 1.0);
    }
    in_order("motion.key", motion.key.iter().map(|key| key.time.0), findings);
    if !scene.mechanics.moves {
        findings.add("mechanics.moves", "a sheet that does not move has no motion", "leave this out, or [motion]");
    }
    if scene.sheet.cockle_height() > 0.0 {
        findings.add("sheet.cockle", "the motion says where the sheet is, cockle and all", "leave this out");
    }
    let meets = !scene.obstacle.is_empty() || scene.contact.self_contact == Some(true);
    if motion.follow == Follow::Exactly && meets {
        let hint = "write `follow = \"drawn\"`, or take obstacles and contact out";
        findings.add("motion.follow", "a sheet that follows exactly can meet nothing", hint);
    }
}

/// Rows that count up in time.
fn in_order(key: &str, times: impl Iterator<Item = f64>, findings: &mut Findings) {
    let times: Vec<f64> = times.collect();
    for (row, pair) in times.windows(2).enumerate().filter(|(_, pair)| pair[1] <= pair[0]) {
        let problem = format!("{} s is not after the {} s of the row before", pair[1], pair[0]);
        findings.add(format!("{key}.{}.time", row + 1), problem, "put the rows in the order of their times");
    }
}

/// Paint comes from an attribute or from a picture.
fn source(key: &str, group: &Option<String>, map: &Option<String>, findings: &mut Findings) {
    if group.is_some() == map.is_some() {
        findings.add(key, "paint comes from one of two places", "give either `group` or `map`");
    }
}

fn paint(scene: &Scene, findings: &mut Findings) {
    let Paint { fuel, moisture, thickness, strength, speed, noburn } = &scene.paint;
    let gains = [
        ("paint.fuel", fuel),
        ("paint.moisture", moisture),
        ("paint.thickness", thickness),
        ("paint.strength", strength),
        ("paint.speed", speed),
    ];
    for (key, gain) in gains {
        let Some(gain) = gain else { continue };
        source(key, &gain.group, &gain.map, findings);
        for (end, value) in [("low", gain.low.0), ("high", gain.high.0)] {
            findings.not_negative(&format!("{key}.{end}"), value);
        }
    }
    if let Some(mask) = noburn {
        source("paint.noburn", &mask.group, &mask.map, findings);
    }
    let physical = scene.model == Model::Physical;
    let painted = gains.iter().skip(1).filter(|(_, gain)| gain.is_some()).map(|(key, _)| *key);
    for key in painted.chain(noburn.as_ref().map(|_| "paint.noburn")).filter(|_| !physical) {
        findings.add(key, "only the physical model knows this", "add `model = \"physical\"`, or paint `fuel`");
    }
    if fuel.is_some() && scene.fire.raw.is_some() {
        findings.add("paint.fuel", "raw coefficients say how much fuel a node has", "leave [fire.raw] out");
    }
    findings.between("fire.speed_gain", scene.fire.speed_gain.0, 0.02, 50.0);
    if scene.fire.speed_gain.0 != 1.0 && !physical {
        let hint = "add `model = \"physical\"`; in the 2004 model burn_time and diffusivity set the speed";
        findings.add("fire.speed_gain", "only the physical model knows this", hint);
    }
}

fn contact(scene: &Scene, findings: &mut Findings) {
    let contact = &scene.contact;
    if let Some(thickness) = contact.thickness {
        findings.positive("contact.thickness", thickness.0, "\"0.1 mm\"");
    }
    findings.not_negative("contact.friction", contact.friction.0);
    findings.positive("contact.modulus", contact.modulus.0, "\"2 kPa\"");
    findings.positive("contact.slip", contact.slip.0, "\"1 mm/s\"");
    let meets = !scene.obstacle.is_empty() || contact.self_contact == Some(true);
    if meets && contact.thickness.is_none() {
        findings.positive("shell.thickness", scene.shell.thickness.0, "\"0.1 mm\"");
    }
    for (row, obstacle) in scene.obstacle.iter().enumerate() {
        let key = |name: &str| format!("obstacle.{row}.{name}");
        match obstacle.shape {
            ObstacleShape::Plane => {
                if let Some(normal) = obstacle.normal
                    && !(normal.iter().map(|c| c * c).sum::<f64>() > 0.0 && normal.iter().all(|c| c.is_finite()))
                {
                    findings.add(key("normal"), "this is no direction", "write a vector such as [0.0, 1.0, 0.0]");
                }
            }
            ObstacleShape::Sphere => findings.positive(&key("radius"), obstacle.radius.0, "\"50 mm\""),
            ObstacleShape::Box => {
                let least = obstacle.size.iter().map(|q| q.0).fold(f64::INFINITY, f64::min);
                findings.positive(&key("size"), least, "[\"0.3 m\", \"20 mm\", \"0.3 m\"]");
            }
            ObstacleShape::Mesh if obstacle.mesh.is_none() => {
                let hint = "add `mesh = \"file.obj\"`, or `files = \"folder\"` for one that is animated";
                findings.add(format!("obstacle.{row}"), "this obstacle is a mesh, but no file is named", hint);
            }
            ObstacleShape::Mesh => {}
        }
        if obstacle.shape != ObstacleShape::Mesh && obstacle.mesh.is_some() {
            findings.add(key("mesh"), "this mesh would not be used", "add `shape = \"mesh\"`");
        }
        if obstacle.shape != ObstacleShape::Mesh && obstacle.files.is_some() {
            findings.add(key("files"), "these meshes would not be used", "add `shape = \"mesh\"`");
        }
        if !(obstacle.fps > 0.0 && obstacle.fps.is_finite()) {
            findings.add(key("fps"), format!("{} is no number of meshes a second", obstacle.fps), "write 24");
        }
        if obstacle.shape != ObstacleShape::Plane && obstacle.normal.is_some() {
            findings.add(key("normal"), "only a plane has a normal", "use `rotate`");
        }
        findings.not_negative(&key("friction"), obstacle.friction.map_or(0.0, |q| q.0));
        findings.not_negative(&key("stop"), obstacle.stop.map_or(0.0, |q| q.0));
    }
}

fn region(key: &str, region: Option<&Region>, findings: &mut Findings) {
    let Some(region) = region else { return };
    if (0..3).any(|k| region.low[k].0 > region.high[k].0) {
        findings.add(format!("{key}.box"), "the low corner is not under the high corner", "swap them, axis by axis");
    }
}

fn time(scene: &Scene, findings: &mut Findings) {
    let time = &scene.time;
    if time.frames == 0 && scene.expect.is_empty() {
        findings.add("time.frames", "0 frames leave nothing to see", "write 192 for eight seconds");
    }
    if !(time.fps > 0.0 && time.fps.is_finite()) {
        findings.add("time.fps", format!("{} is no number of frames a second", time.fps), "write 24");
    }
    findings.positive("time.step", time.step.0, "\"2 ms\"");
    if time.substeps == Some(0) {
        findings.add("time.substeps", "0 substeps do not move the sheet", "write 1 or more, or leave it out");
    }
}

fn output(output: &Output, findings: &mut Findings) {
    if output.size.iter().any(|side| !(16..=16384).contains(side) || side % 2 == 1) {
        findings.add(
            "output.size",
            format!("{} by {} pixels cannot be filmed", output.size[0], output.size[1]),
            "write even numbers from 16 to 16384, such as [960, 720]",
        );
    }
    let camera = &output.camera;
    if !(camera.zoom > 0.0 && camera.zoom.is_finite()) {
        findings.add(
            "output.camera.zoom",
            format!("{} is no zoom", camera.zoom),
            "1 shows the whole sheet, 2 comes nearer",
        );
    }
    if !(camera.field_of_view.0 > 0.0 && camera.field_of_view.0 < 3.1) {
        findings.add(
            "output.camera.field_of_view",
            format!("{} rad is no field of view", camera.field_of_view.0),
            "write \"35 deg\"",
        );
    }
}

fn checks(scene: &Scene, findings: &mut Findings) {
    let mut names = BTreeSet::new();
    for (row, probe) in scene.probe.iter().enumerate() {
        if probe.name.is_empty() {
            findings.add(format!("probe.{row}"), "this probe has no name", "add `name = ...`: `expect` refers to it");
        } else if !names.insert(probe.name.clone()) {
            findings.add(format!("probe.{row}.name"), format!("there are two probes \"{}\"", probe.name), "rename one");
        }
        if probe.measure.is_empty() {
            let hint = "add `measure = ...`: `charcloth list measures` has the kinds";
            findings.add(format!("probe.{row}"), "this probe does not say what it measures", hint);
        }
        let key = format!("probe.{row}.direction");
        findings.finite(&key, probe.direction.as_ref().map_or(&[], |d| d.as_slice()));
    }
    let numbers = Summary::NUMBERS.iter().map(|key| (*key).to_owned());
    let known: Vec<String> = names.into_iter().chain(numbers).collect();
    for (row, expect) in scene.expect.iter().enumerate() {
        let key = format!("expect.{row}");
        let quantity = expect.quantity.strip_prefix(ORDER_OF).unwrap_or(&expect.quantity);
        if quantity.is_empty() {
            findings.add(
                &key,
                "this row names no quantity",
                format!("add `quantity = ...`, one of {}", known.join(", ")),
            );
        } else if !known.iter().any(|name| name == quantity) {
            let hint = match charcloth::registry::nearest(quantity, known.iter().map(String::as_str)) {
                Some(near) => format!("did you mean \"{near}\"?"),
                None => format!("there are: {}", known.join(", ")),
            };
            let problem = format!("\"{quantity}\" is neither a number of the summary nor the name of a probe");
            findings.add(format!("{key}.quantity"), problem, hint);
        }
        expectation(&key, expect, findings);
    }
}

fn expectation(key: &str, expect: &Expect, findings: &mut Findings) {
    let bounded = expect.at_least.is_some() || expect.at_most.is_some();
    let tolerant = expect.tolerance.is_some() || expect.relative_tolerance.is_some();
    match (expect.value.is_some(), tolerant, bounded) {
        (true, false, _) => findings.add(
            format!("{key}.value"),
            "a value without a tolerance is met by nothing",
            "add `tolerance = ...` or `relative_tolerance = \"1 %\"`",
        ),
        (false, false, false) => {
            findings.add(key, "this row expects nothing", "add `value` and `tolerance`, or `at_least`, or `at_most`");
        }
        (false, true, _) => {
            let there = if expect.tolerance.is_some() { "tolerance" } else { "relative_tolerance" };
            findings.add(format!("{key}.{there}"), "there is no value to be near to", "add `value = ...`");
        }
        _ => {}
    }
    findings.not_negative(&format!("{key}.tolerance"), expect.tolerance.unwrap_or(0.0));
    findings.not_negative(&format!("{key}.relative_tolerance"), expect.relative_tolerance.map_or(0.0, |q| q.0));
    for (name, value) in [("value", expect.value), ("at_least", expect.at_least), ("at_most", expect.at_most)] {
        findings.finite(&format!("{key}.{name}"), value.as_slice());
    }
    if expect.source.trim().is_empty() {
        let hint = "add `source = ...`: where the expectation and its tolerance come from";
        findings.add(key, "this row has no source", hint);
    }
}
