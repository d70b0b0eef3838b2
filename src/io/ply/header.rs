//! The header of a PLY file: its encoding, and the elements with their properties.

use super::Wrong;
use crate::shared::messages::one_line;
use std::collections::{HashMap, HashSet};

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Binary { big_endian: bool },
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Char,
    UChar,
    Short,
    UShort,
    Int,
    UInt,
    Float,
    Double,
}

impl Kind {
    fn of(name: &str) -> Option<Kind> {
        Some(match name {
            "char" | "int8" => Kind::Char,
            "uchar" | "uint8" => Kind::UChar,
            "short" | "int16" => Kind::Short,
            "ushort" | "uint16" => Kind::UShort,
            "int" | "int32" => Kind::Int,
            "uint" | "uint32" => Kind::UInt,
            "float" | "float32" => Kind::Float,
            "double" | "float64" => Kind::Double,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Kind::Char | Kind::UChar => 1,
            Kind::Short | Kind::UShort => 2,
            Kind::Int | Kind::UInt | Kind::Float => 4,
            Kind::Double => 8,
        }
    }

    /// The least and the largest whole number; `None` for floating-point types.
    pub fn range(self) -> Option<(f64, f64)> {
        let range = match self {
            Kind::Char => (f64::from(i8::MIN), f64::from(i8::MAX)),
            Kind::UChar => (0.0, f64::from(u8::MAX)),
            Kind::Short => (f64::from(i16::MIN), f64::from(i16::MAX)),
            Kind::UShort => (0.0, f64::from(u16::MAX)),
            Kind::Int => (f64::from(i32::MIN), f64::from(i32::MAX)),
            Kind::UInt => (0.0, f64::from(u32::MAX)),
            Kind::Float | Kind::Double => return None,
        };
        Some(range)
    }

    /// A channel of a colour as a fraction, 0 to 1.
    pub fn fraction(self, x: f64) -> f64 {
        let most = self.range().map_or(1.0, |(_, most)| most);
        if x.is_nan() {
            0.0
        } else {
            (x / most).clamp(0.0, 1.0)
        }
    }
}

pub(super) struct Property {
    pub name: String,
    /// Of a list: the type of its count.
    pub count: Option<Kind>,
    /// The type of the value, or of a list's items.
    pub kind: Kind,
}

pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    row_of: HashMap<String, usize>,
}

impl Element {
    /// The index of a property.
    pub fn property(&self, name: &str) -> Option<usize> {
        self.row_of.get(name).copied()
    }
}

pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// The number of its lines.
    pub lines: usize,
}

/// Splits off a line. A line ends with a line feed, or with a carriage return and one; with a
/// carriage return alone only if the first line does (`old`), since in a binary file what
/// follows the header may begin like a line feed.
fn split_line(bytes: &[u8], old: bool) -> Option<(&[u8], &[u8])> {
    let end = bytes
        .iter()
        .position(|b| *b == b'\n' || old && *b == b'\r')?;
    let line = bytes[..end].strip_suffix(b"\r").unwrap_or(&bytes[..end]);
    Some((line, &bytes[end + 1..]))
}

/// Parses the header, and returns it with what follows it.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, &[u8]), Wrong> {
    let quoted = |line: &[u8]| format!("'{}'", one_line(&String::from_utf8_lossy(line)));
    let end = bytes.iter().position(|b| matches!(b, b'\n' | b'\r'));
    let old = end.is_some_and(|end| bytes[end] == b'\r' && bytes.get(end + 1) != Some(&b'\n'));
    let first = &bytes[..end.unwrap_or(bytes.len())];
    if first.trim_ascii_end() != b"ply" {
        let with = &first[..first.len().min(40)];
        let message = format!(
            "a PLY file begins with the line 'ply', and this with {}",
            quoted(with)
        );
        return Err((Some(1), message));
    }
    let (_, mut rest) = split_line(bytes, old).unwrap_or((bytes, b""));
    let (mut encoding, mut elements): (Option<Encoding>, Vec<Element>) = (None, Vec::new());
    let mut names = HashSet::new();
    let mut number = 1;
    while let Some((line, after)) = split_line(rest, old) {
        rest = after;
        number += 1;
        let wrong = |message: String| Err((Some(number), message));
        let text = String::from_utf8_lossy(line);
        let words: Vec<&str> = text.split_whitespace().collect();
        let no_line = || wrong(format!("{} is no line of a PLY header", quoted(line)));
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["end_header"] => {
                let Some(encoding) = encoding else {
                    return Err((None, "its header has no line 'format'".into()));
                };
                let header = Header {
                    encoding,
                    elements,
                    lines: number,
                };
                return Ok((header, rest));
            }
            ["format", name, _] => {
                let new = match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Binary { big_endian: false },
                    "binary_big_endian" => Encoding::Binary { big_endian: true },
                    _ => return no_line(),
                };
                if encoding.replace(new).is_some_and(|known| known != new) {
                    let line = quoted(line);
                    return wrong(format!("{line} is another format than the one before"));
                }
            }
            ["element", name, count] => {
                let Ok(count) = count.parse() else {
                    return no_line();
                };
                if !names.insert(name.to_string()) {
                    return wrong(format!(
                        "its header names the element {} twice",
                        quoted(name.as_bytes())
                    ));
                }
                elements.push(Element {
                    name: name.into(),
                    count,
                    properties: Vec::new(),
                    row_of: HashMap::new(),
                });
            }
            ["property", ref kind @ .., name] => {
                let (count, kind) = match kind {
                    [kind] => (None, Kind::of(kind)),
                    ["list", count, kind] => match Kind::of(count) {
                        Some(count) if count.range().is_some() => (Some(count), Kind::of(kind)),
                        _ => return no_line(),
                    },
                    _ => return no_line(),
                };
                let Some(kind) = kind else {
                    return no_line();
                };
                let Some(element) = elements.last_mut() else {
                    return wrong(format!("{} comes before any element", quoted(line)));
                };
                let row = element.properties.len();
                if element.row_of.insert(name.into(), row).is_some() {
                    return wrong(format!(
                        "its header names the property {} twice",
                        quoted(name.as_bytes())
                    ));
                }
                element.properties.push(Property {
                    name: name.into(),
                    count,
                    kind,
                });
            }
            _ => return no_line(),
        }
    }
    Err((Some(number), "its header has no line 'end_header'".into()))
}
