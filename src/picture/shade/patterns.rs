//! The colours of patterns at places in object space, and their means over a ray's footprint
//! (docs/LIGHT.md, T13 to T18).
//!
//! All is f64 arithmetic without elementary functions, so its bits depend on nothing else.

mod noise;

use crate::math::Vec3;
use crate::scene::{Pattern, PatternId, Rgb, Tables, Texturing, Wrap, mixed};
use noise::noise;

/// Where a hit lies in the object space of the shape that its instance places.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// The point, just inside the surface.
    pub point: [f64; 3],
    /// The outward unit normal.
    pub normal: [f32; 3],
    /// Lengths in object space by lengths in world space, the mean of all directions along the
    /// surface.
    pub scale: f32,
}

impl Spot {
    pub const NOWHERE: Spot = Spot {
        point: [0.0; 3],
        normal: [0.0; 3],
        scale: 1.0,
    };

    /// Returns how far a disc of this diameter, which lies along the surface, reaches from side
    /// to side in the direction of a unit vector.
    fn reach(&self, diameter: f64, along: [f64; 3]) -> f64 {
        let cos: f64 = (0..3).map(|k| f64::from(self.normal[k]) * along[k]).sum();
        diameter * (1.0 - cos * cos).max(0.0).sqrt()
    }
}

/// A footprint that is narrower than this part of a cell counts as a point: in its mean the
/// difference of two integrals would be little but rounding.
const NARROW: f64 = 1.0 / (1 << 20) as f64;

/// Returns the base colour of a material at a spot, which its own one is unless it has a pattern.
/// `width` is that of the footprint, in world units.
pub(super) fn base_color_at(
    scene: &Tables,
    texturing: &Texturing,
    own: Rgb,
    (spot, width): (&Spot, f32),
) -> Rgb {
    let at = |id: PatternId| color(scene.textures.pattern(id), spot, width);
    texturing.base_color.map_or(own, at)
}

/// Returns the roughness of a material at a spot.
pub(super) fn roughness_at(
    scene: &Tables,
    texturing: &Texturing,
    own: f32,
    (spot, width): (&Spot, f32),
) -> f32 {
    let at = |id: PatternId| color(scene.textures.pattern(id), spot, width)[0];
    texturing.roughness.map_or(own, at)
}

/// Returns the mean colour of a pattern over a footprint of a width in world units.
pub fn color(pattern: &Pattern, spot: &Spot, width: f32) -> Rgb {
    let diameter = f64::from(width) * f64::from(spot.scale);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Infinite where the cone is as good as that.
    let reach = axes.map(|axis| spot.reach(diameter, axis).min(f64::MAX));
    let p = spot.point;
    match pattern {
        Pattern::Checker { colors, size } => {
            let waves = [0, 1, 2].map(|k| square_wave(p[k] / size[k], reach[k] / size[k]));
            let share = 0.5 - 0.5 * (waves[0] * waves[1] * waves[2]);
            mixed(colors[0], colors[1], share as f32)
        }
        Pattern::Gradient {
            colors,
            from,
            to,
            wrap,
        } => {
            let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
            let squared: f64 = way.iter().map(|x| x * x).sum();
            let along: f64 = (0..3).map(|k| (p[k] - from[k]) * way[k]).sum();
            let length = squared.sqrt();
            let wide = spot.reach(diameter, way.map(|x| x / length)) / length;
            ramp_mean(colors, *wrap, along / squared, wide)
        }
        Pattern::Noise {
            colors,
            size,
            octaves,
            seed,
        } => {
            let at: [f64; 3] = std::array::from_fn(|k| p[k] / size[k]);
            let wide = (0..3).map(|k| reach[k] / size[k]).fold(0.0, f64::max);
            let seen = contrast(wide);
            if seen == 0.0 {
                return pattern.mean();
            }
            let value = (0.5 + fractal(at, wide, (*octaves, *seed))).clamp(0.0, 1.0);
            mixed(pattern.mean(), ramp(colors, value), seen as f32)
        }
        Pattern::Brick {
            colors,
            size,
            joint,
        } => {
            let share = brick_share((p, reach), spot.normal, (*size, *joint));
            mixed(colors[1], colors[0], share as f32)
        }
    }
}

/// Returns the mean over `wide` cells about `x` of a wave that is 1 in even cells and −1 in odd
/// ones.
fn square_wave(x: f64, wide: f64) -> f64 {
    let phase = |x: f64| x - 2.0 * (0.5 * x).floor();
    if wide < NARROW {
        return if phase(x) < 1.0 { 1.0 } else { -1.0 };
    }
    // The wave's integral rises and falls by one.
    let integral = |x: f64| 1.0 - (phase(x) - 1.0).abs();
    (integral(x + 0.5 * wide) - integral(x - 0.5 * wide)) / wide
}

/// Returns the mean over `wide` about `x` of a wave that is 1 from `first` to `last` of each
/// period, and 0 elsewhere.
fn pulse((x, wide): (f64, f64), period: f64, [first, last]: [f64; 2]) -> f64 {
    let round = |x: f64| (x / period).floor();
    if wide < NARROW * period {
        let phase = x - round(x) * period;
        return if (first..last).contains(&phase) {
            1.0
        } else {
            0.0
        };
    }
    let long = last - first;
    let integral = |x: f64| {
        let whole = round(x);
        whole * long + (x - whole * period - first).clamp(0.0, long)
    };
    let mean = (integral(x + 0.5 * wide) - integral(x - 0.5 * wide)) / wide;
    mean.clamp(0.0, 1.0)
}

/// Returns the share of bricks in a footprint. Joints along which the surface runs are not seen.
fn brick_share(
    (p, reach): ([f64; 3], [f64; 3]),
    normal: [f32; 3],
    (size, joint): ([f64; 3], f64),
) -> f64 {
    let [x, y, z] = normal.map(f32::abs);
    let across = match () {
        () if x >= y && x >= z => 0,
        () if y >= z => 1,
        () => 2,
    };
    let side = |k: usize, shift: f64| match k == across {
        true => 1.0,
        false => {
            let half = 0.5 * joint;
            let at = (p[k] + shift * size[k], reach[k]);
            pulse(at, size[k], [half, size[k] - half])
        }
    };
    let half = if across == 1 { 0.0 } else { 0.5 * joint };
    let course = |first: f64| {
        let ends = [first + half, first + size[1] - half];
        pulse((p[1], reach[1]), 2.0 * size[1], ends)
    };
    // Every other course is shifted by half a brick.
    course(0.0) * (side(0, 0.0) * side(2, 0.0)) + course(size[1]) * (side(0, 0.5) * side(2, 0.5))
}

/// Returns the colour of a ramp of evenly spaced colours at a place from 0 to 1.
fn ramp(colors: &[Rgb], at: f64) -> Rgb {
    let steps = colors.len() - 1;
    let place = at * steps as f64;
    let first = (place as usize).min(steps - 1);
    mixed(
        colors[first],
        colors[first + 1],
        (place - first as f64) as f32,
    )
}

/// Returns the integral of a ramp from 0 to a place from 0 to 1.
fn ramp_integral(colors: &[Rgb], at: f64) -> [f64; 3] {
    let steps = colors.len() - 1;
    let place = at * steps as f64;
    let mut sum = [0.0; 3];
    for (i, pair) in colors.windows(2).enumerate() {
        let part = (place - i as f64).clamp(0.0, 1.0);
        for (k, sum) in sum.iter_mut().enumerate() {
            let [a, b] = [pair[0][k], pair[1][k]].map(f64::from);
            *sum += part * (a + 0.5 * part * (b - a));
        }
    }
    sum.map(|x| x / steps as f64)
}

/// Returns the mean of a ramp over `wide` about a place.
fn ramp_mean(colors: &[Rgb], wrap: Wrap, at: f64, wide: f64) -> Rgb {
    let mirrored = |x: f64| {
        let phase = x - 2.0 * (0.5 * x).floor();
        1.0 - (phase - 1.0).abs()
    };
    if wide < NARROW {
        return ramp(
            colors,
            match wrap {
                Wrap::Clamp => at.clamp(0.0, 1.0),
                Wrap::Repeat => at - at.floor(),
                Wrap::Mirror => mirrored(at),
            },
        );
    }
    let whole = ramp_integral(colors, 1.0);
    let integral = |x: f64| {
        let rounds = x.floor();
        let inner = ramp_integral(colors, x.clamp(0.0, 1.0));
        std::array::from_fn::<f64, 3, _>(|k| match wrap {
            Wrap::Clamp => {
                let (first, last) = (colors[0][k], colors[colors.len() - 1][k]);
                inner[k] + f64::from(first) * x.min(0.0) + f64::from(last) * (x - 1.0).max(0.0)
            }
            Wrap::Repeat => rounds * whole[k] + ramp_integral(colors, x - rounds)[k],
            Wrap::Mirror => {
                let part = ramp_integral(colors, mirrored(x))[k];
                // On the way back the integral goes on.
                let is_back = x - 2.0 * (0.5 * x).floor() >= 1.0;
                let pair = 2.0 * (0.5 * x).floor() * whole[k];
                pair + if is_back { 2.0 * whole[k] - part } else { part }
            }
        })
    };
    let [high, low] = [0.5, -0.5].map(|half| integral(at + half * wide));
    std::array::from_fn(|k| ((high[k] - low[k]) / wide).clamp(0.0, 1.0) as f32)
}

/// Returns what is left of a noise's contrast where a footprint covers so many of its cells: all
/// up to half a cell, nothing from one on.
fn contrast(cells: f64) -> f64 {
    (2.0 - 2.0 * cells).clamp(0.0, 1.0)
}

/// Octaves do not share their lattices' points, at all of which noise is 0.
const APART: [f64; 3] = [0.37, 0.71, 0.13];

/// Returns the sum of the octaves of noise of which a footprint of so many cells leaves
/// something; each has half the size and the height of the one before.
fn fractal(p: [f64; 3], cells: f64, (octaves, seed): (u32, u32)) -> f64 {
    let (mut sum, mut scale, mut height) = (0.0, 1.0, 1.0);
    for octave in 0..octaves {
        let seen = match octave {
            0 => 1.0,
            _ => contrast(cells * scale),
        };
        if seen == 0.0 {
            break;
        }
        let at = [0, 1, 2].map(|k| p[k] * scale + APART[k] * f64::from(octave));
        let seed = seed.wrapping_mul(0x9e37_79b9).wrapping_add(octave);
        sum += height * seen * noise::<f64>(Vec3::splat(at), seed);
        scale *= 2.0;
        height *= 0.5;
    }
    sum
}

#[cfg(test)]
mod tests;
