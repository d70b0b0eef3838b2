//! Prisms: an outline with holes in the plane z = 0, extruded along z.
//!
//! Seen along z, exact signs say which corners lie to the right of a line; the line crosses
//! an edge if its ends differ. A corner on the line counts as not to the right, so that a
//! line through corners or along an edge crosses as often as one next to it. Sides and caps
//! are planes that contain the corners exactly, because corners lie on a grid
//! ([`snapped`]). There is no kernel in lanes: every kernel is the exact predicate, whose
//! signs and orders f64 nearly always decides (docs/SPEC.md, S69). Edges may touch, but
//! not cross, because the inside is to the left of every edge.

use super::chart::Chart;
use super::exact::line_quadratic::LineQuadratic;
use super::exact::surface::Surface;
use super::exact::{Line, Root, meet_per_lane, orientation};
use super::guarded::ObjectRay;
use super::kinds::PrismId;
use super::primitive::{Blur, Boundaries, Exact, Flaw, Primitive, finite, positive};
use super::ray::Meet;
use super::scratch::Scratch;
use crate::math::bounds::UNIT;
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3};
use glam::{DVec2, DVec3};
use std::cmp::Ordering;
use std::ops::Range;

/// An outline and the holes in it, each of at least three corners in order, either way
/// round; and the height of the top above z = 0. Edges do not cross each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Prism {
    pub outline: Vec<DVec2>,
    pub holes: Vec<Vec<DVec2>>,
    /// The height, > 0.
    pub height: f64,
}

/// Prisms, one row each. Rings are ranges of corners with the inside to the left.
#[derive(Clone, Debug, Default)]
pub struct Prisms {
    pub points: Vec<DVec2>,
    pub rings: Vec<Range<u32>>,
    pub rings_of: Vec<Range<u32>>,
    pub height: Vec<f64>,
    pub boxes: Vec<Aabb>,
}

/// A row of [`Prisms`].
#[derive(Clone, Copy, Debug)]
pub struct PrismRow<'a> {
    points: &'a [DVec2],
    rings: &'a [Range<u32>],
    height: f64,
    bounds: Aabb,
}

/// Rounds corners to a grid of 2⁻⁵⁰ of the power of two in the largest coordinate, so that
/// differences of coordinates, which make the normals of planes, are exact in f64.
fn snapped(rings: &mut [Vec<DVec2>]) {
    let all = || rings.iter().flatten().flat_map(|p| [p.x.abs(), p.y.abs()]);
    let most = all().fold(0.0, f64::max);
    if most == 0.0 || !all().all(f64::is_finite) {
        return;
    }
    let power = libm::ilogb(most) - 50;
    let snap = |x: f64| libm::scalbn(libm::rint(libm::scalbn(x, -power)), power);
    for p in rings.iter_mut().flatten() {
        *p = DVec2::new(snap(p.x), snap(p.y));
    }
}

fn edges(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    let next = ring.iter().skip(1).chain(ring.first());
    ring.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// Says whether a ring goes around a point, by the even-odd rule.
fn is_around(ring: &[DVec2], p: DVec2) -> bool {
    let crossed = edges(ring).filter(|[a, b]| {
        let side = (*a - p).perp_dot(*b - p);
        (a.y > p.y) != (b.y > p.y) && (side > 0.0) == (b.y > p.y)
    });
    crossed.count() % 2 == 1
}

impl Prisms {
    pub fn push(&mut self, row: Prism) -> PrismId {
        let mut rings: Vec<Vec<DVec2>> = [row.outline].into_iter().chain(row.holes).collect();
        snapped(&mut rings);
        let first = self.rings.len() as u32;
        for (i, ring) in rings.iter().enumerate() {
            let others = rings.iter().enumerate().filter(|(j, _)| *j != i);
            let within = |p: &DVec2| others.filter(|(_, other)| is_around(other, *p)).count();
            let is_hole = ring.first().map_or(0, within) % 2 == 1;
            let from = ring.first().copied().unwrap_or_default();
            let area = edges(ring).map(|[a, b]| (a - from).perp_dot(b - from));
            let is_left = area.sum::<f64>() > 0.0;
            let start = self.points.len() as u32;
            self.points.extend_from_slice(ring);
            if is_left == is_hole {
                self.points[start as usize..].reverse();
            }
            self.rings.push(start..self.points.len() as u32);
        }
        let corners = rings.iter().flatten().flat_map(|p| {
            let [low, high] = [0.0, row.height].map(|z| p.extend(z));
            [low, high]
        });
        self.boxes.push(Aabb::of_points(corners));
        self.rings_of.push(first..self.rings.len() as u32);
        self.height.push(row.height);
        PrismId(self.height.len() as u32 - 1)
    }

    #[inline(always)]
    pub fn row(&self, id: PrismId) -> PrismRow<'_> {
        let rings = &self.rings_of[id.index()];
        PrismRow {
            points: &self.points,
            rings: &self.rings[rings.start as usize..rings.end as usize],
            height: self.height[id.index()],
            bounds: self.boxes[id.index()],
        }
    }

    pub fn len(&self) -> usize {
        self.height.len()
    }

    pub fn is_empty(&self) -> bool {
        self.height.is_empty()
    }

    pub fn bytes(&self) -> usize {
        let row = size_of::<Range<u32>>() + size_of::<f64>() + size_of::<Aabb>();
        size_of_val(&self.points[..]) + size_of_val(&self.rings[..]) + self.len() * row
    }
}

impl<'a> PrismRow<'a> {
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Returns the outline, and then the holes, with the inside to the left.
    pub fn rings(&self) -> impl Iterator<Item = &'a [DVec2]> + use<'a> {
        let (points, rings) = (self.points, self.rings);
        let of = |r: &Range<u32>| &points[r.start as usize..r.end as usize];
        rings.iter().map(of)
    }

    /// Finds where a line that is not along z crosses the sides' planes as it is seen along
    /// z, in order: into the outline and out of it by turns.
    fn sides(&self, line: &Line, found: &mut Vec<Root<'static>>) {
        found.clear();
        for ring in self.rings() {
            let Some(last) = ring.last() else { continue };
            let (mut a, mut a_right) = (*last, is_right(line, *last));
            for b in ring {
                let b_right = is_right(line, *b);
                if a_right != b_right {
                    let out = *b - a;
                    let plane = Surface::PlaneThrough {
                        normal: [out.y, -out.x, 0.0],
                        point: [a.x, a.y, 0.0],
                    };
                    let root = LineQuadratic::new(line, plane, 0.0).root_of_linear();
                    // Equal ones stay in the order of the edges.
                    let at = found.partition_point(|other| other.order(&root).is_le());
                    found.insert(at, root);
                }
                (a, a_right) = (*b, b_right);
            }
        }
    }

    /// Says whether a line along z runs inside the outline.
    fn is_around(&self, line: &Line) -> bool {
        let [x, y, _] = line.org;
        let up = Line {
            org: [x, y, 0.0],
            dir: [0.0, 0.0, 1.0],
        };
        let crossed = self.rings().flat_map(edges).filter(|[a, b]| {
            let straddles = (a.y > y) != (b.y > y);
            let side = || orientation::of_edge(&up, &a.extend(0.0).into(), &b.extend(0.0).into());
            let wanted = b.y > y;
            straddles
                && (if wanted {
                    side().is_gt()
                } else {
                    side().is_lt()
                })
        });
        crossed.count() % 2 == 1
    }

    /// Returns where a line crosses the planes of the caps, in order; or, if it is parallel
    /// to them, whether it runs between them.
    fn caps(&self, line: &Line) -> Result<[Root<'static>; 2], bool> {
        let up = line.dir[2];
        if up == 0.0 {
            return Err(0.0 <= line.org[2] && line.org[2] <= self.height);
        }
        let cap = |sign: f64, offset| {
            let normal = [0.0, 0.0, sign];
            LineQuadratic::new(line, Surface::Plane { normal, offset }, 0.0).root_of_linear()
        };
        let (base, top) = (cap(-1.0, 0.0), cap(1.0, self.height));
        Ok(if up > 0.0 { [base, top] } else { [top, base] })
    }
}

/// Returns the side of a line, as seen along z, on which a corner lies, `Greater` on the
/// right: the sign of (p − o) × d, from f64 where the bound allows (three roundings in each
/// term, lemma D9, docs/numerics/exact.md), else exactly.
#[inline(always)]
fn side(line: &Line, p: DVec2) -> Ordering {
    let Line { org, dir } = line;
    let (across, along) = ((p.x - org[0]) * dir[1], (p.y - org[1]) * dir[0]);
    let (side, size) = (across - along, across.abs() + along.abs());
    if side.abs() > size * (4.0 * UNIT) + f64::MIN_POSITIVE {
        return side.total_cmp(&0.0);
    }
    orientation::of_point(line, &[p.x, p.y, 0.0], [0, 1])
}

/// Says whether a corner lies strictly to the right of a line as seen along z.
#[inline(always)]
fn is_right(line: &Line, p: DVec2) -> bool {
    side(line, p).is_gt()
}

/// Says whether two edges cross in a point that is an end of neither, exactly.
fn cross(p: &[DVec2; 2], q: &[DVec2; 2]) -> bool {
    let separates = |[a, b]: &[DVec2; 2], ends: &[DVec2; 2]| {
        // Exact, because corners are on a grid.
        let line = Line {
            org: a.extend(0.0).into(),
            dir: (*b - *a).extend(0.0).into(),
        };
        let sides = ends.map(|end| side(&line, end));
        sides[0].is_ne() && sides[0] == sides[1].reverse()
    };
    separates(p, q) && separates(q, p)
}

/// Finds two edges that cross. Edges are swept in the order of their least x.
fn crossing_edges(row: &PrismRow) -> Option<[[DVec2; 2]; 2]> {
    let mut all: Vec<[DVec2; 2]> = row.rings().flat_map(edges).collect();
    let low = |[a, b]: &[DVec2; 2]| a.x.min(b.x);
    all.sort_by(|p, q| low(p).total_cmp(&low(q)));
    for (i, p) in all.iter().enumerate() {
        let end = p[0].x.max(p[1].x);
        let beside = all[i + 1..].iter().take_while(|q| low(q) <= end);
        if let Some(q) = beside.clone().find(|q| cross(p, q)) {
            return Some([*p, *q]);
        }
    }
    None
}

impl<'a> Exact<'a> for PrismRow<'a> {
    fn is_finite(&self) -> bool {
        self.bounds.min.is_finite() && self.bounds.max.is_finite()
    }

    /// Visits the ends of spans; spans of one point are left out.
    fn crossings(
        &self,
        line: &Line,
        scratch: &mut Scratch,
        mut visit: impl FnMut(Root<'a>, bool),
    ) -> bool {
        if line.part_in(&self.bounds, 1.0).is_none() {
            return false;
        }
        let caps = self.caps(line);
        if caps.as_ref().is_err_and(|between| !between) {
            return false;
        }
        if line.dir[0] == 0.0 && line.dir[1] == 0.0 {
            if let (Ok([enter, exit]), true) = (caps, self.is_around(line)) {
                visit(enter, true);
                visit(exit, false);
            }
            return false;
        }
        self.sides(line, &mut scratch.sides);
        for span in scratch.sides.chunks_exact(2) {
            let (mut enter, mut exit) = (span[0], span[1]);
            if let Ok([first, last]) = caps {
                if first.order(&enter).is_ge() {
                    enter = first;
                }
                if last.order(&exit).is_le() {
                    exit = last;
                }
            }
            if enter.order(&exit).is_lt() {
                visit(enter, true);
                visit(exit, false);
            }
        }
        false
    }

    fn first_beyond(&self, line: &Line, t_min: f64, scratch: &mut Scratch) -> Option<Root<'a>> {
        let mut first = None;
        self.crossings(line, scratch, |root, _| {
            if first.is_none() && root.order_with(t_min).is_gt() {
                first = Some(root);
            }
        });
        first
    }
}

impl Primitive for Prisms {
    type Id = PrismId;
    type Row<'a> = PrismRow<'a>;
    const BOUNDARIES: Boundaries = Boundaries::Crossings;
    const BLUR: Blur = Blur::Apart;

    #[inline(always)]
    fn exact(&self, id: PrismId) -> PrismRow<'_> {
        self.row(id)
    }

    fn check(&self, id: PrismId) -> Result<(), Flaw> {
        let row = self.row(id);
        for (i, ring) in row.rings().enumerate() {
            let (field, empty) = match i {
                0 => ("points", "area (an outline of fewer than 3 points)"),
                _ => ("holes", "area (a hole of fewer than 3 points)"),
            };
            if ring.len() < 3 {
                return Err(Flaw::Empty(empty));
            }
            ring.iter().try_for_each(|p| finite(field, &p.to_array()))?;
        }
        finite("height", &[row.height])?;
        positive("height", row.height)?;
        let extent = row.bounds.extent();
        if !(extent.min_element() > 0.0 && extent.is_finite()) {
            return Err(Flaw::Degenerate(
                "its points lie on a line or too far apart".into(),
            ));
        }
        if let Some(edges) = crossing_edges(&row) {
            let [p, q] = edges.map(|[a, b]| format!("{a} to {b}"));
            return Err(Flaw::Degenerate(format!(
                "its edges from {p} and from {q} cross; split it into several prisms"
            )));
        }
        Ok(())
    }

    fn bounds(&self, id: PrismId) -> Option<Aabb> {
        Some(self.boxes[id.index()])
    }

    fn outlines(&self, id: PrismId) -> Vec<Vec<DVec3>> {
        let row = self.row(id);
        let at = |z: f64| {
            let ring = move |ring: &[DVec2]| ring.iter().map(|p| p.extend(z)).collect();
            row.rings().map(ring)
        };
        at(0.0).chain(at(row.height)).collect()
    }

    fn thickness(&self, _id: PrismId) -> Option<f64> {
        None
    }

    fn meet_fast<L: Lanes>(
        &self,
        id: PrismId,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        self.meet(id, 0.0, object, active, scratch)
    }

    #[inline(never)]
    fn meet<L: Lanes>(
        &self,
        id: PrismId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        meet_per_lane(&self.row(id), object, active, scratch)
    }

    #[inline(never)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: PrismId, p: Vec3<D>) -> (D, Vec3<D>) {
        let row = self.row(id);
        let splat = |v: DVec3| Vec3::<D>::splat(v.to_array());
        let [zero, one] = [0.0, 1.0].map(D::splat);
        let (low, high) = (-p.z, p.z - D::splat(row.height));
        let is_low = low.abs().lt(high.abs());
        let mut above = D::select(is_low, low, high);
        let mut normal = Vec3::select(is_low, splat(-DVec3::Z), splat(DVec3::Z));
        let mut least = above * above;
        for [a, b] in row.rings().flat_map(edges) {
            let way = b - a;
            let Some(out) = DVec2::new(way.y, -way.x).try_normalize() else {
                continue;
            };
            let (x, y) = (p.x - D::splat(a.x), p.y - D::splat(a.y));
            let dot = |v: DVec2| x * D::splat(v.x) + y * D::splat(v.y);
            let part = (dot(way) / D::splat(way.length_squared()))
                .max(zero)
                .min(one);
            let [x, y] = [x - part * D::splat(way.x), y - part * D::splat(way.y)];
            let squared = x * x + y * y;
            let is = squared.lt(least);
            least = D::select(is, squared, least);
            above = D::select(is, dot(out), above);
            normal = Vec3::select(is, splat(out.extend(0.0)), normal);
        }
        (above, normal)
    }

    fn chart(&self, id: PrismId, p: DVec3, normal: DVec3) -> Chart {
        let row = self.row(id);
        let is_cap = normal.z.abs() > 0.5;
        match is_cap {
            true => Chart::on_box([row.bounds.min, row.bounds.max], p, DVec3::Z * normal.z),
            false => Chart::along_outline(row.rings(), row.height, p),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::exact::Solid;

    fn ring(corners: &[[f64; 2]]) -> Vec<DVec2> {
        corners.iter().map(|p| DVec2::from_array(*p)).collect()
    }

    /// A frame with a notch, and a hole that is wound as the outline is.
    fn notched() -> Prisms {
        let mut table = Prisms::default();
        table.push(Prism {
            outline: ring(&[[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [3.0, 4.0], [0.0, 6.0]]),
            holes: vec![ring(&[[1.0, 1.0], [2.0, 1.0], [2.0, 3.0], [1.0, 3.0]])],
            height: 2.0,
        });
        table
    }

    #[test]
    fn corners_are_on_a_grid_and_inside_is_to_the_left() {
        let mut table = Prisms::default();
        let third = 1.0 / 3.0;
        let outline = ring(&[[0.1, 0.0], [0.0, 1e9], [1e9, third]]);
        let id = table.push(Prism {
            outline,
            holes: Vec::new(),
            height: 1.0,
        });
        let corners = table.row(id).rings().next().unwrap().to_vec();
        for [a, b] in edges(&corners) {
            let way = b - a;
            assert_eq!((a + way, b - way), (b, a));
        }
        let area = edges(&corners).map(|[a, b]| a.perp_dot(b));
        assert!(area.sum::<f64>() > 0.0);
        assert_eq!(table.check(id), Ok(()));
        let hole = notched().row(PrismId(0)).rings().nth(1).unwrap().to_vec();
        let area = edges(&hole).map(|[a, b]| a.perp_dot(b));
        assert!(area.sum::<f64>() < 0.0);
    }

    fn checked(outline: &[[f64; 2]], holes: &[&[[f64; 2]]]) -> Result<(), Flaw> {
        let mut table = Prisms::default();
        let id = table.push(Prism {
            outline: ring(outline),
            holes: holes.iter().map(|hole| ring(hole)).collect(),
            height: 1.0,
        });
        table.check(id)
    }

    #[test]
    fn edges_may_touch_but_not_cross() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let tie = [[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]];
        let is_crossed = |flaw: Result<(), Flaw>| match flaw {
            Err(Flaw::Degenerate(why)) => why.contains("cross"),
            _ => false,
        };
        assert!(is_crossed(checked(&tie, &[])));
        let across: &[[f64; 2]] = &[[3.0, 1.0], [5.0, 1.0], [3.0, 2.0]];
        assert!(is_crossed(checked(&square, &[across])));
        // A hole with a corner on an edge, and one with a corner of the outline.
        let at_edge: &[[f64; 2]] = &[[4.0, 2.0], [2.0, 3.0], [2.0, 2.0]];
        let at_corner: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 1.0], [1.0, 2.0]];
        assert_eq!(checked(&square, &[at_edge, at_corner]), Ok(()));
    }

    #[test]
    fn the_ring_that_is_too_short_is_named() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let short = &square[..2];
        assert_eq!(
            checked(short, &[]),
            Err(Flaw::Empty("area (an outline of fewer than 3 points)"))
        );
        assert_eq!(
            checked(&square, &[short]),
            Err(Flaw::Empty("area (a hole of fewer than 3 points)"))
        );
    }

    /// Lines of small whole numbers: through corners, along edges, in caps' planes.
    #[test]
    fn a_prism_is_met_where_its_outline_is() {
        let table = notched();
        let solid = Solid::Prism(table.row(PrismId(0)));
        let is_inside = |p: DVec3| {
            let crossed = table.row(PrismId(0)).rings();
            let crossed = crossed.filter(|ring| is_around(ring, p.truncate()));
            (0.0..2.0).contains(&p.z) && crossed.count() % 2 == 1
        };
        let mut met = 0;
        for i in 0..40_000_u64 {
            let digit = |k: u32| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (8 * k) & 7) as f64;
            let org = DVec3::new(digit(0) - 0.5, digit(1), digit(2) - 2.0);
            let dir = DVec3::new(digit(3) - 3.0, digit(4) - 3.0, digit(5) - 3.0);
            if dir == DVec3::ZERO {
                continue;
            }
            let line = Line {
                org: org.to_array(),
                dir: dir.to_array(),
            };
            let (mut ends, mut enter) = (Vec::new(), true);
            solid.crossings(&line, &mut Scratch::default(), |root, enters| {
                assert_eq!(enters, enter);
                enter = !enter;
                ends.push(root.rounded());
            });
            assert!(enter && ends.is_sorted());
            met += ends.len();
            // Off the line by a little, where nothing is a tie.
            let off = DVec3::new(1.1e-7, 2.3e-7, 1.7e-7);
            for k in 0..=200 {
                let t = (f64::from(k) + 0.31) / 20.0 - 5.0;
                let before = ends.iter().filter(|end| **end < t).count();
                let is_near = ends.iter().any(|end| (end - t).abs() < 1e-5);
                let mut around = (0..8).map(|k| {
                    let sign = [0, 1, 2].map(|axis| f64::from(1 - 2 * (k >> axis & 1)));
                    is_inside(org + dir * t + off * DVec3::from_array(sign))
                });
                let here = is_inside(org + dir * t + off);
                let sure = around.all(|other| other == here);
                assert!(
                    !sure || is_near || here == (before % 2 == 1),
                    "{line:?} at {t}"
                );
            }
        }
        assert!(met > 10_000);
    }
}
