//! What burns: places, area and fuel of the burn nodes, and the edges of a finer burn mesh.

use super::Lattice;
use super::springs::SpringMaterial;
use crate::burn_mesh::{self, Refined};
use crate::error::Error;
use crate::random::RandomField;
use crate::scene::{Fire, Scene};
use crate::sheet::{BurnEdges, BurnNodes, MotionNodes, NONE, Triangles};
use crate::simulation::{GreyImage, Inputs};
use glam::{DVec3, Vec2};

fn node_uv(triangles: &Triangles, node_count: usize) -> Vec<Vec2> {
    let mut uv = vec![Vec2::ZERO; node_count];
    for (corners, corner_uv) in triangles.corners.iter().zip(&triangles.uv) {
        for k in 0..3 {
            uv[corners[k] as usize] = corner_uv[k];
        }
    }
    uv
}

/// Grey value of an image at a texture coordinate (v counts up), bilinear, clamped at the borders.
pub fn sample_image(image: &GreyImage, uv: Vec2) -> f32 {
    let (w, h) = (image.width.max(1), image.height.max(1));
    let x = (uv.x * w as f32 - 0.5).clamp(0.0, (w - 1) as f32);
    let y = ((1.0 - uv.y) * h as f32 - 0.5).clamp(0.0, (h - 1) as f32);
    let (i, j) = (x as usize, y as usize);
    let at = |i: usize, j: usize| image.values[j.min(h - 1) * w + i.min(w - 1)];
    let (fx, fy) = (x - i as f32, y - j as f32);
    let low = at(i, j) * (1.0 - fx) + at(i + 1, j) * fx;
    let high = at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx;
    low * (1.0 - fy) + high * fy
}

/// The image a key names.
pub fn image<'a>(inputs: &'a Inputs, key: &str, path: &str) -> Result<&'a GreyImage, Error> {
    inputs
        .images
        .get(path)
        .ok_or_else(|| Error::scene(key, format!("{path} was not read"), "hand it over in Inputs::images"))
}

/// Where the burn nodes lie: in the stress-free sheet, on its texture, and the area that each stands for.
pub(super) struct BurnPlaces {
    pub rest_position: Vec<DVec3>,
    pub uv: Vec<Vec2>,
    area: Vec<f64>,
}

impl BurnPlaces {
    pub fn of_motion_nodes(motion: &MotionNodes, triangles: &Triangles, lattice: Option<Lattice>) -> Self {
        let mut area = area_of_nodes(motion.len(), &triangles.corners, &triangles.rest_area);
        if let Some(lattice) = lattice {
            for (i, area) in area.iter_mut().enumerate() {
                *area = lattice_area(lattice, i);
            }
        }
        Self { rest_position: motion.rest_position.clone(), uv: node_uv(triangles, motion.len()), area }
    }

    pub fn of_burn_mesh(refined: &Refined, motion: &MotionNodes, triangles: &Triangles) -> Self {
        let fine = &refined.triangles;
        let mut rest_position = vec![DVec3::ZERO; refined.nodes];
        let mut uv = vec![Vec2::ZERO; refined.nodes];
        for t in 0..fine.len() {
            let parent = fine.parent[t] as usize;
            let [a, b, c] = triangles.corners[parent].map(|i| motion.rest_position[i as usize]);
            let [uv_a, uv_b, uv_c] = triangles.uv[parent];
            for (k, i) in fine.corners[t].iter().enumerate() {
                let place = fine.place[t][k] + fine.aside[t][k];
                let [x, y] = place.as_dvec2().to_array();
                rest_position[*i as usize] = a * (1.0 - x - y) + b * x + c * y;
                uv[*i as usize] = uv_a + (uv_b - uv_a) * place.x + (uv_c - uv_a) * place.y;
            }
        }
        Self { rest_position, uv, area: area_of_nodes(refined.nodes, &fine.corners, &fine.rest_area) }
    }

    /// The same with nodes renumbered: entry k of `order` becomes node k.
    pub fn renumbered(&self, order: &[u32]) -> Self {
        let Self { rest_position, uv, area } = self;
        Self {
            rest_position: order.iter().map(|i| rest_position[*i as usize]).collect(),
            uv: order.iter().map(|i| uv[*i as usize]).collect(),
            area: order.iter().map(|i| area[*i as usize]).collect(),
        }
    }
}

fn area_of_nodes(count: usize, corners: &[[u32; 3]], rest_area: &[f64]) -> Vec<f64> {
    let mut area = vec![0.0; count];
    for (corners, rest_area) in corners.iter().zip(rest_area) {
        for i in corners {
            area[*i as usize] += rest_area / 3.0;
        }
    }
    area
}

pub(super) fn check_burn_level(scene: &Scene, triangles: &Triangles) -> Result<(), Error> {
    let level = scene.sheet.burn_level;
    let problem = if level > burn_mesh::FINEST {
        format!("{level} is finer than is built")
    } else if triangles.is_empty() {
        "a chain has no triangles to refine".to_owned()
    } else if scene.fire.raw.is_some() {
        "raw coefficients are per node of the mesh that moves".to_owned()
    } else {
        return Ok(());
    };
    Err(Error::scene("sheet.burn_level", problem, format!("use 0 to {}; 0 is the mesh that moves", burn_mesh::FINEST)))
}

pub(super) fn fine_edges(scene: &Scene, refined: &Refined) -> BurnEdges {
    let material = SpringMaterial::of(scene);
    let mut edges = BurnEdges::default();
    for edge in &refined.edges {
        material.edge(&mut edges, edge.ends, edge.distance, edge.shape.max(0.0));
        if let Some(triangles) = edges.triangles.last_mut() {
            *triangles = edge.triangles;
        }
    }
    edges
}

pub(super) fn burn_nodes(scene: &Scene, inputs: &Inputs, places: &BurnPlaces) -> Result<BurnNodes, Error> {
    let BurnPlaces { rest_position, uv, area } = places;
    let count = area.len();
    let Fire { raw, .. } = &scene.fire;
    let variation = &scene.sheet.variation;
    let field = RandomField::new(scene.seed, 0x6675_656c, variation.correlation_length.0);
    let map = variation.map.as_deref().map(|path| image(inputs, "sheet.variation.map", path)).transpose()?;
    let raw = raw.clone().unwrap_or_default();
    let ambient = scene.fire.ambient_temperature.0;
    let mut burn = BurnNodes {
        temperature: vec![ambient; count],
        peak_temperature: vec![ambient; count],
        ignited_at: vec![-1.0; count],
        particle: vec![NONE; count],
        thickness: vec![1.0; count],
        speed: vec![1.0; count],
        ..BurnNodes::zeros(count)
    };
    for i in 0..count {
        let mut factor = 1.0;
        if variation.noise.0 > 0.0 {
            // Eq. 2.1. A sheet has no places without fibre: cut the Gaussian off well above zero.
            factor *= (1.0 + variation.noise.0 * field.at(rest_position[i])).max(0.2);
        }
        if let Some(map) = map {
            let grey = f64::from(sample_image(map, uv[i]));
            factor *= variation.map_low.0 + (variation.map_high.0 - variation.map_low.0) * grey;
        }
        let nominal = raw.node_fuel.map_or(scene.sheet.grammage.0 * area[i], |mass| mass.0);
        burn.area[i] = area[i];
        burn.fuel_initial[i] = nominal * factor;
        burn.fuel[i] = burn.fuel_initial[i];
        burn.burn_rate_full[i] = raw.k1.map_or(nominal / scene.fire.burn_time.0, |k1| k1.0);
        // Eq. 1.5: k3 m0 is the reciprocal of the node's heat capacity.
        burn.heat_capacity[i] =
            raw.k3.map_or(scene.fire.heat_capacity.0 * burn.fuel_initial[i], |k3| 1.0 / (k3.0 * burn.fuel_initial[i]));
    }
    Ok(burn)
}

/// Part of the cell of a lattice node that lies inside the sheet, along one direction.
pub(super) fn inner_part(index: usize, count: usize) -> f64 {
    if count > 1 && (index == 0 || index == count - 1) { 0.5 } else { 1.0 }
}

pub(super) fn lattice_area(lattice: Lattice, node: usize) -> f64 {
    let (i, j) = lattice.place(node);
    if lattice.rows == 1 {
        // A chain stands for a strip as wide as its spacing.
        return lattice.spacing.x * lattice.spacing.x * inner_part(i, lattice.columns);
    }
    lattice.spacing.x * lattice.spacing.y * inner_part(i, lattice.columns) * inner_part(j, lattice.rows)
}
