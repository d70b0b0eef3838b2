//! Places of a scene's entities in its files, for errors of the scene's own check.

use crate::scene::{Entity, EntityKind, RowCounts};
use crate::shared::line_column::line_column;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The offset of a row that is of another file.
const ELSEWHERE: usize = usize::MAX;

/// Byte offsets of entities in the text of one file, a column per kind, by row of the scene's
/// tables.
#[derive(Debug, Default)]
pub(super) struct Offsets {
    instances: Vec<usize>,
    nodes: Vec<usize>,
    edges: Vec<usize>,
    shapes: Vec<usize>,
    materials: Vec<usize>,
    lights: Vec<usize>,
    cameras: Vec<usize>,
    /// Those of the shapes that they belong to.
    meshes: Vec<usize>,
    pub background: Option<usize>,
}

impl Offsets {
    /// Notes the offset of new rows of a kind's table.
    pub(super) fn note(&mut self, kind: EntityKind, rows: Range<usize>, at: usize) {
        let column = match kind {
            EntityKind::Instance => &mut self.instances,
            EntityKind::Node => &mut self.nodes,
            EntityKind::Edge => &mut self.edges,
            EntityKind::Shape => &mut self.shapes,
            EntityKind::Material => &mut self.materials,
            EntityKind::Light => &mut self.lights,
            EntityKind::Camera => &mut self.cameras,
            EntityKind::Mesh => &mut self.meshes,
            EntityKind::Background => return self.background = Some(at),
        };
        column.resize(rows.start.max(column.len()), ELSEWHERE);
        column.resize(rows.end.max(column.len()), at);
    }

    fn of(&self, what: &Entity) -> Option<usize> {
        let column = match what.kind {
            EntityKind::Instance => &self.instances,
            EntityKind::Node => &self.nodes,
            EntityKind::Edge => &self.edges,
            EntityKind::Shape => &self.shapes,
            EntityKind::Material => &self.materials,
            EntityKind::Light => &self.lights,
            EntityKind::Camera => &self.cameras,
            EntityKind::Mesh => &self.meshes,
            EntityKind::Background => return self.background,
        };
        let at = column.get(what.row as usize).copied();
        at.filter(|at| *at != ELSEWHERE)
    }

    /// Makes the file one that another places: its instances become the edges from `first_edge`
    /// on, and its lights, cameras and background are that file's matter.
    pub(super) fn become_placed(&mut self, first_edge: usize) {
        let instances = std::mem::take(&mut self.instances);
        for (row, at) in (first_edge..).zip(instances) {
            self.note(EntityKind::Edge, row..row + 1, at);
        }
        self.lights.clear();
        self.cameras.clear();
        self.background = None;
    }
}

/// One of a scene's files, and which entities are its own.
#[derive(Debug)]
pub(super) enum FilePlaces {
    /// A file of this format.
    Text {
        path: PathBuf,
        text: String,
        at: Box<Offsets>,
    },
    /// A file of another format, whose rows were added between two counts.
    Rows {
        path: PathBuf,
        rows: Box<[RowCounts; 2]>,
    },
}

impl FilePlaces {
    /// Returns the file of an entity, with line and column, both from 1, if they are known;
    /// `None` if the entity is not of this file.
    pub(super) fn find(&self, what: &Entity) -> Option<(&Path, Option<(u32, u32)>)> {
        match self {
            FilePlaces::Text { path, text, at } => {
                let (line, column) = line_column(text.as_bytes(), at.of(what)?);
                let place = line.try_into().ok().zip(column.try_into().ok());
                Some((path, place))
            }
            FilePlaces::Rows { path, rows } => {
                let [before, after] = rows.each_ref();
                let rows = |of: fn(&RowCounts) -> usize| of(before)..of(after);
                let own = match what.kind {
                    EntityKind::Node => rows(|all| all.nodes),
                    EntityKind::Edge => rows(|all| all.edges),
                    EntityKind::Shape => rows(|all| all.shapes),
                    EntityKind::Mesh => rows(|all| all.meshes),
                    EntityKind::Material => rows(|all| all.materials),
                    EntityKind::Instance
                    | EntityKind::Light
                    | EntityKind::Camera
                    | EntityKind::Background => return None,
                };
                own.contains(&(what.row as usize)).then_some((path, None))
            }
        }
    }
}
