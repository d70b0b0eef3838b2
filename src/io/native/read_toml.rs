//! Reader of TOML text into the tree, by the crate `toml`, which bounds nesting and refuses
//! duplicate keys.

use super::tree::{Key, Kind, MAX_DEPTH, Source, Value, quoted};
use crate::LoadError;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Reads the text. Fails for malformed TOML, repeated keys and too deep nesting.
pub(super) fn read<'a>(source: &Source<'a>) -> Result<Value<'a>, LoadError> {
    let root = DeTable::parse(source.text).map_err(|e| {
        let span = e.span().unwrap_or(source.text.len()..source.text.len());
        let mut message = e.message().to_string();
        if message == "duplicate key"
            && let Some(key) = source.text.get(span.clone())
        {
            message = format!(
                "the key {} is given twice",
                quoted(key.trim_matches(['"', '\'']))
            );
        } else if message == "recursion limit" || message.contains("recursion limit") {
            message = "it is nested too deeply".into();
        }
        source.error(span.start, message)
    })?;
    let kind = table(source, root.into_inner(), 0)?;
    Ok(Value { at: 0, kind })
}

fn table<'a>(source: &Source, table: DeTable<'a>, depth: usize) -> Result<Kind<'a>, LoadError> {
    let mut entries = Vec::with_capacity(table.len());
    for (name, held) in table {
        let at = name.span().start;
        let key = Key {
            at,
            name: name.into_inner(),
        };
        entries.push((key, value(source, held, depth + 1)?));
    }
    Ok(Kind::Table(entries))
}

fn list<'a>(source: &Source, list: DeArray<'a>, depth: usize) -> Result<Kind<'a>, LoadError> {
    let mut values = Vec::with_capacity(list.len());
    for held in list {
        values.push(value(source, held, depth + 1)?);
    }
    Ok(Kind::List(values))
}

fn value<'a>(
    source: &Source,
    held: Spanned<DeValue<'a>>,
    depth: usize,
) -> Result<Value<'a>, LoadError> {
    let at = held.span().start;
    if depth > MAX_DEPTH {
        return Err(source.error(at, "it is nested too deeply"));
    }
    let number = |text: &str| {
        text.parse()
            .map_err(|_| source.error(at, "it is no number"))
    };
    let kind = match held.into_inner() {
        DeValue::String(text) => Kind::Text(text),
        DeValue::Integer(digits) => {
            match i64::from_str_radix(digits.as_str(), digits.radix()) {
                Ok(i) => Kind::Integer(i),
                // An integer of more than 64 bits can still be a coordinate.
                Err(_) if digits.radix() == 10 => Kind::Float(number(digits.as_str())?),
                Err(_) => return Err(source.error(at, "the number is too large")),
            }
        }
        DeValue::Float(digits) => Kind::Float(number(digits.as_str())?),
        DeValue::Boolean(b) => Kind::Bool(b),
        DeValue::Datetime(_) => Kind::Date,
        DeValue::Array(held) => list(source, held, depth)?,
        DeValue::Table(held) => table(source, held, depth)?,
    };
    Ok(Value { at, kind })
}
