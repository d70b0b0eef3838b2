//! What a combination unfolds into: one program over shapes that are none.
//!
//! Derived from the tables; never in them. Nothing recurses: operators may lie in
//! each other a hundred thousand deep.

use super::ids::{CombinationId, MaterialId, ShapeId};
use super::shapes::Shape;
use super::{Operand, Tables, shape_bounds};
use crate::csg::{Builder, Operator, Place, Program};
use crate::math::{Aabb, Affine};
use glam::DVec3;
use std::collections::HashMap;

/// Operands of one combination, at most, once unfolded.
pub const MAX_OPERANDS: u64 = 1 << 20;

/// A space that operands are in. Those that are placed alike share one: there,
/// what coincides does so exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The operand's ray is this times the solid's, by definition.
    pub operand_from_solid: Affine,
    pub solid_from_operand: Affine,
    /// The largest shift on the way from the one to the other, in the solid's
    /// units: maps are known to roundings of it, though they may cancel.
    pub reach: f64,
    /// How many times a rounding in the one space counts in the other.
    pub condition: f64,
}

/// A shape that is no combination, as part of one.
#[derive(Clone, Copy, Debug)]
pub struct CsgOperand {
    pub shape: Shape,
    pub id: ShapeId,
    /// Row of [`CsgSolid::frames`]; 0 is the solid's own space.
    pub frame: u32,
    pub material: Option<MaterialId>,
    /// In the solid's space; `None` where it has no bounds.
    pub bounds: Option<Aabb>,
}

#[derive(Clone, Debug)]
pub struct CsgSolid {
    pub program: Program,
    /// In the order of the file, depth first: the numbers of surfaces.
    pub operands: Vec<CsgOperand>,
    pub frames: Vec<Frame>,
    pub tolerance: f64,
}

impl CsgSolid {
    /// Of checked tables.
    pub fn of(tables: &Tables, id: CombinationId) -> CsgSolid {
        let mut unfold = Unfold::new(tables);
        unfold.run(id);
        CsgSolid {
            program: unfold.builder.finish(),
            operands: unfold.operands,
            frames: unfold.frames,
            tolerance: tables.combinations.tolerance[id.index()],
        }
    }

    /// Boundaries are one where they are equal, and nowhere else.
    pub fn is_exact(&self) -> bool {
        self.frames.len() == 1 && self.tolerance == 0.0
    }

    pub fn bytes(&self) -> usize {
        self.program.bytes()
            + self.operands.len() * size_of::<CsgOperand>()
            + self.frames.len() * size_of::<Frame>()
    }
}

/// How operands, once unfolded, every combination has; saturating. `order`: its
/// operands first.
pub(super) fn unfolded_counts(tables: &Tables, order: &[u32]) -> Vec<u64> {
    let table = &tables.combinations;
    let mut counts = vec![0_u64; table.len()];
    for row in order {
        let operands = table.operands(CombinationId(*row)).iter();
        let of = |operand: &Operand| match tables.shapes.row(operand.shape) {
            Shape::Combination(id) => counts[id.index()],
            _ => 1,
        };
        counts[*row as usize] = operands.map(of).fold(0, u64::saturating_add);
    }
    counts
}

/// A shape that waits to be unfolded.
struct Waiting {
    shape: ShapeId,
    place: Place,
    frame: u32,
    material: Option<MaterialId>,
    /// A combination above has said what its surfaces are made of.
    settled: bool,
}

struct Unfold<'t> {
    tables: &'t Tables,
    builder: Builder,
    operands: Vec<CsgOperand>,
    frames: Vec<Frame>,
    /// Frames by their entries, rounded.
    known: HashMap<Key, u32>,
    waiting: Vec<Waiting>,
}

impl<'t> Unfold<'t> {
    fn new(tables: &'t Tables) -> Unfold<'t> {
        let own = Frame {
            operand_from_solid: Affine::IDENTITY,
            solid_from_operand: Affine::IDENTITY,
            reach: 0.0,
            condition: 1.0,
        };
        Unfold {
            tables,
            builder: Builder::default(),
            operands: Vec::new(),
            frames: vec![own],
            known: HashMap::from([(rounded(&Affine::IDENTITY, 0.0), 0)]),
            waiting: Vec::new(),
        }
    }

    fn run(&mut self, id: CombinationId) {
        let answer = self.builder.answer();
        self.operator(id, answer, 0, None, false);
        while let Some(next) = self.waiting.pop() {
            let Waiting {
                shape,
                place,
                frame,
                material,
                settled,
            } = next;
            match self.tables.shapes.row(shape) {
                Shape::Combination(id) => self.operator(id, place, frame, material, settled),
                leaf => {
                    self.builder.operand(place);
                    let bounds = self.bounds(shape, frame);
                    self.operands.push(CsgOperand {
                        shape: leaf,
                        id: shape,
                        frame,
                        material,
                        bounds,
                    });
                }
            }
        }
    }

    fn operator(
        &mut self,
        id: CombinationId,
        place: Place,
        frame: u32,
        material: Option<MaterialId>,
        settled: bool,
    ) {
        let table = &self.tables.combinations;
        let operator = table.operator[id.index()];
        let own = table.material[id.index()];
        let (material, settled) = match own {
            Some(_) if !settled => (own, true),
            _ => (material, settled),
        };
        let [first, others] = self.builder.operator(operator, place);
        let operands = table.operands(id);
        for (i, operand) in operands.iter().enumerate().rev() {
            let frame = self.frame(frame, operand);
            let nearest = if settled { None } else { operand.material };
            self.waiting.push(Waiting {
                shape: operand.shape,
                place: if i == 0 { first } else { others },
                frame,
                material: nearest.or(material),
                settled,
            });
        }
    }

    fn frame(&mut self, above: u32, operand: &Operand) -> u32 {
        let transforms = &self.tables.transforms;
        let row = operand.transform.index();
        let local = &transforms.local[row];
        let Some(inverse) = transforms.inverse[row].filter(|_| !local.is_identity()) else {
            return above;
        };
        let above = self.frames[above as usize];
        let solid_from_operand = above.solid_from_operand.then_after(local);
        let largest = |shift: &[f64; 3]| shift.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let shift = above.solid_from_operand.norm() * largest(&local.translation);
        let operand_from_solid = inverse.then_after(&above.operand_from_solid);
        let frame = Frame {
            operand_from_solid,
            solid_from_operand,
            condition: operand_from_solid.norm() * solid_from_operand.norm(),
            reach: above
                .reach
                .max(shift)
                .max(largest(&solid_from_operand.translation)),
        };
        let next = self.frames.len() as u32;
        let row = *self
            .known
            .entry(rounded(&frame.solid_from_operand, frame.reach))
            .or_insert(next);
        if row == next {
            self.frames.push(frame);
        }
        row
    }

    fn bounds(&self, shape: ShapeId, frame: u32) -> Option<Aabb> {
        let own = shape_bounds(self.tables, shape)?;
        if frame == 0 {
            return Some(own);
        }
        let frame = &self.frames[frame as usize];
        let bounds = placed(&own, &frame.solid_from_operand);
        // The maps are each other's inverse but for their roundings.
        let size = (bounds.max_abs() + frame.reach) * frame.condition;
        Some(bounds.grown(DVec3::splat(size * (16.0 * f64::EPSILON))))
    }
}

/// What of maps counts where they are compared: entries in units, and the units'
/// powers of two, of the linear part and of the shift.
type Key = ([i64; 12], [i32; 2]);

/// A map's entries to one part in 2^44 of its linear part's largest, and of the
/// largest shift on the way: a turn and a turn back are no turn.
fn rounded(map: &Affine, reach: f64) -> Key {
    let size = |x: &[f64]| x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let power = |size: f64| {
        let power = libm::log2(size * std::f64::consts::SQRT_2);
        if size > 0.0 {
            power.floor() as i32 - 44
        } else {
            0
        }
    };
    let parts = |x: f64, power: i32| libm::scalbn(x, -power).round() as i64;
    let linear = map.linear.as_flattened();
    let mut powers = [size(linear), size(&map.translation).max(reach)].map(power);
    let shift = map.translation.map(|x| parts(x, powers[1]));
    if shift == [0; 3] {
        powers[1] = 0;
    }
    let entry = |i: usize| match linear.get(i) {
        Some(x) => parts(*x, powers[0]),
        None => shift[i - 9],
    };
    (std::array::from_fn(entry), powers)
}

/// The box around a box under a map, with room for its roundings.
pub(super) fn placed(own: &Aabb, map: &Affine) -> Aabb {
    if own.is_empty() {
        return Aabb::EMPTY;
    }
    let place = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
    let bounds = Aabb::of_points(own.corners().map(place));
    let size = map.norm() * own.max_abs() + bounds.max_abs();
    bounds.grown(DVec3::splat(size * (16.0 * f64::EPSILON)))
}

/// Combinations, each after its operands; or a cycle, first row repeated.
pub(crate) fn operands_first(tables: &Tables) -> Result<Vec<u32>, Vec<u32>> {
    let table = &tables.combinations;
    let mut state = vec![0_u8; table.len()];
    let mut order = Vec::with_capacity(table.len());
    let mut stack: Vec<(u32, usize)> = Vec::new();
    for start in 0..table.len() as u32 {
        if state[start as usize] != 0 {
            continue;
        }
        state[start as usize] = 1;
        stack.push((start, 0));
        while let Some((row, next)) = stack.last_mut() {
            let Some(operand) = table.operands(CombinationId(*row)).get(*next) else {
                state[*row as usize] = 2;
                order.push(*row);
                stack.pop();
                continue;
            };
            *next += 1;
            let Shape::Combination(below) = tables.shapes.row(operand.shape) else {
                continue;
            };
            match state[below.index()] {
                0 => {
                    state[below.index()] = 1;
                    stack.push((below.0, 0));
                }
                1 => {
                    let from = stack.iter().position(|(r, _)| *r == below.0).unwrap_or(0);
                    let path = stack[from..].iter().map(|(r, _)| *r);
                    return Err(path.chain([below.0]).collect());
                }
                _ => {}
            }
        }
    }
    Ok(order)
}

/// The box around an operand, in the space of the combination that it is one of.
pub(crate) fn operand_bounds(tables: &Tables, operand: &Operand) -> Option<Aabb> {
    let local = &tables.transforms.local[operand.transform.index()];
    match shape_bounds(tables, operand.shape) {
        Some(own) if !local.is_identity() => Some(placed(&own, local)),
        own => own,
    }
}

/// Boxes of all combinations; `None` of those without bounds. `order`: operands
/// first.
pub(super) fn combination_bounds(tables: &Tables, order: &[u32]) -> Vec<Option<Aabb>> {
    let table = &tables.combinations;
    let mut extents = vec![Extent::default(); table.len()];
    for row in order {
        let id = CombinationId(*row);
        let of = |operand: &Operand| match tables.shapes.row(operand.shape) {
            Shape::Combination(below) => extents[below.index()].through(tables, operand),
            _ => Extent {
                bounds: shape_bounds(tables, operand.shape),
                ..Extent::default()
            }
            .through(tables, operand),
        };
        let all: Vec<Extent> = table.operands(id).iter().map(of).collect();
        let mut boxes = all.iter().map(|extent| extent.bounds);
        let bounds = match table.operator[id.index()] {
            Operator::Union | Operator::Xor => {
                boxes.try_fold(Aabb::EMPTY, |b, one| Some(b.union(&one?)))
            }
            Operator::Difference => boxes.next().flatten(),
            Operator::Intersection => boxes.flatten().reduce(|a, b| overlap(&a, &b)),
            Operator::Complement => None,
        };
        let greatest = |of: fn(&Extent) -> f64| all.iter().map(of).fold(0.0, f64::max);
        extents[*row as usize] = Extent {
            bounds,
            condition: greatest(|extent| extent.condition),
            reach: greatest(|extent| extent.reach),
        };
    }
    extents.iter().map(|extent| extent.bounds).collect()
}

/// Where a combination lies, and how the maps below it blur that: as of frames.
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Option<Aabb>,
    condition: f64,
    reach: f64,
}

impl Default for Extent {
    fn default() -> Extent {
        Extent {
            bounds: None,
            condition: 1.0,
            reach: 0.0,
        }
    }
}

impl Extent {
    /// With room for the roundings of rays that are met below.
    fn through(self, tables: &Tables, operand: &Operand) -> Extent {
        let row = operand.transform.index();
        let (local, inverse) = (
            &tables.transforms.local[row],
            &tables.transforms.inverse[row],
        );
        let Some(inverse) = inverse.filter(|_| !local.is_identity()) else {
            return self;
        };
        let shift = DVec3::from_array(local.translation).abs().max_element();
        let condition = self.condition * local.norm() * inverse.norm();
        let reach = shift + local.norm() * self.reach;
        let bounds = self.bounds.map(|own| {
            let bounds = placed(&own, local);
            let size = bounds.max_abs() + reach;
            bounds.grown(DVec3::splat(size * condition * (16.0 * f64::EPSILON)))
        });
        Extent {
            bounds,
            condition,
            reach,
        }
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> Aabb {
    let both = Aabb {
        min: a.min.max(b.min),
        max: a.max.min(b.max),
    };
    if both.min.cmple(both.max).all() {
        both
    } else {
        // Nothing is there; but a box it must be.
        Aabb::of_points([a.center()])
    }
}
