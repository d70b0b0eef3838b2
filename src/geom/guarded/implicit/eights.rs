//! Rays of any lanes, taken by eights; and degrees, taken by kernels.

use super::{Eight, Rays};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};

/// The lanes of a mask.
pub(super) struct Chosen {
    lanes: [usize; 16],
    count: usize,
}

impl Chosen {
    #[inline(always)]
    pub fn of<M: Mask>(mask: M) -> Chosen {
        let (mut lanes, mut count) = ([0; 16], 0);
        let mut bits = mask.bits();
        while bits != 0 {
            lanes[count] = bits.trailing_zeros() as usize;
            count += 1;
            bits &= bits - 1;
        }
        Chosen { lanes, count }
    }

    /// Eight at a time, the last ones fewer.
    #[inline(always)]
    pub fn eights(&self) -> impl Iterator<Item = &[usize]> {
        self.lanes[..self.count].chunks(8)
    }
}

/// A mask's bits, of some lanes brought together, where they belong.
#[inline(always)]
pub(super) fn spread(bits: u32, some: &[usize]) -> u32 {
    let place = |all, (i, lane): (usize, &usize)| all | (bits >> i & 1) << lane;
    some.iter().enumerate().fold(0, place)
}

/// Some lanes of a column, one or more; the first of them in what is left over.
#[inline(always)]
pub(super) fn gathered<A: AsRef<[f64]>>(column: &A, some: &[usize]) -> Eight {
    let from = column.as_ref();
    let mut values = [from[some[0]]; 8];
    for (value, lane) in values.iter_mut().zip(some) {
        *value = from[*lane];
    }
    Eight::load(&values)
}

/// Origins, directions, the first t and the last.
#[inline(always)]
pub(super) fn rays<A: AsRef<[f64]>>(columns: &[A; 8], some: &[usize]) -> Rays<Eight> {
    let load = |column: usize| gathered(&columns[column], some);
    Rays {
        org: Vec3::new(load(0), load(1), load(2)),
        dir: Vec3::new(load(3), load(4), load(5)),
        t_min: load(6),
        limit: load(7),
    }
}

/// `$call` with N, one of a few, above the degree; `$none` beyond the last.
macro_rules! by_degree {
    ($degree:expr, $n:ident => $call:expr, $none:expr) => {{
        macro_rules! with {
            ($count:literal) => {{
                const $n: usize = $count;
                $call
            }};
        }
        match $degree {
            0..=2 => with!(3),
            3 => with!(4),
            4 => with!(5),
            5..=6 => with!(7),
            7..=8 => with!(9),
            9..=10 => with!(11),
            11..=12 => with!(13),
            13..=16 => with!(17),
            17..=24 => with!(25),
            _ => $none,
        }
    }};
}
pub(super) use by_degree;
