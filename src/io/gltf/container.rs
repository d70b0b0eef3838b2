//! From bytes to a parsed document: GLB chunks, JSON, version, extensions.
//!
//! Nothing here trusts a length. The document is the gltf crate's plain data,
//! not validated by it: the crate refuses some valid files and its readers
//! panic on some wrong ones, so every index is checked where it is used. Where
//! even its parser is too strict, the parts that are not imported are left out.

use crate::LoadError;
use crate::shared::messages::{json_fault, one_line};
use gltf::json::Root;
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

/// Extensions that may be required: they are imported, or they only concern
/// textures, which are left out with a count.
const KNOWN_EXTENSIONS: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
];

pub(super) fn is_known_extension(name: &str) -> bool {
    KNOWN_EXTENSIONS.contains(&name)
}

/// A file split into its JSON and its binary chunk.
pub(super) struct Chunks<'a> {
    pub json: &'a [u8],
    pub bin: Option<&'a [u8]>,
}

/// GLB is told by its magic, not by the file's name.
pub(super) fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<Chunks<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Chunks {
            json: bytes,
            bin: None,
        });
    }
    let wrong = |message: String| LoadError::Invalid {
        path: path.into(),
        place: "GLB container".into(),
        message,
    };
    let word = |at: usize| {
        let word = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(wrong("it ends within its header of 12 bytes".into()));
    };
    if version != 2 {
        return Err(unsupported(path, &format!("GLB version {version}"), TO_TWO));
    }
    let length = length as usize;
    if length < 12 || length > bytes.len() {
        return Err(wrong(format!(
            "its header says {length} bytes, but the file has {}",
            bytes.len()
        )));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    let mut chunk = 0;
    while at < length {
        let (Some(size), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) else {
            return Err(wrong(format!("it ends within the header of chunk {chunk}")));
        };
        let end = (at + 8).checked_add(size as usize).filter(|e| *e <= length);
        let Some(end) = end else {
            return Err(wrong(format!(
                "chunk {chunk} says {size} bytes, but only {} follow",
                length.saturating_sub(at + 8)
            )));
        };
        match (kind, chunk) {
            (b"JSON", 0) => json = Some(&bytes[at + 8..end]),
            (b"BIN\0", 1) => bin = Some(&bytes[at + 8..end]),
            (b"JSON" | b"BIN\0", _) => {
                return Err(wrong(format!(
                    "chunk {chunk} is out of place: first comes one JSON chunk, then at most one BIN chunk"
                )));
            }
            (_, 0) => return Err(wrong("its first chunk is not JSON".into())),
            // Other kinds are for extensions and may be skipped.
            _ => {}
        }
        at = end;
        chunk += 1;
    }
    let json = json.ok_or_else(|| wrong("it has no JSON chunk".into()))?;
    Ok(Chunks { json, bin })
}

/// The placement of a node, in the numbers of the file: the gltf crate keeps
/// only f32.
#[derive(Default, Deserialize)]
pub(super) struct Placement {
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

pub(super) struct Document {
    pub root: Root,
    /// One per node.
    pub placements: Vec<Placement>,
    /// What is in the file, maybe no longer in `root`: its kind and number.
    pub unread: Vec<(&'static str, usize)>,
}

/// Parses the JSON, after the version and the required extensions.
pub(super) fn parse(path: &Path, json: &[u8]) -> Result<Document, LoadError> {
    #[derive(Deserialize)]
    struct Head {
        asset: Asset,
        #[serde(default, rename = "extensionsRequired")]
        required: Vec<String>,
    }
    #[derive(Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Asset {
        version: String,
        min_version: Option<String>,
    }
    #[derive(Deserialize)]
    struct Nodes {
        #[serde(default)]
        nodes: Vec<Placement>,
    }
    let syntax = |e: serde_json::Error| LoadError::Syntax {
        path: path.into(),
        line: e.line().max(1),
        column: e.column().max(1),
        message: format!("not glTF: {}", json_fault(&e)),
    };
    let head: Head = serde_json::from_slice(json).map_err(syntax)?;
    let version = &head.asset.version;
    if version.split('.').next() != Some("2") {
        let what = format!("glTF version '{}'", one_line(version));
        return Err(unsupported(path, &what, TO_TWO));
    }
    if let Some(least) = head.asset.min_version.filter(|v| v != "2.0") {
        let what = format!("glTF minVersion '{}'", one_line(&least));
        return Err(unsupported(path, &what, TO_TWO));
    }
    if let Some(name) = head.required.iter().find(|e| !is_known_extension(e)) {
        let what = format!("the required extension '{}'", one_line(name));
        return Err(unsupported(path, &what, "export the file without it"));
    }
    let nodes: Nodes = serde_json::from_slice(json).map_err(syntax)?;
    let (root, unread) = match serde_json::from_slice::<Root>(json) {
        Ok(root) => {
            let unread = vec![
                ("texture", root.textures.len()),
                ("animation", root.animations.len()),
                ("skin", root.skins.len()),
            ];
            (root, unread)
        }
        // The crate wants properties that the specification or an extension
        // leaves out. The first error is the one with a line.
        Err(first) => without_unread(json).ok_or_else(|| syntax(first))?,
    };
    Ok(Document {
        root,
        placements: nodes.nodes,
        unread,
    })
}

/// The document without the parts that are not imported anyhow, and with the
/// empty list of nodes that a scene may leave out.
fn without_unread(json: &[u8]) -> Option<(Root, Vec<(&'static str, usize)>)> {
    let mut all: Value = serde_json::from_slice(json).ok()?;
    let mut unread = Vec::new();
    for (key, what) in [
        ("textures", "texture"),
        ("animations", "animation"),
        ("skins", "skin"),
        ("images", ""),
        ("samplers", ""),
    ] {
        let Some(part) = all.as_object_mut()?.remove(key) else {
            continue;
        };
        let list = part.as_array().filter(|l| l.iter().all(Value::is_object))?;
        if !what.is_empty() {
            unread.push((what, list.len()));
        }
    }
    if let Some(scenes) = all.get_mut("scenes").and_then(Value::as_array_mut) {
        for scene in scenes.iter_mut().filter_map(Value::as_object_mut) {
            scene
                .entry("nodes")
                .or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    Some((serde_json::from_value(all).ok()?, unread))
}

const TO_TWO: &str = "convert the file to glTF 2.0";

fn unsupported(path: &Path, what: &str, remedy: &str) -> LoadError {
    LoadError::Unsupported {
        path: path.into(),
        what: what.into(),
        remedy: Some(remedy.into()),
    }
}
