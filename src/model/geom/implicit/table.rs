//! The table of polynomial surfaces.

use super::{Implicit, check, guarded, torus, values_of};
use crate::geom::by_solver;
use crate::geom::exact::sign_at;
use crate::geom::exact::{Line, Root, first_beyond_of};
use crate::geom::guarded::ObjectRay;
use crate::geom::implicit_bounds::bounds_of;
use crate::geom::kinds::ImplicitId;
use crate::geom::primitive::{Blur, Boundaries, Exact, Flaw, OPEN, Primitive};
use crate::geom::ray::Meet;
use crate::geom::{Chart, Clip, Dense, Scratch, Tape};
use crate::math::Aabb;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Scalar};
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
    /// The rows that are tori, with their radii [R, r], in order.
    tori: Vec<(ImplicitId, [f64; 2])>,
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
            _ => Dense::expand(&tape, bounds).map(Box::new),
        };
        self.tori
            .extend(torus::radii_of(&tape).map(|radii| (id, radii)));
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
        tapes + dense + latest + size_of_val(&self.tori[..])
    }
}

impl Primitive for Implicits {
    type Id = ImplicitId;
    type Row<'a> = Implicit<'a>;
    const BOUNDARIES: Boundaries = Boundaries::Polynomial;
    const BLUR: Blur = Blur::Apart;
    const IS_DISTANCE: bool = false;

    #[inline(always)]
    fn exact(&self, id: ImplicitId) -> Implicit<'_> {
        self.row(id)
    }

    fn check(&self, id: ImplicitId) -> Result<(), Flaw> {
        check::implicit(&self.row(id), self.solver(id))
    }

    fn bounds(&self, id: ImplicitId) -> Option<Aabb> {
        self.bounds[id.index()]
    }

    fn no_inside(&self, id: ImplicitId) -> Option<&'static str> {
        self.open[id.index()].then_some(OPEN)
    }

    fn thickness(&self, _id: ImplicitId) -> Option<f64> {
        None
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: ImplicitId,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        meet_certainly(&self.row(id), self.solver(id), (object, active), scratch)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: ImplicitId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(&self.row(id), object, active, &mut scratch.polynomial)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: ImplicitId, p: Vec3<D>) -> (D, Vec3<D>) {
        values_of(&self.row(id), p)
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: ImplicitId, p: Vec3<D>) -> Vec3<D> {
        let (_, normals) = values_of(&self.row(id), p);
        // A singular point has none; any is as good.
        let known = normals.max_abs().gt(D::zero());
        Vec3::select(known, normals, Vec3::splat(DVec3::Y.to_array()))
    }

    /// Returns the error of f at rounded points in roundings, over its slope (F17,
    /// docs/numerics/polynomials.md).
    #[inline(always)]
    fn blur<D: Lanes<Scalar = f64>>(&self, id: ImplicitId, at: Vec3<D>, slope: Option<D>) -> D {
        let row = self.row(id);
        let own = || values_of(&row, at).1.length();
        let off = guarded::blur_at((row.tape, row.dense), at) * D::splat(1.0 / UNIT);
        off / slope.unwrap_or_else(own)
    }

    fn chart(&self, id: ImplicitId, p: DVec3, normal: DVec3) -> Chart {
        let known = self.tori.binary_search_by_key(&id, |(row, _)| *row);
        match known {
            Ok(at) => Chart::on_torus(self.tori[at].1[0], p),
            Err(_) => Chart::along_axes(p, normal),
        }
    }
}

impl<'a> Exact<'a> for Implicit<'a> {
    fn is_finite(&self) -> bool {
        Implicit::is_finite(self)
    }

    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, scratch: &mut Scratch) -> Option<Root<'a>> {
        super::exact::first_beyond(self, line, t_min, &mut scratch.polynomial)
    }
}

/// Meets the surface with no lane left undecided: by the solver that the row names, or by the
/// guarded kernel, whose undecided lanes are decided exactly.
#[inline(never)]
fn meet_certainly<L: Lanes>(
    row: &Implicit,
    solver: Solver,
    (object, active): (&ObjectRay<L>, L::Mask),
    scratch: &mut Scratch,
) -> Meet<L> {
    if solver != Solver::Auto {
        let mut t = L::zero();
        let hit = object.each_lane(active, |lane, line, t_min| {
            let first = by_solver::first(row, solver, line, [t_min, f64::INFINITY]);
            if let Some(at) = first {
                t = t.with_lane(lane, L::Scalar::from_f64(at));
            }
            first.is_some()
        });
        return Meet::certain(hit, t);
    }
    let meet = guarded::meet(row, object, active, &mut scratch.polynomial);
    let mut t = meet.t;
    let decided = object.each_lane(meet.unsure, |lane, (org, dir), t_min| {
        let root = first_beyond_of(row, &Line { org, dir }, t_min, scratch);
        if let Some(root) = &root {
            t = t.with_lane(lane, L::Scalar::from_f64(root.t.value));
        }
        root.is_some()
    });
    Meet::certain(meet.hit | decided, t)
}

/// Says whether f is above zero everywhere outside a box that holds all its zeros.
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
