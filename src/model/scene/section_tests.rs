//! Tests of sections.

use super::*;
use crate::geom::{Cuboid, Sphere};
use crate::scene::{Material, MeshData, Target};
use glam::DAffine3;

fn keep_below(offset: f64) -> HalfSpace {
    HalfSpace {
        normal: DVec3::Y,
        offset,
    }
}

fn cube(builder: &mut SceneBuilder) -> ShapeId {
    builder.cuboid(
        "cube",
        Cuboid {
            min: DVec3::splat(-1.0),
            max: DVec3::splat(1.0),
        },
    )
}

#[test]
fn what_is_beyond_goes_and_what_is_before_stays() {
    let mut builder = SceneBuilder::default();
    let cube = cube(&mut builder);
    for y in [-5.0, 0.0, 5.0] {
        let there = builder.transform(DAffine3::from_translation(DVec3::Y * y).into());
        builder.instance("", Edge::shape(cube).transform(there));
    }
    let (cut, uncut) = builder
        .finish()
        .unwrap()
        .cut(&[keep_below(0.25)], None)
        .unwrap();
    assert_eq!(uncut, Uncut::default());
    assert_eq!(cut.roots.len(), 2);
    assert_eq!(cut.roots.target[0], Target::Shape(cube));
    let Target::Shape(shape) = cut.roots.target[1] else {
        panic!("a shape");
    };
    assert!(matches!(cut.shapes.row(shape), Shape::Csg(_)));
}

#[test]
fn operands_that_add_are_cut_and_others_stay() {
    let mut builder = SceneBuilder::default();
    let red = builder.material("red", Material::default());
    let cube = cube(&mut builder);
    let ball = builder.sphere(
        "ball",
        Sphere {
            center: DVec3::ZERO,
            radius: 1.2,
        },
    );
    let both = [Operand::shape(cube).material(red), Operand::shape(ball)];
    let union = builder.csg("union", Operator::Union, &both);
    let part = [Operand::shape(union), Operand::shape(ball)];
    let part = builder.csg("part", Operator::Difference, &part);
    builder.instance("", Edge::shape(part));
    let (cut, _) = builder
        .finish()
        .unwrap()
        .cut(&[keep_below(0.25)], None)
        .unwrap();
    let Target::Shape(shape) = cut.roots.target[0] else {
        panic!("a shape");
    };
    let operands = |shape: ShapeId| match cut.shapes.row(shape) {
        Shape::Csg(id) => (cut.csg.operator[id.index()], cut.csg.operands(id)),
        _ => panic!("a solid"),
    };
    let (operator, [adds, takes]) = operands(shape) else {
        panic!("two operands");
    };
    assert_eq!((operator, takes.shape), (Operator::Difference, ball));
    let (operator, [first, second]) = operands(adds.shape) else {
        panic!("two operands");
    };
    assert_eq!(operator, Operator::Union);
    assert_eq!((first.material, second.material), (Some(red), None));
    for operand in [first, second] {
        assert_eq!(operands(operand.shape).0, Operator::Intersection);
    }
}

#[test]
fn open_meshes_are_cut_triangle_by_triangle() {
    let mut builder = SceneBuilder::default();
    let wall = MeshData {
        positions: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        uvs: vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
        ..MeshData::default()
    };
    let wall = builder.mesh("wall", &wall);
    builder.instance("", Edge::shape(wall));
    let (cut, _) = builder
        .finish()
        .unwrap()
        .cut(&[keep_below(1.0)], None)
        .unwrap();
    let Target::Shape(shape) = cut.roots.target[0] else {
        panic!("a shape");
    };
    let Shape::Mesh(id) = cut.shapes.row(shape) else {
        panic!("a mesh");
    };
    let mesh = cut.meshes.row(id);
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|corners| {
            let [a, b, c] =
                corners.map(|v| DVec3::from_array(mesh.positions[v as usize].map(f64::from)));
            (b - a).cross(c - a).z * 0.5
        })
        .sum();
    assert!((area - 3.5).abs() < 1e-6, "{area}");
    let row = cut.meshes.attributes.of(id).unwrap();
    let first = cut.meshes.attributes.rows[row as usize].uvs;
    for (p, uv) in mesh
        .positions
        .iter()
        .zip(&cut.meshes.attributes.uvs[first..])
    {
        assert_eq!([p[0] / 4.0, p[1] / 4.0], *uv);
    }
}

#[test]
fn planes_that_leave_nothing_together_leave_nothing() {
    let kept = |normal: [f64; 3], offset: f64| HalfSpace {
        normal: normal.into(),
        offset,
    };
    let left = |planes: &[HalfSpace]| {
        let mut builder = SceneBuilder::default();
        let cube = cube(&mut builder);
        let place =
            DAffine3::from_rotation_y(0.3) * DAffine3::from_scale(DVec3::new(3.0, 1.0, 2.0));
        let there = builder.transform(place.into());
        builder.instance("", Edge::shape(cube).transform(there));
        builder.finish().unwrap().cut(planes, None)
    };
    // Each goes through the box.
    for planes in [
        [kept([0.0, 1.0, 0.0], -0.1), kept([0.0, -1.0, 0.0], -0.1)],
        [kept([1.0, 2.0, 0.5], -0.5), kept([-1.0, -2.0, -0.5], 0.4)],
        // They leave an edge that lies above the box.
        [kept([0.1, -1.0, 0.0], -0.9), kept([-0.1, -1.0, 0.0], -1.3)],
    ] {
        let nothing = left(&planes);
        assert!(
            matches!(nothing, Err(SceneError::NothingToSee)),
            "{planes:?}"
        );
    }
    for planes in [
        [kept([0.0, 1.0, 0.0], 0.1), kept([0.0, -1.0, 0.0], 0.1)],
        [
            kept([0.0, 1.0, 0.0], 0.1),
            kept([0.0, -1.0, 0.0], -0.1 + 1e-12),
        ],
        [kept([0.1, -1.0, 0.0], -0.9), kept([-0.1, -1.0, 0.0], -0.95)],
    ] {
        assert!(left(&planes).is_ok(), "{planes:?}");
    }
}
