//! Tapes of well-known polynomial surfaces, with a given size and centre.
//!
//! Every length is a constant of its own, or a power of it, and no other constant is a
//! length. So a tape for lengths times 2^k has the values of the first times a power of 2^k,
//! to the bit.

use glam::DVec3;
use lanecast::internals::geom::Tape;
use lanecast::internals::geom::tape::Builder;

/// Coordinates less those of a place.
fn about(b: &mut Builder, center: DVec3) -> [u32; 3] {
    [0, 1, 2].map(|axis| {
        let x = b.coordinate(axis as u8);
        let from = b.constant(center[axis]);
        b.difference(x, from)
    })
}

fn sum(b: &mut Builder, of: &[u32]) -> u32 {
    let zero = b.constant(0.0);
    of.iter().fold(zero, |sum, step| b.sum(sum, *step))
}

fn times(b: &mut Builder, factor: f64, of: u32) -> u32 {
    let factor = b.constant(factor);
    b.product(factor, of)
}

/// x² + y² + z² − r².
pub fn ball(center: DVec3, radius: f64) -> Tape {
    let b = &mut Builder::default();
    let squares = about(b, center).map(|x| b.power(x, 2));
    let all = sum(b, &squares);
    let radius = b.constant(radius);
    let radius = b.power(radius, 2);
    let last = b.difference(all, radius);
    std::mem::take(b).finish(last)
}

/// About the y-axis: (x² + y² + z² + R² − r²)² − 4 R² (x² + z²).
pub fn torus(center: DVec3, [major, minor]: [f64; 2]) -> Tape {
    let b = &mut Builder::default();
    let [x, y, z] = about(b, center).map(|x| b.power(x, 2));
    let [major, minor] = [major, minor].map(|radius| {
        let radius = b.constant(radius);
        b.power(radius, 2)
    });
    let all = sum(b, &[x, y, z, major]);
    let all = b.difference(all, minor);
    let square = b.power(all, 2);
    let ring = sum(b, &[x, z]);
    let ring = b.product(major, ring);
    let ring = times(b, 4.0, ring);
    let last = b.difference(square, ring);
    std::mem::take(b).finish(last)
}

/// x⁴ + z⁴ − y⁴ − r⁴: a throat about the y-axis that opens both ways without end.
pub fn throat(center: DVec3, radius: f64) -> Tape {
    let b = &mut Builder::default();
    let [x, y, z] = about(b, center).map(|x| b.power(x, 4));
    let radius = b.constant(radius);
    let radius = b.power(radius, 4);
    let across = sum(b, &[x, z]);
    let along = sum(b, &[y, radius]);
    let last = b.difference(across, along);
    std::mem::take(b).finish(last)
}

/// Clebsch's diagonal cubic, with all of its lines within two lengths of the middle:
/// 81 Σx³ − 189 Σx²y + 54 xyz + 126 Σxy − 9 Σx² − 9 Σx + 1.
pub fn clebsch(center: DVec3, length: f64) -> Tape {
    let b = &mut Builder::default();
    let xyz = about(b, center);
    let [x, y, z] = xyz;
    let one = b.constant(length);
    let [squares, cubes] = [2, 3].map(|n| xyz.map(|x| b.power(x, n)));
    let [xx, yy, zz] = squares;
    let pairs = [(xx, y), (xx, z), (yy, x), (yy, z), (zz, x), (zz, y)];
    let mixed = pairs.map(|(p, q)| b.product(p, q));
    let products = [(x, y), (x, z), (y, z)].map(|(p, q)| b.product(p, q));
    let xyz_at_once = b.product(products[0], z);
    // Of one degree each; what is of less than three is filled up with lengths.
    let cubic = [
        (81.0, sum(b, &cubes)),
        (-189.0, sum(b, &mixed)),
        (54.0, xyz_at_once),
    ];
    let quadratic = [(126.0, sum(b, &products)), (-9.0, sum(b, &squares))];
    let linear = [(-9.0, sum(b, &xyz))];
    let terms = |b: &mut Builder, terms: &[(f64, u32)]| {
        let terms: Vec<u32> = terms.iter().map(|(c, of)| times(b, *c, *of)).collect();
        sum(b, &terms)
    };
    // ((1 s + linear) s + quadratic) s + cubic.
    let parts = [terms(b, &linear), terms(b, &quadratic), terms(b, &cubic)];
    let last = parts.into_iter().fold(one, |all, part| {
        // The first of these is s itself.
        let all = if all == one { one } else { b.product(all, one) };
        b.sum(all, part)
    });
    std::mem::take(b).finish(last)
}

/// Barth's sextic; its 65 double points lie within 2.2 lengths of the middle:
/// 4 (φ²x² − y²)(φ²y² − z²)(φ²z² − x²) − (1 + 2φ) s² (x² + y² + z² − s²)².
pub fn barth_sextic(center: DVec3, length: f64) -> Tape {
    let b = &mut Builder::default();
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let [x, y, z] = about(b, center).map(|x| b.power(x, 2));
    let one = b.constant(length);
    let one = b.power(one, 2);
    let cones = [(x, y), (y, z), (z, x)].map(|(p, q)| {
        let wide = times(b, golden * golden, p);
        b.difference(wide, q)
    });
    let cones = cones[1..]
        .iter()
        .fold(cones[0], |all, cone| b.product(all, *cone));
    let cones = times(b, 4.0, cones);
    let all = sum(b, &[x, y, z]);
    let ball = b.difference(all, one);
    let ball = b.power(ball, 2);
    let ball = b.product(ball, one);
    let ball = times(b, 1.0 + 2.0 * golden, ball);
    let last = b.difference(cones, ball);
    std::mem::take(b).finish(last)
}
