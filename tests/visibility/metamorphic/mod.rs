//! Changes of a scene that must not change its picture: the unit of length, the order of the
//! input, objects that no ray meets, and rotations that permute the axes.
//!
//! Each test makes a scene twice and compares the pictures or hits bit by bit, so it needs no
//! oracle. The quick tests take a few scenes, the ignored ones all that are at hand.

mod compare;
mod remade;
mod solids;
mod sums;

use crate::common::{
    ALL_AOVS, Loaded, Random, RayColumns, assets, campaign, hard_rays, in_repository, load,
    random_scene,
};
use compare::{Tally, is_tie, same_pictures, same_records, show};
use glam::DVec3;
use lanecast::internals::accel::Structure;
use lanecast::internals::geom::Sphere;
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::render::{Progress, RenderConfig, Rendered, View, render};
use lanecast::internals::scene::{Edge, Instances, Scene, SceneBuilder};
use lanecast::internals::trace::{HitId, TracedRay};
use remade::{Change, Order, Turn, below, remade};

const MODES: [Precision; 3] = [Precision::Fast, Precision::Guarded, Precision::Exact];

fn config(width: u32, height: u32) -> RenderConfig {
    RenderConfig {
        width,
        height,
        aovs: ALL_AOVS,
        ..RenderConfig::default()
    }
}

fn rendered(of: &Loaded, precision: Precision, config: &RenderConfig) -> Rendered {
    let world = of.world(Structure::Bvh);
    let view = View {
        world: &world,
        kernels: of.kernels(precision),
        camera: of.camera,
        lights: &of.scene.lights,
    };
    render(&view, config, true, &Progress::default()).expect("nobody interrupts")
}

/// With the camera that `change` makes of it.
fn finished(scene: SceneBuilder, of: &Loaded, change: &Change) -> Loaded {
    let scene = scene.finish().expect("as good as before");
    Loaded {
        instances: Instances::of(&scene).expect("few"),
        scene,
        camera: change.camera(&of.camera),
    }
}

fn random(seed: u64) -> Loaded {
    complete(random_scene(seed))
}

fn complete(scene: Scene) -> Loaded {
    let instances = Instances::of(&scene).expect("few");
    let row = (!scene.cameras.rows.is_empty()).then_some(0);
    let (scene, camera) = scene.completed(row, &instances, 1.5);
    Loaded {
        scene,
        instances,
        camera,
    }
}

fn of_project(name: &str) -> Loaded {
    load(&in_repository("scenes").join(name), 1.5)
}

/// Names and scenes: some of ours, random ones, some of the assets.
fn scenes(ours: &[&str], seeds: u64, others: &[&str]) -> Vec<(String, Loaded)> {
    let mut all: Vec<(String, Loaded)> = Vec::new();
    all.extend(ours.iter().map(|name| (name.to_string(), of_project(name))));
    all.extend((0..seeds).map(|seed| (format!("random {seed}"), random(seed))));
    if let Some(assets) = assets() {
        let of = |name: &&str| (name.to_string(), load(&assets.join(name), 1.5));
        all.extend(others.iter().map(of));
    }
    all
}

fn few() -> Vec<(String, Loaded)> {
    scenes(
        &["primitives.toml", "instances.toml", "formula_solids.toml"],
        4,
        &["meshes/suzanne_1k.glb", "spd/balls_2.nff"],
    )
}

/// Whose steps are rounded in another order once lengths or axes are others.
fn surfaces() -> Vec<(String, Loaded)> {
    scenes(&["surface_torus.toml"], 0, &[])
}

fn many() -> Vec<(String, Loaded)> {
    scenes(
        &[
            "primitives.toml",
            "instances.toml",
            "glass.toml",
            "molecule.json",
        ],
        40,
        &[
            "meshes/armadillo_86k.glb",
            "meshes/bunny_69k.glb",
            "meshes/cornell_box.glb",
            "meshes/dragon_202k.glb",
            "meshes/fandisk_13k.glb",
            "meshes/spot_6k.glb",
            "meshes/teapot_6k.glb",
            "spd/balls_4.nff",
            "spd/gears_2.nff",
            "spd/mount_6.nff",
            "spd/rings_7.nff",
            "spd/teapot_12.nff",
            "spd/tetra_6.nff",
            "spd/tree_11.nff",
        ],
    )
}

/// `fast` has nothing to go back to where products leave f32: cubes of lengths, of
/// solids fourth powers. Beyond these its differences are counted.
const FAST_MESHES: i32 = 32;
const FAST_SOLIDS: i32 = 24;

/// Twice: the numbers themselves times 2^k, and a transform above the roots.
fn scaling(scenes: &[(String, Loaded)], powers: &[i32], config: &RenderConfig) -> Tally {
    let mut tally = Tally::default();
    for (name, plain) in scenes {
        let solids = plain.scene.shapes.len() > plain.scene.meshes.len();
        for precision in MODES {
            let before = rendered(plain, precision, config);
            for power in powers {
                let fast = if solids { FAST_SOLIDS } else { FAST_MESHES };
                let held = precision != Precision::Fast || power.abs() <= fast;
                let scale = libm::exp2(f64::from(*power));
                let change = Change {
                    scale,
                    ..Change::NONE
                };
                let numbers = remade(&plain.scene, &change, &mut Order::default());
                let numbers = finished(numbers, plain, &change);
                let above = finished(below(&plain.scene, &change), plain, &change);
                for (how, scaled) in [("numbers", &numbers), ("a node", &above)] {
                    let after = rendered(scaled, precision, config);
                    let what = format!("{precision:?}, {name}, 2^{power} in {how}");
                    tally.add(held, what, same_pictures(&before, &after, scale));
                }
            }
        }
    }
    tally
}

#[test]
fn the_unit_of_length_does_not_show() {
    scaling(&few(), &[-40, 3, 40], &config(48, 32)).settle();
    // So large that the slope of a polynomial is next to nothing.
    scaling(&surfaces(), &[-12, 3, 12], &config(48, 32)).settle();
}

#[test]
#[ignore = "a campaign of minutes"]
fn the_unit_of_length_does_not_show_anywhere() {
    let powers = [-40, -33, -24, -12, -1, 1, 12, 17, 29, 40];
    show("scaling", scaling(&many(), &powers, &config(192, 128))).settle();
}

/// A ball that no ray of the record meets, `distance` scene sizes away.
fn unseen(plain: &Loaded, record: &[TracedRay], distance: f64, seed: u64) -> Option<Sphere> {
    let world = plain.world(Structure::Bvh);
    let bounds = world.bounds.widened();
    let size = bounds.extent().max_element();
    let random = &mut Random(seed);
    // Smaller ones fit between the rays of scenes that look everywhere.
    let balls = (0..200).map(|i| {
        let away = random.vector().normalize_or(DVec3::X) * size * distance;
        Sphere {
            center: bounds.center() + away,
            radius: libm::ldexp(size * distance.min(10.0) * 0.1, -(i / 40)),
        }
    });
    let meets = |ball: &Sphere, ray: &TracedRay| {
        let dir = DVec3::from_array(ray.dir.map(f64::from));
        let to = ball.center - DVec3::from_array(ray.org);
        let t = (to.dot(dir) / dir.length_squared()).clamp(0.0, f64::from(ray.t_max));
        (to - dir * t).length() < 2.0 * ball.radius
    };
    balls
        .into_iter()
        .find(|ball| !record.iter().any(|ray| meets(ball, ray)))
}

fn strangers(scenes: &[(String, Loaded)], config: &RenderConfig) -> Tally {
    let mut tally = Tally::default();
    for (name, plain) in scenes {
        for precision in MODES {
            let before = rendered(plain, precision, config);
            for distance in [2.0, 100.0, 1e6] {
                let Some(ball) = unseen(plain, &before.record, distance, 5) else {
                    tally.left_out += 1;
                    continue;
                };
                let mut more = remade(&plain.scene, &Change::NONE, &mut Order::default());
                let shape = more.sphere("", ball);
                more.instance("", Edge::shape(shape));
                let more = finished(more, plain, &Change::NONE);
                let after = rendered(&more, precision, config);
                let what = format!("{precision:?}, {name}, a ball {distance} sizes away");
                // Tiles of one direction count from the world's box, in f32.
                let held = precision != Precision::Fast;
                tally.add(held, what, same_pictures(&before, &after, 1.0));
            }
        }
    }
    tally
}

#[test]
fn what_nobody_sees_does_not_show() {
    strangers(&few(), &config(48, 32)).settle();
    strangers(&surfaces(), &config(48, 32)).settle();
}

#[test]
#[ignore = "a campaign of minutes"]
fn what_nobody_sees_does_not_show_anywhere() {
    show("strangers", strangers(&many(), &config(192, 128))).settle();
}

/// Rays of the picture, of each kind, and rays at edges, corners and along
/// surfaces.
fn questions(plain: &Loaded, config: &RenderConfig, hard: usize) -> RayColumns {
    let record = rendered(plain, Precision::Exact, config).record;
    let bounded = plain
        .scene
        .half_spaces
        .is_empty()
        .then(|| hard_rays(&plain.scene, &plain.instances, 3, hard));
    let mut rays = bounded.unwrap_or_default();
    for ray in &record {
        rays.push(DVec3::from_array(ray.org), ray.dir);
    }
    rays
}

fn permuting(scenes: &[(String, Loaded)], config: &RenderConfig, hard: usize) -> Tally {
    let mut tally = Tally::default();
    for (name, plain) in scenes {
        let rays = questions(plain, config, hard);
        let reference = Reference::brute_force(&plain.scene, &plain.instances).expect("few");
        let mut order = Order::shuffled(11);
        let other = remade(&plain.scene, &Change::NONE, &mut order);
        let other = finished(other, plain, &Change::NONE);
        // What the other scene's id is in this one.
        let as_before = |id: HitId| {
            if id == HitId::NONE {
                return id;
            }
            let row = (0..order.roots.len())
                .rev()
                .find(|row| other.instances.before_root(*row) <= id.instance)
                .expect("the first root begins at 0");
            let within = id.instance - other.instances.before_root(row);
            let instance = plain.instances.before_root(order.roots[row]) + within;
            let shape = plain.instances.get(&plain.scene, instance).shape;
            let primitive = match plain.scene.shapes.row(shape) {
                lanecast::internals::scene::Shape::Mesh(mesh) => {
                    order.triangles[mesh.index()][id.primitive as usize]
                }
                _ => id.primitive,
            };
            HitId {
                instance,
                primitive,
            }
        };
        for precision in MODES {
            let of = |it: &Loaded| {
                let world = it.world(Structure::Bvh);
                rays.closest(&world, &it.kernels(precision))
            };
            let (before, after) = (of(plain), of(&other));
            let mut wrong = [0; 2];
            let mut ties = 0;
            for (i, ((t, id), (new_t, new_id))) in before.iter().zip(&after).enumerate() {
                let new_id = as_before(*new_id);
                if new_id == *id {
                    let same = *id == HitId::NONE || t.to_bits() == new_t.to_bits();
                    wrong[1] += usize::from(!same);
                } else if is_tie(&reference, rays.ray(i), [*id, new_id]) {
                    ties += 1;
                } else {
                    wrong[0] += 1;
                }
            }
            tally.rays += before.len();
            tally.ties += ties;
            let wrong = vec![("id", wrong[0]), ("t", wrong[1])];
            // Equal in f32 need not be equal.
            let held = precision != Precision::Fast;
            tally.add(held, format!("{precision:?}, {name}, permuted"), wrong);
        }
    }
    tally
}

#[test]
fn the_order_of_the_input_does_not_show() {
    let tally = permuting(&few(), &config(48, 32), campaign(5_000));
    assert!(tally.ties > 0);
    tally.settle();
    permuting(&surfaces(), &config(48, 32), campaign(5_000)).settle();
}

#[test]
#[ignore = "a campaign of minutes"]
fn the_order_of_the_input_does_not_show_anywhere() {
    let tally = permuting(&many(), &config(192, 128), campaign(200_000));
    show("permuting", tally).settle();
}

/// Twice: the numbers themselves turned, and a transform above the roots.
fn turning(scenes: &[(String, Loaded)], turns: &[Turn], config: &RenderConfig) -> Tally {
    let mut tally = Tally::default();
    for (name, plain) in scenes {
        for precision in MODES {
            let before = rendered(plain, precision, config);
            for turn in turns {
                let change = Change {
                    turn: *turn,
                    scale: 1.0,
                };
                let numbers = remade(&plain.scene, &change, &mut Order::default());
                let numbers = finished(numbers, plain, &change);
                let above = finished(below(&plain.scene, &change), plain, &change);
                for (how, turned) in [("numbers", &numbers), ("a node", &above)] {
                    let after = rendered(turned, precision, config);
                    let what = format!("{precision:?}, {name}, turned {:?} in {how}", turn.from);
                    let (differences, spread) =
                        same_records(&before.record, &after.record, precision);
                    tally.rays += before.record.len();
                    tally.spread += spread;
                    tally.add(precision != Precision::Fast, what, differences);
                }
            }
        }
    }
    tally
}

/// A quarter about an axis, half a turn, and two quarters about two axes.
fn three_turns() -> [Turn; 3] {
    let quarter = Turn::quarters;
    [
        quarter(1, 1),
        quarter(0, 2),
        quarter(2, 3).after(&quarter(0, 1)),
    ]
}

/// All 24 but none.
fn all_turns() -> Vec<Turn> {
    let mut all: Vec<Turn> = Vec::new();
    for (a, b, c) in (0..64).map(|i| (i % 4, i / 4 % 4, i / 16)) {
        let quarter = Turn::quarters;
        let turn = quarter(0, a).after(&quarter(1, b)).after(&quarter(0, c));
        let seen = all.iter().chain([&Turn::NONE]);
        if seen.into_iter().all(|t| *t != turn) {
            all.push(turn);
        }
    }
    assert_eq!(all.len(), 23);
    all
}

#[test]
fn the_axes_do_not_show() {
    let tally = show("turning", turning(&few(), &three_turns(), &config(48, 32)));
    tally.settle();
    assert_eq!(tally.spread.beyond_two, 0, "{:?}", tally.spread);
}

#[test]
#[ignore = "a campaign of minutes"]
fn the_axes_do_not_show_anywhere() {
    let tally = turning(&many(), &all_turns(), &config(96, 64));
    let tally = show("turning", tally);
    tally.settle();
    assert_eq!(tally.spread.beyond_two, 0);
}
