//! Tests of small files: faces, indices, normals, materials, and malformed lines.

use super::*;
use crate::scene::Model;

fn load(files: &[(&str, &str)]) -> (Result<MeshFile, LoadError>, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let mut report = ImportReport::default();
    let path = folder.path().join(files[0].0);
    let obj = read(
        &path,
        &LoadOptions::default(),
        &mut ImageStore::default(),
        &mut report,
    );
    (obj, report.summary())
}

fn obj(text: &str) -> MeshFile {
    load(&[("a.obj", text)]).0.unwrap()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_fan_in_order_and_indices_count_both_ways() {
    for face in [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1/9/9 2/8 3// 4//7 # end",
        "f 1 2 \\\n 3 4",
    ] {
        let mesh = obj(&format!("{SQUARE}{face}\r\n")).mesh;
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{face}");
        assert!(mesh.normals.is_empty());
    }
    // The face comes before its vertices, and no face uses the first vertex.
    let mesh = obj(&format!("f 2 3 4\n{SQUARE}")).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.positions[0], [1.0, 0.0, 0.0]);
}

#[test]
fn coordinates_are_f64_and_weights_and_colours_are_not_read() {
    let mesh = obj("v 0.1 2e9 .5 7\nv 1 0 0 .1 .2 nan\nv 0 1 0\nf 1 2 3\n").mesh;
    assert_eq!(mesh.positions[0], [0.1, 2e9, 0.5]);
}

#[test]
fn normals_split_vertices_or_go() {
    let normals = "vn 0 0 2\nvn 1 0 0\nvn 0 0 0\n";
    let mesh = obj(&format!(
        "{SQUARE}{normals}f 1//1 2//1 3//1\nf 1//2 3//1 4//3\n"
    ))
    .mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 2, 4]]);
    assert_eq!(mesh.normals[3], [1.0, 0.0, 0.0]);
    assert_eq!(mesh.normals[4], [0.0, 0.0, 1.0], "repaired");
    let (partly, warning) = load(&[("a.obj", &format!("{SQUARE}{normals}f 1//1 2//1 3\n"))]);
    assert!(partly.unwrap().mesh.normals.is_empty());
    assert!(warning.unwrap().contains("only some corners"));
}

#[test]
fn normals_that_are_not_there_are_told() {
    let (mesh, warning) = load(&[("a.obj", &format!("{SQUARE}f 1//5 2//5 3//5\n"))]);
    assert!(mesh.unwrap().mesh.normals.is_empty());
    let expected = "3 × corner with a normal that the file does not have";
    assert!(warning.unwrap().contains(expected));
    for (face, says) in [
        ("f 1/a/b 2 3", "'b' is not a normal number"),
        ("f 1//-1 2 3", "there is no normal -1"),
        ("f 1//0 2 3", "count from 1, not 0"),
    ] {
        let (wrong, _) = load(&[("a.obj", &format!("{SQUARE}{face}\n"))]);
        let error = wrong.expect_err("a wrong line").to_string();
        assert!(error.contains(says) && error.contains("a.obj:5"), "{error}");
    }
}

#[test]
fn polylines_are_not_triangles() {
    let (lines, warning) = load(&[("a.obj", &format!("{SQUARE}l 1 2 3\np 1\nf 1 2\n"))]);
    assert!(lines.unwrap().mesh.triangles.is_empty());
    let warning = warning.unwrap();
    assert!(warning.contains("2 × point or line element"), "{warning}");
    assert!(
        warning.contains("1 × face of fewer than 3 corners"),
        "{warning}"
    );
}

#[test]
fn materials_become_parts() {
    let mtl = "newmtl red\nKd 1 0 0\nKs .5\nNs 20\nillum 3\nd 0.25\nNi 1.3\nmap_Kd x.png\n\
               newmtl metal # b\nKd .5 .5 .5\nPr .25\nPm 1\n";
    let text = format!(
        "mtllib a b.mtl\n{SQUARE}f 1 2 3\nusemtl red\nf 1 2 3 4\nusemtl none\nf 1 2 3\n\
         usemtl metal # b\nf 1 2 3\n"
    );
    let (read, warning) = load(&[("a.obj", &text), ("a b.mtl", mtl)]);
    let read = read.unwrap();
    assert_eq!(read.parts, [(1, Some(0)), (3, None), (4, Some(1))]);
    let (name, red) = &read.materials[0];
    assert_eq!(name, "red");
    assert_eq!((red.transmission, red.ior), (0.75, 1.0));
    let model = Model::Phong {
        diffuse: [0.25, 0.0, 0.0],
        specular: [0.125; 3],
        exponent: 20.0,
        mirror: [0.125; 3],
    };
    assert_eq!(red.model, model);
    let model = Model::MetallicRoughness {
        metallic: 1.0,
        roughness: 0.25,
    };
    assert_eq!(read.materials[1].1.model, model);
    let warning = warning.unwrap();
    assert!(
        warning.contains("1 × texture (") && warning.contains("1 × unknown material"),
        "{warning}"
    );
}

#[test]
fn wrong_lines_are_named() {
    for (text, place) in [
        ("v 1 2\n", ":1:1:"),
        ("\nv 1 2 x\n", ":2:7:"),
        ("v 1 2 inf\nf 1 1 1\n", ":1:7:"),
        ("v 1 2 1e999\nf 1 1 1\n", ":1:7:"),
        ("vt\n", ":1:1:"),
        ("vt 0 x\n", ":1:6:"),
        ("vn 0 1\n", ":1:1:"),
        ("vn 0 1 z\n", ":1:8:"),
        ("v 0 0 0\nf 1 0 1\n", ":2:5:"),
        ("v 0 0 0\nf 1 1 a\n", ":2:7:"),
        ("v 0 0 0\nf 1 1 -2\n", ":2:7:"),
        ("v 0 0 0\nf 1 1 9223372036854775807\n", ":2:7:"),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", ":2:7:"),
        ("v 0 0 0\nf 1 1 2\n", ":2:1:"),
        ("v 0 0 0\nf 1 1 4294967296\n", ":2:1:"),
    ] {
        let (wrong, _) = load(&[("a.obj", text)]);
        let message = wrong.err().unwrap().to_string();
        assert!(message.contains(place), "{text:?}: {message}");
    }
    // Texture coordinates have one to three numbers of any value; what follows is not read.
    for texture in ["vt 0", "vt 0.5 nan", "vt 0 1e999 .5 x # y"] {
        obj(&format!("{SQUARE}{texture}\nf 1 2 3\n"));
    }
    for mtl in [
        "newmtl a\nKd 1 2\n",
        "newmtl a\nKd\n",
        "newmtl a\nNs x\n",
        "newmtl a\nd\n",
    ] {
        let (wrong, _) = load(&[("a.obj", "mtllib a.mtl\n"), ("a.mtl", mtl)]);
        let message = wrong.err().unwrap().to_string();
        assert!(message.contains("a.mtl:2:"), "{message}");
    }
}

#[test]
fn a_library_outside_the_folder_is_refused() {
    let (wrong, _) = load(&[("a.obj", "mtllib ../b.mtl\n")]);
    assert!(matches!(wrong, Err(LoadError::Outside { .. })));
}

#[test]
fn normals_that_are_no_numbers_become_those_of_their_faces() {
    let normals = "vn nan 0 0\nvn 1.#INF 0 0\nvn 0 1 0\nvn -nan(ind) 0 0\n";
    let faces = "f 1//1 2//2 3//1\nf 1//3 3//3 4//3\n";
    let (file, warning) = load(&[("a.obj", &format!("\u{feff}{SQUARE}{normals}{faces}"))]);
    let found = file.unwrap().mesh.normals;
    let (up, kept) = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    assert_eq!(found, [up, up, up, kept, kept, kept]);
    assert_eq!(warning.unwrap(), "not imported: 3 × unusable normal");
}

#[test]
fn statements_of_materials_that_are_not_finite_count_as_missing() {
    let obj = format!("mtllib a.mtl\nusemtl m\n{SQUARE}f 1 2 3 4\n");
    let one = |mtl: &str| {
        let (file, warning) = load(&[("a.obj", &obj), ("a.mtl", &format!("newmtl m\n{mtl}"))]);
        file.map(|file| (file.materials[0].1, warning))
    };
    let expected = one("").unwrap().0;
    for (mtl, count) in [
        ("Kd nan 0 0\nKs -1.#IND 0 0\nKe inf\n", 3),
        ("Ns 1.#INF\nNi -nan(ind)\nd nan\nTr NaN\nillum 1e99\n", 5),
        ("Pr nan\nPm nan\n", 2),
    ] {
        let (found, warning) = one(mtl).unwrap();
        assert_eq!(found, expected, "{mtl}");
        let says = format!("repaired: {count} × material statement that is not finite, as missing");
        assert_eq!(warning.unwrap(), says);
    }
    let (found, _) = one("Kd 1 0 0\nKd nan 0 0\n").unwrap();
    assert_eq!(found.base_color, [1.0, 0.0, 0.0]);
    for mtl in ["d nano\n", "d\n", "Kd 1 x 0\n", "Kd nan 0\n"] {
        assert!(one(mtl).is_err(), "{mtl}");
    }
}
