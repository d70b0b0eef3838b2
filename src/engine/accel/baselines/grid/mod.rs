//! Uniform grids: space is divided into equal cells, each with a list of the entries whose
//! boxes reach into it (Fujimoto, Tanaka, Iwata 1986; Cleary and Wyvill 1988). A cell with
//! many entries has a grid of its own (Jevans and Wyvill 1989; two levels: Kalojanov,
//! Billeter, Slusallek 2011).
//!
//! Coherent packets pass through it slice by slice ([`slices`]), others lane by lane with a
//! digital differential analyser ([`march`]). An entry is tested once per packet, however
//! many cells list it ([`Mailbox`]).
//!
//! Invariant: a traversal visits every cell whose padded interval, as [`Slabs`] gives it,
//! meets t_min..=limit. By docs/numerics/boxes.md, X14, a grid then gives the bits of a
//! linear scan: the planes of cells are numbers of a table, padded intervals of neighbours
//! overlap, and the combination of cells along the three axes that contains t lists the
//! entry. The same holds for the grid inside a cell. No t is ever added up step by step; each
//! is computed anew from its plane.
//!
//! tests.rs compares the cells visited with all cells, index_tests.rs compares traversals
//! with the linear scan, and tests/structures/accel.rs compares pictures.

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

/// A grid over entries `0..len`, in the builder's order.
#[derive(Clone, Debug)]
pub struct Grid {
    pub bounds: Aabb32,
    pub len: usize,
    /// The outer grid first, then the grids of dense cells.
    blocks: Vec<Block>,
    /// The ascending coordinates of the planes between cells, for every block and axis.
    planes: Vec<f32>,
    /// Where each cell's list starts in `slots`; it ends where the next starts.
    cells: Vec<u32>,
    /// The entries of cells; or [`INNER`] with a block, alone in its cell.
    slots: Vec<u32>,
}

/// The mark of a block among slots.
const INNER: u32 = 1 << 31;

/// A box cut into cells, x fastest.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// The number of cells along each axis.
    res: [u32; 3],
    /// By axis: the row of its first plane; there is one plane more than cells.
    planes: [u32; 3],
    /// The row of its first cell.
    first: u32,
    /// The lower corner.
    min: [f64; 3],
    /// The cells per unit of length; 0 if there is only one.
    scale: [f64; 3],
    /// How far a plane may lie off its place i/scale, in cells, rounded up.
    wobble: [f64; 3],
}

impl Block {
    /// Returns the row of a cell.
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
    /// Returns the planes of a block along an axis.
    #[inline(always)]
    fn planes(&self, block: &Block, axis: usize) -> &[f32] {
        &self.planes[block.planes[axis] as usize..][..block.res[axis] as usize + 1]
    }

    /// Returns the box of a cell as (min, max).
    #[inline(always)]
    fn cell_box(&self, block: &Block, at: [usize; 3]) -> ([f32; 3], [f32; 3]) {
        let plane = |k: usize, up: usize| self.planes[block.planes[k] as usize + at[k] + up];
        (
            std::array::from_fn(|k| plane(k, 0)),
            std::array::from_fn(|k| plane(k, 1)),
        )
    }

    /// Returns the content of a cell.
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

    /// Returns the number of cells of the outer grid along each axis.
    pub fn resolution(&self) -> [u32; 3] {
        self.blocks[0].res
    }

    /// Returns the number of dense cells that have a grid of their own.
    pub fn inner_grids(&self) -> usize {
        self.blocks.len() - 1
    }
}

/// The content of a cell.
enum Content {
    Nothing,
    /// The range of its entries in `slots`.
    List(usize, usize),
    Block(usize),
}

/// The traversal of one packet.
///
/// An entry is tested for all lanes that have cells left, whether they pass through this cell
/// or not, so that one test per packet is enough. It costs nothing, because all lanes compute
/// anyway. A lane that misses the entry's box has no hit there.
struct Walk<'w, 'l, L: Lanes> {
    grid: &'w Grid,
    slabs: &'w Slabs<L>,
    /// The t at which the lanes enter the bounds, at least t_min.
    enter: L,
    limit: L,
    /// The lanes that have cells left.
    waiting: L::Mask,
    mailbox: &'w mut Mailbox,
    counter: Count<'w>,
    leaf: &'w mut Leaf<'l, L>,
}

impl<L: Lanes> Walk<'_, '_, L> {
    /// Tests the entries of a cell for all lanes that have cells left.
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

    /// Walks all lanes through one block; `enter..=exit` are their intervals inside it.
    fn block(&mut self, block: usize, enter: L, exit: L) {
        let inside = enter.le(exit.min(self.limit));
        if const { L::COUNT > 1 }
            && let Some(volume) = self.volume(block, inside, enter, exit)
        {
            return self.slices(block, &volume, enter, exit);
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

    /// Sorts the lists of cells; entries keep their order, because cells list them one by one.
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
