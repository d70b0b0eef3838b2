//! Coincident faces of a CSG solid's operands. Faces in one surface get one number, so that
//! lanes need not order a ray's boundaries on them.
//!
//! In one frame a ray crosses such faces at one t (docs/numerics/csg.md, K9). Planes of
//! different frames are one event if they differ by no more than two roundings (K10).

use crate::math::length;
use crate::scene::{CsgSolid, Face, FaceKey, Frame, Tables, faces_of};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// The numbers of the surface that a face lies in. They begin at 1; 0 is no number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoincidentFace {
    /// Equal for faces of one frame in one surface, which every ray crosses at one t.
    pub exact: u32,
    /// Equal for planes of several frames that are one event along every ray that is not
    /// nearly parallel to them. In one frame at most one surface has a given number. 0 if no
    /// plane of another frame is near.
    pub near: u32,
}

/// The coincident faces of a CSG solid.
#[derive(Clone, Debug, Default)]
pub struct CoincidentFaces {
    /// By operand: the row of its first face; one row more ends the last. Empty if no faces
    /// coincide.
    first: Vec<u32>,
    /// By face: its numbers; both are 0 if no other face lies in the surface.
    faces: Vec<CoincidentFace>,
    /// By `near` − 1: the plane's unit normal in the solid's space.
    normals: Vec<DVec3>,
}

/// A surface of one frame, while faces are collected.
struct Surface {
    frame: u32,
    /// The operand of its first face.
    operand: u32,
    /// Whether another operand has a face in it.
    shared: bool,
    near: u32,
}

impl CoincidentFaces {
    /// Finds the coincident faces of a solid.
    pub(super) fn find(tables: &Tables, solid: &CsgSolid) -> CoincidentFaces {
        let mut keys: HashMap<(u32, FaceKey), u32> = HashMap::new();
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut planes = NearPlanes::new(&solid.frames);
        let mut shared = CoincidentFaces::default();
        shared.first.push(0);
        for (operand, row) in (0..).zip(&solid.operands) {
            for face in faces_of(tables, row.shape) {
                let Some(face) = face else {
                    shared.faces.push(CoincidentFace::default());
                    continue;
                };
                let next = surfaces.len() as u32;
                let exact = *keys.entry((row.frame, face.key())).or_insert(next);
                if exact == next {
                    surfaces.push(Surface {
                        frame: row.frame,
                        operand,
                        shared: false,
                        near: 0,
                    });
                    planes.add(&face, &solid.frames, exact, &mut surfaces);
                }
                let surface = &mut surfaces[exact as usize];
                surface.shared |= surface.operand != operand;
                shared.faces.push(CoincidentFace {
                    exact: exact + 1,
                    near: 0,
                });
            }
            shared.first.push(shared.faces.len() as u32);
        }
        let mut some = false;
        for face in &mut shared.faces {
            let Some(row) = face.exact.checked_sub(1) else {
                continue;
            };
            let surface = &surfaces[row as usize];
            face.near = surface.near;
            if !surface.shared && surface.near == 0 {
                *face = CoincidentFace::default();
            }
            some |= face.exact != 0;
        }
        if !some {
            return CoincidentFaces::default();
        }
        shared.normals = planes.rows.iter().map(|plane| plane.normal).collect();
        shared
    }

    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Returns the numbers of a face, if it coincides with others. `face` is numbered as in
    /// [`crate::geom::guarded::Ends`], or NaN if the face is not known.
    pub fn of_face(&self, operand: u32, face: f64) -> Option<CoincidentFace> {
        let operand = operand as usize;
        let (first, end) = (self.first[operand], self.first[operand + 1]);
        let faces = &self.faces[first as usize..end as usize];
        let face = (face >= 0.0).then_some(face as usize)?;
        faces.get(face).copied().filter(|face| face.exact != 0)
    }

    /// Returns whether a ray leaves the planes numbered `near` at a rate that makes them one
    /// event (K10). `dir` is in the solid's space.
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

/// The least rate at which planes that are nearly one are one event (docs/numerics/csg.md,
/// K10). It is far above [`SLOWEST`](super::SLOWEST), which bounds the slack.
const LEAST_RATE: f64 = 1.0 / (1 << 20) as f64;

/// A plane in the solid's space, which stands for all planes near it.
struct NearPlane {
    normal: DVec3,
    offset: f64,
    /// The row of its surface.
    surface: u32,
    /// The largest shift on the way to its frame; offsets carry roundings of it.
    reach: f64,
}

/// The planes of all frames, found by their rounded normals and offsets.
struct NearPlanes {
    rows: Vec<NearPlane>,
    by_key: HashMap<[i64; 4], u32>,
    /// Pairs of a row and a frame that has a plane near it.
    members: HashSet<(u32, u32)>,
    /// The unit of offsets in keys.
    scale: f64,
}

/// How far a plane may differ from the one that stands for it: two roundings 2⁻⁵² of the
/// unit normal and of the offset. The slack between frames is at least 32 such roundings, of
/// which the rays take a third and the computation here takes a quarter
/// (docs/numerics/csg.md, K10).
const ROUNDINGS: f64 = 2.0 * f64::EPSILON;

impl NearPlanes {
    fn new(frames: &[Frame]) -> NearPlanes {
        let scale = frames.iter().fold(0.0, |m: f64, f| m.max(f.reach));
        NearPlanes {
            rows: Vec::new(),
            by_key: HashMap::new(),
            members: HashSet::new(),
            scale: if scale > 0.0 { scale } else { 1.0 },
        }
    }

    /// Adds the face of the surface in row `number`, and numbers it and the plane near it.
    fn add(&mut self, face: &Face, frames: &[Frame], number: u32, surfaces: &mut [Surface]) {
        let row = surfaces[number as usize].frame;
        let frame = &frames[row as usize];
        let Some((normal, offset)) = placed(face, frame).filter(|_| frames.len() > 1) else {
            return;
        };
        let parts = |x: f64| (x * (1_u64 << 40) as f64).round() as i64;
        let [x, y, z] = normal.to_array().map(parts);
        let key = [x, y, z, parts(offset / self.scale)];
        let next = self.rows.len() as u32;
        let at = *self.by_key.entry(key).or_insert(next);
        if at == next {
            self.rows.push(NearPlane {
                normal,
                offset,
                surface: number,
                reach: frame.reach,
            });
            self.members.insert((at, row));
            return;
        }
        let plane = &self.rows[at as usize];
        let difference = (plane.normal - normal).abs().max_element();
        let size = offset.abs().max(frame.reach).max(plane.reach);
        let same = difference <= ROUNDINGS && (plane.offset - offset).abs() <= ROUNDINGS * size;
        // Different planes of one frame are never one event.
        if same && self.members.insert((at, row)) {
            surfaces[plane.surface as usize].near = at + 1;
            surfaces[number as usize].near = at + 1;
        }
    }
}

/// Returns the unit normal, of a canonical sign, and the offset of a plane face in the
/// solid's space, to a few roundings. Caps are not known so well, and curved faces have
/// none: `None`.
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
