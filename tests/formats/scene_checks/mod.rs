//! Provokes every error of the scene's check by name.

use glam::{DAffine3, DVec3};
use lanecast::internals::geom::tape::Builder;
use lanecast::internals::geom::{
    Clip, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Quadric, Sphere,
};
use lanecast::internals::math::Affine;
use lanecast::internals::scene::*;

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

// After the macro that they use.
mod far_meshes;
mod graphs;
mod shapes;

fn triangle() -> MeshData {
    MeshData {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    }
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
        radius: 0.0,
    };
    let sun = |direction, irradiance| Light::Directional {
        direction,
        irradiance,
        angle: 0.0,
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
