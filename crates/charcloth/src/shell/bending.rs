//! Bending of a triangulated sheet, from the places of its nodes alone.
//!
//! Model: constant curvature a triangle from the slopes at the middles of its edges, as in Morley's plate element
//! [Morley1971]; the slope at an edge is that of the quadratic through the nodes around it (Eq. 12.4 to 12.7). It is exact
//! for constant curvature and conforms on average, so it converges on any mesh, where energies of angles between
//! triangles do not. Valid when: the sheet is nearly inextensible, for which second derivatives of position are
//! curvatures; then the energy is quadratic, and its matrix constant. Cost: a sparse matrix with some 33 numbers a row.

use super::membrane::{MembraneStiffness, RestTriangle};
use crate::mesh::sides_by_edge;
use crate::solver::blocks::{Columns, Pattern, by_rows};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Most nodes around an edge: two triangles and their four other neighbours.
const AROUND_EDGE: usize = 8;
/// Weight of the damping of quadratic conditions that the nodes around an edge cannot meet.
/// // tuned: small against the least eigenvalue of a sound patch, some 0.01; 1e-6 to 1e-3
const SOFT: f64 = 1e-4;

/// Bending of a surface.
#[derive(Default)]
pub struct Bending {
    /// Which nodes off the diagonal bend with each node, and how strongly [N/m].
    pub pattern: Pattern,
    /// Values of the pattern.
    pub value: Vec<f64>,
    /// The diagonal [N/m].
    pub diagonal: Vec<f64>,
    /// Force towards flat on each node [N].
    pub force: Vec<DVec3>,
    /// Force towards the rest curvature [N].
    pub rest_force: Vec<DVec3>,
    /// Energy of the rest curvature [J].
    pub rest_energy: f64,
    /// For each triangle, the nodes that tell its curvature.
    patch: Pattern,
    /// How much each of them does, as (xx, yy, 2 xy) [1/m2].
    weight: Vec<DVec3>,
    /// Rigidity of each triangle times its area, in material axes [N m3].
    rigidity: Vec<DMat3>,
    /// Stiffness left, by which the values were made.
    left: Vec<f64>,
    /// Rigidity times area times rest curvature [N m2].
    moment: Vec<DVec3>,
    curved: bool,
    /// Where the products of each triangle's nodes go: in `value`, or past its end in `diagonal`.
    places: Vec<u32>,
}

/// The edge opposite to each corner of each triangle: the triangle across and its corner there.
type Across = Vec<[Option<(u32, u8)>; 3]>;

impl Bending {
    /// Lays bending out for a surface.
    pub fn lay_out(
        nodes: usize,
        corners: &[[u32; 3]],
        rest: &[RestTriangle],
        stiffness: &MembraneStiffness,
        thickness: f64,
        fixed: &[bool],
    ) -> Self {
        let surface = Surface {
            corners,
            rest,
            across: &across_edges(corners),
            held: &corners.iter().map(|corners| corners.iter().all(|i| fixed[*i as usize])).collect::<Vec<_>>(),
        };
        let plate = thickness * thickness / 12.0; // Eq. 12.6
        let plate = DMat3::from_cols(
            DVec3::new(stiffness.q11, stiffness.q12, 0.0),
            DVec3::new(stiffness.q12, stiffness.q22, 0.0),
            DVec3::new(0.0, 0.0, stiffness.q66),
        ) * plate;
        let slopes = slopes(&surface);
        let curvatures: Vec<Curvature> =
            (0..corners.len()).into_par_iter().with_min_len(256).map(|t| curvature(t, &surface, &slopes)).collect();
        let mut patch = Pattern::empty(0);
        let (mut weight, mut rigidity) = (Vec::new(), Vec::new());
        for (Curvature { nodes, weights, free }, rest) in curvatures.iter().zip(rest) {
            let mut reduced = plate;
            for bent in free {
                // No moment at a free edge: what the rest of the triangle leaves open takes the least energy.
                let across = reduced * *bent;
                let along = bent.dot(across);
                if along > 1e-9 * plate.x_axis.x.max(plate.y_axis.y) * bent.length_squared() {
                    let outer = DMat3::from_cols(across * across.x, across * across.y, across * across.z);
                    reduced -= outer * (1.0 / along);
                }
            }
            patch.push_row(nodes);
            weight.extend_from_slice(weights);
            rigidity.push(reduced * rest.area);
        }
        let (pattern, places) = pattern_of(nodes, &patch);
        Self {
            value: vec![0.0; pattern.blocks()],
            diagonal: vec![0.0; nodes],
            force: vec![DVec3::ZERO; nodes],
            rest_force: vec![DVec3::ZERO; nodes],
            rest_energy: 0.0,
            left: vec![1.0; corners.len()],
            moment: vec![DVec3::ZERO; corners.len()],
            curved: false,
            pattern,
            patch,
            weight,
            rigidity,
            places,
        }
    }

    /// Makes each triangle so many times thicker; rigidity goes with the cube (Eq. 12.6).
    pub fn thicken(&mut self, by: impl Fn(usize) -> f64) {
        for (t, rigidity) in self.rigidity.iter_mut().enumerate() {
            *rigidity *= by(t).powi(3);
        }
    }

    /// Fills in the matrix, for so much stiffness left of each triangle (Eq. 12.7).
    pub fn assemble(&mut self, left: impl Fn(usize) -> f64) {
        self.value.fill(0.0);
        self.diagonal.fill(0.0);
        let off_diagonal = self.value.len();
        let mut places = self.places.iter();
        for t in 0..self.rigidity.len() {
            self.left[t] = left(t);
            let weights = &self.weight[self.patch.row(t)];
            for a in weights {
                let bent = self.rigidity[t] * *a * self.left[t];
                for (b, place) in weights.iter().zip(places.by_ref()) {
                    let place = *place as usize;
                    let value = if place < off_diagonal {
                        &mut self.value[place]
                    } else {
                        &mut self.diagonal[place - off_diagonal]
                    };
                    *value += bent.dot(*b);
                }
            }
        }
    }

    /// Sets the curvature that a triangle has without force, as (xx, yy, 2 xy) [1/m].
    pub fn set_rest_curvature(&mut self, t: usize, curvature: DVec3) {
        self.moment[t] = self.rigidity[t] * curvature * self.left[t];
        self.curved |= curvature != DVec3::ZERO;
    }

    /// Curvature of a triangle along its normal at these positions, as (xx, yy, 2 xy) [1/m].
    pub fn curvature(&self, t: usize, position: &[DVec3], normal: DVec3) -> DVec3 {
        let nodes = self.patch.columns(t).iter().zip(&self.weight[self.patch.row(t)]);
        nodes.map(|(i, weight)| *weight * position[*i as usize].dot(normal)).sum()
    }

    /// One row of the product of the matrix with a field of the nodes.
    #[inline]
    pub fn row_times(&self, x: &[DVec3], i: usize) -> DVec3 {
        let mut sum = x[i] * self.diagonal[i];
        for m in self.pattern.row(i) {
            sum += x[self.pattern.column[m] as usize] * self.value[m];
        }
        sum
    }

    /// Works out the forces at these positions.
    pub fn respond(&mut self, position: &[DVec3], corners: &[[u32; 3]], parallel: bool) {
        let mut force = std::mem::take(&mut self.force);
        by_rows(&mut force, parallel, |first, force| {
            for (k, force) in force.iter_mut().enumerate() {
                *force = -self.row_times(position, first + k);
            }
        });
        self.force = force;
        self.rest_energy = 0.0;
        if !self.curved {
            return;
        }
        self.rest_force.fill(DVec3::ZERO);
        for (t, moment) in self.moment.iter().enumerate() {
            let [a, b, c] = corners[t].map(|i| position[i as usize]);
            let (u, v) = (b - a, c - a);
            let cross = u.cross(v);
            let double_area = cross.length();
            if double_area == 0.0 {
                continue;
            }
            let normal = cross / double_area;
            let mut bent = DVec3::ZERO;
            for (i, weight) in self.patch.columns(t).iter().zip(&self.weight[self.patch.row(t)]) {
                let pull = moment.dot(*weight);
                bent += position[*i as usize] * pull;
                self.rest_force[*i as usize] += normal * pull;
            }
            self.rest_energy -= bent.dot(normal);
            let tangential = (bent - normal * bent.dot(normal)) / double_area;
            let (second, third) = (v.cross(tangential), tangential.cross(u));
            self.rest_force[corners[t][0] as usize] -= second + third;
            self.rest_force[corners[t][1] as usize] += second;
            self.rest_force[corners[t][2] as usize] += third;
        }
    }
}

/// Which nodes other than itself each bends with, and where the products of each triangle's nodes go: among these, or past
/// their end where a node meets itself.
fn pattern_of(nodes: usize, patch: &Pattern) -> (Pattern, Vec<u32>) {
    let at_node = patch.transposed(nodes);
    // Products of a triangle begin where those of the triangles before it end.
    let mut first_place = vec![0];
    for t in 0..patch.rows() {
        first_place.push(first_place[t] + patch.row(t).len().pow(2));
    }
    let mut places = vec![u32::MAX; first_place[patch.rows()]];
    let mut pattern = Pattern::empty(0);
    let mut columns = Columns::new(nodes);
    for i in 0..nodes {
        let others = at_node.columns(i).iter().flat_map(|t| patch.columns(*t as usize)).copied();
        pattern.push_row(columns.collect(i, others.filter(|j| *j != i as u32)));
        let first = pattern.first[i];
        for t in at_node.columns(i) {
            let around = patch.columns(*t as usize);
            let own = around.iter().position(|j| *j == i as u32).expect("a node of the triangle");
            let places = &mut places[first_place[*t as usize] + own * around.len()..][..around.len()];
            for (place, j) in places.iter_mut().zip(around) {
                *place = columns.place(i, *j).map_or(u32::MAX, |k| first + k);
            }
        }
    }
    let blocks = pattern.blocks() as u32;
    for t in 0..patch.rows() {
        let around = patch.columns(t);
        for (a, i) in around.iter().enumerate() {
            places[first_place[t] + a * around.len() + a] = blocks + i;
        }
    }
    (pattern, places)
}

/// Curvature of every triangle of a free surface at these positions, along its normal, as (xx, yy, 2 xy) [1/m].
pub fn curvatures(corners: &[[u32; 3]], rest: &[RestTriangle], position: &[DVec3]) -> Vec<DVec3> {
    let surface = Surface { corners, rest, across: &across_edges(corners), held: &vec![false; corners.len()] };
    let slopes = slopes(&surface);
    let of_triangle = |t: usize| {
        let [a, b, c] = corners[t].map(|i| position[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let Curvature { nodes, weights, .. } = curvature(t, &surface, &slopes);
        nodes.iter().zip(weights).map(|(i, weight)| weight * position[*i as usize].dot(normal)).sum()
    };
    (0..corners.len()).map(of_triangle).collect()
}

/// Finds the triangle across each edge. Edges of one triangle, or of more than two, are free.
fn across_edges(corners: &[[u32; 3]]) -> Across {
    let mut across: Across = vec![[None; 3]; corners.len()];
    for pair in sides_by_edge(corners).chunk_by(|a, b| a.0 == b.0) {
        if let [(_, t, k), (_, u, l)] = *pair {
            across[t as usize][k as usize] = Some((u, l));
            across[u as usize][l as usize] = Some((t, k));
        }
    }
    across
}

/// The surface that bends.
#[derive(Clone, Copy)]
struct Surface<'a> {
    corners: &'a [[u32; 3]],
    rest: &'a [RestTriangle],
    across: &'a Across,
    /// Triangles with all three nodes fixed: what joins them is clamped.
    held: &'a [bool],
}

/// What tells the curvature of a triangle.
struct Curvature {
    nodes: Vec<u32>,
    weights: Vec<DVec3>,
    /// Curvature that a slope at each free edge would give.
    free: Vec<DVec3>,
}

/// Eq. 12.5: the curvature of a triangle from the slopes at its edges and within.
fn curvature(t: usize, surface: &Surface<'_>, slopes: &[[Slope; 3]]) -> Curvature {
    let Surface { corners, rest, across, .. } = *surface;
    let RestTriangle { side: [u, v], area, .. } = rest[t];
    let place = [DVec2::ZERO, u, v];
    let gradient = rest[t].gradients();
    let mut nodes: Vec<u32> = Vec::with_capacity(12);
    let mut weights: Vec<DVec3> = Vec::with_capacity(12);
    let mut free = Vec::new();
    let mut add = |node: u32, weight: DVec3| match nodes.iter().position(|known| *known == node) {
        Some(k) => weights[k] += weight,
        None => {
            nodes.push(node);
            weights.push(weight);
        }
    };
    for k in 0..3 {
        let (from, to) = (place[(k + 1) % 3], place[(k + 2) % 3]);
        // The outward normal, whichever way round the material axes have the triangle.
        let outward = -gradient[k].normalize();
        let bent = DVec3::new(outward.x * outward.x, outward.y * outward.y, 2.0 * outward.x * outward.y)
            * (from.distance(to) / area);
        let Some((other, l)) = across[t][k] else {
            free.push(bent);
            continue;
        };
        // Of the two sides of an edge one has its slope; on the other it has the other sign.
        let (of_edge, sign) = match &slopes[t][k] {
            own if !own.is_empty() => (own, 1.0),
            _ => (&slopes[other as usize][l as usize], -1.0),
        };
        for (node, slope) in of_edge {
            add(*node, bent * (sign * slope));
        }
        for j in 0..3 {
            add(corners[t][j], bent * -outward.dot(gradient[j]));
        }
    }
    Curvature { nodes, weights, free }
}

/// Weights of nodes in the outward slope at the middle of an edge.
type Slope = Vec<(u32, f64)>;

/// The slopes at the inner edges of each triangle; none where the triangle across has that of the edge, so that the two agree.
fn slopes(surface: &Surface<'_>) -> Vec<[Slope; 3]> {
    let Surface { across, held, .. } = *surface;
    let of_edge = |t: usize, k: usize| match across[t][k] {
        Some((other, _)) if held[t] || (other as usize > t && !held[other as usize]) => slope_at_edge(t, k, surface),
        _ => Vec::new(),
    };
    let of_triangle = |t: usize| [0, 1, 2].map(|k| of_edge(t, k));
    (0..across.len()).into_par_iter().with_min_len(256).map(of_triangle).collect()
}

/// Eq. 12.4: weights of the nodes around an edge in the outward slope at its middle. They are exact for quadratics and as
/// small as can be.
fn slope_at_edge(t: usize, k: usize, surface: &Surface<'_>) -> Slope {
    let Surface { corners, rest, across, held } = *surface;
    let (other, back) = across[t][k].map(|(t, corner)| (t as usize, usize::from(corner))).expect("an inner edge");
    if held[t] {
        // A clamp has the slope of what it holds.
        let gradient = rest[t].gradients();
        let outward = -gradient[k].normalize();
        return (0..3).map(|j| (corners[t][j], outward.dot(gradient[j]))).collect();
    }
    // The surroundings, unfolded into the plane of the triangle.
    let [u, v] = rest[t].side;
    let place = [DVec2::ZERO, u, v];
    let mut around: Vec<(u32, DVec2)> = (0..3).map(|j| (corners[t][j], place[j])).collect();
    let mut unfolded = [DVec2::ZERO; 3];
    for j in 0..3 {
        let Some(((node, at), placed)) = unfold(t, &place, j, surface) else { continue };
        if j == k {
            unfolded = placed;
        }
        add_place(&mut around, node, at);
    }
    for j in (0..3).filter(|j| *j != back) {
        if let Some(((node, at), _)) = unfold(other, &unfolded, j, surface) {
            add_place(&mut around, node, at);
        }
    }
    let (from, to) = (place[(k + 1) % 3], place[(k + 2) % 3]);
    let middle = 0.5 * (from + to);
    let along = to - from;
    let mut outward = DVec2::new(along.y, -along.x).normalize();
    if outward.dot(place[k] - middle) > 0.0 {
        outward = -outward;
    }
    let length = along.length().max((rest[t].area + rest[other].area).sqrt());
    let points: Vec<DVec2> = around.iter().map(|(_, p)| (*p - middle) / length).collect();
    let weights = quadratic_slope(&points, outward / length);
    around.into_iter().map(|(node, _)| node).zip(weights).collect()
}

fn add_place(around: &mut Vec<(u32, DVec2)>, node: u32, place: DVec2) {
    if around.len() < AROUND_EDGE && around.iter().all(|(known, _)| *known != node) {
        around.push((node, place));
    }
}

/// Lays the triangle across an edge flat, where the corners of the triangle on this side already lie: its far corner, and
/// all of its corners. None where there is no triangle.
fn unfold(
    from_triangle: usize,
    lies: &[DVec2; 3],
    edge: usize,
    surface: &Surface<'_>,
) -> Option<((u32, DVec2), [DVec2; 3])> {
    let Surface { corners, rest, across, .. } = *surface;
    let (t, corner) = across[from_triangle][edge].map(|(t, corner)| (t as usize, corner as usize))?;
    let place = |i: u32| {
        let shared = corners[from_triangle].iter().position(|known| *known == i);
        lies[shared.expect("a corner of both")]
    };
    let [u, v] = rest[t].side;
    let own = [DVec2::ZERO, u, v];
    let (a, b) = ((corner + 1) % 3, (corner + 2) % 3);
    let (from, to) = (place(corners[t][a]), place(corners[t][b]));
    let side = own[b] - own[a];
    let arm = own[corner] - own[a];
    let (along, height) = (arm.dot(side) / side.length_squared(), side.perp_dot(arm).abs() / side.length());
    let direction = to - from;
    let mut normal = direction.perp().normalize();
    if normal.dot(lies[edge] - from) > 0.0 {
        normal = -normal;
    }
    let mut placed = [DVec2::ZERO; 3];
    placed[a] = from;
    placed[b] = to;
    placed[corner] = from + direction * along + normal * height;
    Some(((corners[t][corner], placed[corner]), placed))
}

/// Weights c of least norm with sum c = 0, sum c p = slope and sum c p p = 0; the last as nearly as the points allow.
fn quadratic_slope(points: &[DVec2], slope: DVec2) -> Vec<f64> {
    let rows: Vec<[f64; 6]> =
        points.iter().map(|p| [1.0, p.x, p.y, p.x * p.x, 2f64.sqrt() * p.x * p.y, p.y * p.y]).collect();
    let mut system = [[0.0; 7]; 6];
    for (r, line) in system.iter_mut().enumerate() {
        for c in 0..6 {
            line[c] = rows.iter().map(|row| row[r] * row[c]).sum();
        }
        if r >= 3 {
            line[r] += SOFT;
        }
    }
    system[1][6] = slope.x;
    system[2][6] = slope.y;
    for pivot in 0..6 {
        let best =
            (pivot..6).max_by(|a, b| system[*a][pivot].abs().total_cmp(&system[*b][pivot].abs())).unwrap_or(pivot);
        system.swap(pivot, best);
        let head = system[pivot];
        for line in system.iter_mut().skip(pivot + 1) {
            let factor = line[pivot] / head[pivot];
            for c in pivot..7 {
                line[c] -= factor * head[c];
            }
        }
    }
    let mut multiplier = [0.0; 6];
    for r in (0..6).rev() {
        let known: f64 = (r + 1..6).map(|c| system[r][c] * multiplier[c]).sum();
        multiplier[r] = (system[r][6] - known) / system[r][r];
    }
    rows.iter().map(|row| (0..6).map(|r| row[r] * multiplier[r]).sum()).collect()
}
