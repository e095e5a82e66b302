//! From the tree to the scene: a serde deserializer whose errors know the place and what was expected there.

use super::tree::{Data, Node, Place};
use charcloth::registry::nearest;
use serde::de::{self, DeserializeSeed, IntoDeserializer, Unexpected, Visitor};
use std::fmt;

/// Why a tree is no scene. Becomes a diagnostic.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mistake {
    /// Where, once the place is known.
    pub place: Option<Place>,
    /// Dotted key of the place.
    pub path: Vec<String>,
    /// What is wrong.
    pub problem: String,
    /// What to try.
    pub hint: String,
}

impl Mistake {
    fn new(problem: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { place: None, path: Vec::new(), problem: problem.into(), hint: hint.into() }
    }

    /// Notes where it was, unless a deeper place is known already.
    fn place(mut self, place: &Place) -> Self {
        self.place.get_or_insert_with(|| place.clone());
        self
    }

    fn inside(mut self, key: &str) -> Self {
        self.path.insert(0, key.to_owned());
        self
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problem)
    }
}

impl std::error::Error for Mistake {}

/// Lists the choices, the nearest first where one is near.
fn choices(word: &str, expected: &[&str]) -> String {
    let all = expected.join(", ");
    match nearest(word, expected.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if expected.is_empty() => "nothing can stand here".to_owned(),
        None => format!("there are: {all}"),
    }
}

impl de::Error for Mistake {
    fn custom<T: fmt::Display>(message: T) -> Self {
        let message = message.to_string();
        // Messages about quantities end in what was expected; that is the part to try.
        match message.split_once("; expected ") {
            Some((problem, expected)) => Self::new(problem, format!("write {expected}")),
            None => Self::new(message, ""),
        }
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        Self::new(format!("there is no key `{field}` here"), choices(field, expected))
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        let hint = match nearest(variant, expected.iter().copied()) {
            Some(near) => format!("did you mean \"{near}\"? There are: {}", expected.join(", ")),
            None => format!("there are: {}", expected.join(", ")),
        };
        Self::new(format!("\"{variant}\" is not one of the choices"), hint)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(format!("`{field}` is missing"), format!("add `{field} = ...`"))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::new(format!("{} cannot stand here", describe(found)), format!("write {}", plain(&expected.to_string())))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(count: usize, expected: &dyn de::Expected) -> Self {
        Self::new(format!("{count} values cannot stand here"), format!("write {}", plain(&expected.to_string())))
    }
}

fn describe(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(flag) => format!("{flag}"),
        Unexpected::Unsigned(number) => format!("{number}"),
        Unexpected::Signed(number) => format!("{number}"),
        Unexpected::Float(number) => format!("{number}"),
        Unexpected::Str(text) => format!("the text \"{text}\""),
        Unexpected::Seq => "an array".to_owned(),
        Unexpected::Map => "a table".to_owned(),
        other => other.to_string(),
    }
}

/// What serde calls things, in words of scene files.
fn plain(expected: &str) -> String {
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more".to_owned(),
        "f64" | "f32" => "a number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a string" => "text in quotes".to_owned(),
        "a sequence" => "an array, such as [[ ]] rows or [a, b]".to_owned(),
        _ if expected.starts_with("struct ") => "a table of key = value".to_owned(),
        _ if expected.starts_with("enum ") => "the name of a choice, in quotes".to_owned(),
        _ => expected.replace("an array of length ", "an array of this many values: "),
    }
}

impl<'de> de::Deserializer<'de> for &'de Node {
    type Error = Mistake;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mistake> {
        match &self.data {
            Data::Text(text) => visitor.visit_str(text),
            Data::Integer(number) => match u64::try_from(*number) {
                Ok(number) => visitor.visit_u64(number),
                Err(_) => visitor.visit_i64(*number),
            },
            Data::Number(number) => visitor.visit_f64(*number),
            Data::Flag(flag) => visitor.visit_bool(*flag),
            Data::Date(text) => Err(de::Error::invalid_type(Unexpected::Other(&format!("the date {text}")), &visitor)),
            Data::Rows(rows) => visit_rows(rows, visitor),
            Data::Table(entries) => visitor.visit_map(Entries { entries: entries.iter(), value: None }),
        }
        .map_err(|mistake| mistake.place(&self.place))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        choices: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        match &self.data {
            Data::Text(text) => visitor.visit_enum(text.as_str().into_deserializer()),
            _ => Err(Mistake::new("the name of a choice belongs here", format!("there are: {}", choices.join(", ")))),
        }
        .map_err(|mistake| mistake.place(&self.place))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

fn visit_rows<'de, V: Visitor<'de>>(rows: &'de [Node], visitor: V) -> Result<V::Value, Mistake> {
    let mut access = Rows { rows: rows.iter(), index: 0 };
    let value = visitor.visit_seq(&mut access)?;
    match access.rows.len() {
        0 => Ok(value),
        over => Err(Mistake::new(
            format!("{} values are {over} too many", rows.len()),
            format!("write an array of {} values", rows.len() - over),
        )),
    }
}

struct Rows<'de> {
    rows: std::slice::Iter<'de, Node>,
    index: usize,
}

impl<'de> de::SeqAccess<'de> for Rows<'de> {
    type Error = Mistake;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Mistake> {
        let Some(row) = self.rows.next() else { return Ok(None) };
        let index = self.index;
        self.index += 1;
        seed.deserialize(row).map(Some).map_err(|mistake| mistake.place(&row.place).inside(&index.to_string()))
    }
}

struct Entries<'de> {
    entries: std::slice::Iter<'de, (String, Node)>,
    value: Option<&'de (String, Node)>,
}

impl<'de> de::MapAccess<'de> for Entries<'de> {
    type Error = Mistake;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Mistake> {
        let Some(entry) = self.entries.next() else { return Ok(None) };
        self.value = Some(entry);
        let key: de::value::StrDeserializer<'_, Mistake> = entry.0.as_str().into_deserializer();
        seed.deserialize(key).map(Some).map_err(|mistake| mistake.place(&entry.1.key_place).inside(&entry.0))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Mistake> {
        let Some((key, node)) = self.value.take() else {
            return Err(Mistake::new("a value was read before its key", ""));
        };
        seed.deserialize(node).map_err(|mistake| mistake.place(&node.place).inside(key))
    }
}
