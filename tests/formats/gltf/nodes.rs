//! Tests of nodes, their transforms, and the cameras and lights on them.

use super::*;
use lanecast::internals::math::Affine;
use lanecast::internals::scene::{Instances, Light, Projection};

fn world(scene: &Scene) -> Vec<Affine> {
    let all = Instances::of(scene).unwrap();
    all.rows.iter().map(|r| r.world_from_object).collect()
}

#[test]
fn matrix_and_trs_agree_and_are_f64() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // A quarter turn about z by a quaternion of length 2, moved by a number that f32 cannot
    // represent.
    let trs = json!({"mesh": 0, "translation": [0.1, 1e9, 3.0], "rotation": [0.0, 0.0, 2.0 * half, 2.0 * half], "scale": [2.0, 3.0, 4.0]});
    let matrix = json!({"mesh": 0, "matrix": [0.0, 2.0, 0.0, 0.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.1, 1e9, 3.0, 1.0]});
    let placed = [trs, matrix.clone()].map(|node| {
        let mut d = document(&points());
        set(&mut d, "/nodes/0", node);
        world(&load(&d, &points()).unwrap().0)[0]
    });
    for (a, b) in placed[0]
        .linear()
        .iter()
        .flatten()
        .zip(placed[1].linear().iter().flatten())
    {
        assert!((a - b).abs() < 1e-15, "{placed:?}");
    }
    assert_eq!(placed[0].translation, [0.1, 1e9, 3.0]);
    assert_eq!(placed[1].translation, [0.1, 1e9, 3.0]);
    let mut d = document(&points());
    set(&mut d, "/nodes/0", matrix);
    set(&mut d, "/nodes/0/matrix/3", json!(0.5));
    assert!(refused(&d, &points()).contains("not affine"));
    set(
        &mut d,
        "/nodes/0",
        json!({"mesh": 0, "rotation": [0, 0, 0, 0]}),
    );
    assert!(refused(&d, &points()).contains("rotation"));
}

#[test]
fn hierarchy_shares_its_mesh_and_leaves_empty_nodes_out() {
    let mut d = document(&points());
    set(
        &mut d,
        "/nodes",
        json!([
            {"name": "top", "children": [1, 2, 3, 4], "translation": [1, 0, 0]},
            {"mesh": 0, "translation": [0, 1, 0]},
            {"mesh": 0, "children": [5]},
            {"name": "empty", "scale": [0, 1, 1]},
            {"mesh": 0, "scale": [0, 0, 0]},
            {"mesh": 0, "translation": [0, 0, 1]},
        ]),
    );
    let (scene, warning) = load(&d, &points()).unwrap();
    assert_eq!((scene.shapes.len(), scene.nodes.len()), (1, 2));
    let at: Vec<_> = world(&scene).iter().map(|m| m.translation).collect();
    assert_eq!(at, [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]);
    assert_eq!(scene.root_names.get(0), Some("top"));
    assert!(warning.unwrap().contains("1 × node scaled to nothing"));
}

#[test]
fn a_deep_chain_and_graphs_that_are_no_forest() {
    let mut d = document(&points());
    let deep = 100_000;
    let chain = (0..deep).map(|i| {
        if i + 1 < deep {
            json!({"children": [i + 1]})
        } else {
            json!({"mesh": 0})
        }
    });
    set(&mut d, "/nodes", chain.collect());
    assert_eq!(world(&load(&d, &points()).unwrap().0).len(), 1);
    for (nodes, says) in [
        (json!([{"children": [0]}]), "own descendant"),
        (
            json!([{}, {"children": [2]}, {"children": [1]}]),
            "own descendant",
        ),
        (
            json!([{"children": [2]}, {"children": [2]}, {}]),
            "one parent",
        ),
        (json!([{"children": [1, 1]}, {}]), "one parent"),
        (json!([{"children": [9]}]), "child node 9"),
    ] {
        set(&mut d, "/nodes", nodes);
        assert!(refused(&d, &points()).contains(says), "{says}");
    }
    set(&mut d, "/nodes", json!([{"children": [1]}, {"mesh": 0}]));
    for (roots, says) in [
        (json!([1]), "not a root"),
        (json!([0, 0]), "twice"),
        (json!([4]), "node 4"),
    ] {
        set(&mut d, "/scenes/0/nodes", roots);
        assert!(refused(&d, &points()).contains(says), "{says}");
    }
}

#[test]
fn without_scenes_every_root_is_shown() {
    let mut d = document(&points());
    d.as_object_mut().unwrap().remove("scenes");
    d.as_object_mut().unwrap().remove("scene");
    set(
        &mut d,
        "/nodes",
        json!([{"mesh": 0}, {"children": [2]}, {"mesh": 0}]),
    );
    assert_eq!(world(&load(&d, &points()).unwrap().0).len(), 2);
}

#[test]
fn cameras_are_numbered_as_the_file_lists_them() {
    let mut d = document(&points());
    let nodes = json!([
        {"mesh": 0, "children": [3, 1]},
        {"camera": 1, "name": "b", "children": [2]},
        {"camera": 0, "name": "a"},
        {"camera": 1, "name": "c"},
    ]);
    set(&mut d, "/nodes", nodes);
    let lens = json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}});
    set(&mut d, "/cameras", json!([lens, lens]));
    let (scene, _) = load(&d, &points()).unwrap();
    let names = [0, 1, 2].map(|row| scene.cameras.names.get(row).unwrap());
    assert_eq!(names, ["a", "b", "c"]);
}

/// One camera on two nodes is found by theirs, too.
#[test]
fn cameras_are_found_by_their_nodes() {
    let mut d = document(&points());
    let nodes = json!([
        {"mesh": 0, "children": [1, 2]},
        {"camera": 0, "name": "front"},
        {"camera": 0, "name": "side", "translation": [5, 0, 0]},
    ]);
    set(&mut d, "/nodes", nodes);
    let perspective = json!({"yfov": 1, "znear": 0.1});
    let lens = json!({"name": "lens", "type": "perspective", "perspective": perspective});
    set(&mut d, "/cameras", json!([lens]));
    let (scene, _) = load(&d, &points()).unwrap();
    let pick = |asked: &str| scene.cameras.pick(Some(asked));
    assert_eq!(
        ["lens", "front", "side", "1"].map(|asked| pick(asked).unwrap()),
        [Some(0), Some(0), Some(1), Some(1)]
    );
    let unknown = pick("top").unwrap_err().to_string();
    assert!(
        unknown.contains("'lens' on node 'front', 'lens' on node 'side'"),
        "{unknown}"
    );
}

#[test]
fn cameras_and_lights_are_posed_by_their_nodes() {
    let mut d = document(&points());
    // A camera that is turned about y by half a turn, far away.
    set(
        &mut d,
        "/nodes",
        json!([
            {"mesh": 0, "children": [1, 2, 3, 4]},
            {"camera": 0, "name": "eye", "translation": [1e17, 2, 3], "rotation": [0, 1, 0, 0], "scale": [2, 2, 2]},
            {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 5]},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}, "rotation": [0, 1, 0, 0]},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        ]),
    );
    set(
        &mut d,
        "/cameras",
        json!([
            {"type": "perspective", "perspective": {"yfov": std::f64::consts::FRAC_PI_2, "znear": 0.1}},
            {"name": "flat", "type": "orthographic", "orthographic": {"xmag": 1, "ymag": 3, "znear": 0, "zfar": 9}},
        ]),
    );
    set(
        &mut d,
        "/extensions",
        json!({"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 4, "color": [1, 0.5, 0]},
            {"type": "directional", "intensity": 2},
            {"type": "spot", "spot": {}},
        ]}}),
    );
    let (scene, warning) = load(&d, &points()).unwrap();
    let [eye, flat] = &scene.cameras.rows[..] else {
        panic!()
    };
    assert_eq!(eye.eye.to_array(), [1e17, 2.0, 3.0]);
    assert!((eye.forward.z - 1.0).abs() < 1e-15 && (eye.right.x + 1.0).abs() < 1e-15);
    let Projection::Perspective { half_height } = eye.projection else {
        panic!()
    };
    assert!((half_height - 1.0).abs() < 1e-7);
    assert_eq!(
        flat.projection,
        Projection::Orthographic { half_height: 3.0 }
    );
    assert_eq!(scene.cameras.names.get(0), Some("eye"));
    assert_eq!(scene.cameras.names.get(1), Some("flat"));
    let pick = |asked: &str| scene.cameras.pick(Some(asked)).unwrap();
    assert_eq!(["eye", "flat", "1"].map(pick), [Some(0), Some(1), Some(1)]);
    let Light::Point {
        position,
        intensity,
        ..
    } = scene.lights[0]
    else {
        panic!()
    };
    assert_eq!((position.z, intensity), (5.0, [4.0, 2.0, 0.0]));
    let Light::Directional {
        direction,
        irradiance,
        ..
    } = scene.lights[1]
    else {
        panic!()
    };
    assert!((direction.z - 1.0).abs() < 1e-15);
    assert_eq!(irradiance, [2.0; 3]);
    let Light::Spot { inner, outer, .. } = scene.lights[2] else {
        panic!()
    };
    assert_eq!((inner, outer as f32), (0.0, std::f32::consts::FRAC_PI_4));
    assert_eq!(warning.unwrap(), "not imported: 1 × incomplete triangle");
}
