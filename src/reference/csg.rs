//! CSG solids along a whole line (docs/SPEC.md, S38 to S54; docs/numerics/oracle.md, O4).
//!
//! The ends of all operands are found and sorted, and ends at equal t are grouped. Between
//! groups the operators, evaluated one by one, say whether the line is in the solid.
//! [`CsgSolid`] defines what an operand is, in which frame and under which number;
//! operators are read from the scene's tables.

mod mesh;

use super::bounds::{self, Bounds};
use super::kinds::{self, Inside, rank};
use super::meet::Primitive;
use super::number::Number;
use super::ray::{Ray, dot};
use super::root::Root;
use super::slack::{self, Measured, Reach, Slack};
use super::solids::{Meeting, changes};
use super::tree::Tree;
use crate::math::Affine;
use crate::scene::{CsgId, CsgSolid, Operator, Scene, Shape, ShapeId};
use std::sync::Arc;

/// The bit of a hit's primitive id that says that the solid's outward normal is the
/// opposite of the operand's (S53).
pub const TURNED: u32 = 1 << 31;

/// A CSG solid that some instance places, unfolded.
#[derive(Clone, Debug)]
pub struct Csg {
    operands: Vec<Operand>,
    frames: Vec<Frame>,
    steps: Vec<Step>,
    tolerance: f64,
    /// The box in the solid's own space; `None` if it has no bounds.
    pub bounds: Option<Bounds>,
    /// The greatest condition of its frames.
    pub condition: f64,
    /// Per mesh, the tree over its triangles about the mesh's centre; empty for brute
    /// force.
    pub triangles: Arc<[Tree]>,
}

#[derive(Clone, Debug)]
struct Operand {
    shape: Shape,
    frame: usize,
    /// The box in the operand's frame.
    bounds: Option<Bounds>,
    /// The number of the operand's first surface; each triangle of a mesh is a surface
    /// (S45).
    first: u32,
}

/// A space that operands with equal maps share (S40).
#[derive(Clone, Debug)]
pub struct Frame {
    pub operand_from_solid: Affine,
    pub solid_from_operand: Affine,
    /// The largest shift on the way to the frame.
    pub reach: f64,
}

/// A step of the operators in postfix.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// The next operand, in the order of their numbers.
    Operand,
    /// An operator, applied to so many of the latest results.
    Operator(Operator, usize),
}

/// A point where a line enters or leaves an operand.
#[derive(Clone, Debug)]
pub struct End<N> {
    pub t: Root<N>,
    pub operand: usize,
    enters: bool,
    face: usize,
    /// Whether the line runs against the surface's normal.
    against: bool,
}

/// Ends that are one event, in groups of equal t (S46, S47).
type Event<'e, N> = Vec<&'e [End<N>]>;

impl Csg {
    /// Unfolds a CSG solid of the scene.
    pub fn new(scene: &Scene, id: CsgId) -> Csg {
        let solid = CsgSolid::of(scene, id);
        let frame = |frame: &crate::scene::Frame| Frame {
            operand_from_solid: frame.operand_from_solid,
            solid_from_operand: frame.solid_from_operand,
            reach: frame.reach,
        };
        let frames: Vec<Frame> = solid.frames.iter().map(frame).collect();
        let operand = |(number, operand): (u32, &crate::scene::CsgOperand)| Operand {
            shape: operand.shape,
            frame: operand.frame as usize,
            bounds: match operand.shape {
                Shape::Mesh(id) => Some(bounds::about_center(&scene.meshes.row(id))),
                shape => kinds::of_shape(scene, shape),
            },
            first: solid.surface(number, 0),
        };
        let condition =
            |frame: &Frame| bounds::condition(&frame.operand_from_solid, &frame.solid_from_operand);
        let mut csg = Csg {
            operands: (0..).zip(&solid.operands).map(operand).collect(),
            triangles: Arc::default(),
            condition: frames.iter().map(condition).fold(1.0, f64::max),
            frames,
            steps: postfix(scene, id),
            tolerance: solid.tolerance,
            bounds: None,
        };
        csg.bounds = csg.around();
        csg
    }

    /// Returns a box around the solid: the box of all operands of a union or xor, of the
    /// first operand of a difference, of one bounded operand of an intersection. A
    /// complement has no bounds.
    fn around(&self) -> Option<Bounds> {
        let mut operands = self.operands.iter().map(|operand| {
            let frame = &self.frames[operand.frame];
            let (to, from) = (&frame.solid_from_operand, &frame.operand_from_solid);
            let own = operand.bounds.as_ref()?;
            Some(bounds::placed(own, to, from))
        });
        self.fold(
            || operands.next().flatten(),
            |operator, values| match operator {
                Operator::Union | Operator::Xor => {
                    values.iter().try_fold(Bounds::EMPTY, |all, one| {
                        one.as_ref().map(|one| all.union(one))
                    })
                }
                Operator::Intersection => values.iter().copied().flatten().next(),
                Operator::Difference => values[0],
                Operator::Complement => None,
            },
        )
    }

    /// Evaluates the operators on a value of each operand, which `operand` returns in the
    /// order of their numbers.
    fn fold<T>(&self, mut operand: impl FnMut() -> T, operator: impl Fn(Operator, &[T]) -> T) -> T {
        let mut stack: Vec<T> = Vec::new();
        for step in &self.steps {
            match step {
                Step::Operand => stack.push(operand()),
                Step::Operator(op, count) => {
                    let first = stack.len() - count;
                    let result = operator(*op, &stack[first..]);
                    stack.truncate(first);
                    stack.push(result);
                }
            }
        }
        stack.pop().expect("a CSG solid has operands")
    }

    /// Says whether a point is in the solid, given the operands that it is in.
    fn is_inside(&self, inside: &[bool]) -> bool {
        let mut operands = inside.iter().copied();
        self.fold(
            || operands.next().expect("one for each operand"),
            |operator, values| match operator {
                Operator::Union => values.contains(&true),
                Operator::Intersection => !values.contains(&false),
                Operator::Difference => values[0] && !values[1..].contains(&true),
                Operator::Xor => values.iter().filter(|x| **x).count() % 2 == 1,
                Operator::Complement => !values[0],
            },
        )
    }

    /// Returns the operand's ray (S39).
    fn in_frame(&self, ray: &Ray, frame: usize) -> Ray {
        if frame == 0 {
            *ray
        } else {
            ray.through(&self.frames[frame].operand_from_solid)
        }
    }

    /// Finds all boundaries along the line, sorted by t. The ray is in the solid's space.
    pub fn boundaries<N: Measured>(
        &self,
        scene: &Scene,
        ray: &Ray,
    ) -> Result<Vec<Meeting<N>>, N::Undecided> {
        let mut inside = vec![false; self.operands.len()];
        let ends = self.ends::<N>(scene, ray, &mut inside)?;
        let mut boundaries = Vec::new();
        let mut state = self.is_inside(&inside);
        for event in self.events(scene, ray, &ends)? {
            let before = state;
            let mut found = None;
            for group in event {
                let start = state;
                let mut first = None;
                for end in group {
                    inside[end.operand] = end.enters;
                    state = self.is_inside(&inside);
                    if state != start {
                        first = first.or(Some(end));
                    }
                }
                // The solid changes here to what it is behind the event (S51).
                if state != start && state != before {
                    found = found.or(first);
                }
            }
            if let Some(end) = found.filter(|_| state != before) {
                let row = &self.operands[end.operand];
                let triangle = match row.shape {
                    Shape::Mesh(_) => end.face as u32,
                    _ => 0,
                };
                let turned = if state == end.against { 0 } else { TURNED };
                boundaries.push(Meeting {
                    t: end.t.clone(),
                    face: end.face,
                    surface: (row.first + triangle) | turned,
                });
            }
        }
        Ok(boundaries)
    }

    /// Finds the ends of all operands, sorted by t and then by operand, and sets `inside`
    /// for the operands that the line is in from the start.
    fn ends<N: Number>(
        &self,
        scene: &Scene,
        ray: &Ray,
        inside: &mut [bool],
    ) -> Result<Vec<End<N>>, N::Undecided> {
        let rays: Vec<Ray> = (0..self.frames.len())
            .map(|frame| self.in_frame(ray, frame))
            .collect();
        let mut ends: Vec<End<N>> = Vec::new();
        for (operand, row) in self.operands.iter().enumerate() {
            let ray = &rays[row.frame];
            let slack = bounds::slack(ray.org, 1.0);
            let missed = |b: &Bounds| {
                b.enter(ray.org, ray.dir, slack, f64::NEG_INFINITY)
                    .is_none()
            };
            if !ray.is_finite() || row.bounds.as_ref().is_some_and(missed) {
                continue;
            }
            if let Shape::Mesh(id) = row.shape {
                for end in self.ends_of_mesh(scene, ray, operand, id)? {
                    insert(&mut ends, end)?;
                }
                continue;
            }
            let (from_start, changes) = span(&primitive(scene, row.shape), ray)?;
            inside[operand] = from_start;
            let mut enters = from_start;
            for Meeting { t, face, .. } in changes {
                enters = !enters;
                let end = End {
                    t,
                    operand,
                    enters,
                    face,
                    against: enters,
                };
                insert(&mut ends, end)?;
            }
        }
        Ok(ends)
    }

    /// Groups ends at one t, and joins groups within slack of each other into events (S46,
    /// S47).
    fn events<'e, N: Measured>(
        &self,
        scene: &Scene,
        ray: &Ray,
        ends: &'e [End<N>],
    ) -> Result<Vec<Event<'e, N>>, N::Undecided> {
        let mut events: Vec<Event<N>> = Vec::new();
        for group in at_one_t(ends)? {
            match events.last_mut() {
                Some(event) if self.are_one(scene, ray, event[event.len() - 1], group)? => {
                    event.push(group);
                }
                _ => events.push(vec![group]),
            }
        }
        Ok(events)
    }

    /// Says whether any end of one group is within slack of any end of the other.
    fn are_one<N: Measured>(
        &self,
        scene: &Scene,
        ray: &Ray,
        before: &[End<N>],
        behind: &[End<N>],
    ) -> Result<bool, N::Undecided> {
        if self.frames.len() == 1 && self.tolerance == 0.0 {
            return Ok(false);
        }
        let slacks = |group: &[End<N>]| -> Vec<Slack> {
            let slack = |end: &End<N>| self.slack(scene, ray, end);
            group.iter().map(slack).collect()
        };
        for a in slacks(before) {
            for b in slacks(behind) {
                let slack = a.with(&b);
                if slack > 0.0 && N::is_within(&before[0].t, &behind[0].t, slack)? {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Evaluates what an end's slack is made of (S48, S49).
    fn slack<N: Measured>(&self, scene: &Scene, ray: &Ray, end: &End<N>) -> Slack {
        let row = &self.operands[end.operand];
        let frame = &self.frames[row.frame];
        let t = N::about(&end.t);
        let own = self.in_frame(ray, row.frame);
        let normal = kinds::normal(&face_of(scene, row.shape, end.face), &own, t, end.face);
        let normal = frame.operand_from_solid.linear().map(|c| dot(c, normal));
        let reach = Reach {
            rate: slack::rate(normal, ray.dir),
            coordinate: bounds::max_abs(ray.org.iter().chain(&ray.at(t))),
        };
        Slack {
            operand: end.operand,
            frame: row.frame,
            placement: if self.frames.len() > 1 {
                slack::placement(frame, &reach)
            } else {
                0.0
            },
            tolerance: self.tolerance / reach.rate,
        }
    }

    /// Returns the solid's outward normal at a meeting of face and surface, in the solid's
    /// space.
    pub fn normal(&self, scene: &Scene, ray: &Ray, t: f64, met: (usize, u32)) -> [f64; 3] {
        let (face, surface) = met;
        let after = |row: &Operand| row.first <= surface & !TURNED;
        let row = &self.operands[self.operands.partition_point(after) - 1];
        let own = self.in_frame(ray, row.frame);
        let normal = kinds::normal(&face_of(scene, row.shape, face), &own, t, face);
        let map = &self.frames[row.frame].operand_from_solid;
        let normal = map.linear().map(|c| dot(c, normal));
        if surface & TURNED == 0 {
            normal
        } else {
            normal.map(|x| -x)
        }
    }
}

/// Makes a primitive of a shape that is neither a mesh nor a CSG solid.
fn primitive(scene: &Scene, shape: Shape) -> Primitive<'_> {
    face_of(scene, shape, 0)
}

/// Makes a primitive of a shape, or of a triangle of a mesh.
fn face_of(scene: &Scene, shape: Shape, face: usize) -> Primitive<'_> {
    Primitive {
        scene,
        shape,
        triangle: face as u32,
        csg: None,
    }
}

/// Groups sorted ends by equal t.
fn at_one_t<N: Number>(ends: &[End<N>]) -> Result<Vec<&[End<N>]>, N::Undecided> {
    let mut groups = Vec::new();
    let mut rest = ends;
    while let Some(first) = rest.first() {
        let mut count = 1;
        while count < rest.len() && rest[count].t.order(&first.t)?.is_eq() {
            count += 1;
        }
        let (group, others) = rest.split_at(count);
        groups.push(group);
        rest = others;
    }
    Ok(groups)
}

/// Inserts an end behind all ends that are not greater.
fn insert<N: Number>(ends: &mut Vec<End<N>>, end: End<N>) -> Result<(), N::Undecided> {
    let (mut low, mut high) = (0, ends.len());
    while low < high {
        let middle = (low + high) / 2;
        if ends[middle].t.order(&end.t)?.is_gt() {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    ends.insert(low, end);
    Ok(())
}

/// Returns the span of a closed solid. A span of one point is none (S41).
fn span<N: Number>(primitive: &Primitive, ray: &Ray) -> Result<Inside<N>, N::Undecided> {
    if ray.dir == [0.0; 3] {
        return Ok((false, Vec::new()));
    }
    if let Some(span) = primitive.span_of_many(ray) {
        return span;
    }
    let faces = primitive.faces::<N>(ray);
    if let (Shape::Quadric(_), [face]) = (primitive.shape, &faces[..]) {
        let mut changes = changes(face)?;
        let from_start = face.sign_far_off(true)?.is_le();
        if from_start == face.sign_far_off(false)?.is_le() && changes.len() == 1 {
            changes.clear();
        }
        return Ok((from_start, changes));
    }
    let always = |backward: bool| -> Result<bool, N::Undecided> {
        for f in &faces {
            if f.sign_far_off(backward)?.is_gt() {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let (inside_before, inside_behind) = (always(true)?, always(false)?);
    let (mut least, mut greatest): (Option<Meeting<N>>, Option<Meeting<N>>) = (None, None);
    let rank = |met: &Meeting<N>| rank(primitive.shape, met.face);
    for met in super::solids::ends(&faces)? {
        let before = match &least {
            Some(least) => {
                let first = rank(&met).cmp(&rank(least));
                met.t.order(&least.t)?.then(first).is_lt()
            }
            None => true,
        };
        let behind = match &greatest {
            Some(greatest) => {
                let first = rank(greatest).cmp(&rank(&met));
                met.t.order(&greatest.t)?.then(first).is_gt()
            }
            None => true,
        };
        if before {
            least = Some(met.clone());
        }
        if behind {
            greatest = Some(met);
        }
    }
    let (Some(least), Some(greatest)) = (least, greatest) else {
        return Ok((inside_before, Vec::new()));
    };
    if !inside_before && !inside_behind && least.t.order(&greatest.t)?.is_eq() {
        return Ok((false, Vec::new()));
    }
    let enter = (!inside_before).then_some(least);
    let exit = (!inside_behind).then_some(greatest);
    Ok((inside_before, enter.into_iter().chain(exit).collect()))
}

/// What is still to be written down.
enum Left {
    Shape(ShapeId),
    Operator(Operator, usize),
}

/// Writes a CSG solid's operators in postfix, without recursion, because operators may be
/// nested to any depth.
fn postfix(scene: &Scene, id: CsgId) -> Vec<Step> {
    let table = &scene.csg;
    let mut steps = Vec::new();
    let mut left: Vec<Left> = Vec::new();
    let open = |left: &mut Vec<Left>, id: CsgId| {
        let operands = table.operands(id);
        left.push(Left::Operator(table.operator[id.index()], operands.len()));
        left.extend(operands.iter().rev().map(|o| Left::Shape(o.shape)));
    };
    open(&mut left, id);
    while let Some(next) = left.pop() {
        match next {
            Left::Operator(operator, count) => steps.push(Step::Operator(operator, count)),
            Left::Shape(shape) => match scene.shapes.row(shape) {
                Shape::Csg(id) => open(&mut left, id),
                _ => steps.push(Step::Operand),
            },
        }
    }
    steps
}
