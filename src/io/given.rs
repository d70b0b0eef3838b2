//! A scene whose format or bytes are known beside its file's name: one on standard input, say.

use crate::{LoadError, LoadOptions, extension};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions of the scene files that are read.
pub const FORMATS: [&str; 11] = [
    "toml", "json", "gltf", "glb", "nff", "csg", "scad", "obj", "ply", "stl", "3mf",
];

/// What is known of the file that [`crate::load`] is called with; files that it names are found and
/// read as always.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// The file; `load` sets it.
    pub path: PathBuf,
    /// One of [`FORMATS`], in place of the extension of the name. Without it that of bytes is told by
    /// [`format_of`].
    pub format: Option<&'static str>,
    /// The file's bytes. The path is then only what messages call them, and names that the scene has
    /// are relative to its folder.
    pub bytes: Option<Arc<[u8]>>,
}

impl LoadOptions {
    /// Returns the options for loading `path`, of whose format is known what can be. Fails where bytes
    /// tell none.
    pub(crate) fn of_file(&self, path: &Path) -> Result<LoadOptions, LoadError> {
        let mut options = self.clone();
        let Some(given) = &mut options.given else {
            return Ok(options);
        };
        given.path = path.into();
        if let (None, Some(bytes)) = (given.format, &given.bytes) {
            given.format = format_of(bytes);
            if given.format.is_none() {
                return Err(LoadError::Invalid {
                    path: path.into(),
                    place: "its content".into(),
                    message: "tells no format; name it with --format, such as --format scad".into(),
                });
            }
        }
        Ok(options)
    }

    fn given(&self, path: &Path) -> Option<&Given> {
        self.given.as_ref().filter(|given| given.path == path)
    }

    /// Returns the format of a file: an extension in lower case, without the dot.
    pub(crate) fn format(&self, path: &Path) -> Cow<'static, str> {
        match self.given(path).and_then(|given| given.format) {
            Some(format) => Cow::Borrowed(format),
            None => Cow::Owned(extension(path)),
        }
    }

    /// Returns the bytes of a file that were read elsewhere.
    pub(crate) fn bytes(&self, path: &Path) -> Option<Arc<[u8]>> {
        self.given(path).and_then(|given| given.bytes.clone())
    }

    /// Returns all bytes of a scene file.
    pub(crate) fn read(&self, path: &Path) -> Result<Vec<u8>, LoadError> {
        match self.bytes(path) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => crate::shared::folder::read_file(path),
        }
    }
}

/// Tells the format of a scene by its first bytes, one of [`FORMATS`]; `None` if none of them
/// begins so. A program for OpenSCAD is never told: it may begin as its `.csg` does.
pub fn format_of(bytes: &[u8]) -> Option<&'static str> {
    /// The length of a binary STL's header with the number of its triangles, and of each of these.
    const STL: (usize, usize) = (84, 50);
    for (magic, format) in [
        (&b"glTF"[..], "glb"),
        (b"PK\x03\x04", "3mf"),
        (b"ply", "ply"),
    ] {
        if bytes.starts_with(magic) {
            return Some(format);
        }
    }
    if let Some(count) = bytes.get(80..84) {
        let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize;
        if count.checked_mul(STL.1).and_then(|n| n.checked_add(STL.0)) == Some(bytes.len()) {
            return Some("stl");
        }
    }
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with('{') {
        // The native format has no such table.
        let of_gltf = text.contains("\"asset\"") && !text.contains("\"format\"");
        return Some(if of_gltf { "gltf" } else { "json" });
    }
    let lines = text.lines().map(str::trim);
    let mut lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    let line = lines.next()?;
    let word = line.split([' ', '\t']).next().unwrap_or_default();
    match word {
        "solid" | "facet" => return Some("stl"),
        // NFF's view, whose numbers follow on lines of their own; OBJ's vertex has them beside it.
        "v" if word == line => return Some("nff"),
        "v" | "vn" | "vt" | "o" | "g" | "mtllib" | "usemtl" | "s" => return Some("obj"),
        _ => {}
    }
    let key = line.split_once('=').map(|(key, _)| key.trim());
    let is_key = |key: &str| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "_-.\"'".contains(c);
        !key.is_empty() && key.chars().all(plain)
    };
    // OpenSCAD's assignments end in a semicolon.
    if line.starts_with('[') || key.is_some_and(is_key) && !line.ends_with(';') {
        return Some("toml");
    }
    let csg = [
        "group(",
        "multmatrix(",
        "union(",
        "difference(",
        "intersection(",
        "color(",
    ];
    csg.iter()
        .any(|start| line.starts_with(start))
        .then_some("csg")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_content() {
        let mut binary = vec![b'x'; 80];
        binary.extend(1_u32.to_le_bytes());
        binary.extend([0; 50]);
        assert_eq!(format_of(&binary), Some("stl"));
        binary.pop();
        assert_eq!(format_of(&binary), None);
        for (text, format) in [
            ("glTF\u{2}", Some("glb")),
            ("PK\u{3}\u{4}", Some("3mf")),
            ("ply\nformat ascii 1.0\n", Some("ply")),
            ("solid part\n", Some("stl")),
            ("{\"asset\": {\"version\": \"2.0\"}}", Some("gltf")),
            (" { \"format\": 1 }", Some("json")),
            ("\u{feff}# a scene\n\nformat = 1\n", Some("toml")),
            ("[camera]\neye = [0, 0, 1]", Some("toml")),
            ("# a view\nv\nfrom 0 0 1\n", Some("nff")),
            ("# a mesh\nv 0 0 1\n", Some("obj")),
            ("mtllib a.mtl\no part\n", Some("obj")),
            ("group() {\n\tsphere(r = 1);\n}\n", Some("csg")),
            ("multmatrix([[1, 0, 0, 0]]) {", Some("csg")),
            ("r = 3;\nsphere(r);\n", None),
            ("hello", None),
            ("", None),
        ] {
            assert_eq!(format_of(text.as_bytes()), format, "{text:?}");
        }
    }
}
