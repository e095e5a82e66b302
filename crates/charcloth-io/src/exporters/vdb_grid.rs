//! Sparse grids of numbers in the file format of OpenVDB: tree 5-4-3, file version 224, neither zip nor blosc.
//!
//! There is no written specification: the layout is that of OpenVDB's `io/Archive.cc`, `tree/RootNode.h`, `InternalNode.h`
//! and `LeafNode.h`. A grid is a root of cubes of 4096 voxels, each of 32^3 cubes of 128, each of 16^3 leaves of 8. Masks
//! say which children and voxels there are; of values, only those of the voxels that are there are written.

use std::collections::BTreeMap;
use std::io::{self, Write};

const FILE_VERSION: u32 = 224;
/// Library whose files these are like.
const LIBRARY: [u32; 2] = [12, 0];
/// Values of voxels that are not there are left out.
const ACTIVE_VALUES_ONLY: u32 = 2;
/// All values that are left out are the background.
const REST_IS_BACKGROUND: u8 = 0;

/// A grid of cubes around the origin, 0 where nothing is set.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Name that programs look for, such as `temperature`.
    pub name: &'static str,
    /// Side of a voxel [m].
    pub voxel: f64,
    /// Cubes of 8^3 voxels by their place in the tree, see [`path`].
    leaves: BTreeMap<([i32; 3], u16, u16), Leaf>,
}

#[derive(Debug, Clone)]
struct Leaf {
    there: [u64; 8],
    values: Box<[f32; 512]>,
}

/// Where a voxel is: cube of 4096, numbers of the cube of 128 in it, of the leaf in that, and of the voxel in that.
fn path(at: [i32; 3]) -> ([i32; 3], u16, u16, usize) {
    let number = |low: u32, high: u32| {
        let digits = at.map(|x| (x as u32 >> low) & ((1 << (high - low)) - 1));
        (digits[0] << (2 * (high - low))) | (digits[1] << (high - low)) | digits[2]
    };
    (at.map(|x| x & !4095), number(7, 12) as u16, number(3, 7) as u16, number(0, 3) as usize)
}

impl Grid {
    /// An empty grid.
    pub fn new(name: &'static str, voxel: f64) -> Self {
        Self { name, voxel, leaves: BTreeMap::new() }
    }

    /// The value of a voxel, which is there from then on.
    pub fn at(&mut self, at: [i32; 3]) -> &mut f32 {
        let (cube, middle, leaf, k) = path(at);
        let leaf = self
            .leaves
            .entry((cube, middle, leaf))
            .or_insert_with(|| Leaf { there: [0; 8], values: Box::new([0.0; 512]) });
        leaf.there[k / 64] |= 1 << (k % 64);
        &mut leaf.values[k]
    }

    /// The tree: who is there, then the values of the leaves. Says where the values begin.
    fn write(&self, out: &mut Vec<u8>) -> usize {
        put(out, 1); // buffers a leaf
        put(out, 0f32.to_bits()); // background
        put(out, 0); // tiles of the root
        let rows: Vec<_> = self.leaves.keys().copied().collect();
        let cubes: Vec<_> = rows.chunk_by(|a, b| a.0 == b.0).collect();
        put(out, cubes.len() as u32);
        for cube in cubes {
            cube[0].0.iter().for_each(|x| put(out, *x as u32));
            inner_node::<32768>(cube.iter().map(|row| row.1), out);
            for middle in cube.chunk_by(|a, b| a.1 == b.1) {
                inner_node::<4096>(middle.iter().map(|row| row.2), out);
                middle.iter().for_each(|row| put_mask(&self.leaves[row].there, out));
            }
        }
        let start = out.len();
        for leaf in self.leaves.values() {
            put_mask(&leaf.there, out);
            out.push(REST_IS_BACKGROUND);
            let values = leaf.values.iter().enumerate().filter(|(k, _)| leaf.there[k / 64] >> (k % 64) & 1 == 1);
            values.for_each(|(_, value)| out.extend(value.to_le_bytes()));
        }
        start
    }
}

/// A node of which only children are there.
fn inner_node<const SIZE: usize>(children: impl Iterator<Item = u16>, out: &mut Vec<u8>) {
    let mut mask = vec![0u64; SIZE / 64];
    children.for_each(|k| mask[usize::from(k) / 64] |= 1 << (k % 64));
    put_mask(&mask, out);
    out.extend(std::iter::repeat_n(0, SIZE / 8));
    out.push(REST_IS_BACKGROUND);
}

fn put(out: &mut Vec<u8>, number: u32) {
    out.extend(number.to_le_bytes());
}

fn put_mask(mask: &[u64], out: &mut Vec<u8>) {
    mask.iter().for_each(|word| out.extend(word.to_le_bytes()));
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    put(out, text.len() as u32);
    out.extend(text.as_bytes());
}

/// Writes grids as a file.
pub fn write(grids: &[Grid], out: &mut impl Write) -> io::Result<()> {
    let mut bytes = Vec::new();
    bytes.extend(b" BDV\0\0\0\0");
    for number in [FILE_VERSION, LIBRARY[0], LIBRARY[1]] {
        put(&mut bytes, number);
    }
    bytes.push(1); // places of the grids are given
    let identity = bytes.len();
    bytes.extend([b'0'; 36]);
    put(&mut bytes, 0); // metadata of the file
    put(&mut bytes, grids.len() as u32);
    for grid in grids {
        put_text(&mut bytes, grid.name);
        put_text(&mut bytes, "Tree_float_5_4_3");
        put_text(&mut bytes, ""); // not an instance of another
        let places = bytes.len();
        bytes.extend([0; 24]);
        let start = bytes.len();
        put(&mut bytes, ACTIVE_VALUES_ONLY);
        let metadata = [("class", "fog volume"), ("name", grid.name)];
        put(&mut bytes, metadata.len() as u32);
        for (name, value) in metadata {
            put_text(&mut bytes, name);
            put_text(&mut bytes, "string");
            put_text(&mut bytes, value);
        }
        put_text(&mut bytes, "UniformScaleMap");
        let size = grid.voxel;
        for number in [size, size, 1.0 / size, 1.0 / (size * size), 0.5 / size] {
            (0..3).for_each(|_| bytes.extend(number.to_le_bytes()));
        }
        let values = grid.write(&mut bytes);
        let end = bytes.len();
        for (k, place) in [start, values, end].into_iter().enumerate() {
            bytes[places + 8 * k..places + 8 * k + 8].copy_from_slice(&(place as u64).to_le_bytes());
        }
    }
    // The same contents have the same identity.
    let text = identity_of(&bytes);
    bytes[identity..identity + 36].copy_from_slice(text.as_bytes());
    out.write_all(&bytes)
}

/// 128 bits of the contents (FNV-1a), written as UUIDs are.
fn identity_of(bytes: &[u8]) -> String {
    let mut hash = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128;
    for byte in bytes {
        hash = (hash ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
    }
    let digits = format!("{hash:032x}");
    [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..]].join("-")
}
