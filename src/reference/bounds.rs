//! Boxes for the oracle's own tree, made from each shape's definition and grown
//! (docs/numerics/oracle.md, O7).

use super::ray::length;
use crate::math::Affine;
use crate::scene::Mesh;

/// The unit roundoff v of f64, 2⁻⁵³.
const UNIT: f64 = f64::EPSILON / 2.0;
/// Roundings of the coordinates that boxes and slabs are grown by, far more than occur
/// (O7).
const ROUNDINGS: f64 = 64.0;

/// An axis-aligned box in f64.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Bounds {
    /// The box of no point.
    pub const EMPTY: Bounds = Bounds {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// Returns the box of some points.
    pub fn around(points: impl IntoIterator<Item = [f64; 3]>) -> Bounds {
        points
            .into_iter()
            .fold(Bounds::EMPTY, |b, p| b.union(&Bounds { min: p, max: p }))
    }

    /// Returns the box of two boxes.
    pub fn union(&self, other: &Bounds) -> Bounds {
        Bounds {
            min: std::array::from_fn(|k| f64::min(self.min[k], other.min[k])),
            max: std::array::from_fn(|k| f64::max(self.max[k], other.max[k])),
        }
    }

    /// Grows the box on all sides, rounded outward.
    pub fn grown(&self, by: f64) -> Bounds {
        Bounds {
            min: self.min.map(|x| (x - by).next_down()),
            max: self.max.map(|x| (x + by).next_up()),
        }
    }

    fn max_abs(&self) -> f64 {
        max_abs(self.min.iter().chain(&self.max))
    }

    /// By a part of its own size: more than any rounding above could matter.
    pub fn widened(&self) -> Bounds {
        let size = length(std::array::from_fn(|k| self.max[k] - self.min[k]));
        self.grown(1e-9 * size + ROUNDINGS * UNIT * self.max_abs())
    }

    /// Returns the least t ≥ `start` at which the ray is inside, or `None` if it never is.
    /// The box is first grown by `slack`, which must cover the roundings of this
    /// computation.
    pub fn enter(&self, org: [f64; 3], dir: [f64; 3], slack: f64, start: f64) -> Option<f64> {
        let (mut near, mut far) = (start, f64::INFINITY);
        for k in 0..3 {
            let (min, max) = (self.min[k] - slack, self.max[k] + slack);
            if dir[k] == 0.0 {
                if org[k] < min || org[k] > max {
                    return None;
                }
                continue;
            }
            let (a, b) = ((min - org[k]) / dir[k], (max - org[k]) / dir[k]);
            near = f64::max(near, f64::min(a, b));
            far = f64::min(far, f64::max(a, b));
        }
        // A NaN from overflow does not cull.
        let missed = near > far;
        (!missed).then_some(near)
    }
}

/// Returns the largest magnitude.
pub fn max_abs<'x>(all: impl Iterator<Item = &'x f64>) -> f64 {
    all.fold(0.0, |m, x| f64::max(m, x.abs()))
}

/// Returns the slack that [`Bounds::enter`] needs for a ray from `org`, whose coordinates
/// are known to `condition` roundings. The boxes themselves already have room for their own
/// roundings (O7).
pub fn slack(org: [f64; 3], condition: f64) -> f64 {
    let size = max_abs(org.iter());
    ROUNDINGS * UNIT * condition * size
}

/// Returns the room of a polygon with these corners: their box, grown on all sides by a
/// thousandth of its longest side, rounded outward (docs/SPEC.md, S28).
pub fn near_outline(points: &[[f64; 3]]) -> Bounds {
    let b = Bounds::around(points.iter().copied());
    let longest = (0..3).map(|k| b.max[k] - b.min[k]).fold(0.0, f64::max);
    let grown = b.grown(longest * 1e-3);
    Bounds {
        min: grown.min.map(|x| x.max(-f64::MAX)),
        max: grown.max.map(|x| x.min(f64::MAX)),
    }
}

/// About the mesh's centre.
pub fn about_center(mesh: &Mesh) -> Bounds {
    Bounds::around(mesh.positions.iter().map(|p| p.map(f64::from))).widened()
}

/// Returns a triangle's box about the mesh's centre.
pub fn triangle_bounds(mesh: &Mesh, triangle: usize) -> Bounds {
    let corners = mesh.corners(triangle).map(|p| p.map(f64::from));
    Bounds::around(corners).widened()
}

/// Returns the condition of a map and its inverse: how many times a rounding counts on the
/// other side.
pub fn condition(to: &Affine, from: &Affine) -> f64 {
    norm(to) * norm(from)
}

/// Returns the box of a mapped box. `from` is only nearly the map's inverse, so the box
/// grows by how far the corners miss themselves when they are mapped back (O7).
pub fn placed(own: &Bounds, to: &Affine, from: &Affine) -> Bounds {
    let corners: [[f64; 3]; 8] = std::array::from_fn(|i| {
        std::array::from_fn(|k| {
            if i >> k & 1 == 0 {
                own.min[k]
            } else {
                own.max[k]
            }
        })
    });
    let there = corners.map(|p| apply(to, p));
    let farthest = corners
        .iter()
        .zip(&there)
        .map(|(p, q)| {
            let back = apply(from, *q);
            length(std::array::from_fn(|k| back[k] - p[k]))
        })
        .fold(0.0, f64::max);
    let bounds = Bounds::around(there);
    let roundings = ROUNDINGS * UNIT * condition(to, from) * bounds.max_abs();
    bounds.grown(4.0 * norm(to) * farthest + roundings)
}

fn apply(m: &Affine, p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| {
        m.linear()[0][r] * p[0]
            + m.linear()[1][r] * p[1]
            + m.linear()[2][r] * p[2]
            + m.translation[r]
    })
}

/// Returns the Frobenius norm of the linear part.
fn norm(m: &Affine) -> f64 {
    length(m.linear().map(length))
}
