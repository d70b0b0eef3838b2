//! Pictures within a page.

use lanecast_io::{Bits, Development, Picture, SaveError, png_bytes};
use std::path::Path;

/// Returns a picture as an address that holds all of it (RFC 2397).
pub fn data(picture: &Picture, path: &Path) -> Result<String, SaveError> {
    let development = Development {
        bits: Bits::Eight,
        ..Development::default()
    };
    let bytes = png_bytes(picture, &development, path)?;
    Ok(format!("data:image/png;base64,{}", base64(&bytes)))
}

/// Encodes bytes in base 64 (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for some in bytes.chunks(3) {
        let byte = |i: usize| u32::from(some.get(i).copied().unwrap_or(0));
        let group = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            match i <= some.len() {
                true => text.push(DIGITS[(group >> (18 - 6 * i) & 63) as usize] as char),
                false => text.push('='),
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
