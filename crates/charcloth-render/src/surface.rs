//! What is drawn, gathered from a frame: checked, in single precision, with the fields that only pictures need.

use crate::error::RenderError;
use crate::glow::black_body;
use charcloth::frame::{Frame, node_normals};
use glam::{DVec3, Vec3};

/// Temperatures at which paper first looks tan and at which it is dark brown [K], where it catches fire at a temperature, and
/// where it breaks down at a rate: what is heated in seconds browns later than what is baked.
pub const SCORCH: [f64; 2] = [480.0, 620.0];
const SCORCH_BY_RATE: [f64; 2] = [500.0, 780.0]; // tuned: copper to black ahead of flames; 480 to 520, 700 to 850
/// How far scorch is spread over the sheet for the picture [m]. The heat of the model runs ahead of the fire by 1 to 2 mm,
/// less than a triangle; smoke and tar stain real paper farther than that.
/// tuned: 2 to 8 mm.
const SCORCH_SPREAD: f64 = 0.004;
/// How burnt a sheet looks that is all char and no ash.
const ALL_CHAR: f64 = 0.6; // tuned: black, no holes yet; 0.45 to 0.65
/// Area of full fire that shines on what is around like a flame that is fed a kilogram of gas a second [m2 s/kg].
const LIGHT_OF_FLAMES: f64 = 18.0; // tuned: sheet in full fire gives off 25 g/(m2 s); 10 to 100
/// Area of full fire that shines like that area of a black body whose red light is 1.
const LIGHT_OF_GLOW: f64 = 0.05; // tuned: a rim lights little beside a flame; 0.02 to 0.2

/// Fuel burnt at which a node on a cut edge counts as burnt away, so that the ragged line runs inside the cut.
/// tuned: 0.4 to 0.8.
const EDGE_BURNT: f32 = 0.5;
/// What `gone` is there: the visible edge then runs about half a triangle inside the cut, where noise can shape it.
/// tuned: 1.2 to 2.
const EDGE_GONE: f32 = 1.6;

/// What a picture needs of a node.
#[derive(Debug, Clone, Copy, Default)]
pub struct Node {
    /// Where it is, from the camera's target [m].
    pub position: Vec3,
    /// Area-weighted unit normal on the anticlockwise side.
    pub normal: Vec3,
    /// Where it is in the stress-free sheet [m].
    pub rest: Vec3,
    /// Temperature [K].
    pub temperature: f32,
    /// 0 for white paper, 1 where it is as dark as scorch gets; more where it burnt.
    pub scorch: f32,
    /// Part of the fuel that is gone.
    pub burnt: f32,
    /// `burnt`, raised over 1 along edges that burning has cut, so that the visible edge runs inside the cut.
    pub gone: f32,
    /// Slopes of `scorch` and `gone` in the stress-free sheet [1/m].
    pub slopes: [Vec3; 2],
    /// Burn rate as a part of the full one; 0 in models without one.
    pub glow: f32,
    /// Area of full fire that lights its surroundings as much [m2].
    pub glow_area: f32,
    /// Part that has turned to char.
    pub charred: f32,
    /// Part of the char that has gone.
    pub ashed: f32,
    /// Whether it breaks down at a rate by its temperature, and so glows by that.
    pub by_rate: bool,
}

/// The surface of one frame.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Positions in full precision, for the camera.
    pub position: Vec<DVec3>,
    /// Nodes, by id.
    pub nodes: Vec<Node>,
    /// Corners of the triangles that are there.
    pub triangles: Vec<[u32; 3]>,
    /// Mean length of an edge at rest [m].
    pub spacing: f64,
    scorch_before: Vec<f32>,
    sums: Vec<(f32, f32)>,
    slope_sums: Vec<([Vec3; 2], f32)>,
}

impl Surface {
    /// Checks a frame and takes what is seen of it; positions count from `target`.
    pub fn gather(&mut self, frame: &Frame, target: DVec3) -> Result<(), RenderError> {
        check(frame)?;
        let normals = node_normals(&frame.motion.position, &frame.triangles);
        self.position.clear();
        self.position.extend_from_slice(&frame.motion.position);
        self.nodes.clear();
        self.nodes.extend((0..frame.motion.len()).map(|i| {
            let burn = &frame.burn;
            let part = |value: f64, whole: f64| if whole > 0.0 { (value / whole).clamp(0.0, 1.0) as f32 } else { 0.0 };
            // A model without a full rate tells char from ash and flame from glow, which follows from the temperature.
            let by_rate = burn.burn_rate_full[i] <= 0.0;
            let (burnt, glow, shines) = if by_rate {
                let glow = f64::from(black_body(burn.temperature[i] as f32).x) * burn.area[i] * LIGHT_OF_GLOW;
                let flame = if burn.flame[i] > 0.0 { burn.burn_rate[i] * LIGHT_OF_FLAMES } else { 0.0 };
                let burnt = ALL_CHAR * burn.charred[i] + (1.0 - ALL_CHAR) * burn.ashed[i];
                (burnt as f32, 0.0, (glow + flame) as f32)
            } else {
                let left = part(burn.fuel[i], burn.fuel_initial[i]);
                let glow = part(burn.burn_rate[i], burn.burn_rate_full[i]);
                let burnt = if burn.fuel_initial[i] > 0.0 { 1.0 - left } else { 0.0 };
                (burnt, glow, glow * burn.area[i] as f32)
            };
            let [tan, brown] = if by_rate { SCORCH_BY_RATE } else { SCORCH };
            Node {
                position: (frame.motion.position[i] - target).as_vec3(),
                normal: normals[i].as_vec3(),
                rest: frame.motion.rest_position[i].as_vec3(),
                temperature: burn.temperature[i] as f32,
                scorch: ((burn.peak_temperature[i] - tan) / (brown - tan)).clamp(-0.25, 1.4) as f32,
                burnt,
                gone: burnt,
                slopes: [Vec3::ZERO; 2],
                glow,
                glow_area: shines,
                charred: if by_rate { burn.charred[i] as f32 } else { burnt / ALL_CHAR as f32 },
                ashed: if by_rate { burn.ashed[i] as f32 } else { 0.0 },
                by_rate,
            }
        }));
        self.triangles.clear();
        let triangles = &frame.triangles;
        self.triangles.extend((0..triangles.len()).filter(|t| triangles.alive[*t] == 1).map(|t| triangles.corners[t]));
        self.spacing = spacing(&frame.motion.rest_position, &self.triangles);
        self.mark_cut_edges(frame);
        self.spread_scorch();
        self.soften_cut_edges();
        self.find_slopes();
        Ok(())
    }

    /// Raises `gone` where a node has lost a triangle to the fire.
    fn mark_cut_edges(&mut self, frame: &Frame) {
        for (t, corners) in frame.triangles.corners.iter().enumerate() {
            if frame.triangles.alive[t] == 0 {
                for i in corners {
                    let node = &mut self.nodes[*i as usize];
                    if node.burnt > EDGE_BURNT {
                        node.gone = EDGE_GONE;
                    }
                }
            }
        }
    }

    /// Lets scorch run out over `SCORCH_SPREAD`, whatever the size of the triangles: repeated means over neighbours walk
    /// a distance of about the spacing times the root of their number.
    fn spread_scorch(&mut self) {
        let steps = (SCORCH_SPREAD / self.spacing).powi(2) * 2.0;
        let rounds = steps.ceil().clamp(1.0, 24.0);
        let share = (steps / rounds).min(1.0) as f32;
        for _ in 0..rounds as usize {
            self.scorch_before.clear();
            self.scorch_before.extend(self.nodes.iter().map(|n| n.scorch));
            self.sums.clear();
            self.sums.resize(self.nodes.len(), (0.0, 0.0));
            for corners in &self.triangles {
                let values = corners.map(|i| self.scorch_before[i as usize]);
                let sum = values[0] + values[1] + values[2];
                for k in 0..3 {
                    let entry = &mut self.sums[corners[k] as usize];
                    entry.0 += sum - values[k];
                    entry.1 += 2.0;
                }
            }
            for (node, (sum, weight)) in self.nodes.iter_mut().zip(&self.sums) {
                if *weight > 0.0 {
                    node.scorch += share * (sum / weight - node.scorch);
                }
            }
        }
    }

    /// Lets `gone` fall off over two triangles instead of one, so that noise can move the visible edge by more.
    fn soften_cut_edges(&mut self) {
        self.sums.clear();
        self.sums.resize(self.nodes.len(), (0.0, 0.0));
        for corners in &self.triangles {
            let values = corners.map(|i| self.nodes[i as usize].gone);
            for k in 0..3 {
                let entry = &mut self.sums[corners[k] as usize];
                entry.0 += values[0] + values[1] + values[2] - values[k];
                entry.1 += 2.0;
            }
        }
        for (node, (sum, weight)) in self.nodes.iter_mut().zip(&self.sums) {
            if *weight > 0.0 && node.gone < EDGE_GONE {
                node.gone = node.gone.max(0.6 * node.gone + 0.4 * sum / weight);
            }
        }
    }

    /// Slopes of the fields that are drawn finer than the mesh: area-weighted means over the triangles of a node.
    fn find_slopes(&mut self) {
        self.slope_sums.clear();
        self.slope_sums.resize(self.nodes.len(), ([Vec3::ZERO; 2], 0.0));
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|i| &self.nodes[i as usize]);
            let normal = (b.rest - a.rest).cross(c.rest - a.rest);
            let twice_area = normal.length();
            if twice_area <= 0.0 {
                continue;
            }
            // Gradient of a linear field, times twice the area.
            let unit = normal / twice_area;
            let arms = [c.rest - b.rest, a.rest - c.rest, b.rest - a.rest].map(|side| unit.cross(side));
            let slopes = [[a.scorch, b.scorch, c.scorch], [a.gone, b.gone, c.gone]]
                .map(|values| arms[0] * values[0] + arms[1] * values[1] + arms[2] * values[2]);
            for i in corners {
                let (sums, weight) = &mut self.slope_sums[*i as usize];
                sums[0] += slopes[0];
                sums[1] += slopes[1];
                *weight += twice_area;
            }
        }
        for (node, (sums, weight)) in self.nodes.iter_mut().zip(&self.slope_sums) {
            if *weight > 0.0 {
                node.slopes = sums.map(|sum| sum / *weight);
            }
        }
    }

    /// `scorch` and `gone` at a point, curved by the slopes at the corners: exact for quadratic fields, so that the
    /// kinks of linear mixing, which show every triangle, are gone.
    #[inline]
    pub fn curved(&self, triangle: usize, weights: [f32; 3], rest: Vec3) -> [f32; 2] {
        let mut sums = [0.0; 2];
        for (i, weight) in self.triangles[triangle].iter().zip(weights) {
            let node = &self.nodes[*i as usize];
            let way = (rest - node.rest) * 0.5;
            sums[0] += weight * (node.scorch + node.slopes[0].dot(way));
            sums[1] += weight * (node.gone + node.slopes[1].dot(way));
        }
        sums
    }

    /// Mixes a value of the three corners of a triangle.
    #[inline]
    pub fn mix(&self, triangle: usize, weights: [f32; 3], value: impl Fn(&Node) -> f32) -> f32 {
        let corners = self.triangles[triangle].map(|i| &self.nodes[i as usize]);
        value(corners[0]) * weights[0] + value(corners[1]) * weights[1] + value(corners[2]) * weights[2]
    }
}

fn spacing(rest: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let total: f64 = triangles.iter().map(|[a, b, _]| rest[*a as usize].distance(rest[*b as usize])).sum();
    if total > 0.0 { total / triangles.len() as f64 } else { 1.0 }
}

/// Whether the tables of a frame fit together and hold finite numbers.
fn check(frame: &Frame) -> Result<(), RenderError> {
    let number = frame.number;
    let count = frame.motion.len();
    if count == 0 {
        return Err(RenderError::EmptyFrame { number });
    }
    let broken = |problem: String| Err(RenderError::BrokenFrame { number, problem });
    let tables = [
        ("motion", frame.motion.columns(), count),
        ("burn", frame.burn.columns(), count),
        ("triangles", frame.triangles.columns(), frame.triangles.corners.len()),
    ];
    for (table, columns, rows) in tables {
        for column in columns {
            if column.data.len() != rows {
                return broken(format!("{table}.{} has {} rows instead of {rows}", column.name, column.data.len()));
            }
        }
    }
    for (t, corners) in frame.triangles.corners.iter().enumerate() {
        if let Some(node) = corners.iter().find(|i| **i as usize >= count) {
            return broken(format!("triangle {t} has node {node}, but there are only {count} nodes"));
        }
    }
    for (field, values) in [("position", &frame.motion.position), ("rest_position", &frame.motion.rest_position)] {
        if let Some(node) = values.iter().position(|value| !value.is_finite()) {
            return Err(RenderError::NotFinite { field, node, number });
        }
    }
    let burn = &frame.burn;
    for (field, values) in [
        ("temperature", &burn.temperature),
        ("peak_temperature", &burn.peak_temperature),
        ("fuel", &burn.fuel),
        ("fuel_initial", &burn.fuel_initial),
        ("burn_rate", &burn.burn_rate),
        ("burn_rate_full", &burn.burn_rate_full),
        ("area", &burn.area),
    ] {
        if let Some(node) = values.iter().position(|value| !value.is_finite()) {
            return Err(RenderError::NotFinite { field, node, number });
        }
    }
    Ok(())
}
