//! Heat conducted into every node by its neighbours (Eq. 1.3).
//!
//! Model: q_i = sum_j k_ij (T_j - T_i), with k_ij the conductance of the edge [W/K]. Source: the 2004 sketch, S1
//! [Moidu2004]. Valid when: always. Cost: 2 flops and 12 bytes a link. In f64 throughout: what one node
//! gives, the other gets.

use super::{LANES, Links, SLICES_A_TASK, VectorUnit, for_each_task};
use rayon::slice::ParallelSliceMut;

/// Conductances of sixteen links, one a lane [W/K].
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct ConductanceRow(pub [f64; LANES]);

/// Adds to `heat` what every node gets from its neighbours [W].
pub fn conduct(
    links: &Links,
    rows: &[ConductanceRow],
    temperature: &[f64],
    heat: &mut [f64],
    unit: VectorUnit,
    parallel: bool,
) {
    assert!(temperature.len() == heat.len() && heat.len().div_ceil(LANES) == links.slices());
    assert!(rows.len() == links.rows());
    let view = View { links, rows, temperature, unit };
    let nodes_a_task = SLICES_A_TASK * LANES;
    if parallel {
        for_each_task(heat.par_chunks_mut(nodes_a_task), |task, heat| view.slices(task * SLICES_A_TASK, heat));
    } else {
        view.slices(0, heat);
    }
}

/// What the loop reads.
struct View<'a> {
    links: &'a Links,
    rows: &'a [ConductanceRow],
    temperature: &'a [f64],
    unit: VectorUnit,
}

impl<'a> View<'a> {
    /// The slices from `first` on, as many as there is heat for.
    fn slices(&self, first: usize, heat: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        match self.unit {
            // SAFETY: `VectorUnit::best` and `available` only name what the processor was found to have.
            VectorUnit::Avx512 => return unsafe { self.slices_avx512(first, heat) },
            // SAFETY: as above.
            VectorUnit::Avx2 => return unsafe { self.slices_avx2(first, heat) },
            VectorUnit::Portable => {}
        }
        self.slices_portable(first, heat);
    }

    /// The rows of a slice: neighbours and conductances.
    #[inline(always)]
    fn rows_of(&self, slice: usize) -> impl Iterator<Item = (&'a [u32; LANES], &'a ConductanceRow)> + use<'a> {
        let rows = self.links.first_row[slice] as usize..self.links.first_row[slice + 1] as usize;
        self.links.neighbour[rows.clone()].iter().zip(&self.rows[rows])
    }

    #[inline(always)]
    fn slices_portable(&self, first: usize, heat: &mut [f64]) {
        for (k, heat) in heat.chunks_mut(LANES).enumerate() {
            let node = (first + k) * LANES;
            let mut here = [0.0; LANES];
            here[..heat.len()].copy_from_slice(&self.temperature[node..node + heat.len()]);
            let mut sum = [0.0f64; LANES];
            for (neighbour, row) in self.rows_of(first + k) {
                for lane in 0..LANES {
                    let there = self.temperature[neighbour[lane] as usize];
                    sum[lane] = row.0[lane].mul_add(there - here[lane], sum[lane]);
                }
            }
            for (heat, sum) in heat.iter_mut().zip(sum) {
                *heat += sum;
            }
        }
    }

    /// The same operations in the same order, four lanes at once.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn slices_avx2(&self, first: usize, heat: &mut [f64]) {
        use std::arch::x86_64::*;
        let whole = heat.len() / LANES;
        let (full, rest) = heat.split_at_mut(whole * LANES);
        for (k, heat) in full.chunks_exact_mut(LANES).enumerate() {
            // SAFETY: sixteen f64 from the first node of the slice on, for it is full; every neighbour is the number of
            // a node, as `Links::build` makes it, and there is a temperature for each.
            unsafe {
                let own = self.temperature.as_ptr().add((first + k) * LANES);
                let here: [__m256d; 4] = std::array::from_fn(|q| _mm256_loadu_pd(own.add(4 * q)));
                let mut sum = [_mm256_setzero_pd(); 4];
                for (neighbour, row) in self.rows_of(first + k) {
                    for q in 0..4 {
                        let there = |lane: usize| self.temperature.as_ptr().add(neighbour[4 * q + lane] as usize);
                        let low = _mm_loadh_pd(_mm_load_sd(there(0)), there(1));
                        let high = _mm_loadh_pd(_mm_load_sd(there(2)), there(3));
                        let there = _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(low), high);
                        let conductance = _mm256_load_pd(row.0.as_ptr().add(4 * q));
                        sum[q] = _mm256_fmadd_pd(conductance, _mm256_sub_pd(there, here[q]), sum[q]);
                    }
                }
                for q in 0..4 {
                    let heat = heat.as_mut_ptr().add(4 * q);
                    _mm256_storeu_pd(heat, _mm256_add_pd(_mm256_loadu_pd(heat), sum[q]));
                }
            }
        }
        self.slices_portable(first + whole, rest);
    }

    /// The same operations in the same order, eight lanes at once.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
    fn slices_avx512(&self, first: usize, heat: &mut [f64]) {
        use std::arch::x86_64::*;
        let whole = heat.len() / LANES;
        let (full, rest) = heat.split_at_mut(whole * LANES);
        for (k, heat) in full.chunks_exact_mut(LANES).enumerate() {
            // SAFETY: as for AVX2.
            unsafe {
                let own = self.temperature.as_ptr().add((first + k) * LANES);
                let here = [_mm512_loadu_pd(own), _mm512_loadu_pd(own.add(8))];
                let mut sum = [_mm512_setzero_pd(); 2];
                for (neighbour, row) in self.rows_of(first + k) {
                    for half in 0..2 {
                        // Plain loads: gather instructions are slower.
                        let at = |lane: usize| self.temperature.as_ptr().add(neighbour[8 * half + lane] as usize);
                        let two = |lane: usize| _mm_loadh_pd(_mm_load_sd(at(lane)), at(lane + 1));
                        let four =
                            |lane: usize| _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(two(lane)), two(lane + 2));
                        let there = _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(four(0)), four(4));
                        let conductance = _mm512_load_pd(row.0.as_ptr().add(8 * half));
                        sum[half] = _mm512_fmadd_pd(conductance, _mm512_sub_pd(there, here[half]), sum[half]);
                    }
                }
                for half in 0..2 {
                    let heat = heat.as_mut_ptr().add(8 * half);
                    _mm512_storeu_pd(heat, _mm512_add_pd(_mm512_loadu_pd(heat), sum[half]));
                }
            }
        }
        self.slices_portable(first + whole, rest);
    }
}
