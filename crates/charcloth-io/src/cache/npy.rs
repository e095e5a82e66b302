//! The head of a `.npy` array, numpy's own format, versions 1 to 3: a mark, a length, and a Python dictionary
//! `{'descr': '<f8', 'fortran_order': False, 'shape': (7, 3), }` padded with spaces.

/// What every array begins with.
const MARK: &[u8] = b"\x93NUMPY";
/// The numbers begin at a multiple of this.
const ALIGNMENT: usize = 64;

/// What the head of an array says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    /// Type of the numbers, such as `<f8`; "a structure" where a row has several.
    pub descriptor: String,
    /// Whether the first index is the fastest.
    pub fortran_order: bool,
    /// Rows, columns...
    pub shape: Vec<u64>,
}

impl Header {
    /// The bytes of the head, in version 1.
    pub fn write(&self) -> Vec<u8> {
        let shape: String = self.shape.iter().map(|n| format!("{n},")).collect();
        let order = if self.fortran_order { "True" } else { "False" };
        let mut text =
            format!("{{'descr': '{}', 'fortran_order': {order}, 'shape': ({shape}), }}", self.descriptor).into_bytes();
        let before = MARK.len() + 4;
        text.resize((before + text.len() + 1).next_multiple_of(ALIGNMENT) - before - 1, b' ');
        text.push(b'\n');
        let mut bytes = MARK.to_vec();
        bytes.extend([1, 0]);
        // A shape of three numbers is far from 64 KiB of text.
        bytes.extend((text.len() as u16).to_le_bytes());
        bytes.extend(text);
        bytes
    }

    /// Reads the head of an array; gives back the numbers that follow, too.
    pub fn read(bytes: &[u8]) -> Result<(Self, &[u8]), &'static str> {
        let rest = bytes.strip_prefix(MARK).ok_or("it does not begin like an array of numpy")?;
        let (length, rest) = match *rest {
            [1, _, a, b, ref rest @ ..] => (usize::from(u16::from_le_bytes([a, b])), rest),
            [2 | 3, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]) as usize, rest),
            _ => return Err("its head is cut short or of an unknown version"),
        };
        let (text, numbers) = rest.split_at_checked(length).ok_or("its head is cut short")?;
        let text = str::from_utf8(text).map_err(|_| "its head is not text")?;
        Ok((dictionary(text).ok_or("its head is not what numpy writes")?, numbers))
    }
}

/// Reads the dictionary: three keys in any order.
fn dictionary(text: &str) -> Option<Header> {
    let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
    let (mut descriptor, mut fortran_order, mut shape) = (None, None, None);
    while !rest.is_empty() {
        let (key, value) = quoted(rest)?;
        let value = value.trim_start().strip_prefix(':')?.trim_start();
        rest = match key {
            "descr" if value.starts_with('[') => {
                descriptor = Some("a structure");
                // Structures are refused, so all that matters is where the list ends.
                &value[value.rfind(']')? + 1..]
            }
            "descr" => {
                let (name, rest) = quoted(value)?;
                descriptor = Some(name);
                rest
            }
            "fortran_order" => {
                let is_true = value.starts_with("True");
                fortran_order = Some(is_true);
                value.strip_prefix(if is_true { "True" } else { "False" })?
            }
            "shape" => {
                let (numbers, rest) = value.strip_prefix('(')?.split_once(')')?;
                let numbers = numbers.split(',').map(str::trim).filter(|number| !number.is_empty());
                // Python 2 wrote long numbers with an L.
                shape = Some(numbers.map(|n| n.trim_end_matches('L').parse().ok()).collect::<Option<Vec<u64>>>()?);
                rest
            }
            _ => return None,
        };
        rest = rest.trim_start();
        rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
    }
    Some(Header { descriptor: descriptor?.to_owned(), fortran_order: fortran_order?, shape: shape? })
}

/// A word in quotes at the beginning of a text, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let mark = text.chars().next().filter(|mark| ['\'', '"'].contains(mark))?;
    text[1..].split_once(mark)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_lies_on_64_bytes() {
        for shape in [vec![], vec![7], vec![7, 3], vec![1_000_000_000_000, 3, 2]] {
            let header = Header { descriptor: "<f8".to_owned(), fortran_order: false, shape };
            let mut bytes = header.write();
            assert_eq!(bytes.len() % ALIGNMENT, 0);
            bytes.extend([1, 2]);
            assert_eq!(Header::read(&bytes), Ok((header, [1, 2].as_slice())));
        }
    }

    #[test]
    fn numpys_own_heads_are_read() {
        let read = |version: u8, text: &str| {
            let mut bytes = MARK.to_vec();
            bytes.extend([version, 0]);
            match version {
                1 => bytes.extend((text.len() as u16).to_le_bytes()),
                _ => bytes.extend((text.len() as u32).to_le_bytes()),
            }
            bytes.extend(text.as_bytes());
            Header::read(&bytes).map(|(header, _)| (header.descriptor, header.fortran_order, header.shape))
        };
        let is = |descriptor: &str, fortran, shape: &[u64]| Ok((descriptor.to_owned(), fortran, shape.to_vec()));
        assert_eq!(
            read(1, "{'descr': '<f4', 'fortran_order': False, 'shape': (5,), }      \n"),
            is("<f4", false, &[5])
        );
        assert_eq!(read(2, "{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3), }\n"), is("|u1", true, &[2, 3]));
        assert_eq!(read(3, "{\"shape\":(),\"fortran_order\":False,\"descr\":\"<u8\"}"), is("<u8", false, &[]));
        assert_eq!(read(1, "{'descr': '<i8', 'fortran_order': False, 'shape': (3L, 2L)}"), is("<i8", false, &[3, 2]));
        let structure = "{'descr': [('x', '<f8'), ('y', '<f8', (2,))], 'fortran_order': False, 'shape': (3,), }";
        assert_eq!(read(1, structure), is("a structure", false, &[3]));
        for wrong in ["", "{}", "{'descr': '<f8'", "{'descr': '<f8', 'fortran_order': False, 'shape': (x,), }", "{'"] {
            assert!(read(1, wrong).is_err(), "{wrong}");
        }
        assert!(read(9, "{}").is_err());
        assert!(Header::read(b"\x93NUMPY\x01\x00\xff\xff{").is_err());
    }
}
