//! Patterns: colours that closed formulas make of the place in object space (docs/LIGHT.md, T13
//! to T18).

use super::error::{Entity, SceneError};
use super::materials::Rgb;
use super::textures::Wrap;

/// A pattern, in the object space of the shape that an instance places. A number, such as a
/// roughness, is a colour of three equal parts.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Cells by turns of two colours, the first where the cells' numbers have an even sum.
    Checker { colors: [Rgb; 2], size: [f64; 3] },
    /// A ramp from one point to another.
    Gradient {
        colors: Vec<Rgb>,
        from: [f64; 3],
        to: [f64; 3],
        wrap: Wrap,
    },
    /// A ramp over gradient noise, summed over octaves.
    Noise {
        colors: Vec<Rgb>,
        size: [f64; 3],
        octaves: u32,
        seed: u32,
    },
    /// Courses of bricks along x that rise with y. `size` is that of a brick with its joint; the
    /// colours are those of bricks and of mortar.
    Brick {
        colors: [Rgb; 2],
        size: [f64; 3],
        joint: f64,
    },
}

/// The most octaves of noise: what a 2²⁴th of the first one's size shows has no more f32 digits.
pub const MOST_OCTAVES: u32 = 24;

impl Pattern {
    pub fn kind_name(&self) -> &'static str {
        match self {
            Pattern::Checker { .. } => "checker",
            Pattern::Gradient { .. } => "gradient",
            Pattern::Noise { .. } => "noise",
            Pattern::Brick { .. } => "brick",
        }
    }

    /// Returns the mean colour, by which what knows no patterns shows a material.
    pub fn mean(&self) -> Rgb {
        match self {
            Pattern::Checker { colors: [a, b], .. } => mixed(*a, *b, 0.5),
            // Steps between equally spaced colours: the ends count half.
            Pattern::Gradient { colors, .. } | Pattern::Noise { colors, .. } => {
                let steps = colors.len().saturating_sub(1).max(1) as f32;
                let mut sum = [0.0; 3];
                for pair in colors.windows(2) {
                    let middle = mixed(pair[0], pair[1], 0.5);
                    sum = std::array::from_fn(|k| sum[k] + middle[k]);
                }
                sum.map(|x| x / steps)
            }
            Pattern::Brick {
                colors: [brick, mortar],
                size,
                joint,
            } => {
                // As a wall across z shows it.
                let share = (1.0 - joint / size[0]) * (1.0 - joint / size[1]);
                mixed(*mortar, *brick, share as f32)
            }
        }
    }

    /// Lists the colours.
    pub fn colors(&self) -> &[Rgb] {
        match self {
            Pattern::Checker { colors, .. } | Pattern::Brick { colors, .. } => colors,
            Pattern::Gradient { colors, .. } | Pattern::Noise { colors, .. } => colors,
        }
    }

    /// Checks the numbers, of which no formula makes anything but finite colours.
    pub(super) fn check(&self, what: impl Fn() -> Entity) -> Result<(), SceneError> {
        let wrong = |why: String| {
            Err(SceneError::Degenerate {
                what: what(),
                why: format!("its {} {why}", self.kind_name()),
            })
        };
        let colors = self.colors();
        if colors.len() < 2 {
            return wrong("needs two colours or more".into());
        }
        if let Some(c) = colors.iter().flatten().find(|c| !(0.0..=1.0).contains(*c)) {
            return wrong(format!("has {c} in a colour; they go from 0 to 1"));
        }
        let fits = |x: &f64| *x > 0.0 && x.is_finite();
        match self {
            Pattern::Checker { size, .. }
            | Pattern::Noise { size, .. }
            | Pattern::Brick { size, .. }
                if !size.iter().all(fits) =>
            {
                wrong("has a size that is not greater than 0 and finite".into())
            }
            Pattern::Noise { octaves, .. } if !(1..=MOST_OCTAVES).contains(octaves) => wrong(
                format!("has {octaves} octaves; from 1 to {MOST_OCTAVES} are possible"),
            ),
            Pattern::Brick { size, joint, .. } => {
                let least = size.iter().copied().fold(f64::INFINITY, f64::min);
                match (0.0..least).contains(joint) {
                    true => Ok(()),
                    false => wrong(format!(
                        "has joints of {joint}, which leave nothing of bricks of {least}"
                    )),
                }
            }
            Pattern::Gradient { from, to, .. } => {
                // Neither it nor its inverse may leave the range of f64.
                let squared: f64 = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum();
                match squared.is_normal() && squared.recip().is_normal() {
                    true => Ok(()),
                    false => wrong("goes nowhere: from and to must be two finite points".into()),
                }
            }
            _ => Ok(()),
        }
    }
}

/// Returns the colour that lies `t` of the way from one to another.
pub fn mixed(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}
