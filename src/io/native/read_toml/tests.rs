use super::*;
use proptest::prelude::*;
use std::path::Path;
use toml::de::{DeTable, DeValue};

fn parsed(text: &str) -> Result<String, String> {
    let path = Path::new("s.toml");
    match read(&Source { path, text }) {
        Ok(value) => Ok(shown(&value)),
        Err(e) => Err(e.to_string()),
    }
}

/// The tree with byte offsets, tables sorted by their keys.
fn shown(value: &Value) -> String {
    let kind = match &value.kind {
        Kind::List(list) => format!("{:?}", list.iter().map(shown).collect::<Vec<_>>()),
        Kind::Table(entries) => {
            let entry =
                |(key, value): &(Key, Value)| format!("{}@{}={}", key.name, key.at, shown(value));
            let mut entries: Vec<String> = entries.iter().map(entry).collect();
            entries.sort();
            format!("{entries:?}")
        }
        other => format!("{other:?}"),
    };
    format!("{}:{kind}", value.at)
}

/// What the crate `toml` reads, shown alike. It leaves numbers unread.
fn expected(text: &str) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let kind = table(root.into_inner())?;
    Some(shown(&Value { at: 0, kind }))
}

fn table(table: DeTable<'_>) -> Option<Kind<'_>> {
    let entries = table.into_iter().map(|(name, held)| {
        let at = name.span().start;
        let name = name.into_inner();
        Some((Key { at, name }, value(held)?))
    });
    Some(Kind::Table(entries.collect::<Option<_>>()?))
}

fn value(held: toml::Spanned<DeValue<'_>>) -> Option<Value<'_>> {
    let at = held.span().start;
    let kind = match held.into_inner() {
        DeValue::String(text) => Kind::Text(text),
        DeValue::Integer(digits) => match i64::from_str_radix(digits.as_str(), digits.radix()) {
            Ok(i) => Kind::Integer(i),
            Err(_) if digits.radix() == 10 => Kind::Float(digits.as_str().parse().ok()?),
            Err(_) => return None,
        },
        DeValue::Float(digits) => Kind::Float(digits.as_str().parse().ok()?),
        DeValue::Boolean(b) => Kind::Bool(b),
        DeValue::Datetime(_) => Kind::Date,
        DeValue::Array(list) => Kind::List(list.into_iter().map(value).collect::<Option<_>>()?),
        DeValue::Table(held) => table(held)?,
    };
    Some(Value { at, kind })
}

#[test]
fn tables_are_extended_as_toml_says() {
    for (text, right) in [
        ("[a.b]\nx=1\n[a]\ny=2", true),
        ("[a]\nb.x=1\nb.y=2", true),
        ("[a]\nb.x=1\n[a.b]\ny=2", false),
        ("[a]\n[a]", false),
        ("[a]\nb=1\nb=2", false),
        ("a={}\n[a.b]", false),
        ("a={}\na.b=1", false),
        ("[[a]]\n[[a]]\nx=1\n[a.b]\n[[a.c]]", true),
        ("[a]\n[[a]]", false),
        ("a=[]\n[[a]]", false),
        ("[[a]]\n[a]", false),
        ("a=1\n[a.b]", false),
        ("[a.b.c]\nz=9\n[a]\nb.c.t=1", false),
        ("x={a.b=1, a.c=2}", true),
        ("x={a.b=1, a={}}", false),
        ("x={a={}, a.b=1}", false),
    ] {
        assert_eq!(parsed(text).is_ok(), right, "{text}: {:?}", parsed(text));
        assert_eq!(parsed(text).ok(), expected(text), "{text}");
    }
}

#[test]
fn pieces_make_one_document() {
    let one = "[[a]]\nx = [\n1,\n]\ny.z = \"\"\"\nb\n[c]\"\"\" # [\n";
    let text = one.repeat(PIECE / 4);
    assert_eq!(parsed(&text).ok(), expected(&text));
    let wrong = text + "[[a]\n";
    assert!(parsed(&wrong).unwrap_err().contains("unclosed array table"));
}

fn fragments() -> impl Strategy<Value = String> {
    let fragment = prop::sample::select(vec![
        "a",
        "b",
        "\"c d\"",
        "'e'",
        ".",
        "=",
        "[",
        "]",
        "[[",
        "]]",
        "{",
        "}",
        ",",
        "\n",
        "\n",
        " ",
        "1",
        "-2.5e3",
        "0x1F",
        "1_000",
        "inf",
        "nan",
        "true",
        "2020-01-01",
        "\"t\\u0041\"",
        "'''m\nl'''",
        "\"\"\"m\nl\"\"\"",
        "# c\n",
        "\r\n",
        "a = 1\n",
        "[a]\n",
        "[[b]]\n",
        "[a.b]\n",
        "a.b = {a = [1, 2]}\n",
        "b = [{a = 1}, {}]\n",
        "99999999999999999999",
        "\u{1}",
        "é",
    ]);
    prop::collection::vec(fragment, 0..24).prop_map(|all| all.concat())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 5000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// The same trees, and the same texts are refused.
    #[test]
    fn every_text_is_read_as_the_crate_toml_reads_it(text in fragments()) {
        prop_assert_eq!(parsed(&text).ok(), expected(&text), "{:?}", parsed(&text));
    }
}
