//! Test that a prefetch changes nothing.

use super::prefetch;

#[test]
fn changes_nothing() {
    let values = [7_u8; 1000];
    prefetch(&values);
    prefetch(&());
    assert!(values.iter().all(|x| *x == 7));
}
