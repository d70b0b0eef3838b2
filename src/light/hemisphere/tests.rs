use super::super::sampling::cosine_hemisphere;
use super::*;

/// Makes sights of a scene by its light and distance in a direction.
fn sights(side: usize, see: impl Fn(DVec3) -> (f64, f64)) -> Vec<Sight> {
    let cell = |i: usize| {
        let u = [i % side, i / side].map(|k| (k as f32 + 0.5) / side as f32);
        let local = cosine_hemisphere::<f32>(u);
        let toward = DVec3::new(local.x.into(), local.y.into(), local.z.into()).normalize();
        let (light, distance) = see(toward);
        Sight {
            toward,
            distance,
            light: [light; 3],
        }
    };
    (0..side * side).map(cell).collect()
}

/// Irradiance over π, at a point of the plane z = 0, of a polygon (Lambert 1760).
fn lambert(corners: &[DVec3], at: DVec2) -> f64 {
    let count = corners.len();
    let sum: f64 = (0..count)
        .map(|i| {
            let [a, b] = [i, (i + 1) % count].map(|k| corners[k] - at.extend(0.0));
            let c = a.cross(b);
            libm::atan2(c.length(), a.dot(b)) * c.z / c.length()
        })
        .sum();
    (sum * 0.5 / std::f64::consts::PI).abs()
}

fn slope(of: impl Fn(DVec2) -> f64) -> DVec2 {
    let h = 1e-5;
    let by = |e: DVec2| (of(e * h) - of(-e * h)) / (2.0 * h);
    DVec2::new(by(DVec2::X), by(DVec2::Y))
}

fn bend(of: impl Fn(DVec2) -> f64) -> DMat2 {
    let h = 1e-4;
    let by = |a: DVec2, b: DVec2| {
        (of((a + b) * h) - of((a - b) * h) - of((b - a) * h) + of(-(a + b) * h)) / (4.0 * h * h)
    };
    let (x, y) = (DVec2::X, DVec2::Y);
    DMat2::from_cols_array(&[by(x, x), by(x, y), by(x, y), by(y, y)])
}

fn assert_near(change: &Change, of: impl Fn(DVec2) -> f64 + Copy, bound: f64) {
    let (slope, bend) = (slope(of), bend(of));
    let off = (change.gradient[1] - slope).length();
    assert!(
        off < bound * slope.length(),
        "{:?} {slope:?}",
        change.gradient
    );
    let off = change.hessian - bend;
    let size = |m: DMat2| m.to_cols_array().map(|x| x * x).iter().sum::<f64>().sqrt();
    assert!(
        size(off) < bound * size(bend),
        "{:?} {bend:?}",
        change.hessian
    );
}

/// A bright square in a dark ceiling.
#[test]
fn a_square_in_a_ceiling_changes_as_its_formula_says() {
    let ceiling = |w: DVec3| {
        let distance = 1.5 / w.z;
        let p = w * distance;
        let inside = p.x > -0.4 && p.x < 1.1 && p.y > 0.3 && p.y < 1.4;
        (if inside { 2.0 } else { 0.0 }, distance)
    };
    let corners = [(-0.4, 0.3), (1.1, 0.3), (1.1, 1.4), (-0.4, 1.4)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 1.5));
    let change = change(&sights(256, ceiling), 256);
    assert_near(&change, |at| 2.0 * lambert(&corners, at), 0.03);
}

/// A dark square before a bright, far ceiling hides what is behind it.
#[test]
fn what_is_hidden_changes_as_what_hides_it() {
    let ceiling = |w: DVec3| {
        let p = w * (1.0 / w.z);
        let inside = p.x > 0.2 && p.x < 1.3 && p.y > -0.5 && p.y < 0.8;
        match inside {
            true => (0.0, 1.0 / w.z),
            false => (3.0, 1000.0 / w.z),
        }
    };
    let corners = [(0.2, -0.5), (1.3, -0.5), (1.3, 0.8), (0.2, 0.8)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 1.0));
    let change = change(&sights(256, ceiling), 256);
    assert_near(&change, |at| 3.0 - 3.0 * lambert(&corners, at), 0.03);
}

/// A bright wall beside the point, that ends below the horizon's ring.
#[test]
fn a_wall_beside_changes_as_its_formula_says() {
    let wall = |w: DVec3| match w.x > 0.0 && w.z * (0.7 / w.x) < 2.0 {
        true => (1.0, 0.7 / w.x),
        false => (0.0, f64::INFINITY),
    };
    let far = 1e5;
    let corners = [(-far, 0.0), (far, 0.0), (far, 2.0), (-far, 2.0)];
    let corners = corners.map(|(y, z)| DVec3::new(0.7, y, z));
    let change = change(&sights(256, wall), 256);
    assert_near(&change, |at| lambert(&corners, at), 0.05);
}

/// Where all is equally bright nothing changes, near or far.
#[test]
fn in_a_furnace_nothing_changes() {
    let walls = |w: DVec3| (1.0, 1.0 / w.abs().max_element());
    let change = change(&sights(32, walls), 32);
    let off = change.gradient[0].length() + change.hessian.to_cols_array()[0].abs();
    assert!(off < 1e-9, "{change:?}");
}

/// A lobe about a direction, as the normal turns.
#[test]
fn light_from_one_side_grows_as_the_normal_turns_there() {
    let side = DVec3::new(0.6, 0.0, 0.8);
    let lobe = |w: DVec3| (f64::max(0.0, w.dot(side) - 0.9), 1.0);
    let change = change(&sights(64, lobe), 64);
    // The lobe's whole light, over π: the cosine of its centre times the integral of (x − 0.9)
    // over directions.
    let whole = |x: f64| (x * x / 2.0 - 0.9 * x) * 2.0;
    let all = whole(1.0) - whole(0.9);
    // The mean direction of the lobe is its axis, but shorter.
    let shorter = {
        let cube = |x: f64| (x * x * x / 3.0 - 0.45 * x * x) * 2.0;
        (cube(1.0) - cube(0.9)) / all
    };
    let expected = all * shorter * side.truncate();
    let off = (change.turn[0] - expected).length();
    assert!(
        off < 0.03 * expected.length(),
        "{:?} {expected:?}",
        change.turn
    );
}
