//! Every error of the scene's check, provoked by name; graphs made to exhaust
//! it; and the derived numbers that everything else builds on.

use glam::{DAffine3, DVec3};
use lanecast::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere};
use lanecast::math::Affine;
use lanecast::scene::*;
use proptest::prelude::*;
use std::time::{Duration, Instant};

const NAN: f64 = f64::NAN;

fn ball(b: &mut SceneBuilder) -> ShapeId {
    b.sphere(
        "ball",
        Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        },
    )
}

/// What the check says about a ball and whatever `fill` adds.
fn check(fill: impl FnOnce(&mut SceneBuilder)) -> Result<Scene, SceneError> {
    let mut b = SceneBuilder::default();
    let ball = ball(&mut b);
    b.instance("seen", Edge::shape(ball));
    fill(&mut b);
    b.finish()
}

fn refused(fill: impl FnOnce(&mut SceneBuilder)) -> SceneError {
    check(fill).expect_err("the check must refuse this")
}

/// The message says all of these.
fn says(error: &SceneError, parts: &[&str]) {
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "no '{part}' in: {message}");
    }
}

macro_rules! assert_is {
    ($error:expr, $variant:ident, $($part:expr),*) => {{
        let error = $error;
        assert!(matches!(error, SceneError::$variant { .. }), "{error:?}");
        says(&error, &[$($part),*]);
    }};
}

#[test]
fn a_sound_scene_passes() {
    assert!(check(|_| {}).is_ok());
}

#[test]
fn dangling_ids() {
    let edge = Edge::shape(ShapeId(0));
    assert_is!(
        refused(|b| b.instance("i", Edge::shape(ShapeId(99)))),
        DanglingId,
        "'i'",
        "shape 99",
        "only 1"
    );
    assert_is!(
        refused(|b| b.instance("i", Edge::node(NodeId(7)))),
        DanglingId,
        "'i'",
        "node 7"
    );
    let unplaced = edge.transform(TransformId(5));
    assert_is!(
        refused(|b| b.instance("i", unplaced)),
        DanglingId,
        "transform 5"
    );
    let bare = edge.material(MaterialId(3));
    assert_is!(refused(|b| b.instance("i", bare)), DanglingId, "material 3");
    let child = refused(|b| {
        b.node("pair", &[edge, Edge::shape(ShapeId(4))]);
    });
    assert_is!(child, DanglingId, "child of node 'pair'", "shape 4");
    let part = refused(|b| {
        let parts = vec![(0, Some(MaterialId(8)))];
        b.mesh(
            "m",
            &MeshData {
                parts,
                ..triangle()
            },
        );
    });
    assert_is!(part, DanglingId, "mesh 0", "material 8");
}

#[test]
fn cycles() {
    let own = refused(|b| {
        let n = b.declare_node("snake");
        b.set_children(n, &[Edge::node(n)]);
    });
    assert_is!(own, Cycle, "'snake' → 'snake'");
    let long = refused(|b| {
        let ring: Vec<NodeId> = (0..3).map(|i| b.declare_node(["a", "b", "c"][i])).collect();
        for i in 0..3 {
            b.set_children(ring[i], &[Edge::node(ring[(i + 1) % 3])]);
        }
    });
    assert_is!(long, Cycle, "'a' → 'b' → 'c' → 'a'");
    // A message stays a message.
    let endless = refused(|b| {
        let ring: Vec<NodeId> = (0..100_000).map(|_| b.declare_node("")).collect();
        for i in 0..ring.len() {
            b.set_children(ring[i], &[Edge::node(ring[(i + 1) % ring.len()])]);
        }
    });
    assert!(matches!(endless, SceneError::Cycle { .. }));
    assert!(
        endless.to_string().len() < 500,
        "{}",
        endless.to_string().len()
    );
}

fn scale(x: f64, y: f64, z: f64) -> Affine {
    DAffine3::from_scale(DVec3::new(x, y, z)).into()
}

#[test]
fn singular_transforms_and_paths() {
    for (matrix, finite) in [
        (scale(1.0, 0.0, 1.0), true),
        (scale(1.0, 1e-16, 1.0), true),
        (scale(0.0, 0.0, 0.0), true),
        (scale(1.0, NAN, 1.0), false),
        (scale(1.0, f64::INFINITY, 1.0), false),
    ] {
        let root = refused(|b| {
            let t = b.transform(matrix);
            b.instance("flat", Edge::shape(ShapeId(0)).transform(t));
        });
        let child = refused(|b| {
            let t = b.transform(matrix);
            b.node("flats", &[Edge::shape(ShapeId(0)).transform(t)]);
        });
        if finite {
            assert_is!(root, SingularTransform, "instance 'flat'", "scale of 0");
            assert_is!(child, SingularTransform, "node 'flats'");
        } else {
            assert_is!(root, NotFinite, "instance 'flat'", "transform");
            assert_is!(child, NotFinite, "node 'flats'", "transform");
        }
    }
    // Each is fine, their product is not.
    for s in [1e-200, 1e200] {
        let path = refused(|b| {
            let t = b.transform(scale(s, s, s));
            let inner = b.node("", &[Edge::shape(ShapeId(0)).transform(t)]);
            b.instance("", Edge::node(inner).transform(t));
        });
        assert_is!(path, SingularPath, "sphere 'ball'");
    }
}

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

fn triangle() -> MeshData {
    MeshData {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    }
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
    for bad in [NAN, f64::INFINITY, 1e300] {
        let positions = vec![[0.0; 3], [1.0, bad, 0.0], [0.0, 1.0, 0.0]];
        assert_is!(
            mesh(MeshData {
                positions,
                ..triangle()
            }),
            NotFinite,
            "mesh 'm'",
            "vertices"
        );
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

#[test]
fn materials_lights_cameras() {
    let good = Material::default();
    let material = |m: Material| {
        refused(|b| {
            b.material("paint", m);
        })
    };
    let phong = |diffuse, exponent| Model::Phong {
        diffuse,
        specular: [0.0; 3],
        exponent,
        mirror: [0.0; 3],
    };
    let shiny = |metallic, roughness| Model::MetallicRoughness {
        metallic,
        roughness,
    };
    for (m, field) in [
        (
            Material {
                base_color: [-1.0, 0.0, 0.0],
                ..good
            },
            "base_color",
        ),
        (
            Material {
                emission: [0.0, -1.0, 0.0],
                ..good
            },
            "emission",
        ),
        (
            Material {
                transmission: 1.5,
                ..good
            },
            "transmission",
        ),
        (
            Material {
                transmission: f32::NAN,
                ..good
            },
            "transmission",
        ),
        (Material { ior: 0.0, ..good }, "ior"),
        (
            Material {
                ior: f32::INFINITY,
                ..good
            },
            "ior",
        ),
        (
            Material {
                model: shiny(2.0, 0.5),
                ..good
            },
            "metallic",
        ),
        (
            Material {
                model: shiny(0.5, -0.1),
                ..good
            },
            "roughness",
        ),
        (
            Material {
                model: phong([-0.5; 3], 1.0),
                ..good
            },
            "diffuse",
        ),
        (
            Material {
                model: phong([0.5; 3], -1.0),
                ..good
            },
            "exponent",
        ),
    ] {
        assert_is!(material(m), OutOfRange, "material 'paint'", field);
    }
    let base_color = [f32::NAN; 3];
    assert_is!(
        material(Material { base_color, ..good }),
        NotFinite,
        "material 'paint'",
        "base_color"
    );
    assert_is!(
        refused(|b| b.background([-1.0; 3])),
        OutOfRange,
        "background"
    );
    assert_is!(
        refused(|b| b.background([f32::INFINITY; 3])),
        NotFinite,
        "background"
    );

    let light = |l: Light| {
        refused(|b| {
            b.light(l);
        })
    };
    let point = |position, intensity| Light::Point {
        position,
        intensity,
        falloff: Falloff::InverseSquare,
    };
    let sun = |direction, irradiance| Light::Directional {
        direction,
        irradiance,
    };
    assert_is!(
        light(point(DVec3::NAN, [1.0; 3])),
        NotFinite,
        "light 0",
        "position"
    );
    assert_is!(
        light(point(DVec3::ZERO, [-1.0; 3])),
        OutOfRange,
        "light 0",
        "intensity"
    );
    assert_is!(
        light(point(DVec3::ZERO, [f32::NAN; 3])),
        NotFinite,
        "light 0",
        "intensity"
    );
    assert_is!(
        light(sun(DVec3::NAN, [1.0; 3])),
        NotFinite,
        "light 0",
        "direction"
    );
    assert_is!(
        light(sun(DVec3::ZERO, [1.0; 3])),
        Degenerate,
        "light 0",
        "direction"
    );

    let camera = |c: Camera| {
        refused(|b| {
            b.camera("c", c);
        })
    };
    let (o, x, y) = (DVec3::ZERO, DVec3::X, DVec3::Y);
    assert_is!(
        camera(Camera::perspective(o, o, y, 40.0)),
        Degenerate,
        "camera 'c'",
        "looks nowhere"
    );
    assert_is!(
        camera(Camera::perspective(o, x, DVec3::NAN, 40.0)),
        Degenerate,
        "camera 'c'"
    );
    assert_is!(
        camera(Camera::perspective(DVec3::NAN, x, y, 40.0)),
        NotFinite,
        "camera 'c'",
        "eye"
    );
    for fov in [0.0, -5.0, 180.0, NAN] {
        assert_is!(
            camera(Camera::perspective(o, x, y, fov)),
            OutOfRange,
            "camera 'c'",
            "fov_y"
        );
    }
    for height in [0.0, -1.0, NAN, f64::INFINITY] {
        assert_is!(
            camera(Camera::orthographic(o, x, y, height)),
            OutOfRange,
            "camera 'c'",
            "height"
        );
    }
    // Straight up is a view like any other.
    assert!(
        check(|b| {
            b.camera("", Camera::perspective(o, y, y, 40.0));
        })
        .is_ok()
    );
}

#[test]
fn nothing_to_see() {
    assert_is!(
        SceneBuilder::default().finish().unwrap_err(),
        NothingToSee,
        "empty"
    );
    let mut b = SceneBuilder::default();
    let empty = b.node("", &[]);
    b.instance("", Edge::node(empty));
    assert_is!(b.finish().unwrap_err(), NothingToSee, "empty");
}

/// Nodes that each hold the next one twice; gives the first.
fn doubling(b: &mut SceneBuilder, levels: usize, last: &[Edge]) -> NodeId {
    (0..levels).fold(b.node("", last), |below, _| {
        b.node("", &[Edge::node(below), Edge::node(below)])
    })
}

fn quickly<T>(work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    let took = start.elapsed();
    assert!(took < Duration::from_secs(10), "took {took:?}");
    result
}

#[test]
fn deep_sharing_is_refused_quickly() {
    let trillion = quickly(|| {
        refused(|b| {
            let top = doubling(b, 40, &[Edge::shape(ShapeId(0))]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(trillion, TooManyAppearances, "1099511627777", "16777216");
    // More than a u64 can count.
    let endless = quickly(|| {
        refused(|b| {
            let top = doubling(b, 200, &[Edge::shape(ShapeId(0))]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(endless, TooManyAppearances, "18446744073709551615");
    // As many ways to nothing at all: nothing to unfold.
    let hollow = quickly(|| {
        check(|b| {
            let top = doubling(b, 60, &[]);
            b.instance("", Edge::node(top));
        })
    });
    assert!(hollow.is_ok());
    // Few appearances, each at the end of a long way: 2^20 · 10^5 steps.
    let winding = quickly(|| {
        refused(|b| {
            let mut chain = b.node("", &[Edge::shape(ShapeId(0))]);
            for _ in 0..100_000 {
                chain = b.node("", &[Edge::node(chain)]);
            }
            let top = doubling(b, 20, &[Edge::node(chain)]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(winding, TooManyNodes, "nodes");
}

#[test]
fn a_chain_of_a_million_nodes() {
    let mut b = SceneBuilder::default();
    let shape = ball(&mut b);
    let step = b.transform(DAffine3::from_translation(DVec3::X).into());
    let mut node = b.node("", &[Edge::shape(shape)]);
    for _ in 0..1_000_000 {
        node = b.node("", &[Edge::node(node).transform(step)]);
    }
    b.instance("", Edge::node(node));
    let scene = quickly(|| b.finish()).expect("deep, but sound");
    let all = Appearances::of(&scene).unwrap();
    assert_eq!(all.len(), 1);
    assert_eq!(all.rows[0].world_from_object.translation, [1e6, 0.0, 0.0]);
    assert_eq!(all.rows[0].object_from_world.translation, [-1e6, 0.0, 0.0]);
}

/// 3×4 matrices as rows, multiplied as the definition says.
fn times(a: [[f64; 4]; 3], b: [[f64; 4]; 3]) -> [[f64; 4]; 3] {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let sum = a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
            if c == 3 { sum + a[r][3] } else { sum }
        })
    })
}

fn rows(m: &Affine) -> [[f64; 4]; 3] {
    std::array::from_fn(|r| {
        [
            m.linear[0][r],
            m.linear[1][r],
            m.linear[2][r],
            m.translation[r],
        ]
    })
}

#[test]
fn appearances_in_the_order_of_the_file() {
    let mut b = SceneBuilder::default();
    let ball = ball(&mut b);
    let block = b.cuboid(
        "",
        Cuboid {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        },
    );
    let locals = [
        DAffine3::from_rotation_y(0.3) * DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        DAffine3::from_scale(DVec3::new(2.0, -0.5, 3.0)),
        DAffine3::from_rotation_x(-1.1) * DAffine3::from_translation(DVec3::new(-4.0, 0.1, 0.7)),
    ]
    .map(Affine::from);
    let t = locals.map(|m| b.transform(m));
    let paint: Vec<MaterialId> = (0..3)
        .map(|_| b.material("", Material::default()))
        .collect();
    let inner = b.node(
        "",
        &[
            Edge::shape(ball).transform(t[2]),
            Edge::shape(block).material(paint[2]),
        ],
    );
    let outer = b.node(
        "",
        &[
            Edge::node(inner).transform(t[1]).material(paint[1]),
            Edge::shape(ball),
        ],
    );
    b.instance("", Edge::node(outer).transform(t[0]).material(paint[0]));
    b.instance("", Edge::node(inner));
    let scene = b.finish().unwrap();
    let all = Appearances::of(&scene).unwrap();

    // Depth first; the nearest edge that sets a material wins.
    let seen: Vec<_> = all
        .rows
        .iter()
        .map(|a| (a.shape, a.material, a.root))
        .collect();
    assert_eq!(
        seen,
        [
            (ball, Some(paint[1]), 0),
            (block, Some(paint[2]), 0),
            (ball, Some(paint[0]), 0),
            (ball, None, 1),
            (block, Some(paint[2]), 1),
        ]
    );
    // To the world by local₀ · local₁ · local₂; back by the inverses, from the
    // root on: inverse₂ · (inverse₁ · inverse₀). The same bits.
    let [m0, m1, m2] = locals.map(|m| rows(&m));
    let [i0, i1, i2] = locals.map(|m| rows(&m.inverse().unwrap()));
    let first = &all.rows[0];
    assert_eq!(rows(&first.world_from_object), times(times(m0, m1), m2));
    assert_eq!(rows(&first.object_from_world), times(i2, times(i1, i0)));
    assert_eq!(rows(&all.rows[2].world_from_object), m0);
    assert_eq!(rows(&all.rows[3].object_from_world), i2);
    assert!(all.rows[4].object_from_world.is_identity());
    // And they undo each other.
    let p = [0.3, -0.2, 0.9];
    let back = first
        .object_from_world
        .point(first.world_from_object.point(p));
    assert!((0..3).all(|k| (back[k] - p[k]).abs() < 1e-14), "{back:?}");
}

fn center_of(positions: Vec<[f64; 3]>) -> (Meshes, DVec3) {
    let mut meshes = Meshes::default();
    meshes.push(&MeshData {
        positions,
        ..MeshData::default()
    });
    let center = meshes.center[0];
    (meshes, center)
}

#[test]
fn the_centre_of_a_far_mesh() {
    // Far in x alone: the other axes stay about 0, where f32 is dense.
    let (meshes, center) = center_of(vec![
        [1000.0, f64::from(0.1_f32), f64::from(1e-30_f32)],
        [1001.0, f64::from(0.9_f32), f64::from(0.7_f32)],
    ]);
    assert!(
        center.x != 0.0 && center.y == 0.0 && center.z == 0.0,
        "{center}"
    );
    assert_eq!(meshes.rounded[0], 0);
    // f64 coordinates of a city: kept to a part in 2^24 of its size, not of its
    // distance.
    let (meshes, center) = center_of(vec![[4.5e6 + 0.123, 1.0, 2.0], [4.5e6 + 9.876, 3.0, 4.0]]);
    assert_eq!(meshes.rounded[0], 2);
    let x = f64::from(meshes.positions[0][0]) + center.x;
    assert!((x - (4.5e6 + 0.123)).abs() < 1e-6, "{x}");
    // Near: about 0.
    assert_eq!(
        center_of(vec![[7.0, 0.0, 0.0], [8.0, 0.0, 0.0]]).1,
        DVec3::ZERO
    );
    // One point, and a sheet whose size is nothing beside its distance.
    assert_eq!(center_of(vec![[9.0, 9.0, 9.0]]).1, DVec3::ZERO);
    let (meshes, center) = center_of(vec![[1e10, 0.0, 0.0], [1e10, 1e-300, 0.0]]);
    assert_eq!(f64::from(meshes.positions[0][0]) + center.x, 1e10);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(20_000)
    })]

    /// What was f32 stays exact, wherever the mesh lies.
    #[test]
    fn f32_vertices_are_never_rounded(
        at in prop::array::uniform3(-1e9..1e9_f32),
        near in prop::array::uniform3(0..3_u8),
        size in -20..20_i32,
        corners in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), 1..6),
    ) {
        let size = f32::powi(2.0, size);
        let positions: Vec<[f64; 3]> = corners
            .iter()
            .map(|c| std::array::from_fn(|k| {
                f64::from(c[k] * size + if near[k] == 0 { 0.0 } else { at[k] / 1e3_f32.powi(near[k].into()) })
            }))
            .collect();
        let (meshes, center) = center_of(positions.clone());
        prop_assert_eq!(meshes.rounded[0], 0, "centre {}", center);
        for (kept, given) in meshes.positions.iter().zip(&positions) {
            let kept: [f64; 3] = std::array::from_fn(|k| f64::from(kept[k]) + center[k]);
            prop_assert_eq!(&kept, given);
        }
    }
}
