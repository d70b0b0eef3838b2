//! Planes perpendicular to an axis, whichever surface they belong to: faces of boxes, caps of
//! cylinders, flat parts of meshes. A line crosses them in the order of two coordinates, so no
//! arithmetic is needed (K11, docs/numerics/csg.md).

use super::Line;
use super::surface::Surface;
use std::cmp::Ordering;

/// The plane on which the coordinate `axis` is `at`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::geom) struct AxisPlane {
    axis: usize,
    at: f64,
}

impl AxisPlane {
    pub fn new(surface: &Surface) -> Option<AxisPlane> {
        match surface {
            Surface::Plane { normal, offset } => {
                let axis = only(|k| normal[k] != 0.0)?;
                let at = offset * normal[axis];
                (normal[axis].abs() == 1.0).then_some(AxisPlane { axis, at })
            }
            Surface::PlaneThrough { normal, point } => {
                let axis = only(|k| normal[k] != 0.0)?;
                let at = point[axis];
                Some(AxisPlane { axis, at })
            }
            Surface::Cap { cone, at_top } => {
                let axis = only(|k| cone.base[k] != cone.top[k])?;
                let point = if *at_top { cone.top } else { cone.base };
                let at = point[axis];
                Some(AxisPlane { axis, at })
            }
            Surface::Facet([a, b, c]) => {
                let is_flat = |k: &usize| a[*k] == b[*k] && b[*k] == c[*k];
                let axis = (0..3).find(is_flat)?;
                let at = f64::from(a[axis]);
                Some(AxisPlane { axis, at })
            }
            _ => None,
        }
    }

    /// Returns the order of the t at which a line that crosses both planes meets them; `None` if
    /// the planes are not on one axis.
    pub fn order(&self, other: &AxisPlane, line: &Line) -> Option<Ordering> {
        if self.axis != other.axis {
            return None;
        }
        let order = self.at.partial_cmp(&other.at)?;
        let falls = line.dir[self.axis] < 0.0;
        Some(if falls { order.reverse() } else { order })
    }
}

/// Returns the axis for which the condition holds, if it holds for one only.
fn only(holds: impl Fn(usize) -> bool) -> Option<usize> {
    match [0, 1, 2].map(holds) {
        [true, false, false] => Some(0),
        [false, true, false] => Some(1),
        [false, false, true] => Some(2),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Cone;
    use crate::math::Number;
    use crate::math::dyadic::{Dyadic, exactly};
    use glam::DVec3;

    /// Makes planes of every kind on which a coordinate is `at`, in both orientations.
    fn planes(axis: usize, at: f64) -> Vec<Surface<'static>> {
        let along = DVec3::AXES[axis];
        let place = |rest: f64| {
            let mut place = [rest, 2.0 * rest, 3.0 * rest];
            place[axis] = at;
            place
        };
        let mut corners = [place(1.0), place(-2.0), place(1.0)].map(|c| c.map(|x| x as f32));
        corners[2][(axis + 1) % 3] += 1.0;
        let base = DVec3::from_array(place(0.25));
        [1.0, -1.0]
            .into_iter()
            .flat_map(|way: f64| {
                let cone = Cone {
                    base: base - along * 3.0 * way,
                    top: base,
                    base_radius: 1.0,
                    top_radius: 0.5,
                    open: false,
                };
                let turned = Cone {
                    base,
                    top: base + along * 3.0 * way,
                    ..cone
                };
                [
                    Surface::Plane {
                        normal: (along * way).to_array(),
                        offset: at * way,
                    },
                    Surface::PlaneThrough {
                        normal: (along * way * 7.0).to_array(),
                        point: place(5.0),
                    },
                    Surface::Cap { cone, at_top: true },
                    Surface::Cap {
                        cone: turned,
                        at_top: false,
                    },
                    Surface::Facet(corners),
                ]
            })
            .collect()
    }

    #[test]
    fn a_plane_is_where_it_is_said_to_be() {
        for (axis, at) in [(0, 1.5), (1, 0.0), (2, -4.25)] {
            for surface in planes(axis, at) {
                let plane = AxisPlane::new(&surface);
                assert_eq!(plane, Some(AxisPlane { axis, at }), "{surface:?}");
                let dir = [0.5, -2.0, 3.0];
                let mut org = [7.0, 8.0, 9.0];
                org[axis] = at - 4.0 * dir[axis];
                let zero = exactly(&|space| {
                    let [a, b, c]: [Dyadic; 3] = surface.on_line(space, &Line { org, dir }, 0.0);
                    assert!(a.sign()?.is_eq() && b.sign()?.is_ne());
                    b.doubled().times(&Dyadic::of(space, 4.0)).plus(&c).sign()
                });
                assert_eq!(zero, Ordering::Equal, "{surface:?}");
            }
        }
        let oblique = Surface::Plane {
            normal: [0.0, 1.0, 1e-300],
            offset: 1.0,
        };
        assert_eq!(AxisPlane::new(&oblique), None);
    }

    #[test]
    fn a_line_meets_them_in_the_order_of_its_direction() {
        let [near, far] = [1.0, 2.0].map(|at| AxisPlane { axis: 1, at });
        let line = |y: f64| Line {
            org: [0.0; 3],
            dir: [1.0, y, 0.0],
        };
        assert_eq!(near.order(&far, &line(1.0)), Some(Ordering::Less));
        assert_eq!(near.order(&far, &line(-1.0)), Some(Ordering::Greater));
        assert_eq!(near.order(&near, &line(-1.0)), Some(Ordering::Equal));
        let other = AxisPlane { axis: 0, at: 1.0 };
        assert_eq!(near.order(&other, &line(1.0)), None);
    }
}
