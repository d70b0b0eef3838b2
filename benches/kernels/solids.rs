//! Decisions about solids: what f64 knows, and what it leaves open.

use criterion::Criterion;
use glam::DVec3;
use lanecast::internals::geom::exact::{Line, Root, Solid, first_beyond};
use lanecast::internals::geom::{Cone, Cuboid, Ellipsoid, HalfSpace, Polygon, Quadric, Sphere};
use std::hint::black_box;

/// A name, the primitive, a ray that certainly meets it, and one that touches it
/// in one point, as f64 cannot tell.
type Row<'a> = (&'static str, Solid<'a>, Line, Option<Line>);

fn line(org: [f64; 3], dir: [f64; 3]) -> Line {
    Line { org, dir }
}

fn first<'a>(solid: &Solid<'a>, line: &Line) -> Root<'a> {
    first_beyond(solid, line, 0.0).expect("it is met")
}

pub fn exact(c: &mut Criterion) {
    let mut group = c.benchmark_group("exact: what does a doubtful decision about a solid cost?");
    let square = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)];
    let square = square.map(|(x, y)| DVec3::new(x, y, 0.1));
    // The second row of a Pythagorean quadruple is perpendicular to the first.
    let (touch, across) = ([2.0, 3.0, 6.0], [3.0, -2.0, 0.0]);
    let beside: [f64; 3] = std::array::from_fn(|k| touch[k] - 4.0 * across[k]);
    let cone = |base_radius, top_radius| {
        Solid::Cone(Cone {
            base: DVec3::new(0.0, -4.0, 0.0),
            top: DVec3::new(0.0, 8.0, 0.0),
            base_radius,
            top_radius,
            open: false,
        })
    };
    let hit = line([0.3, 0.4, 40.1], [0.011, 0.021, -1.3]);
    let rows: [Row; 8] = [
        (
            "half-space",
            Solid::HalfSpace(HalfSpace {
                normal: DVec3::new(0.1, 1.0, 0.2),
                offset: 0.3,
            }),
            hit,
            None,
        ),
        (
            "box",
            Solid::Cuboid(Cuboid {
                min: DVec3::new(-1.0, -1.1, -1.2),
                max: DVec3::new(1.0, 1.1, 1.2),
            }),
            hit,
            Some(line([0.25, 1.1 + 4.0, 1.2 - 4.0], [0.0, -1.0, 1.0])),
        ),
        (
            "sphere",
            Solid::Sphere(Sphere {
                center: DVec3::ZERO,
                radius: 7.0,
            }),
            hit,
            Some(line(beside, across)),
        ),
        (
            "ellipsoid",
            Solid::Ellipsoid(Ellipsoid {
                center: DVec3::ZERO,
                radii: DVec3::new(7.0, 14.0, 7.0),
            }),
            hit,
            Some(line(
                [beside[0], 2.0 * beside[1], beside[2]],
                [across[0], 2.0 * across[1], across[2]],
            )),
        ),
        (
            "quadric",
            Solid::Quadric(Quadric {
                coefficients: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -49.0],
            }),
            hit,
            Some(line(beside, across)),
        ),
        (
            "cylinder",
            cone(5.0, 5.0),
            hit,
            Some(line([3.0 + 4.0, 0.5, 4.0 - 3.0], [-4.0, 0.25, 3.0])),
        ),
        (
            "cone",
            cone(0.0, 15.0),
            hit,
            // At height 0 its radius is 5; along the side and across it.
            Some(line([5.0, -8.0, -10.0], [-1.0, 4.0, 7.0])),
        ),
        (
            "polygon",
            Solid::Polygon(Polygon {
                points: &square,
                normal: DVec3::Z,
            }),
            hit,
            Some(line([2.0, 0.25, 4.1], [0.0, 0.0, -1.0])),
        ),
    ];
    for (name, solid, hit, touch) in &rows {
        let ask = |line: &Line| first_beyond(black_box(solid), black_box(line), 0.0);
        assert!(ask(hit).is_some(), "{name}");
        group.bench_function(format!("{name}, certain"), |b| b.iter(|| ask(hit)));
        if let Some(touch) = touch {
            assert!(ask(touch).is_some(), "{name} is touched");
            group.bench_function(format!("{name}, touched"), |b| b.iter(|| ask(touch)));
        }
        let root = first(solid, hit);
        let t = root.rounded();
        assert!((t - root.t.value).abs() <= root.t.error, "{name}");
        group.bench_function(format!("{name}, t beside a number"), |b| {
            b.iter(|| black_box(&root).order_with(black_box(t)));
        });
        group.bench_function(format!("{name}, t rounded"), |b| {
            b.iter(|| black_box(&root).rounded());
        });
    }
    // At the same place, without being the same.
    let ray = line([20.0, 30.0, 60.0], [-1.0, -1.5, -3.0]);
    let sphere = |center: [f64; 3], radius| {
        let center = DVec3::from_array(center);
        first(&Solid::Sphere(Sphere { center, radius }), &ray)
    };
    let (a, b) = (sphere([0.0; 3], 7.0), sphere([-2.0, -3.0, -6.0], 14.0));
    assert!(a.order(&b).is_eq());
    group.bench_function("order of two spheres at one point", |bench| {
        bench.iter(|| black_box(&a).order(black_box(&b)));
    });
    let scaled = |scale: f64| {
        let Solid::Cone(row) = cone(0.0, 15.0) else {
            unreachable!("it is a cone");
        };
        let cone = Cone {
            base: row.base * scale,
            top: row.top * scale,
            base_radius: row.base_radius * scale,
            top_radius: row.top_radius * scale,
            ..row
        };
        let line = line(hit.org.map(|x| x * scale), hit.dir.map(|x| x * scale));
        first(&Solid::Cone(cone), &line)
    };
    let (a, b) = (scaled(1.0), scaled(2.0));
    assert!(a.order(&b).is_eq());
    group.bench_function("order of two cones at one point", |bench| {
        bench.iter(|| black_box(&a).order(black_box(&b)));
    });
    group.finish();
}
