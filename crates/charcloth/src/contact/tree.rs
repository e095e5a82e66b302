//! A tree of boxes, and all pairs of boxes that overlap.
//!
//! Model: items (vertices, edges, triangles) are put in order once per topology by halving along the longest axis;
//! eight neighbours make a leaf, two nodes make a node, and the boxes are refitted at every query, in place. Two trees,
//! or a tree and itself, are walked together. The walk is cut into tasks by the trees alone, so the division of work
//! does not depend on the number of threads; and whether a pair is found depends on its own two boxes alone, not on the
//! shape of the tree. Boxes are in f32, rounded outwards. Cost: n log n to build, n to refit, and about the number of
//! overlaps to walk.

use glam::{BVec4A, DVec3, DVec4, Mat4, Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

/// Items in a leaf.
const LEAF: usize = 8;

/// Leaves that one thread refits at a time, at least.
const REFIT_LEAVES: usize = 128;

/// Items that are put in order by one thread.
const ARRANGE_ALONE: usize = 4096;

/// The walk is cut into at least this many tasks where it can be. tuned: enough to keep a dozen threads busy
const TASKS: usize = 256;

/// How far something reaches along the three axes and the diagonal (1, 1, 1)/sqrt(3) [m]: four lanes cost what three do.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    lowest: Vec4,
    highest: Vec4,
}

impl Bounds {
    const EMPTY: Self = Self { lowest: Vec4::INFINITY, highest: Vec4::NEG_INFINITY };

    /// The bounds of points, widened by a margin on every side [m].
    #[inline]
    pub fn around(points: &[DVec3], margin: f64) -> Self {
        const DIAGONAL: f64 = 0.577_350_269_189_625_8;
        let along = |p: DVec3| DVec4::new(p.x, p.y, p.z, (p.x + p.y + p.z) * DIAGONAL);
        let (mut lowest, mut highest) = (along(points[0]), along(points[0]));
        for point in &points[1..] {
            lowest = lowest.min(along(*point));
            highest = highest.max(along(*point));
        }
        // An f64 becomes an f32 with an error of at most 2^-24 of it: twice that is outwards.
        let outwards = |bound: DVec4| bound.abs() * 1.2e-7 + margin;
        Self { lowest: (lowest - outwards(lowest)).as_vec4(), highest: (highest + outwards(highest)).as_vec4() }
    }

    #[inline(always)]
    fn overlaps(&self, other: &Self) -> bool {
        (self.lowest.cmple(other.highest) & other.lowest.cmple(self.highest)).all()
    }

    #[inline(always)]
    fn join(&self, other: &Self) -> Self {
        Self { lowest: self.lowest.min(other.lowest), highest: self.highest.max(other.highest) }
    }
}

/// The bounds of the eight items of a leaf, turned so that four are compared at once.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    lowest: [[Vec4; 4]; 2],
    highest: [[Vec4; 4]; 2],
}

impl Leaf {
    const EMPTY: Self = Self { lowest: [[Vec4::INFINITY; 4]; 2], highest: [[Vec4::NEG_INFINITY; 4]; 2] };

    fn of(bounds: &[Bounds; LEAF]) -> Self {
        let turned = |bound: fn(&Bounds) -> Vec4| {
            [0, 4].map(|half| Mat4::from_cols_array_2d(&std::array::from_fn(|k| bound(&bounds[half + k]).to_array())))
        };
        let axes = |turned: [Mat4; 2]| {
            turned.map(|columns| {
                let rows = columns.transpose();
                [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis]
            })
        };
        Self { lowest: axes(turned(|b| b.lowest)), highest: axes(turned(|b| b.highest)) }
    }

    /// Which of the eight overlap, a bit each.
    #[inline(always)]
    fn overlaps(&self, bounds: &Bounds) -> u32 {
        let splat = |v: Vec4| [v.xxxx(), v.yyyy(), v.zzzz(), v.wwww()];
        let (lowest, highest) = (splat(bounds.lowest), splat(bounds.highest));
        let half = |h: usize| {
            let along = |k: usize| self.lowest[h][k].cmple(highest[k]) & lowest[k].cmple(self.highest[h][k]);
            (along(0) & along(1) & along(2) & along(3)).bitmask()
        };
        half(0) | half(1) << 4
    }
}

/// Boxes over numbered items.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Items in the order of the leaves.
    items: Vec<u32>,
    /// Boxes of the items, by leaf; empty past the last.
    bounds: Vec<[Bounds; LEAF]>,
    /// The same, turned.
    leaves: Vec<Leaf>,
    /// Nodes of the items, by leaf.
    item_nodes: Vec<ItemNodes>,
    /// Number of nodes of an item, 1 to 3.
    nodes_an_item: usize,
    /// Boxes of the nodes, leaves first. Node n of a level is over nodes 2 n and 2 n + 1 of the level below.
    nodes: Vec<Bounds>,
    /// Where each level begins in `nodes`, and the end.
    levels: Vec<usize>,
    /// Working storage of the build.
    places: Vec<Place>,
}

/// The nodes of the items of a leaf, by their place in the item, as numbers that compare four at once: exact, for an f32
/// holds every whole number below 2^24. Past that, and past the last item, they are equal to nothing, which only costs
/// time: `visit` leaves out what shares a node in any case.
#[derive(Debug, Clone, Copy)]
struct ItemNodes([[Vec4; 2]; 3]);

impl ItemNodes {
    fn of<const N: usize>(items: &[u32], nodes_of: impl Fn(u32) -> [u32; N]) -> Self {
        let exact = |i: u32| if i < 1 << 24 { i as f32 } else { f32::NAN };
        let node = |place: usize, k: usize| items.get(place).map_or(f32::NAN, |item| exact(nodes_of(*item)[k]));
        let row = |k: usize| [0, 4].map(|half| Vec4::from_array(std::array::from_fn(|j| node(half + j, k))));
        Self(std::array::from_fn(|k| if k < N { row(k) } else { [Vec4::NAN; 2] }))
    }

    /// Which of the eight, of `others` nodes each, share a node with the item of another leaf, of `own` nodes; a bit each.
    #[inline(always)]
    fn sharing(&self, others: usize, leaf: &Self, place: usize, own: usize) -> u32 {
        let mut shared = [BVec4A::FALSE; 2];
        for row in &leaf.0[..own] {
            let node = Vec4::splat(row[place / 4].to_array()[place % 4]);
            for other in &self.0[..others] {
                shared[0] |= other[0].cmpeq(node);
                shared[1] |= other[1].cmpeq(node);
            }
        }
        shared[0].bitmask() | shared[1].bitmask() << 4
    }
}

/// An item while it is put in order.
#[derive(Debug, Clone, Copy)]
struct Place {
    centre: Vec3,
    item: u32,
}

impl Tree {
    /// Puts items of so many nodes in order by where they are [m]. Boxes are empty until the first refit.
    pub fn rebuild<const N: usize>(
        &mut self,
        items: impl Iterator<Item = u32>,
        nodes_of: impl Fn(u32) -> [u32; N],
        positions: &[DVec3],
    ) {
        let centre = |item: u32| nodes_of(item).iter().map(|i| positions[*i as usize]).sum::<DVec3>() / N as f64;
        self.places.clear();
        self.places.extend(items.map(|item| Place { centre: centre(item).as_vec3(), item }));
        arrange(&mut self.places);
        self.items.clear();
        self.items.extend(self.places.iter().map(|place| place.item));
        self.nodes_an_item = N;
        self.item_nodes.clear();
        self.item_nodes.extend(self.items.chunks(LEAF).map(|items| ItemNodes::of(items, &nodes_of)));
        let mut width = self.items.len().div_ceil(LEAF);
        self.leaves.clear();
        self.leaves.resize(width, Leaf::EMPTY);
        self.bounds.clear();
        self.bounds.resize(width, [Bounds::EMPTY; LEAF]);
        self.nodes.clear();
        self.levels.clear();
        while width > 0 {
            self.levels.push(self.nodes.len());
            self.nodes.resize(self.nodes.len() + width, Bounds::EMPTY);
            width = if width == 1 { 0 } else { width.div_ceil(2) };
        }
        self.levels.push(self.nodes.len());
    }

    /// Brings every box up to date.
    pub fn refit(&mut self, bounds_of: impl Fn(u32) -> Bounds + Sync) {
        let Self { items, bounds, leaves, nodes, levels, .. } = self;
        let whole = &mut nodes[..leaves.len()];
        let rows = items.par_chunks(LEAF).zip(bounds).zip(leaves).zip(whole).with_min_len(REFIT_LEAVES);
        rows.for_each(|(((items, bounds), leaf), whole)| {
            for (bounds, item) in bounds.iter_mut().zip(items) {
                *bounds = bounds_of(*item);
            }
            *leaf = Leaf::of(bounds);
            *whole = bounds.iter().fold(Bounds::EMPTY, |sum, next| sum.join(next));
        });
        for level in 1..levels.len().saturating_sub(1) {
            let (below, above) = nodes.split_at_mut(levels[level]);
            let below = &below[levels[level - 1]..];
            for (node, boxes) in below.chunks(2).enumerate() {
                above[node] = boxes.iter().fold(Bounds::EMPTY, |sum, next| sum.join(next));
            }
        }
    }

    /// Number of levels; 0 for a tree without items.
    fn height(&self) -> usize {
        self.levels.len().saturating_sub(1)
    }

    fn node(&self, level: u32, node: u32) -> &Bounds {
        &self.nodes[self.levels[level as usize] + node as usize]
    }

    /// The nodes one level down, which must not be the leaves' items.
    fn children(&self, level: u32, node: u32) -> std::ops::Range<u32> {
        let width = self.levels[level as usize] - self.levels[level as usize - 1];
        2 * node..(2 * node + 2).min(width as u32)
    }
}

/// Halves along the longest axis, at a whole power of two of leaves, so that the halves are nodes of the tree.
fn arrange(places: &mut [Place]) {
    if places.len() <= LEAF {
        return;
    }
    let half = places.len().div_ceil(LEAF).next_power_of_two() / 2 * LEAF;
    let (mut lowest, mut highest) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for place in places.iter() {
        lowest = lowest.min(place.centre);
        highest = highest.max(place.centre);
    }
    let axis = (highest - lowest).max_position();
    places.select_nth_unstable_by(half, |p, q| p.centre[axis].total_cmp(&q.centre[axis]).then(p.item.cmp(&q.item)));
    let (left, right) = places.split_at_mut(half);
    if left.len() > ARRANGE_ALONE {
        rayon::join(|| arrange(left), || arrange(right));
    } else {
        arrange(left);
        arrange(right);
    }
}

/// A node of each tree whose boxes overlap.
#[derive(Debug, Clone, Copy)]
struct NodePair {
    level: [u32; 2],
    node: [u32; 2],
}

/// The walk over overlapping pairs, with what was found in each task. Keeps its storage from query to query.
#[derive(Debug, Clone)]
pub struct Walk<T> {
    seeds: Vec<NodePair>,
    next: Vec<NodePair>,
    tasks: Vec<Task<T>>,
    order: Order,
}

#[derive(Debug, Clone)]
struct Task<T> {
    stack: Vec<NodePair>,
    found: Vec<([u32; 2], T)>,
}

/// Working storage of the sort.
#[derive(Debug, Clone, Default)]
struct Order {
    /// Where the finds of each first item begin.
    first: Vec<u32>,
    /// Second item, task, place in the task.
    places: Vec<[u32; 3]>,
}

impl<T> Default for Walk<T> {
    fn default() -> Self {
        Self { seeds: Vec::new(), next: Vec::new(), tasks: Vec::new(), order: Order::default() }
    }
}

impl<T: Copy + Send + Sync> Walk<T> {
    /// Shows `visit` every pair of an item of `first` and one of `second` whose boxes overlap, but for those
    /// that share a node, and keeps what it gives.
    pub fn between(&mut self, first: &Tree, second: &Tree, visit: impl Fn(u32, u32) -> Option<T> + Sync) {
        self.run(first, second, false, visit);
    }

    /// Shows `visit` every pair of items of one tree whose boxes overlap, but for those that share a node, once,
    /// lower item first.
    pub fn within(&mut self, tree: &Tree, visit: impl Fn(u32, u32) -> Option<T> + Sync) {
        self.run(tree, tree, true, |i, j| visit(i.min(j), i.max(j)));
    }

    fn run(&mut self, first: &Tree, second: &Tree, same: bool, visit: impl Fn(u32, u32) -> Option<T> + Sync) {
        self.plan(first, second, same);
        if self.tasks.len() < self.seeds.len() {
            self.tasks.resize_with(self.seeds.len(), || Task { stack: Vec::new(), found: Vec::new() });
        }
        self.tasks.iter_mut().for_each(|task| task.found.clear());
        self.tasks.par_iter_mut().with_max_len(1).zip(&self.seeds).for_each(|(task, seed)| {
            let Task { stack, found } = task;
            stack.clear();
            stack.push(*seed);
            while let Some(pair) = stack.pop() {
                if pair.level == [0, 0] {
                    visit_leaves(first, second, same, pair.node, |i, j| {
                        if let Some(find) = visit(i, j) {
                            let key = if same { [i.min(j), i.max(j)] } else { [i, j] };
                            found.push((key, find));
                        }
                    });
                } else {
                    open(first, second, same, pair, stack);
                }
            }
        });
    }

    /// Opens pairs of nodes, the same on any number of threads, until there are enough for a task each.
    fn plan(&mut self, first: &Tree, second: &Tree, same: bool) {
        let Self { seeds, next, .. } = self;
        seeds.clear();
        if first.height() == 0 || second.height() == 0 {
            return;
        }
        let level = [first.height() as u32 - 1, second.height() as u32 - 1];
        if first.node(level[0], 0).overlaps(second.node(level[1], 0)) {
            seeds.push(NodePair { level, node: [0, 0] });
        }
        while seeds.len() < TASKS && seeds.iter().any(|pair| pair.level != [0, 0]) {
            next.clear();
            for pair in seeds.iter() {
                if pair.level == [0, 0] {
                    next.push(*pair);
                } else {
                    open(first, second, same, *pair, next);
                }
            }
            std::mem::swap(seeds, next);
        }
    }

    /// Everything found, on the end of `out`, in order of first item, then second.
    pub fn gather(&mut self, out: &mut Vec<T>) {
        let Order { first, places } = &mut self.order;
        let tasks = &self.tasks;
        let keys = || tasks.iter().flat_map(|task| task.found.iter().map(|(key, _)| *key));
        let Some(rows) = keys().map(|key| key[0] as usize + 1).max() else {
            return;
        };
        // Counting sort by first item.
        first.clear();
        first.resize(rows + 2, 0);
        keys().for_each(|key| first[key[0] as usize + 2] += 1);
        for row in 0..rows {
            first[row + 2] += first[row + 1];
        }
        places.clear();
        places.resize(first[rows + 1] as usize, [0; 3]);
        for (t, task) in tasks.iter().enumerate() {
            for (k, (key, _)) in task.found.iter().enumerate() {
                let next = &mut first[key[0] as usize + 1];
                places[*next as usize] = [key[1], t as u32, k as u32];
                *next += 1;
            }
        }
        out.reserve(places.len());
        for row in 0..rows {
            let places = &mut places[first[row] as usize..first[row + 1] as usize];
            places.sort_unstable();
            out.extend(places.iter().map(|[_, t, k]| tasks[*t as usize].found[*k as usize].1));
        }
    }
}

/// Pushes the pairs of nodes below a pair whose boxes overlap.
#[inline]
fn open(first: &Tree, second: &Tree, same: bool, pair: NodePair, out: &mut Vec<NodePair>) {
    let NodePair { level, node } = pair;
    if same && level[0] == level[1] && node[0] == node[1] {
        let below = [level[0] - 1; 2];
        let children = first.children(level[0], node[0]);
        let (left, right) = (children.start, children.end - 1);
        out.push(NodePair { level: below, node: [left, left] });
        if left != right {
            out.push(NodePair { level: below, node: [right, right] });
            if first.node(below[0], left).overlaps(first.node(below[0], right)) {
                out.push(NodePair { level: below, node: [left, right] });
            }
        }
        return;
    }
    // The higher node is opened, both where they are level.
    let opens = [level[0] >= level[1], level[1] >= level[0]];
    let below = [level[0] - opens[0] as u32, level[1] - opens[1] as u32];
    let range = |tree: &Tree, k: usize| match opens[k] {
        true => tree.children(level[k], node[k]),
        false => node[k]..node[k] + 1,
    };
    for i in range(first, 0) {
        let bounds = first.node(below[0], i);
        for j in range(second, 1) {
            if bounds.overlaps(second.node(below[1], j)) {
                out.push(NodePair { level: below, node: [i, j] });
            }
        }
    }
}

/// Shows every overlapping pair of items of two leaves that share no node.
#[inline]
fn visit_leaves(first: &Tree, second: &Tree, same: bool, leaves: [u32; 2], mut visit: impl FnMut(u32, u32)) {
    let within = same && leaves[0] == leaves[1];
    let [a, b] = leaves.map(|leaf| leaf as usize);
    let (items, others) = (&first.items[a * LEAF..], &second.items[b * LEAF..]);
    let mut left = first.leaves[a].overlaps(&second.nodes[b]);
    while left != 0 {
        let i = left.trailing_zeros();
        left &= left - 1;
        let mut right = second.leaves[b].overlaps(&first.bounds[a][i as usize]);
        if within {
            right &= u32::MAX << (i + 1);
        }
        if right != 0 {
            let (nodes, others) = (&first.item_nodes[a], &second.item_nodes[b]);
            right &= !others.sharing(second.nodes_an_item, nodes, i as usize, first.nodes_an_item);
        }
        while right != 0 {
            let j = right.trailing_zeros();
            right &= right - 1;
            visit(items[i as usize], others[j as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn boxes(random: &mut Random, count: usize, size: f64) -> Vec<[DVec3; 2]> {
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform());
        let mut corner = || (point(), point());
        (0..count).map(|_| corner()).map(|(p, q)| [p, p + size * q]).collect()
    }

    /// Some share a node.
    fn nodes_of(item: u32) -> [u32; 2] {
        [item, item / 2]
    }

    fn tree(boxes: &[[DVec3; 2]]) -> Tree {
        let mut tree = Tree::default();
        let positions: Vec<DVec3> = boxes.iter().map(|p| p[0]).collect();
        tree.rebuild(0..boxes.len() as u32, nodes_of, &positions);
        tree.refit(|i| Bounds::around(&boxes[i as usize], 0.0));
        tree
    }

    #[test]
    fn every_overlap_is_found_once_and_in_order() {
        let mut random = Random::new(1, 1);
        let (mut between, mut within) = (Walk::default(), Walk::default());
        for round in 0..200 {
            let count = [0, 1, 7, 8, 9, 40, 65, 200][round % 8];
            let (a, b) = (boxes(&mut random, count, 0.3), boxes(&mut random, 100, 0.1));
            let overlap = |p: &[DVec3; 2], q: &[DVec3; 2]| Bounds::around(p, 0.0).overlaps(&Bounds::around(q, 0.0));
            let apart = |i: usize, j: usize| nodes_of(i as u32).iter().all(|n| !nodes_of(j as u32).contains(n));
            let (mut crossed, mut own) = (Vec::new(), Vec::new());
            for i in 0..a.len() {
                let others = (0..b.len()).filter(|j| apart(i, *j) && overlap(&a[i], &b[*j]));
                crossed.extend(others.map(|j| [i as u32, j as u32]));
                let others = (i + 1..a.len()).filter(|j| apart(i, *j) && overlap(&a[i], &a[*j]));
                own.extend(others.map(|j| [i as u32, j as u32]));
            }
            let (ta, tb) = (tree(&a), tree(&b));
            let mut out = Vec::new();
            between.between(&ta, &tb, |i, j| Some([i, j]));
            between.gather(&mut out);
            assert_eq!(out, crossed);
            out.clear();
            within.within(&ta, |i, j| Some([i, j]));
            within.gather(&mut out);
            assert_eq!(out, own);
        }
    }
}
