//! Tests of one square in all encodings, of malformed headers, and of huge counts.

use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty short z\n\
    property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\n\
    element other 1\nproperty list uchar int i\n\
    element face 2\nproperty uchar flags\nproperty list uchar ushort vertex_indices\nend_header\n";

fn square(format: &str) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {format} 1.0\ncomment c\n{HEADER}").into_bytes();
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    if format == "ascii" {
        for [x, y] in corners {
            bytes.extend(format!("{x} {y} -2 255 0 0 1\n").bytes());
        }
        bytes.extend(b"2 7 8\n9 4 0 1 2 3\n9 2 0 1\n");
        return bytes;
    }
    let big = format == "binary_big_endian";
    let mut put = |mut number: Vec<u8>| {
        if big {
            number.reverse();
        }
        bytes.extend(number);
    };
    let float = |x: f32, put: &mut dyn FnMut(Vec<u8>)| put(x.to_le_bytes().into());
    for [x, y] in corners {
        float(x as f32, &mut put);
        put(f64::from(y).to_le_bytes().into());
        put((-2_i16).to_le_bytes().into());
        put(vec![255]);
        for n in [0.0, 0.0, 1.0] {
            float(n, &mut put);
        }
    }
    put(vec![2]);
    put(7_i32.to_le_bytes().into());
    put(8_i32.to_le_bytes().into());
    for face in [&[0_u16, 1, 2, 3][..], &[0, 1]] {
        put(vec![9]);
        put(vec![face.len() as u8]);
        face.iter().for_each(|v| put(v.to_le_bytes().into()));
    }
    bytes
}

#[test]
fn one_square_in_three_encodings() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let mut report = ImportReport::default();
        let mesh = parse(&square(format), Wants::default(), &mut report)
            .unwrap()
            .mesh;
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{format}");
        assert_eq!(mesh.positions[2], [1.0, 1.0, -2.0]);
        assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 4]);
        let warning = report.summary().unwrap();
        assert!(warning.contains("1 × element other"), "{warning}");
        assert!(
            warning.contains("1 × face of fewer than 3 corners"),
            "{warning}"
        );
    }
}

#[test]
fn every_truncation_is_an_error_not_a_panic() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let whole = square(format);
        // An ASCII file is complete without its last line break.
        for end in 0..whole.len() - 1 {
            let mut report = ImportReport::default();
            let cut = parse(&whole[..end], Wants::default(), &mut report);
            let message = cut.err().map(|e| e.1).unwrap_or_default();
            assert!(
                !message.is_empty() && !message.contains('\n'),
                "{end}: {message}"
            );
        }
    }
}

#[test]
fn wrong_files_are_refused() {
    let head = |format: &str, rest: &str| format!("ply\nformat {format} 1.0\n{rest}");
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let list = "property list uchar int vertex_index\n";
    let one = format!("element vertex 1\n{xyz}element face 1\n{list}end_header\n0 0 0\n");
    for (text, says) in [
        (String::new(), "begins with the line 'ply'"),
        (
            "plx\n".into(),
            "begins with the line 'ply', and this with 'plx'",
        ),
        (
            "ply\nformat asci 1.0\n".into(),
            "'format asci 1.0' is no line of a PLY header",
        ),
        (
            head("ascii", "property float x\nend_header\n"),
            "'property float x' comes before any element",
        ),
        (
            head("ascii", &one.replace("0 0 0\n", "0 0 zz\n3 0 0 0\n")),
            "'0 0 zz' has a value that is not",
        ),
        (
            head("ascii", &one.replace("0 0 0\n", "0 0\n3 0 0 0\n")),
            "'0 0' has fewer values",
        ),
        (
            head("ascii", &one.replace("float x", "list uchar float x")),
            "the property 'x' has an unsupported type",
        ),
        (
            head("ascii", &format!("{one}3 0 0 .5\n")),
            "'3 0 0 .5' has a value",
        ),
        (
            head("ascii", &format!("{one}4 0 0 0\n")),
            "'4 0 0 0' has fewer values",
        ),
        ("ply\n".into(), "end_header"),
        (
            head(
                "binary_little_endian",
                "element face 999999999999\nend_header\n",
            ),
            "bytes follow",
        ),
        (
            head(
                "ascii",
                &format!("element vertex 4000000000\n{xyz}end_header\n0 0 0\n"),
            ),
            "bytes follow",
        ),
        (
            head(
                "ascii",
                &format!(
                    "element vertex 1\n{xyz}element vertex 1\n{xyz}end_header\n0 0 0\n0 0 0\n"
                ),
            ),
            "twice",
        ),
        (
            head(
                "ascii",
                "element vertex 1\nproperty float x\nend_header\n0 0 0\n",
            ),
            "no property 'y'",
        ),
        (
            head("ascii", "element face 1\nproperty int a\nend_header\n0\n"),
            "vertex_indices",
        ),
        (head("ascii", &format!("{one}3 0 0 1\n")), "uses vertex 1"),
        (head("ascii", &format!("{one}3 0 0 -1\n")), "negative"),
        (
            head("ascii", &format!("{one}4000000000 0 0 0\n")),
            "a value that is not",
        ),
        (
            head("ascii", &one.replace("0 0 0\n", "0 0 1e999\n3 0 0 0\n")),
            "finite",
        ),
        (
            head(
                "ascii",
                &one.replace("uchar int", "uchar float")
                    .replace("0 0 0\n", "0 0 0\n3 0 0 0\n"),
            ),
            "unsupported",
        ),
    ] {
        let message = parse(
            text.as_bytes(),
            Wants::default(),
            &mut ImportReport::default(),
        )
        .unwrap_err()
        .1;
        assert!(message.contains(says), "{text}: {message}");
        // The message has none of the parser's own terms.
        for own in ["String:", "Error", "{ ", "Couldn't", "Scalar"] {
            assert!(!message.contains(own), "{text}: {message}");
        }
    }
}

#[test]
fn colours_and_coordinates_of_vertices_are_kept() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
                property uchar alpha\nproperty float s\nproperty float t\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0 255 0 188 255 0 0\n1 0 0 0 255 0 51 1 0.25\n9 9 9 1 1 1 1 1 1\n\
                0 1 0 0 0 0 255 0.5 1\n3 0 1 3\n";
    let wants = Wants {
        uvs: true,
        ..Wants::default()
    };
    let mut report = ImportReport::default();
    let file = parse(text.as_bytes(), wants, &mut report).unwrap();
    assert_eq!(report.summary(), None);
    // 188 is 0.5029 of linear light; alpha is linear.
    let most = u16::MAX;
    let blue = (linear_from_srgb(188.0 / 255.0) * 65_535.0).round() as u16;
    let expected = [
        [most, 0, blue, most],
        [0, most, 0, most / 5],
        [0, 0, 0, most],
    ];
    assert_eq!(file.mesh.colors, expected);
    assert_eq!(file.mesh.uvs, [[[0.0, 1.0], [1.0, 0.75], [0.5, 0.0]]]);
    assert_eq!(file.parts, [(0, Some(0))]);
    assert_eq!(file.materials[0].1.base_color, [1.0; 3]);
    assert!(file.textures[0].1.vertex_color);
    // Coordinates that nothing needs take no memory.
    let plain = parse(text.as_bytes(), Wants::default(), &mut report).unwrap();
    assert!(plain.mesh.uvs.is_empty());
}
