//! Importer of STL, ASCII and binary.
//!
//! Vertices with equal bits are joined; triangles keep their order. Facet normals are not
//! read, because the corners define them more precisely, and may be anything.
//!
//! A file whose length is the one that its binary header announces is binary; another one
//! that begins with "solid" and has no zero byte is ASCII; and what is left is binary. A
//! header may announce fewer triangles than there are, and none at all where a program
//! wrote it first; one that announces more is refused, since the file may be cut. In ASCII a solid may lack its end, or have
//! `end solid`, and words may follow where a keyword says all.
//!
//! The crate stl_io is not used: of ASCII it reads one solid with a name and its end, and of
//! binary what the header announces.

use crate::scene::MeshData;
use crate::shared::messages::one_line;
use crate::shared::text::{decode, is_wide, lines, without_mark};
use crate::{ImportReport, LoadError, LoadOptions};
use std::collections::HashMap;
use std::path::Path;

/// Reads an STL file as one mesh, all its solids together. Fails for malformed files and
/// corners that are not finite.
pub(super) fn read(
    path: &Path,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<MeshData, LoadError> {
    let bytes = options.read(path)?;
    let wrong = |wrong| LoadError::in_mesh_file(path, "STL", wrong);
    if is_ascii(&bytes) {
        let text = decode(path, &bytes)?;
        return ascii(&text, report).map_err(wrong);
    }
    binary(&bytes, report).map_err(wrong)
}

/// The line of an error, if it is known, and the message.
type Wrong = (Option<usize>, String);

type Corner = [f32; 3];

/// Bytes of the binary header with its count, and of a binary triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// The number of triangles that a binary header announces.
fn announced(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(80..HEADER)?.try_into().ok()?;
    Some(u32::from_le_bytes(count) as usize)
}

/// The length in bytes of a binary file of `count` triangles.
fn binary_length(count: usize) -> u64 {
    HEADER as u64 + TRIANGLE as u64 * count as u64
}

fn is_ascii(bytes: &[u8]) -> bool {
    let exact = announced(bytes).is_some_and(|n| bytes.len() as u64 == binary_length(n));
    let start = without_mark(bytes).trim_ascii_start();
    let word = start.get(..5);
    // Headers of binary files say "solid", too. Text has zero bytes only after its end.
    let text_end = bytes.iter().rposition(|b| !matches!(b, 0 | 0x1a));
    let is_text = !bytes[..text_end.map_or(0, |last| last + 1)].contains(&0);
    let is_solid = is_text && word.is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    !exact && (is_wide(bytes, *b"so") || is_solid)
}

/// Parses a binary file.
fn binary(bytes: &[u8], report: &mut ImportReport) -> Result<MeshData, Wrong> {
    let Some(count) = announced(bytes) else {
        let message = format!(
            "{} bytes are too few for binary STL, and it does not begin with 'solid'",
            bytes.len()
        );
        return Err((None, message));
    };
    let body = &bytes[HEADER..];
    let held = body.len() / TRIANGLE;
    if count > held {
        let message =
            format!("its header says {count} triangles, but there are bytes for {held} only");
        return Err((None, message));
    }
    // Programs that write as they go cannot know the count, and leave 0. Bytes after the last
    // triangle that was announced are no triangles unless they are whole ones.
    let by_length = count < held && (count == 0 || body.len().is_multiple_of(TRIANGLE));
    report.repair("header with too few triangles", usize::from(by_length));
    let count = if by_length { held } else { count };
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let mut made = Joined::default();
    for triangle in body.chunks_exact(TRIANGLE).take(count) {
        for corner in triangle[12..48].chunks_exact(12) {
            made.corner([0, 4, 8].map(|at| number(&corner[at..])));
        }
    }
    made.mesh()
}

/// Corners of triangles in turn, and their vertices.
#[derive(Default)]
struct Joined {
    row_of: HashMap<[u32; 3], u32>,
    vertices: Vec<Corner>,
    corners: Vec<u32>,
}

impl Joined {
    fn corner(&mut self, corner: Corner) {
        // u32 overflows from 2^32 vertices on, at three a triangle of 50 bytes: a file of
        // 71 GB, which fails for lack of memory before.
        let next = self.vertices.len() as u32;
        let row = *self.row_of.entry(corner.map(f32::to_bits)).or_insert(next);
        if row == next {
            self.vertices.push(corner);
        }
        self.corners.push(row);
    }

    fn mesh(self) -> Result<MeshData, Wrong> {
        let finite = |v: &Corner| v.iter().all(|x| x.is_finite());
        if let Some(i) = self.vertices.iter().position(|v| !finite(v)) {
            let corner = self.corners.iter().position(|v| *v as usize == i);
            let [x, y, z] = self.vertices[i];
            let message = format!(
                "triangle {} has a corner that is not finite: ({x}, {y}, {z})",
                corner.unwrap_or_default() / 3
            );
            return Err((None, message));
        }
        Ok(MeshData {
            positions: self.vertices.iter().map(|v| v.map(f64::from)).collect(),
            triangles: self
                .corners
                .chunks_exact(3)
                .map(|c| [c[0], c[1], c[2]])
                .collect(),
            ..MeshData::default()
        })
    }
}

/// The lines of an ASCII facet.
const FACET: [&str; 7] = [
    "facet",
    "outer loop",
    "vertex",
    "vertex",
    "vertex",
    "endloop",
    "endfacet",
];

/// Parses an ASCII file.
fn ascii(text: &str, report: &mut ImportReport) -> Result<MeshData, Wrong> {
    let mut made = Joined::default();
    let (mut next, mut open, mut last) = (0, false, 0);
    for (number, line) in lines(text) {
        let lower = line.to_ascii_lowercase();
        let mut words = lower.split_whitespace();
        let Some(first) = words.next() else { continue };
        last = number;
        let wrong = |why: String| Err((Some(number), why));
        let expected = FACET[next];
        // Between facets solids begin and end; their names follow and may be anything.
        let ends = first == "endsolid" || first == "end" && words.clone().next() == Some("solid");
        if next == 0 && (first == "solid" || ends) {
            open = first == "solid";
            continue;
        }
        let second = expected.split(' ').nth(1);
        if !expected.starts_with(first)
            || expected.split(' ').next() != Some(first)
            || second.is_some_and(|second| words.next() != Some(second))
        {
            let numbers = if expected == "vertex" {
                " and three numbers"
            } else {
                ""
            };
            let line = one_line(line);
            return wrong(format!("expected '{expected}'{numbers}, found '{line}'"));
        }
        next = (next + 1) % FACET.len();
        if expected != "vertex" {
            continue;
        }
        let mut corner = [0.0; 3];
        for x in &mut corner {
            let Some(word) = words.next() else {
                let line = one_line(line);
                return wrong(format!(
                    "expected 'vertex' and three numbers, found '{line}'"
                ));
            };
            *x = match word.parse() {
                Ok(x) if f32::is_finite(x) => x,
                _ => {
                    let word = one_line(word);
                    return wrong(format!("'{word}' is not a finite number, 3e38 at most"));
                }
            };
        }
        if let Some(word) = words.next() {
            let word = one_line(word);
            return wrong(format!(
                "expected 'vertex' and three numbers, found also '{word}'"
            ));
        }
        made.corner(corner);
    }
    if next != 0 {
        let message = format!("the file ends too early: expected '{}'", FACET[next]);
        return Err((Some(last), message));
    }
    report.repair("solid without 'endsolid'", usize::from(open));
    made.mesh()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: Vec<u8>) -> Result<MeshData, Wrong> {
        let mut report = ImportReport::default();
        if is_ascii(&bytes) {
            return ascii(&decode(Path::new("a"), &bytes).unwrap(), &mut report);
        }
        super::binary(&bytes, &mut report)
    }

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
            (
                format!("solid a\n{ONE}")
                    .replace("endfacet\n", "")
                    .into_bytes(),
                "'endfacet'",
            ),
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
