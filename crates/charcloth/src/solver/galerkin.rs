//! Rows of the products of a Galerkin coarsening, whose places were looked up when the levels were laid out.
//!
//! They are summed up in double precision: rows of a matrix nearly cancel on rigid motions, and what they leave, the mass, is
//! often under the last digit of single precision.

use super::blocks::{Pattern, on_widest_unit};
use glam::{DMat3, DVec3, Mat3A};

/// A block of 3 x 3 in double precision, by columns of four numbers, of which the last is not looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Wide(pub [[f64; 4]; 3]);

impl Wide {
    /// Nothing.
    pub const ZERO: Self = Self([[0.0; 4]; 3]);

    /// Rows for columns.
    pub fn transpose(&self) -> Self {
        DMat3::from(*self).transpose().into()
    }

    /// In single precision.
    #[inline(always)]
    pub fn single(&self) -> Mat3A {
        DMat3::from(*self).as_mat3().into()
    }
}

impl From<DMat3> for Wide {
    #[inline(always)]
    fn from(block: DMat3) -> Self {
        Self([block.x_axis, block.y_axis, block.z_axis].map(|column| [column.x, column.y, column.z, 0.0]))
    }
}

impl From<Mat3A> for Wide {
    #[inline(always)]
    fn from(block: Mat3A) -> Self {
        block.as_dmat3().into()
    }
}

impl From<Wide> for DMat3 {
    #[inline(always)]
    fn from(block: Wide) -> Self {
        let [x, y, z] = block.0.map(|column| DVec3::new(column[0], column[1], column[2]));
        DMat3::from_cols(x, y, z)
    }
}

/// A sparse matrix of blocks.
#[derive(Clone, Copy)]
pub struct Blocks<'a, T> {
    /// Which there are.
    pub pattern: &'a Pattern,
    /// Their values.
    pub values: &'a [T],
}

/// Part of a row of the left factor.
#[derive(Clone, Copy)]
pub struct Row<'a, T> {
    /// Rows of the right factor that its values meet.
    pub columns: &'a [u32],
    /// Its values, or where they are.
    pub values: &'a [T],
}

/// `sums = (blocks + ties) right` for a row of the finest level; `places` says where in `sums` each product goes.
pub fn finest_product_row(
    blocks: Row<'_, DMat3>,
    ties: Row<'_, f64>,
    right: Blocks<'_, Mat3A>,
    places: &[u16],
    sums: &mut [Wide],
) {
    on_widest_unit!((
        blocks: Row<'_, DMat3>,
        ties: Row<'_, f64>,
        right: Blocks<'_, Mat3A>,
        places: &[u16],
        sums: &mut [Wide],
    ) {
        let mut places = add_products(blocks, right, places, sums);
        for (j, left) in ties.columns.iter().zip(ties.values) {
            let row = &right.values[right.pattern.row(*j as usize)];
            let (own, rest) = places.split_at(row.len());
            for (right, place) in row.iter().zip(own) {
                let right = Wide::from(*right);
                let sum = &mut sums[*place as usize];
                for c in 0..3 {
                    for r in 0..4 {
                        sum.0[c][r] += right.0[c][r] * *left;
                    }
                }
            }
            places = rest;
        }
    });
}

/// The same for a row of another level.
pub fn product_row(blocks: Row<'_, Wide>, right: Blocks<'_, Mat3A>, places: &[u16], sums: &mut [Wide]) {
    on_widest_unit!((blocks: Row<'_, Wide>, right: Blocks<'_, Mat3A>, places: &[u16], sums: &mut [Wide]) {
        add_products(blocks, right, places, sums);
    });
}

#[inline(always)]
fn add_products<'a, T: Copy + Into<Wide>>(
    blocks: Row<'_, T>,
    right: Blocks<'_, Mat3A>,
    mut places: &'a [u16],
    sums: &mut [Wide],
) -> &'a [u16] {
    sums.fill(Wide::ZERO);
    for (j, left) in blocks.columns.iter().zip(blocks.values) {
        let left: Wide = (*left).into();
        let row = &right.values[right.pattern.row(*j as usize)];
        let (own, rest) = places.split_at(row.len());
        for (right, place) in row.iter().zip(own) {
            add_product(&mut sums[*place as usize], &left, &Wide::from(*right));
        }
        places = rest;
    }
    places
}

/// `sums = left right` in the columns from `from` on, which alone have places; others are nought.
pub fn restricted_row(left: Row<'_, Mat3A>, right: Blocks<'_, Wide>, from: u32, places: &[u16], sums: &mut [Wide]) {
    on_widest_unit!((
        left: Row<'_, Mat3A>,
        right: Blocks<'_, Wide>,
        from: u32,
        places: &[u16],
        sums: &mut [Wide],
    ) {
        sums.fill(Wide::ZERO);
        let mut places = places;
        for (i, restriction) in left.columns.iter().zip(left.values) {
            let restriction = Wide::from(*restriction);
            let row = right.pattern.row(*i as usize);
            let before = right.pattern.column[row.clone()].partition_point(|column| *column < from);
            let row = &right.values[row.start + before..row.end];
            let (own, rest) = places.split_at(row.len());
            for (product, place) in row.iter().zip(own) {
                add_product(&mut sums[*place as usize], &restriction, product);
            }
            places = rest;
        }
    });
}

/// `sum += a b`.
#[inline(always)]
fn add_product(sum: &mut Wide, a: &Wide, b: &Wide) {
    for c in 0..3 {
        let [x, y, z, _] = b.0[c];
        for r in 0..4 {
            sum.0[c][r] += a.0[0][r] * x + a.0[1][r] * y + a.0[2][r] * z;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rough(seed: &mut u32) -> f32 {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*seed >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn rough_blocks(count: usize, seed: &mut u32) -> Vec<Mat3A> {
        let mut column = || glam::Vec3A::new(rough(seed), rough(seed), rough(seed));
        (0..count).map(|_| Mat3A::from_cols(column(), column(), column())).collect()
    }

    /// Rows by their definition, against those by places.
    #[test]
    fn rows_of_products_are_sums_of_products_of_blocks() {
        let mut seed = 1;
        let pattern = Pattern::from_rows([vec![0, 1, 4], vec![], vec![1], vec![0, 2, 3]].into_iter());
        let single = rough_blocks(pattern.blocks(), &mut seed);
        let right = Blocks { pattern: &pattern, values: &single };
        let left: Vec<DMat3> = rough_blocks(3, &mut seed).into_iter().map(|block| block.as_dmat3()).collect();
        let columns = [0, 2, 3];
        let tie: Vec<f64> = (0..4).map(|_| f64::from(rough(&mut seed))).collect();
        let tied = [1, 0, 3, 2];
        let targets = |rows: &[u32]| -> Vec<u16> {
            rows.iter().flat_map(|i| pattern.columns(*i as usize)).map(|j| *j as u16).collect()
        };
        let near = |sums: &[Wide], expected: &[DMat3]| {
            for (sum, expected) in sums.iter().zip(expected) {
                let off = DMat3::from(*sum) - *expected;
                assert!(off.to_cols_array().iter().all(|v| v.abs() < 1e-14), "{off}");
            }
        };

        let mut expected = vec![DMat3::ZERO; 5];
        for (i, left) in columns.iter().zip(&left) {
            for k in pattern.row(*i as usize) {
                expected[pattern.column[k] as usize] += *left * single[k].as_dmat3();
            }
        }
        let mut sums = vec![Wide::from(DMat3::IDENTITY); 5];
        let wide: Vec<Wide> = left.iter().map(|block| (*block).into()).collect();
        product_row(Row { columns: &columns, values: &wide }, right, &targets(&columns), &mut sums);
        near(&sums, &expected);

        for (i, tie) in tied.iter().zip(&tie) {
            for k in pattern.row(*i as usize) {
                expected[pattern.column[k] as usize] += single[k].as_dmat3() * *tie;
            }
        }
        let places = [targets(&columns), targets(&tied)].concat();
        let ties = Row { columns: &tied, values: &tie };
        finest_product_row(Row { columns: &columns, values: &left }, ties, right, &places, &mut sums);
        near(&sums, &expected);

        let restriction = rough_blocks(3, &mut seed);
        let double: Vec<Wide> = single.iter().map(|block| (*block).into()).collect();
        let right = Blocks { pattern: &pattern, values: &double };
        for from in [0, 1, 4] {
            let mut expected = vec![DMat3::ZERO; 5];
            for (i, left) in columns.iter().zip(&restriction) {
                for k in pattern.row(*i as usize).filter(|k| pattern.column[*k] >= from) {
                    expected[pattern.column[k] as usize] += left.as_dmat3() * single[k].as_dmat3();
                }
            }
            let places: Vec<u16> = targets(&columns).into_iter().filter(|place| u32::from(*place) >= from).collect();
            restricted_row(Row { columns: &columns, values: &restriction }, right, from, &places, &mut sums);
            near(&sums, &expected);
        }
    }
}
