//! The way of a path: once a tile's memory is there, nothing on it allocates.

use lanecast::internals::render::Integrator;
use lanecast::{RenderConfig, Tracer, TracerOptions};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, which counts each thread's allocations.
pub struct Counting;

// SAFETY: all calls go on to the system's allocator with the arguments they came with; the
// counter is a `Cell` without destructor, so reaching it allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(at, layout, size) }
    }
}

/// Counts the allocations of rendering one tile with that many samples on this thread, which is
/// its pool's only one.
fn allocations(tracer: &Tracer, spp: u32) -> u64 {
    let config = RenderConfig {
        width: 32,
        height: 32,
        spp,
        integrator: Integrator::Path,
        max_depth: 8,
        ..RenderConfig::default()
    };
    let before = COUNT.with(Cell::get);
    tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap();
    COUNT.with(Cell::get) - before
}

/// Buffers of the exact fallback on solids, which few rays need: some of them may be needed first,
/// or grow, at any sample.
const LATE_BUFFERS: u64 = 4;

/// Pictures of 64 samples allocate no more than those of 16 but for [`LATE_BUFFERS`], though they
/// have 49,152 paths more: lists of lights, the light tree, the studio's environment, CSG, media that
/// touch, panes, and rough glass.
#[test]
fn paths_do_not_allocate() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build()
        .unwrap();
    let scenes = [
        "light_cornell",
        "light_many",
        "light_part",
        "light_panes",
        "light_water",
        "light_metals",
        "csg_bracket",
    ]
    .map(|name| format!("scenes/{name}.toml"));
    for name in scenes.into_iter().chain([".ci/scenes/frosted.toml".into()]) {
        let path = format!("{}/{name}", env!("CARGO_MANIFEST_DIR"));
        let scene = lanecast::load(Path::new(&path), &Default::default())
            .unwrap()
            .scene;
        let tracer = Tracer::new(&scene, &TracerOptions::default()).unwrap();
        pool.install(|| {
            // Memory that is kept from picture to picture.
            allocations(&tracer, 64);
            let (few, many) = (allocations(&tracer, 16), allocations(&tracer, 64));
            assert!(few > 0);
            assert!(many <= few + LATE_BUFFERS, "{name}: {few}, {many}");
        });
    }
}
