//! Columns in and out of `.npz`, numpy's own archive: a zip of one `.npy` a column.

use super::npy::Header;
use charcloth::fields::{Data, DataMut};
use glam::{DVec3, Vec2};
use std::io::{self, Cursor, Read, Seek, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// How `f64` columns are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Precision {
    /// As `f32`: to look at.
    Single,
    /// As `f64`: to go on from.
    Full,
}

/// The type of the numbers in an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    F64,
    F32,
    U64,
    U32,
    U8,
}

impl Kind {
    /// numpy's name of the type in files.
    pub fn descriptor(self) -> &'static str {
        match self {
            Self::F64 => "<f8",
            Self::F32 => "<f4",
            Self::U64 => "<u8",
            Self::U32 => "<u4",
            Self::U8 => "|u1",
        }
    }

    /// numpy's name of the type in programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "float64",
            Self::F32 => "float32",
            Self::U64 => "uint64",
            Self::U32 => "uint32",
            Self::U8 => "uint8",
        }
    }

    fn size(self) -> usize {
        match self {
            Self::F64 | Self::U64 => 8,
            Self::F32 | Self::U32 => 4,
            Self::U8 => 1,
        }
    }
}

/// Type and shape of one row of a column.
pub(super) fn layout(data: &Data<'_>, precision: Precision) -> (Kind, &'static [u64]) {
    let float = if precision == Precision::Single { Kind::F32 } else { Kind::F64 };
    match data {
        Data::F64(_) => (float, &[]),
        Data::F64x3(_) => (float, &[3]),
        Data::U32(_) => (Kind::U32, &[]),
        Data::U32x2(_) => (Kind::U32, &[2]),
        Data::U32x3(_) => (Kind::U32, &[3]),
        Data::F32x3x2(_) => (Kind::F32, &[3, 2]),
        Data::U8(_) => (Kind::U8, &[]),
    }
}

/// Writes arrays into an archive.
pub(super) struct NpzWriter<W: Write + Seek> {
    zip: ZipWriter<W>,
    options: SimpleFileOptions,
}

impl<W: Write + Seek> NpzWriter<W> {
    /// Starts an archive, deflated at a level from 1 to 9, or stored as it is at level 0.
    pub fn new(writer: W, level: u8) -> Self {
        let options = SimpleFileOptions::default();
        let options = match level {
            0 => options.compression_method(CompressionMethod::Stored),
            _ => options.compression_method(CompressionMethod::Deflated).compression_level(Some(i64::from(level))),
        };
        Self { zip: ZipWriter::new(writer), options }
    }

    /// Adds a column, one row an element.
    pub fn column(&mut self, name: &str, data: &Data<'_>, precision: Precision) -> io::Result<()> {
        let (kind, row) = layout(data, precision);
        let shape: Vec<u64> = std::iter::once(data.len() as u64).chain(row.iter().copied()).collect();
        let mut bytes = Vec::with_capacity(shape.iter().product::<u64>() as usize * kind.size());
        let mut float = |value: f64| match precision {
            Precision::Single => bytes.extend((value as f32).to_le_bytes()),
            Precision::Full => bytes.extend(value.to_le_bytes()),
        };
        match data {
            Data::F64(d) => d.iter().for_each(|v| float(*v)),
            Data::F64x3(d) => d.iter().for_each(|v| v.to_array().into_iter().for_each(&mut float)),
            Data::U32(d) => d.iter().for_each(|v| bytes.extend(v.to_le_bytes())),
            Data::U32x2(d) => d.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes())),
            Data::U32x3(d) => d.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes())),
            Data::F32x3x2(d) => d.iter().flatten().for_each(|v| {
                bytes.extend(v.x.to_le_bytes());
                bytes.extend(v.y.to_le_bytes());
            }),
            Data::U8(d) => bytes.extend_from_slice(d),
        }
        self.array(name, kind, &shape, &bytes)
    }

    /// Adds a single `float64`.
    pub fn f64(&mut self, name: &str, value: f64) -> io::Result<()> {
        self.array(name, Kind::F64, &[], &value.to_le_bytes())
    }

    /// Adds a single `uint32`.
    pub fn u32(&mut self, name: &str, value: u32) -> io::Result<()> {
        self.array(name, Kind::U32, &[], &value.to_le_bytes())
    }

    /// Adds a single `uint64`.
    pub fn u64(&mut self, name: &str, value: u64) -> io::Result<()> {
        self.array(name, Kind::U64, &[], &value.to_le_bytes())
    }

    fn array(&mut self, name: &str, kind: Kind, shape: &[u64], bytes: &[u8]) -> io::Result<()> {
        // Entries of 4 GiB and more need the long form of the zip records.
        let options = self.options.large_file(bytes.len() >= u32::MAX as usize - 4096);
        self.zip.start_file(format!("{name}.npy"), options)?;
        let header = Header { descriptor: kind.descriptor().to_owned(), fortran_order: false, shape: shape.to_owned() };
        self.zip.write_all(&header.write())?;
        self.zip.write_all(bytes)
    }

    /// Ends the archive.
    pub fn finish(self) -> io::Result<()> {
        self.zip.finish()?.flush()
    }
}

/// One array as read: its numbers are still bytes, little endian, last index fastest.
pub(super) struct Array {
    kind: Kind,
    shape: Vec<u64>,
    bytes: Vec<u8>,
}

/// Reads arrays from an archive that is held in memory.
pub(super) struct NpzReader {
    zip: ZipArchive<Cursor<Vec<u8>>>,
}

impl NpzReader {
    /// Opens an archive; the error is what is wrong with it.
    pub fn new(bytes: Vec<u8>) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| format!("not a sound archive ({error})"))?;
        Ok(Self { zip })
    }

    /// Names of the arrays.
    pub fn names(&self) -> Vec<String> {
        let names = self.zip.file_names().map(|name| name.map_or_else(|_| "?".to_string(), |name| name.to_string()));
        names.map(|name| name.trim_end_matches(".npy").to_string()).collect()
    }

    /// Whether there is an array of a name.
    pub fn has(&self, name: &str) -> bool {
        self.zip.index_for_name(&format!("{name}.npy")).is_some()
    }

    /// Reads one array, checking it against its checksum and its shape; the error is what is wrong with it.
    pub fn array(&mut self, name: &str) -> Result<Array, String> {
        let damaged = |error: io::Error| format!("the array {name} is damaged ({error})");
        let mut file = self.zip.by_name(&format!("{name}.npy")).map_err(|error| match error {
            zip::result::ZipError::FileNotFound => format!("it has no array {name}"),
            other => format!("the array {name} is damaged ({other})"),
        })?;
        let mut all = Vec::new();
        file.read_to_end(&mut all).map_err(damaged)?;
        let (header, rest) =
            Header::read(&all).map_err(|problem| format!("the array {name} is damaged ({problem})"))?;
        let Header { descriptor, fortran_order, shape } = header;
        let kinds = [Kind::F64, Kind::F32, Kind::U64, Kind::U32, Kind::U8];
        let Some(kind) = kinds.into_iter().find(|k| k.descriptor() == descriptor) else {
            return Err(format!("the array {name} is of type {descriptor}, which this version does not know"));
        };
        if fortran_order && shape.len() > 1 {
            return Err(format!("the array {name} is in Fortran order; write it with numpy.ascontiguousarray"));
        }
        let count = shape.iter().try_fold(kind.size() as u64, |product, n| product.checked_mul(*n));
        if count != Some(rest.len() as u64) {
            return Err(format!("the array {name} is cut short"));
        }
        let start = all.len() - rest.len();
        all.drain(..start);
        Ok(Array { kind, shape, bytes: all })
    }

    /// Reads a single number; whole numbers up to 2^53 are exact.
    pub fn number(&mut self, name: &str) -> Result<f64, String> {
        let array = self.array(name)?;
        match (array.kind, array.shape.is_empty()) {
            (Kind::F64 | Kind::F32, true) => Ok(array.floats()[0]),
            (Kind::U32, true) => Ok(f64::from(array.words()[0])),
            _ => Err(format!("the array {name} is not a single number")),
        }
    }

    /// Reads a single 64-bit word.
    pub fn word(&mut self, name: &str) -> Result<u64, String> {
        let array = self.array(name)?;
        match (array.kind, <[u8; 8]>::try_from(array.bytes)) {
            (Kind::U64, Ok(bytes)) => Ok(u64::from_le_bytes(bytes)),
            _ => Err(format!("the array {name} is not a single 64-bit word")),
        }
    }

    /// Reads a column; the error is what is wrong with it.
    pub fn fill(&mut self, name: &str, column: DataMut<'_>) -> Result<(), String> {
        let array = self.array(name)?;
        let row: &[u64] = match column {
            DataMut::F64(_) | DataMut::U32(_) | DataMut::U8(_) => &[],
            DataMut::F64x3(_) | DataMut::U32x3(_) => &[3],
            DataMut::U32x2(_) => &[2],
            DataMut::F32x3x2(_) => &[3, 2],
        };
        let fits_shape = array.shape.len() == row.len() + 1 && array.shape[1..] == *row;
        let fits_kind = match column {
            DataMut::F64(_) | DataMut::F64x3(_) => matches!(array.kind, Kind::F64 | Kind::F32),
            DataMut::F32x3x2(_) => array.kind == Kind::F32,
            DataMut::U32(_) | DataMut::U32x2(_) | DataMut::U32x3(_) => array.kind == Kind::U32,
            DataMut::U8(_) => array.kind == Kind::U8,
        };
        if !fits_shape || !fits_kind {
            let (shape, kind) = (&array.shape, array.kind.name());
            return Err(format!("the array {name} holds {kind} of shape {shape:?}, which is not what belongs there"));
        }
        match column {
            DataMut::F64(d) => *d = array.floats(),
            DataMut::F64x3(d) => {
                *d = array.floats().chunks_exact(3).map(|c| DVec3::new(c[0], c[1], c[2])).collect();
            }
            DataMut::U32(d) => *d = array.words(),
            DataMut::U32x2(d) => *d = array.words().chunks_exact(2).map(|c| [c[0], c[1]]).collect(),
            DataMut::U32x3(d) => *d = array.words().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            DataMut::F32x3x2(d) => {
                let float = |k: &[u8]| f32::from_le_bytes([k[0], k[1], k[2], k[3]]);
                let pair = |c: &[u8]| Vec2::new(float(&c[..4]), float(&c[4..]));
                *d = array.bytes.chunks_exact(24).map(|c| [pair(&c[..8]), pair(&c[8..16]), pair(&c[16..])]).collect();
            }
            DataMut::U8(d) => *d = array.bytes,
        }
        Ok(())
    }
}

impl Array {
    fn floats(&self) -> Vec<f64> {
        match self.kind {
            Kind::F32 => {
                let rows = self.bytes.chunks_exact(4);
                rows.map(|c| f64::from(f32::from_le_bytes([c[0], c[1], c[2], c[3]]))).collect()
            }
            _ => {
                let rows = self.bytes.chunks_exact(8);
                rows.map(|c| f64::from_le_bytes([c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]])).collect()
            }
        }
    }

    fn words(&self) -> Vec<u32> {
        self.bytes.chunks_exact(4).map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect()
    }
}
