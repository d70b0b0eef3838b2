//! Order of the scene's graph: nodes after their children, and the nodes that are used.

use super::Tables;
use super::nodes::Target;

/// Marks the nodes that a root leads to.
pub fn used_nodes(scene: &Tables, children_first: &[u32]) -> Vec<bool> {
    fn mark(used: &mut [bool], targets: &[Target]) {
        for target in targets {
            if let Target::Node(node) = target {
                used[node.index()] = true;
            }
        }
    }
    let mut used = vec![false; scene.nodes.len()];
    mark(&mut used, &scene.roots.target);
    for node in children_first.iter().rev() {
        if used[*node as usize] {
            let rows = scene.nodes.children[*node as usize].clone();
            let targets = &scene.edges.target[rows.start as usize..rows.end as usize];
            mark(&mut used, targets);
        }
    }
    used
}

/// Lists the nodes, each after all of its children; or returns a cycle, with its first node
/// repeated. The stack is explicit, because graphs may be a million nodes deep.
pub fn children_first(scene: &Tables) -> Result<Vec<u32>, Vec<u32>> {
    const NEW: u8 = 0;
    const OPEN: u8 = 1;
    const DONE: u8 = 2;
    let mut state = vec![NEW; scene.nodes.len()];
    let mut order = Vec::with_capacity(scene.nodes.len());
    let mut stack: Vec<(u32, u32)> = Vec::new();
    for start in 0..scene.nodes.len() as u32 {
        if state[start as usize] != NEW {
            continue;
        }
        state[start as usize] = OPEN;
        stack.push((start, scene.nodes.children[start as usize].start));
        while let Some((node, next)) = stack.last_mut() {
            if *next == scene.nodes.children[*node as usize].end {
                state[*node as usize] = DONE;
                order.push(*node);
                stack.pop();
                continue;
            }
            let target = scene.edges.target[*next as usize];
            *next += 1;
            let Target::Node(child) = target else {
                continue;
            };
            match state[child.index()] {
                NEW => {
                    state[child.index()] = OPEN;
                    stack.push((child.0, scene.nodes.children[child.index()].start));
                }
                OPEN => {
                    let from = stack.iter().position(|(n, _)| *n == child.0).unwrap_or(0);
                    let mut path: Vec<u32> = stack[from..].iter().map(|(n, _)| *n).collect();
                    path.push(child.0);
                    return Err(path);
                }
                _ => {}
            }
        }
    }
    Ok(order)
}
