//! OBJ, MTL, PLY and STL as people have them: what public reports say that other programs
//! misread, from the folder `found/` of the test assets, and made files of the same kinds.

use crate::common::{assets, kernels, load as load_with_view};
use glam::DVec3;
use lanecast::internals::accel::Structure;
use lanecast::internals::io::{LoadOptions, Loaded, load};
use lanecast::internals::plan::Precision;
use lanecast::internals::render::RenderConfig;
use lanecast::internals::scene::{Instances, Material, Model, Rgb, Scene, Shape};
use std::path::{Path, PathBuf};

/// A file of the folder `found/`.
pub fn found(name: &str) -> Option<PathBuf> {
    Some(assets()?.join("found").join(name))
}

pub fn loaded(path: &Path) -> Loaded {
    load(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Loads the first of some files, which are written to a folder of their own.
pub fn made(files: &[(&str, &[u8])]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    loaded(&folder.path().join(files[0].0))
}

/// The triangles of all instances in world space.
pub fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let mut all = Vec::new();
    for row in Instances::of(scene).unwrap().iter(scene) {
        let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
            continue;
        };
        let mesh = scene.meshes.row(id);
        let world = |p: [f32; 3]| {
            let p = DVec3::from_array(p.map(f64::from)) + mesh.center;
            DVec3::from_array(row.world_from_object.point(p.to_array()))
        };
        all.extend((0..mesh.triangles.len()).map(|t| mesh.corners(t).map(world)));
    }
    all
}

fn area(scene: &Scene) -> f64 {
    let of = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length() / 2.0;
    triangles(scene).iter().map(of).sum()
}

/// Asserts that the scene's triangles are in this box and reach its sides.
pub fn assert_spans(scene: &Scene, low: [f64; 3], high: [f64; 3]) {
    let all = triangles(scene);
    let corners = || all.iter().flatten();
    let min = corners().fold(DVec3::INFINITY, |a, p| a.min(*p));
    let max = corners().fold(DVec3::NEG_INFINITY, |a, p| a.max(*p));
    let is = |a: DVec3, b: [f64; 3]| a.abs_diff_eq(DVec3::from_array(b), 1e-6);
    assert!(is(min, low) && is(max, high), "{min} to {max}");
}

pub fn assert_warns(loaded: &Loaded, says: &str) {
    let warning = loaded.warning.as_deref().unwrap_or_default();
    assert!(warning.contains(says), "{warning:?} has no {says:?}");
}

/// The materials of the first mesh's triangles.
pub fn materials(scene: &Scene) -> Vec<Option<Material>> {
    let row = Instances::of(scene).unwrap().iter(scene).next().unwrap();
    let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
        panic!("no mesh");
    };
    let mesh = scene.meshes.row(id);
    let of = |t| row.material.or(mesh.material(t));
    let all = (0..mesh.triangles.len() as u32).map(of);
    all.map(|m| m.map(|m| scene.materials.rows[m.index()]))
        .collect()
}

fn colors(scene: &Scene) -> Vec<Rgb> {
    let all = materials(scene).into_iter();
    all.map(|m| m.unwrap_or_default().base_color).collect()
}

const CUBE: &str = "v 0 0 0\nv 0 0 1\nv 0 1 0\nv 0 1 1\nv 1 0 0\nv 1 0 1\nv 1 1 0\nv 1 1 1\n\
    f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n";

fn assert_cube(loaded: &Loaded) {
    assert_eq!(triangles(&loaded.scene).len(), 12);
    assert_spans(&loaded.scene, [0.0; 3], [1.0; 3]);
}

/// The area inside an outline by the shoelace formula.
fn shoelace(points: &[[f64; 2]]) -> f64 {
    let next = points.iter().skip(1).chain(points.first());
    let twice: f64 = points
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum();
    twice.abs() / 2.0
}

#[test]
fn concave_faces_have_the_area_of_their_outline() {
    if let Some(path) = found("02-concave-ngon/f3d473.obj") {
        let text = std::fs::read_to_string(&path).unwrap();
        let points = text.lines().filter_map(|line| {
            let mut words = line.strip_prefix("v ")?.split(' ');
            let mut number = || words.next().unwrap().parse().unwrap();
            Some([number(), number()])
        });
        let expected = shoelace(&points.collect::<Vec<[f64; 2]>>());
        for path in [path.clone(), path.with_file_name("wrap.toml")] {
            let scene = loaded(&path).scene;
            assert_eq!(triangles(&scene).len(), 14);
            assert!((area(&scene) - expected).abs() < 1e-6, "{}", area(&scene));
        }
    }
    // An arrow whose first corner sees only a part, in a plane that is not upright.
    let arrow = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]];
    let expected = shoelace(&arrow) * 3.0_f64.sqrt();
    let (mut obj, mut ply) = (
        String::new(),
        String::from(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
        ),
    );
    for [x, y] in arrow {
        obj += &format!("v {x} {y} {}\n", x + y);
        ply += &format!("{x} {y} {}\n", x + y);
    }
    for turn in 0..4 {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| (i + turn) % 4);
        let face = format!("f {} {} {} {}\n", a + 1, b + 1, c + 1, d + 1);
        let obj = made(&[("a.obj", format!("{obj}{face}").as_bytes())]).scene;
        let ply = made(&[("a.ply", format!("{ply}4 {a} {b} {c} {d}\n").as_bytes())]).scene;
        for scene in [obj, ply] {
            assert!((area(&scene) - expected).abs() < 1e-5, "{}", area(&scene));
        }
    }
    let bow = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv -1 0.5 0\nf 1 2 3 4 5\n";
    assert_warns(
        &made(&[("a.obj", bow.as_bytes())]),
        "1 × face whose outline crosses itself",
    );
}

/// The transmission of a made material, by its statements.
fn transmission(statements: &str) -> f32 {
    let mtl = format!("newmtl wall\nKd 0 1 0\nnewmtl m\nKd 1 0 0\n{statements}\n");
    let obj = format!("mtllib a.mtl\nusemtl m\n{CUBE}");
    let scene = made(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes())]).scene;
    materials(&scene)[0].unwrap().transmission
}

#[test]
fn d_counts_before_tr_and_every_tr_of_1_is_opaque() {
    for (name, triangles, repaired) in [
        ("03-meshlab-tr1/two_1.obj", 14, true),
        ("03-meshlab-tr1/two_0.obj", 14, false),
        ("03-meshlab-tr1/ifc.obj", 12, false),
    ] {
        let Some(path) = found(name) else { continue };
        let loaded = loaded(&path);
        let all = materials(&loaded.scene);
        assert_eq!(all.len(), triangles);
        assert!(all.iter().all(|m| m.unwrap().transmission == 0.0), "{name}");
        let warns =
            loaded.warning.as_deref() == Some("repaired: 1 × Tr 1 of a file without d, as opaque");
        assert_eq!(warns, repaired, "{:?}", loaded.warning);
    }
    for (statements, expected) in [
        ("Tr 1", 0.0),
        ("Tr 1\nd 1", 0.0),
        ("d 1\nTr 1", 0.0),
        ("tr 0.25", 0.25),
        ("d 0.25\nTr 0", 0.75),
        ("Tr 1\nillum 6\nnewmtl other\nTr 0.5", 1.0),
    ] {
        assert_eq!(transmission(statements), expected, "{statements}");
    }
}

#[test]
fn marks_encodings_and_line_ends_do_not_matter() {
    if let Some(path) = found("04-obj-bom/vertex_first_extra.obj") {
        assert_spans(&loaded(&path).scene, [0.0; 3], [1.0, 1.0, 0.0]);
        let scene = loaded(&path.with_file_name("mtllib.obj")).scene;
        assert_eq!(colors(&scene), [[0.8, 0.1, 0.1]; 12]);
    }
    for name in [
        "05-obj-cr/cr.obj",
        "07-obj-text/utf16le.obj",
        "07-obj-text/upper.obj",
        "07-obj-text/contin_blank.obj",
    ] {
        if let Some(path) = found(name) {
            assert_cube(&loaded(&path));
        }
    }
    let wide: Vec<u8> = CUBE.encode_utf16().flat_map(u16::to_be_bytes).collect();
    for bytes in [
        [b"\xfe\xff", &wide[..]].concat(),
        wide.clone(),
        CUBE.replace('\n', "\r\n").into_bytes(),
        CUBE.replace('\n', "\r\r\n").into_bytes(),
        CUBE.replace(" 1 0 ", " \\\t\n 1 0 ").into_bytes(),
        format!("# no line goes on \\\n{CUBE}\x1a").into_bytes(),
    ] {
        assert_cube(&made(&[("a.obj", &bytes)]));
    }
    // A library with a mark, old line ends and capitals.
    let mtl = b"\xef\xbb\xbfNEWMTL red\rKD 1 0 0\r";
    let obj = format!("MTLLIB a.mtl\nUSEMTL red\n{CUBE}");
    let scene = made(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl)]).scene;
    assert_eq!(colors(&scene), [[1.0, 0.0, 0.0]; 12]);
    // NFF, too.
    let nff = "\u{feff}# a comment\rs 0 0 0 1\r# another\rs 3 0 0 1\r";
    assert_eq!(made(&[("a.nff", nff.as_bytes())]).scene.spheres.len(), 2);
}

#[test]
fn names_are_told_apart_and_found() {
    if let Some(path) = found("07-obj-text/latin.obj") {
        let [red, green] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(colors(&loaded(&path).scene), [red, red, green, green]);
        let other_case = loaded(&path.with_file_name("mtl_case.obj"));
        assert_cube(&other_case);
        let case = "repaired: 1 × material library named in another case";
        if path.with_file_name("c.mtl").exists() {
            assert_warns(&other_case, case);
        }
    }
    // A name in Latin-1 beside one in UTF-8, the same.
    let obj = [b"mtllib sub\\A.MTL\nusemtl caf\xe9\n", CUBE.as_bytes()].concat();
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("Sub")).unwrap();
    std::fs::write(folder.path().join("Sub/a.mtl"), "newmtl café\nKd 0 0 1\n").unwrap();
    std::fs::write(folder.path().join("a.obj"), obj).unwrap();
    let loaded = loaded(&folder.path().join("a.obj"));
    assert_eq!(colors(&loaded.scene), [[0.0, 0.0, 1.0]; 12]);
    assert_warns(&loaded, "1 × material library named in another case");
}

#[test]
fn what_is_not_a_number_counts_only_where_it_is_used() {
    if let Some(path) = found("06-obj-nan/v_nan_unused.obj") {
        let loaded = loaded(&path);
        assert_spans(&loaded.scene, [0.0; 3], [0.0, 1.0, 1.0]);
        assert_warns(&loaded, "repaired: 1 × unused vertex that is not finite");
    }
    if let Some(path) = found("06-obj-nan/vn_nan.obj") {
        let loaded = loaded(&path);
        assert_warns(&loaded, "unusable normal");
        let normals = &loaded.scene.meshes.normals;
        assert!(
            normals.iter().flatten().all(|x| x.is_finite()),
            "{normals:?}"
        );
        assert!(normals.contains(&[-1.0, 0.0, 0.0]), "{normals:?}");
    }
    let text = format!("{CUBE}v 1.#QNAN 0 -nan(ind)\nv inf 0 0\nvn -1.#IND 0 0\n");
    let unused = made(&[("a.obj", text.as_bytes())]);
    assert_cube(&unused);
    assert_warns(&unused, "2 × unused vertex that is not finite");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, format!("{text}f 1 2 9\n")).unwrap();
    let error = load(&path, &LoadOptions::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("a.obj:15:3: '1.#QNAN' is not a finite number"),
        "{error}"
    );
}

/// A picture's centre, by default camera and lights.
fn centre(path: &Path) -> Rgb {
    let loaded = load_with_view(path, 1.0);
    let config = RenderConfig {
        width: 9,
        height: 9,
        ..RenderConfig::default()
    };
    let world = loaded.world(Structure::Bvh);
    let rendered = loaded.render(
        &world,
        kernels(Precision::Guarded),
        &loaded.scene.lights,
        &config,
    );
    rendered.picture.color[4 * 9 + 4]
}

#[test]
fn dissolve_blends_the_surface_with_what_is_behind() {
    let Some(path) = found("15-mtl-dissolve/m_0.25.obj") else {
        return;
    };
    let text = std::fs::read_to_string(&path).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let of = |d: &str| {
        std::fs::write(folder.path().join("m.obj"), text.replace("m_0.25", "m")).unwrap();
        let mtl =
            format!("newmtl wall\nKd 0 0.5 0\nnewmtl front\nKd 0.5 0 0\nNi 1.5\nillum 2\n{d}\n");
        std::fs::write(folder.path().join("m.mtl"), mtl).unwrap();
        centre(&folder.path().join("m.obj"))
    };
    let [red, green, _] = centre(&path);
    assert!((red - 0.0953).abs() < 5e-5 && green > 0.0, "{red} {green}");
    let whole = of("d 1")[0];
    assert!((whole - 0.381).abs() < 5e-4, "{whole}");
    for d in [0.25, 0.5, 0.75] {
        let red = of(&format!("d {d}"))[0];
        assert!((red - whole * d).abs() < 1e-6, "{d}: {red}");
    }
    // Nothing is there: only the wall is left.
    assert_eq!(of("d 0")[0], 0.0);
    let none = loaded(&folder.path().join("m.obj"));
    assert_eq!(triangles(&none.scene).len(), 2);
    assert_warns(&none, "1 × face of an invisible material (d 0)");
    // Glass keeps its reflection and bends light.
    let mtl = "newmtl m\nKd 0 0 0\nKs 1 1 1\nillum 7\nd 0.1\nNi 1.5\n";
    let obj = format!("mtllib a.mtl\nusemtl m\n{CUBE}");
    let glass = made(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes())]).scene;
    let glass = materials(&glass)[0].unwrap();
    assert_eq!((glass.transmission, glass.ior), (0.9, 1.5));
    assert!(matches!(glass.model, Model::Phong { mirror, .. } if mirror == [1.0; 3]));
}

#[test]
fn a_texture_that_is_left_out_leaves_the_default_colour() {
    let plain = Material::default().base_color;
    if let Some(path) = found("15-mtl-dissolve/zero.obj") {
        let loaded = loaded(&path);
        assert_eq!(colors(&loaded.scene), [plain; 2]);
        assert_warns(&loaded, "1 × texture");
    }
    for (mtl, expected) in [
        ("Kd 0 0 0\nmap_Kd a.png", plain),
        ("map_Kd a.png", plain),
        ("Kd 0 0 0.5\nmap_Kd a.png", [0.0, 0.0, 0.5]),
        ("Kd 0 0 0\nmap_Ks a.png", [0.0; 3]),
    ] {
        let mtl = format!("newmtl m\n{mtl}\n");
        let obj = format!("mtllib a.mtl\nusemtl m\n{CUBE}");
        let scene = made(&[("a.obj", obj.as_bytes()), ("a.mtl", mtl.as_bytes())]).scene;
        assert_eq!(colors(&scene)[0], expected, "{mtl}");
    }
}

const SQUARE_HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n";
const SQUARE_ROWS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

#[test]
fn ply_is_read_as_it_is_written() {
    for name in [
        "multiline",
        "blank_header",
        "cr",
        "tabs",
        "nan_n",
        "facecolor",
    ] {
        let Some(path) = found(&format!("08-ply/{name}.ply")) else {
            continue;
        };
        let loaded = loaded(&path);
        assert_eq!(triangles(&loaded.scene).len(), 2, "{name}");
        assert_spans(&loaded.scene, [0.0; 3], [1.0, 1.0, 0.0]);
        match name {
            "nan_n" => assert_warns(&loaded, "2 × unusable normal"),
            _ => assert_eq!(loaded.warning, None),
        }
        if name == "facecolor" {
            assert_eq!(colors(&loaded.scene), [[1.0, 0.0, 0.0]; 2]);
        }
    }
    if let Some(path) = found("08-ply/leading_dot.ply") {
        assert_spans(&loaded(&path).scene, [-0.1, -0.1, 0.0], [0.5, 0.5, 0.0]);
    }
    if let Some(path) = found("08-ply/tristrips.ply") {
        assert_eq!(triangles(&loaded(&path).scene).len(), 2);
    }
    let whole = format!("{SQUARE_HEADER}{SQUARE_ROWS}");
    for text in [
        whole.replace('\n', "\r\n"),
        format!("\u{feff}{whole}"),
        whole.replace(' ', "\t"),
        format!("{SQUARE_HEADER}{}", SQUARE_ROWS.replace('\n', " ")),
        whole.replace("1 1 0\n0", "1 1 0\n\n0"),
    ] {
        let loaded = made(&[("a.ply", text.as_bytes())]);
        assert_spans(&loaded.scene, [0.0; 3], [1.0, 1.0, 0.0]);
    }
    // Strips, after a restart wound as from the beginning.
    let strips = whole
        .replace("element face 1", "element tristrips 1")
        .replace("4 0 1 2 3", "8 0 1 3 2 -1 0 1 2");
    let scene = made(&[("a.ply", strips.as_bytes())]).scene;
    let up = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).z > 0.0;
    assert_eq!(triangles(&scene).len(), 3);
    assert!(triangles(&scene).iter().all(up));
    // A colour for each face, as floats.
    let colored = SQUARE_HEADER.replace("face 1", "face 2").replace(
        "vertex_indices\n",
        "vertex_indices\nproperty float red\nproperty float green\nproperty float blue\n",
    ) + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 0 1 0\n3 0 2 3 0 0 1\n";
    let scene = made(&[("a.ply", colored.as_bytes())]).scene;
    assert_eq!(colors(&scene), [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
}

/// Colours of vertices, which scanners and sculptors give, are seen; a material counts before them.
#[test]
fn colours_of_vertices_are_shown() {
    let obj = "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nv 0 0 1 0 1 0\nf 1 2 3\n";
    let loaded = made(&[("a.obj", obj.as_bytes())]);
    assert_eq!(loaded.warning, None);
    let most = u16::MAX;
    let expected = [[most, 0, 0, most], [most; 4], [0, 0, most, most]];
    assert_eq!(loaded.scene.meshes.attributes.colors, expected);
    assert!(
        loaded
            .scene
            .textures
            .iter()
            .all(|row| row.texturing.vertex_color)
    );
    let mtl: &[u8] = b"newmtl red\nKd 1 0 0\n";
    let with = format!("mtllib a.mtl\n{obj}usemtl red\nf 1 2 4\n");
    let loaded = made(&[("a.obj", with.as_bytes()), ("a.mtl", mtl)]);
    assert_warns(
        &loaded,
        "1 × vertex colour set of faces that have materials",
    );
    assert_eq!(colors(&loaded.scene), [[1.0; 3], [1.0, 0.0, 0.0]]);
}

#[test]
fn a_header_of_many_elements_takes_time_in_proportion() {
    let mut text = String::from("ply\nformat ascii 1.0\n");
    for i in 0..100_000 {
        text += &format!("element e{i} 0\n");
    }
    let rest = SQUARE_HEADER
        .strip_prefix("ply\nformat ascii 1.0\n")
        .unwrap();
    let start = std::time::Instant::now();
    let loaded = made(&[("a.ply", format!("{text}{rest}{SQUARE_ROWS}").as_bytes())]);
    assert_eq!(triangles(&loaded.scene).len(), 2);
    assert!(start.elapsed().as_secs() < 5, "{:?}", start.elapsed());
}

#[test]
fn stl_is_read_as_it_is_written() {
    for (name, triangles_of, says) in [
        ("nan_normal", 1, None),
        ("end_solid", 1, None),
        ("endfacet_color", 1, None),
        (
            "no_endsolid",
            1,
            Some("repaired: 1 × solid without 'endsolid'"),
        ),
        ("bom", 3, None),
        (
            "count0",
            2,
            Some("repaired: 1 × header with too few triangles"),
        ),
        (
            "count_less",
            2,
            Some("repaired: 1 × header with too few triangles"),
        ),
    ] {
        let Some(path) = found(&format!("09-stl/{name}.stl")) else {
            continue;
        };
        let loaded = loaded(&path);
        assert_eq!(triangles(&loaded.scene).len(), triangles_of, "{name}");
        assert_eq!(loaded.warning.as_deref(), says, "{name}");
    }
    let one = "facet normal 1.#QNAN -nan(ind) x\nouter loop of a\nvertex 0 0 0\n\
               vertex 1 0 0\nvertex 0 1 0\nendloop 1\nendfacet 1 2 3\n";
    for text in [
        format!("solid\n{one}end solid\nsolid facet\n{one}endsolid\n"),
        format!("solid a\n{one}{one}\x1a").replace('\n', "\r"),
        format!("\u{feff}  SOLID a\n{one}\n\n{}", one.to_uppercase()),
    ] {
        let scene = made(&[("a.stl", text.as_bytes())]).scene;
        assert_eq!(triangles(&scene).len(), 2, "{text}");
    }
    // Bytes after the last triangle that are no triangle are no error.
    let mut binary = vec![b' '; 80];
    binary.extend(1_u32.to_le_bytes());
    binary.extend([0; 12]);
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    binary.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
    binary.extend([0; 2 + 7]);
    let loaded = made(&[("a.stl", &binary)]);
    assert_eq!((triangles(&loaded.scene).len(), loaded.warning), (1, None));
}
