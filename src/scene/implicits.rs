//! The table of polynomial surfaces.

use super::ids::ImplicitId;
use crate::geom::{Clip, Implicit, Tape};
use crate::math::Aabb;

/// One column a field, one row a surface.
#[derive(Clone, Debug, Default)]
pub struct Implicits {
    pub tape: Vec<Tape>,
    pub open: Vec<bool>,
    pub clip: Vec<Option<Clip>>,
    /// Of the surface, clipped; `None` where none are known.
    pub bounds: Vec<Option<Aabb>>,
}

impl Implicits {
    /// Finds out its bounds, too.
    pub fn push(&mut self, tape: Tape, open: bool, clip: Option<Clip>) -> ImplicitId {
        let id = ImplicitId(self.tape.len() as u32);
        let bounds = clip.map(|clip| clip.bounds());
        self.tape.push(tape);
        self.open.push(open);
        self.clip.push(clip);
        self.bounds.push(bounds);
        id
    }

    #[inline(always)]
    pub fn row(&self, id: ImplicitId) -> Implicit<'_> {
        let i = id.index();
        Implicit {
            tape: &self.tape[i],
            open: self.open[i],
            clip: self.clip[i],
            bounds: self.bounds[i],
        }
    }

    pub fn rows(&self) -> impl Iterator<Item = (ImplicitId, Implicit<'_>)> {
        (0..self.len() as u32).map(|i| (ImplicitId(i), self.row(ImplicitId(i))))
    }

    pub fn len(&self) -> usize {
        self.tape.len()
    }

    pub fn is_empty(&self) -> bool {
        self.tape.is_empty()
    }

    pub fn bytes(&self) -> usize {
        let rest = size_of::<Tape>() + size_of::<bool>() + size_of::<Option<Clip>>();
        let rest = rest + size_of::<Option<Aabb>>();
        self.tape.iter().map(|tape| tape.bytes() + rest).sum()
    }
}
