//! The faces of solids, told apart by numbers alone: what lies in one plane, or in one
//! curved surface, by definition, so that rays cross it at one t.

use glam::DVec3;

/// A surface, in the shape's own space. Equal ones are the same; of others the same
/// may be true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// Where a coordinate has a value.
    Across {
        axis: usize,
        at: f64,
    },
    /// Any other.
    Plane {
        normal: DVec3,
        offset: f64,
    },
    /// A plane through a point, across the line to another.
    Cap {
        at: DVec3,
        to: DVec3,
    },
    /// A cylinder about a line along an axis, through a point with a zero there.
    Along {
        axis: usize,
        through: DVec3,
        radius: f64,
    },
    /// A cylinder about any other line.
    Side {
        base: DVec3,
        top: DVec3,
        radius: f64,
    },
    Ellipsoid {
        center: DVec3,
        radii: DVec3,
    },
}

/// [`Face`] without what has no order or no equality: for maps.
pub type FaceKey = [u64; 8];

impl Face {
    pub fn key(&self) -> FaceKey {
        let none = DVec3::ZERO;
        let (kind, numbers) = match *self {
            Face::Across { axis, at } => (0, (none, none, (axis, at))),
            Face::Plane { normal, offset } => (1, (normal, none, (0, offset))),
            Face::Cap { at, to } => (2, (at, to, (0, 0.0))),
            Face::Along {
                axis,
                through,
                radius,
            } => (3 + axis as u64, (through, none, (0, radius))),
            Face::Side { base, top, radius } => (6, (base, top, (0, radius))),
            Face::Ellipsoid { center, radii } => (7, (center, radii, (0, 0.0))),
        };
        let (a, b, (axis, x)) = numbers;
        // Zero has two signs.
        let bits = |x: f64| (x + 0.0).to_bits();
        let mut key = [kind + 8 * axis as u64; 8];
        for (key, x) in key[1..].iter_mut().zip([a.x, a.y, a.z, b.x, b.y, b.z, x]) {
            *key = bits(x);
        }
        key
    }
}

impl Face {
    /// Seen from either side, at any length of the normal that is a power of two.
    pub(super) fn of_plane(normal: DVec3, offset: f64) -> Face {
        let mut along = (0..3).filter(|k| normal[*k] != 0.0);
        let Some(axis) = along.next() else {
            return Face::Plane { normal, offset };
        };
        let at = offset / normal[axis];
        // Of larger numbers the remainder cannot vanish by underflow.
        let is_exact = libm::fma(at, normal[axis], -offset) == 0.0 && offset.abs() > 1e-200;
        if along.next().is_none() && (is_exact || offset == 0.0) {
            return Face::Across { axis, at };
        }
        let power = -libm::ilogb(normal[axis]);
        let scaled = |x: f64| libm::scalbn(x, power).copysign(x * normal[axis].signum());
        let (n, w) = (normal.to_array().map(scaled), scaled(offset));
        let back = |x: f64, scaled: f64| libm::scalbn(scaled.abs(), -power) == x.abs();
        // Scaled beyond the range of numbers, it is left as it is.
        let whole = (0..3).all(|k| back(normal[k], n[k])) && back(offset, w);
        if whole {
            Face::Plane {
                normal: DVec3::from_array(n),
                offset: w,
            }
        } else {
            Face::Plane { normal, offset }
        }
    }

    /// Of a cylinder or cone, at one end of its axis.
    pub(super) fn cap(at: DVec3, to: DVec3) -> Face {
        match axis_of(at, to) {
            Some(axis) => Face::Across { axis, at: at[axis] },
            None => Face::Cap { at, to },
        }
    }

    /// Of a cylinder.
    pub(super) fn side(base: DVec3, top: DVec3, radius: f64) -> Face {
        match axis_of(base, top) {
            Some(axis) => {
                let mut through = base;
                through[axis] = 0.0;
                Face::Along {
                    axis,
                    through,
                    radius,
                }
            }
            None => Face::Side { base, top, radius },
        }
    }
}

/// Along which two points differ, if along one only.
fn axis_of(a: DVec3, b: DVec3) -> Option<usize> {
    let mut along = (0..3).filter(|k| a[*k] != b[*k]);
    along.next().filter(|_| along.next().is_none())
}
