//! The builder of grids. It chooses the number of cells, and two counting passes lay out their
//! lists without gaps (Lagae and Dutré, Compact, Fast and Robust Grids for Ray Tracing, 2008).
//!
//! An entry is listed in the least range of cells that covers its box: along each axis from
//! the last plane not above it to the first plane not below it. An entry on a plane is listed
//! on one side only; rays on the other side find it, because padded intervals overlap (see
//! the module above). No pad is added here.
//!
//! Memory is bounded: the numbers of cells and of references are at most a multiple of the
//! number of entries. Where entries are so large that the lists would grow further, the grid
//! is made coarser until they fit; one cell lists each entry once.

use super::{Block, Content, Grid, INNER};
use crate::accel::baselines::index::{Figures, Primitives};
use crate::math::Aabb32;

/// The density of a grid's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// λ: cells per entry (Cleary and Wyvill 1988; Ize, Shirley, Parker, Grid
    /// Creation Strategies for Efficient Ray Tracing, 2007).
    pub cells: f64,
    /// The least number of references with which a cell gets a grid of its own; `usize::MAX`
    /// if no cell does.
    pub dense: usize,
    /// λ of the inner grids.
    pub inner: f64,
}

/// Of the densities measured on the standard scenes, this needs the fewest tests for its
/// number of cells (docs/results/structures.md).
impl Default for Density {
    fn default() -> Density {
        Density {
            cells: 1.0,
            dense: 8,
            inner: 1.0,
        }
    }
}

impl Density {
    /// Returns the density of a grid of one level.
    pub fn flat(cells: f64) -> Density {
        Density {
            cells,
            dense: usize::MAX,
            ..Density::default()
        }
    }
}

/// The most references per entry, in one block.
const MOST_REFERENCES: u64 = 16;
/// The most cells along one axis.
const MOST_ALONG: f64 = 4096.0;
/// The most cells, and references, of a whole grid; they are numbered in 31 bits.
const MOST: u64 = 1 << 31;
/// The cost of a step, in primitive tests.
const STEP_COST: f64 = 0.25;

/// The lists of one block's cells.
struct Lists {
    /// By cell: where its list begins; one row more ends the last.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Grid {
    /// Builds a grid; its entries are the primitives in their own order.
    pub fn build(primitives: &Primitives, density: &Density) -> (Grid, Vec<u32>) {
        let boxes = primitives.boxes;
        let order: Vec<u32> = (0..boxes.len() as u32).collect();
        let bounds = primitives.bounds();
        let mut grid = Grid {
            bounds,
            len: boxes.len(),
            blocks: Vec::new(),
            planes: Vec::new(),
            cells: Vec::new(),
            slots: Vec::new(),
        };
        let lists = grid.block(&bounds, &order, boxes, density.cells);
        let cells = grid.blocks[0].len();
        let mut open = Vec::new();
        grid.cells.push(0);
        for cell in 0..cells {
            let list = &lists.entries[lists.starts[cell] as usize..lists.starts[cell + 1] as usize];
            let inner = if list.len() >= density.dense && cells > 1 {
                grid.inner(cell, list, boxes, density.inner)
            } else {
                None
            };
            match inner {
                Some((block, lists)) => {
                    grid.slots.push(INNER | block as u32);
                    open.push((block, lists));
                }
                None => grid.slots.extend_from_slice(list),
            }
            grid.cells.push(grid.slots.len() as u32);
        }
        // The inner grids' cells follow; each list begins where the last ended.
        for (block, lists) in open {
            grid.blocks[block].first = grid.cells.len() as u32 - 1;
            let before = grid.slots.len() as u32;
            grid.cells
                .extend(lists.starts[1..].iter().map(|s| before + s));
            grid.slots.extend_from_slice(&lists.entries);
        }
        grid.cells.shrink_to_fit();
        grid.slots.shrink_to_fit();
        (grid, order)
    }

    /// Builds a grid inside a cell; `None` if it would have one cell or too many references.
    fn inner(
        &mut self,
        cell: usize,
        list: &[u32],
        boxes: &[Aabb32],
        density: f64,
    ) -> Option<(usize, Lists)> {
        let of = self.blocks[0];
        let [x, y, _] = of.res.map(|n| n as usize);
        let at = [cell % x, cell / x % y, cell / x / y];
        let (min, max) = self.cell_box(&of, at);
        let before = (self.blocks.len(), self.planes.len());
        let lists = self.block(&Aabb32 { min, max }, list, boxes, density);
        let cells = self.blocks[before.0].len() as u64;
        let used: u64 = (self.slots.len() + self.cells.len()) as u64;
        let room = used + cells + lists.entries.len() as u64 + (boxes.len() as u64) < MOST;
        if cells == 1 || !room {
            self.blocks.truncate(before.0);
            self.planes.truncate(before.1);
            return None;
        }
        Some((before.0, lists))
    }

    /// Adds a block over a box, and returns the lists of the entries that reach into it.
    fn block(&mut self, bounds: &Aabb32, ids: &[u32], boxes: &[Aabb32], density: f64) -> Lists {
        let most = MOST_REFERENCES * ids.len() as u64 + 64;
        let mut res = resolution(bounds, ids.len(), density);
        loop {
            let before = self.planes.len();
            let block = self.cut(bounds, res);
            let ranges = |i: &u32| self.ranges(&block, &boxes[*i as usize]);
            let references: u64 = ids.iter().map(|i| count(&ranges(i))).sum();
            if references > most && block.len() > 1 {
                self.planes.truncate(before);
                res = res.map(|n| n.div_ceil(2));
                continue;
            }
            let mut starts = vec![0_u32; block.len() + 1];
            for i in ids {
                each(&block, &ranges(i), |cell| starts[cell + 1] += 1);
            }
            for cell in 1..starts.len() {
                starts[cell] += starts[cell - 1];
            }
            let mut next = starts.clone();
            let mut entries = vec![0_u32; references as usize];
            for i in ids {
                each(&block, &ranges(i), |cell| {
                    entries[next[cell] as usize] = *i;
                    next[cell] += 1;
                });
            }
            self.blocks.push(block);
            return Lists { starts, entries };
        }
    }

    /// Makes a block that has planes but no cells yet.
    fn cut(&mut self, bounds: &Aabb32, res: [u32; 3]) -> Block {
        let mut block = Block {
            res,
            planes: [0; 3],
            first: 0,
            min: bounds.min.map(f64::from),
            scale: [0.0; 3],
            wobble: [0.0; 3],
        };
        for (k, n) in res.into_iter().enumerate() {
            let (min, max) = (f64::from(bounds.min[k]), f64::from(bounds.max[k]));
            block.planes[k] = self.planes.len() as u32;
            self.planes.push(bounds.min[k]);
            let inner = |i: u32| (min + (max - min) * (f64::from(i) / f64::from(n))) as f32;
            self.planes.extend((1..n).map(inner));
            self.planes.push(bounds.max[k]);
            if n > 1 {
                block.scale[k] = f64::from(n) / (max - min);
                let off = (0..=n).map(|i| {
                    let plane = self.planes[(block.planes[k] + i) as usize];
                    ((f64::from(plane) - min) * block.scale[k] - f64::from(i)).abs()
                });
                block.wobble[k] = off.fold(0.0, f64::max) + 1e-6;
            }
        }
        block
    }

    /// Returns the least ranges of cells, ends included, that cover a box or the part of it in
    /// the block.
    fn ranges(&self, block: &Block, of: &Aabb32) -> [(usize, usize); 3] {
        std::array::from_fn(|k| {
            let planes = self.planes(block, k);
            let last = planes.len() - 2;
            let guess =
                |x: f32| (((f64::from(x) - block.min[k]) * block.scale[k]) as usize).min(last);
            let (low, high) = (of.min[k], of.max[k]);
            let mut a = guess(low);
            while a > 0 && planes[a] > low {
                a -= 1;
            }
            while a < last && planes[a + 1] <= low {
                a += 1;
            }
            let mut b = guess(high);
            while b < last && planes[b + 1] < high {
                b += 1;
            }
            while b > 0 && planes[b] >= high {
                b -= 1;
            }
            (a, b.max(a))
        })
    }

    /// Returns the grid's counts, and the expected cost by the surface areas of cells (Cleary
    /// and Wyvill 1988).
    pub(super) fn measure(&self) -> Figures {
        let whole = half_area(&self.bounds.min, &self.bounds.max);
        let mut figures = Figures {
            depth: if self.blocks.len() > 1 { 2 } else { 1 },
            ..Figures::default()
        };
        let mut cost = 0.0;
        for block in &self.blocks {
            let [x, y, z] = block.res.map(|n| n as usize);
            for cell in 0..block.len() {
                let at = [cell % x, cell / x % y, cell / x / y];
                debug_assert!(at[2] < z);
                let (min, max) = self.cell_box(block, at);
                let area = half_area(&min, &max);
                cost += area * STEP_COST;
                figures.nodes += 1;
                match self.content(block.cell(at)) {
                    Content::Nothing => figures.empty_leaves += 1,
                    Content::List(from, to) => {
                        figures.leaves += 1;
                        figures.references += to - from;
                        cost += area * (to - from) as f64;
                    }
                    Content::Block(_) => {}
                }
            }
        }
        figures.sah = if whole > 0.0 {
            cost / whole
        } else {
            self.len as f64
        };
        figures
    }
}

/// Returns half the surface area of a box.
fn half_area(min: &[f32; 3], max: &[f32; 3]) -> f64 {
    let d: [f64; 3] = std::array::from_fn(|k| f64::from(max[k]) - f64::from(min[k]));
    d[0] * d[1] + d[1] * d[2] + d[2] * d[0]
}

/// Returns the number of cells of the ranges.
fn count(ranges: &[(usize, usize); 3]) -> u64 {
    ranges.iter().map(|(a, b)| (b - a + 1) as u64).product()
}

/// Calls `then` with each cell of the ranges, counted from the block's first.
fn each(block: &Block, [x, y, z]: &[(usize, usize); 3], mut then: impl FnMut(usize)) {
    let [nx, ny, _] = block.res.map(|n| n as usize);
    for k in z.0..=z.1 {
        for j in y.0..=y.1 {
            let row = nx * (j + ny * k);
            for i in x.0..=x.1 {
                then(row + i);
            }
        }
    }
}

/// Returns the number of cells along each axis: about `density`·`entries` cells, as near to
/// cubes as their number allows. An axis too short for two cells has one, and the others
/// share the rest.
fn resolution(bounds: &Aabb32, entries: usize, density: f64) -> [u32; 3] {
    let extent: [f64; 3] =
        std::array::from_fn(|k| f64::from(bounds.max[k]) - f64::from(bounds.min[k]));
    if entries < 2 || !extent.iter().all(|d| d.is_finite() && *d >= 0.0) {
        return [1; 3];
    }
    let cells = (density * entries as f64).clamp(1.0, MOST as f64 / 8.0);
    let mut long = extent.map(|d| d > 0.0);
    loop {
        let axes = || (0..3).filter(|k| long[*k]);
        let n = axes().count();
        if n == 0 {
            return [1; 3];
        }
        // Logarithms are used, because the product of extents may overflow.
        let logs: f64 = axes().map(|k| libm::log(extent[k])).sum();
        let side = libm::exp((logs - libm::log(cells)) / n as f64);
        let short = axes().find(|k| extent[*k] < side);
        match short {
            Some(k) if n > 1 => long[k] = false,
            _ => {
                return std::array::from_fn(|k| {
                    if long[k] {
                        libm::round(extent[k] / side).clamp(1.0, MOST_ALONG) as u32
                    } else {
                        1
                    }
                });
            }
        }
    }
}
