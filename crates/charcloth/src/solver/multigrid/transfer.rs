//! From a level of the multigrid cycle to the next: aggregates, prolongation, and where products of a coarsening go.

use super::NONE;
use super::galerkin::{Prolongation, add_restricted};
use super::lanes::{Strip, Wide, cross, totals};
use crate::solver::blocks::{Columns, Pattern, by_rows, on_widest_unit};
use glam::{Vec3A, Vec4};
use std::ops::Range;

/// Aggregates that a part of the coarsening takes at least.
const AGGREGATES_A_PART: usize = 128;
/// Most parts.
const PARTS: usize = 16;

/// From a level to the next.
pub struct Transfer {
    pub aggregate: Vec<u32>,
    /// Number of nodes of each aggregate.
    pub size: Vec<f32>,
    /// From the middle of its aggregate to each node, over the unit of turns of the next level.
    pub arm: Vec<Vec4>,
    /// The unit of turns of this level over that of the next.
    pub scale: f32,
    rows_a_node: usize,
    /// Where a node's own aggregate stands among those that move it.
    pub own: Vec<u8>,
    /// Prolongation: aggregates that move each node, and strips for the rows of the node.
    pub pattern: Pattern,
    pub strips: Vec<Strip>,
    /// Where the aggregate of each link's other end stands among those that move the node; the same of ties.
    pub smoothed_at: Vec<u8>,
    pub tied_at: Vec<u8>,
    /// Nodes that each aggregate moves.
    transposed: Pattern,
    /// Matrix times prolongation: which aggregates a node meets, and where each product goes among them.
    product: Pattern,
    product_at: Vec<u16>,
    first_product: Vec<u32>,
    /// Where what a node passes on to each aggregate goes within the row of that: from the diagonal on.
    coarse_at: Vec<u16>,
    first_coarse: Vec<u32>,
    parts: Vec<Part>,
    /// All of them.
    whole: Part,
    /// Products of a node, for each part.
    sums: Vec<Vec<Wide>>,
}

/// A range of aggregates, and the nodes that they move.
struct Part {
    aggregates: Range<usize>,
    nodes: Vec<u32>,
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
    /// Lays out the way from a level to its aggregates: of a matrix of these patterns and a level of these links.
    pub fn lay_out(
        [matrix, ties, links]: [&Pattern; 3],
        rows_a_node: usize,
        aggregate: Vec<u32>,
        count: usize,
    ) -> Self {
        let nodes = matrix.rows();
        let all_columns = |i: usize| matrix.columns(i).iter().chain(ties.columns(i)).copied();
        let mut columns = Columns::new(count);
        let (mut pattern, mut own) = (Pattern::empty(0), Vec::with_capacity(nodes));
        let (mut smoothed_at, mut tied_at) = (Vec::with_capacity(links.blocks()), Vec::with_capacity(ties.blocks()));
        for i in 0..nodes {
            let near = all_columns(i).map(|j| aggregate[j as usize]).filter(|a| *a != NONE);
            // A fixed node is moved by none.
            let moved_by = if aggregate[i] == NONE { &[] } else { columns.collect(i, near) };
            pattern.push_row(moved_by);
            let place = |j: u32| match aggregate[j as usize] {
                NONE => u8::MAX,
                a => columns.place(i, a).map_or(u8::MAX, |place| place as u8),
            };
            own.push(place(i as u32));
            smoothed_at.extend(links.columns(i).iter().map(|j| place(*j)));
            tied_at.extend(ties.columns(i).iter().map(|j| place(*j)));
        }
        let mut columns = Columns::new(count);
        let mut product = Pattern::empty(0);
        let (mut product_at, mut first_product) = (Vec::new(), Vec::with_capacity(nodes + 1));
        for i in 0..nodes {
            first_product.push(product_at.len() as u32);
            let met = || all_columns(i).flat_map(|j| pattern.columns(j as usize)).copied();
            if pattern.row(i).is_empty() {
                product.push_row(&[]);
                continue;
            }
            product.push_row(columns.collect(i, met()));
            product_at.extend(met().map(|a| columns.place(i, a).expect("collected") as u16));
        }
        first_product.push(product_at.len() as u32);
        let mut size = vec![0.0; count];
        aggregate.iter().filter(|a| **a != NONE).for_each(|a| size[*a as usize] += 1.0);
        let transposed = pattern.transposed(count);
        let parts = (count / AGGREGATES_A_PART).clamp(1, PARTS);
        let parts: Vec<_> =
            (0..parts).map(|p| Part::over(p * count / parts..(p + 1) * count / parts, &transposed)).collect();
        Self {
            rows_a_node,
            strips: vec![Strip::ZERO; pattern.blocks() * rows_a_node],
            arm: vec![Vec4::ZERO; nodes],
            scale: 0.0,
            own,
            size,
            aggregate,
            pattern,
            smoothed_at,
            tied_at,
            product,
            product_at,
            first_product,
            coarse_at: Vec::new(),
            first_coarse: Vec::new(),
            whole: Part::over(0..count, &transposed),
            sums: vec![Vec::new(); parts.len()],
            parts,
            transposed,
        }
    }

    /// The pattern of the next level; looks up where products go in it.
    pub fn lay_out_coarse(&mut self) -> Pattern {
        let mut coarse = Pattern::empty(0);
        let mut columns = Columns::new(self.transposed.rows());
        for a in 0..self.transposed.rows() {
            let nodes = self.transposed.columns(a).iter();
            let met = nodes.flat_map(|i| self.product.columns(*i as usize)).copied();
            coarse.push_row(columns.collect(a, met.chain([a as u32])));
        }
        for i in 0..self.pattern.rows() {
            self.first_coarse.push(self.coarse_at.len() as u32);
            for a in self.pattern.columns(i) {
                // Both in rising order.
                let row = coarse.columns(*a as usize);
                let mut place = 0;
                for b in self.product.columns(i).iter().filter(|b| *b >= a) {
                    place += row[place..].iter().position(|c| c == b).expect("the pattern holds every product");
                    self.coarse_at.push(place as u16);
                }
            }
        }
        coarse
    }

    /// Which aggregates touch: the graph of the next level.
    pub fn coarse_graph(&self, graph: &Pattern, count: usize) -> Pattern {
        let mut nodes = vec![Vec::new(); count];
        for (i, a) in self.aggregate.iter().enumerate().filter(|(_, a)| **a != NONE) {
            nodes[*a as usize].push(i);
        }
        let mut coarse = Pattern::empty(0);
        let mut columns = Columns::new(count);
        for (a, nodes) in nodes.iter().enumerate() {
            let near = nodes.iter().flat_map(|i| graph.columns(*i)).map(|j| self.aggregate[*j as usize]);
            coarse.push_row(columns.collect(a, near.filter(|b| *b != NONE)));
        }
        coarse
    }

    /// Restriction of a field of this level: what nodes pass on to aggregates, summed up in rising order, whatever the parts.
    pub fn restrict(&self, fine: &[Vec4], coarse: &mut [[Vec4; 2]], parallel: bool) {
        in_parts(
            self.parts(parallel),
            coarse,
            &|coarse, low| coarse.split_at_mut(low[low.len() - 1].aggregates.end - low[0].aggregates.start),
            &|part, coarse| self.restrict_to(part, fine, coarse),
        );
    }

    fn restrict_to(&self, Part { aggregates, nodes }: &Part, fine: &[Vec4], coarse: &mut [[Vec4; 2]]) {
        coarse.fill([Vec4::ZERO; 2]);
        let Self { pattern, strips, rows_a_node, .. } = self;
        for i in nodes.iter().map(|i| *i as usize) {
            for k in pattern.row(i) {
                let a = pattern.column[k] as usize;
                if !aggregates.contains(&a) {
                    continue;
                }
                let [moves, turns] = &mut coarse[a - aggregates.start];
                for half in 0..*rows_a_node {
                    let (strip, pull) = (&strips[rows_a_node * k + half], fine[rows_a_node * i + half]);
                    let [a, b, c] = [strip.row(0), strip.row(1), strip.row(2)];
                    *moves += (a[0] * pull.x + b[0] * pull.y) + c[0] * pull.z;
                    *turns += (a[1] * pull.x + b[1] * pull.y) + c[1] * pull.z;
                }
            }
        }
    }

    /// The parts of the work: one where it is all done by one thread.
    fn parts(&self, parallel: bool) -> &[Part] {
        if parallel { &self.parts } else { std::slice::from_ref(&self.whole) }
    }

    /// Adds to a field of this level what moves of bodies make of it.
    pub fn prolong(&self, coarse: &[Vec4], fine: &mut [Vec4], parallel: bool) {
        by_rows(fine, parallel, |first, fine| {
            let transfer = self;
            on_widest_unit!((transfer: &Transfer, coarse: &[Vec4], first: usize, fine: &mut [Vec4]) {
                let Transfer { pattern, strips, rows_a_node, .. } = transfer;
                let bodies = coarse.as_chunks::<2>().0;
                for (k, field) in fine.iter_mut().enumerate() {
                    let (node, half) = ((first + k) / rows_a_node, (first + k) % rows_a_node);
                    let mut sums = [Vec4::ZERO; 3];
                    for from in pattern.row(node) {
                        let [moves, turns] = bodies[pattern.column[from] as usize];
                        let met = strips[rows_a_node * from + half].meet(moves, turns);
                        sums.iter_mut().zip(met).for_each(|(sum, met)| *sum += met);
                    }
                    *field += totals(&sums);
                }
            });
        });
    }

    /// The matrix of the next level: P^T A P. `product` works out the row of A P of a node, given the places of its
    /// products. Rows are summed up node by node in rising order, whatever the parts.
    pub fn coarsen(
        &mut self,
        coarse_pattern: &Pattern,
        coarse: &mut [[Wide; 2]],
        parallel: bool,
        product: impl Fn(usize, Prolongation<'_>, &[u16], &mut [Wide]) + Sync,
    ) {
        let mut sums = std::mem::take(&mut self.sums);
        in_parts(
            self.parts(parallel),
            (&mut sums[..], coarse),
            &|(sums, coarse), low| {
                let first = |aggregate: usize| coarse_pattern.first[aggregate] as usize;
                let end = low[low.len() - 1].aggregates.end;
                let (low_sums, high_sums) = sums.split_at_mut(low.len());
                let (low_rows, high_rows) = coarse.split_at_mut(first(end) - first(low[0].aggregates.start));
                ((low_sums, low_rows), (high_sums, high_rows))
            },
            &|part, (sums, coarse)| {
                coarse.fill([Wide::ZERO; 2]);
                for i in &part.nodes {
                    self.pass_on(*i as usize, &part.aggregates, coarse_pattern, &mut sums[0], &product, coarse);
                }
            },
        );
        self.sums = sums;
    }

    /// Adds what a node passes on to a range of aggregates, whose rows `coarse` has.
    fn pass_on(
        &self,
        i: usize,
        aggregates: &Range<usize>,
        coarse_pattern: &Pattern,
        sums: &mut Vec<Wide>,
        product: &impl Fn(usize, Prolongation<'_>, &[u16], &mut [Wide]),
        coarse: &mut [[Wide; 2]],
    ) {
        let rows_a_node = self.rows_a_node;
        let met = self.product.columns(i);
        if met.is_empty() {
            return;
        }
        sums.resize(met.len() * rows_a_node, Wide::ZERO);
        let places = self.first_product[i] as usize..self.first_product[i + 1] as usize;
        let prolongation = Prolongation { pattern: &self.pattern, strips: &self.strips };
        product(i, prolongation, &self.product_at[places], sums);
        let mut places = &self.coarse_at[self.first_coarse[i] as usize..];
        for k in self.pattern.row(i) {
            let a = self.pattern.column[k];
            let before = met.partition_point(|b| *b < a);
            let (own, rest) = places.split_at(met.len() - before);
            places = rest;
            if aggregates.contains(&(a as usize)) {
                let base = coarse_pattern.first[aggregates.start] as usize;
                let row = coarse_pattern.row(a as usize);
                let strips = &self.strips[rows_a_node * k..rows_a_node * (k + 1)];
                let products = &sums[rows_a_node * before..];
                add_restricted(strips, products, own, &mut coarse[row.start - base..row.end - base]);
            }
        }
    }

    /// Takes up where nodes and the middles of aggregates are, with the units of turns of both levels.
    pub fn place(&mut self, position: &[Vec3A], middle: &[Vec3A], reach: f32, next_reach: f32) {
        for (i, a) in self.aggregate.iter().enumerate().filter(|(_, a)| **a != NONE) {
            self.arm[i] = ((position[i] - middle[*a as usize]) / next_reach).extend(0.0);
        }
        self.scale = reach / next_reach;
    }

    /// Adds how the aggregate of a node moves it: its displacement, or its turn.
    pub fn add_tentative(&self, i: usize, half: usize, strip: &mut Strip) {
        for (r, axis) in [Vec4::X, Vec4::Y, Vec4::Z].into_iter().enumerate() {
            match half {
                0 => strip.add(r, [axis, cross(self.arm[i], axis)]),
                _ => strip.add(r, [Vec4::ZERO, axis * self.scale]),
            }
        }
    }
}

/// Runs `work(part, its share)` over parts; `split` splits a share between the first of the parts that it is for and the others.
fn in_parts<T: Send>(
    parts: &[Part],
    whole: T,
    split: &(impl Fn(T, &[Part]) -> (T, T) + Sync),
    work: &(impl Fn(&Part, T) + Sync),
) {
    if let [part] = parts {
        return work(part, whole);
    }
    let (low, high) = parts.split_at(parts.len() / 2);
    let (low_share, high_share) = split(whole, low);
    rayon::join(|| in_parts(low, low_share, split, work), || in_parts(high, high_share, split, work));
}

impl Part {
    fn over(aggregates: Range<usize>, transposed: &Pattern) -> Self {
        let mut nodes: Vec<u32> = aggregates.clone().flat_map(|a| transposed.columns(a)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        Self { aggregates, nodes }
    }
}
