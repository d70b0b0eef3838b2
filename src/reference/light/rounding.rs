//! How far f32 may move the numbers of a path, and what comes of it.
//!
//! The path integrator shades in f32, of unit u = 2⁻²⁴. Each number of a step is a function of
//! some f32 operations, so its error is a few u of the numbers that go into it, and what that
//! does to the radiance is the derivative of the path by that number. So the bound is a sum
//! over all numbers of all steps: each is moved by its greatest error, either way, and the
//! path is traced again by the reference. To first order nothing can lie farther away.

use super::bsdf::Color;
use super::maps::Half;
use super::path::{Step, greatest};
use super::{LightReference, Path, Vertex};
use glam::DVec3;

/// The unit of rounding of f32.
pub const UNIT: f64 = 1.0 / 16_777_216.0;

/// How far directions in a frame lie from the right ones: a frame of a rounded normal (three
/// u a component, and four for the formula), times a rounded direction (one), in a sum of three
/// terms (three); and maps to directions are sines, roots and products of at most five.
pub const ROUNDED: f64 = 16.0 * UNIT;

/// How far random numbers lie from those whose exact image the rounded image is: 8 operations.
const NUMBER: f64 = 8.0 * UNIT;

/// The error of a quotient of two indices of f32.
const INDEX: f64 = 2.0 * UNIT;

/// The error of a place in the pixel, in pixels: cells of the filter, and the sum with 1/2.
const PIXEL: f64 = 4.0 * UNIT;

/// How far rays may start from where the reference's do, relative to the greatest coordinate
/// along the path: in f32 lanes they leave 64 u farther away (L4), and towards light from
/// curved operands of CSG solids 256 u more (L5).
pub const ORIGIN: f64 = 320.0 * UNIT;

/// What is added to the numbers of a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nudge {
    pub lobe: f64,
    pub roulette: f64,
    pub pick: f64,
    /// To the numbers that choose a direction to a light.
    pub aim: [f64; 2],
    /// To those that choose the direction in which the path goes on.
    pub spread: [f64; 2],
    pub frame: Half,
    /// To the local direction back along the ray.
    pub turn: DVec3,
    /// To the local direction to the light.
    pub into: DVec3,
    /// To the direction to the light, times the light's blur.
    pub shift: DVec3,
    /// To the direction in which the sky is looked up.
    pub look: DVec3,
    /// Times the ratio of the indices of refraction.
    pub eta: f64,
    /// To the distance from the surface at which rays leave.
    pub lift: f64,
    /// To the place in the pixel.
    pub camera: [f64; 2],
}

impl Nudge {
    /// Adds two nudges, of which one may be of decisions.
    pub fn and(self, other: Nudge) -> Nudge {
        let two = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        Nudge {
            lobe: self.lobe + other.lobe,
            roulette: self.roulette + other.roulette,
            pick: self.pick + other.pick,
            aim: two(self.aim, other.aim),
            spread: two(self.spread, other.spread),
            frame: match self.frame {
                Half::Own => other.frame,
                Half::Other => Half::Other,
            },
            turn: self.turn + other.turn,
            into: self.into + other.into,
            shift: self.shift + other.shift,
            look: self.look + other.look,
            eta: self.eta + other.eta,
            lift: self.lift + other.lift,
            camera: two(self.camera, other.camera),
        }
    }

    /// Scales what is no decision.
    fn times(self, by: f64) -> Nudge {
        Nudge {
            aim: self.aim.map(|x| x * by),
            spread: self.spread.map(|x| x * by),
            turn: self.turn * by,
            into: self.into * by,
            shift: self.shift * by,
            look: self.look * by,
            eta: self.eta * by,
            lift: self.lift * by,
            camera: self.camera.map(|x| x * by),
            ..self
        }
    }
}

/// Returns all that rounding may add to the numbers of a step, in pairs of both signs.
/// `size` is the greatest coordinate along the path.
pub fn roundings(depth: u32, size: f64) -> Vec<[Nudge; 2]> {
    let none = Nudge::default();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut all = Vec::new();
    let mut add = |of: &dyn Fn(f64) -> Nudge| all.push([of(1.0), of(-1.0)]);
    for axis in axes {
        add(&|s| Nudge {
            turn: axis * (s * ROUNDED),
            ..none
        });
        add(&|s| Nudge {
            into: axis * (s * ROUNDED),
            ..none
        });
        add(&|s| Nudge {
            shift: axis * s,
            ..none
        });
        add(&|s| Nudge {
            look: axis * (s * ROUNDED),
            ..none
        });
    }
    for k in 0..2 {
        let number = |s: f64, by: f64| std::array::from_fn(|i| if i == k { s * by } else { 0.0 });
        add(&|s| Nudge {
            aim: number(s, NUMBER),
            ..none
        });
        add(&|s| Nudge {
            spread: number(s, NUMBER),
            ..none
        });
        if depth == 0 {
            add(&|s| Nudge {
                camera: number(s, PIXEL),
                ..none
            });
        }
    }
    add(&|s| Nudge {
        eta: s * INDEX,
        ..none
    });
    let lift = ORIGIN * size;
    all.push([Nudge { lift, ..none }; 2]);
    all
}

/// Directions that lie farther apart than this are not the same but for rounding: another lobe
/// or another part of a lamp was chosen.
pub const OTHER: f64 = 1.0 / 64.0;

/// The least part of an error that is taken for it.
const LEAST_PART: f64 = 1.0 / 64.0;

/// What comes of the roundings of a path, to first order.
#[derive(Clone, Debug, Default)]
pub struct Spread {
    /// How far the radiance may lie away.
    pub radiance: f64,
    /// By vertex, how far the ray's start and its direction may.
    pub rays: Vec<[f64; 2]>,
}

impl LightReference<'_> {
    /// Bounds what rounding does to a path, which goes its own way, or along given rays. Where
    /// a number's error turns a decision, there is no derivative by it; a part of the error is
    /// taken then, and scaled up.
    pub fn spread(
        &self,
        (pixel, sample): ([u32; 2], u32),
        own: &Path,
        on: Option<&[Vertex]>,
    ) -> Spread {
        let mut spread = Spread {
            radiance: 0.0,
            rays: vec![[0.0; 2]; own.vertices.len()],
        };
        let size = extent(&own.vertices);
        for depth in 0..own.vertices.len() as u32 {
            for pair in roundings(depth, size) {
                let mut radiance = 0.0_f64;
                let mut rays = vec![[0.0_f64; 2]; own.vertices.len()];
                for nudge in pair {
                    let (scale, other, alike) =
                        self.smallest((pixel, sample), own, on, (depth, nudge));
                    for (most, far) in rays.iter_mut().zip(&alike) {
                        *most = [most[0].max(far[0] / scale), most[1].max(far[1] / scale)];
                    }
                    if alike.len() > own.vertices.len() {
                        let far = difference(other.radiance, own.radiance);
                        radiance = radiance.max(far / scale);
                    }
                }
                spread.radiance += radiance;
                for (sum, most) in spread.rays.iter_mut().zip(rays) {
                    *sum = [sum[0] + most[0], sum[1] + most[1]];
                }
            }
        }
        spread
    }

    /// Traces a path with a nudge, or with such a part of it that the path's decisions stay;
    /// returns that part, the path, and how far its rays lie apart ([`alike`]).
    fn smallest(
        &self,
        (pixel, sample): ([u32; 2], u32),
        own: &Path,
        on: Option<&[Vertex]>,
        (depth, nudge): (u32, Nudge),
    ) -> (f64, Path, Vec<[f64; 2]>) {
        let mut scale = 1.0;
        loop {
            let other = self.walk(pixel, sample, on, (depth, nudge.times(scale)));
            let alike = alike(&other.vertices, &own.vertices);
            if alike.len() > own.vertices.len() || scale <= LEAST_PART {
                return (scale, other, alike);
            }
            scale /= 8.0;
        }
    }
}

/// Returns how far the rays of two paths lie apart, start and direction, until a decision is
/// another one; one more pair than vertices if none is.
fn alike(a: &[Vertex], b: &[Vertex]) -> Vec<[f64; 2]> {
    let mut rays = Vec::new();
    for (a, b) in a.iter().zip(b) {
        let [start, chord] = ray_apart(a, b);
        if chord > OTHER {
            return rays;
        }
        rays.push([start, chord]);
        let lights = match (&a.light, &b.light) {
            (Some(p), Some(q)) => p.blocked == q.blocked && chord_of(p.dir, q.dir) <= OTHER,
            (p, q) => p.is_none() == q.is_none(),
        };
        if a.met != b.met || !lights {
            return rays;
        }
    }
    if a.len() == b.len() {
        rays.push([0.0; 2]);
    }
    rays
}

/// Returns how far the rays of two vertices lie apart: their starts, and their directions as
/// chords.
pub fn ray_apart(a: &Vertex, b: &Vertex) -> [f64; 2] {
    let [p, q] = [a.org, b.org].map(DVec3::from_array);
    [p.distance(q), chord_of(a.dir, b.dir)]
}

/// Returns how far two directions lie apart, as the chord of unit vectors.
pub fn chord_of(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [a, b] = [a, b].map(|v| DVec3::from_array(v).normalize_or_zero());
    a.distance(b)
}

/// The greatest coordinate of the points of a path.
pub fn extent(vertices: &[Vertex]) -> f64 {
    let of = |v: &Vertex| DVec3::from_array(v.org).abs().max_element();
    vertices.iter().map(of).fold(1e-9, f64::max)
}

/// The greatest difference of two colours' channels.
pub fn difference(a: Color, b: Color) -> f64 {
    greatest([0, 1, 2].map(|k| (a[k] - b[k]).abs()))
}

/// How far the parts of a step may lie from those of another, to first order.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slack {
    /// As chords of unit vectors.
    pub direction: f64,
    pub weight: f64,
    pub light_direction: f64,
    pub light_weight: f64,
}

/// Sums how far roundings move the parts of a step.
pub fn slack(own: &Step, nudged: impl Iterator<Item = [Step; 2]>) -> Slack {
    let apart = |other: &Step| {
        let mut by = Slack::default();
        if let (Some(a), Some(b)) = (&own.next, &other.next) {
            by.direction = chord_of(a.dir.to_array(), b.dir.to_array());
            by.weight = difference(a.weight, b.weight);
        }
        if let (Some(a), Some(b)) = (&own.light, &other.light) {
            by.light_direction = chord_of(a.dir, b.dir);
            by.light_weight = difference(a.weight, b.weight);
        }
        by
    };
    let mut all = Slack::default();
    for pair in nudged {
        let [a, b] = [apart(&pair[0]), apart(&pair[1])];
        all.direction += a.direction.max(b.direction);
        all.weight += a.weight.max(b.weight);
        all.light_direction += a.light_direction.max(b.light_direction);
        all.light_weight += a.light_weight.max(b.light_weight);
    }
    all
}
