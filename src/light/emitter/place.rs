//! Rows of emitters as the sampling routines take them: one emitter a lane, relative to the
//! point that it lights.

use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::Lanes;

/// How near a flat emitter's plane a point lies in it, relative to the emitter's distance or
/// extent, whichever is more. There it gets no light, whatever rounding makes of the height:
/// else an emitter with shading normals would shine on itself.
pub const IN_PLANE: f32 = 1e-9;

/// The geometry of one emitter in f64.
///
/// | kind | `origin` | `u` | `v` | `n` | `s` | `t` |
/// |---|---|---|---|---|---|---|
/// | sphere, point | centre | – | – | – | radius | – |
/// | spot | centre | – | – | unit axis | radius | – |
/// | triangle | corner | edge | edge | u × v | – | – |
/// | rectangle, panel | corner | unit edge | unit edge | u × v | length of u | length of v |
/// | disc | centre | unit tangent | unit tangent | unit normal | radius | – |
/// | sun | – | unit tangent | unit tangent | unit direction to it | 1 − cos(angle) | – |
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    pub origin: [f64; 3],
    pub u: [f64; 3],
    pub v: [f64; 3],
    pub n: [f64; 3],
    pub s: f64,
    pub t: f64,
}

/// The row of what has none.
static NOWHERE: Row = Row {
    origin: [0.0; 3],
    u: [0.0; 3],
    v: [0.0; 3],
    n: [0.0, 0.0, 1.0],
    s: 0.0,
    t: 0.0,
};

/// A [`Row`] per lane; `origin` is relative to the lane's point.
#[derive(Clone, Copy, Debug)]
pub struct Place<L: Lanes> {
    pub origin: Vec3<L::Double>,
    pub u: Vec3<L::Double>,
    pub v: Vec3<L::Double>,
    pub n: Vec3<L::Double>,
    pub s: L::Double,
    pub t: L::Double,
}

impl<L: Lanes> Place<L> {
    /// Gathers the rows of ids; ids past the last row take [`NOWHERE`].
    #[inline(always)]
    pub fn gather(rows: &[Row], ids: L::Ids, point: Vec3<L::Double>) -> Place<L> {
        let ids = ids.as_ref();
        let first = ids[0];
        if ids.iter().all(|&id| id == first) {
            return Place::same(row(rows, first), point);
        }
        let row = |i: usize| row(rows, ids[i]);
        let number = |of: &dyn Fn(&Row) -> f64| {
            let mut lanes = L::Double::splat(0.0).to_array();
            for (i, x) in lanes.as_mut().iter_mut().enumerate() {
                *x = of(row(i));
            }
            L::Double::load(lanes.as_ref())
        };
        Place {
            origin: Vec3::of_lanes(|i| row(i).origin) - point,
            u: Vec3::of_lanes(|i| row(i).u),
            v: Vec3::of_lanes(|i| row(i).v),
            n: Vec3::of_lanes(|i| row(i).n),
            s: number(&|row| row.s),
            t: number(&|row| row.t),
        }
    }

    /// Repeats one row in all lanes.
    #[inline(always)]
    pub fn same(row: &Row, point: Vec3<L::Double>) -> Place<L> {
        Place {
            origin: Vec3::<L::Double>::splat(row.origin) - point,
            u: Vec3::splat(row.u),
            v: Vec3::splat(row.v),
            n: Vec3::splat(row.n),
            s: L::Double::splat(row.s),
            t: L::Double::splat(row.t),
        }
    }
}

#[inline(always)]
fn row(rows: &[Row], id: u32) -> &Row {
    rows.get(id as usize).unwrap_or(&NOWHERE)
}

/// Rounds a vector to f32 lanes.
#[inline(always)]
pub fn narrow<L: Lanes>(v: Vec3<L::Double>) -> Vec3<L> {
    Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z))
}
