//! Uniform grids: space cut into equal cells, each with a list of the entries
//! whose boxes reach into it (Fujimoto, Tanaka, Iwata 1986; Cleary and Wyvill
//! 1988). A cell with many entries holds a grid of its own (Jevans and Wyvill
//! 1989; two levels: Kalojanov, Billeter, Slusallek 2011).
//!
//! Coherent packets march through it slice by slice ([`slices`]), others lane by
//! lane with a digital differential analyser ([`march`]). An entry is met once
//! per packet, however many cells name it ([`Mailbox`]).
//!
//! Invariant, by which a grid gives the bits of a linear scan: a cell is a box,
//! and its planes are numbers of a table, so [`Slabs`] gives a lane an interval
//! of t for it, padded as for any box. A walk visits every cell whose interval
//! meets t_min..=limit. That suffices: let t be in the interval of an entry's
//! box. Along one axis the cells that name the entry cover its box, and padded
//! intervals of neighbours overlap (one plane less the pad is the entry of one,
//! the same plane plus the pad is the exit of the other), so by monotonicity
//! some of those cells has t in its interval; the entry is named by every
//! CSG solid of them along the three axes, so by the cell that has t on all
//! three. The same holds inside a cell for its own grid. No t is ever added up
//! step by step: each is computed anew from its plane.
//!
//! The tests below hold the cells visited against all cells, suite.rs walks
//! against the linear scan, tests/structures/accel.rs pictures.

mod build;
mod march;
mod slices;
#[cfg(test)]
mod tests;

pub use build::Density;

use crate::accel::baselines::count::Count;
use crate::accel::baselines::index::{Figures, Index, Leaf};
use crate::accel::baselines::mailbox::Mailbox;
use crate::accel::slabs::Slabs;
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask};

/// A grid over entries `0..len`, in the order that the builder gave them.
#[derive(Clone, Debug)]
pub struct Grid {
    pub bounds: Aabb32,
    pub len: usize,
    /// The whole first, then the grids of dense cells.
    blocks: Vec<Block>,
    /// Ascending coordinates between cells, of every block and axis.
    planes: Vec<f32>,
    /// Where each cell's list starts in `slots`; it ends where the next starts.
    cells: Vec<u32>,
    /// Entries; or, alone in its cell, [`INNER`] and a block.
    slots: Vec<u32>,
}

/// Marks a block among slots.
const INNER: u32 = 1 << 31;

/// A box cut into cells, x fastest.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Cells along each axis.
    res: [u32; 3],
    /// Where its planes start, one more than cells on each axis.
    planes: [u32; 3],
    /// Placement of its first cell.
    first: u32,
    /// Lower corner.
    min: [f64; 3],
    /// Cells per unit of length; 0 where there is only one.
    scale: [f64; 3],
    /// By how many cells a plane may lie off its place i/scale, rounded up.
    wobble: [f64; 3],
}

impl Block {
    #[inline(always)]
    fn cell(&self, at: [usize; 3]) -> usize {
        let [x, y, _] = self.res.map(|n| n as usize);
        self.first as usize + at[0] + x * (at[1] + y * at[2])
    }

    fn len(&self) -> usize {
        self.res.iter().map(|n| *n as usize).product()
    }
}

impl Grid {
    /// The planes of a block along an axis.
    #[inline(always)]
    fn planes(&self, block: &Block, axis: usize) -> &[f32] {
        &self.planes[block.planes[axis] as usize..][..block.res[axis] as usize + 1]
    }

    #[inline(always)]
    fn cell_box(&self, block: &Block, at: [usize; 3]) -> ([f32; 3], [f32; 3]) {
        let plane = |k: usize, up: usize| self.planes[block.planes[k] as usize + at[k] + up];
        (
            std::array::from_fn(|k| plane(k, 0)),
            std::array::from_fn(|k| plane(k, 1)),
        )
    }

    /// What a cell names.
    #[inline(always)]
    fn content(&self, cell: usize) -> Content {
        let (start, end) = (self.cells[cell] as usize, self.cells[cell + 1] as usize);
        if start == end {
            return Content::Nothing;
        }
        let first = self.slots[start];
        if first & INNER != 0 {
            Content::Block((first & !INNER) as usize)
        } else {
            Content::List(start, end)
        }
    }

    /// Cells along the axes of the whole.
    pub fn resolution(&self) -> [u32; 3] {
        self.blocks[0].res
    }

    /// Dense cells with a grid of their own.
    pub fn inner_grids(&self) -> usize {
        self.blocks.len() - 1
    }
}

enum Content {
    Nothing,
    /// From, to in `slots`.
    List(usize, usize),
    Block(usize),
}

/// One packet on its way.
///
/// Whenever an entry is met, it is met by all lanes that have cells left, in
/// their way through this cell or not: so once is enough, and it costs nothing,
/// since the lanes compute anyway. A lane that does not reach the entry's box
/// has no hit there, as ever.
struct Walk<'w, 'l, L: Lanes> {
    grid: &'w Grid,
    slabs: &'w Slabs<L>,
    /// Into the bounds, and not before t_min.
    enter: L,
    limit: L,
    /// Lanes that have cells left.
    waiting: L::Mask,
    mailbox: &'w mut Mailbox,
    counter: Count<'w>,
    leaf: &'w mut Leaf<'l, L>,
}

impl<L: Lanes> Walk<'_, '_, L> {
    /// Tests what a cell names for all lanes that have cells left.
    #[inline(always)]
    fn list(&mut self, from: usize, to: usize) {
        for place in from..to {
            let slot = self.grid.slots[place] as usize;
            if !self.mailbox.first(slot) {
                self.counter.spared(1);
                continue;
            }
            let active = self.waiting & self.enter.le(self.limit);
            self.limit = (self.leaf)(slot, 1, active, self.limit);
        }
    }

    /// All lanes through one block; `enter..=exit` is their way inside.
    fn block(&mut self, block: usize, enter: L, exit: L) {
        let inside = enter.le(exit.min(self.limit));
        if L::COUNT > 1
            && let Some(bundle) = self.bundle(block, inside, enter, exit)
        {
            return self.slices(block, &bundle, enter, exit);
        }
        let mut bits = inside.bits();
        let outermost = block == 0;
        while bits != 0 {
            if outermost {
                self.waiting = L::Mask::from_bits(bits);
            }
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let of = |x: L| x.lane(lane);
            let axes = self.slabs.planes().map(|(a, b, c)| (of(a), of(b), of(c)));
            self.march(block, lane, &axes, of(enter), of(exit));
        }
    }
}

impl Index for Grid {
    type Scratch<L: Lanes> = Mailbox;

    fn bounds(&self) -> Aabb32 {
        self.bounds
    }

    fn bytes(&self) -> usize {
        self.blocks.len() * size_of::<Block>()
            + (self.planes.len() + self.cells.len() + self.slots.len()) * 4
    }

    fn figures(&self) -> Figures {
        self.measure()
    }

    /// Entries keep their places: cells name them one by one. Only the lists
    /// are brought into order.
    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        for cell in 0..self.cells.len() - 1 {
            if let Content::List(from, to) = self.content(cell) {
                self.slots[from..to].sort_by_key(|slot| key(order[*slot as usize]));
            }
        }
    }

    #[inline(never)]
    fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        mailbox: &mut Mailbox,
        counter: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        if self.blocks[0].len() == 1 && self.blocks.len() == 1 {
            let active = t_min.le(limit);
            counter.leaf(active);
            return leaf(0, self.len, active, limit);
        }
        let (enter, exit) = slabs.interval(self.bounds.min, self.bounds.max);
        let enter = enter.max(t_min);
        let inside = enter.le(exit.min(limit));
        if inside.none() {
            return limit;
        }
        mailbox.begin(self.len);
        let mut walk = Walk {
            grid: self,
            slabs,
            enter: L::select(
                inside,
                enter,
                L::splat(crate::math::lanes::Scalar::INFINITY),
            ),
            limit,
            waiting: inside,
            mailbox,
            counter,
            leaf,
        };
        walk.block(0, walk.enter, exit);
        walk.limit
    }
}
