//! Bounding spheres of a tree's nodes, in columns of their own, and the intervals of rays in
//! them.
//!
//! Lengths are in units of R = δ/(32·u), where δ is the largest pad of the slabs. R is at
//! least the largest distance that the tree has from the ray's origin, so that no square
//! overflows or vanishes. A radius grown by 128·u, and an interval grown by 128·u in t, cover
//! the padded intervals of all entries below (docs/numerics/boxes.md, X15). A NaN radius
//! means everywhere.

use super::Volumes;
use crate::accel::baselines::bvh4::{Bvh4, Node, WIDTH};
use crate::accel::slabs::Slabs;
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb32, Vec3, round_up};
use glam::DVec3;

/// The spheres of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    center: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
}

/// The spheres of all nodes of a tree.
#[derive(Clone, Debug)]
pub struct Spheres {
    rows: Vec<Row>,
}

impl Spheres {
    /// Builds the spheres from the bottom up, each about the middle of its box and as small as
    /// the entries' boxes or the spheres below allow.
    pub(super) fn around(tree: &Bvh4, entry: impl Fn(usize) -> Aabb32) -> Spheres {
        let mut rows = vec![Row::default(); tree.nodes.len()];
        // Children come behind their parents.
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            for i in 0..node.count as usize {
                let own = Aabb32 {
                    min: std::array::from_fn(|k| node.min[k][i]),
                    max: std::array::from_fn(|k| node.max[k][i]),
                };
                let center = own.widened().center().to_array().map(|x| x as f32);
                let about = DVec3::from_array(center.map(f64::from));
                let radius = match node.child[i].leaf_range() {
                    Some(entries) => {
                        let reach = entries.map(|e| farthest(&entry(e), about));
                        reach.fold(0.0, f64::max)
                    }
                    None => {
                        let child = node.child[i].index();
                        debug_assert!(child > index);
                        let below: &Row = &rows[child];
                        let count = tree.nodes[child].count as usize;
                        let reach = (0..count).map(|j| {
                            let of = DVec3::from_array(below.center.map(|c| f64::from(c[j])));
                            (of - about).length() + f64::from(below.radius[j])
                        });
                        let over_spheres = reach.fold(0.0, f64::max);
                        let over_box = farthest(&own, about);
                        if over_spheres < over_box {
                            over_spheres
                        } else {
                            over_box
                        }
                    }
                };
                let row = &mut rows[index];
                for (column, x) in row.center.iter_mut().zip(center) {
                    column[i] = x;
                }
                // X15: grown by 16 roundings 2⁻⁵², then rounded up to f32.
                let radius = round_up(radius * (1.0 + 16.0 * f64::EPSILON));
                row.radius[i] = if radius.is_nan() {
                    f32::INFINITY
                } else {
                    radius
                };
            }
        }
        Spheres { rows }
    }
}

/// Returns the distance of a box's farthest point.
fn farthest(of: &Aabb32, from: DVec3) -> f64 {
    let of = of.widened();
    (of.max - from).abs().max((of.min - from).abs()).length()
}

/// The constants of a packet, in units of R.
#[derive(Clone, Copy, Debug)]
pub struct SphereConstants<L: Lanes> {
    org: Vec3<L>,
    /// The unit direction.
    dir: Vec3<L>,
    /// 1/R.
    shrink: L,
    /// The t of one R.
    pace: L,
}

impl Volumes for Spheres {
    type Constants<L: Lanes> = SphereConstants<L>;

    #[inline(always)]
    fn constants<L: Lanes>(slabs: &Slabs<L>) -> SphereConstants<L> {
        let (one, half) = (L::from_f32(1.0), L::from_f32(0.5));
        let axis = |(inv, low, high): (L, L, L)| {
            let dir = one / inv;
            let org = -((low + high) * half * dir);
            let pad = ((high - low) * half * dir).abs();
            (org, dir, pad)
        };
        let [x, y, z] = slabs.planes().map(axis);
        // X15.
        let unit = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(32.0);
        let pad = x.2.max(y.2).max(z.2);
        let shrink = unit / pad;
        let scaled = |v: Vec3<L>, by: L| Vec3::new(v.x * by, v.y * by, v.z * by);
        let dir = Vec3::new(x.1, y.1, z.1);
        let largest = dir.max_abs();
        let dir = scaled(dir, one / largest);
        let shorten = one / dir.length_squared().sqrt();
        SphereConstants {
            org: scaled(Vec3::new(x.0, y.0, z.0), shrink),
            dir: scaled(dir, shorten),
            shrink,
            // Divided one after the other, because the slabs ensure that this is a number, but
            // not that the product of both divisors is.
            pace: shorten / largest / shrink,
        }
    }

    #[inline(always)]
    fn interval<L: Lanes>(
        &self,
        of: &SphereConstants<L>,
        node: usize,
        _: &Node,
        child: usize,
    ) -> (L, L) {
        let row = &self.rows[node];
        // X15.
        let pad = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(128.0);
        let infinity = L::splat(L::Scalar::INFINITY);
        let center = |k: usize| L::from_f32(row.center[k][child]);
        let to = Vec3::new(
            center(0).mul_add(of.shrink, -of.org.x),
            center(1).mul_add(of.shrink, -of.org.y),
            center(2).mul_add(of.shrink, -of.org.z),
        );
        let middle = to.dot(of.dir);
        let aside = to - of.dir * middle;
        let radius = L::from_f32(row.radius[child]).mul_add(of.shrink, pad);
        let square = radius * radius - aside.length_squared();
        let missed = square.lt(L::zero());
        let square = L::select(square.le(infinity), square, infinity);
        let half = square.max(L::zero()).sqrt() + pad;
        let enter = (middle - half) * of.pace;
        let exit = (middle + half) * of.pace;
        (
            L::select(missed, infinity, enter),
            L::select(missed, -infinity, exit),
        )
    }

    fn bytes(&self) -> usize {
        self.rows.len() * size_of::<Row>()
    }
}
