use super::*;
use proptest::prelude::*;

fn camera(projection: Projection, lens: Option<Lens>) -> Camera {
    let eye = DVec3::new(1.0, 2.0, 3.0);
    Camera {
        lens,
        ..Camera::looking_at(
            eye,
            eye + DVec3::new(-1.0, 0.25, -2.0),
            DVec3::Y,
            projection,
        )
    }
}

fn round(radius: f64) -> Lens {
    Lens {
        radius,
        focus: 3.0,
        blades: 0,
        rotation: 20.0,
        squeeze: 1.0,
    }
}

/// The share of [0, 1)², by a fine grid, that a predicate of the lens's points holds for.
fn share(lens: &Lens, holds: impl Fn([f64; 2]) -> bool) -> f64 {
    const SIDE: usize = 512;
    let at = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    let points = (0..SIDE * SIDE).map(|i| on_lens(lens, [at(i % SIDE), at(i / SIDE)]));
    points.filter(|p| holds(*p)).count() as f64 / (SIDE * SIDE) as f64
}

#[test]
fn lens_points_are_uniform_over_the_opening() {
    for (blades, area) in [(0, PI), (3, 1.299_038), (5, 2.377_641), (6, 2.598_076)] {
        let lens = Lens {
            blades,
            ..round(1.0)
        };
        assert_eq!(share(&lens, |[x, y]| x * x + y * y > 1.0 + 1e-12), 0.0);
        // A disc and a half-plane inside all of these openings.
        let inner = share(&lens, |[x, y]| x * x + y * y < 0.16);
        assert!((inner - 0.16 * PI / area).abs() < 2e-3, "{blades}: {inner}");
        let moments = [0, 1].map(|k| {
            let right = share(&lens, |p| p[k] > 0.2);
            let left = share(&lens, |p| p[k] < -0.2);
            right - left
        });
        if blades % 2 == 0 {
            assert!(moments.iter().all(|m| m.abs() < 2e-3), "{moments:?}");
        }
    }
    let wide = Lens {
        squeeze: 2.0,
        ..round(1.0)
    };
    assert_eq!(share(&wide, |[x, _]| x.abs() > 0.5), 0.0);
}

/// All rays of a point of the picture meet where the sharp one meets the plane of focus.
#[test]
fn rays_through_a_lens_meet_in_the_plane_of_focus() {
    let calibrated = Calibration {
        focal: [80.0, 90.0],
        center: [30.0, 25.0],
        size: [64, 48],
        distortion: [-0.1, 0.01, 1e-3, 2e-3, 0.0],
    };
    for projection in [
        Projection::Perspective { half_height: 0.5 },
        Projection::Orthographic { half_height: 2.0 },
        Projection::Calibrated(calibrated),
    ] {
        let camera = camera(projection, Some(round(0.25)));
        let generator = RayGenerator::new(camera, 64, 48, Grid::Centers);
        let at = [Doubles::splat(11.0), Doubles::splat(40.0)];
        let half = [Doubles::splat(0.5); 2];
        let (org, dir) = generator.rays(at, half);
        let u = Singles::load(&std::array::from_fn::<_, STEP, _>(|i| {
            i as f32 / STEP as f32
        }));
        let (moved, bent) = generator.through_lens((org, dir), [u, u]);
        let focus = Doubles::splat(3.0);
        let off = (moved + bent * focus) - (org + dir * focus);
        for lane in [off.x, off.y, off.z].map(|x| x.to_array()).concat() {
            assert!(lane.abs() < 1e-14, "{lane}");
        }
        let apart = moved.x.to_array();
        assert!(apart.iter().any(|x| (x - apart[0]).abs() > 0.05));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// What a distorted camera sees at a pixel is distorted to that pixel.
    #[test]
    fn undistorted_points_are_distorted_to_themselves(
        x in -0.8..0.8, y in -0.6..0.6,
        k1 in -0.3..0.3, k2 in -0.1..0.1, k3 in -0.02..0.02,
        p1 in -0.01..0.01, p2 in -0.01..0.01,
    ) {
        let k = Calibration {
            focal: [1.0; 2],
            center: [0.0; 2],
            size: [1; 2],
            distortion: [k1, k2, p1, p2, k3],
        };
        if let Some(from) = k.undistorted([x, y]) {
            let to = k.distorted(from);
            prop_assert!((to[0] - x).abs() < 1e-13 && (to[1] - y).abs() < 1e-13, "{to:?}");
        }
        // What is seen is found: nothing folds so near to the axis.
        let near = [x * 0.3, y * 0.3];
        let found = k.undistorted(k.distorted(near)).unwrap();
        prop_assert!((found[0] - near[0]).abs() < 1e-12 && (found[1] - near[1]).abs() < 1e-12);
    }
}

#[test]
fn panoramas_and_fisheyes_see_where_they_should() {
    let ahead = |projection, width, height, x, y| {
        let camera = camera(projection, None);
        let generator = RayGenerator::new(camera, width, height, Grid::Centers);
        let (_, dir) = generator.ray(x, y, [0.0; 2]);
        [camera.right, camera.up, camera.forward].map(|axis| dir.dot(axis))
    };
    let close = |is: [f64; 3], should: [f64; 3]| {
        let off = (0..3)
            .map(|k| (is[k] - should[k]).abs())
            .fold(0.0, f64::max);
        assert!(off < 1e-14, "{is:?} {should:?}");
    };
    let panorama = |x, y| ahead(Projection::Panorama, 80, 40, x, y);
    close(panorama(40, 20), [0.0, 0.0, 1.0]);
    close(panorama(60, 20), [1.0, 0.0, 0.0]);
    close(panorama(0, 20), [0.0, 0.0, -1.0]);
    close(panorama(40, 0), [0.0, 1.0, 0.0]);
    for (mapping, half_way) in [
        (FisheyeMapping::Equidistant, 45_f64.to_radians()),
        (
            FisheyeMapping::Equisolid,
            2.0 * (0.5 * 0.5_f64.sqrt()).asin(),
        ),
    ] {
        let half_angle = 90_f64.to_radians();
        let fisheye = |x, y| {
            let projection = Projection::Fisheye {
                half_angle,
                mapping,
            };
            ahead(projection, 80, 40, x, y)
        };
        close(fisheye(40, 20), [0.0, 0.0, 1.0]);
        close(fisheye(60, 20), [1.0, 0.0, 0.0]);
        close(fisheye(40, 10), [0.0, half_way.sin(), half_way.cos()]);
        assert!(fisheye(61, 20)[0].is_nan());
    }
}

/// The width is the distance over the angle between neighbouring rays, near the axis.
#[test]
fn widths_of_pixels_are_those_between_rays() {
    let k = Calibration {
        focal: [70.0, 70.0],
        center: [39.5, 39.5],
        size: [80, 80],
        distortion: [0.0; 5],
    };
    for projection in [
        Projection::Perspective { half_height: 0.2 },
        Projection::Orthographic { half_height: 2.0 },
        Projection::Calibrated(k),
        Projection::Panorama,
        Projection::Fisheye {
            half_angle: 0.1,
            mapping: FisheyeMapping::Equidistant,
        },
        Projection::Fisheye {
            half_angle: 3.0,
            mapping: FisheyeMapping::Equidistant,
        },
    ] {
        let camera = camera(projection, None);
        let generator = RayGenerator::new(camera, 80, 80, Grid::Centers);
        let at = |y: u32| {
            let (org, dir) = generator.ray(40, y, [0.0; 2]);
            org + dir.normalize() * 5.0
        };
        let apart = (at(40) - at(39)).length();
        let width = generator.pixel_width(at(40));
        assert!(
            (width / apart - 1.0).abs() < 1e-2,
            "{projection:?}: {width} {apart}"
        );
    }
}

#[test]
fn what_a_pixel_sees_is_seen_there() {
    let calibration = Calibration {
        focal: [70.0, 72.0],
        center: [39.0, 31.0],
        size: [80, 60],
        distortion: [-0.1, 0.01, 1e-3, -2e-3, 1e-3],
    };
    let fisheye = |mapping| Projection::Fisheye {
        half_angle: 1.7,
        mapping,
    };
    for projection in [
        Projection::Perspective { half_height: 0.4 },
        Projection::Orthographic { half_height: 2.0 },
        Projection::Calibrated(calibration),
        Projection::Panorama,
        fisheye(FisheyeMapping::Equidistant),
        fisheye(FisheyeMapping::Equisolid),
    ] {
        for grid in [Grid::Centers, Grid::Corners] {
            let generator = RayGenerator::new(camera(projection, None), 40, 30, grid);
            let mut seen = 0;
            for (x, y) in (0..30).flat_map(|y| (0..40).map(move |x| (x, y))) {
                let (org, dir) = generator.ray(x, y, [0.5; 2]);
                // At the poles of a panorama a row of pixels sees one point.
                let is_pole = dir.dot(generator.camera.up).abs() > (1.0 - 1e-9) * dir.length();
                if dir.is_nan() || is_pole {
                    continue;
                }
                let center = generator.center(x, y);
                let mut places = vec![generator.seen_at(org + dir * 7.0)];
                if !projection.is_parallel() {
                    places.push(generator.seen_along(dir));
                }
                for place in places {
                    let [across, down] = generator.way(center, place.unwrap());
                    // All of a panorama's first row, or last, may look at a pole.
                    let upright = dir.dot(generator.camera.up).abs();
                    let is_pole = projection == Projection::Panorama && upright > 1.0 - 1e-12;
                    let across = if is_pole { 0.0 } else { across };
                    let off = across.abs().max(down.abs());
                    assert!(off < 1e-9, "{projection:?} {x} {y}: {off}");
                }
                seen += 1;
            }
            assert!(seen > 500, "{projection:?} {seen}");
        }
    }
    let ahead = RayGenerator::new(
        camera(Projection::Perspective { half_height: 0.4 }, None),
        40,
        30,
        Grid::Centers,
    );
    let behind = ahead.camera.eye - ahead.camera.forward;
    assert_eq!(ahead.seen_at(behind), None);
}
