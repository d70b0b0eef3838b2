//! Guarded beams of one origin against exact arithmetic.

use super::super::Edges as _;
use super::super::oracle_tests::{Probe, TestBeam, Traced, answers, decisions};
use super::*;
use crate::math::Vec3;
use crate::trace::test_cases::{Case, RAYS};
use glam::DVec3;

impl Probe for Edges {
    const WHAT: &str = "one origin";

    fn traced(case: &Case, placed: bool) -> Option<Traced> {
        let size = case.dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let org: [f64; 3] =
            std::array::from_fn(|k| case.targets[RAYS / 2][k] - case.dir[k] / size * case.distance);
        let rounded = |x: f64| if placed { x } else { f64::from(x as f32) };
        let dirs = case
            .targets
            .map(|p| std::array::from_fn(|k| rounded(p[k] - org[k])));
        let mut beam = Box::new(TestBeam::empty());
        let all = [true; RAYS];
        let dir = |s: usize| Vec3::<f64>::from(DVec3::from_array(dirs[s]));
        if !beam.load_pinhole(org, dir, &all, &all, &case.bounds) {
            return None;
        }
        beam.centre_pinhole(&case.bounds);
        let rays = dirs.map(|dir| [org, dir]).to_vec();
        Some(Traced { beam, rays })
    }

    fn margin(&self, slot: usize) -> f32 {
        self.margin[slot]
    }

    fn least(met: &Candidates<f32>) -> f32 {
        met.least
    }

    fn turned_by(_values: [f64; 3], volume: f64) -> f64 {
        volume
    }
}

#[test]
fn decisions_are_those_of_exact_arithmetic() {
    decisions::<Edges>(11, |random, traced, block, at, truth| {
        // An any-hit ray that ends next to the hit.
        let any = Edges::new(Block::Unindexed(block), &traced.beam, true);
        let end = (truth.rounded() * (1.0 + 1e-6 * random.unit())) as f32;
        let along = traced.beam.groups[at.0].along;
        traced.limit(at.0, end * (along * (1.0 + 8.0 * f32::EPSILON)));
        let before = end * (along * (1.0 - 8.0 * f32::EPSILON));
        let (may, certified, _) = traced.see(&any, at, true, before);
        let is_before = truth.order_with(f64::from(end)).is_lt();
        let what = || format!("before {end}: {truth:?}");
        assert!(may || !is_before, "{}", what());
        assert!(!(may && certified.sure) || is_before, "not {}", what());
        traced.limit(at.0, f32::MAX);
    });
}

#[test]
fn hits_are_those_of_exact_arithmetic() {
    answers::<Edges>(13);
}
