//! Springs that break where the shell is pulled harder than it bears.

use super::super::Step;
use super::Implicit;
use crate::scene::Threshold;
use crate::sheet::{NONE, SheetState, SpringKind};

impl Implicit {
    /// Breaks the springs along which the shell is pulled harder than it can bear (Eq. 9.1). Returns their number.
    pub(super) fn break_springs(&self, state: &mut SheetState, step: &Step<'_>) -> usize {
        let mechanics = &self.scene.mechanics;
        if mechanics.strength.0 <= 0.0 {
            return 0;
        }
        let mut broken = 0;
        for s in 0..state.springs.len() {
            if state.springs.broken[s] != 0 || state.springs.kind[s] != SpringKind::Structural as u8 {
                continue;
            }
            let ends = state.springs.ends[s];
            let carriers = state.springs.carriers[s].into_iter().filter(|t| *t != NONE);
            let (sum, bears, count) = carriers
                .filter_map(|t| Some((self.shell.tension_along(t, ends)?, state.rest.strength[t as usize])))
                .fold((0.0, 0.0, 0.0), |(sum, bears, count), (pull, strength)| {
                    (sum + pull, bears + strength, count + 1.0)
                });
            let left = match mechanics.threshold {
                Threshold::Scaled => step.factors.stiffness[s],
                Threshold::Fixed => 1.0,
            };
            if count > 0.0 && sum > mechanics.strength.0 * left * bears {
                state.springs.broken[s] = 1;
                broken += 1;
            }
        }
        broken
    }
}
