//! The native format means what docs/SCENE_FORMAT.md says.

use crate::common::{in_repository, spans};
use glam::DVec3;
use lanecast::internals::io::{LoadError, LoadOptions, Loaded, Picture, json_schema, load};
use lanecast::internals::scene::{
    Camera, CsgId, Falloff, Instances, Light, Material, Model, Operator, Projection, Scene,
};
use std::fmt::Write as _;
use std::time::Instant;

fn load_text(name: &str, text: &str) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    load(&path, &LoadOptions::default())
}

fn scene(text: &str) -> Scene {
    load_text("scene.toml", &format!("format = 1\n{text}"))
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// The text between a fence of this language and its end.
fn fenced<'a>(document: &'a str, language: &str) -> &'a str {
    let fence = format!("```{language}\n");
    let start = document.find(&fence).expect("a fenced block") + fence.len();
    let end = document[start..].find("```").expect("the fence's end");
    &document[start..start + end]
}

#[test]
fn the_documents_examples_load_as_they_stand() {
    let document = std::fs::read_to_string(in_repository("docs/SCENE_FORMAT.md")).unwrap();
    let loaded = load_text("scene.toml", fenced(&document, "toml")).unwrap();
    assert_eq!(Instances::of(&loaded.scene).unwrap().count(), 5);
    assert_eq!(loaded.scene.lights.len(), 2);
    let solids = &document[document.find("## Solids made of solids").unwrap()..];
    let part = fenced(solids, "toml");
    let part = format!("format = 1\n[material.brass]\n{part}[[instance]]\nshape = 'part'\n");
    let loaded = load_text("scene.toml", &part).unwrap();
    assert_eq!(loaded.scene.csg.len(), 1);
    let polynomials = &document[document.find("### Implicit surfaces").unwrap()..];
    let both = fenced(polynomials, "toml");
    let both = format!("format = 1\n{both}[[instance]]\nshape = 'barth'\n");
    let loaded = load_text("scene.toml", &both).unwrap();
    let degrees = loaded.scene.implicits.tape.iter().map(|tape| tape.degree());
    assert_eq!(degrees.collect::<Vec<_>>(), [6, 6]);
    let loaded = load_text("scene.json", fenced(&document, "json")).unwrap();
    assert_eq!(Instances::of(&loaded.scene).unwrap().count(), 1);
}

#[test]
fn the_schema_file_is_that_of_the_program() {
    let path = in_repository("docs/scene.schema.json");
    let generated = json_schema();
    if std::env::var_os("LANECAST_BLESS").is_some() {
        std::fs::write(&path, &generated).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert_eq!(
        kept,
        generated,
        "set LANECAST_BLESS=1 to rewrite {}",
        path.display()
    );
    for word in [
        "half_space",
        "orthographic",
        "superquadric",
        "inverse_square",
        "Applied first to last",
    ] {
        assert!(generated.contains(word), "{word}");
    }
    assert!(!generated.contains("_format"));
}

#[test]
fn the_scenes_of_the_repository_load() {
    let mut count = 0;
    for entry in std::fs::read_dir(in_repository("scenes")).unwrap() {
        let path = entry.unwrap().path();
        let native = path.extension().is_some_and(|e| e == "toml" || e == "json");
        if native {
            let loaded = load(&path, &LoadOptions::default());
            let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(loaded.warning, None);
            assert!(!loaded.scene.cameras.rows.is_empty(), "{}", path.display());
            // Scenes of light may be lit by what shines, or by the studio.
            let name = path.file_name().unwrap().to_string_lossy();
            let lit = name.starts_with("light_") || !loaded.scene.lights.is_empty();
            assert!(lit, "{name}");
            count += 1;
        }
    }
    assert!(count >= 4);
    let scene = load(
        &in_repository("scenes/instances.toml"),
        &LoadOptions::default(),
    )
    .unwrap()
    .scene;
    assert_eq!(scene.nodes.len(), 4);
    let rings = 2 + 4;
    assert_eq!(
        Instances::of(&scene).unwrap().count(),
        1 + rings * 48 + 4 * 2
    );
}

#[test]
fn every_kind_and_key_arrives_in_its_table() {
    let scene = scene(
        r#"
        background = [0.1, 0.2, 0.3]
        [camera]
        eye = [0, 0, 5]
        look_at = [0, 0, 0]
        up = [1, 0, 0]
        orthographic = 4
        [[light]]
        point = { position = [1, 2, 3], intensity = [4, 5, 6], falloff = "none" }
        [[light]]
        point = { position = [1, 2, 3], intensity = [4, 5, 6] }
        [[light]]
        directional = { direction = [0, -1, 0], irradiance = [1, 2, 3] }
        [material.plain]
        [material.full]
        base_color = [0.1, 0.2, 0.3]
        metallic = 0.4
        roughness = 0.5
        emission = [6, 7, 8]
        transmission = 0.9
        ior = 1.1
        [shape]
        a.sphere = { center = [1, 2, 3], radius = 4 }
        b.ellipsoid = { center = [1, 2, 3], radii = [4, 5, 6] }
        c.half_space = { normal = [0, 2, 0], offset = 3.0 }
        d.box = { min = [0, 0, 0], max = [1, 2, 3] }
        e.cylinder = { base = [0, 0, 0], top = [0, 1, 0], radius = 2 }
        f = { cone = { base = [0, 0, 0], top = [0, 1, 0], base_radius = 2, top_radius = 0 }, open = true }
        g.polyhedron.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]]
        h.polygon.points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        i.quadric.coefficients = [1, 2, 3, 4, 5, 6, 7, 8, 9, -10]
        [[instance]]
        shape = "a"
        material = "full"
        "#,
    );
    assert_eq!(scene.background, [0.1, 0.2, 0.3]);
    let camera = scene.cameras.rows[0];
    assert_eq!(
        camera.projection,
        Projection::Orthographic { half_height: 2.0 }
    );
    assert_eq!((camera.up, camera.forward), (DVec3::X, DVec3::NEG_Z));
    let falloffs: Vec<_> = scene
        .lights
        .iter()
        .map(|l| match l {
            Light::Point { falloff, .. } => Some(*falloff),
            _ => None,
        })
        .collect();
    assert_eq!(
        falloffs,
        [Some(Falloff::None), Some(Falloff::InverseSquare), None]
    );
    assert_eq!(scene.materials.rows[0], Material::default());
    let full = scene.materials.rows[1];
    assert_eq!(
        (full.emission, full.transmission, full.ior),
        ([6.0, 7.0, 8.0], 0.9, 1.1)
    );
    let model = Model::MetallicRoughness {
        metallic: 0.4,
        roughness: 0.5,
    };
    assert_eq!((full.base_color, full.model), ([0.1, 0.2, 0.3], model));
    assert_eq!(scene.shapes.len(), 9);
    let coefficients = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, -10.0];
    assert_eq!(scene.quadrics.coefficients, [coefficients]);
    assert_eq!(scene.spheres.center, [DVec3::new(1.0, 2.0, 3.0)]);
    assert_eq!(scene.ellipsoids.radii, [DVec3::new(4.0, 5.0, 6.0)]);
    assert_eq!(
        (scene.half_spaces.normal[0].y, scene.half_spaces.offset[0]),
        (2.0, 3.0)
    );
    assert_eq!(scene.cuboids.max, [DVec3::new(1.0, 2.0, 3.0)]);
    assert!(!scene.cylinders.open[0] && scene.cones.open[0]);
    assert_eq!(
        (scene.polyhedra.planes.len(), scene.polyhedra.points.len()),
        (4, 4)
    );
    assert_eq!(scene.polygons.points.len(), 3);
    assert_eq!(scene.roots.material[0].map(|m| m.0), Some(1));
}

#[test]
fn an_environment_is_read_from_the_scenes_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let sky = Picture {
        width: 2,
        height: 1,
        color: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
        ..Picture::default()
    };
    sky.save(&folder.path().join("sky.exr")).unwrap();
    let read = |keys: &str| {
        let text = format!(
            "format = 1\n[[light]]\nenvironment = {{ {keys} }}\n[shape.b]\nsphere = {{ center = [0, 0, 0], \
             radius = 1 }}\n[[instance]]\nshape = 'b'\n"
        );
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default())
    };
    let scene = read("file = 'sky.exr', rotate_y = 90, scale = [1, 0.5, 2]")
        .unwrap()
        .scene;
    let map = scene.environment.as_ref().unwrap();
    assert_eq!((map.width, map.height), (2, 1));
    assert_eq!(map.pixels[..], sky.color[..]);
    assert_eq!(map.rotation, std::f64::consts::FRAC_PI_2);
    assert_eq!(map.scale, [1.0, 0.5, 2.0]);
    let scene = read("file = 'sky.exr', scale = 3").unwrap().scene;
    assert_eq!(scene.environment.as_ref().unwrap().scale, [3.0; 3]);
    std::fs::write(folder.path().join("no.exr"), "x").unwrap();
    for (keys, says) in [
        (
            "rotate_y = 9",
            "scene.toml:3:15: the environment is empty; give one of file, color",
        ),
        (
            "file = 'sky.exr', scale = -1",
            "scene.toml:3:43: scale must be 0 or greater",
        ),
        (
            "file = 'sky.png'",
            "scene.toml:3:24: the environment map 'sky.png' cannot be read",
        ),
        (
            "file = 'scene.toml'",
            "is of no known format; known are .exr .hdr .png",
        ),
        ("file = '../sky.exr'", "lies outside its folder"),
        ("file = 'no.exr'", "no.exr: OpenEXR: "),
        ("file = 'sky.exr', rotate = 9", "did you mean 'rotate_y'?"),
    ] {
        let said = read(keys).unwrap_err().to_string();
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn transforms_are_applied_first_to_last() {
    let place = |steps: &str, p: [f64; 3]| {
        let scene = scene(&format!(
            "[shape.a]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n\
             [[instance]]\nshape = 'a'\ntransform = [{steps}]"
        ));
        Instances::of(&scene).unwrap().rows[0]
            .world_from_object
            .point(p)
    };
    let p = [1.0, 2.0, 3.0];
    assert_eq!(place("", p), p);
    assert_eq!(
        place("{ scale = 2 }, { translate = [10, 0, 0] }", p),
        [12.0, 4.0, 6.0]
    );
    assert_eq!(
        place("{ translate = [10, 0, 0] }, { scale = 2 }", p),
        [22.0, 4.0, 6.0]
    );
    assert_eq!(place("{ scale = [1, -2, 0.5] }", p), [1.0, -4.0, 1.5]);
    assert_eq!(place("{ rotate_x = 90 }", p), [1.0, -3.0, 2.0]);
    assert_eq!(place("{ rotate_y = -270 }", p), [3.0, 2.0, -1.0]);
    assert_eq!(place("{ rotate_z = 450.0 }", p), [-2.0, 1.0, 3.0]);
    assert_eq!(
        place("{ rotate = { axis = [0, 0, -2], degrees = 90 } }", p),
        [2.0, -1.0, 3.0]
    );
    let rows = "{ matrix = [[1, 0, 0, 7], [0, 0, 1, 8], [0, 1, 0, 9]] }";
    assert_eq!(place(rows, p), [8.0, 11.0, 11.0]);
    // A third of a turn about the diagonal takes x to y, y to z, z to x.
    let turned = place("{ rotate = { axis = [3, 3, 3], degrees = 120 } }", p);
    let off = DVec3::from_array(turned) - DVec3::new(3.0, 1.0, 2.0);
    assert!(off.length() < 4e-15, "{turned:?}");
}

#[test]
fn toml_and_json_give_the_same_tables() {
    let toml = std::fs::read_to_string(in_repository("scenes/glass.toml")).unwrap();
    let json = serde_json::to_string(&toml.parse::<toml::Table>().unwrap()).unwrap();
    let tables = |name, text: &str| format!("{:?}", &*load_text(name, text).unwrap().scene);
    assert_eq!(tables("a.toml", &toml), tables("a.json", &json));
    // A byte order mark and Windows line ends change nothing.
    let windows = format!("\u{feff}{}", toml.replace('\n', "\r\n"));
    assert_eq!(tables("a.toml", &toml), tables("a.toml", &windows));
    let marked = format!("\u{feff}{json}");
    assert_eq!(tables("a.json", &json), tables("a.json", &marked));
}

#[test]
fn null_counts_as_absent() {
    let rest =
        "\"format\": 1, \"shape\": {\"a\": {\"sphere\": {\"center\": [0, 0, 0], \"radius\": 1}}}";
    let tables = |instance: &str, more: &str| {
        let text = format!("{{{rest}, \"instance\": [{{\"shape\": \"a\"{instance}}}]{more}}}");
        format!("{:?}", &*load_text("a.json", &text).unwrap().scene)
    };
    let of_file = ["background", "camera", "light", "material", "node"];
    let of_file: String = of_file.map(|key| format!(", \"{key}\": null")).concat();
    let of_instance = ", \"node\": null, \"material\": null, \"transform\": null, \"motion\": null";
    assert_eq!(tables("", ""), tables(of_instance, &of_file));
    let lamp = |more: &str| {
        let point = "\"position\": [0, 9, 0], \"intensity\": [1, 1, 1]";
        tables(
            "",
            &format!(", \"light\": [{{\"point\": {{{point}{more}}}}}]"),
        )
    };
    assert_eq!(lamp(""), lamp(", \"falloff\": null"));
}

#[test]
fn the_nearest_material_counts() {
    let scene = scene(
        "[material.outer]\n[material.inner]\n\
         [shape.a]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
         [node.top]\nchildren = [{ node = 'pair', material = 'outer' }]\n\
         [node.pair]\nchildren = [{ shape = 'a' }, { shape = 'a', material = 'inner' }]\n\
         [[instance]]\nnode = 'top'\n[[instance]]\nshape = 'a'",
    );
    let rows = Instances::of(&scene).unwrap().rows.clone();
    let materials: Vec<_> = rows.iter().map(|r| r.material.map(|m| m.0)).collect();
    assert_eq!(materials, [Some(0), Some(1), None]);
}

#[test]
fn a_mesh_file_is_read_from_the_scenes_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("meshes")).unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("meshes/tetra.obj"), obj).unwrap();
    let path = folder.path().join("scene.toml");
    let text = "format = 1\n[shape.closed]\nmesh = 'meshes/tetra.obj'\n\
                [shape.sheet]\nmesh = 'meshes/../meshes/tetra.obj'\nopen = true\n\
                [[instance]]\nshape = 'closed'\n[[instance]]\nshape = 'sheet'\n";
    std::fs::write(&path, text).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap().scene;
    assert_eq!((scene.meshes.len(), scene.meshes.triangles.len()), (2, 8));
    assert_eq!(scene.meshes.open, [false, true]);
}

#[test]
fn csg_solids_arrive_with_operands_that_are_defined_later() {
    let scene = scene(
        r#"
        [material.red]
        [material.blue]
        [shape]
        all.union = ["part", { shape = "ball", material = "blue", transform = [{ scale = 2 }, { translate = [1, 0, 0] }] }]
        all.material = "red"
        all.tolerance = 0.5
        part.difference = ["ball", "rest"]
        rest.complement = "ball"
        both.intersection = ["ball", "part", "ball"]
        odd.xor = [{ shape = "both" }]
        ball.sphere = { center = [0, 0, 0], radius = 1 }
        [[instance]]
        shape = "all"
        "#,
    );
    let table = &scene.csg;
    assert_eq!(
        table.operator,
        [
            Operator::Union,
            Operator::Difference,
            Operator::Complement,
            Operator::Intersection,
            Operator::Xor
        ]
    );
    let ids = |row: u32| -> Vec<u32> {
        let operands = table.operands(CsgId(row)).iter();
        operands.map(|operand| operand.shape.0).collect()
    };
    let (all, part, rest, both, ball) = (ids(0), ids(1), ids(2), ids(3), 5);
    assert_eq!(
        (all, part, rest),
        (vec![1, ball], vec![ball, 2], vec![ball])
    );
    assert_eq!((both, ids(4)), (vec![ball, 1, ball], vec![3]));
    assert_eq!(table.tolerance, [0.5, 0.0, 0.0, 0.0, 0.0]);
    let materials: Vec<_> = table.material.iter().map(|m| m.map(|m| m.0)).collect();
    assert_eq!(materials, [Some(0), None, None, None, None]);
    let placed = table.operands(CsgId(0))[1];
    assert_eq!(placed.material.map(|m| m.0), Some(1));
    let map = scene.transforms.local[placed.transform.index()];
    assert_eq!(map.point([1.0, 1.0, 1.0]), [3.0, 2.0, 2.0]);
}

/// A ball far from the others at every second level; every other takes nothing away.
#[test]
fn a_chain_of_100_000_operators_loads_and_is_traced() {
    const DEPTH: usize = 100_000;
    let mut text = String::from("[shape]\n");
    for i in 0..DEPTH {
        let operator = if i % 2 == 0 { "union" } else { "difference" };
        let below = match i + 1 {
            DEPTH => "ball".into(),
            next => format!("c{next}"),
        };
        writeln!(
            text,
            "c{i}.{operator} = ['{below}', {{ shape = 'ball', transform = [{{ translate = [{}, 0, 0] }}] }}]",
            3 * (i + 1)
        )
        .unwrap();
    }
    text += "ball.sphere = { center = [0, 0, 0], radius = 1 }\n[[instance]]\nshape = 'c0'\n";
    let start = Instant::now();
    let scene = scene(&text);
    assert_eq!(scene.csg.len(), DEPTH);
    let instances = Instances::of(&scene).unwrap();
    for (row, hit) in [(0, true), (1, false), (49_998, true), (DEPTH - 1, false)] {
        let org = DVec3::new(3.0 * (row + 1) as f64, 0.0, 5.0);
        let found = spans(&scene, &instances, org, DVec3::NEG_Z).unwrap().rows;
        let ends: Vec<_> = found.iter().map(|s| (s.t_enter(), s.t_exit())).collect();
        let expected: &[(f64, f64)] = if hit { &[(4.0, 6.0)] } else { &[] };
        assert_eq!(ends, expected, "level {row}");
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
    // Far from what anything quadratic would take.
    assert!(start.elapsed().as_secs() < 60);
}

/// Ordinary files may be this deep: time and stack must not mind.
#[test]
fn a_chain_of_200_000_nodes_loads() {
    const NODES: usize = 200_000;
    let mut toml = String::from("format = 1\n");
    let mut json = String::from("{\"format\":1,\"node\":{");
    for i in 0..NODES {
        let child = if i + 1 < NODES {
            format!("node{}n{}", "*", i + 1)
        } else {
            "shape*ball".into()
        };
        let (kind, name) = child.split_once('*').unwrap();
        writeln!(toml, "[node.n{i}]\nchildren = [{{ {kind} = '{name}' }}]").unwrap();
        let comma = if i == 0 { "" } else { "," };
        write!(
            json,
            "{comma}\"n{i}\":{{\"children\":[{{\"{kind}\":\"{name}\"}}]}}"
        )
        .unwrap();
    }
    toml +=
        "[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n[[instance]]\nnode = 'n0'\n";
    json += "},\"shape\":{\"ball\":{\"sphere\":{\"center\":[0,0,0],\"radius\":1}}},";
    json += "\"instance\":[{\"node\":\"n0\"}]}";
    for (name, text) in [("a.toml", toml), ("a.json", json)] {
        let start = Instant::now();
        let loaded = load_text(name, &text).unwrap();
        assert_eq!(loaded.scene.nodes.len(), NODES);
        assert_eq!(Instances::of(&loaded.scene).unwrap().count(), 1);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        // Far from what anything quadratic would take.
        assert!(start.elapsed().as_secs() < 60);
    }
}

/// Cameras keep their names and order; a pose is what eye, look_at and up say, and a calibrated
/// camera without distortion what fov_y says.
#[test]
fn cameras_have_names_poses_and_lenses() {
    let scene = scene(
        r#"
        [camera.front]
        eye = [1, 2, 5]
        look_at = [1, 2, 0]
        fov_y = 90
        lens = { f_number = 2.0, focal_length = 0.5, focus = [7, 7, 1] }
        [camera.posed]
        pose = [[1, 0, 0, 1], [0, -1, 0, 2], [0, 0, -1, 5]]
        k = { fx = 50, fy = 50, cx = 99.5, cy = 49.5, width = 200, height = 100 }
        [shape.ball]
        sphere = { center = [0, 0, 0], radius = 1 }
        [[instance]]
        shape = "ball"
        "#,
    );
    let [front, posed] = scene.cameras.rows[..] else {
        panic!("two cameras");
    };
    assert_eq!(scene.cameras.pick(Some("posed")).unwrap(), Some(1));
    assert_eq!(scene.cameras.pick(None).unwrap(), Some(0));
    let frame = |c: &Camera| [c.eye, c.right, c.up, c.forward];
    assert_eq!(frame(&front), frame(&posed));
    let lens = front.lens.unwrap();
    assert_eq!((lens.radius, lens.focus, lens.blades), (0.125, 4.0, 0));
    let half = posed.projection.half_height();
    assert!((half - front.projection.half_height()).abs() < 1e-15);
}
