//! Convex hulls: planes from points and points from planes.
//!
//! [`of_points`] is quickhull (Barber, Dobkin, Huhdanpaa 1996) on triangles, with coplanar
//! triangles merged afterwards; [`of_planes`] cuts a large cube by one plane after the other. Both
//! work in f64 at unit size with a stated tolerance: a solid flatter than that counts as flat, and
//! undecidable input is refused, never guessed. The resulting planes have unit outward normals;
//! redundant ones are removed.

mod planes;
mod points;
mod support;

pub use planes::of_planes;
pub use points::of_points;

use super::HalfSpace;
use glam::DVec3;
use thiserror::Error;

/// The distance relative to the size below which differences are rounding: some 400 times the
/// error of a determinant of unit vectors (2⁻⁵³ · 24).
const TOLERANCE: f64 = 1e-12;

/// The distance relative to the size below which two faces are one.
const FLATNESS: f64 = 1e-10;

/// The largest spread of three planes that is accepted. Where planes meet at small angles, their
/// rounding moves the corner by up to 16 · 2⁻⁵² · spread of the largest coordinate (P7,
/// docs/numerics/planes.md): here by one part in 10¹⁰.
const MAX_SPREAD: f64 = 3e4;

/// The most points and planes of one solid; more would take long.
const MAX_POINTS: usize = 1 << 16;
const MAX_PLANES: usize = 1 << 11;

/// A bounded convex solid by its planes and by its corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Hull {
    /// One plane per face, with unit outward normals.
    pub planes: Vec<HalfSpace>,
    /// The corners, each on three planes or more.
    pub points: Vec<DVec3>,
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum HullError {
    #[error("{count} {what} are too many for one polyhedron (at most {limit}); use a mesh")]
    TooMany {
        what: &'static str,
        count: usize,
        limit: usize,
    },
    #[error("a polyhedron needs at least 4 points; there are {0}")]
    TooFew(usize),
    #[error("point {0} (from 0) is not finite")]
    BadPoint(usize),
    #[error("plane {0} (from 0) has no finite normal other than (0, 0, 0), or no finite offset")]
    BadPlane(usize),
    #[error("the points lie in one plane; a polyhedron needs a volume")]
    Flat,
    #[error("the planes enclose nothing: no point is inside all of them")]
    Empty,
    #[error("the planes do not enclose a bounded volume; add planes on the open side")]
    Unbounded,
    #[error(
        "a corner or an edge is so sharp that rounding would move it visibly; \
         leave the sliver out, or use a mesh"
    )]
    Sharp,
    #[error("faces or corners lie too close to each other to tell them apart")]
    Unsettled,
}

/// Returns the factor by which errors of three planes are magnified where they meet: the norm of
/// the inverse of their normals.
fn spread([a, b, c]: [DVec3; 3]) -> f64 {
    let determinant = a.dot(b.cross(c));
    (b.cross(c).length() + c.cross(a).length() + a.cross(b).length()) / determinant.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cube_planes() -> Vec<HalfSpace> {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let normals = axes.into_iter().flat_map(|a| [a, -a]);
        let plane = |normal| HalfSpace {
            normal,
            offset: 1.0,
        };
        normals.map(plane).collect()
    }

    fn octahedron() -> Vec<DVec3> {
        cube_planes().iter().map(|p| p.normal).collect()
    }

    fn dodecahedron() -> Vec<DVec3> {
        let phi = (1.0 + 5.0_f64.sqrt()) / 2.0;
        let mut points = Vec::new();
        for i in 0..8 {
            let s = |bit: i32| if i & bit == 0 { 1.0 } else { -1.0 };
            points.push(DVec3::new(s(1), s(2), s(4)));
        }
        for i in 0..4 {
            let (a, b) = (
                if i & 1 == 0 { phi } else { -phi },
                if i & 2 == 0 { 1.0 / phi } else { -1.0 / phi },
            );
            points.extend([
                DVec3::new(0.0, b, a),
                DVec3::new(b, a, 0.0),
                DVec3::new(a, 0.0, b),
            ]);
        }
        points
    }

    fn check(hull: &Hull, inside: &[DVec3]) {
        let size = inside.iter().map(|p| p.length()).fold(0.0, f64::max);
        for plane in &hull.planes {
            assert!((plane.normal.length() - 1.0).abs() < 1e-14);
            for p in inside.iter().chain(&hull.points) {
                let over = plane.normal.dot(*p) - plane.offset;
                assert!(over <= 1e-11 * size, "{p} is {over} outside {plane:?}");
            }
        }
        // Euler's formula holds for a closed surface.
        let on = |plane: &HalfSpace, p: &DVec3| {
            (plane.normal.dot(*p) - plane.offset).abs() <= 1e-9 * size
        };
        let corners_of = |plane: &HalfSpace| hull.points.iter().filter(|p| on(plane, p)).count();
        let edges = hull.planes.iter().map(corners_of).sum::<usize>();
        assert_eq!(edges % 2, 0);
        assert_eq!(hull.points.len() + hull.planes.len(), edges / 2 + 2);
    }

    fn counts(hull: &Hull) -> (usize, usize) {
        (hull.planes.len(), hull.points.len())
    }

    #[test]
    fn known_solids_have_their_faces_and_corners() {
        let cube = of_planes(&cube_planes()).unwrap();
        assert_eq!(counts(&cube), (6, 8));
        assert!(cube.points.iter().all(|p| p.abs() == DVec3::ONE));
        assert_eq!(counts(&of_points(&cube.points).unwrap()), (6, 8));
        assert_eq!(counts(&of_points(&octahedron()).unwrap()), (8, 6));

        let dodecahedron = dodecahedron();
        let hull = of_points(&dodecahedron).unwrap();
        assert_eq!(counts(&hull), (12, 20));
        check(&hull, &dodecahedron);
        let again = of_planes(&hull.planes).unwrap();
        assert_eq!(counts(&again), (12, 20));
        check(&again, &dodecahedron);
    }

    #[test]
    fn four_planes_meet_in_one_corner() {
        let planes: Vec<HalfSpace> = (0..8)
            .map(|i| {
                let s = |bit: i32| if i & bit == 0 { 1.0 } else { -1.0 };
                HalfSpace {
                    normal: DVec3::new(s(1), s(2), s(4)),
                    offset: 1.0,
                }
            })
            .collect();
        let hull = of_planes(&planes).unwrap();
        assert_eq!(counts(&hull), (8, 6));
        check(&hull, &octahedron());
    }

    #[test]
    fn points_inside_faces_and_on_edges_are_no_corners() {
        let grid: Vec<DVec3> = (0..1000)
            .map(|i| DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64))
            .collect();
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        for points in [grid.clone(), grid.iter().map(|p| turn * *p / 3.0).collect()] {
            let hull = of_points(&points).unwrap();
            assert_eq!(counts(&hull), (6, 8));
            check(&hull, &points);
        }
    }

    #[test]
    fn redundant_planes_are_dropped() {
        let mut planes = cube_planes();
        planes.extend(cube_planes());
        for offset in [3.0_f64.sqrt(), 5.0] {
            planes.push(HalfSpace {
                normal: DVec3::ONE.normalize(),
                offset,
            });
        }
        planes.push(HalfSpace {
            normal: DVec3::X * 7.0,
            offset: 70.0,
        });
        assert_eq!(counts(&of_planes(&planes).unwrap()), (6, 8));
    }

    #[test]
    fn what_is_no_solid_is_refused() {
        let planes = cube_planes();
        assert_eq!(of_planes(&planes[..5]), Err(HullError::Unbounded));
        assert_eq!(of_planes(&[]), Err(HullError::Unbounded));
        // A column whose far end is almost a point.
        let column = [
            (DVec3::X, 5e-7),
            (DVec3::Y, 1.0),
            (-DVec3::Y, 0.0),
            (-DVec3::Z, 0.0),
            (-DVec3::X, 0.0),
        ];
        let column = column.map(|(normal, offset)| HalfSpace { normal, offset });
        assert_eq!(of_planes(&column), Err(HullError::Unbounded));
        let mut empty = planes.clone();
        empty[0].offset = -2.0;
        assert_eq!(of_planes(&empty), Err(HullError::Empty));
        empty[0].offset = -1.0;
        assert_eq!(of_planes(&empty), Err(HullError::Empty));
        let mut bad = planes;
        bad[3].normal = DVec3::ZERO;
        assert_eq!(of_planes(&bad), Err(HullError::BadPlane(3)));

        let flat: Vec<DVec3> = (0..9)
            .map(|i| DVec3::new((i % 3) as f64, (i / 3) as f64, (i % 3 + i / 3) as f64))
            .collect();
        assert_eq!(of_points(&flat), Err(HullError::Flat));
        assert_eq!(of_points(&[DVec3::ONE; 7]), Err(HullError::Flat));
        assert_eq!(of_points(&flat[..3]), Err(HullError::TooFew(3)));
        let line: Vec<DVec3> = (0..9).map(|i| DVec3::splat(f64::from(i))).collect();
        assert_eq!(of_points(&line), Err(HullError::Flat));
    }

    #[test]
    fn a_few_thousand_points_on_a_sphere_take_no_time() {
        // A spiral: no two planes coincide, and every point is a corner.
        let points: Vec<DVec3> = (0..4000)
            .map(|i| {
                let z = (f64::from(i) + 0.5) / 2000.0 - 1.0;
                let r = (1.0 - z * z).sqrt();
                let (s, c) = (f64::from(i) * 2.4).sin_cos();
                DVec3::new(r * c, r * s, z)
            })
            .collect();
        let hull = of_points(&points).unwrap();
        assert_eq!(hull.points.len(), 4000);
        for plane in &hull.planes {
            assert!(
                points
                    .iter()
                    .all(|p| plane.normal.dot(*p) <= plane.offset + 1e-12)
            );
        }
    }

    /// Corners of five planes at small angles, which are easily lost.
    #[test]
    fn planes_at_small_angles_meet_all_the_same() {
        let points = [
            [-2.6233407120337, -1.0, 0.25],
            [-2.8698063387427, -0.5369294860180018, -0.8279663438872178],
            [-2.5108840875836678, -0.75, -0.6630443707819089],
            [-2.0108840875836678, 0.0, -1.0],
            [-1.8093377079175328, -1.0, -0.8462396776773853],
        ]
        .map(DVec3::from_array);
        let hull = of_points(&points).unwrap();
        assert_eq!(counts(&of_planes(&hull.planes).unwrap()), counts(&hull));
    }

    fn cloud() -> impl Strategy<Value = Vec<DVec3>> {
        let coordinate = prop_oneof![-1.0..1.0_f64, (-4..=4).prop_map(|i| f64::from(i) / 4.0)];
        let point = [coordinate.clone(), coordinate.clone(), coordinate];
        prop::collection::vec(point.prop_map(DVec3::from_array), 4..80)
    }

    proptest! {
        #[test]
        fn a_hull_holds_its_points(points in cloud(), scale in -20..20, x in -3.0..3.0) {
            let points: Vec<DVec3> = points
                .iter()
                .map(|p| (*p + DVec3::X * x) * 2.0_f64.powi(scale))
                .collect();
            match of_points(&points) {
                Ok(hull) => {
                    check(&hull, &points);
                    // Corners are input points, and their hull is the same.
                    prop_assert!(hull.points.iter().all(|p| points.contains(p)));
                    let again = of_points(&hull.points).unwrap();
                    prop_assert_eq!(counts(&hull), counts(&again));
                    let cut = of_planes(&hull.planes).unwrap();
                    prop_assert_eq!(counts(&hull), counts(&cut));
                }
                Err(e) => prop_assert!(e == HullError::Flat || e == HullError::Sharp, "{e}"),
            }
        }

        #[test]
        fn nothing_given_makes_it_panic(
            points in prop::collection::vec(prop::array::uniform3(any::<f64>()), 0..30),
            offsets in prop::collection::vec(any::<f64>(), 30),
        ) {
            let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
            let _ = of_points(&points);
            let planes = points.iter().zip(offsets);
            let planes = planes.map(|(n, offset)| HalfSpace { normal: *n, offset });
            let _ = of_planes(&planes.collect::<Vec<_>>());
        }
    }
}
