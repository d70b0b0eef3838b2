//! Text files as people have them: byte order marks, UTF-16, Latin-1, and any line ends.

use crate::LoadError;
use std::borrow::Cow;
use std::path::Path;

/// The byte order mark of UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Removes the byte order mark of UTF-8.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(MARK).unwrap_or(bytes)
}

/// Tells whether bytes are UTF-16, with a mark or without, that begins with two letters in
/// any case.
pub fn is_wide(bytes: &[u8], letters: [u8; 2]) -> bool {
    let (bytes, low) = match bytes {
        [0xff, 0xfe, text @ ..] => (text, 0),
        [0xfe, 0xff, text @ ..] => (text, 1),
        [0, _, ..] => (bytes, 1),
        _ => (bytes, 0),
    };
    bytes.get(..4).is_some_and(|start| {
        let [a, b] = [start[low], start[2 + low]];
        [start[1 - low], start[3 - low]] == [0, 0] && [a, b].eq_ignore_ascii_case(&letters)
    })
}

/// Decodes a text file. A byte order mark, and NUL and Ctrl-Z at the end, are removed.
/// UTF-16 is known by its mark, or by the zero byte of its first character; a line that is
/// not UTF-8 is Latin-1, of which every byte is a character. Refuses UTF-32.
pub fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, str>, LoadError> {
    let units = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes
            .chunks_exact(2)
            .map(|pair| unit([pair[0], pair[1]]))
            .collect();
        Cow::Owned(trimmed(&String::from_utf16_lossy(&units)).to_string())
    };
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Err(LoadError::Unsupported {
            path: path.into(),
            what: "text in UTF-32".into(),
            remedy: Some("save it as UTF-8".into()),
        }),
        [0xff, 0xfe, text @ ..] => Ok(units(text, u16::from_le_bytes)),
        [0xfe, 0xff, text @ ..] => Ok(units(text, u16::from_be_bytes)),
        [a, 0, b, 0, ..] if *a > 0 && *b > 0 => Ok(units(bytes, u16::from_le_bytes)),
        [0, a, 0, b, ..] if *a > 0 && *b > 0 => Ok(units(bytes, u16::from_be_bytes)),
        _ => Ok(narrow(without_mark(bytes))),
    }
}

/// Decodes UTF-8, and as Latin-1 those lines that are none.
fn narrow(bytes: &[u8]) -> Cow<'_, str> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Cow::Borrowed(trimmed(text));
    }
    let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
    for line in bytes.split_inclusive(|b| matches!(b, b'\n' | b'\r')) {
        match std::str::from_utf8(line) {
            Ok(line) => text.push_str(line),
            Err(_) => text.extend(line.iter().map(|b| char::from(*b))),
        }
    }
    let length = trimmed(&text).len();
    text.truncate(length);
    Cow::Owned(text)
}

/// Removes what ended a file in old systems.
fn trimmed(text: &str) -> &str {
    text.trim_end_matches(['\0', '\x1a'])
}

/// Splits a text into lines, numbered from 1, without their ends: a line feed, with any
/// carriage returns before it, or a carriage return alone.
pub fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = Some(text);
    let mut number = 0;
    std::iter::from_fn(move || {
        let text = rest?;
        number += 1;
        let Some(end) = text.find(['\n', '\r']) else {
            rest = None;
            return Some((number, text));
        };
        let after = text[end..].trim_start_matches('\r');
        rest = Some(after.strip_prefix('\n').unwrap_or(&text[end + 1..]));
        Some((number, &text[..end]))
    })
}

/// Parses a number, also as C libraries print what is none: `-nan(ind)`, `1.#QNAN`.
pub fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| {
        let bare = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
        let starts = |with: &[&str]| with.iter().any(|w| bare.starts_with(w));
        if starts(&["nan(", "1.#qnan", "1.#snan", "1.#ind", "1.#nan"]) {
            Some(f64::NAN)
        } else if starts(&["1.#inf"]) {
            Some(f64::INFINITY)
        } else {
            None
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> String {
        decode(Path::new("a"), bytes).unwrap().into()
    }

    #[test]
    fn every_encoding_gives_the_same_text() {
        let text = "v 1 é\nf";
        let wide =
            |unit: fn(u16) -> [u8; 2]| -> Vec<u8> { text.encode_utf16().flat_map(unit).collect() };
        assert_eq!(decoded(text.as_bytes()), text);
        assert_eq!(decoded(&[MARK, text.as_bytes()].concat()), text);
        assert_eq!(decoded(b"v 1 \xe9\nf\x1a"), text);
        for (mark, unit) in [
            ([0xff, 0xfe], u16::to_le_bytes as fn(u16) -> [u8; 2]),
            ([0xfe, 0xff], u16::to_be_bytes),
        ] {
            assert_eq!(decoded(&[&mark[..], &wide(unit)].concat()), text);
            assert_eq!(decoded(&wide(unit)), text);
        }
        // One Latin-1 line makes no other line Latin-1.
        assert_eq!(decoded("\u{e9}\n\u{e9}".as_bytes()), "é\né");
        assert_eq!(decoded(b"\xc3\xa9\r\xe9"), "é\ré");
        let wrong = decode(Path::new("a"), b"\xff\xfe\0\0").unwrap_err();
        assert!(wrong.to_string().contains("UTF-32"), "{wrong}");
    }

    #[test]
    fn lines_end_as_in_any_system() {
        let all = |text| lines(text).collect::<Vec<_>>();
        let expected = [(1, "a"), (2, ""), (3, "b")];
        for text in ["a\n\nb", "a\r\rb", "a\r\n\r\nb", "a\r\r\n\nb"] {
            assert_eq!(all(text), expected, "{text:?}");
        }
        assert_eq!(all("a\r"), [(1, "a"), (2, "")]);
        assert_eq!(all(""), [(1, "")]);
    }

    #[test]
    fn numbers_that_c_prints() {
        for word in ["nan", "-nan(ind)", "-NaN", "1.#QNAN", "-1.#IND00"] {
            assert!(number(word).unwrap().is_nan(), "{word}");
        }
        for (word, value) in [
            (".5", 0.5),
            ("-.1", -0.1),
            ("1.", 1.0),
            ("1.#INF", f64::INFINITY),
        ] {
            assert_eq!(number(word), Some(value));
        }
        assert_eq!(number("nano"), None);
    }
}
