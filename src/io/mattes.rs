//! Cryptomatte: ids of names with their coverage, as OpenEXR channels (Friedman & Jones, "Fully
//! Automatic ID Mattes with Support for Motion Blur and Transparency", 2015; specification 1.2.0).

use crate::exr_header::{Attribute, Metadata};
use std::collections::BTreeMap;

/// The mattes of one kind of things.
#[derive(Clone, Debug, PartialEq)]
pub struct Matte {
    /// The layer's name, such as `CryptoObject`.
    pub name: &'static str,
    /// Ids that a pixel has room for, at least 1.
    pub ranks: u32,
    /// Ranks of each pixel in turn: an id, 0 for none, and its coverage, the largest first.
    pub rows: Vec<[f32; 2]>,
    /// The ids of all names in the picture.
    pub manifest: BTreeMap<String, u32>,
}

impl Matte {
    /// Lists the layer's channels: `CryptoObject00.R` and `.G` hold the first id and its coverage,
    /// `.B` and `.A` the second, `CryptoObject01` the third and fourth, and so on.
    pub(super) fn channels(&self) -> impl Iterator<Item = (String, Vec<f32>)> {
        let ranks = self.ranks as usize;
        (0..2 * ranks).map(move |k| {
            let letter = ["R", "G", "B", "A"][k % 4];
            let rows = self.rows.chunks_exact(ranks);
            let column = rows.map(|row| row[k / 2][k % 2]).collect();
            (format!("{}{:02}.{letter}", self.name, k / 4), column)
        })
    }

    /// Returns the attributes that tell other programs of the layer.
    pub(super) fn attributes(&self) -> Metadata {
        // The specification's key: seven digits of the hash of the layer's name.
        let key = format!("{:08x}", murmur3(self.name.as_bytes()));
        let ids = self.manifest.iter();
        let ids: BTreeMap<&str, String> = ids
            .map(|(name, id)| (name.as_str(), format!("{id:08x}")))
            .collect();
        // A map of texts can always be written.
        let manifest = serde_json::to_string(&ids).unwrap_or_default();
        [
            ("name", self.name.to_string()),
            ("hash", "MurmurHash3_32".into()),
            ("conversion", "uint32_to_float32".into()),
            ("manifest", manifest),
        ]
        .into_iter()
        .map(|(of, text)| {
            (
                format!("cryptomatte/{}/{of}", &key[..7]),
                Attribute::Text(text),
            )
        })
        .collect()
    }
}

/// Returns the id of a name: its hash, whose bits are a number of f32 that is neither denormal,
/// infinite nor NaN.
pub fn matte_id(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    match hash >> 23 & 255 {
        0 | 255 => hash ^ 1 << 23,
        _ => hash,
    }
}

/// Hashes bytes by MurmurHash3_x86_32 with the seed 0 (Appleby, public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let mix = |k: u32| {
        k.wrapping_mul(0xcc9e_2d51)
            .rotate_left(15)
            .wrapping_mul(0x1b87_3593)
    };
    let (blocks, tail) = bytes.as_chunks::<4>();
    let mut hash = 0_u32;
    for block in blocks {
        hash = (hash ^ mix(u32::from_le_bytes(*block))).rotate_left(13);
        hash = hash.wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let rest = tail.iter().rev();
    hash ^= mix(rest.fold(0, |rest, byte| rest << 8 | u32::from(*byte)));
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the hash's own test vectors, and names of the specification's examples.
    #[test]
    fn ids_are_those_of_the_specification() {
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"test"), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!"), 0xc036_3e43);
        assert_eq!(
            murmur3(b"The quick brown fox jumps over the lazy dog"),
            0x2e4f_f723
        );
        for i in 0..10_000 {
            let id = f32::from_bits(matte_id(&format!("object {i}")));
            assert!(id.is_normal());
        }
    }

    #[test]
    fn ranks_lie_in_channels_by_twos() {
        let matte = Matte {
            name: "CryptoObject",
            ranks: 3,
            rows: vec![[1.0, 0.5], [2.0, 0.25], [3.0, 0.125]],
            manifest: BTreeMap::from([("a \"b\"".into(), 0x12)]),
        };
        let channels: Vec<_> = matte.channels().collect();
        let names: Vec<&str> = channels.iter().map(|(name, _)| &name[..]).collect();
        assert_eq!(
            names,
            [
                "CryptoObject00.R",
                "CryptoObject00.G",
                "CryptoObject00.B",
                "CryptoObject00.A",
                "CryptoObject01.R",
                "CryptoObject01.G"
            ]
        );
        let values: Vec<f32> = channels.iter().map(|(_, column)| column[0]).collect();
        assert_eq!(values, [1.0, 0.5, 2.0, 0.25, 3.0, 0.125]);
        let attributes = matte.attributes();
        let (name, text) = &attributes[3];
        assert!(name.starts_with("cryptomatte/") && name.ends_with("/manifest"));
        assert_eq!(*text, Attribute::Text(r#"{"a \"b\"":"00000012"}"#.into()));
    }
}
