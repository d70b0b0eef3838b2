//! The slices of a shutter: the scene at each of them, as a static world.
//!
//! A path keeps its time for its whole life, so that a slice is an exact static scene, and what
//! is proven of static scenes holds of it. Slices share all that does not move.

use super::config::Exposure;
use crate::accel::World;
use crate::scene::{Camera, Instances, Light, SceneError};
use rayon::prelude::*;
use thiserror::Error;

/// The most bytes of what slices do not share. The limit is the same on all machines, because
/// the number of slices shows in pictures.
const MOST_BYTES: usize = 1 << 31;

/// The scene at a time.
pub struct Slice {
    pub world: World,
    pub camera: Camera,
}

/// A shutter's slices, in the order of their times.
pub struct Slices {
    pub exposure: Exposure,
    pub rows: Vec<Slice>,
}

#[derive(Clone, Debug, Error)]
pub enum SliceError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(
        "{asked} slices of the shutter would need {megabytes} MB of memory beside the scene; at \
         most {most} are possible here: ask for --shutter-slices {most}"
    )]
    TooMany {
        asked: u32,
        most: u32,
        megabytes: usize,
    },
}

impl Slices {
    /// Returns the largest power of two that is a possible number of slices of a world.
    pub fn most(world: &World) -> u32 {
        let most = (MOST_BYTES / world.bytes_of_a_time().max(1)).clamp(1, 1 << 16);
        1 << most.ilog2()
    }

    /// Makes the worlds of all slices, in parallel on the current pool. `camera` is the picture's,
    /// and its row in the scene's table if it is one of those.
    pub fn build(
        world: &World,
        (camera, row): (&Camera, Option<usize>),
        exposure: &Exposure,
    ) -> Result<Slices, SliceError> {
        let most = Slices::most(world);
        if exposure.slices > most {
            return Err(SliceError::TooMany {
                asked: exposure.slices,
                most,
                megabytes: world.bytes_of_a_time() * exposure.slices as usize / 1_000_000,
            });
        }
        let slice = |number: u32| {
            let scene = world.scene.clone().at(exposure.time(number))?;
            let instances = Instances::of(&scene)?;
            Ok(Slice {
                camera: row.map_or(*camera, |row| scene.cameras.rows[row]),
                world: world.at_time(&scene, &instances),
            })
        };
        let rows = (0..exposure.slices).into_par_iter().map(slice);
        let rows: Result<Vec<Slice>, SceneError> = rows.collect();
        Ok(Slices {
            exposure: *exposure,
            rows: rows?,
        })
    }

    /// Returns the lights of a slice, of a picture whose lights stand in the scene's table or
    /// were made for it.
    pub(super) fn lights<'a>(slice: &'a Slice, made: &'a [Light]) -> &'a [Light] {
        match &*slice.world.scene.lights {
            [] => made,
            lights => lights,
        }
    }
}
