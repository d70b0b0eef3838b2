//! FNV-1a, the checksum of parts and tiles of pictures: it finds damage, and keeps nobody out.

/// The checksum of no bytes (the offset basis of 64 bits).
const EMPTY: u64 = 0xcbf2_9ce4_8422_2325;

/// Returns a checksum with one byte more.
pub fn eat(checksum: u64, byte: &u8) -> u64 {
    (checksum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
}

/// Returns the checksum of bytes.
pub fn fnv<'b>(bytes: impl IntoIterator<Item = &'b u8>) -> u64 {
    bytes.into_iter().fold(EMPTY, eat)
}
