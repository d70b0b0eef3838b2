//! How far ends of operands may lie apart along a line and be one: definitions of
//! docs/NUMERICS.md, in f64.

use super::approx::{Approx, Doubt};
use super::bounds::max_abs;
use super::combination::Frame;
use super::dyadic::Dyadic;
use super::number::Number;
use super::ray::{dot, length};
use super::root::Root;
use super::rounding;
use crate::math::Affine;
use std::convert::Infallible;

/// Roundings that a frame's numbers carry.
const PLACEMENT: f64 = 16.0 * f64::EPSILON;

/// The least sine of the angle between a ray and a surface that counts.
const LEAST_SINE: f64 = 1.0 / (1_u64 << 26) as f64;

/// What is known of an end.
pub struct Reach {
    /// How fast the surface is left in t.
    pub speed: f64,
    /// The largest coordinate of the ray's origin and of the end itself.
    pub coordinate: f64,
}

/// In t.
#[derive(Clone, Copy, Debug)]
pub struct Slack {
    pub operand: usize,
    pub frame: usize,
    pub placement: f64,
    pub tolerance: f64,
}

/// Of a surface, by its normal, along a ray.
pub fn speed(normal: [f64; 3], dir: [f64; 3]) -> f64 {
    let speed = dot(normal, dir).abs() / length(normal);
    f64::max(speed, length(dir) * LEAST_SINE)
}

/// What roundings of the frame move an end by.
pub fn placement(frame: &Frame, reach: &Reach) -> f64 {
    let (to, from) = (&frame.operand_from_solid, &frame.solid_from_operand);
    let shift = max_abs(to.translation.iter());
    let carried = row_norm(to) * reach.coordinate + shift;
    PLACEMENT * (row_norm(from) * carried + frame.reach) / reach.speed
}

impl Slack {
    /// Of two ends. In one frame what differs does so exactly; but what is no
    /// thicker than its own ends are known, may not be met at all. A tolerance is
    /// one between operands.
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

/// The largest sum of magnitudes in a row.
fn row_norm(m: &Affine) -> f64 {
    (0..3)
        .map(|r| m.linear()[0][r].abs() + m.linear()[1][r].abs() + m.linear()[2][r].abs())
        .fold(0.0, f64::max)
}

/// Numbers whose roots can be measured.
pub trait Measured: Number {
    /// A root in f64.
    fn about(t: &Root<Self>) -> f64;
    /// Whether the second root lies no farther behind the first.
    fn is_within(a: &Root<Self>, b: &Root<Self>, slack: f64) -> Result<bool, Self::Doubt>;
}

impl Measured for Approx {
    fn about(t: &Root<Approx>) -> f64 {
        t.value().value
    }

    /// In doubt where it is close: the slack is not known to the last place either.
    fn is_within(a: &Root<Approx>, b: &Root<Approx>, slack: f64) -> Result<bool, Doubt> {
        let gap = b.value() - a.value();
        if gap.hi() <= slack * 0.5 {
            Ok(true)
        } else if gap.lo() > slack * 2.0 {
            Ok(false)
        } else {
            Err(Doubt)
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
