//! Importer of STL, ASCII and binary, by the crate stl_io.
//!
//! Vertices with equal bits are joined; triangles keep their order. Facet normals are not
//! read, because the corners define them more precisely. The crate takes a binary file
//! whose header begins with "solid " for ASCII, requires a name after "solid", and stops
//! after the first solid of an ASCII file, so the bytes are normalised before it reads them.

use crate::LoadError;
use crate::scene::MeshData;
use crate::shared::messages::one_line;
use std::io::Cursor;
use std::path::Path;

/// Reads an STL file as one mesh, all its solids together. Fails for malformed files and
/// corners that are not finite.
pub(super) fn read(path: &Path) -> Result<MeshData, LoadError> {
    let bytes = crate::shared::folder::read_file(path)?;
    parse(bytes).map_err(|wrong| LoadError::in_mesh_file(path, "STL", wrong))
}

/// The line of an error, if it is known, and the message.
type Wrong = (Option<usize>, String);

/// Bytes of the binary header with its count, and of a binary triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Parses a file in memory. A file whose length is the one that its binary header announces
/// is binary; another one that begins with "solid" is ASCII.
fn parse(mut bytes: Vec<u8>) -> Result<MeshData, Wrong> {
    let declared = bytes.get(80..HEADER);
    let declared = declared.map(|n| u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize);
    let exact = declared.is_some_and(|n| bytes.len() as u64 == binary_length(n));
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace());
    let word = start.and_then(|s| bytes.get(s..s + 5));
    let ascii = !exact && word.is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    if ascii {
        let text = String::from_utf8_lossy(&bytes);
        check_lines(&text)?;
        bytes = one_solid(&text);
    } else {
        let refuse = |why: String| Err((None, why));
        let Some(count) = declared else {
            return refuse(format!(
                "{} bytes are too few for binary STL, and it does not begin with 'solid'",
                bytes.len()
            ));
        };
        if (bytes.len() as u64) < binary_length(count) {
            return refuse(format!(
                "its header says {count} triangles, but there are bytes for {} only",
                (bytes.len() - HEADER) / TRIANGLE
            ));
        }
        bytes[0] = 0;
    }
    let mesh =
        stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| (None, one_line(&e.to_string())))?;
    let finite = |v: &stl_io::Vertex| v.0.iter().all(|x| x.is_finite());
    if let Some(i) = mesh.vertices.iter().position(|v| !finite(v)) {
        let triangle = mesh.faces.iter().position(|f| f.vertices.contains(&i));
        let [x, y, z] = mesh.vertices[i].0;
        let message = format!(
            "triangle {} has a corner that is not finite: ({x}, {y}, {z})",
            triangle.unwrap_or_default()
        );
        return Err((None, message));
    }
    Ok(MeshData {
        positions: mesh.vertices.iter().map(|v| v.0.map(f64::from)).collect(),
        // u32 overflows from 2^32 vertices on, at three a triangle of 50 bytes: a file of
        // 71 GB, which fails for lack of memory before these casts.
        triangles: mesh
            .faces
            .iter()
            .map(|f| f.vertices.map(|v| v as u32))
            .collect(),
        ..MeshData::default()
    })
}

/// The length in bytes of a binary file of `count` triangles.
fn binary_length(count: usize) -> u64 {
    HEADER as u64 + TRIANGLE as u64 * count as u64
}

/// The lines of an ASCII facet: the words of each, and how many numbers follow them.
const FACET: [(&str, usize); 7] = [
    ("facet normal", 3),
    ("outer loop", 0),
    ("vertex", 3),
    ("vertex", 3),
    ("vertex", 3),
    ("endloop", 0),
    ("endfacet", 0),
];

/// Checks an ASCII file line by line, because the crate's errors do not tell the line.
fn check_lines(text: &str) -> Result<(), Wrong> {
    let (mut next, mut open) = (0, false);
    for (number, line) in text.lines().enumerate() {
        let wrong = |why: String| Err((Some(number + 1), why));
        let lower = line.to_ascii_lowercase();
        let mut words = lower.split_whitespace();
        let (named, count) = FACET[next];
        match lower.split_whitespace().next() {
            None => continue,
            Some(solid @ ("solid" | "endsolid")) => {
                open = solid == "solid";
                continue;
            }
            Some(_) => next = (next + 1) % FACET.len(),
        }
        let is_named = named.split(' ').all(|word| words.next() == Some(word));
        if !is_named || words.clone().count() != count {
            let numbers = if count > 0 { " and three numbers" } else { "" };
            let line = one_line(line);
            return wrong(format!("expected '{named}'{numbers}, found '{line}'"));
        }
        let is_number = |word: &&str| word.parse().is_ok_and(|x: f32| x.is_finite());
        if let Some(word) = words.find(|word| !is_number(word)) {
            let word = one_line(word);
            return wrong(format!("'{word}' is not a finite number, 3e38 at most"));
        }
    }
    let expected = match (FACET[next].0, open) {
        ("facet normal", true) => "facet normal' or 'endsolid",
        ("facet normal", false) => return Ok(()),
        (within, _) => within,
    };
    let message = format!("the file ends too early: expected '{expected}'");
    Err((Some(text.lines().count()), message))
}

/// Joins all solids of an ASCII file into one, in lower case. If the file does not close its
/// last solid, the result is not closed either.
fn one_solid(text: &str) -> Vec<u8> {
    let mut one = String::with_capacity(text.len() + 32);
    one.push_str("solid all\n");
    let mut open = false;
    for line in text.lines() {
        let line = line.to_ascii_lowercase();
        match line.split_whitespace().next() {
            Some("solid") => open = true,
            Some("endsolid") => open = false,
            _ => {
                one.push_str(&line);
                one.push('\n');
            }
        }
    }
    if !open {
        one.push_str("endsolid all\n");
    }
    one.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = " facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n endfacet\n";

    fn binary(header: &[u8], declared: u32, corners: &[[f32; 3]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(declared.to_le_bytes());
        for triangle in corners.chunks(3) {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const SQUARE: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];

    #[test]
    fn binary_and_a_header_that_says_solid() {
        for header in [&b"x"[..], b"solid of a program", b""] {
            let mesh = parse(binary(header, 2, &SQUARE)).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.positions.len(), 4);
        }
    }

    #[test]
    fn ascii_of_any_case_and_several_solids() {
        for text in [
            format!("solid a\n{ONE}endsolid a\n"),
            format!("solid\r\n{ONE}endsolid"),
            format!("\n SOLID B\n{}ENDSOLID\n", ONE.to_uppercase()),
        ] {
            assert_eq!(parse(text.into_bytes()).unwrap().triangles, [[0, 1, 2]]);
        }
        let two = format!("solid a\n{ONE}endsolid a\nsolid b\n{ONE}endsolid b\n");
        let two = parse(two.into_bytes()).unwrap();
        assert_eq!(two.triangles, [[0, 1, 2]; 2]);
        assert!(
            parse(b"solid nothing\nendsolid\n".to_vec())
                .unwrap()
                .triangles
                .is_empty()
        );
    }

    #[test]
    fn wrong_files_are_refused() {
        let nan = [[f32::NAN, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        let tail = "a".repeat(100);
        for (bytes, says) in [
            (Vec::new(), "too few"),
            (b"abc".to_vec(), "too few"),
            (binary(b"x", u32::MAX, &SQUARE), "bytes for 2 only"),
            (binary(b"x", 1, &nan), "not finite"),
            (format!("solid a\n{ONE}{tail}").into_bytes(), "facet"),
            (format!("solid a\n{ONE}").into_bytes(), "'endsolid'"),
            (
                format!("solid a\n{ONE}{ONE}")
                    .replace("endfacet\n facet", "facet")
                    .into_bytes(),
                "expected 'endfacet', found 'facet normal 0 0 1'",
            ),
            (
                b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n".to_vec(),
                "vertex",
            ),
            (
                format!("solid a\n{}endsolid", ONE.replace("1 0 0", "1 nan 0")).into_bytes(),
                "finite",
            ),
        ] {
            let message = parse(bytes).unwrap_err().1;
            assert!(message.contains(says), "{message}");
            assert!(!message.contains(['\n', '[']), "{message}");
        }
    }
}
