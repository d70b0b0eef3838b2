//! Lights, shutters and looks of the native format mean what docs/SCENE_FORMAT.md says.

use glam::DVec3;
use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::scene::{Falloff, Light, Scene};

const BALL: &str =
    "[shape.b]\nsphere = { center = [0, 0, 0], radius = 1 }\n[[instance]]\nshape = 'b'\n";

/// Loads a file of these lines and a ball.
fn read(lines: &str) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("format = 1\n{lines}\n{BALL}")).unwrap();
    load(&path, &LoadOptions::default())
}

fn scene(lines: &str) -> Scene {
    read(lines).unwrap_or_else(|e| panic!("{e}")).scene
}

fn refused(lines: &str, says: &str) {
    let said = read(lines).unwrap_err().to_string();
    assert!(said.contains(says), "{lines}: {said}");
}

/// Each of two ways to say a light is the same, bit for bit, and so are their keys.
#[test]
fn a_ball_of_radiance_is_a_point_with_a_radius() {
    let ball = scene(
        "[[light]]\nsphere = { center = [0, 3, 0], radius = 0.5, radiance = [4, 2, 1] }\n\
         motion = [{ at = 0.5, color = [8, 4, 2] }, { at = 1.0, radius = 1.0 }]",
    );
    let of =
        |radiance: f64, radius: f64| (radiance * std::f64::consts::PI * radius * radius) as f32;
    let point = |radiance: f64, radius: f64| Light::Point {
        position: DVec3::new(0.0, 3.0, 0.0),
        intensity: [1.0, 0.5, 0.25].map(|c| of(c * radiance, radius)),
        falloff: Falloff::InverseSquare,
        radius,
    };
    assert_eq!(ball.lights[..], [point(4.0, 0.5)]);
    assert_eq!(
        ball.light_motions.keys[..],
        [
            (0.0, point(4.0, 0.5)),
            (0.5, point(8.0, 0.5)),
            (1.0, point(8.0, 1.0))
        ]
    );
}

#[test]
fn a_scene_has_one_environment_and_a_sky_is_one() {
    let sky = "[[light]]\nsky = { sun_direction = [0.3, 0.8, 0.2], turbidity = 3.0, scale = 0.5 }\nname = 'day'\n";
    let read = scene(sky);
    assert_eq!(read.environment.as_ref().unwrap().scale, [0.5; 3]);
    let whole = scene(&sky.replace("0.5 }", "1.0 }"));
    let [Light::Directional { irradiance, .. }] = read.lights[..] else {
        panic!("{:?}", read.lights);
    };
    let [
        Light::Directional {
            irradiance: all, ..
        },
    ] = whole.lights[..]
    else {
        panic!("{:?}", whole.lights);
    };
    assert_eq!(irradiance, all.map(|c| c * 0.5));
    assert_eq!(read.light_groups.names().collect::<Vec<_>>(), ["day"]);
    let map = "[[light]]\nenvironment = { color = [1, 1, 1] }\n";
    for (text, says) in [
        (
            format!("{map}{sky}"),
            "4:1: a scene has one environment or one sky",
        ),
        (
            format!("{map}motion = [{{ at = 1.0 }}]\n"),
            "the environment does not move",
        ),
        (map.replace("color", "sky = 1, color"), "unknown key 'sky'"),
    ] {
        refused(&text, says);
    }
}

#[test]
fn a_files_shutter_is_that_of_cameras_without_one() {
    let shutter = "[shutter]\nopen = 0.0\nclose = 0.5\nshape = 'box'\n";
    let cameras = "[camera.a]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 30\n\
                [camera.b]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 30\nshutter = { close = 1.0 }\n";
    let read = scene(&format!("{shutter}{cameras}"));
    let close = |row| read.cameras.shutter(row).map(|shutter| shutter.close);
    assert_eq!((close(0), close(1)), (Some(0.5), Some(1.0)));
    refused(shutter, "2:1: a shutter is of cameras");
}

/// An image in place of a base colour is one that scales white.
#[test]
fn a_base_color_may_be_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let texels = image::RgbaImage::from_raw(1, 1, vec![10, 20, 30, 255]).unwrap();
    texels.save(folder.path().join("t.png")).unwrap();
    let path = folder.path().join("a.toml");
    let read = |material: &str| {
        let text = format!("format = 1\n[material.m]\n{material}\n{BALL}material = 'm'\n");
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default())
    };
    let own = read("base_color = { texture = 't.png', uv = 0, scale = [2, 3], wrap = 'clamp' }");
    let long = read(
        "base_color = [1, 1, 1]\nbase_color_texture = { file = 't.png', scale = [2, 3], wrap = 'clamp' }",
    );
    let [own, long] = [own, long].map(|loaded| loaded.unwrap().scene);
    assert_eq!(own.materials.rows, long.materials.rows);
    let refs = |scene: &Scene| -> Vec<_> {
        scene
            .textures
            .iter()
            .flat_map(|row| row.refs.to_vec())
            .collect()
    };
    assert!(!refs(&own).is_empty());
    assert_eq!(refs(&own), refs(&long));
    for (material, says) in [
        (
            "base_color = { scale = [2, 3] }",
            "scale is of an image; name it by texture",
        ),
        (
            "base_color = { texture = 't.png', checker = { colors = [[0, 0, 0], [1, 1, 1]] } }",
            "an image and of a pattern at once",
        ),
        (
            "base_color = { texture = 't.png', uv = 1 }",
            "uv = 1; native scenes keep one set",
        ),
        (
            "base_color = { texture = 'u.png' }",
            "the image 'u.png' cannot be read",
        ),
        (
            "base_color = { texture = 't.png' }\nbase_color_texture = { file = 't.png' }",
            "leave out one of them",
        ),
        ("base_color = {}", "the pattern is empty"),
        (
            "base_color = [1, 0, 0]\nalpha = 'blend'",
            "base_color has no image; give it one, or opacity",
        ),
        (
            "base_color = { texture = 't.png' }\nalpha_cutoff = 0.3",
            "alpha_cutoff goes with alpha = \"mask\"",
        ),
        (
            "base_color = [1, 0, 0]\nnormal_scale = 0.5",
            "normal_scale goes with normal_texture",
        ),
    ] {
        let said = read(material).unwrap_err().to_string();
        assert!(said.contains(says), "{material}: {said}");
    }
}

/// Files bring whole libraries of materials, of which some shine.
#[test]
fn a_material_that_stands_on_nothing_lights_nothing() {
    let lamp = "[material.lamp]\nemission = [1, 1, 1]\n";
    let dark = scene(lamp);
    assert!(dark.is_dark() && !dark.has_soft_light());
    for part in [
        "[[instance]]\nshape = 'b'\nmaterial = 'lamp'\n",
        "[node.n]\nchildren = [{ shape = 'b', material = 'lamp' }]\n[[instance]]\nnode = 'n'\n",
        "[shape.u]\nunion = ['b', 'b']\nmaterial = 'lamp'\n[[instance]]\nshape = 'u'\n",
        "[shape.u]\nunion = ['b', { shape = 'b', material = 'lamp' }]\n[[instance]]\nshape = 'u'\n",
    ] {
        let lit = scene(&format!("{lamp}{part}"));
        assert!(!lit.is_dark() && lit.has_soft_light(), "{part}");
    }
}

/// A black picture of a scene that counts as lit would be all that its author gets.
#[test]
fn a_material_that_is_nowhere_to_be_seen_lights_nothing() {
    let lamp = "[material.lamp]\nemission = [1, 1, 1]\n[material.grey]\nbase_color = [0.5, 0.5, 0.5]\n\
                [[instance]]\nshape = 'b'\n";
    for part in [
        // Nothing places it.
        "[node.n]\nchildren = [{ shape = 'b', material = 'lamp' }]\n",
        "[shape.u]\nunion = ['b', { shape = 'b', material = 'lamp' }]\n",
        // Another replaces it: nearer ones, that of the whole solid, that of the placement.
        "[node.n]\nchildren = [{ shape = 'b', material = 'grey' }]\n\
         [[instance]]\nnode = 'n'\nmaterial = 'lamp'\n",
        "[shape.u]\nunion = ['b', { shape = 'b', material = 'lamp' }]\nmaterial = 'grey'\n\
         [[instance]]\nshape = 'u'\n",
        "[shape.u]\nunion = ['b', { shape = 'b', material = 'lamp' }]\n\
         [[instance]]\nshape = 'u'\nmaterial = 'grey'\n",
        "[shape.u]\nunion = ['b', 'b']\nmaterial = 'grey'\n\
         [shape.v]\nunion = ['b', { shape = 'u', material = 'lamp' }]\n[[instance]]\nshape = 'v'\n",
    ] {
        let dark = scene(&format!("{lamp}{part}"));
        assert!(dark.is_dark() && !dark.has_soft_light(), "{part}");
    }
    for part in [
        "[node.n]\nchildren = [{ shape = 'b', material = 'grey' }, { shape = 'b' }]\n\
         [[instance]]\nnode = 'n'\nmaterial = 'lamp'\n",
        "[node.n]\nchildren = [{ shape = 'b', material = 'lamp' }]\n\
         [[instance]]\nnode = 'n'\nmaterial = 'grey'\n",
        "[shape.u]\nunion = ['b', { shape = 'b', material = 'lamp' }]\n\
         [shape.v]\nunion = ['b', { shape = 'u', material = 'grey' }]\n[[instance]]\nshape = 'v'\n",
    ] {
        let lit = scene(&format!("{lamp}{part}"));
        assert!(!lit.is_dark() && lit.has_soft_light(), "{part}");
    }
}
