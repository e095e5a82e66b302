//! What is wrong with a scene, shown where it was written.

use super::tree::Place;
use std::fmt;

/// One thing that is wrong: where, what, and what to try.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file, the name of the built-in scene, or the `--set` argument.
    pub source: String,
    /// Line and column in the file, counted from 1; none where the whole file is meant.
    pub position: Option<(usize, usize)>,
    /// The line of text pointed at.
    pub line_text: String,
    /// Characters pointed at.
    pub width: usize,
    /// What is wrong.
    pub problem: String,
    /// What to try; empty when there is nothing to say.
    pub hint: String,
}

impl Diagnostic {
    /// About a file as a whole.
    pub fn whole(source: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { source: source.into(), problem: problem.into(), ..Self::default() }
    }

    /// About a place in a file or an override.
    pub(crate) fn at(
        source: &str,
        text: &str,
        overrides: &[String],
        place: &Place,
        problem: impl Into<String>,
    ) -> Self {
        match place {
            Place::File(span) => {
                let start = floor_boundary(text, span.start);
                let line_start = text[..start].rfind('\n').map_or(0, |k| k + 1);
                let line_text = text[line_start..].lines().next().unwrap_or("").to_owned();
                let column = text[line_start..start].chars().count();
                let end = floor_boundary(text, span.end.max(start));
                let width = text[start..end].lines().next().unwrap_or("").chars().count();
                let line = text[..start].matches('\n').count();
                Self {
                    source: source.to_owned(),
                    position: Some((line + 1, column + 1)),
                    line_text,
                    width: width.max(1),
                    problem: problem.into(),
                    hint: String::new(),
                }
            }
            Place::Override(number) => {
                let argument = overrides.get(*number).map_or("", String::as_str);
                Self::whole(format!("--set {argument}"), problem)
            }
            Place::Nowhere => Self::whole(source, problem),
        }
    }

    /// The same, with what to try.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }

    /// The message, in colour for a terminal or plain.
    pub fn render(&self, colour: bool) -> String {
        let (strong, red, plain) = if colour { ("\x1b[1m", "\x1b[31m", "\x1b[0m") } else { ("", "", "") };
        let place = self.position.map_or(String::new(), |(line, column)| format!(":{line}:{column}"));
        let mut text = format!("{strong}{}{place}{plain}: {}", self.source, self.problem);
        if let Some((line, column)) = self.position {
            let margin = " ".repeat(line.to_string().len());
            // Tabs stay tabs, so that the carets stand under the text whatever a tab is wide.
            let indent: String =
                self.line_text.chars().take(column - 1).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
            let carets = "^".repeat(self.width);
            text.push_str(&format!("\n  {line} | {}\n  {margin} | {indent}{red}{carets}{plain}", self.line_text));
        }
        if !self.hint.is_empty() {
            text.push_str(&format!("\n  try: {}", self.hint));
        }
        text
    }
}

/// The last character boundary up to a byte.
fn floor_boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

/// Why a scene cannot be run: one or more things.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct SceneError {
    /// What is wrong, in the order of the file; never empty.
    pub diagnostics: Vec<Diagnostic>,
}

impl From<Diagnostic> for SceneError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { diagnostics: vec![diagnostic] }
    }
}

impl SceneError {
    /// The messages, in colour for a terminal or plain.
    pub fn render(&self, colour: bool) -> String {
        self.diagnostics.iter().map(|d| d.render(colour)).collect::<Vec<_>>().join("\n")
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}
