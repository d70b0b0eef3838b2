//! A CSG solid ready to be met: unfolded, and a tree over its operands.
//!
//! Outside its own box nothing of a solid counts, so operands are known by the
//! parts of their boxes inside, and those with none are left out where all are in one
//! space: without them a program is false there too, because a box is derived from its
//! operands' boxes alone.

use super::Index;
use super::baselines::bvh4::Bvh4;
use super::baselines::bvh4_build::{Bvh4Quality, build};
use super::coincident_faces::CoincidentFaces;
use super::mesh_crossings::{MeshCrossingTrees, MeshCrossings};
use super::slabs::Slabs;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Aabb32, Vec3, unit};
use crate::scene::{
    CsgId, CsgOperand, CsgSolid, Frame, Instances, MeshId, Shape, ShapeId, Tables, shape_bounds,
};
use glam::DVec3;
use std::sync::Arc;

/// With no more operands than this a tree does not pay.
const FEW: usize = 12;

/// The place of the box of an operand that is not in the tree.
const NO_BOX: u32 = u32::MAX;

/// Frames of a greater condition have no tree.
const WILD: f64 = 8.0;

#[derive(Clone, Debug)]
pub struct PreparedCsg {
    pub solid: CsgSolid,
    pub coincident_faces: CoincidentFaces,
    /// The greatest of its frames.
    condition: f64,
    /// Operands that every ray has to ask.
    always: Vec<u32>,
    /// Over the others, if they are many: those that its entries are, with their
    /// boxes.
    tree: Option<(Bvh4, Vec<(u32, Aabb32)>)>,
    /// Of the operands that are meshes, by id.
    facets: Vec<(MeshId, Arc<MeshCrossings>)>,
    /// Of all of it, with room for roundings; `None` of what has none.
    pub bounds: Option<Aabb>,
    /// The largest coordinate of its box, infinite of one without, or of a shift on
    /// the way to an operand.
    size: f64,
    /// The most that a coordinate's rounding by the frames counts, over the least
    /// extent of the operand: see [`crate::trace`].
    pub roughness: f64,
    /// By frame.
    placements: Vec<Placement>,
    /// See [`PreparedCsg::unit_normals`]: all of them, and where each operand's end.
    normals: (Vec<DVec3>, Vec<usize>),
    /// See [`PreparedCsg::farthest_event`]: per unit of reach, and besides.
    event: [f64; 2],
}

/// How far boundaries of operands in a frame may be off, per unit of the largest
/// coordinate of where a ray begins, and besides.
#[derive(Clone, Copy, Debug)]
struct Placement {
    /// A plane's, over the rate at which the ray leaves it: see
    /// [`PreparedCsg::placement_per_reach`].
    plane: [f64; 2],
    /// Of any surface: see [`PreparedCsg::astray`].
    surface: [f64; 2],
    /// Its share of [`PreparedCsg::farthest_event`].
    event: [f64; 2],
}

/// Roundings that a frame's numbers carry: of its matrix' product, of the ray
/// through it, of the surface's own.
pub const PLACEMENT: f64 = 16.0 * f64::EPSILON;

/// A surface that the ray nearly runs along, is met anywhere; but not so far away: no
/// slower than at this part of the ray's speed.
pub const SLOWEST: f64 = 1.0 / (1_u64 << 26) as f64;

impl Placement {
    /// `size`: the solid's.
    fn of(frame: &Frame, size: f64) -> Placement {
        let (to, from) = (&frame.operand_from_solid, &frame.solid_from_operand);
        let (to_norm, from_norm) = (to.norm(), from.norm());
        let moved = DVec3::from_array(to.translation).abs().max_element();
        let unit = 2.0 * 32.0 * UNIT * to_norm;
        let share = unit * from_norm * to_norm;
        let rest = unit * (from_norm * moved + frame.reach);
        let roundings = to.stretch() * (0.51 * PLACEMENT);
        let fixed = from_norm * (to_norm * size + moved) + frame.reach;
        // Of two boundaries, and twice, for the roundings of all this.
        let slowest = 4.0 * PLACEMENT / SLOWEST;
        Placement {
            plane: [share, share * size + rest],
            surface: [roundings * from_norm * to_norm, roundings * fixed],
            event: [slowest * from_norm * to_norm, slowest * fixed],
        }
    }
}

impl PreparedCsg {
    /// `shape`: the CSG solid's own.
    pub fn of(
        tables: &Tables,
        shape: ShapeId,
        id: CsgId,
        trees: &mut MeshCrossingTrees,
    ) -> PreparedCsg {
        PreparedCsg::of_solid(tables, shape, CsgSolid::of(tables, id), trees)
    }

    /// By row, those that appear: what is an operand only, need not be unfolded.
    pub(super) fn all(scene: &Tables, instances: &Instances) -> Vec<Option<PreparedCsg>> {
        let appears = instances.of_shapes(scene);
        let mut solids = vec![None; scene.csg.len()];
        let mut trees = MeshCrossingTrees::default();
        for (row, (shape, times)) in (0..).zip(scene.shapes.rows.iter().zip(appears)) {
            if let (Shape::Csg(id), 1..) = (shape, times) {
                let solid = PreparedCsg::of(scene, ShapeId(row), *id, &mut trees);
                solids[id.index()] = Some(solid);
            }
        }
        solids
    }

    /// As if it were all of a union: a shape that has an inside, and is no
    /// CSG solid.
    pub fn of_one(tables: &Tables, shape: ShapeId) -> PreparedCsg {
        let solid = CsgSolid::of_one(tables, shape);
        PreparedCsg::of_solid(tables, shape, solid, &mut MeshCrossingTrees::default())
    }

    fn of_solid(
        tables: &Tables,
        shape: ShapeId,
        solid: CsgSolid,
        trees: &mut MeshCrossingTrees,
    ) -> PreparedCsg {
        let mut meshes: Vec<MeshId> = solid.operands.iter().filter_map(mesh_of).collect();
        meshes.sort_unstable();
        meshes.dedup();
        let facets = meshes.into_iter();
        let facets = facets.map(|id| (id, MeshCrossings::shared(trees, tables, id)));
        let own = shape_bounds(tables, shape).map(|b| b.grown(DVec3::splat(room(&b))));
        let (mut always, mut boxes, mut bounded) = (Vec::new(), Vec::new(), Vec::new());
        for (number, operand) in (0_u32..).zip(&solid.operands) {
            match (operand.bounds, own) {
                (None, _) => always.push(number),
                (Some(b), own) => {
                    let part =
                        own.map_or(b, |own| Aabb::new(b.min.max(own.min), b.max.min(own.max)));
                    // In a space of its own, what lies apart may be one event with what
                    // does not: as far as rays' roundings go, that boxes pad.
                    let part = match part.is_empty() {
                        true if solid.frames.len() > 1 => b,
                        _ => part,
                    };
                    if !part.is_empty() {
                        boxes.push(part.outward());
                        bounded.push(number);
                    }
                }
            }
        }
        let mut tree = None;
        // A tree's boxes have room for the roundings of rays, but not if these count
        // many times in the operands' spaces.
        let conditions = solid.frames.iter().map(|frame| frame.condition);
        let condition = conditions.fold(1.0, f64::max);
        if bounded.len() > FEW && condition <= WILD {
            let (built, order) = build(&boxes, &Bvh4Quality::default());
            let entry = |i: &u32| (bounded[*i as usize], boxes[*i as usize]);
            tree = Some((built, order.iter().map(entry).collect()));
        } else {
            always.extend(bounded);
            always.sort_unstable();
        }
        let frames = solid.frames.iter().map(|frame| frame.reach);
        let size = frames.fold(own.map_or(f64::INFINITY, |b| b.max_abs()), f64::max);
        let placement = |frame| Placement::of(frame, size);
        let placements: Vec<Placement> = solid.frames.iter().map(placement).collect();
        let event = match &placements[..] {
            [_] => [0.0; 2],
            all => [0, 1].map(|i| all.iter().fold(0.0, |most, p| f64::max(most, p.event[i]))),
        };
        let roughness = roughness(tables, &solid);
        let normals = match roughness == 0.0 {
            true => Default::default(),
            false => unit_normals(tables, &solid),
        };
        PreparedCsg {
            bounds: own,
            size,
            normals,
            placements,
            event,
            roughness,
            coincident_faces: CoincidentFaces::of(tables, &solid),
            facets: facets.collect(),
            solid,
            condition,
            always,
            tree,
        }
    }

    /// By how much lanes widen the bounds of boundaries, so that those of operands in
    /// different frames which are one by definition overlap; 0 with a single frame. A
    /// boundary's bound is at least 2.5 roundings of the operand's least extent over
    /// the rate at which the ray leaves its surface (but for planes: beside a corner,
    /// or near the start, they may be known better); its placement is 32 roundings of
    /// f64, of coordinates that count `roughness` times in that extent. Twice that,
    /// for the roundings of these numbers.
    ///
    /// `reach`: the largest coordinate of where the ray begins, in the solid's space;
    /// `unit`: the lanes' unit roundoff.
    pub fn widening(&self, reach: f64, unit: f64) -> f64 {
        let [share, more] = self.widening_per_reach(unit);
        reach * share + more
    }

    /// How far apart, in t, boundaries of different frames may be that are one by
    /// definition, for rays in the solid's space: two placements over the least rate. A
    /// boundary that is no farther before a ray's start, or beyond its limit, may be one
    /// event with what lies between. Nothing with a single frame.
    #[inline]
    pub fn farthest_event<L: Lanes>(&self, org: &Vec3<L>, dir: &Vec3<L>) -> L {
        let [share, fixed] = self.event;
        if fixed == 0.0 {
            return L::zero();
        }
        (org.max_abs() * L::from_f64(share) + L::from_f64(fixed)) / dir.max_abs()
    }

    /// By how much a plane's boundary is widened instead, over the rate at which the
    /// ray leaves it in the operand's space: per unit of reach, and besides. Twice
    /// the 32 roundings of its placement, as of [`PreparedCsg::widening`].
    #[inline]
    pub fn placement_per_reach(&self, frame: u32) -> [f64; 2] {
        self.placements[frame as usize].plane
    }

    /// Of an operand that planes bound, their normals at length 1, in its own space;
    /// of solids whose roughness is not 0.
    #[inline]
    pub fn unit_normals(&self, operand: u32) -> &[DVec3] {
        let (normals, ends) = &self.normals;
        let before = operand.checked_sub(1).map_or(0, |row| ends[row as usize]);
        &normals[before..ends[operand as usize]]
    }

    /// What [`PreparedCsg::widening`] is per unit of reach, and besides.
    pub fn widening_per_reach(&self, unit: f64) -> [f64; 2] {
        if self.roughness == 0.0 {
            return [0.0; 2];
        }
        let share = self.roughness * (2.0 * 32.0 / 2.5 * UNIT / unit);
        [share, share * self.size]
    }

    /// The box that an operand matters in, in the solid's space, and how many times a
    /// rounding of a ray counts there; `None` where it has none.
    #[inline]
    pub fn box_around(&self, operand: &CsgOperand) -> Option<(Aabb, f64)> {
        let frame = &self.solid.frames[operand.frame as usize];
        let own = operand.bounds.map(|b| (b, frame.condition));
        // What an operand without end does beyond all of the solid, does not matter; but
        // that lies where the others are.
        own.or(self.bounds.map(|b| (b, self.condition)))
    }

    /// Of a mesh that is an operand.
    #[inline]
    pub fn facets(&self, id: MeshId) -> &MeshCrossings {
        let row = self.facets.binary_search_by_key(&id, |row| row.0);
        &self.facets[row.expect("it is an operand")].1
    }

    /// Of the trees of meshes that are operands, each counted once.
    pub(super) fn facet_bytes<'c>(all: impl Iterator<Item = &'c PreparedCsg>) -> usize {
        let trees: MeshCrossingTrees = all.flat_map(|one| one.facets.iter().cloned()).collect();
        trees.values().map(|facets| facets.bytes()).sum()
    }

    /// How far off, in an operand's space, its surface may be beside those of other
    /// frames, for rays from `start`: half of what the definition of placement says, for
    /// the bound of a root grows by four times that.
    #[inline]
    pub fn astray<L: Lanes>(&self, frame: u32, start: L) -> L {
        let [share, fixed] = self.placements[frame as usize].surface;
        start * L::from_f64(share) + L::from_f64(fixed)
    }

    /// Without the trees of meshes, which CSG solids share.
    pub fn bytes(&self) -> usize {
        let tree = self.tree.iter();
        self.solid.bytes()
            + self.coincident_faces.bytes()
            + self.always.len() * 4
            + size_of_val(&self.placements[..])
            + tree
                .map(|(t, entries)| t.bytes() + size_of_val(&entries[..]))
                .sum::<usize>()
    }

    /// The numbers of all operands that some ray may be in between `t_min` and its
    /// limit (of lanes that are done: −∞), in order. Rays in the solid's space.
    #[inline]
    pub fn operands_along<L: Lanes>(
        &self,
        (org, dir): (Vec3<L>, Vec3<L>),
        t_min: L,
        limit: L,
        found: &mut Vec<u32>,
    ) {
        found.clear();
        found.extend_from_slice(&self.always);
        let Some((tree, entries)) = &self.tree else {
            return;
        };
        let slabs = Slabs::new(org, dir, &tree.bounds());
        tree.leaves_along(&slabs, (t_min, limit), |first, count| {
            for (number, own) in &entries[first..first + count] {
                let (enter, exit) = slabs.interval(own.min, own.max);
                if count == 1 || enter.max(t_min).le(exit.min(limit)).any() {
                    found.push(*number);
                }
            }
        });
        found.sort_unstable();
    }

    /// The same with, below each number's 32 bits, the place of its box for
    /// [`PreparedCsg::part_of`]: where no bound says what a lane may be certain of, no other
    /// may change what it finds, nor where it ends what it finds before.
    /// A walk of its own: one for both, with a closure for what is found, took pictures
    /// in `guarded`, which has no use for the boxes, 3 to 6 % longer.
    #[inline(never)]
    pub fn operands_in_boxes<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        found: &mut Vec<u64>,
    ) {
        let entry = |number: u32, place: u32| u64::from(number) << 32 | u64::from(place);
        found.clear();
        found.extend(self.always.iter().map(|number| entry(*number, NO_BOX)));
        let Some((tree, entries)) = &self.tree else {
            return;
        };
        tree.leaves_along(slabs, (t_min, limit), |first, count| {
            for (place, (number, own)) in (first..).zip(&entries[first..first + count]) {
                let (enter, exit) = slabs.interval(own.min, own.max);
                if enter.max(t_min).le(exit.min(limit)).any() {
                    found.push(entry(*number, place as u32));
                }
            }
        });
        found.sort_unstable();
    }

    /// Rays in the solid's space before the boxes of the tree.
    #[inline(always)]
    pub fn slabs<L: Lanes>(&self, org: Vec3<L>, dir: Vec3<L>) -> Slabs<L> {
        match &self.tree {
            Some((tree, _)) => Slabs::new(org, dir, &tree.bounds()),
            None => Slabs::open(),
        }
    }

    /// Of what [`PreparedCsg::operands_in_boxes`] found, the lanes that reach its box beyond
    /// `t_min`, and from where on they are in it: −∞ of what has none.
    #[inline(always)]
    pub fn part_of<L: Lanes>(&self, entry: u64, slabs: &Slabs<L>, t_min: L) -> (L::Mask, L) {
        match &self.tree {
            Some((_, entries)) if entry as u32 != NO_BOX => {
                let own = &entries[entry as u32 as usize].1;
                let (enter, exit) = slabs.interval(own.min, own.max);
                (enter.max(t_min).le(exit), enter)
            }
            _ => (L::Mask::splat(true), -L::splat(L::Scalar::INFINITY)),
        }
    }
}

fn mesh_of(operand: &CsgOperand) -> Option<MeshId> {
    match operand.shape {
        Shape::Mesh(id) => Some(id),
        _ => None,
    }
}

/// For the rounding of f64 coordinates.
fn room(bounds: &Aabb) -> f64 {
    bounds.max_abs() * (64.0 * f64::EPSILON)
}

fn unit_normals(tables: &Tables, solid: &CsgSolid) -> (Vec<DVec3>, Vec<usize>) {
    let mut normals = Vec::new();
    let ends = solid.operands.iter().map(|operand| {
        let own = tables.plane_normals(operand.shape);
        normals.extend(own.into_iter().map(unit));
        normals.len()
    });
    let ends = ends.collect();
    (normals, ends)
}

fn roughness(tables: &Tables, solid: &CsgSolid) -> f64 {
    if solid.frames.len() == 1 {
        return 0.0;
    }
    let of = |operand: &CsgOperand| {
        let frame = &solid.frames[operand.frame as usize];
        // Of quadrics and polynomials it is known apart.
        let thin = tables.thickness(operand.id)?;
        let scale = frame.operand_from_solid.norm();
        Some(frame.solid_from_operand.norm() * scale * scale / thin)
    };
    let all = solid.operands.iter().filter_map(of);
    all.fold(f64::MIN_POSITIVE, f64::max)
}
