//! Local transforms and their inverses, both f64, one row per distinct use.
//!
//! Row 0 is the identity. The inverse is computed once, when the row is added;
//! a row without one is caught by the scene's check.

use super::ids::TransformId;
use crate::math::Affine;

#[derive(Clone, Debug)]
pub struct Transforms {
    /// `parent_from_child`.
    pub local: Vec<Affine>,
    /// `child_from_parent`; `None` where `local` is singular or not finite.
    pub inverse: Vec<Option<Affine>>,
}

impl Default for Transforms {
    fn default() -> Transforms {
        Transforms {
            local: vec![Affine::IDENTITY],
            inverse: vec![Some(Affine::IDENTITY)],
        }
    }
}

impl Transforms {
    pub fn push(&mut self, local: Affine) -> TransformId {
        if local.is_identity() {
            return TransformId::IDENTITY;
        }
        self.local.push(local);
        self.inverse.push(local.inverse());
        TransformId(self.local.len() as u32 - 1)
    }

    pub fn len(&self) -> usize {
        self.local.len()
    }

    pub fn is_empty(&self) -> bool {
        false
    }

    pub fn bytes(&self) -> usize {
        self.local.len() * (size_of::<Affine>() + size_of::<Option<Affine>>())
    }
}
