//! What does one primitive test cost?
//!
//! Each kernel on sixteen rays, as the machine's f32 and f64 packets and ray by
//! ray. The rays fan out over the primitive, so that some hit and some miss.
//! Asserted: which rays hit, the same at every width.
//!
//! And what does a decision cost that is left to exact arithmetic? Of one ray
//! and a triangle, by the size of integer that it takes; of one ray and any other
//! primitive, with and without a doubt. Asserted: the answers.

mod common;
#[path = "kernels/solids.rs"]
mod solids;

use common::{Native32, Native64, quick};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use lanecast::internals::geom::triangle::exact::{Pair, edge_functions, meet_exact};
use lanecast::internals::geom::*;
use lanecast::internals::math::Vec3;
use lanecast::internals::math::lanes::{Lanes, Mask, Scalar};
use std::cmp::Ordering::{Equal, Less};
use std::hint::black_box;

/// Ray i goes from (0, 0, 4) to (x, y, 0), x and y in a 4×4 grid over ±1.35.
const RAYS: usize = 16;

fn packets<L: Lanes>() -> Vec<Ray<L>> {
    let column = |first: usize, f: &dyn Fn(usize) -> f64| {
        let mut lanes = L::zero().to_array();
        for (i, lane) in lanes.as_mut().iter_mut().enumerate() {
            *lane = L::Scalar::from_f64(f(first + i));
        }
        L::load(lanes.as_ref())
    };
    let firsts = (0..RAYS).step_by(L::COUNT);
    firsts
        .map(|first| {
            let x = column(first, &|i| (i % 4) as f64 * 0.9 - 1.35);
            let y = column(first, &|i| (i / 4) as f64 * 0.9 - 1.35);
            let org = Vec3::splat([0.0, 0.0, 4.0].map(L::Scalar::from_f64));
            Ray::new(org, Vec3::new(x, y, L::from_f64(-4.0)), L::zero())
        })
        .collect()
}

/// Bit i: ray i hits.
fn hits<L: Lanes>(rays: &[Ray<L>], kernel: impl Fn(&Ray<L>) -> Meet<L>) -> u32 {
    let mut bits = 0;
    for (i, ray) in rays.iter().enumerate() {
        bits |= kernel(ray).hit.bits() << (i * L::COUNT);
    }
    bits
}

/// A line per kernel: its name, the rays that hit, and the call.
macro_rules! kernels {
    ($c:ident; $($name:literal, $expected:expr, |$ray:ident, $active:ident| $call:expr;)*) => {
        kernels!(@width $c, "f32 packet", Native32; $($name, $expected, |$ray, $active| $call;)*);
        kernels!(@width $c, "f64 packet", Native64; $($name, $expected, |$ray, $active| $call;)*);
        kernels!(@width $c, "f32 single", f32; $($name, $expected, |$ray, $active| $call;)*);
        kernels!(@width $c, "f64 single", f64; $($name, $expected, |$ray, $active| $call;)*);
    };
    (@width $c:ident, $width:literal, $lanes:ty; $($name:literal, $expected:expr, |$ray:ident, $active:ident| $call:expr;)*) => {{
        let mut group = $c.benchmark_group(concat!("kernels: what does a test of 16 rays cost? ", $width));
        let rays = packets::<$lanes>();
        $(
            let $active = <$lanes as Lanes>::Mask::splat(true);
            let found = hits(&rays, |$ray| $call);
            assert_eq!(found, $expected, "{}, {}: {found:#018b}", $name, $width);
            group.bench_function($name, |b| {
                b.iter(|| {
                    for $ray in black_box(&rays) {
                        black_box($call);
                    }
                });
            });
        )*
        group.finish();
    }};
}

fn kernels(c: &mut Criterion) {
    let center = DVec3::ZERO;
    let sphere = Sphere {
        center,
        radius: 1.0,
    };
    let ellipsoid = Ellipsoid {
        center,
        radii: DVec3::new(1.6, 0.8, 0.5),
    };
    // The same ellipsoid.
    let [a, b, c2] = (ellipsoid.radii * ellipsoid.radii).recip().to_array();
    let quadric = Quadric {
        coefficients: [a, b, c2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0],
    };
    let cuboid = Cuboid {
        min: DVec3::new(-1.0, -0.6, -0.5),
        max: DVec3::new(1.0, 0.6, 0.5),
    };
    let cylinder = Cylinder {
        base: DVec3::new(0.0, -1.0, 0.0),
        top: DVec3::new(0.0, 1.0, 0.0),
        radius: 0.6,
        open: false,
    };
    let cone = Cone {
        base: DVec3::new(0.0, -1.6, 0.0),
        top: DVec3::new(0.0, 1.6, 0.0),
        base_radius: 1.5,
        top_radius: 0.0,
        open: false,
    };
    let pipe = Cone {
        open: true,
        top_radius: 0.6,
        base_radius: 0.6,
        ..cone
    };
    // As tables keep them.
    let cylinder = cylinder.as_cone().upright();
    let (cone, pipe) = (cone.upright(), pipe.upright());
    let ground = [HalfSpace {
        normal: DVec3::Y,
        offset: -0.2,
    }];
    let corners = [
        DVec3::new(-1.2, -1.0, 0.0),
        DVec3::new(1.2, -1.0, 0.0),
        DVec3::new(1.2, 1.0, 0.0),
        DVec3::new(0.0, 0.1, 0.0),
        DVec3::new(-1.2, 1.0, 0.0),
    ];
    let polygon = Polygon {
        points: &corners,
        normal: DVec3::Z,
    };
    let octahedron: Vec<HalfSpace> = (0..8)
        .map(|i: u32| {
            let side = |bit: u32| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
            HalfSpace {
                normal: DVec3::new(side(0), side(1), side(2)),
                offset: 1.4,
            }
        })
        .collect();
    let corners = [[-1.5_f32, -1.2, 0.0], [1.5, -1.2, 0.1], [0.1, 1.5, -0.1]];
    kernels! { c;
        "triangle", 0b0000_0110_0110_0000, |ray, all| triangle::meet(black_box(&corners), ray, all);
        "sphere", 0b0000_0110_0110_0000, |ray, _all| sphere::span(black_box(&sphere), ray).first_beyond(ray.t_min);
        "ellipsoid", 0b0000_0110_0110_0000, |ray, _all| ellipsoid::span(black_box(&ellipsoid), ray).first_beyond(ray.t_min);
        "quadric", 0b0000_0110_0110_0000, |ray, _all| quadric::span(black_box(&quadric), ray).0.first_beyond(ray.t_min);
        "box", 0b0000_0110_0110_0000, |ray, _all| cuboid::span(black_box(&cuboid), ray).first_beyond(ray.t_min);
        "cylinder", 0b0000_0110_0110_0000, |ray, _all| cone::span(black_box(&cylinder), ray).first_beyond(ray.t_min);
        "cone", 0b0000_0110_0110_1111, |ray, _all| cone::span(black_box(&cone), ray).first_beyond(ray.t_min);
        "open cylinder", 0b0110_0110_0110_0110, |ray, _all| cone::meet_side(black_box(&pipe), ray);
        "half-space", 0b0000_0000_1111_1111, |ray, _all| half_space::span(black_box(&ground), ray).first_beyond(ray.t_min);
        "octahedron", 0b0000_0110_0110_0000, |ray, _all| half_space::span(black_box(&octahedron), ray).first_beyond(ray.t_min);
        "polygon of 5", 0b0000_0000_0110_0000, |ray, all| polygon::meet(black_box(&polygon), ray, all);
    }
}

/// Rays down at a triangle, along its first edge where y is 0; x says how many
/// limbs they take.
fn pair(x: f64, y: f64) -> Pair {
    Pair {
        org: [x, y, 4.0],
        dir: [f64::from(0.1_f32), 0.0, -1.0],
        corners: [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.1, 1.5, 0.3]],
    }
}

fn exact(c: &mut Criterion) {
    let mut group = c.benchmark_group("exact: what does a doubtful decision cost?");
    for (name, pair, doubts, met) in [
        ("certain miss", pair(0.0, -1.0), 0, None),
        ("certain hit", pair(0.0, 0.5), 0, Some(Less)),
        ("edge, 1 limb", pair(0.0, 0.0), 1, Some(Less)),
        (
            "corner, 1 limb",
            pair(-1.0 - f64::from(0.4_f32), 0.0),
            2,
            Some(Less),
        ),
        ("edge, 2 limbs", pair(1e-20, 0.0), 1, Some(Less)),
        ("edge, 4 limbs", pair(1e-40, 0.0), 1, Some(Less)),
        ("edge, 33 limbs", pair(1e-200, 0.0), 1, Some(Less)),
    ] {
        let edges = edge_functions(&pair);
        let open = edges.iter().filter(|e| e.sign().is_none()).count();
        let ask = |pair: &Pair, t_max: f64| meet_exact(pair).map(|c| c.order_with(t_max));
        assert_eq!((open, ask(&pair, 100.0)), (doubts, met), "{name}");
        // What has just been asked about a line is known.
        let pairs = [1.0, 2.0].map(|times| Pair {
            dir: pair.dir.map(|x| x * times),
            ..pair
        });
        let mut turn = 0;
        group.bench_function(name, |b| {
            b.iter(|| {
                turn = (turn + 1) % pairs.len();
                ask(black_box(&pairs[turn]), black_box(100.0))
            });
        });
    }
    for (size, x) in [("1 limb", 0.0), ("2 limbs", 1e-20), ("4 limbs", 1e-40)] {
        let edge = pair(x, 0.0);
        let [p, q, _] = edge.corners;
        let neighbour = Pair {
            corners: [q, p, [0.3, -1.0, 0.2]],
            ..edge
        };
        // In one plane, without a common corner.
        let ours = pair(x, 0.5);
        let other = Pair {
            corners: [[-3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.2, 3.0, 0.6]],
            ..ours
        };
        for (name, a, b) in [("neighbours", edge, neighbour), ("equal t", ours, other)] {
            let met = |pair| meet_exact(pair).expect("it is met");
            let (a, b) = (met(&a), met(&b));
            assert_eq!(a.order(&b), Equal, "{name}, {size}");
            group.bench_function(format!("order of {name}, {size}"), |bench| {
                bench.iter(|| black_box(&a).order(black_box(&b)));
            });
        }
        let crossing = meet_exact(&ours).expect("it is met");
        let t = crossing.rounded();
        assert!((t - 3.9).abs() < 1e-6, "{t}");
        group.bench_function(format!("rounded t, {size}"), |b| {
            b.iter(|| black_box(&crossing).rounded());
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = quick(); targets = kernels, exact, solids::exact }
criterion_main!(benches);
