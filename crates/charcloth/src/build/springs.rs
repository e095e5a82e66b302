//! Springs and edges by kind, with the coefficients that the intensive values give them.

use super::Lattice;
use super::burn_nodes::inner_part;
use super::rest_shape::RestSides;
use crate::mesh::SurfaceMesh;
use crate::scene::{Rest, Scene};
use crate::sheet::{BurnEdges, NONE, SpringKind, Springs};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// What the springs of each kind are made of.
pub(super) struct SpringMaterial {
    /// Tension per strain and width [N/m] or stiffness [N/m], by kind.
    modulus: [f64; 3],
    raw: [Option<f64>; 3],
    /// Strain that breaks a spring; 0 means none does.
    breaking_strain: f64,
    /// Conductance of a square of sheet [W/K].
    sheet_conductance: f64,
    raw_k0: Option<f64>,
}

impl SpringMaterial {
    pub fn of(scene: &Scene) -> Self {
        let mechanics = &scene.mechanics;
        let raw = scene.fire.raw.clone().unwrap_or_default();
        let fire = &scene.fire;
        Self {
            modulus: [mechanics.structural.0, mechanics.shear.0, mechanics.flexion.0],
            raw: [raw.structural, raw.shear, raw.flexion].map(|k| k.map(|k| k.0)),
            breaking_strain: if mechanics.structural.0 > 0.0 {
                mechanics.strength.0 / mechanics.structural.0
            } else {
                0.0
            },
            // Eq. 1.1: D = kappa / (grammage c)
            sheet_conductance: fire.diffusivity.0 * scene.sheet.grammage.0 * fire.heat_capacity.0,
            raw_k0: raw.k0.map(|k0| k0.0),
        }
    }

    /// Adds a spring whose stiffness is `shape` times the modulus of its kind.
    fn spring(&self, springs: &mut Springs, kind: SpringKind, ends: [u32; 2], length: f64, shape: f64, hold: Hold) {
        let stiffness = self.raw[kind as usize].unwrap_or(self.modulus[kind as usize] * shape);
        if stiffness <= 0.0 {
            return;
        }
        springs.ends.push(ends);
        springs.kind.push(kind as u8);
        springs.rest_length.push(length);
        springs.stiffness.push(stiffness);
        springs.strength.push(stiffness * length * self.breaking_strain);
        springs.broken.push(0);
        springs.edge.push(hold.edge);
        springs.carriers.push(hold.carriers);
        springs.needs_both.push(u8::from(hold.needs_both));
    }

    /// Adds an edge of the burn mesh whose conductance is `width_over_distance` squares of sheet side by side.
    pub fn edge(&self, edges: &mut BurnEdges, ends: [u32; 2], distance: f64, width_over_distance: f64) {
        edges.ends.push(ends);
        edges.rest_distance.push(distance);
        edges.conductance_length.push(self.raw_k0.unwrap_or(self.sheet_conductance * width_over_distance * distance));
        edges.cut.push(0);
        edges.triangles.push([NONE; 2]);
    }
}

/// What a spring hangs on: the edge it runs along and the triangles that carry it.
struct Hold {
    edge: u32,
    carriers: [u32; 2],
    needs_both: bool,
}

/// An edge of the surface and the one or two triangles at it, with the corners opposite.
struct SurfaceEdge {
    triangles: [u32; 2],
    opposite: [u32; 2],
}

fn surface_edges(mesh: &SurfaceMesh) -> BTreeMap<[u32; 2], SurfaceEdge> {
    let mut edges: BTreeMap<[u32; 2], SurfaceEdge> = BTreeMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (i, j) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let edge =
                edges.entry([i.min(j), i.max(j)]).or_insert(SurfaceEdge { triangles: [NONE; 2], opposite: [NONE; 2] });
            let slot = usize::from(edge.triangles[0] != NONE);
            edge.triangles[slot] = t as u32;
            edge.opposite[slot] = corners[k];
        }
    }
    edges
}

/// Structural springs along edges, flexion springs between the corners opposite an inner edge.
pub(super) fn triangle_springs(
    scene: &Scene,
    mesh: &SurfaceMesh,
    rest_points: &[DVec3],
    sides: &RestSides,
    area: &[f64],
) -> (Springs, BurnEdges) {
    let material = SpringMaterial::of(scene);
    let (mut springs, mut edges) = (Springs::default(), BurnEdges::default());
    for (ends, edge) in &surface_edges(mesh) {
        let mut area_sum = 0.0;
        let mut cotangents = 0.0;
        let mut lengths = 0.0;
        let mut count = 0.0;
        for slot in 0..2 {
            let t = edge.triangles[slot];
            if t == NONE {
                continue;
            }
            let t = t as usize;
            let k = mesh.triangles[t].iter().position(|c| *c == edge.opposite[slot]).expect("a corner of its triangle");
            let (a, b, c) = (sides[t][k], sides[t][(k + 1) % 3], sides[t][(k + 2) % 3]);
            area_sum += area[t];
            cotangents += (b * b + c * c - a * a) / (4.0 * area[t]);
            lengths += a;
            count += 1.0;
        }
        // A seam of a flattened sheet may give an edge two lengths: the mean.
        let length = lengths / count;
        let number = edges.len() as u32;
        // Eq. 1.2; a negative weight (obtuse triangles) would let heat run uphill, so it is none.
        material.edge(&mut edges, *ends, length, (0.5 * cotangents).max(0.0));
        let hold = Hold { edge: number, carriers: edge.triangles, needs_both: false };
        // Eq. 6.2
        material.spring(&mut springs, SpringKind::Structural, *ends, length, area_sum / (length * length), hold);
        if edge.triangles[1] != NONE {
            let t = edge.triangles.map(|t| t as usize);
            let unfolded = unfolded_distance(mesh, sides, *ends, t, edge.opposite, length);
            // Laid flat by its texture coordinates the sheet has no crease at rest; else it has those it lies in.
            let across = match scene.sheet.rest {
                Rest::FlatByUv => unfolded,
                Rest::AsItLies | Rest::Mesh => {
                    let [c, d] = edge.opposite.map(|i| rest_points[i as usize]);
                    c.distance(d)
                }
            };
            let hold = Hold { edge: number, carriers: edge.triangles, needs_both: true };
            // A sharp crease makes the sheet no stiffer.
            let shape = area_sum / (unfolded * unfolded);
            material.spring(&mut springs, SpringKind::Flexion, edge.opposite, across, shape, hold);
        }
    }
    (springs, edges)
}

/// Distance of the corners opposite an edge, with the two stress-free triangles unfolded flat; a sheet that is folded
/// or curved at rest is pushed open by it.
fn unfolded_distance(
    mesh: &SurfaceMesh,
    sides: &RestSides,
    ends: [u32; 2],
    triangles: [usize; 2],
    opposite: [u32; 2],
    length: f64,
) -> f64 {
    // Sides from end 0 to each opposite corner, and from end 1.
    let mut place = [DVec2::ZERO; 2];
    for slot in 0..2 {
        let corners = mesh.triangles[triangles[slot]];
        let side_to = |end: u32| {
            let third = corners.iter().position(|c| *c != end && *c != opposite[slot]).expect("three corners");
            sides[triangles[slot]][third]
        };
        let (from_start, from_end) = (side_to(ends[0]), side_to(ends[1]));
        let x = (from_start * from_start + length * length - from_end * from_end) / (2.0 * length);
        let y = (from_start * from_start - x * x).max(0.0).sqrt();
        place[slot] = DVec2::new(x, if slot == 0 { y } else { -y });
    }
    place[0].distance(place[1])
}

/// Provot's three kinds of spring on a grid; a chain has structural ones only.
pub(super) fn lattice_springs(scene: &Scene, mesh: &SurfaceMesh, lattice: Lattice) -> (Springs, BurnEdges) {
    let material = SpringMaterial::of(scene);
    let Lattice { columns, rows, spacing } = lattice;
    let (mut springs, mut edges) = (Springs::default(), BurnEdges::default());
    let surface = surface_edges(mesh);
    let carriers_of = |i: u32, j: u32| surface.get(&[i.min(j), i.max(j)]).map_or([NONE; 2], |e| e.triangles);
    let at = |i: usize, j: usize| (j * columns + i) as u32;
    for j in 0..rows {
        for i in 0..columns {
            let here = at(i, j);
            // Along the width, along the height: (next node, length, width of the strip the edge stands for).
            let steps = [
                (i + 1 < columns, 1, 0, spacing.x, if rows > 1 { spacing.y * inner_part(j, rows) } else { spacing.x }),
                (j + 1 < rows, 0, 1, spacing.y, spacing.x * inner_part(i, columns)),
            ];
            for (exists, di, dj, length, width) in steps {
                if !exists {
                    continue;
                }
                let next = at(i + di, j + dj);
                let number = edges.len() as u32;
                material.edge(&mut edges, [here, next], length, width / length);
                let hold = Hold { edge: number, carriers: carriers_of(here, next), needs_both: false };
                material.spring(&mut springs, SpringKind::Structural, [here, next], length, width / length, hold);
                if rows > 1 && i + 2 * di < columns && j + 2 * dj < rows {
                    let far = at(i + 2 * di, j + 2 * dj);
                    let first = carriers_of(here, next).into_iter().find(|t| *t != NONE).unwrap_or(NONE);
                    let second = carriers_of(next, far).into_iter().find(|t| *t != NONE).unwrap_or(NONE);
                    let hold = Hold { edge: NONE, carriers: [first, second], needs_both: true };
                    let shape = width / (2.0 * length);
                    material.spring(&mut springs, SpringKind::Flexion, [here, far], 2.0 * length, shape, hold);
                }
            }
            if i + 1 < columns && j + 1 < rows {
                let diagonal = spacing.length();
                for ends in [[here, at(i + 1, j + 1)], [at(i + 1, j), at(i, j + 1)]] {
                    let on_surface = carriers_of(ends[0], ends[1]);
                    let hold = if on_surface[0] != NONE {
                        Hold { edge: NONE, carriers: on_surface, needs_both: false }
                    } else {
                        let other =
                            if ends[0] == here { [at(i + 1, j), at(i, j + 1)] } else { [here, at(i + 1, j + 1)] };
                        let [t0, t1] = carriers_of(other[0], other[1]);
                        let holds = |t: u32, node: u32| mesh.triangles[t as usize].contains(&node);
                        let carriers = if holds(t0, ends[0]) { [t0, t1] } else { [t1, t0] };
                        Hold { edge: NONE, carriers, needs_both: true }
                    };
                    material.spring(&mut springs, SpringKind::Shear, ends, diagonal, 1.0, hold);
                }
            }
        }
    }
    (springs, edges)
}
