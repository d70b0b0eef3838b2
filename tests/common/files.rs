//! Files of the repository and of the test assets, and scenes loaded with a camera and lights.

use lanecast::internals::accel::{Structure, World};
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::render::{Progress, RenderConfig, Rendered, View, render};
use lanecast::internals::scene::{Camera, Instances, Light, Scene};
use std::path::{Path, PathBuf};

/// A file or folder by its path from the root of the repository.
pub fn in_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The folder of test assets, or `None` after saying that it is absent.
pub fn assets() -> Option<PathBuf> {
    let folder = std::env::var_os("LANECAST_ASSETS")
        .map_or_else(|| in_repository("../shared/assets"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no assets at {}", folder.display());
    None
}

/// A scene file, complete with a view and lights.
pub struct Loaded {
    pub scene: Scene,
    pub instances: Instances,
    pub camera: Camera,
}

/// `aspect`: the picture's width over its height.
pub fn load(path: &Path, aspect: f64) -> Loaded {
    let loaded = lanecast::internals::io::load(path, &Default::default());
    let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    let instances = Instances::of(&scene).expect("few instances");
    let row = (!scene.cameras.rows.is_empty()).then_some(0);
    let (scene, camera) = scene.completed(row, &instances, aspect);
    Loaded {
        scene,
        instances,
        camera,
    }
}

impl Loaded {
    /// What the plan would take for it, at the machine's own width.
    pub fn kernels(&self, precision: Precision) -> Kernels {
        Kernels {
            precision,
            lanes: native_width(),
        }
    }

    pub fn world(&self, structure: Structure) -> World {
        World::build(&self.scene, &self.instances, structure)
    }

    pub fn render(
        &self,
        world: &World,
        kernels: Kernels,
        lights: &[Light],
        config: &RenderConfig,
    ) -> Rendered {
        let view = View {
            world,
            kernels,
            camera: self.camera,
            lights,
        };
        render(&view, config, false, &Progress::default()).expect("nobody interrupts")
    }
}
