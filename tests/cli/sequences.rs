//! Sequences of pictures: what they share with single ones, and what is refused or warned of.

use crate::run::{BALL, folder, lanecast, stderr};
use std::fs;
use std::path::Path;

/// Renders a small sequence of a ball, and returns what is said.
fn succeeds(folder: &Path, more: &[&str]) -> String {
    fs::write(folder.join("ball.toml"), BALL).unwrap();
    let first = ["render", "ball.toml", "--size", "16x16"];
    let done = lanecast(folder, &[&first, more].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    stderr(&done).into()
}

#[test]
fn each_frame_counts_the_work_of_its_rays() {
    let folder = folder();
    let path = folder.path();
    for accel in ["bvh", "kd", "item-buffer"] {
        let heat = ["--integrator", "heat", "--accel", accel];
        succeeds(path, &[&heat[..], &["-o", "one.png"]].concat());
        succeeds(
            path,
            &[&heat[..], &["-o", "h.png", "--frames", "2"]].concat(),
        );
        let bytes = |name: &str| fs::read(path.join(name)).unwrap();
        assert!(bytes("one.png") == bytes("h_0000.png"), "{accel}");
        assert!(bytes("one.png") == bytes("h_0001.png"), "{accel}");
    }
}
