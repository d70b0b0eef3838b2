//! The item buffer of a frame: the list of boxes per tile of camera rays.

use super::camera::RayGenerator;
use crate::accel::{WIDE, World};
use crate::scene::{Camera, Projection};
use crate::trace::{BEAM, ItemBuffer, Raster, Rect};
use rayon::prelude::*;

/// Prepares the lists of the camera rays of all render tiles, [`tiles_of`] lists per
/// render tile. `order(tile)` returns the tile's pixels in tracing order. Returns
/// `None` if the world has no item boxes or the camera is not a perspective one.
pub fn item_buffer(
    world: &World,
    camera: &Camera,
    generator: &RayGenerator,
    tiles: u32,
    pixels: u32,
    order: impl Fn(u32) -> Vec<(u32, u32)> + Sync,
) -> Option<ItemBuffer> {
    world.item_boxes.as_ref()?;
    // The list of a tile holds what all rays through its rectangle may meet.
    if !matches!(camera.projection, Projection::Perspective { .. }) {
        return None;
    }
    let raster = Raster::new(camera.eye.to_array(), camera.forward, camera.right)?;
    let rects = |tile: u32| {
        let order = order(tile);
        let mut rects: Vec<Rect> = order
            .chunks(BEAM)
            .map(|pixels| around(&raster, generator, pixels))
            .collect();
        rects.resize(tiles_of(pixels), Rect::EMPTY);
        rects
    };
    let rects = (0..tiles).into_par_iter().flat_map_iter(rects);
    ItemBuffer::prepare(world, &raster, rects.collect())
}

/// Returns the number of ray tiles in a render tile of that many pixels.
pub fn tiles_of(pixels: u32) -> usize {
    (pixels as usize).div_ceil(BEAM)
}

/// Returns a rectangle that covers every ray through the pixels, at any offset inside
/// each pixel.
fn around(raster: &Raster, generator: &RayGenerator, pixels: &[(u32, u32)]) -> Rect {
    let mut range = [[u32::MAX, 0]; 2];
    for (x, y) in pixels {
        for (range, at) in range.iter_mut().zip([*x, *y]) {
            *range = [range[0].min(at), range[1].max(at)];
        }
    }
    let mut dirs = [[0.0; WIDE]; 3];
    for i in 0..WIDE {
        let [right, down] = [i & 1, i >> 1 & 1];
        let (x, y) = (range[0][right], range[1][down]);
        let (_, dir) = generator.ray(x, y, [right as f64, down as f64]);
        for k in 0..3 {
            dirs[k][i] = dir[k] as f32;
        }
    }
    let rect = raster.rect([&dirs[0], &dirs[1], &dirs[2]]);
    rect.unwrap_or(Rect::EMPTY)
}
