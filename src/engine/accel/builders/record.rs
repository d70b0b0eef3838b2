//! Rows of 32 bytes, one per primitive, which the builder moves about; and boxes in the same
//! layout.
//!
//! A row is `[−min x, y, z, id, max x, y, z, 0]`. With lower bounds negated the union of two
//! boxes is one maximum over eight lanes, and the middle of a box is a difference of its
//! halves. Rows lie at multiples of their size, so that none crosses a cache line, and every
//! pass of the builder streams over them.

use crate::math::Aabb32;
use crate::math::lanes::{Lanes, f32x8};

/// A primitive's box and id.
pub(super) type Row = [f32; 8];

/// A bit that is set in each id, so that its bits are those of a normal number.
const TAG: u32 = 0x4000_0000;

#[inline(always)]
pub(super) fn row(bounds: &Aabb32, id: u32) -> Row {
    let (a, b) = (&bounds.min, &bounds.max);
    let id = f32::from_bits(id | TAG);
    [-a[0], -a[1], -a[2], id, b[0], b[1], b[2], 0.0]
}

#[inline(always)]
pub(super) fn id(row: &Row) -> u32 {
    row[3].to_bits() & !TAG
}

/// An array of rows, zero at first, that begins at a multiple of a row's size.
pub(super) struct Rows {
    room: Vec<f32>,
    first: usize,
    count: usize,
}

impl Rows {
    pub(super) fn new(count: usize) -> Rows {
        let room = vec![0.0; count * 8 + 7];
        // If the alignment is unknown, the rows are only slower.
        let first = room.as_ptr().align_offset(size_of::<Row>());
        Rows {
            first: if first < 8 { first } else { 0 },
            room,
            count,
        }
    }

    pub(super) fn rows(&mut self) -> &mut [Row] {
        let room = &mut self.room[self.first..self.first + self.count * 8];
        room.as_chunks_mut().0
    }
}

/// A box as `[−min, _, max, _]`; the fourth and the eighth lane mean nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound(pub f32x8);

impl Bound {
    #[inline(always)]
    pub(super) fn empty() -> Bound {
        Bound(Lanes::splat(f32::NEG_INFINITY))
    }

    #[inline(always)]
    pub(super) fn load(row: &Row) -> Bound {
        Bound(Lanes::load(row))
    }

    pub(super) fn around(bounds: &Aabb32) -> Bound {
        Bound::load(&row(bounds, 0))
    }

    /// Returns twice the middle of a row's box, as a box of one point.
    #[inline(always)]
    pub(super) fn middle(row: &Row) -> Bound {
        let [a, b, c, d, e, f, g, h] = *row;
        let swapped: f32x8 = Lanes::load(&[e, f, g, h, a, b, c, d]);
        let own: f32x8 = Lanes::load(row);
        Bound(own - swapped)
    }

    /// Returns the box around both; a NaN in `self` is ignored.
    #[inline(always)]
    pub(super) fn union(self, other: Bound) -> Bound {
        Bound(Lanes::max(self.0, other.0))
    }

    #[inline(always)]
    pub(super) fn extent(self) -> [f32; 3] {
        let b = Lanes::to_array(self.0);
        [b[0] + b[4], b[1] + b[5], b[2] + b[6]]
    }

    #[inline(always)]
    pub(super) fn store(self) -> Row {
        Lanes::to_array(self.0)
    }

    pub(super) fn aabb(self) -> Aabb32 {
        let b = Lanes::to_array(self.0);
        Aabb32 {
            min: [-b[0], -b[1], -b[2]],
            max: [b[4], b[5], b[6]],
        }
    }
}

/// The extents of a range of rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extents {
    /// The box around all boxes.
    pub bounds: Bound,
    /// The box around the doubled middles of all boxes.
    pub middles: Bound,
}

impl Extents {
    #[inline(always)]
    pub(super) fn empty() -> Extents {
        Extents {
            bounds: Bound::empty(),
            middles: Bound::empty(),
        }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, row: &Row) {
        self.bounds = Bound::load(row).union(self.bounds);
        self.middles = Bound::middle(row).union(self.middles);
    }

    pub(super) fn measure(rows: &[Row]) -> Extents {
        let mut extents = Extents::empty();
        rows.iter().for_each(|row| extents.add(row));
        extents
    }

    pub(super) fn union(&self, other: &Extents) -> Extents {
        Extents {
            bounds: self.bounds.union(other.bounds),
            middles: self.middles.union(other.middles),
        }
    }
}
