//! What sheets do where they touch: they push each other off, and rub.
//!
//! Model: energies of the distance of vertex-face and edge-edge pairs (Eq. 16.1), quadratic at first and logarithmic
//! from half the radius on, so that a contact carries any load [Chen2025]; lagged, smoothed Coulomb friction (Eq. 16.3)
//! [Li2020]. Both are part of the energy that a step minimises (Eq. 12.9). The pairs are looked for once a Newton
//! iteration and held while its length is sought, and no pair may lose more than a part of its distance in one
//! iteration, so that nothing passes through. Which pairs a correction would bring together or apart, and what it would
//! run into from afar, is taken into account before it is made (`foresee`, `expect`). Valid when: nothing crosses at the
//! start; the radius is below half an edge. Cost: two walks of the trees an iteration.

use super::continuous::kept;
use super::distance::{edge_edge, vertex_triangle};
use super::laws::{LOGARITHMIC, barrier, friction};
use super::scenery::Scenery;
use super::{Body, Contacts, Impact, Kind};
use crate::scene::Scene;
use crate::sheet::SheetState;
use crate::solver::StepMatrix;
use crate::solver::couplings::Coupling;
use glam::{DMat3, DVec3};

/// Distance over radius up to which pairs are looked at: a correction may bring them into contact. // tuned: 1.5 to 4
const NEAR: f64 = 2.0;
/// Share of the pairs that must come or go under a correction for it to be worth another. // tuned: 0 to 0.1
const WORTH: f64 = 0.03;
/// How many times as stiff as its barrier a pair in contact is held that a correction would push through.
// tuned: 3 to 30; held less where it is near, it takes five times as long; at 100 single precision no longer solves
const HOLD: f64 = 10.0;
/// Part of an edge at its ends over which an edge-edge pair fades away: there a vertex takes over. // tuned: 0.02 to 0.2
const FADE: f64 = 0.1;
/// Squared sine of the angle under which edges count as parallel, and their pair fades: vertices are closer. [Li2020]
const PARALLEL: f64 = 1e-3;
/// Largest radius over the mean edge: past it a sheet would touch itself in its own plane.
const RADIUS_OVER_EDGE: f64 = 0.5;

/// What two features do to each other; fixed while the length of a correction is sought.
#[derive(Debug, Clone, Copy)]
struct Term {
    kind: Option<Kind>,
    /// Sheet nodes come first, then those of the scenery.
    nodes: [u32; 4],
    weights: [f64; 4],
    /// Nodes of the first feature.
    split: usize,
    /// From the second feature to the first.
    normal: DVec3,
    radius: f64,
    /// [N/m]
    stiffness: f64,
    /// Along the normal, where the pairs were found [m].
    distance: f64,
    /// Whether it pushes, or is taken to.
    acts: bool,
    /// The plane it is with, where there is no second feature.
    plane: usize,
    /// Force of contact times the coefficient of friction [N].
    grip: f64,
    /// Force on the first feature at the point of contact [N].
    force: DVec3,
    /// Minus its derivative [N/m].
    block: DMat3,
}

/// Contact of the sheets of a scene.
#[derive(Debug, Default)]
pub struct Response {
    scenery: Scenery,
    own: bool,
    thickness: f64,
    friction: f64,
    modulus: f64,
    slip: f64,
    contacts: Contacts,
    /// Number of nodes of the sheets.
    count: usize,
    free: Vec<bool>,
    area: Vec<f64>,
    /// Friction of each body with a sheet.
    rough: Vec<f64>,
    /// Nodes of the sheets and of the scenery: at the start of the step, now, and where they would go [m].
    start: Vec<DVec3>,
    now: Vec<DVec3>,
    target: Vec<DVec3>,
    /// Where all was after each iteration, one after the other [m].
    path: Vec<DVec3>,
    /// Nodes of the scenery at the end of the step [m], and their velocity [m/s].
    arrival: Vec<DVec3>,
    speed: Vec<DVec3>,
    /// The same of planes: a point at the start of the step, at its end, and velocity.
    plane: Vec<[DVec3; 3]>,
    /// Part of its way that the scenery has gone in this step.
    progress: f64,
    /// Time that its way takes [s].
    duration: f64,
    /// Whether the scenery stays where it is for now, for the sheet to make way.
    waits: bool,
    terms: Vec<Term>,
    /// Share of its way at which each node meets a plane, where it does.
    plane_meetings: Vec<(u32, usize)>,
}

impl Response {
    /// Of a scene; none where nothing can touch.
    pub fn of(scene: &Scene, scenery: Scenery) -> Option<Self> {
        let own = scene.contact.self_contact.unwrap_or(!scenery.is_empty());
        (own || !scenery.is_empty()).then(|| Self {
            scenery,
            own,
            thickness: scene.contact.thickness.unwrap_or(scene.shell.thickness).0,
            friction: scene.contact.friction.0,
            modulus: scene.contact.modulus.0,
            slip: scene.contact.slip.0,
            ..Self::default()
        })
    }

    /// Takes up a topology.
    pub fn lay_out(&mut self, state: &SheetState, fixed: &[bool]) {
        let Self { scenery, count, free, area, rough, .. } = self;
        *count = state.motion.len();
        free.clear();
        free.extend(fixed.iter().map(|fixed| !fixed));
        area.clear();
        area.resize(*count, 0.0);
        let mut triangles = Vec::new();
        let (mut edges, mut sides) = (0.0, 0.0);
        for t in (0..state.triangles.len()).filter(|t| state.triangles.alive[*t] != 0) {
            triangles.push(state.triangles.corners[t]);
            let [u, v] = [state.rest.side_1[t], state.rest.side_2[t]];
            edges += u.length() + v.length() + u.distance(v);
            sides += 3.0;
            for i in state.triangles.corners[t] {
                area[i as usize] += state.triangles.rest_area[t] / 3.0;
            }
        }
        let layer = self.thickness.min(RADIUS_OVER_EDGE * edges / f64::max(sides, 1.0));
        let mut bodies = vec![Body::default()];
        rough.clear();
        rough.push(self.friction);
        let mut node_body = vec![0; *count];
        let mut thickness = vec![layer; *count];
        let mut origin: Vec<u32> = (0..*count as u32).collect();
        let mut first_of_source = vec![u32::MAX; *count];
        for i in 0..*count {
            // Nodes a tear has made have the source of their parent, which comes before them.
            let first = &mut first_of_source[state.motion.source[i] as usize];
            *first = (*first).min(i as u32);
            origin[i] = *first;
        }
        self.start.clear();
        self.start.extend_from_slice(&state.motion.position);
        for solid in &scenery.solids {
            let first = node_body.len() as u32;
            triangles.extend(solid.triangles.iter().map(|corners| corners.map(|i| first + i)));
            node_body.resize(node_body.len() + solid.points.len(), bodies.len() as u32);
            bodies.push(Body { rigid: true });
            rough.push(solid.friction);
            self.start.extend_from_slice(&solid.points);
        }
        thickness.resize(node_body.len(), 0.0);
        origin.extend(*count as u32..node_body.len() as u32);
        // Live triangles of a sheet are sound, and so is the scenery.
        let built = self.contacts.rebuild(&triangles, &bodies, &node_body, &thickness, &self.start);
        debug_assert!(built.is_ok());
        self.contacts.restrict(&origin, self.own);
        self.target.clear();
        self.target.resize(node_body.len(), DVec3::ZERO);
    }

    /// Begins a step of motion between two times [s]: the sheet is where it is, the scenery has its way to go, from where it
    /// was so much earlier [s].
    pub fn begin(&mut self, position: &[DVec3], [before, after]: [f64; 2], lag: f64) {
        let Self { scenery, start, arrival, speed, plane, .. } = self;
        start.clear();
        start.extend_from_slice(position);
        arrival.clear();
        speed.clear();
        for solid in &scenery.solids {
            for point in 0..solid.points.len() {
                let (from, to) = (solid.place(point, before - lag), solid.place(point, after));
                start.push(from);
                arrival.push(to);
                speed.push((to - from) / (after - before));
            }
        }
        plane.clear();
        plane.extend(scenery.planes.iter().map(|plane| {
            let [from, to] = plane.way([before, after], lag);
            [from, to, (to - from) / (after - before)]
        }));
        self.progress = if self.top_speed() == 0.0 { 1.0 } else { 0.0 };
        self.duration = after - before + lag;
        self.waits = false;
        self.now.clear();
        self.now.extend_from_slice(&self.start);
        self.path.clear();
    }

    /// Whether the scenery has gone all its way.
    pub fn has_arrived(&self) -> bool {
        self.progress >= 1.0
    }

    /// How far the scenery is behind its time [s].
    pub fn lag(&self) -> f64 {
        (1.0 - self.progress) * self.duration
    }

    /// Largest speed of the scenery in this step [m/s].
    pub fn top_speed(&self) -> f64 {
        let planes = self.plane.iter().map(|plane| plane[2]);
        self.speed.iter().copied().chain(planes).map(DVec3::length).fold(0.0, f64::max)
    }

    /// Holds the scenery where it is, or lets it go on.
    pub fn wait(&mut self, waits: bool) {
        self.waits = waits;
    }

    /// Whether the scenery goes on with its way in this iteration.
    pub fn is_under_way(&self) -> bool {
        self.progress < 1.0 && !self.waits
    }

    /// Moves on: the sheet to these places, the scenery by a share of the way it has left.
    pub fn go(&mut self, position: &[DVec3], share: f64) {
        let under_way = self.is_under_way();
        let Self { now, arrival, count, .. } = self;
        now[..*count].copy_from_slice(position);
        if under_way {
            for (now, arrival) in now[*count..].iter_mut().zip(arrival) {
                *now = if share >= 1.0 { *arrival } else { now.lerp(*arrival, share) };
            }
            self.progress = if share >= 1.0 { 1.0 } else { self.progress + (1.0 - self.progress) * share };
        }
        self.path.extend_from_slice(&self.now);
    }

    fn plane_point(&self, plane: usize) -> DVec3 {
        let [from, to, _] = self.plane[plane];
        if self.progress >= 1.0 { to } else { from.lerp(to, self.progress) }
    }

    /// The way that a plane has yet to go in this iteration [m].
    fn way_of_plane(&self, plane: usize) -> DVec3 {
        if self.is_under_way() { self.plane[plane][1] - self.plane_point(plane) } else { DVec3::ZERO }
    }

    /// The way that a node of the scenery has yet to go in this iteration [m].
    fn way_of_node(&self, node: usize) -> DVec3 {
        if self.is_under_way() { self.arrival[node - self.count] - self.now[node] } else { DVec3::ZERO }
    }

    /// Distance over which the vertex of a sheet is in contact with a plane [m].
    fn half_layer(&self, node: usize) -> f64 {
        0.5 * self.contacts.surface().thickness[node]
    }

    /// Share of the way to these places on which nothing passes through. What stops it is remembered for
    /// [`Self::expect`].
    pub fn safe_share(&mut self, position: &[DVec3]) -> f64 {
        let under_way = self.is_under_way();
        let Self { now, target, arrival, count, .. } = self;
        target[..*count].copy_from_slice(position);
        target[*count..].copy_from_slice(if under_way { arrival } else { &now[*count..] });
        let impacts = self.contacts.approaches(now, target, self.thickness);
        let mut share = impacts.iter().map(|impact| impact.time).fold(1.0, f64::min);
        self.plane_meetings.clear();
        for (p, plane) in self.scenery.planes.iter().enumerate() {
            let from = self.plane_point(p);
            let to = from + self.way_of_plane(p);
            for i in 0..self.count {
                let before = (self.now[i] - from).dot(plane.normal);
                let after = (self.target[i] - to).dot(plane.normal);
                let floor = kept(before, self.half_layer(i));
                if after < floor {
                    share = share.min(((before - floor) / (before - after)).max(0.0));
                    self.plane_meetings.push((i as u32, p));
                }
            }
        }
        share
    }

    /// Area that a pair stands for [m2]: that of its nodes on sheets.
    fn area_of(&self, nodes: &[u32; 4], weights: &[f64; 4]) -> f64 {
        let on_sheet = || (0..4).filter(|k| (nodes[*k] as usize) < self.count);
        let sum: f64 = on_sheet().map(|k| weights[k].abs() * self.area[nodes[k] as usize]).sum();
        sum / on_sheet().map(|k| weights[k].abs()).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Friction between the bodies of two nodes.
    fn friction_of(&self, i: u32, j: u32) -> f64 {
        let body = |i: u32| self.contacts.surface().node_body[i as usize] as usize;
        self.rough[body(i).max(body(j))]
    }

    /// Finds what is in contact where everything is now, with forces and their derivatives; `speed` is that of the sheets
    /// [m/s], `h` the length of the step [s].
    pub fn detect(&mut self, speed: &[DVec3], h: f64) {
        self.contacts.proximities(&self.now, NEAR * self.thickness);
        let mut terms = std::mem::take(&mut self.terms);
        terms.clear();
        for pair in self.contacts.last_proximities() {
            let radius = pair.thickness(self.contacts.surface());
            let share = match pair.kind {
                Kind::VertexFace => 1.0,
                Kind::EdgeEdge => self.fade(&pair.nodes, &pair.weights),
            };
            if pair.distance < NEAR * radius && share > 0.0 {
                terms.push(Term {
                    kind: Some(pair.kind),
                    split: if pair.kind == Kind::VertexFace { 1 } else { 2 },
                    stiffness: share * self.modulus * self.area_of(&pair.nodes, &pair.weights) / radius,
                    radius,
                    distance: pair.distance,
                    ..Term::of(pair.nodes, pair.weights, pair.normal)
                });
            }
        }
        for (p, plane) in self.scenery.planes.iter().enumerate() {
            let point = self.plane_point(p);
            for i in 0..self.count {
                if self.area[i] > 0.0 && (self.now[i] - point).dot(plane.normal) < NEAR * self.half_layer(i) {
                    terms.push(self.against_plane(i as u32, p));
                }
            }
        }
        for term in &mut terms {
            term.acts = term.distance < term.radius;
            if !term.acts {
                continue;
            }
            let (_, push, curvature) = barrier(term.distance, term.radius, term.stiffness);
            let roughness = match term.kind {
                Some(_) => self.friction_of(term.nodes[0], term.nodes[term.split]),
                None => self.scenery.planes[term.plane].friction,
            };
            term.grip = roughness * push;
            term.force = term.normal * push;
            term.block = outer(term.normal) * curvature;
            self.rub(term, speed, h);
            self.meet_scenery(term);
        }
        self.terms = terms;
    }

    /// Looks which pairs a correction (of speeds, in a step of length `h`) would bring into contact and which out of it, and
    /// takes them as such. Returns whether that is worth another correction.
    pub fn foresee(&mut self, correction: &[DVec3], h: f64) -> bool {
        let mut terms = std::mem::take(&mut self.terms);
        let (mut changed, mut acting) = (0, 0);
        for term in &mut terms {
            let way = |k: usize| {
                let i = term.nodes[k] as usize;
                if i < self.count { correction[i] * h } else { self.way_of_node(i) }
            };
            let mut towards: DVec3 = (0..4).map(|k| way(k) * term.weights[k]).sum();
            if term.kind.is_none() {
                towards -= self.way_of_plane(term.plane);
            }
            let deep = term.distance < LOGARITHMIC * term.radius;
            let acts = deep || term.distance + towards.dot(term.normal) < term.radius;
            if acts != term.acts {
                changed += 1;
                term.acts = acts;
                (term.force, term.block) = (DVec3::ZERO, DMat3::ZERO);
                if acts {
                    // The spring that contact would be: it also draws, so that the correction ends in contact.
                    term.force = term.normal * (term.stiffness * (term.radius - term.distance));
                    term.block = outer(term.normal) * term.stiffness;
                    self.meet_scenery(term);
                }
            }
            acting += usize::from(acts);
        }
        self.terms = terms;
        changed as f64 > WORTH * acting as f64
    }

    /// Takes into account what the last correction would have run into from afar. Returns whether there is anything.
    pub fn expect(&mut self) -> bool {
        let mut terms = std::mem::take(&mut self.terms);
        let before = terms.len();
        for Impact { kind, nodes, weights, normal, .. } in self.contacts.last_impacts() {
            let radius: f64 = (0..4).map(|k| 0.5 * weights[k].abs() * self.layer(nodes[k])).sum();
            let split = if *kind == Kind::VertexFace { 1 } else { 2 };
            let stiffness = self.modulus * self.area_of(nodes, weights) / radius;
            if radius > 0.0 && *normal != DVec3::ZERO {
                terms.push(Term { kind: Some(*kind), split, radius, stiffness, ..Term::of(*nodes, *weights, *normal) });
            }
        }
        for (node, plane) in &self.plane_meetings {
            terms.push(self.against_plane(*node, *plane));
        }
        for term in &mut terms[before..] {
            let apart = match term.kind {
                Some(_) => (0..4).map(|k| self.now[term.nodes[k] as usize] * term.weights[k]).sum::<DVec3>(),
                None => self.now[term.nodes[0] as usize] - self.plane_point(term.plane),
            };
            term.distance = apart.dot(term.normal);
            term.acts = true;
            if term.distance < term.radius {
                // It has its force already, which is too weak: for this once it is held where it is, without any energy.
                term.block = outer(term.normal) * (HOLD * barrier(term.distance, term.radius, term.stiffness).2);
                term.stiffness = 0.0;
            } else {
                term.force = term.normal * (term.stiffness * (term.radius - term.distance));
                term.block = outer(term.normal) * term.stiffness;
            }
            self.meet_scenery(term);
        }
        self.terms = terms;
        self.terms.len() > before
    }

    /// Energy of contact and friction [J] of the pairs last detected, with the sheets at these places and speeds.
    pub fn energy(&self, position: &[DVec3], speed: &[DVec3], h: f64) -> f64 {
        let mut energy = 0.0;
        for term in &self.terms {
            energy += barrier(self.distance(term, position), term.radius, term.stiffness).0;
            if term.grip > 0.0 {
                let slip = self.sliding(term, speed) * h;
                energy += term.grip * friction(slip.length(), self.slip * h).0;
            }
        }
        energy
    }

    /// Adds the forces at the places of the last detection, times `scale`.
    pub fn add_forces(&self, residual: &mut [DVec3], scale: f64) {
        for term in self.terms.iter().filter(|term| term.acts) {
            for k in 0..4 {
                let i = term.nodes[k] as usize;
                if term.weights[k] != 0.0 && i < self.count && self.free[i] {
                    residual[i] += term.force * (term.weights[k] * scale);
                }
            }
        }
    }

    /// Puts the derivatives of forces, times `scale`, into a matrix as its couplings.
    pub fn couple(&self, matrix: &mut StepMatrix, scale: f64) {
        let StepMatrix { couplings, .. } = matrix;
        couplings.clear();
        for term in self.terms.iter().filter(|term| term.acts) {
            let free = |k: usize| (term.nodes[k] as usize) < self.count && self.free[term.nodes[k] as usize];
            couplings.push(Coupling {
                // Nodes of the scenery are in no row of the matrix.
                nodes: std::array::from_fn(|k| if free(k) { term.nodes[k] } else { 0 }),
                weights: std::array::from_fn(|k| if free(k) { term.weights[k] } else { 0.0 }),
                block: term.block * scale,
            });
        }
        couplings.index(self.count);
    }

    /// Calls `touch` for every node of a sheet that something acts on.
    pub fn touched(&self, mut touch: impl FnMut(usize)) {
        for term in self.terms.iter().filter(|term| term.acts) {
            let nodes = (0..4).filter(|k| term.weights[*k] != 0.0).map(|k| term.nodes[k] as usize);
            nodes.filter(|i| *i < self.count).for_each(&mut touch);
        }
    }

    /// Number of pairs that act on each other.
    pub fn pairs(&self) -> usize {
        self.terms.iter().filter(|term| term.acts).count()
    }

    /// Pairs that passed through each other in the step. The straight way from where it began to where all is now may meet
    /// what the sheet went around: where it meets anything, the way that was gone is followed, iteration by iteration.
    pub fn passed_through(&mut self) -> usize {
        let Self { contacts, start, now, path, .. } = self;
        let mut pairs = contacts.passed_through(start, now).len();
        if pairs > 0 && !path.is_empty() {
            let places = || std::iter::once(&start[..]).chain(path.chunks_exact(start.len()));
            pairs = places().zip(places().skip(1)).map(|(from, to)| contacts.passed_through(from, to).len()).sum();
        }
        let mut nodes = 0;
        for (p, plane) in self.scenery.planes.iter().enumerate() {
            let side = |at: DVec3, point: DVec3| (at - point).dot(plane.normal) > 0.0;
            let (from, to) = (self.plane[p][0], self.plane_point(p));
            nodes += (0..self.count).filter(|i| side(self.start[*i], from) && !side(self.now[*i], to)).count();
        }
        pairs + nodes
    }

    /// Pairs of triangles that cross, of sheets and scenery, and nodes below a plane, at a time [s]; the scenery so far
    /// behind [s].
    pub fn crossings(&mut self, position: &[DVec3], time: f64, lag: f64) -> usize {
        self.begin(position, [time, time + 1.0], lag);
        let pairs = self.contacts.intersecting_pairs(&self.now);
        let below = |(p, plane): (usize, &super::scenery::Plane)| {
            let point = self.plane[p][0];
            (0..self.count).filter(|i| self.area[*i] > 0.0 && (position[*i] - point).dot(plane.normal) <= 0.0).count()
        };
        pairs + self.scenery.planes.iter().enumerate().map(below).sum::<usize>()
    }

    fn layer(&self, node: u32) -> f64 {
        self.contacts.surface().thickness[node as usize]
    }

    fn against_plane(&self, node: u32, plane: usize) -> Term {
        let radius = self.half_layer(node as usize);
        let stiffness = self.modulus * self.area[node as usize] / radius;
        let normal = self.scenery.planes[plane].normal;
        let distance = (self.now[node as usize] - self.plane_point(plane)).dot(normal);
        Term { plane, radius, stiffness, distance, ..Term::of([node; 4], [1.0, 0.0, 0.0, 0.0], normal) }
    }

    /// Where a node is: of a sheet as given, of the scenery as it is now.
    fn at(&self, position: &[DVec3], node: u32) -> DVec3 {
        let i = node as usize;
        if i < self.count { position[i] } else { self.now[i] }
    }

    /// Distance of a pair, with the sheets at these places [m].
    fn distance(&self, term: &Term, position: &[DVec3]) -> f64 {
        let x = || term.nodes.map(|i| self.at(position, i));
        match term.kind {
            None => (position[term.nodes[0] as usize] - self.plane_point(term.plane)).dot(term.normal),
            Some(Kind::VertexFace) => {
                let [p, a, b, c] = x();
                vertex_triangle(p, [a, b, c]).offset.length()
            }
            Some(Kind::EdgeEdge) => {
                let [a, b, c, d] = x();
                edge_edge([a, b], [c, d], f64::INFINITY).map_or(f64::INFINITY, |closest| closest.offset.length())
            }
        }
    }

    /// Velocity of the first feature over the second, without its part along the normal [m/s].
    fn sliding(&self, term: &Term, speed: &[DVec3]) -> DVec3 {
        let of =
            |i: u32| if (i as usize) < self.count { speed[i as usize] } else { self.speed[i as usize - self.count] };
        let mut sum: DVec3 = (0..4).map(|k| of(term.nodes[k]) * term.weights[k]).sum();
        if term.kind.is_none() {
            sum -= self.plane[term.plane][2];
        }
        sum - term.normal * term.normal.dot(sum)
    }

    /// Adds friction to a term (Eq. 16.3).
    fn rub(&self, term: &mut Term, speed: &[DVec3], h: f64) {
        if term.grip <= 0.0 {
            return;
        }
        let slide = self.sliding(term, speed) * h;
        let way = slide.length();
        let (_, pull, curvature) = friction(way, self.slip * h);
        // The secant, over the second derivative: a paraboloid that touches the energy and is nowhere below it, for a full
        // correction with the true one slides past rest and back.
        let secant = if way > 0.0 { pull / way } else { curvature };
        term.force -= slide * (term.grip * secant);
        term.block += (DMat3::IDENTITY - outer(term.normal)) * (term.grip * secant);
    }

    /// Takes into account the way that the scenery has yet to go.
    fn meet_scenery(&self, term: &mut Term) {
        if !self.is_under_way() {
            return;
        }
        let ahead = match term.kind {
            None => -self.way_of_plane(term.plane),
            Some(_) => (0..4)
                .filter(|k| term.nodes[*k] as usize >= self.count)
                .map(|k| self.way_of_node(term.nodes[k] as usize) * term.weights[k])
                .sum(),
        };
        term.force -= term.block * ahead;
    }

    /// How much an edge-edge pair counts: less at the ends of edges and where they are parallel, where vertices do.
    fn fade(&self, nodes: &[u32; 4], weights: &[f64; 4]) -> f64 {
        let smooth = |x: f64| {
            let x = x.clamp(0.0, 1.0);
            x * x * (3.0 - 2.0 * x)
        };
        let end = |a: f64, b: f64| smooth(a.abs().min(b.abs()) / FADE);
        let [a, b, c, d] = nodes.map(|i| self.now[i as usize]);
        let (u, v) = (b - a, d - c);
        let sine_squared = u.cross(v).length_squared() / (u.length_squared() * v.length_squared());
        end(weights[0], weights[1]) * end(weights[2], weights[3]) * smooth(sine_squared / PARALLEL)
    }
}

impl Term {
    fn of(nodes: [u32; 4], weights: [f64; 4], normal: DVec3) -> Self {
        Self {
            kind: None,
            nodes,
            weights,
            split: 1,
            normal,
            radius: 0.0,
            stiffness: 0.0,
            distance: 0.0,
            acts: false,
            plane: 0,
            grip: 0.0,
            force: DVec3::ZERO,
            block: DMat3::ZERO,
        }
    }
}

fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_through_is_told_from_what_goes_around() {
        // A small triangle over a large one.
        let large = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let small = |at: DVec3| [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| at + 0.1 * corner);
        let all = |at: DVec3| [large, small(at)].concat();
        let mut response = Response { count: 6, own: true, ..Response::default() };
        let surface = crate::contact::surface::Surface::sheet(6, &[[0, 1, 2], [3, 4, 5]], 1e-3).unwrap();
        let [over, under] = [DVec3::new(0.2, 0.2, 0.1), DVec3::new(0.2, 0.2, -0.1)];
        response.contacts = Contacts::build(surface, &all(over));
        for (way, through) in [(vec![under], true), (vec![over - DVec3::X, under - DVec3::X, under], false)] {
            response.begin(&all(over), [0.0, 1.0], 0.0);
            way.iter().for_each(|at| response.go(&all(*at), 1.0));
            assert_eq!(response.passed_through() > 0, through, "{way:?}");
        }
    }
}
