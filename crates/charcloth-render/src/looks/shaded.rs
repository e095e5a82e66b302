//! Burning paper: white sheet, brown scorch, black char with ash, a thin glowing line where it burns.
//!
//! Everything that varies faster than the mesh is noise in the stress-free sheet, so it sticks to the material while the
//! sheet bends. The same noise moves the borders of scorch, char and holes, so that no triangle shows in them.

use super::Look;
use crate::camera::{Camera, View};
use crate::error::RenderError;
use crate::flames::Flames;
use crate::glow::black_body;
use crate::image::RgbImage;
use crate::light::{FireLight, KeyLight};
use crate::post::Post;
use crate::props::Props;
use crate::raster::{Fragment, Raster, Shader};
use crate::specks;
use crate::surface::{Node, Surface};
use charcloth::frame::Frame;
use charcloth::noise::{fractal, noise};
use glam::{DVec3, Vec3, Vec3A};

/// Burnt part at which the most fragile spots are gone, and at which everything is.
/// tuned: from 0.7; holes must begin before the fuel is quite gone, or the mesh is seen where triangles are cut.
const HOLES_BEGIN: f32 = 0.55;
const HOLES_END: f32 = 1.2;

// Light and colours, linear. tuned: by eye, for white paper in a dim room that still shows its own fire.
const PAPER: Vec3 = Vec3::new(0.80, 0.785, 0.745);
const KEY: Vec3 = Vec3::new(0.66, 0.62, 0.56);
const SKY: Vec3 = Vec3::new(0.14, 0.15, 0.167);
const GROUND: Vec3 = Vec3::new(0.055, 0.049, 0.043);
const FIRE: Vec3 = Vec3::new(1.0, 0.36, 0.075);
const CHAR: Vec3 = Vec3::new(0.016, 0.0145, 0.0135);
const ASH: Vec3 = Vec3::new(0.21, 0.20, 0.19);
const TABLE: Vec3 = Vec3::new(0.105, 0.090, 0.078);
const CLAY: Vec3 = Vec3::new(0.29, 0.27, 0.25);
/// Part of the light on one side of white paper that comes through on the other.
const THROUGH: f32 = 0.16;

/// Colour of scorched paper, from white to as dark as scorch gets.
const SCORCH: [(f32, Vec3); 6] = [
    (-0.12, PAPER),
    (0.06, Vec3::new(0.68, 0.58, 0.42)),
    (0.24, Vec3::new(0.40, 0.245, 0.115)),
    (0.44, Vec3::new(0.15, 0.070, 0.028)),
    (0.62, Vec3::new(0.045, 0.024, 0.014)),
    (0.85, CHAR),
];

/// Colour of hot char by temperature [K]: red to yellow, about as a black body's, brightened to what a camera set for
/// the paper would record.
const EMBER: [(f32, Vec3); 5] = [
    (620.0, Vec3::new(0.9, 0.07, 0.006)),
    (800.0, Vec3::new(2.6, 0.33, 0.022)),
    (1000.0, Vec3::new(5.5, 1.15, 0.09)),
    (1200.0, Vec3::new(8.5, 2.4, 0.26)),
    (1500.0, Vec3::new(11.0, 5.2, 1.3)),
];

/// Least temperature of char whose light is worked out [K], and part of a black body's light that it gives.
const GLOWS: f32 = 900.0;
const EMISSIVITY: f32 = 0.9;
/// How much hotter and colder than on average over its mesh char is, from pore to pore [K].
const UNEVEN: f32 = 90.0; // tuned: by eye, a rim is a broken line; 30 to 150

struct Shaded {
    camera: Camera,
    raster: Raster,
    surface: Surface,
    props: Props,
    /// Sheet and props together.
    position: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    key: KeyLight,
    fire: FireLight,
    light: Vec<Vec3A>,
    flames: Flames,
    post: Post,
}

/// Makes the look.
pub fn build(view: &View) -> Result<Box<dyn Look>, RenderError> {
    let camera = Camera::build(view)?;
    Ok(Box::new(Shaded {
        key: KeyLight::build(&camera),
        props: Props::build(&view.scenery, &camera),
        position: Vec::new(),
        triangles: Vec::new(),
        camera,
        raster: Raster::default(),
        surface: Surface::default(),
        fire: FireLight::default(),
        light: Vec::new(),
        flames: Flames::default(),
        post: Post::default(),
    }))
}

impl Look for Shaded {
    fn draw(&mut self, frame: &Frame, image: &mut RgbImage) -> Result<(), RenderError> {
        let Self { camera, raster, surface, props, position, triangles, key, fire, light, flames, post } = self;
        surface.gather(frame, camera.target)?;
        props.move_to(frame.time, camera.target);
        position.clone_from(&surface.position);
        position.extend_from_slice(&props.place);
        triangles.clone_from(&surface.triangles);
        let first = surface.position.len() as u32;
        triangles.extend(props.triangles.iter().map(|corners| corners.map(|i| i + first)));
        key.look_at(surface, props);
        fire.look_at(surface, camera.up.as_vec3(), frame.time);
        let paper = Paper {
            surface,
            props,
            camera,
            key,
            fire,
            eye: (camera.eye - camera.target).as_vec3(),
            up: camera.up.as_vec3(),
            pixel: camera.pixel_width() as f32,
            radius: camera.radius as f32,
            time: frame.time as f32,
        };
        raster.draw(camera, position, triangles, &paper, light);
        specks::add(frame, camera, &raster.depth, light);
        flames.add(frame, camera, &raster.depth, light);
        post.bloom(light, camera.size);
        post.develop(light, image);
        Ok(())
    }
}

struct Paper<'a> {
    surface: &'a Surface,
    props: &'a Props,
    camera: &'a Camera,
    key: &'a KeyLight,
    fire: &'a FireLight,
    eye: Vec3,
    up: Vec3,
    /// Width of a pixel on the sheet [m].
    pixel: f32,
    /// Radius of the sheet at the start [m].
    radius: f32,
    /// Simulated time [s].
    time: f32,
}

fn ramp(stops: &[(f32, Vec3)], x: f32) -> Vec3 {
    let mut before = stops[0];
    for stop in stops {
        if x < stop.0 {
            let t = ((x - before.0) / (stop.0 - before.0).max(1e-6)).clamp(0.0, 1.0);
            return before.1.lerp(stop.1, t);
        }
        before = *stop;
    }
    before.1
}

fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Cracks of char, 1 in their middle: where a noise some millimetres wide is nought, and one half as wide.
fn crackle(rest: Vec3) -> f32 {
    let line = |width: f32, size: f32| 1.0 - smooth(0.0, width, noise(rest * (1.0 / size)).abs());
    line(0.10, 0.0034).max(0.7 * line(0.12, 0.0017))
}

impl Paper<'_> {
    /// How much of a pattern of this width [m] a pixel can show.
    fn visible(&self, width: f32) -> f32 {
        smooth(1.0, 2.5, width / self.pixel)
    }

    /// Noise that moves the borders of char and holes: tongues of some millimetres with a fine fringe.
    fn fringe(&self, rest: Vec3) -> f32 {
        let coarse = fractal(rest * (1.0 / 0.0045), 2, 0.5);
        let fine = self.visible(0.0011);
        let fringe = if fine > 0.0 { fine * noise(rest * (1.0 / 0.0011)) } else { 0.0 };
        coarse * 0.65 + fringe * 0.55
    }

    /// Burnt part beyond which the sheet is gone at a point.
    fn limit(&self, rest: Vec3) -> f32 {
        let t = (0.5 + 0.8 * self.fringe(rest)).clamp(0.0, 1.0);
        HOLES_BEGIN + (HOLES_END - HOLES_BEGIN) * t
    }

    fn rest(&self, triangle: usize, weights: [f32; 3]) -> Vec3 {
        let corners = self.surface.triangles[triangle].map(|i| self.surface.nodes[i as usize].rest);
        corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
    }

    /// Colour of what the sheet meets: dull, and plain enough not to draw the eye.
    fn shade_prop(&self, triangle: usize, fragment: &Fragment) -> Vec3A {
        let (corners, w) = (self.props.triangles[triangle], fragment.weights);
        let mix = |of: [Vec3; 3]| of[0] * w[0] + of[1] * w[1] + of[2] * w[2];
        let position = mix(corners.map(|i| self.props.position[i as usize]));
        let mut normal = mix(self.props.normal[triangle]).normalize_or(self.up);
        if normal.dot(self.eye - position) < 0.0 {
            normal = -normal;
        }
        let plane = triangle < self.props.flat;
        let facing = normal.dot(self.key.direction).max(0.0);
        let lit = if facing > 0.0 { self.key.reaches(position, normal) } else { 0.0 };
        let near = (0.84 + 0.34 * position.dot(self.key.direction) / self.radius).clamp(0.3, 1.2);
        let sky = GROUND.lerp(SKY, 0.5 + 0.5 * normal.dot(self.up));
        let light = KEY * (facing * lit * near) + sky + FIRE * (self.fire.at(position, normal) * 1.1).min(1.6);
        let grain = 1.0 + 0.06 * noise(position * (1.0 / 0.02)) + 0.04 * noise(position * (1.0 / 0.004));
        let colour = Vec3A::from(if plane { TABLE } else { CLAY } * grain * light);
        if !plane {
            return colour;
        }
        let point = self.camera.project(self.camera.target + position.as_dvec3());
        let [width, height] = self.camera.size.map(f64::from);
        let behind = self.background((point.x / width) as f32, (point.y / height) as f32);
        colour.lerp(behind, smooth(0.2, 0.95, position.length() / self.props.far))
    }
}

impl Shader for Paper<'_> {
    fn may_cut(&self, triangle: usize) -> bool {
        let corners = self.surface.triangles.get(triangle);
        corners.is_some_and(|corners| corners.iter().any(|i| self.surface.nodes[*i as usize].gone > HOLES_BEGIN))
    }

    fn keeps(&self, triangle: usize, weights: [f32; 3]) -> bool {
        let rest = self.rest(triangle, weights);
        let [_, gone] = self.surface.curved(triangle, weights, rest);
        gone <= HOLES_BEGIN || (gone < HOLES_END && gone < self.limit(rest))
    }

    fn shade(&self, fragment: &Fragment) -> Vec3A {
        if let Some(prop) = fragment.triangle.checked_sub(self.surface.triangles.len()) {
            return self.shade_prop(prop, fragment);
        }
        let corners = self.surface.triangles[fragment.triangle].map(|i| i as usize);
        let nodes: [&Node; 3] = corners.map(|i| &self.surface.nodes[i]);
        let w = fragment.weights;
        let mix = |value: fn(&Node) -> f32| value(nodes[0]) * w[0] + value(nodes[1]) * w[1] + value(nodes[2]) * w[2];
        let mix_vector =
            |value: fn(&Node) -> Vec3| value(nodes[0]) * w[0] + value(nodes[1]) * w[1] + value(nodes[2]) * w[2];
        let rest = mix_vector(|n| n.rest);
        let position = mix_vector(|n| n.position);
        let touched = nodes.iter().any(|n| n.scorch > -0.2 || n.gone > 0.0);
        let [scorch, burnt] = if touched { self.surface.curved(fragment.triangle, w, rest) } else { [-0.25, 0.0] };
        let glow = mix(|n| n.glow);
        let temperature = mix(|n| n.temperature);

        // Paper: clouds of formation some millimetres wide, and fibres about the width of a pixel.
        let cloud = noise(rest * (1.0 / 0.0065));
        let fine = self.visible(0.0009);
        let fibre =
            if fine > 0.0 { fine * noise(rest * Vec3::new(1.0 / 0.0009, 1.0 / 0.002, 1.0 / 0.0009)) } else { 0.0 };
        let grain = 1.0 + 0.035 * cloud + 0.045 * fibre;

        let affected = scorch > -0.22 || burnt > 0.0;
        let fringe = if affected { self.fringe(rest) } else { 0.0 };
        // Scorch wanders by a third of its band, and is mottled within it.
        let mut albedo = PAPER * grain;
        if affected {
            let within = smooth(-0.22, 0.1, scorch);
            albedo = ramp(&SCORCH, scorch + (0.20 * fringe + 0.16 * cloud) * within) * grain;
        }
        // Char follows the fuel: brown while there is fibre left, then black, with cracks as fine as a hair.
        let by_rate = nodes[0].by_rate;
        let charred = match by_rate {
            true => smooth(0.12, 0.72, mix(|n| n.charred) + 0.12 * fringe),
            false if burnt > 0.0 => smooth(0.04, 0.34, burnt + 0.10 * fringe),
            false => 0.0,
        };
        let (mut ashen, mut cracks) = (0.0, 0.0);
        if charred > 0.0 {
            cracks = self.visible(0.0012) * crackle(rest) * charred;
            let mottle = 1.0 + 0.45 * fringe;
            albedo = albedo.lerp(CHAR * (mottle.max(0.2) * (1.0 - 0.7 * cracks)), charred);
            let patches = fractal(rest * (1.0 / 0.0026) + 31.0, 2, 0.6);
            ashen = match by_rate {
                // A film of ash, which comes first where air gets at the char.
                true => smooth(0.0, 0.6, mix(|n| n.ashed) + 0.25 * patches - 0.05),
                false => smooth(0.05, 0.7, patches) * smooth(0.62, 0.97, burnt),
            };
            albedo = albedo.lerp(ASH * (1.0 - 0.5 * cracks), ashen * 0.75);
        }

        // Which way the surface faces; char is crinkled.
        let mut normal = mix_vector(|n| n.normal).normalize_or(self.key.direction);
        if !fragment.front {
            normal = -normal;
        }
        let view = (self.eye - position).normalize_or(normal);
        if charred > 0.0 {
            let p = rest * (1.0 / 0.0022);
            let crinkle = Vec3::new(noise(p + 7.0), noise(p - 13.0), noise(p + 29.0));
            normal = (normal + crinkle * (0.55 * charred)).normalize_or(normal);
        }

        // Two-sided: what falls on the far side comes through as far as the paper is still pale.
        let facing = normal.dot(self.key.direction);
        let lit: f32 = (0..3).map(|k| self.key.on_node[corners[k]] * w[k]).sum();
        let pale = (albedo.x / PAPER.x).clamp(0.0, 1.0);
        let straight = facing.max(0.0) * (1.0 - THROUGH * pale);
        let through = (-facing).max(0.0) * THROUGH * pale + facing.max(0.0) * THROUGH * pale * 0.3;
        let sky = GROUND.lerp(SKY, 0.5 + 0.5 * normal.dot(self.up));
        let on_fire: f32 = (0..3).map(|k| self.fire.on_node[corners[k]] * w[k]).sum();
        // The lamp is near: what is farther from it gets less.
        let near = 0.84 + 0.34 * position.dot(self.key.direction) / self.radius;
        let key = KEY * straight + KEY * Vec3::new(1.0, 0.86, 0.66) * through;
        let light = key * (lit * near) + sky + FIRE * (on_fire * 1.1).min(1.6);
        let mut colour = albedo * light * 1.12;
        // Char has a satin sheen.
        if charred > 0.0 {
            let half = (view + self.key.direction).normalize_or(normal);
            let sheen = normal.dot(half).max(0.0).powi(14) * 0.055 * charred * (1.0 - ashen);
            colour += KEY * (sheen * lit);
        }

        // Embers: what burns now, most of it close to the edge it burns back from.
        if glow > 0.0 {
            let flicker = noise(rest * (1.0 / 0.003) + Vec3::splat(self.time * 5.0));
            let close = smooth(0.40, 0.86, burnt + 0.16 * fringe + 0.06 * flicker);
            let strength = glow * (close * (0.62 + 0.75 * flicker).max(0.06) * (1.0 - 0.4 * ashen) + 0.015);
            colour += ramp(&EMBER, temperature + 90.0 * flicker) * strength.max(0.0);
        }
        // Char that burns shines by its temperature, which differs from pore to pore, and through its cracks; ash hides it.
        if by_rate && temperature > GLOWS {
            let uneven = noise(rest * (1.0 / 0.0016) + Vec3::splat(self.time * 4.0)) + 0.8 * fringe;
            let seen = EMISSIVITY * charred * (1.0 - 0.6 * ashen * (1.0 - cracks));
            colour += black_body(temperature + UNEVEN * uneven + 0.5 * UNEVEN * cracks) * seen;
        }
        colour.into()
    }

    fn background(&self, x: f32, y: f32) -> Vec3A {
        // A dim wall: lighter behind the middle of the sheet, darker to the corners and the top.
        let high = Vec3::new(0.020, 0.0185, 0.0175);
        let low = Vec3::new(0.052, 0.047, 0.0425);
        let corner = ((x - 0.5).powi(2) + (y - 0.5).powi(2)) * 0.9;
        (high.lerp(low, y * y * (3.0 - 2.0 * y)) * (1.0 - corner)).into()
    }
}
