//! Regroups the active lanes of any width into registers of eight or four f64 lanes, and selects
//! kernels by degree.

use super::Rays;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};

/// The numbers of the lanes in a mask.
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

    /// Returns the lanes `count` at a time; the last chunk may be shorter.
    #[inline(always)]
    pub fn chunks(&self, count: usize) -> impl Iterator<Item = &[usize]> {
        self.lanes[..self.count].chunks(count)
    }
}

/// Lanes that share a register, some of them active.
#[derive(Clone, Copy)]
pub(super) enum LaneGroup<'a> {
    /// Adjacent lanes from `first` on; the bits of `asked` say which are active.
    Adjacent {
        first: usize,
        asked: u32,
    },
    Gathered(&'a [usize]),
}

impl ActiveLanes {
    /// Returns the least number of groups of D's lanes. Adjacent lanes stay adjacent, because
    /// loads are much faster than gathers.
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

    /// Loads the rays: origins, directions, the first t and the last.
    #[inline(always)]
    pub fn rays<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(&self, columns: &[A; 8]) -> Rays<D> {
        match self {
            LaneGroup::Adjacent { first, .. } => {
                Rays::load(|column| D::load(&columns[column].as_ref()[*first..]))
            }
            LaneGroup::Gathered(some) => rays(columns, some),
        }
    }

    /// Moves the bits of the group's mask to their lanes.
    #[inline(always)]
    pub fn scatter_bits(&self, bits: u32) -> u32 {
        match self {
            LaneGroup::Adjacent { first, .. } => bits << first,
            LaneGroup::Gathered(some) => scatter_bits(bits, some),
        }
    }

    /// Stores numbers of the group in their lanes.
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
    fn load(load: impl Fn(usize) -> D) -> Rays<D> {
        Rays {
            org: Vec3::new(load(0), load(1), load(2)),
            dir: Vec3::new(load(3), load(4), load(5)),
            t_min: load(6),
            limit: load(7),
        }
    }
}

/// Moves the bits of gathered lanes back to their lanes.
#[inline(always)]
pub(super) fn scatter_bits(bits: u32, some: &[usize]) -> u32 {
    let place = |all, (i, lane): (usize, &usize)| all | (bits >> i & 1) << lane;
    some.iter().enumerate().fold(0, place)
}

/// Gathers one or more lanes of a column; the remaining lanes repeat the first of them.
#[inline(always)]
pub(super) fn gather<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(column: &A, some: &[usize]) -> D {
    let from = column.as_ref();
    let mut values = D::splat(from[some[0]]).to_array();
    for (value, lane) in values.as_mut().iter_mut().zip(some) {
        *value = from[*lane];
    }
    D::load(values.as_ref())
}

/// Loads the rays: origins, directions, the first t and the last.
#[inline(always)]
pub(super) fn rays<D: Lanes<Scalar = f64>, A: AsRef<[f64]>>(
    columns: &[A; 8],
    some: &[usize],
) -> Rays<D> {
    Rays::load(|column| gather(&columns[column], some))
}

/// Evaluates `$call` with a constant N of a few, the least above the degree; `$none` beyond the
/// last.
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
