//! The container of .usdc files ("crate", version 0.8.0), written front to back.
//!
//! Values come first, each where it falls; what refers to them (tokens, fields, the tree of prims) is kept in memory and
//! written behind. So memory grows with the number of prims and by eight bytes a time sample, and readers load a sample
//! only when they come to its time. There is no written specification: the layout is that of OpenUSD's
//! `pxr/usd/sdf/crateFile.cpp`, and the tests have OpenUSD itself read it.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::hash::Hash;
use std::io::{self, Seek, SeekFrom, Write};

/// Mark and version at the head of the file, and the length of the head.
const MARK: &[u8; 16] = b"PXR-USDC\0\x08\0\0\0\0\0\0";
const HEAD: u64 = 88;
/// Integer arrays shorter than this are not compressed.
const LEAST_COMPRESSED: usize = 16;
/// Ends a set of fields.
const END_OF_SET: u32 = u32::MAX;

/// A value that is in the file: type in bits 48 to 55, place or the value itself below.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Value(u64);

const ARRAY: u64 = 1 << 63;
const INLINED: u64 = 1 << 62;
const COMPRESSED: u64 = 1 << 61;

/// Types of value, by their numbers in the format.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Bool = 1,
    Int = 3,
    Int64 = 5,
    Float = 8,
    Double = 9,
    String = 10,
    Token = 11,
    Float2 = 20,
    Float3 = 24,
    TokenListOp = 32,
    PathListOp = 34,
    TokenVector = 41,
    Specifier = 42,
    Variability = 44,
    TimeSamples = 46,
    DoubleVector = 48,
}

impl Value {
    fn new(kind: Kind, flags: u64, payload: u64) -> Self {
        Self(flags | (kind as u64) << 48 | payload)
    }

    /// A truth value.
    pub fn bool(value: bool) -> Self {
        Self::new(Kind::Bool, INLINED, u64::from(value))
    }

    /// A single-precision number.
    pub fn float(value: f32) -> Self {
        Self::new(Kind::Float, INLINED, u64::from(value.to_bits()))
    }

    /// Marks an attribute that does not change in time.
    pub fn uniform() -> Self {
        Self::new(Kind::Variability, INLINED, 1)
    }

    /// The specifier `def`.
    fn def() -> Self {
        Self::new(Kind::Specifier, INLINED, 0)
    }
}

/// A prim: what stands between its braces in text.
#[derive(Debug, Default)]
pub(super) struct Prim {
    pub name: String,
    pub type_name: &'static str,
    /// Metadata.
    pub fields: Vec<(&'static str, Value)>,
    pub properties: Vec<Property>,
    pub children: Vec<Prim>,
}

/// An attribute or a relationship.
#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub fields: Vec<(&'static str, Value)>,
    /// Path of what an attribute is connected to, or a relationship points at.
    pub target: Option<String>,
    pub is_relationship: bool,
}

/// Numbers things by their first use.
#[derive(Debug)]
struct Numbered<T>(HashMap<T, u32>, Vec<T>);

impl<T: Clone + Hash + Eq> Numbered<T> {
    fn number(&mut self, item: &T) -> u32 {
        match self.0.entry(item.clone()) {
            Entry::Occupied(known) => *known.get(),
            Entry::Vacant(free) => {
                self.1.push(item.clone());
                *free.insert(self.1.len() as u32 - 1)
            }
        }
    }
}

/// Writes a .usdc file.
#[derive(Debug)]
pub(super) struct CrateWriter<W> {
    out: W,
    position: u64,
    tokens: Numbered<String>,
    strings: Vec<u32>,
    fields: Numbered<(u32, Value)>,
    field_sets: Vec<u32>,
    /// Path, set of fields, and type of each prim and property.
    specs: [Vec<i32>; 3],
    /// Number, name and jump of each path, parents before children.
    paths: [Vec<i32>; 3],
}

impl<W: Write + Seek> CrateWriter<W> {
    /// Begins a file.
    pub fn begin(mut out: W) -> io::Result<Self> {
        out.write_all(&[0; HEAD as usize])?;
        let mut writer = Self {
            out,
            position: HEAD,
            tokens: Numbered(HashMap::new(), Vec::new()),
            strings: Vec::new(),
            fields: Numbered(HashMap::new(), Vec::new()),
            field_sets: Vec::new(),
            specs: Default::default(),
            paths: Default::default(),
        };
        // The sign of a name's number tells prims from properties, so no name may have number 0.
        writer.tokens.number(&String::new());
        Ok(writer)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.position += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    /// Writes bytes at a multiple of eight, where readers can use them as they lie; says where.
    fn place(&mut self, bytes: &[u8]) -> io::Result<u64> {
        let gap = self.position.next_multiple_of(8) - self.position;
        self.write(&[0; 8][..gap as usize])?;
        let at = self.position;
        self.write(bytes)?;
        Ok(at)
    }

    /// A name from a closed list.
    pub fn token(&mut self, text: &str) -> Value {
        Value::new(Kind::Token, INLINED, u64::from(self.tokens.number(&text.to_string())))
    }

    /// Text.
    pub fn string(&mut self, text: &str) -> Value {
        let token = self.tokens.number(&text.to_string());
        let number = self.strings.iter().position(|t| *t == token).unwrap_or_else(|| {
            self.strings.push(token);
            self.strings.len() - 1
        });
        Value::new(Kind::String, INLINED, number as u64)
    }

    /// A double-precision number.
    pub fn double(&mut self, value: f64) -> io::Result<Value> {
        let short = value as f32;
        if f64::from(short) == value {
            return Ok(Value::new(Kind::Double, INLINED, u64::from(short.to_bits())));
        }
        Ok(Value::new(Kind::Double, 0, self.place(&value.to_le_bytes())?))
    }

    /// Three single-precision numbers.
    pub fn float3(&mut self, value: [f32; 3]) -> io::Result<Value> {
        let bytes: Vec<u8> = value.iter().flat_map(|v| v.to_le_bytes()).collect();
        Ok(Value::new(Kind::Float3, 0, self.place(&bytes)?))
    }

    /// Names to be put before those of weaker layers.
    pub fn prepended_tokens(&mut self, names: &[&str]) -> io::Result<Value> {
        const HAS_PREPENDED: u8 = 1 << 5;
        let mut bytes = vec![HAS_PREPENDED];
        bytes.extend(self.token_list(names));
        Ok(Value::new(Kind::TokenListOp, 0, self.place(&bytes)?))
    }

    fn token_list(&mut self, names: &[&str]) -> Vec<u8> {
        let mut bytes = (names.len() as u64).to_le_bytes().to_vec();
        names.iter().for_each(|name| bytes.extend(self.tokens.number(&name.to_string()).to_le_bytes()));
        bytes
    }

    /// An array of single-precision numbers, or of two or three of them each.
    pub fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> io::Result<Value> {
        let kind = match N {
            1 => Kind::Float,
            2 => Kind::Float2,
            3 => Kind::Float3,
            _ => unreachable!("rows of {N} have no kind here"),
        };
        if rows.is_empty() {
            return Ok(Value::new(kind, ARRAY, 0));
        }
        let mut bytes = Vec::with_capacity(8 + 4 * N * rows.len());
        bytes.extend((rows.len() as u64).to_le_bytes());
        rows.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        Ok(Value::new(kind, ARRAY, self.place(&bytes)?))
    }

    /// An array of whole numbers.
    pub fn ints(&mut self, values: &[i32]) -> io::Result<Value> {
        if values.is_empty() {
            return Ok(Value::new(Kind::Int, ARRAY, 0));
        }
        let mut bytes = (values.len() as u64).to_le_bytes().to_vec();
        let compressed = values.len() >= LEAST_COMPRESSED;
        if compressed {
            append_sized(&mut bytes, &compressed_integers(values));
        } else {
            values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        Ok(Value::new(Kind::Int, ARRAY | if compressed { COMPRESSED } else { 0 }, self.place(&bytes)?))
    }

    /// An array of whole numbers of 64 bits, not compressed.
    pub fn long_ints(&mut self, values: &[i64]) -> io::Result<Value> {
        if values.is_empty() {
            return Ok(Value::new(Kind::Int64, ARRAY, 0));
        }
        let mut bytes = (values.len() as u64).to_le_bytes().to_vec();
        values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        Ok(Value::new(Kind::Int64, ARRAY, self.place(&bytes)?))
    }

    /// The times that samples are of, in frames; written once and shared by all attributes.
    pub fn times(&mut self, times: &[f64]) -> io::Result<Value> {
        let mut bytes = (times.len() as u64).to_le_bytes().to_vec();
        times.iter().for_each(|t| bytes.extend(t.to_le_bytes()));
        Ok(Value::new(Kind::DoubleVector, 0, self.place(&bytes)?))
    }

    /// Values at times. What is referred to stands behind the distance to it, which is none here.
    pub fn time_samples(&mut self, times: Value, values: &[Value]) -> io::Result<Value> {
        let mut bytes = 8u64.to_le_bytes().to_vec();
        bytes.extend(times.0.to_le_bytes());
        bytes.extend(8u64.to_le_bytes());
        bytes.extend((values.len() as u64).to_le_bytes());
        values.iter().for_each(|value| bytes.extend(value.0.to_le_bytes()));
        Ok(Value::new(Kind::TimeSamples, 0, self.place(&bytes)?))
    }

    /// Writes the tree and ends the file. The root stands for the whole file, its fields for the metadata of the layer.
    pub fn finish(mut self, root: &Prim) -> io::Result<W> {
        let mut numbers = HashMap::new();
        number_paths(root, "", &mut numbers);
        self.add_prim(root, "", false, &numbers)?;

        let mut sections = Vec::new();
        let bytes = self.tokens.1.iter().flat_map(|t| t.bytes().chain([0])).collect::<Vec<u8>>();
        let mut section = (self.tokens.1.len() as u64).to_le_bytes().to_vec();
        section.extend((bytes.len() as u64).to_le_bytes());
        append_sized(&mut section, &compressed(&bytes));
        sections.push(("TOKENS", section));

        let mut section = (self.strings.len() as u64).to_le_bytes().to_vec();
        self.strings.iter().for_each(|t| section.extend(t.to_le_bytes()));
        sections.push(("STRINGS", section));

        let mut section = (self.fields.1.len() as u64).to_le_bytes().to_vec();
        let names: Vec<i32> = self.fields.1.iter().map(|(name, _)| *name as i32).collect();
        append_sized(&mut section, &compressed_integers(&names));
        let values: Vec<u8> = self.fields.1.iter().flat_map(|(_, value)| value.0.to_le_bytes()).collect();
        append_sized(&mut section, &compressed(&values));
        sections.push(("FIELDS", section));

        let mut section = (self.field_sets.len() as u64).to_le_bytes().to_vec();
        let sets: Vec<i32> = self.field_sets.iter().map(|f| *f as i32).collect();
        append_sized(&mut section, &compressed_integers(&sets));
        sections.push(("FIELDSETS", section));

        let mut section = (self.paths[0].len() as u64).to_le_bytes().to_vec();
        section.extend((self.paths[0].len() as u64).to_le_bytes());
        self.paths.iter().for_each(|column| append_sized(&mut section, &compressed_integers(column)));
        sections.push(("PATHS", section));

        let mut section = (self.specs[0].len() as u64).to_le_bytes().to_vec();
        self.specs.iter().for_each(|column| append_sized(&mut section, &compressed_integers(column)));
        sections.push(("SPECS", section));

        let mut contents = (sections.len() as u64).to_le_bytes().to_vec();
        for (name, section) in sections {
            let start = self.place(&section)?;
            let mut padded = [0; 16];
            padded[..name.len()].copy_from_slice(name.as_bytes());
            contents.extend(padded);
            contents.extend(start.to_le_bytes());
            contents.extend((section.len() as u64).to_le_bytes());
        }
        let start = self.place(&contents)?;
        self.out.seek(SeekFrom::Start(0))?;
        self.out.write_all(MARK)?;
        self.out.write_all(&start.to_le_bytes())?;
        self.out.seek(SeekFrom::End(0))?;
        Ok(self.out)
    }

    /// Adds a prim with all below it to the tables.
    fn add_prim(&mut self, prim: &Prim, path: &str, more: bool, numbers: &HashMap<String, i32>) -> io::Result<()> {
        const PRIM: i32 = 6;
        const PSEUDO_ROOT: i32 = 7;
        let is_root = path.is_empty();
        let row = self.add_path(&prim.name, numbers[path], false);
        let mut fields = prim.fields.clone();
        if !is_root {
            fields.push(("specifier", Value::def()));
            if !prim.type_name.is_empty() {
                fields.push(("typeName", self.token(prim.type_name)));
            }
        }
        if !prim.properties.is_empty() {
            let names: Vec<&str> = prim.properties.iter().map(|p| p.name.as_str()).collect();
            fields.push(("properties", self.token_vector(&names)?));
        }
        if !prim.children.is_empty() {
            let names: Vec<&str> = prim.children.iter().map(|p| p.name.as_str()).collect();
            fields.push(("primChildren", self.token_vector(&names)?));
        }
        self.add_spec(numbers[path], &fields, if is_root { PSEUDO_ROOT } else { PRIM });
        for (k, child) in prim.children.iter().enumerate() {
            let more = k + 1 < prim.children.len() || !prim.properties.is_empty();
            self.add_prim(child, &format!("{path}/{}", child.name), more, numbers)?;
        }
        for (k, property) in prim.properties.iter().enumerate() {
            self.add_property(property, path, k + 1 < prim.properties.len(), numbers)?;
        }
        self.set_jump(row, !(prim.children.is_empty() && prim.properties.is_empty()), more);
        Ok(())
    }

    fn add_property(
        &mut self,
        property: &Property,
        prim: &str,
        more: bool,
        numbers: &HashMap<String, i32>,
    ) -> io::Result<()> {
        const ATTRIBUTE: i32 = 1;
        const RELATIONSHIP: i32 = 8;
        let number = numbers[&format!("{prim}.{}", property.name)];
        let row = self.add_path(&property.name, number, true);
        self.set_jump(row, false, more);
        let mut fields = property.fields.clone();
        if let Some(target) = &property.target {
            // One explicit item.
            let mut bytes = vec![0b11];
            bytes.extend(1u64.to_le_bytes());
            bytes.extend(numbers[target].to_le_bytes());
            let value = Value::new(Kind::PathListOp, 0, self.place(&bytes)?);
            fields.push((if property.is_relationship { "targetPaths" } else { "connectionPaths" }, value));
        }
        self.add_spec(number, &fields, if property.is_relationship { RELATIONSHIP } else { ATTRIBUTE });
        Ok(())
    }

    fn token_vector(&mut self, names: &[&str]) -> io::Result<Value> {
        let bytes = self.token_list(names);
        Ok(Value::new(Kind::TokenVector, 0, self.place(&bytes)?))
    }

    fn add_spec(&mut self, path: i32, fields: &[(&str, Value)], kind: i32) {
        let set = self.field_sets.len();
        for (name, value) in fields {
            let name = self.tokens.number(&name.to_string());
            let field = self.fields.number(&(name, *value));
            self.field_sets.push(field);
        }
        self.field_sets.push(END_OF_SET);
        self.specs[0].push(path);
        self.specs[1].push(set as i32);
        self.specs[2].push(kind);
    }

    /// Adds a row to the paths and says which.
    fn add_path(&mut self, name: &str, number: i32, is_property: bool) -> usize {
        let token = self.tokens.number(&name.to_string()) as i32;
        self.paths[0].push(number);
        self.paths[1].push(if is_property { -token } else { token });
        self.paths[2].push(0);
        self.paths[0].len() - 1
    }

    /// Says where to go on from a path once all below it have been added: how far on the next beside it stands if it
    /// has both; else 0 for a next beside it, -1 for something below, -2 for neither.
    fn set_jump(&mut self, row: usize, has_below: bool, has_beside: bool) {
        self.paths[2][row] = match (has_below, has_beside) {
            (true, true) => (self.paths[0].len() - row) as i32,
            (true, false) => -1,
            (false, true) => 0,
            (false, false) => -2,
        };
    }
}

/// Numbers every path of a tree; the root's is "".
fn number_paths(prim: &Prim, path: &str, numbers: &mut HashMap<String, i32>) {
    numbers.insert(path.to_string(), numbers.len() as i32);
    for child in &prim.children {
        number_paths(child, &format!("{path}/{}", child.name), numbers);
    }
    for property in &prim.properties {
        numbers.insert(format!("{path}.{}", property.name), numbers.len() as i32);
    }
}

/// Appends the length of some bytes, and the bytes.
fn append_sized(to: &mut Vec<u8>, bytes: &[u8]) {
    to.extend((bytes.len() as u64).to_le_bytes());
    to.extend(bytes);
}

/// One chunk of LZ4, which is what a 0 in front says.
fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut all = vec![0];
    all.extend(lz4_flex::block::compress(bytes));
    all
}

/// Whole numbers as differences to the one before: the commonest difference, two bits each for "that one" or the width
/// of the difference, then those differences; LZ4 over it all.
fn compressed_integers(values: &[i32]) -> Vec<u8> {
    let differences = || {
        let mut before = 0i32;
        values.iter().map(move |v| {
            let difference = v.wrapping_sub(before);
            before = *v;
            difference
        })
    };
    let mut counts: HashMap<i32, usize> = HashMap::new();
    differences().for_each(|d| *counts.entry(d).or_default() += 1);
    let common = counts.into_iter().max_by_key(|(difference, count)| (*count, *difference)).map_or(0, |(d, _)| d);
    let mut codes = vec![0u8; (2 * values.len()).div_ceil(8)];
    let mut rest = Vec::new();
    for (k, difference) in differences().enumerate() {
        let code = if difference == common {
            0
        } else if let Ok(short) = i8::try_from(difference) {
            rest.extend(short.to_le_bytes());
            1
        } else if let Ok(medium) = i16::try_from(difference) {
            rest.extend(medium.to_le_bytes());
            2
        } else {
            rest.extend(difference.to_le_bytes());
            3
        };
        codes[k / 4] |= code << (2 * (k % 4));
    }
    let mut bytes = common.to_le_bytes().to_vec();
    bytes.extend(codes);
    bytes.extend(rest);
    compressed(&bytes)
}
