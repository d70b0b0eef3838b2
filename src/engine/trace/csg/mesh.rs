//! A closed mesh as an operand: a line comes into it and leaves it in turn.
//!
//! Inside is where an odd number of crossings lies behind a point, whichever way
//! the triangles are wound. A line through an edge or a corner meets the triangles
//! that one next to it would ([`through`]), so crossings are even in number; of
//! several at one t only whether they are odd counts.

use crate::accel::MeshCrossings;
use crate::geom::exact::{Line, Root, through};
use crate::scene::Mesh;

/// Where a line comes into a mesh, or leaves it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshCrossing {
    pub root: Root<'static>,
    pub triangle: u32,
    /// The line comes against the triangle's normal.
    pub against: bool,
}

/// Calls `visit` at each place beyond `t_min` where the line's state changes, in
/// order. Returns whether it is inside at t_min. `met`: reused from ray to ray. The line is about the mesh's
/// centre, as the mesh's corners are.
pub(super) fn crossings(
    (mesh, facets): (&Mesh, &MeshCrossings),
    line: &Line,
    t_min: f64,
    met: &mut Vec<MeshCrossing>,
    mut visit: impl FnMut(&MeshCrossing),
) -> bool {
    let is_line = line.dir.iter().any(|x| *x != 0.0);
    if !is_line || !line.is_finite() {
        return false;
    }
    met.clear();
    facets.along(line, t_min, |triangle| {
        let found = through(line, &mesh.corners(triangle as usize));
        met.extend(found.map(|(root, against)| MeshCrossing {
            root,
            triangle,
            against,
        }));
    });
    met.retain(|facet| facet.root.order_with(t_min).is_gt());
    let by_t = |a: &MeshCrossing, b: &MeshCrossing| {
        let order = a.root.order(&b.root);
        order.then(a.triangle.cmp(&b.triangle))
    };
    met.sort_unstable_by(by_t);
    let at_one_t = |a: &MeshCrossing, b: &MeshCrossing| a.root.order(&b.root).is_eq();
    let mut changes = 0;
    for together in met.chunk_by(at_one_t) {
        if together.len() % 2 == 1 {
            changes += 1;
            visit(representative(together));
        }
    }
    debug_assert!(t_min > f64::NEG_INFINITY || changes % 2 == 0);
    changes % 2 == 1
}

/// Of an odd number of triangles, the first that most of them face alike.
fn representative(together: &[MeshCrossing]) -> &MeshCrossing {
    let against = together.iter().filter(|facet| facet.against).count();
    let most = against * 2 > together.len();
    let first = together.iter().find(|facet| facet.against == most);
    first.unwrap_or(&together[0])
}
