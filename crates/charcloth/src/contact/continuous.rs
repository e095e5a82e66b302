//! When two features on straight paths first meet.
//!
//! Model: conservative advancement by additive steps, with minimum separation [Li2021]. A step is as long as one of two
//! lower bounds of the distance stays above the floor: the distance less the greatest relative motion of any two nodes
//! (which bounds that of any two points, without centring), and the separation of the nodes along the present normal,
//! which is linear in time and is exact for two features that slide past each other. The larger step is taken.
//! Every step is safe by itself, so running out of steps is safe too. Valid when: paths are straight within the step.
//! Cost: about 100 ns for a pair whose boxes meet and that does not collide.

use super::distance::{edge_edge, vertex_triangle};
use super::proximity::Kind;
use glam::DVec3;

/// Share of its distance above the separation that a pair still has where it counts as met; [Li2021] has 0.1.
const LEFT: f64 = 0.1;

/// Distance above the separation of which no more than that share is kept, or the separation where that is more [m]:
/// else what only slides past, from afar, would count as met. tuned: a tenth of the thinnest paper
const LEAST_GAP: f64 = 1e-5;

/// Share of its distance that a pair keeps in one move towards each other. // tuned: 0.1 to 0.5
const APPROACH: f64 = 0.2;

/// Distance that no pair comes down to in moves towards each other [m], and the share of its distance that one keeps which
/// is down there all the same: an audit can still tell them apart.
// tuned: a few times `TOUCH`, where no paper bears what would press it so close
const NEAREST: f64 = 4e-9;
const BARELY: f64 = 1.0 - 1e-5;

/// Relative motion up to which no pair at a distance approaches by the measure of [`kept`] [m].
pub(super) fn idle(distance: f64) -> f64 {
    // What it would have to lose is at least this part, but for the nearest.
    let lost = 0.99 * (1.0 - APPROACH) * (1.0 - LEFT);
    if APPROACH * distance > NEAREST { lost * distance } else { 0.0 }
}

/// Distance that a pair keeps in one move towards each other, from the one it has, within a radius [m].
pub(super) fn kept(distance: f64, radius: f64) -> f64 {
    (APPROACH * distance.min(radius)).max(BARELY * distance.min(NEAREST))
}

/// Distance at which two features count as having met when we ask only whether they did [m].
/// tuned: above the rounding of positions within a kilometre, far below any thickness
const TOUCH: f64 = 1e-9;

/// Steps after which the time reached counts as the time of impact. tuned: a dozen is usual
const STEPS: usize = 1000;

/// Two features that meet on their way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// What meets what.
    pub kind: Kind,
    /// Node and triangle, or edge and edge, in the numbers of the surface.
    pub features: [u32; 2],
    /// Nodes of the first feature, then of the second.
    pub nodes: [u32; 4],
    /// Time of impact, as a share of the way, 0 to 1: never late.
    pub time: f64,
    /// Share of each node in the closest points then: those of the first feature add up to 1, of the second to -1.
    pub weights: [f64; 4],
    /// Distance of the closest points then [m].
    pub distance: f64,
    /// Unit vector from the second feature to the first then; zero where they touch.
    pub normal: DVec3,
}

/// What counts as an impact.
#[derive(Debug, Clone, Copy)]
pub(super) enum Goal {
    /// To keep a separation [m]. A pair that starts closer may halve its distance.
    Keep(f64),
    /// To keep what is [`kept`] of the distance, or of this one [m] where that is less.
    Approach(f64),
    /// To tell whether two features touch at all.
    Tell,
}

impl Goal {
    /// Distance that is never gone below on the way to the impact, and how much above it is close enough [m].
    fn floor(self, distance: f64) -> (f64, f64) {
        let least = match self {
            Self::Keep(separation) if distance > separation => separation,
            Self::Keep(_) => 0.5 * distance,
            Self::Approach(radius) => kept(distance, radius),
            Self::Tell => return (TOUCH, LEFT * TOUCH),
        };
        let left = LEFT * (distance - least).min(least.max(LEAST_GAP));
        (least + left, LEFT * left)
    }
}

impl Goal {
    /// Distance that no pair comes down to without an impact being looked for [m].
    pub(super) fn reach(self) -> f64 {
        let least = match self {
            Self::Keep(separation) => separation,
            Self::Approach(radius) => kept(radius, radius),
            Self::Tell => return (1.0 + LEFT) * TOUCH,
        };
        least + (1.0 + LEFT) * LEFT * least.max(LEAST_GAP)
    }
}

/// Whether the nodes of the two features are apart all the way as seen along the line through their middles, by more than any
/// impact leaves them: on straight paths they are if they are at both ends. Costs a tenth of what the time of impact does.
pub(super) fn stay_apart(kind: Kind, before: &[DVec3; 4], after: &[DVec3; 4], goal: Goal) -> bool {
    let first = match kind {
        Kind::VertexFace => 1,
        Kind::EdgeEdge => 2,
    };
    let twice = |k: usize| before[k] + after[k];
    let axis = match kind {
        Kind::VertexFace => twice(0) - (twice(1) + twice(2) + twice(3)) / 3.0,
        Kind::EdgeEdge => (twice(0) + twice(1)) - (twice(2) + twice(3)),
    };
    let apart = |x: &[DVec3; 4]| {
        let along: [f64; 4] = std::array::from_fn(|k| axis.dot(x[k] - x[0]));
        let lowest = along[..first].iter().copied().fold(f64::INFINITY, f64::min);
        lowest - along[first..].iter().copied().fold(f64::NEG_INFINITY, f64::max)
    };
    let apart = apart(before).min(apart(after));
    // A thousandth more, for rounding.
    let reach = 1.001 * goal.reach();
    apart > 0.0 && apart * apart > reach * reach * axis.length_squared()
}

/// Whether a pair cannot lose so much of its distance that it counts as an approach, by the distance [m] that each of its
/// nodes keeps from anything at the start: that of the pair is no less.
pub(super) fn cannot_approach(kind: Kind, clearance: [f64; 4], before: [DVec3; 4], after: [DVec3; 4]) -> bool {
    let least = clearance.into_iter().fold(0.0, f64::max);
    fastest(kind, &std::array::from_fn(|k| after[k] - before[k])) <= idle(least)
}

/// Greatest relative motion of two nodes of different features, which bounds that of any two points [m].
fn fastest(kind: Kind, motion: &[DVec3; 4]) -> f64 {
    let relative = |[i, j]: &[usize; 2]| (motion[*i] - motion[*j]).length_squared();
    across(kind).iter().map(relative).fold(0.0, f64::max).sqrt()
}

/// Pairs of nodes of different features.
fn across(kind: Kind) -> &'static [[usize; 2]] {
    match kind {
        Kind::VertexFace => &[[0, 1], [0, 2], [0, 3]],
        Kind::EdgeEdge => &[[0, 2], [0, 3], [1, 2], [1, 3]],
    }
}

/// When a pair first meets, if it does before `last`, as share of the way; with the closest points then.
pub(super) fn time_of_impact(
    kind: Kind,
    before: [DVec3; 4],
    after: [DVec3; 4],
    goal: Goal,
    last: f64,
) -> Option<(f64, DVec3, [f64; 4])> {
    let motion: [DVec3; 4] = std::array::from_fn(|k| after[k] - before[k]);
    let speed = fastest(kind, &motion);
    let closest = |x: [DVec3; 4]| match kind {
        Kind::VertexFace => {
            let closest = vertex_triangle(x[0], [x[1], x[2], x[3]]);
            (closest.offset, closest.weights)
        }
        Kind::EdgeEdge => {
            let ends = ([x[0], x[1]], [x[2], x[3]]);
            edge_edge(ends.0, ends.1, f64::INFINITY).map_or((DVec3::ZERO, [0.0; 4]), |c| (c.offset, c.weights))
        }
    };
    let mut time = 0.0;
    let (mut offset, mut weights) = closest(before);
    let (floor, slack) = goal.floor(offset.length());
    for _ in 0..STEPS {
        let distance = offset.length();
        let gap = distance - floor;
        if gap <= slack || gap.is_nan() {
            return Some((time, offset, weights));
        }
        let normal = offset / distance;
        let mut along = f64::INFINITY;
        for [i, j] in across(kind) {
            let relative = motion[*i] - motion[*j];
            let apart = normal.dot((before[*i] - before[*j]) + time * relative);
            let rate = normal.dot(relative);
            if apart < floor {
                // The normal is mostly rounding: it shows no separation.
                along = 0.0;
            } else if rate < 0.0 {
                along = along.min((floor - apart) / rate);
            }
        }
        time += (gap / speed).max(along);
        if time >= last {
            return None;
        }
        (offset, weights) = closest(std::array::from_fn(|k| before[k] + time * motion[k]));
    }
    Some((time, offset, weights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn at(before: &[DVec3; 4], after: &[DVec3; 4], time: f64) -> [DVec3; 4] {
        std::array::from_fn(|k| before[k] + time * (after[k] - before[k]))
    }

    fn distance(kind: Kind, x: [DVec3; 4]) -> f64 {
        match kind {
            Kind::VertexFace => vertex_triangle(x[0], [x[1], x[2], x[3]]).offset.length(),
            Kind::EdgeEdge => edge_edge([x[0], x[1]], [x[2], x[3]], f64::INFINITY).unwrap().offset.length(),
        }
    }

    /// Paths through a common point at a random time: every one of these pairs meets.
    fn meeting(random: &mut Random, kind: Kind) -> ([DVec3; 4], [DVec3; 4]) {
        let size = 10.0f64.powf(-3.0 * random.uniform());
        // Edges of a fine mesh of paper.
        let mut point = || 1.6e-3 * DVec3::new(random.normal(), random.normal(), random.normal());
        let (mut x, motion): ([DVec3; 4], [DVec3; 4]) = ([0; 4].map(|_| point()), [0; 4].map(|_| size * point()));
        let (r, s, time) = (random.uniform(), random.uniform(), random.uniform());
        // Moves the last node so that the closest points coincide.
        match kind {
            Kind::VertexFace => {
                let s = s * (1.0 - r);
                x[0] = x[1] + r * (x[2] - x[1]) + s * (x[3] - x[1]);
            }
            Kind::EdgeEdge => {
                let there = x[2] + r * (x[3] - x[2]);
                x[1] = x[0] + (there - x[0]) / s.max(0.01);
            }
        }
        let place = |share: f64| std::array::from_fn(|k| x[k] + share * motion[k]);
        (place(-time), place(1.0 - time))
    }

    #[test]
    fn no_impact_is_missed_in_a_million() {
        let mut random = Random::new(3, 1);
        let mut early = 0;
        for round in 0..1_000_000 {
            let kind = if round % 2 == 0 { Kind::VertexFace } else { Kind::EdgeEdge };
            let (before, after) = meeting(&mut random, kind);
            let start = distance(kind, before);
            let Some((time, offset, _)) = time_of_impact(kind, before, after, Goal::Keep(0.0), 1.0) else {
                panic!("missed: {kind:?} {before:?} {after:?}");
            };
            assert!(!stay_apart(kind, &before, &after, Goal::Keep(0.0)), "{kind:?} {before:?} {after:?}");
            // What is left is what was promised, and it was never less on the way.
            let (floor, slack) = Goal::Keep(0.0).floor(start);
            assert!(offset.length() >= 0.9999 * floor - 1e-13, "{kind:?} {before:?} {after:?}");
            early += (offset.length() > 1.0001 * (floor + slack) + 1e-13) as u32;
            if round % 50 == 0 {
                for k in 0..=100 {
                    assert!(distance(kind, at(&before, &after, time * k as f64 / 100.0)) >= 0.9999 * floor - 1e-13);
                }
            }
            let told = time_of_impact(kind, before, after, Goal::Tell, 1.0);
            assert!(told.is_some(), "not told: {kind:?} {before:?} {after:?}");
        }
        // Out of steps, which is safe: features that turn about each other a thousand times closer than they move.
        assert!(early < 2000, "{early}");
    }

    #[test]
    fn impacts_are_those_of_a_finely_sampled_motion() {
        let mut random = Random::new(4, 1);
        let (mut hits, mut apart, mut most) = (0, 0, 0.0f64);
        for round in 0..20_000 {
            let kind = if round % 2 == 0 { Kind::VertexFace } else { Kind::EdgeEdge };
            let mut points = || [0; 4].map(|_| DVec3::new(random.uniform(), random.uniform(), random.uniform()));
            let (before, after) = (points(), points());
            let separation = 0.02;
            let start = distance(kind, before);
            let (floor, slack) = Goal::Keep(separation).floor(start);
            let speed = (0..4).map(|k| (after[k] - before[k]).length()).fold(0.0, f64::max);
            // First sample below the floor; a sample is at most half a spacing from the lowest point.
            let samples = 2000;
            let below = |d: f64| {
                (0..=samples).map(|k| k as f64 / samples as f64).find(|t| distance(kind, at(&before, &after, *t)) < d)
            };
            let found = time_of_impact(kind, before, after, Goal::Keep(separation), 1.0).map(|(time, _, _)| time);
            let seen_apart = stay_apart(kind, &before, &after, Goal::Keep(separation));
            assert!(!(seen_apart && found.is_some()), "{kind:?} {before:?} {after:?}");
            apart += seen_apart as u32;
            if let Some(sampled) = below(floor) {
                hits += 1;
                let time = found.expect("missed");
                assert!(time <= sampled);
                // Never early either: at that time the pair is within the slack of the floor.
                let left = distance(kind, at(&before, &after, time));
                assert!(left >= floor * (1.0 - 1e-12) && left <= (floor + slack) * (1.0 + 1e-12));
                most = most.max(sampled - time);
            } else if found.is_some() {
                // Between two samples, or within the slack of the floor.
                assert!(below(floor + slack + speed / samples as f64).is_some());
            }
        }
        assert!(hits > 3000, "{hits}");
        assert!(apart > 3000, "{apart}");
    }

    #[test]
    fn sliding_past_takes_few_steps_and_standing_still_none() {
        // A vertex 0.02 mm above a face, sliding over it by a hundred edges.
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| 1.6e-3 * p);
        let p = DVec3::new(-0.08, 4e-4, 2e-5);
        let before = [p, face[0], face[1], face[2]];
        let mut after = before;
        assert!(time_of_impact(Kind::VertexFace, before, after, Goal::Keep(9e-6), 1.0).is_none());
        after[0].x += 0.16;
        assert!(time_of_impact(Kind::VertexFace, before, after, Goal::Keep(9e-6), 1.0).is_none());
        after[0].z = -2e-5;
        assert!(time_of_impact(Kind::VertexFace, before, after, Goal::Keep(9e-6), 1.0).is_some());
    }
}
