//! Random numbers of the reference: the same as the path integrator's, made from the crate
//! `sobol_burley` and the documented map from (seed, frame, pixel, pad) to its seeds.

/// The distance of the seeds of consecutive pads.
const PAD_STEP: u32 = 0x9e37_79b9;

/// The random numbers of a picture (Burley 2020, four dimensions a pad).
#[derive(Clone, Copy, Debug)]
pub struct Sobol {
    frame: u64,
}

impl Sobol {
    pub fn new(seed: u64, frame: u32) -> Sobol {
        Sobol {
            frame: split_mix(seed ^ split_mix(u64::from(frame))),
        }
    }

    /// Returns the four numbers of a pad of a pixel's sample, each in [0, 1). `sample` is
    /// below 2^16.
    pub fn pad(&self, [x, y]: [u32; 2], sample: u32, pad: u32) -> [f64; 4] {
        let place = u64::from(x) | u64::from(y) << 32;
        let key = (split_mix(self.frame ^ split_mix(place)) >> 32) as u32;
        let seed = key.wrapping_add(pad.wrapping_mul(PAD_STEP));
        sobol_burley::sample_4d(sample, 0, seed).map(f64::from)
    }
}

/// Returns the output of SplitMix64 for a state (Vigna).
fn split_mix(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
