//! Scenes exported for POV-Ray: the text, and that POV-Ray renders the same picture.

use crate::common::{Loaded, in_repository, load};
use lanecast::internals::accel::Structure;
use lanecast::internals::io::pov_text;
use lanecast::internals::plan::Precision;
use lanecast::internals::render::RenderConfig;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const VIEW: &str = "format = 1
[camera]
eye = [0, 0, 5]
look_at = [0, 0, 0]
fov_y = 90
";

fn loaded(text: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.toml");
    std::fs::write(&path, format!("{VIEW}{text}")).unwrap();
    load(&path, 4.0 / 3.0)
}

fn text(scene: &str) -> String {
    let loaded = loaded(scene);
    pov_text(&loaded.scene, &loaded.camera).unwrap()
}

/// Every line of `wanted` stands in the text, in this order.
fn has(text: &str, wanted: &[&str]) {
    let mut rest = text;
    for line in wanted {
        let Some(at) = rest.find(line) else {
            panic!("not here, or not in this place: {line}\n{text}");
        };
        rest = &rest[at + line.len()..];
    }
}

#[test]
fn lights_with_an_area_are_grids_of_points() {
    let text = text(
        "[[light]]
        rectangle = { center = [0, 3, 0], edge_u = [0, 0, 2], edge_v = [4, 0, 0], radiance = [1, 1, 1] }
        [[light]]
        disc = { center = [0, 5, 0], normal = [0, -2, 0], radius = 2, radiance = [1, 1, 1], two_sided = true }
        [shape]
        a.sphere = { center = [0, 0, 0], radius = 1 }
        [[instance]]
        shape = 'a'",
    );
    has(
        &text,
        &[
            "light_source { <0, 3, 0>",
            "spotlight radius 90 falloff 90 tightness 1 point_at <0, 4, 0>",
            "area_light <0, 0, 2>, <4, 0, 0>, 9, 9 adaptive 1 jitter }",
            "point_at <0, 4, 0>",
            "9, 9 circular adaptive 1 jitter }",
            "point_at <0, 6, 0>",
        ],
    );
    assert_eq!(text.matches("light_source").count(), 3);
}

#[test]
fn every_kind_is_written() {
    let text = text(
        "[shape]
        a.sphere = { center = [1, 2, 3], radius = 4 }
        b.ellipsoid = { center = [1, 2, 3], radii = [4, 5, 6] }
        c.half_space = { normal = [0, 2, 0], offset = 3.0 }
        d.box = { min = [0, 0, 0], max = [1, 2, 3] }
        e = { cylinder = { base = [0, 0, 0], top = [0, 1, 0], radius = 2 }, open = true }
        f.cone = { base = [0, 0, 0], top = [0, 1, 0], base_radius = 2, top_radius = 1e-9 }
        g.polyhedron.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        h.polygon.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        i.quadric.coefficients = [1, 2, 3, 4, 5, 6, 7, 8, 9, -1]
        j = { implicit = 'x^2/2 - min(sin(y), z)', clip.sphere = { center = [0, 1, 0], radius = 2 }, open = true }
        unseen.sphere = { center = [1, 2, 3], radius = 4 }
        [node.all]
        children = [{ shape = 'a' }, { shape = 'b' }, { shape = 'c' }, { shape = 'd' },
          { shape = 'e' }, { shape = 'f' }, { shape = 'g' }, { shape = 'h' }, { shape = 'i' },
          { shape = 'j' }]
        [[instance]]
        node = 'all'
        transform = [{ rotate_z = 90 }, { translate = [7, 8, 9] }]
        [[light]]
        directional = { direction = [0, -1, 0], irradiance = [1, 1, 1] }",
    );
    has(
        &text,
        &[
            "#version 3.7;",
            "camera { perspective\n  location <0, 0, 5>\n  direction <0, 0, -1>\n",
            "* image_width / image_height\n}",
            "parallel point_at <0, 0, 5> }",
            "#declare Shape_0 = sphere { <1, 2, 3>, 4 } // a\n",
            "#declare Shape_1 = sphere { 0, 1 scale <4, 5, 6> translate <1, 2, 3> } // b\n",
            "#declare Shape_2 = plane { <0, 1, 0>, 1.5 } // c\n",
            "#declare Shape_3 = box { <0, 0, 0>, <1, 2, 3> } // d\n",
            "#declare Shape_4 = cylinder { <0, 0, 0>, <0, 1, 0>, 2 open } // e\n",
            "#declare Shape_5 = cone { <0, 0, 0>, 2, <0, 1, 0>, 1e-9 } // f\n",
            "#declare Shape_6 = intersection {\n  plane {",
            "#declare Shape_7 = polygon { 4, <0, 0, 0>, <1, 0, 0>, <0, 1, 0>, <0, 0, 0> } // h\n",
            "#declare Shape_8 = quadric { <1, 2, 3>, <4, 5, 6>, <7, 8, 9>, -1 } // i\n",
            "#declare Shape_9 = isosurface {\n  function { ((pow(x, 2) / ((2))) - min(sin(y), z)) }\n  \
             contained_by { sphere { <0, 1, 0>, 2 } }\n  accuracy 1e-7 max_gradient ",
            "\n  all_intersections\n  open\n} // j\n",
            "#declare Node_0 = union { // all\nobject { Shape_0 }\n",
            "object { Shape_9 }\n}\n",
            "object { Node_0 matrix <0, 1, 0, -1, 0, 0, 0, 0, 1, 7, 8, 9> }\n",
        ],
    );
    assert!(!text.contains("unseen"), "{text}");
}

#[test]
fn what_is_no_number_is_not_written() {
    // A sun is placed outside of everything.
    let scene = "[shape.ball]
        sphere = { center = [0, 0, 0], radius = 1 }
        [[light]]
        directional = { direction = [0, -1, 0], irradiance = [1, 1, 1] }
        [[instance]]
        shape = 'ball'
        transform = [{ scale = 1e160 }]
        ";
    let loaded = loaded(scene);
    let error = pov_text(&loaded.scene, &loaded.camera)
        .unwrap_err()
        .to_string();
    assert!(error.contains("beyond f64: light_source"), "{error}");
}

#[test]
fn operators_are_written() {
    let text = text(
        "[material.clay]
        [shape]
        a.sphere = { center = [0, 0, 0], radius = 1 }
        both.intersection = ['a', { shape = 'a', transform = [{ translate = [1, 0, 0] }] }]
        cut.difference = ['a', { shape = 'both', material = 'clay' }]
        not.complement = 'cut'
        odd.xor = ['a', 'cut', 'not']
        all.union = ['odd', 'both']
        one.union = ['all']
        [[instance]]
        shape = 'one'",
    );
    has(
        &text,
        &[
            "#declare Shape_0 = sphere { <0, 0, 0>, 1 } // a\n",
            "#declare Shape_1 = intersection {\n  object { Shape_0 }\n  \
             object { Shape_0 matrix <1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0> }\n} // both\n",
            "#declare Shape_2 = difference {\n  object { Shape_0 }\n  \
             object { Shape_1 material { Material_0 } }\n} // cut\n",
            "#declare Shape_3 = object { object { Shape_2 } inverse } // not\n",
            "#declare Shape_4_xor_0 = union {\n  difference { object { Shape_0 } object { Shape_2 } }\n",
            "#declare Shape_4 = union {\n  \
             difference { object { Shape_4_xor_0 } object { Shape_3 } }\n  \
             difference { object { Shape_3 } object { Shape_4_xor_0 } }\n} // odd\n",
            "#declare Shape_5 = union {\n  object { Shape_4 }\n  object { Shape_1 }\n} // all\n",
            "#declare Shape_6 = object { Shape_5 } // one\n",
            "\nobject { Shape_6 }\n",
        ],
    );
}

/// In POV-Ray the innermost material wins; here that of a placement does.
#[test]
fn a_placements_material_wins_over_those_of_operands() {
    let text = text(
        "[material.clay]
        [material.gold]
        [shape]
        ball.sphere = { center = [0, 0, 0], radius = 1 }
        hole.sphere = { center = [0, 0, 1], radius = 0.5 }
        cut.difference = ['ball', { shape = 'hole', material = 'clay' }]
        painted = { union = ['cut', 'ball'], material = 'gold' }
        [node.plain]
        children = [{ shape = 'cut' }]
        [node.golden]
        children = [{ node = 'plain', material = 'gold' }]
        [[instance]]
        node = 'plain'
        [[instance]]
        node = 'golden'
        [[instance]]
        shape = 'painted'",
    );
    has(
        &text,
        &[
            "#declare Shape_2 = difference {\n  object { Shape_0 }\n  \
             object { Shape_1 material { Material_0 } }\n}",
            "#declare Bare_Shape_2 = difference {\n  object { Shape_0 }\n  object { Shape_1 }\n}",
            "#declare Shape_3 = object { union {\n  object { Bare_Shape_2 }\n  \
             object { Shape_0 }\n} material { Material_1 } }",
            "#declare Node_0 = union { // plain\nobject { Shape_2 }\n}",
            "#declare Bare_Node_0 = union { // plain\nobject { Bare_Shape_2 }\n}",
            "#declare Node_1 = union { // golden\nobject { Bare_Node_0 material { Material_1 } }\n}",
            "\nobject { Node_0 }\nobject { Node_1 }\nobject { Shape_3 }\n",
        ],
    );
}

#[test]
fn clear_materials_want_merged_unions() {
    let scene = |transmission: f64| {
        format!(
            "[material.glass]\ntransmission = {transmission}\n[shape]\n\
             a.sphere = {{ center = [0, 0, 0], radius = 1 }}\nb.union = ['a', 'a']\n\
             [[instance]]\nshape = 'b'\nmaterial = 'glass'"
        )
    };
    assert!(text(&scene(0.5)).contains("= merge {"));
    assert!(text(&scene(0.0)).contains("= union {"));
}

#[test]
fn meshes_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n";
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    let loaded = load(&folder.path().join("a.obj"), 1.0);
    let text = pov_text(&loaded.scene, &loaded.camera).unwrap();
    has(
        &text,
        &[
            "= mesh2 {\n  vertex_vectors { 4,\n    <0, 0, 0>,\n",
            "  face_indices { 2,\n    <0, 1, 2>,\n    <0, 2, 3>\n  }\n}",
        ],
    );

    // As an operand it needs an inside.
    let obj = format!("{obj}f 1 4 3\nf 2 3 4\n");
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    let scene =
        format!("{VIEW}[shape]\na.mesh = 'a.obj'\nb.union = ['a']\n[[instance]]\nshape = 'b'");
    let path = folder.path().join("a.toml");
    std::fs::write(&path, scene).unwrap();
    let loaded = load(&path, 1.0);
    let text = pov_text(&loaded.scene, &loaded.camera).unwrap();
    has(&text, &["  }\n  inside_vector <0.36, 0.48, 0.8>\n}"]);
}

fn scene_file(name: &str) -> PathBuf {
    in_repository("scenes").join(name)
}

const SIZE: (u32, u32) = (160, 120);

/// The scene in plain colours, each material another: no light, all of them glow.
fn flat(name: &str) -> Value {
    let text = std::fs::read_to_string(scene_file(name)).unwrap();
    let mut scene = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
    scene["background"] = json!([1, 1, 1]);
    scene["light"] = json!([{ "point": { "position": [0, 9, 0], "intensity": [0, 0, 0] } }]);
    if let Some(materials) = scene["material"].as_object_mut() {
        for (i, (_, material)) in materials.iter_mut().enumerate() {
            let bits = 1 + i % 6;
            let glow = [0, 1, 2].map(|k| bits >> k & 1);
            *material = json!({ "base_color": [0, 0, 0], "emission": glow, "roughness": 1 });
        }
    }
    scene
}

/// By pixel, which of red, green and blue is on.
fn here(loaded: &Loaded) -> Vec<[bool; 3]> {
    let world = loaded.world(Structure::Bvh);
    let config = RenderConfig {
        width: SIZE.0,
        height: SIZE.1,
        ..RenderConfig::default()
    };
    let kernels = loaded.kernels(Precision::Exact);
    let rendered = loaded.render(&world, kernels, &loaded.scene.lights, &config);
    let color = rendered.picture.color.iter();
    color.map(|c| c.map(|x| x > 0.5)).collect()
}

/// What scenes refer to.
fn copy_meshes(folder: &Path) {
    let from = in_repository("scenes/meshes");
    let to = folder.join("meshes");
    std::fs::create_dir(&to).unwrap();
    for file in std::fs::read_dir(from).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
    }
}

/// The same by POV-Ray; `None` where it is not installed.
fn there(folder: &Path) -> Option<Vec<[bool; 3]>> {
    let output = Command::new("povray")
        .current_dir(folder)
        .args(["+Ia.pov", "+Oa.ppm", "+FP", "-D", "-A", "-GA"])
        .args([format!("+W{}", SIZE.0), format!("+H{}", SIZE.1)])
        .stdin(Stdio::null())
        .output()
        .ok()?;
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let bytes = std::fs::read(folder.join("a.ppm")).unwrap();
    let pixels = bytes.len() - (SIZE.0 * SIZE.1 * 3) as usize;
    assert!(bytes.starts_with(b"P6"));
    let rows = bytes[pixels..].chunks(3);
    Some(rows.map(|c| [0, 1, 2].map(|k| c[k] > 127)).collect())
}

/// The same solid with the same material at all but a few pixels, on silhouettes.
/// Of scenes without faces that coincide: on those POV-Ray has skins.
#[test]
fn povray_sees_what_is_seen_here() {
    for name in [
        "primitives.toml",
        "instances.toml",
        "csg_operators.toml",
        "csg_lens.toml",
        "csg_steinmetz.toml",
        "csg_grid.toml",
        "csg_deep.toml",
        "csg_mesh.toml",
        "formula_gyroid.toml",
        "formula_solids.toml",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        copy_meshes(folder.path());
        std::fs::write(&path, flat(name).to_string()).unwrap();
        let loaded = load(&path, 4.0 / 3.0);
        let text = pov_text(&loaded.scene, &loaded.camera).unwrap();
        std::fs::write(folder.path().join("a.pov"), text).unwrap();
        let Some(there) = there(folder.path()) else {
            println!("skipped: no povray");
            return;
        };
        let here = here(&loaded);
        let differ = here.iter().zip(&there).filter(|(a, b)| a != b).count();
        let share = differ as f64 / here.len() as f64;
        println!("{name}: {differ} of {} pixels differ", here.len());
        assert!(share < 0.01, "{name}: {share}");
        // And it is a picture.
        let mut colors = here.clone();
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 1, "{name}: {colors:?}");
    }
}
