//! When a step counts as solved, and how closely what leads there is.

use super::Implicit;
use crate::contact::response::Response;
use crate::scene;
use crate::solver::blocks::sum_by_rows;

/// Part of the gain under which a step counts as solved that linear systems are solved to: the multigrid cycle, which
/// measures it, takes what is left for less than it is.
// tuned: 0.001 to 0.1; at 0.001 as much time as it saves is lost, at 0.01 a sheet that falls is off by half more
const CLOSER: f64 = 0.003;
/// The same where something touches, and what touches changes from iteration to iteration.
// tuned: 0.01 to 0.3; what slides on a slope falls short by 0.2, 0.4, 0.7 and 1.8 % at 0.01, 0.02, 0.03 and 0.1
const CLOSER_IN_CONTACT: f64 = 0.02;
/// Speed that is as good as none [m/s]: a Newton iteration that gains less energy than its square ends the step.
const STILL: f64 = 1e-5;

/// The sheet's mass [kg], and what it has of energy by its speed, and would have by that which gravity gives it in the step
/// [J].
pub(super) struct Pace {
    mass: f64,
    pub moving: f64,
    pub falling: f64,
}

/// What the gains of the iterations of a step are measured by.
pub(super) struct Measure {
    newton: f64,
    linear: f64,
    closer: f64,
    /// A gain that is as good as none [J].
    still: f64,
    /// What the sheet would have of energy if all of it went along with the scenery [J].
    along: f64,
    /// Bounds on the first gain [J]. Where something touches, the speed of all is the upper one: friction follows from the
    /// force of contact, which it would leave open as the lower, and a guess that presses together what touches gains far
    /// more than that.
    least: f64,
    most: f64,
    first: Option<f64>,
}

impl Implicit {
    /// Energies of a step of length `h` [s].
    pub(super) fn pace(&mut self, h: f64, parallel: bool) -> Pace {
        let moving = sum_by_rows(self.mass.len(), parallel, &mut self.sums, |part| {
            part.map(|i| self.mass[i] * self.speed[i].length_squared()).sum()
        });
        let mass = self.mass.iter().sum();
        let falling = (self.scene.gravity.0 * h).powi(2) * mass;
        Pace { mass, moving: 0.5 * moving, falling: 0.5 * falling }
    }
}

impl Measure {
    pub fn of(shell: &scene::Shell, pace: &Pace, contact: Option<&Response>) -> Self {
        let Pace { mass, moving, falling } = *pace;
        let along = 0.5 * mass * contact.map_or(0.0, Response::top_speed).powi(2);
        let (least, most, closer) = match contact {
            Some(_) => (moving.min(falling), moving.max(falling).max(along), CLOSER_IN_CONTACT),
            None => (moving, f64::INFINITY, CLOSER),
        };
        let [newton, linear] = [shell.newton_tolerance.0, shell.linear_tolerance.0];
        Self { newton, linear, closer, still: 0.5 * STILL * STILL * mass, along, least, most, first: None }
    }

    /// Error that the linear systems of an iteration are solved to: over that at the start, in the norm of energy, or as
    /// energy [J]. What the scenery does to bring the sheet along is no measure of what is left.
    pub fn linear(&self, carried: bool) -> [f64; 2] {
        let [relative, energy] = if carried {
            [0.0, self.along]
        } else {
            [self.linear, self.closer * self.newton * self.first.unwrap_or(self.least)]
        };
        [relative, energy.max(0.01 * self.still)]
    }

    /// Takes the gain of an iteration [J] for the first, if it is.
    pub fn take(&mut self, gain: f64) {
        self.first.get_or_insert(gain.clamp(self.least, self.most));
    }

    /// Whether an iteration that gains so much [J] may be the last.
    pub fn is_enough(&self, gain: f64) -> bool {
        gain <= (self.newton * self.first.unwrap_or(self.least)).max(self.still)
    }

    /// Whether a gain [J] is as good as none.
    pub fn is_still(&self, gain: f64) -> bool {
        gain <= self.still
    }
}
