//! Importer of Wavefront OBJ: the polygons of a file as one mesh, its MTL as materials.
//!
//! The crate tobj is not used: it keeps f32 only, reads a polyline of three points as a
//! triangle, shifts normals if only some corners have them, gives errors without a line and
//! panics on an MTL colour of one number.
//!
//! Polygons become triangles in file order: fans about their first corner where that is
//! right, or else what `triangulate` makes. Corners with equal indices
//! share a vertex. Texture coordinates are used where a material has an image; weights,
//! groups and smoothing are not read; points and lines are where they are wanted (`elements`).
//! Otherwise they are counted in the import report, as are free-form curves and surfaces.
//! Colours of positions are shown by faces without a material. Keywords may be in capitals. A
//! position that is not finite is an error only if a face uses it, and such a normal is replaced.

mod elements;
mod maps;
mod mtl;

use crate::scene::SceneBuilder;
use crate::shared::images::ImageStore;
use crate::shared::mesh_cleanup::repair_normals;
use crate::shared::mesh_file::MeshFile;
use crate::shared::messages::one_line;
use crate::shared::points::add_points;
use crate::shared::text::{decode, lines, number};
use crate::shared::triangulate::Triangulator;
use crate::shared::vertex_colors::{Srgb, WHITE, linear_codes, varied_by_vertices};
use crate::{Folder, ImportReport, LoadError, LoadOptions, add_mesh_instance};
use elements::Element;
use glam::DVec3;
use maps::MtlMaterial;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Reads an OBJ file into the builder as a mesh with materials, and one instance of it.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    images: &mut ImageStore,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let file = read(path, options, images, report)?;
    let (mesh, points) = file.add_with_points(scene);
    add_mesh_instance(scene, &mesh);
    add_points(path, &points, options, scene, report)
}

/// A corner of a face: indices of the file's positions, normals and texture coordinates.
type Corner = (u32, Option<u32>, Option<u32>);

/// The statements of a file, before corners are joined to vertices.
#[derive(Default)]
struct Lines {
    positions: Vec<[f64; 3]>,
    /// Errors of the positions that are not finite, for faces that use them.
    not_finite: HashMap<u32, LoadError>,
    normals: Vec<[f64; 3]>,
    /// With v from the top, as images have it.
    uvs: Vec<[f32; 2]>,
    corners: Vec<Corner>,
    /// For each face the end of its corners, its line, and its index into `material_names`.
    faces: Vec<(usize, usize, Option<usize>)>,
    /// Points and lines, if they are wanted.
    elements: Vec<Element>,
    /// Colours of positions, up to the last that has one; sRGB.
    colors: Vec<Option<Srgb>>,
    material_names: Vec<String>,
    libraries: Vec<String>,
}

/// Reads an OBJ file and the material libraries that it names. Fails for malformed lines,
/// vertices that do not exist or are not finite, and libraries outside the folder.
pub(super) fn read(
    path: &Path,
    options: &LoadOptions,
    images: &mut ImageStore,
    report: &mut ImportReport,
) -> Result<MeshFile, LoadError> {
    let bytes = options.read(path)?;
    let text = decode(path, &bytes)?;
    let lines = scan(path, &text, options.point_radius.is_some(), report)?;
    let folder = Folder::new(path, options);
    let materials = libraries(&folder, &lines.libraries, report)?;
    let keeps_uvs = options.keeps_uvs;
    join(path, lines, (materials, images, keeps_uvs), report)
}

/// Splits a file into lines, numbered from 1, and joins continued ones (with a `\` at the
/// end, or only blanks after it); they have the number of their first line. Comments do not
/// go on.
pub(super) fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = lines(text);
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = Cow::Borrowed(first);
        if first.trim_start().starts_with('#') {
            return Some((number, line));
        }
        while let Some(begun) = line.trim_end().strip_suffix('\\') {
            let end = begun.len();
            let joined = line.to_mut();
            joined.truncate(end);
            joined.push(' ');
            match lines.next() {
                Some((_, next)) => joined.push_str(next),
                None => break,
            }
        }
        Some((number, line))
    })
}

/// Makes an error at the place of `word`, which must be a slice of `line`.
pub(super) fn syntax(path: &Path, line: (usize, &str), word: &str, message: String) -> LoadError {
    let before = (word.as_ptr() as usize).saturating_sub(line.1.as_ptr() as usize);
    let before = line.1.get(..before).map_or(0, |b| b.chars().count());
    LoadError::Syntax {
        path: path.into(),
        line: line.0,
        column: before + 1,
        message,
    }
}

/// Reads the statements of a file.
fn scan(
    path: &Path,
    text: &str,
    wants_points: bool,
    report: &mut ImportReport,
) -> Result<Lines, LoadError> {
    let mut all = Lines::default();
    let mut rows: HashMap<String, usize> = HashMap::new();
    let mut material = None;
    for (number, line) in logical_lines(text) {
        let line = (number, &*line);
        let bare = without_comment(line.1);
        let mut words = bare.split_whitespace();
        let Some(key) = words.next() else { continue };
        // Names may contain blanks and '#'.
        let rest = || line.1.trim_start()[key.len()..].trim();
        match &*keyword(key) {
            "v" => {
                let (position, wrong) = triple(path, line, key, &mut words)?;
                if let Some(wrong) = wrong {
                    all.not_finite.insert(all.positions.len() as u32, wrong);
                }
                all.positions.push(position);
                // Three numbers after the position are a colour, and one is a weight.
                let color: Vec<&str> = words.collect();
                if let [r, g, b, ..] = color[..] {
                    let number = |word: &str| word.parse().unwrap_or(0.0_f32);
                    let [r, g, b] = [r, g, b].map(|word| number(word).clamp(0.0, 1.0));
                    all.colors.resize(all.positions.len() - 1, None);
                    all.colors.push(Some([r, g, b, 1.0]));
                }
            }
            "vn" => all.normals.push(triple(path, line, key, &mut words)?.0),
            "vt" => all.uvs.push(texture(path, line, words)?),
            "f" | "fo" => {
                let first = all.corners.len();
                for word in words {
                    let corner = corner(path, line, word, &all)?;
                    all.corners.push(corner);
                }
                if all.corners.len() - first < 3 {
                    all.corners.truncate(first);
                    report.add("face of fewer than 3 corners");
                } else {
                    all.faces.push((all.corners.len(), number, material));
                }
            }
            "usemtl" => {
                let name = rest();
                let next = all.material_names.len();
                let row = *rows.entry(name.into()).or_insert(next);
                if row == next {
                    all.material_names.push(name.into());
                }
                material = Some(row);
            }
            "mtllib" => all.libraries.push(rest().into()),
            "p" | "l" if wants_points => {
                let rows = words.map(|word| Ok(corner(path, line, word, &all)?.0));
                all.elements.push(Element {
                    rows: rows.collect::<Result<_, LoadError>>()?,
                    is_line: keyword(key) == "l",
                    line: number,
                    material,
                });
            }
            "p" | "l" => report.add("point or line element (see --point-radius)"),
            "curv" | "curv2" | "surf" => report.add("free-form element"),
            _ => {}
        }
    }
    Ok(all)
}

/// Removes a comment. What C libraries print as `1.#QNAN` begins none.
fn without_comment(line: &str) -> &str {
    let mut marks = line.match_indices('#').map(|(at, _)| at);
    let comment = marks.find(|at| !line[..*at].ends_with("1."));
    &line[..comment.unwrap_or(line.len())]
}

/// A keyword in lower case: some programs write `V` and `F`.
pub(super) fn keyword(word: &str) -> Cow<'_, str> {
    if word.bytes().any(|b| b.is_ascii_uppercase()) {
        Cow::Owned(word.to_ascii_lowercase())
    } else {
        Cow::Borrowed(word)
    }
}

/// Reads three numbers, and an error if one is not finite.
fn triple<'a>(
    path: &Path,
    line: (usize, &str),
    key: &str,
    words: &mut impl Iterator<Item = &'a str>,
) -> Result<([f64; 3], Option<LoadError>), LoadError> {
    let mut values = [0.0; 3];
    let mut not_finite = None;
    for (i, value) in values.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            let message = format!("'{key}' needs three numbers, but there are {i}");
            syntax(path, line, line.1, message)
        })?;
        let wrong = || {
            let message = format!("'{}' is not a finite number", one_line(word));
            syntax(path, line, word, message)
        };
        *value = number(word).ok_or_else(wrong)?;
        if !value.is_finite() && not_finite.is_none() {
            not_finite = Some(wrong());
        }
    }
    Ok((values, not_finite))
}

/// Reads a texture coordinate of one to three numbers, of which the third is not used, and those
/// that are not finite count as 0.
fn texture<'a>(
    path: &Path,
    line: (usize, &str),
    words: impl Iterator<Item = &'a str>,
) -> Result<[f32; 2], LoadError> {
    let mut uv = [0.0; 2];
    let mut count = 0;
    for word in words.take(3) {
        let Some(x) = number(word) else {
            let message = format!("'{}' is not a number", one_line(word));
            return Err(syntax(path, line, word, message));
        };
        if let (Some(place), true) = (uv.get_mut(count), (x as f32).is_finite()) {
            *place = x as f32;
        }
        count += 1;
    }
    if count == 0 {
        let message = "'vt' needs a number, but there is none".into();
        return Err(syntax(path, line, line.1, message));
    }
    Ok([uv[0], 1.0 - uv[1]])
}

/// Parses `position/texture/normal`, of which the latter two may be missing. Numbers count
/// from 1, or as negative numbers backwards from the last definition before this line. The
/// file may define positive ones later, so `join` checks them. Texture coordinates that are none
/// are left out.
fn corner(path: &Path, line: (usize, &str), word: &str, all: &Lines) -> Result<Corner, LoadError> {
    let row = |part: &str, what: &str, count: usize| {
        let wrong = |why: String| syntax(path, line, word, why);
        let number: i64 = part
            .parse()
            .map_err(|_| wrong(format!("'{}' is not a {what} number", one_line(part))))?;
        if number == 0 {
            return Err(wrong(format!("{what} numbers count from 1, not 0")));
        }
        from_first(number, count).ok_or_else(|| {
            wrong(format!(
                "there is no {what} {number}: {count} are defined before this line"
            ))
        })
    };
    let mut parts = word.split('/');
    let position = row(
        parts.next().unwrap_or_default(),
        "vertex",
        all.positions.len(),
    )?;
    let uv = parts.next().unwrap_or_default();
    let normal = match parts.next() {
        None | Some("") => None,
        Some(part) => Some(row(part, "normal", all.normals.len())?),
    };
    // A file may refer to what it does not have, for nothing has to use it.
    let uv = uv.parse().ok();
    let uv = uv.and_then(|number| from_first(number, all.uvs.len()));
    Ok((position, normal, uv))
}

/// Returns the row that a number means when there are `count` rows, if there may be one.
fn from_first(number: i64, count: usize) -> Option<u32> {
    let row = match number {
        0 => return None,
        1.. => number - 1,
        _ => count as i64 + number,
    };
    u32::try_from(row).ok()
}

/// Reads the materials of the libraries that exist, `None` for invisible ones. Missing libraries are counted and no
/// error, because OBJ files often come without theirs.
fn libraries(
    folder: &Folder,
    names: &[String],
    report: &mut ImportReport,
) -> Result<HashMap<String, Option<MtlMaterial>>, LoadError> {
    let mut materials = HashMap::new();
    let mut done: HashSet<PathBuf> = HashSet::new();
    for name in names {
        let name = name.trim_matches('"').replace('\\', "/");
        // The rest of the line is one name with blanks, or else a list of names.
        let whole = resolve(folder, &name);
        let list: Vec<&str> = match whole {
            Err(LoadError::Read { .. }) => name.split_whitespace().collect(),
            _ => vec![&*name],
        };
        for name in list {
            match resolve(folder, name) {
                Ok((found, exact)) if done.insert(found.clone()) => {
                    mtl::read(&found, folder, &mut materials, report)?;
                    let other_case = "material library named in another case";
                    report.repair(other_case, usize::from(!exact));
                }
                Ok(_) => {}
                Err(LoadError::Read { .. }) => report.add("missing material library"),
                Err(outside) => return Err(outside),
            }
        }
    }
    Ok(materials)
}

/// Finds a library by its name, or else by its name in letters of another case; tells which.
fn resolve(folder: &Folder, name: &str) -> Result<(PathBuf, bool), LoadError> {
    match folder.resolve(name) {
        Ok(found) => Ok((found, true)),
        Err(LoadError::Read { path, source }) => match folder.resolve_any_case(name) {
            Some(found) => Ok((found, false)),
            None => Err(LoadError::Read { path, source }),
        },
        Err(refused) => Err(refused),
    }
}

/// Joins corners to vertices, and splits faces into triangles. Fails if a face names a
/// vertex that the file does not have, or that is not finite.
fn join(
    path: &Path,
    mut lines: Lines,
    (mut known, images, keeps_uvs): (HashMap<String, Option<MtlMaterial>>, &mut ImageStore, bool),
    report: &mut ImportReport,
) -> Result<MeshFile, LoadError> {
    let normal_of = |corner: &Corner| lines.normals.get(corner.1? as usize);
    let smooth = lines.corners.iter().filter(|c| normal_of(c).is_some());
    let smooth = smooth.count();
    // Some files without normals refer to normals all the same.
    let named = lines.corners.iter().filter(|c| c.1.is_some()).count();
    report.add_many(
        "corner with a normal that the file does not have",
        named - smooth,
    );
    let with_normals = smooth == lines.corners.len();
    if smooth > 0 && !with_normals {
        report.add("normals of a mesh where only some corners have them");
    }
    let mut file = MeshFile::default();
    let mut faces_of = Vec::new();
    for name in &lines.material_names {
        faces_of.push(match known.remove(name) {
            None => {
                report.add("unknown material");
                Faces::Plain
            }
            Some(None) => Faces::Invisible,
            Some(Some(made)) => {
                let row = file.materials.len();
                let material = made.textured(row, &mut file, images, report);
                file.materials.push((name.clone(), material));
                Faces::Made(row)
            }
        });
    }

    let is_plain =
        |material: &Option<usize>| material.is_none_or(|m| matches!(faces_of[m], Faces::Plain));
    let mut plain = lines.faces.iter().filter(|(_, _, m)| is_plain(m));
    let is_varied = !lines.colors.is_empty() && plain.next().is_some();
    let varied = is_varied.then(|| varied_by_vertices(&mut file));
    let has_materials =
        !lines.colors.is_empty() && lines.faces.iter().any(|(_, _, m)| !is_plain(m));
    report.add_many(
        "vertex colour set of faces that have materials",
        usize::from(has_materials),
    );
    let has_images = file.textures.iter().any(|(_, _, refs)| !refs.is_empty());
    let with_uvs = keeps_uvs && !lines.uvs.is_empty() || has_images;
    if with_uvs {
        file.mesh.uvs.push(Vec::new());
    }
    let mut vertex: HashMap<Corner, u32> = HashMap::new();
    let (mut rows, mut outline) = (Vec::<u32>::new(), Vec::<DVec3>::new());
    let mut triangulator = Triangulator::new();
    let mut first = 0;
    for (end, line, material) in &lines.faces {
        let corners = &lines.corners[first..*end];
        first = *end;
        rows.clear();
        outline.clear();
        let material = match material.map_or(Faces::Plain, |m| faces_of[m]) {
            Faces::Plain => varied,
            Faces::Made(row) => Some(row),
            Faces::Invisible => {
                report.add("face of an invisible material (d 0)");
                continue;
            }
        };
        for corner in corners {
            let (position, normal, uv) = *corner;
            let Some(at) = lines.positions.get(position as usize) else {
                return Err(LoadError::Syntax {
                    path: path.into(),
                    line: *line,
                    column: 1,
                    message: no_vertex(position, lines.positions.len()),
                });
            };
            if let Some(wrong) = lines.not_finite.remove(&position) {
                return Err(wrong);
            }
            let mesh = &mut file.mesh;
            let uv = uv.filter(|_| with_uvs);
            let key = (position, normal.filter(|_| with_normals), uv);
            let next = mesh.positions.len() as u32;
            let row = *vertex.entry(key).or_insert(next);
            if row == next {
                mesh.positions.push(*at);
                if is_varied {
                    let color = lines.colors.get(position as usize).copied().flatten();
                    mesh.colors.push(linear_codes(&color.unwrap_or(WHITE)));
                }
                if let Some(set) = mesh.uvs.first_mut() {
                    let uv = uv.and_then(|uv| lines.uvs.get(uv as usize));
                    set.push(uv.copied().unwrap_or_default());
                }
                if with_normals {
                    let normal = normal.and_then(|n| lines.normals.get(n as usize));
                    let normal = normal.copied().unwrap_or_default();
                    mesh.normals.push(normal.map(|x| x as f32));
                }
            }
            rows.push(row);
            outline.push(DVec3::from_array(*at));
        }
        file.begin_part(material);
        triangulator.split(&outline, |t| {
            file.mesh.triangles.push(t.map(|i| rows[i as usize]));
        });
    }
    triangulator.tell(report);
    file.points = elements::points(path, &lines, |material| {
        match material.map(|m| faces_of[m]) {
            Some(Faces::Made(row)) => Some(row),
            _ => None,
        }
    })?;
    report.repair("unused vertex that is not finite", lines.not_finite.len());
    report.add_many("unusable normal", repair_normals(&mut file.mesh));
    Ok(file)
}

/// Says that a file does not have a vertex.
fn no_vertex(row: u32, count: usize) -> String {
    format!(
        "there is no vertex {}: the file has {count}",
        u64::from(row) + 1
    )
}

/// How faces of a material are read.
#[derive(Clone, Copy)]
enum Faces {
    Plain,
    /// With a row of the materials.
    Made(usize),
    Invisible,
}

#[cfg(test)]
mod tests;
