//! Bounding spheres of a tree's nodes, in columns of their own, and where rays
//! are inside them.
//!
//! Lengths are measured in R = δ/(32·u), δ the largest pad of the slabs': no less
//! than the largest distance from the ray's origin that the tree has, so that no
//! square overflows or vanishes. A t in the padded interval of an entry's box lies,
//! on each axis, within 32·u·R of the box by [`Slabs`], and 6·u·R for its
//! roundings; so within √3·38·u < 66·u of the sphere. Origin and direction are
//! recovered from the slabs' constants (some 9·u), and the distance of the centre
//! from the ray comes with another 18·u. A radius grown by 128·u therefore covers
//! every such t, with more than 30·u to spare, which is more than the rounding of
//! r² − d², whose terms are at most 4 and which grows by twice r·30·u. The half
//! chord is then at least the true one, and the pad of 128·u in t covers the
//! products that lead there, each at most 4 and rounded less than 10 times. NaN
//! means everywhere.

use super::Volumes;
use crate::accel::baselines::bvh4::{Bvh4, Node, WIDTH};
use crate::accel::slabs::Slabs;
use crate::math::lanes::{Lanes, Scalar};
use crate::math::{Aabb32, Vec3, round_up};
use glam::DVec3;

/// One node's.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    center: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
}

/// By node and child of a tree.
#[derive(Clone, Debug)]
pub struct Spheres {
    rows: Vec<Row>,
}

impl Spheres {
    /// Bottom up: about the middle of each box, as small as the entries' boxes
    /// or the spheres below allow.
    pub(super) fn around(tree: &Bvh4, entry: impl Fn(usize) -> Aabb32) -> Spheres {
        let mut rows = vec![Row::default(); tree.nodes.len()];
        // Children stand behind their parents.
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
                // Some roundings of f64 outward, then to f32.
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

/// The distance of the box's farthest point.
fn farthest(of: &Aabb32, from: DVec3) -> f64 {
    let of = of.widened();
    (of.max - from).abs().max((of.min - from).abs()).length()
}

/// A packet's, in units of R.
#[derive(Clone, Copy, Debug)]
pub struct SphereConstants<L: Lanes> {
    org: Vec3<L>,
    /// Unit.
    dir: Vec3<L>,
    /// 1/R.
    shrink: L,
    /// t of one R.
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
            // One after the other: slabs see to it that this is a number, but not to what
            // the two are together.
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
