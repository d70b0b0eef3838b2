//! Samples of a path-traced picture before they are summed, and single paths with all their
//! vertices, for `verify`.

use super::camera::RayGenerator;
use super::config::RenderConfig;
use super::paths::{PathPicture, PathTile};
use super::picture::{View, Worker};
use super::pixel_order::{Spot, morton_order};
use super::progress::Progress;
use crate::scene::Rgb;
use crate::shade::Statistics;
use crate::shade::path::{PathScratch, PathVertex, SampleNumbers, Seen};
use crate::trace::{ScratchPool, ShadowCache};

/// The paths of a picture.
pub struct PathProbe<'a> {
    view: &'a View<'a>,
    config: &'a RenderConfig,
    picture: PathPicture,
    generator: RayGenerator,
    workers: ScratchPool<Worker>,
    progress: &'a Progress,
}

/// A rectangle of pixels: its left upper one, width and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    pub corner: (u32, u32),
    pub size: (u32, u32),
}

impl<'a> PathProbe<'a> {
    /// Prepares a picture; `None` if its integrator traces no paths.
    pub fn new(
        view: &'a View<'a>,
        config: &'a RenderConfig,
        progress: &'a Progress,
    ) -> Option<PathProbe<'a>> {
        let (width, height) = (config.width, config.height);
        Some(PathProbe {
            view,
            config,
            picture: PathPicture::new(view, config)?,
            generator: RayGenerator::new(view.camera, width, height, config.grid),
            workers: ScratchPool::default(),
            progress,
        })
    }

    /// Returns what camera rays see in place of the sky.
    pub fn backdrop(&self) -> Option<Rgb> {
        match self.picture.backdrop {
            Seen::Color(color) => Some(color),
            Seen::Sky => None,
            Seen::Nothing => Some([0.0; 3]),
        }
    }

    /// Says whether media touch, so that the solids tell them apart.
    pub fn asks_solids(&self) -> bool {
        self.picture.media.solids.is_some()
    }

    /// Says whether the eye lies in a medium.
    pub fn eye_is_inside(&self) -> bool {
        self.picture.media.eye.iter().next().is_some()
    }

    /// Traces all samples of a block and returns them sample by sample, each row by row.
    pub fn samples(&self, block: Block) -> Vec<Rgb> {
        let order = morton_order(block.size);
        let samples = 0..self.picture.samples;
        let traced = samples.flat_map(|sample| self.traced(block, &order, sample, false).0);
        traced.collect()
    }

    /// Traces one sample of a pixel alone, and returns it with its vertices.
    pub fn path(&self, corner: (u32, u32), sample: u32) -> (Rgb, Vec<PathVertex>) {
        let block = Block {
            corner,
            size: (1, 1),
        };
        let (colors, vertices) = self.traced(block, &morton_order(block.size), sample, true);
        (colors[0], vertices)
    }

    fn traced(
        &self,
        block: Block,
        order: &[Spot],
        sample: u32,
        recording: bool,
    ) -> (Vec<Rgb>, Vec<PathVertex>) {
        let tile = PathTile {
            view: self.view,
            config: self.config,
            picture: &self.picture,
            generator: &self.generator,
            corner: block.corner,
            order,
            cancel: &self.progress.cancel,
        };
        self.workers.with(|worker| {
            let mut slots = vec![[0.0, 0.0, 0.0, 1.0]; order.len()];
            let Worker { arena, trace } = worker;
            let mut scratch = PathScratch::new(arena, trace, self.picture.kinds());
            if recording {
                scratch.start_record();
            }
            let cache = &mut ShadowCache::new(self.config.shadow_cache);
            let statistics = &mut Statistics {
                sample,
                ..Statistics::of_counts()
            };
            tile.queue_rays(sample, &mut scratch);
            let tracer = tile.tracer();
            let number = SampleNumbers::One(sample);
            tracer.run(&mut scratch, number, &mut slots, cache, statistics);
            let vertices = scratch.take_record();
            drop(scratch);
            arena.reset();
            (
                slots.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect(),
                vertices,
            )
        })
    }
}
