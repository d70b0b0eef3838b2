//! Importer of PLY, ASCII and binary in both byte orders, by the crate ply-rs-bw.
//!
//! Two elements are read, with any number types: `vertex` (x y z, and nx ny nz if all three
//! exist) and `face` (`vertex_indices` or `vertex_index`; more than three corners become a
//! fan, faces of fewer are counted). All other elements are skipped and counted. The crate
//! trusts the header's counts, which for an element without properties means endless work,
//! so counts are compared with the file's size first.

use crate::scene::MeshData;
use crate::shared::mesh_cleanup::{compact, repair_normals};
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult,
};
use std::path::Path;

/// Reads a PLY file as one mesh. Fails for malformed files, positions that are not finite,
/// and faces with vertices that do not exist.
pub(super) fn read(path: &Path, report: &mut ImportReport) -> Result<MeshData, LoadError> {
    let bytes = crate::shared::folder::read_file(path)?;
    parse(&bytes, report).map_err(|wrong| LoadError::in_mesh_file(path, "PLY", wrong))
}

/// The line of an error, if it is known, and the message.
type Wrong = (Option<usize>, String);

/// A row of the element `vertex`; the normal is 0 if the file has none.
struct Vertex {
    position: [f64; 3],
    normal: [f64; 3],
}

/// A row of the element `face`.
struct Face {
    /// `None` if a corner is negative or no integer.
    corners: Option<Vec<u32>>,
}

/// A row of an element that is not read.
struct Skipped;

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex {
            position: [0.0; 3],
            normal: [0.0; 3],
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let slot = match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            _ => return PropertyAccessResult::Ignored,
        };
        *slot = match property {
            Property::Char(v) => f64::from(v),
            Property::UChar(v) => f64::from(v),
            Property::Short(v) => f64::from(v),
            Property::UShort(v) => f64::from(v),
            Property::Int(v) => f64::from(v),
            Property::UInt(v) => f64::from(v),
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// Whether a property of a face lists its corners.
fn is_corners(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

impl PropertyAccess for Face {
    fn new() -> Face {
        Face {
            corners: Some(Vec::new()),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !is_corners(name) {
            return PropertyAccessResult::Ignored;
        }
        match property {
            Property::ListFloat(_) | Property::ListDouble(_) => {
                return PropertyAccessResult::UnsupportedType;
            }
            list => self.corners = list.to_u32_list(),
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Skipped {
    fn new() -> Skipped {
        Skipped
    }
}

/// Translates an error of the crate.
fn wrong(e: ParseError) -> Wrong {
    let (line, full) = (e.line(), e.to_string());
    // The line goes into the place, not into the message.
    let said = line.and_then(|line| full.strip_prefix(&format!("Line {line}: ")));
    (line, one_line(&in_words(said.unwrap_or(&full))))
}

/// Translates a message of the crate into words for users. It consists of a summary, the text
/// of the line and a reason, mixed with names of types and the state of the parser.
fn in_words(said: &str) -> String {
    let (what, rest) = said.split_once("\n\tString: ").unwrap_or((said, ""));
    let (line, why) = rest.split_once("\n\tError: ").unwrap_or((rest, ""));
    let line = format!("'{}'", one_line(line.trim().trim_matches('\'')));
    let what = what.lines().next().unwrap_or_default();
    let list = why
        .strip_suffix('.')
        .filter(|why| why.contains("list elements"));
    let property = |text: &'_ str| {
        text.strip_prefix("PLY property '")?
            .split('\'')
            .next()
            .map(str::to_owned)
    };
    if let Some(property) = property(why).or(property(what)) {
        return format!(
            "the property '{property}' has an unsupported type: coordinates are numbers, and \
             corners lists of whole numbers"
        );
    }
    match what {
        _ if what.starts_with("Expected magic number") => {
            format!("a PLY file begins with the line 'ply', and this with {line}")
        }
        "Couldn't parse line." => format!("{line} is no line of a PLY header"),
        _ if what.starts_with("Property ") => format!("{line} comes before any element"),
        _ if what.starts_with("Found contradicting") => {
            format!("{line} is another format than the one before")
        }
        "Couldn't read element line." => match list {
            Some(list) => format!("{line} is too short: {}", list.to_lowercase()),
            _ if why.starts_with("Expected element of type") => {
                format!("{line} has fewer values than the header says")
            }
            _ => format!("{line} has a value that is not of the type that the header says"),
        },
        _ => what.trim_end_matches('.').into(),
    }
}

/// Parses a file in memory.
fn parse(bytes: &[u8], report: &mut ImportReport) -> Result<MeshData, Wrong> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new()
        .read_header(&mut reader)
        .map_err(wrong)?;
    let rest = reader.get_ref().len();
    check_header(&header, &bytes[..bytes.len() - rest], rest)?;

    let mut vertices: Vec<Vertex> = Vec::new();
    let mut faces: Vec<Face> = Vec::new();
    let mut smooth = false;
    for element in header.elements.values() {
        match &*element.name {
            "vertex" => {
                let has = |name: &str| element.properties.contains_key(name);
                if let Some(axis) = ["x", "y", "z"].into_iter().find(|a| !has(a)) {
                    return Err((None, format!("its vertices have no property '{axis}'")));
                }
                smooth = ["nx", "ny", "nz"].into_iter().all(has);
                if ["red", "diffuse_red"].into_iter().any(has) {
                    report.add("vertex colour set");
                }
                vertices = elements(&mut reader, element, &header)?;
            }
            "face" => {
                if !element.properties.keys().any(|name| is_corners(name)) {
                    return Err((None, "its faces have no list 'vertex_indices'".into()));
                }
                faces = elements(&mut reader, element, &header)?;
            }
            name => {
                // Rows of a binary element without properties have no bytes.
                if !(element.properties.is_empty() && header.encoding != Encoding::Ascii) {
                    let _: Vec<Skipped> = elements(&mut reader, element, &header)?;
                }
                let what = format!("element {}", one_line(name));
                report.add_many(&what, element.count);
            }
        }
    }
    mesh(&vertices, &faces, smooth, report)
}

/// Formats a position for a message.
fn triple(p: [f64; 3]) -> String {
    let [x, y, z] = p;
    format!("({x}, {y}, {z})")
}

/// Reads all rows of an element.
fn elements<E: PropertyAccess>(
    reader: &mut Reader<&[u8]>,
    element: &ElementDef,
    header: &Header,
) -> Result<Vec<E>, Wrong> {
    Parser::<E>::new()
        .read_payload_for_element(reader, element, header)
        .map_err(wrong)
}

/// Checks that the elements have no more rows than the file has bytes after the header
/// (`rest`): all of them together, since a row takes a byte at least, and each binary element
/// without properties, whose rows take none, by itself; and
/// that no name occurs twice, because the crate would join the two.
fn check_header(header: &Header, text: &[u8], rest: usize) -> Result<(), Wrong> {
    let mut left = rest;
    for element in header.elements.values() {
        let no_bytes = element.properties.is_empty() && header.encoding != Encoding::Ascii;
        let room = if no_bytes { rest } else { left };
        if element.count <= room {
            left -= if no_bytes { 0 } else { element.count };
        } else {
            let message = format!(
                "its header says {} of element '{}', but only {room} bytes follow",
                element.count,
                one_line(&element.name)
            );
            return Err((None, message));
        }
    }
    let lines = |word: &[u8]| {
        let starts = |l: &&[u8]| l.starts_with(word);
        text.split(|b| *b == b'\n').filter(starts).count()
    };
    let properties = header.elements.values().map(|e| e.properties.len());
    let properties: usize = properties.sum();
    if lines(b"element ") != header.elements.len() || lines(b"property ") != properties {
        return Err((
            None,
            "its header names an element or a property twice".into(),
        ));
    }
    Ok(())
}

/// Joins vertices and faces into a mesh, and cleans it up.
fn mesh(
    vertices: &[Vertex],
    faces: &[Face],
    smooth: bool,
    report: &mut ImportReport,
) -> Result<MeshData, Wrong> {
    let finite = |v: &Vertex| v.position.iter().all(|x| x.is_finite());
    if let Some(i) = vertices.iter().position(|v| !finite(v)) {
        let message = format!("vertex {i} is not finite: {}", triple(vertices[i].position));
        return Err((None, message));
    }
    let mut mesh = MeshData {
        positions: vertices.iter().map(|v| v.position).collect(),
        ..MeshData::default()
    };
    if smooth {
        let normals = vertices.iter().map(|v| v.normal.map(|x| x as f32));
        mesh.normals = normals.collect();
    }
    for (i, face) in faces.iter().enumerate() {
        let Some(corners) = &face.corners else {
            return Err((None, format!("face {i} has a negative vertex number")));
        };
        let outside = corners.iter().find(|v| **v as usize >= vertices.len());
        if let Some(vertex) = outside {
            let message = format!(
                "face {i} uses vertex {vertex}, but there are only {}",
                vertices.len()
            );
            return Err((None, message));
        }
        if corners.len() < 3 {
            report.add("face of fewer than 3 corners");
            continue;
        }
        let pairs = corners[1..].windows(2);
        mesh.triangles
            .extend(pairs.map(|w| [corners[0], w[0], w[1]]));
    }
    if mesh.triangles.is_empty() {
        report.add_many("loose point", mesh.positions.len());
    }
    compact(&mut mesh);
    report.add_many("unusable normal", repair_normals(&mut mesh));
    Ok(mesh)
}

#[cfg(test)]
mod tests;
