//! What solids and colours become: the shapes, where they are, and of which material.

use super::{CUBE, FN0, loaded, near, scene, volume};
use lanecast::internals::io::SrgbEncoder;
use lanecast::internals::scene::{Instances, Scene, Shape, TransformId};

#[test]
fn what_is_made_is_exact_and_small() {
    let kinds = |text: &str| -> Vec<&'static str> {
        let scene = scene(text);
        let rows = scene.shapes.rows.iter();
        rows.map(|shape| shape.kind_name()).collect()
    };
    assert_eq!(kinds(CUBE), ["box"]);
    // A quarter of a turn, and any turn of what is round, leave no frame.
    let turned = "multmatrix([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]])";
    let scene = scene(&format!("{turned} {CUBE}"));
    let cuboid = &scene.cuboids;
    assert_eq!(cuboid.len(), 1);
    assert_eq!(scene.transforms.len(), 1, "only the identity");
    let text = format!(
        "multmatrix([[0.866025, -0.5, 0, 1], [0.5, 0.866025, 0, 0], [0, 0, 1, 0]]) \
         cylinder({FN0}, h = 1, r1 = 2, r2 = 1);"
    );
    assert_eq!(kinds(&text), ["cone"]);
    assert_eq!(
        kinds(&format!("linear_extrude(height = 1) circle({FN0}, r = 1);")),
        ["cylinder"]
    );
    let torus = format!("rotate_extrude({FN0}) multmatrix([[1, 0, 0, 2]]) circle({FN0}, r = 1);");
    assert_eq!(kinds(&torus), ["implicit"]);
}

#[test]
fn z_is_up() {
    let loaded =
        loaded("multmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 10]]) cube(size = [1, 2, 3]);");
    let scene = &loaded.scene;
    let Shape::Cuboid(id) = scene.shapes.rows[0] else {
        panic!()
    };
    let row = scene.cuboids.row(id);
    assert_eq!(row.min.to_array(), [0.0, 10.0, -2.0]);
    assert_eq!(row.max.to_array(), [1.0, 13.0, 0.0]);
}

#[test]
fn colors_are_those_of_openscads_view() {
    let colors = |text: &str| -> Vec<([u8; 3], f32)> {
        let scene = scene(text);
        let encoder = SrgbEncoder::new();
        let rows = scene.materials.rows.iter();
        rows.map(|m| (m.base_color.map(|c| encoder.encode(c)), m.layers.opacity))
            .collect()
    };
    let (yellow, green) = ([249, 215, 44], [157, 203, 81]);
    assert_eq!(colors(CUBE), [(yellow, 1.0)]);
    // What is cut off, unless it is one piece or has a colour.
    let other = "multmatrix([[1, 0, 0, 0.5]])";
    let cut = colors(&format!("difference() {{ {CUBE} {other} {CUBE} }}"));
    assert!(cut.contains(&(green, 1.0)) && cut.contains(&(yellow, 1.0)) && cut.len() == 2);
    let plain = format!("render() difference() {{ {CUBE} {other} {CUBE} }}");
    assert_eq!(colors(&plain), [(yellow, 1.0)]);
    // The outermost colour counts.
    let nested = format!("color([1, 0, 0, 0.25]) {{ color([0, 1, 0, 1]) {{ {CUBE} }} }}");
    assert_eq!(colors(&nested), [([255, 0, 0], 0.25)]);
    assert_eq!(
        colors(&format!("color([-1, -1, -1, 1]) {CUBE}")),
        [(yellow, 1.0)]
    );
    // Modifiers.
    assert_eq!(colors(&format!("%{CUBE}")), [([180, 180, 180], 0.5)]);
    let marked = colors(&format!("#{CUBE}"));
    assert_eq!(marked.len(), 1);
    assert_eq!(marked[0].1, 1.0);
    assert!(marked[0].0[0] > 240 && marked[0].0[1] < 180);
    let cut = colors(&format!("difference() {{ {CUBE} #{other} {CUBE} }}"));
    assert!(cut.contains(&([255, 81, 81], 0.5)), "{cut:?}");
}

/// The shape that the first instance places.
fn root_shape(scene: &Scene) -> Shape {
    let instances = Instances::of(scene).unwrap();
    let first = instances.iter(scene).next().unwrap();
    scene.shapes.row(first.shape)
}

/// Coincident faces whose numbers have six digits leave no skin.
#[test]
fn faces_that_six_digits_part_are_one() {
    let text = "difference() { cube(size = [33.3333, 100, 100]); \
                multmatrix([[1, 0, 0, 16.6667], [0, 1, 0, 10], [0, 0, 1, 10]]) \
                cube(size = [16.6666, 50, 50]); }";
    let scene = scene(text);
    let Shape::Csg(id) = root_shape(&scene) else {
        panic!()
    };
    assert!(scene.csg.tolerance[id.index()] >= 1e-4);
    near(volume(text), 33.3333 * 1e4 - 16.6666 * 2500.0, text);
}

#[test]
fn what_one_node_turns_is_turned_as_an_instance() {
    let turn = "multmatrix([[0.866025, -0.5, 0, 1], [0.5, 0.866025, 0, 2], [0, 0, 1, 3]])";
    let at = |x: f64| format!("multmatrix([[1, 0, 0, {x}]]) {CUBE}");
    let bar = "cube(size = [9, 1, 1]);";
    let text = format!("{turn} difference() {{ {bar} {} {} }}", at(2.0), at(5.0));
    let scene = scene(&text);
    // The solid has one frame, its own.
    let used: Vec<_> = scene.csg.operands.iter().map(|one| one.transform).collect();
    assert!(
        used.iter().all(|id| *id == TransformId::IDENTITY),
        "{used:?}"
    );
    let instances = Instances::of(&scene).unwrap();
    let place = instances.iter(&scene).next().unwrap().world_from_object;
    // z of the file is y of the scene, and y is -z.
    let at = place.point([1.0, 0.0, 0.0]);
    let expected = [1.0 + 0.866025, 3.0, -2.0 - 0.5];
    assert!(
        at.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
        "{at:?}"
    );
    near(volume(&text), 7.0, &text);
    // What is beside it and not turned is an operand in a frame, and ghosts have their own places.
    let beside = format!("cube(size = [0.5, 0.5, 0.5], center = true); {text} %{CUBE}");
    let scene = super::scene(&beside);
    let instances = Instances::of(&scene).unwrap();
    let placed: Vec<_> = instances.iter(&scene).collect();
    assert!(
        placed.iter().any(|one| one.world_from_object.is_identity()),
        "the ghost"
    );
    // No solid touches another, so volumes add up, the ghost's too.
    near(volume(&beside), 7.0 + 0.125 + 6.0, &beside);
    // Mostly as it stands: nothing is turned but the one.
    let few = format!(
        "{CUBE} multmatrix([[1, 0, 0, 1]]) {CUBE} multmatrix([[1, 0, 0, 50]]) {turn} {CUBE}"
    );
    let scene = super::scene(&few);
    let instances = Instances::of(&scene).unwrap();
    let moved = instances
        .iter(&scene)
        .filter(|one| !one.world_from_object.is_identity());
    assert_eq!(moved.count(), 1);
}
