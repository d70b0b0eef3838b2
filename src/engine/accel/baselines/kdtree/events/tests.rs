//! Tests of the events' order.

use super::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn events_sort_as_their_positions(a in -1e30_f32..1e30, b in -1e30_f32..1e30) {
        let of = |x: f32| Event::new(x, 1, START, 7);
        prop_assert_eq!(of(a) < of(b), a < b);
        prop_assert_eq!(of(a).position(), a);
        prop_assert_eq!((of(a).axis(), of(a).kind(), of(a).entry()), (1, START, 7));
    }
}

#[test]
fn both_zeros_are_one() {
    assert_eq!(Event::new(-0.0, 0, END, 0), Event::new(0.0, 0, END, 0));
    let order = [-f32::INFINITY, -1.0, -1e-45, 0.0, 1e-45, 1.0, f32::INFINITY];
    let events = order.map(|x| Event::new(x, 0, END, 0));
    assert!(events.is_sorted());
    assert_eq!(events.map(Event::position), order);
}
