//! The flat faces of solids, told apart by numbers alone: what lies in one plane by
//! definition, so that rays cross it at one t.

use super::Tables;
use super::shapes::Shape;
use glam::DVec3;

/// A plane, in the shape's own space. Equal ones are the same plane; of planes that
/// are not equal the same may be true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlatFace {
    /// Where a coordinate has a value.
    Across { axis: usize, at: f64 },
    /// Any other.
    Plane { normal: DVec3, offset: f64 },
    /// Through a point, across the line to another.
    Cap { at: DVec3, to: DVec3 },
}

/// [`FlatFace`] without what has no order or no equality: for maps.
pub type FaceKey = [u64; 7];

impl FlatFace {
    pub fn key(&self) -> FaceKey {
        let (kind, numbers) = match self {
            FlatFace::Across { axis, at } => {
                let axis = *axis as f64;
                (0, [axis, *at, 0.0, 0.0, 0.0, 0.0])
            }
            FlatFace::Plane { normal: n, offset } => (1, [n.x, n.y, n.z, *offset, 0.0, 0.0]),
            FlatFace::Cap { at, to } => (2, [at.x, at.y, at.z, to.x, to.y, to.z]),
        };
        let mut key = [kind; 7];
        for (key, number) in key[1..].iter_mut().zip(numbers) {
            // Zero has two signs.
            *key = (number + 0.0).to_bits();
        }
        key
    }
}

/// Of a solid, numbered as by [`crate::geom::guarded::Ends`]; `None` where a face is
/// but a point.
pub fn flat_faces(tables: &Tables, shape: Shape) -> Vec<Option<FlatFace>> {
    match shape {
        Shape::Cuboid(id) => {
            let row = tables.cuboids.row(id);
            let across = |(axis, at)| Some(FlatFace::Across { axis, at });
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
            vec![Some(cap(row.base, row.top)), Some(cap(row.top, row.base))]
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

/// Seen from either side, at any length of the normal that is a power of two.
fn of_plane(normal: DVec3, offset: f64) -> FlatFace {
    let mut along = (0..3).filter(|k| normal[*k] != 0.0);
    let Some(axis) = along.next() else {
        return FlatFace::Plane { normal, offset };
    };
    let at = offset / normal[axis];
    // Of larger numbers the remainder cannot vanish by underflow.
    let is_exact = libm::fma(at, normal[axis], -offset) == 0.0 && offset.abs() > 1e-200;
    if along.next().is_none() && (is_exact || offset == 0.0) {
        return FlatFace::Across { axis, at };
    }
    let power = -libm::ilogb(normal[axis]);
    let scaled = |x: f64| libm::scalbn(x, power).copysign(x * normal[axis].signum());
    let (n, w) = (normal.to_array().map(scaled), scaled(offset));
    let back = |x: f64, scaled: f64| libm::scalbn(scaled.abs(), -power) == x.abs();
    // Scaled beyond the range of numbers, it is left as it is.
    let whole = (0..3).all(|k| back(normal[k], n[k])) && back(offset, w);
    if whole {
        FlatFace::Plane {
            normal: DVec3::from_array(n),
            offset: w,
        }
    } else {
        FlatFace::Plane { normal, offset }
    }
}

fn cap(at: DVec3, to: DVec3) -> FlatFace {
    let mut along = (0..3).filter(|k| at[*k] != to[*k]);
    match (along.next(), along.next()) {
        (Some(axis), None) => FlatFace::Across { axis, at: at[axis] },
        _ => FlatFace::Cap { at, to },
    }
}
