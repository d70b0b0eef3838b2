//! Random numbers as functions of seed, frame, pixel, sample and dimension.
//!
//! The numbers of a path come in pads of four. A pad is a function of the pixel's key, the
//! sample and the pad's index alone, so no order of rays, threads or tiles changes a number.
//! Within a pad the numbers of a pixel's samples are stratified together, as far as the
//! sampler stratifies; different pads and different pixels are independent of each other.
//! All numbers are in [0, 1) and have the same bits at every width.

mod sobol;
mod stratified;

use lanecast_numerics::math::lanes::{Lanes, Word, Words};

/// How the samples of a pixel are spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Independent numbers, a hash of their counter (Jarzynski & Olano, "Hash Functions for
    /// GPU Rendering", JCGT 9(3), 2020).
    Independent,
    /// Numbers 0 and 1 of a pad, and 2 and 3, are correlated multi-jittered: one sample in
    /// each cell of a grid, row and column of finer cells (Kensler 2013). Fit for a number of
    /// samples known beforehand.
    Stratified,
    /// Owen-scrambled, shuffled points of Sobol' in four dimensions (Burley, "Practical
    /// Hash-based Owen Scrambling", JCGT 9(4), 2020): any first 2ᵏ samples are well spread.
    #[default]
    Sobol,
}

/// Makes the random numbers of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: Kind,
    /// Seed and frame, mixed.
    frame: u64,
    strata: stratified::Strata,
}

impl Sampler {
    /// Makes the sampler of a frame. `spp` is the number of samples per pixel, which only
    /// [`Kind::Stratified`] has to know; samples beyond it are valid with every kind.
    pub fn new(kind: Kind, seed: u64, frame: u32, spp: u32) -> Sampler {
        Sampler {
            kind,
            frame: mix(seed ^ mix(u64::from(frame))),
            strata: stratified::Strata::new(spp),
        }
    }

    /// Returns the key of a pixel, of which its pads are made.
    pub fn key(&self, x: u32, y: u32) -> u32 {
        (mix(self.frame ^ mix(u64::from(x) | u64::from(y) << 32)) >> 32) as u32
    }

    /// Returns the four numbers of a pad in each lane, from the key of the lane's pixel and
    /// the sample's index.
    #[inline(always)]
    pub fn pad<L: Lanes<Scalar = f32>>(
        &self,
        keys: L::Words,
        samples: L::Words,
        pad: u32,
    ) -> [L; 4] {
        match self.kind {
            Kind::Independent => independent(keys, samples, pad),
            Kind::Stratified => stratified::pad(self.strata, keys, samples, pad),
            Kind::Sobol => sobol::pad(keys, samples, pad),
        }
    }

    /// Returns the four numbers of one sample's pad, with the bits of [`Sampler::pad`].
    pub fn pad_one(&self, key: u32, sample: u32, pad: u32) -> [f32; 4] {
        self.pad(Word(key), Word(sample), pad)
    }
}

/// Hashes key, sample and pad to four numbers: `pcg4d`, a linear congruential step and two
/// rounds that mix the four words.
#[inline(always)]
fn independent<L: Lanes<Scalar = f32>>(keys: L::Words, samples: L::Words, pad: u32) -> [L; 4] {
    let step = |x: L::Words| x * L::Words::splat(1_664_525) + L::Words::splat(1_013_904_223);
    let round = |[x, y, z, w]: [L::Words; 4]| {
        let x = x + y * w;
        let y = y + z * x;
        let z = z + x * y;
        [x, y, z, w + y * z]
    };
    let words = [keys, samples, L::Words::splat(pad), L::Words::splat(0)];
    let words = round(words.map(step)).map(|x| x ^ (x >> 16));
    round(words).map(unit)
}

/// Maps the highest 24 bits of each word to [0, 1).
#[inline(always)]
pub fn unit<L: Lanes<Scalar = f32>>(words: L::Words) -> L {
    L::from_words(words >> 8) * L::splat(1.0 / 16_777_216.0)
}

/// Hashes words (Wellons, "hash-prospector", the constants of least bias with two
/// multiplications; a constant first, so that 0 does not give 0).
#[inline(always)]
fn hash<W: Words>(x: W) -> W {
    let x = x ^ W::splat(0xe6fe_3beb);
    let x = (x ^ (x >> 16)) * W::splat(0x7feb_352d);
    let x = (x ^ (x >> 15)) * W::splat(0x846c_a68b);
    x ^ (x >> 16)
}

/// The finaliser of Vigna's SplitMix64.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chi2::{integrals, p_value, sidak};
    use lanecast_numerics::math::lanes::{f32x4, f32x8, f32x16};

    const KINDS: [Kind; 3] = [Kind::Independent, Kind::Stratified, Kind::Sobol];

    /// Samples around everything that could go wrong.
    fn samples() -> Vec<u32> {
        let edges = [
            0xffff,
            0x1_0000,
            0x1_0001,
            0xff_ffff,
            1 << 31,
            u32::MAX - 1,
            u32::MAX,
        ];
        (0..64).chain(edges).collect()
    }

    fn agrees<L: Lanes<Scalar = f32>>() {
        for kind in KINDS {
            for spp in [1, 13, 64, 1 << 20] {
                let sampler = Sampler::new(kind, 7, 3, spp);
                let samples = samples();
                for (x, at) in samples.windows(L::COUNT).enumerate() {
                    let keys = L::Words::of_lanes(|i| sampler.key(x as u32, i as u32));
                    for pad in [0, 1, 2, 77, u32::MAX] {
                        let wide = sampler.pad::<L>(keys, L::Words::load(at), pad);
                        for i in 0..L::COUNT {
                            let one = sampler.pad_one(keys.lane(i), at[i], pad);
                            let bits = wide.map(|x| x.lane(i).to_bits());
                            assert_eq!(bits, one.map(f32::to_bits));
                            assert!(one.iter().all(|x| (0.0..1.0).contains(x)), "{one:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn every_width_has_the_bits_of_one_lane() {
        agrees::<f32x4>();
        agrees::<f32x8>();
        agrees::<f32x16>();
    }

    /// Counts pairs of numbers over a grid; if `first` and `second` draw them independently
    /// and uniformly, the counts are even.
    fn spread(name: &str, count: u32, numbers: impl Fn(u32) -> [f32; 2]) {
        let mut observed = vec![0.0; 16 * 16];
        for i in 0..count {
            let [a, b] = numbers(i).map(|x| (x * 16.0) as usize);
            observed[a * 16 + b] += 1.0;
        }
        let expected = integrals([16, 16], |_| f64::from(count));
        let p = p_value(&observed, &expected);
        assert!(p >= sidak(0.01, 60), "{name}: {p:e}");
    }

    #[test]
    fn pads_pixels_frames_and_seeds_are_independent() {
        for kind in KINDS {
            let sampler = Sampler::new(kind, 1, 0, 16);
            let next = Sampler::new(kind, 1, 1, 16);
            let other = Sampler::new(kind, 2, 0, 16);
            // One sample each of many pixels, or the pads of one sample.
            let place = |i: u32| (i % 256, i / 256);
            let at = |sampler: &Sampler, (x, y): (u32, u32), sample, pad| {
                sampler.pad_one(sampler.key(x, y), sample, pad)
            };
            let name = |what: &str| format!("{kind:?} {what}");
            for k in 0..4 {
                spread(&name("pixels"), 65_536, |i| {
                    let (x, y) = place(i);
                    [
                        at(&sampler, (x, y), 5, 0)[k],
                        at(&sampler, (x + 1, y), 5, 0)[k],
                    ]
                });
                spread(&name("pads"), 65_536, |i| {
                    let (a, b) = (at(&sampler, (3, 4), 5, i), at(&sampler, (3, 4), 5, i + 1));
                    [a[k], b[k]]
                });
                spread(&name("frames"), 65_536, |i| {
                    [
                        at(&sampler, place(i), 5, 1)[k],
                        at(&next, place(i), 5, 1)[k],
                    ]
                });
                spread(&name("seeds"), 65_536, |i| {
                    [
                        at(&sampler, place(i), 5, 1)[k],
                        at(&other, place(i), 5, 1)[k],
                    ]
                });
            }
            spread(&name("samples"), 65_536, |i| {
                [
                    at(&sampler, place(i), 5, 0)[0],
                    at(&sampler, place(i), 5, 0)[2],
                ]
            });
        }
    }

    /// Error of a smooth integrand at 64 samples, over 1024 pixels: the mean square.
    fn square_error(kind: Kind) -> f64 {
        let sampler = Sampler::new(kind, 5, 0, 64);
        let mut error = 0.0;
        for x in 0..1024 {
            let key = sampler.key(x, 0);
            let mean = (0..64)
                .map(|i| {
                    let [a, b, ..] = sampler.pad_one(key, i, 2).map(f64::from);
                    (std::f64::consts::PI * a).sin() * (1.0 + b)
                })
                .sum::<f64>()
                / 64.0;
            let exact = 2.0 / std::f64::consts::PI * 1.5;
            error += (mean - exact) * (mean - exact);
        }
        error / 1024.0
    }

    #[test]
    fn strata_lower_the_error_of_smooth_integrands() {
        let [independent, stratified, sobol] = KINDS.map(square_error);
        assert!(
            stratified < independent / 20.0,
            "{stratified:e} {independent:e}"
        );
        assert!(sobol < independent / 100.0, "{sobol:e} {independent:e}");
    }

    /// `cargo test --release -p lanecast-light -- --ignored --nocapture time_of_a_pad`
    #[test]
    #[ignore = "prints times"]
    fn time_of_a_pad() {
        for kind in KINDS {
            let sampler = Sampler::new(kind, 1, 0, 64);
            let keys = Words::of_lanes(|i| sampler.key(i as u32, 0));
            let mut sum = f32x8::splat(0.0);
            let mut best = f64::INFINITY;
            // The best of short runs, which others on the machine do not interrupt.
            let rounds = 300;
            for _ in 0..3000 {
                let start = std::time::Instant::now();
                for i in 0..rounds {
                    let samples = Words::splat(std::hint::black_box(i) & 63);
                    let [a, b, c, d] = sampler.pad::<f32x8>(keys, samples, i);
                    sum += (a + b) + (c + d);
                }
                best = best.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(rounds));
            }
            println!("{kind:?}: {best:.1} ns a pad of eight lanes ({sum:?})");
        }
    }
}
