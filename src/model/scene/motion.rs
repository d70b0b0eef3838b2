//! Transforms that move: keys over the time of a sequence, 0 to 1.
//!
//! At a key the matrix is the key's own, bit by bit. Between two keys every
//! element is interpolated linearly, `a·(1 − s) + b·s`; before the first key
//! comes the row's transform at time 0, after the last one nothing changes. So
//! points move along straight lines, and a turn needs a key every few degrees:
//! halfway between two keys that are an angle φ apart, what turns has shrunk to
//! cos(φ/2).
//!
//! The determinant is a cubic in s. Where the signs of its Bernstein
//! coefficients agree it has no root (a polynomial lies in the hull of its
//! coefficients); else the interval is halved until they do, or until a time is
//! left at which the motion is as good as singular: the check refuses it. Signs
//! count beyond rounding: half a turn only touches 0.

use super::ids::TransformId;
use crate::math::Affine;
use std::ops::Range;

/// Where something is at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Above 0, and at most 1.
    pub at: f64,
    /// `parent_from_child`.
    pub local: Affine,
}

/// The keys of all rows of [`Transforms`](super::Transforms) that move.
#[derive(Clone, Debug, Default)]
pub struct Motions {
    /// Rows of the transforms.
    pub of: Vec<TransformId>,
    /// Of each: its range of `keys`, the first at time 0.
    pub ranges: Vec<Range<u32>>,
    pub keys: Vec<Key>,
}

impl Motions {
    pub(super) fn push(&mut self, of: TransformId, start: Affine, keys: &[Key]) {
        let first = self.keys.len() as u32;
        self.keys.push(Key {
            at: 0.0,
            local: start,
        });
        self.keys.extend_from_slice(keys);
        self.of.push(of);
        self.ranges.push(first..self.keys.len() as u32);
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// The keys of a row of these.
    pub fn keys(&self, row: usize) -> &[Key] {
        let range = &self.ranges[row];
        &self.keys[range.start as usize..range.end as usize]
    }

    /// Those of a transform, where it moves.
    pub fn of_transform(&self, id: TransformId) -> Option<&[Key]> {
        // Rows are added in order.
        let row = self.of.binary_search(&id).ok()?;
        Some(self.keys(row))
    }

    /// Every transform that moves, as it is at a time.
    pub fn at(&self, time: f64) -> impl Iterator<Item = (TransformId, Affine)> {
        let rows = self.of.iter().enumerate();
        rows.map(move |(row, of)| (*of, between(self.keys(row), time)))
    }

    pub fn bytes(&self) -> usize {
        self.of.len() * (size_of::<TransformId>() + size_of::<Range<u32>>())
            + self.keys.len() * size_of::<Key>()
    }
}

/// What the keys say of a time; times outside take the nearest key's.
fn between(keys: &[Key], time: f64) -> Affine {
    let after = keys.partition_point(|key| key.at <= time);
    let (Some(a), Some(b)) = (keys.get(after.wrapping_sub(1)), keys.get(after)) else {
        // Before the first key, or from the last one on.
        let nearest = keys.get(after).or(keys.last());
        return nearest.map_or(Affine::IDENTITY, |key| key.local);
    };
    // At a itself, s is 0: what is taken is its own, also where b is infinite.
    if time == a.at {
        return a.local;
    }
    interpolate(&a.local, &b.local, (time - a.at) / (b.at - a.at))
}

fn interpolate(a: &Affine, b: &Affine, s: f64) -> Affine {
    let mix = |a: f64, b: f64| a * (1.0 - s) + b * s;
    let mix3 = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| mix(a[i], b[i]));
    Affine::new(
        std::array::from_fn(|c| mix3(a.linear()[c], b.linear()[c])),
        mix3(a.translation, b.translation),
    )
}

/// How short a stretch of a segment may get before it counts as a root.
const FINEST: f64 = 1.0 / (1 << 20) as f64;

/// A time between the keys at which the matrix is singular, or all but. The
/// keys' own matrices are regular.
pub(super) fn singular_time(keys: &[Key]) -> Option<f64> {
    keys.windows(2).find_map(|pair| {
        let (a, b) = (&pair[0], &pair[1]);
        if a.local.linear() == b.local.linear() {
            return None;
        }
        let s = root(determinant(&a.local, &b.local))?;
        Some(a.at + (b.at - a.at) * s)
    })
}

/// A number, and by how much its rounding may be off, at most.
#[derive(Clone, Copy)]
struct About {
    value: f64,
    error: f64,
}

impl About {
    fn half(x: About, y: About) -> About {
        let value = 0.5 * (x.value + y.value);
        About {
            value,
            error: 0.5 * (x.error + y.error) + value.abs() * f64::EPSILON,
        }
    }
}

/// Bernstein coefficients over s of the determinant of a·(1 − s) + b·s.
fn determinant(a: &Affine, b: &Affine) -> [About; 4] {
    // One scale for both keeps the products away from the ends of f64.
    let size = a.norm().max(b.norm());
    let [a, b] = [a, b].map(|m| m.linear().map(|c| c.map(|x| x / size)));
    let det = |x: [f64; 3], y: [f64; 3], z: [f64; 3]| {
        let terms = [
            (x[0], y[1] * z[2], y[2] * z[1]),
            (-x[1], y[0] * z[2], y[2] * z[0]),
            (x[2], y[0] * z[1], y[1] * z[0]),
        ];
        let value: f64 = terms.iter().map(|(x, p, q)| x * (p - q)).sum();
        let sizes = terms.map(|(x, p, q)| x.abs() * (p.abs() + q.abs()));
        // Scaled, two products, a difference, two sums; three and a third more.
        let error = 8.0 * f64::EPSILON * sizes.iter().sum::<f64>();
        About { value, error }
    };
    // The blossom: each column from one of the two, averaged over the ways.
    let mixed = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| {
        let ways = [
            det(b[0], a[1], a[2]),
            det(a[0], b[1], a[2]),
            det(a[0], a[1], b[2]),
        ];
        About {
            value: ways.iter().map(|way| way.value).sum::<f64>() / 3.0,
            error: ways.iter().map(|way| way.error).sum::<f64>() / 3.0,
        }
    };
    [
        det(a[0], a[1], a[2]),
        mixed(a, b),
        mixed(b, a),
        det(b[0], b[1], b[2]),
    ]
}

/// Where in [0, 1] a cubic is not shown to keep its sign.
fn root(cubic: [About; 4]) -> Option<f64> {
    let mut open = vec![(cubic, 0.0, 1.0)];
    while let Some((c, from, to)) = open.pop() {
        let above = c.iter().all(|x| x.value > x.error);
        if above || c.iter().all(|x| x.value < -x.error) {
            continue;
        }
        let middle = 0.5 * (from + to);
        if to - from <= FINEST {
            return Some(middle);
        }
        // De Casteljau.
        let half = About::half;
        let [l1, m, r2] = [half(c[0], c[1]), half(c[1], c[2]), half(c[2], c[3])];
        let (l2, r1) = (half(l1, m), half(m, r2));
        let mid = half(l2, r1);
        open.push(([mid, r1, r2, c[3]], middle, to));
        open.push(([c[0], l1, l2, mid], from, middle));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DVec3};

    fn key(at: f64, local: DAffine3) -> Key {
        Key {
            at,
            local: local.into(),
        }
    }

    fn turn(degrees: f64) -> DAffine3 {
        DAffine3::from_rotation_z(degrees.to_radians())
    }

    fn moved(x: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::X * x)
    }

    #[test]
    fn keys_are_met_exactly() {
        let keys: Vec<Key> = [0.0, 0.1, 0.3, 0.7, 1.0]
            .into_iter()
            .map(|at| key(at, turn(37.0 * at) * moved(at / 3.0)))
            .collect();
        for k in &keys {
            assert_eq!(between(&keys, k.at), k.local);
        }
        assert_eq!(between(&keys, -1.0), keys[0].local);
        assert_eq!(between(&keys, 2.0), keys[4].local);
        // One key, and it holds on.
        assert_eq!(between(&keys[..2], 0.9), keys[1].local);
    }

    #[test]
    fn every_element_goes_straight() {
        let keys = [key(0.0, moved(1.0)), key(0.5, moved(3.0))];
        assert_eq!(between(&keys, 0.25), moved(2.0).into());
        let keys = [key(0.0, turn(0.0)), key(1.0, turn(90.0))];
        let half = between(&keys, 0.5);
        assert!((half.linear()[0][0] - 0.5).abs() < 1e-15);
        assert!((half.linear()[0][1] - 0.5).abs() < 1e-15);
        assert_eq!(half.linear()[2], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn singular_times_are_found() {
        let time = |keys: &[Key]| singular_time(keys);
        let scaled = |x: f64| DAffine3::from_scale(DVec3::new(1.0, x, 1.0));
        // Through a mirror: at once, one sign becomes the other.
        let mirror = [key(0.0, scaled(1.0)), key(1.0, scaled(-3.0))];
        assert!((time(&mirror).unwrap() - 0.25).abs() < 1e-6);
        // Half a turn touches 0 and comes back.
        let half = [key(0.0, turn(0.0)), key(0.5, turn(180.0))];
        assert!((time(&half).unwrap() - 0.25).abs() < 1e-3);
        // About any axis, whichever way it is rounded.
        for i in 0..100 {
            let axis = DVec3::new(f64::from(i), 3.0, 7.0).normalize();
            let turn = |angle| DAffine3::from_axis_angle(axis, angle);
            let from = 0.1 * f64::from(i);
            let half = [
                key(0.0, turn(from)),
                key(1.0, turn(from + std::f64::consts::PI)),
            ];
            assert!((time(&half).unwrap() - 0.5).abs() < 1e-3, "{i}");
            let less = [key(0.0, turn(from)), key(1.0, turn(from + 3.1))];
            assert_eq!(time(&less), None, "{i}");
        }
        // A needle that only goes elsewhere, and one that turns.
        let needle = |x: f64, angle: f64| {
            moved(x) * turn(angle) * DAffine3::from_scale(DVec3::new(1e-7, 1e-7, 1.0))
        };
        assert_eq!(
            time(&[key(0.0, needle(0.0, 9.0)), key(1.0, needle(5.0, 9.0))]),
            None
        );
        assert_eq!(
            time(&[key(0.0, needle(0.0, 9.0)), key(1.0, needle(5.0, 50.0))]),
            None
        );
        let steps = [0.0, 60.0, 120.0, 179.0].map(|d| key(d / 180.0, turn(d)));
        assert_eq!(time(&steps), None);
        // Whatever the unit.
        for size in [1e-150, 1e150] {
            let by = DAffine3::from_scale(DVec3::splat(size));
            assert_eq!(time(&[key(0.0, by), key(1.0, by * turn(120.0))]), None);
            assert!(time(&[key(0.0, by), key(1.0, by * scaled(-1.0))]).is_some());
        }
        assert_eq!(time(&[key(0.0, scaled(1.0))]), None);
    }
}
