//! JSON text to the tree. The parser is `serde_json`; values are taken apart
//! level by level as raw slices, because a slice knows its place in the text.
//!
//! Each level is scanned once more for each level above it: depth is bounded.

use super::tree::{Key, Kind, MAX_DEPTH, Source, Value, quoted};
use crate::LoadError;
use crate::shared::messages::json_fault;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::collections::HashSet;

pub(super) fn read<'a>(source: &Source<'a>) -> Result<Value<'a>, LoadError> {
    // The whole text is scanned here, without recursion: its grammar is right
    // from here on.
    let raw: &RawValue =
        serde_json::from_str(source.text).map_err(|e| syntax(source, source.text, &e))?;
    value(source, raw, 0)
}

fn value<'a>(source: &Source<'a>, raw: &'a RawValue, depth: usize) -> Result<Value<'a>, LoadError> {
    let text = raw.get();
    let at = offset(source, text);
    if depth > MAX_DEPTH {
        return Err(source.error(at, "it is nested too deeply"));
    }
    let kind = match text.as_bytes().first() {
        Some(b'{') => {
            let Entries(entries) = parse(source, text)?;
            let mut table = Vec::with_capacity(entries.len());
            let mut seen = HashSet::with_capacity(entries.len());
            for (key, held) in entries {
                let at = offset(source, key.get());
                let name = self::text(source, key.get())?;
                if !seen.insert(name.clone()) {
                    let message = format!("the key {} is given twice", quoted(&name));
                    return Err(source.error(at, message));
                }
                table.push((Key { at, name }, value(source, held, depth + 1)?));
            }
            Kind::Table(table)
        }
        Some(b'[') => {
            let items: Vec<&'a RawValue> = parse(source, text)?;
            let items = items.into_iter().map(|held| value(source, held, depth + 1));
            Kind::List(items.collect::<Result<_, _>>()?)
        }
        Some(b'"') => Kind::Text(self::text(source, text)?),
        Some(b't') => Kind::Bool(true),
        Some(b'f') => Kind::Bool(false),
        Some(b'n') => Kind::Null,
        _ => match text.parse() {
            Ok(i) => Kind::Integer(i),
            Err(_) => Kind::Float(parse(source, text)?),
        },
    };
    Ok(Value { at, kind })
}

fn text<'a>(source: &Source, text: &'a str) -> Result<Cow<'a, str>, LoadError> {
    let inner = &text[1..text.len() - 1];
    if inner.contains('\\') {
        return parse(source, text).map(Cow::Owned);
    }
    Ok(Cow::Borrowed(inner))
}

fn parse<'a, T: Deserialize<'a>>(source: &Source, text: &'a str) -> Result<T, LoadError> {
    serde_json::from_str(text).map_err(|e| syntax(source, text, &e))
}

/// `text` is a slice of the source's own text.
fn offset(source: &Source, text: &str) -> usize {
    (text.as_ptr() as usize).saturating_sub(source.text.as_ptr() as usize)
}

/// The parser's message at its place in the whole file.
fn syntax(source: &Source, text: &str, error: &serde_json::Error) -> LoadError {
    let lines = text
        .split_inclusive('\n')
        .take(error.line().saturating_sub(1));
    let at = lines.map(str::len).sum::<usize>() + error.column().saturating_sub(1);
    source.error(offset(source, text) + at.min(text.len()), json_fault(error))
}

/// A table's entries as they stand, repeated keys included.
struct Entries<'a>(Vec<(&'a RawValue, &'a RawValue)>);

impl<'de> Deserialize<'de> for Entries<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect;
        impl<'de> Visitor<'de> for Collect {
            type Value = Entries<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries<'de>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Entries(entries))
            }
        }
        deserializer.deserialize_map(Collect)
    }
}
