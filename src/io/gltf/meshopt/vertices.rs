//! Mode 0: rows of attributes, as differences of bytes, of 16 bits, or of bits.
//!
//! Rows come in blocks. A block holds the first bytes of its rows, then the second ones, and so on:
//! a column of differences for each place in a row, in groups of 16 rows. A group is as wide as its
//! differences need; those that are wider still follow it.

/// Rows of a group.
const GROUP: usize = 16;
/// Rows that a block has at most.
const BLOCK: usize = 256;
/// Bytes that a block has at most, unless a group has more.
const BLOCK_BYTES: usize = 8192;
/// Bytes that the end of a stream has at least, by version.
const LEAST_TAIL: [usize; 2] = [32, 24];

/// Bytes yet to be read.
struct Input<'d> {
    rest: &'d [u8],
}

impl<'d> Input<'d> {
    fn take(&mut self, count: usize) -> Result<&'d [u8], String> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or("the stream of vertices ends too early")?;
        self.rest = rest;
        Ok(taken)
    }
}

/// Decodes `count` rows of `stride` bytes, a multiple of 4.
pub(super) fn decode(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let version = match data.first() {
        Some(0xa0) => 0,
        Some(0xa1) => 1,
        _ => return Err("the stream of vertices has an unknown version".into()),
    };
    let channels = stride / 4;
    let modes = if version == 1 { channels } else { 0 };
    let tail = (stride + modes).max(LEAST_TAIL[version]);
    let body = data[1..].len().checked_sub(tail);
    let body = body.ok_or("the stream of vertices ends too early")?;
    let mut input = Input {
        rest: &data[1..1 + body],
    };
    let baseline = &data[data.len() - stride - modes..];
    let (baseline, modes) = baseline.split_at(stride);
    let mut last = baseline.to_vec();
    let mut rows = vec![0; count * stride];
    let most = ((BLOCK_BYTES / stride) & !(GROUP - 1)).min(BLOCK);
    for block in rows.chunks_mut(most * stride) {
        let groups = (block.len() / stride).div_ceil(GROUP);
        let controls = match version {
            1 => input.take(channels)?,
            _ => &[],
        };
        for channel in 0..channels {
            let mut columns = [[0; BLOCK]; 4];
            for (k, column) in columns.iter_mut().enumerate() {
                let control = controls.get(channel).map(|c| c >> (2 * k) & 3);
                let column = &mut column[..groups * GROUP];
                differences(&mut input, control, column, block.len() / stride)?;
            }
            let mode = modes.get(channel).copied().unwrap_or(0);
            let at = 4 * channel;
            let mut value = [last[at], last[at + 1], last[at + 2], last[at + 3]];
            for (i, row) in block.chunks_exact_mut(stride).enumerate() {
                value = following(value, columns.each_ref().map(|column| column[i]), mode)?;
                row[at..at + 4].copy_from_slice(&value);
            }
            last[at..at + 4].copy_from_slice(&value);
        }
    }
    match input.rest {
        [] => Ok(rows),
        _ => Err("the stream of vertices is longer than its rows".into()),
    }
}

/// Returns the value of a channel that follows `before` by a difference.
fn following(before: [u8; 4], by: [u8; 4], mode: u8) -> Result<[u8; 4], String> {
    match (mode & 15, mode >> 4) {
        (0, 0) => Ok(std::array::from_fn(|k| {
            let by = by[k];
            let signed = if by & 1 == 1 { !(by >> 1) } else { by >> 1 };
            before[k].wrapping_add(signed)
        })),
        (1, 0) => {
            let half = |at: usize| {
                let by = u16::from_le_bytes([by[at], by[at + 1]]);
                let signed = if by & 1 == 1 { !(by >> 1) } else { by >> 1 };
                let before = u16::from_le_bytes([before[at], before[at + 1]]);
                before.wrapping_add(signed).to_le_bytes()
            };
            let ([a, b], [c, d]) = (half(0), half(2));
            Ok([a, b, c, d])
        }
        (2, turn) => {
            let by = u32::from_le_bytes(by).rotate_right(u32::from(turn));
            Ok((u32::from_le_bytes(before) ^ by).to_le_bytes())
        }
        _ => Err(format!(
            "the stream of vertices has an unknown channel mode {mode}"
        )),
    }
}

/// Reads a column of differences of whole groups, of which the first `count` are of rows; `control`
/// is `None` in version 0.
fn differences(
    input: &mut Input,
    control: Option<u8>,
    column: &mut [u8],
    count: usize,
) -> Result<(), String> {
    // Bits of a difference for each code of a group.
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => return Ok(()),
        Some(_) => {
            // Only these have nothing that fills up the last group.
            column[..count].copy_from_slice(input.take(count)?);
            return Ok(());
        }
    };
    let groups = column.len() / GROUP;
    let codes = input.take(groups.div_ceil(4))?;
    for (i, group) in column.chunks_exact_mut(GROUP).enumerate() {
        let code = codes[i / 4] >> (2 * (i % 4)) & 3;
        match widths[usize::from(code)] {
            0 => {}
            8 => group.copy_from_slice(input.take(GROUP)?),
            bits => {
                let packed = input.take(GROUP * bits / 8)?;
                let wide = (1 << bits) - 1;
                for (k, difference) in group.iter_mut().enumerate() {
                    let byte = packed[k * bits / 8];
                    let place = k * bits % 8;
                    // Single bits begin with the lowest, wider ones with the highest.
                    let place = if bits == 1 { place } else { 8 - bits - place };
                    let short = byte >> place & wide;
                    *difference = match short == wide {
                        true => input.take(1)?[0],
                        false => short,
                    };
                }
            }
        }
    }
    Ok(())
}
