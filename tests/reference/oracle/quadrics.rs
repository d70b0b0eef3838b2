//! Quadrics, and their hits worked out by hand.

use super::*;

/// x² + y² − z² ≤ 1.
pub fn hyperboloid(b: &mut SceneBuilder) -> ShapeId {
    let coefficients = [1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    b.quadric("", Quadric { coefficients })
}

#[test]
fn quadric_hits_and_normals() {
    let x = [1.0, 0.0, 0.0];
    expect(hyperboloid, [-5.0, 0.0, 0.0], x, 4.0, [-1.0, 0.0, 0.0]);
    // From within, to the outside; up the axis there is none.
    expect(hyperboloid, [0.0; 3], [0.5, 0.0, 0.0], 2.0, x);
    expect_miss(hyperboloid, [0.0; 3], [0.0, 0.0, 1.0]);
    // x = 1.5, z from below: 2.25 − 1 = z², out of it and in again.
    let z = 1.25_f64.sqrt();
    let n = v(1.5, 0.0, z).normalize().to_array();
    expect(hyperboloid, [1.5, 0.0, -8.0], [0.0, 0.0, 1.0], 8.0 - z, n);
    let n = v(1.5, 0.0, -z).normalize().to_array();
    expect(hyperboloid, [1.5, 0.0, 0.0], [0.0, 0.0, 2.0], z / 2.0, n);
    // At its waist that is a tangent from within: nothing begins or ends there.
    expect_miss(hyperboloid, [1.0, 0.0, -8.0], [0.0, 0.0, 1.0]);
    expect_at(hyperboloid, [1.0, -3.0, 0.0], [0.0, 1.0, 0.0], 3.0);
    // Along a line that lies in it, likewise; beside it there is one boundary.
    expect_miss(hyperboloid, [1.0, -3.0, -3.0], [0.0, 1.0, 1.0]);
    expect_at(hyperboloid, [2.0, -3.0, -2.0], [0.0, 1.0, 1.0], 4.0);
    // z ≤ x y.
    let saddle = |b: &mut SceneBuilder| {
        let coefficients = [0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        b.quadric("", Quadric { coefficients })
    };
    expect_at(saddle, [0.5, 3.0, 9.0], [0.0, 0.0, -1.0], 7.5);
    expect_at(saddle, [0.5, 3.0, -1.0], [0.0, 0.0, 1.0], 2.5);
    expect_at(saddle, [0.5, 3.0, 0.5], [0.0, -1.0, 0.0], 2.0);
    // x² ≤ 0: a plane as thin as nothing is met, and its opposite is everything.
    let thin = |sign: f64| {
        move |b: &mut SceneBuilder| {
            let coefficients = [sign, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            b.quadric("", Quadric { coefficients })
        }
    };
    expect_at(thin(1.0), [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0], 2.0);
    expect_miss(thin(-1.0), [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0]);
}
