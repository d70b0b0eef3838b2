//! Rays and triangles, most of them chosen so that exact decisions are hard.

use super::{Pair, Random};

/// Sorts of cases, see [`case`].
pub const SORTS: usize = 9;
/// Rays in the triangle's plane.
pub const PLANE: usize = 4;

/// The numbers where formats begin and end, and others of any size.
fn extreme(random: &mut Random) -> f64 {
    match random.below(3) {
        0 => random.end_of_format([1e-40, 1e17]),
        1 => random.unit(),
        _ => random.any_finite(),
    }
}

fn extreme_f32(random: &mut Random) -> f32 {
    const ENDS: [f32; 10] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-45,
        -1e-45,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::MIN,
        1e-30,
    ];
    match random.below(3) {
        0 => ENDS[random.below(ENDS.len() as u64) as usize],
        1 => random.unit() as f32,
        _ => Some(f32::from_bits(random.bits() as u32))
            .filter(|x| x.is_finite())
            .unwrap_or(1.5),
    }
}

/// A multiple of 2^−bits in [−1, 1).
fn short(random: &mut Random, bits: u32) -> f64 {
    let steps = 1_u64 << bits;
    random.below(2 * steps) as f64 / steps as f64 - 1.0
}

/// 2^k, |k| ≤ most.
fn power(random: &mut Random, most: i32) -> f64 {
    2.0_f64.powi(random.below(2 * most as u64 + 1) as i32 - most)
}

/// Corners with few bits, sometimes so that they are near a needle, a line or
/// a point.
fn triangle(random: &mut Random, bits: u32) -> [[f32; 3]; 3] {
    let mut corner = || std::array::from_fn(|_| short(random, bits) as f32);
    let mut corners: [[f32; 3]; 3] = [corner(), corner(), corner()];
    let [a, b, _] = corners;
    match random.below(12) {
        // Needles: one unit in the last place wide.
        0 => corners[2] = a.map(|x| if x == 0.0 { x } else { x.next_up() }),
        1 => corners[2] = std::array::from_fn(|k| 0.5 * (a[k] + b[k]).next_up()),
        // No area.
        2 => corners[2] = std::array::from_fn(|k| 0.5 * (a[k] + b[k])),
        3 => corners[1] = a,
        4 => corners = [a; 3],
        _ => {}
    }
    corners
}

/// A ray whose line goes through a point, as far as f64 can: exactly, where
/// the point and the direction have few bits.
fn aimed(random: &mut Random, point: [f64; 3], corners: [[f32; 3]; 3]) -> Pair {
    let bits = 1 + random.below(23) as u32;
    let mut dir: [f64; 3] = std::array::from_fn(|_| short(random, bits));
    if random.below(4) == 0 {
        dir[random.below(3) as usize] = 0.0;
    }
    let t = power(random, 6) * if random.below(8) == 0 { -1.0 } else { 1.0 };
    Pair {
        org: std::array::from_fn(|k| point[k] - t * dir[k]),
        dir,
        corners,
    }
}

/// Points on the triangle's border: a corner, or somewhere on an edge.
fn border(random: &mut Random, corners: &[[f32; 3]; 3]) -> [f64; 3] {
    let i = random.below(3) as usize;
    let [a, b] = [corners[i], corners[(i + 1) % 3]].map(|p| p.map(f64::from));
    let part = match random.below(3) {
        0 => 0.0,
        1 => 0.5,
        _ => short(random, 6).abs(),
    };
    std::array::from_fn(|k| a[k] + part * (b[k] - a[k]))
}

/// One case of a sort, below [`SORTS`].
pub fn case(random: &mut Random, sort: usize) -> Pair {
    let bits = 2 + random.below(22) as u32;
    let corners = triangle(random, bits);
    match sort {
        // From anywhere at a point near the triangle.
        0 => {
            let org: [f64; 3] = std::array::from_fn(|_| 3.0 * random.unit());
            let [a, b, c] = corners.map(|p| p.map(f64::from));
            let (u, v) = (random.unit().abs(), random.unit().abs());
            let at = |k: usize| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
            let dir = std::array::from_fn(|k| at(k) - org[k]);
            Pair { org, dir, corners }
        }
        // At corners and edges, at once and by f64 origins off a little.
        1 => {
            let point = border(random, &corners);
            aimed(random, point, corners)
        }
        2 => {
            let point = border(random, &corners);
            let mut case = aimed(random, point, corners);
            let off: [f64; 3] = std::array::from_fn(|_| random.unit() * 1e-16);
            case.org = std::array::from_fn(|k| case.org[k] * (1.0 + off[k]));
            case
        }
        // A nudge of one unit in the last place from a border.
        3 => {
            let point = border(random, &corners);
            let mut case = aimed(random, point, corners);
            let k = random.below(3) as usize;
            match random.below(4) {
                0 => case.org[k] = case.org[k].next_up(),
                1 => case.org[k] = case.org[k].next_down(),
                2 => case.dir[k] = case.dir[k].next_up(),
                _ => case.corners[k][random.below(3) as usize] += f32::EPSILON,
            }
            case
        }
        PLANE => {
            let [a, b, c] = corners.map(|p| p.map(f64::from));
            let mut at = |from: [f64; 3]| -> [f64; 3] {
                let (u, v) = (short(random, 3), short(random, 3));
                std::array::from_fn(|k| from[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
            };
            let (org, dir) = (at(a), at([0.0; 3]));
            Pair { org, dir, corners }
        }
        // From a border along an edge, or just off it, to another border.
        5 => {
            let mut org = border(random, &corners);
            let mut to = border(random, &corners);
            let k = random.below(3) as usize;
            match random.below(4) {
                0 => to[k] += 0.5,
                1 => {}
                _ => org[k] += power(random, 20) * 1e-6,
            }
            let dir = std::array::from_fn(|k| to[k] - org[k]);
            Pair { org, dir, corners }
        }
        // Small and far away, or huge: the ray and the mesh at scales of 2^k.
        6 => {
            let point = border(random, &corners);
            let mut case = aimed(random, point, corners);
            let (by, stretch) = (power(random, 100), power(random, 800));
            case.org = case.org.map(|x| x * by);
            case.dir = case.dir.map(|x| x * stretch);
            case.corners = case.corners.map(|c| c.map(|x| x * by as f32));
            case
        }
        // Vectors with noise, directions with noise: wide spreads.
        7 => {
            let point = border(random, &corners);
            let mut case = aimed(random, point, corners);
            let noise = power(random, 120);
            let k = random.below(3) as usize;
            match random.below(3) {
                0 => case.org[k] = random.unit() * noise,
                1 => case.dir[k] = random.unit() * noise,
                _ => case.corners[0][k] = (random.unit() * noise) as f32,
            }
            case
        }
        // No regard to anything.
        _ => {
            let mut case = Pair {
                org: [0.0; 3],
                dir: [0.0; 3],
                corners,
            };
            case.org = case.org.map(|_| extreme(random));
            case.dir = case.dir.map(|_| extreme(random));
            if random.below(2) == 0 {
                case.corners = corners.map(|c| c.map(|_| extreme_f32(random)));
            }
            case
        }
    }
}
