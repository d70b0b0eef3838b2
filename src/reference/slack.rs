//! Slack: how far apart ends of operands may lie along a line and still be one event, in
//! f64 (docs/SPEC.md, S47 to S50).

use super::approx::{Approx, Undecided};
use super::bounds::max_abs;
use super::csg::Frame;
use super::dyadic::Dyadic;
use super::number::Number;
use super::ray::{dot, length};
use super::root::Root;
use super::rounding;
use crate::math::Affine;
use std::convert::Infallible;

/// The placement error of a frame: 16 roundings 2⁻⁵² (O4, S49).
const PLACEMENT: f64 = 16.0 * f64::EPSILON;

/// The least sine of the angle between a ray and a surface that a rate counts with (S48).
const LEAST_RATE: f64 = 1.0 / (1_u64 << 26) as f64;

/// The rate and the size of an end, from which its slack follows.
pub struct Reach {
    /// The rate of the end: how fast the ray leaves the surface (S48).
    pub rate: f64,
    /// The largest coordinate of the ray's origin and of the end itself, in the solid's
    /// space.
    pub coordinate: f64,
}

/// What an end's slack is made of, as differences of t.
#[derive(Clone, Copy, Debug)]
pub struct Slack {
    pub operand: usize,
    pub frame: usize,
    pub placement: f64,
    pub tolerance: f64,
}

/// Returns the rate |n·d|/|n| of a ray at a surface with this normal, at least 2⁻²⁶|d|
/// (S48).
pub fn rate(normal: [f64; 3], dir: [f64; 3]) -> f64 {
    let rate = dot(normal, dir).abs() / length(normal);
    f64::max(rate, length(dir) * LEAST_RATE)
}

/// Returns how far, in t, the roundings of a frame may move an end (S49).
pub fn placement(frame: &Frame, reach: &Reach) -> f64 {
    let (to, from) = (&frame.operand_from_solid, &frame.solid_from_operand);
    let shift = max_abs(to.translation.iter());
    let carried = row_norm(to) * reach.coordinate + shift;
    PLACEMENT * (row_norm(from) * carried + frame.reach) / reach.rate
}

impl Slack {
    /// Returns the slack between two ends (S49, S50). Ends of one operand have no
    /// tolerance, but their placements count: a solid that is thinner than its ends are
    /// known may not be met at all. In one frame only the tolerance counts, because
    /// differences there are exact.
    pub fn with(&self, other: &Slack) -> f64 {
        let placements = self.placement + other.placement;
        if self.operand == other.operand {
            return placements;
        }
        let tolerance = f64::max(self.tolerance, other.tolerance);
        if self.frame == other.frame {
            tolerance
        } else {
            f64::max(tolerance, placements)
        }
    }
}

/// Returns the largest row sum of magnitudes.
fn row_norm(m: &Affine) -> f64 {
    (0..3)
        .map(|r| m.linear()[0][r].abs() + m.linear()[1][r].abs() + m.linear()[2][r].abs())
        .fold(0.0, f64::max)
}

/// Numbers whose roots can be compared with a slack.
pub trait Measured: Number {
    /// Returns a root in f64.
    fn about(t: &Root<Self>) -> f64;
    /// Says whether the second root lies at most `slack` behind the first.
    fn is_within(a: &Root<Self>, b: &Root<Self>, slack: f64) -> Result<bool, Self::Undecided>;
}

impl Measured for Approx {
    fn about(t: &Root<Approx>) -> f64 {
        t.value().value
    }

    /// Undecided within a factor of two of the slack, because the slack is itself rounded.
    fn is_within(a: &Root<Approx>, b: &Root<Approx>, slack: f64) -> Result<bool, Undecided> {
        let gap = b.value() - a.value();
        if gap.hi() <= slack * 0.5 {
            Ok(true)
        } else if gap.lo() > slack * 2.0 {
            Ok(false)
        } else {
            Err(Undecided)
        }
    }
}

impl Measured for Dyadic {
    fn about(t: &Root<Dyadic>) -> f64 {
        rounding::nearest(t)
    }

    fn is_within(a: &Root<Dyadic>, b: &Root<Dyadic>, slack: f64) -> Result<bool, Infallible> {
        Ok(rounding::nearest(b) - rounding::nearest(a) <= slack)
    }
}
