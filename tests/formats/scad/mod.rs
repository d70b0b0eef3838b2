//! OpenSCAD's `.csg`: what each node means, what is refused and with which message, and texts
//! that nobody wrote.

mod bounds;
mod messages;
mod openscad;
mod shapes;
mod volumes;

use lanecast::internals::io::{Curves, LoadOptions, Loaded, load};
use lanecast::internals::math::Affine;
use lanecast::internals::measure::volumes::{Goal, Placed};
use lanecast::internals::render::Progress;
use lanecast::internals::scene::{Instances, Scene};

fn load_as(text: &str, scad_curves: Curves) -> Result<Loaded, String> {
    load_beside(text, &[], scad_curves)
}

/// Loads a text as a file beside others.
fn load_beside(text: &str, files: &[(&str, &[u8])], scad_curves: Curves) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.csg");
    std::fs::write(&path, text).unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let options = LoadOptions {
        scad_curves,
        ..LoadOptions::default()
    };
    load(&path, &options).map_err(|error| {
        let message = error.to_string();
        message.replace(&format!("{}/", folder.path().display()), "")
    })
}

fn loaded(text: &str) -> Loaded {
    load_as(text, Curves::Exact).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn scene(text: &str) -> Scene {
    loaded(text).scene
}

/// The volume of all that is placed, to a third of what `near` allows.
fn volume(text: &str) -> f64 {
    volume_as(text, Curves::Exact)
}

fn volume_as(text: &str, curves: Curves) -> f64 {
    let scene = match load_as(text, curves) {
        Ok(loaded) => loaded.scene,
        Err(error) if error.contains("the scene is empty") => return 0.0,
        Err(error) => panic!("{text}: {error}"),
    };
    volume_of(&scene, text)
}

/// The share of a volume that may be missing or too much: what is wrong with a solid is wrong by
/// hundredths, and quadrature to more digits takes most of the time of these tests.
pub const NEAR: f64 = 1e-3;

pub fn volume_of(scene: &Scene, text: &str) -> f64 {
    let instances = Instances::of(scene).unwrap();
    let goal = Goal {
        relative: 0.3 * NEAR,
        ..Goal::default()
    };
    let mut sum = 0.0;
    for instance in instances.iter(scene) {
        let maps = (&instance.world_from_object, &instance.object_from_world);
        let placed = Placed::new(scene, instance.shape, maps.0, maps.1);
        let placed = placed.unwrap_or_else(|_| panic!("{text}: no volume"));
        let found = placed.measure(&goal, &Progress::default()).unwrap();
        sum += found.volume(&Affine::IDENTITY, 1.0).unwrap().volume;
    }
    sum
}

fn near(found: f64, expected: f64, text: &str) {
    let off = (found - expected).abs();
    assert!(
        off <= NEAR * expected.abs(),
        "{text}: {found}, not {expected}"
    );
}

const CUBE: &str = "cube(size = [1, 2, 3], center = false);";
const FN0: &str = "$fn = 0, $fa = 12, $fs = 2";
