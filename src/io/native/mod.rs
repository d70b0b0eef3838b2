//! The native scene format, TOML for hands and JSON for programs.
//!
//! Text becomes a tree with places ([`tree`]), the tree becomes the types of
//! [`schema`] by serde, and [`lower`] turns names into ids and fills the
//! builder. Everything that can be wrong is reported as `path:line:column`.
//! Numbers that are no shape (a radius of 0) are left to the scene's check,
//! which names the entity; [`SourceSpans`] tells where it stands. docs/SCENE_FORMAT.md is the format for users;
//! tests/native_bad.rs holds what is refused.

mod expression;
mod formula;
mod lower;
mod lower_combination;
mod lower_polynomial;
mod lower_shape;
mod make;
mod polynomial;
mod read_json;
mod read_toml;
mod rotate;
mod schema;
mod schema_polynomial;
mod source_spans;
mod tree;

use crate::scene::{Entity, SceneBuilder};
use crate::shared::{folder, line_column::line_column};
use crate::{ImportReport, LoadError, LoadOptions};
use serde::Deserialize;
use std::path::Path;
use tree::{Kind, Source, Value};

// The name by which lower*.rs and schema*.rs call this module.
use source_spans as places;

/// The version of the format that is read.
const FORMAT: i64 = 1;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    Toml,
    Json,
}

pub(super) fn import(
    path: &Path,
    syntax: Syntax,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<SourceSpans, LoadError> {
    let bytes = folder::read_file(path)?;
    let text = decode(path, &bytes)?;
    let source = Source { path, text };
    let root = match syntax {
        Syntax::Toml => read_toml::read(&source)?,
        Syntax::Json => read_json::read(&source)?,
    };
    version(&source, &root)?;
    let file =
        schema::File::deserialize(root).map_err(|e| source.error(e.at.unwrap_or(0), e.message))?;
    let at = lower::lower(&source, file, options, scene, report)?;
    Ok(SourceSpans {
        text: text.to_string(),
        at,
    })
}

/// Where the entities of a scene stand in its file, for the scene's own check.
pub(super) struct SourceSpans {
    text: String,
    at: lower::Offsets,
}

impl SourceSpans {
    /// Line and column, both from 1.
    pub(super) fn line_column(&self, what: &Entity) -> Option<(u32, u32)> {
        let at = self.at.of(what)?;
        let (line, column) = line_column(self.text.as_bytes(), at);
        Some((line.try_into().ok()?, column.try_into().ok()?))
    }
}

/// The JSON Schema of the format, as `docs/scene.schema.json` holds it.
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(schema::File);
    // A schema is plain JSON; it always prints.
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}

fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, LoadError> {
    // Editors on Windows like to put a byte order mark first.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let valid = &bytes[..e.valid_up_to()];
        let text = std::str::from_utf8(valid).unwrap_or_default();
        Source { path, text }.error(text.len(), "it is not UTF-8 text; save it as UTF-8")
    })
}

/// Looked at first: another version may have other keys.
fn version(source: &Source, root: &Value) -> Result<(), LoadError> {
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
