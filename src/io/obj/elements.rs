//! Points and lines of a file.

use super::{Lines, no_vertex};
use crate::LoadError;
use crate::shared::points::Points;
use crate::shared::vertex_colors::code_of;
use std::collections::HashMap;
use std::path::Path;

/// A statement of points, or of a line from one vertex to the next.
pub(super) struct Element {
    /// Rows of positions, which the file may define later.
    pub rows: Vec<u32>,
    pub is_line: bool,
    /// Its line in the file.
    pub line: usize,
    /// Its index into the names of materials.
    pub material: Option<usize>,
}

/// Returns the points and lines of each material; `row` finds that of an index into the names. Fails
/// if one names a vertex that the file does not have.
pub(super) fn points(
    path: &Path,
    lines: &Lines,
    row: impl Fn(Option<usize>) -> Option<usize>,
) -> Result<Vec<(Option<usize>, Points)>, LoadError> {
    let mut group_of: HashMap<Option<usize>, usize> = HashMap::new();
    let mut groups: Vec<(Option<usize>, Points)> = Vec::new();
    // Vertices that a group has, by group and row.
    let mut known: HashMap<(usize, u32), u32> = HashMap::new();
    let mut list = Vec::new();
    for element in &lines.elements {
        let material = row(element.material);
        let group = *group_of.entry(material).or_insert(groups.len());
        if group == groups.len() {
            groups.push((material, Points::default()));
        }
        let all = &mut groups[group].1;
        list.clear();
        for v in &element.rows {
            let Some(at) = lines.positions.get(*v as usize) else {
                return Err(LoadError::Syntax {
                    path: path.into(),
                    line: element.line,
                    column: 1,
                    message: no_vertex(*v, lines.positions.len()),
                });
            };
            let next = all.positions.len() as u32;
            let made = *known.entry((group, *v)).or_insert(next);
            if made == next {
                // What is not finite is found out when it is drawn.
                let lost = lines.not_finite.contains_key(v);
                all.positions.push(if lost { [f64::NAN; 3] } else { *at });
                all.colors.push(
                    lines
                        .colors
                        .get(*v as usize)
                        .copied()
                        .flatten()
                        .as_ref()
                        .map(code_of),
                );
            }
            list.push(made);
        }
        if element.is_line {
            all.segments
                .extend(list.windows(2).map(|pair| [pair[0], pair[1]]));
        }
    }
    Ok(groups)
}
