//! One side out: triangles of a shell that run the other way round than their neighbours are turned over.

use super::clean::turn_over;
use charcloth::mesh::SurfaceMesh;

/// A triangle next to another, and whether it must be the other way round for both to agree.
#[derive(Clone, Copy)]
struct Neighbour {
    triangle: usize,
    disagrees: bool,
}

/// Turns triangles over until all of a piece agree, the fewer to the way of the more. A piece that cannot agree (a
/// Moebius strip) stays as it is.
pub(super) fn orient(mesh: &mut SurfaceMesh, remarks: &mut Vec<String>) {
    let neighbours = neighbours(mesh);
    let count = mesh.triangles.len();
    let mut flip: Vec<Option<bool>> = vec![None; count];
    let (mut turned, mut one_sided) = (0, 0);
    for seed in 0..count {
        if flip[seed].is_some() {
            continue;
        }
        flip[seed] = Some(false);
        let mut piece = vec![seed];
        let mut agrees = true;
        let mut next = 0;
        while next < piece.len() {
            let triangle = piece[next];
            next += 1;
            for neighbour in neighbours[triangle].iter().flatten() {
                let wanted = flip[triangle].map(|f| f != neighbour.disagrees);
                if flip[neighbour.triangle].is_none() {
                    flip[neighbour.triangle] = wanted;
                    piece.push(neighbour.triangle);
                } else if flip[neighbour.triangle] != wanted {
                    agrees = false;
                }
            }
        }
        if !agrees {
            one_sided += 1;
            continue;
        }
        let flipped = piece.iter().filter(|t| flip[**t] == Some(true)).count();
        let minority = 2 * flipped <= piece.len();
        for &triangle in &piece {
            if (flip[triangle] == Some(true)) == minority {
                turn_over(&mut mesh.triangles[triangle], mesh.corner_uv.get_mut(triangle));
                turned += 1;
            }
        }
    }
    if turned > 0 {
        remarks.push(format!("{turned} triangles faced the other way than their neighbours and were turned over"));
    }
    if one_sided > 0 {
        remarks
            .push(format!("{one_sided} pieces have only one side (like a Moebius strip); their faces were left alone"));
    }
}

/// The triangles across the three edges of each triangle, where an edge has exactly two.
fn neighbours(mesh: &SurfaceMesh) -> Vec<[Option<Neighbour>; 3]> {
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[k], corners[(k + 1) % 3]);
            edges.push((i.min(j), i.max(j), t, k, i < j));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[None; 3]; mesh.triangles.len()];
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [(_, _, s, k, forward), (_, _, t, l, other_forward)] = *group {
            let disagrees = forward == other_forward;
            neighbours[s][k] = Some(Neighbour { triangle: t, disagrees });
            neighbours[t][l] = Some(Neighbour { triangle: s, disagrees });
        }
    }
    neighbours
}
