//! Procedural meshes of any size, for growth measurements.
//!
//! The displaced sphere is the mesh of the baseline's figures: a sphere of latitudes
//! and longitudes whose radius is modulated by two products of sines, one coarse and
//! one fine. Elementary functions come from the crate `libm`, so the mesh is the same
//! on every machine.

use lanecast_io::TriangleSet;
use std::f64::consts::{PI, TAU};

/// Returns the (longitudes, latitudes) whose number of triangles is nearest to the
/// requested one. There are twice as many longitudes as latitudes, so that triangles at
/// the equator are half squares.
pub fn sphere_size(triangles: u64) -> (u32, u32) {
    // The sphere has 4·down·(down − 1) triangles.
    let down = 0.5 + (0.25 + triangles as f64 * 0.25).sqrt();
    let down = (down.round() as u32).max(2);
    (2 * down, down)
}

/// Builds a sphere of `2·across·(down − 1)` triangles; each pole is one vertex.
pub fn displaced_sphere(across: u32, down: u32) -> TriangleSet {
    let vertices = across as usize * (down as usize - 1) + 2;
    let mut positions = Vec::with_capacity(vertices);
    positions.push(waved([0.0, 1.0, 0.0]));
    for j in 1..down {
        let (sin, cos) = libm::sincos(PI * f64::from(j) / f64::from(down));
        for i in 0..across {
            let (z, x) = libm::sincos(TAU * f64::from(i) / f64::from(across));
            positions.push(waved([sin * x, cos, sin * z]));
        }
    }
    positions.push(waved([0.0, -1.0, 0.0]));

    let last = positions.len() as u32 - 1;
    let ring = |j: u32, i: u32| 1 + (j - 1) * across + i % across;
    let mut triangles = Vec::with_capacity(2 * across as usize * (down as usize - 1));
    triangles.extend((0..across).map(|i| [0, ring(1, i + 1), ring(1, i)]));
    // The baseline's order: in each ring the upper triangles, then the lower ones.
    for j in 1..down - 1 {
        let upper = |i| [ring(j, i), ring(j, i + 1), ring(j + 1, i)];
        let lower = |i| [ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)];
        triangles.extend((0..across).map(upper));
        triangles.extend((0..across).map(lower));
    }
    triangles.extend((0..across).map(|i| [last, ring(down - 1, i), ring(down - 1, i + 1)]));
    TriangleSet {
        positions,
        triangles,
    }
}

fn waved(p: [f64; 3]) -> [f32; 3] {
    let sin = libm::sin;
    let [x, y, z] = p;
    let coarse = sin(9.0 * x + 1.0) * sin(8.0 * y) * sin(10.0 * z + 2.0);
    let fine = sin(31.0 * x) * sin(29.0 * y + 1.0) * sin(33.0 * z);
    let radius = 1.0 + 0.05 * coarse + 0.02 * fine;
    p.map(|x| (x * radius) as f32)
}

/// A kind of procedural mesh, of approximately the requested number of triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Generated {
    #[default]
    Sphere,
    Needles,
    Building,
}

impl Generated {
    pub const ALL: [Generated; 3] = [Generated::Sphere, Generated::Needles, Generated::Building];

    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Generated::Sphere => "sphere",
            Generated::Needles => "needles",
            Generated::Building => "building",
        }
    }

    /// Returns the title for readers.
    pub fn title(self) -> &'static str {
        match self {
            Generated::Sphere => "displaced sphere",
            Generated::Needles => "needles in all directions",
            Generated::Building => "building with blinds",
        }
    }

    pub fn mesh(self, triangles: u64) -> TriangleSet {
        match self {
            Generated::Sphere => {
                let (across, down) = sphere_size(triangles);
                displaced_sphere(across, down)
            }
            Generated::Needles => needles(triangles),
            Generated::Building => building(triangles),
        }
    }
}

/// Builds triangles half a unit long and 1/500 wide, in all directions, around points
/// of a cube of side 1.6: the worst case for axis-aligned boxes.
pub fn needles(triangles: u64) -> TriangleSet {
    let mut next = numbers();
    let mut set = TriangleSet::default();
    for i in 0..triangles as u32 {
        let middle: [f64; 3] = std::array::from_fn(|_| 1.6 * next() - 0.8);
        let (sin, cos) = libm::sincos(TAU * next());
        let y = 2.0 * next() - 1.0;
        let r = libm::sqrt(1.0 - y * y);
        let along = [r * cos, y, r * sin].map(|x| 0.25 * x);
        let side: [f64; 3] = std::array::from_fn(|_| 0.002 * (next() - 0.5));
        let tip = |sign: f64| std::array::from_fn(|k| (middle[k] + sign * along[k]) as f32);
        let other = std::array::from_fn(|k| (middle[k] + along[k] + side[k]) as f32);
        set.positions.extend([tip(-1.0), tip(1.0), other]);
        set.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    set
}

const STOREYS: u32 = 4;
const BAYS: [u32; 2] = [5, 3];

/// Builds a building that is open to the front and rotated by 30 degrees: slabs and
/// walls of few large triangles, tables on thin legs, a finely tessellated ball on
/// each, and blinds of long thin slats. Balls and slats share the remaining triangles.
pub fn building(triangles: u64) -> TriangleSet {
    let rooms = u64::from(STOREYS * BAYS[0] * BAYS[1]);
    let each = (triangles / rooms).saturating_sub(84);
    let slats = (each / 2 / 12).max(1) as u32;
    let (across, down) = sphere_size(each / 2);
    let ball = displaced_sphere(across, down);
    let mut set = TriangleSet::default();
    for storey in 0..STOREYS {
        let y = f64::from(storey);
        let [width, depth] = BAYS.map(f64::from);
        add_box(&mut set, [0.0, y - 0.04, 0.0], [width, y + 0.04, depth]);
        for x in 0..BAYS[0] {
            for z in 0..BAYS[1] {
                let (x, z) = (f64::from(x), f64::from(z));
                // A wall on the left, and one at the back with a door.
                add_box(&mut set, [x, y, z], [x + 0.03, y + 1.0, z + 1.0]);
                add_box(&mut set, [x, y, z], [x + 0.5, y + 1.0, z + 0.03]);
                for leg in 0..4 {
                    let (i, j) = (f64::from(leg % 2), f64::from(leg / 2));
                    let (a, b) = (x + 0.25 + 0.48 * i, z + 0.35 + 0.28 * j);
                    add_box(&mut set, [a, y, b], [a + 0.02, y + 0.3, b + 0.02]);
                }
                add_box(
                    &mut set,
                    [x + 0.22, y + 0.3, z + 0.32],
                    [x + 0.78, y + 0.33, z + 0.68],
                );
                for slat in 0..slats {
                    let h = y + 0.5 + 0.45 * f64::from(slat) / f64::from(slats);
                    let thick = 0.1 / f64::from(slats);
                    add_box(
                        &mut set,
                        [x + 0.05, h, z + 0.96],
                        [x + 0.97, h + thick, z + 0.98],
                    );
                }
                let base = set.positions.len() as u32;
                let place = [x + 0.5, y + 0.46, z + 0.5];
                let vertex = |p: &[f32; 3]| -> [f32; 3] {
                    std::array::from_fn(|k| (place[k] + 0.12 * f64::from(p[k])) as f32)
                };
                set.positions.extend(ball.positions.iter().map(vertex));
                let moved = ball.triangles.iter().map(|t| t.map(|v| v + base));
                set.triangles.extend(moved);
            }
        }
    }
    let (sin, cos) = libm::sincos(PI / 6.0);
    for p in &mut set.positions {
        let [x, y, z] = p.map(f64::from);
        let (x, y, z) = (x - 2.5, y - 2.0, z - 1.5);
        *p = [cos * x + sin * z, y, cos * z - sin * x].map(|c| (0.3 * c) as f32);
    }
    set
}

/// Adds a box of twelve triangles.
fn add_box(set: &mut TriangleSet, min: [f64; 3], max: [f64; 3]) {
    let base = set.positions.len() as u32;
    let corner =
        |i: usize| std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] } as f32);
    set.positions.extend((0..8).map(corner));
    for k in 0..3 {
        let (u, v) = (1 << ((k + 1) % 3), 1 << ((k + 2) % 3));
        for side in [0, 1 << k] {
            let quad = [side, side + u, side + u + v, side + v].map(|i: u32| base + i);
            let [a, b, c, d] = quad;
            set.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// Returns a generator of numbers in [0, 1), with a fixed seed.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn sizes_are_near_what_is_asked_for() {
        for asked in [1000, 10_000, 1_000_000, 10_000_000] {
            let (across, down) = sphere_size(asked);
            let made = 2 * u64::from(across) * u64::from(down - 1);
            assert!(made.abs_diff(asked) as f64 <= 0.04 * asked as f64, "{made}");
        }
        assert_eq!(sphere_size(0), (4, 2));
        // The baseline's mesh.
        assert_eq!(sphere_size(1_046_528), (1024, 512));
    }

    #[test]
    fn closed_and_the_size_of_a_sphere() {
        let (across, down) = sphere_size(5000);
        let set = displaced_sphere(across, down);
        assert_eq!(set.triangles.len() as u32, 2 * across * (down - 1));
        // Every edge occurs once in each direction.
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for t in &set.triangles {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]];
                assert_ne!(a, b);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert_eq!(edges.len() * 2, set.triangles.len() * 3);
        assert!(edges.values().all(|sum| *sum == 0));
        for p in &set.positions {
            let radius = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((0.93..1.07).contains(&radius), "{radius}");
        }
    }

    /// The mesh that the baseline's generator writes: its size, some vertices, and the
    /// order of its triangles.
    #[test]
    fn the_peers_mesh() {
        let set = displaced_sphere(1024, 512);
        assert_eq!(set.positions.len(), 523_266);
        assert_eq!(set.triangles.len(), 1_046_528);
        for (row, position) in [
            (0, [0.0, 1.037_850_3, 0.0]),
            (123_456, [-0.630_291_5, 0.741_626_1, -0.256_555_77]),
            (400_000, [-0.480_150_64, -0.735_524_5, -0.474_294_16]),
        ] {
            for (own, peer) in set.positions[row].iter().zip(position) {
                let difference: f32 = own - peer;
                assert!(difference.abs() < 1e-6, "{row}");
            }
        }
        assert_eq!(set.triangles[1024], [1, 2, 1025]);
        assert_eq!(set.triangles[500_000], [249_122, 250_146, 250_145]);
        assert_eq!(set.triangles.last(), Some(&[523_265, 523_264, 522_241]));
    }
}
