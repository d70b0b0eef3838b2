//! The farthest of many points along a direction, by a tree of boxes.
//!
//! The answer is the largest of the rounded products, as a scan over all points gives it:
//! a product of a box's corner is computed by the same operations, and rounding is monotone,
//! so no point in the box has a larger one.

use crate::math::Aabb;
use glam::DVec3;

/// The most points of one leaf.
const LEAF: usize = 8;

/// Points in the order of a tree that halves them along the longest axis of their box.
pub(super) struct Support {
    points: Vec<DVec3>,
    /// In depth-first order: a node's first child follows it.
    nodes: Vec<Node>,
}

struct Node {
    around: Aabb,
    /// The number of the second child; 0 in a leaf.
    second: usize,
}

impl Support {
    pub fn new(mut points: Vec<DVec3>) -> Support {
        let mut nodes = Vec::new();
        build(&mut points, &mut nodes);
        Support { points, nodes }
    }

    /// Returns the largest product of `normal` and a point; −∞ if there are none.
    pub fn reach(&self, normal: DVec3) -> f64 {
        let mut best = f64::NEG_INFINITY;
        self.search(normal, 0, &self.points, &mut best);
        best
    }

    fn search(&self, normal: DVec3, node: usize, points: &[DVec3], best: &mut f64) {
        let second = self.nodes[node].second;
        if second == 0 {
            *best = points
                .iter()
                .fold(*best, |best, p| best.max(normal.dot(*p)));
            return;
        }
        let (left, right) = points.split_at(points.len() / 2);
        let children = [(node + 1, left), (second, right)];
        let mut children = children.map(|(child, points)| {
            let Aabb { min, max } = self.nodes[child].around;
            let most = DVec3::select(normal.cmplt(DVec3::ZERO), min, max);
            (normal.dot(most), child, points)
        });
        if children[1].0 > children[0].0 {
            children.swap(0, 1);
        }
        for (bound, child, points) in children {
            if bound > *best {
                self.search(normal, child, points, best);
            }
        }
    }
}

fn build(points: &mut [DVec3], nodes: &mut Vec<Node>) {
    let around = Aabb::of_points(points.iter().copied());
    let node = nodes.len();
    nodes.push(Node { around, second: 0 });
    if points.len() <= LEAF {
        return;
    }
    let axis = around.extent().max_position();
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    let (left, right) = points.split_at_mut(middle);
    build(left, nodes);
    nodes[node].second = nodes.len();
    build(right, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_reaches_as_far_as_a_scan() {
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for count in [0, 1, 7, 8, 9, 100, 1000] {
            let points: Vec<DVec3> = (0..count)
                .map(|_| DVec3::new(random(), random(), 1e-3 * random()).normalize())
                .collect();
            let tree = Support::new(points.clone());
            for _ in 0..200 {
                let normal = DVec3::new(random(), random(), random());
                let scan = points.iter().map(|p| normal.dot(*p));
                assert_eq!(tree.reach(normal), scan.fold(f64::NEG_INFINITY, f64::max));
            }
        }
    }
}
