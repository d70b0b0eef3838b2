//! Solids made of solids: an operator and its operands, which are shapes under
//! transforms and may be combinations themselves. A DAG, as nodes are; what it
//! unfolds into is derived ([`CsgSolid`](super::CsgSolid)).

use super::Blur;
use super::ids::{CombinationId, MaterialId, ShapeId, TransformId};
use crate::csg::Operator;
use crate::math::Aabb;
use std::ops::Range;

/// A shape's part in a combination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operand {
    pub shape: ShapeId,
    /// `solid_from_operand`.
    pub transform: TransformId,
    /// Of the surfaces that it contributes, where nothing nearer to them has one.
    pub material: Option<MaterialId>,
}

impl Operand {
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

#[derive(Clone, Debug, Default)]
pub struct Combinations {
    pub operator: Vec<Operator>,
    /// Of [`Combinations::operands`].
    pub operands_of: Vec<Range<u32>>,
    /// Of all surfaces, whatever the operands say.
    pub material: Vec<Option<MaterialId>>,
    /// How far apart boundaries of different operands may lie and be one, in the
    /// solid's space.
    pub tolerance: Vec<f64>,
    pub operands: Vec<Operand>,
    /// Object space; `None` of those without. Filled by the check.
    pub(super) bounds: Vec<Option<Aabb>>,
    /// Of the operands' spaces, in object space. Filled by the check.
    pub(super) blur: Vec<Blur>,
}

impl Combinations {
    pub(super) fn push(&mut self, operator: Operator) -> CombinationId {
        let first = self.operands.len() as u32;
        self.operator.push(operator);
        self.operands_of.push(first..first);
        self.material.push(None);
        self.tolerance.push(0.0);
        CombinationId(self.operator.len() as u32 - 1)
    }

    pub(super) fn set_operands(&mut self, id: CombinationId, operands: &[Operand]) {
        let first = self.operands.len() as u32;
        self.operands.extend_from_slice(operands);
        self.operands_of[id.index()] = first..self.operands.len() as u32;
    }

    #[inline(always)]
    pub fn operands(&self, id: CombinationId) -> &[Operand] {
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
