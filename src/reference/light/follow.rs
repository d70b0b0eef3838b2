//! Follows a recorded path vertex by vertex: each ray is taken as it was recorded and checked,
//! so that rounding does not grow from vertex to vertex and a decision that rounding turned
//! does not end the comparison.

use super::bsdf::Color;
use super::maps::Half;
use super::path::{Place, State, Step, plus};
use super::rounding::{Nudge, ORIGIN, ROUNDED, Slack, UNIT, extent, roundings, slack};
use super::{LightRay, LightReference, Vertex};
use glam::DVec3;

/// How far a random number may lie from the threshold of a decision that f32 makes otherwise:
/// thresholds are sums and quotients of some tens of f32.
const THRESHOLD: f64 = 256.0 * UNIT;

/// How far a number that chooses a cell of the sky may lie from the cell's edge.
const CELL: f64 = 4.0 * UNIT;

/// How far directions may lie apart, as chords of unit vectors, beside what the roundings of
/// the numbers that choose them make of it.
pub const DIRECTION: f64 = 4.0 * ROUNDED;

/// How far weights may lie apart beside that, relative to the greatest channel: albedos of GGX
/// are interpolated in a table, and found here by another quadrature.
pub const WEIGHT: f64 = 1e-3;

/// What following a path found.
#[derive(Clone, Debug)]
pub struct Followed {
    pub radiance: Color,
    /// Decisions whose random number lies at their threshold.
    pub turned: u32,
}

/// Where a recorded path is not right.
#[derive(Clone, Debug, PartialEq)]
pub struct Miss {
    pub depth: u32,
    pub what: String,
}

/// All ways in which rounding may turn decisions at a vertex, the likeliest first.
fn nudges() -> impl Iterator<Item = Nudge> {
    let halves = [Half::Own, Half::Other];
    let shifts = [0.0, THRESHOLD, -THRESHOLD];
    halves.into_iter().flat_map(move |frame| {
        shifts.into_iter().flat_map(move |lobe| {
            shifts.into_iter().map(move |roulette| Nudge {
                lobe,
                roulette,
                frame,
                ..Nudge::default()
            })
        })
    })
}

fn picks() -> impl Iterator<Item = Nudge> {
    let own = Nudge::default();
    let other = Nudge {
        frame: Half::Other,
        ..own
    };
    let pick = [THRESHOLD, -THRESHOLD].map(|pick| Nudge { pick, ..own });
    let shifts = [-CELL, 0.0, CELL];
    let aims = shifts.into_iter().flat_map(move |u| shifts.map(|v| [u, v]));
    let aims = aims.map(move |aim| Nudge { aim, ..own });
    [other].into_iter().chain(pick).chain(aims)
}

impl LightReference<'_> {
    /// Follows a recorded path of a pixel's sample and checks each of its steps.
    pub fn follow(
        &self,
        pixel: [u32; 2],
        sample: u32,
        vertices: &[Vertex],
    ) -> Result<Followed, Miss> {
        let mut found = Followed {
            radiance: [0.0; 3],
            turned: 0,
        };
        let mut state = self.begin(pixel, sample, [0.0; 2]);
        let size = extent(vertices);
        for (depth, vertex) in (0..).zip(vertices) {
            let miss = |what: String| Miss { depth, what };
            if depth == 0
                && let Some(what) = apart(&state, vertex, &Slack::default(), size)
            {
                return Err(miss(what));
            }
            state.org = DVec3::from_array(vertex.org);
            state.dir = DVec3::from_array(vertex.dir);
            state.weight = vertex.weight;
            let hit = self.nearest(&state);
            let met = hit.map(|hit| (hit.instance, hit.primitive));
            if met != vertex.met {
                let what = format!("meets {:?}, the reference {met:?}", vertex.met);
                return Err(miss(what));
            }
            let place = Place {
                pixel,
                sample,
                depth,
            };
            let next = vertices.get(depth as usize + 1);
            // Rays leave as far from the surface as the recorded ones.
            let lift = hit.map_or(0.0, |hit| {
                let at = self.surface(state.org, state.dir, &hit);
                let left = next.map(|v| v.org).or(vertex.light.map(|light| light.org));
                left.map_or(0.0, |org| at.farther(DVec3::from_array(org)))
            });
            let base = Nudge {
                lift: lift.clamp(0.0, ORIGIN * size),
                ..Nudge::default()
            };
            let step = |nudge: Nudge| self.step(&state, place, hit.as_ref(), base.and(nudge));
            let own = step(Nudge::default());
            found.radiance = plus(found.radiance, own.gained);
            let rounded = || roundings(1, size).into_iter();
            let slack = |nudge: Nudge| {
                let pairs = rounded().map(|pair| pair.map(|by| step(nudge.and(by))));
                slack(&step(nudge), pairs)
            };
            let mut followed = Following {
                own: &own,
                step: &step,
                rounded: &|| rounded().flatten().collect(),
                slack: &slack,
                size,
                turned: &mut found.turned,
            };
            let light = followed.light(&vertex.light).map_err(miss)?;
            if let (Some(light), Some(theirs)) = (light, &vertex.light) {
                let ray = LightRay {
                    weight: light.weight,
                    ..*theirs
                };
                let (blocked, arrives) = self.arriving(&ray);
                if blocked != theirs.blocked {
                    let what = format!("blocked {}, the reference {blocked}", theirs.blocked);
                    return Err(miss(what));
                }
                found.radiance = plus(found.radiance, arrives);
            }
            state = match followed.next(next).map_err(miss)? {
                Some(state) => state,
                None => return Ok(found),
            };
        }
        Ok(found)
    }
}

/// A step of the reference beside a recorded one.
struct Following<'f> {
    own: &'f Step,
    step: &'f dyn Fn(Nudge) -> Step,
    rounded: &'f dyn Fn() -> Vec<Nudge>,
    slack: &'f dyn Fn(Nudge) -> Slack,
    /// The greatest coordinate along the path.
    size: f64,
    turned: &'f mut u32,
}

impl Following<'_> {
    /// Finds the ray towards light that was recorded, by the reference's own decisions or by
    /// those that rounding may make.
    fn light(&mut self, theirs: &Option<LightRay>) -> Result<Option<LightRay>, String> {
        let own = &self.own.light;
        if same_light(own, theirs, &Slack::default()) {
            return Ok(*own);
        }
        let slack = (self.slack)(Nudge::default());
        if same_light(own, theirs, &slack) {
            return Ok(*own);
        }
        let mut others = picks().chain((self.rounded)());
        let found = others.find_map(|nudge| {
            let light = (self.step)(nudge).light;
            let fits = light.is_some() == theirs.is_some()
                && same_light(&light, theirs, &(self.slack)(nudge));
            fits.then_some(light)
        });
        *self.turned += 1;
        found.ok_or_else(|| format!("light {theirs:?}, the reference {own:?}, {slack:?}"))
    }

    /// Finds the continuation that the next vertex shows.
    fn next(&mut self, next: Option<&Vertex>) -> Result<Option<State>, String> {
        let size = self.size;
        let fits = |state: &Option<State>, slack: &Slack| match (state, next) {
            (Some(state), Some(vertex)) => apart(state, vertex, slack, size).is_none(),
            (None, None) => true,
            _ => false,
        };
        let own = &self.own.next;
        if fits(own, &Slack::default()) {
            return Ok(own.clone());
        }
        let slack = (self.slack)(Nudge::default());
        if fits(own, &slack) {
            return Ok(own.clone());
        }
        *self.turned += 1;
        let mut others = nudges().chain((self.rounded)());
        let found = others.find_map(|nudge| {
            let state = (self.step)(nudge).next;
            let is_one = state.is_some() == next.is_some() && fits(&state, &(self.slack)(nudge));
            is_one.then_some(state)
        });
        found.ok_or_else(|| match (own, next) {
            (None, _) => "goes on, the reference ends".into(),
            (_, None) => "ends, the reference goes on".into(),
            (Some(state), Some(vertex)) => apart(state, vertex, &slack, size).unwrap_or_default(),
        })
    }
}

/// Says how a ray lies apart from a recorded one; `size` is the path's greatest coordinate.
fn apart(state: &State, vertex: &Vertex, slack: &Slack, size: f64) -> Option<String> {
    let (org, dir) = (DVec3::from_array(vertex.org), DVec3::from_array(vertex.dir));
    let chord = state.dir.normalize().distance(dir.normalize());
    let most = DIRECTION + slack.direction;
    if !(chord <= most) {
        return Some(format!(
            "directions lie {chord:.1e} apart, more than {most:.1e}"
        ));
    }
    let gap = state.org.distance(org) / size;
    if !(gap <= ORIGIN) {
        return Some(format!("origins lie {gap:.1e} apart"));
    }
    let (a, b) = (vertex.weight, state.weight);
    (!is_near(a, b, slack.weight)).then(|| format!("weights {a:?}, the reference {b:?}, {slack:?}"))
}

/// Returns the greatest difference of two colours' channels, relative to their greatest.
pub fn error(a: Color, b: Color) -> f64 {
    let size = (0..3).fold(0.0, |m: f64, k| m.max(a[k].abs()).max(b[k].abs()));
    let apart = (0..3).fold(0.0, |m: f64, k| m.max((a[k] - b[k]).abs()));
    if size > 0.0 { apart / size } else { apart }
}

/// Says whether two weights lie no more than a part of them and `more` apart.
fn is_near(a: Color, b: Color, more: f64) -> bool {
    let size = (0..3).fold(0.0, |m: f64, k| m.max(a[k].abs()).max(b[k].abs()));
    error(a, b) * size <= WEIGHT * size + more
}

/// Says whether two light rays are the same up to rounding.
fn same_light(own: &Option<LightRay>, other: &Option<LightRay>, slack: &Slack) -> bool {
    let (Some(a), Some(b)) = (own, other) else {
        return own.is_none() == other.is_none();
    };
    let [p, q] = [a.dir, b.dir].map(|dir| DVec3::from_array(dir).normalize());
    p.distance(q) <= DIRECTION + slack.light_direction
        && is_near(a.weight, b.weight, slack.light_weight)
}
