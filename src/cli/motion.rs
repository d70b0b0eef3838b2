//! Motion vectors, as far as the command line is asked for them.

use super::error::CliError;
use super::pipeline::Prepared;
use lanecast_io::{LoadError, Picture};
use lanecast_model::scene::{Camera, Instances, Scene};
use lanecast_picture::render::{Moment, RenderConfig, motion_vectors};
use std::path::Path;

/// What motion vectors are computed from.
const NEEDED: [&str; 3] = ["distance", "instance_id", "primitive_id"];

/// Returns the configuration of a picture that is rendered with what its motion vectors need.
pub fn rendered(config: RenderConfig) -> RenderConfig {
    let aovs = match config.aovs.any_of_motion() {
        true => config.aovs.with(&NEEDED),
        false => config.aovs,
    };
    RenderConfig { aovs, ..config }
}

/// The scene that a picture shows, at its time.
pub struct Shown<'s> {
    pub scene: &'s Scene,
    pub instances: &'s Instances,
    pub camera: Camera,
    /// The camera's row of the scene's table, unless it was made.
    pub camera_row: Option<usize>,
    pub time: f64,
    /// From one frame of the sequence to the next; the whole motion of a single picture.
    pub step: f64,
}

impl<'s> Shown<'s> {
    /// Returns what a single picture shows.
    pub fn of(prepared: &'s Prepared, config: &RenderConfig) -> Shown<'s> {
        Shown {
            scene: &prepared.scene,
            instances: &prepared.instances,
            camera: prepared.camera,
            camera_row: prepared.camera_row,
            time: config.shutter.map_or(0.0, |exposure| exposure.middle()),
            step: 1.0,
        }
    }

    /// Adds motion vectors to a picture if `config` asks for them, and takes out what was rendered for
    /// them alone. Fails if the scene is not possible a step before or after; `path` names it.
    pub fn add_vectors(
        &self,
        picture: &mut Picture,
        config: &RenderConfig,
        path: &Path,
    ) -> Result<(), CliError> {
        let asked = &config.aovs;
        if !asked.any_of_motion() {
            return Ok(());
        }
        let scene_at = |time: f64| -> Result<(Scene, Instances), LoadError> {
            let of_scene = |source| LoadError::of_scene(path, source);
            let scene = self.scene.clone().at(time).map_err(of_scene)?;
            let instances = Instances::of(&scene).map_err(of_scene)?;
            Ok((scene, instances))
        };
        let (after, before) = (
            scene_at(self.time + self.step)?,
            scene_at(self.time - self.step)?,
        );
        let camera = |scene: &Scene| {
            let row = self.camera_row;
            row.map_or(self.camera, |row| scene.cameras.rows[row])
        };
        let now = Moment {
            scene: self.scene,
            instances: self.instances,
            camera: self.camera,
        };
        let [after, before] = [&after, &before].map(|(scene, instances)| Moment {
            scene,
            instances,
            camera: camera(scene),
        });
        let vectors = motion_vectors(picture, config, &now, [&after, &before]);
        if asked.vector {
            // Blender's: from before to now reversed, and from now to after reversed.
            let of_blender = |[u, v, before_u, before_v]: &[f32; 4]| [*before_u, *before_v, -u, -v];
            picture.vector = Some(vectors.iter().map(of_blender).collect());
        }
        if asked.motion {
            picture.motion = Some(vectors);
        }
        if !asked.distance {
            picture.distance = None;
        }
        if !asked.instance_id {
            picture.instance_id = None;
        }
        if !asked.primitive_id {
            picture.primitive_id = None;
        }
        Ok(())
    }
}
