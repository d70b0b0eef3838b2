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

/// Lanes that are met together: eight, of which some are asked about.
#[derive(Clone, Copy)]
pub(super) enum Group<'a> {
    /// From this one on, those whose bits are set.
    Side {
        first: usize,
        asked: u32,
    },
    Picked(&'a [usize]),
}

impl Chosen {
    /// As few groups as there can be. Lanes that lie side by side stay so, which takes
    /// much less time.
    #[inline(always)]
    pub fn groups<M: Mask>(&self, mask: M, count: usize) -> impl Iterator<Item = Group<'_>> {
        let bits = mask.bits();
        let sides = [bits & 0xff, bits >> 8];
        let apart = count < 8 || sides[0] != 0 && sides[1] != 0 && self.count <= 8;
        let side = move |(i, asked): (usize, u32)| {
            let first = 8 * i;
            (!apart && asked != 0).then_some(Group::Side { first, asked })
        };
        let sides = sides.into_iter().enumerate().filter_map(side);
        let picked = if apart { self.count } else { 0 };
        sides.chain(self.lanes[..picked].chunks(8).map(Group::Picked))
    }
}

impl Group<'_> {
    #[inline(always)]
    pub fn asked(&self) -> u32 {
        match self {
            Group::Side { asked, .. } => *asked,
            Group::Picked(some) => (1 << some.len()) - 1,
        }
    }

    /// Origins, directions, the first t and the last.
    #[inline(always)]
    pub fn rays<A: AsRef<[f64]>>(&self, columns: &[A; 8]) -> Rays<Eight> {
        match self {
            Group::Side { first, .. } => {
                let load = |column: usize| Eight::load(&columns[column].as_ref()[*first..]);
                Rays::of(load)
            }
            Group::Picked(some) => rays(columns, some),
        }
    }

    /// A mask's bits where they belong.
    #[inline(always)]
    pub fn spread(&self, bits: u32) -> u32 {
        match self {
            Group::Side { first, .. } => bits << first,
            Group::Picked(some) => spread(bits, some),
        }
    }

    /// Numbers of the group's lanes to where they belong.
    #[inline(always)]
    pub fn put<A: AsMut<[f64]>>(&self, column: &mut A, from: Eight) {
        match self {
            Group::Side { first, .. } => from.store(&mut column.as_mut()[*first..]),
            Group::Picked(some) => {
                for (lane, x) in some.iter().zip(from.to_array()) {
                    column.as_mut()[*lane] = x;
                }
            }
        }
    }
}

impl Rays<Eight> {
    #[inline(always)]
    fn of(load: impl Fn(usize) -> Eight) -> Rays<Eight> {
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
    Rays::of(|column| gathered(&columns[column], some))
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
