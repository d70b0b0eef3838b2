//! Lint for instances of one shape at one place, as far as equal placements of one parent
//! produce them.

use crate::scene::{Edges, Tables, Target, children_first};
use std::collections::HashMap;
use std::ops::Range;

/// The number of coincident instances that is reported: a ray that meets as many takes
/// milliseconds.
const MANY: u64 = 1 << 16;

/// Reports more coincident instances than any picture needs.
pub fn stacked(tables: &Tables) -> Option<String> {
    let mut of_node = vec![0; tables.nodes.len()];
    for node in children_first(tables).unwrap_or_default() {
        let children = &tables.nodes.children[node as usize];
        let rows = children.start as usize..children.end as usize;
        of_node[node as usize] = highest(tables, &tables.edges, rows, &of_node);
    }
    let roots = 0..tables.roots.len();
    let count = highest(tables, &tables.roots, roots, &of_node);
    (count > MANY).then(|| {
        format!(
            "{count} instances of one shape stand at one and the same place, and a ray that \
             comes there is tried on each: place the shape, or a node above it, once"
        )
    })
}

/// Returns the greatest number of instances below edges with one target and one transform.
fn highest(tables: &Tables, edges: &Edges, rows: Range<usize>, of_node: &[u64]) -> u64 {
    let mut stacks: HashMap<(Target, [u64; 12]), u64> = HashMap::new();
    for row in rows {
        let edge = edges.row(row);
        let local = &tables.transforms.local[edge.transform.index()];
        let linear = local.linear().as_flattened().iter();
        let mut bits = linear.chain(&local.translation).map(|x| x.to_bits());
        let place = std::array::from_fn(|_| bits.next().unwrap_or(0));
        let below = match edge.target {
            Target::Shape(_) => 1,
            Target::Node(id) => of_node[id.index()],
        };
        let stack = stacks.entry((edge.target, place)).or_default();
        *stack = stack.saturating_add(below);
    }
    stacks.into_values().max().unwrap_or(0)
}
