//! Triangles in blocks: as many as one register has f32 lanes, in columns.
//!
//! Sixteen neighbours of a closed surface have about sixteen vertices, not 48:
//! a block that needs no more keeps each once, and its corners are permuted into
//! place in registers. That is half the memory, and what incoherent rays, and
//! all rays on large meshes, wait for is memory. Other blocks keep every corner.

use super::wide_bvh::WIDE;
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::{Entries, Lanes, Register, Table, table};

/// Vertices that a [`Shared`] block holds.
pub const VERTICES: usize = 16;

/// Of unused slots, in place of a triangle.
pub const UNUSED: u32 = u32::MAX;

/// Triangles with at most [`VERTICES`] vertices among them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Shared {
    /// `[axis][vertex]`, about the mesh's centre. Unused ones are the first.
    pub vertex: [[f32; VERTICES]; 3],
    /// `[corner][slot]`: vertices.
    pub at: [[u8; WIDE]; 3],
    /// Triangle in source order, or [`UNUSED`].
    pub source: [u32; WIDE],
}

/// Triangles with all their corners.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Apart {
    /// `[corner][axis][slot]`, about the mesh's centre.
    pub corner: [[[f32; WIDE]; 3]; 3],
    /// Triangle in source order, or [`UNUSED`].
    pub source: [u32; WIDE],
}

/// A block of either kind: triangles of one leaf, in canonical corner order (see
/// [`crate::geom::triangle::canonical`]). Unused slots are at the end: their
/// corners all are the first triangle's first one, so no ray meets them and no
/// box grows by them.
#[derive(Clone, Copy, Debug)]
pub enum Block<'a> {
    Shared(&'a Shared),
    Apart(&'a Apart),
}

impl Shared {
    #[inline(always)]
    pub fn vertices(&self, axis: usize) -> Table {
        table(&self.vertex[axis])
    }

    /// By corner.
    #[inline(always)]
    pub fn entries(&self) -> [Entries; 3] {
        let [a, b, c] = &self.at;
        [Entries::load(a), Entries::load(b), Entries::load(c)]
    }
}

impl Block<'_> {
    /// `[corner][axis]`, a slot in each lane, axes in the order asked for.
    #[inline(always)]
    pub fn columns(&self, [x, y, z]: [usize; 3]) -> [[Register; 3]; 3] {
        match self {
            Block::Shared(block) => {
                let [x, y, z] = [block.vertices(x), block.vertices(y), block.vertices(z)];
                let corner = |at: Entries| [at.of(x), at.of(y), at.of(z)];
                let [a, b, c] = block.entries();
                [corner(a), corner(b), corner(c)]
            }
            Block::Apart(block) => {
                let corner = |v: usize| {
                    let at = |axis: usize| Register::load(&block.corner[v][axis]);
                    [at(x), at(y), at(z)]
                };
                [corner(0), corner(1), corner(2)]
            }
        }
    }

    #[inline(always)]
    pub fn corners(&self, slot: usize) -> Corners {
        match self {
            Block::Shared(block) => {
                let vertex = |at: u8| block.vertex.map(|axis| axis[usize::from(at) % VERTICES]);
                [
                    vertex(block.at[0][slot]),
                    vertex(block.at[1][slot]),
                    vertex(block.at[2][slot]),
                ]
            }
            Block::Apart(block) => {
                std::array::from_fn(|v| std::array::from_fn(|k| block.corner[v][k][slot]))
            }
        }
    }

    #[inline(always)]
    pub fn source(&self, slot: usize) -> u32 {
        self.sources()[slot]
    }

    #[inline(always)]
    pub fn sources(&self) -> &[u32; WIDE] {
        match self {
            Block::Shared(block) => &block.source,
            Block::Apart(block) => &block.source,
        }
    }

    /// Slots that hold a triangle.
    #[inline(always)]
    pub fn used(&self) -> u32 {
        let sources = self.sources();
        let mut used = WIDE;
        while used > 0 && sources[used - 1] == UNUSED {
            used -= 1;
        }
        ((1_u64 << used) - 1) as u32
    }

    /// The box around the triangles, exact.
    pub fn bounds(&self) -> Aabb32 {
        let around = |k: usize, all: &[f32], bounds: &mut Aabb32| {
            let least = all.iter().copied().fold(bounds.min[k], f32::min);
            let most = all.iter().copied().fold(bounds.max[k], f32::max);
            (bounds.min[k], bounds.max[k]) = (least, most);
        };
        let mut bounds = Aabb32::EMPTY;
        for k in 0..3 {
            match self {
                Block::Shared(block) => around(k, &block.vertex[k], &mut bounds),
                Block::Apart(block) => {
                    for corner in &block.corner {
                        around(k, &corner[k], &mut bounds);
                    }
                }
            }
        }
        bounds
    }
}

/// A mesh's blocks, by number: those of the first kind stand before all others.
#[derive(Clone, Debug, Default)]
pub struct Blocks {
    pub shared: Vec<Shared>,
    pub apart: Vec<Apart>,
}

impl Blocks {
    pub fn len(&self) -> usize {
        self.shared.len() + self.apart.len()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline(always)]
    pub fn get(&self, number: usize) -> Block<'_> {
        match self.shared.get(number) {
            Some(block) => Block::Shared(block),
            None => Block::Apart(&self.apart[number - self.shared.len()]),
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = Block<'_>> {
        let apart = self.apart.iter().map(Block::Apart);
        self.shared.iter().map(Block::Shared).chain(apart)
    }

    /// Asks for a block's memory.
    #[inline(always)]
    pub fn prefetch(&self, number: usize) {
        match self.get(number) {
            Block::Shared(block) => super::prefetch(block),
            Block::Apart(block) => super::prefetch(block),
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.shared) + size_of_val(&*self.apart)
    }
}
