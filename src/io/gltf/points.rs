//! Primitives of points and lines, in world space.

use super::File;
use super::accessor::{Accept, colors, indices, triples};
use super::material::Materials;
use crate::math::Affine;
use crate::scene::MaterialId;
use crate::shared::points::{Code, Drawn, Points};
use crate::shared::srgb::SrgbEncoder;
use crate::{ImportReport, LoadError};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::rc::Rc;

/// The points and lines of the meshes that are read so far, in the spaces of these.
#[derive(Default)]
pub(super) struct PointMeshes {
    read: HashMap<usize, Rc<Vec<Drawn>>>,
    pub drawn: Vec<Drawn>,
}

impl PointMeshes {
    /// Adds the points and lines of a mesh, each moved by all of these maps.
    pub fn add(
        &mut self,
        file: &File,
        mesh: usize,
        materials: &Materials,
        maps: &[Affine],
        report: &mut ImportReport,
    ) -> Result<bool, LoadError> {
        let known = self.read.get(&mesh).cloned();
        let groups = match known {
            Some(groups) => groups,
            None => {
                let groups = Rc::new(read(file, mesh, materials, report)?);
                self.read.insert(mesh, groups.clone());
                groups
            }
        };
        let count: usize = groups.iter().map(|(_, all)| all.positions.len()).sum();
        file.spend((count * maps.len()) as u64, &format!("mesh {mesh}"))?;
        for map in maps {
            let moved = |(material, all): &Drawn| {
                let positions = all.positions.iter().map(|p| map.point(*p)).collect();
                let all = Points {
                    positions,
                    ..all.clone()
                };
                (*material, all)
            };
            self.drawn.extend(groups.iter().map(moved));
        }
        Ok(!groups.is_empty())
    }
}

/// Reads the points and lines of a mesh, without skin and morphs.
fn read(
    file: &File,
    mesh: usize,
    materials: &Materials,
    report: &mut ImportReport,
) -> Result<Vec<Drawn>, LoadError> {
    let mut groups = Vec::new();
    let Some(source) = file.root.meshes.get(mesh) else {
        return Ok(groups);
    };
    for (i, primitive) in source.primitives.iter().enumerate() {
        let place = format!("mesh {mesh}, primitive {i}");
        let Checked::Valid(mode) = primitive.mode else {
            continue;
        };
        if !matches!(
            mode,
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip
        ) {
            continue;
        }
        let material = primitive.material.map(|id| id.value());
        let material = match material {
            None => None,
            Some(id) => match materials.rows.get(id) {
                Some(made) if made.id.is_none() => {
                    report.add("primitive of an invisible material");
                    continue;
                }
                Some(made) => made.id,
                None => {
                    let all = materials.rows.len();
                    let message = format!("refers to material {id}, but there are {all}");
                    return Err(file.invalid(&place, &message));
                }
            },
        };
        groups.extend(self::primitive(
            file,
            (primitive, mode),
            material,
            &place,
            report,
        )?);
    }
    Ok(groups)
}

fn primitive(
    file: &File,
    (primitive, mode): (&Primitive, Mode),
    material: Option<MaterialId>,
    place: &str,
    report: &mut ImportReport,
) -> Result<Option<Drawn>, LoadError> {
    let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
    let Some(positions) = attribute(Semantic::Positions) else {
        report.add("primitive without positions");
        return Ok(None);
    };
    let at = format!("{place}, POSITION");
    let positions = triples(file, positions, &file.vertex_types(Accept::Position), &at)?;
    let count = positions.len();
    let colors: Vec<Code> = match attribute(Semantic::Colors(0)) {
        None => Vec::new(),
        Some(id) => {
            let at = format!("{place}, COLOR_0");
            let rows = colors(file, id, &at)?;
            if rows.len() != count {
                let message = format!("{} elements for {count} positions", rows.len());
                return Err(file.invalid(&at, &message));
            }
            let encoder = SrgbEncoder::new();
            let code = |[r, g, b, _]: &[f64; 4]| [*r, *g, *b].map(|c| encoder.encode(c as f32));
            rows.iter().map(code).collect()
        }
    };
    let list = match primitive.indices {
        Some(id) => indices(file, id, &format!("{place}, indices"))?,
        None => (0..count as u32).collect(),
    };
    if let Some(v) = list.iter().find(|v| **v as usize >= count) {
        let message = format!("uses vertex {v}, but there are only {count}");
        return Err(file.invalid(&format!("{place}, indices"), &message));
    }
    // Only vertices that are used, each once.
    let mut row_of = vec![u32::MAX; count];
    let mut all = Points::default();
    let mut rows = Vec::with_capacity(list.len());
    for v in &list {
        let row = &mut row_of[*v as usize];
        if *row == u32::MAX {
            *row = all.positions.len() as u32;
            all.positions.push(positions[*v as usize]);
            all.colors
                .extend(colors.get(*v as usize).map(|code| Some(*code)));
        }
        rows.push(*row);
    }
    match mode {
        Mode::Lines => {
            let whole = rows.chunks_exact(2);
            if !whole.remainder().is_empty() {
                report.add("incomplete line");
            }
            all.segments.extend(whole.map(|pair| [pair[0], pair[1]]));
        }
        Mode::LineStrip | Mode::LineLoop => {
            all.segments
                .extend(rows.windows(2).map(|pair| [pair[0], pair[1]]));
            if let (Mode::LineLoop, Some(first), Some(last)) = (mode, rows.first(), rows.last())
                && rows.len() > 2
            {
                all.segments.push([*last, *first]);
            }
        }
        _ => {}
    }
    Ok(Some((material, all)))
}
