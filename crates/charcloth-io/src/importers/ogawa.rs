//! The container of .abc files ("Ogawa"): objects and their properties, read where they are asked for.
//!
//! There is no written specification: the layout is that of Alembic's `lib/Alembic/Ogawa` and `AbcCoreOgawa`. Nothing in
//! the file is trusted: every place is looked up within the bytes, and no more memory is taken than the bytes can account
//! for.

pub(super) const MARK: &[u8] = b"Ogawa";
const CUT: &str = "it is cut short or damaged";
/// Marks the place of data; alone, it is data of no length.
const DATA: u64 = 1 << 63;
/// Bytes that samples begin with: their hash.
const KEY: usize = 16;
/// Bytes behind the names of the objects below one.
const HASHES: usize = 32;
/// Metadata that is not one of the numbered texts, but follows.
const WRITTEN_OUT: usize = 0xff;

/// A file in memory.
pub(super) struct Ogawa<'a> {
    bytes: &'a [u8],
    /// Texts that objects and properties refer to by their number.
    metadata: Vec<&'a [u8]>,
}

/// A thing in the tree of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Object {
    /// Names from the top, with slashes between.
    pub path: String,
    /// Keys and values, as `key=value` parted by semicolons.
    pub metadata: String,
    group: u64,
}

/// What an object, or a property of several parts, has.
#[derive(Debug, Clone)]
pub(super) struct Property {
    pub name: String,
    /// Keys and values, as those of objects.
    pub metadata: String,
    /// Numbers of an element; 0 for a property of several parts.
    pub extent: usize,
    /// Whether a later sample differs from the first.
    pub is_animated: bool,
    /// Type of number, as the format counts them; none for a property of several parts.
    pod: Option<u32>,
    group: u64,
}

impl Property {
    /// Whether its numbers are of single or double precision.
    pub fn is_float(&self) -> bool {
        matches!(self.pod, Some(10 | 11))
    }
}

/// The value of a key in metadata.
pub(super) fn value_of<'a>(metadata: &'a str, key: &str) -> Option<&'a str> {
    metadata.split(';').find_map(|pair| pair.split_once('=').filter(|(name, _)| *name == key).map(|(_, value)| value))
}

/// A place in the bytes to read on from.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(CUT)?;
        self.0 = rest;
        Ok(taken)
    }

    /// A whole number of so many bytes, the lowest first.
    fn number(&mut self, bytes: usize) -> Result<usize, String> {
        let number = self.take(bytes)?.iter().rev().fold(0u64, |sum, byte| sum << 8 | u64::from(*byte));
        usize::try_from(number).map_err(|_| CUT.to_string())
    }

    fn text(&mut self, count: usize) -> Result<String, String> {
        Ok(String::from_utf8_lossy(self.take(count)?).into_owned())
    }
}

impl<'a> Ogawa<'a> {
    /// Opens a file, and gives its topmost object.
    pub fn open(bytes: &'a [u8]) -> Result<(Self, Object), String> {
        let mut head = Cursor(bytes.get(MARK.len()..).ok_or(CUT)?);
        // What wrote it sets this byte last of all.
        if head.number(1)? != 0xff {
            return Err("the program that wrote it did not come to the end".to_string());
        }
        head.take(2)?;
        let root = head.number(8)? as u64;
        let mut file = Self { bytes, metadata: Vec::new() };
        let [_, _, top, _, _, texts] = *file.group(root)? else { return Err(CUT.to_string()) };
        let mut texts = Cursor(file.data(texts)?);
        file.metadata.push(b"");
        while !texts.0.is_empty() {
            let length = texts.number(1)?;
            file.metadata.push(texts.take(length)?);
        }
        Ok((file, Object { group: top, ..Object::default() }))
    }

    /// Bytes from a place on.
    fn from(&self, place: u64) -> Result<Cursor<'a>, String> {
        let place = usize::try_from(place & !DATA).map_err(|_| CUT)?;
        Ok(Cursor(self.bytes.get(place..).ok_or(CUT)?))
    }

    /// Places of what a group has.
    fn group(&self, place: u64) -> Result<Vec<u64>, String> {
        if place == 0 {
            return Ok(Vec::new());
        }
        if place & DATA != 0 {
            return Err(CUT.to_string());
        }
        let mut cursor = self.from(place)?;
        let count = cursor.number(8)?;
        let places = cursor.take(count.checked_mul(8).ok_or(CUT)?)?;
        Ok(places.as_chunks().0.iter().map(|place| u64::from_le_bytes(*place)).collect())
    }

    fn data(&self, place: u64) -> Result<&'a [u8], String> {
        match place {
            DATA => Ok(&[]),
            _ if place & DATA == 0 => Err(CUT.to_string()),
            _ => {
                let mut cursor = self.from(place)?;
                let length = cursor.number(8)?;
                cursor.take(length)
            }
        }
    }

    fn text_of(&self, number: usize) -> Result<String, String> {
        Ok(String::from_utf8_lossy(self.metadata.get(number).ok_or(CUT)?).into_owned())
    }

    /// Objects below one.
    pub fn children(&self, object: &Object) -> Result<Vec<Object>, String> {
        let places = self.group(object.group)?;
        let Some(heads) = places.last().filter(|place| *place & DATA != 0) else { return Ok(Vec::new()) };
        let heads = self.data(*heads)?;
        let mut heads = Cursor(&heads[..heads.len().saturating_sub(HASHES)]);
        let mut children = Vec::new();
        while !heads.0.is_empty() {
            let length = heads.number(4)?;
            let name = heads.text(length)?;
            let metadata = match heads.number(1)? {
                WRITTEN_OUT => {
                    let length = heads.number(4)?;
                    heads.text(length)?
                }
                number => self.text_of(number)?,
            };
            // Its properties come first.
            let group = *places[..places.len() - 1].get(children.len() + 1).ok_or(CUT)?;
            children.push(Object { path: format!("{}/{name}", object.path), metadata, group });
        }
        Ok(children)
    }

    /// Properties of an object.
    pub fn properties(&self, object: &Object) -> Result<Vec<Property>, String> {
        match self.group(object.group)?.first() {
            Some(group) if group & DATA == 0 => self.compound(*group),
            _ => Ok(Vec::new()),
        }
    }

    /// Parts of a property.
    pub fn parts(&self, property: &Property) -> Result<Vec<Property>, String> {
        if property.pod.is_some() { Ok(Vec::new()) } else { self.compound(property.group) }
    }

    fn compound(&self, group: u64) -> Result<Vec<Property>, String> {
        let places = self.group(group)?;
        let Some((heads, places)) = places.split_last() else { return Ok(Vec::new()) };
        let mut heads = Cursor(self.data(*heads)?);
        let mut properties = Vec::new();
        while !heads.0.is_empty() {
            let info = heads.number(4)?;
            // Counts and lengths take one byte, two or four.
            let width = match info >> 2 & 3 {
                3 => return Err(CUT.to_string()),
                power => 1 << power,
            };
            let is_compound = info & 3 == 0;
            let (mut samples, mut is_constant) = (0, true);
            if !is_compound {
                samples = heads.number(width)?;
                // Which samples first and last differ from the one before.
                is_constant = info & 0x800 != 0;
                if info & 0x200 != 0 {
                    let (first, last) = (heads.number(width)?, heads.number(width)?);
                    is_constant = first == 0 && last == 0;
                }
                if info & 0x100 != 0 {
                    heads.number(width)?;
                }
            }
            let length = heads.number(width)?;
            let name = heads.text(length)?;
            let metadata = match info >> 20 & 0xff {
                WRITTEN_OUT => {
                    let length = heads.number(width)?;
                    heads.text(length)?
                }
                number => self.text_of(number)?,
            };
            properties.push(Property {
                name,
                metadata,
                extent: info >> 12 & 0xff,
                is_animated: samples > 1 && !is_constant,
                pod: (!is_compound).then_some((info >> 4 & 0xf) as u32),
                group: *places.get(properties.len()).ok_or(CUT)?,
            });
        }
        Ok(properties)
    }

    /// Numbers of the first sample; none where there is no sample or it holds texts.
    pub fn numbers(&self, property: &Property) -> Result<Vec<f64>, String> {
        let Some(pod) = property.pod else { return Ok(Vec::new()) };
        let Some(sample) = self.group(property.group)?.first().copied() else { return Ok(Vec::new()) };
        let bytes = self.data(sample)?;
        let bytes = if bytes.is_empty() { bytes } else { bytes.get(KEY..).ok_or(CUT)? };
        fn each<const N: usize>(bytes: &[u8], number: impl Fn([u8; N]) -> f64) -> Result<Vec<f64>, String> {
            let (numbers, rest) = bytes.as_chunks();
            if rest.is_empty() {
                Ok(numbers.iter().map(|bytes| number(*bytes)).collect())
            } else {
                Err(CUT.to_string())
            }
        }
        match pod {
            0 | 1 => each(bytes, |b: [u8; 1]| f64::from(b[0])),
            2 => each(bytes, |b| f64::from(i8::from_le_bytes(b))),
            3 => each(bytes, |b| f64::from(u16::from_le_bytes(b))),
            4 => each(bytes, |b| f64::from(i16::from_le_bytes(b))),
            5 => each(bytes, |b| f64::from(u32::from_le_bytes(b))),
            6 => each(bytes, |b| f64::from(i32::from_le_bytes(b))),
            10 => each(bytes, |b| f64::from(f32::from_le_bytes(b))),
            11 => each(bytes, f64::from_le_bytes),
            _ => Ok(Vec::new()),
        }
    }
}
