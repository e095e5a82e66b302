//! Runs a scene and compares what comes out with its `expect` rows.

use crate::error::Error;
use crate::frame::Null;
use crate::scene::{Expect, Scene};
use crate::simulation::{Inputs, Simulation, Summary};

/// One compared quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckRow {
    /// Quantity, as the scene names it.
    pub quantity: String,
    /// What was expected: a value, or a bound such as ">= 0.2".
    pub expected: String,
    /// What came out.
    pub got: f64,
    /// Distance from the expected value, or by how far a bound is missed.
    pub error: f64,
    /// Allowed distance.
    pub tolerance: f64,
    /// Where the expectation comes from.
    pub source: String,
    /// Whether it passed.
    pub pass: bool,
}

/// A quantity that begins so is the order of convergence of another: the scene runs with its step, half and a quarter.
pub const ORDER_OF: &str = "order of ";

/// Runs the scene and compares.
pub fn run(scene: &Scene, inputs: &Inputs) -> Result<Vec<CheckRow>, Error> {
    let base = Quantities::of(scene, inputs)?;
    let mut halved: Option<[Quantities; 2]> = None;
    let mut rows = Vec::new();
    for (row, expect) in scene.expect.iter().enumerate() {
        let got = match expect.quantity.strip_prefix(ORDER_OF) {
            None => base.value(&expect.quantity, row)?,
            Some(quantity) => {
                if halved.is_none() {
                    halved = Some([
                        Quantities::of(&finer(scene, 2.0), inputs)?,
                        Quantities::of(&finer(scene, 4.0), inputs)?,
                    ]);
                }
                let [half, quarter] = halved.as_ref().expect("just run");
                let [a, b, c] = [base.value(quantity, row)?, half.value(quantity, row)?, quarter.value(quantity, row)?];
                ((a - b) / (b - c)).abs().log2()
            }
        };
        rows.push(compare(expect, got));
    }
    Ok(rows)
}

/// The scene with a step so many times shorter.
fn finer(scene: &Scene, times: f64) -> Scene {
    let mut finer = scene.clone();
    finer.time.step.0 /= times;
    finer
}

/// What a run came to.
struct Quantities {
    summary: Summary,
    probes: Vec<(String, f64)>,
}

impl Quantities {
    fn of(scene: &Scene, inputs: &Inputs) -> Result<Self, Error> {
        let mut simulation = Simulation::build(scene, inputs)?;
        simulation.run(scene.time.frames, &mut Null)?;
        let probes = scene
            .probe
            .iter()
            .map(|probe| (probe.name.clone(), simulation.probe(&probe.name).unwrap_or(f64::NAN)))
            .collect();
        Ok(Self { summary: simulation.summary(), probes })
    }

    fn value(&self, quantity: &str, row: usize) -> Result<f64, Error> {
        let probe = self.probes.iter().find(|(name, _)| name == quantity).map(|(_, value)| *value);
        probe.or_else(|| self.summary.value(quantity)).ok_or_else(|| {
            Error::scene(
                format!("expect.{row}.quantity"),
                format!("\"{quantity}\" is neither a probe of the scene nor a number of the summary"),
                format!("the summary has: {}", Summary::NUMBERS.join(", ")),
            )
        })
    }
}

fn compare(expect: &Expect, got: f64) -> CheckRow {
    let value = expect.value;
    let tolerance = match value {
        Some(value) => {
            expect.tolerance.unwrap_or(0.0).max(expect.relative_tolerance.map_or(0.0, |part| part.0 * value.abs()))
        }
        None => 0.0,
    };
    let mut error = 0.0f64;
    let mut expected = Vec::new();
    if let Some(value) = value {
        error = error.max((got - value).abs());
        expected.push(format!("{value}"));
    }
    if let Some(least) = expect.at_least {
        error = error.max(least - got);
        expected.push(format!(">= {least}"));
    }
    if let Some(most) = expect.at_most {
        error = error.max(got - most);
        expected.push(format!("<= {most}"));
    }
    CheckRow {
        quantity: expect.quantity.clone(),
        expected: expected.join(", "),
        got,
        error: if got.is_nan() { f64::NAN } else { error },
        tolerance,
        source: expect.source.clone(),
        pass: got.is_finite() && error <= tolerance && !expected.is_empty(),
    }
}
