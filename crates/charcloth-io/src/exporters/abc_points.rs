//! Particles in Alembic: ash and crumbs as points with widths and velocities.

use super::abc::{bounds, bytes, parameter, point_metadata, turned};
use super::abc_samples::{Columns, Place, Sample};
use super::ogawa::{OgawaWriter, Pod};
use super::quantities::{PARTICLES, Value as Of, disc_width, linear_char};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::DVec3;
use std::io::{self, Seek, Write};

/// The particles, with the frames so far.
#[derive(Debug, Default)]
pub(super) struct Points {
    pub columns: Columns,
    /// Whether any frame had some.
    pub any: bool,
}

impl Points {
    /// Writes the particles of the next frame.
    pub fn add<W: Write + Seek>(&mut self, file: &mut OgawaWriter<W>, frame: &Frame, up: Axis) -> io::Result<()> {
        use {Place::*, Pod::*};
        let particles = &frame.particles;
        let count = particles.len();
        self.any |= count > 0;
        let vectors = |values: &[DVec3]| bytes(values.iter().flat_map(|v| turned(up, *v)).map(f32::to_le_bytes));
        let width = |p: usize| disc_width(particles.area[p]);
        let bounds = bounds(particles.position.iter().map(|p| turned(up, *p)), |p| 0.5 * width(p));
        let widths = bytes((0..count).map(|p| (width(p) as f32).to_le_bytes()));
        let colors = bytes((0..count).flat_map(|_| linear_char()).map(f32::to_le_bytes));
        let mut all = vec![
            Sample(".selfBnds", Geometry, "interpretation=box".into(), Float64, 6, bounds),
            Sample("P", Geometry, point_metadata("point"), Float32, 3, vectors(&particles.position)),
            Sample(".pointIds", Geometry, String::new(), Uint64, 1, bytes((0..count as u64).map(u64::to_le_bytes))),
            Sample(".velocities", Geometry, point_metadata("vector"), Float32, 3, vectors(&particles.velocity)),
            Sample(".widths", Geometry, parameter("vtx", "float32_t", 1, ""), Float32, 1, widths),
            Sample("Cd", Arbitrary, parameter("vtx", "float32_t", 3, "rgb"), Float32, 3, colors),
        ];
        for quantity in PARTICLES {
            let (kind, pod, values) = match quantity.value {
                Of::Number(value) => {
                    ("float32_t", Float32, bytes((0..count).map(|p| (value(frame, p) as f32).to_le_bytes())))
                }
                Of::Whole(value) => ("int32_t", Int32, bytes((0..count).map(|p| value(frame, p).to_le_bytes()))),
            };
            all.push(Sample(quantity.name, Arbitrary, parameter("vtx", kind, 1, ""), pod, 1, values));
        }
        self.columns.add(file, all)
    }
}
