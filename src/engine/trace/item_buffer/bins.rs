//! Binning of rectangles to the tiles that they overlap, by a grid of cells.

use super::Item;
use super::raster::Rect;

/// An item listed at a tile.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    tile: u32,
    entry: u32,
    block: u32,
    near: f32,
}

/// A tile in a cell's list.
#[derive(Clone, Copy)]
struct Here {
    rect: Rect,
    tile: u32,
    /// First cell of the tile along u and v.
    from: [u16; 2],
}

/// A grid of cells, each with the tiles that overlap it.
pub struct Cells {
    /// Smallest rectangle around all tiles.
    pub extent: Rect,
    low: [f32; 2],
    /// Cells per unit of u and v.
    per: [f32; 2],
    /// Number of cells along u and v.
    across: [usize; 2],
    /// By cell, start of its tiles; and the end of the last ones.
    first: Vec<u32>,
    tiles: Vec<Here>,
}

/// Largest ratio of the tiles' total area to that of the picture; tiles of incoherent rays
/// exceed it.
const MOST_COVER: f64 = 16.0;

impl Cells {
    /// Builds cells as large as the average tile. `None` if there is no tile, or tiles overlap
    /// too much.
    pub fn build(rects: &[Rect]) -> Option<Cells> {
        let real = || rects.iter().filter(|rect| !rect.is_empty());
        let extent = real().fold(Rect::EMPTY, |all, rect| all.around(rect));
        if extent.is_empty() {
            return None;
        }
        let size = |[low, high]: [f32; 2]| f64::from(high) - f64::from(low);
        let all = [size(extent.u), size(extent.v)];
        let (mut sums, mut area, mut count) = ([0.0; 2], 0.0, 0);
        for rect in real() {
            let sides = [size(rect.u), size(rect.v)];
            sums = [sums[0] + sides[0], sums[1] + sides[1]];
            area += sides[0] * sides[1];
            count += 1;
        }
        if area > MOST_COVER * all[0] * all[1] {
            return None;
        }
        // Limits the number of cells to a few per tile.
        let most = (4.0 * f64::from(count)).sqrt() + 1.0;
        let across = [0, 1].map(|i| {
            let cells = all[i] * f64::from(count) / sums[i];
            cells.clamp(1.0, most.clamp(64.0, 4096.0)) as usize
        });
        let mut cells = Cells {
            extent,
            low: [extent.u[0], extent.v[0]],
            per: [0, 1].map(|i| (across[i] as f64 / all[i]) as f32),
            across,
            first: vec![0; across[0] * across[1] + 1],
            tiles: Vec::new(),
        };
        cells.fill(rects);
        Some(cells)
    }

    /// Sorts tiles into cells, by counting sort.
    fn fill(&mut self, rects: &[Rect]) {
        let real = || (0_u32..).zip(rects).filter(|(_, rect)| !rect.is_empty());
        let mut ends = std::mem::take(&mut self.first);
        for (_, rect) in real() {
            self.each(rect, |cell, _| ends[cell + 1] += 1);
        }
        for cell in 1..ends.len() {
            ends[cell] += ends[cell - 1];
        }
        let nowhere = Here {
            rect: Rect::EMPTY,
            tile: 0,
            from: [0; 2],
        };
        let mut tiles = vec![nowhere; ends[ends.len() - 1] as usize];
        let mut next = ends.clone();
        for (tile, rect) in real() {
            let [[x, _], [y, _]] = self.range(rect);
            let from = [x as u16, y as u16];
            self.each(rect, |cell, _| {
                let rect = *rect;
                tiles[next[cell] as usize] = Here { rect, tile, from };
                next[cell] += 1;
            });
        }
        (self.first, self.tiles) = (ends, tiles);
    }

    /// Returns the first and last cell along u and v. They are monotone in the rectangle, so
    /// rectangles that overlap share a cell.
    #[inline(always)]
    fn range(&self, rect: &Rect) -> [[usize; 2]; 2] {
        let cell = |x: f32, i: usize| {
            let at = (x - self.low[i]) * self.per[i];
            // The cast saturates; negative numbers and NaN become 0.
            (at as usize).min(self.across[i] - 1)
        };
        [
            [cell(rect.u[0], 0), cell(rect.u[1], 0)],
            [cell(rect.v[0], 1), cell(rect.v[1], 1)],
        ]
    }

    /// Calls `visit` for each cell of a rectangle.
    #[inline(always)]
    fn each(&self, rect: &Rect, mut visit: impl FnMut(usize, [usize; 2])) {
        let [[x0, x1], [y0, y1]] = self.range(rect);
        for y in y0..=y1 {
            for x in x0..=x1 {
                visit(y * self.across[0] + x, [x, y]);
            }
        }
    }

    /// Lists an item once at every tile that its rectangle overlaps.
    #[inline(always)]
    pub fn list(&self, rect: &Rect, entry: u32, block: u32, near: f32, pairs: &mut Vec<Pair>) {
        let [[x0, _], [y0, _]] = self.range(rect);
        self.each(rect, |cell, [x, y]| {
            let range = self.first[cell] as usize..self.first[cell + 1] as usize;
            for here in &self.tiles[range] {
                // Only in the first cell that both share.
                let [from_x, from_y] = here.from.map(usize::from);
                let once = (x == x0.max(from_x)) & (y == y0.max(from_y));
                if once & here.rect.meets(rect) {
                    pairs.push(Pair {
                        tile: here.tile,
                        entry,
                        block,
                        near,
                    });
                }
            }
        });
    }
}

/// Sorts items by tile: returns the start of each tile's items, and the items in the order of
/// the lists, those of one entry by nearest depth.
pub fn by_tile(lists: &[Vec<Pair>], tiles: usize) -> (Vec<u32>, Vec<Item>) {
    let pairs = || lists.iter().flatten();
    let mut first = vec![0_u32; tiles + 1];
    for pair in pairs() {
        first[pair.tile as usize + 1] += 1;
    }
    for tile in 1..first.len() {
        first[tile] += first[tile - 1];
    }
    let nothing = Item { entry: 0, block: 0 };
    let mut items = vec![(nothing, 0.0_f32); first[tiles] as usize];
    let mut next = first.clone();
    for pair in pairs() {
        let to = &mut next[pair.tile as usize];
        let item = Item {
            entry: pair.entry,
            block: pair.block,
        };
        items[*to as usize] = (item, pair.near);
        *to += 1;
    }
    for tile in 0..tiles {
        let range = first[tile] as usize..first[tile + 1] as usize;
        for run in items[range].chunk_by_mut(|a, b| a.0.entry == b.0.entry) {
            run.sort_unstable_by(|a, b| a.1.total_cmp(&b.1));
        }
    }
    (first, items.into_iter().map(|(item, _)| item).collect())
}
