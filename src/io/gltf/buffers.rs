//! The bytes of a document's buffers: the GLB chunk, data URIs, and files.
//!
//! Files are read by [`Folder`]; a file that several buffers name is stored once. A buffer
//! without any source is allowed, because extensions use it; it is an error only when
//! something reads it.

use super::meshopt;
use crate::shared::messages::one_line;
use crate::{Folder, LoadError};
use gltf::json::Root;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The buffers of a document.
#[derive(Default)]
pub(super) struct Buffers<'a> {
    stores: Vec<Cow<'a, [u8]>>,
    /// For each buffer the index of its store and its length; `None` without a source.
    stored: Vec<Option<(usize, usize)>>,
}

impl<'a> Buffers<'a> {
    /// Reads the bytes of all buffers. Fails if a file cannot be read, a URI is malformed, or
    /// a source is shorter than its buffer.
    pub fn read(
        path: &Path,
        root: &Root,
        bin: Option<&'a [u8]>,
        folder: &Folder,
    ) -> Result<Buffers<'a>, LoadError> {
        let mut buffers = Buffers::default();
        let mut files: HashMap<PathBuf, usize> = HashMap::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            if meshopt::is_fallback(buffer) {
                buffers.stored.push(None);
                continue;
            }
            let wrong = |message: String| LoadError::Invalid {
                path: path.into(),
                place: format!("buffer {i}"),
                message,
            };
            let store = match (&buffer.uri, bin) {
                (None, Some(bin)) if i == 0 => buffers.store(Cow::Borrowed(bin)),
                (None, _) => {
                    buffers.stored.push(None);
                    continue;
                }
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => buffers.store(Cow::Owned(data_uri(data).map_err(wrong)?)),
                    None => {
                        let found = folder.resolve(&file_name(uri).map_err(wrong)?)?;
                        match files.get(&found) {
                            Some(store) => *store,
                            None => {
                                let bytes = crate::shared::folder::read_file(&found)?;
                                let store = buffers.store(Cow::Owned(bytes));
                                files.insert(found, store);
                                store
                            }
                        }
                    }
                },
            };
            let held = buffers.stores[store].len();
            let length = buffer.byte_length.0;
            if length > held as u64 {
                return Err(wrong(format!(
                    "byteLength is {length}, but there are only {held} bytes"
                )));
            }
            buffers.stored.push(Some((store, length as usize)));
        }
        Ok(buffers)
    }

    /// Adds bytes and returns their index.
    fn store(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.stores.push(bytes);
        self.stores.len() - 1
    }

    /// Returns the bytes of a buffer; `None` if it does not exist or has no source.
    pub fn get(&self, buffer: usize) -> Option<&[u8]> {
        let (store, length) = (*self.stored.get(buffer)?)?;
        self.stores[store].get(..length)
    }

    /// The number of bytes that are stored.
    pub fn total(&self) -> u64 {
        self.stores.iter().map(|s| s.len() as u64).sum()
    }
}

/// Decodes the file name of a relative reference. Refuses URIs with a scheme.
pub(super) fn file_name(uri: &str) -> Result<String, String> {
    let scheme = uri.split(['/', '?', '#']).next().unwrap_or_default();
    if scheme.contains(':') {
        return Err(format!(
            "its uri '{}' is neither a relative file name nor a data URI",
            one_line(uri)
        ));
    }
    let bytes = percent_decode(uri)?;
    let name = String::from_utf8(bytes)
        .map_err(|_| format!("its uri '{}' is not UTF-8 when decoded", one_line(uri)))?;
    if name.contains('\0') || name.is_empty() {
        return Err(format!("its uri '{}' is not a file name", one_line(uri)));
    }
    Ok(name)
}

/// Decodes a data URI; `data` is what follows `data:`.
pub(super) fn data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = data
        .split_once(',')
        .ok_or("its data URI has no comma before the data")?;
    if kind.ends_with(";base64") {
        // Some encoders break lines, or escape what a URI may not have.
        let mut text = percent_decode(data)?;
        text.retain(|b| !b.is_ascii_whitespace());
        base64(&text)
    } else {
        percent_decode(data)
    }
}

/// Replaces `%` and two hexadecimal digits by the byte they mean.
fn percent_decode(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let hex = |b: u8| char::from(b).to_digit(16);
        let [high, low, after @ ..] = rest else {
            return Err("its uri ends within a %-escape".into());
        };
        let (Some(high), Some(low)) = (hex(*high), hex(*low)) else {
            return Err("its uri has a % without two hexadecimal digits".into());
        };
        bytes.push((high * 16 + low) as u8);
        rest = after;
    }
    Ok(bytes)
}

/// Decodes base64 (RFC 4648) in the standard alphabet; padding may be missing.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let end = text.iter().rposition(|b| *b != b'=').map_or(0, |i| i + 1);
    if text.len() - end > 2 || end % 4 == 1 {
        return Err("its base64 data has a wrong length".into());
    }
    let mut bytes = Vec::with_capacity(end / 4 * 3 + 2);
    let (mut bits, mut count) = (0_u32, 0);
    for (i, b) in text[..end].iter().enumerate() {
        let six = match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return Err(format!("its base64 data has a wrong character at {i}")),
        };
        bits = (bits << 6) | u32::from(six);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_known_answers() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm8", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base64(text.as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64(b"+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        for wrong in ["Z", "Zg===", "Z g=", "Zg==Zg==", "Zm9v\n"] {
            assert!(base64(wrong.as_bytes()).is_err(), "{wrong}");
        }
    }

    #[test]
    fn uris() {
        assert_eq!(file_name("a%20b/%C3%A9.bin").unwrap(), "a b/é.bin");
        assert_eq!(file_name("a/b:c").unwrap(), "a/b:c");
        for wrong in [
            "http://x/y",
            "file:///etc/passwd",
            "%",
            "%g0",
            "%00",
            "",
            "%ff",
        ] {
            assert!(file_name(wrong).is_err(), "{wrong}");
        }
        assert_eq!(data_uri(",a%41").unwrap(), b"aA");
        assert_eq!(data_uri(";base64,Zm9v\r\n Ym\tFy\n").unwrap(), b"foobar");
        assert_eq!(data_uri(";base64,Zg%3D%3D").unwrap(), b"f");
        assert!(data_uri("application/octet-stream;base64").is_err());
    }
}
