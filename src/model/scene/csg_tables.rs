//! The table of CSG solids: an operator and its operands, which are shapes under transforms
//! and may be CSG solids themselves. Like nodes they form a DAG;
//! [`CsgSolid`](super::CsgSolid) is derived by unfolding it.

use super::conditioning::Conditioning;
use super::ids::{CsgId, MaterialId, ShapeId, TransformId};
use crate::csg::Operator;
use crate::math::Aabb;
use std::ops::Range;

/// An operand of a CSG solid: a shape under a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operand {
    pub shape: ShapeId,
    /// The transform `solid_from_operand`.
    pub transform: TransformId,
    /// The material of the surfaces that the operand contributes, unless an operand nearer
    /// to them sets one.
    pub material: Option<MaterialId>,
}

impl Operand {
    /// Makes an operand without a transform or a material.
    pub fn shape(shape: ShapeId) -> Operand {
        Operand {
            shape,
            transform: TransformId::IDENTITY,
            material: None,
        }
    }

    pub fn transform(self, transform: TransformId) -> Operand {
        Operand { transform, ..self }
    }

    pub fn material(self, material: MaterialId) -> Operand {
        Operand {
            material: Some(material),
            ..self
        }
    }
}

/// The columns of CSG solids. The row of a solid is its [`CsgId`].
#[derive(Clone, Debug, Default)]
pub struct CsgTables {
    /// Per solid: its operator.
    pub operator: Vec<Operator>,
    /// Per solid: the range of its operands in `operands`.
    pub operands_of: Vec<Range<u32>>,
    /// Per solid: the material of all its surfaces, which overrides those of operands.
    pub material: Vec<Option<MaterialId>>,
    /// Per solid: how far apart boundaries of different operands may lie and still be one
    /// event, in the solid's space (docs/SPEC.md, S49).
    pub tolerance: Vec<f64>,
    /// The operands of all solids.
    pub operands: Vec<Operand>,
    /// Per solid: its box in object space, or `None` if it has no bounds. The scene's check
    /// fills the column.
    pub(super) bounds: Vec<Option<Aabb>>,
    /// Per solid: the conditioning of its operands' spaces, in object space. The scene's
    /// check fills the column.
    pub(super) conditioning: Vec<Conditioning>,
}

impl CsgTables {
    pub(super) fn push(&mut self, operator: Operator) -> CsgId {
        let first = self.operands.len() as u32;
        self.operator.push(operator);
        self.operands_of.push(first..first);
        self.material.push(None);
        self.tolerance.push(0.0);
        CsgId(self.operator.len() as u32 - 1)
    }

    pub(super) fn set_operands(&mut self, id: CsgId, operands: &[Operand]) {
        let first = self.operands.len() as u32;
        self.operands.extend_from_slice(operands);
        self.operands_of[id.index()] = first..self.operands.len() as u32;
    }

    /// Returns the operands of a solid.
    #[inline(always)]
    pub fn operands(&self, id: CsgId) -> &[Operand] {
        let range = &self.operands_of[id.index()];
        &self.operands[range.start as usize..range.end as usize]
    }

    pub fn len(&self) -> usize {
        self.operator.len()
    }

    pub fn is_empty(&self) -> bool {
        self.operator.is_empty()
    }

    pub fn bytes(&self) -> usize {
        let row = size_of::<Operator>()
            + size_of::<Range<u32>>()
            + size_of::<Option<MaterialId>>()
            + size_of::<f64>()
            + size_of::<Option<Aabb>>();
        self.len() * row + self.operands.len() * size_of::<Operand>()
    }
}
