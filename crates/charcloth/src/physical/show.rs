//! What pictures and mechanics see of burning: char and ash, how stiff and how sound the sheet still is.

use super::{Physical, masses};
use crate::gases::FACES;
use crate::sheet::{BurnNodes, SheetState};

/// Part of a node's char that is gone when what is left no longer holds together: ash that falls.
const ASH_FALLS: f64 = 0.9; // tuned: ash of paper crumbles at a touch, 0.7 to 1

/// How fast char loses stiffness and strength while it burns away: `exp(-6 a)` for the part a that has gone.
// tuned: graphites are said to lose about half of their strength with the first tenth of their mass, char of paper was not
// found; strain at failure stays [GeneralAtomics1981]; 4 to 10
const BURN_OFF: f64 = 6.0;

/// Between these temperatures paper goes from as stiff as it was to as soft as char [K]: it has lost its stiffness before
/// it shrinks.
// tuned: no measurement of thin sheets was found; 200 to 400 degC
const SOFTENS: f64 = 473.15;
const SOFT: f64 = 673.15;

impl Physical {
    /// Brings the columns of the burn nodes that both models share up to date, for pictures, files and mechanics: where
    /// something has happened since the last time, or everywhere, which is called for when nodes have split.
    pub fn show(&mut self, state: &mut SheetState, all: bool) {
        let mut shown = std::mem::take(&mut self.shown);
        self.awake.touched(state.burn.len(), all, &mut shown);
        for i in &shown {
            let i = *i as usize;
            let fuel = self.fuel(state, i);
            let SheetState { burn, front, back, .. } = &mut *state;
            let dry_mass = front.dry_mass[i] + back.dry_mass[i];
            let whole = front.fibre[i] + back.fibre[i] + front.polymer[i] + back.polymer[i];
            let char = front.young_char[i] + back.young_char[i] + front.char[i] + back.char[i];
            let left = (whole / (self.burns * dry_mass)).clamp(0.0, 1.0);
            burn.fuel[i] = fuel;
            burn.charred[i] = 1.0 - left;
            // Char that ought to be there, if none had burnt.
            let made = self.char_yield * dry_mass * (1.0 - left);
            burn.ashed[i] = if left < 0.5 { (1.0 - char / made.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0) } else { 0.0 };
            let whole = Self::whole(burn, i);
            burn.stiffness[i] = whole + (1.0 - whole) * self.char_stiffness * Self::sound(burn, i);
            burn.mass[i] = masses(front, i).iter().chain(&masses(back, i)).sum();
            burn.flame[i] = 0.0;
            for face in 0..FACES {
                if let (Some(flame), Some(height)) =
                    (self.exchange.flame[face].get(i), self.exchange.flame_height[face].get(i))
                    && *flame > 0.1
                {
                    burn.flame[i] = burn.flame[i].max(*height);
                }
            }
        }
        self.shown = shown;
    }

    /// Part of a node that is still sheet, by its fibre and by the heat that it has seen (w of Eq. 15.4).
    pub fn whole(burn: &BurnNodes, i: usize) -> f64 {
        let softened = ((burn.peak_temperature[i] - SOFTENS) / (SOFT - SOFTENS)).clamp(0.0, 1.0);
        (1.0 - burn.charred[i]).min(1.0 - softened)
    }

    /// Part of the stiffness and strength of its char that burning away has left a node (Eq. 15.4).
    pub fn sound(burn: &BurnNodes, i: usize) -> f64 {
        (-BURN_OFF * burn.ashed[i]).exp()
    }

    /// Whether what is left between some burn nodes still holds together.
    pub fn holds(burn: &BurnNodes, nodes: [usize; 3]) -> bool {
        nodes.iter().any(|i| burn.ashed[*i] < ASH_FALLS)
    }
}
