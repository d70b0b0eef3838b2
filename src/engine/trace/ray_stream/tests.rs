//! Culling of triangles for streams, against exact arithmetic.

use super::*;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::trace::test_cases::{Case, RAYS, count};
use crate::trace::test_random::Random;

/// Rays through a case's targets: from afar, from next to them, or from behind.
fn rays(case: &Case, random: &mut Random) -> Vec<Pair> {
    let size = case.dir.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let ray = |(i, target): (usize, &[f64; 3])| {
        let turn = random.vector().map(|x| x * [0.0, 0.3, 3.0][i % 3]);
        // Directions as in instances, with more bits than f32 has.
        let length = [1.0, 1.0, 1e-30, 1e30, 4e38][i % 5];
        let dir: [f64; 3] = std::array::from_fn(|k| (case.dir[k] + turn[k]) * length);
        let back = match i / 4 % 4 {
            0 => 1e-5 * random.unit(),
            1 => 1e-3 * random.unit(),
            _ => case.distance / size,
        };
        let back = back / length;
        Pair {
            org: std::array::from_fn(|k| target[k] - dir[k] * back),
            dir,
            corners: case.corners[0],
        }
    };
    case.targets.iter().enumerate().map(ray).collect()
}

#[test]
fn what_is_sorted_out_is_what_exact_arithmetic_says() {
    let mut random = Random(14);
    let [mut pairs, mut out, mut sure] = [0_u64; 3];
    for _ in 0..count() {
        let case = Case::some(&mut random);
        let block = case.block();
        let rays = rays(&case, &mut random);
        let mut stream_rays = Box::<StreamRays>::default();
        let t_min = |i: usize| [1e-4, 0.0, 0.0, -1e-2, -1e30, 0.0_f32][i % 6];
        stream_rays.load(
            u64::MAX,
            |i| (rays[i].org, rays[i].dir, t_min(i)),
            &case.bounds,
            true,
        );
        let planes = BlockPlanes::new(Block::Unindexed(&block), true);
        for (i, ray) in rays.iter().enumerate().take(RAYS) {
            let all = case.corners.map(|corners| Pair { corners, ..*ray });
            let met = all.each_ref().map(meet_exact);
            let some = met[random.below(WIDE)].as_ref().map(|t| t.rounded());
            let near = 1.0 + random.size(-8.0, 0.0) * random.unit();
            let limit = match some {
                Some(t) if random.unit() > 0.0 => (t * near) as f32,
                _ => f32::INFINITY,
            };
            let [may, certain] = stream_rays.triangle_rays.may_meet(i, &planes, limit);
            for (slot, crossing) in met.iter().enumerate() {
                let is_met = crossing.as_ref().is_some_and(|t| {
                    let (begin, end) = (f64::from(t_min(i)), f64::from(limit));
                    t.order_with(begin).is_gt() && t.order_with(end).is_lt()
                });
                let what = || format!("{:?}, from {} to {limit}", all[slot], t_min(i));
                let (may, certain) = (may >> slot & 1 != 0, certain >> slot & 1 != 0);
                assert!(may || !is_met, "met: {}", what());
                assert!(!certain || is_met, "not met: {}", what());
                pairs += 1;
                out += u64::from(!may);
                sure += u64::from(certain);
            }
        }
    }
    println!("of {pairs} pairs {out} are out, {sure} certain");
    assert!(
        out > pairs / 2 && sure > pairs / 1000,
        "{pairs}: {out}, {sure}"
    );
}
