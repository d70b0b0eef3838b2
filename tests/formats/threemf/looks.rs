//! Materials, colours and textures of 3MF.

use super::{RELATIONSHIPS, cuboid, model, package, packed, read, refused};
use lanecast::internals::scene::{Alpha, MaterialId, MeshId, Scene, Slot, check_closed};

/// The material of each triangle of the only mesh.
fn materials(scene: &Scene) -> Vec<Option<MaterialId>> {
    let meshes = &scene.meshes;
    let count = meshes.triangles.len();
    let of = |triangle: usize| {
        let before = meshes.parts.iter().rev();
        let mut before = before.filter(|(first, _)| *first as usize <= triangle);
        before.next().and_then(|(_, material)| *material)
    };
    (0..count).map(of).collect()
}

/// Linear light of an 8-bit code by IEC 61966-2-1.
fn linear(code: u8) -> f32 {
    let x = f64::from(code) / 255.0;
    let linear = if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

const BASES: &str = "<basematerials id=\"5\"><base name=\"steel\" displaycolor=\"#80C0FF\"/>\
    <base name=\"glass\" displaycolor=\"#10203040\"/></basematerials>";

fn triangle(corners: &str, rest: &str) -> String {
    let v: Vec<&str> = corners.split(' ').collect();
    format!(
        "<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\" {rest}/>",
        v[0], v[1], v[2]
    )
}

/// A tetrahedron whose triangles have these attributes.
fn tetrahedron(each: [&str; 4]) -> String {
    let corners = ["0 2 1", "0 1 3", "1 2 3", "0 3 2"];
    let triangles: String = corners
        .iter()
        .zip(each)
        .map(|(c, a)| triangle(c, a))
        .collect();
    format!(
        "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>\
         <vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/></vertices>\
         <triangles>{triangles}</triangles></mesh>"
    )
}

#[test]
fn base_materials_are_of_objects_and_of_triangles() {
    let mesh = tetrahedron(["", "pid=\"5\" p1=\"1\"", "p1=\"1\"", ""]);
    let resources = format!("{BASES}<object id=\"1\" pid=\"5\" pindex=\"0\">{mesh}</object>");
    let scene = read(&packed(&model("", &resources, "<item objectid=\"1\"/>"))).unwrap();
    assert_eq!(scene.warning, None);
    let scene = scene.scene;
    let [a, b, c, d] = materials(&scene)[..] else {
        panic!()
    };
    assert_eq!((a, b), (d, c));
    let (steel, glass) = (a.unwrap(), b.unwrap());
    let names = &scene.materials.names;
    assert_eq!(names.get(steel.0), Some("steel"));
    assert_eq!(names.get(glass.0), Some("glass"));
    let steel = &scene.materials.rows[steel.index()];
    for (found, code) in steel.base_color.iter().zip([0x80, 0xc0, 0xff]) {
        assert!((found - linear(code)).abs() < 1e-6, "{found}");
    }
    assert_eq!(steel.layers.opacity, 1.0);
    let glass = &scene.materials.rows[glass.index()];
    assert_eq!(glass.layers.opacity, 64.0 / 255.0);
}

#[test]
fn colours_that_differ_at_corners_are_those_of_vertices() {
    let colors = "<m:colorgroup id=\"7\"><m:color color=\"#FF0000\"/><m:color color=\"#00FF0080\"/>\
                  <m:color color=\"#FF0000FF\"/></m:colorgroup>";
    let each = [
        "pid=\"7\" p1=\"0\"",
        "pid=\"7\" p1=\"0\" p2=\"1\" p3=\"0\"",
        "pid=\"7\" p1=\"0\" p2=\"2\" p3=\"0\"",
        "",
    ];
    let resources = format!("{colors}<object id=\"1\">{}</object>", tetrahedron(each));
    let loaded = read(&packed(&model("", &resources, "<item objectid=\"1\"/>"))).unwrap();
    let scene = loaded.scene;
    let [a, b, c, d] = materials(&scene)[..] else {
        panic!()
    };
    assert_eq!((a, d), (c, None));
    let red = &scene.materials.rows[a.unwrap().index()];
    assert_eq!(red.base_color, [1.0, 0.0, 0.0]);
    let varied = scene.textures.of(b.unwrap()).unwrap();
    assert!(varied.texturing.vertex_color && varied.texturing.alpha == Alpha::Blend);
    let row = &scene.meshes.attributes.rows[0];
    let first = row.colors.unwrap();
    let colors = &scene.meshes.attributes.colors[first..first + row.vertices];
    let corners = scene.meshes.triangles[1].map(|v| colors[v as usize]);
    let full = u16::MAX;
    let half = (f64::from(full) * 128.0 / 255.0).round() as u16;
    let red = [full, 0, 0, full];
    assert_eq!(corners, [red, [0, full, 0, half], red]);
    // Positions are where they were.
    let at = scene.meshes.triangles[1].map(|v| scene.meshes.positions[v as usize]);
    assert_eq!(at, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    let closed = check_closed(&scene, MeshId(0));
    assert!(closed.is_ok(), "closed as before");
}

#[test]
fn mixtures_and_several_properties_have_a_colour() {
    let resources = format!(
        "{BASES}<m:compositematerials id=\"6\" matid=\"5\" matindices=\"0 1\">\
         <m:composite values=\"0.25 0.75\"/></m:compositematerials>\
         <m:colorgroup id=\"7\"><m:color color=\"#0000FF\"/></m:colorgroup>\
         <m:multiproperties id=\"8\" pids=\"6 7\"><m:multi pindices=\"0 0\"/></m:multiproperties>\
         <object id=\"1\">{}</object>",
        tetrahedron([
            "pid=\"6\" p1=\"0\"",
            "pid=\"8\" p1=\"0\"",
            "pid=\"6\" p1=\"9\"",
            "pid=\"9\" p1=\"0\""
        ])
    );
    let loaded = read(&packed(&model("", &resources, "<item objectid=\"1\"/>"))).unwrap();
    let said = "not imported: 2 × triangle's property that the file does not have; \
                shown as: 1 × multiproperties, by one of their layers";
    assert_eq!(loaded.warning.as_deref(), Some(said));
    let scene = loaded.scene;
    let [a, b, c, d] = materials(&scene)[..] else {
        panic!()
    };
    assert_eq!([c, d], [None; 2]);
    let mixed = scene.materials.rows[a.unwrap().index()].base_color;
    for (k, [first, second]) in [[0x80, 0x10], [0xc0, 0x20], [0xff, 0x30]]
        .iter()
        .enumerate()
    {
        let mean = 0.25 * linear(*first) + 0.75 * linear(*second);
        assert!((mixed[k] - mean).abs() < 1e-6);
    }
    let blue = scene.materials.rows[b.unwrap().index()].base_color;
    assert_eq!(blue, [0.0, 0.0, 1.0]);
}

#[test]
fn textures_are_read_from_the_package() {
    let image =
        image::RgbImage::from_fn(2, 2, |x, y| image::Rgb([255 * x as u8, 255 * y as u8, 9]));
    let mut png = Vec::new();
    let format = image::ImageFormat::Png;
    image
        .write_to(&mut std::io::Cursor::new(&mut png), format)
        .unwrap();
    let resources = format!(
        "<m:texture2d id=\"3\" path=\"/3D/Textures/a.png\" contenttype=\"image/png\" \
         tilestyleu=\"mirror\" tilestylev=\"clamp\" filter=\"nearest\"/>\
         <m:texture2dgroup id=\"4\" texid=\"3\"><m:tex2coord u=\"0\" v=\"0.25\"/>\
         <m:tex2coord u=\"1\" v=\"0\"/><m:tex2coord u=\"0\" v=\"1\"/></m:texture2dgroup>\
         <object id=\"1\">{}</object>",
        tetrahedron(["pid=\"4\" p1=\"0\" p2=\"1\" p3=\"2\"", "", "", ""])
    );
    let text = model("", &resources, "<item objectid=\"1\"/>");
    let mut parts = vec![
        ("_rels/.rels", RELATIONSHIPS.as_bytes()),
        ("3D/3dmodel.model", text.as_bytes()),
        ("3D/Textures/a.png", &png),
    ];
    let loaded = read(&package(&parts)).unwrap();
    assert_eq!(loaded.warning, None);
    let scene = loaded.scene;
    let material = materials(&scene)[0].unwrap();
    let textured = scene.textures.of(material).unwrap();
    assert!(textured.has(Slot::BaseColor) && textured.refs[0].1.nearest);
    let row = &scene.meshes.attributes.rows[0];
    let uvs = &scene.meshes.attributes.uvs[row.uvs..row.uvs + row.vertices];
    let corners = scene.meshes.triangles[0].map(|v| uvs[v as usize]);
    // v counts upwards in the file, and from the top here.
    assert_eq!(corners, [[0.0, 0.75], [1.0, 1.0], [0.0, 0.0]]);
    parts.pop();
    let loaded = read(&package(&parts)).unwrap();
    let said = "not imported: 1 × texture (/3D/Textures/a.png: the package has no such part)";
    assert_eq!(loaded.warning.as_deref(), Some(said));
}

#[test]
fn malformed_properties_are_refused() {
    let mesh = cuboid([1.0; 3], "");
    for (resources, says) in [
        (
            "<m:colorgroup id=\"7\"><m:color color=\"red\"/></m:colorgroup>",
            "the colour 'red' is not",
        ),
        (
            "<m:colorgroup id=\"7\"><m:color color=\"#12345\"/></m:colorgroup>",
            "'#12345' is not",
        ),
        (
            "<m:colorgroup><m:color color=\"#123456\"/></m:colorgroup>",
            "a colorgroup has no id",
        ),
        (
            "<basematerials id=\"1\"><base name=\"x\"/></basematerials>",
            "has no displaycolor",
        ),
        (
            "<m:compositematerials id=\"6\" matid=\"5\" matindices=\"0\"/>",
            "there are no base materials 5 before it",
        ),
        (
            "<m:texture2dgroup id=\"6\" texid=\"5\"><m:tex2coord u=\"nan\" v=\"0\"/></m:texture2dgroup>",
            "'nan' is not a finite number",
        ),
    ] {
        let all = format!("{resources}<object id=\"1\">{mesh}</object>");
        let said = refused(&packed(&model("", &all, "<item objectid=\"1\"/>")));
        assert!(said.contains(says), "{said}");
        assert!(said.contains("3D/3dmodel.model, line 4: "), "{said}");
    }
}
