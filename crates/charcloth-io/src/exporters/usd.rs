//! OpenUSD: the living surface of all frames as one mesh with time samples in one .usdc file.
//!
//! Topology changes from frame to frame, so `velocities` [m/s] carry motion blur where the points of two frames do not
//! match. A value that is the same as in the frame before is not written again: a sheet that does not tear has its
//! faces once. Texture coordinates stand once, and each frame says which it uses.

use super::look::{display_color, linear};
use super::quantities::{ABOUT_ORIGIN_WEIGHTS, ORIGIN_WEIGHTS, ORIGINS, QUANTITIES, linear_color};
use super::sequence::Sequence;
use super::surface::Shape;
use super::twin::Twin;
use super::usd_crate::{CrateWriter, Prim, Property, Value};
use crate::error::IoError;
use crate::files::{Durability, write_streamed};
use charcloth::frame::Frame;
use charcloth::scene::Axis;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

/// What all prims stand below, the mesh, and its material.
const TOP: &str = "charcloth";
const SHEET: &str = "sheet";
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

/// The values of an attribute, frame by frame.
struct Samples {
    name: String,
    type_name: &'static str,
    /// "vertex" for one a point, "uniform" for one a face; empty where that goes without saying.
    interpolation: &'static str,
    about: String,
    values: Vec<Value>,
    /// What the last value was written from.
    last: Array,
}

/// An array as it goes into the file.
#[derive(PartialEq)]
enum Array {
    Ints(Vec<i32>),
    Floats(Vec<[f32; 1]>),
    Float3(Vec<[f32; 3]>),
}

/// Name, type, interpolation, description and values of an attribute in a frame.
type Attribute = (String, &'static str, &'static str, String, Array);

/// The mesh, with the frames so far.
#[derive(Default)]
struct Sheet {
    times: Vec<f64>,
    samples: Vec<Samples>,
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
        for (k, (name, type_name, interpolation, about, array)) in arrays.into_iter().enumerate() {
            if k == self.samples.len() {
                let (values, last) = (Vec::new(), Array::Ints(Vec::new()));
                self.samples.push(Samples { name, type_name, interpolation, about, values, last });
            }
            let samples = &mut self.samples[k];
            let value = match (samples.values.last(), &array) {
                (Some(value), array) if *array == samples.last => *value,
                (_, Array::Ints(values)) => file.ints(values)?,
                (_, Array::Floats(values)) => file.floats(values)?,
                (_, Array::Float3(values)) => file.floats(values)?,
            };
            samples.values.push(value);
            samples.last = array;
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
        let mut all: Vec<Attribute> = vec![
            ("points".into(), "point3f[]", "", "Places [m]".into(), points),
            ("velocities".into(), "vector3f[]", "", "Velocities [m/s]".into(), velocities),
            ("normals".into(), "normal3f[]", "vertex", String::new(), node_rows(&|i| normals[i])),
            ("extent".into(), "float3[]", "", String::new(), Array::Float3(extent(places).to_vec())),
            ("faceVertexCounts".into(), "int[]", "", String::new(), Array::Ints(vec![3; shape.faces.len()])),
            (
                "faceVertexIndices".into(),
                "int[]",
                "",
                String::new(),
                Array::Ints(shape.faces.iter().flatten().map(|v| *v as i32).collect()),
            ),
            ("primvars:st:indices".into(), "int[]", "", String::new(), uv_numbers),
            (
                "primvars:displayColor".into(),
                "color3f[]",
                "vertex",
                "Paper white by brown to black".into(),
                Array::Float3(shape.nodes.iter().map(|i| linear_color(frame, *i as usize)).collect()),
            ),
        ];
        for quantity in QUANTITIES {
            let name = format!("primvars:{}", quantity.name);
            let values = shape.nodes.iter().map(|i| [(quantity.value)(frame, *i as usize) as f32]).collect();
            all.push((name, "float[]", "vertex", quantity.about.to_string(), Array::Floats(values)));
        }
        let rest = node_rows(&|i| motion.rest_position[i]);
        all.push(("primvars:rest".into(), "point3f[]", "vertex", "Place in the stress-free sheet [m]".into(), rest));
        let weights = node_rows(&|i| frame.origins.origin_weights[i]);
        let name = format!("primvars:{ORIGIN_WEIGHTS}");
        all.push((name, "float3[]", "vertex", ABOUT_ORIGIN_WEIGHTS.into(), weights));
        for origin in ORIGINS {
            let values = node_ints(&|i| (origin.value)(frame, i));
            all.push((format!("primvars:{}", origin.name), "int[]", "vertex", origin.about.into(), values));
        }
        let whole: [(_, &str, _); 3] = [
            ("primvars:id", "Number of the node, the same in all frames", node_ints(&|i| i as u32)),
            ("primvars:source", "Point of the input mesh the node comes from", node_ints(&|i| motion.source[i])),
            ("primvars:alive", "1 while the node belongs to the surface", alive),
        ];
        all.extend(whole.map(|(name, about, array)| (name.to_string(), "int[]", "vertex", about.into(), array)));
        let faces: [(_, &str, _); 3] = [
            ("primvars:piece", "Connected piece; 0 is the largest, flakes count up", face_ints(&triangles.piece)),
            ("primvars:source_face", "Face of the input mesh", face_ints(&triangles.source_face)),
            ("primvars:sheet", "Shell of the input mesh", face_ints(&triangles.sheet)),
        ];
        all.extend(faces.map(|(name, about, array)| (name.to_string(), "int[]", "uniform", about.into(), array)));
        all
    }
}

/// Lowest and highest corner of the box around some places [m].
fn extent(places: &[Vec3]) -> [[f32; 3]; 2] {
    let bounds = places.iter().fold(None, |bounds: Option<(Vec3, Vec3)>, p| {
        Some(bounds.map_or((*p, *p), |(low, high)| (low.min(*p), high.max(*p))))
    });
    let (low, high) = bounds.unwrap_or_default();
    [low.to_array(), high.to_array()]
}

/// The tree of prims around the samples.
fn stage<W: Write + Seek>(file: &mut CrateWriter<W>, sheet: &Sheet, sequence: &Sequence<'_>) -> io::Result<Prim> {
    let times = file.times(&sheet.times)?;
    let mut properties = Vec::new();
    for samples in &sheet.samples {
        // What never changes has no samples: readers then know that it does not, most of all the faces.
        let value = match samples.values.as_slice() {
            [only, rest @ ..] if rest.iter().all(|value| value == only) => ("default", *only),
            values => ("timeSamples", file.time_samples(times, values)?),
        };
        let mut fields = vec![("typeName", file.token(samples.type_name)), value];
        if !samples.interpolation.is_empty() {
            fields.push(("interpolation", file.token(samples.interpolation)));
        }
        if !samples.about.is_empty() {
            fields.push(("documentation", file.string(&samples.about)));
        }
        properties.push(attribute(&samples.name, fields));
    }
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
    let top = Prim {
        name: TOP.to_string(),
        type_name: "Xform",
        fields: vec![("kind", file.token("component"))],
        properties: Vec::new(),
        children: vec![mesh, material(file)?],
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
