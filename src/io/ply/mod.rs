//! Importer of PLY, ASCII and binary in both byte orders.
//!
//! Three elements are read, with any number types: `vertex` (x y z, and nx ny nz if all three
//! exist), `face` and `tristrips` (`vertex_indices` or `vertex_index`). Faces of more than
//! three corners are split by `triangulate`, those of fewer are counted; a strip begins anew
//! after a negative number. Colours, in sRGB, become materials of faces, or else a material that
//! those of vertices vary; all other elements are counted. Texture coordinates (s and t, u and v)
//! are kept where something may use them, and count from the image's top then.
//!
//! `header` parses the header and `rows` the rows of an element. The crate ply-rs-bw is not
//! used: it takes a line of text for a row, refuses tabs, blank lines and line ends of old
//! systems in the header, and NaN as C libraries print it, and its time grows as the square
//! of the header.

mod header;
mod rows;

use crate::scene::Material;
use crate::shared::mesh_cleanup::{compact, repair_normals};
use crate::shared::mesh_file::MeshFile;
use crate::shared::messages::one_line;
use crate::shared::points::Points;
use crate::shared::srgb::linear_from_srgb;
use crate::shared::text::{decode, is_wide};
use crate::shared::triangulate::Triangulator;
use crate::shared::vertex_colors::{Srgb, code_of, linear_codes, varied_by_vertices};
use crate::shared::write_ply::turned;
use crate::{ImportReport, LoadError, LoadOptions};
use glam::DVec3;
use header::{Element, Encoding, Header, Kind};
use rows::{Binary, Rows, Words};
use std::collections::HashMap;
use std::path::Path;

/// Reads a PLY file as one mesh, or as points if they are wanted and there are no triangles. Fails
/// for malformed files, and for faces with vertices that do not exist or are not finite.
pub(super) fn read(
    path: &Path,
    options: &LoadOptions,
    wants_points: bool,
    report: &mut ImportReport,
) -> Result<MeshFile, LoadError> {
    let mut bytes = options.read(path)?;
    if is_wide(&bytes, *b"pl") {
        bytes = decode(path, &bytes)?.into_owned().into_bytes();
    }
    let wants = Wants {
        points: wants_points,
        uvs: options.keeps_uvs,
    };
    parse(&bytes, wants, report).map_err(|wrong| LoadError::in_mesh_file(path, "PLY", wrong))
}

/// What is read only where something uses it.
#[derive(Clone, Copy, Default)]
struct Wants {
    points: bool,
    uvs: bool,
}

/// The line of an error, if it is known, and the message.
type Wrong = (Option<usize>, String);

/// The most colours of faces that become materials.
const MOST_COLORS: usize = 1 << 16;

/// The rows of the elements that are read.
#[derive(Default)]
struct Content {
    positions: Vec<[f64; 3]>,
    /// None, or one for each vertex.
    normals: Vec<[f32; 3]>,
    /// None, or one for each vertex, in sRGB, with alpha.
    vertex_colors: Vec<Srgb>,
    /// None, or one for each vertex, from the image's bottom.
    uvs: Vec<[f64; 2]>,
    /// Corners of all faces, and for each face the end of its corners.
    corners: Vec<i64>,
    ends: Vec<usize>,
    /// None, or one for each face; linear.
    colors: Vec<[f32; 3]>,
    /// Corners of all strips, and for each strip the end of its corners.
    strip_corners: Vec<i64>,
    strip_ends: Vec<usize>,
}

/// Parses a file in memory.
fn parse(bytes: &[u8], wants: Wants, report: &mut ImportReport) -> Result<MeshFile, Wrong> {
    let bytes = crate::shared::text::without_mark(bytes);
    let (header, body) = header::parse(bytes)?;
    check_counts(&header, body.len())?;
    let content = match header.encoding {
        Encoding::Ascii => {
            // A row is a line, as most programs write it, or else the words of any lines.
            let by_lines = content(&header, &mut Words::by_lines(body, header.lines), wants);
            by_lines.or_else(|wrong| {
                let mut words = Words::in_turn(body, header.lines);
                let all = content(&header, &mut words, wants).ok();
                all.filter(|_| words.is_at_end()).ok_or(wrong)
            })?
        }
        Encoding::Binary { big_endian } => {
            content(&header, &mut Binary::new(body, big_endian), wants)?
        }
    };
    let file = mesh(content, wants, report)?;
    for element in &header.elements {
        if !matches!(&*element.name, "vertex" | "face" | "tristrips") {
            let what = format!("element {}", one_line(&element.name));
            report.add_many(&what, element.count);
        }
    }
    Ok(file)
}

/// Checks that no element has more rows than the file has bytes after the header (`rest`),
/// since a row takes at least one byte, or none and then needs no more rows than that.
fn check_counts(header: &Header, rest: usize) -> Result<(), Wrong> {
    match header.elements.iter().find(|element| element.count > rest) {
        None => Ok(()),
        Some(element) => {
            let message = format!(
                "its header says {} of element '{}', but only {rest} bytes follow",
                element.count,
                one_line(&element.name)
            );
            Err((None, message))
        }
    }
}

/// Reads the rows of all elements.
fn content(header: &Header, rows: &mut impl Rows, wants: Wants) -> Result<Content, Wrong> {
    let mut content = Content::default();
    for element in &header.elements {
        match &*element.name {
            "vertex" => vertices(element, rows, wants, &mut content)?,
            "face" => faces(element, rows, &mut content)?,
            "tristrips" => {
                let corners = corner_list(element, "strips")?;
                for _ in 0..element.count {
                    let list = &mut content.strip_corners;
                    row(element, rows, |i, value| match value {
                        Value::Number(_) => {}
                        Value::Item(x) if i == corners => list.push(x as i64),
                        Value::Item(_) => {}
                    })?;
                    content.strip_ends.push(content.strip_corners.len());
                }
            }
            _ if element.properties.is_empty() => {}
            _ => {
                for _ in 0..element.count {
                    row(element, rows, |_, _| {})?;
                }
            }
        }
    }
    Ok(content)
}

/// A value of a property, or an item of a list.
enum Value {
    Number(f64),
    Item(f64),
}

/// Reads a row, and calls `take` with the index of a property and a value of it.
#[inline(always)]
fn row(
    element: &Element,
    rows: &mut impl Rows,
    mut take: impl FnMut(usize, Value),
) -> Result<(), Wrong> {
    rows.begin();
    for (i, property) in element.properties.iter().enumerate() {
        match property.count {
            None => take(i, Value::Number(rows.value(property.kind)?)),
            Some(count) => {
                for _ in 0..rows.count(count)? {
                    take(i, Value::Item(rows.value(property.kind)?));
                }
            }
        }
    }
    rows.end()
}

fn vertices(
    element: &Element,
    rows: &mut impl Rows,
    wants: Wants,
    content: &mut Content,
) -> Result<(), Wrong> {
    const NAMES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
    if let Some(axis) = NAMES[..3].iter().find(|n| element.property(n).is_none()) {
        return Err((None, format!("its vertices have no property '{axis}'")));
    }
    let slot = |name: &str| NAMES.iter().position(|known| *known == name);
    let slots: Vec<Option<usize>> = element.properties.iter().map(|p| slot(&p.name)).collect();
    if let Some(list) = element
        .properties
        .iter()
        .find(|p| p.count.is_some() && slot(&p.name).is_some())
    {
        return Err(unsupported(&list.name));
    }
    let smooth = NAMES.iter().all(|name| element.property(name).is_some());
    let channels = channels(element);
    let alpha = number_of(element, "alpha");
    let coordinates = coordinates(element).filter(|_| wants.uvs);
    for _ in 0..element.count {
        let mut values = [0.0; 6];
        let mut color = [0.0, 0.0, 0.0, 1.0];
        let mut uv = [0.0; 2];
        row(element, rows, |i, value| {
            let Value::Number(x) = value else {
                return;
            };
            if let Some(slot) = slots[i] {
                values[slot] = x;
            }
            let fraction = || element.properties[i].kind.fraction(x) as f32;
            if let Some(channels) = channels {
                match channels.iter().position(|slot| *slot == Some(i)) {
                    Some(k) => color[k] = fraction(),
                    None if alpha == Some(i) => color[3] = fraction(),
                    None => {}
                }
            }
            if let Some(k) = coordinates.and_then(|all| all.iter().position(|slot| *slot == i)) {
                uv[k] = x;
            }
        })?;
        if channels.is_some() {
            content.vertex_colors.push(color);
        }
        if coordinates.is_some() {
            content.uvs.push(uv);
        }
        let [x, y, z, nx, ny, nz] = values;
        content.positions.push([x, y, z]);
        if smooth {
            content.normals.push([nx, ny, nz].map(|x| x as f32));
        }
    }
    Ok(())
}

fn faces(element: &Element, rows: &mut impl Rows, content: &mut Content) -> Result<(), Wrong> {
    let corners = corner_list(element, "faces")?;
    let channels = channels(element);
    for _ in 0..element.count {
        let mut color = [0.0; 3];
        let list = &mut content.corners;
        row(element, rows, |i, value| match value {
            Value::Item(x) if i == corners => list.push(x as i64),
            Value::Item(_) => {}
            Value::Number(x) => {
                if let Some(channels) = channels
                    && let Some(k) = channels.iter().position(|slot| *slot == Some(i))
                {
                    color[k] = element.properties[i].kind.fraction(x);
                }
            }
        })?;
        content.ends.push(content.corners.len());
        if channels.is_some() {
            content
                .colors
                .push(color.map(|c| linear_from_srgb(c) as f32));
        }
    }
    Ok(())
}

/// The properties of an element that are a colour, if it has one.
fn channels(element: &Element) -> Option<[Option<usize>; 3]> {
    let slot = |names: [&str; 3]| names.map(|name| element.property(name));
    let channels = [
        slot(["red", "green", "blue"]),
        slot(["diffuse_red", "diffuse_green", "diffuse_blue"]),
        slot(["r", "g", "b"]),
    ];
    let is_number = |i: &Option<usize>| i.is_some_and(|i| element.properties[i].count.is_none());
    channels.into_iter().find(|all| all.iter().all(is_number))
}

/// Returns the property of this name, if it is one number.
fn number_of(element: &Element, name: &str) -> Option<usize> {
    let row = element.property(name)?;
    element.properties[row].count.is_none().then_some(row)
}

/// Returns the properties of an element that are texture coordinates, if it has some.
fn coordinates(element: &Element) -> Option<[usize; 2]> {
    let named = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
    named.into_iter().find_map(|[u, v]| {
        let both = [number_of(element, u)?, number_of(element, v)?];
        Some(both)
    })
}

/// The index of the list of corners.
fn corner_list(element: &Element, what: &str) -> Result<usize, Wrong> {
    let named = ["vertex_indices", "vertex_index"]
        .into_iter()
        .find_map(|name| element.property(name));
    let Some(at) = named else {
        return Err((None, format!("its {what} have no list 'vertex_indices'")));
    };
    let property = &element.properties[at];
    let is_whole = !matches!(property.kind, Kind::Float | Kind::Double);
    if property.count.is_some() && is_whole {
        Ok(at)
    } else {
        Err(unsupported(&property.name))
    }
}

fn unsupported(name: &str) -> Wrong {
    let message = format!(
        "the property '{}' has an unsupported type: coordinates are numbers, and \
         corners lists of whole numbers",
        one_line(name)
    );
    (None, message)
}

/// Joins vertices and faces into a mesh, and cleans it up.
fn mesh(content: Content, wants: Wants, report: &mut ImportReport) -> Result<MeshFile, Wrong> {
    let mut file = MeshFile::default();
    let count = content.positions.len();
    let at = |v: u32| DVec3::from_array(content.positions[v as usize]);
    let checked = |corner: i64, what: &str| match u32::try_from(corner) {
        Err(_) => Err((None, format!("{what} has a negative vertex number"))),
        Ok(v) if v as usize >= count => Err((
            None,
            format!("{what} uses vertex {v}, but there are only {count}"),
        )),
        Ok(v) if !at(v).is_finite() => {
            let [x, y, z] = content.positions[v as usize];
            Err((None, format!("vertex {v} is not finite: ({x}, {y}, {z})")))
        }
        Ok(v) => Ok(v),
    };
    let mut colors = Colors::new(&content.colors, report);
    // Colours of faces hide those of vertices.
    let varied = (colors.colors.is_empty() && !content.vertex_colors.is_empty())
        .then(|| varied_by_vertices(&mut file));
    let mut triangulator = Triangulator::new();
    let (mut rows, mut outline) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (i, end) in content.ends.iter().enumerate() {
        rows.clear();
        outline.clear();
        for corner in &content.corners[first..*end] {
            let v = checked(*corner, &format!("face {i}"))?;
            rows.push(v);
            outline.push(at(v));
        }
        first = *end;
        if rows.len() < 3 {
            report.add("face of fewer than 3 corners");
            continue;
        }
        let material = colors.material(i, &mut file.materials).or(varied);
        file.begin_part(material);
        triangulator.split(&outline, |t| {
            file.mesh.triangles.push(t.map(|i| rows[i as usize]));
        });
    }
    file.begin_part(varied);
    let mut first = 0;
    for (i, end) in content.strip_ends.iter().enumerate() {
        let strips = content.strip_corners[first..*end].split(|corner| *corner < 0);
        first = *end;
        for strip in strips {
            for (k, w) in strip.windows(3).enumerate() {
                let mut triangle = [0; 3];
                for (v, corner) in triangle.iter_mut().zip(w) {
                    *v = checked(*corner, &format!("strip {i}"))?;
                }
                let [a, b, c] = triangle;
                // Every second triangle is reversed, so that all have the same winding.
                let wound = if k % 2 == 0 { [a, b, c] } else { [a, c, b] };
                file.mesh.triangles.push(wound);
            }
        }
    }
    if file.mesh.triangles.len() > u32::MAX as usize {
        return Err((None, "it has more triangles than u32 can count".into()));
    }
    if file.mesh.triangles.is_empty() {
        if wants.points {
            let colors = content.vertex_colors.iter();
            let points = Points {
                positions: content.positions,
                colors: colors.map(|color| Some(code_of(color))).collect(),
                segments: Vec::new(),
            };
            return Ok(MeshFile {
                points: vec![(None, points)],
                ..MeshFile::default()
            });
        }
        report.add_many("loose point (see --point-radius)", count);
    }
    triangulator.tell(report);
    let lost = content.positions.iter();
    let lost = lost.filter(|p| !p.iter().all(|x| x.is_finite())).count();
    report.repair("unused vertex that is not finite", lost);
    file.parts
        .retain(|(at, _)| (*at as usize) < file.mesh.triangles.len());
    file.mesh.positions = content.positions;
    file.mesh.normals = content.normals;
    if varied.is_some() {
        let colors = content.vertex_colors.iter();
        file.mesh.colors = colors.map(linear_codes).collect();
    }
    if !content.uvs.is_empty() {
        let finite = |x: f64| if x.is_finite() { x as f32 } else { 0.0 };
        let uvs = content.uvs.iter();
        let from_top = uvs.map(|[u, v]| [finite(*u), finite(turned(*v))]);
        file.mesh.uvs.push(from_top.collect());
    }
    compact(&mut file.mesh);
    report.add_many("unusable normal", repair_normals(&mut file.mesh));
    Ok(file)
}

/// The colours of faces, and the material of each colour.
struct Colors<'a> {
    colors: &'a [[f32; 3]],
    row_of: HashMap<[u32; 3], usize>,
}

impl Colors<'_> {
    /// Takes the colours of all faces, none if they are too many.
    fn new<'a>(colors: &'a [[f32; 3]], report: &mut ImportReport) -> Colors<'a> {
        let mut seen = std::collections::HashSet::new();
        let key = |color: &[f32; 3]| color.map(f32::to_bits);
        let too_many = colors.iter().any(|color| {
            seen.insert(key(color));
            seen.len() > MOST_COLORS
        });
        if too_many {
            report.add("face colour set of more than 65,536 colours");
        }
        Colors {
            colors: if too_many { &[] } else { colors },
            row_of: HashMap::new(),
        }
    }

    /// The material of a face.
    fn material(&mut self, face: usize, all: &mut Vec<(String, Material)>) -> Option<usize> {
        let color = *self.colors.get(face)?;
        Some(
            *self
                .row_of
                .entry(color.map(f32::to_bits))
                .or_insert_with(|| {
                    let plain = Material::default();
                    all.push((
                        String::new(),
                        Material {
                            base_color: color,
                            ..plain
                        },
                    ));
                    all.len() - 1
                }),
        )
    }
}

#[cfg(test)]
mod tests;
