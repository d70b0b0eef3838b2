//! Exact span of a line in a closed cone, and exact crossings of an open cone's side.

use super::Cone;
use crate::geom::exact::line_quadratic::{LineQuadratic, nearest_to};
use crate::geom::exact::solid::SpanRoots;
use crate::geom::exact::surface::Surface as AnySurface;
use crate::geom::exact::{Line, root};
use std::cmp::Ordering;

type Surface = AnySurface<'static>;
type Root = root::Root<'static>;

/// A line against a cone's side and caps.
struct Frustum {
    side: LineQuadratic,
    /// The sign of the quadratic coefficient along the side.
    bend: Ordering,
    /// The roots of the side, where that coefficient is not zero.
    roots: Option<[Root; 2]>,
    /// Where the line crosses the caps' planes, in order; or, if it is parallel to them, whether
    /// it runs between them.
    caps: Result<[Root; 2], bool>,
}

impl Frustum {
    #[inline(always)]
    fn new(line: &Line, cone: &Cone) -> Frustum {
        let middle = cone.base * 0.5 + cone.top * 0.5;
        let shift = nearest_to(line, middle.to_array());
        let side = LineQuadratic::new(line, Surface::Side(*cone), shift);
        let bend = side.quadratic_sign();
        let roots = bend.is_ne().then(|| side.roots(bend)).flatten();
        let cap = |at_top: bool| {
            let cap = Surface::Cap {
                cone: *cone,
                at_top,
            };
            LineQuadratic::new(line, cap, shift)
        };
        let (base, top) = (cap(false), cap(true));
        let caps = match base.linear_sign() {
            Ordering::Less => Ok([top.root_of_linear(), base.root_of_linear()]),
            Ordering::Equal => Err(base.constant_sign().is_ge() && top.constant_sign().is_le()),
            Ordering::Greater => Ok([base.root_of_linear(), top.root_of_linear()]),
        };
        Frustum {
            side,
            bend,
            roots,
            caps,
        }
    }

    /// Returns the one place where the line goes into the side (the sign is negative) or out of
    /// it.
    fn passage(&self, way: Ordering) -> Option<Root> {
        match self.roots {
            Some([lower, upper]) => Some(if self.bend == way { upper } else { lower }),
            // A quadratic without a root does not change its sign.
            None => (self.bend.is_eq() && self.side.linear_sign() == way)
                .then(|| self.side.root_of_linear()),
        }
    }
}

/// Returns the span of a line in a closed cone. Between the caps' planes the cone is convex, so
/// there is one span: whether the line is inside the side where it crosses these planes says which
/// roots of the side are its ends.
pub(in crate::geom) fn cone(line: &Line, cone: &Cone) -> Option<SpanRoots> {
    let frustum = Frustum::new(line, cone);
    let Frustum {
        side, bend, roots, ..
    } = &frustum;
    let [first, last] = match frustum.caps {
        Ok(caps) => caps,
        // Across the axis the span is a chord of a disc.
        Err(between) => {
            let roots = roots.filter(|_| between && bend.is_gt())?;
            return Some(roots.map(Some));
        }
    };
    let within = |cap: &Root| side.sign_at(cap, *bend, roots.as_ref()).is_le();
    let (enter, exit) = match (within(&first), within(&last)) {
        (true, true) => (Some(first), Some(last)),
        (true, false) => (Some(first), frustum.passage(Ordering::Greater)),
        (false, true) => (frustum.passage(Ordering::Less), Some(last)),
        (false, false) => {
            let [lower, upper] = roots.filter(|_| bend.is_gt())?;
            if first.order(&lower).is_gt() || lower.order(&last).is_gt() {
                return None;
            }
            (Some(lower), Some(upper))
        }
    };
    Some([enter, exit])
}

/// Returns the first crossing of an open cone's side beyond t_min. A line that lies in the side
/// does not cross it.
pub(in crate::geom) fn cone_side(line: &Line, cone: &Cone, t_min: f64) -> Option<Root> {
    let frustum = Frustum::new(line, cone);
    let linear = frustum.bend.is_eq() && frustum.side.linear_sign().is_ne();
    let only = linear.then(|| frustum.side.root_of_linear());
    let roots = frustum.roots.into_iter().flatten().chain(only);
    let on_side = |root: &Root| match &frustum.caps {
        Ok([first, last]) => first.order(root).is_le() && root.order(last).is_le(),
        Err(between) => *between,
    };
    let beyond = |root: &Root| root.order_with(t_min).is_gt();
    roots.into_iter().find(|root| beyond(root) && on_side(root))
}
