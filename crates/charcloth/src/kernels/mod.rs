//! The two inner loops, in a layout made for vector units: nodes in slices of sixteen, one lane a node.
//!
//! Every node gathers from its own neighbours, in the order of its springs or edges, and lanes never mix. Each
//! operation is rounded as IEEE 754 says, fused multiply-adds included. So neither the number of threads nor the width
//! of the vector unit changes a bit, and the choice made at run time is only one of speed.

pub mod heat;
pub mod springs;

use std::sync::OnceLock;

/// Nodes in a slice.
pub const LANES: usize = 16;

/// Slices that one thread takes at a time. Fixed, so that the work is cut up alike on any number of threads.
const SLICES_A_TASK: usize = 64;

/// What the processor can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum VectorUnit {
    /// Nothing beyond what every processor of the architecture has.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, VL and DQ.
    Avx512,
}

impl VectorUnit {
    /// The best that this processor has; `CHARCLOTH_VECTOR_UNIT` (portable, avx2, avx512) may ask for less, to compare.
    pub fn best() -> Self {
        static BEST: OnceLock<VectorUnit> = OnceLock::new();
        *BEST.get_or_init(|| {
            let wanted = match std::env::var("CHARCLOTH_VECTOR_UNIT").as_deref() {
                Ok("portable") => Self::Portable,
                Ok("avx2") => Self::Avx2,
                _ => Self::Avx512,
            };
            Self::detected().min(wanted)
        })
    }

    /// Every one that this processor has.
    pub fn available() -> Vec<Self> {
        [Self::Portable, Self::Avx2, Self::Avx512].into_iter().filter(|unit| *unit <= Self::detected()).collect()
    }

    fn detected() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if avx2
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
            {
                return Self::Avx512;
            }
            if avx2 {
                return Self::Avx2;
            }
        }
        Self::Portable
    }
}

/// Who is joined to whom, by slices: for each slice, rows of sixteen links, one link a node and row.
#[derive(Debug, Clone, Default)]
pub struct Links {
    /// First row of each slice, and the end.
    pub first_row: Vec<u32>,
    /// The node at the other end; the node itself where it has no more links.
    pub neighbour: Vec<[u32; LANES]>,
    /// Rows and lanes of the two links of each element (spring or edge); `u32::MAX` where it has none.
    pub of_element: Vec<[[u32; 2]; 2]>,
}

impl Links {
    /// Lays out the links of the elements that are not left out. A node's links are in the order of the elements.
    pub fn build(node_count: usize, ends: &[[u32; 2]], left_out: impl Fn(usize) -> bool) -> Self {
        let slices = node_count.div_ceil(LANES);
        let mut degree = vec![0u32; slices * LANES];
        for (e, [i, j]) in ends.iter().enumerate() {
            if !left_out(e) {
                degree[*i as usize] += 1;
                degree[*j as usize] += 1;
            }
        }
        let mut first_row = Vec::with_capacity(slices + 1);
        let mut rows = 0;
        for slice in degree.chunks_exact(LANES) {
            first_row.push(rows);
            rows += slice.iter().max().copied().unwrap_or(0);
        }
        first_row.push(rows);
        let mut neighbour = vec![[0u32; LANES]; rows as usize];
        for slice in 0..slices {
            for row in first_row[slice]..first_row[slice + 1] {
                for lane in 0..LANES {
                    // A link without an element leads back to its own node, and past the last node to the last.
                    neighbour[row as usize][lane] = ((slice * LANES + lane) as u32).min(node_count as u32 - 1);
                }
            }
        }
        let mut filled = vec![0u32; slices * LANES];
        let mut of_element = vec![[[u32::MAX; 2]; 2]; ends.len()];
        for (e, [i, j]) in ends.iter().enumerate() {
            if left_out(e) {
                continue;
            }
            for (end, (here, there)) in [(*i, *j), (*j, *i)].into_iter().enumerate() {
                let here = here as usize;
                let row = first_row[here / LANES] + filled[here];
                filled[here] += 1;
                neighbour[row as usize][here % LANES] = there;
                of_element[e][end] = [row, (here % LANES) as u32];
            }
        }
        Self { first_row, neighbour, of_element }
    }

    /// Number of slices.
    pub fn slices(&self) -> usize {
        self.first_row.len().saturating_sub(1)
    }

    /// Number of rows in all.
    pub fn rows(&self) -> usize {
        self.neighbour.len()
    }
}

/// Runs `work` over numbered tasks, each with its own part of the output, on the threads there are.
fn for_each_task<T: Send>(parts: impl rayon::iter::IndexedParallelIterator<Item = T>, work: impl Fn(usize, T) + Sync) {
    use rayon::iter::ParallelIterator;
    parts.enumerate().for_each(|(task, part)| work(task, part));
}
