//! Importer of the native scene format: TOML for people, JSON for programs.
//!
//! Both readers turn the text into a tree of values with byte offsets ([`tree`]), serde
//! turns the tree into the types of [`schema`], and [`lower`] turns names into ids and fills
//! the builder. Errors are reported as `path:line:column`. The scene's own check refuses
//! numbers that make no shape (a radius of 0) and names the entity; [`Files`] knows its file
//! and line. docs/SCENE_FORMAT.md describes the format for users; tests/formats/native_bad
//! holds files that are refused, with their messages.

mod expression;
mod files;
mod formula;
mod include;
mod lower;
mod lower_camera;
mod lower_csg;
mod lower_deformation;
mod lower_lathe;
mod lower_light;
mod lower_looks;
mod lower_pattern;
mod lower_placement;
mod lower_polynomial;
mod lower_shape;
mod lower_shutter;
mod lower_texture;
mod lower_transform;
mod lower_views;
mod moved_views;
mod operations;
mod places;
mod polynomial;
mod read_json;
mod read_toml;
mod rotate;
mod schema;
mod schema_camera;
mod schema_light;
mod schema_pattern;
mod schema_placement;
mod schema_polynomial;
mod schema_texture;
mod source_spans;
mod toml_tables;
mod tree;
mod write;

use crate::scene::SceneBuilder;
use crate::{ImportReport, LoadError, LoadOptions};
use serde::Deserialize;
use std::path::Path;
use tree::{Kind, Source, Value};

pub(super) use files::Files;
pub use write::{NativeError, NativeScene, native_scene};

/// The version of the format that is read.
const FORMAT: i64 = 1;

/// The two syntaxes of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    Toml,
    Json,
}

/// Reads a scene into the builder, with all files that it includes and places. Fails, with line and
/// column, for malformed text, unknown keys and names, values of wrong type or out of range, and
/// files that do not load.
pub(super) fn import(
    path: &Path,
    syntax: Syntax,
    options: &LoadOptions,
    files: &mut Files,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let units = include::read(path, syntax, options, report)?;
    lower::lower(units, options, files, scene, report)
}

/// Parses one file. Returns its text, and what it says.
fn parse(path: &Path, bytes: &[u8], syntax: Syntax) -> Result<(String, schema::File), LoadError> {
    let text = decode(path, bytes)?;
    let source = Source { path, text };
    let mut root = match syntax {
        Syntax::Toml => read_toml::read(&source)?,
        Syntax::Json => read_json::read(&source)?,
    };
    check_version(&source, &root)?;
    name_single_camera(&source, &mut root)?;
    let file =
        schema::File::deserialize(root).map_err(|e| source.error(e.at.unwrap_or(0), e.message))?;
    Ok((text.to_string(), file))
}

/// Gives the single camera of a file, written as `[camera]`, an empty name, as cameras by name
/// have one each.
fn name_single_camera(source: &Source, root: &mut Value) -> Result<(), LoadError> {
    let Kind::Table(entries) = &mut root.kind else {
        return Ok(());
    };
    let Some((key, camera)) = entries.iter_mut().find(|(key, _)| key.name == "camera") else {
        return Ok(());
    };
    match &camera.kind {
        Kind::List(list) => {
            let at = list.first().map_or(camera.at, |first| first.at);
            let message = "cameras are in a list; a scene of this format has one, written as \
                           [camera], or several by name, written as [camera.NAME]";
            Err(source.error(at, message))
        }
        Kind::Table(rows) => {
            let is_table = |value: &Value| matches!(value.kind, Kind::Table(_));
            if rows.is_empty() || !rows.iter().all(|(_, value)| is_table(value)) {
                let name = tree::Key {
                    at: key.at,
                    name: "".into(),
                };
                let at = camera.at;
                let one = std::mem::replace(&mut camera.kind, Kind::Null);
                camera.kind = Kind::Table(vec![(name, Value { at, kind: one })]);
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Generates the JSON Schema of the format, which `docs/scene.schema.json` holds.
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(schema::File);
    // Serialisation cannot fail: a schema is plain JSON.
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}

/// Decodes UTF-8 and removes a byte order mark; fails at the first byte that is not UTF-8.
fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, LoadError> {
    // Some editors on Windows put a byte order mark first.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let valid = &bytes[..e.valid_up_to()];
        let text = std::str::from_utf8(valid).unwrap_or_default();
        Source { path, text }.error(text.len(), "it is not UTF-8 text; save it as UTF-8")
    })
}

/// Checks the version of the format, before anything else, because another version may have
/// other keys.
fn check_version(source: &Source, root: &Value) -> Result<(), LoadError> {
    let Kind::Table(entries) = &root.kind else {
        return Ok(());
    };
    match entries.iter().find(|(key, _)| key.name == "format") {
        Some((_, value)) => match value.kind {
            Kind::Integer(FORMAT) => Ok(()),
            Kind::Integer(other) => {
                let message =
                    format!("format {other} is unknown; this program reads format {FORMAT}");
                Err(source.error(value.at, message))
            }
            Kind::Float(_) => {
                let message = format!("expected {FORMAT}, written without a point");
                Err(source.error(value.at, message))
            }
            _ => {
                let message = format!("expected {FORMAT}, found {}", value.kind.describe());
                Err(source.error(value.at, message))
            }
        },
        None => {
            let message =
                format!("the key 'format' is missing; a scene begins with format = {FORMAT}");
            Err(source.error(root.at, message))
        }
    }
}
