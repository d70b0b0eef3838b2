//! Errors of a scene, and the entities that they name.

use super::watertight::Leaks;
use crate::geom::primitive::Flaw;
use crate::roots::Solver;
use std::fmt;
use thiserror::Error;

/// The entity that an error is about, from which the caller can tell its place in a file.
/// Messages show its label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entity {
    pub kind: EntityKind,
    /// The row of the kind's table.
    pub row: u32,
    pub label: Box<str>,
}

/// The table of an entity, as files have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntityKind {
    /// A root of the graph, which scene files call an instance.
    Instance,
    Node,
    /// A child edge of a node.
    Edge,
    Shape,
    Mesh,
    Material,
    Light,
    Camera,
    /// The background, of which a scene has one.
    Background,
}

impl Entity {
    pub(super) fn new(kind: EntityKind, row: u32, label: String) -> Entity {
        Entity {
            kind,
            row,
            label: label.into(),
        }
    }
}

impl fmt::Display for Entity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// An error that the check of a scene finds.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SceneError {
    #[error("{what} refers to {kind} {id}, but there are only {count}")]
    DanglingId {
        what: Entity,
        kind: &'static str,
        id: u32,
        count: usize,
    },
    #[error("nodes form a cycle: {}; a node cannot contain itself", path.join(" → "))]
    Cycle { what: Entity, path: Vec<String> },
    #[error(
        "{what} has a singular transform (a scale of 0, or a matrix that flattens space, or \
         squeezes one direction 10^15 times as much as another); give every axis a size"
    )]
    SingularTransform { what: Entity },
    #[error(
        "{what} is placed by a transform that becomes singular (or nearly: 10^15 times as long one way as another) \
         or infinite together with those above it"
    )]
    SingularPath { what: Entity },
    #[error(
        "{what} has a motion that is singular at time {time:.6}, between two keys; matrices are \
         interpolated element by element, so turn in smaller steps: give more keys"
    )]
    SingularMotion { what: Entity, time: f64 },
    #[error(
        "{what} mirrors at one key and not at the next, and at time {time:.6} in between it would \
         be flat: use negative scales at both or at none"
    )]
    MirroredMotion { what: Entity, time: f64 },
    #[error(
        "{what} deforms, and at time {time} it has other vertices, normals or triangles than at \
         time 0; all its meshes must have the same, at other places"
    )]
    OtherMesh { what: Entity, time: f64 },
    #[error("at time {time:.6} {what} looks nowhere: its eye meets the point that it looks at")]
    BlindCamera { what: Entity, time: f64 },
    #[error(
        "at time {time} {what} is placed by a transform that becomes singular or infinite \
         together with those above it"
    )]
    SingularPathAt { what: Entity, time: f64 },
    #[error("{what} has {field} = {value}, which is not a finite number")]
    NotFinite {
        what: Entity,
        field: &'static str,
        value: String,
    },
    #[error("{what} has {field} = {value}; it must be {must}")]
    OutOfRange {
        what: Entity,
        field: &'static str,
        value: String,
        must: &'static str,
    },
    #[error("{what} is degenerate: {why}")]
    Degenerate { what: Entity, why: String },
    #[error(
        "{what} has degree {degree}, and the solver '{}' has formulas to degree {most}; choose \
         auto or another",
        solver.name()
    )]
    NoFormula {
        what: Entity,
        degree: u32,
        solver: Solver,
        most: usize,
    },
    #[error("{what} is empty: it has no {part}")]
    Empty { what: Entity, part: &'static str },
    #[error("{what}: triangle {triangle} uses vertex {vertex}, but there are only {count}")]
    VertexOutOfRange {
        what: Entity,
        triangle: usize,
        vertex: u32,
        count: usize,
    },
    #[error("{what} has {normals} normals for {vertices} vertices; give one each, or none")]
    NormalCount {
        what: Entity,
        normals: usize,
        vertices: usize,
    },
    #[error("{what} has {count} triangles; at most {limit} are supported, so split it")]
    TooManyTriangles {
        what: Entity,
        count: usize,
        limit: usize,
    },
    #[error("{what} has {operand} as an operand: {why}")]
    NotSolid {
        what: Entity,
        operand: Box<Entity>,
        why: &'static str,
    },
    #[error(
        "{what} has {operand} as an operand: it is not closed and has no inside: {leaks}; fill its \
         holes and turn its triangles alike, as most modelling programs can, or leave it out"
    )]
    NotClosed {
        what: Entity,
        operand: Box<Entity>,
        leaks: Box<Leaks>,
    },
    #[error("shapes form a cycle: {}; a solid cannot be made of itself", path.join(" → "))]
    CycleOfShapes { what: Entity, path: Vec<String> },
    #[error(
        "{what} unfolds into {count} operands; at most {limit} are supported: share less, or place \
         parts as instances of their own"
    )]
    TooManyOperands {
        what: Entity,
        count: u64,
        limit: u64,
    },
    #[error(
        "{what} unfolds into operands of {count} surfaces, triangles among them; at most {limit} \
         are supported: share less, or use meshes of fewer triangles"
    )]
    TooManySurfaces {
        what: Entity,
        count: u64,
        limit: u64,
    },
    #[error(
        "{what} and the solids before it that are placed unfold into {count} operands in all; at \
         most {limit} are supported in a scene: place one solid several times instead of defining \
         it again"
    )]
    TooManyOperandsInAll {
        what: Entity,
        count: u64,
        limit: u64,
    },
    #[error("the scene is empty: no instance places a shape")]
    NothingToSee,
    #[error(
        "the scene unfolds into {count} instances of shapes or more; ids count at most {limit}: \
         nest fewer shared nodes"
    )]
    TooManyInstances { count: u64, limit: u64 },
    #[error(
        "the scene unfolds into {count} instances of shapes, and each of them would be looked \
         at by itself; at most {limit} are supported for that"
    )]
    TooManyToLayOut { count: u64, limit: u64 },
    #[error(
        "the scene's nodes lie in each other {depth} deep; at most {limit} are supported where so \
         much is shared: use shorter chains of nodes"
    )]
    TooDeep { depth: u64, limit: u64 },
}

impl SceneError {
    /// Makes the error of a primitive's own flaw.
    pub(super) fn from_flaw(what: Entity, flaw: Flaw) -> SceneError {
        match flaw {
            Flaw::NotFinite { field, value } => SceneError::NotFinite { what, field, value },
            Flaw::OutOfRange { field, value, must } => SceneError::OutOfRange {
                what,
                field,
                value,
                must,
            },
            Flaw::Degenerate(why) => SceneError::Degenerate { what, why },
            Flaw::NoFormula {
                degree,
                solver,
                most,
            } => SceneError::NoFormula {
                what,
                degree,
                solver,
                most,
            },
            Flaw::Empty(part) => SceneError::Empty { what, part },
            Flaw::NormalCount { normals, vertices } => SceneError::NormalCount {
                what,
                normals,
                vertices,
            },
        }
    }

    /// Returns the entity that the error is about; `None` if it is about the whole scene.
    pub fn entity(&self) -> Option<&Entity> {
        match self {
            SceneError::DanglingId { what, .. }
            | SceneError::Cycle { what, .. }
            | SceneError::SingularTransform { what }
            | SceneError::SingularPath { what }
            | SceneError::SingularMotion { what, .. }
            | SceneError::MirroredMotion { what, .. }
            | SceneError::BlindCamera { what, .. }
            | SceneError::OtherMesh { what, .. }
            | SceneError::SingularPathAt { what, .. }
            | SceneError::NotFinite { what, .. }
            | SceneError::OutOfRange { what, .. }
            | SceneError::Degenerate { what, .. }
            | SceneError::NoFormula { what, .. }
            | SceneError::Empty { what, .. }
            | SceneError::VertexOutOfRange { what, .. }
            | SceneError::NotSolid { what, .. }
            | SceneError::NotClosed { what, .. }
            | SceneError::CycleOfShapes { what, .. }
            | SceneError::TooManyOperands { what, .. }
            | SceneError::TooManyOperandsInAll { what, .. }
            | SceneError::TooManySurfaces { what, .. }
            | SceneError::NormalCount { what, .. }
            | SceneError::TooManyTriangles { what, .. } => Some(what),
            SceneError::NothingToSee
            | SceneError::TooManyInstances { .. }
            | SceneError::TooManyToLayOut { .. }
            | SceneError::TooDeep { .. } => None,
        }
    }
}
