//! From a level of the multigrid cycle to the next: aggregates, prolongation, and where products of a coarsening go.

use super::NONE;
use crate::solver::blocks::{Pattern, block_row_times, on_widest_unit};
use crate::solver::galerkin::Wide;
use glam::{Mat3A, Vec3A};

/// From a level to the next.
pub struct Transfer {
    pub aggregate: Vec<u32>,
    /// Number of nodes of each aggregate.
    pub size: Vec<f32>,
    /// How a rotation of the aggregate moves each row.
    pub tentative: Vec<Mat3A>,
    /// Where the displacement of a row's own aggregate stands among the row's blocks of the prolongation.
    pub own: Vec<u8>,
    /// Prolongation.
    pub pattern: Pattern,
    pub blocks: Vec<Mat3A>,
    /// Where the displacement of the aggregate of each block's column stands among the row's blocks of the prolongation.
    pub smoothed_at: Vec<u8>,
    /// The same for each tie.
    pub tied_at: Vec<u8>,
    /// Restriction: the transpose, its values, and the block of the prolongation that each stands for.
    pub transposed: Pattern,
    pub restriction: Vec<Mat3A>,
    pub origin: Vec<u32>,
    /// A times prolongation: pattern, values, and where each product goes within its row.
    pub product: Pattern,
    pub product_blocks: Vec<Wide>,
    pub product_at: Vec<u16>,
    pub first_product: Vec<u32>,
    /// Where each product of restriction and that goes within its row, from the diagonal on.
    pub coarse_at: Vec<u16>,
    pub first_coarse: Vec<u32>,
    /// For each block of the next level before the diagonal, its mirror image.
    pub mirror: Vec<u32>,
}

/// Adds rows of the product of a matrix with a field.
pub fn add_rows(pattern: &Pattern, blocks: &[Mat3A], field: &[Vec3A], first: usize, sums: &mut [Vec3A]) {
    on_widest_unit!((pattern: &Pattern, blocks: &[Mat3A], field: &[Vec3A], first: usize, sums: &mut [Vec3A]) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += block_row_times(pattern, blocks, field, first + k);
        }
    });
}

/// Groups of nodes around nodes that are far enough apart: the aggregate of each node, and how many there are. Fixed
/// nodes are in none.
pub fn aggregates(graph: &Pattern, fixed: &[bool]) -> (Vec<u32>, usize) {
    let rows = graph.rows();
    let mut aggregate = vec![NONE; rows];
    let mut count = 0u32;
    let neighbours = |i: usize| graph.columns(i).iter().map(|j| *j as usize).filter(move |j| *j != i && !fixed[*j]);
    for i in 0..rows {
        if !fixed[i] && aggregate[i] == NONE && neighbours(i).all(|j| aggregate[j] == NONE) {
            aggregate[i] = count;
            neighbours(i).for_each(|j| aggregate[j] = count);
            count += 1;
        }
    }
    let cores = aggregate.clone();
    for i in 0..rows {
        if !fixed[i] && aggregate[i] == NONE {
            match neighbours(i).map(|j| cores[j]).filter(|a| *a != NONE).min() {
                Some(near) => aggregate[i] = near,
                None => {
                    aggregate[i] = count;
                    count += 1;
                }
            }
        }
    }
    (aggregate, count as usize)
}

impl Transfer {
    /// Lays out the way from a level of this pattern to its aggregates.
    pub fn lay_out(matrix: &Pattern, ties: &Pattern, rows_a_node: usize, aggregate: Vec<u32>, count: usize) -> Self {
        let rows = matrix.rows();
        let aggregate_of = |row: u32| aggregate[row as usize / rows_a_node];
        let all_columns = |i: usize| matrix.columns(i).iter().chain(ties.columns(i)).copied();
        let pattern = Pattern::from_rows((0..rows).map(|i| {
            if aggregate_of(i as u32) == NONE {
                return Vec::new();
            }
            all_columns(i).map(aggregate_of).filter(|a| *a != NONE).flat_map(|a| [2 * a, 2 * a + 1]).collect()
        }));
        let place = |i: usize, j: u32| {
            let a = aggregate_of(j);
            let found = (a != NONE).then(|| pattern.find(i, 2 * a)).flatten();
            found.map_or(u8::MAX, |k| (k - pattern.first[i] as usize) as u8)
        };
        let own = (0..rows).map(|i| place(i, i as u32)).collect();
        let places = |of: &Pattern| {
            (0..rows).flat_map(|i| of.columns(i).iter().map(move |j| (i, *j))).map(|(i, j)| place(i, j)).collect()
        };
        let (smoothed_at, tied_at) = (places(matrix), places(ties));
        let product = Pattern::from_rows((0..rows).map(|i| {
            if pattern.row(i).is_empty() {
                return Vec::new();
            }
            all_columns(i).flat_map(|j| pattern.columns(j as usize)).copied().collect()
        }));
        let mut product_at = Vec::new();
        let mut first_product = Vec::with_capacity(rows);
        for i in 0..rows {
            first_product.push(product_at.len() as u32);
            for j in all_columns(i) {
                for a in pattern.columns(j as usize) {
                    // A fixed node has no row: its products fall away with it.
                    product_at.push(product.find(i, *a).map_or(0, |k| (k - product.first[i] as usize) as u16));
                }
            }
        }
        let mut size = vec![0.0; count];
        aggregate.iter().filter(|a| **a != NONE).for_each(|a| size[*a as usize] += 1.0);
        let (transposed, origin) = pattern.transposed(2 * count);
        Self {
            blocks: vec![Mat3A::ZERO; pattern.blocks()],
            restriction: vec![Mat3A::ZERO; pattern.blocks()],
            product_blocks: vec![Wide::ZERO; product.blocks()],
            tentative: vec![Mat3A::ZERO; rows],
            own,
            size,
            aggregate,
            pattern,
            smoothed_at,
            tied_at,
            transposed,
            origin,
            product,
            product_at,
            first_product,
            coarse_at: Vec::new(),
            first_coarse: Vec::new(),
            mirror: Vec::new(),
        }
    }

    /// The pattern of the next level.
    pub fn coarse_pattern(&self) -> Pattern {
        Pattern::from_rows((0..self.transposed.rows()).map(|a| {
            self.transposed
                .columns(a)
                .iter()
                .flat_map(|i| self.product.columns(*i as usize))
                .copied()
                .chain([a as u32])
                .collect()
        }))
    }

    /// Which aggregates touch: the graph of the next level.
    pub fn coarse_graph(&self, graph: &Pattern, count: usize) -> Pattern {
        let mut rows: Vec<Vec<u32>> = (0..count as u32).map(|a| vec![a]).collect();
        for i in 0..graph.rows() {
            for j in graph.columns(i) {
                let (a, b) = (self.aggregate[i], self.aggregate[*j as usize]);
                if a != NONE && b != NONE {
                    rows[a as usize].push(b);
                }
            }
        }
        Pattern::from_rows(rows.into_iter())
    }

    /// Looks up where products go in the pattern of the next level.
    pub fn place_coarse(&mut self, coarse: &Pattern) {
        self.mirror = vec![0; coarse.blocks()];
        for a in 0..coarse.rows() {
            for k in coarse.row(a) {
                let mirrored = coarse.find(coarse.column[k] as usize, a as u32);
                self.mirror[k] = mirrored.expect("the pattern is its own mirror image") as u32;
            }
            self.first_coarse.push(self.coarse_at.len() as u32);
            for i in self.transposed.columns(a) {
                for b in self.product.columns(*i as usize).iter().filter(|b| **b >= a as u32) {
                    let place = coarse.find(a, *b).expect("the pattern holds every product");
                    self.coarse_at.push((place - coarse.first[a] as usize) as u16);
                }
            }
        }
    }
}
