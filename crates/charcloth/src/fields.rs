//! Tables: one row of `fields!` is an array with its name, unit, meaning and split rule.
//!
//! From that row follow the NaN check, the hash, the snapshot, the frame in the cache, every exporter, and what
//! happens to the quantity when a tear splits its element.

use glam::{DVec3, Vec2};

/// What happens to a quantity when its element is split in two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Split {
    /// Both parts keep the value (a temperature).
    Copy,
    /// The parts share the value in proportion to their areas (a mass).
    Share,
}

/// Borrowed data of one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Data<'a> {
    /// One `f64` a row.
    F64(&'a [f64]),
    /// Three `f64` a row.
    F64x3(&'a [DVec3]),
    /// One `u32` a row.
    U32(&'a [u32]),
    /// Two `u32` a row.
    U32x2(&'a [[u32; 2]]),
    /// Three `u32` a row.
    U32x3(&'a [[u32; 3]]),
    /// Three texture coordinates a row.
    F32x3x2(&'a [[Vec2; 3]]),
    /// One flag or small number a row.
    U8(&'a [u8]),
}

impl Data<'_> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Data::F64(d) => d.len(),
            Data::F64x3(d) => d.len(),
            Data::U32(d) => d.len(),
            Data::U32x2(d) => d.len(),
            Data::U32x3(d) => d.len(),
            Data::F32x3x2(d) => d.len(),
            Data::U8(d) => d.len(),
        }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The first row with a number that is not finite, or as large as `limit`.
    pub fn first_beyond(&self, limit: f64) -> Option<usize> {
        let beyond = |v: &f64| v.abs() >= limit || v.is_nan();
        match self {
            Data::F64(d) => d.iter().position(beyond),
            Data::F64x3(d) => d.iter().position(|v| v.to_array().iter().any(beyond)),
            Data::F32x3x2(d) => d.iter().position(|v| !v.iter().all(|p| p.is_finite())),
            _ => None,
        }
    }

    /// Feeds the bits of every row to a hash function (FNV-1a is enough to tell two runs apart).
    pub fn hash_into(&self, hash: &mut Fnv) {
        match self {
            Data::F64(d) => d.iter().for_each(|v| hash.write(v.to_bits())),
            Data::F64x3(d) => d.iter().for_each(|v| v.to_array().iter().for_each(|c| hash.write(c.to_bits()))),
            Data::U32(d) => d.iter().for_each(|v| hash.write(u64::from(*v))),
            Data::U32x2(d) => d.iter().flatten().for_each(|v| hash.write(u64::from(*v))),
            Data::U32x3(d) => d.iter().flatten().for_each(|v| hash.write(u64::from(*v))),
            Data::F32x3x2(d) => d.iter().flatten().for_each(|v| {
                hash.write(u64::from(v.x.to_bits()));
                hash.write(u64::from(v.y.to_bits()));
            }),
            Data::U8(d) => d.iter().for_each(|v| hash.write(u64::from(*v))),
        }
    }
}

/// Mutable data of one column.
#[derive(Debug)]
pub enum DataMut<'a> {
    /// One `f64` a row.
    F64(&'a mut Vec<f64>),
    /// Three `f64` a row.
    F64x3(&'a mut Vec<DVec3>),
    /// One `u32` a row.
    U32(&'a mut Vec<u32>),
    /// Two `u32` a row.
    U32x2(&'a mut Vec<[u32; 2]>),
    /// Three `u32` a row.
    U32x3(&'a mut Vec<[u32; 3]>),
    /// Three texture coordinates a row.
    F32x3x2(&'a mut Vec<[Vec2; 3]>),
    /// One flag or small number a row.
    U8(&'a mut Vec<u8>),
}

/// The 64-bit Fowler-Noll-Vo 1a hash, a word at a time.
#[derive(Debug, Clone, Copy)]
pub struct Fnv(pub u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// Mixes one word in.
    pub fn write(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
    }
}

/// One column of a table.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    /// Name, as in files.
    pub name: &'static str,
    /// SI unit; "1" for pure numbers.
    pub unit: &'static str,
    /// One sentence on what it is.
    pub about: &'static str,
    /// What a split does to it.
    pub split: Split,
    /// The values.
    pub data: Data<'a>,
}

/// Ties a Rust row type to its [`Data`] variant and to its behaviour in a split.
pub trait Row: Copy + Default {
    /// Borrowed column of such rows.
    fn data(rows: &[Self]) -> Data<'_>;
    /// Mutable column of such rows.
    fn data_mut(rows: &mut Vec<Self>) -> DataMut<'_>;
    /// The share of a value that a part with this fraction of the area takes. Only numbers can be shared.
    fn share(self, _fraction: f64) -> Self {
        unreachable!("a column of this type has the rule Copy")
    }
}

macro_rules! rows {
    ($($row:ty => $variant:ident $(, $share:expr)?;)*) => {$(
        impl Row for $row {
            fn data(rows: &[Self]) -> Data<'_> { Data::$variant(rows) }
            fn data_mut(rows: &mut Vec<Self>) -> DataMut<'_> { DataMut::$variant(rows) }
            $(fn share(self, fraction: f64) -> Self { let share: fn(Self, f64) -> Self = $share; share(self, fraction) })?
        }
    )*};
}

rows! {
    f64 => F64, |value, fraction| value * fraction;
    DVec3 => F64x3, |value, fraction| value * fraction;
    u32 => U32;
    [u32; 2] => U32x2;
    [u32; 3] => U32x3;
    [Vec2; 3] => F32x3x2;
    u8 => U8;
}

/// Declares a table: a struct of arrays, one row of the macro an array.
#[macro_export]
macro_rules! fields {
    ($(#[$doc:meta])* pub struct $table:ident { $(
        #[doc = $about:literal]
        $field:ident: $row:ty, $unit:literal, $split:ident;
    )* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct $table { $(
            #[doc = $about]
            #[doc = concat!("[", $unit, "]")]
            pub $field: Vec<$row>,
        )* }

        impl $table {
            /// A table of `count` rows of zeros.
            pub fn zeros(count: usize) -> Self {
                Self { $($field: vec![Default::default(); count],)* }
            }

            /// Number of rows.
            pub fn len(&self) -> usize {
                self.columns()[0].data.len()
            }

            /// Whether there are no rows.
            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            /// Every column with its name, unit and split rule.
            pub fn columns(&self) -> Vec<$crate::fields::Column<'_>> {
                vec![$($crate::fields::Column {
                    name: stringify!($field),
                    unit: $unit,
                    about: $about.trim_ascii(),
                    split: $crate::fields::Split::$split,
                    data: <$row as $crate::fields::Row>::data(&self.$field),
                }),*]
            }

            /// Every column by name, to be filled.
            pub fn columns_mut(&mut self) -> Vec<(&'static str, $crate::fields::DataMut<'_>)> {
                vec![$((stringify!($field), <$row as $crate::fields::Row>::data_mut(&mut self.$field))),*]
            }

            /// Splits row `parent`: a new last row takes `fraction` of what is shared and a copy of the rest.
            pub fn split(&mut self, parent: usize, fraction: f64) {
                $(
                    let value = self.$field[parent];
                    match $crate::fields::Split::$split {
                        $crate::fields::Split::Copy => self.$field.push(value),
                        $crate::fields::Split::Share => {
                            self.$field.push(<$row as $crate::fields::Row>::share(value, fraction));
                            self.$field[parent] = <$row as $crate::fields::Row>::share(value, 1.0 - fraction);
                        }
                    }
                )*
            }
        }
    };
}

#[cfg(test)]
mod tests {
    fields! {
        /// A table to test with.
        pub struct Sample {
            /// Shared.
            mass: f64, "kg", Share;
            /// Copied.
            temperature: f64, "K", Copy;
            /// Copied.
            corner: [u32; 3], "1", Copy;
        }
    }

    #[test]
    fn a_split_shares_masses_and_copies_the_rest() {
        let mut table = Sample::zeros(2);
        assert!(!table.is_empty() && table.columns_mut().len() == 3);
        table.mass[1] = 8.0;
        table.temperature[1] = 300.0;
        table.split(1, 0.25);
        assert_eq!(table.len(), 3);
        assert_eq!(table.mass, [0.0, 6.0, 2.0]);
        assert_eq!(table.temperature, [0.0, 300.0, 300.0]);
        assert_eq!(table.columns()[0].name, "mass");
        assert_eq!(table.columns()[1].about, "Copied.");
    }
}
