//! KTX2 files of Basis Universal as texels: ETC1S and UASTC, of which level 0 is read.

use super::images::{Budget, too_large};
use super::texels::LONGEST;
use basisu::ktx2::{BasisFormat, Ktx2Header};
use basisu::{DecodeFlags, TargetFormat, Transcoder};
use std::ops::Range;

/// Where the header has the length of keys and values.
const LENGTH_OF_KEYS: Range<usize> = 60..64;

/// The number of Zstandard among supercompressions.
const ZSTANDARD: u32 = 2;

/// Bytes of a block of 4 × 4 texels of UASTC.
const BLOCK: u64 = 16;

/// Decodes an image to four bytes a texel, rows from the top, with its size. Fails with what is
/// wrong.
///
/// Lengths are checked before the decoder sees the file, and what the texels and their smaller
/// levels will take is taken from the budget.
pub(super) fn decode(bytes: &[u8], budget: &mut Budget) -> Result<(Vec<u8>, [u32; 2]), String> {
    // Keys and values are not needed, and the decoder reads beyond the end of malformed ones.
    let mut bytes = bytes.to_vec();
    if let Some(length) = bytes.get_mut(LENGTH_OF_KEYS) {
        length.fill(0);
    }
    let bytes = &*bytes;
    let header = Ktx2Header::parse(bytes);
    let header =
        header.ok_or("it is no KTX2 file of Basis Universal, or its header is malformed")?;
    if !matches!(header.format, BasisFormat::Etc1s | BasisFormat::Uastc) {
        return Err(format!(
            "its texels are {:?}; glTF allows ETC1S and UASTC",
            header.format
        ));
    }
    if header.layer_count > 1 || header.face_count > 1 {
        return Err("it is a cube, an array or a video, not one image".into());
    }
    let size = [header.width, header.height];
    if size.iter().any(|side| *side > LONGEST) {
        let [width, height] = size;
        return Err(format!(
            "{width} × {height} texels are more than {LONGEST} a side; make it smaller"
        ));
    }
    let [width, height] = size.map(u64::from);
    let takes = width * height * 4 * 4 / 3;
    let left = budget.left.checked_sub(takes);
    budget.left = left.ok_or_else(|| too_large(size, takes, budget))?;
    let level = header.levels.first().ok_or("it has no level")?;
    let parts = [
        (level.byte_offset, level.byte_length),
        (header.sgd_byte_offset, header.sgd_byte_length),
    ];
    let is_within = |(offset, length): &(u64, u64)| {
        let end = offset.checked_add(*length);
        end.is_some_and(|end| end <= bytes.len() as u64)
    };
    if !parts.iter().all(is_within) {
        return Err("it is shorter than its header says".into());
    }
    let blocks = width.div_ceil(4) * height.div_ceil(4) * BLOCK;
    let is_packed = header.supercompression == ZSTANDARD;
    if is_packed && level.uncompressed_byte_length != blocks {
        return Err(format!(
            "its level 0 inflates to {} bytes instead of {blocks}",
            level.uncompressed_byte_length
        ));
    }
    let malformed = |_| "its data is malformed";
    let image = Transcoder::new(bytes).map_err(malformed)?;
    let mut texels = image
        .transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
        .map_err(malformed)?;
    if green_is_alpha(bytes) {
        for texel in texels.chunks_exact_mut(4) {
            texel.copy_from_slice(&[texel[0], texel[3], 0, u8::MAX]);
        }
    }
    Ok((texels, size))
}

/// Says whether the channel that decoders give as alpha is green: files of red and green alone
/// keep it there (`RRR` and `GGG` of ETC1S, `RRRG` of UASTC).
fn green_is_alpha(bytes: &[u8]) -> bool {
    /// Where the header has the place of the descriptor, and where this has its colour model
    /// and the channels of its samples.
    const DESCRIPTOR: usize = 48;
    const MODEL: usize = 12;
    const CHANNELS: [usize; 2] = [31, 47];
    const ETC1S: u8 = 163;
    const UASTC: u8 = 166;
    let at = bytes.get(DESCRIPTOR..DESCRIPTOR + 4);
    let Some(at) = at.map(|at| u32::from_le_bytes([at[0], at[1], at[2], at[3]]) as usize) else {
        return false;
    };
    let byte = |offset: usize| bytes.get(at + offset).copied();
    let [first, second] = CHANNELS.map(|offset| byte(offset).map(|channel| channel & 15));
    match byte(MODEL) {
        Some(ETC1S) => second == Some(4),
        Some(UASTC) => first == Some(5),
        _ => false,
    }
}
