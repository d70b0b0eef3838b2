//! Compares every kernel at every width of lanes with one lane, bit by bit. A new kernel is
//! one line in `kernels!`.
//!
//! Cases are random at many scales, with degenerate ones among them: zeros, axis-parallel and
//! zero directions, origins on faces, NaN, infinities, the ends of the exponent range.

mod rules;

use crate::common::{Random, campaign};
use glam::DVec3;
use lanecast::internals::accel::Slabs;
use lanecast::internals::geom::*;
use lanecast::internals::math::lanes::*;
use lanecast::internals::math::{Aabb32, Vec3};

/// Cases of each kernel and width, at the campaign's full size.
const CASES: usize = 1_000_000;

/// Numbers of all kinds.
trait Wild {
    fn number(&mut self) -> f64;
    fn numbers(&mut self) -> DVec3;
    fn sane(&mut self) -> DVec3;
    fn positive(&mut self) -> f64;
}

impl Wild for Random {
    /// Mostly of ordinary size; one in eight from the corners of the format.
    fn number(&mut self) -> f64 {
        const CORNERS: [f64; 14] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            1e-30,
            -1e-30,
            1e30,
            -1e30,
            1e-42,
            1e-310,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        match self.below(16) {
            0 => CORNERS[self.below(CORNERS.len() as u64) as usize],
            1 => CORNERS[self.below(4) as usize],
            2 => self.unit() * 1e-6,
            3 => self.unit() * 1e6,
            _ => self.unit(),
        }
    }

    fn numbers(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    /// Numbers that the scene's check would let through.
    fn sane(&mut self) -> DVec3 {
        self.vector() * 2.0
    }

    fn positive(&mut self) -> f64 {
        match self.below(8) {
            0 => 1e-6,
            1 => 1e6,
            _ => self.unit().abs() + 1e-3,
        }
    }
}

/// One lane's ray. A third aims at the origin's surroundings, so that hits are
/// common.
fn ray(random: &mut Random) -> ([f64; 3], [f64; 3], f64) {
    let (org, dir) = match random.below(3) {
        0 => (random.numbers(), random.numbers()),
        1 => {
            let org = random.sane() * 3.0;
            let aim = random.sane() * 0.5;
            (org, aim - org)
        }
        _ => {
            // Axis-parallel, from a lattice point: on faces, edges and corners.
            let axis = DVec3::AXES[random.below(3) as usize];
            let org = (random.sane() * 2.0).round();
            (org, if random.below(2) == 0 { axis } else { -axis })
        }
    };
    (org.to_array(), dir.to_array(), 0.0)
}

fn pack<L: Lanes>(rays: &[([f64; 3], [f64; 3], f64)]) -> Ray<L> {
    let column = |f: &dyn Fn(usize) -> f64| {
        let mut lanes = L::zero().to_array();
        for (i, lane) in lanes.as_mut().iter_mut().enumerate() {
            *lane = L::Scalar::from_f64(f(i));
        }
        L::load(lanes.as_ref())
    };
    let org = |k: usize| column(&|i| rays[i].0[k]);
    let dir = |k: usize| column(&|i| rays[i].1[k]);
    Ray::new(
        Vec3::new(org(0), org(1), org(2)),
        Vec3::new(dir(0), dir(1), dir(2)),
        column(&|i| rays[i].2),
    )
}

/// Everything that a kernel gives, in bits: hits, and t where there is one.
fn bits_of<L: Lanes>(meet: &Meet<L>, lane: usize) -> Option<u64> {
    (meet.hit.bits() >> lane & 1 != 0).then(|| meet.t.lane(lane).bits())
}

/// Runs `kernel` at width L and lane by lane at one lane, over a campaign of `CASES` rays.
fn compare<L, P>(
    name: &str,
    primitive: impl Fn(&mut Random) -> P,
    wide: impl Fn(&P, &Ray<L>) -> Meet<L>,
    narrow: impl Fn(&P, &Ray<L::Scalar>) -> Meet<L::Scalar>,
) where
    L: Lanes,
    L::Scalar: Lanes<Scalar = L::Scalar>,
{
    let mut random = Random(0x1a7e ^ (L::COUNT as u64) << 32);
    let (mut hits, mut cases) = (0, 0);
    let all_cases = campaign(CASES);
    while cases < all_cases {
        let row = primitive(&mut random);
        for _ in 0..8 {
            let rays: Vec<_> = (0..L::COUNT).map(|_| ray(&mut random)).collect();
            let all = wide(&row, &pack::<L>(&rays));
            for (lane, one) in rays.iter().enumerate() {
                let alone = narrow(&row, &pack::<L::Scalar>(std::slice::from_ref(one)));
                let (a, b) = (bits_of(&all, lane), bits_of(&alone, 0));
                assert_eq!(a, b, "{name} at {} lanes, lane {lane}: {one:?}", L::COUNT);
                hits += usize::from(a.is_some());
            }
            cases += L::COUNT;
        }
    }
    // A kernel that never hits would prove nothing.
    assert!(hits * 200 > cases, "{name}: {hits} hits of {cases}");
}

macro_rules! kernels {
    ($($name:ident: $primitive:expr, $kernel:expr;)*) => {$(
        #[test]
        fn $name() {
            macro_rules! at {
                ($lanes:ty) => {
                    compare::<$lanes, _>(
                        stringify!($name),
                        $primitive,
                        |p, ray| {
                            fn typed<P, L: Lanes>(
                                p: &P,
                                ray: &Ray<L>,
                                f: impl Fn(&P, &Ray<L>) -> Meet<L>,
                            ) -> Meet<L> {
                                f(p, ray)
                            }
                            typed(p, ray, $kernel)
                        },
                        |p, ray| {
                            fn typed<P, L: Lanes>(
                                p: &P,
                                ray: &Ray<L>,
                                f: impl Fn(&P, &Ray<L>) -> Meet<L>,
                            ) -> Meet<L> {
                                f(p, ray)
                            }
                            typed(p, ray, $kernel)
                        },
                    )
                };
            }
            at!(f32x4);
            at!(f32x8);
            at!(f32x16);
            at!(f64x4);
            at!(f64x8);
            at!(f64x16);
        }
    )*};
}

fn some_cone(random: &mut Random, open: bool) -> Cone {
    let base = random.sane();
    let base_radius = random.positive();
    Cone {
        base,
        top: base + random.sane() + DVec3::X * 1e-3,
        base_radius,
        top_radius: match random.below(3) {
            0 => 0.0,
            1 => base_radius,
            _ => random.positive(),
        },
        open,
    }
}

fn planes(random: &mut Random) -> Vec<HalfSpace> {
    (0..6)
        .map(|i| HalfSpace {
            normal: DVec3::AXES[i % 3] * if i < 3 { 1.0 } else { -1.0 } + random.sane() * 0.1,
            offset: random.positive().min(2.0),
        })
        .collect()
}

fn outline(random: &mut Random) -> (Vec<DVec3>, DVec3) {
    let (u, v) = (random.sane(), random.sane());
    let center = random.sane() * 0.3;
    let corners = 3 + random.below(6);
    let points: Vec<DVec3> = (0..corners)
        .map(|i| {
            let turn = i as f64 / corners as f64 * std::f64::consts::TAU;
            let r = 0.3 + random.unit().abs();
            center + u * (turn.cos() * r) + v * (turn.sin() * r)
        })
        .collect();
    let normal = u.cross(v).normalize_or(DVec3::Y);
    (points, normal)
}

/// Some of its coefficients are nothing.
fn some_quadric(random: &mut Random) -> Quadric {
    let mut coefficients = [0.0; 10];
    for x in &mut coefficients {
        if random.below(3) > 0 {
            *x = random.number();
        }
    }
    Quadric { coefficients }
}

kernels! {
    triangle_kernel:
        |random: &mut Random| [(); 3].map(|()| random.numbers().to_array().map(|x| x as f32)),
        |corners, ray| triangle::meet(corners, ray, Mask::splat(true));
    sphere_kernel:
        |random: &mut Random| Sphere { center: random.sane(), radius: random.positive() },
        |row, ray| sphere::span(row, ray).first_beyond(ray.t_min);
    ellipsoid_kernel:
        |random: &mut Random| Ellipsoid {
            center: random.sane(),
            radii: DVec3::new(random.positive(), random.positive(), random.positive()),
        },
        |row, ray| ellipsoid::span(row, ray).first_beyond(ray.t_min);
    closed_cone_kernel:
        |random: &mut Random| some_cone(random, false),
        |row, ray| cone::span(&row.upright(), ray).first_beyond(ray.t_min);
    open_cone_kernel:
        |random: &mut Random| some_cone(random, true),
        |row, ray| cone::meet_side(&row.upright(), ray);
    cuboid_kernel:
        |random: &mut Random| {
            let min = random.sane().round();
            let size = DVec3::new(random.positive(), random.positive(), random.positive());
            Cuboid { min, max: min + size }
        },
        |row, ray| cuboid::span(row, ray).first_beyond(ray.t_min);
    half_space_kernel:
        |random: &mut Random| HalfSpace { normal: random.numbers(), offset: random.number() },
        |row, ray| half_space::span(std::slice::from_ref(row), ray).first_beyond(ray.t_min);
    polyhedron_kernel:
        planes,
        |rows, ray| half_space::span(rows, ray).first_beyond(ray.t_min);
    polygon_kernel:
        outline,
        |(points, normal), ray| {
            let polygon = Polygon { points, normal: *normal };
            polygon::meet(&polygon, ray, Mask::splat(true))
        };
    quadric_kernel:
        some_quadric,
        |row, ray| quadric::span(row, ray).0.first_beyond(ray.t_min);
    guarded_quadric_kernel:
        some_quadric,
        |row, ray| guarded::quadric::meet(row, &in_full(ray).rays(), Mask::splat(true));
    guarded_sphere_kernel:
        |random: &mut Random| Sphere { center: random.sane(), radius: random.positive() },
        |row, ray| guarded::sphere::meet_sphere(row, &in_full(ray).rays(), Mask::splat(true));
    guarded_ellipsoid_kernel:
        |random: &mut Random| Ellipsoid {
            center: random.sane(),
            radii: DVec3::new(random.positive(), random.positive(), random.positive()),
        },
        |row, ray| guarded::sphere::meet_ellipsoid(row, &in_full(ray).rays(), Mask::splat(true));
    guarded_closed_cone_kernel:
        |random: &mut Random| some_cone(random, false),
        |row, ray| guarded::cone::meet(&row.upright(), &in_full(ray).rays(), Mask::splat(true));
    guarded_open_cone_kernel:
        |random: &mut Random| some_cone(random, true),
        |row, ray| guarded::cone::meet(&row.upright(), &in_full(ray).rays(), Mask::splat(true));
    guarded_cylinder_kernel:
        |random: &mut Random| {
            let open = random.below(2) == 0;
            let cone = some_cone(random, open);
            Cone { top_radius: cone.base_radius, ..cone }
        },
        |row, ray| {
            guarded::cone::meet_cylinder(&row.upright(), &in_full(ray).rays(), Mask::splat(true))
        };
    guarded_cuboid_kernel:
        |random: &mut Random| {
            let min = random.sane().round();
            let size = DVec3::new(random.positive(), random.positive(), random.positive());
            Cuboid { min, max: min + size }
        },
        |row, ray| guarded::cuboid::meet(row, &in_full(ray).rays(), Mask::splat(true));
    guarded_half_space_kernel:
        |random: &mut Random| HalfSpace { normal: random.numbers(), offset: random.number() },
        |row, ray| guarded::half_space::meet(row, &in_full(ray).rays(), Mask::splat(true));
    guarded_polyhedron_kernel:
        planes,
        |rows, ray| {
            let all = Mask::splat(true);
            guarded::half_space::meet_polyhedron(rows, DVec3::ONE, &in_full(ray).rays(), all)
        };
    guarded_polygon_kernel:
        outline,
        |(points, normal), ray| {
            let polygon = Polygon { points, normal: *normal };
            guarded::polygon::meet(&polygon, 12.0, &in_full(ray).rays(), Mask::splat(true))
        };
    // The interval's two ends as two meetings: each must agree.
    slab_entry:
        |random: &mut Random| (random.sane(), random.positive()),
        |row, ray| slab(row, ray).0;
    slab_exit:
        |random: &mut Random| (random.sane(), random.positive()),
        |row, ray| slab(row, ray).1;
}

/// A ray whose numbers in full are the rounded ones.
struct InFull<'a, L: Lanes> {
    org: Vec3<L::Double>,
    dir: Vec3<L::Double>,
    ray: &'a Ray<L>,
}

fn in_full<L: Lanes>(ray: &Ray<L>) -> InFull<'_, L> {
    let widen = |v: Vec3<L>| Vec3::new(v.x.widen(), v.y.widen(), v.z.widen());
    InFull {
        org: widen(ray.org),
        dir: widen(ray.dir),
        ray,
    }
}

impl<L: Lanes> InFull<'_, L> {
    fn rays(&self) -> guarded::ObjectRay<'_, L> {
        guarded::ObjectRay::new(&self.org, &self.dir, self.ray)
    }
}

fn slab<L: Lanes>((center, size): &(DVec3, f64), ray: &Ray<L>) -> (Meet<L>, Meet<L>) {
    let bounds = Aabb32 {
        min: (*center - *size).to_array().map(|x| x as f32),
        max: (*center + *size).to_array().map(|x| x as f32),
    };
    let slabs = Slabs::new(ray.org, ray.dir, &bounds);
    let (enter, exit) = slabs.interval(bounds.min, bounds.max);
    let some = enter.le(exit);
    (Meet::certain(some, enter), Meet::certain(some, exit))
}
