//! Boxes in columns, as many to a row as a register has lanes. An item buffer projects them
//! for each frame instead of walking a tree.

use crate::accel::block::Blocks;
use crate::accel::tlas_entry::TlasEntry;
use crate::accel::wide_bvh::WIDE;
use crate::math::Aabb32;

/// A row of [`WIDE`] boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct BoxRow {
    /// `[axis][lower, upper][slot]`.
    pub bounds: [[[f32; WIDE]; 2]; 3],
}

/// Boxes in rows of [`WIDE`]; slots behind the last box are empty.
#[derive(Clone, Debug, Default)]
pub struct BoxRows {
    pub rows: Vec<BoxRow>,
    pub len: usize,
}

/// The boxes that a world's item buffers project.
#[derive(Clone, Debug)]
pub struct ItemBoxes {
    /// The boxes of the world's entries, in their order.
    pub entries: BoxRows,
    /// By mesh: the boxes of its blocks; `None` for meshes that no instance places.
    pub meshes: Vec<Option<BoxRows>>,
}

impl BoxRows {
    /// Collects boxes into rows.
    pub fn collect(boxes: impl Iterator<Item = Aabb32>) -> BoxRows {
        let mut all = BoxRows::default();
        for bounds in boxes {
            let slot = all.len % WIDE;
            if slot == 0 {
                let side = [f32::INFINITY, f32::NEG_INFINITY].map(|x| [x; WIDE]);
                all.rows.push(BoxRow { bounds: [side; 3] });
            }
            if let Some(row) = all.rows.last_mut() {
                for k in 0..3 {
                    row.bounds[k][0][slot] = bounds.min[k];
                    row.bounds[k][1][slot] = bounds.max[k];
                }
            }
            all.len += 1;
        }
        all
    }

    pub fn of_entries(entries: &[TlasEntry]) -> BoxRows {
        BoxRows::collect(entries.iter().map(|entry| entry.bounds))
    }

    pub fn of_blocks(blocks: &Blocks) -> BoxRows {
        BoxRows::collect(blocks.iter().map(|block| block.bounds()))
    }

    /// Returns box `i` as (min, max).
    #[inline(always)]
    pub fn get(&self, i: usize) -> ([f32; 3], [f32; 3]) {
        let row = &self.rows[i / WIDE].bounds;
        let side = |s: usize| std::array::from_fn(|k| row[k][s][i % WIDE]);
        (side(0), side(1))
    }

    pub fn bytes(&self) -> usize {
        self.rows.len() * size_of::<BoxRow>()
    }
}

impl ItemBoxes {
    pub fn bytes(&self) -> usize {
        let meshes = self.meshes.iter().flatten().map(BoxRows::bytes);
        self.entries.bytes() + meshes.sum::<usize>()
    }
}
