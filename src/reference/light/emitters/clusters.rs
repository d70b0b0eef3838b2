//! Clusters of emitters, and how the model groups them: a set is cut at the cheapest of twelve
//! bins along each axis, by the surface area orientation heuristic of Conty Estevez and Kulla
//! 2018 (section 4.4), and its costliest part again, until a node has eight.
//!
//! Of cuts of equal cost the first counts, of parts of equal cost the last: lamps in rows have
//! many, and another choice would be another model.

use super::{Emitter, Kind};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

const CHILDREN: usize = 8;
const BINS: usize = 12;

/// What bounds a set of emitters: a box, the cone of their normals, and the angle from a
/// normal up to which they shine.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    pub low: DVec3,
    pub high: DVec3,
    pub axis: DVec3,
    pub spread: f64,
    pub end: f64,
    pub two_sided: bool,
    pub everywhere: bool,
    pub power: f64,
}

/// A child of a node.
pub enum Part {
    Emitter(usize),
    Node(Node),
}

pub struct Node {
    pub children: Vec<(Cluster, Part)>,
    pub emitters: Vec<usize>,
}

impl Cluster {
    /// Bounds one emitter. Power and axis are rounded to f32, as the model holds them.
    pub fn new(emitter: &Emitter) -> Cluster {
        let bounds = &emitter.bounds;
        let mut end = FRAC_PI_2;
        let (spread, two_sided, everywhere) = match emitter.kind {
            Kind::Triangle(_) | Kind::Rectangle(_) => (0.0, true, false),
            Kind::Lamp { constant: true, .. } => (PI, false, true),
            Kind::Lamp {
                ramp: Some([slope, start]),
                ..
            } => {
                let [slope, start] = [slope, start].map(|x| f64::from(x as f32));
                let inner = libm::acos(((1.0 - start) / slope).min(1.0));
                let outer = libm::acos((-start / slope).clamp(-1.0, 1.0));
                end = (outer - inner).max(0.0);
                (inner, false, false)
            }
            _ => (PI, false, false),
        };
        let axis = bounds.axis.as_vec3().as_dvec3();
        Cluster {
            low: bounds.low,
            high: bounds.high,
            axis: axis.try_normalize().unwrap_or(DVec3::Z),
            spread,
            end,
            two_sided,
            everywhere,
            power: f64::from(bounds.power as f32),
        }
    }

    pub fn center(&self) -> DVec3 {
        self.low + (self.high - self.low) * 0.5
    }

    pub fn radius(&self) -> f64 {
        (self.high - self.low).length() * 0.5
    }

    fn with(&self, other: &Cluster) -> Cluster {
        let (axis, spread) = self.cone_with(other);
        Cluster {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            axis,
            spread,
            end: self.end.max(other.end),
            two_sided: self.two_sided || other.two_sided,
            everywhere: self.everywhere || other.everywhere,
            power: self.power + other.power,
        }
    }

    /// Returns the least cone that contains both; one of two-sided emitters may be turned.
    fn cone_with(&self, other: &Cluster) -> (DVec3, f64) {
        let turns = self.two_sided && other.two_sided && self.axis.dot(other.axis) < 0.0;
        let theirs = if turns { -other.axis } else { other.axis };
        let ((a, wide), (b, narrow)) = match self.spread >= other.spread {
            true => ((self.axis, self.spread), (theirs, other.spread)),
            false => ((theirs, other.spread), (self.axis, self.spread)),
        };
        if wide >= PI {
            return (a, PI);
        }
        let between = 2.0 * libm::asin((0.5 * (a - b).length()).min(1.0));
        if (between + narrow).min(PI) <= wide {
            return (a, wide);
        }
        let spread = (wide + between + narrow) / 2.0;
        let across = b - a * a.dot(b);
        if spread >= PI || across.length() < 1e-9 {
            return (a, PI);
        }
        let (sin, cos) = libm::sincos(spread - wide);
        (a * cos + across.normalize() * sin, spread)
    }

    /// Returns power · area · cone; `lengthened` is the ratio of the longest edge to that
    /// along the cut.
    fn cost(&self, lengthened: f64) -> f64 {
        let size = self.high - self.low;
        let faces = size.x * size.y + size.y * size.z + size.z * size.x;
        // Lights on a line have an area, too.
        let area = faces + 0.01 * size.length_squared();
        let o = self.spread;
        let w = (o + self.end).min(PI);
        let (sin, cos) = libm::sincos(o);
        let fringe = 2.0 * w * sin - libm::cos(o - 2.0 * w) - 2.0 * o * sin + cos;
        let cone = 2.0 * PI * (1.0 - cos) + PI / 2.0 * fringe;
        self.power * area * cone * lengthened
    }
}

impl Node {
    /// Groups all emitters.
    pub fn of(clusters: &[Cluster]) -> Node {
        Node::of_some(clusters, (0..clusters.len()).collect())
    }

    fn of_some(clusters: &[Cluster], emitters: Vec<usize>) -> Node {
        let whole = |some: &[usize]| {
            let all = some.iter().map(|k| clusters[*k]);
            all.reduce(|a, b| a.with(&b)).expect("no part is empty")
        };
        let mut parts = vec![(whole(&emitters), emitters.clone())];
        while parts.len() < CHILDREN {
            let costs = parts.iter().map(|(cluster, some)| match some.len() {
                1 => -1.0,
                _ => cluster.cost(1.0),
            });
            let costs: Vec<f64> = costs.collect();
            let most = costs.iter().copied().fold(-1.0, f64::max);
            if most < 0.0 {
                break;
            }
            let k = costs.iter().rposition(|cost| *cost == most).unwrap_or(0);
            let (cluster, some) = parts.swap_remove(k);
            for half in cut(clusters, some, &cluster) {
                parts.push((whole(&half), half));
            }
        }
        let child = |(cluster, some): (Cluster, Vec<usize>)| match some[..] {
            [one] => (cluster, Part::Emitter(one)),
            _ => (cluster, Part::Node(Node::of_some(clusters, some))),
        };
        Node {
            children: parts.into_iter().map(child).collect(),
            emitters,
        }
    }
}

/// Cuts a set of at least two emitters in two.
fn cut(clusters: &[Cluster], some: Vec<usize>, whole: &Cluster) -> [Vec<usize>; 2] {
    let centers = || some.iter().map(|k| clusters[*k].center());
    let low = centers().reduce(DVec3::min).unwrap_or_default();
    let size = centers().reduce(DVec3::max).unwrap_or_default() - low;
    let edges = whole.high - whole.low;
    let longest = edges.max_element();
    let bin = |k: usize, axis: usize| {
        let at = (clusters[k].center()[axis] - low[axis]) / size[axis];
        ((at * BINS as f64) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|axis| size[*axis] > 0.0) {
        let lengthened = longest / edges[axis].max(longest * 1e-6);
        let mut bins = [None; BINS];
        for k in &some {
            let bin = &mut bins[bin(*k, axis)];
            *bin = joined(*bin, Some(clusters[*k]));
        }
        for at in 1..BINS {
            let left = bins[..at].iter().copied().fold(None, joined);
            let right = bins[at..].iter().rev().copied().fold(None, joined);
            let (Some(left), Some(right)) = (left, right) else {
                continue;
            };
            let cost = left.cost(lengthened) + right.cost(lengthened);
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, at));
            }
        }
    }
    let Some((_, axis, at)) = best else {
        let (a, b) = some.split_at(some.len() / 2);
        return [a.to_vec(), b.to_vec()];
    };
    let (a, b) = some.into_iter().partition(|k| bin(*k, axis) < at);
    [a, b]
}

fn joined(a: Option<Cluster>, b: Option<Cluster>) -> Option<Cluster> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.with(&b)),
        (a, b) => a.or(b),
    }
}
