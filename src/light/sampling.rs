//! Maps from the unit square to discs, hemispheres and triangles, and their densities.
//!
//! Numbers of the square are in [0, 1). Maps of round domains go through the concentric
//! map of the disc, which keeps neighbours together, so that strata of the square stay
//! compact. Densities are per area of the disc or triangle, per solid angle of directions.
//! Directions are unit vectors within a few units in the last place, about the z axis.

use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::sin_cos_turns;
use lanecast_numerics::math::lanes::Lanes;
use std::f32::consts::{FRAC_1_PI, PI};

/// A point of the unit disc by its coordinates, and its radius.
struct DiscPoint<L> {
    x: L,
    y: L,
    radius: L,
}

/// Maps the square to the disc so that squares about the centre become circles (Shirley &
/// Chiu, "A Low Distortion Map Between Disk and Square", 1997).
#[inline(always)]
fn disc_point<L: Lanes<Scalar = f32>>(u: [L; 2]) -> DiscPoint<L> {
    let [a, b] = u.map(|u| u * L::splat(2.0) - L::splat(1.0));
    let wide = a.abs().gt(b.abs());
    let radius = L::select(wide, a, b);
    let other = L::select(wide, b, a);
    // 0/0 at the centre, whose angle does not matter.
    let eighth = L::splat(0.125);
    let centre = radius.eq(L::zero());
    let turns = other / L::select(centre, L::splat(1.0), radius) * eighth;
    let turns = L::select(wide, turns, L::splat(0.25) - turns);
    let (sin, cos) = sin_cos_turns(turns);
    DiscPoint {
        x: radius * cos,
        y: radius * sin,
        radius: radius.abs(),
    }
}

/// Maps the square to the unit disc, uniformly; see [`DISC_DENSITY`].
#[inline(always)]
pub fn concentric_disc<L: Lanes<Scalar = f32>>(u: [L; 2]) -> [L; 2] {
    let point = disc_point(u);
    [point.x, point.y]
}

/// Density of [`concentric_disc`] per area.
pub const DISC_DENSITY: f32 = FRAC_1_PI;

/// Maps the square to the hemisphere z > 0 with a density proportional to the cosine: the
/// disc, projected upwards (Malley). z is never 0.
#[inline(always)]
pub fn cosine_hemisphere<L: Lanes<Scalar = f32>>(u: [L; 2]) -> Vec3<L> {
    let point = disc_point(u);
    let one = L::splat(1.0);
    // z² = 1 − r² as a product, without cancellation, and above 0 also where r is 1.
    let rest = (one - point.radius).max(L::splat(0.5 * f32::EPSILON));
    let z = (rest * (one + point.radius)).sqrt();
    Vec3::new(point.x, point.y, z)
}

/// Density of [`cosine_hemisphere`] in a direction with this z.
#[inline(always)]
pub fn cosine_hemisphere_density<L: Lanes<Scalar = f32>>(z: L) -> L {
    z.max(L::zero()) * L::splat(FRAC_1_PI)
}

/// Maps the square uniformly to the directions within an angle θ of the z axis. The cone is
/// given by 1 − cos θ in [0, 2], which keeps its digits in the narrowest of cones.
#[inline(always)]
pub fn uniform_cone<L: Lanes<Scalar = f32>>(u: [L; 2], one_minus_cos: L) -> Vec3<L> {
    // The area below a height of the sphere grows with the height, as that of a disc with
    // the square of the radius.
    let point = disc_point(u);
    let down = point.radius * point.radius * one_minus_cos;
    let scale = (one_minus_cos * (L::splat(2.0) - down)).sqrt();
    Vec3::new(point.x * scale, point.y * scale, L::splat(1.0) - down)
}

/// Density of [`uniform_cone`] inside the cone; 0 if the cone is empty.
#[inline(always)]
pub fn uniform_cone_density<L: Lanes<Scalar = f32>>(one_minus_cos: L) -> L {
    let some = one_minus_cos.gt(L::zero());
    let solid_angle = L::splat(2.0 * PI) * one_minus_cos;
    let density = L::splat(1.0) / L::select(some, solid_angle, L::splat(1.0));
    L::select(some, density, L::zero())
}

/// Maps the square uniformly to the sphere of directions; see [`SPHERE_DENSITY`].
#[inline(always)]
pub fn uniform_sphere<L: Lanes<Scalar = f32>>(u: [L; 2]) -> Vec3<L> {
    uniform_cone(u, L::splat(2.0))
}

/// Density of [`uniform_sphere`].
pub const SPHERE_DENSITY: f32 = 0.25 * FRAC_1_PI;

/// Maps the square uniformly to a triangle: barycentric coordinates of its three corners,
/// none below 0 (Heitz, "A Low-Distortion Map Between Triangle and Square", 2019). The
/// density is 1/area.
#[inline(always)]
pub fn uniform_triangle<L: Lanes<Scalar = f32>>([u, v]: [L; 2]) -> [L; 3] {
    let half = L::splat(0.5);
    let above = v.gt(u);
    let first = L::select(above, u * half, u - v * half);
    let second = L::select(above, v - u * half, v * half);
    [first, second, L::splat(1.0) - first - second]
}

/// An orthonormal, right-handed frame of three unit vectors.
#[derive(Clone, Copy, Debug)]
pub struct Frame<L> {
    pub x: Vec3<L>,
    pub y: Vec3<L>,
    pub z: Vec3<L>,
}

impl<L: Lanes<Scalar = f32>> Frame<L> {
    /// Makes a frame about a unit vector (Duff et al., "Building an Orthonormal Basis,
    /// Revisited", JCGT 6(1), 2017).
    #[inline(always)]
    pub fn about(z: Vec3<L>) -> Frame<L> {
        let one = L::splat(1.0);
        let sign = L::select(z.z.lt(L::zero()), -one, one);
        let a = -(one / (sign + z.z));
        let b = z.x * z.y * a;
        Frame {
            x: Vec3::new(one + sign * z.x * z.x * a, sign * b, -(sign * z.x)),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Returns the world's coordinates of a vector in this frame.
    #[inline(always)]
    pub fn world_from_local(&self, v: Vec3<L>) -> Vec3<L> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Returns this frame's coordinates of a vector in the world.
    #[inline(always)]
    pub fn local_from_world(&self, v: Vec3<L>) -> Vec3<L> {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chi2::{Random, check, direction_of, place_of};
    use lanecast_numerics::math::lanes::{f32x4, f32x8, f32x16};

    const TESTS: usize = 8;

    fn array(v: Vec3<f32>) -> [f64; 3] {
        [v.x, v.y, v.z].map(f64::from)
    }

    #[test]
    fn discs_are_covered_uniformly() {
        let sample = |u| concentric_disc(u).map(|x| 0.5 + 0.5 * f64::from(x));
        let density = |[x, y]: [f64; 2]| {
            let inside = (2.0 * x - 1.0).hypot(2.0 * y - 1.0) <= 1.0;
            if inside {
                4.0 * f64::from(DISC_DENSITY)
            } else {
                0.0
            }
        };
        check(
            "disc",
            [11, 13],
            400_000,
            TESTS,
            |u| Some(sample(u)),
            density,
        );
        assert_eq!(concentric_disc([0.5_f32, 0.5]), [0.0, 0.0]);
        assert_eq!(concentric_disc([0.0_f32, 0.5]), [-1.0, 0.0]);
        assert_eq!(concentric_disc([0.5_f32, 0.0]), [0.0, -1.0]);
    }

    #[test]
    fn hemispheres_are_covered_by_the_cosine() {
        let sample = |u| place_of(array(cosine_hemisphere(u)));
        let density = |at| {
            let [_, _, z] = direction_of(at);
            4.0 * std::f64::consts::PI * f64::from(cosine_hemisphere_density(z as f32))
        };
        check(
            "cosine",
            [20, 16],
            400_000,
            TESTS,
            |u| Some(sample(u)),
            density,
        );
    }

    #[test]
    fn cones_and_spheres_are_covered_uniformly() {
        for one_minus_cos in [2.0_f32, 1.0, 0.03] {
            let sample = |u| place_of(array(uniform_cone(u, one_minus_cos)));
            let density = |at| {
                let [_, _, z] = direction_of(at);
                let inside = 1.0 - z <= f64::from(one_minus_cos);
                let density = f64::from(uniform_cone_density(one_minus_cos));
                if inside {
                    4.0 * std::f64::consts::PI * density
                } else {
                    0.0
                }
            };
            // Rows as high as the cone is, or a whole part of it.
            let rows = if one_minus_cos < 0.1 { 200 } else { 16 };
            check(
                "cone",
                [rows, 8],
                400_000,
                TESTS,
                |u| Some(sample(u)),
                density,
            );
        }
        assert_eq!(uniform_cone_density(0.0_f32), 0.0);
        assert_eq!(uniform_cone_density(2.0_f32), SPHERE_DENSITY);
    }

    #[test]
    fn triangles_are_covered_uniformly() {
        // The corners (1, 0), (0, 1) and (0, 0) take half of the unit square.
        let sample = |u| {
            let [a, b, _] = uniform_triangle(u).map(f64::from);
            Some([a, b])
        };
        let density = |[a, b]: [f64; 2]| if a + b <= 1.0 { 2.0 } else { 0.0 };
        check("triangle", [9, 10], 400_000, TESTS, sample, density);
        let last = 1.0 - 0.5 * f32::EPSILON;
        for u in [[0.0, 0.0], [last, 0.0], [0.0, last], [last, last]] {
            let corners = uniform_triangle(u);
            assert!(corners.iter().all(|b| *b >= 0.0), "{corners:?}");
        }
    }

    #[test]
    fn directions_are_unit_vectors_above_the_plane() {
        let last = 1.0 - 0.5 * f32::EPSILON;
        let mut random = Random(5);
        let mut squares = vec![
            [0.0, 0.0],
            [last, 0.0],
            [0.0, last],
            [last, last],
            [0.5, 0.5],
        ];
        squares.extend((0..100_000).map(|_| random.square()));
        for u in squares {
            let up = cosine_hemisphere(u);
            assert!(
                up.z > 0.0 && (up.length() - 1.0).abs() < 4e-7,
                "{u:?} {up:?}"
            );
            for one_minus_cos in [2.0, 1.0, 1e-3, 1e-12] {
                let v = uniform_cone(u, one_minus_cos);
                assert!((v.length() - 1.0).abs() < 4e-7, "{u:?} {v:?}");
                assert!(1.0 - v.z <= one_minus_cos * 1.000_001 + 6e-8);
            }
        }
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let mut random = Random(9);
        let mut axes: Vec<Vec3<f32>> = (0..100_000)
            .map(|_| uniform_sphere(random.square()))
            .collect();
        for z in [1.0, -1.0] {
            axes.push(Vec3::new(0.0, 0.0, z));
            axes.push(Vec3::new(z, 0.0, -0.0));
            axes.push(Vec3::new(0.0, z, 0.0));
        }
        for axis in axes {
            let frame = Frame::about(axis);
            let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{frame:?}");
            close(frame.x.length(), 1.0);
            close(frame.y.length(), 1.0);
            close(frame.x.dot(frame.y), 0.0);
            close(frame.x.dot(frame.z), 0.0);
            close(frame.y.dot(frame.z), 0.0);
            close(frame.x.cross(frame.y).dot(frame.z), 1.0);
            let v = Vec3::new(0.3, -0.5, 0.8);
            let back = frame.local_from_world(frame.world_from_local(v)) - v;
            close(back.length(), 0.0);
        }
    }

    fn agrees<L: Lanes<Scalar = f32>>() {
        let mut random = Random(17);
        for _ in 0..1000 {
            let squares: Vec<[f32; 2]> = (0..L::COUNT).map(|_| random.square()).collect();
            let u = [0, 1].map(|k| L::load(&squares.iter().map(|u| u[k]).collect::<Vec<_>>()));
            let lanes = |u: [L; 2]| {
                let (up, cone) = (cosine_hemisphere(u), uniform_cone(u, L::splat(0.2)));
                let frame = Frame::about(uniform_sphere(u));
                let [a, b, c] = uniform_triangle(u);
                [
                    up.x, up.y, up.z, cone.x, cone.y, cone.z, a, b, c, frame.x.x, frame.y.y,
                ]
            };
            let one = |u: [f32; 2]| {
                let (up, cone) = (cosine_hemisphere(u), uniform_cone(u, 0.2));
                let frame = Frame::about(uniform_sphere(u));
                let [a, b, c] = uniform_triangle(u);
                [
                    up.x, up.y, up.z, cone.x, cone.y, cone.z, a, b, c, frame.x.x, frame.y.y,
                ]
            };
            let wide = lanes(u);
            for (i, u) in squares.iter().enumerate() {
                let bits = wide.map(|x| x.lane(i).to_bits());
                assert_eq!(bits, one(*u).map(f32::to_bits));
            }
        }
    }

    #[test]
    fn every_width_has_the_bits_of_one_lane() {
        agrees::<f32x4>();
        agrees::<f32x8>();
        agrees::<f32x16>();
    }
}
