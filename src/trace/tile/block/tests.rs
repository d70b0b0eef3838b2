//! What the edge functions leave out where numbers leave f32.

use super::*;
use crate::accel::Apart;
use crate::geom::triangle::exact::{Pair, meet_exact};
use crate::math::{Aabb32, Vec3};
use crate::trace::random::Random;
use crate::trace::tile::bundle::Pinhole;

/// A ray from the origin to a place in the first triangle of a block, which lies
/// within `size` of a place twice as far along z. None where exact arithmetic, or the
/// bundle, has none.
fn some_pair(random: &mut Random, size: f32) -> Option<(Apart, Bundle<f64, 1>)> {
    let corners: [[f32; 3]; 3] = [(); 3].map(|()| {
        let [x, y, z] = random.vector().map(|x| x as f32);
        [x * size, y * size, (z + 2.0) * size]
    });
    let weights = random.vector().map(|x| 0.01 + x.abs() as f32);
    let dir: [f32; 3] = std::array::from_fn(|k| {
        let at = |v: usize| weights[v] / (3.0 * size) * corners[v][k];
        at(0) + at(1) + at(2)
    });
    let pair = Pair {
        org: [0.0; 3],
        dir: dir.map(f64::from),
        corners,
    };
    meet_exact(&pair)?;
    let block = Apart {
        corner: corners.map(|c| c.map(|x| [x; WIDE])),
        source: [0; WIDE],
    };
    let bounds = Aabb32 {
        min: [-size, -size, size],
        max: [size, size, 3.0 * size],
    };
    let mut bundle = Bundle::empty();
    let dirs = |_| Vec3::<f64>::splat(pair.dir);
    if !bundle.take_in(pair.org, dirs, &[true], &[true], &bounds) {
        return None;
    }
    bundle.groups[0].limit = f64::INFINITY;
    bundle.groups[0].set_deepest();
    Some((block, bundle))
}

/// T, three lengths multiplied, leaves f32 long before edge functions do.
#[test]
fn no_size_leaves_out_what_is_met() {
    let mut random = Random(5);
    for power in -14..19 {
        let (size, mut met) = (10.0_f32.powi(power * 2), 0);
        for _ in 0..400 {
            let Some((block, bundle)) = some_pair(&mut random, size) else {
                continue;
            };
            let edges = Edges::new::<Pinhole, _, 1>(Block::Apart(&block), &bundle, Aim::Exact);
            let group = &bundle.groups[0];
            let (u, v) = (group.u as f32, group.v as f32);
            let may = edges.may_meet(group, true, bundle.reach) & edges.may_meet_ray(u, v);
            assert_eq!(
                may.count_ones() as usize,
                WIDE,
                "{size:e}: {:?}",
                block.corner
            );
            met += 1;
        }
        assert!(met > 200, "{size:e}: {met}");
    }
}
