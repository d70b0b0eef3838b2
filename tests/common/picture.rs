//! Renders a picture by a given structure, precision and width, and hashes all of its bits.

use lanecast::internals::accel::{Density, KdQuality, Structure, World};
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::render::{AovSet, Progress, RenderConfig, Rendered, View, render};
use lanecast::internals::scene::{Camera, Instances, Light, Scene};

pub const ALL_AOVS: AovSet = AovSet {
    depth: true,
    position: true,
    normal: true,
    albedo: true,
    instance_id: true,
    primitive_id: true,
    samples: true,
    ..AovSet::NONE
};

/// How a picture is computed; nothing of it may show.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub precision: Precision,
    pub lanes: usize,
    pub structure: Structure,
}

/// All that find primitives.
pub fn structures() -> [Structure; 8] {
    [
        Structure::Linear,
        Structure::Bvh,
        Structure::Nested,
        Structure::Narrow,
        Structure::Kd(KdQuality::default()),
        Structure::Grid(Density::default()),
        Structure::Heap,
        Structure::HeapSpheres,
    ]
}

/// Kernels of a precision at the machine's own width.
pub fn kernels(precision: Precision) -> Kernels {
    let lanes = native_width();
    Kernels { precision, lanes }
}

pub fn picture(
    scene: &Scene,
    camera: Camera,
    lights: &[Light],
    way: Way,
    config: &RenderConfig,
) -> Rendered {
    let instances = Instances::of(scene).expect("checked");
    let world = World::build(scene, &instances, way.structure);
    let view = View {
        world: &world,
        kernels: Kernels {
            precision: way.precision,
            lanes: way.lanes,
        },
        camera,
        lights,
    };
    render(&view, config, false, &Progress::default()).expect("nobody interrupts")
}

/// FNV-1a over every bit of every channel, and the counts.
pub fn hash(rendered: &Rendered) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |bits: u64| {
        for byte in bits.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    let picture = &rendered.picture;
    let triples = [&picture.position, &picture.normal, &picture.albedo];
    let triples = triples.into_iter().flatten().chain([&picture.color]);
    for value in triples.flatten().flatten() {
        eat(u64::from(value.to_bits()));
    }
    for depth in picture.depth.iter().flatten() {
        eat(u64::from(depth.to_bits()));
    }
    for id in picture.instance_id.iter().flatten() {
        eat(*id);
    }
    for id in picture.primitive_id.iter().flatten() {
        eat(u64::from(*id));
    }
    let counts = &rendered.counts;
    eat(counts.primary_hits);
    eat(counts.shadow);
    eat(counts.shadow_occluded);
    eat(counts.reflection);
    eat(counts.refraction);
    hash
}
