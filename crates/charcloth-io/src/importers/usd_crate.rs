//! .usdc files ("crate", versions 0.4 to 0.x): tokens, fields and paths are read whole, values where they are asked for.
//!
//! There is no written specification: the layout is that of OpenUSD's `pxr/usd/sdf/crateFile.cpp`. Nothing in the file is
//! trusted: every place is looked up within the bytes, and no more memory is taken than the bytes can account for.

use super::usd_layer::{Attribute, Layer, Prim, Value, taken};

pub(super) const MARK: &[u8] = b"PXR-USDC";
/// LZ4 makes at most so many bytes of one.
const MOST_PER_BYTE: usize = 255;
/// Integer arrays shorter than this are never compressed.
const LEAST_COMPRESSED: usize = 16;
const CUT: &str = "it is cut short or damaged";
/// Ends a set of fields.
const END_OF_SET: u32 = u32::MAX;

/// Reads the prims of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Layer, String> {
    let file = Crate::open(bytes)?;
    let mut layer = Layer::default();
    let mut of_path = vec![None; file.paths.len()];
    // Prims first: attributes go to the prims they belong to, which may stand behind them.
    for spec in file.specs.iter().filter(|spec| [PRIM, ROOT].contains(&spec.kind)) {
        let mut prim = Prim { path: file.path(spec.path), is_defined: spec.kind == ROOT, ..Prim::default() };
        let mut active = true;
        for (name, value) in file.fields(spec.fields)? {
            if let Some(field) = taken(name) {
                prim.taken = field;
                continue;
            }
            match name {
                "specifier" => prim.is_defined = value.payload() == 0,
                "active" => active = value.payload() != 0,
                "typeName" => {
                    prim.type_name = file.value(value)?.and_then(|v| Some(v.text()?.to_string())).unwrap_or_default()
                }
                "metersPerUnit" | "upAxis" | "defaultPrim" if spec.kind == ROOT => {
                    layer.metadata.extend(file.value(value)?.map(|value| (name.to_string(), value)));
                }
                _ => {}
            }
        }
        prim.is_defined &= active;
        if let Some(slot) = of_path.get_mut(spec.path) {
            *slot = Some(layer.prims.len());
        }
        layer.prims.push(prim);
    }
    for spec in file.specs.iter().filter(|spec| spec.kind == ATTRIBUTE) {
        let Some(path) = file.paths.get(spec.path).filter(|path| path.is_property) else { continue };
        let Some(prim) = path.parent.and_then(|parent| of_path.get(parent).copied().flatten()) else { continue };
        // Values of meshes and transforms only: those of a volume or a light may be of any size.
        let name = &file.tokens[path.name];
        let wanted = layer.prims[prim].type_name == "Mesh" || name.starts_with("xformOp") || name == "visibility";
        if !wanted {
            continue;
        }
        let attribute = file.attribute(spec.fields).map_err(|problem| format!("{name}: {problem}"))?;
        layer.prims[prim].attributes.insert(name.clone(), attribute);
    }
    let mut order: Vec<usize> = (0..layer.prims.len()).collect();
    order.sort_by(|a, b| layer.prims[*a].path.cmp(&layer.prims[*b].path));
    layer.prims = order.into_iter().map(|k| layer.prims[k].clone()).collect();
    Ok(layer)
}

const ATTRIBUTE: u32 = 1;
const PRIM: u32 = 6;
const ROOT: u32 = 7;

/// A value that is in the file: type in bits 48 to 55, place or the value itself below.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rep(u64);

impl Rep {
    fn is_array(self) -> bool {
        self.0 >> 63 & 1 == 1
    }
    fn is_inlined(self) -> bool {
        self.0 >> 62 & 1 == 1
    }
    fn is_compressed(self) -> bool {
        self.0 >> 61 & 1 == 1
    }
    fn kind(self) -> u8 {
        (self.0 >> 48) as u8
    }
    fn payload(self) -> u64 {
        self.0 & ((1 << 48) - 1)
    }
}

/// A prim or property, by its name below another.
struct Path {
    parent: Option<usize>,
    name: usize,
    is_property: bool,
}

struct Spec {
    path: usize,
    fields: usize,
    kind: u32,
}

struct Crate<'a> {
    bytes: &'a [u8],
    version: [u8; 3],
    tokens: Vec<String>,
    strings: Vec<u32>,
    fields: Vec<(usize, Rep)>,
    field_sets: Vec<u32>,
    paths: Vec<Path>,
    specs: Vec<Spec>,
}

/// A place in the bytes to read on from.
#[derive(Clone, Copy)]
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).ok_or(CUT)?;
        let taken = self.bytes.get(self.at..end).ok_or(CUT)?;
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn u32(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn u64(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// A number of things of which at least one stands in so many bytes of the rest.
    fn count(&mut self, most_per_byte: usize) -> Result<usize, String> {
        let count = usize::try_from(self.u64()?).map_err(|_| CUT)?;
        let left = self.bytes.len() - self.at;
        if count > left.saturating_mul(most_per_byte) { Err(CUT.to_string()) } else { Ok(count) }
    }

    /// Bytes behind their number.
    fn sized(&mut self) -> Result<&'a [u8], String> {
        let count = self.count(1)?;
        self.take(count)
    }
}

/// Undoes LZ4 in chunks: their number in a byte, 0 for a single one without a length.
fn decompressed(bytes: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let damaged = |_| CUT.to_string();
    if size > bytes.len().saturating_mul(MOST_PER_BYTE) {
        return Err(CUT.to_string());
    }
    let (chunks, rest) = bytes.split_first().ok_or(CUT)?;
    let all = if *chunks == 0 {
        lz4_flex::block::decompress(rest, size).map_err(damaged)?
    } else {
        let mut cursor = Cursor { bytes: rest, at: 0 };
        let mut all: Vec<u8> = Vec::new();
        for _ in 0..*chunks {
            let length = cursor.u32()? as usize;
            let left = size.checked_sub(all.len()).ok_or(CUT)?;
            all.extend(lz4_flex::block::decompress(cursor.take(length)?, left).map_err(damaged)?);
        }
        all
    };
    if all.len() == size { Ok(all) } else { Err(CUT.to_string()) }
}

/// Undoes what whole numbers are packed by: differences to the one before, as the commonest or in one, two or four bytes.
fn integers(bytes: &[u8], count: usize) -> Result<Vec<i32>, String> {
    if count == 0 {
        return Ok(Vec::new());
    }
    // A quarter of a byte a number at least, before LZ4.
    if count > bytes.len().saturating_mul(4 * MOST_PER_BYTE) {
        return Err(CUT.to_string());
    }
    let most = 4 + (2 * count).div_ceil(8) + 4 * count;
    let unpacked = unpack_at_most(bytes, most)?;
    let mut cursor = Cursor { bytes: &unpacked, at: 0 };
    let common = cursor.u32()? as i32;
    let codes = cursor.take((2 * count).div_ceil(8))?;
    let mut value = 0i32;
    (0..count)
        .map(|k| {
            let difference = match codes[k / 4] >> (2 * (k % 4)) & 3 {
                0 => common,
                1 => i32::from(i8::from_le_bytes(cursor.array()?)),
                2 => i32::from(i16::from_le_bytes(cursor.array()?)),
                _ => i32::from_le_bytes(cursor.array()?),
            };
            value = value.wrapping_add(difference);
            Ok(value)
        })
        .collect()
}

/// Undoes LZ4 where only the most that comes out is known.
fn unpack_at_most(bytes: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let (chunks, rest) = bytes.split_first().ok_or(CUT)?;
    if *chunks != 0 {
        return Err("it has arrays of more than 2 GB".to_string());
    }
    let mut all = vec![0; most.min(rest.len().saturating_mul(MOST_PER_BYTE))];
    let length = lz4_flex::block::decompress_into(rest, &mut all).map_err(|_| CUT)?;
    all.truncate(length);
    Ok(all)
}

impl<'a> Crate<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let mut head = Cursor { bytes, at: MARK.len() };
        let [major, minor, patch, ..] = head.array::<8>()?;
        let version = [major, minor, patch];
        if major != 0 || minor < 4 {
            return Err(format!("it is a crate of version {major}.{minor}.{patch}, and 0.4 and later are read"));
        }
        let mut contents = Cursor { bytes, at: usize::try_from(head.u64()?).map_err(|_| CUT)? };
        let count = contents.u64()?;
        let mut sections = Vec::new();
        for _ in 0..count {
            let name = contents.array::<16>()?;
            let (start, size) = (contents.u64()? as usize, contents.u64()? as usize);
            let section = start.checked_add(size).and_then(|end| bytes.get(start..end)).ok_or(CUT)?;
            sections.push((name, section));
        }
        let section = |name: &str| {
            let found = sections.iter().find(|(there, _)| there.starts_with(name.as_bytes()) && there[name.len()] == 0);
            found.map(|(_, bytes)| Cursor { bytes, at: 0 }).ok_or(format!("it has no section {name}"))
        };
        let mut file = Self {
            bytes,
            version,
            tokens: Vec::new(),
            strings: Vec::new(),
            fields: Vec::new(),
            field_sets: Vec::new(),
            paths: Vec::new(),
            specs: Vec::new(),
        };

        let mut part = section("TOKENS")?;
        let count = part.count(MOST_PER_BYTE)?;
        let size = part.count(MOST_PER_BYTE)?;
        let text = decompressed(part.sized()?, size)?;
        file.tokens = text.split(|b| *b == 0).take(count).map(|t| String::from_utf8_lossy(t).into_owned()).collect();
        if file.tokens.len() != count {
            return Err(CUT.to_string());
        }

        let mut part = section("STRINGS")?;
        let count = part.count(1)?;
        file.strings = (0..count).map(|_| part.u32()).collect::<Result<_, _>>()?;

        let mut part = section("FIELDS")?;
        let count = part.count(4 * MOST_PER_BYTE)?;
        let names = integers(part.sized()?, count)?;
        let reps = decompressed(part.sized()?, count.checked_mul(8).ok_or(CUT)?)?;
        for (name, rep) in names.iter().zip(reps.chunks_exact(8)) {
            let name = file.token_number(*name)?;
            file.fields.push((name, Rep(Cursor { bytes: rep, at: 0 }.u64()?)));
        }

        let mut part = section("FIELDSETS")?;
        let count = part.count(4 * MOST_PER_BYTE)?;
        file.field_sets = integers(part.sized()?, count)?.into_iter().map(|field| field as u32).collect();

        file.read_paths(section("PATHS")?)?;

        let mut part = section("SPECS")?;
        let count = part.count(4 * MOST_PER_BYTE)?;
        let mut columns = [const { Vec::new() }; 3];
        for column in &mut columns {
            *column = integers(part.sized()?, count)?;
        }
        let [paths, fields, kinds] = columns;
        for k in 0..count {
            let number = |value: i32, most: usize| usize::try_from(value).ok().filter(|v| *v < most).ok_or(CUT);
            let (path, fields) = (number(paths[k], file.paths.len())?, number(fields[k], file.field_sets.len())?);
            file.specs.push(Spec { path, fields, kind: kinds[k] as u32 });
        }
        Ok(file)
    }

    fn token_number(&self, number: i32) -> Result<usize, String> {
        usize::try_from(number).ok().filter(|n| *n < self.tokens.len()).ok_or(CUT.to_string())
    }

    /// The tree of paths: each row has a name and says whether the next row is below it, beside it or elsewhere.
    fn read_paths(&mut self, mut part: Cursor<'_>) -> Result<(), String> {
        let most = part.count(4 * MOST_PER_BYTE)?;
        let count = part.count(4 * MOST_PER_BYTE)?;
        let mut columns = [const { Vec::new() }; 3];
        for column in &mut columns {
            *column = integers(part.sized()?, count)?;
        }
        let [numbers, names, jumps] = columns;
        // Paths that are in use, and a few that are not.
        if most > 2 * count + 64 {
            return Err(CUT.to_string());
        }
        self.paths.extend((0..most).map(|_| Path { parent: None, name: 0, is_property: false }));
        let mut seen = vec![false; count];
        let mut waiting = if count > 0 { vec![(0, None)] } else { Vec::new() };
        while let Some((mut row, mut parent)) = waiting.pop() {
            loop {
                if row >= count || std::mem::replace(&mut seen[row], true) {
                    return Err(CUT.to_string());
                }
                let number = usize::try_from(numbers[row]).ok().filter(|n| *n < most).ok_or(CUT)?;
                let name = self.token_number(names[row].checked_abs().ok_or(CUT)?)?;
                self.paths[number] = Path { parent, name, is_property: names[row] < 0 };
                let (has_below, has_beside) = (jumps[row] > 0 || jumps[row] == -1, jumps[row] >= 0);
                if has_below && has_beside {
                    waiting.push((row + jumps[row] as usize, parent));
                }
                if has_below {
                    parent = Some(number);
                }
                if !has_below && !has_beside {
                    break;
                }
                row += 1;
            }
        }
        // A number that stands in two rows could make a path its own parent.
        for start in 0..most {
            let (mut at, mut steps) = (Some(start), 0);
            while let Some(path) = at {
                at = self.paths[path].parent;
                steps += 1;
                if steps > MOST_DEEP {
                    return Err(format!("its prims are more than {MOST_DEEP} deep"));
                }
            }
        }
        Ok(())
    }

    /// A path as text; that of the root is "/".
    fn path(&self, number: usize) -> String {
        let mut names = Vec::new();
        let mut at = number;
        while let Some(parent) = self.paths[at].parent {
            names.push(self.tokens[self.paths[at].name].as_str());
            at = parent;
        }
        names.reverse();
        format!("/{}", names.join("/"))
    }

    /// Names and values of a set of fields.
    fn fields(&self, first: usize) -> Result<Vec<(&str, Rep)>, String> {
        let set = self.field_sets[first..].iter().take_while(|field| **field != END_OF_SET);
        set.map(|field| {
            let (name, rep) = self.fields.get(*field as usize).ok_or(CUT)?;
            Ok((self.tokens[*name].as_str(), *rep))
        })
        .collect()
    }

    fn attribute(&self, fields: usize) -> Result<Attribute, String> {
        let mut attribute = Attribute::default();
        let mut sampled = None;
        let text =
            |rep| Ok::<_, String>(self.value(rep)?.and_then(|v| Some(v.text()?.to_string())).unwrap_or_default());
        for (name, rep) in self.fields(fields)? {
            match name {
                "typeName" => attribute.type_name = text(rep)?,
                "interpolation" => attribute.interpolation = text(rep)?,
                "default" => attribute.value = self.value(rep)?,
                "timeSamples" => sampled = self.first_sample(rep)?,
                _ => {}
            }
        }
        attribute.is_animated = sampled.is_some();
        attribute.value = attribute.value.or(sampled);
        Ok(attribute)
    }

    /// The value of the earliest of some time samples.
    fn first_sample(&self, rep: Rep) -> Result<Option<Value>, String> {
        const TIME_SAMPLES: u8 = 46;
        if rep.kind() != TIME_SAMPLES || rep.is_inlined() {
            return Ok(None);
        }
        // What is referred to stands behind the distance to it.
        let follow = |at: usize| -> Result<Cursor<'a>, String> {
            let distance = Cursor { bytes: self.bytes, at }.u64()? as i64;
            let to = (at as i64).checked_add(distance).and_then(|to| usize::try_from(to).ok()).ok_or(CUT)?;
            Ok(Cursor { bytes: self.bytes, at: to })
        };
        let mut times = follow(rep.payload() as usize)?;
        times.u64()?;
        let mut values = follow(times.at)?;
        match values.u64()? {
            0 => Ok(None),
            _ => self.value(Rep(values.u64()?)),
        }
    }

    /// A value; none where it is of a kind that no mesh needs.
    fn value(&self, rep: Rep) -> Result<Option<Value>, String> {
        let token = |number: usize| self.tokens.get(number).cloned().ok_or(CUT.to_string());
        let numbers =
            |scalar: Scalar, width: usize| Ok::<_, String>(Some(Value::Numbers(self.numbers(rep, scalar, width)?)));
        match rep.kind() {
            1 | 2 => numbers(Scalar::Byte, 1),
            3 => numbers(Scalar::Int, 1),
            4 => numbers(Scalar::Uint, 1),
            7 => numbers(Scalar::Half, 1),
            8 => numbers(Scalar::Float, 1),
            9 | 48 => numbers(Scalar::Double, 1),
            15 => numbers(Scalar::Double, 16),
            16 => numbers(Scalar::Double, 4),
            17 => numbers(Scalar::Float, 4),
            18 => numbers(Scalar::Half, 4),
            19 => numbers(Scalar::Double, 2),
            20 => numbers(Scalar::Float, 2),
            21 => numbers(Scalar::Half, 2),
            23 => numbers(Scalar::Double, 3),
            24 => numbers(Scalar::Float, 3),
            25 => numbers(Scalar::Half, 3),
            27 => numbers(Scalar::Double, 4),
            28 => numbers(Scalar::Float, 4),
            29 => numbers(Scalar::Half, 4),
            10 if rep.is_inlined() => {
                let number = *self.strings.get(rep.payload() as usize).ok_or(CUT)?;
                Ok(Some(Value::Texts(vec![token(number as usize)?])))
            }
            11 if rep.is_inlined() => Ok(Some(Value::Texts(vec![token(rep.payload() as usize)?]))),
            // Tokens in an array or a vector.
            11 | 41 => {
                if rep.payload() == 0 {
                    return Ok(Some(Value::Texts(Vec::new())));
                }
                let mut cursor = Cursor { bytes: self.bytes, at: rep.payload() as usize };
                let count = if rep.is_array() { self.array_size(&mut cursor)? } else { cursor.count(1)? };
                let texts = (0..count).map(|_| token(cursor.u32()? as usize)).collect::<Result<_, String>>()?;
                Ok(Some(Value::Texts(texts)))
            }
            _ => Ok(None),
        }
    }

    /// The number of elements at the head of an array.
    fn array_size(&self, cursor: &mut Cursor<'_>) -> Result<usize, String> {
        let [_, minor, _] = self.version;
        if minor < 5 {
            cursor.u32()?;
        }
        let count = if minor < 7 { u64::from(cursor.u32()?) } else { cursor.u64()? };
        usize::try_from(count)
            .ok()
            .filter(|n| *n <= cursor.bytes.len().saturating_mul(4 * MOST_PER_BYTE))
            .ok_or(CUT.into())
    }

    /// Numbers of a value or an array, so many to an element.
    fn numbers(&self, rep: Rep, scalar: Scalar, width: usize) -> Result<Vec<f64>, String> {
        let payload = rep.payload();
        if rep.is_inlined() {
            return Ok(inlined(payload as u32, scalar, width));
        }
        if rep.is_array() && payload == 0 {
            return Ok(Vec::new());
        }
        let mut cursor = Cursor { bytes: self.bytes, at: usize::try_from(payload).map_err(|_| CUT)? };
        let count = match (rep.is_array(), rep.kind()) {
            (true, _) => self.array_size(&mut cursor)?,
            // The vector of times.
            (false, 48) => cursor.count(1)?,
            (false, _) => 1,
        };
        if rep.is_compressed() && count >= LEAST_COMPRESSED {
            return self.compressed(&mut cursor, scalar, width, count);
        }
        let size = count.checked_mul(width * scalar.size()).ok_or(CUT)?;
        Ok(cursor.take(size)?.chunks_exact(scalar.size()).map(|bytes| scalar.number(bytes)).collect())
    }

    fn compressed(
        &self,
        cursor: &mut Cursor<'_>,
        scalar: Scalar,
        width: usize,
        count: usize,
    ) -> Result<Vec<f64>, String> {
        let unknown = || "it has an array in a compression that is not known here".to_string();
        if width != 1 {
            return Err(unknown());
        }
        match scalar {
            Scalar::Int => Ok(integers(cursor.sized()?, count)?.into_iter().map(f64::from).collect()),
            Scalar::Uint => Ok(integers(cursor.sized()?, count)?.into_iter().map(|v| f64::from(v as u32)).collect()),
            Scalar::Byte => Err(unknown()),
            Scalar::Half | Scalar::Float | Scalar::Double => match cursor.array::<1>()? {
                // All of them whole.
                [b'i'] => Ok(integers(cursor.sized()?, count)?.into_iter().map(f64::from).collect()),
                // Few that come again: a table, and rows of it.
                [b't'] => {
                    let rows = cursor.u32()? as usize;
                    let size = rows.checked_mul(scalar.size()).ok_or(CUT)?;
                    let table: Vec<f64> =
                        cursor.take(size)?.chunks_exact(scalar.size()).map(|bytes| scalar.number(bytes)).collect();
                    let numbers = integers(cursor.sized()?, count)?;
                    numbers.into_iter().map(|row| table.get(row as usize).copied().ok_or(CUT.into())).collect()
                }
                _ => Err(unknown()),
            },
        }
    }
}

/// Deepest tree of prims that is followed.
const MOST_DEEP: usize = 1000;

/// Types of number.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scalar {
    Byte,
    Int,
    Uint,
    Half,
    Float,
    Double,
}

impl Scalar {
    fn size(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Half => 2,
            Self::Int | Self::Uint | Self::Float => 4,
            Self::Double => 8,
        }
    }

    /// A number of its bytes; there must be as many as its size.
    fn number(self, bytes: &[u8]) -> f64 {
        let mut padded = [0; 8];
        padded[..bytes.len()].copy_from_slice(bytes);
        let word = u64::from_le_bytes(padded);
        match self {
            Self::Byte => word as f64,
            Self::Int => f64::from(word as u32 as i32),
            Self::Uint => f64::from(word as u32),
            Self::Half => half(word as u16),
            Self::Float => f64::from(f32::from_bits(word as u32)),
            Self::Double => f64::from_bits(word),
        }
    }
}

/// A number of half precision (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// A value that stands in 32 bits: vectors and the diagonals of matrices as small whole numbers, a byte each.
fn inlined(bits: u32, scalar: Scalar, width: usize) -> Vec<f64> {
    let bytes = bits.to_le_bytes().map(|b| f64::from(b as i8));
    match (width, scalar) {
        // A double that single precision holds.
        (1, Scalar::Double) => vec![f64::from(f32::from_bits(bits))],
        (1, _) => vec![scalar.number(&bits.to_le_bytes()[..scalar.size()])],
        (16, _) => (0..16).map(|k| if k % 5 == 0 { bytes[k / 5] } else { 0.0 }).collect(),
        _ => bytes[..width.min(4)].to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_that_of_the_standard() {
        for (bits, value) in [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (0x0001, 5.960_464_477_539_063e-8)] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }
}
