//! The one tree that TOML and JSON are read into: values with their places.
//!
//! Both readers bound the depth, so whatever walks or drops a tree may recurse.
//! Places are byte offsets in the text; [`Source`] turns them into lines and
//! columns, and only for messages.

use crate::LoadError;
use std::borrow::Cow;
use std::path::Path;

/// The format nests eight deep; what goes beyond this is not a scene.
pub(super) const MAX_DEPTH: usize = 64;

#[derive(Debug)]
pub(super) struct Value<'a> {
    pub at: usize,
    pub kind: Kind<'a>,
}

#[derive(Debug)]
pub(super) enum Kind<'a> {
    Null,
    Bool(bool),
    Integer(i64),
    /// May be infinite or NaN: TOML has words for them.
    Float(f64),
    Text(Cow<'a, str>),
    /// TOML only; the format has no use for it.
    Date,
    List(Vec<Value<'a>>),
    /// In the order of the file; no key twice.
    Table(Vec<(Key<'a>, Value<'a>)>),
}

#[derive(Debug)]
pub(super) struct Key<'a> {
    pub at: usize,
    pub name: Cow<'a, str>,
}

impl Kind<'_> {
    /// For `expected …, found …`.
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

/// The file that messages speak of.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Line and column, both from 1; the column counts characters.
    pub(super) fn place(&self, at: usize) -> (usize, usize) {
        crate::shared::line_column::line_column(self.text.as_bytes(), at)
    }

    /// Where a byte of a text value stands, which begins at `at`: past its quotes, and
    /// past what is written there but not in the value. At the first escape it stops.
    pub(super) fn within(&self, at: usize, value: &str, offset: usize) -> usize {
        let written = self.text.get(at..).unwrap_or_default();
        let quotes = ["\"\"\"", "'''", "\"", "'"];
        let quote = quotes.into_iter().find(|quote| written.starts_with(*quote));
        let mut rest = &written[quote.map_or(0, str::len)..];
        let before = value.get(..offset).unwrap_or(value);
        let is_long = quote.is_some_and(|quote| quote.len() == 3);
        if is_long {
            // A first line's end is no part of it.
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

/// A name for a message: in quotes, shortened, without control characters.
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

/// The known name most like `name`, if it is like any.
pub(super) fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    // The comparison is quadratic in length: nobody means names this long.
    const LONGEST: usize = 64;
    if name.len() > LONGEST {
        return None;
    }
    let lower = name.to_lowercase();
    known
        .filter(|k| k.len() <= LONGEST)
        .map(|k| (strsim::jaro_winkler(&lower, &k.to_lowercase()), k))
        .filter(|(likeness, _)| *likeness >= 0.6)
        // The first of equals.
        .fold(None, |best: Option<(f64, &str)>, next| match best {
            Some(b) if b.0 >= next.0 => Some(b),
            _ => Some(next),
        })
        .map(|(_, k)| k)
}
