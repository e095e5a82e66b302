//! What a USD file says of its prims, whichever way it is written down, as far as a mesh needs it.

use std::collections::BTreeMap;

/// A value: numbers and texts in their order, tuples laid out flat.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Value {
    /// The numbers; none where these are texts.
    pub fn numbers(&self) -> Option<&[f64]> {
        match self {
            Self::Numbers(numbers) => Some(numbers),
            Self::Texts(_) => None,
        }
    }

    /// The first text.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Texts(texts) => texts.first().map(String::as_str),
            Self::Numbers(_) => None,
        }
    }
}

/// An attribute of a prim.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Attribute {
    /// Type, such as `point3f[]`.
    pub type_name: String,
    /// How the values are spread over the mesh, such as `faceVarying`; empty where that is not said.
    pub interpolation: String,
    /// The value without a time, or else the first of its samples.
    pub value: Option<Value>,
    /// Whether there are samples.
    pub is_animated: bool,
}

/// A prim.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Prim {
    /// Path, such as `/world/sheet`.
    pub path: String,
    pub type_name: String,
    /// Whether it is defined here and not switched off.
    pub is_defined: bool,
    /// What the prim takes from elsewhere, such as `references`; empty where all is here.
    pub taken: &'static str,
    pub attributes: BTreeMap<String, Attribute>,
}

/// A file: its metadata, and its prims, parents before children.
#[derive(Debug, Default)]
pub(super) struct Layer {
    pub metadata: BTreeMap<String, Value>,
    pub prims: Vec<Prim>,
}

/// Fields by which a prim has more than stands in the file.
pub(super) const TAKEN: [&str; 6] =
    ["references", "payload", "inherits", "specializes", "variantSetNames", "subLayers"];

/// The row of [`TAKEN`] that a field is.
pub(super) fn taken(field: &str) -> Option<&'static str> {
    TAKEN.into_iter().find(|there| *there == field)
}
