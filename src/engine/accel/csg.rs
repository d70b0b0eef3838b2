//! CSG solids prepared for tracing: unfolded, with a tree over their operands.
//!
//! Nothing outside a solid's box counts, so operands are listed by the parts of their boxes
//! inside it. Operands whose part is empty are left out if all operands share one frame.
//! Without them the program is false outside the box as well, because the box is derived
//! from the operands' boxes alone.

use super::Index;
use super::baselines::bvh4::Bvh4;
use super::baselines::bvh4_build::{Bvh4Quality, build};
use super::coincident_faces::CoincidentFaces;
use super::mesh_crossings::{MeshCrossingTrees, MeshCrossings};
use super::slabs::Slabs;
use crate::geom::primitive::Blur;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Aabb32, Vec3, unit};
use crate::scene::{
    CsgId, CsgOperand, CsgSolid, Frame, Instances, MeshId, Shape, ShapeId, Tables, shape_bounds,
};
use glam::DVec3;
use std::sync::Arc;

/// The most operands for which a tree does not pay.
const FEW: usize = 12;

/// The row of the box of an operand that is not in the tree.
const NO_BOX: u32 = u32::MAX;

/// The largest condition of a frame whose solid gets a tree. The boxes have room for the
/// roundings of rays, but not if these count many times in an operand's space.
const MAX_CONDITION: f64 = 8.0;

/// A CSG solid prepared for tracing.
#[derive(Clone, Debug)]
pub struct PreparedCsg {
    pub solid: CsgSolid,
    pub coincident_faces: CoincidentFaces,
    /// The greatest condition of its frames.
    condition: f64,
    /// Operands that every ray tests, ascending.
    always: Vec<u32>,
    /// The tree over the other operands, if they are many, and in its order their numbers
    /// and boxes.
    tree: Option<(Bvh4, Vec<(u32, Aabb32)>)>,
    /// The operands that are meshes, by id.
    meshes: Vec<(MeshId, Arc<MeshCrossings>)>,
    /// The solid's box, with room for roundings (docs/numerics/csg.md, K12); `None` if the
    /// solid has no bounds.
    pub bounds: Option<Aabb>,
    /// The largest coordinate of the box or of a shift on the way to an operand; infinite
    /// without a box.
    size: f64,
    /// χ of docs/numerics/csg.md, K3: how many times a rounding of a coordinate counts in an
    /// operand's space, over the operand's least extent; the greatest of all operands. 0
    /// with a single frame.
    pub roughness: f64,
    /// By frame.
    placements: Vec<PlacementBounds>,
    /// The normals of [`PreparedCsg::unit_normals`], and by operand where its own end.
    normals: (Vec<DVec3>, Vec<usize>),
    /// The coefficients of [`PreparedCsg::farthest_event`].
    event: [f64; 2],
    /// By operand, of a solid with a tolerance: see [`PreparedCsg::tolerance`].
    tolerances: Vec<ToleranceBounds>,
}

/// How lanes widen the bounds of an operand's boundaries for the solid's tolerance
/// (docs/numerics/csg.md, K17).
#[derive(Clone, Copy, Debug)]
pub struct ToleranceBounds {
    /// The factor of a curved surface's or a box's bound, times the lanes' unit roundoff.
    pub factor: f64,
    /// What the bound of a plane grows by, times the rate at which the ray leaves it.
    pub plane: f64,
}

/// Bounds on how far boundaries of operands in one frame may lie off. A pair [a, b] stands
/// for a·s + b, where s is the largest coordinate of the ray's start.
#[derive(Clone, Copy, Debug)]
struct PlacementBounds {
    /// The bound of a plane, times the rate at which the ray leaves it: see
    /// [`PreparedCsg::placement_per_reach`].
    plane: [f64; 2],
    /// The bound of any surface: see [`PreparedCsg::astray`].
    surface: [f64; 2],
    /// The frame's share of [`PreparedCsg::farthest_event`].
    event: [f64; 2],
}

/// The roundings that coordinates carry in a frame, 16 of 2⁻⁵²: those of the composed
/// matrix, of the object ray and of the surface's own numbers (docs/SPEC.md, S49).
pub const PLACEMENT: f64 = 16.0 * f64::EPSILON;

/// The least rate that counts, as a part of the ray's speed (docs/SPEC.md, S48). It limits
/// how far apart two boundaries of one event may be where the ray nearly runs along a
/// surface.
pub const SLOWEST: f64 = 1.0 / (1_u64 << 26) as f64;

impl PlacementBounds {
    /// Bounds the operands in `frame` of a solid whose largest coordinate is `size`
    /// (docs/numerics/csg.md, K4, K5 and K7).
    fn bound(frame: &Frame, size: f64) -> PlacementBounds {
        let (to, from) = (&frame.operand_from_solid, &frame.solid_from_operand);
        let (to_norm, from_norm) = (to.norm(), from.norm());
        let moved = DVec3::from_array(to.translation).abs().max_element();
        // K4: twice the 32 roundings of the placement.
        let unit = 2.0 * 32.0 * UNIT * to_norm;
        let share = unit * from_norm * to_norm;
        let rest = unit * (from_norm * moved + frame.reach);
        // K5: half the placement, and 0.01 for the roundings here.
        let roundings = to.stretch() * (0.51 * PLACEMENT);
        let fixed = from_norm * (to_norm * size + moved) + frame.reach;
        // K7: the placements of two boundaries, and twice for the roundings here.
        let slowest = 4.0 * PLACEMENT / SLOWEST;
        PlacementBounds {
            plane: [share, share * size + rest],
            surface: [roundings * from_norm * to_norm, roundings * fixed],
            event: [slowest * from_norm * to_norm, slowest * fixed],
        }
    }
}

impl PreparedCsg {
    /// Prepares the CSG solid `id`, which is the shape `shape`.
    pub fn prepare(
        tables: &Tables,
        shape: ShapeId,
        id: CsgId,
        trees: &mut MeshCrossingTrees,
    ) -> PreparedCsg {
        PreparedCsg::prepare_solid(tables, shape, CsgSolid::of(tables, id), trees)
    }

    /// Prepares the CSG solids that instances place, by row. Solids that are only operands
    /// need no preparation of their own.
    pub(super) fn placed(scene: &Tables, instances: &Instances) -> Vec<Option<PreparedCsg>> {
        let appears = instances.of_shapes(scene);
        let mut solids = vec![None; scene.csg.len()];
        let mut trees = MeshCrossingTrees::default();
        for (row, (shape, times)) in (0..).zip(scene.shapes.rows.iter().zip(appears)) {
            if let (Shape::Csg(id), 1..) = (shape, times) {
                let solid = PreparedCsg::prepare(scene, ShapeId(row), *id, &mut trees);
                solids[id.index()] = Some(solid);
            }
        }
        solids
    }

    /// Prepares a solid of one operand: a shape that has an inside and is no CSG solid.
    pub fn prepare_single(tables: &Tables, shape: ShapeId) -> PreparedCsg {
        let solid = CsgSolid::of_one(tables, shape);
        PreparedCsg::prepare_solid(tables, shape, solid, &mut MeshCrossingTrees::default())
    }

    fn prepare_solid(
        tables: &Tables,
        shape: ShapeId,
        solid: CsgSolid,
        trees: &mut MeshCrossingTrees,
    ) -> PreparedCsg {
        let mut meshes: Vec<MeshId> = solid.operands.iter().filter_map(mesh_of).collect();
        meshes.sort_unstable();
        meshes.dedup();
        let meshes = meshes.into_iter();
        let meshes = meshes.map(|id| (id, MeshCrossings::shared(trees, tables, id)));
        let own = shape_bounds(tables, shape).map(|b| b.grown(DVec3::splat(room(&b))));
        let (mut always, mut boxes, mut bounded) = (Vec::new(), Vec::new(), Vec::new());
        for (number, operand) in (0_u32..).zip(&solid.operands) {
            match (operand.bounds, own) {
                (None, _) => always.push(number),
                (Some(b), own) => {
                    let part =
                        own.map_or(b, |own| Aabb::new(b.min.max(own.min), b.max.min(own.max)));
                    // An operand in a frame of its own may be one event with the solid although
                    // its box lies outside, as far as rays are rounded; boxes are padded by that.
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
        let conditions = solid.frames.iter().map(|frame| frame.condition);
        let condition = conditions.fold(1.0, f64::max);
        if bounded.len() > FEW && condition <= MAX_CONDITION {
            let (built, order) = build(&boxes, &Bvh4Quality::default());
            let row = |i: &u32| (bounded[*i as usize], boxes[*i as usize]);
            tree = Some((built, order.iter().map(row).collect()));
        } else {
            always.extend(bounded);
            always.sort_unstable();
        }
        let frames = solid.frames.iter().map(|frame| frame.reach);
        let size = frames.fold(own.map_or(f64::INFINITY, |b| b.max_abs()), f64::max);
        let placement = |frame| PlacementBounds::bound(frame, size);
        let placements: Vec<PlacementBounds> = solid.frames.iter().map(placement).collect();
        let mut event = match &placements[..] {
            [_] => [0.0; 2],
            all => [0, 1].map(|i| all.iter().fold(0.0, |most, p| f64::max(most, p.event[i]))),
        };
        // K17: twice for the roundings here.
        event[1] += 2.0 * solid.tolerance / SLOWEST;
        let roughness = roughness(tables, &solid);
        let normals = match roughness == 0.0 && solid.tolerance == 0.0 {
            true => Default::default(),
            false => unit_normals(tables, &solid),
        };
        let tolerances = match solid.tolerance > 0.0 {
            true => tolerances(tables, &solid),
            false => Vec::new(),
        };
        PreparedCsg {
            bounds: own,
            size,
            normals,
            placements,
            event,
            tolerances,
            roughness,
            coincident_faces: CoincidentFaces::find(tables, &solid),
            meshes: meshes.collect(),
            solid,
            condition,
            always,
            tree,
        }
    }

    /// Returns the factor, less 1, by which lanes widen the bounds of boundaries, so that
    /// boundaries of different frames overlap if they are one event (docs/numerics/csg.md,
    /// K3); 0 with a single frame. A boundary's bound is at least 2.5 roundings of the
    /// operand's least extent, over the rate at which the ray leaves its surface. Its
    /// placement is 32 roundings 2⁻⁵² of coordinates that count `roughness` times in that
    /// extent, taken twice. Planes may be known better beside a corner or near the start;
    /// [`PreparedCsg::placement_per_reach`] is for them.
    ///
    /// `reach` is the largest coordinate of the ray's start in the solid's space, and `unit`
    /// is the lanes' unit roundoff.
    pub fn widening(&self, reach: f64, unit: f64) -> f64 {
        let [share, more] = self.widening_per_reach(unit);
        reach * share + more
    }

    /// Returns how far apart, in t, boundaries of different frames may be and still be one
    /// event: two placements over the least rate (docs/numerics/csg.md, K7). A boundary that
    /// far before a ray's start, or beyond its limit, may be one event with a boundary
    /// between these. Rays are in the solid's space; 0 with a single frame.
    #[inline]
    pub fn farthest_event<L: Lanes>(&self, org: &Vec3<L>, dir: &Vec3<L>) -> L {
        let [share, fixed] = self.event;
        if fixed == 0.0 {
            return L::zero();
        }
        (org.max_abs() * L::from_f64(share) + L::from_f64(fixed)) / dir.max_abs()
    }

    /// Returns [a, b], by which the boundary of a plane is widened: (a·reach + b) over the
    /// rate at which the ray leaves the plane in the operand's space (docs/numerics/csg.md,
    /// K4). `reach` is that of [`PreparedCsg::widening`].
    #[inline]
    pub fn placement_per_reach(&self, frame: u32) -> [f64; 2] {
        self.placements[frame as usize].plane
    }

    /// Returns how lanes widen the bounds of an operand's boundaries for the solid's tolerance;
    /// `None` if it has none.
    #[inline]
    pub fn tolerance(&self, operand: u32) -> Option<ToleranceBounds> {
        self.tolerances.get(operand as usize).copied()
    }

    /// Says whether the solid has a tolerance that lanes do not know how to widen the bounds of
    /// its operands by, as those of polynomials.
    pub fn is_beyond_lanes(&self) -> bool {
        let apart = |operand: &CsgOperand| operand.shape.blur() == Blur::Apart;
        self.solid.tolerance > 0.0 && self.solid.operands.iter().any(apart)
    }

    /// Returns the unit normals of an operand that planes bound, in its own space. The solid
    /// must have several frames, or a tolerance.
    #[inline]
    pub fn unit_normals(&self, operand: u32) -> &[DVec3] {
        let (normals, ends) = &self.normals;
        let before = operand.checked_sub(1).map_or(0, |row| ends[row as usize]);
        &normals[before..ends[operand as usize]]
    }

    /// Returns [a, b], with which [`PreparedCsg::widening`] is a·reach + b.
    pub fn widening_per_reach(&self, unit: f64) -> [f64; 2] {
        if self.roughness == 0.0 {
            return [0.0; 2];
        }
        // K3: twice the 32 roundings of the placement, over the 2.5 of the bound.
        let share = self.roughness * (2.0 * 32.0 / 2.5 * UNIT / unit);
        [share, share * self.size]
    }

    /// Returns the box in the solid's space outside of which an operand does not matter, and
    /// how many times a rounding of a ray counts there; `None` if there is no such box.
    #[inline]
    pub fn box_around(&self, operand: &CsgOperand) -> Option<(Aabb, f64)> {
        let frame = &self.solid.frames[operand.frame as usize];
        let own = operand.bounds.map(|b| (b, frame.condition));
        // An unbounded operand matters only inside the solid's box, where other operands'
        // frames count.
        own.or(self.bounds.map(|b| (b, self.condition)))
    }

    /// Returns the triangle tree of a mesh that is an operand.
    #[inline]
    pub fn mesh_crossings(&self, id: MeshId) -> &MeshCrossings {
        let row = self.meshes.binary_search_by_key(&id, |row| row.0);
        &self.meshes[row.expect("the mesh is an operand")].1
    }

    /// Returns the bytes of the triangle trees of all operands, each counted once.
    pub(super) fn mesh_bytes<'c>(all: impl Iterator<Item = &'c PreparedCsg>) -> usize {
        let trees: MeshCrossingTrees = all.flat_map(|one| one.meshes.iter().cloned()).collect();
        trees.values().map(|mesh| mesh.bytes()).sum()
    }

    /// Returns how far off, in the operand's space, a surface in a frame may lie beside
    /// surfaces of other frames: half its placement, because the bound of a root grows by
    /// four times this (docs/numerics/csg.md, K5). `start` is the largest coordinate of the
    /// ray's start.
    #[inline]
    pub fn astray<L: Lanes>(&self, frame: u32, start: L) -> L {
        let [share, fixed] = self.placements[frame as usize].surface;
        start * L::from_f64(share) + L::from_f64(fixed)
    }

    /// Returns the bytes without the triangle trees, which CSG solids share.
    pub fn bytes(&self) -> usize {
        let tree = self.tree.iter();
        self.solid.bytes()
            + self.coincident_faces.bytes()
            + self.always.len() * 4
            + size_of_val(&self.placements[..])
            + tree
                .map(|(t, operands)| t.bytes() + size_of_val(&operands[..]))
                .sum::<usize>()
    }

    /// Finds the numbers of all operands that some ray may be in between `t_min` and its
    /// limit, ascending. Rays are in the solid's space; the limit of a lane that is done is
    /// −∞.
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
        let Some((tree, operands)) = &self.tree else {
            return;
        };
        let slabs = Slabs::new(org, dir, &tree.bounds());
        tree.leaves_along(&slabs, (t_min, limit), |first, count| {
            for (number, own) in &operands[first..first + count] {
                let (enter, exit) = slabs.interval(own.min, own.max);
                if count == 1 || enter.max(t_min).le(exit.min(limit)).any() {
                    found.push(*number);
                }
            }
        });
        found.sort_unstable();
    }

    /// Finds the operands as [`PreparedCsg::operands_along`] does, and packs each number above
    /// the 32-bit row of its box, for [`PreparedCsg::part_of`]. `fast` needs the boxes: it
    /// has no error bounds, so a lane's answer must not depend on the operands that other
    /// lanes ask for, nor on its limit (docs/numerics/csg.md, K16).
    ///
    /// This is a walk of its own, because one walk with a closure made pictures in
    /// `guarded`, which needs no boxes, take 3 to 6 % longer.
    #[inline(never)]
    pub fn operands_in_boxes<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        found: &mut Vec<u64>,
    ) {
        let pack = |number: u32, row: u32| u64::from(number) << 32 | u64::from(row);
        found.clear();
        found.extend(self.always.iter().map(|number| pack(*number, NO_BOX)));
        let Some((tree, operands)) = &self.tree else {
            return;
        };
        tree.leaves_along(slabs, (t_min, limit), |first, count| {
            for (row, (number, own)) in (first..).zip(&operands[first..first + count]) {
                let (enter, exit) = slabs.interval(own.min, own.max);
                if enter.max(t_min).le(exit.min(limit)).any() {
                    found.push(pack(*number, row as u32));
                }
            }
        });
        found.sort_unstable();
    }

    /// Makes the slab constants of rays in the solid's space for the boxes of the tree.
    #[inline(always)]
    pub fn slabs<L: Lanes>(&self, org: Vec3<L>, dir: Vec3<L>) -> Slabs<L> {
        match &self.tree {
            Some((tree, _)) => Slabs::new(org, dir, &tree.bounds()),
            None => Slabs::open(),
        }
    }

    /// Returns the lanes that reach the box of an operand that
    /// [`PreparedCsg::operands_in_boxes`] found, beyond `t_min`, and the t at which they enter
    /// it; all lanes and −∞ if the operand has no box.
    #[inline(always)]
    pub fn part_of<L: Lanes>(&self, found: u64, slabs: &Slabs<L>, t_min: L) -> (L::Mask, L) {
        match &self.tree {
            Some((_, operands)) if found as u32 != NO_BOX => {
                let own = &operands[found as u32 as usize].1;
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

/// Returns the room for roundings of f64 coordinates, 64 of 2⁻⁵² (docs/numerics/csg.md,
/// K12).
fn room(bounds: &Aabb) -> f64 {
    bounds.max_abs() * (64.0 * f64::EPSILON)
}

/// Bounds the slack of a solid's tolerance at boundaries of its operands. A boundary's bound is at
/// least 2.5 roundings of the operand's least extent over the rate (K3), so the tolerance over the
/// rate is at most a multiple of it (docs/numerics/csg.md, K17).
fn tolerances(tables: &Tables, solid: &CsgSolid) -> Vec<ToleranceBounds> {
    let of = |operand: &CsgOperand| {
        let frame = &solid.frames[operand.frame as usize];
        // A part in a hundred for the roundings of the stretch and of what follows.
        let plane = 1.01 * solid.tolerance * frame.operand_from_solid.stretch();
        let factor = tables
            .thickness(operand.id)
            .map_or(0.0, |thin| plane / (2.5 * thin));
        ToleranceBounds { factor, plane }
    };
    solid.operands.iter().map(of).collect()
}

/// Returns the unit normals of all operands, and by operand where its own end.
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

/// Returns the roughness χ of a solid (docs/numerics/csg.md, K3).
fn roughness(tables: &Tables, solid: &CsgSolid) -> f64 {
    if solid.frames.len() == 1 {
        return 0.0;
    }
    let of = |operand: &CsgOperand| {
        let frame = &solid.frames[operand.frame as usize];
        // Quadrics and polynomials have no thickness; their surfaces are bounded by K5.
        let thin = tables.thickness(operand.id)?;
        let scale = frame.operand_from_solid.norm();
        Some(frame.solid_from_operand.norm() * scale * scale / thin)
    };
    let all = solid.operands.iter().filter_map(of);
    all.fold(f64::MIN_POSITIVE, f64::max)
}
