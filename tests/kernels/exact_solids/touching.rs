//! Lines that are tangent to a solid in exactly one point.

use super::Random;
use super::cases::{Shape, power};
use glam::DVec3;
use lanecast::internals::geom::exact::Line;
use lanecast::internals::geom::{Cone, Ellipsoid, Quadric, Sphere};

/// A shape and a line that touches it and no more, in integers: from Pythagorean
/// numbers.
pub fn tangent(random: &mut Random, kind: usize) -> (Shape, Line) {
    let int = |random: &mut Random, most: u64| random.below(2 * most + 1) as f64 - most as f64;
    let center = DVec3::new(int(random, 9), int(random, 9), int(random, 9));
    let (touch, length) = [
        (DVec3::new(2.0, 3.0, 6.0), 7.0),
        (DVec3::new(1.0, 2.0, 2.0), 3.0),
        (DVec3::new(4.0, 4.0, 7.0), 9.0),
        (DVec3::new(0.0, 3.0, 4.0), 5.0),
        (DVec3::new(0.0, 0.0, 1.0), 1.0),
    ][random.below(5) as usize];
    let any = DVec3::new(int(random, 5), int(random, 5), int(random, 5));
    let (shape, point, dir) = match kind {
        4 => {
            let by = DVec3::new(1.0, 1.0 + int(random, 3).abs(), 2.0);
            let row = Ellipsoid {
                center,
                radii: by * length,
            };
            let dir = touch.cross(any) * by;
            (Shape::Ellipsoid(row), center + touch * by, dir)
        }
        5..=8 => {
            let axis = random.below(3) as usize;
            let turn = |v: DVec3| DVec3::from_array(std::array::from_fn(|k| v[(k + axis) % 3]));
            let height = 1.0 + int(random, 6).abs();
            let (apex, cylinder) = (random.below(2) == 0, kind.is_multiple_of(2));
            let scale = 2.0;
            let along = turn(DVec3::new(0.0, 0.0, height));
            // A line of the side, from the apex or along the axis; and the
            // tangent across it.
            let rim = turn(DVec3::new(3.0, 4.0, 0.0));
            let across = turn(DVec3::new(-4.0, 3.0, 0.0));
            let start = center + if cylinder { rim } else { DVec3::ZERO };
            let side = if cylinder { along } else { along + rim };
            let row = Cone {
                base: center,
                top: center + along * scale,
                base_radius: if cylinder { 5.0 } else { 0.0 },
                top_radius: if cylinder { 5.0 } else { 5.0 * scale },
                open: kind >= 7,
            };
            let row = if apex {
                Cone {
                    base: row.top,
                    top: row.base,
                    base_radius: row.top_radius,
                    top_radius: row.base_radius,
                    ..row
                }
            } else {
                row
            };
            // From the rim of one end to that of the other, and past it.
            let at = start + side * (random.below(6) as f64 * 0.5 - 0.25);
            let dir = side * int(random, 2) + across * int(random, 3);
            (Shape::Cone(row), at, dir)
        }
        10 => {
            // (x − c)·M(x − c) + n·(x − c), of which a line across n has but a square.
            let mut m = [0.0; 6];
            for x in &mut m {
                *x = int(random, 3);
            }
            let [a, b, c, d, e, f] = m;
            let dir = touch.cross(any);
            let normal = if random.below(4) == 0 {
                DVec3::ZERO
            } else {
                dir.cross(any)
            };
            let row = |v: DVec3| {
                DVec3::new(
                    2.0 * a * v.x + d * v.y + e * v.z,
                    d * v.x + 2.0 * b * v.y + f * v.z,
                    e * v.x + f * v.y + 2.0 * c * v.z,
                )
            };
            let [x, y, z] = (normal - row(center)).to_array();
            let constant = 0.5 * center.dot(row(center)) - normal.dot(center);
            let coefficients = [a, b, c, d, e, f, x, y, z, constant];
            (Shape::Quadric(Quadric { coefficients }), center, dir)
        }
        _ => {
            let row = Sphere {
                center,
                radius: length,
            };
            (Shape::Sphere(row), center + touch, touch.cross(any))
        }
    };
    let t = power(random, 3);
    let line = Line {
        org: (point - dir * t).to_array(),
        dir: dir.to_array(),
    };
    (shape, line)
}
