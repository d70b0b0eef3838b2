//! A plain binary tree of boxes, split at the median. It prunes, nothing else:
//! what it visits is tested by the same functions as brute force.

use super::bounds::Bounds;
use super::ray::Ray;

#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Leaf(std::ops::Range<usize>),
    Inner(usize, usize),
}

/// What of a ray counts.
#[derive(Clone, Copy)]
pub enum Part {
    /// From its origin to a t that may become less.
    Until(f64),
    /// All of it, before its origin too.
    Line,
}

const LEAF: usize = 4;

impl Tree {
    /// Over items with these numbers and boxes.
    pub fn new(boxes: &[(u32, Bounds)]) -> Tree {
        let mut tree = Tree::default();
        if !boxes.is_empty() {
            let mut rows: Vec<(u32, Bounds, [f64; 3])> = boxes
                .iter()
                .map(|(item, b)| {
                    let middle = std::array::from_fn(|k| b.min[k] * 0.5 + b.max[k] * 0.5);
                    (*item, *b, middle)
                })
                .collect();
            tree.grow(&mut rows);
        }
        tree
    }

    /// Halves the rows, so it is no deeper than their count has bits.
    fn grow(&mut self, rows: &mut [(u32, Bounds, [f64; 3])]) -> usize {
        let bounds = rows
            .iter()
            .fold(Bounds::EMPTY, |all, row| all.union(&row.1));
        let here = self.nodes.len();
        let first = self.items.len();
        self.nodes.push(Node {
            bounds,
            kind: Kind::Leaf(first..first),
        });
        self.nodes[here].kind = if rows.len() <= LEAF {
            self.items.extend(rows.iter().map(|row| row.0));
            Kind::Leaf(first..self.items.len())
        } else {
            let middles = Bounds::of(rows.iter().map(|row| row.2));
            let extent: [f64; 3] = std::array::from_fn(|k| middles.max[k] - middles.min[k]);
            let axis = (0..3).fold(0, |k, i| if extent[i] > extent[k] { i } else { k });
            let half = rows.len() / 2;
            rows.select_nth_unstable_by(half, |a, b| a.2[axis].total_cmp(&b.2[axis]));
            let (low, high) = rows.split_at_mut(half);
            Kind::Inner(self.grow(low), self.grow(high))
        };
        here
    }

    /// Calls `item` for all whose boxes this part of the ray may meet; it answers
    /// with the limit from then on.
    pub fn visit(&self, ray: &Ray, slack: f64, part: Part, mut item: impl FnMut(u32) -> f64) {
        let (start, mut limit) = match part {
            Part::Until(limit) => (0.0, limit),
            Part::Line => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let enter = |node: usize| {
            let bounds = &self.nodes[node].bounds;
            bounds.enter(ray.org, ray.dir, slack, start)
        };
        let mut open: Vec<(usize, f64)> = Vec::new();
        if !self.nodes.is_empty() {
            open.extend(enter(0).map(|t| (0, t)));
        }
        while let Some((node, t)) = open.pop() {
            if t > limit {
                continue;
            }
            match &self.nodes[node].kind {
                Kind::Leaf(items) => {
                    for i in &self.items[items.clone()] {
                        let until = item(*i);
                        // A line goes on, unless nothing matters any more.
                        if matches!(part, Part::Until(_)) || until == f64::NEG_INFINITY {
                            limit = until;
                        }
                    }
                }
                Kind::Inner(low, high) => {
                    let mut both = [*low, *high].map(|n| enter(n).map(|t| (n, t)));
                    // The nearer one on top.
                    if let [Some(a), Some(b)] = both
                        && a.1 < b.1
                    {
                        both.swap(0, 1);
                    }
                    open.extend(both.into_iter().flatten());
                }
            }
        }
    }
}
