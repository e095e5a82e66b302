//! Who is next to whom on the burn mesh, and how wide the way is.

use crate::sheet::SheetState;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// No free edge is looked for farther away than this [m]; its flames are thinner.
const FAR: f64 = 0.02;
/// "No free edge near": a length that no flame has [m].
pub(super) const NOWHERE: f64 = 1e6;

/// Links of the burn mesh, each at both its ends: those of node i are `start[i]..start[i + 1]`.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    pub start: Vec<u32>,
    pub to: Vec<u32>,
    /// Length at rest [m].
    pub length: Vec<f64>,
    /// Width that the link stands for [m].
    pub width: Vec<f64>,
}

/// A triangle that burns: its nodes, and the motion triangle whose shape it has.
fn burning_triangles(state: &SheetState) -> impl Iterator<Item = ([u32; 3], u32, f64)> + '_ {
    let fine = state.has_fine_burn_mesh();
    let (own, coarse) = (&state.burn_triangles, &state.triangles);
    let count = if fine { own.len() } else { coarse.len() };
    (0..count).filter(move |t| if fine { own.alive[*t] != 0 } else { coarse.alive[*t] != 0 }).map(move |t| {
        if fine {
            let parent = own.parent[t];
            let scale = (own.rest_area[t] / coarse.rest_area[parent as usize]).sqrt();
            (own.corners[t], parent, scale)
        } else {
            (coarse.corners[t].map(|i| state.motion.burn_node[i as usize]), t as u32, 1.0)
        }
    })
}

/// A side of a triangle: ends, length [m], width by this triangle [m], conductance by the sheet's two directions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub ends: [u32; 2],
    pub length: f64,
    pub width: f64,
    pub parent: u32,
    pub opposite: u8,
}

/// Every side of every triangle, sorted by its ends; an inner edge has two.
pub(super) fn sides(state: &SheetState) -> Vec<Side> {
    let mut all = Vec::new();
    for (corners, parent, scale) in burning_triangles(state) {
        let [p, q] = [state.rest.side_1[parent as usize], state.rest.side_2[parent as usize]];
        let points = [glam::DVec3::ZERO, p, q];
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (u, v) = (points[i] - points[k], points[j] - points[k]);
            let cotangent = u.dot(v) / u.cross(v).length();
            let length = scale * points[i].distance(points[j]);
            let [a, b] = [corners[i], corners[j]];
            all.push(Side {
                ends: [a.min(b), a.max(b)],
                length,
                width: 0.5 * cotangent * length,
                parent,
                opposite: k as u8,
            });
        }
    }
    all.sort_unstable_by_key(|side| (side.ends, side.parent, side.opposite));
    all
}

impl Layout {
    /// Lays the links of the live triangles out; a chain has those of its edges.
    pub fn build(&mut self, state: &SheetState) {
        let count = state.burn.len();
        let mut links: Vec<([u32; 2], f64, f64)> = Vec::new();
        if state.triangles.is_empty() {
            let edges = &state.burn_edges;
            for e in (0..edges.len()).filter(|e| edges.cut[*e] == 0) {
                // A chain stands for a strip as wide as its spacing.
                links.push((edges.ends[e], edges.rest_distance[e], edges.rest_distance[e]));
            }
        } else {
            for same in sides(state).chunk_by(|a, b| a.ends == b.ends) {
                let length = same.iter().map(|side| side.length).sum::<f64>() / same.len() as f64;
                let width: f64 = same.iter().map(|side| side.width).sum();
                links.push((same[0].ends, length, width.max(0.0)));
            }
        }
        self.start.clear();
        self.start.resize(count + 1, 0);
        for (ends, ..) in &links {
            ends.iter().for_each(|i| self.start[*i as usize + 1] += 1);
        }
        for i in 0..count {
            self.start[i + 1] += self.start[i];
        }
        let total = self.start[count] as usize;
        let mut next = self.start.clone();
        self.to.clear();
        self.to.resize(total, 0);
        self.length.clear();
        self.length.resize(total, 0.0);
        self.width.clear();
        self.width.resize(total, 0.0);
        for ([i, j], length, width) in links {
            for (from, to) in [(i, j), (j, i)] {
                let place = next[from as usize] as usize;
                self.to[place] = to;
                self.length[place] = length;
                self.width[place] = width;
                next[from as usize] += 1;
            }
        }
    }

    /// Places of the links of a node.
    pub fn links(&self, node: usize) -> std::ops::Range<usize> {
        self.start[node] as usize..self.start[node + 1] as usize
    }
}

/// Free edges of a sheet: length of edge at each node [m], and distance to the nearest one [m].
pub(super) struct FreeEdges {
    pub length: Vec<f64>,
    pub distance: Vec<f64>,
}

struct Reached {
    distance: f64,
    node: u32,
}

impl PartialEq for Reached {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Reached {}
impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Reached {
    /// The nearest is the greatest.
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

/// Finds the free edges of a whole sheet, and who is near them.
pub(super) fn free_edges(state: &SheetState) -> FreeEdges {
    let count = state.burn.len();
    let mut edges = FreeEdges { length: vec![0.0; count], distance: vec![NOWHERE; count] };
    let mut layout = Layout::default();
    layout.build(state);
    for same in sides(state).chunk_by(|a, b| a.ends == b.ends) {
        if let [side] = same {
            for i in side.ends {
                edges.length[i as usize] += 0.5 * side.length;
                edges.distance[i as usize] = 0.0;
            }
        }
    }
    let mut queue: BinaryHeap<Reached> = (0..count as u32)
        .filter(|i| edges.distance[*i as usize] == 0.0)
        .map(|node| Reached { distance: 0.0, node })
        .collect();
    while let Some(Reached { distance, node }) = queue.pop() {
        if distance > edges.distance[node as usize] {
            continue;
        }
        for l in layout.links(node as usize) {
            let (to, farther) = (layout.to[l], distance + layout.length[l]);
            if farther < FAR && farther < edges.distance[to as usize] {
                edges.distance[to as usize] = farther;
                queue.push(Reached { distance: farther, node: to });
            }
        }
    }
    edges
}
