//! Tests of hatches.

use super::*;
use crate::geom::{Cuboid, Sphere};
use crate::scene::{Edge, Operand, Operator, Scene, Shape, ShapeId, Target, Texels, TextureRef};
use glam::DAffine3;

const FRONT: HalfSpace = HalfSpace {
    normal: DVec3::Z,
    offset: 0.0,
};

fn block(builder: &mut SceneBuilder) -> ShapeId {
    let (min, max) = (DVec3::splat(-1.0), DVec3::new(3.0, 1.0, 1.0));
    builder.cuboid("block", Cuboid { min, max })
}

fn cut(builder: SceneBuilder, spacing: Option<f64>) -> Scene {
    let hatch = Hatch { spacing };
    let scene = builder.finish().unwrap();
    scene.cut(&[FRONT], Some(hatch)).unwrap().0
}

/// The operands of what an instance places.
fn operands(scene: &Scene, shape: ShapeId) -> &[Operand] {
    match scene.shapes.row(shape) {
        Shape::Csg(id) => scene.csg.operands(id),
        _ => panic!("a solid"),
    }
}

fn placed(scene: &Scene, instance: u32) -> ShapeId {
    match scene.roots.target[instance as usize] {
        Target::Shape(shape) => shape,
        Target::Node(_) => panic!("a shape"),
    }
}

fn ramp(scene: &Scene, material: MaterialId) -> (Vec<Rgb>, DVec3, DVec3) {
    let pattern = scene.textures.of(material).unwrap().texturing.base_color;
    match scene.textures.pattern(pattern.unwrap()) {
        Pattern::Gradient {
            colors, from, to, ..
        } => (colors.clone(), (*from).into(), (*to).into()),
        _ => panic!("a gradient"),
    }
}

#[test]
fn a_hatch_has_the_operands_colour_and_goes_at_45_degrees() {
    let mut builder = SceneBuilder::default();
    let red = Material::metallic_roughness([0.8, 0.1, 0.1], 0.0, 0.5);
    let red = builder.material("red", red);
    let block = block(&mut builder);
    builder.instance("", Edge::shape(block).material(red));
    let scene = cut(builder, None);
    let [whole, half] = operands(&scene, placed(&scene, 0)) else {
        panic!("two operands")
    };
    // The block is what it was but for its material, which was the instance's.
    assert_eq!(scene.roots.material[0], None);
    let Shape::Csg(row) = scene.shapes.row(whole.shape) else {
        panic!("a solid")
    };
    assert_eq!(scene.csg.material[row.index()], Some(red));
    assert_eq!(operands(&scene, whole.shape)[0].shape, block);
    let material = half.material.unwrap();
    let names = &scene.materials.names;
    assert_eq!(names.get(material.0), Some("red hatched"));
    let (colors, from, to) = ramp(&scene, material);
    let dark = colors.iter().filter(|c| c[0] < 0.4).count();
    assert_eq!((dark, colors.len(), colors[8]), (3, 17, [0.8, 0.1, 0.1]));
    // The block is 4 long.
    let way = (to - from) * (LINES / 4.0);
    assert!(
        (way - DVec3::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0)).length() < 1e-12,
        "{way}"
    );
}

/// An image cannot go on over the cut, so its mean does.
#[test]
fn a_hatch_has_the_mean_of_an_image() {
    let mut builder = SceneBuilder::default();
    let own = Material::metallic_roughness([1.0, 0.5, 1.0], 0.0, 0.5);
    let own = builder.material("own", own);
    let texels = Texels::Bytes(vec![255, 0, 0, 0, 0, 255]);
    let image = builder.image(texels, 3, true, [2, 1]);
    let refs = [(Slot::BaseColor, TextureRef::plain(image))];
    builder.texture(own, Texturing::default(), &refs);
    let block = block(&mut builder);
    builder.instance("", Edge::shape(block).material(own));
    let scene = cut(builder, None);
    let [_, half] = operands(&scene, placed(&scene, 0)) else {
        panic!("two operands")
    };
    let (colors, ..) = ramp(&scene, half.material.unwrap());
    // 188 is the code next to half of the light.
    let half = crate::scene::linear_from_srgb(188.0 / 255.0) as f32;
    assert_eq!(colors[8], [half, 0.0, half]);
}

#[test]
fn lines_lie_in_the_world_wherever_an_instance_is() {
    let mut builder = SceneBuilder::default();
    let block = block(&mut builder);
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::new(2.0, 3.0, 0.5),
        glam::DQuat::from_rotation_z(0.7),
        DVec3::new(10.3, -4.0, 0.1),
    );
    let transform = builder.transform(place.into());
    builder.instance("", Edge::shape(block).transform(transform));
    let scene = cut(builder, Some(0.25));
    let [_, half] = operands(&scene, placed(&scene, 0)) else {
        panic!("two operands")
    };
    let (_, from, to) = ramp(&scene, half.material.unwrap());
    let across = DVec3::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0);
    for point in [
        DVec3::ZERO,
        DVec3::new(1.0, 0.4, -0.2),
        DVec3::new(2.5, -1.0, 0.9),
    ] {
        let way = to - from;
        let found = (point - from).dot(way) / way.length_squared();
        let lines = place.transform_point3(point).dot(across) / 0.25;
        // Whole lines do not count.
        let off = found - lines;
        assert!((off - off.round()).abs() < 1e-12, "{off}");
    }
}

#[test]
fn parts_beside_each_other_differ_and_one_part_is_alike() {
    let mut builder = SceneBuilder::default();
    let [red, blue] = ["red", "blue"].map(|name| builder.material(name, Material::default()));
    let block = block(&mut builder);
    let (center, radius) = (DVec3::ZERO, 1.5);
    let ball = builder.sphere("ball", Sphere { center, radius });
    let rows = [(block, red), (ball, red), (ball, blue)];
    let rows = rows.map(|(shape, material)| Operand::shape(shape).material(material));
    let part = builder.csg("part", Operator::Union, &rows);
    // All of one material, whatever its operands have.
    let (plain, row) = builder.declare_csg("plain", Operator::Union);
    builder.set_operands(row, &rows);
    builder.set_csg_material(row, blue);
    for shape in [part, plain] {
        builder.instance("", Edge::shape(shape));
    }
    let scene = cut(builder, Some(1.0));
    let way = |material: Option<MaterialId>| {
        let (_, from, to) = ramp(&scene, material.unwrap());
        let way = to - from;
        (way.length(), way.normalize())
    };
    let hatches: Vec<_> = operands(&scene, placed(&scene, 0))
        .iter()
        .map(|one| operands(&scene, one.shape)[1].material)
        .collect();
    assert_eq!(hatches[0], hatches[1]);
    let [(one, along), (other, across)] = [way(hatches[0]), way(hatches[2])];
    assert!((one - 1.0).abs() < 1e-12 && (other - 1.0).abs() < 1e-12);
    assert!(along.dot(across).abs() < 1e-12);
    let of_plain = operands(&scene, placed(&scene, 1));
    assert_eq!((of_plain[0].shape, of_plain.len()), (plain, 2));
    let (length, third) = way(of_plain[1].material);
    assert!((length - 0.6).abs() < 1e-12 && third.dot(along) > 0.999);
}

#[test]
fn dark_matter_has_light_lines_and_unbounded_matter_has_some() {
    let light = lines([0.01, 0.02, 0.01]);
    assert!(light[0][0] > light[5][0]);
    let mut builder = SceneBuilder::default();
    let floor = builder.half_space(
        "floor",
        HalfSpace {
            normal: DVec3::Y,
            offset: 0.0,
        },
    );
    builder.instance("", Edge::shape(floor));
    let scene = cut(builder, None);
    assert_eq!(scene.textures.patterns.len(), 1);
    let (_, from, to) = ramp(
        &scene,
        operands(&scene, placed(&scene, 0))[1].material.unwrap(),
    );
    assert!(((to - from).length() - 1.0).abs() < 1e-12);
}

#[test]
fn level_and_upright_planes_have_lines_at_45_degrees() {
    for normal in [
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::Z,
        DVec3::new(1.0, 2.0, -3.0),
    ] {
        let [one, other] = [false, true].map(|is_other| direction(normal, is_other));
        assert!(one.dot(normal).abs() < 1e-12 && other.dot(normal).abs() < 1e-12);
        assert!(one.dot(other).abs() < 1e-12);
        assert!((one.length() - 1.0).abs() < 1e-12);
    }
    assert!(direction(DVec3::Y, false).x > 0.7 && direction(DVec3::Y, false).z.abs() > 0.7);
}
