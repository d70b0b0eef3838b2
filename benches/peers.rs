//! How do our kernels compare with another Rust tracer on the same rays?
//!
//! obvhs traces one ray at a time through compressed eight-wide trees; ours
//! takes the rays as an array, in f32 at the machine's width. The same displaced
//! sphere, the same arrays in, t and id (or a shadow) out, one thread. Asserted
//! outside the timing: every ray's answer, but for edges. Embree is measured by
//! `lanecast bench --peers embree`.

mod common;

use common::{Traced, displaced_sphere, mesh_scene, one_thread, quick, run, traced};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3A;
use lanecast::internals::io::RaySet;
use lanecast::internals::measure::queries::{Answers, Ask};
use lanecast::internals::measure::ray_kinds::Kind;
use lanecast::internals::scene::{Instances, MeshData};
use lanecast::internals::trace::HitId;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::time::Duration;

const SIDE: u32 = 256;
const KINDS: [Kind; 4] = [Kind::Primary, Kind::Shadow, Kind::Diffuse, Kind::DiffuseAny];
/// Rays whose answer may depend on rounding, at edges.
const SLACK: usize = 4;

/// obvhs's tree, and its triangles in the order of the leaves.
struct Peer {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Peer {
    fn of(mesh: &MeshData) -> Peer {
        let corner = |i: u32| {
            let position = mesh.positions[i as usize].map(|x| x as f32);
            Vec3A::from_array(position)
        };
        let triangle = |t: &[u32; 3]| Triangle {
            v0: corner(t[0]),
            v1: corner(t[1]),
            v2: corner(t[2]),
        };
        let all: Vec<Triangle> = mesh.triangles.iter().map(triangle).collect();
        let setting = BvhBuildParams::very_slow_build();
        let tree = build_cwbvh_from_tris(&all, setting, &mut Duration::default());
        let order = tree.primitive_indices.iter();
        let triangles = order.map(|i| RtTriangle::from(&all[*i as usize])).collect();
        Peer { tree, triangles }
    }

    fn trace(&self, rays: &RaySet, ask: Ask, answers: &mut Answers) {
        let ray = |i: usize| {
            let [org, dir] = [rays.org(i), rays.dir(i)].map(Vec3A::from_array);
            Ray::new(org, dir, rays.t_min[i], rays.t_max[i])
        };
        let meet = |ray: &Ray, at: usize| self.triangles[at].intersect(ray);
        match ask {
            Ask::Closest => {
                for (i, t) in answers.t.iter_mut().enumerate() {
                    let mut hit = RayHit::none();
                    let id = if self.tree.ray_traverse(ray(i), &mut hit, meet) {
                        *t = hit.t;
                        HitId {
                            instance: 0,
                            primitive: self.tree.primitive_indices[hit.primitive_id as usize],
                        }
                    } else {
                        HitId::NONE
                    };
                    answers.id.set(i, id);
                }
            }
            Ask::Any => {
                for (i, blocked) in answers.blocked.iter_mut().enumerate() {
                    *blocked = !self.tree.ray_traverse_miss(ray(i), meet);
                }
            }
        }
    }
}

fn differing(a: &Answers, b: &Answers) -> usize {
    let ids = a.id.iter().zip(b.id.iter()).filter(|(a, b)| a != b).count();
    let blocked = a.blocked.iter().zip(&b.blocked);
    ids + blocked.filter(|(a, b)| a != b).count()
}

fn peers(c: &mut Criterion) {
    let pool = one_thread();
    let mesh = displaced_sphere(320, 160);
    let scene = mesh_scene(&mesh);
    let instances = Instances::of(&scene).expect("few instances");
    let work: Traced = traced(&scene, &instances, &KINDS, SIDE);
    let peer = Peer::of(&mesh);
    let modes = || work.modes.iter();
    let (_, exact) = modes()
        .find(|(name, _)| *name == "exact")
        .expect("both are there");
    let (_, fast) = modes()
        .find(|(name, _)| *name == "fast")
        .expect("both are there");

    let mut group = c.benchmark_group("peers: how do ours and obvhs compare?");
    for (number, (kind, rays)) in work.rays.iter().enumerate() {
        group.throughput(Throughput::Elements(rays.len() as u64));
        let mut expected = Answers::default();
        pool.install(|| run(&work, exact, number, &mut expected));
        let mut answers = expected.clone();
        pool.install(|| run(&work, fast, number, &mut answers));
        let differ = differing(&answers, &expected);
        assert!(differ <= SLACK, "{}, ours: {differ} differ", kind.name());
        group.bench_function(format!("{}/lanecast fast", kind.name()), |b| {
            b.iter(|| pool.install(|| run(&work, fast, number, &mut answers)));
        });
        peer.trace(rays, kind.ask(), &mut answers);
        let differ = differing(&answers, &expected);
        assert!(differ <= SLACK, "{}, obvhs: {differ} differ", kind.name());
        group.bench_function(format!("{}/obvhs cwbvh", kind.name()), |b| {
            b.iter(|| peer.trace(rays, kind.ask(), &mut answers));
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = quick(); targets = peers }
criterion_main!(benches);
