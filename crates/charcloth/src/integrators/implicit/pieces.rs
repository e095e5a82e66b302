//! Pieces that hang on nothing: what is left of their momentum is put right exactly.

use super::Implicit;
use crate::sheet::NONE;
use glam::DVec3;

impl Implicit {
    /// Numbers the connected pieces.
    pub(super) fn find_pieces(&mut self) {
        let count = self.fixed.len();
        self.piece = vec![NONE; count];
        self.floats.clear();
        let mut found = Vec::new();
        for start in 0..count {
            if self.piece[start] != NONE {
                continue;
            }
            let piece = self.floats.len() as u32;
            self.piece[start] = piece;
            found.push(start as u32);
            let mut floats = true;
            while let Some(i) = found.pop() {
                floats &= !self.fixed[i as usize];
                for j in self.matrix.pattern.columns(i as usize) {
                    if self.piece[*j as usize] == NONE {
                        self.piece[*j as usize] = piece;
                        found.push(*j);
                    }
                }
            }
            self.floats.push(floats);
        }
    }

    /// Puts right what the linear solver has left of the momentum of pieces that hang on nothing: elastic forces cannot
    /// change it, so the last word needs no iteration.
    pub(super) fn balance_momentum(&mut self) {
        self.touched.clear();
        self.touched.resize(self.floats.len(), false);
        if let Some(contact) = &self.contact {
            contact.touched(|i| self.touched[self.piece[i] as usize] = true);
        }
        self.piece_sums.clear();
        self.piece_sums.resize(self.floats.len(), (DVec3::ZERO, 0.0));
        for (i, piece) in self.piece.iter().enumerate() {
            let (left, mass) = &mut self.piece_sums[*piece as usize];
            *left += self.rest_of_residual[i];
            *mass += self.diagonal[i];
        }
        for (i, piece) in self.piece.iter().enumerate() {
            if self.floats[*piece as usize] && !self.touched[*piece as usize] {
                let (left, mass) = self.piece_sums[*piece as usize];
                self.correction[i] += left / mass;
            }
        }
    }
}
