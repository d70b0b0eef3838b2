//! Volume, area, centroid and second moments of closed triangle surfaces, by the
//! divergence theorem: sums over the tetrahedra of an origin and each triangle (Lien and
//! Kajiya, A Symbolic Method for Calculating the Integral Properties of Arbitrary
//! Nonconvex Polyhedra, 1984). Sums are compensated (Neumaier 1974), so their errors do not
//! grow with the number of triangles.

use super::body::{Body, Method, ROUNDINGS};
use super::moments::{PAIRS, Symmetric, outer, plus};
use glam::DVec3;

/// A compensated sum, and the sum of its terms' magnitudes.
#[derive(Clone, Copy, Default)]
struct Sum {
    sum: f64,
    rest: f64,
    magnitude: f64,
}

impl Sum {
    fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.rest += match self.sum.abs() >= x.abs() {
            true => (self.sum - sum) + x,
            false => (x - sum) + self.sum,
        };
        self.sum = sum;
        self.magnitude += x.abs();
    }

    fn value(&self) -> f64 {
        self.sum + self.rest
    }
}

/// Returns the figures of the solid that triangles bound, counter-clockwise seen from
/// outside; of corners near the origin, in a unit of about their size. The sign of the
/// volume is dropped, so a surface that is turned inside out has the figures of its
/// interior. Returns `None` if the triangles' area vectors do not sum to zero.
pub fn body(triangles: impl Iterator<Item = [DVec3; 3]>) -> Option<Body> {
    let (mut volume, mut area) = (Sum::default(), Sum::default());
    let (mut first, mut second, mut facing) = (
        [Sum::default(); 3],
        [Sum::default(); 6],
        [Sum::default(); 3],
    );
    for [a, b, c] in triangles {
        let cross = (b - a).cross(c - a);
        // Six times the tetrahedron's volume.
        let det = a.dot(cross);
        area.add(0.5 * cross.length());
        volume.add(det / 6.0);
        let total = a + b + c;
        for k in 0..3 {
            facing[k].add(cross[k]);
            first[k].add(det / 24.0 * total[k]);
        }
        for (sum, [i, j]) in second.iter_mut().zip(PAIRS) {
            let corners = a[i] * a[j] + b[i] * b[j] + c[i] * c[j];
            sum.add(det / 120.0 * (corners + total[i] * total[j]));
        }
    }
    let gap = facing.iter().map(|s| s.value().abs()).fold(0.0, f64::max);
    if gap > 1e-9 * area.value() {
        return None;
    }
    let sign = 1.0_f64.copysign(volume.value());
    let error = |sum: &Sum| ROUNDINGS * sum.magnitude;
    let own = volume.value() * sign;
    let volume_error = error(&volume);
    let area_error = error(&area);
    if own == 0.0 {
        return Some(Body {
            volume_error,
            area: area.value(),
            area_error,
            method: Method::Divergence,
            area_method: Method::Divergence,
            ..Body::default()
        });
    }
    let centroid = DVec3::from_array(first.map(|s| s.value() * sign / own));
    let first_error = first.iter().map(error).fold(0.0, f64::max);
    let spread: Symmetric = second.map(|s| s.value() * sign);
    let second_error = second.iter().map(error).fold(0.0, f64::max);
    let centroid_error = (first_error + volume_error * centroid.length()) / own;
    Some(Body {
        volume: own,
        volume_error,
        area: area.value(),
        area_error,
        centroid,
        centroid_error,
        spread: plus(spread, outer(centroid, -own)),
        spread_error: second_error
            + volume_error * centroid.length_squared()
            + 2.0 * first_error * centroid.length(),
        method: Method::Divergence,
        area_method: Method::Divergence,
    })
}
