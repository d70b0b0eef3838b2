//! The tree that TOML and JSON are read into: values with their byte offsets in the text.
//!
//! Both readers bound the depth, so code that walks or drops a tree may recurse. [`Source`]
//! turns offsets into lines and columns, for messages only.

use crate::LoadError;
use std::borrow::Cow;
use std::path::Path;

/// Limit on the depth of a tree. The format itself nests eight deep.
pub(super) const MAX_DEPTH: usize = 64;

/// A value and its byte offset in the text.
#[derive(Debug)]
pub(super) struct Value<'a> {
    pub at: usize,
    pub kind: Kind<'a>,
}

/// A value of TOML or JSON.
#[derive(Debug)]
pub(super) enum Kind<'a> {
    Null,
    Bool(bool),
    Integer(i64),
    /// A number, maybe infinite or NaN, for which TOML has words.
    Float(f64),
    Text(Cow<'a, str>),
    /// A date or time, which only TOML has and no key of the format takes.
    Date,
    List(Vec<Value<'a>>),
    /// Entries in the order of the file, without repeated keys.
    Table(Vec<(Key<'a>, Value<'a>)>),
}

/// A key and its byte offset in the text.
#[derive(Debug)]
pub(super) struct Key<'a> {
    pub at: usize,
    pub name: Cow<'a, str>,
}

impl Kind<'_> {
    /// Names the kind of value for messages: `expected …, found …`.
    pub(super) fn describe(&self) -> &'static str {
        match self {
            Kind::Null => "null",
            Kind::Bool(_) => "true or false",
            Kind::Integer(_) | Kind::Float(_) => "a number",
            Kind::Text(_) => "text",
            Kind::Date => "a date",
            Kind::List(_) => "a list",
            Kind::Table(_) => "a table",
        }
    }
}

/// A file and its text, for messages.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Returns line and column of a byte offset, both from 1; the column counts characters.
    pub(super) fn place(&self, at: usize) -> (usize, usize) {
        crate::shared::line_column::line_column(self.text.as_bytes(), at)
    }

    /// Finds the byte offset in the file of byte `offset` of a text value that begins at `at`.
    ///
    /// The quotes, and characters that are in the file but not in the value, are skipped: a
    /// first line break, continued lines, and carriage returns. The search ends at the first
    /// escape, whose place is returned for all that follows.
    pub(super) fn within(&self, at: usize, value: &str, offset: usize) -> usize {
        let written = self.text.get(at..).unwrap_or_default();
        let quotes = ["\"\"\"", "'''", "\"", "'"];
        let quote = quotes.into_iter().find(|quote| written.starts_with(*quote));
        let mut rest = &written[quote.map_or(0, str::len)..];
        let before = value.get(..offset).unwrap_or(value);
        let is_long = quote.is_some_and(|quote| quote.len() == 3);
        if is_long {
            // A line break right after the quotes is not part of the value.
            let line = rest.strip_prefix('\r').unwrap_or(rest);
            rest = line.strip_prefix('\n').unwrap_or(rest);
        }
        for c in before.chars() {
            let continued = rest.strip_prefix('\\').map(str::trim_start);
            rest = continued.filter(|_| is_long).unwrap_or(rest);
            rest = match rest.strip_prefix("\r\n") {
                Some(_) if c == '\n' => &rest[1..],
                _ => rest,
            };
            match rest.strip_prefix(c) {
                Some(after) => rest = after,
                None => break,
            }
        }
        at + written.len() - rest.len()
    }

    /// Makes an error at the line and column of a byte offset.
    pub(super) fn error(&self, at: usize, message: impl Into<String>) -> LoadError {
        let (line, column) = self.place(at);
        LoadError::Syntax {
            path: self.path.into(),
            line,
            column,
            message: message.into(),
        }
    }
}

/// Quotes a name for a message, escaped and cut after 60 characters.
pub(super) fn quoted(name: &str) -> String {
    const SHOWN: usize = 60;
    let mut shown: String = name
        .chars()
        .take(SHOWN)
        .flat_map(char::escape_debug)
        .collect();
    if name.chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    format!("'{shown}'")
}

/// Finds the known name most similar to `name`, by Jaro-Winkler similarity of at least 0.75;
/// the first of equally similar ones.
pub(super) fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    // Longer names are not compared, because the comparison is quadratic in length.
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return None;
    }
    let lower = name.to_lowercase();
    known
        .filter(|k| k.len() <= LONGEST)
        .map(|k| (strsim::jaro_winkler(&lower, &k.to_lowercase()), k))
        .filter(|(likeness, _)| *likeness >= 0.75)
        .fold(None, |best: Option<(f64, &str)>, next| match best {
            Some(b) if b.0 >= next.0 => Some(b),
            _ => Some(next),
        })
        .map(|(_, k)| k)
}
