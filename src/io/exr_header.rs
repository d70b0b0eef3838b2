//! Attributes of OpenEXR headers.

use exr::meta::attribute::Chromaticities;
use exr::prelude::{AttributeValue, LayerAttributes, Text, Vec2};

/// A fact about a picture, which a file's header may hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    Text(String),
    Int(i32),
    Float(f32),
    Double(f64),
    /// Of row vectors: a point goes before the matrix, and the last row is the translation.
    Matrix([f32; 16]),
}

/// Facts about a picture, by name. The names are those of the format's standard attributes where
/// there is one, else those of the renderer pbrt.
pub type Metadata = Vec<(String, Attribute)>;

/// Rec. 709 with the white D65: what the numbers of a picture mean.
pub(super) fn chromaticities() -> Chromaticities {
    Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.3, 0.6),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.329),
    }
}

/// Sets attributes of a header.
pub(super) fn set(metadata: &Metadata, layer: &mut LayerAttributes) {
    for (name, value) in metadata {
        match (name.as_str(), value) {
            ("worldToCamera", Attribute::Matrix(m)) => layer.world_to_camera = Some(*m),
            ("worldToNDC", Attribute::Matrix(m)) => layer.world_to_normalized_device = Some(*m),
            ("software", Attribute::Text(text)) => layer.software_name = Some(text_of(text)),
            ("capDate", Attribute::Text(text)) => layer.capture_date = Some(text_of(text)),
            _ => add(layer, name, value),
        }
    }
}

/// Adds an attribute that the format does not know by itself.
fn add(layer: &mut LayerAttributes, name: &str, value: &Attribute) {
    let value = match value {
        Attribute::Text(text) => AttributeValue::Text(text_of(text)),
        Attribute::Int(number) => AttributeValue::I32(*number),
        Attribute::Float(number) => AttributeValue::F32(*number),
        Attribute::Double(number) => AttributeValue::F64(*number),
        Attribute::Matrix(m) => AttributeValue::Matrix4x4(*m),
    };
    layer.other.insert(text_of(name), value);
}

/// Writes a text as UTF-8, which strict readers demand. The crate `exr` by itself writes Latin-1, and
/// panics where that has no letter.
pub(super) fn text_of(text: &str) -> Text {
    Text::from_bytes_unchecked(text.bytes().collect())
}

/// Reads a text of UTF-8, or else of Latin-1.
pub(super) fn text_from(text: &Text) -> String {
    let utf8 = std::str::from_utf8(text.bytes());
    utf8.map_or_else(|_| text.to_string(), str::to_owned)
}

/// Where the attributes begin: behind the magic number and the version.
const FIRST: usize = 8;

/// Returns where the header of a file of one part ends, and the offsets of its chunks begin; `None` if
/// the file is not as expected.
pub(super) fn end(bytes: &[u8]) -> Option<usize> {
    let mut at = FIRST;
    loop {
        match attribute(bytes, at)? {
            (_, next) if next == at + 1 => return Some(next),
            (_, next) => at = next,
        }
    }
}

/// Lets a header tell that the picture has a size, begins at (0, 0) and has so many chunks. Returns false
/// if it has no room for that.
pub(super) fn set_size(header: &mut [u8], (width, height): (u32, u32), chunks: u32) -> bool {
    let corners = [0, 0, width - 1, height - 1];
    let window = corners.map(u32::to_le_bytes).concat();
    let mut found = 0;
    let mut at = FIRST;
    while let Some((name, next)) = attribute(header, at) {
        let value = match name {
            b"dataWindow" | b"displayWindow" => &window[..],
            b"chunkCount" => &chunks.to_le_bytes(),
            b"" => break,
            _ => &[],
        };
        header[next - value.len()..next].copy_from_slice(value);
        found += usize::from(!value.is_empty());
        at = next;
    }
    found == 3
}

/// Sorts the attributes of a file of one part by name, so that equal pictures have equal files: the
/// crate `exr` writes them in the order of a hash map. Files that are not as expected stay as they
/// are.
pub(super) fn sort(bytes: &mut [u8]) {
    let mut attributes = Vec::new();
    let mut at = FIRST;
    let end = loop {
        match attribute(bytes, at) {
            Some((_, next)) if next == at + 1 => break at,
            Some((name, next)) => {
                attributes.push((name.to_vec(), bytes[at..next].to_vec()));
                at = next;
            }
            None => return,
        }
    };
    attributes.sort();
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, all)| all).collect();
    bytes[FIRST..end].copy_from_slice(&sorted);
}

/// Returns the name of the attribute that begins at a byte, and where the next begins: the byte
/// behind if the header ends here.
fn attribute(bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
    let text = |at: usize| {
        let rest = bytes.get(at..)?;
        let len = rest.iter().position(|byte| *byte == 0)?;
        Some((&rest[..len], at + len + 1))
    };
    let (name, kind) = text(at)?;
    if name.is_empty() {
        return Some((name, kind));
    }
    let (_, size) = text(kind)?;
    let data = size + 4;
    let length = bytes.get(size..data)?.try_into().ok()?;
    let end = data.checked_add(u32::from_le_bytes(length) as usize)?;
    (end <= bytes.len()).then_some((name, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_utf_8_and_latin_1_is_read() {
        for text in ["plain", "Würfel é", "立方体"] {
            let written = text_of(text);
            assert_eq!(written.bytes(), text.as_bytes());
            assert_eq!(text_from(&written), text);
        }
        let latin = Text::from_slice_unchecked(b"W\xfcrfel");
        assert_eq!(text_from(&latin), "Würfel");
        let mut layer = LayerAttributes::default();
        let metadata = [("über".to_owned(), Attribute::Text("ü".into()))];
        set(&metadata.into(), &mut layer);
        let (name, value) = layer.other.iter().next().unwrap();
        assert_eq!(name.bytes(), "über".as_bytes());
        assert_eq!(*value, AttributeValue::Text(text_of("ü")));
    }

    #[test]
    fn attributes_are_sorted_and_nothing_else_moves() {
        let one = |name: &str, data: &[u8]| {
            let mut all = name.as_bytes().to_vec();
            all.extend(b"\0string\0");
            all.extend((data.len() as u32).to_le_bytes());
            all.extend(data);
            all
        };
        let file = |parts: &[Vec<u8>]| {
            let mut all = b"magicver".to_vec();
            all.extend(parts.concat());
            all.extend(b"\0pixels");
            all
        };
        let (a, b, c) = (one("a", b"xyz"), one("bb", b""), one("c", b"\0\0"));
        let mut mixed = file(&[c.clone(), a.clone(), b.clone()]);
        sort(&mut mixed);
        assert_eq!(mixed, file(&[a, b, c]));
        for len in 0..mixed.len() {
            let mut cut = mixed[..len].to_vec();
            sort(&mut cut);
            assert_eq!(cut, mixed[..len]);
        }
    }
}
