//! The oracle's binary tree of boxes, split at the median (docs/numerics/oracle.md, O7). It
//! only prunes: the items that it visits are tested by the same functions as brute force.

use super::bounds::Bounds;
use super::ray::Ray;

/// A tree over boxes; a leaf names items by number.
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

/// The part of a ray that a query looks at.
#[derive(Clone, Copy)]
pub enum Part {
    /// The part from the origin to a limit of t that may shrink.
    Until(f64),
    /// The whole line, before the origin too.
    Line,
}

/// The most items of a leaf.
const LEAF: usize = 4;

impl Tree {
    /// Builds the tree over items with these numbers and boxes.
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

    /// Builds the node of `rows` and returns its number. Rows are halved, so the depth is
    /// at most the number of bits of their count.
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
            let middles = Bounds::around(rows.iter().map(|row| row.2));
            let extent: [f64; 3] = std::array::from_fn(|k| middles.max[k] - middles.min[k]);
            let axis = (0..3).fold(0, |k, i| if extent[i] > extent[k] { i } else { k });
            let half = rows.len() / 2;
            rows.select_nth_unstable_by(half, |a, b| a.2[axis].total_cmp(&b.2[axis]));
            let (low, high) = rows.split_at_mut(half);
            Kind::Inner(self.grow(low), self.grow(high))
        };
        here
    }

    /// Calls `item` for every item whose box this part of the ray may meet. `item` returns
    /// the limit of t from then on.
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
                        // A query for the whole line ignores limits, except the one that
                        // ends it.
                        if matches!(part, Part::Until(_)) || until == f64::NEG_INFINITY {
                            limit = until;
                        }
                    }
                }
                Kind::Inner(low, high) => {
                    let mut both = [*low, *high].map(|n| enter(n).map(|t| (n, t)));
                    // The nearer child is visited first.
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
