//! Made files in the dialects of PLY, STL and text that `found_meshes` knows from reports:
//! one or more of each kind, so that not one file is read but its kind.

use crate::found_meshes::{assert_spans, assert_warns, made, materials, triangles};
use lanecast::internals::io::{LoadOptions, load};

const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nelement face 1\n\
    property list uchar int vertex_indices\nend_header\n";
const ROWS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
    vertex 0 1 0\nendloop\nendfacet\n";

/// A text in UTF-16: with a mark and without, either byte first.
fn wide(text: &str) -> [Vec<u8>; 4] {
    let low = |unit: u16| unit.to_le_bytes();
    let high = |unit: u16| unit.to_be_bytes();
    let marked = format!("\u{feff}{text}");
    [
        text.encode_utf16().flat_map(low).collect(),
        text.encode_utf16().flat_map(high).collect(),
        marked.encode_utf16().flat_map(low).collect(),
        marked.encode_utf16().flat_map(high).collect(),
    ]
}

/// The message of a file that is refused.
fn refused(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let error = load(&path, &LoadOptions::default()).unwrap_err();
    error.to_string()
}

#[test]
fn every_text_format_is_read_as_utf_16() {
    let obj = "mtllib a.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for mtl in wide("newmtl red\nKd 1 0 0\n") {
        let scene = made(&[("a.obj", obj.as_bytes()), ("a.mtl", &mtl)]).scene;
        assert_eq!(materials(&scene)[0].unwrap().base_color, [1.0, 0.0, 0.0]);
    }
    for ply in wide(&format!("{HEADER}{ROWS}")) {
        assert_spans(&made(&[("a.ply", &ply)]).scene, [0.0; 3], [1.0, 1.0, 0.0]);
    }
    for stl in wide(&format!("solid a\n{FACET}endsolid a\n")) {
        let loaded = made(&[("a.stl", &stl)]);
        assert_eq!((triangles(&loaded.scene).len(), loaded.warning), (1, None));
    }
    for nff in wide("s 0 0 0 1\ns 3 0 0 1\n") {
        assert_eq!(made(&[("a.nff", &nff)]).scene.spheres.len(), 2);
    }
    // Native scenes are UTF-8 by their standards: one message says so.
    for (name, text) in [("a.toml", "format = 1\n"), ("a.json", "{\"format\": 1}")] {
        let [_, _, marked, _] = wide(text);
        let said = refused(name, &marked);
        assert!(said.contains("not UTF-8 text; save it as UTF-8"), "{said}");
    }
}

#[test]
fn ply_headers_and_numbers_have_dialects() {
    let blank = HEADER.replace("element", "\n \nelement");
    let loaded = made(&[("a.ply", format!("{blank}{ROWS}").as_bytes())]);
    assert_spans(&loaded.scene, [0.0; 3], [1.0, 1.0, 0.0]);
    let rows = "-.5 +.5 5.\n1. -0 5\n+1 1 .5e1\n0 .1E1 5\n4 0 1 2 3\n";
    let loaded = made(&[("a.ply", format!("{HEADER}{rows}").as_bytes())]);
    assert_spans(&loaded.scene, [-0.5, 0.0, 5.0], [1.0, 1.0, 5.0]);
    // Normals, and a vertex of no face, that are no numbers, as C libraries print them.
    let header = HEADER.replace("vertex 4", "vertex 5").replace(
        "property float z\n",
        "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n",
    );
    let rows = "0 0 0 nan nan nan\n1 0 0 0 0 1\n1 1 0 -nan(ind) 0 0\n0 1 0 1.#INF 0 0\n\
                nan 1.#QNAN inf 0 0 1\n4 0 1 2 3\n";
    let loaded = made(&[("a.ply", format!("{header}{rows}").as_bytes())]);
    assert_spans(&loaded.scene, [0.0; 3], [1.0, 1.0, 0.0]);
    assert_warns(&loaded, "3 × unusable normal");
    assert_warns(&loaded, "1 × unused vertex that is not finite");
    let normals = &loaded.scene.meshes.normals;
    assert!(normals.iter().all(|n| *n == [0.0, 0.0, 1.0]), "{normals:?}");
}

#[test]
fn strips_are_read_in_both_byte_orders() {
    let header = HEADER.replace("element face", "element tristrips");
    let floats = [
        0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0,
    ];
    let strip = [0, 1, 3, 2, -1, 0, 1, 2_i32];
    let (little, big) = ("binary_little_endian", "binary_big_endian");
    for (order, is_big) in [(little, false), (big, true)] {
        let bytes = |mut four: [u8; 4]| {
            if is_big {
                four.reverse();
            }
            four
        };
        let mut ply = header.replace("ascii", order).into_bytes();
        ply.extend(floats.iter().flat_map(|x| bytes(x.to_le_bytes())));
        ply.push(strip.len() as u8);
        ply.extend(strip.iter().flat_map(|x| bytes(x.to_le_bytes())));
        let loaded = made(&[("a.ply", &ply)]);
        let up = |[a, b, c]: [glam::DVec3; 3]| (b - a).cross(c - a).z > 0.0;
        let all = triangles(&loaded.scene);
        assert_eq!((all.len(), loaded.warning), (3, None), "{order}");
        assert!(all.into_iter().all(up), "{order}");
    }
}

/// A binary file of three triangles, whose header is this text and announces `count`.
fn binary_stl(header: &str, count: u32, tail: &[u8]) -> Vec<u8> {
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for z in [0.0_f32, 1.0, 2.0] {
        // A normal that is no number.
        bytes.extend([0xff; 12]);
        let corners = [0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z];
        bytes.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes.extend(tail);
    bytes
}

#[test]
fn binary_stl_has_as_many_triangles_as_its_length_holds() {
    let few = Some("repaired: 1 × header with too few triangles");
    for header in ["", "solid of a program", "SOLID facet normal"] {
        for (count, tail, expected, says) in [
            (3, &b""[..], 3, None),
            (0, b"", 3, few),
            (2, b"", 3, few),
            (0, b"abc", 3, few),
            (3, b"abc", 3, None),
            (2, b"abc", 2, None),
        ] {
            let loaded = made(&[("a.stl", &binary_stl(header, count, tail))]);
            let found = (triangles(&loaded.scene).len(), loaded.warning.as_deref());
            assert_eq!(found, (expected, says), "{header} {count}");
        }
        for count in [4, u32::MAX] {
            let says = format!("its header says {count} triangles, but there are bytes for 3");
            let said = refused("a.stl", &binary_stl(header, count, b""));
            assert!(said.contains(&says), "{said}");
        }
    }
    // Text stays text, with a name in Latin-1 and zeros after its end.
    let text = [b"solid caf\xe9\n", FACET.as_bytes(), b"endsolid\n\0\0\0"].concat();
    let loaded = made(&[("a.stl", &text)]);
    assert_eq!((triangles(&loaded.scene).len(), loaded.warning), (1, None));
}

#[test]
fn points_and_lines_are_named_as_left_out() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2\nl 1 2 3\n";
    let face = format!("{obj}f 1 2 3\n");
    let loaded = made(&[("a.obj", face.as_bytes())]);
    assert_eq!(triangles(&loaded.scene).len(), 1);
    assert_warns(&loaded, "not imported: 2 × point or line element");
    let said = refused("a.obj", obj.as_bytes());
    assert!(said.contains("the scene is empty"), "{said}");
    assert!(said.contains("2 × point or line element"), "{said}");
    let edges = "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header";
    let ply = HEADER.replace("end_header", edges) + ROWS + "0 1\n";
    let loaded = made(&[("a.ply", ply.as_bytes())]);
    assert_warns(&loaded, "not imported: 1 × element edge");
    let (vertices, _) = HEADER.split_once("element face").unwrap();
    let (rows, _) = ROWS.split_once("4 0").unwrap();
    let said = refused("a.ply", format!("{vertices}end_header\n{rows}").as_bytes());
    assert!(said.contains("4 × loose point"), "{said}");
}
