//! The container of .abc files ("Ogawa") and Alembic's properties in it, written front to back.
//!
//! A file is a tree of groups and data, children before parents; a group is a list of places, whose top bit tells data
//! from groups. So samples go to the file as they come and memory grows by their places only. There is no written
//! specification: the layout is that of Alembic's `lib/Alembic/AbcCoreOgawa`.

use std::io::{self, Seek, SeekFrom, Write};

/// Marks the place of data; alone, it is data of no length.
const DATA: u64 = 1 << 63;
/// A group without children.
const EMPTY_GROUP: u64 = 0;
/// Metadata of properties that have none.
const NO_METADATA: u32 = 0;

/// Types of number, by their numbers in the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pod {
    Uint32 = 5,
    Int32 = 6,
    Uint64 = 7,
    Float32 = 10,
    Float64 = 11,
}

/// A property with a value for every frame.
#[derive(Debug)]
pub(super) struct Property {
    name: &'static str,
    metadata: u32,
    pod: Pod,
    /// Numbers of an element.
    extent: u32,
    is_scalar: bool,
    /// Place of the sample of each frame.
    samples: Vec<u64>,
    /// Bytes of the last sample.
    last: Vec<u8>,
}

/// What a compound property holds.
#[derive(Debug)]
pub(super) enum Item {
    Property(Property),
    Compound { name: &'static str, metadata: u32, items: Vec<Item> },
}

/// What stands below the top of the tree.
#[derive(Debug)]
pub(super) struct Object {
    pub name: &'static str,
    /// Number of its metadata.
    pub metadata: u32,
    pub items: Vec<Item>,
}

/// Writes a .abc file.
#[derive(Debug)]
pub(super) struct OgawaWriter<W> {
    out: W,
    position: u64,
    /// Texts that properties and objects refer to by their number, from 1 on.
    metadata: Vec<String>,
    /// Over all samples so far.
    hash: [u8; 16],
}

impl<W: Write + Seek> OgawaWriter<W> {
    /// Begins a file.
    pub fn begin(mut out: W) -> io::Result<Self> {
        // The byte behind the name is 0xff once the file is complete; the place of the root comes last, too.
        out.write_all(b"Ogawa\0\0\x01\0\0\0\0\0\0\0\0")?;
        Ok(Self { out, position: 16, metadata: Vec::new(), hash: [0; 16] })
    }

    /// The number of a metadata text, `key=value` pairs parted by semicolons.
    pub fn metadata(&mut self, text: &str) -> u32 {
        let known = self.metadata.iter().position(|there| there == text);
        let number = known.unwrap_or_else(|| {
            self.metadata.push(text.to_string());
            self.metadata.len() - 1
        });
        number as u32 + 1
    }

    /// A property without samples.
    pub fn property(&mut self, name: &'static str, metadata: &str, pod: Pod, extent: u32, is_scalar: bool) -> Property {
        let metadata = if metadata.is_empty() { NO_METADATA } else { self.metadata(metadata) };
        Property { name, metadata, pod, extent, is_scalar, samples: Vec::new(), last: Vec::new() }
    }

    /// Adds the sample of the next frame; one that is as the last is not written again.
    pub fn add_sample(&mut self, property: &mut Property, bytes: Vec<u8>) -> io::Result<()> {
        if let Some(last) = property.samples.last().filter(|_| property.last == bytes) {
            property.samples.push(*last);
            return Ok(());
        }
        let place = if bytes.is_empty() {
            DATA
        } else {
            let key = murmur(&bytes);
            self.hash = murmur(&[self.hash, key].concat());
            self.data(&[&key, bytes.as_slice()])?
        };
        property.samples.push(place);
        property.last = bytes;
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.position += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    fn data(&mut self, parts: &[&[u8]]) -> io::Result<u64> {
        let place = self.position;
        self.write(&parts.iter().map(|part| part.len() as u64).sum::<u64>().to_le_bytes())?;
        for part in parts {
            self.write(part)?;
        }
        Ok(place | DATA)
    }

    fn group(&mut self, children: &[u64]) -> io::Result<u64> {
        if children.is_empty() {
            return Ok(EMPTY_GROUP);
        }
        let place = self.position;
        let mut bytes = (children.len() as u64).to_le_bytes().to_vec();
        children.iter().for_each(|child| bytes.extend(child.to_le_bytes()));
        self.write(&bytes)?;
        Ok(place)
    }

    /// Writes a compound property: a group of its properties, their heads behind them.
    fn compound(&mut self, items: &[Item]) -> io::Result<u64> {
        let (mut children, mut heads) = (Vec::new(), Vec::new());
        for item in items {
            match item {
                Item::Property(property) => {
                    children.push(self.samples(property)?);
                    append_head(&mut heads, property);
                }
                Item::Compound { name, metadata, items } => {
                    children.push(self.compound(items)?);
                    heads.extend((metadata << 20).to_le_bytes());
                    heads.push(name.len() as u8);
                    heads.extend(name.bytes());
                }
            }
        }
        if !items.is_empty() {
            children.push(self.data(&[&heads])?);
        }
        self.group(&children)
    }

    /// Writes the list of the samples of a property: for arrays each with its size, which is that of its data.
    fn samples(&mut self, property: &Property) -> io::Result<u64> {
        let kept = if is_constant(property) { &property.samples[..1] } else { &property.samples };
        let children: Vec<u64> =
            if property.is_scalar { kept.to_vec() } else { kept.iter().flat_map(|sample| [*sample, DATA]).collect() };
        self.group(&children)
    }

    /// Writes objects with their properties below the top, and ends the file. `start` and `step` are the time of the
    /// first frame and between frames [s]; `about` is the metadata of the archive.
    pub fn finish(mut self, objects: &[Object], [start, step]: [f64; 2], about: &str) -> io::Result<()> {
        let frames = objects.iter().flat_map(|object| &object.items).map(sample_count).max().unwrap_or(0) as u32;
        let (mut children, mut heads, mut hashes) = (vec![EMPTY_GROUP], Vec::new(), Vec::new());
        for Object { name, metadata, items } in objects {
            let properties = self.compound(items)?;
            // Hashes of an object's properties and of its children, which readers compare with nothing but each other.
            let (hash, no_children) = (murmur(&[&self.hash, name.as_bytes()].concat()), murmur(b""));
            let own = self.data(&[&hash, &no_children])?;
            children.push(self.group(&[properties, own])?);
            heads.extend((name.len() as u32).to_le_bytes());
            heads.extend(name.bytes());
            heads.push(*metadata as u8);
            hashes.extend(hash);
        }
        children.push(self.data(&[&heads, &murmur(b""), &murmur(&hashes)])?);
        let top = self.group(&children)?;

        let file_version = self.data(&[&0u32.to_le_bytes()])?;
        let library_version = self.data(&[&10803u32.to_le_bytes()])?;
        let about = self.data(&[about.as_bytes()])?;
        let mut times = Vec::new();
        for (count, step, start) in [(1, 1.0, 0.0), (frames, step, start)] {
            times.extend(u32::to_le_bytes(count));
            times.extend(f64::to_le_bytes(step));
            times.extend(1u32.to_le_bytes());
            times.extend(f64::to_le_bytes(start));
        }
        let times = self.data(&[&times])?;
        let texts: Vec<u8> =
            self.metadata.iter().flat_map(|text| [text.len() as u8].into_iter().chain(text.bytes())).collect();
        let texts = self.data(&[&texts])?;
        let root = self.group(&[file_version, library_version, top, about, times, texts])?;
        self.out.seek(SeekFrom::Start(5))?;
        self.out.write_all(b"\xff\0\x01")?;
        self.out.write_all(&root.to_le_bytes())?;
        self.out.seek(SeekFrom::End(0))?;
        Ok(())
    }
}

fn sample_count(item: &Item) -> usize {
    match item {
        Item::Property(property) => property.samples.len(),
        Item::Compound { items, .. } => items.iter().map(sample_count).max().unwrap_or(0),
    }
}

/// Whether all frames have the same sample.
fn is_constant(property: &Property) -> bool {
    property.samples.windows(2).all(|pair| pair[0] == pair[1])
}

/// Appends the head of a property: type, number of samples, times, name.
fn append_head(heads: &mut Vec<u8>, property: &Property) {
    const HAS_TIMES: u32 = 0x100;
    const HOMOGENEOUS: u32 = 0x400;
    const CONSTANT: u32 = 0x800;
    let count = property.samples.len();
    // Whether counts and lengths take one byte, two or four.
    let width = match count.max(property.name.len()) {
        0..=0xff => 0,
        0x100..=0xffff => 1,
        _ => 2,
    };
    let mut info = if property.is_scalar { 1 | HOMOGENEOUS } else { 2 };
    info |= width << 2 | (property.pod as u32) << 4 | HAS_TIMES | property.extent << 12 | property.metadata << 20;
    if is_constant(property) {
        info |= CONSTANT;
    }
    heads.extend(info.to_le_bytes());
    let mut push = |number: usize| heads.extend(&(number as u32).to_le_bytes()[..1 << width]);
    push(count);
    // The second table of times: those of the frames.
    push(1);
    push(property.name.len());
    heads.extend(property.name.bytes());
}

/// MurmurHash3, 128 bits for 64-bit processors, by Austin Appleby (public domain): readers know samples by it.
fn murmur(bytes: &[u8]) -> [u8; 16] {
    const C1: u64 = 0x87c3_7b91_1142_53d5;
    const C2: u64 = 0x4cf5_ad43_2745_937f;
    let mix_1 = |k: u64| k.wrapping_mul(C1).rotate_left(31).wrapping_mul(C2);
    let mix_2 = |k: u64| k.wrapping_mul(C2).rotate_left(33).wrapping_mul(C1);
    let word = |bytes: &[u8]| {
        let mut padded = [0; 8];
        padded[..bytes.len()].copy_from_slice(bytes);
        u64::from_le_bytes(padded)
    };
    let (mut a, mut b) = (0u64, 0u64);
    let blocks = bytes.chunks_exact(16);
    let rest = blocks.remainder();
    for block in blocks {
        a = (a ^ mix_1(word(&block[..8]))).rotate_left(27).wrapping_add(b);
        a = a.wrapping_mul(5).wrapping_add(0x52dc_e729);
        b = (b ^ mix_2(word(&block[8..]))).rotate_left(31).wrapping_add(a);
        b = b.wrapping_mul(5).wrapping_add(0x3849_5ab5);
    }
    let (low, high) = rest.split_at(rest.len().min(8));
    b ^= mix_2(word(high));
    a ^= mix_1(word(low));
    let finish = |mut k: u64| {
        k = (k ^ k >> 33).wrapping_mul(0xff51_afd7_ed55_8ccd);
        k = (k ^ k >> 33).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        k ^ k >> 33
    };
    a ^= bytes.len() as u64;
    b ^= bytes.len() as u64;
    a = a.wrapping_add(b);
    b = b.wrapping_add(a);
    a = finish(a);
    b = finish(b);
    a = a.wrapping_add(b);
    b = b.wrapping_add(a);
    let mut hash = [0; 16];
    hash[..8].copy_from_slice(&a.to_le_bytes());
    hash[8..].copy_from_slice(&b.to_le_bytes());
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_other_programs() {
        // Keys of three samples in a file that Blender's Alembic 1.8.3 wrote.
        let faces: Vec<u8> = [2, 3, 1, 0].iter().flat_map(|v: &i32| v.to_le_bytes()).collect();
        assert_eq!(murmur(&faces)[..4], [0xac, 0xf8, 0x88, 0xf4]);
        assert_eq!(murmur(&4i32.to_le_bytes())[..4], [0xf0, 0x57, 0x83, 0xc9]);
        let uv: Vec<u8> = [0, 1, 2, 3].iter().flat_map(|v: &u32| v.to_le_bytes()).collect();
        assert_eq!(murmur(&uv)[..4], [0xd1, 0x5b, 0xd5, 0x5e]);
    }
}
