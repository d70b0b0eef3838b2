//! Closed meshes as CSG operands: crossings of a line by parity (K15).
//!
//! A point is inside where an odd number of crossings lies behind it, whatever the winding
//! of the triangles. A line through an edge or a corner crosses the triangles that a line
//! moved next to it crosses ([`through`], K14), so the number of crossings is even. Of
//! several crossings at one t only the parity counts.

use crate::accel::MeshCrossings;
use crate::geom::exact::{Line, Root, through};
use crate::scene::Mesh;

/// A crossing of a line and a triangle of a closed mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshCrossing {
    pub root: Root<'static>,
    pub triangle: u32,
    /// Whether the line runs against the triangle's normal.
    pub against: bool,
}

/// Calls `visit` at each t beyond `t_min` where the line enters or leaves the mesh, in
/// order. Returns whether the line is inside at t_min. The line is relative to the mesh's
/// centre, as its corners are. `met` is a buffer.
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

/// Picks, of an odd number of crossings, the first with the orientation of the majority.
fn representative(together: &[MeshCrossing]) -> &MeshCrossing {
    let against = together.iter().filter(|facet| facet.against).count();
    let most = against * 2 > together.len();
    let first = together.iter().find(|facet| facet.against == most);
    first.unwrap_or(&together[0])
}
