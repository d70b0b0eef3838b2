//! The faces of solids, told apart by their numbers alone: faces in one plane or one curved
//! surface by definition, which rays therefore cross at one t (docs/numerics/csg.md, K9).

use super::Tables;
use super::shapes::Shape;
use glam::DVec3;

/// A surface in the shape's own space. Equal faces are one surface; unequal faces may be
/// one surface as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// The plane where a coordinate has a value.
    Across {
        axis: usize,
        at: f64,
    },
    /// Any other plane.
    Plane {
        normal: DVec3,
        offset: f64,
    },
    /// The plane through a point, perpendicular to the line to another point.
    Cap {
        at: DVec3,
        to: DVec3,
    },
    /// A cylinder about a line along an axis, through a point whose coordinate along it is
    /// 0.
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

/// The bits of a [`Face`], which can be compared and hashed in maps.
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
        // Adding zero makes both zeros equal.
        let bits = |x: f64| (x + 0.0).to_bits();
        let mut key = [kind + 8 * axis as u64; 8];
        for (key, x) in key[1..].iter_mut().zip([a.x, a.y, a.z, b.x, b.y, b.z, x]) {
            *key = bits(x);
        }
        key
    }
}

/// Lists the faces of a solid, numbered as in [`crate::geom::guarded::Ends`]; `None` where
/// a face is only a point.
pub fn faces_of(tables: &Tables, shape: Shape) -> Vec<Option<Face>> {
    match shape {
        Shape::Cuboid(id) => {
            let row = tables.cuboids.row(id);
            let across = |(axis, at)| Some(Face::Across { axis, at });
            let axes = (0..3).flat_map(|k| [(k, row.min[k]), (k, row.max[k])]);
            axes.map(across).collect()
        }
        Shape::HalfSpace(id) => {
            let row = tables.half_spaces.row(id);
            vec![Some(of_plane(row.normal, row.offset))]
        }
        Shape::Polyhedron(id) => {
            let planes = tables.polyhedra.planes(id).iter();
            let of = planes.map(|plane| Some(of_plane(plane.normal, plane.offset)));
            of.collect()
        }
        Shape::Cylinder(id) => {
            let row = tables.cylinders.row(id);
            let caps = [cap(row.base, row.top), cap(row.top, row.base)];
            let side = side(row.base, row.top, row.radius);
            caps.into_iter().chain([side]).map(Some).collect()
        }
        Shape::Sphere(id) => {
            let row = tables.spheres.row(id);
            let (center, radii) = (row.center, DVec3::splat(row.radius));
            vec![Some(Face::Ellipsoid { center, radii })]
        }
        Shape::Ellipsoid(id) => {
            let row = tables.ellipsoids.row(id);
            let (center, radii) = (row.center, row.radii);
            vec![Some(Face::Ellipsoid { center, radii })]
        }
        Shape::Cone(id) => {
            let row = tables.cones.row(id);
            vec![
                (row.base_radius > 0.0).then(|| cap(row.base, row.top)),
                (row.top_radius > 0.0).then(|| cap(row.top, row.base)),
            ]
        }
        _ => Vec::new(),
    }
}

/// Returns one face for both orientations of a plane, and for all lengths of its normal
/// that differ by a power of two.
fn of_plane(normal: DVec3, offset: f64) -> Face {
    let mut along = (0..3).filter(|k| normal[*k] != 0.0);
    let Some(axis) = along.next() else {
        return Face::Plane { normal, offset };
    };
    let at = offset / normal[axis];
    // For offsets of this size the remainder cannot underflow to zero.
    let is_exact = libm::fma(at, normal[axis], -offset) == 0.0 && offset.abs() > 1e-200;
    if along.next().is_none() && (is_exact || offset == 0.0) {
        return Face::Across { axis, at };
    }
    let power = -libm::ilogb(normal[axis]);
    let scaled = |x: f64| libm::scalbn(x, power).copysign(x * normal[axis].signum());
    let (n, w) = (normal.to_array().map(scaled), scaled(offset));
    let back = |x: f64, scaled: f64| libm::scalbn(scaled.abs(), -power) == x.abs();
    // A plane whose scaling leaves the range of f64 stays as it is.
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

/// Returns the axis along which two points differ, if they differ along only one.
fn axis_of(a: DVec3, b: DVec3) -> Option<usize> {
    let mut along = (0..3).filter(|k| a[*k] != b[*k]);
    along.next().filter(|_| along.next().is_none())
}

fn cap(at: DVec3, to: DVec3) -> Face {
    match axis_of(at, to) {
        Some(axis) => Face::Across { axis, at: at[axis] },
        None => Face::Cap { at, to },
    }
}

fn side(base: DVec3, top: DVec3, radius: f64) -> Face {
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
