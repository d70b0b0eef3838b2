//! `repeat`: copies of a child along a chain of transforms.

use crate::placed::{bits, refused, scene, seen};
use glam::{DAffine3, DVec3};

const BALL: &str = "[shape.ball]\nsphere = { center = [0, 0, 0], radius = 0.5 }\n";

#[test]
fn copies_are_where_they_would_be_if_they_were_written_out() {
    let repeated = format!(
        "{BALL}[[instance]]\nshape = 'ball'\ntransform = [{{ translate = [3, 0, 0] }}]\n\
         repeat = {{ count = 12, transform = [{{ rotate_y = 30.0 }}] }}\n"
    );
    let mut written = BALL.to_string();
    for k in 0..12 {
        written += &format!(
            "[[instance]]\nshape = 'ball'\ntransform = [{{ translate = [3, 0, 0] }}, \
             {{ rotate_y = {} }}]\n",
            30 * k
        );
    }
    let [repeated, written] = [&repeated, &written].map(|text| scene(&[("main.toml", text)]));
    assert_eq!(seen(&repeated), seen(&written));
    assert_eq!(bits(&repeated), bits(&written));
    // A quarter of a turn is exact.
    assert_eq!(seen(&repeated)[3].2.translation, [0.0, 0.0, -3.0]);

    // Repeats of repeats, on children and instances, and along with a motion.
    let text = format!(
        "{BALL}[node.row]\nchildren = [{{ shape = 'ball', \
         repeat = {{ count = 10, transform = [{{ translate = [1, 0, 0] }}] }} }}]\n\
         [node.field]\nchildren = [{{ node = 'row', \
         repeat = {{ count = 10, transform = [{{ translate = [0, 1, 0] }}] }} }}]\n\
         [[instance]]\nnode = 'field'\nmotion = [{{ at = 1.0, transform = [{{ translate = [0, 0, 7] }}] }}]\n\
         repeat = {{ count = 10, transform = [{{ translate = [0, 0, 0.5] }}] }}\n"
    );
    let field = scene(&[("main.toml", &text)]);
    assert_eq!((field.edges.len(), field.roots.len()), (20, 10));
    for (time, z) in [(0.0, 0.0), (1.0, 7.0)] {
        let rows = seen(&field.clone().at(time).unwrap());
        assert_eq!(rows.len(), 1000);
        for (k, row) in rows.iter().enumerate() {
            let at = [k % 10, k / 10 % 10].map(|x| x as f64);
            assert_eq!(
                row.2.translation,
                [at[0], at[1], z + 0.5 * (k / 100) as f64]
            );
        }
    }
}

#[test]
fn powers_of_a_transform_have_few_roundings() {
    let text = format!(
        "{BALL}[[instance]]\nshape = 'ball'\nrepeat = {{ count = 100000, \
         transform = [{{ rotate_y = 0.01 }}, {{ scale = 0.9999 }}] }}\n"
    );
    let spiral = scene(&[("main.toml", &text)]);
    for (k, row) in seen(&spiral).into_iter().enumerate() {
        let k = k as f64;
        let turn = DAffine3::from_rotation_y((0.01 * k).to_radians());
        let expected = DAffine3::from_scale(DVec3::splat(0.9999_f64.powf(k))) * turn;
        let is: DAffine3 = row.2.into();
        let off = (is.matrix3 - expected.matrix3).to_cols_array();
        let off = off.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Angle and factor of a single step are rounded by 2⁻⁵³ each, which k steps add up.
        let size = 0.9999_f64.powf(k);
        assert!(
            off <= (4.0 * k + 40.0) * f64::EPSILON * size,
            "{k}: {off:e}"
        );
    }
}

#[test]
fn counts_that_are_none_are_refused() {
    for (count, message) in [
        ("0", "count = 0; give a whole number of copies, 1 or more"),
        ("-3", "count = -3; give a whole number"),
        ("2.5", "count = 2.5; give a whole number"),
        ("nan", "a finite number"),
        ("1e30", "all repeats of a scene make 4194304 copies at most"),
        (
            "4194305",
            "all repeats of a scene make 4194304 copies at most",
        ),
    ] {
        let text = format!(
            "{BALL}[[instance]]\nshape = 'ball'\n\
             repeat = {{ count = {count}, transform = [{{ rotate_y = 1.0 }}] }}\n"
        );
        refused(&[("main.toml", &text)], &["main.toml:6:", message]);
    }
    let text = format!(
        "{BALL}[[instance]]\nshape = 'ball'\n\
         repeat = {{ count = 2000, transform = [{{ scale = 2.0 }}] }}\n"
    );
    refused(
        &[("main.toml", &text)],
        &["main.toml:6:10: copy 1024 is singular or infinite"],
    );
    let text = format!("{BALL}[[instance]]\nshape = 'ball'\nrepeat = {{ count = 2 }}\n");
    refused(
        &[("main.toml", &text)],
        &["main.toml:6:10: the key 'transform' is missing"],
    );
}
