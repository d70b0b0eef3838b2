//! Silhouettes: which pixels show something of a world, also beside the picture.
//!
//! The rays are those of the outputs beside the colour, one through each pixel's centre, and they
//! pass through holes as those do. So a world of one object ([`World::of_some`]) gives the pixels
//! that the object would have if nothing were in front of it.
//!
//! [`World::of_some`]: crate::accel::World::of_some

use super::camera::RayGenerator;
use super::config::RenderConfig;
use super::picture::{View, Worker};
use crate::math::lanes::Lanes;
use crate::shade::{Doubles, Integrator, MaterialFlags, STEP, Scratch, Statistics};
use crate::trace::RayKind;
use glam::DVec3;
use std::sync::atomic::AtomicBool;

/// Rays that are traced at a time.
const BATCH: usize = 1 << 12;

/// Pixels of a picture's plane: those of the picture begin at 0, others lie beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// The first column and row.
    pub x: i32,
    pub y: i32,
    pub width: u32,
    pub height: u32,
}

impl Rectangle {
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Returns the place of a pixel of the rectangle, by its number row by row.
    pub fn place(&self, number: usize) -> [i32; 2] {
        let width = self.width as usize;
        let (x, y) = ((number % width) as i32, (number / width) as i32);
        [self.x + x, self.y + y]
    }
}

/// Says of each pixel of a rectangle, row by row, whether its ray meets something. Only rays whose
/// direction (right, up, ahead), with 1 ahead for cameras with a plane, is wanted are traced.
pub fn silhouette(
    view: &View,
    config: &RenderConfig,
    rectangle: &Rectangle,
    wanted: &dyn Fn([f64; 3]) -> bool,
    (worker, cancel): (&mut Worker, &AtomicBool),
) -> Vec<bool> {
    let generator = RayGenerator::new(view.camera, config.width, config.height, config.grid);
    let integrator = Integrator {
        world: view.world,
        kernels: view.kernels,
        lights: &[],
        items: None,
        background: [0.0; 3],
        backdrop: [0.0; 3],
        max_depth: 0,
        unnamed: Default::default(),
        material_flags: MaterialFlags::new(&view.world.scene.materials.rows),
        cancel,
    };
    let axes = [view.camera.right, view.camera.up, view.camera.forward];
    let mut meets = vec![false; rectangle.pixels()];
    // Nobody looks at the emission that is added here.
    let mut film = vec![[0.0; 3]; BATCH.min(meets.len())];
    for (batch, some) in meets.chunks_mut(BATCH).enumerate() {
        let mut scratch = Scratch::new(&worker.arena, &mut worker.trace);
        let queue = scratch.camera_rays();
        for first in (0..some.len()).step_by(STEP) {
            let count = STEP.min(some.len() - first);
            let rows: [u32; STEP] = std::array::from_fn(|i| (first + i.min(count - 1)) as u32);
            let places = rows.map(|row| rectangle.place(batch * BATCH + row as usize));
            let [x, y] = [0, 1].map(|k| Doubles::load(&places.map(|at| f64::from(at[k]))));
            let half = Doubles::splat(0.5);
            let rays = generator.rays([x, y], [half; 2]);
            let [dx, dy, dz] = [rays.1.x, rays.1.y, rays.1.z].map(|d| d.to_array());
            let is_wanted = |i: usize| {
                let dir = DVec3::new(dx[i], dy[i], dz[i]);
                wanted(axes.map(|axis| axis.dot(dir)))
            };
            let seeing = generator.seeing(&rays.1, count);
            let asked = (0..count).filter(|i| seeing >> i & 1 == 1 && is_wanted(*i));
            queue.push_some(asked.fold(0, |bits, i| bits | 1 << i), rays, &rows);
        }
        queue.complete(f32::INFINITY, RayKind::Primary);
        let mut met = |row: u32, _: &_, _| some[row as usize] = true;
        let statistics = &mut Statistics::of_counts();
        integrator.run(&mut scratch, &mut film, &mut [], statistics, Some(&mut met));
        drop(scratch);
        worker.arena.reset();
    }
    meets
}
