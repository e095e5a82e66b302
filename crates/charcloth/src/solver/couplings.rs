//! Ties between nodes that the pattern of a step's matrix does not join: what contact adds to it.
//!
//! Each is a symmetric block that meets a weighted sum of nodes: the distance of two points, or of one from what is held.
//! Rows gather, in the order of the ties. Cost: about 20 ns a node of a tie and product.

use glam::{DMat3, DVec3};

/// A block that meets a weighted sum of nodes.
#[derive(Debug, Clone, Copy)]
pub struct Coupling {
    /// Nodes of the sum.
    pub nodes: [u32; 4],
    /// Weight of each node; 0 for one that takes no part.
    pub weights: [f64; 4],
    /// The block.
    pub block: DMat3,
}

/// Ties, and where each node takes part.
#[derive(Debug, Clone, Default)]
pub struct Couplings {
    ties: Vec<Coupling>,
    first: Vec<u32>,
    /// Tie times four and place in it, row by row.
    entries: Vec<u32>,
}

impl Couplings {
    /// Takes everything out; keeps the storage.
    pub fn clear(&mut self) {
        self.ties.clear();
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ties.is_empty()
    }

    /// All of them, in the order they were added.
    pub fn ties(&self) -> &[Coupling] {
        &self.ties
    }

    /// Adds a tie.
    pub fn push(&mut self, tie: Coupling) {
        self.ties.push(tie);
    }

    /// Finds where each of so many nodes takes part; to be called after the last tie.
    pub fn index(&mut self, rows: usize) {
        let Self { ties, first, entries } = self;
        let places = |tie: &Coupling| {
            let (nodes, weights) = (tie.nodes, tie.weights);
            (0..4).filter(move |k| weights[*k] != 0.0).map(move |k| (nodes[k] as usize, k))
        };
        first.clear();
        first.resize(rows + 2, 0);
        ties.iter().flat_map(places).for_each(|(i, _)| first[i + 2] += 1);
        for i in 0..rows {
            first[i + 2] += first[i + 1];
        }
        entries.clear();
        entries.resize(first[rows + 1] as usize, 0);
        for (t, tie) in ties.iter().enumerate() {
            for (i, k) in places(tie) {
                let next = &mut first[i + 1];
                entries[*next as usize] = (4 * t + k) as u32;
                *next += 1;
            }
        }
        first.pop();
    }

    /// One row of the product with a field of the nodes.
    #[inline]
    pub fn row_times(&self, x: &[DVec3], i: usize) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for entry in &self.entries[self.first[i] as usize..self.first[i + 1] as usize] {
            let (tie, k) = (&self.ties[*entry as usize / 4], *entry as usize % 4);
            let mut met = DVec3::ZERO;
            for l in 0..4 {
                met += x[tie.nodes[l] as usize] * tie.weights[l];
            }
            sum += tie.block * met * tie.weights[k];
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_add_up_to_what_each_block_makes_of_its_sum() {
        let block = DMat3::from_cols(DVec3::new(2.0, 0.5, 0.0), DVec3::new(0.5, 1.0, 0.0), DVec3::Z);
        let tie = |nodes, weights| Coupling { nodes, weights, block };
        let ties = [
            tie([1, 4, 2, 0], [1.0, -0.25, -0.5, -0.25]),
            tie([3, 2, 4, 0], [0.3, 0.7, -0.9, -0.1]),
            tie([2, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        ];
        let x: Vec<DVec3> = (0..5).map(|i| DVec3::new(i as f64, 1.0 - i as f64, (i * i) as f64)).collect();
        let mut expected = [DVec3::ZERO; 5];
        let mut couplings = Couplings::default();
        for tie in ties {
            couplings.push(tie);
            let sum: DVec3 = (0..4).map(|k| x[tie.nodes[k] as usize] * tie.weights[k]).sum();
            for k in 0..4 {
                expected[tie.nodes[k] as usize] += block * sum * tie.weights[k];
            }
        }
        couplings.index(5);
        for (i, expected) in expected.iter().enumerate() {
            assert!(couplings.row_times(&x, i).abs_diff_eq(*expected, 1e-12), "row {i}");
        }
    }
}
