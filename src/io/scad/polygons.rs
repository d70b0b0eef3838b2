//! Operators on rings of corners, by the crate `i_overlay`, on a grid of a power of two: corners
//! that come out are exact in f64, so edges that touch do not cross.

use super::crossings;
use crate::scene::Operator;
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;

/// Rings of corners; what an odd number of them goes around is inside.
pub(super) type Rings = Vec<Vec<DVec2>>;

/// The most corners that operators work on: where all edges cross, they make their square.
const MOST_CORNERS: usize = 1 << 14;

/// The power of two of the largest coordinate on the grid, of those of i64 that differences and
/// products leave; a prism's own grid is finer.
const BITS: i32 = 44;

/// A grid for outlines of one size.
pub(super) struct Grid {
    power: i32,
}

impl Grid {
    pub fn of<'a>(rings: impl Iterator<Item = &'a Vec<DVec2>>) -> Grid {
        let most = rings
            .flatten()
            .fold(0.0, |most: f64, p| most.max(p.abs().max_element()));
        let power = match most > 0.0 && most.is_finite() {
            true => BITS - 1 - libm::ilogb(most),
            false => 0,
        };
        Grid { power }
    }

    fn to(&self, ring: &[DVec2]) -> Vec<IntPoint<i64>> {
        let on = |x: f64| libm::rint(libm::scalbn(x, self.power)) as i64;
        ring.iter()
            .map(|p| IntPoint::new(on(p.x), on(p.y)))
            .collect()
    }

    fn back(&self, ring: &[IntPoint<i64>]) -> Vec<DVec2> {
        let off = |x: i64| libm::scalbn(x as f64, -self.power);
        ring.iter()
            .map(|p| DVec2::new(off(p.x), off(p.y)))
            .collect()
    }
}

/// Refuses more corners than operators work on.
pub(super) fn few_enough<'a>(all: impl Iterator<Item = &'a Rings>) -> Result<(), String> {
    let corners: usize = all.flatten().map(Vec::len).sum();
    match corners <= MOST_CORNERS {
        true => Ok(()),
        false => Err(format!(
            "an outline of {corners} corners is too much here (at most {MOST_CORNERS})"
        )),
    }
}

/// Combines rings by an operator.
pub(super) fn combined(
    operator: Operator,
    operands: Vec<Rings>,
    grid: &Grid,
) -> Result<Rings, String> {
    few_enough(operands.iter())?;
    let mut operands = operands.into_iter();
    Ok(match operator {
        Operator::Intersection => {
            let first = operands.next().unwrap_or_default();
            let both = |a, b| even_odd(&a, &b, OverlayRule::Intersect, grid);
            operands.try_fold(first, both)?
        }
        Operator::Difference => {
            let first = operands.next().unwrap_or_default();
            let others = united(operands.collect(), grid)?;
            even_odd(&first, &others, OverlayRule::Difference, grid)?
        }
        _ => united(operands.collect(), grid)?,
    })
}

/// Unites rings by halves, so that many take hardly longer than few.
fn united(mut operands: Vec<Rings>, grid: &Grid) -> Result<Rings, String> {
    while operands.len() > 1 {
        let pair = |pair: &[Rings]| match pair {
            [a, b] => even_odd(a, b, OverlayRule::Union, grid),
            _ => Ok(pair.concat()),
        };
        operands = operands.chunks(2).map(pair).collect::<Result<_, _>>()?;
    }
    Ok(operands.pop().unwrap_or_default())
}

fn even_odd(one: &Rings, other: &Rings, rule: OverlayRule, grid: &Grid) -> Result<Rings, String> {
    overlaid(one, other, rule, FillRule::EvenOdd, grid)
}

/// Returns the rings of [`pieces_of`] in one list.
fn overlaid(
    one: &Rings,
    other: &Rings,
    rule: OverlayRule,
    fill: FillRule,
    grid: &Grid,
) -> Result<Rings, String> {
    Ok(pieces_of(one, other, rule, fill, grid)?.concat())
}

/// Overlays rings; each piece that comes out is an outline with its holes. Fails where edges cross too
/// often, or too many corners come out.
fn pieces_of(
    one: &Rings,
    other: &Rings,
    rule: OverlayRule,
    fill: FillRule,
    grid: &Grid,
) -> Result<Vec<Rings>, String> {
    crossings::few_enough([one, other].into_iter())?;
    let corners = one.iter().chain(other).map(Vec::len).sum();
    let mut overlay = Overlay::<i64>::new(corners);
    for (rings, side) in [(one, ShapeType::Subject), (other, ShapeType::Clip)] {
        for ring in rings {
            overlay.add_contour(&grid.to(ring), side);
        }
    }
    let shapes = overlay.overlay(rule, fill);
    let piece = |shape: &Vec<_>| shape.iter().map(|ring: &Vec<_>| grid.back(ring)).collect();
    let pieces: Vec<Rings> = shapes.iter().map(piece).collect();
    few_enough(pieces.iter())?;
    Ok(pieces)
}

/// Makes rings whose edges do not cross, by the even-odd rule.
pub(super) fn cleaned(rings: &Rings) -> Result<Rings, String> {
    few_enough(std::iter::once(rings))?;
    let grid = Grid::of(rings.iter());
    even_odd(rings, &Vec::new(), OverlayRule::Subject, &grid)
}

/// Parts rings whose edges do not cross, by the even-odd rule, into outlines with their holes.
pub(super) fn pieces(rings: &Rings) -> Result<Vec<Rings>, String> {
    few_enough(std::iter::once(rings))?;
    let grid = Grid::of(rings.iter());
    pieces_of(
        rings,
        &Vec::new(),
        OverlayRule::Subject,
        FillRule::EvenOdd,
        &grid,
    )
}

/// Makes the rings of what is wound around a positive number of times.
pub(super) fn positive(rings: &Rings, grid: &Grid) -> Result<Rings, String> {
    overlaid(
        rings,
        &Vec::new(),
        OverlayRule::Subject,
        FillRule::Positive,
        grid,
    )
}
