//! Camera rays against the reference's, which are written apart.

use glam::DVec3;
use lanecast::internals::reference::{Grid as ReferenceGrid, camera_ray};
use lanecast::internals::render::{Grid, RayGenerator};
use lanecast::internals::scene::{Calibration, Camera, FisheyeMapping, Projection};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Every projection sees what the reference sees, and nothing where that sees nothing.
    #[test]
    fn rays_are_those_of_the_reference(x in 0_u32..64, y in 0_u32..48, kind in 0_usize..9) {
        let distorted = |focal: f64, distortion| Calibration {
            focal: [focal, 1.05 * focal],
            center: [30.0, 22.0],
            size: [64, 48],
            distortion,
        };
        let fisheye = |mapping| Projection::Fisheye { half_angle: 1.6, mapping };
        let projection = [
            Projection::Perspective { half_height: 0.5 },
            Projection::Orthographic { half_height: 2.0 },
            Projection::Calibrated(distorted(40.0, [-0.28, 0.05, 1e-3, -2e-3, 0.004])),
            // These fold within the picture, and the model reaches its corners again far away.
            Projection::Calibrated(distorted(20.0, [-0.4, 0.05, 0.0, 0.0, 0.0])),
            Projection::Calibrated(distorted(70.0, [-3.0, 0.1, 0.0, 0.0, 0.0])),
            Projection::Calibrated(distorted(20.0, [-0.35, 0.08, 4e-3, -2e-3, -0.004])),
            Projection::Panorama,
            fisheye(FisheyeMapping::Equidistant),
            fisheye(FisheyeMapping::Equisolid),
        ][kind];
        let eye = DVec3::new(1.0, 2.0, 3.0);
        let towards = eye + DVec3::new(-1.0, 0.25, -2.0);
        let camera = Camera::looking_at(eye, towards, DVec3::Y, projection);
        let generator = RayGenerator::new(camera, 64, 48, Grid::Centers);
        let (org, dir) = generator.ray(x, y, [0.5; 2]);
        let own = camera_ray(&camera, [64, 48], ReferenceGrid::Centers, [x, y]);
        prop_assert_eq!(dir.is_nan(), own.dir.iter().any(|d| d.is_nan()));
        prop_assert!((org - DVec3::from_array(own.org)).length() < 1e-13);
        if !dir.is_nan() {
            let off = (dir - DVec3::from_array(own.dir)).length();
            prop_assert!(off < 1e-12, "{dir} {:?}", own.dir);
        }
    }
}
