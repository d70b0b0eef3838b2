//! A binary heap of the children that a packet has met, the nearest on top. The lanes' entry
//! t's are stored beside it and do not move.

use crate::accel::baselines::bvh4::Child;
use crate::math::lanes::Lanes;

#[derive(Clone, Copy)]
struct Item<S> {
    key: S,
    child: Child,
    /// The row of the lanes' entry t's.
    place: u32,
}

/// The queue of one traversal, reused from packet to packet. It grows as traversals need, to
/// at most one item per child of the tree.
pub struct Queue<L: Lanes> {
    items: Vec<Item<L::Scalar>>,
    enters: Vec<L>,
    free: Vec<u32>,
}

impl<L: Lanes> Default for Queue<L> {
    fn default() -> Queue<L> {
        Queue {
            items: Vec::new(),
            enters: Vec::new(),
            free: Vec::new(),
        }
    }
}

impl<L: Lanes> Queue<L> {
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.items.clear();
        self.enters.clear();
        self.free.clear();
    }

    /// Adds a child; `key` is the least of `enter`.
    #[inline(always)]
    pub(super) fn push(&mut self, key: L::Scalar, child: Child, enter: L) {
        let place = match self.free.pop() {
            Some(place) => {
                self.enters[place as usize] = enter;
                place
            }
            None => {
                self.enters.push(enter);
                self.enters.len() as u32 - 1
            }
        };
        let item = Item { key, child, place };
        let mut at = self.items.len();
        self.items.push(item);
        while at > 0 {
            let parent = (at - 1) / 2;
            if self.items[parent].key <= key {
                break;
            }
            self.items[at] = self.items[parent];
            at = parent;
        }
        self.items[at] = item;
    }

    /// Removes the child of the least key, and returns the key, the child and the lanes' entry
    /// t's.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<(L::Scalar, Child, L)> {
        let last = self.items.pop()?;
        let Some(top) = self.items.first().copied() else {
            self.free.push(last.place);
            return Some((last.key, last.child, self.enters[last.place as usize]));
        };
        let len = self.items.len();
        let mut at = 0;
        loop {
            let mut child = 2 * at + 1;
            if child >= len {
                break;
            }
            if child + 1 < len && self.items[child + 1].key < self.items[child].key {
                child += 1;
            }
            if last.key <= self.items[child].key {
                break;
            }
            self.items[at] = self.items[child];
            at = child;
        }
        self.items[at] = last;
        self.free.push(top.place);
        Some((top.key, top.child, self.enters[top.place as usize]))
    }
}
