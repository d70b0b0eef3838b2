//! A checked scene, and its answers by every precision and by the reference.

use crate::common::{RayColumns, kernels};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::exact::Line;
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::{Hit, Reference};
use lanecast::internals::scene::{CsgId, Edge, Instances, Scene, SceneBuilder, Shape, ShapeId};
use lanecast::internals::shade::Surface;
use lanecast::internals::trace::{Caching, Crossing, HitId, ShadowCache, TraceScratch, boundaries};
use std::ops::ControlFlow;

/// Precisions that promise the right hit.
pub const RIGHT: [Precision; 2] = [Precision::Guarded, Precision::Exact];
pub const ALL: [Precision; 3] = [Precision::Fast, Precision::Guarded, Precision::Exact];

/// A checked scene.
pub struct Asked {
    pub scene: Scene,
    pub instances: Instances,
}

impl Asked {
    pub fn new(fill: impl FnOnce(&mut SceneBuilder)) -> Asked {
        let mut builder = SceneBuilder::default();
        fill(&mut builder);
        let scene = builder.finish().expect("the test's own scene is sound");
        let instances = Instances::of(&scene).expect("and small");
        Asked { scene, instances }
    }

    /// One shape, where it is.
    pub fn one(make: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Asked {
        Asked::new(|scene| {
            let shape = make(scene);
            scene.instance("", Edge::shape(shape));
        })
    }

    pub fn world(&self) -> World {
        World::build(&self.scene, &self.instances, Structure::Bvh)
    }

    pub fn reference(&self) -> Reference<'_> {
        Reference::new(&self.scene, &self.instances).expect("few instances")
    }

    /// The CSG solid that is the first root.
    pub fn csg(&self) -> CsgId {
        let instance = self.instances.get(&self.scene, 0);
        match self.scene.shapes.row(instance.shape) {
            Shape::Csg(id) => id,
            other => panic!("{other:?}"),
        }
    }
}

/// Whether the line is inside from the start, and all boundaries.
pub fn spans<'a>(world: &'a World, id: CsgId, line: &Line) -> (bool, Vec<Crossing<'a>>) {
    let mut all = Vec::new();
    let from = (line, f64::NEG_INFINITY);
    let scratch = &mut TraceScratch::default();
    let start = boundaries(world.csg(id), &world.scene, from, scratch, |crossing| {
        all.push(crossing);
        ControlFlow::Continue(())
    });
    let outside = |inside: bool, c: &Crossing| {
        assert_ne!(inside, c.enters, "boundaries alternate: {all:?}");
        c.enters
    };
    all.iter().fold(start, outside);
    (start, all)
}

pub fn line(org: [f64; 3], dir: [f64; 3]) -> Line {
    let dir = dir.map(f64::from);
    Line { org, dir }
}

/// What the reference says of each ray.
pub fn nearest_hits(reference: &Reference, rays: &RayColumns) -> Vec<Option<Hit>> {
    let nearest = |i: usize| {
        let (org, dir) = rays.ray(i);
        reference.nearest(org, dir.map(f64::from), f64::INFINITY)
    };
    (0..rays.len()).map(nearest).collect()
}

/// Nearest hits, surfaces and normals, and whether anything is met before several
/// ends, in both precisions that promise to be right, are the reference's.
pub fn agree(asked: &Asked, rays: &RayColumns) -> Vec<Option<Hit>> {
    let (world, reference) = (asked.world(), asked.reference());
    let truth = nearest_hits(&reference, rays);
    for precision in RIGHT {
        let kernels = kernels(precision);
        let answers = rays.closest(&world, &kernels);
        for (i, (said, (t, id))) in truth.iter().zip(&answers).enumerate() {
            let ray = rays.ray(i);
            let own = said.map_or(HitId::NONE, |hit| HitId {
                instance: hit.instance,
                primitive: hit.primitive,
            });
            let context = || format!("{precision:?} {ray:?}: {id:?} at {t}, not {said:?}");
            assert_eq!(*id, own, "{}", context());
            let Some(hit) = said else { continue };
            let size = ray.0.iter().fold(hit.t.abs(), |m, x| m.max(x.abs()));
            let near = if precision == Precision::Exact {
                1e-6
            } else {
                1e-2
            };
            assert!((t - hit.t).abs() <= near * size, "{}", context());
            let surface = Surface::at(&world, precision, ray.0, ray.1, *t, *id);
            // A ray within a face has its normal, too, and rays from a grid meet edges.
            // And t in f32 does not tell the side of a very flat solid from its face.
            let on_grid = ray.0.iter().all(|x| (x * 4.0).fract() == 0.0);
            let unknown = ray.1.contains(&0.0) || on_grid || precision != Precision::Exact;
            assert!(
                unknown || is_normal(&reference, ray, *said, surface.ng),
                "{}: {:?}",
                context(),
                surface.ng
            );
        }
        for part in [f64::INFINITY, 1.5, 0.75] {
            let end = |hit: &Option<Hit>| hit.map_or(f32::INFINITY, |hit| (hit.t * part) as f32);
            let ends: Vec<f32> = truth.iter().map(end).collect();
            let cache = &mut ShadowCache::new(Caching::On);
            let blocked = rays.any(&world, &kernels, &ends, cache);
            for (i, blocked) in blocked.into_iter().enumerate() {
                let hidden = truth[i].is_some_and(|hit| hit.t < f64::from(ends[i]));
                assert_eq!(
                    blocked,
                    hidden,
                    "{precision:?} {:?} to {}",
                    rays.ray(i),
                    ends[i]
                );
            }
        }
    }
    truth
}

/// Whether it is a hit's normal, or at an edge that of a surface beside it.
fn is_normal(
    reference: &Reference,
    (org, dir): ([f64; 3], [f64; 3]),
    hit: Option<Hit>,
    n: DVec3,
) -> bool {
    let like = |hit: &Hit| n.dot(DVec3::from_array(hit.normal)) > 0.9;
    let Some(hit) = hit else { return false };
    let size = org.iter().fold(hit.t.abs(), |m, x| m.max(x.abs()));
    // Past the edge, or to it from the other side; what is there may be thin.
    let beside = |i: usize| {
        let size = size * [1e-7, 1e-9, 1e-11][i / 16];
        let off: [f64; 3] = std::array::from_fn(|k| if i >> k & 1 == 0 { size } else { -size });
        let back = if i & 8 == 0 { 0.0 } else { 0.999 / hit.t };
        let org = std::array::from_fn(|k| org[k] + off[k]);
        let dir = std::array::from_fn(|k| dir[k] - off[k] * back);
        reference.nearest(org, dir, f64::INFINITY)
    };
    like(&hit) || (0..48).filter_map(beside).any(|hit| like(&hit))
}
