//! Rows of the products of a Galerkin coarsening, whose places were looked up when the levels were laid out.
//!
//! Half of the time of a set-up goes in here, so a whole block of 3 x 3 is one register where the processor has AVX-512.
//! The operations are the same, one by one, and so are the bits.

use super::blocks::{Pattern, on_widest_unit};
use crate::kernels::VectorUnit;
use glam::Mat3A;

/// A sparse matrix of blocks.
#[derive(Clone, Copy)]
pub struct Blocks<'a> {
    /// Which there are.
    pub pattern: &'a Pattern,
    /// Their values.
    pub values: &'a [Mat3A],
}

/// Part of a row of the left factor.
#[derive(Clone, Copy)]
pub struct Row<'a, T> {
    /// Rows of the right factor that its values meet.
    pub columns: &'a [u32],
    /// Its values, or where they are.
    pub values: &'a [T],
}

/// Most blocks in a row that the widest registers sum up on the stack.
const ON_STACK: usize = 64;

/// `sums = (blocks + ties) right`; `places` says where in `sums` each product goes.
pub fn product_row(blocks: Row<'_, Mat3A>, ties: Row<'_, f32>, right: Blocks<'_>, places: &[u16], sums: &mut [Mat3A]) {
    #[cfg(target_arch = "x86_64")]
    if VectorUnit::best() == VectorUnit::Avx512 && sums.len() <= ON_STACK {
        // SAFETY: `VectorUnit::best` only names what the processor was found to have.
        return unsafe { wide::product_row(blocks, ties, right, places, sums) };
    }
    on_widest_unit!((
        blocks: Row<'_, Mat3A>,
        ties: Row<'_, f32>,
        right: Blocks<'_>,
        places: &[u16],
        sums: &mut [Mat3A],
    ) {
        sums.fill(Mat3A::ZERO);
        let mut places = places;
        for (j, left) in blocks.columns.iter().zip(blocks.values) {
            let row = &right.values[right.pattern.row(*j as usize)];
            let (own, rest) = places.split_at(row.len());
            for (right, place) in row.iter().zip(own) {
                add_product(&mut sums[*place as usize], left, right);
            }
            places = rest;
        }
        for (j, left) in ties.columns.iter().zip(ties.values) {
            let row = &right.values[right.pattern.row(*j as usize)];
            let (own, rest) = places.split_at(row.len());
            for (right, place) in row.iter().zip(own) {
                let sum = &mut sums[*place as usize];
                sum.x_axis += right.x_axis * *left;
                sum.y_axis += right.y_axis * *left;
                sum.z_axis += right.z_axis * *left;
            }
            places = rest;
        }
    });
}

/// `sums = left^T right`, the values of the left factor being those of `prolongation` that the row names.
pub fn restricted_row(
    left: Row<'_, u32>,
    prolongation: &[Mat3A],
    right: Blocks<'_>,
    places: &[u16],
    sums: &mut [Mat3A],
) {
    #[cfg(target_arch = "x86_64")]
    if VectorUnit::best() == VectorUnit::Avx512 && sums.len() <= ON_STACK {
        // SAFETY: `VectorUnit::best` only names what the processor was found to have.
        return unsafe { wide::restricted_row(left, prolongation, right, places, sums) };
    }
    on_widest_unit!((
        left: Row<'_, u32>,
        prolongation: &[Mat3A],
        right: Blocks<'_>,
        places: &[u16],
        sums: &mut [Mat3A],
    ) {
        sums.fill(Mat3A::ZERO);
        let mut places = places;
        for (i, m) in left.columns.iter().zip(left.values) {
            let restriction = prolongation[*m as usize].transpose();
            let row = &right.values[right.pattern.row(*i as usize)];
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
pub fn add_product(sum: &mut Mat3A, a: &Mat3A, b: &Mat3A) {
    sum.x_axis += a.x_axis * b.x_axis.x + a.y_axis * b.x_axis.y + a.z_axis * b.x_axis.z;
    sum.y_axis += a.x_axis * b.y_axis.x + a.y_axis * b.y_axis.y + a.z_axis * b.y_axis.z;
    sum.z_axis += a.x_axis * b.z_axis.x + a.y_axis * b.z_axis.y + a.z_axis * b.z_axis.z;
}

/// One block a register: four lanes a column, of which the last is not looked at.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Blocks, Mat3A, ON_STACK, Row};
    use std::arch::x86_64::*;

    /// Lanes of a block.
    const BLOCK: __mmask16 = 0x0fff;

    #[inline]
    #[target_feature(enable = "avx512f,avx2")]
    fn load(block: &Mat3A) -> __m512 {
        // SAFETY: a block is three columns of sixteen bytes, and the mask leaves out what is past them.
        unsafe { _mm512_maskz_loadu_ps(BLOCK, std::ptr::from_ref(block).cast()) }
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx2")]
    fn store(sums: &mut [Mat3A], wide: &[__m512]) {
        for (sum, wide) in sums.iter_mut().zip(wide) {
            sum.x_axis = _mm512_castps512_ps128(*wide).into();
            sum.y_axis = _mm512_extractf32x4_ps::<1>(*wide).into();
            sum.z_axis = _mm512_extractf32x4_ps::<2>(*wide).into();
        }
    }

    /// Each column of a block, four times.
    #[inline]
    #[target_feature(enable = "avx512f,avx2")]
    fn columns(a: &Mat3A) -> [__m512; 3] {
        [a.x_axis, a.y_axis, a.z_axis].map(|column| _mm512_broadcast_f32x4(column.into()))
    }

    #[inline]
    #[target_feature(enable = "avx512f,avx2")]
    fn add_product(sum: &mut __m512, a: &[__m512; 3], b: __m512) {
        let x = _mm512_mul_ps(a[0], _mm512_permute_ps::<0x00>(b));
        let y = _mm512_mul_ps(a[1], _mm512_permute_ps::<0x55>(b));
        let z = _mm512_mul_ps(a[2], _mm512_permute_ps::<0xaa>(b));
        *sum = _mm512_add_ps(*sum, _mm512_add_ps(_mm512_add_ps(x, y), z));
    }

    #[target_feature(enable = "avx512f,avx2")]
    pub fn product_row(
        blocks: Row<'_, Mat3A>,
        ties: Row<'_, f32>,
        right: Blocks<'_>,
        places: &[u16],
        sums: &mut [Mat3A],
    ) {
        let mut wide = [_mm512_setzero_ps(); ON_STACK];
        let mut places = places;
        for (j, left) in blocks.columns.iter().zip(blocks.values) {
            let left = columns(left);
            let row = &right.values[right.pattern.row(*j as usize)];
            let (own, rest) = places.split_at(row.len());
            for (right, place) in row.iter().zip(own) {
                add_product(&mut wide[*place as usize % ON_STACK], &left, load(right));
            }
            places = rest;
        }
        for (j, left) in ties.columns.iter().zip(ties.values) {
            let left = _mm512_set1_ps(*left);
            let row = &right.values[right.pattern.row(*j as usize)];
            let (own, rest) = places.split_at(row.len());
            for (right, place) in row.iter().zip(own) {
                let sum = &mut wide[*place as usize % ON_STACK];
                *sum = _mm512_add_ps(*sum, _mm512_mul_ps(load(right), left));
            }
            places = rest;
        }
        store(sums, &wide);
    }

    #[target_feature(enable = "avx512f,avx2")]
    pub fn restricted_row(
        left: Row<'_, u32>,
        prolongation: &[Mat3A],
        right: Blocks<'_>,
        places: &[u16],
        sums: &mut [Mat3A],
    ) {
        let mut wide = [_mm512_setzero_ps(); ON_STACK];
        let mut places = places;
        for (i, m) in left.columns.iter().zip(left.values) {
            let left = columns(&prolongation[*m as usize].transpose());
            let row = &right.values[right.pattern.row(*i as usize)];
            let (own, rest) = places.split_at(row.len());
            for (product, place) in row.iter().zip(own) {
                add_product(&mut wide[*place as usize % ON_STACK], &left, load(product));
            }
            places = rest;
        }
        store(sums, &wide);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3A;

    fn rough(seed: &mut u32) -> f32 {
        *seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*seed >> 8) as f32 / 8_388_608.0 - 1.0
    }

    fn rough_blocks(count: usize, seed: &mut u32) -> Vec<Mat3A> {
        let mut column = || Vec3A::new(rough(seed), rough(seed), rough(seed));
        (0..count).map(|_| Mat3A::from_cols(column(), column(), column())).collect()
    }

    #[test]
    fn rows_on_the_widest_unit_have_the_bits_of_plain_products() {
        let mut seed = 1;
        let pattern = Pattern::from_rows([vec![0, 1, 4], vec![], vec![1], vec![0, 2, 3]].into_iter());
        let values = rough_blocks(pattern.blocks(), &mut seed);
        let right = Blocks { pattern: &pattern, values: &values };
        let left = rough_blocks(3, &mut seed);
        let columns = [0, 2, 3];
        let tie: Vec<f32> = (0..4).map(|_| rough(&mut seed)).collect();
        let tied = [1, 0, 3, 2];
        let targets = |rows: &[u32]| -> Vec<u16> {
            rows.iter().flat_map(|i| pattern.columns(*i as usize)).map(|j| *j as u16).collect()
        };
        let places = [targets(&columns), targets(&tied)].concat();

        let mut expected = vec![Mat3A::ZERO; 5];
        for (i, left) in columns.iter().zip(&left) {
            for k in pattern.row(*i as usize) {
                add_product(&mut expected[pattern.column[k] as usize], left, &values[k]);
            }
        }
        for (i, tie) in tied.iter().zip(&tie) {
            for k in pattern.row(*i as usize) {
                let sum = &mut expected[pattern.column[k] as usize];
                sum.x_axis += values[k].x_axis * *tie;
                sum.y_axis += values[k].y_axis * *tie;
                sum.z_axis += values[k].z_axis * *tie;
            }
        }
        let mut sums = vec![Mat3A::IDENTITY; 5];
        let ties = Row { columns: &tied, values: &tie };
        product_row(Row { columns: &columns, values: &left }, ties, right, &places, &mut sums);
        assert_eq!(sums, expected);

        let mut expected = vec![Mat3A::ZERO; 5];
        let origin = [2, 0, 1];
        for (i, m) in columns.iter().zip(&origin) {
            for k in pattern.row(*i as usize) {
                let restriction = left[*m as usize].transpose();
                add_product(&mut expected[pattern.column[k] as usize], &restriction, &values[k]);
            }
        }
        restricted_row(Row { columns: &columns, values: &origin }, &left, right, &places, &mut sums);
        assert_eq!(sums, expected);
    }
}
