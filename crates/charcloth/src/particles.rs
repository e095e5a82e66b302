//! What comes off: the numbers of its pieces, and what is too small to be sheet.
//!
//! Model: a piece under `crack.particle_area`, or what has burnt to ash on a triangle that moves, goes off as one particle
//! with the momentum it had. It falls and drifts as a plate that tumbles: drag of a plate broadside on half of its area,
//! which is what convex bodies show on average (Eq. 17.8) [Cauchy1832] [Hoerner1965]. Its burn nodes stay, glow and cool as
//! they did, so that mass and heat are booked where they were. Where one meets an obstacle it stays. Valid when: particles do
//! not meet sheets or each other, and what they lie on keeps still. Cost: one pass over the particles a step, and over the burn nodes a frame.

use crate::contact::scenery::{Plane, Scenery, Solid};
use crate::effects::wind::{Air, PLATE_DRAG};
use crate::plume::Plume;
use crate::scene::Scene;
use crate::sheet::{NONE, Particles, SheetState};
use crate::tear;
use glam::DVec3;

/// Molar gas constant [J/(mol K)] [Bipm2019], and molar mass of air [kg/mol].
const GAS_CONSTANT: f64 = 8.314_462_618;
const AIR: f64 = 0.028_97;

/// What particles weigh at least where they move [kg]: far less than any speck of ash, so that none divides by nothing.
const LIGHTEST: f64 = 1e-14;

/// Density of the air of a scene's room [kg/m3], by the law of ideal gases.
pub fn density_of_air(scene: &Scene) -> f64 {
    scene.fire.pressure.0 * AIR / (GAS_CONSTANT * scene.fire.ambient_temperature.0)
}

/// Pieces and particles of a scene, and their buffers.
pub struct Shed {
    /// Area under which a piece is a particle [m2].
    least: f64,
    gravity: DVec3,
    /// Half the density of air times the drag coefficient times the part of the area that it acts on [kg/m3].
    drag: f64,
    air: Air,
    planes: Vec<Plane>,
    solids: Vec<Target>,
    area: Vec<f64>,
    held: Vec<bool>,
    piece: Vec<u32>,
    parent: Vec<u32>,
    particle_of_parent: Vec<u32>,
}

impl Shed {
    /// Of a scene.
    pub fn of(scene: &Scene, up: DVec3, scenery: &Scenery) -> Self {
        Self {
            least: scene.crack.particle_area.0,
            gravity: up * -scene.gravity.0,
            drag: 0.25 * density_of_air(scene) * PLATE_DRAG,
            air: Air::of(scene),
            planes: scenery.planes.clone(),
            // Those that bend are passed through: particles are found in a solid as it was at the start.
            solids: scenery.solids.iter().filter(|solid| solid.course.is_none()).map(Target::of).collect(),
            area: Vec::new(),
            held: Vec::new(),
            piece: Vec::new(),
            parent: Vec::new(),
            particle_of_parent: Vec::new(),
        }
    }

    /// Cuts pieces that are too small to be sheet. Returns whether there was any.
    pub fn cut(&mut self, state: &mut SheetState) -> bool {
        let SheetState { triangles, motion, burn_triangles: fine, pieces, .. } = state;
        self.area.clear();
        self.area.resize(pieces.mass.len(), 0.0);
        for t in (0..triangles.len()).filter(|t| triangles.alive[*t] != 0) {
            let held = triangles.corners[t].iter().any(|i| motion.pinned[*i as usize] != 0);
            self.area[triangles.piece[t] as usize] += if held { f64::INFINITY } else { triangles.rest_area[t] };
        }
        let mut any = false;
        for t in 0..triangles.len() {
            if triangles.alive[t] != 0 && self.area[triangles.piece[t] as usize] < self.least {
                triangles.alive[t] = 0;
                any = true;
            }
        }
        for t in 0..fine.len() {
            fine.alive[t] &= triangles.alive[fine.parent[t] as usize];
        }
        if any {
            tear::part(state);
        }
        any
    }

    /// Makes particles of burn nodes that have no triangle any more: one of all that came off one piece on one motion
    /// triangle in a frame, or of all of a small piece.
    pub fn gather(&mut self, state: &mut SheetState) {
        self.find_parents(state);
        let SheetState { burn, triangles, motion, particles, books, .. } = state;
        self.particle_of_parent.clear();
        self.particle_of_parent.resize(triangles.len() + self.area.len(), NONE);
        let before = particles.mass.len();
        for i in 0..burn.len() {
            if self.held[i] || burn.particle[i] != NONE || self.parent[i] == NONE {
                continue;
            }
            let parent = self.parent[i] as usize;
            let piece = triangles.piece[parent] as usize;
            let small = self.area.get(piece).is_some_and(|area| *area < self.least);
            let key = if small { triangles.len() + piece } else { parent };
            let known = &mut self.particle_of_parent[key];
            if *known == NONE {
                *known = particles.mass.len() as u32;
                add(particles, piece as u32, books.time[0]);
            }
            burn.particle[i] = *known;
            let p = *known as usize;
            let corners = triangles.corners[parent].map(|i| i as usize);
            // A node of no mass still says where it is.
            let mass = burn.mass[i].max(LIGHTEST);
            particles.mass[p] += mass;
            particles.position[p] += corners.iter().map(|i| motion.position[*i]).sum::<DVec3>() * (mass / 3.0);
            particles.velocity[p] += corners.iter().map(|i| motion.velocity[*i]).sum::<DVec3>() * (mass / 3.0);
        }
        for p in before..particles.mass.len() {
            let mass = particles.mass[p];
            particles.position[p] /= mass;
            particles.velocity[p] /= mass;
        }
    }

    /// Finds which burn nodes hang on a live triangle, the piece of each, and the motion triangle that carries it or did.
    fn find_parents(&mut self, state: &SheetState) {
        let SheetState { burn, triangles, motion, burn_triangles: fine, .. } = state;
        self.held.clear();
        self.held.resize(burn.len(), false);
        for column in [&mut self.parent, &mut self.piece] {
            column.clear();
            column.resize(burn.len(), NONE);
        }
        let count = if fine.is_empty() { triangles.len() } else { fine.len() };
        for t in (0..count).rev() {
            let (nodes, parent, alive) = if fine.is_empty() {
                (triangles.corners[t].map(|i| motion.burn_node[i as usize]), t, triangles.alive[t] != 0)
            } else {
                (fine.corners[t], fine.parent[t] as usize, fine.alive[t] != 0)
            };
            for i in nodes.map(|i| i as usize) {
                if alive || !self.held[i] {
                    (self.parent[i], self.piece[i], self.held[i]) = (parent as u32, triangles.piece[parent], alive);
                }
            }
        }
    }

    /// Brings masses, areas and temperatures of pieces and particles up to date.
    pub fn measure(&mut self, state: &mut SheetState) {
        self.find_parents(state);
        let SheetState { burn, pieces, particles, .. } = state;
        for column in [&mut pieces.mass, &mut pieces.area, &mut pieces.temperature] {
            column.fill(0.0);
        }
        for column in [&mut particles.mass, &mut particles.area, &mut particles.temperature] {
            column.fill(0.0);
        }
        for i in 0..burn.len() {
            let (mass, area, temperature) = if burn.particle[i] != NONE {
                let p = burn.particle[i] as usize;
                (&mut particles.mass[p], &mut particles.area[p], &mut particles.temperature[p])
            } else if self.held[i] {
                let p = self.piece[i] as usize;
                (&mut pieces.mass[p], &mut pieces.area[p], &mut pieces.temperature[p])
            } else {
                continue;
            };
            *mass += burn.mass[i];
            *area += burn.area[i];
            *temperature += burn.mass[i] * burn.temperature[i];
        }
        for (mass, temperature) in
            [(&pieces.mass, &mut pieces.temperature), (&particles.mass, &mut particles.temperature)]
        {
            temperature.iter_mut().zip(mass).for_each(|(heat, mass)| *heat /= mass.max(f64::MIN_POSITIVE));
        }
    }

    /// Moves the particles through a step from a time on [s] (Eq. 17.8).
    pub fn advance(&self, particles: &mut Particles, plume: &Plume, time: f64, dt: f64) {
        let wind = self.air.velocity(time);
        for p in 0..particles.lies.len() {
            if particles.lies[p] != 0 {
                continue;
            }
            let air = wind + plume.velocity(particles.position[p]);
            let mass = particles.mass[p].max(LIGHTEST);
            let velocity = particles.velocity[p];
            // Drag for the speed now, taken implicitly: it never turns a particle round.
            let rate = self.drag * particles.area[p] * (velocity - air).length() / mass;
            let velocity = (velocity + (self.gravity + air * rate) * dt) / (1.0 + rate * dt);
            let from = particles.position[p];
            let position = from + velocity * dt;
            particles.velocity[p] = velocity;
            particles.position[p] = position;
            for solid in &self.solids {
                if let Some(share) = solid.meeting([from, position], [time, time + dt]) {
                    particles.position[p] = from.lerp(position, share);
                    particles.velocity[p] = DVec3::ZERO;
                    particles.lies[p] = 1;
                }
            }
            for plane in &self.planes {
                let under = (plane.place(time + dt) - position).dot(plane.normal);
                if under >= 0.0 {
                    particles.position[p] = position + plane.normal * under;
                    particles.velocity[p] = DVec3::ZERO;
                    particles.lies[p] = 1;
                }
            }
        }
    }
}

/// A solid as particles meet it: its triangles in the order of their lowest x.
struct Target {
    solid: Solid,
    lowest: Vec<f64>,
    /// How far a triangle reaches in x at most [m].
    widest: f64,
}

impl Target {
    fn of(solid: &Solid) -> Self {
        let mut solid = solid.clone();
        let Solid { points, triangles, .. } = &mut solid;
        let x = |corners: &[u32; 3]| corners.map(|i| points[i as usize].x);
        let low = |corners: &[u32; 3]| x(corners).into_iter().fold(f64::INFINITY, f64::min);
        let high = |corners: &[u32; 3]| x(corners).into_iter().fold(f64::NEG_INFINITY, f64::max);
        triangles.sort_by(|a, b| low(a).total_cmp(&low(b)));
        let lowest = triangles.iter().map(low).collect();
        let widest = triangles.iter().map(|corners| high(corners) - low(corners)).fold(0.0, f64::max);
        Self { solid, lowest, widest }
    }

    /// Share of its way between two times [s] at which a particle meets it; none where it does not.
    fn meeting(&self, way: [DVec3; 2], times: [f64; 2]) -> Option<f64> {
        let motion = &self.solid.motion;
        let [from, to] = [motion.back(way[0], times[0]), motion.back(way[1], times[1])];
        let (low, high) = (from.x.min(to.x), from.x.max(to.x));
        let near = self.lowest.partition_point(|x| *x < low - self.widest)..self.lowest.partition_point(|x| *x <= high);
        let meets = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| self.solid.points[i as usize]);
            crosses([from, to], [a, b, c])
        };
        self.solid.triangles[near].iter().filter_map(meets).min_by(f64::total_cmp)
    }
}

/// Share of the way between two points at which a triangle is in it: signed volumes of the five tetrahedra [Ericson2005].
fn crosses([from, to]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    let (before, after) = ((from - a).dot(normal), (to - a).dot(normal));
    if before == after || before * after > 0.0 {
        return None;
    }
    let way = to - from;
    let beside = [[a, b], [b, c], [c, a]].map(|[p, q]| way.dot((p - from).cross(q - from)));
    let within = beside.iter().all(|side| *side >= 0.0) || beside.iter().all(|side| *side <= 0.0);
    within.then(|| before / (before - after))
}

fn add(particles: &mut Particles, from: u32, time: f64) {
    let Particles { position, velocity, mass, area, temperature, parent, birth, lies } = particles;
    [position, velocity].into_iter().for_each(|column| column.push(DVec3::ZERO));
    [mass, area, temperature].into_iter().for_each(|column| column.push(0.0));
    parent.push(from);
    birth.push(time);
    lies.push(0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::scenery::Motion;

    #[test]
    fn a_particle_meets_a_solid_where_it_has_moved_to() {
        let points = vec![DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::new(1.0, 0.0, 1.0)];
        let motion = Motion { velocity: DVec3::X * 10.0, stop: f64::INFINITY, ..Motion::default() };
        let solid = Solid { points, triangles: vec![[2, 1, 3], [0, 1, 2]], motion, course: None, friction: 0.0 };
        let target = Target::of(&solid);
        let fall =
            |x: f64, z: f64, time: f64| target.meeting([DVec3::new(x, 0.3, z), DVec3::new(x, -0.1, z)], [time, time]);
        for (x, z) in [(0.2, 0.3), (0.9, 0.9)] {
            assert!((fall(x, z, 0.0).unwrap() - 0.75).abs() < 1e-12, "{x} {z}");
            assert_eq!(fall(x, z, 1.0), None, "it is ten metres away");
            assert!(fall(x + 10.0, z, 1.0).is_some());
        }
        assert_eq!(fall(1.2, 0.5, 0.0), None, "beside it");
        let above = target.meeting([DVec3::new(0.5, 0.3, 0.2), DVec3::new(0.5, 0.1, 0.2)], [0.0; 2]);
        assert_eq!(above, None, "it has not come down yet");
    }
}
