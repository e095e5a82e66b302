//! `charcloth bench`: where the time of a simulation goes.

mod kernels;

use super::{Outcome, Run, run::set_threads};
use crate::files::Files;
use crate::scenes;
use charcloth::frame::Null;
use charcloth::simulation::{Simulation, Summary};
use clap::Args;
use std::time::Instant;

/// What to time.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Scene file or built-in scene
    #[arg(default_value = scenes::DEFAULT)]
    scene: String,
    /// Change a key of the scene, such as sheet.spacing=2mm
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Case of a file that has several
    #[arg(long, value_name = "NAME")]
    case: Option<String>,
    /// Frames to simulate [default: those of the scene]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Time the two inner loops instead, on a shuffled sheet of their own, for each vector unit and 1 and 2 threads
    #[arg(long, conflicts_with_all = ["scene", "overrides", "case", "frames"])]
    kernels: bool,
    /// Nodes of that sheet
    #[arg(long, value_name = "N", default_value_t = 65_536, requires = "kernels")]
    nodes: u32,
}

impl Run for Arguments {
    fn run(self) -> anyhow::Result<Outcome> {
        if self.kernels {
            let threads = self.threads.map_or(vec![1, 2], |n| vec![usize::from(n)]);
            print!("{}", kernels::report(self.nodes as usize, &threads)?);
            return Ok(Outcome::Fine);
        }
        set_threads(self.threads)?;
        let case = scenes::one_case(scenes::open(&self.scene, &self.overrides)?, self.case.as_deref())?;
        let (inputs, _) = case.read_inputs(&Files)?;
        let start = Instant::now();
        let mut simulation = Simulation::build(&case.scene, &inputs).map_err(|error| case.explain(&error))?;
        let build = start.elapsed().as_secs_f64();
        let start = Instant::now();
        simulation.run(self.frames.unwrap_or(case.scene.time.frames), &mut Null)?;
        let wall = start.elapsed().as_secs_f64();
        print!("{}", report(&simulation.summary(), case.scene.time.fps, build, wall));
        Ok(Outcome::Fine)
    }
}

/// The figures, with the scene and the sizes they hold for.
fn report(summary: &Summary, fps: f64, build: f64, wall: f64) -> String {
    let Summary { scene, nodes, springs, triangles, frames, threads, substeps, time_step_s, .. } = summary;
    let mut text = format!(
        "{scene}: {nodes} nodes, {springs} springs, {triangles} triangles, {frames} frames, {threads} threads\n"
    );
    text.push_str(&format!("steps of {:.3} ms, {substeps} substeps each\n\n", time_step_s * 1e3));
    let mut stages: Vec<(&str, f64)> = summary.stage_wall_s.iter().map(|(name, wall)| (name.as_str(), *wall)).collect();
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    stages.push(("build", build));
    stages.push(("all frames", wall));
    let width = stages.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    for (name, seconds) in stages {
        let part = if wall > 0.0 { 100.0 * seconds / wall } else { 0.0 };
        text.push_str(&format!("  {name:width$}  {seconds:9.3} s  {part:5.1} %\n"));
    }
    let steps = f64::from(*frames) / fps / time_step_s;
    let rate = |count: usize| count as f64 * steps * f64::from((*substeps).max(1)) / wall;
    text.push_str(&format!(
        "\n{:.3e} node substeps a second\n{:.3e} spring substeps a second\n",
        rate(*nodes),
        rate(*springs)
    ));
    if summary.newton_iterations > 0 {
        let (newton, linear) = (summary.newton_iterations as f64, summary.linear_iterations as f64);
        text.push_str(&format!(
            "{:.2} Newton iterations a step, {:.1} linear ones each\n",
            newton / steps,
            linear / newton
        ));
    }
    text.push_str(&format!("s_per_frame={:.4}", wall / f64::from((*frames).max(1))));
    if let Some(stretch) = summary.stretch {
        text.push_str(&format!(" stretch={stretch:.6}"));
    }
    text.push_str(&format!(" strain_p99={:.2e} strain_max={:.2e}\n", summary.strain_p99, summary.strain_max));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_names_stages_and_rates() {
        let summary = Summary {
            scene: "a4".to_owned(),
            nodes: 1000,
            springs: 3000,
            frames: 24,
            substeps: 10,
            time_step_s: 1e-3,
            stage_wall_s: [("springs".to_owned(), 1.5), ("heat".to_owned(), 0.25)].into(),
            ..Summary::default()
        };
        let text = report(&summary, 24.0, 0.1, 2.0);
        assert!(text.find("springs  ").unwrap() < text.find("heat").unwrap());
        assert!(text.contains("75.0 %") && text.contains("5.000e6 node") && text.contains("1.500e7 spring"), "{text}");
    }
}
