//! Watertightness: whether a mesh is closed, so that it has an inside (docs/SPEC.md, S42).
//!
//! A triangle is bounded by three directed edges. A mesh is closed if every directed edge,
//! by the positions of its ends, has as many opposites as copies; then any line that avoids
//! edges crosses the mesh an even number of times (docs/numerics/csg.md, K15). Several
//! shells are closed, and so are edges of four triangles that pair up. Triangles without
//! area count as well: no line meets one, but two longer edges may need its edges to match.
//! Vertices are compared by position, because files repeat them.

use super::Tables;
use super::ids::MeshId;
use glam::DVec3;
use std::fmt;

/// The reasons why a mesh is not closed: each undirected edge is in one of the counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaks {
    /// Edges of one triangle only.
    pub open: usize,
    /// Edges of two triangles that run along them in the same direction, so that one
    /// triangle is turned over.
    pub turned: usize,
    /// Edges of three triangles or more that do not pair up.
    pub unpaired: usize,
    /// The ends of the first such edge, in the order of triangles, in object space.
    pub first: [DVec3; 2],
    /// The triangle of the first such edge.
    pub triangle: usize,
}

impl fmt::Display for Leaks {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let kinds = [
            (self.open, "open", "of one triangle only"),
            (
                self.turned,
                "duplicated",
                "which two triangles run along in the same direction",
            ),
            (
                self.unpaired,
                "non-manifold",
                "of three triangles or more that do not pair up",
            ),
        ];
        let present: Vec<_> = kinds.iter().filter(|kind| kind.0 > 0).collect();
        for (i, (count, name, what)) in present.iter().enumerate() {
            let between = match i {
                0 => "",
                i if i + 1 == present.len() => " and ",
                _ => ", ",
            };
            let edges = if *count == 1 { "edge" } else { "edges" };
            write!(f, "{between}{count} {name} {edges} ({what})")?;
        }
        let [from, to] = self.first.map(|p| format!("({}, {}, {})", p.x, p.y, p.z));
        let triangle = self.triangle;
        write!(f, ", the first from {from} to {to} of triangle {triangle}")
    }
}

/// A directed edge: the numbers of its ends, the lower one first, whether it runs from the
/// lower one, and its triangle.
type Edge = (u32, u32, bool, u32);

/// Says whether a mesh is closed. The mesh's indices must be checked.
pub fn check_closed(tables: &Tables, id: MeshId) -> Result<(), Leaks> {
    let mesh = tables.meshes.row(id);
    let number = numbers(mesh.positions);
    let mut edges: Vec<Edge> = Vec::with_capacity(mesh.triangles.len() * 3);
    for (triangle, corners) in (0_u32..).zip(mesh.triangles) {
        let [a, b, c] = corners.map(|v| number[v as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            // An edge without length is its own opposite.
            if from != to {
                edges.push((from.min(to), from.max(to), from < to, triangle));
            }
        }
    }
    edges.sort_unstable();
    let [mut open, mut turned, mut unpaired] = [0; 3];
    let mut first: Option<Edge> = None;
    for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let forward = edge.iter().filter(|e| e.2).count();
        if forward * 2 == edge.len() {
            continue;
        }
        match edge.len() {
            1 => open += 1,
            2 => turned += 1,
            _ => unpaired += 1,
        }
        let least = edge.iter().min_by_key(|e| e.3).copied();
        first = [first, least].into_iter().flatten().min_by_key(|e| e.3);
    }
    let Some((low, high, is_forward, triangle)) = first else {
        return Ok(());
    };
    let place = |wanted: u32| {
        let corners = mesh.triangles[triangle as usize];
        let vertex = corners.into_iter().find(|v| number[*v as usize] == wanted);
        let position = mesh.positions[vertex.unwrap_or(corners[0]) as usize];
        // Adding zero removes negative zeros, because users read these numbers.
        DVec3::from_array(position.map(f64::from)) + mesh.center + DVec3::ZERO
    };
    let [from, to] = if is_forward { [low, high] } else { [high, low] };
    Err(Leaks {
        open,
        turned,
        unpaired,
        first: [place(from), place(to)],
        triangle: triangle as usize,
    })
}

/// Numbers the vertices; vertices at one position have one number.
fn numbers(positions: &[[f32; 3]]) -> Vec<u32> {
    // Adding zero makes both zeros equal.
    let key = |v: u32| positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|v| key(*v));
    let mut number = vec![0; positions.len()];
    for (i, alike) in (0..).zip(order.chunk_by(|a, b| key(*a) == key(*b))) {
        for vertex in alike {
            number[*vertex as usize] = i;
        }
    }
    number
}
