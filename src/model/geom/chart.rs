//! Texture coordinates of primitives: where the image lies on a surface (docs/LIGHT.md, T9 to
//! T12).
//!
//! u goes to the right and v down as the surface is seen from outside, so nothing is mirrored.
//! All is f64 arithmetic and libm, one point at a time, with the same bits everywhere.

use super::cone::Upright;
use crate::math::{length, unit};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, FRAC_1_SQRT_2};

/// Texture coordinates at a point of a surface, and their gradients in the shape's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chart {
    pub uv: [f64; 2],
    pub du: DVec3,
    pub dv: DVec3,
}

/// One turn in radians, inverted.
const PER_TURN: f64 = 0.5 * FRAC_1_PI;

/// The least square of a distance from an axis that gradients are computed for: what is nearer
/// is a pole, where they have no limit.
const POLE: f64 = 1e-200;

/// An angle in turns with its gradient.
pub(super) struct Turns {
    pub turns: f64,
    pub gradient: DVec3,
}

/// Computes the angle of (`across`, `ahead`) from `ahead`, from −½ to ½ of a turn; 0 for (0, 0).
/// The axes are the gradients of the two coordinates.
pub(super) fn turns_of((across, right): (f64, DVec3), (ahead, front): (f64, DVec3)) -> Turns {
    let squared = (across * across + ahead * ahead).max(POLE);
    Turns {
        turns: libm::atan2(across, ahead) * PER_TURN,
        gradient: (right * ahead - front * across) * (PER_TURN / squared),
    }
}

/// Returns the directions in which u and v grow on a face of an axis-parallel cube. The face is
/// that whose normal is nearest to `normal`, of equally near ones that of the first axis.
pub(super) fn face_axes(normal: DVec3) -> [DVec3; 2] {
    let [x, y, z] = normal.abs().to_array();
    let axis = match () {
        () if x >= y && x >= z => 0,
        () if y >= z => 1,
        () => 2,
    };
    let sign = if normal[axis] < 0.0 { -1.0 } else { 1.0 };
    match axis {
        0 => [DVec3::Z * -sign, -DVec3::Y],
        1 => [DVec3::X, DVec3::Z * sign],
        _ => [DVec3::X * sign, -DVec3::Y],
    }
}

impl Chart {
    /// Lays an image of one unit by one along the axes, onto the face of the cube that the
    /// surface's normal is nearest to.
    pub fn along_axes(p: DVec3, normal: DVec3) -> Chart {
        let [du, dv] = face_axes(normal);
        Chart {
            uv: [p.dot(du), p.dot(dv)],
            du,
            dv,
        }
    }

    /// Stretches an image over each face of an axis-parallel box.
    pub(super) fn on_box([min, max]: [DVec3; 2], p: DVec3, normal: DVec3) -> Chart {
        let axes = face_axes(normal);
        Chart::stretched(axes, p, |axis| {
            // Axes are ± unit vectors.
            let [a, b] = [min.dot(axis), max.dot(axis)];
            [a.min(b), a.max(b)]
        })
    }

    /// Stretches an image over what lies between the least and the greatest place along each of
    /// two axes.
    pub(super) fn stretched(axes: [DVec3; 2], p: DVec3, span: impl Fn(DVec3) -> [f64; 2]) -> Chart {
        let [(u, du), (v, dv)] = axes.map(|axis| {
            let [low, high] = span(axis);
            ((p.dot(axis) - low) / (high - low), axis / (high - low))
        });
        Chart { uv: [u, v], du, dv }
    }

    /// Wraps an image around an ellipsoid about `q` = 0 with the poles on y. `q` is the point as
    /// on the unit sphere, and `shrink` what it was divided by.
    pub(super) fn on_sphere(q: DVec3, shrink: DVec3) -> Chart {
        let around = turns_of((q.x, DVec3::X), (q.z, DVec3::Z));
        let (radius, out) = from_y(q);
        let up = turns_of((q.y, DVec3::Y), (radius, out));
        Chart {
            uv: [0.5 + around.turns, 0.5 - 2.0 * up.turns],
            du: around.gradient / shrink,
            dv: up.gradient * -2.0 / shrink,
        }
    }

    /// Wraps an image around a torus about y: u around the axis, v around the tube.
    pub(super) fn on_torus(major: f64, p: DVec3) -> Chart {
        let around = turns_of((p.x, DVec3::X), (p.z, DVec3::Z));
        let (radius, out) = from_y(p);
        let up = turns_of((p.y, DVec3::Y), (radius - major, out));
        Chart {
            uv: [0.5 + around.turns, 0.5 - up.turns],
            du: around.gradient,
            dv: -up.gradient,
        }
    }

    /// Wraps an image around the side of a cone, from top to base, and lays it on each cap, whose
    /// circle touches the image's edges.
    pub(super) fn on_cone(cone: &Upright, p: DVec3) -> Chart {
        let axis = cone.unit;
        let [right, front] = frame_about(axis);
        let from = p - cone.middle;
        let (x, z) = (from.dot(right), from.dot(front));
        let (_, normal) = cone.nearest::<f64>(p.into());
        let normal = DVec3::from(normal);
        let is_cap = |n: DVec3| !cone.open && normal == n;
        let on_cap = |side: f64| {
            let radius = cone.radius + cone.growth * cone.half * side;
            let per = 0.5 / radius;
            Chart {
                uv: [0.5 + x * per, 0.5 + side * z * per],
                du: right * per,
                dv: front * (side * per),
            }
        };
        if is_cap(axis) {
            return on_cap(1.0);
        }
        if is_cap(-axis) {
            return on_cap(-1.0);
        }
        let around = turns_of((x, right), (z, front));
        let per = 0.5 / cone.half;
        Chart {
            uv: [0.5 + around.turns, 0.5 - from.dot(axis) * per],
            du: around.gradient,
            dv: axis * -per,
        }
    }

    /// Wraps an image around each ring of an outline in the plane z = 0 that is swept upward by
    /// `height`: u goes along the edges from the ring's first corner, v from top to bottom. The
    /// edge is the one nearest to the point.
    pub(super) fn along_outline<'r>(
        rings: impl Iterator<Item = &'r [DVec2]>,
        height: f64,
        p: DVec3,
    ) -> Chart {
        let mut nearest = (f64::INFINITY, 0.0, DVec2::X);
        for ring in rings {
            let perimeter: f64 = ring_edges(ring).map(|[a, b]| edge_length(a, b)).sum();
            let mut before = 0.0;
            for [a, b] in ring_edges(ring) {
                let long = edge_length(a, b);
                if long > 0.0 {
                    let way = (b - a) / long;
                    let along = (p.truncate() - a).dot(way).clamp(0.0, long);
                    let off = (p.truncate() - a - way * along).length_squared();
                    if off < nearest.0 {
                        nearest = (off, (before + along) / perimeter, way / perimeter);
                    }
                }
                before += long;
            }
        }
        let (_, u, way) = nearest;
        Chart {
            uv: [u, 1.0 - p.z / height],
            du: way.extend(0.0),
            dv: DVec3::Z / -height,
        }
    }

    /// Returns |∂(u, v)| of a unit of area of the surface across `normal`, which is a unit vector.
    pub fn density(&self, normal: DVec3) -> f64 {
        self.du.cross(self.dv).dot(normal).abs()
    }
}

/// Returns the distance from the y axis and its gradient, which is 0 on the axis.
fn from_y(p: DVec3) -> (f64, DVec3) {
    let out = DVec3::new(p.x, 0.0, p.z);
    (length(out), unit(out))
}

fn ring_edges(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| [*a, *b])
}

fn edge_length(a: DVec2, b: DVec2) -> f64 {
    length((b - a).extend(0.0))
}

/// Returns the directions to the right and to the front of an axis that points up: front is +z as
/// far as it is across the axis, or, of an axis within 45° of z, the side that comes to the front
/// when y is tilted there.
fn frame_about(axis: DVec3) -> [DVec3; 2] {
    let towards = match axis.z {
        z if z.abs() <= FRAC_1_SQRT_2 => DVec3::Z,
        z if z > 0.0 => -DVec3::Y,
        _ => DVec3::Y,
    };
    let front = unit(towards - axis * axis.dot(towards));
    [axis.cross(front), front]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cone, Cylinder};

    /// Checks that u goes right and v down: ∂u × ∂v points inward, and that the gradients are
    /// those of the coordinates.
    fn check(at: DVec3, normal: DVec3, chart: impl Fn(DVec3) -> Chart) {
        let here = chart(at);
        let turn = here.du.cross(here.dv).dot(normal);
        assert!(turn < 0.0, "{at}: {turn}");
        assert!((here.density(normal) + turn).abs() < 1e-12);
        for axis in DVec3::AXES {
            let step = 1e-6;
            let [after, before] = [step, -step].map(|by| chart(at + axis * by).uv);
            for (k, gradient) in [here.du, here.dv].into_iter().enumerate() {
                let slope = (after[k] - before[k]) / (2.0 * step);
                let off = (slope - gradient.dot(axis)).abs();
                assert!(off < 1e-6 * (1.0 + slope.abs()), "{at} {axis} {k}: {off}");
            }
        }
    }

    fn near(a: [f64; 2], b: [f64; 2]) {
        let off = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        assert!(off < 1e-12, "{a:?} is not {b:?}");
    }

    #[test]
    fn images_are_upright_and_not_mirrored() {
        for normal in [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::NEG_X,
            DVec3::NEG_Y,
            DVec3::NEG_Z,
        ] {
            check(DVec3::new(0.3, 0.4, 0.2), normal, |p| {
                Chart::along_axes(p, normal)
            });
            let corners = [DVec3::splat(-1.0), DVec3::new(1.0, 2.0, 3.0)];
            check(DVec3::new(0.3, 0.4, 0.2), normal, |p| {
                Chart::on_box(corners, p, normal)
            });
        }
        let radii = DVec3::new(1.0, 2.0, 0.5);
        for q in [
            DVec3::new(0.6, 0.0, 0.8),
            DVec3::new(-0.48, 0.6, 0.64),
            DVec3::new(0.48, -0.64, -0.6),
        ] {
            check(q * radii, unit(q / radii), |p| {
                Chart::on_sphere(p / radii, radii)
            });
        }
        // Around the tube: outside, on top, inside and below.
        for tube in [[0.6, 0.8], [-0.6, 0.8], [-0.6, -0.8], [0.6, -0.8]] {
            let out = DVec3::new(0.8, 0.0, 0.6);
            let normal = out * tube[0] + DVec3::Y * tube[1];
            check(out * 2.0 + normal * 0.5, normal, |p| {
                Chart::on_torus(2.0, p)
            });
        }
    }

    #[test]
    fn a_prism_is_wrapped_along_its_rings() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(DVec2::from_array);
        let hole = [[1.0, 0.5], [1.0, 1.5], [3.0, 1.5], [3.0, 0.5]].map(DVec2::from_array);
        let rings = [&square[..], &hole[..]];
        let chart = |p: DVec3| Chart::along_outline(rings.into_iter(), 3.0, p);
        near(chart(DVec3::new(3.0, 0.0, 3.0)).uv, [0.25, 0.0]);
        near(chart(DVec3::new(4.0, 1.0, 0.0)).uv, [5.0 / 12.0, 1.0]);
        near(chart(DVec3::new(2.0, 1.5, 1.5)).uv, [2.0 / 6.0, 0.5]);
        check(DVec3::new(3.0, 0.0, 1.0), DVec3::NEG_Y, chart);
        check(DVec3::new(1.0, 1.0, 1.0), DVec3::X, chart);
    }

    #[test]
    fn poles_and_seams_are_where_the_rules_say() {
        let sphere = |x: f64, y: f64, z: f64| Chart::on_sphere(DVec3::new(x, y, z), DVec3::ONE).uv;
        near(sphere(0.0, 0.0, 1.0), [0.5, 0.5]);
        near(sphere(1.0, 0.0, 0.0), [0.75, 0.5]);
        near(sphere(-1.0, 0.0, 0.0), [0.25, 0.5]);
        near(sphere(0.0, 0.0, -1.0), [1.0, 0.5]);
        near(sphere(-0.0, 0.0, -1.0), [0.0, 0.5]);
        near(sphere(0.0, 1.0, 0.0), [0.5, 0.0]);
        near(sphere(0.0, -1.0, 0.0), [0.5, 1.0]);
        near(sphere(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2), [0.5, 0.25]);
        let torus = |x: f64, y: f64, z: f64| Chart::on_torus(2.0, DVec3::new(x, y, z)).uv;
        near(torus(0.0, 0.0, 3.0), [0.5, 0.5]);
        near(torus(2.0, 1.0, 0.0), [0.75, 0.25]);
        near(torus(2.0, -1.0, 0.0), [0.75, 0.75]);
        near(torus(0.0, 0.0, 1.0), [0.5, 0.0]);
        let pole = Chart::on_sphere(DVec3::Y, DVec3::ONE);
        assert!(pole.du.is_finite() && pole.dv.is_finite(), "{pole:?}");
    }

    #[test]
    fn a_cone_has_a_side_and_two_discs() {
        let cone = Cone {
            base: DVec3::new(1.0, 1.0, 1.0),
            top: DVec3::new(1.0, 4.0, 1.0),
            base_radius: 2.0,
            top_radius: 1.0,
            open: false,
        };
        let chart = |x: f64, y: f64, z: f64| Chart::on_cone(&cone.upright(), DVec3::new(x, y, z));
        near(chart(1.0, 1.0 + 1.5, 1.0 + 1.5).uv, [0.5, 0.5]);
        near(chart(1.0 + 1.5, 2.5, 1.0).uv, [0.75, 0.5]);
        near(chart(1.0 - 1.75, 1.75, 1.0).uv, [0.25, 0.75]);
        // From above: right is +x, down is +z. From below: down is −z.
        near(chart(1.5, 4.0, 1.25).uv, [0.75, 0.625]);
        near(chart(2.0, 1.0, 1.5).uv, [0.75, 0.375]);
        let slope = unit(DVec3::new(0.0, 1.0, 3.0));
        check(DVec3::new(1.0, 2.5, 2.5), slope, |p| chart(p.x, p.y, p.z));
        check(DVec3::new(1.2, 4.0, 1.3), DVec3::Y, |p| {
            Chart::on_cone(&cone.upright(), DVec3::new(p.x, 4.0, p.z))
        });
    }

    #[test]
    fn a_cylinder_shows_the_images_middle_in_front_whichever_way_it_points() {
        for (top, front, right) in [
            (DVec3::Y, DVec3::Z, DVec3::X),
            (DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X),
            (DVec3::X, DVec3::Z, DVec3::NEG_Y),
            (DVec3::Z, DVec3::NEG_Y, DVec3::X),
            (DVec3::NEG_Z, DVec3::Y, DVec3::X),
        ] {
            let cylinder = Cylinder {
                base: -top,
                top,
                radius: 0.5,
                open: false,
            };
            let upright = cylinder.as_cone().upright();
            let uv = |p: DVec3| Chart::on_cone(&upright, p).uv;
            near(uv(front * 0.5), [0.5, 0.5]);
            near(uv(right * 0.5), [0.75, 0.5]);
            near(uv(front * 0.5 + top * 0.5), [0.5, 0.25]);
            near(uv(top + front * 0.25), [0.5, 0.75]);
            near(uv(front * 0.25 - top), [0.5, 0.25]);
            check(right * 0.5 + top * 0.25, right, |p| {
                Chart::on_cone(&upright, p)
            });
        }
    }
}
