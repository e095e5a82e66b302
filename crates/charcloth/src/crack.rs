//! Where burnt sheet gives way: cracks along the sides of motion triangles.
//!
//! Model: a node cracks where the utilisation of the sheet (tension over strength, Eq. 17.1 to 17.3), averaged over a
//! length of the material (Eq. 17.4), passes one; the sheet then parts along the sides at the node that are pulled apart
//! the hardest (Eq. 17.5). Source: greatest principal stress [Rankine1858] over a strength that depends on direction;
//! averages over a length of the material instead of the stress at a point, which no mesh agrees on [Taylor2007], with less
//! strength on meshes coarser than that (Eq. 17.13) [Bazant1983]; nodes that part across the greatest tension [OBrien1999].
//! Valid when: cracks are fast against everything else, so that one round a step is enough to follow the load. A crack takes
//! no fewer than a side of a triangle, so that the mesh shows in the edge.
//! Cost: one pass over the triangles a step; no more until something cracks.

use crate::effects::SpringFactors;
use crate::material::Material;
use crate::physical::Physical;
use crate::random::Random;
use crate::scene::Scene;
use crate::sheet::{BurnNodes, SheetState};
use crate::shell::Shell;
use crate::tear;
use glam::{DVec2, DVec3};

/// Least part of its strength or stiffness that counts: what is weaker falls.
const LEAST: f64 = crate::homogenise::NOTHING_LEFT;
/// How much the sides at a node differ in strength for no reason that the mesh shows, as a part of it.
// tuned: fibres leave torn edges ragged; strength of paper scatters by 5 to 10 % on strips of 15 mm, more on less; 0 to 0.5
const RAGGED: f64 = 0.3;
/// Cracks within so many lengths of averaging of each other wait for the next step, by when the first have relieved them.
const APART: f64 = 3.0; // tuned: twice the reach of an average and some more; 2 to 6
/// Cosine of the angle to its beginning under which a crack through a node may go on.
const ONWARD: f64 = -0.3; // tuned: it turns by under 70 degrees; -0.7 to 0

/// A symmetric tensor in the plane of the sheet: along, across, shear.
type Tensor = [f64; 3];

/// What a triangle bears.
#[derive(Debug, Clone, Copy, Default)]
struct Strength {
    /// Part of its strength that is left, by what has burnt, by formation and as painted (Eq. 17.2).
    left: f64,
    /// Part of it that is char.
    brittle: f64,
}

/// A node about to crack.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    node: u32,
    utilisation: f64,
    tensor: Tensor,
}

/// A side at a node between two triangles that hang together.
#[derive(Debug, Clone, Copy)]
struct Side {
    to: u32,
    triangles: [u32; 2],
    direction: DVec2,
    score: f64,
}

/// Cracks of a scene, and their buffers.
pub struct Cracks {
    /// Tension per width that tears the sheet along and across the machine direction [N/m].
    strength: DVec2,
    char_strength: f64,
    /// Length over which utilisation is averaged [m].
    length: f64,
    thickness: f64,
    /// Fuel per area of the sheet at the start [kg/m2].
    fuel: f64,
    seed: u64,
    /// Frame and topology of `of_triangle`.
    known: Option<(u32, u64)>,
    of_triangle: Vec<Strength>,
    /// Triangles at each node.
    first: Vec<u32>,
    around: Vec<u32>,
    /// Place of each triangle in the shell.
    place: Vec<u32>,
    utilisation: Vec<[Tensor; 2]>,
    /// Triangles that an average has reached, by the number of the average.
    reached: Vec<u32>,
    averages: u32,
    queue: Vec<u32>,
    candidates: Vec<Candidate>,
    accepted: Vec<Candidate>,
}

impl Cracks {
    /// Cracks of a scene with a material, for a sheet as built.
    pub fn of(scene: &Scene, material: &Material, burn: &BurnNodes) -> Self {
        let mechanics = &material.mechanics;
        let thickness = scene.shell.thickness.0;
        Self {
            strength: DVec2::new(mechanics.strength_machine.value.0, mechanics.strength_cross.value.0) * thickness,
            char_strength: mechanics.char_strength.value.0,
            length: mechanics.crack_length.value.0,
            thickness,
            fuel: burn.fuel_initial.iter().sum::<f64>() / burn.area.iter().sum::<f64>(),
            seed: scene.seed,
            known: None,
            of_triangle: Vec::new(),
            first: Vec::new(),
            around: Vec::new(),
            place: Vec::new(),
            utilisation: Vec::new(),
            reached: Vec::new(),
            averages: 0,
            queue: Vec::new(),
            candidates: Vec::new(),
            accepted: Vec::new(),
        }
    }

    /// Parts the sheet where it is pulled harder than it bears, and says whether it has. `topology` is that which the shell
    /// was laid out for.
    pub fn advance(&mut self, state: &mut SheetState, shell: &Shell, factors: &SpringFactors, topology: u64) -> bool {
        if self.refresh(state, shell, topology) && self.let_fall(state, factors) {
            tear::part(state);
            return true;
        }
        if !self.utilise(state, shell, factors) {
            return false;
        }
        self.find_candidates(state, shell);
        self.accept(state);
        let accepted = std::mem::take(&mut self.accepted);
        let mut parted = false;
        for candidate in &accepted {
            parted |= self.crack(state, candidate);
        }
        self.accepted = accepted;
        if parted {
            tear::part(state);
        }
        parted
    }

    /// Brings strengths up to date, which change once a frame, and what follows from the topology. Returns whether they have
    /// changed.
    fn refresh(&mut self, state: &SheetState, shell: &Shell, topology: u64) -> bool {
        let moment = (state.books.frame[0], topology);
        if self.known == Some(moment) {
            return false;
        }
        let SheetState { burn, burn_triangles: fine, triangles, motion, .. } = state;
        if self.known.is_none_or(|(_, known)| known != topology) {
            (self.first, self.around) = tear::triangles_at_nodes(motion.len(), &triangles.corners, &triangles.alive);
            self.place.clear();
            self.place.resize(triangles.len(), u32::MAX);
            for (k, t) in shell.triangles().iter().enumerate() {
                self.place[*t as usize] = k as u32;
            }
            self.reached.clear();
            self.reached.resize(triangles.len(), 0);
            self.averages = 0;
        }
        self.known = Some(moment);
        let of_corners = |nodes: [u32; 3]| {
            let mut sum = Strength::default();
            for i in nodes.map(|i| i as usize) {
                let whole = Physical::whole(burn, i);
                let grammage = burn.speed[i] * burn.fuel_initial[i] / (burn.area[i] * self.fuel);
                sum.left += grammage * (whole + (1.0 - whole) * self.char_strength * Physical::sound(burn, i)) / 3.0;
                sum.brittle += (1.0 - whole) / 3.0;
            }
            sum
        };
        self.of_triangle.clear();
        let mut t = 0;
        for parent in 0..triangles.len() {
            let (mut sum, mut number) = (Strength::default(), 0.0);
            if fine.is_empty() {
                sum = of_corners(triangles.corners[parent].map(|i| state.burn_node(i as usize) as u32));
                number = 1.0;
            }
            while t < fine.len() && fine.parent[t] as usize == parent {
                if fine.alive[t] != 0 {
                    let of_fine = of_corners(fine.corners[t]);
                    sum.left += of_fine.left;
                    sum.brittle += of_fine.brittle;
                }
                number += 1.0;
                t += 1;
            }
            let left = state.rest.strength[parent] * sum.left / number;
            self.of_triangle.push(Strength { left: left.max(LEAST), brittle: sum.brittle / number });
        }
        true
    }

    /// Parts triangles that have nothing left to hold on by from all around them. Returns whether there were any.
    fn let_fall(&self, state: &mut SheetState, factors: &SpringFactors) -> bool {
        let mut parted = false;
        for t in 0..factors.triangle.len() {
            if state.triangles.alive[t] == 0 || factors.triangle[t] >= LEAST {
                continue;
            }
            let corners = state.triangles.corners[t];
            for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|k: usize| corners[k])) {
                if let Some(across) = self.across_side(state, t as u32, [a, b]) {
                    part_sides(state, [t as u32, across], [a, b]);
                    parted = true;
                }
            }
        }
        parted
    }

    /// Triangles at a node.
    fn around(&self, node: u32) -> &[u32] {
        &self.around[self.first[node as usize] as usize..self.first[node as usize + 1] as usize]
    }

    /// The triangle across a side of one, from one end of it to the other.
    fn across_side(&self, state: &SheetState, t: u32, [from, to]: [u32; 2]) -> Option<u32> {
        self.around(from).iter().copied().find(|u| *u != t && state.triangles.corners[*u as usize].contains(&to))
    }

    /// Works out the utilisation of every live triangle. Returns whether any is over one.
    fn utilise(&mut self, state: &SheetState, shell: &Shell, factors: &SpringFactors) -> bool {
        self.utilisation.clear();
        let mut over = false;
        for (k, t) in shell.triangles().iter().enumerate() {
            let t = *t as usize;
            let Strength { left, brittle } = self.of_triangle[t];
            let kept = factors.kept.get(t).copied().unwrap_or(1.0);
            let stretched = shell.tension(k).map(|tension| kept * tension / left);
            let mut bent = [0.0; 3];
            if brittle > 0.0 {
                // Sheet that is whole creases; char breaks at the face that is stretched.
                let free = factors.free_curvature.get(t).copied().unwrap_or_default();
                let resting = state.rest.curvature[t] + free.extend(0.0);
                let elastic = shell.curvature(k, &state.motion.position) - resting;
                bent = shell.face_tension(k, elastic, self.thickness).map(|tension| brittle * tension / left);
            }
            self.utilisation.push([stretched, bent]);
            over |= self.of_faces([stretched, bent]).0 >= 1.0;
        }
        over
    }

    /// Eq. 17.3: the greatest utilisation of the two faces, and the tensor there.
    fn of_faces(&self, [stretched, bent]: [Tensor; 2]) -> (f64, Tensor) {
        let faces = [1.0, -1.0].map(|side| {
            let tensor = [0, 1, 2].map(|c| stretched[c] + side * bent[c]);
            (self.greatest(tensor), tensor)
        });
        if faces[1].0 > faces[0].0 { faces[1] } else { faces[0] }
    }

    /// Eq. 17.1: greatest tension across any line, over the strength across it: the first principal value of
    /// `D N D`, `D = diag(S1, S2)^(-1/2)`.
    fn greatest(&self, [along, across, shear]: Tensor) -> f64 {
        let DVec2 { x, y } = self.strength;
        let (a, b, c) = (along / x, across / y, shear / (x * y).sqrt());
        0.5 * (a + b) + (0.5 * (a - b)).hypot(c)
    }

    /// Utilisation across a line with this normal.
    fn across(&self, [along, across, shear]: Tensor, normal: DVec2) -> f64 {
        let DVec2 { x, y } = normal;
        (along * x * x + across * y * y + 2.0 * shear * x * y) / (self.strength.x * x * x + self.strength.y * y * y)
    }

    /// Collects the nodes at which the average utilisation is over one.
    fn find_candidates(&mut self, state: &SheetState, shell: &Shell) {
        self.candidates.clear();
        for i in 0..state.motion.len() {
            let around = self.first[i] as usize..self.first[i + 1] as usize;
            let hard = |t: &u32| self.of_faces(self.utilisation[self.place[*t as usize] as usize]).0 >= 1.0;
            // Cracks begin and go on in what has burnt. Whole sheet is a thousand times as stiff as what pulls at it, and
            // what a solver leaves of a step would show as tension first there.
            let burnt = |t: &u32| self.of_triangle[*t as usize].brittle > 0.0;
            let around = &self.around[around];
            if !around.iter().any(hard) || !around.iter().any(burnt) {
                continue;
            }
            let average = self.average(state, i);
            let (utilisation, tensor) = self.of_faces(average);
            if utilisation >= 1.0 {
                self.candidates.push(Candidate { node: i as u32, utilisation, tensor });
            }
        }
        debug_assert_eq!(self.utilisation.len(), shell.triangles().len());
    }

    /// Eq. 17.4: mean of the utilisation over the triangles at a node and those that hang together with them and have their
    /// middle within the length of averaging.
    fn average(&mut self, state: &SheetState, node: usize) -> [Tensor; 2] {
        let triangles = &state.triangles;
        let rest = |i: u32| state.motion.rest_position[i as usize];
        let middle = |t: u32| triangles.corners[t as usize].iter().map(|i| rest(*i)).sum::<DVec3>() / 3.0;
        let from = rest(node as u32);
        self.averages += 1;
        self.queue.clear();
        for t in &self.around[self.first[node] as usize..self.first[node + 1] as usize] {
            self.reached[*t as usize] = self.averages;
            self.queue.push(*t);
        }
        let (mut sum, mut area, mut distance) = ([[0.0; 3]; 2], 0.0, 0.0);
        let mut next = 0;
        while next < self.queue.len() {
            let t = self.queue[next];
            next += 1;
            let own = triangles.rest_area[t as usize];
            let utilisation = self.utilisation[self.place[t as usize] as usize];
            for (sum, value) in sum.iter_mut().flatten().zip(utilisation.iter().flatten()) {
                *sum += own * value;
            }
            area += own;
            distance += own * middle(t).distance(from);
            for i in triangles.corners[t as usize].map(|i| i as usize) {
                for t in &self.around[self.first[i] as usize..self.first[i + 1] as usize] {
                    if self.reached[*t as usize] != self.averages && middle(*t).distance(from) <= self.length {
                        self.reached[*t as usize] = self.averages;
                        self.queue.push(*t);
                    }
                }
            }
        }
        // Eq. 17.13 [Bazant1983]: points of a disc lie two thirds of its radius from its middle.
        let reach = 1.5 * distance / area;
        let coarse = (reach / self.length).max(1.0).sqrt();
        sum.map(|tensor| tensor.map(|value| value / area * coarse))
    }

    /// Chooses those that crack in this step: the hardest pulled first, none near another.
    fn accept(&mut self, state: &SheetState) {
        self.candidates.sort_unstable_by(|a, b| b.utilisation.total_cmp(&a.utilisation).then(a.node.cmp(&b.node)));
        self.accepted.clear();
        let place = |c: &Candidate| state.motion.rest_position[c.node as usize];
        for candidate in &self.candidates {
            let reach = APART * self.length;
            if self.accepted.iter().all(|other| place(other).distance(place(candidate)) > reach) {
                self.accepted.push(*candidate);
            }
        }
    }

    /// Parts the sheet at a node: along one side where it lies on an edge, along two within.
    fn crack(&self, state: &mut SheetState, candidate: &Candidate) -> bool {
        let (sides, on_edge) = self.sides(state, candidate);
        let best = |may: &dyn Fn(&Side) -> bool| {
            let open = sides.iter().filter(|side| side.score > 0.0 && may(side));
            open.max_by(|a, b| a.score.total_cmp(&b.score).then(b.to.cmp(&a.to))).copied()
        };
        let Some(first) = best(&|_| true) else { return false };
        let onward = |side: &Side| side.to != first.to && side.direction.dot(first.direction) < ONWARD;
        let second = if on_edge { None } else { best(&onward) };
        for Side { to, triangles, .. } in [Some(first), second].into_iter().flatten() {
            part_sides(state, triangles, [candidate.node, to]);
        }
        true
    }

    /// The sides at a node along which the sheet could part, and whether the node lies on an edge.
    fn sides(&self, state: &SheetState, candidate: &Candidate) -> (Vec<Side>, bool) {
        let SheetState { triangles, motion, rest, .. } = state;
        let node = candidate.node;
        let mut sides = Vec::new();
        let mut on_edge = false;
        for t in self.around(node) {
            let corners = triangles.corners[*t as usize];
            let points = [DVec2::ZERO, rest.side_1[*t as usize].truncate(), rest.side_2[*t as usize].truncate()];
            let own = corners.iter().position(|i| *i == node).expect("the triangle is at the node");
            for k in (0..3).filter(|k| *k != own) {
                let to = corners[k];
                let parted = triangles.parted[*t as usize] & (1 << (3 - own - k)) != 0;
                let across = self.across_side(state, *t, [node, to]);
                let Some(across) = across.filter(|_| !parted) else {
                    on_edge = true;
                    continue;
                };
                if across < *t {
                    continue;
                }
                let direction = (points[k] - points[own]).normalize();
                // Eq. 17.5: the sides differ by chance, and by what they join.
                let (a, b) = (motion.source[node as usize], motion.source[to as usize]);
                let name = (u64::from(a.min(b)) << 32) | u64::from(a.max(b));
                let chance = 1.0 + RAGGED * (2.0 * Random::new(self.seed, name).uniform() - 1.0);
                let strength = self.of_triangle[*t as usize].left + self.of_triangle[across as usize].left;
                let score = self.across(candidate.tensor, direction.perp()) * chance / strength;
                sides.push(Side { to, triangles: [*t, across], direction, score });
            }
        }
        (sides, on_edge)
    }
}

/// Parts the two triangles at a side.
fn part_sides(state: &mut SheetState, triangles: [u32; 2], ends: [u32; 2]) {
    triangles.into_iter().for_each(|t| tear::part_side(state, t, ends));
}
