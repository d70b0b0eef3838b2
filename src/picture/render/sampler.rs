//! Sample positions inside a pixel: a fixed stratified pattern.
//!
//! The pattern is Hammersley's point set, shifted cyclically inside the pixel by a hash
//! of (seed, frame, pixel). Every column and every power-of-two row of the pixel gets
//! its share of samples, and neighbouring pixels have different patterns. The position
//! is a function of its arguments alone, so no tile, thread or lane width changes a
//! sample. A single sample lies at the centre.

/// Returns sample `index` of `count` as offsets in [0, 1) from the pixel's left and top
/// edges.
pub fn sample_position(
    seed: u64,
    frame: u32,
    pixel: (u32, u32),
    index: u32,
    count: u32,
) -> [f64; 2] {
    position_in(seed, frame_key(frame), pixel, index, count)
}

/// Hashes the number of a frame, once for all its pixels.
pub(super) fn frame_key(frame: u32) -> u64 {
    mix(u64::from(frame))
}

/// As [`sample_position`], from a frame's key.
#[inline(always)]
pub(super) fn position_in(
    seed: u64,
    frame_key: u64,
    pixel: (u32, u32),
    index: u32,
    count: u32,
) -> [f64; 2] {
    if count == 1 {
        return [0.5, 0.5];
    }
    let place = u64::from(pixel.0) | u64::from(pixel.1) << 32;
    let key = mix(seed ^ mix(place ^ frame_key));
    let (dx, dy) = (unit(key), unit(mix(key)));
    let x = (f64::from(index) + 0.5) / f64::from(count) + dx;
    let y = f64::from(index.reverse_bits()) * TWO_POW_MINUS_32 + dy;
    [x.fract(), y.fract()]
}

const TWO_POW_MINUS_32: f64 = 1.0 / 4_294_967_296.0;

/// The finaliser of Vigna's SplitMix64.
pub fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// Maps the upper half of the bits to [0, 1).
pub fn unit(bits: u64) -> f64 {
    (bits >> 32) as f64 * TWO_POW_MINUS_32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stratum_gets_one_sample() {
        let n = 64;
        let mut columns = vec![0; n];
        let mut rows = vec![0; n];
        let shift = sample_position(7, 0, (3, 4), 0, n as u32);
        for i in 0..n as u32 {
            let [x, y] = sample_position(7, 0, (3, 4), i, n as u32);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            // Undo the shift: strata are counted from the first sample.
            let at = |v: f64, from: f64| ((v - from + 1.0 + 1e-9).fract() * n as f64) as usize;
            columns[at(x, shift[0])] += 1;
            rows[at(y, shift[1])] += 1;
        }
        assert!(columns.iter().all(|c| *c == 1), "{columns:?}");
        assert!(rows.iter().all(|c| *c == 1), "{rows:?}");
    }

    #[test]
    fn pixels_seeds_and_frames_differ_and_one_sample_is_the_centre() {
        let base = sample_position(1, 0, (5, 5), 3, 16);
        assert_ne!(base, sample_position(1, 0, (6, 5), 3, 16));
        assert_ne!(base, sample_position(2, 0, (5, 5), 3, 16));
        assert_ne!(base, sample_position(1, 1, (5, 5), 3, 16));
        assert_eq!(base, sample_position(1, 0, (5, 5), 3, 16));
        assert_eq!(sample_position(9, 9, (1, 2), 0, 1), [0.5, 0.5]);
    }
}
