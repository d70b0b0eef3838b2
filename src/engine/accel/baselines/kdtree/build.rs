//! The builder of k-d trees, in O(n log n). Events are sorted once, at the root; each split
//! passes them on in order, and only the few entries that it cuts get new ones (Wald and
//! Havran 2006, section 4.3).
//!
//! The builder is deterministic: any free thread may build a subtree, but a subtree depends
//! only on its own cell.

use super::clip::Clipped;
use super::events::{
    END, Event, Measure, PLANAR, START, Split, best_split, halves, merged, push_events,
};
use super::quality::{KdQuality, KdStop};
use super::{KdTree, Node};
use crate::accel::baselines::index::Primitives;
use crate::math::Aabb32;

/// The most references per entry after duplication.
const MOST_REFERENCES: f64 = 32.0;
/// The share of a leaf's cost above which a split has improved too little.
const IMPROVED: f64 = 0.9;
/// The least number of entries of a cell whose children are built in parallel.
const PARALLEL: usize = 2048;

/// An entry of a cell, and the box of its part in the cell.
#[derive(Clone, Copy)]
struct Reference {
    entry: u32,
    region: Aabb32,
}

struct Builder<'a> {
    quality: &'a KdQuality,
    /// By entry: the triangle to clip; `None` if its box is used.
    clipped: Vec<Option<Clipped>>,
    measure: Measure,
    depth: u32,
    /// The most splits on a path that may improve the cost too little.
    failures: u32,
}

/// A cell that a subtree is to be built for.
struct Cell {
    bounds: Aabb32,
    references: Vec<Reference>,
    /// The sorted events of the references.
    events: Vec<Event>,
    depth: u32,
    failures: u32,
    /// The most references of the subtree, per reference of the cell.
    room: f64,
}

/// The references on one side of a plane, and their sorted events.
type Held = (Vec<Reference>, Vec<Event>);

struct Subtree {
    /// The expected cost times the measure of the cell.
    cost: f64,
    depth: usize,
    kind: Kind,
}

enum Kind {
    Leaf(Vec<u32>),
    Inner(usize, f32, Box<[Subtree; 2]>),
}

/// Builds a k-d tree, and returns it with the order of the primitives.
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
    let corners = primitives.corners.unwrap_or_default().iter();
    let least = (8.0 + 1.3 * libm::log2(boxes.len().max(1) as f64)) as u32;
    let depth = quality.depth.unwrap_or(least).min(KdTree::MAX_DEPTH as u32);
    let measure = match Measure::Area.size(&bounds) > 0.0 {
        true => Measure::Area,
        false => Measure::Length,
    };
    let builder = Builder {
        quality,
        clipped: corners
            .map(|corners| Clipped::new(corners, quality.clip, extent))
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
        sah: if some(&bounds) && measure.size(&bounds) > 0.0 {
            subtree.cost / measure.size(&bounds)
        } else {
            boxes.len() as f64
        },
    };
    let mut order = Vec::with_capacity(boxes.len());
    let mut places = vec![u32::MAX; boxes.len()];
    lay_out(&subtree, &mut tree, &mut places, &mut order);
    // Primitives with an empty box are in no leaf and come last.
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
        let measure = self.measure.size(&bounds);
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
            cost: self.measure.size(bounds) * references.len() as f64,
            depth: 0,
            kind: Kind::Leaf(references.iter().map(|r| r.entry).collect()),
        }
    }

    /// Finds the plane to split a cell at; `None` if the cell becomes a leaf.
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

    /// Returns the references and events of the two children.
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
        // References on one side are numbered first, then those on both sides.
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

    /// Returns the box of an entry's part in a child cell, for an entry that the plane cuts.
    fn region(&self, reference: &Reference, cell: &Aabb32) -> Option<Aabb32> {
        let part = Aabb32 {
            min: std::array::from_fn(|k| reference.region.min[k].max(cell.min[k])),
            max: std::array::from_fn(|k| reference.region.max[k].min(cell.max[k])),
        };
        match self.clipped.get(reference.entry as usize) {
            Some(Some(triangle)) => triangle.region(&part),
            _ => Some(part),
        }
    }
}

/// Lays out nodes depth first, the lower child right behind its parent, and entries in the
/// order in which leaves first list them.
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
