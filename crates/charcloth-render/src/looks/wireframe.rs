//! The mesh as a figure in a paper: thin lines with hidden ones removed, coloured by temperature, on a light ground.

use super::Look;
use crate::camera::{Camera, View};
use crate::error::RenderError;
use crate::image::RgbImage;
use crate::post::{Post, decode, plain};
use crate::raster::{Fragment, Raster, Shader};
use crate::surface::{SCORCH, Surface};
use charcloth::frame::Frame;
use glam::{Vec3, Vec3A};

/// Width of a line [pixels]; thinner where the mesh is so fine that lines would run together.
const LINE_WIDTH: f32 = 1.0;

struct Wireframe {
    camera: Camera,
    raster: Raster,
    surface: Surface,
    light: Vec<Vec3A>,
    post: Post,
}

/// Makes the look.
pub fn build(view: &View) -> Result<Box<dyn Look>, RenderError> {
    Ok(Box::new(Wireframe {
        camera: Camera::build(view)?,
        raster: Raster::default(),
        surface: Surface::default(),
        light: Vec::new(),
        post: Post::build(plain),
    }))
}

impl Look for Wireframe {
    fn draw(&mut self, frame: &Frame, image: &mut RgbImage) -> Result<(), RenderError> {
        let Self { camera, raster, surface, light, post } = self;
        surface.gather(frame, camera.target)?;
        let screen: Vec<[f32; 2]> = surface
            .position
            .iter()
            .map(|p| {
                let projected = camera.project(*p);
                [projected.x as f32, projected.y as f32]
            })
            .collect();
        let edge_pixels = (surface.spacing / camera.pixel_width()) as f32;
        let shader = Lines {
            surface,
            screen: &screen,
            forward: camera.forward.as_vec3(),
            radius: camera.radius as f32,
            width: LINE_WIDTH.min(edge_pixels * 0.16),
            strength: (edge_pixels / 6.0).clamp(0.45, 0.9),
            ground: decode([247, 246, 243]),
            front: decode([236, 238, 240]),
            back: decode([216, 219, 224]),
        };
        raster.draw(camera, &surface.position, &surface.triangles, &shader, light);
        post.develop(light, image);
        Ok(())
    }
}

struct Lines<'a> {
    surface: &'a Surface,
    screen: &'a [[f32; 2]],
    forward: Vec3,
    radius: f32,
    width: f32,
    strength: f32,
    ground: Vec3,
    front: Vec3,
    back: Vec3,
}

impl Shader for Lines<'_> {
    const EVERY_SAMPLE: bool = true;

    fn shade(&self, fragment: &Fragment) -> Vec3A {
        let corners = self.surface.triangles[fragment.triangle].map(|i| i as usize);
        let points = corners.map(|i| glam::Vec2::from_array(self.screen[i]));
        let twice_area = (points[1] - points[0]).perp_dot(points[2] - points[0]).abs();
        // Distance to the nearest side, in pixels.
        let mut distance = f32::INFINITY;
        for k in 0..3 {
            let side = points[(k + 1) % 3].distance(points[(k + 2) % 3]).max(1e-3);
            distance = distance.min(fragment.flat_weights[k].max(0.0) * twice_area / side);
        }
        let mix =
            |value: fn(&crate::surface::Node) -> f32| self.surface.mix(fragment.triangle, fragment.weights, value);
        let depth: f32 = (0..3)
            .map(|k| self.surface.nodes[corners[k]].position.dot(self.forward) * fragment.weights[k])
            .sum::<f32>()
            / self.radius;
        let line = line_colour(mix(|n| n.temperature), mix(|n| n.burnt), mix(|n| n.glow));
        let face = if fragment.front { self.front } else { self.back };
        // Half the line lies on each side of the edge; a ramp as wide as a sample smooths it.
        let cover = ((self.width * 0.5 + 0.35 - distance) / 0.7).clamp(0.0, 1.0) * self.strength;
        let faded = line.lerp(face, (0.12 + 0.3 * depth).clamp(0.0, 0.5));
        face.lerp(faded, cover).into()
    }

    fn background(&self, _: f32, _: f32) -> Vec3A {
        self.ground.into()
    }
}

/// Slate while cold, amber to orange as it heats, red where it burns, black once burnt.
fn line_colour(temperature: f32, burnt: f32, glow: f32) -> Vec3 {
    let heat = ((temperature - 310.0) / (SCORCH[1] as f32 - 310.0)).clamp(0.0, 1.0);
    let (cold, warm, hot) = (decode([72, 92, 116]), decode([214, 148, 52]), decode([224, 86, 20]));
    let heated = if heat < 0.5 { cold.lerp(warm, heat * 2.0) } else { warm.lerp(hot, heat * 2.0 - 1.0) };
    let charred = heated.lerp(decode([24, 20, 20]), (burnt * 1.3).min(1.0));
    charred.lerp(decode([208, 24, 12]), glow * 0.8)
}
