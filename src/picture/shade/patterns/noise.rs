//! Gradient noise (Perlin 1985, with the quintic of his "Improving Noise" of 2002): each point of
//! the lattice of whole numbers has a gradient of its own, and the planes of the eight around
//! are blended.

use crate::math::Vec3;
use crate::math::lanes::{Lanes, Words};

/// Returns noise at points: 0 at whole numbers, hardly ever beyond ±½, of mean 0.
///
/// Lattice points are numbered modulo 2³²; beyond 2⁵² cells from the origin there is no noise.
#[inline(always)]
pub fn noise<D: Lanes<Scalar = f64>>(p: Vec3<D>, seed: u32) -> D {
    let one = D::splat(1.0);
    let low = [p.x, p.y, p.z].map(floor);
    let part = [p.x - low[0], p.y - low[1], p.z - low[2]];
    let cell = low.map(|low| {
        let low = low.to_array();
        D::Words::of_lanes(|i| low.as_ref()[i] as i64 as u32)
    });
    // Each axis has its number of the two lattice points, their distances and their weights.
    let ends = [0, 1, 2].map(|k| {
        let far = quintic(part[k]);
        let next = cell[k] + D::Words::splat(1);
        [(cell[k], part[k], one - far), (next, part[k] - one, far)]
    });
    let mut sum = D::zero();
    for (z, dz, wz) in ends[2] {
        for (y, dy, wy) in ends[1] {
            for (x, dx, wx) in ends[0] {
                let [gx, gy, gz] = gradient::<D>([x, y, z], seed);
                sum = sum + (gx * dx + gy * dy + gz * dz) * (wx * wy * wz);
            }
        }
    }
    sum
}

/// Returns the greatest whole number not above each lane.
#[inline(always)]
fn floor<D: Lanes<Scalar = f64>>(x: D) -> D {
    let mut lanes = x.to_array();
    lanes.as_mut().iter_mut().for_each(|x| *x = x.floor());
    D::load(lanes.as_ref())
}

/// Goes from 0 to 1 with no slope and no curvature at both ends.
#[inline(always)]
fn quintic<D: Lanes<Scalar = f64>>(t: D) -> D {
    let [six, fifteen, ten] = [6.0, 15.0, 10.0].map(D::splat);
    t * t * t * (t * (t * six - fifteen) + ten)
}

/// Returns the gradient of a lattice point, each part of it evenly from −1 to 1.
#[inline(always)]
fn gradient<D: Lanes<Scalar = f64>>([x, y, z]: [D::Words; 3], seed: u32) -> [D; 3] {
    let word = |x: u32| D::Words::splat(x);
    let mixed = |mut h: D::Words| {
        // The finisher of MurmurHash3 (Appleby), which lets each bit change all others.
        h = (h ^ (h >> 16)) * word(0x85eb_ca6b);
        h = (h ^ (h >> 13)) * word(0xc2b2_ae35);
        h ^ (h >> 16)
    };
    let hash = mixed(x + word(seed));
    let hash = mixed(hash + y);
    let hash = mixed(hash + z);
    [0, 10, 20].map(|shift| {
        let bits = (hash >> shift) & word(1023);
        D::from_words(bits) * D::splat(2.0 / 1023.0) - D::splat(1.0)
    })
}
