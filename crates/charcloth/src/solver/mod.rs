//! Linear systems of implicit steps: block matrices, multigrid, conjugate gradients.

pub mod blocks;
pub mod conjugate_gradients;
pub mod couplings;
pub mod multigrid;

use blocks::{Pattern, on_widest_unit};
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
            self.multiply_rows(x, first, y);
            if !self.couplings.is_empty() {
                for (k, y) in y.iter_mut().enumerate() {
                    *y += self.couplings.row_times(x, first + k);
                }
            }
        });
    }

    fn multiply_rows(&self, x: &[DVec3], first: usize, y: &mut [DVec3]) {
        let matrix = self;
        on_widest_unit!((matrix: &StepMatrix, x: &[DVec3], first: usize, y: &mut [DVec3]) {
            let StepMatrix { pattern, blocks, ties, tie, .. } = matrix;
            for (k, y) in y.iter_mut().enumerate() {
                let row = pattern.row(first + k);
                let mut sums = [DVec3::ZERO; 3];
                for (j, block) in pattern.column[row.clone()].iter().zip(&blocks[row]) {
                    let x = x[*j as usize];
                    sums[0] += block.x_axis * x.x;
                    sums[1] += block.y_axis * x.y;
                    sums[2] += block.z_axis * x.z;
                }
                let row = ties.row(first + k);
                let (columns, values) = (&ties.column[row.clone()], &tie[row]);
                let (fours, rest) = columns.as_chunks::<4>();
                let (four_values, rest_of_values) = values.as_chunks::<4>();
                let mut tied = [DVec3::ZERO; 4];
                for (columns, values) in fours.iter().zip(four_values) {
                    for lane in 0..4 {
                        tied[lane] += x[columns[lane] as usize] * values[lane];
                    }
                }
                for (column, value) in rest.iter().zip(rest_of_values) {
                    tied[0] += x[*column as usize] * *value;
                }
                *y = (sums[0] + sums[1]) + (sums[2] + ((tied[0] + tied[1]) + (tied[2] + tied[3])));
            }
        });
    }
}
