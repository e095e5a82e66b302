//! Light: a key light with a shadow map, a sky, and the glow of the fire on the sheet around it.

use crate::camera::Camera;
use crate::props::Props;
use crate::surface::Surface;
use charcloth::noise::noise;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Side of the shadow map [texels].
const MAP_SIDE: usize = 448;
/// Rows of the map that are drawn together.
const BAND: usize = 64;
/// Most lamps that stand for the fire.
const MOST_LAMPS: usize = 48;

/// Distance from the key light of what it sees first.
#[derive(Debug, Clone)]
pub struct KeyLight {
    /// Unit vector to the light.
    pub direction: Vec3,
    across: Vec3,
    along: Vec3,
    /// Half the side of the map [m].
    reach: f32,
    /// Height towards the light, over the camera's target [m].
    height: Vec<f32>,
    /// Part of the key light that reaches each node, on the side that faces it.
    pub on_node: Vec<f32>,
}

impl KeyLight {
    /// A light over the camera's left shoulder.
    pub fn build(camera: &Camera) -> Self {
        // tuned: raking enough that bends of a few degrees show, and never from behind the sheet the camera faces.
        let direction = (camera.up * 0.70 - camera.right * 0.85 - camera.forward * 0.50).normalize();
        let across = direction.any_orthonormal_vector();
        Self {
            direction: direction.as_vec3(),
            across: across.as_vec3(),
            along: direction.cross(across).as_vec3(),
            reach: camera.radius as f32 * 1.3,
            height: vec![f32::NEG_INFINITY; MAP_SIDE * MAP_SIDE],
            on_node: Vec::new(),
        }
    }

    fn to_map(&self, position: Vec3) -> Vec3 {
        let scale = MAP_SIDE as f32 / 2.0 / self.reach;
        let half = MAP_SIDE as f32 / 2.0;
        Vec3::new(
            position.dot(self.across) * scale + half,
            position.dot(self.along) * scale + half,
            position.dot(self.direction),
        )
    }

    /// Draws the map of a surface and of solid props, and reads it at every node: shadows on a sheet are soft and wide, so
    /// that is enough.
    pub fn look_at(&mut self, surface: &Surface, props: &Props) {
        let mut height = std::mem::take(&mut self.height);
        let points: Vec<Vec3> = surface.nodes.par_iter().map(|node| self.to_map(node.position)).collect();
        let solid: Vec<Vec3> = props.position.iter().map(|position| self.to_map(*position)).collect();
        height.par_chunks_mut(MAP_SIDE * BAND).enumerate().for_each(|(band, rows)| {
            rows.fill(f32::NEG_INFINITY);
            let top = (band * BAND) as f32;
            let sheet = surface.triangles.iter().map(|corners| corners.map(|i| points[i as usize]));
            let solids = props.triangles[props.flat..].iter().map(|corners| corners.map(|i| solid[i as usize]));
            for [a, b, c] in sheet.chain(solids) {
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                let area = (b - a).truncate().perp_dot((c - a).truncate());
                if high.y < top || low.y >= top + BAND as f32 || high.x < 0.0 || area.abs() < 1e-9 {
                    continue;
                }
                let first_row = (low.y - top).floor().max(0.0) as usize;
                let last_row = ((high.y - top).ceil() as usize).min(BAND - 1).min(rows.len() / MAP_SIDE - 1);
                let first = low.x.floor().max(0.0) as usize;
                let last = (high.x.ceil() as usize).min(MAP_SIDE - 1);
                for row in first_row..=last_row {
                    for column in first..=last {
                        let p = glam::Vec2::new(column as f32 + 0.5, row as f32 + top + 0.5);
                        let wa = (b.truncate() - p).perp_dot(c.truncate() - p) / area;
                        let wb = (c.truncate() - p).perp_dot(a.truncate() - p) / area;
                        let wc = 1.0 - wa - wb;
                        if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                            let cell = &mut rows[row * MAP_SIDE + column];
                            *cell = cell.max(wa * a.z + wb * b.z + wc * c.z);
                        }
                    }
                }
            }
        });
        self.height = height;
        let mut on_node = std::mem::take(&mut self.on_node);
        surface
            .nodes
            .par_iter()
            .map(|node| {
                let lit_side = if node.normal.dot(self.direction) > 0.0 { node.normal } else { -node.normal };
                self.reaches(node.position, lit_side)
            })
            .collect_into_vec(&mut on_node);
        self.on_node = on_node;
    }

    /// Part of the key light that reaches a point; `normal` is on the lit side.
    pub fn reaches(&self, position: Vec3, normal: Vec3) -> f32 {
        let texel = 2.0 * self.reach / MAP_SIDE as f32;
        const TAPS: i32 = 2;
        const SHARE: f32 = 1.0 / ((2 * TAPS + 1) * (2 * TAPS + 1)) as f32;
        // Pushed off the surface, so that a slope does not shade itself.
        let p = self.to_map(position + normal * (texel * 1.5));
        let bias = texel * 2.0;
        let mut lit = 0.0;
        for dy in -TAPS..=TAPS {
            for dx in -TAPS..=TAPS {
                let (x, y) = (p.x + dx as f32 * 1.4, p.y + dy as f32 * 1.4);
                let outside = x < 0.0 || y < 0.0 || x >= MAP_SIDE as f32 || y >= MAP_SIDE as f32;
                if outside || self.height[y as usize * MAP_SIDE + x as usize] - p.z < bias {
                    lit += SHARE;
                }
            }
        }
        lit
    }
}

/// Light of the fire on each node, or anywhere: glowing nodes are gathered into a few lamps, a little off the sheet.
#[derive(Debug, Clone, Default)]
pub struct FireLight {
    /// Light that falls on a node, times what one square centimetre of full fire gives at one centimetre.
    pub on_node: Vec<f32>,
    /// Places and powers.
    lamps: Vec<(Vec3, f32)>,
}

impl FireLight {
    /// Finds the lamps and lights every node; the flicker is a function of place and time.
    pub fn look_at(&mut self, surface: &Surface, up: Vec3, time: f64) {
        let mut cell = 0.008_f32;
        let lamps = loop {
            let mut cells: BTreeMap<[i32; 3], (Vec3, f32)> = BTreeMap::new();
            for node in surface.nodes.iter().filter(|node| node.glow_area > 0.0) {
                let key = (node.position / cell).floor().to_array().map(|v| v as i32);
                let entry = cells.entry(key).or_insert((Vec3::ZERO, 0.0));
                entry.0 += node.position * node.glow_area;
                entry.1 += node.glow_area;
            }
            if cells.len() <= MOST_LAMPS {
                break cells;
            }
            cell *= 1.5;
        };
        self.lamps.clear();
        self.lamps.extend(lamps.values().map(|(sum, area)| {
            let place = *sum / *area;
            let flicker = 1.0 + 0.25 * noise(place * 60.0 + Vec3::splat(time as f32 * 9.0));
            // The flame that lights the sheet stands over the edge that feeds it.
            (place + up * 0.012, area * flicker)
        }));
        let mut on_node = std::mem::take(&mut self.on_node);
        surface.nodes.par_iter().map(|node| self.at(node.position, node.normal)).collect_into_vec(&mut on_node);
        self.on_node = on_node;
    }

    /// Light that falls on a point.
    pub fn at(&self, position: Vec3, normal: Vec3) -> f32 {
        let mut sum = 0.0;
        for (place, power) in &self.lamps {
            let way = *place - position;
            let distance_squared = way.length_squared() + 1.5e-4;
            // A flame is centimetres tall: it lights the sheet under it from both sides, at every slant.
            let facing = 0.4 + 0.6 * way.dot(normal).abs() / distance_squared.sqrt();
            sum += power * facing / distance_squared;
        }
        sum
    }
}
