//! Numbering nodes so that neighbours lie close in memory: the order of Cuthill and McKee [CuthillMcKee1969] for what
//! moves, that of a curve through space [Morton1966] for the finer mesh that burns.

use crate::mesh::SurfaceMesh;
use glam::DVec3;

/// Nodes that are sorted among themselves by the number of their neighbours, so that the slices of the inner loops are
/// full. // tuned: 128 keeps the order local and fills slices to nine tenths, 64 to 512
const SORTED_TOGETHER: usize = 128;

/// Bits of the place along each axis that the curve through space tells apart.
const CURVE_BITS: u32 = 16;

/// The order in which the points of a mesh are best kept: entry k is the point that becomes number k.
pub fn order(mesh: &SurfaceMesh) -> Vec<u32> {
    let count = mesh.positions.len();
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); count];
    for corners in &mesh.triangles {
        for k in 0..3 {
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            neighbours[i as usize].push(j);
            neighbours[j as usize].push(i);
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    let degree = |i: u32| neighbours[i as usize].len();
    let mut seeds: Vec<u32> = (0..count as u32).collect();
    seeds.sort_by_key(|i| (degree(*i), *i));
    let mut seen = vec![false; count];
    let mut order = Vec::with_capacity(count);
    for seed in seeds {
        if seen[seed as usize] {
            continue;
        }
        // Two sweeps: the last point of the first lies at an end of the shell, where the band is narrowest.
        let start = *breadth_first(seed, &neighbours, &mut seen.clone()).last().unwrap_or(&seed);
        order.extend(breadth_first(start, &neighbours, &mut seen));
    }
    for chunk in order.chunks_mut(SORTED_TOGETHER) {
        chunk.sort_by_key(|i| std::cmp::Reverse(degree(*i)));
    }
    order
}

fn breadth_first(start: u32, neighbours: &[Vec<u32>], seen: &mut [bool]) -> Vec<u32> {
    let mut queue = vec![start];
    seen[start as usize] = true;
    let mut next = 0;
    while next < queue.len() {
        let here = queue[next];
        next += 1;
        let mut fresh: Vec<u32> = neighbours[here as usize].iter().copied().filter(|j| !seen[*j as usize]).collect();
        fresh.sort_by_key(|j| (neighbours[*j as usize].len(), *j));
        for j in fresh {
            seen[j as usize] = true;
            queue.push(j);
        }
    }
    queue
}

/// The order of points along a curve that fills space, block by block: entry k is the point that becomes number k.
pub fn along_curve(points: &[DVec3]) -> Vec<u32> {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let cell = (high - low).max_element().max(f64::MIN_POSITIVE) / f64::from((1u32 << CURVE_BITS) - 1);
    let code = |point: &DVec3| {
        let [x, y, z] = ((*point - low) / cell).to_array().map(|c| c as u64);
        (0..CURVE_BITS).fold(0u64, |code, bit| {
            let of = |c: u64, axis: u32| (c >> bit & 1) << (3 * bit + axis);
            code | of(x, 0) | of(y, 1) | of(z, 2)
        })
    };
    let codes: Vec<u64> = points.iter().map(code).collect();
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by_key(|i| codes[*i as usize]);
    order
}

/// The number that each point has in an order.
pub fn numbers(order: &[u32]) -> Vec<u32> {
    let mut number = vec![0u32; order.len()];
    for (k, i) in order.iter().enumerate() {
        number[*i as usize] = k as u32;
    }
    number
}

/// The mesh with its points renumbered: entry k of `order` becomes point k.
pub fn renumbered(mesh: &SurfaceMesh, order: &[u32]) -> SurfaceMesh {
    let number = numbers(order);
    SurfaceMesh {
        positions: order.iter().map(|i| mesh.positions[*i as usize]).collect(),
        triangles: mesh.triangles.iter().map(|t| t.map(|i| number[i as usize])).collect(),
        painted: mesh
            .painted
            .iter()
            .map(|(name, values)| (name.clone(), order.iter().map(|i| values[*i as usize]).collect()))
            .collect(),
        ..mesh.clone()
    }
}
