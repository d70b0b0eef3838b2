//! The binary tree, built from the top down: binned splits of large ranges, exact splits of
//! small ones.
//!
//! Rows move back and forth between two arrays, so that a split is one pass over its range.
//! Large ranges are read and divided in parallel, in chunks of fixed size. A range of at most
//! [`TASK`] rows is one thread's work; its nodes are joined to the others afterwards. Neither
//! depends on the number of threads, and so the tree does not.
//!
//! Depth is bounded: a range that has only as many levels left as halving needs is halved.

use super::bins::{Bins, Grid, halve, partition, partition_in};
use super::costs::{Costs, MAX_DEPTH, Scale};
use super::record::{Bound, Extents, Row, id};
use super::sweep::{SMALL, Sweep};
use crate::math::Aabb32;
use rayon::prelude::*;

/// The rows of one chunk; with their bins they fit the second-level cache.
const CHUNK: usize = 1 << 14;
/// The most rows that one thread divides alone; both of their arrays fit the second-level
/// cache.
const TASK: usize = 1 << 14;

/// A node of the binary tree, over primitives `first..first + count` of the new order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Binary {
    pub bounds: Aabb32,
    pub first: u32,
    pub count: u32,
    /// The first of two children, which stand behind their parent; 0 for a leaf.
    pub child: u32,
}

/// The parameters that all ranges of a build share.
pub(super) struct Plan {
    pub costs: Costs,
    pub scale: Scale,
}

impl Plan {
    /// Returns the levels that halving `count` rows down to blocks takes.
    fn levels(&self, count: usize) -> usize {
        count.div_ceil(self.costs.block).next_power_of_two().ilog2() as usize
    }

    /// Returns whether a range at `depth` must be halved to stay within [`MAX_DEPTH`].
    fn must_halve(&self, count: usize, depth: usize) -> bool {
        depth + self.levels(count) >= MAX_DEPTH
    }
}

/// Grows the tree over the rows, and returns its nodes, the root first, with the rows' ids in
/// its order.
pub(super) fn grow(
    rows: &mut [Row],
    spare: &mut [Row],
    extents: &Extents,
    plan: &Plan,
) -> (Vec<Binary>, Vec<u32>) {
    let mut order = vec![0; rows.len()];
    let range = Range {
        rows,
        spare,
        order: &mut order,
        first: 0,
        extents: *extents,
        depth: 0,
    };
    let part = grow_range(range, plan);
    let mut nodes = Vec::with_capacity(part.len());
    nodes.push(part.root());
    part.join(0, &mut nodes);
    (nodes, order)
}

/// A subtree whose nodes have no rows in the tree yet.
enum Part {
    Inner(Binary, Box<[Part; 2]>),
    /// The nodes of a task, the root first.
    Task(Vec<Binary>),
}

impl Part {
    fn len(&self) -> usize {
        match self {
            Part::Inner(_, children) => 1 + children.iter().map(Part::len).sum::<usize>(),
            Part::Task(nodes) => nodes.len(),
        }
    }

    fn root(&self) -> Binary {
        match self {
            Part::Inner(root, _) => *root,
            Part::Task(nodes) => nodes[0],
        }
    }

    /// Appends all nodes but the root, which is row `at`.
    fn join(&self, at: usize, nodes: &mut Vec<Binary>) {
        match self {
            Part::Inner(_, children) => {
                let child = nodes.len();
                nodes[at].child = child as u32;
                nodes.extend(children.iter().map(Part::root));
                children[0].join(child, nodes);
                children[1].join(child + 1, nodes);
            }
            Part::Task(own) => {
                let shift = nodes.len() as u32 - 1;
                let moved = |child: u32| if child == 0 { 0 } else { child + shift };
                nodes[at].child = moved(own[0].child);
                nodes.extend(own[1..].iter().map(|node| Binary {
                    child: moved(node.child),
                    ..*node
                }));
            }
        }
    }
}

/// The rows of a subtree to build, and an array for them to move to.
struct Range<'a> {
    rows: &'a mut [Row],
    spare: &'a mut [Row],
    order: &'a mut [u32],
    /// Where `order` begins in the whole order.
    first: usize,
    extents: Extents,
    depth: usize,
}

impl Range<'_> {
    fn node(&self) -> Binary {
        Binary {
            bounds: self.extents.bounds.aabb(),
            first: self.first as u32,
            count: self.rows.len() as u32,
            child: 0,
        }
    }
}

fn grow_range(range: Range, plan: &Plan) -> Part {
    if range.rows.len() <= TASK {
        return Part::Task(Task::default().grow(range, plan));
    }
    let root = range.node();
    let (moved, left, extents) = divide(range.rows, range.spare, &range.extents, plan, range.depth);
    let (rows, spare) = if moved {
        (range.spare, range.rows)
    } else {
        (range.rows, range.spare)
    };
    let (left_rows, right_rows) = rows.split_at_mut(left);
    let (left_spare, right_spare) = spare.split_at_mut(left);
    let (left_order, right_order) = range.order.split_at_mut(left);
    let side = |rows, spare, order, first, extents| Range {
        rows,
        spare,
        order,
        first,
        extents,
        depth: range.depth + 1,
    };
    let a = side(left_rows, left_spare, left_order, range.first, extents[0]);
    let b = side(
        right_rows,
        right_spare,
        right_order,
        range.first + left,
        extents[1],
    );
    let (a, b) = rayon::join(|| grow_range(a, plan), || grow_range(b, plan));
    Part::Inner(root, Box::new([a, b]))
}

/// Divides a large range, and returns whether the rows have moved to `spare`, how many are on
/// the left side, and the extents of both sides.
fn divide(
    rows: &[Row],
    spare: &mut [Row],
    extents: &Extents,
    plan: &Plan,
    depth: usize,
) -> (bool, usize, [Extents; 2]) {
    let halved = || {
        let (left, extents) = halve(rows, &plan.costs);
        (false, left, extents)
    };
    if plan.must_halve(rows.len(), depth) {
        return halved();
    }
    let grid = Grid::over(&extents.middles);
    let parts: Vec<Bins> = rows
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut bins = Bins::empty();
            bins.fill(chunk, &grid);
            bins
        })
        .collect();
    let mut bins = parts[0].clone();
    parts[1..].iter().for_each(|part| bins.merge(part));
    let Some(split) = bins.best(&plan.costs, plan.scale) else {
        return halved();
    };
    // Each chunk gets its own places on both sides, from the counts of its bins.
    let (mut left, mut right) = spare[..rows.len()].split_at_mut(split.left);
    let mut places = Vec::with_capacity(parts.len());
    for (chunk, part) in rows.chunks(CHUNK).zip(&parts) {
        let n = part.left_of(&split);
        let (a, rest) = left.split_at_mut(n);
        left = rest;
        let (b, rest) = right.split_at_mut(chunk.len() - n);
        right = rest;
        places.push((chunk, [a, b]));
    }
    let middles: Vec<[Bound; 2]> = places
        .into_par_iter()
        .map(|(chunk, sides)| partition(chunk, &grid, &split, sides))
        .collect();
    let bounds = bins.sides(&split);
    let sides = std::array::from_fn(|side| Extents {
        bounds: bounds[side],
        middles: middles
            .iter()
            .fold(Bound::empty(), |all, m| m[side].union(all)),
    });
    (true, split.left, sides)
}

/// The part of a build that one thread does alone.
#[derive(Default)]
struct Task {
    nodes: Vec<Binary>,
}

/// A node whose range is yet to be divided.
struct Open {
    node: usize,
    rows: std::ops::Range<usize>,
    middles: Bound,
    bounds: Bound,
    depth: usize,
    /// The array of the two that holds the rows.
    side: usize,
}

impl Task {
    fn grow(mut self, range: Range, plan: &Plan) -> Vec<Binary> {
        let count = range.rows.len();
        self.nodes.reserve(4 * count.div_ceil(plan.costs.block) + 1);
        self.nodes.push(range.node());
        let mut arrays = [range.rows, range.spare];
        let mut sweep = Sweep::new();
        let mut bins = Bins::empty();
        let mut open = vec![Open {
            node: 0,
            rows: 0..count,
            middles: range.extents.middles,
            bounds: range.extents.bounds,
            depth: range.depth,
            side: 0,
        }];
        while let Some(top) = open.pop() {
            let n = top.rows.len();
            if n <= SMALL {
                let rows = &arrays[top.side][top.rows.clone()];
                let order = &mut range.order[top.rows.clone()];
                self.sweep(&mut sweep, rows, order, &top, plan);
                continue;
            }
            let [a, b] = &mut arrays;
            let (rows, to) = if top.side == 0 { (a, b) } else { (b, a) };
            let rows = &rows[top.rows.clone()];
            let to = &mut to[top.rows.clone()];
            let mut split = None;
            let grid = Grid::over(&top.middles);
            if !plan.must_halve(n, top.depth) {
                bins = Bins::empty();
                bins.fill(rows, &grid);
                split = bins.best(&plan.costs, plan.scale);
            }
            let (left, extents, side) = match split {
                Some(split) => {
                    let middles = partition_in(rows, &grid, &split, to);
                    let bounds = bins.sides(&split);
                    let side = |k: usize| Extents {
                        bounds: bounds[k],
                        middles: middles[k],
                    };
                    (split.left, [side(0), side(1)], 1 - top.side)
                }
                None => {
                    let (left, extents) = halve(rows, &plan.costs);
                    (left, extents, top.side)
                }
            };
            let children = self.split(top.node, left, extents.map(|e| e.bounds));
            let middle = top.rows.start + left;
            let child = |k: usize, rows| Open {
                node: children + k,
                rows,
                middles: extents[k].middles,
                bounds: extents[k].bounds,
                depth: top.depth + 1,
                side,
            };
            open.push(child(1, middle..top.rows.end));
            open.push(child(0, top.rows.start..middle));
        }
        self.nodes
    }

    /// Adds the two children of a node, and returns the first.
    fn split(&mut self, node: usize, left: usize, bounds: [Bound; 2]) -> usize {
        let children = self.nodes.len();
        let Binary { first, count, .. } = self.nodes[node];
        self.nodes[node].child = children as u32;
        let left = left as u32;
        self.nodes.push(Binary {
            bounds: bounds[0].aabb(),
            first,
            count: left,
            child: 0,
        });
        self.nodes.push(Binary {
            bounds: bounds[1].aabb(),
            first: first + left,
            count: count - left,
            child: 0,
        });
        children
    }

    /// Builds the subtree over a small range by exact splits, and the order of its leaves.
    fn sweep(
        &mut self,
        sweep: &mut Sweep,
        rows: &[Row],
        order: &mut [u32],
        top: &Open,
        plan: &Plan,
    ) {
        let costs = &plan.costs;
        sweep.sort(rows);
        // (node, first rank, last rank, depth, area)
        let mut open = [(0_usize, 0_usize, 0_usize, 0_usize, 0.0_f32); SMALL];
        open[0] = (
            top.node,
            0,
            rows.len(),
            top.depth,
            plan.scale.area(top.bounds),
        );
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (node, first, last, depth, area) = open[height];
            let n = last - first;
            let mut cut = None;
            if n > 1 && !plan.must_halve(n, depth) {
                cut = sweep.best(rows, first, last, costs, plan.scale);
            }
            let pays = cut.is_some_and(|c| c.cost + costs.split * area < costs.blocks(n) * area);
            if n <= costs.leaf && !pays {
                for (to, i) in order[first..last].iter_mut().zip(sweep.ranks(first, last)) {
                    *to = id(&rows[*i as usize]);
                }
                continue;
            }
            let cut = cut.unwrap_or_else(|| sweep.half(rows, first, last, costs));
            sweep.divide(first, last, &cut);
            let (left, sides) = (cut.left, cut.sides);
            let children = self.split(node, left, sides);
            let areas = sides.map(|b| plan.scale.area(b));
            open[height] = (children + 1, first + left, last, depth + 1, areas[1]);
            open[height + 1] = (children, first, first + left, depth + 1, areas[0]);
            height += 2;
        }
    }
}

#[cfg(test)]
mod tests;
