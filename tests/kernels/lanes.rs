//! Lanes against scalar, bit by bit: the same source at every width must give
//! the same numbers. A new kernel is one line in `kernels!`.
//!
//! Cases are random at many scales, with degenerate ones seeded among them:
//! zeros, axis-parallel and zero directions, origins on faces, NaN, infinities,
//! the edges of the exponent range.

use crate::common::{Random, campaign};
use glam::DVec3;
use lanecast::accel::Slabs;
use lanecast::geom::*;
use lanecast::math::lanes::*;
use lanecast::math::{Aabb32, Affine, Vec3};

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

/// Object rays: a transform of f64 lanes is the scalar transform of each.
#[test]
fn transforms_of_lanes_are_those_of_points() {
    let mut random = Random(3);
    for _ in 0..campaign(20_000) {
        let numbers = |random: &mut Random| random.numbers().to_array();
        let linear = [(); 3].map(|()| numbers(&mut random));
        let map = Affine::new(linear, numbers(&mut random));
        let points: [[f64; 3]; 16] = std::array::from_fn(|_| numbers(&mut random));
        let column = |k: usize| f64x16::load(&points.map(|p| p[k]));
        let packed = Vec3::new(column(0), column(1), column(2));
        let (moved, turned) = (map.points(packed), map.vectors(packed));
        for (i, p) in points.iter().enumerate() {
            for k in 0..3 {
                same(moved.axis(k).lane(i), map.point(*p)[k]);
                same(turned.axis(k).lane(i), map.vector(*p)[k]);
            }
        }
    }
}

/// Equal bits, or both NaN (whose payloads may differ).
fn same(a: f64, b: f64) {
    assert!(
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
        "{a} {b}"
    );
}

/// The rules of math::lanes, operation by operation, on every pair of a table.
fn rules<L>(fuses: bool)
where
    L: Lanes,
    L::Scalar: Lanes<Scalar = L::Scalar>,
{
    let mut random = Random(11);
    let mut table: Vec<f64> = (0..40).map(|_| random.number()).collect();
    table.extend([
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1.0,
        3.0,
    ]);
    let same = |wide: L, one: L::Scalar, what: &str| {
        for lane in 0..L::COUNT {
            let (a, b) = (wide.lane(lane), one);
            let nan = a.to_f64().is_nan() && b.to_f64().is_nan();
            assert!(nan || a.bits() == b.bits(), "{what}: {a:?} {b:?}");
        }
    };
    let agree = |wide: L::Mask, one: <L::Scalar as Lanes>::Mask, what: &str| {
        let all = if one.any() {
            (1_u64 << L::COUNT) - 1
        } else {
            0
        };
        assert_eq!(u64::from(wide.bits()), all, "{what}");
    };
    for x in &table {
        for y in &table {
            let (a, b) = (
                <L::Scalar as Scalar>::from_f64(*x),
                <L::Scalar as Scalar>::from_f64(*y),
            );
            let (wa, wb) = (L::splat(a), L::splat(b));
            let (x, y) = (a.to_f64(), b.to_f64());
            same(wa + wb, a + b, "+");
            same(wa - wb, a - b, "-");
            same(wa * wb, a * b, "*");
            same(wa / wb, a / b, "/");
            same(-wa, -a, "negation");
            same(wa.abs(), a.abs(), "abs");
            same(Lanes::sqrt(wa), Lanes::sqrt(a), "sqrt");
            same(Lanes::min(wa, wb), Lanes::min(a, b), "min");
            same(Lanes::max(wa, wb), Lanes::max(a, b), "max");
            same(wa.mul_add(wb, wa), Lanes::mul_add(a, b, a), "mul_add");
            agree(wa.lt(wb), a.lt(b), "<");
            agree(wa.le(wb), a.le(b), "<=");
            agree(wa.gt(wb), a.gt(b), ">");
            agree(wa.ge(wb), a.ge(b), ">=");
            agree(wa.eq(wb), a.eq(b), "==");
            // The NaN rule, spelled out.
            let rule = if x < y { a } else { b };
            if x.is_nan() || y.is_nan() {
                same(Lanes::min(wa, wb), rule, "min of NaN");
            }
            // Exact, so the same with and without FMA.
            let ordinary = |x: f64| (1e-9..1e9).contains(&x.abs());
            if ordinary(x) && ordinary(y) {
                let lost = match L::is_double() {
                    true => x.mul_add(y, -(x * y)),
                    false => x * y - (a * b).to_f64(),
                };
                let lost = <L::Scalar as Scalar>::from_f64(lost);
                same(wa.product_error(wb, wa * wb), lost, "what a product lost");
            }
            let rounded = L::narrow(wa.widen());
            same(rounded, a, "widen and narrow");
        }
    }
    // Each lane by itself, to nearest, where it stands.
    for power in (-1080..=1020).step_by(15).chain(-155..-140) {
        let number = |i: usize| (1.0 + 0.013 * i as f64) * libm::ldexp(1.0 / 3.0, power);
        let wide: Vec<f64> = (0..L::COUNT)
            .map(|i| [1.0, -1.0][i % 2] * number(i))
            .collect();
        let narrow = L::narrow(<L::Double as Lanes>::load(&wide));
        for (lane, wide) in wide.iter().enumerate() {
            let expected = <L::Scalar as Scalar>::from_f64(*wide);
            let found = narrow.lane(lane);
            assert_eq!(found.bits(), expected.bits(), "{wide} in lane {lane}");
        }
    }
    // (1 + u)² − (1 + 2u) is u² fused and 0 rounded twice.
    let u = L::Scalar::UNIT_ROUNDOFF.to_f64() * 2.0;
    let x = L::from_f64(1.0 + u);
    let fused = x.mul_add(x, -L::from_f64(1.0 + 2.0 * u));
    let expected = if fuses { u * u } else { 0.0 };
    assert_eq!(fused.lane(0).to_f64(), expected, "the FMA rule");
    for bits in [0_u32, 1, 0b1010, 0xffff, 0x8001] {
        let mask = L::Mask::from_bits(bits);
        let kept = bits & ((1_u64 << L::COUNT) - 1) as u32;
        assert_eq!(mask.bits(), kept);
        assert_eq!((!mask).bits(), !bits & ((1_u64 << L::COUNT) - 1) as u32);
        assert_eq!(mask.any(), kept != 0);
        let chosen = L::select(mask, L::from_f64(1.0), L::from_f64(2.0));
        for lane in 0..L::COUNT {
            let one = bits >> lane & 1 != 0;
            assert_eq!(chosen.lane(lane).to_f64(), if one { 1.0 } else { 2.0 });
        }
    }
}

#[test]
fn the_rules_hold_at_every_width() {
    let hardware = cfg!(target_feature = "fma");
    rules::<f32>(hardware);
    rules::<f32x4>(hardware);
    rules::<f32x8>(hardware);
    rules::<f32x16>(hardware);
    // f64 never fuses: `exact` must not depend on the machine.
    rules::<f64>(false);
    rules::<f64x4>(false);
    rules::<f64x8>(false);
    rules::<f64x16>(false);
}
