//! Outlines that are turned about an axis, as cones.
//!
//! An edge sweeps the side of a cone, so what an outline sweeps is what lies in an odd number
//! of the pieces of cones between its edges and the axis.

use glam::DVec2;

/// A piece of a cone about the axis: (radius, height) of its lower and of its upper end, of
/// which one radius may be 0.
pub type Frustum = [DVec2; 2];

/// Returns the pieces of cones between the edges of a closed ring of (distance from the axis,
/// height) and the axis. Of what lies at negative distances nothing counts.
pub fn frusta(ring: &[DVec2]) -> impl Iterator<Item = Frustum> + '_ {
    let next = ring.iter().skip(1).chain(ring.first());
    ring.iter().zip(next).filter_map(|(a, b)| {
        let [low, high] = if a.y < b.y { [*a, *b] } else { [*b, *a] };
        frustum(low, high)
    })
}

fn frustum(mut low: DVec2, mut high: DVec2) -> Option<Frustum> {
    if !(low.y < high.y) || low.x.max(high.x) <= 0.0 {
        return None;
    }
    let (from, to) = (low, high);
    let at_axis = || {
        let part = from.x / (from.x - to.x);
        DVec2::new(0.0, from.y + (to.y - from.y) * part)
    };
    if low.x < 0.0 {
        low = at_axis();
    } else if high.x < 0.0 {
        high = at_axis();
    }
    (low.y < high.y).then_some([low, high])
}
