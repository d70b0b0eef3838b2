//! Builds light trees top down by the surface area orientation heuristic of Conty Estevez and
//! Kulla 2018 (section 4.4).
//!
//! A set of emitters is split in two at the cheapest of twelve bins along each axis, and the
//! costliest part again, until a node has its eight children.

use super::importance::Bounds;
use super::tree::{Tree, WIDTH, cone_of};
use glam::DVec3;
use std::f64::consts::PI;

/// What bounds a set of emitters: their box, the cone of their normals, and the angle from a
/// normal up to which they shine.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    pub low: DVec3,
    pub high: DVec3,
    pub axis: DVec3,
    /// Half angle of the cone of normals.
    pub spread: f64,
    pub end: f64,
    pub two_sided: bool,
    pub everywhere: bool,
    pub power: f64,
}

impl Cluster {
    fn of(bounds: &Bounds, [low, high]: [DVec3; 2]) -> Cluster {
        let (spread, end, two_sided, everywhere) = cone_of(bounds.facing);
        let axis = DVec3::from(bounds.axis.map(f64::from));
        Cluster {
            low,
            high,
            axis: if axis == DVec3::ZERO {
                DVec3::Z
            } else {
                axis.normalize()
            },
            spread,
            end,
            two_sided,
            everywhere,
            power: f64::from(bounds.power),
        }
    }

    pub fn center(&self) -> DVec3 {
        self.low + (self.high - self.low) * 0.5
    }

    /// Returns the radius of the ball about the box.
    pub fn radius(&self) -> f64 {
        (self.high - self.low).length() * 0.5
    }

    /// Bounds both.
    pub fn union(&self, other: &Cluster) -> Cluster {
        let (axis, spread) = cone_union(self, other);
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

    /// Returns power times the measures of box and cone; `lengthened` is the ratio of the
    /// node's longest edge to that along the split.
    fn cost(&self, lengthened: f64) -> f64 {
        let size = self.high - self.low;
        // A part of the squared diagonal, so that lights on a line have a measure.
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        let area = area + 0.01 * size.length_squared();
        let (spread, reach) = (self.spread, (self.spread + self.end).min(PI));
        let (sin, cos) = libm::sincos(spread);
        let fringe = 2.0 * reach * sin - libm::cos(spread - 2.0 * reach) - 2.0 * spread * sin + cos;
        let cone = 2.0 * PI * (1.0 - cos) + PI / 2.0 * fringe;
        self.power * area * cone * lengthened
    }
}

/// Returns the least cone that contains two cones; a two-sided one may be turned over.
fn cone_union(a: &Cluster, b: &Cluster) -> (DVec3, f64) {
    let both = a.two_sided && b.two_sided;
    let turned = if both && a.axis.dot(b.axis) < 0.0 {
        -b.axis
    } else {
        b.axis
    };
    let (a, b, wide) = if a.spread >= b.spread {
        (a.axis, turned, [a.spread, b.spread])
    } else {
        (turned, a.axis, [b.spread, a.spread])
    };
    if wide[0] >= PI {
        return (a, PI);
    }
    // Half of the chord is the sine of half of the angle.
    let between = 2.0 * libm::asin((0.5 * (a - b).length()).min(1.0));
    if (between + wide[1]).min(PI) <= wide[0] {
        return (a, wide[0]);
    }
    let spread = (wide[0] + between + wide[1]) / 2.0;
    let across = b - a * a.dot(b);
    if spread >= PI || across.length() < 1e-9 {
        return (a, PI);
    }
    let (sin, cos) = libm::sincos(spread - wide[0]);
    (a * cos + across.normalize() * sin, spread)
}

/// Builds the tree of at least one emitter; `boxes` contain them.
pub fn build(bounds: &[Bounds], boxes: &[[DVec3; 2]]) -> Tree {
    let clusters: Vec<Cluster> = bounds
        .iter()
        .zip(boxes)
        .map(|(bounds, &sides)| Cluster::of(bounds, sides))
        .collect();
    let mut order: Vec<u32> = (0..clusters.len() as u32).collect();
    let mut tree = Tree::with_slots(clusters.len());
    // Ranges of `order` with the place that their node has above.
    let mut open = vec![(0..clusters.len(), None)];
    while let Some((range, above)) = open.pop() {
        let mut parts = vec![(union(&clusters, &order[range.clone()]), range)];
        while parts.len() < WIDTH {
            let cost = |(cluster, range): &(Cluster, std::ops::Range<usize>)| {
                if range.len() > 1 {
                    cluster.cost(1.0)
                } else {
                    -1.0
                }
            };
            let costs = parts.iter().map(cost).enumerate();
            let (k, cost) = costs.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            if cost < 0.0 {
                break;
            }
            let (cluster, range) = parts.swap_remove(k);
            let middle = range.start + split(&clusters, &mut order[range.clone()], &cluster);
            for half in [range.start..middle, middle..range.end] {
                parts.push((union(&clusters, &order[half.clone()]), half));
            }
        }
        let children: Vec<Cluster> = parts.iter().map(|part| part.0).collect();
        let node = tree.add_node(&children, above.unwrap_or((0, 0)));
        if let Some(above) = above {
            tree.set_node(above, node);
        }
        for (child, (_, range)) in (0..).zip(parts) {
            match range.len() {
                1 => tree.set_emitter((node, child), order[range.start]),
                _ => open.push((range, Some((node, child)))),
            }
        }
    }
    tree
}

fn union(clusters: &[Cluster], order: &[u32]) -> Cluster {
    let all = order.iter().map(|&k| clusters[k as usize]);
    all.reduce(|a, b| a.union(&b)).unwrap()
}

/// Orders a part of at least two emitters so that the cheapest split lies between its halves,
/// neither empty; returns the second's start.
fn split(clusters: &[Cluster], order: &mut [u32], whole: &Cluster) -> usize {
    const BINS: usize = 12;
    let centers = order.iter().map(|&k| clusters[k as usize].center());
    let infinity = DVec3::splat(f64::INFINITY);
    let (low, high) = centers.fold((infinity, -infinity), |(low, high), c| {
        (low.min(c), high.max(c))
    });
    let size = high - low;
    let longest = (whole.high - whole.low).max_element();
    let bin = |k: u32, axis: usize| {
        let at = (clusters[k as usize].center()[axis] - low[axis]) / size[axis];
        ((at * BINS as f64) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        let mut bins: [Option<Cluster>; BINS] = [None; BINS];
        for &k in order.iter() {
            let into = &mut bins[bin(k, axis)];
            let own = clusters[k as usize];
            *into = Some(into.map_or(own, |sum| sum.union(&own)));
        }
        let lengthened = longest / (whole.high - whole.low)[axis].max(longest * 1e-6);
        // Costs of everything before and after each cut, by sweeps from both ends.
        let sweep = |bins: &mut dyn Iterator<Item = &Option<Cluster>>| -> Vec<Option<f64>> {
            let mut sum: Option<Cluster> = None;
            let costs = bins.map(|bin| {
                sum = match (sum, bin) {
                    (Some(sum), Some(bin)) => Some(sum.union(bin)),
                    (sum, bin) => sum.or(*bin),
                };
                sum.map(|sum| sum.cost(lengthened))
            });
            costs.collect()
        };
        let (before, after) = (sweep(&mut bins.iter()), sweep(&mut bins.iter().rev()));
        for cut in 1..BINS {
            let (Some(left), Some(right)) = (before[cut - 1], after[BINS - 1 - cut]) else {
                continue;
            };
            if best.is_none_or(|(cost, ..)| left + right < cost) {
                best = Some((left + right, axis, cut));
            }
        }
    }
    let Some((_, axis, cut)) = best else {
        // All centres are one.
        return order.len() / 2;
    };
    order.sort_by_key(|&k| bin(k, axis) >= cut);
    order.partition_point(|&k| bin(k, axis) < cut)
}
