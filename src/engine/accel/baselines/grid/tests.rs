//! Tests of the cells that traversals visit, and of the layout of grids. index_tests.rs
//! compares traversals with the linear scan.

use super::*;
use crate::accel::baselines::count::{Count, Counter};
use crate::accel::baselines::index::Primitives;
use crate::accel::baselines::index_tests::{Random, boxes, rays};
use crate::math::Vec3;
use crate::math::lanes::{f64x4, f64x8};
use proptest::prelude::*;

fn grid(of: &[Aabb32], density: &Density) -> Grid {
    let primitives = Primitives {
        boxes: of,
        corners: None,
    };
    Grid::build(&primitives, density).0
}

/// Counts the cells whose interval is not empty, in all blocks that are reached.
fn reached(grid: &Grid, slabs: &Slabs<f64>, block: usize, from: f64, to: f64) -> u64 {
    let of = &grid.blocks[block];
    let [x, y, _] = of.res.map(|n| n as usize);
    let mut count = 0;
    for cell in 0..of.len() {
        let at = [cell % x, cell / x % y, cell / x / y];
        let (min, max) = grid.cell_box(of, at);
        let (enter, exit) = slabs.interval(min, max);
        let (enter, exit) = (enter.max(from), exit.min(to));
        if enter <= exit {
            count += 1;
            if let Content::Block(inner) = grid.content(of.cell(at)) {
                count += reached(grid, slabs, inner, enter, to);
            }
        }
    }
    count
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5_000))]

    /// The cells visited are those whose interval is not empty, no fewer and no more.
    #[test]
    fn a_lane_visits_the_cells_whose_interval_is_not_empty(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let of = boxes(random);
        let density = Density { cells: 3.0, dense: 2 + random.below(30), inner: 4.0 };
        let grid = grid(&of, &density);
        if grid.blocks[0].len() == 1 {
            return Ok(());
        }
        let mut marks = Mailbox::default();
        for _ in 0..4 {
            let r = rays::<f64>(random, &of);
            let slabs = Slabs::new(r.org, r.dir, &grid.bounds);
            let counter = Counter::default();
            grid.walk(&slabs, r.t_min, r.t_max, &mut marks, Count(Some(&counter)), &mut |_, _, _, limit| limit);
            let expected = reached(&grid, &slabs, 0, r.t_min, r.t_max);
            prop_assert_eq!(counter.counts().nodes, expected);
        }
    }

    /// A packet visits the cells that its lanes visit alone.
    #[test]
    fn a_packet_visits_the_cells_of_its_lanes(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let of = boxes(random);
        let density = Density { cells: 3.0, dense: 2 + random.below(30), inner: 4.0 };
        let grid = grid(&of, &density);
        if grid.blocks[0].len() == 1 {
            return Ok(());
        }
        packet::<f64x4>(&grid, &rays(random, &of));
        packet::<f64x8>(&grid, &rays(random, &of));
    }
}

/// Compares the cells that a packet visits with those of its lanes.
fn packet<L: Lanes<Scalar = f64>>(grid: &Grid, r: &crate::accel::baselines::index_tests::Rays<L>) {
    let mut marks = Mailbox::default();
    let together = Counter::default();
    let slabs = Slabs::new(r.org, r.dir, &grid.bounds);
    grid.walk(
        &slabs,
        r.t_min,
        r.t_max,
        &mut marks,
        Count(Some(&together)),
        &mut |_, _, _, limit| limit,
    );
    let mut alone = 0;
    for i in 0..L::COUNT {
        let lane = |v: Vec3<L>| Vec3::new(v.x.lane(i), v.y.lane(i), v.z.lane(i));
        let slabs = Slabs::<f64>::new(lane(r.org), lane(r.dir), &grid.bounds);
        alone += reached(grid, &slabs, 0, r.t_min.lane(i), r.t_max.lane(i));
    }
    assert_eq!(together.counts().node_lanes, alone);
}

#[test]
fn memory_stays_within_a_multiple_of_the_entries() {
    // Each box nearly fills the bounds, so every cell would list all of them.
    let random = &mut Random(7);
    let of: Vec<Aabb32> = (0..5000)
        .map(|_| Aabb32 {
            min: random.point(0.0, 0.01),
            max: random.point(0.99, 1.0),
        })
        .collect();
    let figures = grid(&of, &Density::flat(8.0)).figures();
    assert!(figures.references <= 16 * of.len() + 64, "{figures:?}");
    let figures = grid(&of, &Density::default()).figures();
    assert!(figures.references <= 17 * 16 * of.len(), "{figures:?}");
}

#[test]
fn cells_are_about_cubes_and_as_many_as_asked_for() {
    let random = &mut Random(11);
    for (extent, res) in [
        ([1.0, 1.0, 1.0], [20, 20, 20]),
        ([4.0, 2.0, 1.0], [40, 20, 10]),
    ] {
        let mut of: Vec<Aabb32> = (0..8000)
            .map(|_| {
                let p = random.point(0.0, 1.0);
                let p = std::array::from_fn(|k| p[k] * extent[k]);
                Aabb32 { min: p, max: p }
            })
            .collect();
        of[0].min = [0.0; 3];
        of[1].max = extent;
        assert_eq!(grid(&of, &Density::flat(1.0)).resolution(), res);
    }
    // Points in a plane: all cells lie in it.
    let of: Vec<Aabb32> = (0..1024)
        .map(|i| {
            let p = [(i % 32) as f32 / 31.0, 3.0, (i / 32) as f32 / 31.0];
            Aabb32 { min: p, max: p }
        })
        .collect();
    assert_eq!(grid(&of, &Density::flat(1.0)).resolution(), [32, 1, 32]);
}

#[test]
fn dense_cells_have_grids_of_their_own() {
    let random = &mut Random(3);
    let mut of: Vec<Aabb32> = (0..2000)
        .map(|_| {
            let p = random.point(0.0, 0.01);
            Aabb32 { min: p, max: p }
        })
        .collect();
    of.push(Aabb32 {
        min: [1.0; 3],
        max: [1.0; 3],
    });
    let two = grid(&of, &Density::default());
    assert_eq!(two.inner_grids(), 1);
    let one = grid(&of, &Density::flat(2.0)).figures();
    assert!(two.figures().sah < one.sah, "{:?} {one:?}", two.figures());
}
