//! Triangulation of polygons that a file gives by their corners: n corners, n − 2 triangles.
//!
//! A fan about the first corner is right for convex polygons, and for others that this corner
//! sees whole; it is kept there, as most programs make it. Elsewhere ears are clipped
//! (Meisters 1975): a corner whose triangle contains no other is cut off. Turns are exact, as
//! seen along the axis on which Newell's normal is longest. Every corner stays a corner of a
//! triangle, also between two collinear edges, so a closed mesh stays closed; crates that
//! drop such corners open it. Holes that a bridge joins to the outline are understood: the
//! corners at the bridge's ends coincide.

use crate::ImportReport;
use crate::math::Number;
use crate::math::dyadic::{Dyadic, exactly};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::VecDeque;

/// Tests of a corner against a triangle that any file may ask for, and those that each
/// corner adds: ears are found in quadratic time.
const FREE_TESTS: u64 = 1 << 28;
const TESTS_PER_CORNER: u64 = 256;

/// Splits polygons; counts those that no triangulation fits.
pub struct Triangulator {
    tests: u64,
    /// Polygons whose outline touches or crosses itself.
    pub crossing: usize,
    /// Polygons of so many corners that they became fans.
    pub fans: usize,
}

type Point = [f64; 2];

/// The corners that are left of a polygon, a ring.
struct Ring {
    points: Vec<Point>,
    next: Vec<u32>,
    before: Vec<u32>,
    /// The corners that are left, in any order, and where each of them is.
    left: Vec<u32>,
    place: Vec<u32>,
}

impl Triangulator {
    pub fn new() -> Triangulator {
        Triangulator {
            tests: FREE_TESTS,
            crossing: 0,
            fans: 0,
        }
    }

    /// Counts the polygons that no triangulation fits in a report.
    pub fn tell(&self, report: &mut ImportReport) {
        report.repair("face whose outline crosses itself", self.crossing);
        report.repair("concave face of too many corners, as a fan", self.fans);
    }

    /// Calls `push` with the three corners of each triangle, as indices into `points`.
    /// Points need not be finite.
    pub fn split(&mut self, points: &[DVec3], mut push: impl FnMut([u32; 3])) {
        let count = points.len() as u32;
        let seen = (count > 3).then(|| flattened(points)).flatten();
        let Some(seen) = seen.filter(|seen| !fan_covers(seen)) else {
            (2..count).for_each(|i| push([0, i - 1, i]));
            return;
        };
        self.tests = self
            .tests
            .saturating_add(TESTS_PER_CORNER * u64::from(count));
        self.clip(&mut Ring::new(seen), &mut push);
    }

    /// Clips ears until a triangle is left.
    fn clip(&mut self, ring: &mut Ring, push: &mut impl FnMut([u32; 3])) {
        let mut waiting: VecDeque<u32> = (0..ring.next.len() as u32).collect();
        let (mut crosses, mut tried_all) = (false, true);
        while ring.left.len() > 3 {
            if self.tests == 0 {
                waiting.clear();
                tried_all = true;
            }
            let ear = match waiting.pop_front() {
                Some(b) if ring.is_in(b) => Some(b).filter(|b| ring.is_ear(*b, &mut self.tests)),
                Some(_) => continue,
                None if !tried_all => {
                    waiting.extend(&ring.left);
                    tried_all = true;
                    continue;
                }
                None => {
                    crosses = true;
                    Some(ring.least_bad(&mut self.tests))
                }
            };
            if let Some(b) = ear {
                let (a, c) = ring.around(b);
                push([a, b, c]);
                ring.remove(b);
                waiting.extend([a, c]);
                tried_all = false;
            }
        }
        let b = ring.left[0];
        let (a, c) = ring.around(b);
        push([a, b, c]);
        crosses |= turn([a, b, c].map(|i| ring.at(i))).is_lt();
        match self.tests {
            0 => self.fans += 1,
            _ => self.crossing += usize::from(crosses),
        }
    }
}

impl Ring {
    fn new(points: Vec<Point>) -> Ring {
        let count = points.len() as u32;
        Ring {
            points,
            next: (1..count).chain([0]).collect(),
            before: [count - 1].into_iter().chain(0..count - 1).collect(),
            left: (0..count).collect(),
            place: (0..count).collect(),
        }
    }

    fn at(&self, corner: u32) -> Point {
        self.points[corner as usize]
    }

    fn around(&self, b: u32) -> (u32, u32) {
        (self.before[b as usize], self.next[b as usize])
    }

    fn is_in(&self, b: u32) -> bool {
        self.left.get(self.place[b as usize] as usize) == Some(&b)
    }

    fn remove(&mut self, b: u32) {
        let (a, c) = self.around(b);
        self.next[a as usize] = c;
        self.before[c as usize] = a;
        let place = self.place[b as usize] as usize;
        self.left.swap_remove(place);
        if let Some(moved) = self.left.get(place) {
            self.place[*moved as usize] = place as u32;
        }
    }

    /// Whether the triangle of `b` and its neighbours has area and meets no other corner, nor
    /// an edge of one that coincides with a corner of the triangle.
    fn is_ear(&self, b: u32, tests: &mut u64) -> bool {
        let (a, c) = self.around(b);
        let triangle = [a, b, c].map(|i| self.at(i));
        turn(triangle).is_gt()
            && self.all_miss(&triangle, [a, b, c], tests, |p| {
                match triangle.iter().position(|corner| *corner == self.at(p)) {
                    Some(k) => self.enters(p, triangle, k),
                    None => sides(triangle, self.at(p)).iter().all(|side| side.is_ge()),
                }
            })
    }

    /// A corner to clip where no corner is an ear: one whose triangle has area and no corner
    /// inside, or else one without area, or else any. Without tests left it is the next one.
    fn least_bad(&self, tests: &mut u64) -> u32 {
        let of = |b: u32| {
            let (a, c) = self.around(b);
            ([a, b, c], [a, b, c].map(|i| self.at(i)))
        };
        let mut flat = None;
        for b in &self.left {
            let (corners, triangle) = of(*b);
            match turn(triangle) {
                Ordering::Greater => {
                    let is_inside =
                        |p: u32| sides(triangle, self.at(p)).iter().all(|side| side.is_gt());
                    if self.all_miss(&triangle, corners, tests, is_inside) {
                        return *b;
                    }
                }
                Ordering::Equal => flat = flat.or(Some(*b)),
                Ordering::Less => {}
            }
            if *tests == 0 {
                break;
            }
        }
        flat.unwrap_or(self.left[0])
    }

    /// Whether no corner but those of the triangle does what `meets` says, which is asked
    /// about those in the triangle's box only. False without tests left.
    fn all_miss(
        &self,
        triangle: &[Point; 3],
        corners: [u32; 3],
        tests: &mut u64,
        meets: impl Fn(u32) -> bool,
    ) -> bool {
        let [low, high] = [f64::min, f64::max]
            .map(|of| [0, 1].map(|k| of(of(triangle[0][k], triangle[1][k]), triangle[2][k])));
        let cost = self.left.len() as u64;
        if *tests < cost {
            *tests = 0;
            return false;
        }
        *tests -= cost;
        !self.left.iter().any(|p| {
            let at = self.at(*p);
            let boxed = (0..2).all(|k| low[k] <= at[k] && at[k] <= high[k]);
            boxed && !corners.contains(p) && meets(*p)
        })
    }

    /// Whether an edge at `p`, which coincides with corner `k` of a triangle, leads into it.
    fn enters(&self, p: u32, triangle: [Point; 3], k: usize) -> bool {
        let (before, next) = self.around(p);
        let (corner, right, left) = (triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
        [before, next].iter().any(|q| {
            let q = self.at(*q);
            turn([corner, right, q]).is_gt() && turn([corner, q, left]).is_gt()
        })
    }
}

/// On which side of each edge of a triangle a point lies: `Greater` is inside.
fn sides([a, b, c]: [Point; 3], p: Point) -> [Ordering; 3] {
    [turn([a, b, p]), turn([b, c, p]), turn([c, a, p])]
}

/// Projects corners along an axis such that the outline is counter-clockwise. `None` if
/// they are not finite, or their area is 0.
fn flattened(points: &[DVec3]) -> Option<Vec<Point>> {
    let first = points[0];
    let size = points.iter().fold(0.0, |size: f64, p| {
        size.max((*p - first).abs().max_element())
    });
    if !(points.iter().all(|p| p.is_finite()) && size.is_finite() && size > 0.0) {
        return None;
    }
    let from = |p: &DVec3| (*p - first) / size;
    let pairs = points.iter().zip(points[1..].iter().chain([&first]));
    let normal: DVec3 = pairs.map(|(a, b)| from(a).cross(from(b))).sum();
    let normal = normal.to_array();
    let axis = (0..3).max_by(|i, j| normal[*i].abs().total_cmp(&normal[*j].abs()))?;
    let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (x, y) = (y, x);
    }
    let seen = |p: &DVec3| {
        let p = p.to_array();
        [p[x], p[y]]
    };
    (normal[axis] != 0.0).then(|| points.iter().map(seen).collect())
}

/// Whether no triangle of the fan about the first corner turns the other way.
fn fan_covers(seen: &[Point]) -> bool {
    seen[1..]
        .windows(2)
        .all(|pair| turn([seen[0], pair[0], pair[1]]).is_ge())
}

/// The exact sign of the area of a triangle: `Greater` is counter-clockwise.
fn turn([a, b, c]: [Point; 3]) -> Ordering {
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let area = left - right;
    // Three roundings in each term (Shewchuk 1997, ccwerrboundA), and underflow.
    let bound = (left.abs() + right.abs()) * (2.0 * f64::EPSILON) + f64::MIN_POSITIVE;
    if area.abs() > bound {
        return area.total_cmp(&0.0);
    }
    exactly(&|space| {
        let of = |x: f64| Dyadic::of(space, x);
        let from = |p: Point, k: usize| of(p[k]).minus(&of(c[k]));
        let left = from(a, 0).times(&from(b, 1));
        left.minus(&from(a, 1).times(&from(b, 0))).sign()
    })
}

#[cfg(test)]
mod tests;
