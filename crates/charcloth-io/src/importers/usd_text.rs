//! .usda files: USD as text. What a mesh does not need is read over, as long as its brackets match.

use super::usd_layer::{Attribute, Layer, Prim, Value, taken};

pub(super) const MARK: &[u8] = b"#usda";
/// Deepest nesting that is followed.
const MOST_DEEP: usize = 200;

/// Reads the prims of a file. The error has the line, counted from 1.
pub(super) fn read(text: &str) -> Result<Layer, (usize, String)> {
    let mut reader = Reader { text, at: 0, layer: Layer::default() };
    reader.file().map_err(|problem| {
        let end = reader.at.min(text.len());
        (1 + text.as_bytes()[..end].iter().filter(|b| **b == b'\n').count(), problem)
    })?;
    Ok(reader.layer)
}

#[derive(Debug, Clone, PartialEq)]
enum Token<'a> {
    /// A name or a number.
    Word(&'a str),
    /// What stands in quotes, or between @ or angle brackets.
    Text(String),
    Sign(char),
    End,
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    layer: Layer,
}

impl<'a> Reader<'a> {
    fn file(&mut self) -> Result<(), String> {
        if self.peek()? == Token::Sign('(') {
            for (name, value) in self.metadata(0)? {
                self.layer.metadata.extend(value.map(|value| (name, value)));
            }
        }
        while self.peek()? != Token::End {
            self.statement(None, "", true, 0)?;
        }
        Ok(())
    }

    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    /// Steps over white space and comments.
    fn skip(&mut self) {
        loop {
            let rest = self.rest();
            self.at += rest.len() - rest.trim_start_matches(|c: char| c.is_whitespace() || c == ';').len();
            if !self.rest().starts_with('#') {
                return;
            }
            self.at += self.rest().find('\n').unwrap_or(self.rest().len());
        }
    }

    fn peek(&mut self) -> Result<Token<'a>, String> {
        let before = self.at;
        let token = self.token();
        self.at = before;
        token
    }

    fn token(&mut self) -> Result<Token<'a>, String> {
        self.skip();
        let rest = self.rest();
        let Some(first) = rest.chars().next() else { return Ok(Token::End) };
        let is_word = |c: char| c.is_alphanumeric() || "_:.+-!".contains(c);
        if is_word(first) {
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            self.at += length;
            return Ok(Token::Word(&rest[..length]));
        }
        let fences =
            [("\"\"\"", "\"\"\""), ("'''", "'''"), ("@@@", "@@@"), ("\"", "\""), ("'", "'"), ("@", "@"), ("<", ">")];
        if let Some((open, close)) = fences.into_iter().find(|(open, _)| rest.starts_with(open)) {
            let body = &rest[open.len()..];
            let mut from = 0;
            loop {
                let end = from + body[from..].find(close).ok_or("a text does not end")?;
                let backslashes = body[..end].bytes().rev().take_while(|b| *b == b'\\').count();
                if backslashes % 2 == 0 || !["\"", "'"].contains(&&close[..1]) {
                    self.at += open.len() + end + close.len();
                    return Ok(Token::Text(body[..end].to_string()));
                }
                from = end + 1;
            }
        }
        self.at += first.len_utf8();
        Ok(Token::Sign(first))
    }

    fn expect(&mut self, sign: char) -> Result<(), String> {
        match self.token()? {
            Token::Sign(there) if there == sign => Ok(()),
            _ => Err(format!("there should be a \"{sign}\"")),
        }
    }

    fn accept(&mut self, sign: char) -> Result<bool, String> {
        let there = self.peek()? == Token::Sign(sign);
        if there {
            self.token()?;
        }
        Ok(there)
    }

    /// `( name = value ... )`
    fn metadata(&mut self, deep: usize) -> Result<Vec<(String, Option<Value>)>, String> {
        self.expect('(')?;
        let mut all = Vec::new();
        loop {
            match self.token()? {
                Token::Sign(')') => return Ok(all),
                Token::End => return Err("it ends within brackets".to_string()),
                // A comment that is kept.
                Token::Text(_) | Token::Sign(_) => {}
                Token::Word("prepend" | "append" | "add" | "delete" | "reorder") => {}
                Token::Word(name) => {
                    self.expect('=')?;
                    all.push((name.to_string(), self.value(deep)?));
                }
            }
        }
    }

    /// A prim, a property or a set of variants, in a prim of this row and path.
    fn statement(&mut self, prim: Option<usize>, path: &str, defined: bool, deep: usize) -> Result<(), String> {
        if deep > MOST_DEEP {
            return Err(format!("it is nested more than {MOST_DEEP} deep"));
        }
        let mut words = vec![];
        loop {
            match self.peek()? {
                Token::Word(word) => {
                    self.token()?;
                    words.push(word);
                }
                Token::Sign('[') if !words.is_empty() => {
                    self.token()?;
                    self.expect(']')?;
                    words.push("[]");
                }
                _ => break,
            }
        }
        match words.first().copied() {
            Some(how @ ("def" | "over" | "class")) => {
                self.prim(how == "def" && defined, words.get(1).copied().unwrap_or_default(), path, deep)
            }
            Some("variantSet") => {
                // What variants hold is not chosen from.
                self.token()?;
                self.expect('=')?;
                self.value(deep + 1).map(drop)
            }
            Some(_) => self.property(&words, prim, deep),
            None => Err("there should be a prim or an attribute".to_string()),
        }
    }

    fn prim(&mut self, defined: bool, type_name: &str, path: &str, deep: usize) -> Result<(), String> {
        let Token::Text(name) = self.token()? else { return Err("there should be the name of a prim".to_string()) };
        let path = format!("{path}/{name}");
        let mut prim =
            Prim { path: path.clone(), type_name: type_name.to_string(), is_defined: defined, ..Prim::default() };
        if self.peek()? == Token::Sign('(') {
            for (name, value) in self.metadata(deep)? {
                if let Some(field) = taken(&name).or((name == "variantSets").then_some("variants")) {
                    prim.taken = field;
                }
                if name == "active" && value == Some(Value::Numbers(vec![0.0])) {
                    prim.is_defined = false;
                }
            }
        }
        self.layer.prims.push(prim);
        let row = self.layer.prims.len() - 1;
        self.expect('{')?;
        while !self.accept('}')? {
            self.statement(Some(row), &path, defined, deep + 1)?;
        }
        Ok(())
    }

    /// The rest of a property: `= value ( metadata )`.
    fn property(&mut self, words: &[&str], prim: Option<usize>, deep: usize) -> Result<(), String> {
        let full_name = words[words.len() - 1];
        let (name, what) = match full_name.rsplit_once('.') {
            Some((name, what @ ("timeSamples" | "connect" | "spline"))) => (name, what),
            _ => (full_name, ""),
        };
        let is_array = words.len() > 1 && words[words.len() - 2] == "[]";
        let type_name = words.iter().rev().skip(1).find(|word| **word != "[]").copied().unwrap_or_default();
        let mut value = None;
        if self.accept('=')? {
            value = if what == "timeSamples" { self.first_sample(deep)? } else { self.value(deep)? };
        }
        if let (true, Some(Value::Numbers(numbers))) = (type_name.starts_with("quat"), &mut value) {
            // The real part is first in text and last in crates.
            numbers.chunks_exact_mut(4).for_each(|quaternion| quaternion.rotate_left(1));
        }
        let metadata = if self.peek()? == Token::Sign('(') { self.metadata(deep)? } else { Vec::new() };
        let Some(prim) = prim.filter(|_| ["", "timeSamples"].contains(&what)) else { return Ok(()) };
        let attribute: &mut Attribute = self.layer.prims[prim].attributes.entry(name.to_string()).or_default();
        attribute.type_name = format!("{type_name}{}", if is_array { "[]" } else { "" });
        for (name, value) in metadata {
            if let (true, Some(Value::Texts(texts))) = (name == "interpolation", value) {
                attribute.interpolation = texts.into_iter().next().unwrap_or_default();
            }
        }
        if what == "timeSamples" {
            attribute.is_animated = true;
            attribute.value = attribute.value.take().or(value);
        } else {
            attribute.value = value.or(attribute.value.take());
        }
        Ok(())
    }

    /// `{ time: value, ... }`; samples stand in the order of their times.
    fn first_sample(&mut self, deep: usize) -> Result<Option<Value>, String> {
        self.expect('{')?;
        let mut first: Option<(f64, Option<Value>)> = None;
        while !self.accept('}')? {
            let Token::Word(time) = self.token()? else { return Err("there should be a time".to_string()) };
            let time: f64 = time.trim_end_matches(':').parse().map_err(|_| format!("\"{time}\" is not a time"))?;
            self.accept(':')?;
            let value = self.value(deep)?;
            self.accept(',')?;
            if first.as_ref().is_none_or(|(earliest, _)| time < *earliest) {
                first = Some((time, value));
            }
        }
        Ok(first.and_then(|(_, value)| value))
    }

    /// A value: none where it says so, or where it is a dictionary.
    fn value(&mut self, deep: usize) -> Result<Option<Value>, String> {
        let (mut numbers, mut texts) = (Vec::new(), Vec::new());
        let mut open = Vec::new();
        loop {
            match self.token()? {
                Token::Word("None") => {}
                Token::Word("true") => numbers.push(1.0),
                Token::Word("false") => numbers.push(0.0),
                Token::Word(word) => match word.parse() {
                    Ok(number) => numbers.push(number),
                    // Names of keys and types in a dictionary.
                    Err(_) if open.contains(&'}') => {}
                    Err(_) => return Err(format!("\"{word}\" is not a value")),
                },
                Token::Text(text) => texts.push(text),
                Token::Sign('(') => open.push(')'),
                Token::Sign('[') => open.push(']'),
                Token::Sign('{') => open.push('}'),
                Token::Sign(sign @ (')' | ']' | '}')) => {
                    if open.pop() != Some(sign) {
                        return Err(format!("there is a \"{sign}\" too many"));
                    }
                }
                Token::Sign(',') if !open.is_empty() => {}
                Token::Sign(_) if open.contains(&'}') => {}
                Token::Sign(sign) => return Err(format!("there should be a value, not \"{sign}\"")),
                Token::End => return Err("it ends within a value".to_string()),
            }
            if open.len() + deep > MOST_DEEP {
                return Err(format!("it is nested more than {MOST_DEEP} deep"));
            }
            if open.is_empty() {
                break;
            }
        }
        // The layer offset or the target behind an asset.
        if let Token::Text(_) = self.peek()? {
            let before = self.at;
            self.skip();
            if self.rest().starts_with('<') && !texts.is_empty() {
                self.token()?;
            } else {
                self.at = before;
            }
        }
        Ok(match (numbers.is_empty(), texts.is_empty()) {
            (true, false) => Some(Value::Texts(texts)),
            _ => Some(Value::Numbers(numbers)),
        })
    }
}
