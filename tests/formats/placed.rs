//! Files in files: what is placed is what the files say by themselves, and what cannot be is refused
//! with its place.

use crate::common::{ALL_AOVS, Way, assets, hash, in_repository, picture};
use glam::DVec3;
use lanecast::internals::accel::Structure;
use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::math::Affine;
use lanecast::internals::plan::{Precision, native_width};
use lanecast::internals::render::RenderConfig;
use lanecast::internals::scene::{Camera, Instances, Light, Projection, Scene, SceneBuilder};
use std::fs;
use std::path::Path;

/// Writes files into a new folder and loads the first.
fn load_files(files: &[(&str, &str)]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let head = match name.ends_with(".toml") {
            true => "format = 1\n",
            false => "",
        };
        fs::write(path, format!("{head}{text}")).unwrap();
    }
    load(&folder.path().join(files[0].0), &LoadOptions::default())
}

pub fn scene(files: &[(&str, &str)]) -> Scene {
    load_files(files).unwrap_or_else(|e| panic!("{e}")).scene
}

pub fn warning(files: &[(&str, &str)]) -> String {
    let loaded = load_files(files).unwrap_or_else(|e| panic!("{e}"));
    loaded.warning.unwrap_or_default()
}

pub fn refused(files: &[(&str, &str)], expected: &[&str]) {
    let message = load_files(files).expect_err("it is refused").to_string();
    for part in expected {
        assert!(message.contains(part), "{message}\nlacks {part}");
    }
}

/// What is seen where: of each instance its shape, material and matrix, all by content.
pub fn seen(scene: &Scene) -> Vec<(String, String, Affine)> {
    let all = Instances::of(scene).unwrap();
    let name = |name: Option<&str>| name.unwrap_or_default().to_string();
    let row = |row: lanecast::internals::scene::Instance| {
        let material = row.material.and_then(|id| scene.materials.names.get(id.0));
        let shape = scene.shapes.names.get(row.shape.0);
        (name(shape), name(material), row.world_from_object)
    };
    all.iter(scene).map(row).collect()
}

/// The bits of a small picture with all ids.
pub fn bits(scene: &Scene) -> u64 {
    let instances = Instances::of(scene).unwrap();
    let (scene, camera) = scene.clone().completed(None, &instances, 1.5);
    let way = Way {
        precision: Precision::Guarded,
        lanes: native_width(),
        structure: Structure::Bvh,
    };
    let config = RenderConfig {
        width: 48,
        height: 32,
        aovs: ALL_AOVS,
        ..RenderConfig::default()
    };
    hash(&picture(&scene, camera, &scene.lights, way, &config))
}

const PAIR: &str = r#"
[material.Paint]
base_color = [0.1, 0.2, 0.7]
[material.Steel]
metallic = 1.0
[shape.ball]
sphere = { center = [0.0, 1.0, 0.0], radius = 1.0 }
[shape.foot]
box = { min = [-1.0, -0.5, -1.0], max = [1.0, 0.25, 1.0] }
[node.both]
children = [{ shape = "ball", material = "Paint" }, { shape = "foot", material = "Steel" }]
[[instance]]
node = "both"
transform = [{ rotate_y = 20.0 }, { translate = [0.5, 0.0, 0.25] }]
[[instance]]
shape = "foot"
transform = [{ translate = [0.0, -0.5, 0.0] }]
"#;

#[test]
fn a_placed_file_has_the_ids_and_the_picture_of_the_file() {
    let alone = scene(&[("pair.toml", PAIR)]);
    let once = "[[instance]]\nscene = 'pair.toml'\n";
    let twice = format!("{once}{once}");
    for (text, copies) in [(once, 1), (&twice, 2)] {
        let placed = scene(&[("main.toml", text), ("pair.toml", PAIR)]);
        let rows = seen(&alone);
        let prefixed = rows.iter().map(|(shape, material, matrix)| {
            let prefixed = |name: &str| match name {
                "" => String::new(),
                name => format!("pair/{name}"),
            };
            (prefixed(shape), prefixed(material), *matrix)
        });
        let prefixed: Vec<_> = prefixed.collect();
        let copied: Vec<_> = (0..copies).flat_map(|_| prefixed.clone()).collect();
        assert_eq!(seen(&placed), copied);
        assert_eq!(bits(&placed), bits(&alone), "{copies}");
        assert_eq!(placed.spheres.len(), 1);
        let nodes = &placed.nodes;
        let names = (0..nodes.len() as u32).filter_map(|row| nodes.names.get(row));
        assert_eq!(names.collect::<Vec<_>>(), ["pair/both", "pair"]);
    }
}

#[test]
fn placed_files_of_every_format_have_the_picture_of_the_file() {
    same_as_alone(&in_repository("scenes/meshes/gear.ply"));
    same_as_alone(&in_repository("scenes/csg_bracket.toml"));
    same_as_alone(&in_repository("scenes/molecule.json"));
    let Some(assets) = assets() else { return };
    for name in [
        "gltf/Box/Box.gltf",
        "gltf/BoxTextured_binary/BoxTextured.glb",
        "gltf/2CylinderEngine/2CylinderEngine.glb",
        "obj/tinyobjloader/cube.obj",
        "spd/balls_1.nff",
    ] {
        let path = assets.join(name);
        if !path.exists() {
            println!("skipped: no {name}");
            continue;
        }
        same_as_alone(&path);
    }
}

fn same_as_alone(path: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let main = folder.path().join("main.toml");
    let text = format!("format = 1\n[[instance]]\nscene = {:?}\n", path.display());
    fs::write(&main, text).unwrap();
    let options = LoadOptions {
        allow_outside: true,
        ..LoadOptions::default()
    };
    let read = |path: &Path| load(path, &options).unwrap_or_else(|e| panic!("{e}")).scene;
    let [alone, placed] = [read(path), read(&main)];
    // The background does not come along.
    let mut alone = SceneBuilder::from(alone);
    alone.background([0.0; 3]);
    let alone = alone.finish().unwrap();
    assert_eq!(placed.lights, alone.lights, "{}", path.display());
    assert_eq!(placed.cameras.rows, alone.cameras.rows);
    assert_eq!(bits(&placed), bits(&alone), "{}", path.display());
}

#[test]
fn materials_of_a_placed_file_are_replaced_by_name() {
    let main = "[material.red]\nbase_color = [1.0, 0.0, 0.0]\n\
                [[instance]]\nscene = 'pair.toml'\nmaterials = { Paint = 'red' }\n\
                [[instance]]\nscene = 'pair.toml'\n\
                [[instance]]\nscene = 'pair.toml'\nmaterial = 'red'\n";
    let placed = scene(&[("main.toml", main), ("pair.toml", PAIR)]);
    let materials: Vec<_> = seen(&placed).into_iter().map(|row| row.1).collect();
    let expected = [
        "red",
        "pair/Steel",
        "", // replaced
        "pair_2/Paint",
        "pair_2/Steel",
        "", // as they are
        "pair_2/Paint",
        "pair_2/Steel",
        "red", // where there are none
    ];
    assert_eq!(materials, expected);
    // The file as it is was read once for two placements, and once with another material.
    assert_eq!(placed.spheres.len(), 2);
    refused(
        &[
            (
                "main.toml",
                "[material.red]\n[[instance]]\nscene = 'pair.toml'\nmaterials = { Pain = 'red' }\n",
            ),
            ("pair.toml", PAIR),
        ],
        &[
            "main.toml:5:15: the scene file 'pair.toml' has no material 'Pain'; did you mean 'Paint'?",
        ],
    );
    refused(
        &[
            (
                "main.toml",
                "[material.red]\n[[instance]]\nscene = 'pair.toml'\nmaterials = { Paint = 'rad' }\n",
            ),
            ("pair.toml", PAIR),
        ],
        &["main.toml:5:23: there is no material 'rad'; did you mean 'red'?"],
    );
    refused(
        &[(
            "main.toml",
            "[shape.x]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
            [[instance]]\nshape = 'x'\nmaterials = { a = 'b' }\n",
        )],
        &["main.toml:6:13: materials takes the place"],
    );
}

#[test]
fn materials_within_meshes_and_solids_are_replaced() {
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl Paint\nf 1 2 3\n";
    let solid = "[material.Paint]\n[shape.a]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                 [shape.s]\nunion = [{ shape = 'a', material = 'Paint' }, 'a']\nmaterial = 'Paint'\n\
                 [[instance]]\nshape = 's'\n";
    let main = "[material.red]\n[[instance]]\nscene = 'm.obj'\nmaterials = { Paint = 'red' }\n\
                [[instance]]\nscene = 'solid.toml'\nmaterials = { Paint = 'red' }\n";
    let placed = scene(&[
        ("main.toml", main),
        ("m.obj", obj),
        ("m.mtl", "newmtl Paint\nKd 0 1 0\n"),
        ("solid.toml", solid),
    ]);
    let red = Some(lanecast::internals::scene::MaterialId(0));
    assert_eq!(placed.meshes.parts, [(0, red)]);
    assert_eq!(placed.csg.material, [red]);
    assert_eq!(placed.csg.operands[0].material, red);
}

#[test]
fn files_within_files_are_read_once_and_never_in_a_circle() {
    let car = "[shape.body]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n\
               [[instance]]\nshape = 'body'\n\
               [[instance]]\nscene = '../wheel.toml'\ntransform = [{ translate = [1, 0, 0] }]\n";
    let wheel = "[shape.tyre]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                 [[instance]]\nshape = 'tyre'\n";
    let files = [
        (
            "main.toml",
            "[[instance]]\nscene = 'car.toml'\n[[instance]]\nscene = 'wheel.toml'\n",
        ),
        ("car.toml", &*car.replace("../", "")),
        ("wheel.toml", wheel),
    ];
    let placed = scene(&files);
    let names: Vec<_> = seen(&placed).into_iter().map(|row| row.0).collect();
    assert_eq!(names, ["car/body", "car/wheel/tyre", "car/wheel/tyre"]);
    assert_eq!(placed.spheres.len(), 1);
    // A file's names are relative to its own folder, and may not leave it.
    let files = [
        ("main.toml", "[[instance]]\nscene = 'cars/car.toml'\n"),
        ("cars/car.toml", car),
        ("wheel.toml", wheel),
    ];
    refused(
        &files,
        &["names the file '../wheel.toml', which lies outside its folder"],
    );
    let files = [
        ("main.toml", "[[instance]]\nscene = 'a.toml'\n"),
        ("a.toml", "[[instance]]\nscene = 'b.toml'\n"),
        ("b.toml", "[[instance]]\n scene = 'a.toml'\n"),
    ];
    refused(
        &files,
        &[
            "b.toml:3:10: the scene file 'a.toml' would contain itself: 'a.toml' → 'b.toml' → 'a.toml'",
        ],
    );
    let own = [("main.toml", "[[instance]]\nscene = 'main.toml'\n")];
    refused(
        &own,
        &["main.toml:3:9: the scene file 'main.toml' would contain itself"],
    );
    let chain: Vec<(String, String)> = (0..40)
        .map(|k| {
            (
                format!("f{k}.toml"),
                format!("[[instance]]\nscene = 'f{}.toml'\n", k + 1),
            )
        })
        .collect();
    let chain: Vec<(&str, &str)> = chain.iter().map(|(a, b)| (&**a, &**b)).collect();
    refused(&chain, &["lies in other scene files 16 deep"]);
}

#[test]
fn placed_files_that_cannot_be_read_say_where_they_are_named() {
    let placing = |name: &str| format!("[[instance]]\nscene = '{name}'\n");
    let one = |name: &str, expected: &[&str]| {
        refused(
            &[("main.toml", &placing(name)), ("d/x", ""), ("x.xyz", "")],
            expected,
        );
    };
    one(
        "gone.glb",
        &["main.toml:3:9: the scene file 'gone.glb' cannot be read"],
    );
    one("d", &["main.toml:3:9: the scene file 'd' is a folder"]);
    one("x.xyz", &["x.xyz: unknown scene format 'xyz'"]);
    let empty = [("main.toml", &*placing("e.toml")), ("e.toml", "")];
    refused(
        &empty,
        &["main.toml:3:9: the scene file 'e.toml' has nothing to see"],
    );
    // What a file has wrong is said with its own name and line.
    let bad = [
        ("main.toml", &*placing("b.toml")),
        ("b.toml", "shapes = 1\n"),
    ];
    refused(&bad, &["b.toml:2:1: unknown key 'shapes'"]);
    let flat =
        "[shape.x]\nsphere = { center = [0, 0, 0], radius = 0 }\n[[instance]]\nshape = 'x'\n";
    let bad = [("main.toml", &*placing("b.toml")), ("b.toml", flat)];
    refused(&bad, &["b.toml:2:8: sphere 'b/x' has radius = 0"]);
    let flat = "[shape.x]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                [[instance]]\nshape = 'x'\ntransform = [{ scale = 0 }]\n";
    let bad = [("main.toml", &*placing("b.toml")), ("b.toml", flat)];
    refused(&bad, &["b.toml:4:1:", "singular transform"]);
    refused(
        &[
            ("main.toml", "[[instance]]\nscene = 'a.toml'\nnode = 'n'\n"),
            ("a.toml", PAIR),
        ],
        &["main.toml:3:9: both node and scene are given"],
    );
}

const LAMP: &str = r#"
background = [0.1, 0.1, 0.1]
[camera.near]
eye = [0.0, 0.0, 5.0]
look_at = [0.0, 0.0, 0.0]
orthographic = 2.0
[[light]]
point = { position = [0.0, 1.0, 0.0], intensity = [3.0, 2.0, 1.0], radius = 0.25 }
name = "lamps"
[[light]]
spot = { position = [0.0, 2.0, 0.0], direction = [0.0, -1.0, 0.0], intensity = [1.0, 1.0, 1.0], outer = 30.0 }
[shape.bulb]
sphere = { center = [0.0, 0.0, 0.0], radius = 0.5 }
[[instance]]
shape = "bulb"
"#;

#[test]
fn lights_come_with_every_placement_and_cameras_with_the_first() {
    let main = "[node.row]\nchildren = [\n\
                { scene = 'lamp.toml', transform = [{ scale = 2.0 }, { rotate_z = 90.0 }] },\n\
                { scene = 'lamp.toml', transform = [{ translate = [5.0, 0.0, 0.0] }] }]\n\
                [[instance]]\nnode = 'row'\ntransform = [{ translate = [0.0, 0.0, 1.0] }]\n\
                [[instance]]\nnode = 'row'\ntransform = [{ translate = [0.0, 0.0, 9.0] }]\n";
    let files = [("main.toml", main), ("lamp.toml", LAMP)];
    let placed = scene(&files);
    let lights: Vec<_> = placed
        .lights
        .iter()
        .map(|light| match *light {
            Light::Point {
                position, radius, ..
            } => (position.to_array(), radius),
            Light::Spot {
                position,
                direction,
                ..
            } => {
                let along = direction.to_array();
                assert!(
                    along == [2.0, 0.0, 0.0] || along == [0.0, -1.0, 0.0],
                    "{along:?}"
                );
                (position.to_array(), -1.0)
            }
            _ => panic!("no such light"),
        })
        .collect();
    let expected = [
        ([-2.0, 0.0, 1.0], 0.5),
        ([-4.0, 0.0, 1.0], -1.0),
        ([5.0, 1.0, 1.0], 0.25),
        ([5.0, 2.0, 1.0], -1.0),
        ([-2.0, 0.0, 9.0], 0.5),
        ([-4.0, 0.0, 9.0], -1.0),
        ([5.0, 1.0, 9.0], 0.25),
        ([5.0, 2.0, 9.0], -1.0),
    ];
    assert_eq!(lights, expected);
    assert_eq!(placed.light_groups.names().collect::<Vec<_>>(), ["lamps"]);
    assert_eq!(placed.cameras.rows.len(), 1);
    assert_eq!(placed.cameras.pick(Some("lamp/near")).unwrap(), Some(0));
    let Camera {
        eye,
        up,
        forward,
        projection,
        ..
    } = placed.cameras.rows[0];
    assert_eq!(eye, DVec3::new(0.0, 0.0, 11.0));
    assert_eq!((up, forward), (-DVec3::X, -DVec3::Z));
    assert_eq!(projection, Projection::Orthographic { half_height: 2.0 });
    assert_eq!(
        warning(&files),
        "not imported: 1 × background of a placed file"
    );
    // A sky stays behind, and its sun with it.
    let sky = "[[light]]\nsky = { sun_direction = [0, 1, 1] }\n";
    let files = [
        ("main.toml", "[[instance]]\nscene = 'sky.toml'\n"),
        ("sky.toml", &*format!("{LAMP}{sky}")),
    ];
    let expected =
        "not imported: 1 × background of a placed file, 1 × environment of a placed file";
    assert_eq!(warning(&files), expected);
    let placed = scene(&files);
    assert!(placed.environment.is_none() && placed.lights.len() == 2);
    // What stretches has no ball of light.
    let main = "[[instance]]\nscene = 'lamp.toml'\ntransform = [{ scale = [1, 2, 1] }]\n";
    let said = warning(&[("main.toml", main), ("lamp.toml", LAMP)]);
    assert!(
        said.contains("1 × light with an extent below a placement that stretches it"),
        "{said}"
    );
    let main = "[[instance]]\nscene = 'lamp.toml'\n\
                repeat = { count = 40000, transform = [{ translate = [1, 0, 0] }] }\n";
    refused(
        &[("main.toml", main), ("lamp.toml", LAMP)],
        &["main.toml:3:9: the lights of 'lamp' are placed too often"],
    );
}

#[test]
fn lights_and_cameras_go_with_a_placement_that_moves() {
    let main = "[[instance]]\nscene = 'lamp.toml'\n\
                motion = [{ at = 0.5, transform = [{ translate = [1, 0, 0] }] },\n\
                { at = 1.0, transform = [{ translate = [1, 4, 0] }] }]\n";
    let placed = scene(&[("main.toml", main), ("lamp.toml", LAMP)]);
    for (time, x, y) in [
        (0.0, 0.0, 0.0),
        (0.25, 0.5, 0.0),
        (0.75, 1.0, 2.0),
        (1.0, 1.0, 4.0),
    ] {
        let there = placed.clone().at(time).unwrap();
        let by = DVec3::new(x, y, 0.0);
        assert_eq!(there.lights[0].position(), Some(by + DVec3::Y), "{time}");
        assert_eq!(there.cameras.rows[0].eye, by + 5.0 * DVec3::Z, "{time}");
    }
    // A file's own motion comes along, its lights and cameras included.
    let file = "[shape.b]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                [[instance]]\nshape = 'b'\nmotion = [{ at = 1.0, transform = [{ translate = [2, 0, 0] }] }]\n\
                [[light]]\npoint = { position = [0, 0, 0], intensity = [1, 1, 1] }\n\
                motion = [{ at = 1.0, position = [2, 0, 0] }]\n";
    let main = "[[instance]]\nscene = 'm.toml'\ntransform = [{ rotate_z = 90.0 }]\n";
    let there = scene(&[("main.toml", main), ("m.toml", file)])
        .at(0.5)
        .unwrap();
    assert_eq!(there.lights[0].position(), Some(DVec3::Y));
    assert_eq!(seen(&there)[0].2.translation, [0.0, 1.0, 0.0]);
}

#[test]
fn a_mesh_brings_its_own_materials() {
    let Some(assets) = assets() else { return };
    let path = assets.join("found/14-native-mesh-material/s.toml");
    let scene = load(&path, &LoadOptions::default()).unwrap().scene;
    let material = scene.meshes.parts[0].1.expect("a material");
    let [r, g, b] = scene.materials.rows[material.index()].base_color;
    assert!(r > 0.5 && g < 0.1 && b < 0.1, "{r} {g} {b}");
}
