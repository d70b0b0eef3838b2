//! Meetings of a line and a level set: the t that the search defines (S35) are taken as exact
//! numbers.

use crate::geom::LevelSet;
use crate::geom::exact::root::{Branch, Root};
use crate::geom::exact::surface::Surface;
use crate::geom::exact::{Line, solid};
use crate::geom::formula::{Formula, SearchScratch};
use crate::math::bounds::ErrorBounded;
use std::ops::ControlFlow;

/// Calls `visit` with all roots on a line, front to back, and whether the line enters there.
/// Returns whether the line is in the solid from the start.
pub fn crossings<'a>(
    row: &LevelSet<'a>,
    line: &Line,
    scratch: &mut SearchScratch,
    mut visit: impl FnMut(Root<'a>, bool),
) -> bool {
    let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
    row.changes(line, everywhere, scratch, |change| {
        visit(root(row.formula, line, change.t), change.enters);
        ControlFlow::Continue(())
    })
}

/// Returns the first meeting beyond t_min in the clip.
pub(in crate::geom) fn first_beyond<'a>(
    row: &LevelSet<'a>,
    line: &Line,
    t_min: f64,
    scratch: &mut SearchScratch,
) -> Option<Root<'a>> {
    let [enter, exit] = solid::clip(line, row.ends())?;
    let mut first = None;
    row.changes(line, [t_min, f64::INFINITY], scratch, |change| {
        let root = root(row.formula, line, change.t);
        let begins = enter.is_none_or(|end| root.order(&end).is_ge());
        let ended = exit.is_some_and(|end| root.order(&end).is_gt());
        if change.t > t_min && begins && !ended {
            first = Some(root);
        }
        match first.is_some() || ended {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    first
}

fn root<'a>(formula: &'a Formula, line: &Line, t: f64) -> Root<'a> {
    let surface = Surface::LevelSet { formula, t };
    Root::new(line, surface, Branch::Upper, ErrorBounded::exact(t))
}
