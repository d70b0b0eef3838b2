//! Bounds on the composed matrices of all paths at once.
//!
//! Each matrix may be regular by itself while the product along a path overflows or
//! vanishes. Norms bound the product without unfolding the DAG: with ‖·‖ the ∞-norm, ‖AB‖ ≤
//! ‖A‖‖B‖ and ‖AB‖ ≥ ‖B‖ / ‖A⁻¹‖. From the roots down, each node keeps the widest range
//! over all paths to it. Paths that these bounds do not show to be regular may still be
//! regular.

use super::graph_order::children_first;
use super::ids::ShapeId;
use super::nodes::Target;
use super::{Edge, Tables};
use crate::math::Affine;

/// The largest norm of a product that is accepted; the least is its inverse. It is far from
/// the end of f64's range and leaves room for the roundings on the longest path.
const MOST: f64 = 1e290;

/// The range of the composed matrices of some paths.
#[derive(Clone, Copy)]
struct Range {
    /// The least norm of the linear part.
    least: f64,
    most: f64,
    /// The largest coordinate of the translation.
    shift: f64,
}

impl Range {
    const IDENTITY: Range = Range {
        least: 1.0,
        most: 1.0,
        shift: 0.0,
    };
    /// The range of no path.
    const NONE: Range = Range {
        least: f64::INFINITY,
        most: 0.0,
        shift: 0.0,
    };

    fn union(self, other: Range) -> Range {
        Range {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            shift: self.shift.max(other.shift),
        }
    }

    fn is_regular(&self) -> bool {
        self.least > 1.0 / MOST && self.most < MOST && self.shift < MOST
    }
}

/// The ranges of `object_from_world` and `world_from_object`.
#[derive(Clone, Copy)]
struct Reach {
    inward: Range,
    outward: Range,
}

impl Reach {
    const NONE: Reach = Reach {
        inward: Range::NONE,
        outward: Range::NONE,
    };

    fn union(self, other: Reach) -> Reach {
        Reach {
            inward: self.inward.union(other.inward),
            outward: self.outward.union(other.outward),
        }
    }

    fn through(&self, scene: &Tables, edge: Edge) -> Reach {
        let t = edge.transform.index();
        let local = scene.transforms.local[t];
        let inverse = scene.transforms.inverse[t].unwrap_or(Affine::IDENTITY);
        let shift = |m: &Affine| m.translation.iter().fold(0.0, |s, x| f64::max(s, x.abs()));
        let (there, back) = (local.norm(), inverse.norm());
        Reach {
            // The product inverse · M.
            inward: Range {
                least: self.inward.least / there,
                most: self.inward.most * back,
                shift: self.inward.shift * back + shift(&inverse),
            },
            // The product M · local.
            outward: Range {
                least: self.outward.least / back,
                most: self.outward.most * there,
                shift: self.outward.most * shift(&local) + self.outward.shift,
            },
        }
    }
}

/// Says that the matrices of every instance stay finite and do not vanish, or returns a
/// shape for which the bounds do not show it.
pub(super) fn stay_regular(scene: &Tables) -> Result<(), ShapeId> {
    let mut of_node = vec![Reach::NONE; scene.nodes.len()];
    let world = Reach {
        inward: Range::IDENTITY,
        outward: Range::IDENTITY,
    };
    let lead = |edge: Edge, above: &Reach, of_node: &mut [Reach]| {
        let reach = above.through(scene, edge);
        match edge.target {
            Target::Node(node) => {
                let of_node = &mut of_node[node.index()];
                *of_node = of_node.union(reach);
            }
            Target::Shape(shape) => {
                if !(reach.inward.is_regular() && reach.outward.is_regular()) {
                    return Err(shape);
                }
            }
        }
        Ok(())
    };
    for row in 0..scene.roots.len() {
        lead(scene.roots.row(row), &world, &mut of_node)?;
    }
    for node in children_first(scene).unwrap_or_default().into_iter().rev() {
        let above = of_node[node as usize];
        // No path leads to this node.
        if above.inward.most == 0.0 {
            continue;
        }
        for row in scene.nodes.children[node as usize].clone() {
            lead(scene.edges.row(row as usize), &above, &mut of_node)?;
        }
    }
    Ok(())
}
