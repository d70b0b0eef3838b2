//! Reader of JSON text into the tree, by `serde_json`.
//!
//! Values are parsed level by level into raw slices, because the address of a slice gives
//! its offset in the text. Text is therefore scanned once more for each level above it, which
//! the limit on depth bounds.

use super::tree::{Key, Kind, MAX_DEPTH, Source, Value, quoted};
use crate::LoadError;
use crate::shared::messages::json_fault;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;
use std::borrow::Cow;
use std::collections::HashSet;

/// Reads the text. Fails for malformed JSON, repeated keys and too deep nesting.
pub(super) fn read<'a>(source: &Source<'a>) -> Result<Value<'a>, LoadError> {
    // The whole text is scanned here, without recursion; from here on its grammar is known
    // to be correct.
    let raw: &RawValue =
        serde_json::from_str(source.text).map_err(|e| syntax(source, source.text, &e))?;
    value(source, raw, 0)
}

/// Converts the raw text of a value at this depth.
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

/// Decodes a string with its quotes; copies only if it has escapes.
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

/// Returns the offset of `text`, which must be a slice of the source's text.
fn offset(source: &Source, text: &str) -> usize {
    (text.as_ptr() as usize).saturating_sub(source.text.as_ptr() as usize)
}

/// Translates an error of the parser in `text`, a slice of the source's text, and places it
/// in the whole file.
fn syntax(source: &Source, text: &str, error: &serde_json::Error) -> LoadError {
    let lines = text
        .split_inclusive('\n')
        .take(error.line().saturating_sub(1));
    let at = lines.map(str::len).sum::<usize>() + error.column().saturating_sub(1);
    source.error(offset(source, text) + at.min(text.len()), json_fault(error))
}

/// The entries of a table in the order of the file, with repeated keys.
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
