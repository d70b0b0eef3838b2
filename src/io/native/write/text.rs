//! The text of a scene: values, in TOML or in JSON.

use crate::native::Syntax;
use std::fmt::Write;

/// What stands behind a key.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Written with as few digits as read back to the same f64.
    Number(f64),
    Whole(i64),
    Flag(bool),
    Text(String),
    List(Vec<Value>),
    Table(Table),
}

/// Keys in their order.
pub(super) type Table = Vec<(String, Value)>;

/// Makes a list of numbers.
pub(super) fn numbers(list: impl IntoIterator<Item = f64>) -> Value {
    Value::List(list.into_iter().map(Value::Number).collect())
}

/// Makes a table of one key.
pub(super) fn one(key: &str, value: Value) -> Value {
    Value::Table(vec![(key.into(), value)])
}

/// Takes an f32 to the f64 of its fewest digits, so that 0.1 is written as such, if that is read
/// back to the same f32.
pub(super) fn short(x: f32) -> f64 {
    let few: f64 = x.to_string().parse().unwrap_or(f64::from(x));
    if few as f32 == x { few } else { f64::from(x) }
}

/// Writes tables and lists of a file, in the order of `parts`: a table of tables, a list of
/// tables, or single values, one row a line.
pub(super) fn file(parts: &Table, syntax: Syntax) -> String {
    match syntax {
        Syntax::Toml => toml(parts),
        Syntax::Json => json(parts),
    }
}

fn toml(parts: &Table) -> String {
    let mut text = String::new();
    let mut rows = |head: String, table: &Table| {
        let _ = writeln!(text, "{head}");
        for (key, value) in table {
            let _ = write!(text, "{} = ", toml_key(key));
            match value {
                // Lists of tables are long: a line each.
                Value::List(list) if matches!(list.first(), Some(Value::Table(_))) => {
                    text.push_str("[\n");
                    for value in list {
                        text.push_str("  ");
                        inline(&mut text, value, Syntax::Toml);
                        text.push_str(",\n");
                    }
                    text.push(']');
                }
                value => inline(&mut text, value, Syntax::Toml),
            }
            text.push('\n');
        }
    };
    // Single values come before all tables, or they would belong to one.
    let is_single = |value: &Value| match value {
        Value::Table(_) => false,
        Value::List(list) => !matches!(list.first(), Some(Value::Table(_))),
        _ => true,
    };
    let single = parts.iter().filter(|(_, value)| is_single(value));
    let single: Table = single.cloned().collect();
    rows("# Written by Lanecast.".into(), &single);
    for (key, value) in parts {
        match value {
            Value::List(list) => {
                for row in list {
                    if let Value::Table(row) = row {
                        rows(format!("\n[[{key}]]"), row);
                    }
                }
            }
            Value::Table(table) => {
                let of_rows = table.iter().all(|(_, v)| matches!(v, Value::Table(_)));
                if !of_rows {
                    rows(format!("\n[{key}]"), table);
                    continue;
                }
                for (name, row) in table {
                    if let Value::Table(row) = row {
                        rows(format!("\n[{key}.{}]", toml_key(name)), row);
                    }
                }
            }
            _ => {}
        }
    }
    text
}

fn toml_key(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !key.is_empty() && key.chars().all(is_bare) {
        true => key.into(),
        false => quoted(key),
    }
}

fn json(parts: &Table) -> String {
    let mut text = String::from("{\n");
    let mut first = "";
    for (key, value) in parts {
        let _ = write!(text, "{first}  {}: ", quoted(key));
        first = ",\n";
        let mut separator = "\n";
        match value {
            Value::Table(table) => {
                text.push('{');
                for (key, value) in table {
                    let _ = write!(text, "{separator}    {}: ", quoted(key));
                    inline(&mut text, value, Syntax::Json);
                    separator = ",\n";
                }
                text.push_str("\n  }");
            }
            Value::List(list) if matches!(list.first(), Some(Value::Table(_))) => {
                text.push('[');
                for value in list {
                    let _ = write!(text, "{separator}    ");
                    inline(&mut text, value, Syntax::Json);
                    separator = ",\n";
                }
                text.push_str("\n  ]");
            }
            value => inline(&mut text, value, Syntax::Json),
        }
    }
    text + "\n}\n"
}

/// Writes a value within one line.
fn inline(text: &mut String, value: &Value, syntax: Syntax) {
    let mut separator = "";
    match value {
        Value::List(list) => {
            text.push('[');
            for value in list {
                text.push_str(separator);
                inline(text, value, syntax);
                separator = ", ";
            }
            text.push(']');
        }
        Value::Table(table) => {
            text.push('{');
            for (key, value) in table {
                let _ = match syntax {
                    Syntax::Toml => write!(text, "{separator} {} = ", toml_key(key)),
                    Syntax::Json => write!(text, "{separator} {}: ", quoted(key)),
                };
                inline(text, value, syntax);
                separator = ",";
            }
            text.push_str(" }");
        }
        single => scalar(text, single),
    }
}

/// Writes what both syntaxes write alike.
fn scalar(text: &mut String, value: &Value) {
    let _ = match value {
        // Debug always has a point or an exponent, and the fewest digits.
        Value::Number(x) => write!(text, "{x:?}"),
        Value::Whole(x) => write!(text, "{x}"),
        Value::Flag(x) => write!(text, "{x}"),
        Value::Text(x) => write!(text, "{}", quoted(x)),
        Value::List(_) | Value::Table(_) => Ok(()),
    };
}

/// Quotes a text by the rules that TOML and JSON share.
fn quoted(text: &str) -> String {
    let mut all = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => all.push_str("\\\""),
            '\\' => all.push_str("\\\\"),
            c if c.is_control() => drop(write!(all, "\\u{:04x}", u32::from(c))),
            c => all.push(c),
        }
    }
    all.push('"');
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f32_have_few_digits_and_come_back() {
        assert_eq!(short(0.1), 0.1);
        for bits in (0..0x7f80_0000_u32).step_by(99_991) {
            let x = f32::from_bits(bits);
            assert_eq!(short(x) as f32, x);
        }
    }

    #[test]
    fn names_and_rows_in_both_syntaxes() {
        let row = || vec![("radius".to_string(), Value::Number(0.5))];
        let parts: Table = vec![
            (
                "shape".into(),
                Value::Table(vec![("a \"b\"\n".into(), Value::Table(row()))]),
            ),
            ("format".into(), Value::Whole(1)),
        ];
        let said = file(&parts, Syntax::Toml);
        let expected =
            "# Written by Lanecast.\nformat = 1\n\n[shape.\"a \\\"b\\\"\\u000a\"]\nradius = 0.5\n";
        assert_eq!(said, expected);
        let said: serde_json::Value = serde_json::from_str(&file(&parts, Syntax::Json)).unwrap();
        assert_eq!(said["shape"]["a \"b\"\n"]["radius"], 0.5);
    }
}
