//! 3MF: what its objects, components, items, units and materials become, and what is refused.
//! The archives are written here.

mod limits;
mod looks;

use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::scene::{Instances, Shape};
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const MATERIAL: &str = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02";
const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";

/// The parts of an archive, and whether they are compressed.
pub fn package(parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in parts {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

pub const RELATIONSHIPS: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
    <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\n\
    <Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" \
    Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";

/// A model with attributes of its own, resources and items.
pub fn model(attributes: &str, resources: &str, items: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model xmlns=\"{CORE}\" \
         xmlns:m=\"{MATERIAL}\" xmlns:p=\"{PRODUCTION}\" {attributes}>\n\
         <metadata name=\"Title\">t</metadata>\n<resources>{resources}</resources>\n\
         <build>{items}</build>\n</model>"
    )
}

/// An archive of a model.
pub fn packed(model: &str) -> Vec<u8> {
    package(&[
        ("_rels/.rels", RELATIONSHIPS.as_bytes()),
        ("3D/3dmodel.model", model.as_bytes()),
    ])
}

/// Vertices and triangles of a box from 0 to x, y, z; `each` are attributes of each triangle.
pub fn cuboid([x, y, z]: [f64; 3], each: &str) -> String {
    let mut text = "<mesh><vertices>".to_string();
    for i in 0..8 {
        let at = |bit: i32, size: f64| if i >> bit & 1 == 1 { size } else { 0.0 };
        text += &format!(
            "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>",
            at(0, x),
            at(1, y),
            at(2, z)
        );
    }
    text += "</vertices><triangles>";
    for [a, b, c] in CUBOID {
        text += &format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\" {each}/>");
    }
    text + "</triangles></mesh>"
}

const CUBOID: [[u32; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

pub fn read(bytes: &[u8]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.3mf");
    std::fs::write(&path, bytes).unwrap();
    load(&path, &LoadOptions::default())
}

/// What is said of a file that is refused.
pub fn refused(bytes: &[u8]) -> String {
    let said = read(bytes).unwrap_err().to_string();
    assert!(!said.contains('\n') && said.len() < 600, "{said}");
    said
}

/// The least and the greatest corner of each instance, in the scene.
pub fn boxes(loaded: &Loaded) -> Vec<[[f64; 3]; 2]> {
    let scene = &loaded.scene;
    let all = Instances::of(scene).unwrap();
    let of = |row: lanecast::internals::scene::Instance| {
        let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
            panic!("no mesh")
        };
        let mesh = scene.meshes.row(id);
        let mut found = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for p in mesh.positions {
            let p = std::array::from_fn(|k| f64::from(p[k]) + mesh.center[k]);
            let p = row.world_from_object.point(p);
            for k in 0..3 {
                found[0][k] = found[0][k].min(p[k]);
                found[1][k] = found[1][k].max(p[k]);
            }
        }
        found
    };
    all.iter(scene).map(of).collect()
}

#[test]
fn z_is_up_and_a_unit_is_a_millimetre() {
    for (unit, size) in [
        ("", 1.0),
        ("unit=\"micron\"", 0.001),
        ("unit=\"millimeter\"", 1.0),
        ("unit=\"centimeter\"", 10.0),
        ("unit=\"inch\"", 25.4),
        ("unit=\"foot\"", 304.8),
        ("unit=\"meter\"", 1000.0),
    ] {
        let object = format!("<object id=\"1\">{}</object>", cuboid([1.0, 2.0, 3.0], ""));
        let file = packed(&model(unit, &object, "<item objectid=\"1\"/>"));
        let loaded = read(&file).unwrap();
        assert_eq!(loaded.warning, None);
        let [low, high] = boxes(&loaded)[..] else {
            let all = boxes(&loaded);
            assert_eq!(all.len(), 1);
            assert_eq!(all[0][0], [0.0, 0.0, -2.0 * size], "{unit}");
            assert_eq!(all[0][1], [size, 3.0 * size, 0.0], "{unit}");
            continue;
        };
        panic!("{low:?} {high:?}");
    }
}

#[test]
fn components_are_nodes_and_items_are_instances() {
    let resources = format!(
        "<object id=\"1\" name=\"brick\">{}</object>\
         <object id=\"2\" name=\"pair\"><components><component objectid=\"1\"/>\
         <component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/></components></object>\
         <object id=\"3\" name=\"unused\">{}</object>",
        cuboid([1.0, 2.0, 3.0], ""),
        cuboid([1.0; 3], "")
    );
    let items = "<item objectid=\"2\"/><item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 0 0 5\"/>\
                 <item objectid=\"1\" transform=\"2 0 0 0 2 0 0 0 2 0 100 0\"/>";
    let loaded = read(&packed(&model("", &resources, items))).unwrap();
    let said = loaded.warning.as_deref();
    assert_eq!(said, Some("not imported: 1 × object that is not built"));
    assert_eq!(loaded.scene.meshes.triangles.len(), 12);
    assert_eq!(loaded.scene.shapes.len(), 1);
    // Points are rows that are multiplied by the matrix: (x, y) goes to (10 − y, x).
    let turned = |z: f64| [[8.0, z, -1.0], [10.0, z + 3.0, 0.0]];
    let plain = |z: f64| [[0.0, z, -2.0], [1.0, z + 3.0, 0.0]];
    let expected = [
        plain(0.0),
        turned(0.0),
        plain(5.0),
        turned(5.0),
        [[0.0, 0.0, -104.0], [2.0, 6.0, -100.0]],
    ];
    assert_eq!(boxes(&loaded), expected);
    let names = &loaded.scene.shapes.names;
    let first = lanecast::internals::scene::ShapeId(0);
    assert_eq!(names.get(first.0), Some("brick"));
}

#[test]
fn objects_of_other_parts_are_read() {
    let root = model(
        "requiredextensions=\"p\"",
        "<object id=\"1\"><components><component p:path=\"/3D/Objects/a%20b.model\" \
         objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 7 0 0\"/></components></object>",
        "<item objectid=\"1\"/><item objectid=\"1\" p:path=\"/3d/objects/A%20B.model\"/>",
    );
    let object = format!("<object id=\"1\">{}</object>", cuboid([1.0; 3], ""));
    let part = model("unit=\"inch\"", &object, "<item objectid=\"1\"/>");
    let file = package(&[
        ("_rels/.rels", RELATIONSHIPS.as_bytes()),
        ("3D/3dmodel.model", root.as_bytes()),
        ("3D/Objects/a%20b.model", part.as_bytes()),
    ]);
    let loaded = read(&file).unwrap();
    assert_eq!(loaded.warning, None);
    assert_eq!(loaded.scene.meshes.triangles.len(), 12);
    let expected = [
        [[7.0, 0.0, -25.4], [32.4, 25.4, 0.0]],
        [[0.0, 0.0, -25.4], [25.4, 25.4, 0.0]],
    ];
    assert_eq!(boxes(&loaded), expected);
    let without = package(&[
        ("_rels/.rels", RELATIONSHIPS.as_bytes()),
        ("3D/3dmodel.model", root.as_bytes()),
    ]);
    let said = refused(&without);
    assert!(
        said.contains("a%20b.model: the package has no such part"),
        "{said}"
    );
}

#[test]
fn supports_and_regions_are_left_out_and_surfaces_are_open() {
    let mesh = cuboid([1.0; 3], "");
    let kinds = ["model", "surface", "support", "solidsupport", "other"];
    let mut resources = String::new();
    let mut items = String::new();
    for (i, kind) in kinds.iter().enumerate() {
        let id = i + 1;
        resources += &format!("<object id=\"{id}\" type=\"{kind}\">{mesh}</object>");
        items += &format!("<item objectid=\"{id}\"/>");
    }
    let loaded = read(&packed(&model("", &resources, &items))).unwrap();
    let said = "not imported: 1 × object of type 'other', 2 × support";
    assert_eq!(loaded.warning.as_deref(), Some(said));
    assert_eq!(loaded.scene.meshes.open, [false, true]);
}

/// A package without relationships has its only model.
#[test]
fn the_model_is_found_without_relationships() {
    let object = format!("<object id=\"1\">{}</object>", cuboid([1.0; 3], ""));
    let text = model("", &object, "<item objectid=\"1\"/>");
    read(&package(&[("3D/other.model", text.as_bytes())])).unwrap();
    let two = [("a.model", text.as_bytes()), ("b.model", text.as_bytes())];
    assert!(refused(&package(&two)).contains("name no 3D model"));
}

#[test]
fn required_extensions_are_known_or_refused_by_name() {
    let object = format!("<object id=\"1\">{}</object>", cuboid([1.0; 3], ""));
    let with = |declared: &str, required: &str| {
        let attributes = format!("{declared} requiredextensions=\"{required}\"");
        packed(&model(&attributes, &object, "<item objectid=\"1\"/>"))
    };
    read(&with("", "m p")).unwrap();
    let lattice = "xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\"";
    let said = refused(&with(lattice, "b"));
    let expected = "the required extension \
        'http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02' (beam lattice) is not \
        supported; export the part as plain triangles, as 3MF without it or as STL";
    assert!(said.ends_with(expected), "{said}");
    let own = "xmlns:v=\"http://example.org/v\"";
    assert!(refused(&with(own, "v")).contains("'http://example.org/v'"));
    assert!(refused(&with("", "q")).contains("'q', whose namespace it does not declare"));
    // What is there and not required is left out.
    let resources = format!(
        "<object id=\"1\"><mesh><vertices/><triangles/><b:beamlattice/></mesh></object>\
         <object id=\"2\">{}</object>",
        cuboid([1.0; 3], "")
    );
    let loaded = read(&packed(&model(
        lattice,
        &resources,
        "<item objectid=\"2\"/>",
    )))
    .unwrap();
    let said = "not imported: 1 × beam lattice";
    assert_eq!(loaded.warning.as_deref(), Some(said));
}
