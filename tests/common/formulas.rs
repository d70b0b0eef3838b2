//! Formulas of level sets that are no polynomials, with a given size and centre.

use glam::DVec3;
use lanecast::internals::geom::formula::{Binary, Builder, Formula, Unary};

/// Coordinates less those of a place, times a factor.
fn about(b: &mut Builder, center: DVec3, factor: f64) -> [u32; 3] {
    [0, 1, 2].map(|axis| {
        let x = b.coordinate(axis as u8);
        let from = b.constant(center[axis]);
        let off = b.binary(Binary::Difference, x, from);
        let factor = b.constant(factor);
        b.binary(Binary::Product, factor, off)
    })
}

fn squares(b: &mut Builder, of: &[u32]) -> u32 {
    let zero = b.constant(0.0);
    of.iter().fold(zero, |sum, x| {
        let square = b.power(*x, 2);
        b.binary(Binary::Sum, sum, square)
    })
}

/// √(x² + y² + z²) − 1.
pub fn unit_ball() -> Formula {
    let mut b = Builder::default();
    let axes = about(&mut b, DVec3::ZERO, 1.0);
    let sum = squares(&mut b, &axes);
    let (root, one) = (b.unary(Unary::Sqrt, sum), b.constant(1.0));
    let last = b.binary(Binary::Difference, root, one);
    b.finish(last)
}

/// (√(x² + z²) − 1)² + y² − r².
pub fn ring(minor: f64) -> Formula {
    let mut b = Builder::default();
    let [x, y, z] = about(&mut b, DVec3::ZERO, 1.0);
    let sum = squares(&mut b, &[x, z]);
    let (root, one) = (b.unary(Unary::Sqrt, sum), b.constant(1.0));
    let off = b.binary(Binary::Difference, root, one);
    let sum = squares(&mut b, &[off, y]);
    let minor = b.constant(minor * minor);
    let last = b.binary(Binary::Difference, sum, minor);
    b.finish(last)
}

/// sin x cos y + sin y cos z + sin z cos x, of coordinates about a place and times a factor.
pub fn gyroid(center: DVec3, factor: f64) -> Formula {
    let mut b = Builder::default();
    let axes = about(&mut b, center, factor);
    let mut sum = b.constant(0.0);
    for k in 0..3 {
        let (sine, cosine) = (
            b.unary(Unary::Sin, axes[k]),
            b.unary(Unary::Cos, axes[(k + 1) % 3]),
        );
        let product = b.binary(Binary::Product, sine, cosine);
        sum = b.binary(Binary::Sum, sum, product);
    }
    b.finish(sum)
}
