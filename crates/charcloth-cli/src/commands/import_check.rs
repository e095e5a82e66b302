//! `charcloth import-check`: what a mesh file holds, and what burning it would take.

use super::{Outcome, Run, run::set_threads};
use crate::files::Files;
use crate::run_folder::{human_bytes, human_time};
use crate::scenes;
use anyhow::Context;
use charcloth::scene::LengthUnit;
use charcloth::simulation::Simulation;
use charcloth_io::importers::{MeshReport, UNITS, coarse, inspect};
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Shells that are listed one by one.
const MOST_SHELLS: usize = 12;

/// Which file.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Mesh file
    file: PathBuf,
    /// What length the file counts in [default: the likeliest]
    #[arg(long, value_name = "UNIT", value_parser = PossibleValuesParser::new(UNITS.iter().map(|(name, _)| *name)))]
    unit: Option<String>,
    /// Do not try a frame: no estimate of time and memory
    #[arg(long)]
    no_estimate: bool,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        let asked = self.unit.as_deref().and_then(|name| UNITS.iter().find(|(there, _)| *there == name));
        let report = inspect(&self.file, asked.map(|(_, unit)| *unit))?;
        println!("{}", self.file.display());
        print!("{}", describe(&report, asked.is_some()));
        if !self.no_estimate {
            set_threads(self.threads)?;
            println!("  {:10}{}", "estimate", self.estimate(&report)?);
        }
        Ok(Outcome::Fine)
    }
}

impl Arguments {
    /// Burns the first frame of the default scene with the mesh, and says what the whole would take.
    fn estimate(&self, report: &MeshReport) -> anyhow::Result<String> {
        let file = std::path::absolute(&self.file)?;
        let file = file.to_str().context("the name of the file is not text: rename it for an estimate")?;
        let overrides = [format!("sheet.mesh={file}"), format!("sheet.unit={}", unit_name(report.unit))];
        let case = scenes::one_case(scenes::open(scenes::DEFAULT, &overrides)?, None)?;
        let (inputs, _) = case.read_inputs(&Files)?;
        let mut simulation = Simulation::build(&case.scene, &inputs).map_err(|error| case.explain(&error))?;
        let start = Instant::now();
        simulation.advance_frame()?;
        let frame = start.elapsed().as_secs_f64();
        let summary = simulation.summary();
        let frames = case.scene.time.frames;
        Ok(format!(
            "scene {}: {} nodes, {} springs; {} for {frames} frames at the pace of the first, {} of memory",
            scenes::DEFAULT,
            summary.nodes,
            summary.springs,
            human_time(frame * f64::from(frames)),
            human_bytes(summary.peak_memory_bytes),
        ))
    }
}

fn unit_name(unit: LengthUnit) -> &'static str {
    UNITS.iter().find(|(_, there)| *there == unit).map_or("m", |(name, _)| name)
}

/// The report, a line a fact.
fn describe(report: &MeshReport, asked: bool) -> String {
    let mesh = &report.mesh;
    let mut text = String::new();
    let mut line = |name: &str, fact: String| {
        // Writing to text cannot fail.
        let _ = writeln!(text, "  {name:10}{fact}");
    };
    line("format", format!("{}, {} points, {} faces", report.format, report.file_points, report.file_faces));
    line("surface", format!("{} points, {} triangles", mesh.positions.len(), mesh.triangles.len()));
    let [x, y, z] = (report.size * report.unit.metres()).to_array();
    let name = unit_name(report.unit);
    let why = match (asked, report.format) {
        (true, _) => "as you say",
        (false, "gltf") => "as glTF says",
        (false, "usd") => "as the file says",
        (false, _) => "by its size",
    };
    let say =
        if asked || report.unit == LengthUnit::M { String::new() } else { format!("; burn it with sheet.unit={name}") };
    line("unit", format!("{name}, {why}: {x:.4} x {y:.4} x {z:.4} m{say}"));
    let [shortest, median, longest] = report.edges.map(|edge| edge * 1e3);
    line("edges", format!("{shortest:.3} to {longest:.3} mm, half of them under {median:.3} mm"));
    let area: f64 = report.shells.iter().map(|shell| shell.area).sum();
    let holes: usize = report.shells.iter().map(|shell| shell.holes()).sum();
    let closed = report.shells.iter().filter(|shell| shell.borders == 0).count();
    line("shells", format!("{}, of them closed {closed}; holes {holes}; area {area:.5} m2", report.shells.len()));
    if report.shells.len() > 1 {
        for (k, shell) in report.shells.iter().take(MOST_SHELLS).enumerate() {
            let (triangles, area, borders) = (shell.triangles, shell.area, shell.borders);
            line("", format!("{k}: {triangles} triangles, {area:.5} m2, borders {borders}"));
        }
        if report.shells.len() > MOST_SHELLS {
            line("", format!("and {} more", report.shells.len() - MOST_SHELLS));
        }
    }
    line("texture", describe_uv(report.uv.map(|ends| ends.map(|uv| uv.to_array()))));
    let painted: Vec<&str> = mesh.painted.keys().map(String::as_str).collect();
    line("painted", if painted.is_empty() { "nothing".to_owned() } else { painted.join(", ") });
    for remark in mesh.remarks.iter().cloned().chain(coarse(mesh, 0)) {
        line("note", remark);
    }
    text
}

/// The lowest and the highest texture coordinate.
fn describe_uv(uv: Option<[[f32; 2]; 2]>) -> String {
    let Some(uv) = uv else { return "no coordinates: pictures cannot be laid on it".to_owned() };
    // A thousandth is rounding, and less than a texel.
    let inside = uv.iter().flatten().all(|v| (-1e-3..=1.001).contains(v));
    let beyond = if inside { "" } else { "; maps show what lies from 0 to 1" };
    // Nothing, not minus nothing.
    let [[u, v], [u_high, v_high]] = uv.map(|uv| uv.map(|v| (v * 1e3).round() / 1e3 + 0.0));
    format!("coordinates from ({u:.3}, {v:.3}) to ({u_high:.3}, {v_high:.3}){beyond}")
}
