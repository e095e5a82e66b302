//! Linear systems of implicit steps: block matrices, multigrid, conjugate gradients.

pub mod blocks;
pub mod conjugate_gradients;
pub mod couplings;
pub mod multigrid;

use blocks::Pattern;
use couplings::Couplings;
use glam::{DMat3, DVec3};

/// Symmetric matrix of an implicit step: blocks that tie neighbours, and numbers that tie nodes further off in all three
/// directions alike, as bending does.
#[derive(Debug, Clone, Default)]
pub struct StepMatrix {
    /// Which blocks there are; every row has its diagonal.
    pub pattern: Pattern,
    /// The blocks.
    pub blocks: Vec<DMat3>,
    /// Where the diagonals are.
    pub diagonal: Vec<u32>,
    /// Which numbers there are, none of them on the diagonal.
    pub ties: Pattern,
    /// The numbers.
    pub tie: Vec<f64>,
    /// What contact ties, beyond all patterns.
    pub couplings: Couplings,
}

impl StepMatrix {
    /// A matrix of these patterns, with nothing in it.
    pub fn zeros(pattern: Pattern, ties: Pattern) -> Self {
        let diagonal =
            (0..pattern.rows()).map(|i| pattern.find(i, i as u32).expect("a matrix has its diagonal") as u32).collect();
        let (blocks, tie) = (vec![DMat3::ZERO; pattern.blocks()], vec![0.0; ties.blocks()]);
        Self { pattern, blocks, diagonal, ties, tie, couplings: Couplings::default() }
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[DVec3], y: &mut [DVec3], parallel: bool) {
        blocks::by_rows(y, parallel, |first, y| {
            for (k, y) in y.iter_mut().enumerate() {
                let row = self.pattern.row(first + k);
                let mut sum = DVec3::ZERO;
                for (j, block) in self.pattern.column[row.clone()].iter().zip(&self.blocks[row]) {
                    sum += *block * x[*j as usize];
                }
                let row = self.ties.row(first + k);
                for (j, tie) in self.ties.column[row.clone()].iter().zip(&self.tie[row]) {
                    sum += *tie * x[*j as usize];
                }
                if !self.couplings.is_empty() {
                    sum += self.couplings.row_times(x, first + k);
                }
                *y = sum;
            }
        });
    }
}
