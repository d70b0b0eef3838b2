//! Rays of one origin against exact arithmetic.

use super::super::Edges as _;
use super::super::cases::{Case, RAYS, Random, Tally, Tile, ask, edges, least, tiles};
use super::*;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::math::Vec3;
use crate::trace::tile::leaf::Before;
use crate::trace::tile::mesh::Nearest;

/// And the rays' origin and directions.
type Rays = (Box<Tile>, [f64; 3], Vec<[f64; 3]>);

/// None where the bundle takes in no such rays. `placed`: their directions are f64, as in
/// the space of an instance.
fn tile(case: &Case, placed: bool) -> Option<Rays> {
    let size = case.dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let org: [f64; 3] =
        std::array::from_fn(|k| case.targets[RAYS / 2][k] - case.dir[k] / size * case.distance);
    let rounded = |x: f64| if placed { x } else { f64::from(x as f32) };
    let dirs: Vec<[f64; 3]> = case
        .targets
        .iter()
        .map(|p| std::array::from_fn(|k| rounded(p[k] - org[k])))
        .collect();
    let mut bundle = Box::new(Tile::empty());
    let all = [true; RAYS];
    let dir = |s: usize| Vec3::new(dirs[s][0] as f32, dirs[s][1] as f32, dirs[s][2] as f32);
    if !bundle.take_in(org, dir, &all, &all, &case.bounds) {
        return None;
    }
    bundle.centre_pinhole(placed, &case.bounds);
    Some((bundle, org, dirs))
}

/// One ray and one triangle as the tile sees them: whether they may meet, what comes of
/// it, and the least edge function.
fn see(
    edges: &Edges,
    bundle: &mut Tile,
    (ray, slot): (usize, usize),
    any: bool,
    least: f32,
) -> (bool, Settled<f32>, f32) {
    let Bundle {
        groups,
        lines,
        starts,
        ..
    } = bundle;
    let mut nearest = Nearest::none();
    nearest.least = least;
    let before = Before {
        group: &mut groups[ray],
        lines: &lines[ray],
        starts: &starts[ray],
        nearest: &mut nearest,
    };
    let line = edges.line(&before, |x| *x);
    let at = |column: &[f32; WIDE]| column[slot];
    let met = edges.meet(at, &line, any);
    let group = &groups[ray];
    let may = Edges::possible(&met) && edges.may_meet(group, &lines[ray]) >> slot & 1 != 0;
    (may, edges.settle(at, &met, any), met.least)
}

#[test]
fn decisions_are_those_of_exact_arithmetic() {
    let (mut random, mut tally) = (Random(11), Tally::default());
    for number in 0..tiles() {
        let case = Case::some(&mut random);
        let block = case.block();
        let Some((mut bundle, org, dirs)) = tile(&case, number % 2 == 1) else {
            continue;
        };
        for group in &mut bundle.groups {
            group.limit = f32::INFINITY;
            group.set_deepest();
        }
        let all = Edges::of(Block::Apart(&block), &bundle, false);
        let any = Edges::of(Block::Apart(&block), &bundle, true);
        for (ray, slot) in (0..RAYS).flat_map(|ray| (0..WIDE).map(move |slot| (ray, slot))) {
            let (corners, dir) = (case.corners[slot], dirs[ray]);
            let (along, exact) = (bundle.groups[ray].along, dir[bundle.frustum.axes[2]].abs());
            let pair = Pair { org, dir, corners };
            let truth = meet_exact(&pair);
            let truth = truth.filter(|t| t.order_with(0.0).is_gt());
            let (may, settled, value) = see(&all, &mut bundle, (ray, slot), false, f32::INFINITY);
            let what = || format!("ray {ray} from {org:?} along {dir:?}, triangle {corners:?}");
            tally.pairs += 1;
            tally.sure += u64::from(may && settled.sure);
            tally.missed += u64::from(!may);
            tally.doubts += u64::from(may && !settled.sure);
            let margin = f64::from(all.margin[slot]) / 2.0;
            if margin.is_finite() {
                let (values, volume) = edges(&corners, org, dir, exact);
                let off = f64::from(value) - margin - least(values, volume);
                tally.worst = tally.worst.max(off.abs() / margin);
            }
            let Some(truth) = truth else {
                assert!(!(may && settled.sure), "no hit: {}", what());
                continue;
            };
            assert!(may, "a hit: {}", what());
            let depth = truth.rounded() * exact;
            let (from, to) = (f64::from(settled.from), f64::from(settled.to));
            assert!(
                from <= depth && depth <= to,
                "{from} {depth} {to}: {}",
                what()
            );
            // The same, asked for any hit before an end that is next to it.
            let end = (truth.rounded() * (1.0 + 1e-6 * random.unit())) as f32;
            let group = &mut bundle.groups[ray];
            group.limit = end * (along * (1.0 + 8.0 * f32::EPSILON));
            group.set_deepest();
            let before = end * (along * (1.0 - 8.0 * f32::EPSILON));
            let (may, settled, _) = see(&any, &mut bundle, (ray, slot), true, before);
            let is_before = truth.order_with(f64::from(end)).is_lt();
            assert!(may || !is_before, "before {end}: {}", what());
            assert!(
                !(may && settled.sure) || is_before,
                "not before {end}: {}",
                what()
            );
            bundle.groups[ray].limit = f32::INFINITY;
            bundle.groups[ray].set_deepest();
        }
    }
    tally.report("one origin");
}

#[test]
fn hits_are_those_of_exact_arithmetic() {
    let (mut random, mut answers) = (Random(13), [0; 2]);
    for number in 0..tiles() / 4 {
        let case = Case::some(&mut random);
        let block = case.block();
        let Some((mut bundle, org, dirs)) = tile(&case, number % 2 == 1) else {
            continue;
        };
        let pair = |ray, slot| Pair {
            org,
            dir: dirs[ray],
            corners: case.corners[slot],
        };
        let some = ask::<Edges>(&mut random, &mut bundle, &block, pair);
        answers = [answers[0] + some[0], answers[1] + some[1]];
    }
    let [certain, all] = answers;
    println!("pinhole: {certain} of {all} answers are certain");
    assert!(certain > all / 5, "{certain} of {all}");
}
