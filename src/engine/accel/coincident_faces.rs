//! Faces of a CSG solid's operands that lie in one surface: known by numbers, so
//! that lanes need not ask which of them a ray meets first.
//!
//! In one frame a ray meets such faces at one t. Between frames it meets planes at t's
//! that are one event by definition (docs/NUMERICS.md), if these differ by no more
//! than some roundings of the coordinates there.

use crate::math::length;
use crate::scene::{CsgSolid, Face, FaceKey, Frame, Tables, faces_of};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// The surface that a face lies in, by number. Numbers begin at 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoincidentFace {
    /// The same in one frame: the same t along every ray.
    pub exact: u32,
    /// Of planes, the same: one event along every ray that is not as good as level with
    /// it. Of two numbers `exact` in one frame, one at most has it; 0: nobody else.
    pub near: u32,
}

/// Surfaces that several operands have faces in.
#[derive(Clone, Debug, Default)]
pub struct CoincidentFaces {
    /// By operand, and one more: where its faces begin. Empty where there are no
    /// such surfaces.
    first: Vec<u32>,
    /// By face: its surface, or 0 twice.
    faces: Vec<CoincidentFace>,
    /// By `near` − 1: the plane's normal, unit, in the solid's space.
    normals: Vec<DVec3>,
}

/// What is known of a surface of one frame.
struct Known {
    frame: u32,
    operand: u32,
    shared: bool,
    near: u32,
}

impl CoincidentFaces {
    pub(super) fn of(tables: &Tables, solid: &CsgSolid) -> CoincidentFaces {
        let mut keys: HashMap<(u32, FaceKey), u32> = HashMap::new();
        let mut known: Vec<Known> = Vec::new();
        let mut groups = InstanceBvhs::new(&solid.frames);
        let mut shared = CoincidentFaces::default();
        shared.first.push(0);
        for (operand, row) in (0..).zip(&solid.operands) {
            for face in faces_of(tables, row.shape) {
                let Some(face) = face else {
                    shared.faces.push(CoincidentFace::default());
                    continue;
                };
                let next = known.len() as u32;
                let exact = *keys.entry((row.frame, face.key())).or_insert(next);
                if exact == next {
                    known.push(Known {
                        frame: row.frame,
                        operand,
                        shared: false,
                        near: 0,
                    });
                    groups.add(&face, &solid.frames, exact, &mut known);
                }
                let plane = &mut known[exact as usize];
                plane.shared |= plane.operand != operand;
                shared.faces.push(CoincidentFace {
                    exact: exact + 1,
                    near: 0,
                });
            }
            shared.first.push(shared.faces.len() as u32);
        }
        let mut some = false;
        for plane in &mut shared.faces {
            let Some(known) = plane.exact.checked_sub(1).map(|row| &known[row as usize]) else {
                continue;
            };
            plane.near = known.near;
            if !known.shared && known.near == 0 {
                *plane = CoincidentFace::default();
            }
            some |= plane.exact != 0;
        }
        if !some {
            return CoincidentFaces::default();
        }
        shared.normals = groups.groups.iter().map(|group| group.normal).collect();
        shared
    }

    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// The surface that a face of an operand lies in, if others do too. `face`: as
    /// [`crate::geom::guarded::Ends`] has them, or no number.
    pub fn of_face(&self, operand: u32, face: f64) -> Option<CoincidentFace> {
        let operand = operand as usize;
        let (first, end) = (self.first[operand], self.first[operand + 1]);
        let faces = &self.faces[first as usize..end as usize];
        let face = (face >= 0.0).then_some(face as usize)?;
        faces.get(face).copied().filter(|plane| plane.exact != 0)
    }

    /// Whether a ray leaves a plane, by `near`, fast enough for planes that are
    /// nearly one to be one event. `dir`: in the solid's space.
    pub fn is_crossed(&self, near: u32, dir: DVec3) -> bool {
        let rate = self.normals[near as usize - 1].dot(dir).abs();
        rate > length(dir) * LEAST_RATE
    }

    pub(super) fn bytes(&self) -> usize {
        self.first.len() * 4
            + self.faces.len() * size_of::<CoincidentFace>()
            + self.normals.len() * size_of::<DVec3>()
    }
}

/// Far above the rate that slack is bounded by (trace/csg.rs).
const LEAST_RATE: f64 = 1.0 / (1 << 20) as f64;

/// Planes that are nearly the same, in the solid's space.
struct Group {
    normal: DVec3,
    offset: f64,
    /// Of the first of its planes: the number, and the largest shift that its
    /// frame's numbers carry.
    first: u32,
    reach: f64,
}

struct InstanceBvhs {
    groups: Vec<Group>,
    by_number: HashMap<[i64; 4], u32>,
    /// Group and frame.
    members: HashSet<(u32, u32)>,
    /// What offsets are compared in.
    scale: f64,
}

/// Roundings by which planes of a group may differ from its first: of their unit
/// normals, and of their offsets. Slack between frames is 32 of such at least, of
/// which the rays' own take a third and what is computed here a quarter.
const ROUNDINGS: f64 = 2.0 * f64::EPSILON;

impl InstanceBvhs {
    fn new(frames: &[Frame]) -> InstanceBvhs {
        let scale = frames.iter().fold(0.0, |m: f64, f| m.max(f.reach));
        InstanceBvhs {
            groups: Vec::new(),
            by_number: HashMap::new(),
            members: HashSet::new(),
            scale: if scale > 0.0 { scale } else { 1.0 },
        }
    }

    fn add(&mut self, face: &Face, frames: &[Frame], number: u32, known: &mut [Known]) {
        let row = known[number as usize].frame;
        let frame = &frames[row as usize];
        let Some((normal, offset)) = placed(face, frame).filter(|_| frames.len() > 1) else {
            return;
        };
        let parts = |x: f64| (x * (1_u64 << 40) as f64).round() as i64;
        let [x, y, z] = normal.to_array().map(parts);
        let key = [x, y, z, parts(offset / self.scale)];
        let next = self.groups.len() as u32;
        let at = *self.by_number.entry(key).or_insert(next);
        if at == next {
            self.groups.push(Group {
                normal,
                offset,
                first: number,
                reach: frame.reach,
            });
            self.members.insert((at, row));
            return;
        }
        let group = &mut self.groups[at as usize];
        let apart = (group.normal - normal).abs().max_element();
        let size = offset.abs().max(frame.reach).max(group.reach);
        let same = apart <= ROUNDINGS && (group.offset - offset).abs() <= ROUNDINGS * size;
        // Two planes of one frame that are not the same are two.
        if same && self.members.insert((at, row)) {
            known[group.first as usize].near = at + 1;
            known[number as usize].near = at + 1;
        }
    }
}

/// Unit normal, to one side, and offset, in the solid's space: as good as some
/// roundings. Of caps that is not so, and curved faces have none.
fn placed(face: &Face, frame: &Frame) -> Option<(DVec3, f64)> {
    let (n, w) = match *face {
        Face::Across { axis, at } => (DVec3::AXES[axis], at),
        Face::Plane { normal, offset } => (normal, offset),
        _ => return None,
    };
    let map = &frame.operand_from_solid;
    let normal = DVec3::from_array(map.transposed_vector(n.to_array()));
    let offset = w - n.dot(DVec3::from_array(map.translation));
    let length = length(normal);
    let (normal, offset) = (normal / length, offset / length);
    let first = normal.to_array().into_iter().find(|x| x.abs() > 1e-3)?;
    let sign = first.signum();
    let finite = normal.is_finite() && offset.is_finite();
    finite.then_some((normal * sign, offset * sign))
}
