//! The fixed-topology twin of a run: the same points and triangles in all frames, for formats and engines that cannot
//! take others.
//!
//! It follows every triangle that lives in the first frame. Nodes that a tear will split are separate points from the
//! beginning; until then they go the same way. A triangle that is cut from the surface lets go of those that live on,
//! and folds up into one of its corners, so that it cannot be seen even where nobody asks whether it is alive. Whole
//! handfuls of triangles around a node that go in the same frame fold up into that node, which takes far fewer points
//! than three a triangle.

use super::sequence::Sequence;
use crate::error::IoError;
use charcloth::frame::Frame;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// A frame that never comes.
const NEVER: u32 = u32::MAX;

/// The points and triangles that are the same in all frames.
#[derive(Debug)]
pub(super) struct Twin {
    /// Points of each face.
    pub faces: Vec<[u32; 3]>,
    /// Row of each face in the triangle table.
    pub rows: Vec<u32>,
    points: Vec<Point>,
}

/// A corner of a triangle, by their rows.
type Corner = (u32, usize);

#[derive(Debug, Clone, Copy)]
struct Point {
    /// A corner that has the point; the table of triangles knows its node in every frame.
    corner: Corner,
    /// Corner that the point folds up into once it is dead.
    fold: Corner,
    /// First frame in which the point is dead.
    dies: u32,
}

/// The points of a twin in a frame.
#[derive(Debug)]
pub(super) struct Pose {
    /// Node at each point.
    pub nodes: Vec<u32>,
    /// Whether each point belongs to the living surface.
    pub alive: Vec<bool>,
    /// Place of each point [m]; dead ones are folded up.
    pub positions: Vec<Vec3>,
    /// Unit normal of each point.
    pub normals: Vec<Vec3>,
}

impl Twin {
    /// The twin of the frames of a sequence. The last frame tells all splits, for nodes are only ever added and the
    /// corners of a triangle change with a split only.
    pub fn of(sequence: &Sequence<'_>, path: &Path) -> Result<Self, IoError> {
        let first = sequence.first()?;
        let rows: Vec<u32> =
            (0..first.triangles.len() as u32).filter(|t| first.triangles.alive[*t as usize] != 0).collect();
        if rows.is_empty() {
            let hint = "begin at an earlier frame with --frames";
            return Err(IoError::content(path, "the first frame has no living face that could be followed", hint));
        }
        sequence.refuse_gaps(path)?;
        let mut dies = vec![NEVER; first.triangles.len()];
        for number in sequence.numbers() {
            for (dies, alive) in dies.iter_mut().zip(sequence.triangles_alive(*number)?) {
                if alive == 0 && *dies == NEVER {
                    *dies = *number;
                }
            }
        }
        let last = sequence.last()?;
        if last.triangles.len() < first.triangles.len() {
            let problem = "the last frame has fewer triangles than the first";
            return Err(IoError::content(path, problem, "they are of different runs: run the scene again"));
        }
        Ok(Self::build(rows, &dies, &last.triangles.corners))
    }

    /// The twin of triangles with the frame in which each dies and their corners in the end.
    fn build(rows: Vec<u32>, dies: &[u32], corners: &[[u32; 3]]) -> Self {
        let folds = folds(&rows, dies, corners);
        let mut numbers: HashMap<(u32, Option<Corner>), u32> = HashMap::new();
        let mut points = Vec::new();
        let mut faces = Vec::with_capacity(rows.len());
        for t in &rows {
            let fold = folds[*t as usize];
            faces.push(std::array::from_fn(|k| {
                let corner = (*t, k);
                *numbers.entry((corners[*t as usize][k], fold)).or_insert_with(|| {
                    points.push(Point { corner, fold: fold.unwrap_or(corner), dies: dies[*t as usize] });
                    points.len() as u32 - 1
                })
            }));
        }
        Self { faces, rows, points }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Where the points are in a frame.
    pub fn pose(&self, frame: &Frame) -> Pose {
        let node = |(t, k): Corner| frame.triangles.corners[t as usize][k];
        let normals = frame.normals();
        let nodes: Vec<u32> = self.points.iter().map(|point| node(point.corner)).collect();
        let alive: Vec<bool> = self.points.iter().map(|point| frame.number < point.dies).collect();
        let place = |point: &Point, alive: bool| -> DVec3 {
            frame.motion.position[node(if alive { point.corner } else { point.fold }) as usize]
        };
        Pose {
            positions: self.points.iter().zip(&alive).map(|(point, alive)| place(point, *alive).as_vec3()).collect(),
            normals: nodes.iter().map(|i| normals[*i as usize].as_vec3().normalize_or(Vec3::Z)).collect(),
            nodes,
            alive,
        }
    }
}

/// For each triangle that dies, the corner it folds up into. Triangles that go in the same frame and share a node fold
/// up into it together, as long as none of them has another: the most of them first, in the order of the rows.
fn folds(rows: &[u32], dies: &[u32], corners: &[[u32; 3]]) -> Vec<Option<Corner>> {
    let mut around: HashMap<(u32, u32), Vec<Corner>> = HashMap::new();
    for t in rows {
        for (k, node) in corners[*t as usize].iter().enumerate() {
            if dies[*t as usize] != NEVER {
                around.entry((*node, dies[*t as usize])).or_default().push((*t, k));
            }
        }
    }
    let mut folds: Vec<Option<Corner>> = vec![None; corners.len()];
    for t in rows {
        let frame = dies[*t as usize];
        if frame == NEVER || folds[*t as usize].is_some() {
            continue;
        }
        let free = |node: u32| around[&(node, frame)].iter().filter(|(other, _)| folds[*other as usize].is_none());
        let [a, b, c] = corners[*t as usize];
        // Of equals the first corner.
        let node = [c, b, a].into_iter().max_by_key(|node| free(*node).count()).unwrap_or(a);
        let together: Vec<Corner> = free(node).copied().collect();
        for (other, _) in &together {
            folds[*other as usize] = Some(together[0]);
        }
    }
    folds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_are_there_from_the_start_and_the_dead_fold_up() {
        // A strip of four triangles; the nodes 2 and 3 are split into 6 and 7 by the end, and the last triangle dies.
        let corners = [[0, 1, 2], [1, 3, 2], [6, 7, 4], [7, 5, 4]];
        let twin = Twin::build(vec![0, 1, 2, 3], &[NEVER, NEVER, NEVER, 8], &corners);
        assert_eq!(twin.faces[..2], [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(twin.faces[2..], [[4, 5, 6], [7, 8, 9]]);
        assert_eq!(twin.len(), 10);

        let mut frame = Frame { number: 3, ..Frame::default() };
        frame.motion = charcloth::sheet::MotionNodes::zeros(6);
        for i in 0..6 {
            frame.motion.position[i] = DVec3::new((i / 2) as f64, (i % 2) as f64, 0.0);
        }
        frame.triangles = charcloth::sheet::Triangles::zeros(4);
        frame.triangles.corners = vec![[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]];
        let before = twin.pose(&frame);
        assert_eq!(before.nodes, [0, 1, 2, 3, 2, 3, 4, 3, 5, 4], "copies that are not there yet follow their origin");
        assert!(before.alive.iter().all(|alive| *alive));

        frame.number = 8;
        let after = twin.pose(&frame);
        assert_eq!(after.alive, [true, true, true, true, true, true, true, false, false, false]);
        assert!(after.positions[7..].iter().all(|p| *p == after.positions[7]), "{:?}", after.positions);
    }

    #[test]
    fn triangles_around_a_node_that_die_together_share_their_points() {
        // A fan of five triangles around node 0.
        let corners: Vec<[u32; 3]> = (1..6).map(|i| [0, i, i + 1]).collect();
        let twin = Twin::build((0..5).collect(), &[4; 5], &corners);
        assert_eq!(twin.len(), 7);
        assert!(twin.points.iter().all(|point| point.fold == (0, 0)));
    }
}
