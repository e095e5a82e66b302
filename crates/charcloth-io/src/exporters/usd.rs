//! OpenUSD: the living surface of all frames as one mesh with time samples in one .usdc file.
//!
//! Topology changes from frame to frame, so `velocities` [m/s] carry motion blur where the points of two frames do not
//! match. Texture coordinates and what is known of each piece stand once a piece or coordinate, and faces say which.
//! Particles are points beside the mesh.

use super::look::{display_color, linear};
use super::quantities::{
    ABOUT_ORIGIN_WEIGHTS, ORIGIN_WEIGHTS, ORIGINS, PIECES, QUANTITIES, Value as Of, disc_width, linear_color,
    piece_count,
};
use super::sequence::Sequence;
use super::surface::Shape;
use super::twin::Twin;
use super::usd_crate::{CrateWriter, Prim, Property, Value};
use super::usd_points::Points;
use super::usd_samples::{Array, Attribute, Track};
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// What all prims stand below, the mesh, the points, and the material of the mesh.
const TOP: &str = "charcloth";
const SHEET: &str = "sheet";
const PARTICLES: &str = "particles";
const MATERIAL: &str = "paper";

/// Writes `sheet.usdc` into a folder.
pub(super) fn write(sequence: &mut Sequence<'_>, folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let path = folder.join("sheet.usdc");
    write_file(sequence, None, &path)?;
    Ok(vec![path])
}

/// Writes a .usdc file: the living surface, or a twin.
pub(super) fn write_file(sequence: &mut Sequence<'_>, twin: Option<&Twin>, path: &Path) -> Result<(), IoError> {
    write_streamed(path, Durability::Process, |out| {
        let mut file = CrateWriter::begin(out)?;
        let mut sheet = Sheet::default();
        while let Some(frame) = sequence.next(path)? {
            sheet.add(&mut file, &frame, twin)?;
        }
        let root = stage(&mut file, &sheet, sequence)?;
        file.finish(&root)?;
        Ok(())
    })
}

/// The mesh, with the frames so far.
#[derive(Default)]
struct Sheet {
    times: Vec<f64>,
    track: Track,
    particles: Points,
    /// All texture coordinates that were ever used, numbered.
    uv: Vec<[f32; 2]>,
    uv_numbers: HashMap<[u32; 2], i32>,
}

impl Sheet {
    fn add<W: Write + Seek>(
        &mut self,
        file: &mut CrateWriter<W>,
        frame: &Frame,
        twin: Option<&Twin>,
    ) -> io::Result<()> {
        let arrays = match twin {
            Some(twin) => {
                let pose = twin.pose(frame);
                let shape = Shape { nodes: pose.nodes, faces: twin.faces.clone(), rows: twin.rows.clone() };
                self.arrays(frame, &shape, &pose.positions, Some(&pose.alive))
            }
            None => {
                let shape = Shape::of(frame);
                let places: Vec<Vec3> =
                    shape.nodes.iter().map(|i| frame.motion.position[*i as usize].as_vec3()).collect();
                self.arrays(frame, &shape, &places, None)
            }
        };
        self.track.add(file, arrays)?;
        if twin.is_none() {
            self.particles.add(file, frame)?;
        }
        self.times.push(f64::from(frame.number));
        Ok(())
    }

    /// Every attribute of the mesh in a frame, its points at these places [m]. Without `alive`, all of them are.
    fn arrays(&mut self, frame: &Frame, shape: &Shape, places: &[Vec3], alive: Option<&[bool]>) -> Vec<Attribute> {
        let node_rows = |value: &dyn Fn(usize) -> DVec3| {
            Array::Float3(shape.nodes.iter().map(|i| value(*i as usize).as_vec3().to_array()).collect())
        };
        let node_ints =
            |value: &dyn Fn(usize) -> u32| Array::Ints(shape.nodes.iter().map(|i| value(*i as usize) as i32).collect());
        let face_ints = |column: &[u32]| Array::Ints(shape.rows.iter().map(|t| column[*t as usize] as i32).collect());
        let (motion, triangles) = (&frame.motion, &frame.triangles);
        let normals = frame.normals();
        let points = Array::Float3(places.iter().map(|p| p.to_array()).collect());
        let is_alive = |point: usize| alive.is_none_or(|alive| alive[point]);
        // What has folded up stays where it is.
        let velocity = |(point, i): (usize, &u32)| match is_alive(point) {
            true => motion.velocity[*i as usize].as_vec3().to_array(),
            false => [0.0; 3],
        };
        let velocities = Array::Float3(shape.nodes.iter().enumerate().map(velocity).collect());
        let alive = Array::Ints((0..places.len()).map(|point| is_alive(point).into()).collect());
        let uv_numbers = shape.rows.iter().flat_map(|t| triangles.uv[*t as usize]).map(|uv| {
            *self.uv_numbers.entry([uv.x.to_bits(), uv.y.to_bits()]).or_insert_with(|| {
                self.uv.push(uv.to_array());
                self.uv.len() as i32 - 1
            })
        });
        let uv_numbers = Array::Ints(uv_numbers.collect());
        let corners = shape.faces.iter().flatten().map(|v| *v as i32).collect();
        let colors = shape.nodes.iter().map(|i| linear_color(frame, *i as usize)).collect();
        let mut all = vec![
            Attribute::plain("points", "point3f[]", "Places [m]", points),
            Attribute::plain("velocities", "vector3f[]", "Velocities [m/s]", velocities),
            Attribute {
                interpolation: "vertex",
                ..Attribute::plain("normals", "normal3f[]", "", node_rows(&|i| normals[i]))
            },
            Attribute::plain("extent", "float3[]", "", Array::Float3(extent(places, &[]).to_vec())),
            Attribute::plain("faceVertexCounts", "int[]", "", Array::Ints(vec![3; shape.faces.len()])),
            Attribute::plain("faceVertexIndices", "int[]", "", Array::Ints(corners)),
            Attribute::plain("primvars:st:indices", "int[]", "", uv_numbers),
            Attribute::primvar("displayColor", "vertex", "Paper white by brown to black", Array::Float3(colors))
                .typed("color3f[]"),
        ];
        for quantity in QUANTITIES {
            let values = shape.nodes.iter().map(|i| [(quantity.value)(frame, *i as usize) as f32]).collect();
            all.push(Attribute::primvar(quantity.name, "vertex", quantity.about, Array::Floats(values)));
        }
        let rest = node_rows(&|i| motion.rest_position[i]);
        all.push(Attribute::primvar("rest", "vertex", "Place in the stress-free sheet [m]", rest).typed("point3f[]"));
        let weights = node_rows(&|i| frame.origins.origin_weights[i]);
        all.push(Attribute::primvar(ORIGIN_WEIGHTS, "vertex", ABOUT_ORIGIN_WEIGHTS, weights));
        for origin in ORIGINS {
            let values = node_ints(&|i| (origin.value)(frame, i));
            all.push(Attribute::primvar(origin.name, "vertex", origin.about, values));
        }
        let whole = [
            ("id", "Number of the node, the same in all frames", node_ints(&|i| i as u32)),
            ("source", "Point of the input mesh the node comes from", node_ints(&|i| motion.source[i])),
            ("alive", "1 while the node belongs to the surface", alive),
        ];
        all.extend(whole.map(|(name, about, array)| Attribute::primvar(name, "vertex", about, array)));
        let faces = [
            ("piece", "Connected piece; 0 is the largest, flakes count up", face_ints(&triangles.piece)),
            ("source_face", "Face of the input mesh", face_ints(&triangles.source_face)),
            ("sheet", "Shell of the input mesh", face_ints(&triangles.sheet)),
        ];
        all.extend(faces.map(|(name, about, array)| Attribute::primvar(name, "uniform", about, array)));
        // A value a piece, and each face says which: its number.
        let count = piece_count(frame);
        for quantity in PIECES {
            let array = match quantity.value {
                Of::Number(value) => Array::Floats((0..count).map(|p| [value(frame, p) as f32]).collect()),
                Of::Whole(value) => Array::Ints((0..count).map(|p| value(frame, p) as i32).collect()),
            };
            all.push(Attribute::primvar(quantity.name, "uniform", quantity.about, array));
            let indices = format!("primvars:{}:indices", quantity.name);
            all.push(Attribute::plain(&indices, "int[]", "", Array::SameAs("primvars:piece")));
        }
        all
    }
}

/// Lowest and highest corner of the box around some places [m], each as wide as a disc of its area [m2].
pub(super) fn extent(places: &[Vec3], areas: &[f64]) -> [[f32; 3]; 2] {
    let mut bounds: Option<(Vec3, Vec3)> = None;
    for (k, place) in places.iter().enumerate() {
        let half = Vec3::splat(areas.get(k).map_or(0.0, |area| 0.5 * disc_width(*area) as f32));
        let (low, high) = bounds.unwrap_or((*place - half, *place + half));
        bounds = Some((low.min(*place - half), high.max(*place + half)));
    }
    let (low, high) = bounds.unwrap_or_default();
    [low.to_array(), high.to_array()]
}

/// The tree of prims around the samples.
fn stage<W: Write + Seek>(file: &mut CrateWriter<W>, sheet: &Sheet, sequence: &Sequence<'_>) -> io::Result<Prim> {
    let times = file.times(&sheet.times)?;
    let mut properties = sheet.track.properties(file, times)?;
    let st = file.floats(&sheet.uv)?;
    let fields =
        vec![("typeName", file.token("texCoord2f[]")), ("default", st), ("interpolation", file.token("faceVarying"))];
    properties.push(attribute("primvars:st", fields));
    let scheme = file.token("none");
    properties.push(uniform(file, "subdivisionScheme", "token", scheme));
    properties.push(uniform(file, "doubleSided", "bool", Value::bool(true)));
    properties.push(Property {
        name: "material:binding".to_string(),
        fields: vec![("variability", Value::uniform())],
        target: Some(format!("/{TOP}/{MATERIAL}")),
        is_relationship: true,
    });
    let binding = file.prepended_tokens(&["MaterialBindingAPI"])?;
    let mesh = Prim {
        name: SHEET.to_string(),
        type_name: "Mesh",
        fields: vec![("apiSchemas", binding)],
        properties,
        children: Vec::new(),
    };
    let mut children = vec![mesh];
    if sheet.particles.any {
        children.push(sheet.particles.prim(file, PARTICLES, times)?);
    }
    children.push(material(file)?);
    let top = Prim {
        name: TOP.to_string(),
        type_name: "Xform",
        fields: vec![("kind", file.token("component"))],
        properties: Vec::new(),
        children,
    };
    let meta = sequence.meta();
    let about =
        format!("Charcloth {}, scene \"{}\": SI units, a time code a frame", env!("CARGO_PKG_VERSION"), meta.scene);
    let (first, last) = (sheet.times.first().copied(), sheet.times.last().copied());
    let fields = vec![
        ("defaultPrim", file.token(TOP)),
        ("documentation", file.string(&about)),
        ("metersPerUnit", file.double(1.0)?),
        (
            "upAxis",
            file.token(match meta.up {
                Axis::Y => "Y",
                Axis::Z => "Z",
            }),
        ),
        ("timeCodesPerSecond", file.double(sequence.fps())?),
        ("framesPerSecond", file.double(sequence.fps())?),
        ("startTimeCode", file.double(first.unwrap_or_default())?),
        ("endTimeCode", file.double(last.unwrap_or_default())?),
    ];
    Ok(Prim { fields, children: vec![top], ..Prim::default() })
}

/// A plain material that shows the display colour, for viewers that shade.
fn material<W: Write + Seek>(file: &mut CrateWriter<W>) -> io::Result<Prim> {
    let path = format!("/{TOP}/{MATERIAL}");
    let connected = |file: &mut CrateWriter<W>, name: &str, kind: &str, to: String| Property {
        name: name.to_string(),
        fields: vec![("typeName", file.token(kind))],
        target: Some(to),
        is_relationship: false,
    };
    let valued = |file: &mut CrateWriter<W>, name: &str, kind: &str, value: Value| {
        let fields = vec![("typeName", file.token(kind)), ("default", value)];
        attribute(name, fields)
    };
    let output = |file: &mut CrateWriter<W>, name: &str, kind: &str| {
        let fields = vec![("typeName", file.token(kind))];
        attribute(name, fields)
    };
    let (surface_id, reader_id) = (file.token("UsdPreviewSurface"), file.token("UsdPrimvarReader_float3"));
    let name_of_color = file.string("displayColor");
    let paper = file.float3(display_color(0.0, 0.0).map(linear))?;
    let surface = Prim {
        name: "surface".to_string(),
        type_name: "Shader",
        fields: Vec::new(),
        properties: vec![
            uniform(file, "info:id", "token", surface_id),
            connected(file, "inputs:diffuseColor", "color3f", format!("{path}/color.outputs:result")),
            valued(file, "inputs:roughness", "float", Value::float(0.9)),
            output(file, "outputs:surface", "token"),
        ],
        children: Vec::new(),
    };
    let color = Prim {
        name: "color".to_string(),
        type_name: "Shader",
        fields: Vec::new(),
        properties: vec![
            uniform(file, "info:id", "token", reader_id),
            valued(file, "inputs:varname", "string", name_of_color),
            valued(file, "inputs:fallback", "float3", paper),
            output(file, "outputs:result", "float3"),
        ],
        children: Vec::new(),
    };
    Ok(Prim {
        name: MATERIAL.to_string(),
        type_name: "Material",
        fields: Vec::new(),
        properties: vec![connected(file, "outputs:surface", "token", format!("{path}/surface.outputs:surface"))],
        children: vec![surface, color],
    })
}

fn attribute(name: &str, fields: Vec<(&'static str, Value)>) -> Property {
    Property { name: name.to_string(), fields, target: None, is_relationship: false }
}

fn uniform<W: Write + Seek>(file: &mut CrateWriter<W>, name: &str, kind: &str, value: Value) -> Property {
    let fields = vec![("typeName", file.token(kind)), ("variability", Value::uniform()), ("default", value)];
    attribute(name, fields)
}
