//! Scenes as texts for Mitsuba; that it reads them, and what it makes of it, is checked by
//! `.ci/mitsuba`.

use lanecast::internals::io::{
    LoadOptions, MitsubaError, MitsubaPicture, MitsubaScene, load, mitsuba_scene,
};
use lanecast::internals::scene::Instances;

fn export(text: &str) -> Result<MitsubaScene, MitsubaError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("format = 1\n{text}")).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap().scene;
    let instances = Instances::of(&scene).unwrap();
    let (scene, camera) = scene.completed(Some(0), &instances, 2.0);
    let picture = MitsubaPicture {
        width: 200,
        height: 100,
        max_depth: 5,
        stem: "a&b".into(),
    };
    mitsuba_scene(&scene, &instances, &camera, &picture)
}

const CAMERA: &str = "camera = { eye = [0, 0, 5], look_at = [0, 0, 0], fov_y = 90 }\n";
const LIGHT: &str = "[[light]]\npoint = { position = [0, 4, 0], intensity = [1, 2, 3] }\n";

#[test]
fn exact_scenes_have_no_warning() {
    let text = format!(
        "background = [0.5, 0.25, 0]\n{CAMERA}{LIGHT}\
         [material.dull]\nspecular = 0.0\nbase_color = [0.25, 0.5, 0.75]\n\
         [material.glass]\nbase_color = [1, 1, 1]\nroughness = 0\ntransmission = 1\n\
         [material.pane]\nbase_color = [1, 1, 1]\nroughness = 0\ntransmission = 1\nthin = true\n\
         [shape.ball]\nsphere = {{ center = [1, 0, 0], radius = 0.5 }}\n\
         [shape.block]\nbox = {{ min = [0, 0, 0], max = [2, 4, 6] }}\n\
         [shape.floor]\npolygon = {{ points = [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]] }}\n\
         [shape.tip]\npolygon = {{ points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]] }}\n\
         [shape.rod]\ncylinder = {{ base = [0, 0, 0], top = [0, 2, 0], radius = 0.5 }}\n\
         [shape.gem]\npolyhedron = {{ points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]] }}\n\
         [[instance]]\nshape = 'ball'\nmaterial = 'glass'\ntransform = [{{ scale = 2 }}]\n\
         [[instance]]\nshape = 'block'\nmaterial = 'dull'\n\
         [[instance]]\nshape = 'floor'\nmaterial = 'dull'\n\
         [[instance]]\nshape = 'tip'\nmaterial = 'dull'\ntransform = [{{ scale = [-1, 1, 1] }}]\n\
         [[instance]]\nshape = 'rod'\nmaterial = 'pane'\n\
         [[instance]]\nshape = 'gem'\nmaterial = 'glass'\n\
         [[instance]]\nshape = 'gem'\nmaterial = 'dull'\n"
    );
    let made = export(&text).unwrap();
    // The material of what has none, which is only similar, is not used here.
    assert_eq!(made.warning, None);
    for part in [
        "<integer name=\"max_depth\" value=\"6\"/>",
        "<float name=\"fov\" value=\"90\"/>",
        "<matrix value=\"-1 0 0 0 0 1 0 0 0 0 -1 5 0 0 0 1\"/>",
        "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.5, 0.25, 0\"/></emitter>",
        "<emitter type=\"point\"><point name=\"position\" value=\"0, 4, 0\"/><rgb name=\"intensity\" \
         value=\"1, 2, 3\"/></emitter>",
        "<bsdf id=\"material_0\" type=\"twosided\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" \
         value=\"0.25, 0.5, 0.75\"/></bsdf></bsdf>",
        "<bsdf id=\"material_1\" type=\"dielectric\"><float name=\"int_ior\" value=\"1.5\"/>",
        "<bsdf id=\"material_2\" type=\"thindielectric\">",
        "<point name=\"center\" value=\"2, 0, 0\"/><float name=\"radius\" value=\"1\"/>",
        "<shape type=\"cube\"><transform name=\"to_world\"><matrix value=\"1 0 0 1 0 2 0 2 0 0 3 3 \
         0 0 0 1\"/>",
        "<shape type=\"rectangle\"><transform name=\"to_world\"><matrix value=\"1 0 0 0 0 0 1 0 0 -1 \
         0 0 0 0 0 1\"/>",
        "<string name=\"filename\" value=\"a&amp;b_mesh_0.ply\"/>",
        "<shape type=\"disk\">",
        "flip_normals",
    ] {
        assert!(made.xml.contains(part), "{part}\n{}", made.xml);
    }
    // Both instances of the polyhedron share a file of four triangles.
    assert_eq!(made.files.len(), 2);
    let head = String::from_utf8_lossy(&made.files[1].1[..200]).into_owned();
    assert!(head.contains("element face 4"), "{head}");
}

#[test]
fn rectangles_and_discs_of_light_shine_along_their_normals() {
    let text = format!(
        "{CAMERA}[[light]]\nrectangle = {{ center = [0, 3, 0], edge_u = [0, 0, 2], edge_v = [4, 0, 0], radiance = [1, 2, 3] }}\n\
         [[light]]\ndisc = {{ center = [1, 0, 0], normal = [0, 0, 2], radius = 2, radiance = [4, 5, 6], two_sided = true }}\n\
         [shape.ball]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n[[instance]]\nshape = 'ball'\n"
    );
    let made = export(&text).unwrap();
    let told = made.warning.unwrap();
    for part in [
        "2 × flat light, which can be seen",
        "1 × flat light, which shines on one side",
    ] {
        assert!(told.contains(part), "{told}");
    }
    let lines: Vec<&str> = made
        .xml
        .lines()
        .filter(|l| l.contains("\"area\""))
        .collect();
    // Columns are half the edges, the normal u × v = 8y, unit, and the middle.
    let rectangle = "<matrix value=\"0 2 0 0 0 0 1 3 1 0 0 0 0 0 0 1\"/>";
    assert!(
        lines[0].contains("\"rectangle\"") && lines[0].contains(rectangle),
        "{lines:?}"
    );
    assert!(
        lines[1].contains("\"disk\"") && lines[1].contains("4, 5, 6"),
        "{lines:?}"
    );
}

#[test]
fn what_is_similar_or_missing_is_counted() {
    let text = format!(
        "{CAMERA}[[light]]\nspot = {{ position = [0, 4, 0], direction = [0, -1, 0], intensity = [1, 1, 1], outer = 30 }}\n\
         [material.lamp]\nemission = [3, 3, 3]\n\
         [material.steel]\nmetallic = 1\nclearcoat = 0.5\n\
         [shape.egg]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n\
         [shape.floor]\nhalf_space = {{ normal = [0, 2, 0], offset = -2 }}\n\
         [shape.cone]\ncone = {{ base = [0, 0, 0], top = [0, 1, 0], base_radius = 1, top_radius = 0 }}\n\
         [shape.lamp]\npolygon = {{ points = [[-1, 3, 1], [1, 3, 1], [1, 3, -1], [-1, 3, -1]] }}\n\
         [[instance]]\nshape = 'egg'\ntransform = [{{ scale = [1, 2, 1] }}]\n\
         [[instance]]\nshape = 'floor'\nmaterial = 'steel'\n\
         [[instance]]\nshape = 'cone'\n\
         [[instance]]\nshape = 'lamp'\nmaterial = 'lamp'\n"
    );
    let made = export(&text).unwrap();
    let told = made.warning.unwrap();
    for part in [
        "not exported: 1 × clearcoat, 1 × cone, 1 × sphere that its transform deforms; only similar",
        "1 × flat light, which shines on one side",
        "1 × half-space, as a square",
        "1 × rough metal, as roughconductor",
        "1 × spot light, whose rim fades linearly",
        "1 × metallic-roughness, as principled",
    ] {
        assert!(told.contains(part), "{told}");
    }
    // The lamp's normal is turned down, towards the middle of the scene.
    let lamp = made
        .xml
        .lines()
        .find(|line| line.contains("type=\"area\""))
        .unwrap();
    assert!(
        lamp.contains("<matrix value=\"0 1 0 0 0 0 -1 3 -1 0 0 0 0 0 0 1\"/>"),
        "{lamp}"
    );
}

#[test]
fn numbers_beyond_f32_are_an_error() {
    let text = format!(
        "{CAMERA}{LIGHT}[shape.ball]\nsphere = {{ center = [1e60, 0, 0], radius = 0.5 }}\n\
         [[instance]]\nshape = 'ball'\n"
    );
    let said = export(&text).unwrap_err().to_string();
    assert!(said.contains("a number beyond f32: <"), "{said}");
}
