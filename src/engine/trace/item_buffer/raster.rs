//! Projection of directions and boxes to the picture plane of an item buffer.
//!
//! Three covectors a, b, w project a direction d to u = a·d / w·d and v = b·d / w·d. Points
//! relative to the origin are projected in the same way, so a ray that hits a box has its
//! (u, v) within the rectangle around the box's eight projected corners. In the space of a
//! placed mesh the covectors are those of the world after `world_from_object`; their residual
//! against `object_from_world`, which defines the rays, is computed.
//!
//! Rectangles are conservative (X16): boxes grow by the pad of [`crate::accel::Slabs`] at f32,
//! rectangles by the rounding of their own arithmetic, and a box that is not wholly in front
//! of the origin covers everything.

use crate::accel::{BoxRow, SKEW, WIDE};
use crate::math::lanes::{Lanes, Mask, Register, max, min};
use crate::math::{Aabb32, Affine, unit};
use glam::{DMat3, DVec3};

/// u, the unit roundoff of f32.
const ROUNDING: f32 = 0.5 * f32::EPSILON;

/// Least w of a direction relative to its largest component (X16); other rays are traced
/// through the trees.
const LEAST_AHEAD: f32 = 1.0 / 16.0;

/// A rectangle of (u, v): least and greatest value of each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    pub u: [f32; 2],
    pub v: [f32; 2],
}

impl Rect {
    /// The empty rectangle.
    pub const EMPTY: Rect = Rect {
        u: [f32::INFINITY, f32::NEG_INFINITY],
        v: [f32::INFINITY, f32::NEG_INFINITY],
    };

    #[inline(always)]
    pub fn meets(&self, other: &Rect) -> bool {
        (self.u[0] <= other.u[1])
            & (other.u[0] <= self.u[1])
            & (self.v[0] <= other.v[1])
            & (other.v[0] <= self.v[1])
    }

    #[inline(always)]
    pub fn contains(&self, other: &Rect) -> bool {
        (self.u[0] <= other.u[0])
            & (other.u[1] <= self.u[1])
            & (self.v[0] <= other.v[0])
            & (other.v[1] <= self.v[1])
    }

    /// Returns the smallest rectangle around both.
    #[inline(always)]
    pub fn around(&self, other: &Rect) -> Rect {
        let both = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Rect {
            u: both(self.u, other.u),
            v: both(self.v, other.v),
        }
    }

    /// Grows by the rounding of a direction and of its projection: of three products of at most
    /// w / [`LEAST_AHEAD`] each, and of the quotient (X16).
    #[inline(always)]
    pub fn grown(&self) -> Rect {
        let slack = |x: f32| (1.0 + x.abs()) * (16.0 / LEAST_AHEAD * ROUNDING);
        let grow = |[a, b]: [f32; 2]| [a - slack(a), b + slack(b)];
        Rect {
            u: grow(self.u),
            v: grow(self.v),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.u[0] > self.u[1]
    }
}

/// The projection of directions in world space.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    pub org: [f64; 3],
    /// a, b, w: orthonormal, rounded.
    covectors: [[f32; 3]; 3],
}

impl Raster {
    /// Makes a projection. `ahead`: direction of the middle of the rays. `across`: direction in
    /// which u rises, along rows of pixels. Neither needs to be unit, and no answer depends
    /// on them.
    pub fn new(org: [f64; 3], ahead: DVec3, across: DVec3) -> Option<Raster> {
        let w = unit(ahead);
        if w == DVec3::ZERO || !org.iter().all(|x| x.is_finite()) {
            return None;
        }
        let across = unit(across);
        let level = across - w * across.dot(w);
        let a = if level.length_squared() > 1e-12 {
            unit(level)
        } else {
            w.any_orthonormal_vector()
        };
        let b = w.cross(a);
        Some(Raster {
            org,
            covectors: [a, b, w].map(|c| c.to_array().map(|x| x as f32)),
        })
    }

    /// Returns the rectangle around directions in columns of whole registers, without error
    /// bounds; `None` if one of them is too far from `ahead`.
    #[inline(always)]
    pub fn rect(&self, dirs: [&[f32]; 3]) -> Option<Rect> {
        let infinite = Register::splat(f32::INFINITY);
        let (mut low, mut high) = ([infinite; 2], [-infinite; 2]);
        let mut fits = <Register as Lanes>::Mask::splat(true);
        let [ca, cb, cw] = self.covectors.map(|c| c.map(Register::splat));
        for first in (0..dirs[0].len()).step_by(WIDE) {
            let [x, y, z] = dirs.map(|column| Register::load(&column[first..]));
            let along = |c: &[Register; 3]| c[0] * x + c[1] * y + c[2] * z;
            let w = along(&cw);
            let largest = max(max(x.abs(), y.abs()), z.abs());
            fits = fits
                & w.ge(largest * Register::splat(LEAST_AHEAD))
                & w.gt(Register::splat(1e-30))
                & w.lt(Register::splat(1e30));
            let inv = Register::splat(1.0) / w;
            for (i, along) in [along(&ca), along(&cb)].into_iter().enumerate() {
                let at = along * inv;
                low[i] = min(low[i], at);
                high[i] = max(high[i], at);
            }
        }
        if fits.bits().count_ones() as usize != WIDE {
            return None;
        }
        Some(Rect {
            u: [low[0].least(), high[0].greatest()],
            v: [low[1].least(), high[1].greatest()],
        })
    }
}

/// The projection of boxes of one space.
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    /// Rounded to f32; the pad covers it.
    org: [f32; 3],
    pad: [f32; 3],
    covectors: [[f32; 3]; 3],
    /// Bounds of the difference between a ray's numerators, or denominator, and those of the
    /// world's raster, relative to the denominator: of u, v and w.
    misfit: [f32; 3],
}

/// Rectangles of a row of boxes, and the nearest w of each box.
pub struct Projected {
    pub u: [[f32; WIDE]; 2],
    pub v: [[f32; WIDE]; 2],
    pub near: [f32; WIDE],
}

impl Projection {
    /// Makes the projection of boxes in world space, relative to `center`. `bounds`: around all
    /// boxes.
    pub fn for_world(raster: &Raster, center: DVec3, bounds: &Aabb32) -> Projection {
        let org = DVec3::from_array(raster.org) - center;
        let org = org.to_array().map(|x| x as f32);
        Projection {
            org,
            pad: pad(org, bounds),
            covectors: raster.covectors,
            misfit: [0.0; 3],
        }
    }

    /// Makes the projection of boxes of a placed mesh, relative to its `center`.
    pub fn for_object(
        raster: &Raster,
        object_from_world: &Affine,
        center: DVec3,
        bounds: &Aabb32,
    ) -> Projection {
        let map = object_from_world;
        let org = DVec3::from_array(map.point(raster.org)) - center;
        let org = org.to_array().map(|x| x as f32);
        let forward = DMat3::from_cols_array_2d(map.linear());
        let back = forward.inverse().transpose();
        let world = raster
            .covectors
            .map(|c| DVec3::from_array(c.map(f64::from)));
        let exact = world.map(|c| back * c);
        // A common factor cancels in the quotients. The constants below are those of X16.
        let scale = exact[2].abs().max_element().recip();
        let covectors = exact.map(|c| (c * scale).to_array().map(|x| x as f32));
        let ahead = scale * f64::from(LEAST_AHEAD);
        let misfit = std::array::from_fn(|i| {
            let c = DVec3::from_array(covectors[i].map(f64::from));
            let residual = forward.transpose() * c - world[i] * scale;
            let rounded = c.abs().dot(row_sums(map)) * f64::from(4.0 * ROUNDING);
            let against = |v: DVec3| v.abs().element_sum();
            (2.0 * (against(residual) + rounded) / ahead) as f32
        });
        Projection {
            org,
            pad: pad(org, bounds),
            covectors,
            misfit,
        }
    }

    /// Returns rectangles that contain the projections of a row of boxes.
    #[inline(always)]
    pub fn row(&self, row: &BoxRow) -> Projected {
        let splat = |x: f32| Register::splat(x);
        let side = |k: usize, s: usize| {
            let to = if s == 0 { -self.pad[k] } else { self.pad[k] };
            Register::load(&row.bounds[k][s]) - splat(self.org[k]) + splat(to)
        };
        let sides = [
            [side(0, 0), side(0, 1)],
            [side(1, 0), side(1, 1)],
            [side(2, 0), side(2, 1)],
        ];
        let size = |k: usize| max(sides[k][0].abs(), sides[k][1].abs());
        let sizes = [size(0), size(1), size(2)];
        // Products of a covector with both sides, and the sum of their magnitudes.
        let products = |c: [f32; 3]| {
            let at = |k: usize, s: usize| sides[k][s] * splat(c[k]);
            let most = |k: usize| sizes[k] * splat(c[k].abs());
            (
                [
                    [at(0, 0), at(0, 1)],
                    [at(1, 0), at(1, 1)],
                    [at(2, 0), at(2, 1)],
                ],
                most(0) + most(1) + most(2),
            )
        };
        let (a, a_size) = products(self.covectors[0]);
        let (b, b_size) = products(self.covectors[1]);
        let (w, w_size) = products(self.covectors[2]);
        let infinite = splat(f32::INFINITY);
        let (mut u, mut v) = ([infinite, -infinite], [infinite, -infinite]);
        let mut ahead = [infinite, -infinite];
        for corner in 0..8 {
            let (i, j, k) = (corner & 1, corner >> 1 & 1, corner >> 2);
            let sum = |p: &[[Register; 2]; 3]| p[0][i] + p[1][j] + p[2][k];
            let w = sum(&w);
            ahead = [min(ahead[0], w), max(ahead[1], w)];
            let inv = splat(1.0) / w;
            let (at_u, at_v) = (sum(&a) * inv, sum(&b) * inv);
            u = [min(u[0], at_u), max(u[1], at_u)];
            v = [min(v[0], at_v), max(v[1], at_v)];
        }
        // Errors of w, of sums and of quotients (X16).
        let wrong = w_size * splat(8.0 * ROUNDING);
        let least = ahead[0] - wrong;
        let sound = self.misfit[2] < 0.5 && self.covectors.iter().flatten().all(|x| x.is_finite());
        let behind =
            (ahead[1] + wrong).lt(Register::zero()) & <Register as Lanes>::Mask::splat(sound);
        let beside = least.gt(Register::zero());
        let grow = |[low, high]: [Register; 2], size: Register, misfit: f32| {
            let most = max(low.abs(), high.abs());
            let sums = (size + most * w_size) * splat(32.0 * ROUNDING) / least;
            let own = splat(misfit) + most * splat(self.misfit[2] + 8.0 * ROUNDING);
            let slack = sums + own;
            // A box without a finite bound covers everything.
            let sure = beside & slack.lt(infinite);
            let bound = |x: Register, all: Register| {
                let x = <Register as Lanes>::select(sure, x, all);
                <Register as Lanes>::select(behind, -all, x)
            };
            [
                bound(low - slack, -infinite).to_array(),
                bound(high + slack, infinite).to_array(),
            ]
        };
        let misfit = |i: usize| if sound { self.misfit[i] } else { f32::INFINITY };
        Projected {
            u: grow(u, a_size, misfit(0)),
            v: grow(v, b_size, misfit(1)),
            near: max(least, Register::zero()).to_array(),
        }
    }
}

/// Returns the padding of [`crate::accel::Frustum`] (B16).
fn pad(org: [f32; 3], bounds: &Aabb32) -> [f32; 3] {
    let reach: [f32; 3] = std::array::from_fn(|k| {
        let (low, high) = (bounds.min[k] - org[k], bounds.max[k] - org[k]);
        low.abs().max(high.abs()).max(org[k].abs())
    });
    let most = reach[0].max(reach[1]).max(reach[2]);
    reach.map(|r| r * (32.0 * f32::EPSILON) + most * SKEW as f32 + f32::MIN_POSITIVE)
}

/// Returns the row sums of the magnitudes of a map's linear part.
fn row_sums(map: &Affine) -> DVec3 {
    let row = |r: usize| map.linear().iter().map(|column| column[r].abs()).sum();
    DVec3::new(row(0), row(1), row(2))
}
