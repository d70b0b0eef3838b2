//! The choice among many emitters by one descent of a tree of clusters (Conty Estevez and
//! Kulla 2018), in f64.
//!
//! At a node each child gets a bound of the irradiance that it may bring (pbrt 4, section
//! 12.6.3), and the number chooses among them in proportion. Which emitters make up a cluster
//! is part of the model's definition, and is found in [`super::clusters`].

use super::clusters::{Cluster, Node, Part};
use super::importance::Receiver;
use glam::DVec3;

/// The largest importance, and the reciprocal of the least squared distance.
const MOST: f64 = 1e30;

/// Boxes and balls are a little larger than their clusters, and the angle at which an emitter
/// ends is a little wider, so that f32 loses no light.
const WIDER: f64 = 1.000_001;
const HALF: f64 = 0.500_001;
const END: f64 = 1e-3;

/// A tree of emitters.
pub struct Tree {
    root: Node,
}

impl Tree {
    pub fn new(clusters: &[Cluster]) -> Tree {
        Tree {
            root: Node::of(clusters),
        }
    }

    /// Returns the importance of all emitters together.
    pub fn importance(&self, at: &Receiver) -> f64 {
        weights(&self.root, at).iter().sum::<f64>().min(MOST)
    }

    /// Chooses an emitter by a number in [0, 1), and returns its probability.
    pub fn choose(&self, at: &Receiver, mut number: f64) -> Option<(usize, f64)> {
        let (mut node, mut chance) = (&self.root, 1.0);
        loop {
            let weights = weights(node, at);
            let sum: f64 = weights.iter().sum();
            let (mut before, mut chosen) = (0.0, None);
            for (k, weight) in weights.iter().enumerate() {
                if *weight > 0.0 && before <= number * sum {
                    chosen = Some((k, before, *weight));
                }
                before += weight;
            }
            let (k, before, weight) = chosen?;
            chance *= weight / sum;
            number = ((number * sum - before) / weight).clamp(0.0, 1.0);
            match &node.children[k].1 {
                Part::Emitter(emitter) => return Some((*emitter, chance)),
                Part::Node(below) => node = below,
            }
        }
    }

    /// Returns the probability with which an emitter is chosen.
    pub fn chance(&self, at: &Receiver, emitter: usize) -> f64 {
        fn below(node: &Node, at: &Receiver, emitter: usize) -> Option<f64> {
            let own = |part: &Part| match part {
                Part::Emitter(own) => (*own == emitter).then_some(1.0),
                Part::Node(node) => {
                    let here = node.emitters.contains(&emitter);
                    here.then(|| below(node, at, emitter)).flatten()
                }
            };
            let all = node.children.iter().map(|(_, part)| own(part));
            let (k, rest) = all.enumerate().find_map(|(k, own)| Some((k, own?)))?;
            let weights = weights(node, at);
            let sum: f64 = weights.iter().sum();
            Some(match weights[k] > 0.0 {
                true => weights[k] / sum * rest,
                false => 0.0,
            })
        }
        below(&self.root, at, emitter).unwrap_or(0.0)
    }
}

fn weights(node: &Node, at: &Receiver) -> Vec<f64> {
    let of = node.children.iter();
    of.map(|(cluster, _)| importance(cluster, at)).collect()
}

/// Returns the cosine of an angle less another, 1 if that is the greater.
fn less(cos: f64, [sin_less, cos_less]: [f64; 2]) -> f64 {
    match cos >= cos_less {
        true => 1.0,
        false => cos * cos_less + (1.0 - cos * cos).max(0.0).sqrt() * sin_less,
    }
}

/// Bounds the irradiance that a cluster may bring to a point.
fn importance(cluster: &Cluster, at: &Receiver) -> f64 {
    let to = cluster.center() - at.point;
    let square = to.length_squared().clamp(1.0 / MOST, MOST);
    let radius = cluster.radius();
    let near = (radius * radius * WIDER).min(MOST);
    let inside = near >= square;
    let sin2 = (near / square).min(1.0);
    let cone = [sin2.sqrt(), (1.0 - sin2).sqrt()];
    let dir = to / square.sqrt();
    let mut surface = 1.0;
    if at.normal != DVec3::ZERO {
        let height = to.dot(at.normal);
        let rise = ((cluster.high - cluster.low) * HALF).dot(at.normal.abs());
        surface = match (height + rise >= 0.0, inside) {
            (false, _) => 0.0,
            (true, true) => 1.0,
            (true, false) => less(dir.dot(at.normal), cone).max(0.0),
        };
    }
    let along = -dir.dot(cluster.axis);
    let along = if cluster.two_sided {
        along.abs()
    } else {
        along
    };
    let (sin, cos) = libm::sincos(cluster.spread);
    let leaving = less(less(along, [sin, cos]), cone);
    let end = libm::cos(cluster.end) - if cluster.end < 1.5 { END } else { 0.0 };
    let lit = match inside {
        true => 1.0,
        false if leaving > end => leaving,
        false => 0.0,
    };
    let decrease = match cluster.everywhere {
        true => 1.0,
        false => 1.0 / square.max(near),
    };
    (cluster.power.min(MOST) * surface * lit * decrease).min(MOST)
}
