//! Outlines and what is made of them: `square`, `circle`, `polygon`, `offset`, `hull`,
//! `linear_extrude` and `rotate_extrude`.

use super::arguments::{self, to_plane};
use super::budget;
use super::curves::{self, FINE_SIDES};
use super::facets;
use super::hulls;
use super::nodes::{Made, Outcome, Reader, is_size, radius, remedy};
use super::offsets::{self, Corner};
use super::outlines::{OutlineId, PlacedShape, Shape};
use super::polygons::{self, Rings};
use super::solids::{Leaf, Part, SolidId};
use super::syntax::Value;
use super::turn;
use crate::scene::Operator;
use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};

impl Reader<'_> {
    pub(super) fn square(&self, row: usize) -> Option<Shape> {
        let of = self.arguments(row, &["size", "center"]);
        let size = DVec2::from_array(of.numbers("size", 1.0));
        let is_there = size.is_finite() && size.min_element() > 0.0;
        let min = match of.is_true("center") {
            true => size * -0.5,
            false => DVec2::ZERO,
        };
        let max = min + size;
        is_there.then_some(Shape::Box { min, max })
    }

    pub(super) fn circle(&self, row: usize) -> Option<Shape> {
        let of = self.arguments(row, &["r"]);
        let radius = radius(&of, "r", "d", 1.0);
        if !is_size(radius) {
            return None;
        }
        Some(match curves::sides_if_any(self.curves, &of, radius) {
            Some(sides) => Shape::Rings(vec![curves::circle(radius, sides)]),
            None => Shape::Disc(radius),
        })
    }

    pub(super) fn polygon(&self, row: usize) -> Outcome<Option<Shape>> {
        let of = self.arguments(row, &["points", "paths", "convexity"]);
        let wrong = |why| format!("this polygon cannot be drawn: {why}");
        let points = to_plane(arguments::points::<2>(of.get("points")).map_err(wrong)?);
        let rings: Rings = match of.get("paths") {
            None => vec![points],
            Some(Value::List(paths)) if paths.is_empty() => vec![points],
            // One path need not be in a list of its own.
            Some(paths) => {
                let rows = arguments::faces_or_one(Some(paths), points.len()).map_err(wrong)?;
                let ring = |row: Vec<u32>| row.into_iter().map(|i| points[i as usize]).collect();
                rows.into_iter().map(ring).collect()
            }
        };
        let rings = polygons::cleaned(&rings).map_err(wrong)?;
        Ok((!rings.is_empty()).then_some(Shape::Rings(rings)))
    }

    pub(super) fn offset(&mut self, row: usize) -> Outcome<Made> {
        let of = self.arguments(row, &["r"]);
        let outline = match self.united_outline(row) {
            Ok(outline) => outline,
            Err(made) => return Ok(made),
        };
        let line = self.lines[row];
        let (by, is_round) = match (of.number("r"), of.number("delta")) {
            (Some(r), _) => (r, true),
            (None, Some(delta)) => (delta, false),
            (None, None) => (1.0, true),
        };
        if !by.is_finite() {
            return Err("offset() needs a finite distance".into());
        }
        if let Shape::Disc(radius) = self.outlines.shapes[outline as usize]
            && is_round
        {
            let radius = radius + by;
            let disc = is_size(radius).then_some(Shape::Disc(radius));
            return Ok(self.outline(line, disc));
        }
        let mut has_sides = self.has_discs(outline, |_| true);
        let corner = match is_round {
            true => {
                let sides = curves::sides_if_any(self.curves, &of, by.abs());
                has_sides |= sides.is_none() && by > 0.0;
                Corner::Round(sides.unwrap_or(FINE_SIDES))
            }
            false if of.is_true("chamfer") => Corner::Cut,
            false => Corner::Sharp,
        };
        if has_sides {
            let what = format!("offset(), with {FINE_SIDES} sides to a circle");
            self.report.shown_as(&what);
        }
        let rings = self.outlines.rings(outline, FINE_SIDES)?;
        let rings = offsets::offset(&rings, by, corner)?;
        let shape = (!rings.is_empty()).then_some(Shape::Rings(rings));
        Ok(self.outline(line, shape))
    }

    /// Says whether an outline has discs whose maps are of a kind.
    fn has_discs(&self, outline: OutlineId, is_kind: impl Fn(&DAffine2) -> bool) -> bool {
        let shapes = &self.outlines.shapes;
        let is = |part: &PlacedShape| {
            matches!(shapes[part.id as usize], Shape::Disc(_)) && is_kind(&part.map)
        };
        self.outlines.visit(outline).iter().any(is)
    }

    pub(super) fn hull(&mut self, row: usize) -> Outcome<Made> {
        let line = self.lines[row];
        let with_remedy = |why: String| remedy(&why);
        let (made, sides) = match self.operator(row, Operator::Union) {
            Made::Solid(solid) => {
                let made = hulls::of_solid(solid, line, &mut self.solids).map_err(with_remedy)?;
                let hull = made.hull.map(|hull| {
                    // OpenSCAD shows a hull in one colour.
                    Made::Solid(self.solids.push(line, Part::Plain(hull)))
                });
                (hull, made.sides)
            }
            Made::Outline(outline) => {
                let made =
                    hulls::of_outline(outline, line, &mut self.outlines).map_err(with_remedy)?;
                (made.hull.map(Made::Outline), made.sides)
            }
            other => (Some(other), None),
        };
        if let Some(sides) = sides {
            self.report.shown_as(&format!(
                "hull() of several curves, with {sides} sides to a circle"
            ));
        }
        Ok(made.unwrap_or(Made::Nothing))
    }

    pub(super) fn linear_extrude(&mut self, row: usize) -> Outcome<Made> {
        let of = self.arguments(row, &["height", "center", "convexity", "twist"]);
        let outline = match self.united_outline(row) {
            Ok(outline) => outline,
            Err(made) => return Ok(made),
        };
        let height = of
            .number("height")
            .or_else(|| of.number("h"))
            .unwrap_or(100.0);
        if !is_size(height) {
            return Ok(Made::Nothing);
        }
        if of.number_or("twist", 0.0) != 0.0 {
            return Err(remedy("linear_extrude() with a twist is not drawn"));
        }
        let from = match of.is_true("center") {
            true => height * -0.5,
            false => 0.0,
        };
        let scale: [f64; 2] = of.numbers("scale", 1.0);
        let line = self.lines[row];
        let solid = match scale == [1.0; 2] {
            true => self
                .outlines
                .sweep(outline, (from, height), &mut self.solids),
            false => {
                let leaves = self.tapered(outline, (from, height), scale)?;
                match self.either(line, leaves) {
                    Some(solid) => solid,
                    None => return Ok(Made::Nothing),
                }
            }
        };
        Ok(Made::Solid(self.solids.push(line, Part::Plain(solid))))
    }

    /// Makes what an outline sweeps that is scaled on the way. Its sides are flat where it is
    /// scaled alike in both directions.
    fn tapered(
        &mut self,
        outline: OutlineId,
        (from, height): (f64, f64),
        scale: [f64; 2],
    ) -> Outcome<Vec<Leaf>> {
        let [x, y] = scale;
        let is_known = x == y && x.is_finite() && x >= 0.0;
        if !is_known {
            return Err(remedy(
                "linear_extrude() that scales x and y differently, or turns inside out, is not drawn",
            ));
        }
        if let Shape::Disc(radius) = self.outlines.shapes[outline as usize] {
            return Ok(vec![Leaf::Frustum {
                base: DVec3::new(0.0, 0.0, from),
                top: DVec3::new(0.0, 0.0, from + height),
                base_radius: radius,
                top_radius: radius * x,
            }]);
        }
        if self.has_discs(outline, |_| true) {
            self.report.shown_as(&format!(
                "linear_extrude() with a scale, with {FINE_SIDES} sides to a circle"
            ));
        }
        let rings = self.outlines.rings(outline, FINE_SIDES)?;
        let rings = polygons::cleaned(&rings)?;
        let of = |ring: &Vec<DVec2>| facets::of_tapered(ring, (from, height), x);
        Ok(rings.iter().map(of).collect())
    }

    /// Makes the solid that is in an odd number of leaves, of which each belongs to a ring.
    fn either(&mut self, line: u32, leaves: Vec<Leaf>) -> Option<SolidId> {
        let solids: Vec<SolidId> = leaves
            .into_iter()
            .map(|leaf| self.solids.leaf(line, leaf))
            .collect();
        (!solids.is_empty()).then(|| self.solids.op(line, Operator::Xor, solids))
    }

    pub(super) fn rotate_extrude(&mut self, row: usize) -> Outcome<Made> {
        let of = self.arguments(row, &["angle", "convexity"]);
        let outline = match self.united_outline(row) {
            Ok(outline) => outline,
            Err(made) => return Ok(made),
        };
        let line = self.lines[row];
        let angle = of
            .number("angle")
            .filter(|a| a.is_finite() && a.abs() <= 360.0);
        let angle = angle.unwrap_or(360.0);
        let rings = self.outlines.rings(outline, FINE_SIDES)?;
        let points = || rings.iter().flatten();
        let most = points().fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
        let [low, high] = [
            points().fold(f64::INFINITY, |low, p| low.min(p.x)),
            points().fold(f64::NEG_INFINITY, |high, p| high.max(p.x)),
        ];
        if !(low < high) || angle == 0.0 {
            return Ok(Made::Nothing);
        }
        let room = most * 1e-5;
        if low < -room && high > room {
            return Err(
                "rotate_extrude() of an outline on both sides of the axis; move it to x > 0".into(),
            );
        }
        let is_mirrored = high <= room;
        let turned = match is_mirrored {
            true => {
                let by = DAffine2::from_scale(DVec2::new(-1.0, 1.0));
                self.outlines.push(line, Shape::Placed(outline, by))
            }
            false => outline,
        };
        let radius = high.abs().max(low.abs());
        let solid = match curves::sides_if_any(self.curves, &of, radius) {
            Some(sides) => {
                if self.has_discs(turned, |_| true) {
                    self.report.shown_as(&format!(
                        "rotate_extrude() in facets of a circle, with {FINE_SIDES} sides to it"
                    ));
                }
                let rings = polygons::cleaned(&self.outlines.rings(turned, FINE_SIDES)?)?;
                let corners: usize = rings.iter().map(Vec::len).sum();
                let steps = facets::steps(sides, angle) as usize;
                budget::fits(corners.saturating_mul(steps).saturating_mul(3))?;
                let of = |ring: &Vec<DVec2>| facets::of_turned(ring, (sides, angle), is_mirrored);
                match self.either(line, rings.iter().map(of).collect()) {
                    Some(solid) => solid,
                    None => return Ok(Made::Nothing),
                }
            }
            None => {
                if self.has_discs(turned, |map| !turn::is_round(map)) {
                    self.report.shown_as(&format!(
                        "rotate_extrude() of an ellipse, with {FINE_SIDES} sides to it"
                    ));
                }
                let swept = turn::swept(&self.outlines, turned, line, &mut self.solids);
                let Some(mut solid) = swept else {
                    return Ok(Made::Nothing);
                };
                if angle.abs() < 360.0 {
                    let ends = (angle.min(0.0), angle.max(0.0));
                    solid = turn::wedge(solid, ends, line, &mut self.solids);
                }
                match is_mirrored {
                    true => {
                        let half = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
                        self.solids.placed(line, solid, DAffine3::from_mat3(half))
                    }
                    false => solid,
                }
            }
        };
        Ok(Made::Solid(self.solids.push(line, Part::Plain(solid))))
    }
}
