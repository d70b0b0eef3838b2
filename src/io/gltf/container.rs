//! Parsing of a file into a document: GLB chunks, JSON, version, extensions.
//!
//! Every length is checked. JSON may have a byte order mark, and NUL where a chunk is padded. The document is the gltf crate's plain data without the crate's
//! validation, which refuses some valid files, and without its readers, which panic on some
//! malformed ones; so every index is checked where it is used. If even the crate's parser
//! refuses a file, the file is parsed again without the parts that are not imported.

use super::animation;
use super::texture::Sources;
use crate::LoadError;
use crate::shared::messages::{json_fault, one_line};
use crate::shared::text::decode;
use gltf::json::Root;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;
use std::borrow::Cow;
use std::path::Path;

/// Extensions that are imported, or concern only textures, which are counted where they are
/// not.
const KNOWN_EXTENSIONS: [&str; 23] = [
    "EXT_lights_image_based",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_node_visibility",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
];

/// The extension of meshes that are compressed by Draco.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// What the names of extensions begin with, after their vendor, that change no geometry:
/// they are about looks, sound, behaviour and data beside the scene.
const BESIDE_GEOMETRY: [&str; 17] = [
    "animation_",
    "audio",
    "feature_metadata",
    "instance_features",
    "interactivity",
    "lights_",
    "materials_",
    "mesh_features",
    "mesh_manifold",
    "mesh_primitive_edge_visibility",
    "node_hoverability",
    "node_selectability",
    "physics",
    "primitive_outline",
    "structural_metadata",
    "texture_",
    "xmp",
];

/// Whether this extension is imported, or counted with the textures.
pub(super) fn is_known_extension(name: &str) -> bool {
    KNOWN_EXTENSIONS.contains(&name) || cfg!(feature = "draco") && name == DRACO
}

/// Whether a file may require this extension: geometry does not depend on it, or it is
/// imported.
fn may_be_required(name: &str) -> bool {
    let bare = name.split_once('_').map_or(name, |(_, bare)| bare);
    let mut known = BESIDE_GEOMETRY.iter();
    is_known_extension(name) || known.any(|start| bare.starts_with(start))
}

/// The JSON of a file and its binary chunk, if it has one.
pub(super) struct Chunks<'a> {
    pub json: Cow<'a, str>,
    pub bin: Option<&'a [u8]>,
}

/// Splits a GLB file into its chunks; any other file is all JSON. The magic tells GLB, not
/// the file's name. Fails for malformed chunks and versions other than 2.
pub(super) fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<Chunks<'a>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Chunks {
            json: decode(path, bytes)?,
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
            // The specification says to skip chunks of other kinds, which extensions use.
            _ => {}
        }
        at = end;
        chunk += 1;
    }
    let json = json.ok_or_else(|| wrong("it has no JSON chunk".into()))?;
    let json = decode(path, json)?;
    Ok(Chunks { json, bin })
}

/// The transform of a node as the file writes it, in f64, because the gltf crate keeps f32.
#[derive(Clone, Default, Deserialize)]
pub(super) struct Placement {
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

/// A parsed file.
pub(super) struct Document {
    pub root: Root,
    /// One row per node.
    pub placements: Vec<Placement>,
    /// What textures are made of.
    pub sources: Sources,
    pub animations: Vec<animation::Source>,
    /// Kind and number of the things in the file that are not imported; `root` may lack them.
    pub unread: Vec<(&'static str, usize)>,
}

/// Parses the JSON. Fails for malformed JSON, versions other than 2 and required extensions
/// that are not supported.
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
    if let Some(name) = head.required.iter().find(|e| !may_be_required(e)) {
        let what = format!("the required extension '{}'", one_line(name));
        let remedy = match &**name {
            DRACO => "build Lanecast with --features draco, or export the file without it",
            _ => "export the file without it",
        };
        return Err(unsupported(path, &what, remedy));
    }
    check_counts(path, json)?;
    let nodes: Nodes = serde_json::from_slice(json).map_err(syntax)?;
    let (animations, malformed) = animation::sources(json);
    let (root, mut unread) = match parse_root(json) {
        Ok(root) => (root, Vec::new()),
        // The crate requires properties that the specification or an extension lets a file
        // omit. Errors are those of the first parse, which have a line.
        Err(first) => without_unread(json).ok_or_else(|| syntax(first))?,
    };
    unread.push(("malformed animation", malformed));
    Ok(Document {
        animations,
        // A list that is none is that of a file without textures.
        sources: serde_json::from_slice(json).unwrap_or_default(),
        root,
        placements: nodes.nodes,
        unread,
    })
}

/// Number of nodes, materials and the like that a file of any size may have, and the bytes
/// that justify one more. Each takes up to a kilobyte, and may be two bytes in the file.
const FREE_OBJECTS: usize = 1 << 20;
const BYTES_AN_OBJECT: usize = 32;

/// Refuses files with more objects than their size justifies, before any is kept.
fn check_counts(path: &Path, json: &[u8]) -> Result<(), LoadError> {
    /// Lists whose items are counted and not kept.
    #[derive(Default, Deserialize)]
    #[serde(default, rename_all = "camelCase")]
    struct Lists {
        accessors: Vec<IgnoredAny>,
        animations: Vec<IgnoredAny>,
        buffers: Vec<IgnoredAny>,
        buffer_views: Vec<IgnoredAny>,
        cameras: Vec<IgnoredAny>,
        images: Vec<IgnoredAny>,
        materials: Vec<IgnoredAny>,
        meshes: Vec<IgnoredAny>,
        nodes: Vec<IgnoredAny>,
        samplers: Vec<IgnoredAny>,
        scenes: Vec<IgnoredAny>,
        skins: Vec<IgnoredAny>,
        textures: Vec<IgnoredAny>,
    }
    // What is malformed here has its message from the full parse.
    let lists: Lists = serde_json::from_slice(json).unwrap_or_default();
    let counts = [
        ("accessors", lists.accessors.len()),
        ("animations", lists.animations.len()),
        ("buffers", lists.buffers.len()),
        ("bufferViews", lists.buffer_views.len()),
        ("cameras", lists.cameras.len()),
        ("images", lists.images.len()),
        ("materials", lists.materials.len()),
        ("meshes", lists.meshes.len()),
        ("nodes", lists.nodes.len()),
        ("samplers", lists.samplers.len()),
        ("scenes", lists.scenes.len()),
        ("skins", lists.skins.len()),
        ("textures", lists.textures.len()),
    ];
    let most = FREE_OBJECTS + json.len() / BYTES_AN_OBJECT;
    let all: usize = counts.iter().map(|(_, count)| count).sum();
    let largest = counts.iter().max_by_key(|(_, count)| *count);
    match largest {
        Some((place, count)) if all > most => Err(LoadError::Invalid {
            path: path.into(),
            place: (*place).into(),
            message: format!(
                "{count} are more than the size of the file justifies; a file of {} bytes may have \
                 {most} objects in all",
                json.len()
            ),
        }),
        _ => Ok(()),
    }
}

/// Parses the document without the parts that are not imported, and with an empty list of
/// nodes for scenes that omit it. `None` if the crate's parser refuses this, too.
fn without_unread(json: &[u8]) -> Option<(Root, Vec<(&'static str, usize)>)> {
    let mut all: Value = serde_json::from_slice(json).ok()?;
    let mut unread = Vec::new();
    for (key, what) in [
        ("textures", ""),
        ("animations", ""),
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
    let rest = serde_json::to_vec(&all).ok()?;
    Some((parse_root(&rest).ok()?, unread))
}

/// Parses a document. The one place that does: the parsers of all its types are a third of what
/// this crate takes to build.
fn parse_root(json: &[u8]) -> Result<Root, serde_json::Error> {
    serde_json::from_slice(json)
}

/// The remedy for other versions.
const TO_TWO: &str = "convert the file to glTF 2.0";

/// Makes an error about a feature that is not supported.
fn unsupported(path: &Path, what: &str, remedy: &str) -> LoadError {
    LoadError::Unsupported {
        path: path.into(),
        what: what.into(),
        remedy: Some(remedy.into()),
    }
}
