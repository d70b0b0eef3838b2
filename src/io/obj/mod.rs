//! Importer of Wavefront OBJ: the polygons of a file as one mesh, its MTL as materials.
//!
//! The crate tobj is not used: it keeps f32 only, reads a polyline of three points as a
//! triangle, shifts normals if only some corners have them, gives errors without a line and
//! panics on an MTL colour of one number.
//!
//! Polygons become triangle fans about their first corner, in file order, which is right for
//! convex polygons. Corners with equal position and normal indices share a vertex. Texture
//! coordinates are checked to be numbers and not used; vertex colours and weights, groups
//! and smoothing are not read; points, lines, and free-form curves and surfaces are counted
//! in the import report.

mod mtl;

use crate::scene::{Material, MeshData, SceneBuilder};
use crate::shared::folder::read_file;
use crate::shared::mesh_cleanup::repair_normals;
use crate::shared::messages::one_line;
use crate::{Folder, ImportReport, LoadError, LoadOptions, add_mesh_instance};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// The content of a file: a mesh, whose own table of parts is empty, and materials.
pub(super) struct Obj {
    pub mesh: MeshData,
    pub materials: Vec<(String, Material)>,
    /// The first triangle of each part and its index into `materials`, in ascending order.
    pub parts: Vec<(u32, Option<usize>)>,
}

/// Reads an OBJ file into the builder as a mesh with materials, and one instance of it.
pub(super) fn import(
    path: &Path,
    options: &LoadOptions,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let mut obj = read(path, options, report)?;
    let mut ids = Vec::with_capacity(obj.materials.len());
    for (name, material) in obj.materials {
        ids.push(scene.material(&one_line(&name), material));
    }
    let parts = obj.parts.iter();
    obj.mesh.parts = parts
        .map(|(first, m)| (*first, m.map(|m| ids[m])))
        .collect();
    add_mesh_instance(scene, &obj.mesh);
    Ok(())
}

/// A corner of a face: indices of the file's positions and normals.
type Corner = (u32, Option<u32>);

/// The statements of a file, before corners are joined to vertices.
#[derive(Default)]
struct Lines {
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    corners: Vec<Corner>,
    /// For each face the end of its corners, its line, and its index into `material_names`.
    faces: Vec<(usize, usize, Option<usize>)>,
    material_names: Vec<String>,
    libraries: Vec<String>,
}

/// Reads an OBJ file and the material libraries that it names. Fails for malformed lines,
/// vertices that do not exist, and libraries outside the folder.
pub(super) fn read(
    path: &Path,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<Obj, LoadError> {
    let bytes = read_file(path)?;
    let lines = scan(path, &bytes, report)?;
    let folder = Folder::new(path, options);
    let materials = libraries(&folder, &lines.libraries, report)?;
    join(path, &lines, materials, report)
}

/// Splits a file into lines, numbered from 1, and joins continued ones (with a `\` at the
/// end); they have the number of their first line.
pub(super) fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.split('\n').enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut line = Cow::Borrowed(first.trim_end_matches('\r'));
        while line.ends_with('\\') {
            let joined = line.to_mut();
            joined.pop();
            joined.push(' ');
            match lines.next() {
                Some((_, next)) => joined.push_str(next.trim_end_matches('\r')),
                None => break,
            }
        }
        Some((number + 1, line))
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
fn scan(path: &Path, bytes: &[u8], report: &mut ImportReport) -> Result<Lines, LoadError> {
    let text = String::from_utf8_lossy(bytes);
    let mut all = Lines::default();
    let mut rows: HashMap<String, usize> = HashMap::new();
    let mut material = None;
    for (number, line) in logical_lines(&text) {
        let line = (number, &*line);
        let bare = line.1.split('#').next().unwrap_or_default();
        let mut words = bare.split_whitespace();
        let Some(key) = words.next() else { continue };
        // Names may contain blanks and '#'.
        let rest = || line.1.trim_start()[key.len()..].trim();
        match key {
            "v" => all.positions.push(triple(path, line, key, words)?),
            "vn" => all.normals.push(triple(path, line, key, words)?),
            "vt" => texture(path, line, words)?,
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
            "p" | "l" => report.add("point or line element"),
            "curv" | "curv2" | "surf" => report.add("free-form element"),
            _ => {}
        }
    }
    Ok(all)
}

/// Reads three finite numbers; what follows them (a weight, a colour) is not read.
fn triple<'a>(
    path: &Path,
    line: (usize, &str),
    key: &str,
    mut words: impl Iterator<Item = &'a str>,
) -> Result<[f64; 3], LoadError> {
    let mut values = [0.0; 3];
    for (i, value) in values.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| {
            let message = format!("'{key}' needs three numbers, but there are {i}");
            syntax(path, line, line.1, message)
        })?;
        *value = finite(word).ok_or_else(|| {
            let message = format!("'{}' is not a finite number", one_line(word));
            syntax(path, line, word, message)
        })?;
    }
    Ok(values)
}

/// Checks that a texture coordinate has one to three numbers, of any value, since they are
/// not used.
fn texture<'a>(
    path: &Path,
    line: (usize, &str),
    words: impl Iterator<Item = &'a str>,
) -> Result<(), LoadError> {
    let mut words = words.take(3).peekable();
    if words.peek().is_none() {
        let message = "'vt' needs a number, but there is none".into();
        return Err(syntax(path, line, line.1, message));
    }
    match words.find(|word| word.parse::<f64>().is_err()) {
        None => Ok(()),
        Some(word) => {
            let message = format!("'{}' is not a number", one_line(word));
            Err(syntax(path, line, word, message))
        }
    }
}

/// Parses a finite number.
pub(super) fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Parses `position/texture/normal`, of which the latter two may be missing. Numbers count
/// from 1, or as negative numbers backwards from the last definition before this line. The
/// file may define positive ones later, so `join` checks them. Textures are not used.
fn corner(path: &Path, line: (usize, &str), word: &str, all: &Lines) -> Result<Corner, LoadError> {
    let row = |part: &str, what: &str, count: usize| {
        let wrong = |why: String| syntax(path, line, word, why);
        let number: i64 = part
            .parse()
            .map_err(|_| wrong(format!("'{}' is not a {what} number", one_line(part))))?;
        let row = match number {
            0 => return Err(wrong(format!("{what} numbers count from 1, not 0"))),
            1.. => number - 1,
            _ => count as i64 + number,
        };
        u32::try_from(row).map_err(|_| {
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
    let normal = match parts.nth(1) {
        None | Some("") => None,
        Some(part) => Some(row(part, "normal", all.normals.len())?),
    };
    Ok((position, normal))
}

/// Reads the materials of the libraries that exist. Missing libraries are counted and no
/// error, because OBJ files often come without theirs.
fn libraries(
    folder: &Folder,
    names: &[String],
    report: &mut ImportReport,
) -> Result<HashMap<String, Material>, LoadError> {
    let mut materials = HashMap::new();
    let mut done: HashSet<PathBuf> = HashSet::new();
    for name in names {
        // The rest of the line is one name with blanks, or else a list of names.
        let whole = folder.resolve(name);
        let list: Vec<&str> = match whole {
            Err(LoadError::Read { .. }) => name.split_whitespace().collect(),
            _ => vec![name],
        };
        for name in list {
            match folder.resolve(name) {
                Ok(found) if done.insert(found.clone()) => {
                    mtl::read(&found, &mut materials, report)?;
                }
                Ok(_) => {}
                Err(LoadError::Read { .. }) => report.add("missing material library"),
                Err(outside) => return Err(outside),
            }
        }
    }
    Ok(materials)
}

/// Joins corners to vertices, and splits faces into triangles. Fails if a face names a
/// vertex that the file does not have.
fn join(
    path: &Path,
    lines: &Lines,
    mut known: HashMap<String, Material>,
    report: &mut ImportReport,
) -> Result<Obj, LoadError> {
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
    let mut materials = Vec::new();
    let mut row_of = Vec::new();
    for name in &lines.material_names {
        let found = known.remove(name);
        if found.is_none() {
            report.add("unknown material");
        }
        row_of.push(found.map(|material| {
            materials.push((name.clone(), material));
            materials.len() - 1
        }));
    }

    let mut mesh = MeshData::default();
    let mut parts: Vec<(u32, Option<usize>)> = Vec::new();
    let mut vertex: HashMap<Corner, u32> = HashMap::new();
    let mut fan: Vec<u32> = Vec::new();
    let mut first = 0;
    for (end, line, material) in &lines.faces {
        fan.clear();
        for corner in &lines.corners[first..*end] {
            let (position, normal) = *corner;
            let Some(at) = lines.positions.get(position as usize) else {
                return Err(LoadError::Syntax {
                    path: path.into(),
                    line: *line,
                    column: 1,
                    message: format!(
                        "there is no vertex {}: the file has {}",
                        u64::from(position) + 1,
                        lines.positions.len()
                    ),
                });
            };
            let key = (position, normal.filter(|_| with_normals));
            let next = mesh.positions.len() as u32;
            let row = *vertex.entry(key).or_insert(next);
            if row == next {
                mesh.positions.push(*at);
                if with_normals {
                    let normal = normal_of(corner).copied().unwrap_or_default();
                    mesh.normals.push(normal.map(|x| x as f32));
                }
            }
            fan.push(row);
        }
        first = *end;
        let material = material.and_then(|m| row_of[m]);
        if parts.last().and_then(|(_, m)| *m) != material {
            parts.push((mesh.triangles.len() as u32, material));
        }
        let pairs = fan[1..].windows(2);
        mesh.triangles.extend(pairs.map(|w| [fan[0], w[0], w[1]]));
    }
    report.add_many("unusable normal", repair_normals(&mut mesh));
    Ok(Obj {
        mesh,
        materials,
        parts,
    })
}

#[cfg(test)]
mod tests;
