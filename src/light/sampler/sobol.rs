//! Owen-scrambled, shuffled points of Sobol' in pads of four dimensions.
//!
//! Burley, "Practical Hash-based Owen Scrambling" (JCGT 9(4), 2020): each pad shuffles the
//! samples by a nested uniform permutation of their index, and scrambles each of the first
//! four dimensions of Sobol's sequence. Both are the hash of Laine and Karras in Vegdahl's
//! form ("Building a Better LK Hash", 2021), which works on reversed bits; so bits are
//! reversed only at both ends.
//!
//! The numbers of pad p of a pixel are `sobol_burley::sample_4d(sample, 0, seed)` of the
//! crate `sobol_burley` for samples below 2^16, bit by bit, with seed = key + p·0x9e3779b9.
//! From 2^16 on, where that crate ends, the same sequence goes on to 2^32.

use super::hash;
use lanecast_numerics::math::lanes::{Lanes, Words};

/// How far the seeds of consecutive pads lie apart: 2³² over the golden ratio.
const PAD_STEP: u32 = 0x9e37_79b9;

/// Of each dimension the direction numbers, with reversed bits: entry i belongs to bit i of
/// the index. Primitive polynomials and initial numbers are those of Joe & Kuo,
/// "Constructing Sobol sequences with better two-dimensional projections" (2008), of which
/// the first dimension is van der Corput's sequence.
const DIRECTIONS: [[u32; 32]; 4] = [
    directions(&[], 0),
    directions(&[1], 0),
    directions(&[1, 3], 1),
    directions(&[1, 3, 1], 1),
];

/// Extends initial direction numbers by the recurrence of the primitive polynomial whose
/// inner coefficients are the bits of `inner`.
const fn directions(first: &[u32], inner: u32) -> [u32; 32] {
    let degree = first.len();
    let mut v = [0; 32];
    let mut i = 0;
    while i < 32 {
        if degree == 0 {
            v[i] = 1 << (31 - i);
        } else if i < degree {
            v[i] = first[i] << (31 - i);
        } else {
            v[i] = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (inner >> (degree - 1 - k)) & 1 == 1 {
                    v[i] ^= v[i - k];
                }
                k += 1;
            }
        }
        i += 1;
    }
    let mut i = 0;
    while i < 32 {
        v[i] = v[i].reverse_bits();
        i += 1;
    }
    v
}

/// What each value of three bits of the reversed index adds to two dimensions.
type Triples = [[u32; 8]; 6];

/// Tables of dimensions `low` and `low + 1` for the lowest 16 bits of the index, which are
/// the highest of the reversed index; group g begins at its bit 16 + 3·g. Directions of 16
/// bits have 16 bits, so a word holds two dimensions.
const fn triples(low: usize) -> Triples {
    let mut tables = [[0; 8]; 6];
    let mut group = 0;
    while group < 6 {
        let mut value = 0;
        while value < 8 {
            let mut bit = 0;
            while bit < 3 {
                let place = 16 + 3 * group + bit;
                if (value >> bit) & 1 == 1 && place < 32 {
                    let i = 31 - place;
                    tables[group][value] ^= DIRECTIONS[low][i] | DIRECTIONS[low + 1][i] << 16;
                }
                bit += 1;
            }
            value += 1;
        }
        group += 1;
    }
    tables
}

static FIRST_TWO: Triples = triples(0);
static LAST_TWO: Triples = triples(2);

/// Owen-scrambles words of reversed bits: each bit is flipped or not by a hash of those
/// below it. The scramble itself has to be a hash.
#[inline(always)]
fn owen_scrambled<W: Words>(x: W, scramble: W) -> W {
    let x = x ^ (x * W::splat(0x3d20_adea));
    let x = (x + scramble) * ((scramble >> 16) | W::splat(1));
    let x = x ^ (x * W::splat(0x0552_6c56));
    x ^ (x * W::splat(0x53a2_2864))
}

/// Sums the directions of two dimensions over the highest 16 bits of the reversed index.
#[inline(always)]
fn sums<W: Words>(reversed: W, tables: &Triples) -> W {
    let group = |g: usize| (reversed >> (16 + 3 * g as u32)).entries(&tables[g]);
    ((group(0) ^ group(1)) ^ (group(2) ^ group(3))) ^ (group(4) ^ group(5))
}

/// Adds the directions of the index's bits from 16 on, the lowest of the reversed index.
#[inline(never)]
fn add_high_bits<W: Words>(reversed: W, points: [W; 4]) -> [W; 4] {
    let mut points = points;
    for place in 0..16 {
        let set = W::splat(0) - ((reversed >> place) & W::splat(1));
        for (point, directions) in points.iter_mut().zip(&DIRECTIONS) {
            *point = *point ^ (set & W::splat(directions[31 - place as usize]));
        }
    }
    points
}

/// Returns the numbers of a pad.
#[inline(always)]
pub fn pad<L: Lanes<Scalar = f32>>(keys: L::Words, samples: L::Words, pad: u32) -> [L; 4] {
    let splat = L::Words::splat;
    let seeds = keys + splat(pad.wrapping_mul(PAD_STEP));
    let shuffle = hash(seeds ^ splat(0x79c6_8e4a));
    let index = owen_scrambled(samples.reverse_bits(), shuffle);
    let (first, last) = (sums(index, &FIRST_TWO), sums(index, &LAST_TWO));
    let low = splat(0xffff);
    let mut points = [first & low, first >> 16, last & low, last >> 16];
    if (samples >> 16).any() {
        // Low bits of the shuffled index depend on low bits alone. Without what those of the
        // first 2^16 samples have, these samples are not moved.
        let high = (index ^ owen_scrambled(splat(0), shuffle)) & low;
        points = add_high_bits(high, points);
    }
    let seeds = seeds * splat(0x9c8f_2d3b);
    let [a, b, c, d] = points;
    // Not `from_fn`, which is a call: its arguments go through memory.
    [
        scrambled(a, seeds, 0x912f_69ba),
        scrambled(b, seeds, 0x174f_18ab),
        scrambled(c, seeds, 0x691e_72ca),
        scrambled(d, seeds, 0xb40c_c1b8),
    ]
}

/// Scrambles the points of one dimension of a pad, and maps them to [0, 1).
#[inline(always)]
fn scrambled<L: Lanes<Scalar = f32>>(points: L::Words, seeds: L::Words, dimension: u32) -> L {
    let scramble = hash(seeds ^ L::Words::splat(dimension));
    let word = owen_scrambled(points, scramble).reverse_bits();
    // 23 bits, as the crate has them.
    L::from_words(word >> 9) * L::splat(1.0 / 8_388_608.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Kind, Sampler};
    use crate::sampling::concentric_disc;

    #[test]
    fn numbers_are_those_of_the_crate() {
        let sampler = Sampler::new(Kind::Sobol, 0, 0, 1);
        for (key, pad) in [
            (0, 0_u32),
            (1_u32, 0),
            (0x1234_5678, 0),
            (99, 3),
            (u32::MAX, 1000),
        ] {
            let seed = PAD_STEP.wrapping_mul(pad).wrapping_add(key);
            for sample in 0..1 << 16 {
                let ours = sampler.pad_one(key, sample, pad);
                let theirs = sobol_burley::sample_4d(sample, 0, seed);
                assert_eq!(ours.map(f32::to_bits), theirs.map(f32::to_bits));
            }
        }
    }

    /// Of any 2ᵏ samples that begin at a multiple of 2ᵏ, every number has one in each
    /// stratum of width 2⁻ᵏ, and numbers 0 and 1 have one in each elementary rectangle.
    #[test]
    fn every_stratum_gets_one_sample() {
        let sampler = Sampler::new(Kind::Sobol, 3, 0, 1);
        let key = sampler.key(10, 20);
        for (bits, from) in [
            (4, 0),
            (8, 0),
            (8, 256),
            (8, 1 << 16),
            (18, 0),
            (17, 1 << 30),
        ] {
            let count = 1 << bits;
            let points: Vec<[f32; 4]> = (from..from + count)
                .map(|sample| sampler.pad_one(key, sample, 1))
                .collect();
            let cell = |x: f32, bits: u32| (x * (1_u32 << bits) as f32) as usize;
            for k in 0..4 {
                let mut seen = vec![false; count as usize];
                for point in &points {
                    let at = cell(point[k], bits);
                    assert!(!seen[at], "{bits} bits from {from}, number {k}");
                    seen[at] = true;
                }
            }
            for x_bits in 0..=bits {
                let y_bits = bits - x_bits;
                let mut seen = vec![false; count as usize];
                for point in &points {
                    let at = cell(point[0], x_bits) << y_bits | cell(point[1], y_bits);
                    assert!(!seen[at], "2^{x_bits} × 2^{y_bits} from {from}");
                    seen[at] = true;
                }
            }
        }
    }

    /// What a pixel sees of a plane through a lens: the plane's value where a point of the pixel, moved
    /// by `blur` pixels times a point of the lens, lies.
    fn seen(plane: impl Fn(f64, f64) -> f64, blur: f64, [x, y, u, v]: [f32; 4]) -> f64 {
        let lens = concentric_disc([u, v]).map(f64::from);
        plane(f64::from(x) + blur * lens[0], f64::from(y) + blur * lens[1])
    }

    /// Returns the mean squared error of 16 samples by pads of four, and by pairs of two pads, as parts of
    /// that of independent numbers.
    fn of_fours_and_pairs(plane: impl Fn(f64, f64) -> f64 + Copy, blur: f64) -> [f64; 2] {
        let sobol = Sampler::new(Kind::Sobol, 5, 0, 16);
        let independent = Sampler::new(Kind::Independent, 5, 0, 16);
        let points: [&dyn Fn(u32, u32) -> [f32; 4]; 3] = [
            &|key, sample| sobol.pad_one(key, sample, 0),
            &|key, sample| {
                let [x, y, ..] = sobol.pad_one(key, sample, 0);
                let [u, v, ..] = sobol.pad_one(key, sample, 1);
                [x, y, u, v]
            },
            &|key, sample| independent.pad_one(key, sample, 0),
        ];
        let mut errors = [0.0; 3];
        for pixel in 0..256 {
            // Another part of the plane for each pixel.
            let at = sobol.pad_one(9, pixel, 2).map(|x| 8.0 * f64::from(x));
            let moved = |x: f64, y: f64| plane(x + at[0], y + at[1]);
            let exact: f64 = (0..1 << 14)
                .map(|sample| seen(moved, blur, sobol.pad_one(1, sample, 0)))
                .sum();
            let exact = exact / f64::from(1 << 14);
            for (error, point) in errors.iter_mut().zip(points) {
                for seed in 0..8 {
                    let key = sobol.key(pixel, seed);
                    let sum: f64 = (0..16).map(|s| seen(moved, blur, point(key, s))).sum();
                    *error += (sum / 16.0 - exact) * (sum / 16.0 - exact);
                }
            }
        }
        [errors[0] / errors[2], errors[1] / errors[2]]
    }

    /// Of a pixel and a lens pads of four have at most three quarters of the error of pairs while the blur is
    /// about as wide as the pixel; of wide blur most of the error is of the lens alone, which has a pair
    /// either way.
    #[test]
    fn pads_of_four_beat_pairs_where_pixel_and_lens_count_alike() {
        let waves = |x: f64, y: f64| 0.5 + 0.5 * libm::sin(x) * libm::sin(y);
        let edges = |x: f64, y: f64| f64::from(libm::sin(0.9 * x + 0.5 * y) > 0.0);
        for blur in [0.25, 0.5, 1.0, 4.0] {
            let [fours, pairs] = of_fours_and_pairs(waves, blur);
            let [sharp, in_pairs] = of_fours_and_pairs(edges, blur);
            println!(
                "{blur} pixels: waves {:.2} ({fours:.3} of independent), edges {:.2} ({sharp:.3})",
                fours / pairs,
                sharp / in_pairs
            );
            if blur <= 1.0 {
                assert!(fours / pairs <= 0.75, "{blur}: {fours} {pairs}");
                assert!(sharp / in_pairs <= 0.85, "{blur}: {sharp} {in_pairs}");
            }
        }
    }
}
