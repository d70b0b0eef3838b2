//! Guarded beams of one direction against exact arithmetic.

use super::super::oracle_tests::{Probe, TestBeam, Traced, answers, decisions};
use super::*;
use crate::math::Vec3;
use crate::trace::test_cases::{Case, RAYS};

impl Probe for Edges {
    const WHAT: &str = "one direction";

    /// Half of the rays start at their target, as shadow rays do.
    fn traced(case: &Case, placed: bool) -> Option<Traced> {
        let rounded = |x: f64| if placed { x } else { f64::from(x as f32) };
        let dir = case.dir.map(rounded);
        let size = dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let orgs: [[f64; 3]; RAYS] = std::array::from_fn(|i| {
            let back = if i / 4 % 2 == 0 { case.distance } else { 1e-5 };
            std::array::from_fn(|k| case.targets[i][k] - dir[k] / size * back)
        });
        let mut beam = Box::new(TestBeam::empty());
        let all = [true; RAYS];
        let org = |s: usize| Vec3::splat(orgs[s]);
        if !beam.load_parallel(org, dir, &all, &all, &case.bounds) {
            return None;
        }
        beam.centre_groups();
        let rays = orgs.map(|org| [org, dir]).to_vec();
        Some(Traced { beam, rays })
    }

    fn margin(&self, slot: usize) -> f32 {
        self.margin[slot]
    }

    fn least(met: &Candidates<f32>) -> f32 {
        met.least
    }

    fn turned_by(values: [f64; 3], _volume: f64) -> f64 {
        values.iter().sum()
    }
}

#[test]
fn decisions_are_those_of_exact_arithmetic() {
    decisions::<Edges>(12, |_, _, _, _, _| ());
}

#[test]
fn hits_are_those_of_exact_arithmetic() {
    answers::<Edges>(13);
}
