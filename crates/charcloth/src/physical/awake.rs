//! Which nodes a step has to look after: those off the temperature of the room or with a film of gas, and those next to
//! them.
//!
//! Model: none; a step changes nothing at any other node, so that leaving them out changes no bit (Eq. 15.3). Heat gets no
//! further than to the neighbours in a step, so the nodes of one step are found among those of the step before. Valid
//! when: `find` is called before every step. Cost: a bit a node, and a look at each node that was awake.

use super::layout::Layout;

/// A set of nodes, one bit each.
#[derive(Debug, Clone, Default)]
struct Set(Vec<u64>);

impl Set {
    fn clear(&mut self, nodes: usize) {
        self.0.clear();
        self.0.resize(nodes.div_ceil(64), 0);
    }

    #[inline]
    fn add(&mut self, node: usize) {
        self.0[node / 64] |= 1 << (node % 64);
    }

    #[inline]
    fn has(&self, node: usize) -> bool {
        self.0[node / 64] >> (node % 64) & 1 != 0
    }

    /// Appends the nodes, in order.
    fn list(&self, nodes: &mut Vec<u32>) {
        for (place, word) in self.0.iter().enumerate() {
            let mut left = *word;
            while left != 0 {
                nodes.push(64 * place as u32 + left.trailing_zeros());
                left &= left - 1;
            }
        }
    }
}

/// Nodes to look after.
#[derive(Debug, Clone, Default)]
pub(super) struct Awake {
    /// In order.
    pub nodes: Vec<u32>,
    /// With all their neighbours, in order.
    pub near: Vec<u32>,
    /// Nodes that have just fallen asleep.
    pub fallen_asleep: Vec<u32>,
    /// Keeps every node awake: slower, and the same bits.
    pub all: bool,
    set: Set,
    /// Nodes that have been awake since they were last shown.
    touched: Set,
    nodes_before: Vec<u32>,
    /// Whether the set is to be found in the whole state.
    lost: bool,
    /// Whether every node is to be shown.
    all_touched: bool,
}

impl Awake {
    /// The next search is in the whole state, and the next show shows all: the topology has changed, or a run goes on.
    pub fn lose(&mut self, nodes: usize) {
        self.lost = true;
        self.all_touched = true;
        self.touched.clear(nodes);
    }

    /// Finds the nodes that are awake. `stirs` says whether anything is going on at a node by itself; `held` are nodes
    /// that something outside may have reached.
    pub fn find(&mut self, layout: &Layout, stirs: impl Fn(usize) -> bool, held: impl Iterator<Item = usize>) {
        let count = layout.start.len() - 1;
        std::mem::swap(&mut self.nodes, &mut self.nodes_before);
        self.nodes.clear();
        self.set.clear(count);
        if self.all {
            (0..count).for_each(|i| self.set.add(i));
        } else if self.lost {
            (0..count).filter(|i| stirs(*i)).for_each(|i| add_with_neighbours(&mut self.set, layout, i));
        } else {
            let before = self.nodes_before.iter().map(|i| *i as usize).chain(held);
            before.filter(|i| stirs(*i)).for_each(|i| add_with_neighbours(&mut self.set, layout, i));
        }
        self.lost = false;
        self.set.list(&mut self.nodes);
        self.fallen_asleep.clear();
        self.fallen_asleep.extend(self.nodes_before.iter().filter(|i| !self.set.has(**i as usize)));
        for (touched, awake) in self.touched.0.iter_mut().zip(&self.set.0) {
            *touched |= awake;
        }
    }

    /// Finds who is near the nodes that are awake.
    pub fn find_near(&mut self, layout: &Layout) {
        self.near.clear();
        let Self { set, nodes, near, .. } = self;
        for i in nodes.iter() {
            add_with_neighbours(set, layout, *i as usize);
        }
        set.list(near);
    }

    /// Lists the nodes that may have changed since the last call; all of so many, if `all`.
    pub fn touched(&mut self, count: usize, all: bool, nodes: &mut Vec<u32>) {
        nodes.clear();
        if all || self.all || self.all_touched {
            nodes.extend(0..count as u32);
        } else {
            self.touched.list(nodes);
        }
        // What falls asleep in the next step has still to be shown without its flame.
        self.touched.clear(count);
        self.nodes.iter().for_each(|i| self.touched.add(*i as usize));
        self.all_touched = false;
    }
}

fn add_with_neighbours(set: &mut Set, layout: &Layout, node: usize) {
    set.add(node);
    layout.links(node).for_each(|l| set.add(layout.to[l] as usize));
}
