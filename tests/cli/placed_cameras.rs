//! `--eye` and `--look-at`: cameras that a scene does not have.

use crate::run::{BALL, fails, folder, lanecast, stderr};
use image::{Rgb, RgbImage};
use std::fs;

fn picture(scene: &str, more: &[&str]) -> RgbImage {
    let folder = folder();
    fs::write(folder.path().join("a.toml"), scene).unwrap();
    let arguments = ["render", "a.toml", "-o", "a.png", "--size", "64x48"];
    let output = lanecast(folder.path(), &[&arguments, more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    image::open(folder.path().join("a.png"))
        .unwrap()
        .into_rgb8()
}

#[test]
fn a_camera_is_placed_as_in_a_scene() {
    let own =
        |camera: &str| BALL.replace("eye = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov_y = 30", camera);
    let place = ["--eye", "-4,2.5,5", "--look-at", "0.25,-0.125,0"];
    let at = "eye = [-4, 2.5, 5]\nlook_at = [0.25, -0.125, 0]\n";
    for (keys, more) in [
        ("fov_y = 30", vec![]),
        ("fov_y = 12.5", vec!["--fov-y", "12.5"]),
        ("fov_y = 30\nup = [1, 1, 0]", vec!["--up", "1,1,0"]),
        ("orthographic = 4.5", vec!["--orthographic", "4.5"]),
    ] {
        let asked = picture(BALL, &[&place[..], &more].concat());
        assert_eq!(
            asked,
            picture(&own(&format!("{at}{keys}")), &[]),
            "{more:?}"
        );
        assert_ne!(asked, picture(BALL, &[]), "{more:?}");
    }
    // The lens of the camera goes along, unless another is asked for.
    let lens = "\nlens = { radius = 0.2, focus = 3 }";
    let paths = ["--integrator", "path", "--spp", "2"];
    let with_lens = own(&format!(
        "eye = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov_y = 30{lens}"
    ));
    let moved = picture(&with_lens, &[&place[..], &paths].concat());
    assert_eq!(
        moved,
        picture(&own(&format!("{at}fov_y = 30{lens}")), &paths)
    );
    let pinhole = [&place[..], &paths, &["--fov-y", "30"]].concat();
    assert_eq!(
        picture(&with_lens, &pinhole),
        picture(&own(&format!("{at}fov_y = 30")), &paths)
    );
}

#[test]
fn a_placed_camera_fits_along_its_direction() {
    let near = picture(BALL, &["--eye", "1,1,1", "--look-at", "0,0,0", "--fit"]);
    let far = picture(BALL, &["--eye", "90,90,90", "--look-at", "0,0,0", "--fit"]);
    assert_eq!(near, far);
    let red = |pixel: &&Rgb<u8>| pixel.0[0] > 0;
    assert!(near.pixels().filter(red).count() > 200);
}

#[test]
fn places_that_are_none_are_refused() {
    let here = ["render", "--eye", "1,2,3"];
    let refused = |more: &[&'static str], says| fails(&[&here, more].concat(), 2, says);
    refused(&[], "--look-at");
    refused(&["--look-at", "1,2,3"], "one point");
    refused(&["--look-at", "0,0,0", "--up", "0,0,0"], "--up");
    refused(
        &["--look-at", "0,0,0", "--fov-y", "180"],
        "between 0 and 180",
    );
    refused(&["--look-at", "0,0,0", "--orthographic", "0"], "above 0");
    refused(&["--look-at", "0,0,0", "--view", "top"], "--view");
    fails(&["render", "--fov-y", "20"], 2, "--eye");
}
