//! Data sets: what people who train on pictures want to know about each (docs/DATASETS.md).
//!
//! A task renders its picture with ids and depth besides, traces each object alone for its
//! silhouette, and writes depth, masks and a note beside the picture. `--merge` makes the files of
//! BOP, COCO, Kubric and NeRF of the notes. So all that a kill may interrupt is an output of a task.

mod coordinates;
mod doubts;
mod files;
mod formats;
mod job;
mod kubric;
mod note;
mod objects;
mod pinhole;
mod poses;
mod random;
mod rle;
mod settings;
mod shot;

pub use files::{Beside, bop_picture};
pub use formats::write;
pub use job::{check_dataset, check_random};
pub use poses::CameraFile;
pub use random::Random;
pub use settings::{DatasetSettings, Format};

use super::tasks::{Task, Tasks};
use crate::error::CliError;
use glam::DVec3;
use lanecast_engine::accel::{Structure, World};
use lanecast_io::{Outputs, Picture, SaveError, number_png, triple_png};
use lanecast_model::scene::Camera;
use lanecast_numerics::math::Affine;
use lanecast_picture::render::{Progress, RenderConfig, View, Worker};
use note::Note;
use objects::Object;
use pinhole::Pinhole;
use rayon::prelude::*;
use shot::{Shot, Traced};
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// What is computed for a data set beside the picture.
const NEEDED: [&str; 2] = ["depth", "instance_id"];

/// The most objects of a scene: their numbers have 16 bits, and 0 is none.
const MOST_OBJECTS: usize = 65_535;

/// Returns the configuration of a picture with what its data set needs.
pub fn rendered(config: RenderConfig) -> RenderConfig {
    let aovs = config.aovs.with(&NEEDED);
    RenderConfig { aovs, ..config }
}

/// A task whose picture is part of a data set.
pub struct Sample<'t> {
    pub tasks: &'t Tasks,
    pub task: &'t Task,
    /// The folder of the run.
    pub out: &'t Path,
    pub settings: &'t DatasetSettings,
}

impl Sample<'_> {
    /// Writes what the data set has of a rendered picture, and returns the files, from the folder of
    /// the run. Takes out of the picture what `config` does not ask for.
    pub fn add(
        &self,
        picture: &mut Picture,
        config: &RenderConfig,
        view: &View,
        progress: &Progress,
        outputs: &mut Outputs,
    ) -> Result<Vec<PathBuf>, CliError> {
        let pinhole = Pinhole::of(&view.camera, config, self.settings)?;
        let world = whole(view)?;
        let objects = objects::objects(&world.scene, &world.instances, self.settings);
        if objects.len() > MOST_OBJECTS {
            return Err(CliError::Usage(format!(
                "the scene has {} objects, and a data set numbers {MOST_OBJECTS}; name fewer by \
                 category, or take object = \"root\"",
                objects.len()
            )));
        }
        let depth = self.depths(picture);
        let number_of = numbers(&objects, world.instances.count());
        let pixels = picture.color.len();
        let ids = picture.instance_id.as_deref().unwrap_or_default();
        let number = |pixel: usize| match ids.get(pixel) {
            Some(id) if *id != Picture::NO_ID => number_of[*id as usize],
            _ => 0,
        };
        let shown: Vec<u16> = (0..pixels).map(number).collect();
        let of = Shot {
            view,
            config,
            world: &world,
            pinhole: &pinhole,
            with_masks: self.settings.writes(Format::Bop),
        };
        let each =
            objects
                .par_iter()
                .enumerate()
                .map_init(Worker::default, |worker, (i, object)| {
                    of.seen(
                        (i as u16 + 1, object),
                        (&shown, &depth.steps),
                        (worker, progress),
                    )
                });
        let seen: Result<Vec<Traced>, SaveError> = each.flatten().collect();
        let mut seen = seen?;
        let category = |number: &u16| match usize::from(*number).checked_sub(1) {
            Some(row) => objects[row].category,
            None => 0,
        };
        let categories: Vec<u16> = shown.iter().map(category).collect();
        let beside = self.beside();
        let (width, height) = (picture.width, picture.height);
        let mut files = Vec::new();
        let mut keep = |file: PathBuf, bytes: Result<Vec<u8>, SaveError>| -> Result<(), CliError> {
            let path = self.out.join(&file);
            let folder = path.parent().unwrap_or(self.out);
            std::fs::create_dir_all(folder).map_err(|source| SaveError::Write {
                path: folder.into(),
                source,
            })?;
            outputs.add(&path, bytes?)?;
            files.push(file);
            Ok(())
        };
        let numbers = |file: PathBuf, numbers: &[u16]| {
            let bytes = number_png(width, height, numbers, &file);
            (file, bytes)
        };
        let (file, bytes) = numbers(beside.depth(), &depth.steps);
        keep(file, bytes)?;
        let (file, bytes) = numbers(beside.objects(), &shown);
        keep(file, bytes)?;
        let (file, bytes) = numbers(beside.categories(), &categories);
        keep(file, bytes)?;
        let within = coordinates::of(picture, (view, config), &objects, &shown);
        let bytes = triple_png(width, height, &within, &beside.coordinates());
        keep(beside.coordinates(), bytes)?;
        for (i, traced) in seen.iter_mut().enumerate() {
            let masks = traced.masks.take().into_iter().flatten();
            for (file, bytes) in beside.masks(i).into_iter().zip(masks) {
                keep(file, Ok(bytes))?;
            }
        }
        let note = Note {
            v: note::VERSION,
            task: self.task.number,
            picture: self.task.output.to_string_lossy().into_owned(),
            size: [width, height],
            scene: self.tasks.scene(self.task).to_string_lossy().into_owned(),
            camera: self.tasks.camera(self.task).into(),
            variant: self.tasks.variant(self.task).into(),
            frame: self.task.frame,
            k: pinhole.k,
            distortion: pinhole.distortion,
            world_from_camera: pose_of(&view.camera),
            unit: self.settings.unit,
            depth_scale: self.settings.depth_scale,
            too_far: depth.too_far,
            objects: seen.into_iter().map(|traced| traced.seen).collect(),
        };
        let file = beside.note();
        let bytes = serde_json::to_vec(&note).map_err(|e| SaveError::Encode {
            path: file.clone(),
            message: e.to_string(),
        });
        keep(file, bytes)?;
        if !config.aovs.depth {
            picture.depth = None;
        }
        if !config.aovs.instance_id && !config.aovs.any_of_motion() {
            picture.instance_id = None;
        }
        Ok(files)
    }

    fn beside(&self) -> Beside<'_> {
        Beside {
            picture: &self.task.output,
            in_folders: self.settings.writes(Format::Bop),
        }
    }

    /// Returns the depth along the axis in steps, rounded to the nearest; 0 where nothing is.
    fn depths(&self, picture: &Picture) -> Depths {
        let steps_of_unit = self.settings.unit / self.settings.depth_scale;
        let mut too_far = 0;
        let steps = picture.depth.iter().flatten().map(|z| {
            let steps = (f64::from(*z) * steps_of_unit).round();
            match steps <= f64::from(u16::MAX) {
                true => steps as u16,
                false => {
                    too_far += u64::from(z.is_finite());
                    0
                }
            }
        });
        let steps = steps.collect();
        Depths { steps, too_far }
    }
}

/// Depths in steps.
struct Depths {
    steps: Vec<u16>,
    /// Pixels of which 16 bits are too few.
    too_far: u64,
}

/// Returns a world that has worlds of some of its instances: that of the view, or one beside it.
fn whole<'w>(view: &View<'w>) -> Result<Whole<'w>, CliError> {
    let world = view.world;
    if world.wide().is_some() {
        return Ok(Whole::Same(world));
    }
    if !world.instances.are_laid_out() {
        return Err(CliError::Usage(format!(
            "the scene has {} instances, too many for a data set to trace objects alone; 65536 are \
             possible",
            world.instances.count()
        )));
    }
    let other = World::build(&world.scene, &world.instances, Structure::Bvh);
    Ok(Whole::Beside(Box::new(other)))
}

/// A world, or one that was built beside it.
enum Whole<'w> {
    Same(&'w World),
    Beside(Box<World>),
}

impl Deref for Whole<'_> {
    type Target = World;

    fn deref(&self) -> &World {
        match self {
            Whole::Same(world) => world,
            Whole::Beside(world) => world,
        }
    }
}

/// Returns the numbers of objects by instance, from 1; 0 of what is none.
fn numbers(objects: &[Object], instances: u64) -> Vec<u16> {
    let mut numbers = vec![0; instances as usize];
    for (number, object) in (1..).zip(objects) {
        object
            .instances
            .iter()
            .for_each(|id| numbers[*id as usize] = number);
    }
    numbers
}

/// Returns the rows of a camera's pose: x to the right, y down, z ahead.
fn pose_of(camera: &Camera) -> [[f64; 4]; 3] {
    let columns = [camera.right, -camera.up, camera.forward, camera.eye];
    [0, 1, 2].map(|row| columns.map(|column: DVec3| column[row]))
}

fn rows_of(map: &Affine) -> [[f64; 4]; 3] {
    let linear = map.linear();
    [0, 1, 2].map(|row| {
        let [a, b, c] = [0, 1, 2].map(|column| linear[column][row]);
        [a, b, c, map.translation[row]]
    })
}
