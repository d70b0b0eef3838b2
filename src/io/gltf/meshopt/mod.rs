//! Compressed views: EXT_meshopt_compression and KHR_meshopt_compression.
//!
//! Written from the bitstream that the extensions specify (appendix A of each; `vertices`,
//! `indices`) and their filters (appendix B; `filters`). KHR's has a second version of vertices and
//! a filter for colours beside what EXT's has. Every view is decoded when the file is opened, in
//! bounded memory; it is then read as any other.

mod filters;
mod indices;
mod vertices;

use super::buffers::Buffers;
use crate::LoadError;
use crate::shared::messages::one_line;
use gltf::json::Root;
use gltf::json::buffer::{Buffer, View};
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

/// The names of the extension.
const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Bytes that the views of a file of any size may decode to, and how many more each of its bytes
/// adds. Triangles are at best a byte each, of 12.
const FREE_BYTES: u64 = 1 << 27;
const BYTES_A_BYTE: u64 = 16;

/// The extension of a view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Source {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// Finds the extension in a list of extensions.
fn extension(all: Option<&serde_json::Map<String, Value>>) -> Option<&Value> {
    NAMES.iter().find_map(|name| all?.get(*name))
}

/// Whether a buffer is only for readers that do not know the extension.
pub(super) fn is_fallback(buffer: &Buffer) -> bool {
    let all = buffer.extensions.as_ref().map(|all| &all.others);
    let fallback = extension(all).and_then(|own| own.get("fallback"));
    fallback.and_then(Value::as_bool).unwrap_or(false)
}

/// Decodes the views that are compressed: a row for each view, `None` for one that is not.
/// Fails where a stream is malformed, or where all are larger than the file justifies.
pub(super) fn decoded(
    path: &Path,
    root: &Root,
    buffers: &Buffers,
) -> Result<Vec<Option<Vec<u8>>>, LoadError> {
    let mut left = FREE_BYTES + BYTES_A_BYTE * buffers.total();
    let mut views = Vec::new();
    for (i, view) in root.buffer_views.iter().enumerate() {
        let all = view.extensions.as_ref().map(|all| &all.others);
        let Some(source) = extension(all) else {
            continue;
        };
        views.resize(root.buffer_views.len(), None);
        let bytes = decode(view, source, buffers, &mut left);
        views[i] = Some(bytes.map_err(|why| LoadError::Invalid {
            path: path.into(),
            place: format!("bufferView {i}, meshopt_compression"),
            message: one_line(&why),
        })?);
    }
    Ok(views)
}

/// Decodes one view.
fn decode(
    view: &View,
    source: &Value,
    buffers: &Buffers,
    left: &mut u64,
) -> Result<Vec<u8>, String> {
    let source = Source::deserialize(source).map_err(|e| e.to_string())?;
    let stored = buffers.get(source.buffer);
    let stored = stored.ok_or_else(|| format!("buffer {} has no data", source.buffer))?;
    let end = source.byte_offset.checked_add(source.byte_length);
    let end = end.filter(|end| *end <= stored.len() as u64);
    let Some(end) = end else {
        return Err(format!(
            "it spans bytes {} to {0}+{}, but buffer {} has only {}",
            source.byte_offset,
            source.byte_length,
            source.buffer,
            stored.len()
        ));
    };
    let data = &stored[source.byte_offset as usize..end as usize];
    let size = source.count.checked_mul(source.byte_stride);
    let size = size.unwrap_or(u64::MAX);
    if view.byte_length.0 != size {
        return Err(format!(
            "{} elements of {} bytes are not the {} bytes of the view",
            source.count, source.byte_stride, view.byte_length.0
        ));
    }
    *left = left
        .checked_sub(size)
        .ok_or("the views decode to more than the size of the file justifies")?;
    // Below `left`, so that neither overflows.
    let (count, stride) = (source.count as usize, source.byte_stride as usize);
    let filter = source.filter.as_deref().unwrap_or("NONE");
    let is_index = stride == 2 || stride == 4;
    match &*source.mode {
        "ATTRIBUTES" => {
            if stride == 0 || !stride.is_multiple_of(4) || stride > 256 {
                return Err(format!(
                    "its byteStride is {stride}, not a multiple of 4 from 4 to 256"
                ));
            }
            let mut bytes = vertices::decode(data, count, stride)?;
            filters::apply(filter, &mut bytes, stride)?;
            Ok(bytes)
        }
        "TRIANGLES" | "INDICES" if filter != "NONE" => {
            Err(format!("indices have no filter '{filter}'"))
        }
        "TRIANGLES" | "INDICES" if !is_index => {
            Err(format!("its byteStride is {stride}, not 2 or 4"))
        }
        "TRIANGLES" if !count.is_multiple_of(3) => {
            Err(format!("its count {count} is not a multiple of 3"))
        }
        "TRIANGLES" => indices::triangles(data, count / 3, stride),
        "INDICES" => indices::sequence(data, count, stride),
        other => Err(format!(
            "its mode '{other}' is none of ATTRIBUTES, TRIANGLES and INDICES"
        )),
    }
}

#[cfg(test)]
mod tests;
