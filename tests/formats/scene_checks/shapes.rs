//! Shapes that the scene's check refuses.

use super::*;

#[test]
fn numbers_out_of_range() {
    let at = |x: f64| DVec3::new(x, 0.0, 0.0);
    type Add = Box<dyn FnOnce(&mut SceneBuilder) -> ShapeId>;
    let sphere =
        |center, radius| -> Add { Box::new(move |b| b.sphere("s", Sphere { center, radius })) };
    let ellipsoid =
        |center, radii| -> Add { Box::new(move |b| b.ellipsoid("s", Ellipsoid { center, radii })) };
    let half = |normal, offset| -> Add {
        Box::new(move |b| b.half_space("s", HalfSpace { normal, offset }))
    };
    let tube = |base, top, radius| -> Add {
        let open = false;
        Box::new(move |b| {
            b.cylinder(
                "s",
                Cylinder {
                    base,
                    top,
                    radius,
                    open,
                },
            )
        })
    };
    let cone = |base, top, base_radius, top_radius| -> Add {
        let open = false;
        Box::new(move |b| {
            b.cone(
                "s",
                Cone {
                    base,
                    top,
                    base_radius,
                    top_radius,
                    open,
                },
            )
        })
    };
    let cuboid = |min, max| -> Add { Box::new(move |b| b.cuboid("s", Cuboid { min, max })) };
    let quadric =
        |coefficients| -> Add { Box::new(move |b| b.quadric("s", Quadric { coefficients })) };
    let with = |k: usize, x: f64| std::array::from_fn(|i| if i == k { x } else { 0.0 });
    let (o, x) = (DVec3::ZERO, DVec3::X);

    let not_finite: Vec<(Add, &str)> = vec![
        (sphere(at(NAN), 1.0), "center"),
        (sphere(o, f64::INFINITY), "radius"),
        (ellipsoid(at(NAN), DVec3::ONE), "center"),
        (ellipsoid(o, DVec3::new(1.0, NAN, 1.0)), "radii"),
        (half(at(NAN), 0.0), "normal"),
        (half(x, f64::NEG_INFINITY), "offset"),
        (tube(at(NAN), o, 1.0), "base"),
        (tube(o, at(NAN), 1.0), "top"),
        (tube(o, x, NAN), "radius"),
        (cone(at(NAN), o, 1.0, 1.0), "base"),
        (cone(o, at(NAN), 1.0, 1.0), "top"),
        (cone(o, x, NAN, 1.0), "base_radius"),
        (cone(o, x, 1.0, NAN), "top_radius"),
        (quadric(with(3, NAN)), "coefficients"),
        (quadric(with(9, f64::INFINITY)), "coefficients"),
        (cuboid(at(NAN), x), "min"),
        (cuboid(o, at(NAN)), "max"),
    ];
    for (add, field) in not_finite {
        assert_is!(
            refused(|b| {
                add(b);
            }),
            NotFinite,
            "'s'",
            field
        );
    }
    let out_of_range: Vec<(Add, &str)> = vec![
        (sphere(o, 0.0), "radius = 0"),
        (sphere(o, -2.0), "radius = -2"),
        (ellipsoid(o, DVec3::new(1.0, 0.0, 1.0)), "radii = 0"),
        (tube(o, x, -1.0), "radius = -1"),
        (cone(o, x, -1.0, 2.0), "base_radius = -1"),
        (cone(o, x, 2.0, -1.0), "top_radius = -1"),
        (cone(o, x, 0.0, 0.0), "base_radius + top_radius = 0"),
    ];
    for (add, field) in out_of_range {
        assert_is!(
            refused(|b| {
                add(b);
            }),
            OutOfRange,
            "'s'",
            field,
            "must be"
        );
    }
    let degenerate: Vec<(Add, &str)> = vec![
        (half(o, 1.0), "normal is (0, 0, 0)"),
        (quadric(with(9, -1.0)), "no surface"),
        (tube(x, x, 1.0), "same point"),
        (cone(x, x, 1.0, 1.0), "same point"),
        (cuboid(o, DVec3::new(1.0, 0.0, 1.0)), "below max"),
        (cuboid(DVec3::ONE, o), "below max"),
    ];
    for (add, why) in degenerate {
        assert_is!(
            refused(|b| {
                add(b);
            }),
            Degenerate,
            "'s'",
            why
        );
    }
}

#[test]
fn polynomial_surfaces() {
    type Make = fn(&mut Builder) -> u32;
    let refused = |make: Make, open: bool, clip: Option<Clip>| {
        let mut builder = Builder::default();
        let last = make(&mut builder);
        refused(|b| {
            b.implicit("s", builder.finish(last), open, clip);
        })
    };
    let x: Make = |b| b.coordinate(0);
    let [infinite, constant]: [Make; 2] = [
        |b| {
            let (x, value) = (b.coordinate(0), b.constant(f64::INFINITY));
            b.product(x, value)
        },
        |b| b.constant(2.0),
    ];
    assert_is!(
        refused(infinite, false, None),
        NotFinite,
        "implicit 's'",
        "constants = inf"
    );
    let degree: Make = |b| {
        let x = b.coordinate(0);
        b.power(x, 25)
    };
    let steps: Make = |b| {
        let x = b.coordinate(0);
        (0..5000).fold(x, |sum, _| b.sum(sum, x))
    };
    let slots: Make = |b| {
        let x = b.coordinate(0);
        let all: Vec<u32> = (1..80)
            .map(|i| {
                let value = b.constant(f64::from(i));
                b.sum(x, value)
            })
            .collect();
        all.into_iter().rev().fold(x, |sum, step| b.sum(sum, step))
    };
    for (make, field) in [
        (degree, "degree = 25; it must be 24 at most"),
        (steps, "steps = 5001; it must be 4096 at most"),
        (slots, "values at once = 80; it must be 64 at most"),
    ] {
        assert_is!(refused(make, false, None), OutOfRange, "'s'", field);
    }
    let bits: Make = |b| {
        let (x, value) = (b.coordinate(0), b.constant(1e-300));
        let power = b.power(value, 64);
        b.sum(x, power)
    };
    let most_cancels: Make = |b| {
        let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
        let [sum, product] = [b.sum(x, y), b.product(x, y)];
        let sum = b.difference(sum, x);
        let sum = b.difference(sum, y);
        b.sum(sum, product)
    };
    let nothing_at_all: Make = |b| {
        let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
        let sum = b.sum(x, y);
        let rest = b.difference(sum, x);
        b.difference(rest, y)
    };
    let ball = |radius| {
        let center = DVec3::ZERO;
        Some(Clip::Sphere(Sphere { center, radius }))
    };
    for (make, open, clip, why) in [
        (bits, false, None, "too large or too small"),
        (constant, false, None, "the same number everywhere"),
        (nothing_at_all, true, None, "the same number everywhere"),
        (x, false, ball(1.0), "clipped but not open"),
    ] {
        assert_is!(refused(make, open, clip), Degenerate, "'s'", why);
    }
    let cuboid = |min, max| Some(Clip::Cuboid(Cuboid { min, max }));
    assert_is!(
        refused(x, true, cuboid(DVec3::ONE, DVec3::ONE)),
        Degenerate,
        "clip's min must be below max"
    );
    assert_is!(
        refused(x, true, ball(0.0)),
        OutOfRange,
        "the clip's radius = 0"
    );
    for clip in [ball(NAN), cuboid(DVec3::ZERO, DVec3::INFINITY)] {
        assert_is!(refused(x, true, clip), NotFinite, "'s'", "the clip's");
    }
    let fine = check(|b| {
        for (open, clip) in [(false, None), (true, None), (true, ball(1.0))] {
            let mut builder = Builder::default();
            let last = most_cancels(&mut builder);
            b.implicit("s", builder.finish(last), open, clip);
        }
    });
    assert!(fine.is_ok());
}

#[test]
fn meshes() {
    let mesh = |data: MeshData| {
        refused(|b| {
            b.mesh("m", &data);
        })
    };
    let triangles = vec![];
    assert_is!(
        mesh(MeshData {
            triangles,
            ..triangle()
        }),
        Empty,
        "mesh 'm'",
        "triangles"
    );
    let triangles = vec![[0, 1, 2], [0, 3, 1]];
    assert_is!(
        mesh(MeshData {
            triangles,
            ..triangle()
        }),
        VertexOutOfRange,
        "mesh 'm'",
        "triangle 1",
        "vertex 3",
        "only 3"
    );
    for (bad, is_large) in [(NAN, false), (f64::INFINITY, true), (1e300, true)] {
        let data = MeshData {
            positions: vec![[0.0; 3], [1.0, bad, 0.0], [0.0, 1.0, 0.0]],
            ..triangle()
        };
        match is_large {
            true => assert_is!(mesh(data), Degenerate, "mesh 'm'", "larger than f32"),
            false => assert_is!(mesh(data), NotFinite, "mesh 'm'", "vertices"),
        }
    }
    let normals = vec![[0.0, 0.0, 1.0], [f32::NAN, 0.0, 1.0], [0.0, 0.0, 1.0]];
    assert_is!(
        mesh(MeshData {
            normals,
            ..triangle()
        }),
        NotFinite,
        "mesh 'm'",
        "normals"
    );
    // Too few, too many, and the same with another mesh behind.
    for count in [1, 2, 4] {
        let normals = vec![[0.0, 0.0, 1.0]; count];
        let data = MeshData {
            normals,
            ..triangle()
        };
        let number = count.to_string();
        assert_is!(
            mesh(data.clone()),
            NormalCount,
            "mesh 'm'",
            &number,
            "3 vertices"
        );
        let followed = refused(|b| {
            let normals = vec![[0.0, 0.0, 1.0]; 3];
            b.mesh("m", &data);
            b.mesh("plain", &triangle());
            b.mesh(
                "good",
                &MeshData {
                    normals,
                    ..triangle()
                },
            );
        });
        assert_is!(followed, NormalCount, "mesh 'm'", &number, "3 vertices");
    }
}

#[test]
fn polygons_and_polyhedra() {
    let (o, x, y, z) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z);
    let polygon = |points: &[DVec3], normals: &[DVec3]| {
        refused(|b| {
            b.polygon("p", points, normals);
        })
    };
    assert_is!(polygon(&[o, x], &[]), Empty, "polygon 'p'", "fewer than 3");
    assert_is!(polygon(&[], &[]), Empty, "polygon 'p'");
    assert_is!(
        polygon(&[o, x, y * NAN], &[]),
        NotFinite,
        "polygon 'p'",
        "points"
    );
    assert_is!(
        polygon(&[o, x, y], &[z, z, z * NAN]),
        NotFinite,
        "polygon 'p'",
        "normals"
    );
    assert_is!(
        polygon(&[o, x, y], &[z, z]),
        NormalCount,
        "polygon 'p'",
        "2",
        "3"
    );
    assert_is!(
        polygon(&[o, x, y], &[z, z, z, z]),
        NormalCount,
        "polygon 'p'",
        "4",
        "3"
    );
    assert_is!(
        polygon(&[o, x, x * 2.0], &[]),
        Degenerate,
        "polygon 'p'",
        "line"
    );
    assert_is!(
        polygon(&[x, x, x], &[]),
        Degenerate,
        "polygon 'p'",
        "one point"
    );
    assert_is!(
        polygon(&[o, x, x + y, y + z], &[]),
        Degenerate,
        "polygon 'p'",
        "one plane"
    );
    let far = 1.7e308;
    assert_is!(
        polygon(&[x * far, -x * far, y * far], &[]),
        Degenerate,
        "polygon 'p'",
        "far apart"
    );

    let plane = |normal| HalfSpace {
        normal,
        offset: 1.0,
    };
    let planes = [plane(x), plane(y), plane(z), plane(-x - y - z)];
    let points = [o, x, y, z];
    let body = |planes: &[HalfSpace], points: &[DVec3]| {
        refused(|b| {
            b.polyhedron("k", planes, points);
        })
    };
    assert_is!(
        body(&planes[..3], &points),
        Empty,
        "polyhedron 'k'",
        "fewer than 4"
    );
    assert_is!(
        body(&planes, &points[..3]),
        Empty,
        "polyhedron 'k'",
        "fewer than 4"
    );
    let mut bad = planes;
    bad[2].normal = o;
    assert_is!(
        body(&bad, &points),
        Degenerate,
        "polyhedron 'k'",
        "(0, 0, 0)"
    );
    bad[2].normal = DVec3::NAN;
    assert_is!(body(&bad, &points), NotFinite, "polyhedron 'k'", "planes");
    bad[2] = HalfSpace {
        offset: NAN,
        ..planes[2]
    };
    assert_is!(body(&bad, &points), NotFinite, "polyhedron 'k'", "planes");
    assert_is!(
        body(&planes, &[o, x, y, DVec3::NAN]),
        NotFinite,
        "polyhedron 'k'",
        "points"
    );
}
