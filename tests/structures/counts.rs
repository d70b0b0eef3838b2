//! Traces the rays of the Standard Procedural Databases' pictures through every structure:
//! the hits are the same, and each structure counts its steps and tests.
//!
//! The counts per ray stand beside those of Havran and Sixta (1999) in docs/GRIDS.md; this
//! prints them:
//!
//! ```text
//! cargo test --release --test structures -- counts --nocapture --test-threads=1
//! ```

use crate::common::{Loaded, assets, load};
use lanecast::internals::accel::{
    Accelerator, BaselineAccelerator, Count, Counter, Counts, Density, Figures, Structure, World,
};
use lanecast::internals::geom::Guarded;
use lanecast::internals::math::Vec3;
use lanecast::internals::plan::Precision;
use lanecast::internals::render::{Grid, Progress, RenderConfig, View, render};
use lanecast::internals::trace::{
    AnyHit, Closest, HitId, Outcome, Packet, RayKind, Tester, TraceScratch, TracedRay,
};
use std::time::Instant;

/// One ray in so many is traced again.
const STRIDE: usize = 13;

/// All rays of the picture that the published figures are about.
fn rays(loaded: &Loaded) -> Vec<TracedRay> {
    let world = loaded.world(Structure::Bvh);
    let view = View {
        world: &world,
        kernels: loaded.kernels(Precision::Guarded),
        camera: loaded.camera,
        lights: &loaded.scene.lights,
    };
    let config = RenderConfig {
        width: 513,
        height: 513,
        grid: Grid::Corners,
        ..RenderConfig::default()
    };
    let rendered = render(&view, &config, true, &Progress::default()).unwrap();
    rendered.record.into_iter().step_by(STRIDE).collect()
}

/// Traces each ray anew, at one lane, and compares. No occluder is tried first.
fn replay(world: &World, levels: &BaselineAccelerator, rays: &[TracedRay]) -> (Counts, Figures) {
    let counter = Counter::default();
    let count = Count(Some(&counter));
    let mut scratch = [levels.tlas.scratch::<f32>(), levels.tlas.scratch::<f32>()];
    let trace = &mut TraceScratch::default();
    for ray in rays {
        let dir = ray.dir.map(f64::from);
        let packet = Packet::<f32>::new(Vec3::splat(ray.org), Vec3::splat(dir), 0.0, &world.bounds);
        let mut tester = Tester::<f32, Guarded>::new(world, &packet, trace);
        if let RayKind::Shadow { .. } = ray.kind {
            let mut query = AnyHit::<f32>::new(ray.t_max);
            tester.trace(levels, &mut query, &mut scratch, count);
            assert_eq!(query.blocked(), ray.outcome == Outcome::Blocked, "{ray:?}");
            continue;
        }
        let mut query = Closest::<f32, Guarded>::new(ray.t_max);
        tester.trace(levels, &mut query, &mut scratch, count);
        let id = query.id(0);
        match ray.outcome {
            Outcome::Hit {
                t,
                instance,
                primitive,
                ..
            } => {
                assert_eq!(
                    (query.t(0), id.instance, id.primitive),
                    (t, instance, primitive)
                );
            }
            _ => assert_eq!(id, HitId::NONE, "{ray:?}"),
        }
    }
    (counter.counts(), levels.tlas.figures())
}

fn measure(name: &str, world: &World, rays: &[TracedRay]) -> Counts {
    let start = Instant::now();
    let Accelerator::Baseline(levels) = &world.accelerator else {
        return Counts::default();
    };
    let (counts, figures) = replay(world, levels, rays);
    let per_ray = |n: u64| n as f64 / rays.len() as f64;
    println!(
        "    {name:22} {:8.2} steps {:8.2} tests {:7.2} spared {:8.0} ns, {} nodes or cells, {} references",
        per_ray(counts.nodes),
        per_ray(counts.tests),
        per_ray(counts.spared),
        start.elapsed().as_nanos() as f64 / rays.len() as f64,
        figures.nodes,
        figures.references,
    );
    counts
}

fn every_ray_has_the_same_answer(file: &str) {
    let Some(assets) = assets() else { return };
    let loaded = load(&assets.join(format!("spd/{file}.nff")), 1.0);
    let rays = rays(&loaded);
    println!("{file}: {} rays", rays.len());
    let of_grids = |density| loaded.world(Structure::Grid(density));
    let two = |cells, dense, inner| Density {
        cells,
        dense,
        inner,
    };
    measure("grid, 1 a primitive", &of_grids(Density::flat(1.0)), &rays);
    measure("grid, 10", &of_grids(Density::flat(10.0)), &rays);
    for (cells, dense, inner) in [(1.0, 8, 1.0), (2.0, 16, 2.0), (2.0, 8, 4.0), (8.0, 16, 2.0)] {
        let name = format!("{cells}, from {dense} on {inner}");
        measure(&name, &of_grids(two(cells, dense, inner)), &rays);
    }
    let [ordered, best] = [
        ("ordered stack", Structure::Narrow),
        ("heap", Structure::Heap),
    ]
    .map(|(name, structure)| {
        let world = loaded.world(structure);
        measure(name, &world, &rays);
        let shadow = |ray: &&TracedRay| matches!(ray.kind, RayKind::Shadow { .. });
        let nearest: Vec<TracedRay> = rays.iter().filter(|r| !shadow(r)).copied().collect();
        measure("  all but shadow rays", &world, &nearest)
    });
    measure(
        "heap, spheres",
        &loaded.world(Structure::HeapSpheres),
        &rays,
    );
    // For nearest hits, best first opens the fewest nodes of a tree.
    assert!(best.nodes <= ordered.nodes, "{best:?} {ordered:?}");
}

/// One test a scene, so that they share the machine.
macro_rules! scenes {
    ($($file:ident)*) => { $(
        #[test]
        fn $file() {
            every_ray_has_the_same_answer(stringify!($file));
        }
    )* };
}

scenes! { balls_4 gears_4 mount_6 rings_7 teapot_12 tetra_6 tree_11 }
