//! A combination ready to be met: unfolded, and a tree over its operands.
//!
//! Outside its own box nothing of a solid counts, so operands are known by the
//! parts of their boxes inside, and those with none are left out: without them a
//! program is false there too, because a box is derived from its operands' boxes
//! alone.

use super::Index;
use super::bvh::{Stack, Tree};
use super::sah::{Quality, build};
use super::slabs::Slabs;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Aabb, Vec3};
use crate::scene::{CombinationId, CsgSolid, Shape, ShapeId, Tables, shape_bounds};
use glam::DVec3;

/// With no more operands than this a tree does not pay.
const FEW: usize = 12;

/// Frames of a greater condition have no tree.
const WILD: f64 = 8.0;

#[derive(Clone, Debug)]
pub struct Combined {
    pub solid: CsgSolid,
    /// Operands that every ray has to ask.
    always: Vec<u32>,
    /// Over the others, if they are many.
    tree: Option<(Tree, Vec<u32>)>,
    /// The largest coordinate of its box, infinite of one without, or of a shift on
    /// the way to an operand.
    size: f64,
    /// The most that a coordinate's rounding by the frames counts, over the least
    /// extent of the operand: see [`crate::trace`].
    pub roughness: f64,
}

impl Combined {
    /// `shape`: the combination's own.
    pub fn of(tables: &Tables, shape: ShapeId, id: CombinationId) -> Combined {
        let solid = CsgSolid::of(tables, id);
        let own = shape_bounds(tables, shape).map(|b| b.grown(DVec3::splat(room(&b))));
        let (mut always, mut boxes, mut bounded) = (Vec::new(), Vec::new(), Vec::new());
        for (number, operand) in (0_u32..).zip(&solid.operands) {
            match (operand.bounds, own) {
                (None, _) => always.push(number),
                (Some(b), own) => {
                    let part =
                        own.map_or(b, |own| Aabb::new(b.min.max(own.min), b.max.min(own.max)));
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
        let wild = solid
            .frames
            .iter()
            .any(|frame| frame.operand_from_solid.norm() * frame.solid_from_operand.norm() > WILD);
        if bounded.len() > FEW && !wild {
            let (built, order) = build(&boxes, &Quality::default());
            let order = order.iter().map(|i| bounded[*i as usize]).collect();
            tree = Some((built, order));
        } else {
            always.extend(bounded);
            always.sort_unstable();
        }
        let frames = solid.frames.iter().map(|frame| frame.reach);
        Combined {
            size: frames.fold(own.map_or(f64::INFINITY, |b| b.max_abs()), f64::max),
            roughness: roughness(tables, &solid),
            solid,
            always,
            tree,
        }
    }

    pub fn size(&self) -> f64 {
        self.size
    }

    /// How far off, in an operand's space, its surface may be beside those of other
    /// frames, for rays from `start`: half of what the definition of placement says, for
    /// the bound of a root grows by four times that.
    pub fn astray<L: Lanes>(&self, frame: u32, start: L) -> L {
        let frame = &self.solid.frames[frame as usize];
        let (to, from) = (&frame.operand_from_solid, &frame.solid_from_operand);
        let (to_norm, from_norm) = (to.norm(), from.norm());
        let moved = DVec3::from_array(to.translation).abs().max_element();
        let fixed = from_norm * (to_norm * self.size + moved) + frame.reach;
        let roundings = to.stretch() * (0.51 * 16.0 * f64::EPSILON);
        start * L::from_f64(roundings * from_norm * to_norm) + L::from_f64(roundings * fixed)
    }

    pub fn bytes(&self) -> usize {
        let tree = self.tree.iter();
        self.solid.bytes()
            + self.always.len() * 4
            + tree
                .map(|(t, order)| t.bytes() + order.len() * 4)
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
        let Some((tree, order)) = &self.tree else {
            return;
        };
        let slabs = Slabs::new(org, dir, &tree.bounds());
        tree.walk(
            &slabs,
            t_min,
            limit,
            &mut Stack::default(),
            &(),
            |first, count, active, _| {
                if active.any() {
                    found.extend_from_slice(&order[first..first + count]);
                }
                limit
            },
        );
        found.sort_unstable();
        found.dedup();
    }
}

/// For the rounding of f64 coordinates.
fn room(bounds: &Aabb) -> f64 {
    bounds.max_abs() * (64.0 * f64::EPSILON)
}

fn roughness(tables: &Tables, solid: &CsgSolid) -> f64 {
    if solid.frames.len() == 1 {
        return 0.0;
    }
    // Of quadrics it is known apart.
    let others = solid
        .operands
        .iter()
        .filter(|operand| !matches!(operand.shape, Shape::Quadric(_)));
    let of = |operand: &crate::scene::CsgOperand| {
        let frame = &solid.frames[operand.frame as usize];
        let thin = shape_bounds(tables, operand.id).map_or(1.0, |b| b.extent().min_element());
        let scale = frame.operand_from_solid.norm();
        frame.solid_from_operand.norm() * scale * scale / thin
    };
    others.map(of).fold(f64::MIN_POSITIVE, f64::max)
}
