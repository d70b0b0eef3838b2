//! The scene graph: a DAG of nodes joined by edges, in flat columns without pointers.
//!
//! A node is a range of edges. An edge places a shape or another node under a transform,
//! with an optional material. The roots are edges too
//! ([`Tables::roots`](super::Tables)). A node may have many parents; it is stored once,
//! however often it is placed.

use super::ids::{MaterialId, NodeId, ShapeId, TransformId};
use super::names::Names;
use std::ops::Range;

/// The target of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    Shape(ShapeId),
    Node(NodeId),
}

/// One placement of a shape or a node: the row of [`Edges`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    pub target: Target,
    /// The transform `parent_from_child`.
    pub transform: TransformId,
    /// The material of everything below the edge, unless an edge nearer to the shape sets
    /// one. It also overrides a mesh's own materials.
    pub material: Option<MaterialId>,
}

impl Edge {
    /// Makes an edge to a shape, without a transform or a material.
    pub fn shape(shape: ShapeId) -> Edge {
        Edge {
            target: Target::Shape(shape),
            transform: TransformId::IDENTITY,
            material: None,
        }
    }

    /// Makes an edge to a node, without a transform or a material.
    pub fn node(node: NodeId) -> Edge {
        Edge {
            target: Target::Node(node),
            ..Edge::shape(ShapeId(0))
        }
    }

    pub fn transform(self, transform: TransformId) -> Edge {
        Edge { transform, ..self }
    }

    pub fn material(self, material: MaterialId) -> Edge {
        Edge {
            material: Some(material),
            ..self
        }
    }
}

/// Columns of edges; the children of a node, and the roots, are ranges of rows.
#[derive(Clone, Debug, Default)]
pub struct Edges {
    pub target: Vec<Target>,
    pub transform: Vec<TransformId>,
    pub material: Vec<Option<MaterialId>>,
}

impl Edges {
    pub fn push(&mut self, edge: Edge) {
        self.target.push(edge.target);
        self.transform.push(edge.transform);
        self.material.push(edge.material);
    }

    pub fn row(&self, i: usize) -> Edge {
        Edge {
            target: self.target[i],
            transform: self.transform[i],
            material: self.material[i],
        }
    }

    pub fn len(&self) -> usize {
        self.target.len()
    }

    pub fn is_empty(&self) -> bool {
        self.target.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.len()
            * (size_of::<Target>() + size_of::<TransformId>() + size_of::<Option<MaterialId>>())
    }
}

/// The table of nodes.
#[derive(Clone, Debug, Default)]
pub struct Nodes {
    /// Per node: the range of [`Tables::edges`](super::Tables) that are its children.
    pub children: Vec<Range<u32>>,
    pub names: Names,
}

impl Nodes {
    pub fn len(&self) -> usize {
        self.children.len()
    }

    pub fn is_empty(&self) -> bool {
        self.children.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.len() * size_of::<Range<u32>>() + self.names.bytes()
    }
}
