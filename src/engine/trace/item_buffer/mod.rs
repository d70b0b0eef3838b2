//! The item buffer (Weghorst, Hooper and Greenberg 1984): closest hits of camera rays by
//! projecting the scene instead of walking trees.
//!
//! Rays of one origin form tiles of [`BEAM`] rays. Once per frame the boxes of all entries, and
//! of all blocks of triangles of each instance of a mesh, are projected and listed at every
//! tile that they may cover. A beam then goes through its tile's list with the tests of the
//! tree walk (`trace/beam/item_lists.rs`), so ids and depths are those of tracing.
//!
//! Lists only answer closest hits of rays from the frame's origin. Rays that a list does not
//! cover (another origin, or directions outside its rectangle) are traced through the trees.

mod bins;
mod raster;

pub use raster::{Raster, Rect};

use super::beam::BEAM;
use crate::accel::{BoxRows, World};
use crate::scene::Shape;
use bins::Cells;
use raster::Projection;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// An item of a list: an entry of the world, and for a mesh one of its blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// Row of the world's entries.
    pub entry: u32,
    pub block: u32,
}

/// The lists of one frame. Items of one entry are consecutive, sorted by nearest depth.
pub struct ItemBuffer {
    raster: Raster,
    /// Rectangle by tile; empty without a list.
    rects: Vec<Rect>,
    /// By tile, start of its items; and the end of the last ones.
    first: Vec<u32>,
    items: Vec<Item>,
}

/// Largest number of items (1 GB while they are sorted); with more, walking the trees is
/// faster.
const MAX_ITEMS: usize = 1 << 26;

/// Rows of boxes per job.
const CHUNK: usize = 256;

/// A job: boxes of one space to project.
struct Work<'w> {
    entry: u32,
    rows: &'w BoxRows,
    range: std::ops::Range<usize>,
    projection: Projection,
}

impl ItemBuffer {
    /// Makes the lists of tiles. `tiles`: the rectangle of each by [`Raster::rect`], or empty.
    /// `None` if the world or one of its meshes has no boxes, or if lists do not pay:
    /// incoherent rays, or too many items.
    pub fn prepare(world: &World, raster: &Raster, mut tiles: Vec<Rect>) -> Option<ItemBuffer> {
        let boxes = world.item_boxes.as_ref()?;
        if world.unbounded_meshes().next().is_some() {
            return None;
        }
        for rect in &mut tiles {
            if !rect.is_empty() {
                *rect = rect.grown().grown();
            }
        }
        let cells = Cells::build(&tiles)?;
        let mut lists = vec![Vec::new()];
        let mut work = Vec::new();
        let in_world = Projection::for_world(raster, world.center, &world.bounds);
        let top = Work {
            entry: 0,
            rows: &boxes.entries,
            range: 0..boxes.entries.rows.len(),
            projection: in_world,
        };
        top.project(&cells.extent, |number, rect, near| {
            let entry = &world.entries[number];
            let Shape::Mesh(id) = entry.shape else {
                cells.list(&rect, number as u32, 0, near, &mut lists[0]);
                return;
            };
            let (Some(mesh), Some(rows)) = (world.wide_mesh(id), &boxes.meshes[id.index()]) else {
                return;
            };
            let projection = if entry.placed {
                let map = world.object_from_world(entry.instance);
                let center = world.scene.meshes.center[id.index()];
                Projection::for_object(raster, &map, center, &mesh.tree.bounds)
            } else {
                in_world
            };
            let count = rows.rows.len();
            work.extend((0..count).step_by(CHUNK).map(|first| Work {
                entry: number as u32,
                rows,
                range: first..count.min(first + CHUNK),
                projection,
            }));
        });
        let total = AtomicUsize::new(lists[0].len());
        lists.par_extend(work.par_iter().map(|work| {
            let mut list = Vec::new();
            if total.load(Relaxed) <= MAX_ITEMS {
                work.project(&cells.extent, |number, rect, near| {
                    cells.list(&rect, work.entry, number as u32, near, &mut list);
                });
                total.fetch_add(list.len(), Relaxed);
            }
            list
        }));
        if total.into_inner() > MAX_ITEMS {
            return None;
        }
        let (first, items) = bins::by_tile(&lists, tiles.len());
        Some(ItemBuffer {
            raster: *raster,
            rects: tiles,
            first,
            items,
        })
    }

    /// Makes the lists of `count` rays. `ray(i)` returns origin and direction, or `None` for a
    /// ray that hits nothing. The frame's origin is that of the first ray.
    pub fn of_rays(
        world: &World,
        count: usize,
        ray: impl Fn(usize) -> Option<([f64; 3], [f64; 3])> + Sync,
    ) -> Option<ItemBuffer> {
        world.item_boxes.as_ref()?;
        let raster = raster_of(count, &ray)?;
        let rect = |tile: usize| {
            let mut dirs = [[0.0; BEAM]; 3];
            let mut stand_in = None;
            for i in 0..BEAM {
                let row = tile * BEAM + i;
                let Some((org, dir)) = (row < count).then(|| ray(row)).flatten() else {
                    continue;
                };
                if org != raster.org {
                    return Rect::EMPTY;
                }
                if stand_in.is_none() {
                    stand_in = Some(dir);
                    dirs = dir.map(|x| [x as f32; BEAM]);
                }
                for k in 0..3 {
                    dirs[k][i] = dir[k] as f32;
                }
            }
            let rect = raster.rect([&dirs[0], &dirs[1], &dirs[2]]);
            rect.unwrap_or(Rect::EMPTY)
        };
        let tiles = (0..count.div_ceil(BEAM)).into_par_iter().with_min_len(64);
        ItemBuffer::prepare(world, &raster, tiles.map(rect).collect())
    }

    /// Returns the list of a tile, if it covers rays from `org` with rounded directions
    /// in columns.
    #[inline(always)]
    pub(super) fn list(&self, tile: usize, org: [f64; 3], dirs: [&[f32]; 3]) -> Option<&[Item]> {
        let rect = self.rects.get(tile)?;
        if org != self.raster.org || !rect.contains(&self.raster.rect(dirs)?.grown()) {
            return None;
        }
        let range = self.first[tile] as usize..self.first[tile + 1] as usize;
        Some(&self.items[range])
    }

    /// Returns the number of items in all lists.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.items.len() * size_of::<Item>()
            + self.first.len() * 4
            + self.rects.len() * size_of::<Rect>()
    }
}

impl Work<'_> {
    /// Calls `found(number, rectangle, near)` for each box whose rectangle overlaps `extent`.
    #[inline(always)]
    fn project(&self, extent: &Rect, mut found: impl FnMut(usize, Rect, f32)) {
        for number in self.range.clone() {
            let row = self.projection.row(&self.rows.rows[number]);
            let first = number * crate::accel::WIDE;
            let count = crate::accel::WIDE.min(self.rows.len - first);
            for i in 0..count {
                let rect = Rect {
                    u: [row.u[0][i], row.u[1][i]],
                    v: [row.v[0][i], row.v[1][i]],
                };
                if rect.meets(extent) {
                    found(first + i, rect, row.near[i]);
                }
            }
        }
    }
}

/// Chooses the picture plane: ahead is the mean of some directions, across the difference of
/// two consecutive ones.
fn raster_of(count: usize, ray: &impl Fn(usize) -> Option<([f64; 3], [f64; 3])>) -> Option<Raster> {
    use crate::math::unit;
    use glam::DVec3;
    let dir = |i: usize| Some(unit(DVec3::from_array(ray(i)?.1)));
    let leader = (0..count).find(|i| ray(*i).is_some())?;
    let (org, _) = ray(leader)?;
    let some = (0..count).step_by(BEAM - 1).filter_map(dir);
    let ahead = some.fold(DVec3::ZERO, |sum, dir| sum + dir);
    let (one, next) = (dir(leader)?, (leader + 1..count).find_map(dir));
    Raster::new(org, ahead, next.unwrap_or(one) - one)
}
