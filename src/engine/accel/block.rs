//! Blocks of triangles in columns, as many as one register has f32 lanes.
//!
//! Sixteen neighbouring triangles of a closed surface have about sixteen vertices, not 48.
//! An indexed block stores each vertex once, and corners are gathered in registers. That
//! halves the memory, and memory is what incoherent rays, and all rays on large meshes, wait
//! for (docs/decisions/010-vertices-once-in-a-block.md). A block with more vertices stores
//! every corner.

use super::wide_bvh::WIDE;
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::{Entries, Lanes, Register, Table, table};

/// The most vertices of an [`IndexedBlock`].
pub const VERTICES: usize = 16;

/// The triangle number of an unused slot.
pub const UNUSED: u32 = u32::MAX;

/// A block whose triangles have at most [`VERTICES`] distinct vertices.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct IndexedBlock {
    /// `[axis][vertex]`, about the mesh's centre. Unused columns repeat the first vertex.
    pub vertex: [[f32; VERTICES]; 3],
    /// `[corner][slot]`: the corner's vertex.
    pub index: [[u8; WIDE]; 3],
    /// By slot: the triangle's number in the mesh, or [`UNUSED`].
    pub source: [u32; WIDE],
}

/// A block that stores every corner.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct UnindexedBlock {
    /// `[corner][axis][slot]`, about the mesh's centre.
    pub corner: [[[f32; WIDE]; 3]; 3],
    /// By slot: the triangle's number in the mesh, or [`UNUSED`].
    pub source: [u32; WIDE],
}

/// A block of either kind. It holds triangles of one leaf, in canonical corner order (see
/// [`crate::geom::triangle::canonical`]). Unused slots are at the end; all their corners are
/// the first corner of the first triangle, so that no ray meets them and no box grows by
/// them.
#[derive(Clone, Copy, Debug)]
pub enum Block<'a> {
    Indexed(&'a IndexedBlock),
    Unindexed(&'a UnindexedBlock),
}

impl IndexedBlock {
    /// Returns one coordinate of all vertices.
    #[inline(always)]
    pub fn vertices(&self, axis: usize) -> Table {
        table(&self.vertex[axis])
    }

    /// Returns the vertices of each corner, a slot in each lane.
    #[inline(always)]
    pub fn entries(&self) -> [Entries; 3] {
        let [a, b, c] = &self.index;
        [Entries::load(a), Entries::load(b), Entries::load(c)]
    }
}

impl Block<'_> {
    /// Returns the corners as `[corner][axis]`, a slot in each lane and the axes in the given
    /// order.
    #[inline(always)]
    pub fn columns(&self, [x, y, z]: [usize; 3]) -> [[Register; 3]; 3] {
        match self {
            Block::Indexed(block) => {
                let [x, y, z] = [block.vertices(x), block.vertices(y), block.vertices(z)];
                let corner = |at: Entries| [at.of(x), at.of(y), at.of(z)];
                let [a, b, c] = block.entries();
                [corner(a), corner(b), corner(c)]
            }
            Block::Unindexed(block) => {
                let corner = |v: usize| {
                    let at = |axis: usize| Register::load(&block.corner[v][axis]);
                    [at(x), at(y), at(z)]
                };
                [corner(0), corner(1), corner(2)]
            }
        }
    }

    /// Returns the corners of one triangle.
    #[inline(always)]
    pub fn corners(&self, slot: usize) -> Corners {
        match self {
            Block::Indexed(block) => {
                let vertex = |at: u8| block.vertex.map(|axis| axis[usize::from(at) % VERTICES]);
                [
                    vertex(block.index[0][slot]),
                    vertex(block.index[1][slot]),
                    vertex(block.index[2][slot]),
                ]
            }
            Block::Unindexed(block) => {
                std::array::from_fn(|v| std::array::from_fn(|k| block.corner[v][k][slot]))
            }
        }
    }

    /// Returns the mesh's number of the triangle in a slot.
    #[inline(always)]
    pub fn source(&self, slot: usize) -> u32 {
        self.sources()[slot]
    }

    /// Returns the mesh's numbers of the triangles, or [`UNUSED`].
    #[inline(always)]
    pub fn sources(&self) -> &[u32; WIDE] {
        match self {
            Block::Indexed(block) => &block.source,
            Block::Unindexed(block) => &block.source,
        }
    }

    /// Returns the slots that hold a triangle, a bit for each.
    #[inline(always)]
    pub fn used(&self) -> u32 {
        let sources = self.sources();
        let mut used = WIDE;
        while used > 0 && sources[used - 1] == UNUSED {
            used -= 1;
        }
        ((1_u64 << used) - 1) as u32
    }

    /// Returns the exact box around the triangles.
    pub fn bounds(&self) -> Aabb32 {
        let around = |k: usize, all: &[f32], bounds: &mut Aabb32| {
            let least = all.iter().copied().fold(bounds.min[k], f32::min);
            let most = all.iter().copied().fold(bounds.max[k], f32::max);
            (bounds.min[k], bounds.max[k]) = (least, most);
        };
        let mut bounds = Aabb32::EMPTY;
        for k in 0..3 {
            match self {
                Block::Indexed(block) => around(k, &block.vertex[k], &mut bounds),
                Block::Unindexed(block) => {
                    for corner in &block.corner {
                        around(k, &corner[k], &mut bounds);
                    }
                }
            }
        }
        bounds
    }
}

/// A mesh's blocks. The number of a block counts indexed blocks first, then the others.
#[derive(Clone, Debug, Default)]
pub struct Blocks {
    pub indexed: Vec<IndexedBlock>,
    pub unindexed: Vec<UnindexedBlock>,
}

impl Blocks {
    pub fn len(&self) -> usize {
        self.indexed.len() + self.unindexed.len()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the block of a number.
    #[inline(always)]
    pub fn get(&self, number: usize) -> Block<'_> {
        match self.indexed.get(number) {
            Some(block) => Block::Indexed(block),
            None => Block::Unindexed(&self.unindexed[number - self.indexed.len()]),
        }
    }

    /// Iterates over all blocks in the order of their numbers.
    pub fn iter(&self) -> impl Iterator<Item = Block<'_>> {
        let unindexed = self.unindexed.iter().map(Block::Unindexed);
        self.indexed.iter().map(Block::Indexed).chain(unindexed)
    }

    /// Prefetches the memory of a block.
    #[inline(always)]
    pub fn prefetch(&self, number: usize) {
        match self.get(number) {
            Block::Indexed(block) => super::prefetch(block),
            Block::Unindexed(block) => super::prefetch(block),
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.indexed) + size_of_val(&*self.unindexed)
    }
}
