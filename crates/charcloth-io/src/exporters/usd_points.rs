//! Particles in OpenUSD: ash and crumbs as points with widths and velocities.

use super::quantities::{PARTICLES, Value as Of, disc_width, linear_char};
use super::usd::extent;
use super::usd_crate::{CrateWriter, Prim, Value};
use super::usd_samples::{Array, Attribute, Track};
use charcloth::frame::Frame;
use glam::{DVec3, Vec3};
use std::io::{self, Seek, Write};

/// The particles, with the frames so far.
#[derive(Debug, Default)]
pub(super) struct Points {
    track: Track,
    /// Whether any frame had some.
    pub any: bool,
}

impl Points {
    /// Writes the particles of the next frame.
    pub fn add<W: Write + Seek>(&mut self, file: &mut CrateWriter<W>, frame: &Frame) -> io::Result<()> {
        let particles = &frame.particles;
        let count = particles.len();
        self.any |= count > 0;
        let rows = |values: &[DVec3]| Array::Float3(values.iter().map(|v| v.as_vec3().to_array()).collect());
        let places: Vec<Vec3> = particles.position.iter().map(|p| p.as_vec3()).collect();
        let widths = particles.area.iter().map(|area| [disc_width(*area) as f32]).collect();
        let mut all = vec![
            Attribute::plain("points", "point3f[]", "Places [m]", rows(&particles.position)),
            Attribute::plain("velocities", "vector3f[]", "Velocities [m/s]", rows(&particles.velocity)),
            Attribute::plain("ids", "int64[]", "The same in all frames", Array::LongInts((0..count as i64).collect())),
            Attribute {
                interpolation: "vertex",
                ..Attribute::plain("widths", "float[]", "Of a disc of the same area [m]", Array::Floats(widths))
            },
            Attribute::plain("extent", "float3[]", "", Array::Float3(extent(&places, &particles.area).to_vec())),
            Attribute::primvar("id", "vertex", "The same in all frames", Array::Ints((0..count as i32).collect())),
            Attribute::primvar("displayColor", "vertex", "Char", Array::Float3(vec![linear_char(); count]))
                .typed("color3f[]"),
        ];
        for quantity in PARTICLES {
            let array = match quantity.value {
                Of::Number(value) => Array::Floats((0..count).map(|p| [value(frame, p) as f32]).collect()),
                Of::Whole(value) => Array::Ints((0..count).map(|p| value(frame, p) as i32).collect()),
            };
            all.push(Attribute::primvar(quantity.name, "vertex", quantity.about, array));
        }
        self.track.add(file, all)
    }

    /// The prim.
    pub fn prim<W: Write + Seek>(&self, file: &mut CrateWriter<W>, name: &str, times: Value) -> io::Result<Prim> {
        let properties = self.track.properties(file, times)?;
        Ok(Prim { name: name.to_string(), type_name: "Points", properties, ..Prim::default() })
    }
}
