//! CSG solids, unfolded: one program over operands that are no CSG solids themselves.
//!
//! The unfolded solid is derived from the scene's tables and never stored in them. Nothing
//! recurses, because operators may be nested a hundred thousand deep.

use super::ids::{CsgId, MaterialId, ShapeId};
use super::primitives::{shape_bounds, shape_center};
use super::shapes::Shape;
use super::{Operand, Tables};
use crate::csg::{Builder, Operator, Place, Program};
use crate::math::{Aabb, Affine};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;

/// The most operands of one unfolded CSG solid, and of all that are placed, at some 150 bytes
/// each.
pub const MAX_OPERANDS: u64 = 1 << 20;

/// The most surfaces of its operands; each triangle of a mesh is one (docs/SPEC.md, S45).
pub const MAX_SURFACES: u64 = 1 << 31;

/// A space that operands with equal maps share (S40). In one frame, coincident faces
/// coincide exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The matrix that makes the operand's ray from the solid's, by definition (S39).
    pub operand_from_solid: Affine,
    pub solid_from_operand: Affine,
    /// The largest shift on the way between the two spaces, in the solid's units. Maps are
    /// known to roundings of it, even where shifts cancel.
    pub reach: f64,
    /// The condition of the map: how many times a rounding in one space counts in the
    /// other.
    pub condition: f64,
}

/// An operand of an unfolded CSG solid.
#[derive(Clone, Copy, Debug)]
pub struct CsgOperand {
    pub shape: Shape,
    pub id: ShapeId,
    /// The row of [`CsgSolid::frames`]; 0 is the solid's own space.
    pub frame: u32,
    pub material: Option<MaterialId>,
    /// The box in the solid's space; `None` if the operand has no bounds.
    pub bounds: Option<Aabb>,
}

/// An unfolded CSG solid.
#[derive(Clone, Debug)]
pub struct CsgSolid {
    pub program: Program,
    /// The operands in the order of the file, depth first (S38).
    pub operands: Vec<CsgOperand>,
    /// Per operand: the number of its first surface; empty if each operand has one surface.
    firsts: Vec<u32>,
    pub frames: Vec<Frame>,
    pub tolerance: f64,
}

impl CsgSolid {
    /// Unfolds a CSG solid of checked tables.
    pub fn of(tables: &Tables, id: CsgId) -> CsgSolid {
        CsgSolid::with_steps(tables, id).0
    }

    /// Unfolds a CSG solid, and returns the steps as well, operators before their operands.
    pub(super) fn with_steps(tables: &Tables, id: CsgId) -> (CsgSolid, Vec<Step>) {
        let mut unfold = Unfold::new(tables);
        let answer = unfold.builder.answer();
        unfold.operator(id, answer, 0, None, false);
        unfold.finish(tables.csg.tolerance[id.index()])
    }

    /// Builds a solid of one operand: a shape that has an inside and is no CSG solid.
    pub fn of_one(tables: &Tables, shape: ShapeId) -> CsgSolid {
        let mut unfold = Unfold::new(tables);
        unfold.waiting.push(Waiting {
            shape,
            place: unfold.builder.answer(),
            frame: 0,
            material: None,
            settled: false,
        });
        unfold.finish(0.0).0
    }

    /// Says whether boundaries are one event only where their t are equal (S46).
    pub fn is_exact(&self) -> bool {
        self.frames.len() == 1 && self.tolerance == 0.0
    }

    /// Says whether some operands are meshes.
    #[inline]
    pub fn has_meshes(&self) -> bool {
        !self.firsts.is_empty()
    }

    /// Returns the surface number that hits carry, of an operand or of a triangle of a
    /// mesh.
    #[inline]
    pub fn surface(&self, operand: u32, triangle: u32) -> u32 {
        match self.firsts.get(operand as usize) {
            Some(first) => first + triangle,
            None => operand,
        }
    }

    /// Returns the operand of a surface, and the triangle of a mesh.
    #[inline]
    pub fn operand_of(&self, surface: u32) -> (u32, u32) {
        if self.firsts.is_empty() {
            return (surface, 0);
        }
        let operand = self.firsts.partition_point(|first| *first <= surface) - 1;
        (operand as u32, surface - self.firsts[operand])
    }

    pub fn bytes(&self) -> usize {
        self.program.bytes()
            + self.firsts.len() * size_of::<u32>()
            + self.operands.len() * size_of::<CsgOperand>()
            + self.frames.len() * size_of::<Frame>()
    }
}

/// Returns the number of surfaces of an operand.
pub(super) fn surfaces(tables: &Tables, shape: Shape) -> u32 {
    match shape {
        Shape::Mesh(id) => tables.meshes.triangles_of[id.index()].len() as u32,
        _ => 1,
    }
}

/// Counts the operands of every CSG solid once unfolded, each counted as `one` says and
/// each CSG solid as `own`; saturating. `order` lists operands before their solids.
pub(super) fn unfolded_counts(
    tables: &Tables,
    order: &[u32],
    own: u64,
    one: impl Fn(Shape) -> u64,
) -> Vec<u64> {
    let table = &tables.csg;
    let mut counts = vec![0_u64; table.len()];
    for row in order {
        let operands = table.operands(CsgId(*row)).iter();
        let of = |operand: &Operand| match tables.shapes.row(operand.shape) {
            Shape::Csg(id) => counts[id.index()],
            shape => one(shape),
        };
        counts[*row as usize] = operands.map(of).fold(own, u64::saturating_add);
    }
    counts
}

/// A step of the unfolded operators.
#[derive(Clone, Copy, Debug)]
pub(super) enum Step {
    /// An operator and its number of operands.
    Operator(Operator, u32),
    /// The next operand.
    Operand,
}

/// A shape that waits to be unfolded.
struct Waiting {
    shape: ShapeId,
    place: Place,
    frame: u32,
    material: Option<MaterialId>,
    /// Whether a CSG solid above has set the material of its surfaces.
    settled: bool,
}

struct Unfold<'t> {
    tables: &'t Tables,
    builder: Builder,
    operands: Vec<CsgOperand>,
    frames: Vec<Frame>,
    /// Frames by their rounded entries.
    known: HashMap<Key, u32>,
    waiting: Vec<Waiting>,
    steps: Vec<Step>,
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
            steps: Vec::new(),
        }
    }

    fn finish(mut self, tolerance: f64) -> (CsgSolid, Vec<Step>) {
        while let Some(next) = self.waiting.pop() {
            let Waiting {
                shape,
                place,
                frame,
                material,
                settled,
            } = next;
            match self.tables.shapes.row(shape) {
                Shape::Csg(id) => self.operator(id, place, frame, material, settled),
                leaf => {
                    self.steps.push(Step::Operand);
                    self.builder.operand(place);
                    let center = shape_center(self.tables, leaf);
                    let frame = self.about(frame, center);
                    let bounds = self.bounds(shape, frame, center);
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
        let solid = CsgSolid {
            program: self.builder.finish(),
            firsts: firsts(self.tables, &self.operands),
            operands: self.operands,
            frames: self.frames,
            tolerance,
        };
        (solid, self.steps)
    }

    fn operator(
        &mut self,
        id: CsgId,
        place: Place,
        frame: u32,
        material: Option<MaterialId>,
        settled: bool,
    ) {
        let table = &self.tables.csg;
        let operator = table.operator[id.index()];
        let own = table.material[id.index()];
        let (material, settled) = match own {
            Some(_) if !settled => (own, true),
            _ => (material, settled),
        };
        let [first, others] = self.builder.operator(operator, place);
        let operands = table.operands(id);
        let step = Step::Operator(operator, operands.len() as u32);
        self.steps.push(step);
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
        match &transforms.inverse[row] {
            Some(inverse) if !local.is_identity() => self.below(above, local, inverse),
            _ => above,
        }
    }

    /// Returns the frame about a mesh's centre.
    fn about(&mut self, frame: u32, center: DVec3) -> u32 {
        if center == DVec3::ZERO {
            return frame;
        }
        let by = |shift: DVec3| Affine::from(DAffine3::from_translation(shift));
        self.below(frame, &by(center), &by(-center))
    }

    fn below(&mut self, above: u32, local: &Affine, inverse: &Affine) -> u32 {
        let above = self.frames[above as usize];
        let solid_from_operand = above.solid_from_operand.then_after(local);
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

    fn bounds(&self, shape: ShapeId, frame: u32, center: DVec3) -> Option<Aabb> {
        let own = shape_bounds(self.tables, shape)?;
        // The maps may lead back to the solid's own space, and there to the mesh's centre;
        // the box has room for 4 roundings 2⁻⁵² of the centre (K12).
        let about = Aabb::new(own.min - center, own.max - center);
        let rounding = center.abs().max_element() * (4.0 * f64::EPSILON);
        let own = about.grown(DVec3::splat(rounding));
        if frame == 0 {
            return own.is_finite().then_some(own);
        }
        let frame = &self.frames[frame as usize];
        let bounds = own.placed(&frame.operand_from_solid, &frame.solid_from_operand)?;
        // Room for 16 roundings 2⁻⁵² of operands' rays (K12).
        let room = (bounds.max_abs() + frame.reach) * frame.condition * (16.0 * f64::EPSILON);
        let bounds = bounds.grown(DVec3::splat(room));
        bounds.is_finite().then_some(bounds)
    }
}

fn largest(shift: &[f64; 3]) -> f64 {
    shift.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
}

/// Returns the first surface of each operand. Their number is already checked.
fn firsts(tables: &Tables, operands: &[CsgOperand]) -> Vec<u32> {
    let is_mesh = |operand: &CsgOperand| matches!(operand.shape, Shape::Mesh(_));
    if !operands.iter().any(is_mesh) {
        return Vec::new();
    }
    let mut next = 0;
    let first = |operand: &CsgOperand| {
        let first = next;
        next += surfaces(tables, operand.shape);
        first
    };
    operands.iter().map(first).collect()
}

/// The part of a map that is compared: its entries in units, and the exponents of the units
/// of the linear part and of the shift.
type Key = ([i64; 12], [i32; 2]);

/// Rounds a map's entries to one part in 2⁴⁴ of the largest of the linear part, and of the
/// largest shift on the way (S40). So a rotation there and back is no rotation.
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
    let linear = map.linear().as_flattened();
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

/// Lists CSG solids, each after its operands; or returns a cycle, with its first row
/// repeated.
pub fn operands_first(tables: &Tables) -> Result<Vec<u32>, Vec<u32>> {
    let table = &tables.csg;
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
            let Some(operand) = table.operands(CsgId(*row)).get(*next) else {
                state[*row as usize] = 2;
                order.push(*row);
                stack.pop();
                continue;
            };
            *next += 1;
            let Shape::Csg(below) = tables.shapes.row(operand.shape) else {
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
