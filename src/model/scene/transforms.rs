//! Local transforms and their inverses in f64, one row per distinct use.
//!
//! Row 0 is the identity. The inverse is computed once, when the row is added; the scene's
//! check refuses rows without one. Rows that move have keys beside them (`motion.rs`);
//! their `local` is the transform at the tables' time, which is 0 at first.

use super::ids::TransformId;
use super::motion::{Interpolation, Key, Motions};
use crate::math::Affine;

#[derive(Clone, Debug)]
pub struct Transforms {
    /// The transforms `parent_from_child`.
    pub local: Vec<Affine>,
    /// The inverses `child_from_parent`; `None` where `local` is singular or not finite.
    pub inverse: Vec<Option<Affine>>,
    pub motions: Motions,
}

impl Default for Transforms {
    fn default() -> Transforms {
        Transforms {
            local: vec![Affine::IDENTITY],
            inverse: vec![Some(Affine::IDENTITY)],
            motions: Motions::default(),
        }
    }
}

impl Transforms {
    pub fn push(&mut self, local: Affine) -> TransformId {
        if local.is_identity() {
            return TransformId::IDENTITY;
        }
        self.add(local)
    }

    /// Adds a row that is `local` at time 0 and moves through the keys, which are sorted by
    /// time. It is never row 0, whatever `local` is.
    pub fn push_moving(
        &mut self,
        local: Affine,
        keys: &[Key],
        interpolation: Interpolation,
    ) -> TransformId {
        let id = self.add(local);
        self.motions.push(id, local, keys, interpolation);
        id
    }

    fn add(&mut self, local: Affine) -> TransformId {
        self.local.push(local);
        self.inverse.push(local.inverse());
        TransformId(self.local.len() as u32 - 1)
    }

    /// Sets the rows that move to a time.
    pub(super) fn set_time(&mut self, time: f64) {
        for (row, local) in self.motions.at(time) {
            self.local[row.index()] = local;
            self.inverse[row.index()] = local.inverse();
        }
    }

    pub fn len(&self) -> usize {
        self.local.len()
    }

    pub fn is_empty(&self) -> bool {
        false
    }

    pub fn bytes(&self) -> usize {
        self.local.len() * (size_of::<Affine>() + size_of::<Option<Affine>>())
            + self.motions.bytes()
    }
}
