//! Rows of the products of a Galerkin coarsening, whose places were looked up when the levels were laid out.
//!
//! They are summed up in double precision: rows of a matrix nearly cancel on rigid motions, and what they leave, the mass, is
//! often under the last digit of single precision.

use super::lanes::{Strip, Wide};
use crate::solver::blocks::{Pattern, on_widest_unit};
use glam::DMat3;

/// Part of a row of a matrix.
#[derive(Clone, Copy)]
pub struct Row<'a, T> {
    /// Nodes that its values meet.
    pub columns: &'a [u32],
    /// Its values.
    pub values: &'a [T],
}

/// The prolongation: for each node, aggregates, and as many strips for each as the node has rows.
#[derive(Clone, Copy)]
pub struct Prolongation<'a> {
    /// Aggregates of each node.
    pub pattern: &'a Pattern,
    /// The strips.
    pub strips: &'a [Strip],
}

/// `sums = (blocks + ties) prolongation` for a node of the finest level; `places` says where in `sums` each product goes.
pub fn finest_product(
    blocks: Row<'_, DMat3>,
    ties: Row<'_, f64>,
    prolongation: Prolongation<'_>,
    places: &[u16],
    sums: &mut [Wide],
) {
    on_widest_unit!((
        blocks: Row<'_, DMat3>,
        ties: Row<'_, f64>,
        prolongation: Prolongation<'_>,
        places: &[u16],
        sums: &mut [Wide],
    ) {
        sums.fill(Wide::ZERO);
        let mut places = places.iter();
        for (j, left) in blocks.columns.iter().zip(blocks.values) {
            let left = left.to_cols_array_2d();
            for strip in &prolongation.strips[prolongation.pattern.row(*j as usize)] {
                let sum = &mut sums[*places.next().expect("a place for each product") as usize];
                for c in 0..3 {
                    let right = widened(&strip.0[c]);
                    for r in 0..3 {
                        add_scaled(&mut sum.0[r], left[c][r], &right);
                    }
                }
            }
        }
        for (j, left) in ties.columns.iter().zip(ties.values) {
            for strip in &prolongation.strips[prolongation.pattern.row(*j as usize)] {
                let sum = &mut sums[*places.next().expect("a place for each product") as usize];
                for r in 0..3 {
                    add_scaled(&mut sum.0[r], *left, &widened(&strip.0[r]));
                }
            }
        }
    });
}

/// The same for a node of another level: a product for its moves and one for its turns for each place.
pub fn product(matrix: Row<'_, [Wide; 2]>, prolongation: Prolongation<'_>, places: &[u16], sums: &mut [Wide]) {
    on_widest_unit!((
        matrix: Row<'_, [Wide; 2]>,
        prolongation: Prolongation<'_>,
        places: &[u16],
        sums: &mut [Wide],
    ) {
        sums.fill(Wide::ZERO);
        let sums = sums.as_chunks_mut::<2>().0;
        let mut places = places.iter();
        let strips = prolongation.strips.as_chunks::<2>().0;
        for (j, left) in matrix.columns.iter().zip(matrix.values) {
            for strips in &strips[prolongation.pattern.row(*j as usize)] {
                let sums = &mut sums[*places.next().expect("a place for each product") as usize];
                for (half, strip) in strips.iter().enumerate() {
                    for c in 0..3 {
                        let right = widened(&strip.0[c]);
                        for (sum, left) in sums.iter_mut().zip(left) {
                            for r in 0..3 {
                                add_scaled(&mut sum.0[r], left.0[r][4 * half + c], &right);
                            }
                        }
                    }
                }
            }
        }
    });
}

/// Adds to a row of the next level what a node passes on to it: its strips of the prolongation, transposed, times its products,
/// as many for each place as there are strips.
pub fn add_restricted(strips: &[Strip], products: &[Wide], places: &[u16], row: &mut [[Wide; 2]]) {
    on_widest_unit!((strips: &[Strip], products: &[Wide], places: &[u16], row: &mut [[Wide; 2]]) {
        for (half, strip) in strips.iter().enumerate() {
            for (right, place) in products[half..].iter().step_by(strips.len()).zip(places) {
                for (turns, sum) in row[*place as usize].iter_mut().enumerate() {
                    for r in 0..3 {
                        for c in 0..3 {
                            add_scaled(&mut sum.0[r], f64::from(strip.0[c][4 * turns + r]), &right.0[c]);
                        }
                    }
                }
            }
        }
    });
}

/// `sum += a x`, in lanes.
#[inline(always)]
fn add_scaled(sum: &mut [f64; 8], a: f64, x: &[f64; 8]) {
    for lane in 0..8 {
        sum[lane] += a * x[lane];
    }
}

#[inline(always)]
fn widened(row: &[f32; 8]) -> [f64; 8] {
    let mut wide = [0.0; 8];
    for lane in 0..8 {
        wide[lane] = f64::from(row[lane]);
    }
    wide
}
