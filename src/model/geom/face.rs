//! Faces of solids as numbers: two faces with equal numbers lie in one plane or one curved surface
//! by definition, so that rays cross both at one t.

use glam::DVec3;

/// A surface in the shape's own space. Equal values are one surface; unequal values may be, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// The plane on which a coordinate has one value.
    Across {
        axis: usize,
        at: f64,
    },
    /// Any other plane.
    Plane {
        normal: DVec3,
        offset: f64,
    },
    /// The plane through a point and perpendicular to the line to another point.
    Cap {
        at: DVec3,
        to: DVec3,
    },
    /// A cylinder about a line that is parallel to an axis, through the point whose coordinate on
    /// that axis is 0.
    Along {
        axis: usize,
        through: DVec3,
        radius: f64,
    },
    /// A cylinder about another line.
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

/// A [`Face`] as a key of maps.
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
        // −0 and +0 are one number.
        let bits = |x: f64| (x + 0.0).to_bits();
        let mut key = [kind + 8 * axis as u64; 8];
        for (key, x) in key[1..].iter_mut().zip([a.x, a.y, a.z, b.x, b.y, b.z, x]) {
            *key = bits(x);
        }
        key
    }
}

impl Face {
    /// Makes the face of a plane; it is the same for both orientations, and for normals that
    /// differ by a power of two.
    pub(super) fn of_plane(normal: DVec3, offset: f64) -> Face {
        let mut along = (0..3).filter(|k| normal[*k] != 0.0);
        let Some(axis) = along.next() else {
            return Face::Plane { normal, offset };
        };
        let at = offset / normal[axis];
        // With numbers above this the remainder cannot underflow to zero.
        let is_exact = libm::fma(at, normal[axis], -offset) == 0.0 && offset.abs() > 1e-200;
        if along.next().is_none() && (is_exact || offset == 0.0) {
            return Face::Across { axis, at };
        }
        let power = -libm::ilogb(normal[axis]);
        let scaled = |x: f64| libm::scalbn(x, power).copysign(x * normal[axis].signum());
        let (n, w) = (normal.to_array().map(scaled), scaled(offset));
        let back = |x: f64, scaled: f64| libm::scalbn(scaled.abs(), -power) == x.abs();
        // A plane whose scaled numbers leave f64's range is not scaled.
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

    /// Makes the face of a cap of a cylinder or cone, at one end of its axis.
    pub(super) fn cap(at: DVec3, to: DVec3) -> Face {
        match axis_of(at, to) {
            Some(axis) => Face::Across { axis, at: at[axis] },
            None => Face::Cap { at, to },
        }
    }

    /// Makes the face of a cylinder's side.
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

/// Returns the axis along which two points differ, if they differ along one only.
fn axis_of(a: DVec3, b: DVec3) -> Option<usize> {
    let mut along = (0..3).filter(|k| a[*k] != b[*k]);
    along.next().filter(|_| along.next().is_none())
}
