//! Building in O(n log n): events are sorted once, at the root; each split
//! hands them on in order, and only the few entries that it cuts get new ones
//! (Wald and Havran 2006, section 4.3).
//!
//! Deterministic: subtrees are built by whichever thread is free, and each
//! depends on nothing but its own cell.

use super::clip::Shape;
use super::events::{
    END, Event, Measure, PLANAR, START, Split, best_split, halves, merged, push_events,
};
use super::quality::{KdQuality, KdStop};
use super::{KdTree, Node};
use crate::accel::baselines::index::Primitives;
use crate::math::Aabb32;

/// References per entry that duplication may lead to, at most.
const MOST_REFERENCES: f64 = 32.0;
/// A split that keeps more than this of a leaf's cost has improved too little.
const IMPROVED: f64 = 0.9;
/// Cells of fewer entries are not worth another thread.
const PARALLEL: usize = 2048;

/// An entry in a cell, and the box of what it has there.
#[derive(Clone, Copy)]
struct Reference {
    entry: u32,
    region: Aabb32,
}

struct Builder<'a> {
    quality: &'a KdQuality,
    shapes: Vec<Option<Shape>>,
    measure: Measure,
    depth: u32,
    /// Splits on the way down that may improve the cost too little.
    failures: u32,
}

/// What is to be built of one cell.
struct Cell {
    bounds: Aabb32,
    references: Vec<Reference>,
    /// Sorted.
    events: Vec<Event>,
    depth: u32,
    failures: u32,
    /// References that the subtree may still come to, per one of the cell's.
    room: f64,
}

/// What one side of a plane holds: references, and their sorted events.
type Held = (Vec<Reference>, Vec<Event>);

struct Subtree {
    /// Expected, times the measure of the cell.
    cost: f64,
    depth: usize,
    kind: Kind,
}

enum Kind {
    Leaf(Vec<u32>),
    Inner(usize, f32, Box<[Subtree; 2]>),
}

/// The tree, and for each of its entries the primitive that it came from.
pub fn build(primitives: &Primitives, quality: &KdQuality) -> (KdTree, Vec<u32>) {
    let boxes = primitives.boxes;
    let bounds = primitives.bounds();
    let some = |b: &Aabb32| (0..3).all(|k| b.min[k] <= b.max[k]);
    let references: Vec<Reference> = (0_u32..)
        .zip(boxes)
        .filter(|(_, b)| some(b))
        .map(|(entry, b)| Reference { entry, region: *b })
        .collect();
    let mut events = Vec::with_capacity(references.len() * 6);
    for (i, reference) in references.iter().enumerate() {
        push_events(&reference.region, i, &mut events);
    }
    events.sort_unstable();
    let extent = bounds.widened().max_abs();
    let shapes = primitives.corners.unwrap_or_default().iter();
    let least = (8.0 + 1.3 * (boxes.len().max(1) as f64).log2()) as u32;
    let depth = quality.depth.unwrap_or(least).min(KdTree::MAX_DEPTH as u32);
    let measure = match Measure::Area.of(&bounds) > 0.0 {
        true => Measure::Area,
        false => Measure::Length,
    };
    let builder = Builder {
        quality,
        shapes: shapes
            .map(|corners| Shape::new(corners, quality.clip, extent))
            .collect(),
        measure,
        depth,
        failures: 1 + depth / 5,
    };
    let subtree = builder.build(Cell {
        bounds,
        references,
        events,
        depth: 0,
        failures: 0,
        room: MOST_REFERENCES,
    });
    let mut tree = KdTree {
        nodes: Vec::new(),
        references: Vec::new(),
        bounds,
        len: boxes.len(),
        depth: subtree.depth,
        sah: if some(&bounds) && measure.of(&bounds) > 0.0 {
            subtree.cost / measure.of(&bounds)
        } else {
            boxes.len() as f64
        },
    };
    let mut order = Vec::with_capacity(boxes.len());
    let mut places = vec![u32::MAX; boxes.len()];
    lay_out(&subtree, &mut tree, &mut places, &mut order);
    // What stands nowhere, since it is empty.
    for (i, place) in places.iter().enumerate() {
        if *place == u32::MAX {
            order.push(i as u32);
        }
    }
    (tree, order)
}

impl Builder<'_> {
    fn build(&self, cell: Cell) -> Subtree {
        let Some(split) = self.split(&cell) else {
            return self.leaf(&cell.bounds, &cell.references);
        };
        let Cell {
            bounds,
            references,
            events,
            depth,
            failures,
            room,
        } = cell;
        let count = references.len();
        let [low, high] = self.divide(&bounds, &references, events, &split);
        let room = room * count as f64 / (low.0.len() + high.0.len()).max(1) as f64;
        if room < 1.0 {
            return self.leaf(&bounds, &references);
        }
        let failed = split.cost > IMPROVED * count as f64;
        let [low_bounds, high_bounds] = halves(&bounds, split.axis, split.position);
        let child = |(references, events), bounds| Cell {
            bounds,
            references,
            events,
            depth: depth + 1,
            failures: failures + u32::from(failed),
            room,
        };
        let (low, high) = (child(low, low_bounds), child(high, high_bounds));
        let children = if count >= PARALLEL {
            rayon::join(|| self.build(low), || self.build(high))
        } else {
            (self.build(low), self.build(high))
        };
        let measure = self.measure.of(&bounds);
        let cost = f64::from(self.quality.node_cost) * measure + children.0.cost + children.1.cost;
        if self.quality.stop == KdStop::Cost && cost >= measure * count as f64 {
            return self.leaf(&bounds, &references);
        }
        Subtree {
            cost,
            depth: 1 + children.0.depth.max(children.1.depth),
            kind: Kind::Inner(split.axis, split.position, Box::new(children.into())),
        }
    }

    fn leaf(&self, bounds: &Aabb32, references: &[Reference]) -> Subtree {
        Subtree {
            cost: self.measure.of(bounds) * references.len() as f64,
            depth: 0,
            kind: Kind::Leaf(references.iter().map(|r| r.entry).collect()),
        }
    }

    /// The plane to cut at; `None` makes a leaf.
    fn split(&self, cell: &Cell) -> Option<Split> {
        let (quality, count) = (self.quality, cell.references.len());
        let few = count <= quality.leaf as usize;
        let deepest = match quality.stop {
            KdStop::Count => KdTree::MAX_DEPTH as u32,
            _ => self.depth,
        };
        let done = match quality.stop {
            KdStop::Depth => count == 0,
            KdStop::Count | KdStop::Both => few,
            KdStop::Cost => cell.failures > self.failures || count == 0,
        };
        if done || cell.depth >= deepest {
            return None;
        }
        best_split(&cell.events, count, &cell.bounds, self.measure, quality)
    }

    /// References and events of the two children.
    fn divide(
        &self,
        bounds: &Aabb32,
        references: &[Reference],
        events: Vec<Event>,
        split: &Split,
    ) -> [Held; 2] {
        const BOTH: u8 = 0;
        const LOW: u8 = 1;
        const HIGH: u8 = 2;
        let mut sides = vec![BOTH; references.len()];
        for event in events.iter().filter(|e| e.axis() == split.axis) {
            let position = event.position();
            let side = match event.kind() {
                END if position <= split.position => LOW,
                START if position >= split.position => HIGH,
                PLANAR if position < split.position => LOW,
                PLANAR if position > split.position => HIGH,
                PLANAR if split.planar_low => LOW,
                PLANAR => HIGH,
                _ => continue,
            };
            sides[event.entry()] = side;
        }
        // New numbers of what lies on one side, then of what lies on both.
        let mut number = vec![0_u32; references.len()];
        let [mut low, mut high] = [Vec::new(), Vec::new()];
        for (i, reference) in references.iter().enumerate() {
            let child = match sides[i] {
                LOW => &mut low,
                HIGH => &mut high,
                _ => continue,
            };
            number[i] = child.len() as u32;
            child.push(*reference);
        }
        let [mut low_events, mut high_events] = [Vec::new(), Vec::new()];
        for event in &events {
            let own = event.entry();
            match sides[own] {
                LOW => low_events.push(event.renumbered(number[own] as usize)),
                HIGH => high_events.push(event.renumbered(number[own] as usize)),
                _ => {}
            }
        }
        drop(events);
        let [low_bounds, high_bounds] = halves(bounds, split.axis, split.position);
        let [mut low_new, mut high_new] = [Vec::new(), Vec::new()];
        for (i, reference) in references.iter().enumerate() {
            if sides[i] != BOTH {
                continue;
            }
            for (cell, child, new) in [
                (&low_bounds, &mut low, &mut low_new),
                (&high_bounds, &mut high, &mut high_new),
            ] {
                if let Some(region) = self.region(reference, cell) {
                    push_events(&region, child.len(), new);
                    child.push(Reference {
                        entry: reference.entry,
                        region,
                    });
                }
            }
        }
        low_new.sort_unstable();
        high_new.sort_unstable();
        [
            (low, merged(&low_events, &low_new)),
            (high, merged(&high_events, &high_new)),
        ]
    }

    /// Of an entry that a cut goes through: what it has on one side.
    fn region(&self, reference: &Reference, cell: &Aabb32) -> Option<Aabb32> {
        let part = Aabb32 {
            min: std::array::from_fn(|k| reference.region.min[k].max(cell.min[k])),
            max: std::array::from_fn(|k| reference.region.max[k].min(cell.max[k])),
        };
        match self.shapes.get(reference.entry as usize) {
            Some(Some(shape)) => shape.clipped(&part),
            _ => Some(part),
        }
    }
}

/// Nodes in depth-first order, the lower child right behind its parent; entries
/// in the order in which leaves first name them.
fn lay_out(subtree: &Subtree, tree: &mut KdTree, places: &mut [u32], order: &mut Vec<u32>) {
    match &subtree.kind {
        Kind::Leaf(entries) => {
            let first = tree.references.len();
            for entry in entries {
                let place = &mut places[*entry as usize];
                if *place == u32::MAX {
                    *place = order.len() as u32;
                    order.push(*entry);
                }
                tree.references.push(*place);
            }
            tree.references[first..].sort_unstable();
            tree.nodes.push(Node::leaf(first, entries.len()));
        }
        Kind::Inner(axis, position, children) => {
            let node = tree.nodes.len();
            tree.nodes.push(Node::leaf(0, 0));
            lay_out(&children[0], tree, places, order);
            let high = tree.nodes.len();
            tree.nodes[node] = Node::inner(*axis, *position, high);
            lay_out(&children[1], tree, places, order);
        }
    }
}
