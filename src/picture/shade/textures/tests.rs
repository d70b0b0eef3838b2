//! Look-ups have the values that images and triangles say.

use super::*;

#[test]
fn what_is_beyond_an_image_is_repeated_mirrored_or_its_edge() {
    let row = |wrap| [-5, -4, -1, 0, 3, 4, 7, 8].map(|at| wrapped(wrap, at, 4));
    assert_eq!(row(Wrap::Repeat), [3, 0, 3, 0, 3, 0, 3, 0]);
    assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 3, 3, 3, 3]);
    assert_eq!(row(Wrap::Mirror), [3, 3, 0, 0, 3, 3, 0, 0]);
}
