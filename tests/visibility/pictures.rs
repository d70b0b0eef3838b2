//! Every scene of the repository has one hash of its picture per precision, whatever the
//! width, the structure, the threads and the order of tiles.

#![cfg(feature = "all-lanes")]

use crate::common::{ALL_AOVS, Loaded, assets, campaign, hash, in_repository, load};
use lanecast::internals::accel::Structure;
use lanecast::internals::plan::{Kernels, Precision, widths};
use lanecast::internals::render::{RenderConfig, TileOrder};
use lanecast::internals::scene::{CsgSolid, Shape};
use std::path::{Path, PathBuf};

const FILES: [&str; 6] = [
    "meshes/bunny_7k.glb",
    "gltf/many-cubes/many-cubes.gltf",
    "spd/balls_3.nff",
    "spd/teapot_4.nff",
    "spd/tree_7.nff",
    "spd/gears_1.nff",
];

/// A size at which every primitive can be tested, and one of many tiles.
const SMALL: (u32, u32) = (40, 30);
const LARGE: (u32, u32) = (136, 102);

/// The linear scan of more would take minutes.
const FEW: u64 = 20_000;

/// A ray looks at every operand of a CSG solid: many more would take minutes, too.
const FEW_OPERANDS: usize = 1000;

fn config((width, height): (u32, u32)) -> RenderConfig {
    RenderConfig {
        width,
        height,
        aovs: ALL_AOVS,
        ..RenderConfig::default()
    }
}

#[test]
fn one_picture_per_scene_in_f32() {
    one_picture_per_scene(Precision::Fast);
}

#[test]
fn one_picture_per_scene_in_f64() {
    one_picture_per_scene(Precision::Exact);
}

fn one_picture_per_scene(precision: Precision) {
    let scenes = in_repository("scenes");
    let mut files: Vec<PathBuf> = std::fs::read_dir(scenes)
        .map(|d| d.map(|entry| entry.unwrap().path()).collect())
        .unwrap_or_default();
    // Paths have tests of their own.
    let of_light = |f: &Path| {
        f.file_name()
            .is_some_and(|n| n.to_string_lossy().starts_with("light_"))
    };
    files.retain(|f| f.extension().is_some_and(|e| e == "toml") && !of_light(f));
    files.sort();
    if let Some(assets) = assets() {
        files.extend(FILES.map(|f| assets.join(f)));
    }
    // Evenly, if not all.
    let step = files.len().div_ceil(campaign(files.len()));
    for file in files.into_iter().step_by(step) {
        let loaded = load(&file, 4.0 / 3.0);
        if most_operands(&loaded) > FEW_OPERANDS {
            println!("skipped: {}", file.display());
            continue;
        }
        let [small, large] = hashes(&file, &loaded, precision);
        let name = file.file_name().unwrap_or_default().display();
        println!("{name} {precision:?}: {small:016x} small, {large:016x} large");
    }
}

/// Of its CSG solids, unfolded.
fn most_operands(loaded: &Loaded) -> usize {
    let shapes = loaded.scene.shapes.rows.iter();
    let operands = shapes.map(|shape| match shape {
        Shape::Csg(id) => CsgSolid::of(&loaded.scene, *id).operands.len(),
        _ => 0,
    });
    operands.max().unwrap_or(0)
}

fn hashes(file: &Path, loaded: &Loaded, precision: Precision) -> [u64; 2] {
    let base = loaded.kernels(precision);
    let of = |world: &_, lanes, config: &RenderConfig| {
        let kernels = Kernels { lanes, ..base };
        let rendered = loaded.render(world, kernels, &loaded.scene.lights, config);
        assert!(rendered.counts.primary_hits > 0, "{}", file.display());
        hash(&rendered)
    };
    let bvh = loaded.world(Structure::Bvh);
    let large = of(&bvh, 8, &config(LARGE));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.unwrap();
        for (lanes, tiles) in [
            (1, TileOrder::Reverse),
            (4, TileOrder::Small),
            (8, TileOrder::Small),
            (16, TileOrder::Spread),
        ] {
            let config = RenderConfig {
                tiles,
                ..config(LARGE)
            };
            let got = pool.install(|| of(&bvh, lanes, &config));
            let file = file.display();
            assert_eq!(
                got, large,
                "{file}: {precision:?}, {lanes} lanes, {threads} threads"
            );
        }
    }
    let small = of(&bvh, 8, &config(SMALL));
    if loaded.scene.meshes.triangles.len() as u64 + loaded.instances.count() > FEW {
        return [small, large];
    }
    let linear = loaded.world(Structure::Linear);
    for lanes in widths() {
        for world in [&bvh, &linear] {
            let got = of(world, lanes, &config(SMALL));
            let structure = world.accelerator.tlas_figures().nodes;
            let file = file.display();
            assert_eq!(
                got, small,
                "{file}: {precision:?}, {lanes} lanes, {structure} nodes"
            );
        }
    }
    [small, large]
}
