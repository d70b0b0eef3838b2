//! Correlated multi-jittered samples.
//!
//! Kensler, "Correlated Multi-Jittered Sampling" (Pixar Technical Memo 13-01, 2013): N = m·n
//! points of which each cell of an m × n grid has one, each of N columns, and each of N rows.
//! Samples take the cells in a random order. A pad has two such patterns. Samples beyond N
//! begin another pattern.

use super::mix;
use lanecast_numerics::math::lanes::{Lanes, Words};

/// The grid of a number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    columns: u32,
    rows: u32,
}

impl Strata {
    /// Makes the grid next to a square that has a cell for every sample, and fewer cells
    /// without one than a row has.
    pub fn new(samples: u32) -> Strata {
        let samples = samples.clamp(1, 1 << 24);
        let columns = samples.isqrt();
        Strata {
            columns,
            rows: samples.div_ceil(columns),
        }
    }
}

/// Returns the numbers of a pad.
#[inline(always)]
pub fn pad<L: Lanes<Scalar = f32>>(
    strata: Strata,
    keys: L::Words,
    samples: L::Words,
    pad: u32,
) -> [L; 4] {
    // Lane by lane, since permutations of any length walk for different times.
    let mut numbers = [L::zero().to_array(); 4];
    for i in 0..L::COUNT {
        let key = u64::from(keys.lane(i)) << 32 | u64::from(pad);
        for pair in 0..2 {
            let [x, y] = point(strata, mix(key ^ (pair as u64) << 31), samples.lane(i));
            numbers[2 * pair].as_mut()[i] = x;
            numbers[2 * pair + 1].as_mut()[i] = y;
        }
    }
    numbers.map(|lanes| L::load(lanes.as_ref()))
}

/// Returns point `sample` of the patterns of a key.
fn point(strata: Strata, key: u64, sample: u32) -> [f32; 2] {
    let Strata { columns, rows } = strata;
    let count = columns * rows;
    let key = mix(key ^ u64::from(sample / count));
    let cell = permuted(sample % count, count, key as u32);
    let jitter = mix(key ^ 0x5bd1_e995 ^ u64::from(cell) << 32);
    let key = mix(key);
    let (column, row) = (cell % columns, cell / columns);
    // Which finer column of its cell a point has depends on the row alone, and the other way
    // round.
    let finer_column = permuted(row, rows, key as u32);
    let finer_row = permuted(column, columns, (key >> 32) as u32);
    let within = |cell: u32, finer: u32, jitter: u32, finer_count: u32| {
        let jitter = f64::from(jitter) / 4_294_967_296.0;
        f64::from(cell * finer_count + finer) + jitter
    };
    let x = within(column, finer_column, jitter as u32, rows);
    let y = within(row, finer_row, (jitter >> 32) as u32, columns);
    // Cut off, not rounded, which could leave the cell.
    [x, y].map(|x| (x / f64::from(count) * 16_777_216.0) as u32 as f32 / 16_777_216.0)
}

/// Returns the image of `x` under a random permutation of 0..count. A bijection of the next
/// power of two is repeated until it comes back into the range, and the range is rotated
/// (Kensler, section 3). Every place is equally likely. Pairs of places are not quite so for
/// few of them, which concerns the variance alone.
fn permuted(x: u32, count: u32, key: u32) -> u32 {
    let bits = 32 - (count - 1).leading_zeros();
    let mask = u32::MAX.checked_shr(32 - bits).unwrap_or(0);
    let shift = bits.div_ceil(2).max(1);
    let mut x = x;
    loop {
        for round in 0..4_u32 {
            // Adding, multiplying by an odd number and xor with higher bits are bijections.
            let constant =
                key.rotate_left(8 * round) ^ (key >> 5) ^ 0x9e37_79b9_u32.rotate_left(round);
            x = x.wrapping_add(constant) & mask;
            x = x.wrapping_mul((constant >> 16) | 1) & mask;
            x ^= x >> shift;
        }
        if x < count {
            let key = u64::from(key.wrapping_mul(0x846c_a68b));
            let turn = ((key * u64::from(count)) >> 32) as u32;
            let to_end = count - x;
            return if turn < to_end {
                x + turn
            } else {
                turn - to_end
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chi2::p_value;

    #[test]
    fn permutations_are_those_of_their_range_and_even() {
        for count in [1_u32, 2, 3, 7, 16, 100, 257, 65_536] {
            let mut seen = vec![false; count as usize];
            for x in 0..count {
                let at = permuted(x, count, 0x1357_9bdf) as usize;
                assert!(!seen[at]);
                seen[at] = true;
            }
        }
        for count in [3_u32, 5, 8, 12, 16] {
            // Over all keys an element comes to every place equally often, and the next one
            // to any other place.
            let n = count as usize;
            let (mut places, mut pairs) = (vec![0.0; n], vec![0.0; n * n]);
            let keys = 40_000;
            for key in 0..keys {
                let key = mix(key) as u32;
                let (a, b) = (permuted(0, count, key), permuted(1, count, key));
                places[a as usize] += 1.0;
                pairs[a as usize * n + b as usize] += 1.0;
            }
            let p = p_value(&places, &vec![keys as f64 / n as f64; n]);
            assert!(p > 1e-3, "{count}: {p:e}");
            let even = keys as f64 / (n * (n - 1)) as f64;
            for a in 0..n {
                for b in (0..n).filter(|b| *b != a) {
                    let share = pairs[a * n + b] / even;
                    assert!((0.5..1.6).contains(&share), "{count}: {a} {b} {share}");
                }
            }
        }
    }

    #[test]
    fn every_cell_row_and_column_gets_one_sample() {
        for samples in [1, 4, 12, 64, 100, 1024] {
            let strata = Strata::new(samples);
            let (m, n) = (strata.columns as usize, strata.rows as usize);
            assert_eq!(m * n, samples as usize);
            for key in 0..20 {
                // The second pattern as well as the first.
                for from in [0, samples] {
                    let mut cells = vec![0; m * n];
                    let mut columns = vec![0; m * n];
                    let mut rows = vec![0; m * n];
                    for i in from..from + samples {
                        let [x, y] = point(strata, key, i).map(f64::from);
                        let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
                        cells[at(x, m) * n + at(y, n)] += 1;
                        columns[at(x, m * n)] += 1;
                        rows[at(y, m * n)] += 1;
                    }
                    assert!(cells.iter().chain(&columns).chain(&rows).all(|c| *c == 1));
                }
            }
        }
        let prime = Strata::new(13);
        assert_eq!((prime.columns, prime.rows), (3, 5));
        Strata::new(0);
        Strata::new(u32::MAX);
    }
}
