//! Texts for messages: quotations from files, and translated errors of the JSON parser.

/// Makes a text from a file fit for one line of a message or for a name: replaces control
/// characters by blanks, and cuts after `LIMIT` characters.
pub fn one_line(text: &str) -> String {
    const LIMIT: usize = 160;
    let mut line: String = text
        .chars()
        .take(LIMIT)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    if text.chars().nth(LIMIT).is_some() {
        line.push('…');
    }
    line.trim().into()
}

/// Translates an error of `serde_json` into the words of our messages, without line and
/// column.
pub fn json_fault(error: &serde_json::Error) -> String {
    let full = error.to_string();
    let said = full.rfind(" at line ").map_or(&*full, |end| &full[..end]);
    if said.starts_with("EOF") || said == "unexpected end of hex escape" && error.is_eof() {
        return "the file ends too early: something is not closed, or it is empty".into();
    }
    if let Some(("invalid type", rest)) = said.split_once(": ")
        && let Some((found, expected)) = rest.rsplit_once(", expected ")
    {
        let expected = match expected {
            "a sequence" => "a list",
            "a map" => "a table",
            "a string" => "text in quotes",
            other if other.starts_with("struct ") => "a table",
            other => other,
        };
        return one_line(&format!("expected {expected}, found {}", kind(found)));
    }
    let ours = match said {
        "expected ident" => "this is no value; expected true, false or null",
        "number out of range" => "the number is too large; at most 1.7e308 is possible",
        "trailing characters" => "there is more after the end of the value",
        "key must be a string" => "expected a key in double quotes",
        "unexpected end of hex escape" | "lone leading surrogate in hex escape" => {
            "half of a character's code: \\ud800 to \\udfff come in pairs"
        }
        control if control.starts_with("control character") => {
            "a line break or another control character within a text; write it as \\n or \\u000a"
        }
        other => other,
    };
    one_line(ours)
}

/// Translates what `serde_json` calls a value it found, such as "integer `3`" or "map".
fn kind(found: &str) -> &str {
    match found.split_whitespace().next() {
        Some("integer" | "floating") => "a number",
        Some("string") => "text",
        Some("boolean") => "true or false",
        Some("sequence") => "a list",
        Some("map") => "a table",
        _ => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_faults_are_in_our_words() {
        let fault =
            |text: &str| json_fault(&serde_json::from_str::<Vec<String>>(text).unwrap_err());
        for (text, says) in [
            ("", "the file ends too early"),
            ("[\"a", "the file ends too early"),
            ("[1]", "expected text in quotes, found a number"),
            ("{}", "expected a list, found a table"),
            ("[] x", "more after the end"),
            ("[nul]", "no value"),
            ("[\"a\nb\"]", "a line break"),
        ] {
            let said = fault(text);
            assert!(said.contains(says), "{text}: {said}");
            assert!(!said.contains(" at line "), "{said}");
        }
    }

    #[test]
    fn keeps_one_short_line() {
        assert_eq!(one_line("a\nb\u{7}c\r\n"), "a b c");
        assert_eq!(one_line(&"x".repeat(10_000)).chars().count(), 161);
    }
}
