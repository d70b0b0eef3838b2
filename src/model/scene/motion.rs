//! Transforms that move: keys over the time of a sequence, from 0 to 1.
//!
//! At a key the matrix is the key's own, bit by bit. Before the first key comes the row's
//! transform at time 0; after the last key nothing changes, nor before time 0. Between two keys
//! a linear row has every element interpolated, `a·(1 − s) + b·s`. So points move along
//! straight lines, and a rotation needs a key every few degrees: halfway between two keys that
//! are an angle φ apart, a rotated shape has shrunk to cos(φ/2). A rigid row turns evenly
//! instead (`rigid.rs`).
//!
//! The determinant of a linear row is a cubic in s. Where the signs of its Bernstein coefficients agree it
//! has no root, because a polynomial lies in the hull of its coefficients. Otherwise the
//! interval is halved until they agree, or until a time is left at which the motion is
//! singular to within rounding, which the scene's check refuses
//! (docs/numerics/transforms.md, A4). Signs count beyond rounding, because half a turn only
//! touches 0.

use super::ids::TransformId;
use super::rigid::Pose;
use crate::math::Affine;
use std::ops::Range;

/// A transform at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// The time, above 0 and at most 1.
    pub at: f64,
    /// The transform `parent_from_child`.
    pub local: Affine,
}

/// How a transform goes from key to key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Every element of the matrix goes straight.
    #[default]
    Linear,
    /// Translation and stretch go straight, and what turns turns evenly, less than half a turn
    /// from key to key.
    Rigid,
}

/// Stands for the poses of rows that have none.
const NO_POSES: u32 = u32::MAX;

/// The keys of all rows of [`Transforms`](super::Transforms) that move.
#[derive(Clone, Debug, Default)]
pub struct Motions {
    /// The rows of the transforms that move.
    pub of: Vec<TransformId>,
    /// Per row: its range of `keys`, with the first key at time 0.
    pub ranges: Vec<Range<u32>>,
    pub keys: Vec<Key>,
    /// Per row: the first of its `poses`, one a key, if it is rigid.
    first_pose: Vec<u32>,
    poses: Vec<Pose>,
}

impl Motions {
    pub(super) fn push(
        &mut self,
        of: TransformId,
        start: Affine,
        keys: &[Key],
        interpolation: Interpolation,
    ) {
        let first = self.keys.len() as u32;
        self.keys.push(Key {
            at: 0.0,
            local: start,
        });
        self.keys.extend_from_slice(keys);
        self.of.push(of);
        self.ranges.push(first..self.keys.len() as u32);
        self.first_pose.push(match interpolation {
            Interpolation::Linear => NO_POSES,
            Interpolation::Rigid => self.poses.len() as u32,
        });
        if interpolation == Interpolation::Rigid {
            let keys = &self.keys[first as usize..];
            self.poses
                .extend(keys.iter().map(|key| Pose::of(&key.local)));
        }
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Returns the keys of a row of this table.
    pub fn keys(&self, row: usize) -> &[Key] {
        let range = &self.ranges[row];
        &self.keys[range.start as usize..range.end as usize]
    }

    /// Returns the poses of a row's keys, none if it is linear.
    fn poses(&self, row: usize) -> &[Pose] {
        match self.first_pose[row] {
            NO_POSES => &[],
            first => &self.poses[first as usize..][..self.ranges[row].len()],
        }
    }

    /// Says whether a row is interpolated rigidly.
    pub fn is_rigid(&self, row: usize) -> bool {
        self.first_pose[row] != NO_POSES
    }

    /// Returns the row of a transform, if it moves.
    pub fn row_of(&self, id: TransformId) -> Option<usize> {
        // Rows are added in rising order.
        self.of.binary_search(&id).ok()
    }

    /// Lists every transform that moves, with its matrix at a time.
    pub fn at(&self, time: f64) -> impl Iterator<Item = (TransformId, Affine)> {
        let rows = self.of.iter().enumerate();
        rows.map(move |(row, of)| (*of, self.row_at(row, time)))
    }

    /// Returns the matrix of a row of this table at a time.
    pub fn row_at(&self, row: usize, time: f64) -> Affine {
        between(self.keys(row), self.poses(row), time)
    }

    /// Returns a time between a row's keys at which its matrix is singular to within rounding.
    /// The keys' own matrices are regular.
    pub(super) fn singular_time(&self, row: usize) -> Option<f64> {
        let keys = self.keys(row);
        match self.poses(row) {
            [] => singular_time(keys),
            poses => {
                let turns_over = |pair: &[Pose]| pair[0].mirrors() != pair[1].mirrors();
                let from = poses.windows(2).position(turns_over)?;
                Some(0.5 * (keys[from].at + keys[from + 1].at))
            }
        }
    }

    pub fn bytes(&self) -> usize {
        self.of.len() * (size_of::<TransformId>() + size_of::<Range<u32>>() + size_of::<u32>())
            + self.keys.len() * size_of::<Key>()
            + self.poses.len() * size_of::<Pose>()
    }
}

/// Interpolates the keys at a time, rigidly if they have poses; times outside take the nearest
/// key's matrix.
fn between(keys: &[Key], poses: &[Pose], time: f64) -> Affine {
    let after = keys.partition_point(|key| key.at <= time);
    let (Some(a), Some(b)) = (keys.get(after.wrapping_sub(1)), keys.get(after)) else {
        // Before the first key, or from the last one on.
        let nearest = keys.get(after).or(keys.last());
        return nearest.map_or(Affine::IDENTITY, |key| key.local);
    };
    // At the time of a the matrix is a's own, also where b is infinite.
    if time == a.at {
        return a.local;
    }
    let s = (time - a.at) / (b.at - a.at);
    let straight = interpolate(&a.local, &b.local, s);
    match poses {
        [] => straight,
        _ => Affine::new(
            poses[after - 1].towards(&poses[after], s),
            straight.translation,
        ),
    }
}

fn interpolate(a: &Affine, b: &Affine, s: f64) -> Affine {
    let mix = |a: f64, b: f64| a * (1.0 - s) + b * s;
    let mix3 = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| mix(a[i], b[i]));
    Affine::new(
        std::array::from_fn(|c| mix3(a.linear()[c], b.linear()[c])),
        mix3(a.translation, b.translation),
    )
}

/// The length of a part of a segment below which a possible root counts as one.
const FINEST: f64 = 1.0 / (1 << 20) as f64;

/// Returns a time at which keys that are interpolated linearly give a singular matrix.
fn singular_time(keys: &[Key]) -> Option<f64> {
    keys.windows(2).find_map(|pair| {
        let (a, b) = (&pair[0], &pair[1]);
        if a.local.linear() == b.local.linear() {
            return None;
        }
        let s = root(determinant(&a.local, &b.local))?;
        Some(a.at + (b.at - a.at) * s)
    })
}

/// A number and a bound on its rounding error.
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
            // One rounding of the mean (A4).
            error: 0.5 * (x.error + y.error) + value.abs() * f64::EPSILON,
        }
    }
}

/// Returns the Bernstein coefficients over s of the determinant of a·(1 − s) + b·s.
fn determinant(a: &Affine, b: &Affine) -> [About; 4] {
    // One scale for both matrices keeps the products away from the ends of f64's range.
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
        // Eight roundings 2⁻⁵² (A4): the scaling, two products, a difference and two sums;
        // and three and a third for the mean below.
        let error = 8.0 * f64::EPSILON * sizes.iter().sum::<f64>();
        About { value, error }
    };
    // The blossom takes each column from one of the two matrices, and averages the ways to
    // do so.
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

/// Returns an s in [0, 1] near which a cubic is not shown to keep its sign.
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
        // De Casteljau's subdivision at the middle.
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
            assert_eq!(between(&keys, &[], k.at), k.local);
        }
        assert_eq!(between(&keys, &[], -1.0), keys[0].local);
        assert_eq!(between(&keys, &[], 2.0), keys[4].local);
        // A single key holds until the end.
        assert_eq!(between(&keys[..2], &[], 0.9), keys[1].local);
    }

    #[test]
    fn every_element_goes_straight() {
        let keys = [key(0.0, moved(1.0)), key(0.5, moved(3.0))];
        assert_eq!(between(&keys, &[], 0.25), moved(2.0).into());
        let keys = [key(0.0, turn(0.0)), key(1.0, turn(90.0))];
        let half = between(&keys, &[], 0.5);
        assert!((half.linear()[0][0] - 0.5).abs() < 1e-15);
        assert!((half.linear()[0][1] - 0.5).abs() < 1e-15);
        assert_eq!(half.linear()[2], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn rigid_keys_are_met_exactly_and_turn_evenly() {
        let keys: Vec<Key> = [0.2, 0.5, 1.0]
            .into_iter()
            .map(|at| key(at, turn(170.0 * at) * moved(at / 3.0)))
            .collect();
        let mut motions = Motions::default();
        let start = turn(-90.0).into();
        motions.push(TransformId(1), start, &keys, Interpolation::Rigid);
        let at = |time| motions.at(time).next().unwrap().1;
        for k in motions.keys(0) {
            assert_eq!(at(k.at), k.local);
        }
        assert_eq!(at(-3.0), start);
        assert_eq!(at(2.0), keys[2].local);
        let expected: Affine = turn(170.0 * 0.75).into();
        for c in 0..3 {
            for r in 0..3 {
                let (is, should) = (at(0.75).linear()[c][r], expected.linear()[c][r]);
                assert!((is - should).abs() < 1e-15, "{c} {r}");
            }
        }
        assert_eq!(motions.singular_time(0), None);
        let mirror = DAffine3::from_scale(DVec3::new(1.0, 1.0, -2.0));
        let keys = [key(0.5, turn(180.0)), key(1.0, mirror)];
        motions.push(TransformId(2), start, &keys, Interpolation::Rigid);
        assert_eq!(motions.singular_time(1), Some(0.75));
    }

    #[test]
    fn singular_times_are_found() {
        let time = |keys: &[Key]| singular_time(keys);
        let scaled = |x: f64| DAffine3::from_scale(DVec3::new(1.0, x, 1.0));
        // A motion through a mirror image: the determinant changes its sign.
        let mirror = [key(0.0, scaled(1.0)), key(1.0, scaled(-3.0))];
        assert!((time(&mirror).unwrap() - 0.25).abs() < 1e-6);
        // Half a turn touches 0 and comes back.
        let half = [key(0.0, turn(0.0)), key(0.5, turn(180.0))];
        assert!((time(&half).unwrap() - 0.25).abs() < 1e-3);
        // Half a turn about any axis, whichever way it is rounded.
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
        // A needle that is only moved, and one that is rotated.
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
        // The same in any unit of length.
        for size in [1e-150, 1e150] {
            let by = DAffine3::from_scale(DVec3::splat(size));
            assert_eq!(time(&[key(0.0, by), key(1.0, by * turn(120.0))]), None);
            assert!(time(&[key(0.0, by), key(1.0, by * scaled(-1.0))]).is_some());
        }
        assert_eq!(time(&[key(0.0, scaled(1.0))]), None);
    }
}
