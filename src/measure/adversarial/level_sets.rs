//! Target points on level sets: points of the surface with tangents there, so that rays
//! graze it. Computed in f64, so they lie on the surface approximately.

use super::{Random, Target};
use glam::DVec3;
use lanecast_model::geom::LevelSet;
use lanecast_model::geom::exact::Line;
use lanecast_model::geom::formula::{SearchScratch, value_and_gradient};
use std::ops::ControlFlow;

/// Number of random chords.
const TRIES: usize = 8;

pub(super) fn in_level_set(row: &LevelSet, random: &mut Random) -> Target {
    let on_chord = (0..TRIES).find_map(|_| {
        let region = row.region?;
        let mut within = || {
            let part = DVec3::new(random.part(), random.part(), random.part());
            region.min + (region.max - region.min) * part
        };
        let (a, b) = (within(), within());
        let (org, dir) = (a.to_array(), (b - a).to_array());
        let mut met = None;
        let scratch = &mut SearchScratch::default();
        row.changes(&Line { org, dir }, [0.0, 1.0], scratch, |change| {
            met = Some(a.lerp(b, change.t));
            ControlFlow::Break(())
        });
        met
    });
    let Some(point) = on_chord else {
        return random.anywhere();
    };
    let (_, slope) = value_and_gradient(row.formula, point.to_array());
    let slope = DVec3::from_array(slope).try_normalize().unwrap_or(DVec3::Y);
    let (u, v) = slope.any_orthonormal_pair();
    Target {
        point,
        along: [u, v],
    }
}
