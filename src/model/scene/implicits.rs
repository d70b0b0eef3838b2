//! The table of polynomial surfaces.

use super::ids::ImplicitId;
use crate::geom::exact::sign_at;
use crate::geom::implicit_bounds::bounds_of;
use crate::geom::{Clip, Dense, Implicit, Tape};
use crate::math::Aabb;
use crate::roots::Solver;
use glam::DVec3;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Polynomial surfaces, one column a field and one row a surface.
#[derive(Clone, Debug, Default)]
pub struct Implicits {
    pub tape: Vec<Tape>,
    /// The tape multiplied out, where that is faster.
    pub dense: Vec<Option<Box<Dense>>>,
    pub open: Vec<bool>,
    pub clip: Vec<Option<Clip>>,
    /// The box of the solid, or of the surface in its clip; `None` where none is known.
    pub bounds: Vec<Option<Aabb>>,
    /// The solver that finds the roots in `fast` ([`crate::geom::by_solver`]).
    /// [`Solver::Auto`] is the lanes' own solver; `guarded` and `exact` always use it, and
    /// decide exactly.
    pub solver: Vec<Solver>,
    /// The latest row of each hash of tape and clip, because many rows may share a tape.
    latest: HashMap<u64, u32>,
}

impl Implicits {
    /// Adds a surface and finds its bounds, which takes up to one or two tenths of a second
    /// for a new tape.
    pub fn push(&mut self, tape: Tape, open: bool, clip: Option<Clip>) -> ImplicitId {
        let id = ImplicitId(self.tape.len() as u32);
        let key = key(&tape, &clip);
        let known = self.latest.get(&key).map(|row| *row as usize);
        let is_same =
            |row: usize| self.tape[row] == tape && self.clip[row] == clip && self.open[row] == open;
        let same = known.filter(|row| is_same(*row));
        let bounds = match same {
            Some(row) => self.bounds[row],
            None => bounds_of(&tape, clip.as_ref()),
        };
        // A solid that reaches outside the box of its surface is unbounded.
        let bounds = bounds.filter(|b| open || is_outside_beyond(&tape, b));
        self.latest.insert(key, id.0);
        let dense = match same {
            Some(row) if self.bounds[row] == bounds => self.dense[row].clone(),
            _ => Dense::of(&tape, bounds).map(Box::new),
        };
        self.dense.push(dense);
        self.tape.push(tape);
        self.open.push(open);
        self.clip.push(clip);
        self.bounds.push(bounds);
        self.solver.push(Solver::Auto);
        id
    }

    #[inline(always)]
    pub fn row(&self, id: ImplicitId) -> Implicit<'_> {
        let i = id.index();
        Implicit {
            tape: &self.tape[i],
            dense: self.dense[i].as_deref(),
            open: self.open[i],
            clip: self.clip[i],
            bounds: self.bounds[i],
        }
    }

    #[inline(always)]
    pub fn solver(&self, id: ImplicitId) -> Solver {
        self.solver[id.index()]
    }

    /// Lists the names of the solvers, other than `auto`, that any row has.
    pub fn chosen_solvers(&self) -> Vec<&'static str> {
        let chosen = |solver: &Solver| *solver != Solver::Auto && self.solver.contains(solver);
        let chosen = Solver::ALL.into_iter().filter(chosen);
        chosen.map(Solver::name).collect()
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
        let rest = rest + size_of::<Option<Aabb>>() + size_of::<Solver>();
        let latest = self.latest.capacity() * size_of::<(u64, u32)>();
        let tapes: usize = self.tape.iter().map(|tape| tape.bytes() + rest).sum();
        let dense = size_of::<Option<Box<Dense>>>() * self.dense.len()
            + size_of::<Dense>() * self.dense.iter().flatten().count();
        tapes + dense + latest
    }
}

/// Says whether f > 0 everywhere outside a box that contains all zeros of f.
fn is_outside_beyond(tape: &Tape, bounds: &Aabb) -> bool {
    let beyond = bounds.max + bounds.extent() + bounds.max.abs();
    let beyond = beyond.max(DVec3::splat(f64::MIN_POSITIVE));
    let is_known = beyond.is_finite() && beyond.cmpgt(bounds.max).all();
    is_known && sign_at(tape, beyond.to_array()).is_gt()
}

fn key(tape: &Tape, clip: &Option<Clip>) -> u64 {
    let mut hasher = DefaultHasher::new();
    for step in tape.steps() {
        let (kind, a, b) = step.key();
        (kind, a, b).hash(&mut hasher);
    }
    let mut number = |x: f64| (x + 0.0).to_bits().hash(&mut hasher);
    match clip {
        None => (),
        Some(Clip::Sphere(s)) => [s.center.x, s.center.y, s.center.z, s.radius]
            .into_iter()
            .for_each(&mut number),
        Some(Clip::Cuboid(c)) => [c.min.to_array(), c.max.to_array()]
            .into_iter()
            .flatten()
            .for_each(&mut number),
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::tape::Builder;
    use crate::geom::{Cuboid, Sphere};
    use glam::DVec3;

    /// The tape of x² + y² + z² − c.
    fn ball(c: f64) -> Tape {
        let mut b = Builder::default();
        let mut sum = b.constant(-c);
        for axis in 0..3 {
            let v = b.coordinate(axis);
            let square = b.power(v, 2);
            sum = b.sum(sum, square);
        }
        b.finish(sum)
    }

    #[test]
    fn every_row_has_its_own_bounds() {
        let cuboid = Clip::Cuboid(Cuboid {
            min: DVec3::splat(0.0),
            max: DVec3::splat(8.0),
        });
        let sphere = Clip::Sphere(Sphere {
            center: DVec3::X,
            radius: 0.5,
        });
        let mut table = Implicits::default();
        for _ in 0..2 {
            for c in [1.0, 4.0] {
                for clip in [None, Some(cuboid), Some(sphere)] {
                    table.push(ball(c), true, clip);
                }
            }
        }
        assert_eq!(table.len(), 12);
        for (id, row) in table.rows() {
            assert_eq!(row.bounds, bounds_of(row.tape, row.clip.as_ref()));
            assert_eq!(row.bounds, table.bounds[(id.index() + 6) % 12]);
        }
        let unlike = |i: usize, j: usize| table.bounds[i] != table.bounds[j];
        assert!((1..6).all(|i| unlike(0, i)) && unlike(1, 4) && unlike(1, 2));
    }

    #[test]
    fn equal_rows_are_searched_once() {
        let mut table = Implicits::default();
        table.push(ball(1.0), false, None);
        // A mark in place of the bounds, which a second search would not find.
        let mark = Aabb::new(DVec3::ZERO, DVec3::splat(7.0));
        table.bounds[0] = Some(mark);
        table.push(ball(2.0), false, None);
        table.push(ball(1.0), false, None);
        assert_ne!(table.bounds[1], Some(mark));
        assert_eq!(table.bounds[2], Some(mark));
    }
}
