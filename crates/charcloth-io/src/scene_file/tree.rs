//! A scene file as a tree whose keys and values know where they were written.
//!
//! Overrides (`--set`, the `set` of a case) change the tree before anything is read from it, so a value from the
//! command line is checked, and pointed at, in the same way as one from the file.

use super::diagnostic::{Diagnostic, SceneError};
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Where a key or value was written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Place {
    /// Bytes of the file.
    File(Range<usize>),
    /// The override of this number.
    Override(usize),
    /// Nowhere: a default.
    Nowhere,
}

/// A value, with its places.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Where its key was written; for a row of an array, where the row was.
    pub key_place: Place,
    /// Where the value was written.
    pub place: Place,
    /// The value.
    pub data: Data,
}

/// What a value is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Data {
    Text(String),
    Integer(i64),
    Number(f64),
    Flag(bool),
    Date(String),
    Rows(Vec<Node>),
    Table(Vec<(String, Node)>),
}

impl Node {
    /// Parses a file.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, SceneError> {
        let table = DeTable::parse(text).map_err(|error| {
            let place = error.span().map_or(Place::Nowhere, Place::File);
            let span = error.span().unwrap_or(0..0);
            let diagnostic = Diagnostic::at(name, text, &[], &place, error.message());
            SceneError::from(diagnostic.hint(syntax_hint(text, span)))
        })?;
        Ok(Self { key_place: Place::Nowhere, place: Place::Nowhere, data: read(&DeValue::Table(table.into_inner())) })
    }

    /// Parses the value of an override: TOML, or a bare string where that is no TOML.
    pub(crate) fn parse_override(number: usize, text: &str) -> Result<Self, String> {
        let document = format!("value = {text}");
        let node = match DeTable::parse(&document) {
            Ok(table) => {
                let mut entries = table.into_inner().into_iter();
                let (Some((_, value)), None) = (entries.next(), entries.next()) else {
                    return Err("the value has several lines".to_owned());
                };
                match read(value.get_ref()) {
                    Data::Date(text) => Data::Text(text), // nothing in a scene is a date, but a name may look like one
                    data => data,
                }
            }
            Err(error) if text.trim_start().starts_with(['[', '{', '"', '\'']) => {
                return Err(error.message().to_owned());
            }
            Err(_) => Data::Text(text.trim().to_owned()),
        };
        let mut node = Self { key_place: Place::Nowhere, place: Place::Nowhere, data: node };
        node.move_to(&Place::Override(number));
        Ok(node)
    }

    /// A value made by the program, such as a default.
    pub(crate) fn of_value(value: &toml::Value) -> Self {
        let data = match value {
            toml::Value::String(text) => Data::Text(text.clone()),
            toml::Value::Integer(number) => Data::Integer(*number),
            toml::Value::Float(number) => Data::Number(*number),
            toml::Value::Boolean(flag) => Data::Flag(*flag),
            toml::Value::Datetime(date) => Data::Date(date.to_string()),
            toml::Value::Array(rows) => Data::Rows(rows.iter().map(Self::of_value).collect()),
            toml::Value::Table(table) => {
                Data::Table(table.iter().map(|(key, value)| (key.clone(), Self::of_value(value))).collect())
            }
        };
        Self { key_place: Place::Nowhere, place: Place::Nowhere, data }
    }

    /// Says that all of it was written in one place.
    pub(crate) fn move_to(&mut self, place: &Place) {
        self.key_place = place.clone();
        self.place = place.clone();
        match &mut self.data {
            Data::Rows(rows) => rows.iter_mut().for_each(|row| row.move_to(place)),
            Data::Table(entries) => entries.iter_mut().for_each(|(_, value)| value.move_to(place)),
            _ => {}
        }
    }

    /// The value of a key.
    pub(crate) fn get(&self, key: &str) -> Option<&Node> {
        match &self.data {
            Data::Table(entries) => entries.iter().find(|(name, _)| name == key).map(|(_, node)| node),
            Data::Rows(rows) => rows.get(key.parse::<usize>().ok()?),
            _ => None,
        }
    }

    /// Takes a key out of a table.
    pub(crate) fn take(&mut self, key: &str) -> Option<Node> {
        let Data::Table(entries) = &mut self.data else { return None };
        let position = entries.iter().position(|(name, _)| name == key)?;
        Some(entries.remove(position).1)
    }

    /// Adds rows to the array of a key, which is made if need be.
    pub(crate) fn append(&mut self, key: &str, rows: Vec<Node>) {
        let Data::Table(entries) = &mut self.data else { return };
        let Some((_, node)) = entries.iter_mut().find(|(name, _)| name == key) else {
            let place = rows.first().map_or(Place::Nowhere, |row| row.place.clone());
            entries.push((key.to_owned(), Node { key_place: place.clone(), place, data: Data::Rows(rows) }));
            return;
        };
        if let Data::Rows(there) = &mut node.data {
            there.extend(rows);
        }
    }

    /// The deepest node there is on the way to a dotted key, and whether it is the key itself.
    pub(crate) fn nearest_to(&self, key: &str) -> (&Node, bool) {
        let mut node = self;
        for part in key.split('.') {
            match node.get(part) {
                Some(next) => node = next,
                None => return (node, false),
            }
        }
        (node, true)
    }

    /// Puts a value at a dotted key; numbers index arrays, and the number one past the end appends a row. Tables are
    /// merged. `defaults` is what a table or array is before anything is put into it.
    pub(crate) fn set(&mut self, key: &str, value: Node, defaults: Option<&Node>) -> Result<(), String> {
        let parts: Vec<&str> = key.split('.').map(str::trim).collect();
        if parts.iter().any(|part| part.is_empty()) {
            return Err(format!("`{key}` is not a dotted key such as `sheet.spacing`"));
        }
        self.set_parts(&parts, 0, value, defaults)
    }

    fn set_parts(&mut self, parts: &[&str], depth: usize, value: Node, defaults: Option<&Node>) -> Result<(), String> {
        let Some(part) = parts.get(depth) else {
            if let (Data::Table(_), Data::Table(entries)) = (&self.data, &value.data) {
                for (name, value) in entries.clone() {
                    let inner = defaults.and_then(|d| d.get(&name));
                    self.child(&[name.as_str()], 0, &value, inner)?.set_parts(&[], 0, value, inner)?;
                }
            } else {
                *self = value;
            }
            return Ok(());
        };
        let inner = defaults.and_then(|d| d.get(part));
        self.child(parts, depth, &value, inner)?.set_parts(parts, depth + 1, value, inner)
    }

    /// The node of one part of a dotted key, made if it is not there.
    fn child(
        &mut self,
        parts: &[&str],
        depth: usize,
        value: &Node,
        default: Option<&Node>,
    ) -> Result<&mut Node, String> {
        let part = parts[depth];
        let so_far = parts[..depth].join(".");
        let make = || {
            let data = match (parts.get(depth + 1), default) {
                (Some(next), Some(node)) if next.parse::<usize>().is_ok() => node.data.clone(),
                (Some(next), None) if next.parse::<usize>().is_ok() => Data::Rows(Vec::new()),
                (Some(_), _) => Data::Table(Vec::new()),
                (None, _) if matches!(value.data, Data::Table(_)) => Data::Table(Vec::new()),
                (None, _) => Data::Flag(false), // overwritten at once
            };
            let mut node = Node { key_place: value.key_place.clone(), place: value.place.clone(), data };
            node.move_to(&value.key_place);
            node
        };
        match &mut self.data {
            Data::Table(entries) => {
                let position = match entries.iter().position(|(name, _)| name == part) {
                    Some(position) => position,
                    None => {
                        entries.push((part.to_owned(), make()));
                        entries.len() - 1
                    }
                };
                Ok(&mut entries[position].1)
            }
            Data::Rows(rows) => {
                let index: usize =
                    part.parse().map_err(|_| format!("`{so_far}` is an array: say which row, as in `{so_far}.0`"))?;
                if index > rows.len() {
                    return Err(format!(
                        "`{so_far}` has {} rows, numbered from 0: there is no row {index}",
                        rows.len()
                    ));
                }
                if index == rows.len() {
                    rows.push(make());
                }
                Ok(&mut rows[index])
            }
            _ => Err(format!("`{so_far}` is a single value: it holds no `{part}`")),
        }
    }
}

fn read(value: &DeValue<'_>) -> Data {
    match value {
        DeValue::String(text) => Data::Text(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(&number.as_str().replace('_', ""), number.radix()) {
            Ok(integer) => Data::Integer(integer),
            Err(_) => Data::Number(number.as_str().parse().unwrap_or(f64::INFINITY)),
        },
        DeValue::Float(number) => Data::Number(number.as_str().replace('_', "").parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(flag) => Data::Flag(*flag),
        DeValue::Datetime(date) => Data::Date(date.to_string()),
        DeValue::Array(rows) => Data::Rows(
            rows.iter()
                .map(|row| {
                    let place = Place::File(row.span());
                    Node { key_place: place.clone(), place, data: read(row.get_ref()) }
                })
                .collect(),
        ),
        DeValue::Table(table) => {
            let mut entries: Vec<_> = table
                .iter()
                .map(|(key, value)| {
                    let node = Node {
                        key_place: Place::File(key.span()),
                        place: Place::File(value.span()),
                        data: read(value.get_ref()),
                    };
                    (key.span().start, (key.get_ref().to_string(), node))
                })
                .collect();
            entries.sort_by_key(|(start, _)| *start); // so that the first mistake in the file is the one reported
            Data::Table(entries.into_iter().map(|(_, entry)| entry).collect())
        }
    }
}

/// What to try where a file is no TOML at all.
fn syntax_hint(text: &str, span: Range<usize>) -> String {
    let start = text[..span.start.min(text.len())].rfind('\n').map_or(0, |k| k + 1);
    let line = text[start..].lines().next().unwrap_or("");
    if let Some((_, value)) = line.split_once('=') {
        let value = value.split('#').next().unwrap_or("").trim();
        let starts_as_number = value.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '.');
        if starts_as_number && value.contains(|c: char| c.is_alphabetic() || c == '%' || c == '°') {
            return format!("put a quantity with a unit in quotes: \"{value}\"");
        }
        if value.starts_with(|c: char| c.is_alphabetic()) && value != "true" && value != "false" {
            return format!("put words in quotes: \"{value}\"");
        }
    }
    "scene files are TOML: [tables] of key = value lines".to_owned()
}
