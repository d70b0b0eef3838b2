//! Exact crossing of a line and a polygon: its plane, and whether the line passes inside the
//! outline or through it.
//!
//! Corners are seen along the line, from its origin. Exact signs count the edges that cross the
//! positive x-axis (Shimrat's rule); a corner on the axis counts as below it. The origin is inside
//! if it lies on an edge (D16, docs/numerics/exact.md).

use crate::geom::Polygon;
use crate::geom::exact::Line;
use crate::geom::exact::line_quadratic::LineQuadratic;
use crate::geom::exact::orientation;
use crate::geom::exact::root::Root;
use crate::geom::exact::surface::Surface;
use crate::geom::polygon::room;
use crate::math::Number;
use crate::math::bounds::{ErrorBounded, UNIT};
use std::cmp::Ordering;

pub(in crate::geom) fn polygon(
    line: &Line,
    polygon: &Polygon,
    t_min: f64,
) -> Option<Root<'static>> {
    let plane = Surface::PlaneThrough {
        normal: polygon.normal.to_array(),
        point: polygon.points[0].to_array(),
    };
    let curve = LineQuadratic::new(line, plane, 0.0);
    if curve.linear_sign().is_eq() {
        return None;
    }
    let root = curve.root_of_linear();
    let met = root.order_with(t_min).is_gt() && View::new(line).contains(polygon);
    (met && is_in_room(&root, line, polygon)).then_some(root)
}

/// Says whether the plane is met in the polygon's room, and not far off at a grazing angle (S28).
fn is_in_room(root: &Root, line: &Line, polygon: &Polygon) -> bool {
    let room = room(polygon.points);
    let ErrorBounded { value, error } = root.t;
    (0..3).all(|k| {
        let (org, way) = (line.org[k], line.dir[k] * value);
        let at = org + way;
        let off = line.dir[k].abs() * error + (org.abs() + way.abs()) * (4.0 * f64::EPSILON);
        let off = off + f64::MIN_POSITIVE;
        let (low, high) = (room.min[k], room.max[k]);
        if at - off > low && at + off < high {
            return true;
        }
        if at + off < low || at - off > high {
            return false;
        }
        let mut normal = [0.0; 3];
        normal[k] = 1.0;
        let side = |offset| root.sign_of(&Surface::Plane { normal, offset });
        side(low).is_ge() && side(high).is_le()
    })
}

/// A line, and the axis along which its direction is longest.
struct View<'a> {
    line: &'a Line,
    axis: usize,
}

/// A corner as seen along the line.
struct Corner {
    point: [f64; 3],
    /// The sign of y.
    height: Ordering,
}

impl View<'_> {
    fn new(line: &Line) -> View<'_> {
        let size = line.dir.map(f64::abs);
        let axis = (0..3).max_by(|i, j| size[*i].total_cmp(&size[*j]));
        View {
            line,
            axis: axis.unwrap_or(0),
        }
    }

    fn contains(&self, polygon: &Polygon) -> bool {
        let corners = polygon.points.iter().map(|p| self.corner(p.to_array()));
        let mut a = self.corner(polygon.points[polygon.points.len() - 1].to_array());
        let mut odd = false;
        for b in corners {
            match (a.height, b.height) {
                (Ordering::Equal, Ordering::Equal) => {
                    if self.place(&a) != self.place(&b) || self.place(&a).is_eq() {
                        return true;
                    }
                }
                (from, to) if from == to => {}
                (from, to) => {
                    // The sign of the x at which the edge's line crosses the x-axis, times the
                    // direction in which it crosses.
                    let side = self.turn(&a, &b);
                    if side.is_eq() {
                        return true;
                    }
                    let crosses = from.is_gt() != to.is_gt();
                    odd ^= crosses && side.is_gt() == to.is_gt();
                }
            }
            a = b;
        }
        odd
    }

    #[inline(always)]
    fn corner(&self, point: [f64; 3]) -> Corner {
        let height = self.height(&point);
        Corner {
            point,
            height: height.unwrap_or_else(|| self.exact_place(&point, 1)),
        }
    }

    /// Returns the sign of y, from f64 where the bound allows (three roundings in each term), else
    /// exactly.
    #[inline(always)]
    fn height(&self, point: &[f64; 3]) -> Option<Ordering> {
        let Line { org, dir } = self.line;
        let (i, k) = ((self.axis + 2) % 3, self.axis);
        let across = (point[i] - org[i]) * dir[k];
        let depth = (point[k] - org[k]) * dir[i];
        let (y, size) = (across - depth, across.abs() + depth.abs());
        let certain = y.abs() > size * (4.0 * UNIT) + f64::MIN_POSITIVE;
        certain.then_some(if y > 0.0 {
            Ordering::Greater
        } else {
            Ordering::Less
        })
    }

    /// Returns the sign of x.
    fn place(&self, corner: &Corner) -> Ordering {
        let place = self.seen(&corner.point)[0].sign();
        place.unwrap_or_else(|| self.exact_place(&corner.point, 0))
    }

    #[cold]
    #[inline(never)]
    fn exact_place(&self, point: &[f64; 3], k: usize) -> Ordering {
        orientation::of_point(self.line, point, [(self.axis + 1 + k) % 3, self.axis])
    }

    /// Returns the sign of an edge function.
    #[inline(always)]
    fn turn(&self, a: &Corner, b: &Corner) -> Ordering {
        let turn = turn(&self.seen(&a.point), &self.seen(&b.point)).sign();
        turn.unwrap_or_else(|| self.exact_turn(&a.point, &b.point))
    }

    /// Returns the exact sign of an edge function: the line's own, times the direction's longest
    /// component.
    #[cold]
    fn exact_turn(&self, a: &[f64; 3], b: &[f64; 3]) -> Ordering {
        let side = orientation::of_edge(self.line, a, b);
        if self.line.dir[self.axis] < 0.0 {
            side.reverse()
        } else {
            side
        }
    }

    /// Returns x and y as seen along the line, times the direction's longest component.
    #[inline(always)]
    fn seen(&self, point: &[f64; 3]) -> [ErrorBounded; 2] {
        let Line { org, dir } = self.line;
        let from = |k: usize| ErrorBounded::displaced((), point[k], 0.0, 0.0, org[k]);
        let k = self.axis;
        let (depth, along) = (from(k), ErrorBounded::exact(dir[k]));
        let coordinate = |i: usize| {
            let across = from(i).times(&along);
            across.minus(&depth.times(&ErrorBounded::exact(dir[i])))
        };
        [coordinate((k + 1) % 3), coordinate((k + 2) % 3)]
    }
}

/// Returns the edge function of two corners, times the direction's longest component.
#[inline(always)]
fn turn(a: &[ErrorBounded; 2], b: &[ErrorBounded; 2]) -> ErrorBounded {
    a[0].times(&b[1]).minus(&a[1].times(&b[0]))
}
