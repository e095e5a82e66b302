//! Where springs have given way, the sheet comes apart.
//!
//! A broken structural spring parts the sheet along its edge: the triangles at the edge are cut from the surface. A
//! spring that has lost the triangles it hangs on is gone too. Where the triangles around a node no longer hang together,
//! the node is split, one copy for each fan of triangles, and its mass, fuel and heat are shared by area. A node with no
//! triangle left is ash: it keeps its mass and fuel in the books but moves no more. A crack parts two triangles along the
//! side that they share and cuts neither: across such a side triangles do not hang together. Connected pieces keep their number
//! as long as they hold together; what comes off gets a new one. A finer burn mesh follows: its triangles go with those
//! that carry them, or burn through by themselves, and its nodes are split in the same way.

use crate::burn_mesh;
use crate::sheet::{BurnTriangles, NONE, Pieces, SheetState, SpringKind, Triangles};

/// Brings the surface up to date with its broken springs. Returns whether anything changed.
pub fn split(state: &mut SheetState) -> bool {
    let mut fresh = cut_triangles(state);
    let mut fine = false;
    if state.has_fine_burn_mesh() {
        let [with_parents, parents] = burn_mesh::cut_with_parents(state);
        fresh |= parents;
        fine = with_parents;
    }
    let mut changed = drop_springs(state) || fresh;
    if fresh {
        split_nodes(state);
        // Springs over two edges of a grid hang on triangles that a split may have parted.
        drop_springs(state);
        number_pieces(state);
    }
    if state.has_fine_burn_mesh() {
        // What has burnt through by itself shows in its edges, which lose their triangles.
        fine |= burn_mesh::cut_edges(&mut state.burn_edges, &state.burn_triangles);
        if fine || fresh {
            split_burn_nodes(state);
        }
        return changed || fine;
    }
    // The springs of a chain have no triangles to cut.
    changed |= cut_burn_edges(state);
    changed
}

/// Brings the surface up to date with sides along which it has cracked, and triangles that are gone.
pub fn part(state: &mut SheetState) {
    split_nodes(state);
    drop_springs(state);
    number_pieces(state);
    if state.has_fine_burn_mesh() {
        burn_mesh::cut_edges(&mut state.burn_edges, &state.burn_triangles);
        split_burn_nodes(state);
    }
}

/// Marks the side of a motion triangle that leads from one of its corners to another as parted.
pub(crate) fn part_side(state: &mut SheetState, t: u32, ends: [u32; 2]) {
    let corners = state.triangles.corners[t as usize];
    if let Some(opposite) = corners.iter().position(|i| !ends.contains(i)) {
        state.triangles.parted[t as usize] |= 1 << opposite;
    }
}

/// Cuts the triangles along broken edges.
fn cut_triangles(state: &mut SheetState) -> bool {
    let (springs, triangles) = (&state.springs, &mut state.triangles);
    let mut fresh = false;
    for s in 0..springs.len() {
        // Only springs along an edge of the surface part it; one over an edge is a crease that has gone soft.
        if springs.broken[s] == 0 || springs.needs_both[s] != 0 {
            continue;
        }
        for t in springs.carriers[s] {
            if t != NONE && triangles.alive[t as usize] != 0 {
                triangles.alive[t as usize] = 0;
                fresh = true;
            }
        }
    }
    fresh
}

/// Breaks the springs that have lost the triangles they hang on; two triangles must also still hang together.
fn drop_springs(state: &mut SheetState) -> bool {
    let (springs, triangles) = (&mut state.springs, &state.triangles);
    let mut dropped = false;
    for s in 0..springs.len() {
        let carriers = springs.carriers[s];
        if springs.broken[s] != 0 || carriers == [NONE; 2] {
            continue;
        }
        let holds = |t: u32| t != NONE && triangles.alive[t as usize] != 0;
        let meet =
            |[a, b]: [u32; 2]| triangles.corners[a as usize].iter().any(|i| triangles.corners[b as usize].contains(i));
        let held = if springs.needs_both[s] != 0 {
            holds(carriers[0]) && holds(carriers[1]) && meet(carriers)
        } else {
            holds(carriers[0]) || holds(carriers[1])
        };
        if !held {
            springs.broken[s] = 1;
            dropped = true;
        }
    }
    dropped
}

/// Stops the heat across broken edges. Returns whether any was fresh.
fn cut_burn_edges(state: &mut SheetState) -> bool {
    let (springs, cut) = (&state.springs, &mut state.burn_edges.cut);
    let mut fresh = false;
    for s in 0..springs.len() {
        if springs.broken[s] != 0 && springs.kind[s] == SpringKind::Structural as u8 && springs.edge[s] != NONE {
            let cut = &mut cut[springs.edge[s] as usize];
            fresh |= *cut == 0;
            *cut = 1;
        }
    }
    fresh
}

/// Live triangles at each of so many nodes: first of each in the list, and the list.
pub(crate) fn triangles_at_nodes(count: usize, corners: &[[u32; 3]], alive: &[u8]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0u32; count + 1];
    for t in 0..corners.len() {
        if alive[t] != 0 {
            corners[t].iter().for_each(|i| first[*i as usize + 1] += 1);
        }
    }
    for i in 0..count {
        first[i + 1] += first[i];
    }
    let mut next = first.clone();
    let mut list = vec![0u32; first[count] as usize];
    for t in 0..corners.len() {
        if alive[t] != 0 {
            for i in corners[t] {
                list[next[i as usize] as usize] = t as u32;
                next[i as usize] += 1;
            }
        }
    }
    (first, list)
}

/// Splits every node whose triangles form more than one fan.
fn split_nodes(state: &mut SheetState) {
    let (first, list) = triangles_at_nodes(state.motion.len(), &state.triangles.corners, &state.triangles.alive);
    // Copies that were made: (node, fan's triangles, new node), to send the ends of springs to.
    let mut copies: Vec<(u32, Vec<u32>, u32)> = Vec::new();
    let mut touched = vec![false; state.motion.len()];
    for i in 0..first.len() - 1 {
        let around = &list[first[i] as usize..first[i + 1] as usize];
        if around.is_empty() {
            // A node of a chain has no triangles to lose.
            if !state.triangles.is_empty() {
                state.motion.alive[i] = 0;
            }
            continue;
        }
        let Triangles { corners, rest_area, parted, .. } = &state.triangles;
        let joined = |t: u32, j: u32| {
            parted[t as usize] == 0
                || !is_parted(parted[t as usize], |k| {
                    let corner = corners[t as usize][k];
                    corner != i as u32 && corner != j
                })
        };
        let fans = fans(corners, rest_area, i as u32, around, joined);
        if fans.len() == 1 {
            continue;
        }
        touched[i] = true;
        let mut left: f64 = fans.iter().map(|(_, area)| area).sum();
        for (fan, area) in fans.into_iter().skip(1) {
            let copy = state.motion.len() as u32;
            let burn_node = state.burn_node(i);
            state.motion.split(i, area / left);
            state.before.split(i, area / left);
            if !state.has_fine_burn_mesh() {
                state.motion.burn_node[copy as usize] = state.burn.len() as u32;
                state.split_burn_node(burn_node, area / left);
            }
            left -= area;
            for t in &fan {
                for corner in &mut state.triangles.corners[*t as usize] {
                    if *corner == i as u32 {
                        *corner = copy;
                    }
                }
            }
            copies.push((i as u32, fan, copy));
        }
    }
    send_ends(state, &touched, &copies);
}

/// Splits every node of a finer burn mesh whose triangles form more than one fan.
fn split_burn_nodes(state: &mut SheetState) {
    let fine = &state.burn_triangles;
    let (first, list) = triangles_at_nodes(state.burn.len(), &fine.corners, &fine.alive);
    let mut copies: Vec<(u32, u32)> = Vec::new();
    for i in 0..first.len() - 1 {
        let around = &list[first[i] as usize..first[i + 1] as usize];
        if around.is_empty() {
            continue;
        }
        let BurnTriangles { corners, rest_area, parent, place, .. } = &state.burn_triangles;
        let joined = |t: u32, j: u32| {
            let parted = state.triangles.parted[parent[t as usize] as usize];
            // Both ends lie on the side of the parent that has parted: they have no part of the corner opposite.
            parted == 0
                || !is_parted(parted, |k| {
                    (0..3).filter(|c| [i as u32, j].contains(&corners[t as usize][*c])).all(|c| {
                        let place = place[t as usize][c];
                        [1.0 - place.x - place.y, place.x, place.y][k] == 0.0
                    })
                })
        };
        let fans = fans(corners, rest_area, i as u32, around, joined);
        let mut left: f64 = fans.iter().map(|(_, area)| area).sum();
        for (fan, area) in fans.into_iter().skip(1) {
            let copy = state.burn.len() as u32;
            state.split_burn_node(i, area / left);
            left -= area;
            for t in fan {
                for corner in &mut state.burn_triangles.corners[t as usize] {
                    if *corner == i as u32 {
                        *corner = copy;
                    }
                }
            }
            copies.push((i as u32, copy));
        }
    }
    let SheetState { motion, triangles, burn_triangles: fine, burn_edges: edges, .. } = state;
    for e in 0..edges.len() {
        let held = edges.triangles[e].into_iter().find(|t| *t != NONE && fine.alive[*t as usize] != 0);
        let Some(t) = held else { continue };
        let corners = fine.corners[t as usize];
        for end in &mut edges.ends[e] {
            if !corners.contains(end) {
                // Copies are in the order of the nodes they were split from.
                let of_node = copies.partition_point(|(node, _)| node < end);
                let copy = copies[of_node..].iter().find(|(node, copy)| node == end && corners.contains(copy));
                *end = copy.expect("the triangle went with one of the copies").1;
            }
        }
        // An edge along which the sheet has cracked is that of its first triangle alone.
        let ends = edges.ends[e];
        for other in &mut edges.triangles[e] {
            if *other != NONE && *other != t && !ends.iter().all(|i| fine.corners[*other as usize].contains(i)) {
                *other = NONE;
            }
        }
    }
    // The burn node at a motion node is the one that its triangles have there.
    for t in (0..fine.len()).rev().filter(|t| fine.alive[*t] != 0) {
        let at = triangles.corners[fine.parent[t] as usize];
        for (corner, place) in fine.corners[t].iter().zip(fine.place[t]) {
            let weights = [1.0 - place.x - place.y, place.x, place.y];
            if let Some(vertex) = weights.iter().position(|weight| *weight == 1.0) {
                motion.burn_node[at[vertex] as usize] = *corner;
            }
        }
    }
}

/// Whether a side for which `is_side` holds, by the corner opposite, is among those of these flags.
fn is_parted(flags: u8, is_side: impl Fn(usize) -> bool) -> bool {
    (0..3).any(|k| flags & (1 << k) != 0 && is_side(k))
}

/// The triangles around a node, in groups that hang together by edges at the node, with their areas [m2]: the largest
/// first; of equals, the one with the first triangle. `joined` says whether a triangle hangs on across its side from the
/// node to another one.
fn fans(
    corners: &[[u32; 3]],
    rest_area: &[f64],
    node: u32,
    around: &[u32],
    joined: impl Fn(u32, u32) -> bool,
) -> Vec<(Vec<u32>, f64)> {
    let mut group: Vec<usize> = (0..around.len()).collect();
    for a in 0..around.len() {
        for b in 0..a {
            let shared = corners[around[a] as usize]
                .iter()
                .any(|i| *i != node && corners[around[b] as usize].contains(i) && joined(around[a], *i));
            if shared && group[a] != group[b] {
                let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let mut fans: Vec<Vec<u32>> = vec![Vec::new(); around.len()];
    for (k, g) in group.into_iter().enumerate() {
        fans[g].push(around[k]);
    }
    fans.retain(|fan| !fan.is_empty());
    let area = |fan: &[u32]| fan.iter().map(|t| rest_area[*t as usize]).sum::<f64>();
    let mut fans: Vec<(Vec<u32>, f64)> = fans
        .into_iter()
        .map(|fan| {
            let area = area(&fan);
            (fan, area)
        })
        .collect();
    fans.sort_by(|(a, area_a), (b, area_b)| area_b.total_cmp(area_a).then(a[0].cmp(&b[0])));
    fans
}

/// Sends the ends of springs and edges at split nodes to the copy that has their triangle.
fn send_ends(state: &mut SheetState, touched: &[bool], copies: &[(u32, Vec<u32>, u32)]) {
    if copies.is_empty() {
        return;
    }
    let SheetState { springs, burn_edges, triangles, .. } = state;
    for s in 0..springs.len() {
        if springs.broken[s] != 0 {
            continue;
        }
        for end in 0..2 {
            let node = springs.ends[s][end];
            if !touched.get(node as usize).copied().unwrap_or(false) {
                continue;
            }
            // The end's own triangle first; along an edge the same for both, for it may have cracked.
            let [own, other] = if end == 0 || springs.needs_both[s] == 0 {
                springs.carriers[s]
            } else {
                [springs.carriers[s][1], springs.carriers[s][0]]
            };
            let alive = |t: &u32| *t != NONE && triangles.alive[*t as usize] != 0;
            let holder = [own, other].into_iter().find(alive);
            let copy = holder.and_then(|t| copies.iter().find(|(i, fan, _)| *i == node && fan.contains(&t)));
            if let Some((_, _, copy)) = copy {
                springs.ends[s][end] = *copy;
                if springs.edge[s] != NONE && springs.needs_both[s] == 0 {
                    burn_edges.ends[springs.edge[s] as usize][end] = *copy;
                }
            }
        }
        // A spring along which the sheet has cracked is that of one triangle alone.
        let ends = springs.ends[s];
        let alive = |t: u32| t != NONE && triangles.alive[t as usize] != 0;
        let holds = |t: u32| alive(t) && ends.iter().all(|i| triangles.corners[t as usize].contains(i));
        if springs.needs_both[s] == 0 && springs.carriers[s].into_iter().any(holds) {
            for carrier in &mut springs.carriers[s] {
                if alive(*carrier) && !holds(*carrier) {
                    *carrier = NONE;
                }
            }
        }
    }
}

/// Numbers the connected pieces: of what was one piece, the largest part keeps the number.
fn number_pieces(state: &mut SheetState) {
    let triangles = &mut state.triangles;
    let count = state.motion.len();
    let mut root: Vec<u32> = (0..count as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for t in 0..triangles.len() {
        if triangles.alive[t] != 0 {
            let [a, b, c] = triangles.corners[t];
            for other in [b, c] {
                let (x, y) = (find(&mut root, a), find(&mut root, other));
                root[x.max(y) as usize] = x.min(y);
            }
        }
    }
    // Parts by (old piece, root), with their areas, in order of first triangle.
    let mut parts: Vec<(u32, u32, f64)> = Vec::new();
    let mut part_of_root = std::collections::HashMap::new();
    for t in 0..triangles.len() {
        if triangles.alive[t] != 0 {
            let r = find(&mut root, triangles.corners[t][0]);
            let part = *part_of_root.entry(r).or_insert_with(|| {
                parts.push((triangles.piece[t], r, 0.0));
                parts.len() - 1
            });
            parts[part].2 += triangles.rest_area[t];
        }
    }
    let mut largest: std::collections::HashMap<u32, usize> = std::collections::HashMap::new();
    for (k, (piece, _, area)) in parts.iter().enumerate() {
        let best = largest.entry(*piece).or_insert(k);
        if *area > parts[*best].2 {
            *best = k;
        }
    }
    let mut number = Vec::with_capacity(parts.len());
    for (k, (piece, _, _)) in parts.iter().enumerate() {
        number.push(if largest[piece] == k {
            *piece
        } else {
            let fresh = state.books.next_piece[0];
            state.books.next_piece[0] += 1;
            let Pieces { parent, birth, mass, area, temperature } = &mut state.pieces;
            parent.push(*piece);
            birth.push(state.books.time[0]);
            [mass, area, temperature].into_iter().for_each(|column| column.push(0.0));
            fresh
        });
    }
    for t in 0..triangles.len() {
        if triangles.alive[t] != 0 {
            let r = find(&mut root, triangles.corners[t][0]);
            triangles.piece[t] = number[part_of_root[&r]];
        }
    }
}

/// Number of connected pieces of the surface.
pub fn pieces(state: &SheetState) -> usize {
    let triangles = &state.triangles;
    let mut numbers: Vec<u32> =
        (0..triangles.len()).filter(|t| triangles.alive[*t] != 0).map(|t| triangles.piece[t]).collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.len()
}
