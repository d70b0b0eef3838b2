//! Rays of one direction against exact arithmetic.

use super::super::Edges as _;
use super::super::cases::{Case, RAYS, Random, Tally, Tile, ask, edges, least, tiles};
use super::*;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::math::Vec3;
use crate::trace::tile::leaf::Before;
use crate::trace::tile::mesh::Nearest;

/// And the rays' origins and direction.
type Rays = (Box<Tile>, Vec<[f64; 3]>, [f64; 3]);

/// None where the bundle takes in no such rays. Half of them start at their target, as
/// shadow rays do. `placed`: their direction is f64, as in the space of an instance.
fn tile(case: &Case, placed: bool) -> Option<Rays> {
    let rounded = |x: f64| if placed { x } else { f64::from(x as f32) };
    let dir = case.dir.map(rounded);
    let size = dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let orgs: Vec<[f64; 3]> = case
        .targets
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let back = if i / 4 % 2 == 0 { case.distance } else { 1e-5 };
            std::array::from_fn(|k| p[k] - dir[k] / size * back)
        })
        .collect();
    let mut bundle = Box::new(Tile::empty());
    let all = [true; RAYS];
    let org = |s: usize| Vec3::new(orgs[s][0], orgs[s][1], orgs[s][2]);
    if !bundle.take_in_parallel(org, dir, &all, &all, &case.bounds) {
        return None;
    }
    bundle.centre_groups();
    Some((bundle, orgs, dir))
}

#[test]
fn decisions_are_those_of_exact_arithmetic() {
    let (mut random, mut tally) = (Random(12), Tally::default());
    for number in 0..tiles() {
        let case = Case::some(&mut random);
        let block = case.block();
        let Some((mut bundle, orgs, dir)) = tile(&case, number % 2 == 1) else {
            continue;
        };
        for group in &mut bundle.groups {
            group.limit = f32::MAX;
            group.set_deepest();
        }
        let all = Edges::of(Block::Apart(&block), &bundle, false);
        let [_, _, k] = bundle.frustum.axes;
        let (along, base) = (dir[k].abs(), f64::from(bundle.org[2]));
        for (ray, slot) in (0..RAYS).flat_map(|ray| (0..WIDE).map(move |slot| (ray, slot))) {
            let (corners, org) = (case.corners[slot], orgs[ray]);
            let pair = Pair { org, dir, corners };
            let truth = meet_exact(&pair);
            let truth = truth.filter(|t| t.order_with(0.0).is_gt());
            let Bundle {
                groups,
                lines,
                starts,
                ..
            } = &mut *bundle;
            let mut nearest = Nearest::none();
            let before = Before {
                group: &mut groups[ray],
                lines: &lines[ray],
                starts: &starts[ray],
                nearest: &mut nearest,
            };
            let line = all.line(&before, |x| *x);
            let at = |column: &[f32; WIDE]| column[slot];
            let met = all.meet(at, &line, false);
            let may =
                Edges::possible(&met) && all.may_meet(&groups[ray], &lines[ray]) >> slot & 1 != 0;
            let settled = all.settle(at, &met, false);
            let what = || format!("ray {ray} from {org:?} along {dir:?}, triangle {corners:?}");
            tally.pairs += 1;
            tally.sure += u64::from(may && settled.sure);
            tally.missed += u64::from(!may);
            tally.doubts += u64::from(may && !settled.sure);
            let margin = f64::from(all.margin[slot]) / 2.0;
            if margin.is_finite() {
                let (values, _) = edges(&corners, org, dir, along);
                let least = least(values, values.iter().sum());
                let off = f64::from(met.least) - margin - least;
                tally.worst = tally.worst.max(off.abs() / margin);
            }
            let Some(truth) = truth else {
                assert!(!(may && settled.sure), "no hit: {}", what());
                continue;
            };
            assert!(may, "a hit: {}", what());
            let start = org[k] * f64::from(bundle.frustum.sign) - base;
            let depth = start + truth.rounded() * along;
            let (from, to) = (f64::from(settled.from), f64::from(settled.to));
            let room = 1e-14 * (start.abs() + depth.abs());
            assert!(
                from <= depth + room && depth - room <= to,
                "{from} {depth} {to}: {}",
                what()
            );
        }
    }
    tally.report("one direction");
}

#[test]
fn hits_are_those_of_exact_arithmetic() {
    let (mut random, mut answers) = (Random(13), [0; 2]);
    for number in 0..tiles() / 4 {
        let case = Case::some(&mut random);
        let block = case.block();
        let Some((mut bundle, orgs, dir)) = tile(&case, number % 2 == 1) else {
            continue;
        };
        let pair = |ray, slot| Pair {
            org: orgs[ray],
            dir,
            corners: case.corners[slot],
        };
        let some = ask::<Edges>(&mut random, &mut bundle, &block, pair);
        answers = [answers[0] + some[0], answers[1] + some[1]];
    }
    let [certain, all] = answers;
    println!("parallel: {certain} of {all} answers are certain");
    assert!(certain > all / 5, "{certain} of {all}");
}
