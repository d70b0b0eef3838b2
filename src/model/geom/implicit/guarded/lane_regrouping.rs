//! Rays of any lanes, taken by eights or fours; and degrees, taken by kernels.

use super::Rays;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};

/// The lanes of a mask.
pub(super) struct ActiveLanes {
    lanes: [usize; 16],
    count: usize,
}

impl ActiveLanes {
    #[inline(always)]
    pub fn new<M: Mask>(mask: M) -> ActiveLanes {
        let (mut lanes, mut count) = ([0; 16], 0);
        let mut bits = mask.bits();
        while bits != 0 {
            lanes[count] = bits.trailing_zeros() as usize;
            count += 1;
            bits &= bits - 1;
        }
        ActiveLanes { lanes, count }
    }

    /// So many at a time, the last ones fewer.
    #[inline(always)]
    pub fn chunks(&self, count: usize) -> impl Iterator<Item = &[usize]> {
        self.lanes[..self.count].chunks(count)
    }
}

/// Lanes that are met together, of which some are asked about.
#[derive(Clone, Copy)]
pub(super) enum LaneGroup<'a> {
    /// From this one on, those whose bits are set.
    Adjacent {
        first: usize,
        asked: u32,
    },
    Gathered(&'a [usize]),
}

impl ActiveLanes {
    /// As few groups of D's lanes as there can be. Lanes that lie side by side stay so,
    /// which takes much less time.
    #[inline(always)]
    pub fn groups<L: Lanes, D: Lanes>(&self, mask: L::Mask) -> impl Iterator<Item = LaneGroup<'_>> {
        let bits = mask.bits();
        let sides = [bits & ((1 << D::COUNT) - 1), bits >> D::COUNT];
        let few = sides[0] != 0 && sides[1] != 0 && self.count <= D::COUNT;
        let apart = L::COUNT < D::COUNT || few;
        let side = move |(i, asked): (usize, u32)| {
            let first = D::COUNT * i;
            (!apart && asked != 0).then_some(LaneGroup::Adjacent { first, asked })
        };
        let sides = sides.into_iter().enumerate().filter_map(side);
        let picked = if apart { self.count } else { 0 };
        sides.chain(
            self.lanes[..picked]
                .chunks(D::COUNT)
                .map(LaneGroup::Gathered),
        )
    }
}

impl LaneGroup<'_> {
    #[inline(always)]
    pub fn asked(&self) -> u32 {
        match self {
            LaneGroup::Adjacent { asked, .. } => *asked,
            LaneGroup::Gathered(some) => (1 << some.len()) - 1,
        }
    }

    /// Origins, directions, the first t and the last.
    #[inline(always)]
    pub fn rays<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(&self, columns: &[A; 8]) -> Rays<D> {
        match self {
            LaneGroup::Adjacent { first, .. } => {
                Rays::of(|column| D::load(&columns[column].as_ref()[*first..]))
            }
            LaneGroup::Gathered(some) => rays(columns, some),
        }
    }

    /// A mask's bits where they belong.
    #[inline(always)]
    pub fn scatter_bits(&self, bits: u32) -> u32 {
        match self {
            LaneGroup::Adjacent { first, .. } => bits << first,
            LaneGroup::Gathered(some) => scatter_bits(bits, some),
        }
    }

    /// Numbers of the group's lanes to where they belong.
    #[inline(always)]
    pub fn scatter<D: Lanes<Scalar = f64>, A: AsMut<[f64]>>(&self, column: &mut A, from: D) {
        match self {
            LaneGroup::Adjacent { first, .. } => from.store(&mut column.as_mut()[*first..]),
            LaneGroup::Gathered(some) => {
                for (lane, x) in some.iter().zip(from.to_array().as_ref()) {
                    column.as_mut()[*lane] = *x;
                }
            }
        }
    }
}

impl<D: Lanes> Rays<D> {
    #[inline(always)]
    fn of(load: impl Fn(usize) -> D) -> Rays<D> {
        Rays {
            org: Vec3::new(load(0), load(1), load(2)),
            dir: Vec3::new(load(3), load(4), load(5)),
            t_min: load(6),
            limit: load(7),
        }
    }
}

/// A mask's bits, of some lanes brought together, where they belong.
#[inline(always)]
pub(super) fn scatter_bits(bits: u32, some: &[usize]) -> u32 {
    let place = |all, (i, lane): (usize, &usize)| all | (bits >> i & 1) << lane;
    some.iter().enumerate().fold(0, place)
}

/// Some lanes of a column, one or more; the first of them in what is left over.
#[inline(always)]
pub(super) fn gather<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(column: &A, some: &[usize]) -> D {
    let from = column.as_ref();
    let mut values = D::splat(from[some[0]]).to_array();
    for (value, lane) in values.as_mut().iter_mut().zip(some) {
        *value = from[*lane];
    }
    D::load(values.as_ref())
}

/// Origins, directions, the first t and the last.
#[inline(always)]
pub(super) fn rays<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(
    columns: &[A; 8],
    some: &[usize],
) -> Rays<D> {
    Rays::of(|column| gather(&columns[column], some))
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
