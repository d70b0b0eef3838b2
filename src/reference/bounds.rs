//! Boxes for the judge's own tree: from each shape's definition, widened.

use super::ray::length;
use crate::math::Affine;
use crate::scene::Mesh;

/// Half a unit in the last place of 1.
const UNIT: f64 = f64::EPSILON / 2.0;
/// Roundings that the widening stands for, and then many more.
const ROUNDINGS: f64 = 64.0;

#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    pub fn of(points: impl IntoIterator<Item = [f64; 3]>) -> Bounds {
        points
            .into_iter()
            .fold(Bounds::EMPTY, |b, p| b.union(&Bounds { min: p, max: p }))
    }

    pub fn union(&self, other: &Bounds) -> Bounds {
        Bounds {
            min: std::array::from_fn(|k| f64::min(self.min[k], other.min[k])),
            max: std::array::from_fn(|k| f64::max(self.max[k], other.max[k])),
        }
    }

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

    /// Where a ray is inside first, as t ≥ `start`; `None` where it never is. The
    /// box is first grown by `slack`, which must cover this computation's
    /// rounding.
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
        // Overflow to NaN must not cull.
        let missed = near > far;
        (!missed).then_some(near)
    }
}

pub fn max_abs<'x>(all: impl Iterator<Item = &'x f64>) -> f64 {
    all.fold(0.0, |m, x| f64::max(m, x.abs()))
}

/// What [`Bounds::enter`] needs for a ray from `org`, where coordinates are
/// known to within `condition` roundings. The boxes' own part is in them.
pub fn slack(org: [f64; 3], condition: f64) -> f64 {
    let size = max_abs(org.iter());
    ROUNDINGS * UNIT * condition * size
}

/// Where a polygon with these corners is met: their box, which grows on all sides by
/// a thousandth of its longest, rounded outward.
pub fn near_outline(points: &[[f64; 3]]) -> Bounds {
    let b = Bounds::of(points.iter().copied());
    let longest = (0..3).map(|k| b.max[k] - b.min[k]).fold(0.0, f64::max);
    let grown = b.grown(longest * 1e-3);
    Bounds {
        min: grown.min.map(|x| x.max(-f64::MAX)),
        max: grown.max.map(|x| x.min(f64::MAX)),
    }
}

/// About the mesh's centre.
pub fn about_center(mesh: &Mesh) -> Bounds {
    Bounds::of(mesh.positions.iter().map(|p| p.map(f64::from))).widened()
}

/// About the mesh's centre.
pub fn of_triangle(mesh: &Mesh, triangle: usize) -> Bounds {
    let corners = mesh.corners(triangle).map(|p| p.map(f64::from));
    Bounds::of(corners).widened()
}

/// The condition of a map and its inverse: how many times a rounding counts on
/// the other side.
pub fn condition(to: &Affine, from: &Affine) -> f64 {
    norm(to) * norm(from)
}

/// The box of a box under a map. `from` is the map's inverse only nearly, so the
/// box grows by how far the corners do not come back.
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
    let astray = corners
        .iter()
        .zip(&there)
        .map(|(p, q)| {
            let back = apply(from, *q);
            length(std::array::from_fn(|k| back[k] - p[k]))
        })
        .fold(0.0, f64::max);
    let bounds = Bounds::of(there);
    let roundings = ROUNDINGS * UNIT * condition(to, from) * bounds.max_abs();
    bounds.grown(4.0 * norm(to) * astray + roundings)
}

fn apply(m: &Affine, p: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|r| {
        m.linear()[0][r] * p[0]
            + m.linear()[1][r] * p[1]
            + m.linear()[2][r] * p[2]
            + m.translation[r]
    })
}

/// The Frobenius norm.
fn norm(m: &Affine) -> f64 {
    length(m.linear().map(length))
}
