//! Attributes of a prim of OpenUSD, frame by frame.
//!
//! A value that is the same as in the frame before is not written again, and what never changes has no time samples:
//! readers then know that it does not.

use super::usd_crate::{CrateWriter, Property, Value};
use std::io::{self, Seek, Write};

/// An array as it goes into the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Array {
    Ints(Vec<i32>),
    LongInts(Vec<i64>),
    Floats(Vec<[f32; 1]>),
    Float3(Vec<[f32; 3]>),
    /// The one of the attribute with this name, which stands before it in the list.
    SameAs(&'static str),
}

/// An attribute in a frame.
#[derive(Debug)]
pub(super) struct Attribute {
    pub name: String,
    pub type_name: &'static str,
    /// "vertex" for one a point, "uniform" for one a face; empty where that goes without saying.
    pub interpolation: &'static str,
    pub about: String,
    pub array: Array,
}

impl Attribute {
    /// An attribute of its own name.
    pub fn plain(name: &str, type_name: &'static str, about: &str, array: Array) -> Self {
        Self { name: name.to_string(), type_name, interpolation: "", about: about.to_string(), array }
    }

    /// A primvar, its type that of the array.
    pub fn primvar(name: &str, interpolation: &'static str, about: &str, array: Array) -> Self {
        let type_name = match array {
            Array::Ints(_) | Array::SameAs(_) => "int[]",
            Array::LongInts(_) => "int64[]",
            Array::Floats(_) => "float[]",
            Array::Float3(_) => "float3[]",
        };
        Self { name: format!("primvars:{name}"), type_name, interpolation, about: about.to_string(), array }
    }

    /// The same of another type that has as many numbers, such as "color3f[]".
    pub fn typed(self, type_name: &'static str) -> Self {
        Self { type_name, ..self }
    }
}

/// The values of an attribute, frame by frame.
#[derive(Debug)]
struct Samples {
    name: String,
    type_name: &'static str,
    interpolation: &'static str,
    about: String,
    values: Vec<Value>,
    /// What the last value was written from.
    last: Array,
}

/// The attributes of a prim, with the frames so far.
#[derive(Debug, Default)]
pub(super) struct Track {
    samples: Vec<Samples>,
}

impl Track {
    /// Writes the attributes of the next frame: the same in each, in the same order.
    pub fn add<W: Write + Seek>(&mut self, file: &mut CrateWriter<W>, attributes: Vec<Attribute>) -> io::Result<()> {
        for (k, Attribute { name, type_name, interpolation, about, array }) in attributes.into_iter().enumerate() {
            if k == self.samples.len() {
                let (values, last) = (Vec::new(), Array::Ints(Vec::new()));
                self.samples.push(Samples { name, type_name, interpolation, about, values, last });
            }
            let value = match (&array, self.samples[k].values.last()) {
                (Array::SameAs(other), _) => {
                    let other = self.samples[..k].iter().find(|samples| samples.name == *other);
                    *other.and_then(|samples| samples.values.last()).expect("it stands before")
                }
                (array, Some(value)) if *array == self.samples[k].last => *value,
                (Array::Ints(values), _) => file.ints(values)?,
                (Array::LongInts(values), _) => file.long_ints(values)?,
                (Array::Floats(values), _) => file.floats(values)?,
                (Array::Float3(values), _) => file.floats(values)?,
            };
            let samples = &mut self.samples[k];
            samples.values.push(value);
            samples.last = array;
        }
        Ok(())
    }

    /// What the prim has, at these times, which are in the file.
    pub fn properties<W: Write + Seek>(&self, file: &mut CrateWriter<W>, times: Value) -> io::Result<Vec<Property>> {
        let mut properties = Vec::new();
        for samples in &self.samples {
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
            properties.push(Property { name: samples.name.clone(), fields, target: None, is_relationship: false });
        }
        Ok(properties)
    }
}
