//! Tests of every comparison structure: traversals give the bits of a linear scan, on
//! degenerate boxes and rays among others.
//!
//! An entry is hit at some t of its box's interval that depends only on the entry and the
//! ray, as with primitives. So no geometry is needed.

use super::bvh4_build::{Bvh4Quality, build};
use super::count::{Count, Counter};
use super::grid::{Density, Grid};
use super::heap::Heap;
use super::index::{Index, Primitives};
use crate::accel::slabs::Slabs;
use crate::math::lanes::{Lanes, Mask, Scalar, f32x8, f32x16};
use crate::math::{Aabb32, Vec3};
use proptest::prelude::*;

/// The generator SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Returns a number in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    pub fn point(&mut self, from: f32, to: f32) -> [f32; 3] {
        std::array::from_fn(|_| from + (to - from) * self.unit())
    }
}

/// Makes boxes of a random kind; some kinds are degenerate.
pub fn boxes(random: &mut Random) -> Vec<Aabb32> {
    let kind = random.below(12);
    let n = match kind {
        0 => random.below(2),
        _ => 1 + random.below(150),
    };
    let scale = [1e-20, 1e-3, 1.0, 1.0, 1.0, 1e4, 1e15][random.below(7)];
    let off = [0.0, 0.0, 1.0, 1e3, 1e7][random.below(5)];
    let size = [0.0, 0.01, 0.1, 0.5][random.below(4)];
    let axis = random.below(3);
    let mut boxes: Vec<Aabb32> = (0..n)
        .map(|i| {
            let mut min = random.point(0.0, 1.0);
            let mut max = random.point(0.0, size);
            for k in 0..3 {
                max[k] += min[k];
            }
            match kind {
                // Flat, all in one plane.
                1 => (min[axis], max[axis]) = (0.5, 0.5),
                // On a line.
                2 => {
                    for k in (0..3).filter(|k| *k != axis) {
                        (min[k], max[k]) = (0.25, 0.25);
                    }
                }
                // Nested.
                3 => {
                    let r = i as f32 / 150.0 + 0.01;
                    (min, max) = ([-r; 3], [r; 3]);
                }
                // On a lattice: faces in the planes of cells.
                4 => {
                    for k in 0..3 {
                        min[k] = (min[k] * 4.0).floor() * 0.25;
                        max[k] = min[k] + 0.25;
                    }
                }
                // A dense cluster in a wide space.
                5 => {
                    for k in 0..3 {
                        min[k] *= 0.01;
                        max[k] *= 0.01;
                    }
                }
                // Each flat along an axis of its own.
                6 => max[i % 3] = min[i % 3],
                _ => {}
            }
            Aabb32 { min, max }
        })
        .collect();
    match kind {
        // Identical.
        7 => {
            let first = boxes[0];
            boxes.fill(first);
        }
        // One that holds all others, and one far away.
        5 | 8 => {
            boxes[0].min = [-1.0; 3];
            boxes[0].max = [2.0; 3];
            let last = boxes.len() - 1;
            boxes[last].min = [9.0; 3];
            boxes[last].max = [9.5; 3];
        }
        // One without bounds.
        9 if random.below(4) == 0 => boxes[0] = Aabb32::EVERYTHING,
        _ => {}
    }
    for b in &mut boxes {
        let place = |x: f32| (x + off) * scale;
        *b = Aabb32 {
            min: b.min.map(place),
            max: b.max.map(place),
        };
    }
    boxes
}

/// A packet of rays, one in each lane.
pub struct Rays<L> {
    pub org: Vec3<L>,
    pub dir: Vec3<L>,
    pub t_min: L,
    pub t_max: L,
}

/// Makes a packet of coherent or incoherent rays that start inside, outside or far away. Some
/// directions have zeros or denormal numbers, and some lanes are inactive.
pub fn rays<L: Lanes>(random: &mut Random, boxes: &[Aabb32]) -> Rays<L> {
    let all = boxes.iter().fold(Aabb32::EMPTY, |all, b| all.union(b));
    let finite = all.min.iter().chain(&all.max).all(|x| x.is_finite());
    let (min, max) = if finite {
        (all.min, all.max)
    } else {
        ([-1.0; 3], [2.0; 3])
    };
    let extent = (0..3).map(|k| max[k] - min[k]).fold(1e-22, f32::max);
    let away = [0.0, 1.0, 1.0, 3.0, 100.0, 1e6][random.below(6)];
    let spread = [0.0, 0.01, 0.1, 1.0][random.below(4)];
    let within = |r: &mut Random, spread: f32| -> [f32; 3] {
        std::array::from_fn(|k| min[k] + extent * (r.unit() - 0.5) * spread)
    };
    let (eye, target) = (within(random, 2.0 * away + 1.0), within(random, 2.0));
    let special = random.below(6);
    let mut columns = [[L::zero(); 2]; 4];
    let mut set = |row: usize, column: usize, lane: usize, x: f32| {
        let place: &mut L = &mut columns[row][column];
        *place = place.with_lane(lane, L::Scalar::from_f32(x));
    };
    for lane in 0..L::COUNT {
        let mut org = eye;
        let mut to = within(random, spread);
        for k in 0..3 {
            to[k] = to[k] - min[k] + target[k];
            if special == 5 {
                org[k] += extent * (random.unit() - 0.5);
            }
        }
        let mut dir: [f32; 3] = std::array::from_fn(|k| to[k] - org[k]);
        match special {
            0 => {
                // Parallel to an axis, from a corner of some box.
                let axis = random.below(3);
                let way = if random.below(2) == 0 { 1.0 } else { -1.0 };
                dir = std::array::from_fn(|k| if k == axis { way } else { 0.0 });
                if let Some(b) = boxes.get(random.below(boxes.len().max(1))) {
                    org = if random.below(2) == 0 { b.min } else { b.max };
                    org = org.map(|x| if x.is_finite() { x } else { 0.5 });
                    org[axis] -= way * extent * away;
                }
            }
            1 => {
                dir[random.below(3)] = 0.0;
                dir[random.below(3)] *= 1e-38;
            }
            2 => {
                // Through a corner, where planes of cells cross.
                if let Some(b) = boxes.get(random.below(boxes.len().max(1)))
                    && b.min.iter().all(|x| x.is_finite())
                {
                    dir = std::array::from_fn(|k| b.min[k] - org[k]);
                }
            }
            _ => {}
        }
        if dir == [0.0; 3] {
            dir[1] = 1.0;
        }
        for k in 0..3 {
            set(k, 0, lane, org[k]);
            set(k, 1, lane, dir[k]);
        }
        set(3, 0, lane, if random.below(3) == 0 { 0.3 } else { 0.0 });
        set(
            3,
            1,
            lane,
            match random.below(12) {
                0 => -f32::INFINITY,
                1 => 0.9,
                2 => 1.0,
                _ => f32::INFINITY,
            },
        );
    }
    let [x, y, z, t] = columns;
    Rays {
        org: Vec3::new(x[0], y[0], z[0]),
        dir: Vec3::new(x[1], y[1], z[1]),
        t_min: t[0],
        t_max: t[1],
    }
}

/// Returns the lanes that hit an entry, and the t of the hits, some way into its box.
fn hit<L: Lanes>(slabs: &Slabs<L>, of: &Aabb32, id: u32, t_min: L, limit: L) -> (L::Mask, L) {
    let (enter, exit) = slabs.interval(of.min, of.max);
    let share = Random(u64::from(id)).unit();
    let t = enter + (exit - enter) * L::from_f32(if share < 0.3 { 0.0 } else { share });
    let t = t.max(enter).min(exit);
    (enter.le(exit) & t.gt(t_min) & t.le(limit), t)
}

/// Returns the final limits and the ids of the nearest hits; ties go to the lower id.
fn nearest<L: Lanes>(
    rays: &Rays<L>,
    bounds: &Aabb32,
    walk: impl FnOnce(&Slabs<L>, &mut dyn FnMut(u32, L::Mask, L) -> L) -> L,
    of: &[Aabb32],
) -> (Vec<u64>, Vec<u32>) {
    let slabs = Slabs::new(rays.org, rays.dir, bounds);
    let mut ids = vec![u32::MAX; L::COUNT];
    let mut visited = vec![false; of.len()];
    let limit = walk(&slabs, &mut |id, active, limit| {
        assert!(!visited[id as usize], "{id} is tested twice");
        visited[id as usize] = true;
        let (met, t) = hit(&slabs, &of[id as usize], id, rays.t_min, limit);
        let met = met & active;
        for lane in 0..L::COUNT {
            if met.bits() >> lane & 1 != 0 && (t.lane(lane) < limit.lane(lane) || id < ids[lane]) {
                ids[lane] = id;
            }
        }
        L::select(met, t, limit)
    });
    let limits = (0..L::COUNT).map(|i| limit.lane(i).bits()).collect();
    (limits, ids)
}

/// Asserts that a traversal gives the bits of the linear scan.
fn same_as_linear<L: Lanes, A: Index>(
    name: &str,
    (index, order): &(A, Vec<u32>),
    scratch: &mut A::Scratch<L>,
    of: &[Aabb32],
    rays: &Rays<L>,
    expected: &(Vec<u64>, Vec<u32>),
) {
    let counter = Counter::default();
    let got = nearest(
        rays,
        &index.bounds(),
        |slabs, test| {
            let (t_min, t_max) = (rays.t_min, rays.t_max);
            index.walk(
                slabs,
                t_min,
                t_max,
                scratch,
                Count(Some(&counter)),
                &mut |first, count, active, limit| {
                    (first..first + count).fold(limit, |limit, i| test(order[i], active, limit))
                },
            )
        },
        of,
    );
    assert_eq!(&got, expected, "{name} at {} lanes", L::COUNT);
}

/// Compares all structures over the same boxes, with packets of one width.
fn all_same<L: Lanes>(seed: u64) {
    let random = &mut Random(seed);
    let of = boxes(random);
    let primitives = Primitives {
        boxes: &of,
        corners: None,
    };
    let quality = Bvh4Quality {
        max_leaf: 1 + random.below(4),
        ..Bvh4Quality::default()
    };
    let flat = Density::flat([0.1, 1.0, 8.0, 100.0][random.below(4)]);
    let deep = Density {
        cells: [0.1, 0.5, 2.0][random.below(3)],
        dense: 2 + random.below(6),
        inner: [1.0, 3.0, 20.0][random.below(3)],
    };
    let bvh = build(&of, &quality);
    let boxes = Heap::of_boxes(&primitives, &quality);
    let spheres = Heap::of_spheres(&primitives, &quality);
    let flat = Grid::build(&primitives, &flat);
    let mut deep = Grid::build(&primitives, &deep);
    deep.0
        .group(&mut deep.1, &|i| ((i % 3) as u8, u64::from(i)));
    let mut scratch = Default::default();
    let mut queues = Default::default();
    let mut marks = Default::default();
    for _ in 0..8 {
        let rays = rays::<L>(random, &of);
        let expected = nearest(
            &rays,
            &primitives.bounds(),
            |_, test| {
                let active = rays.t_min.le(rays.t_max);
                (0..of.len() as u32).fold(rays.t_max, |limit, i| test(i, active, limit))
            },
            &of,
        );
        same_as_linear("bvh", &bvh, &mut scratch, &of, &rays, &expected);
        same_as_linear("heap", &boxes, &mut queues, &of, &rays, &expected);
        same_as_linear(
            "heap of spheres",
            &spheres,
            &mut queues,
            &of,
            &rays,
            &expected,
        );
        same_as_linear("grid", &flat, &mut marks, &of, &rays, &expected);
        same_as_linear("grid of grids", &deep, &mut marks, &of, &rays, &expected);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3_000))]

    #[test]
    fn one_lane(seed in any::<u64>()) {
        all_same::<f32>(seed);
    }

    #[test]
    fn packets(seed in any::<u64>()) {
        all_same::<f32x8>(seed);
        all_same::<f32x16>(seed);
    }
}
