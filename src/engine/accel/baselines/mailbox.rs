//! Mailboxes ( Amanatides and Woo 1987): a primitive that stands in many
//! cells is tested once per packet.
//!
//! A stamp per entry holds the number of the last walk that met it. Numbers go
//! on from walk to walk, whatever structure is walked, so nothing is cleared
//! between packets. Each thread keeps its stamps from batch to batch.

use std::cell::RefCell;

thread_local! {
    static KEPT: RefCell<Vec<Stamps>> = const { RefCell::new(Vec::new()) };
}

#[derive(Default)]
struct Stamps {
    of: Vec<u32>,
    walk: u32,
}

/// Borrowed from the thread for as long as it lives.
pub struct Mailbox(Stamps);

impl Default for Mailbox {
    fn default() -> Mailbox {
        Mailbox(KEPT.with_borrow_mut(Vec::pop).unwrap_or_default())
    }
}

impl Drop for Mailbox {
    fn drop(&mut self) {
        let stamps = std::mem::take(&mut self.0);
        KEPT.with_borrow_mut(|kept| kept.push(stamps));
    }
}

impl Mailbox {
    /// Begins a walk over so many entries, of which none has been met.
    #[inline(always)]
    pub fn begin(&mut self, entries: usize) {
        let Stamps { of, walk } = &mut self.0;
        if of.len() < entries {
            of.resize(entries, 0);
        }
        if *walk == u32::MAX {
            of.fill(0);
            *walk = 0;
        }
        *walk += 1;
    }

    /// Whether this walk meets the entry for the first time.
    #[inline(always)]
    pub fn first(&mut self, entry: usize) -> bool {
        let stamp = &mut self.0.of[entry];
        let new = *stamp != self.0.walk;
        *stamp = self.0.walk;
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn once_per_walk() {
        let mut mailbox = Mailbox::default();
        mailbox.0 = Stamps::default();
        for walk in [1, 2, u32::MAX - 1, u32::MAX, 1] {
            if walk == u32::MAX - 1 {
                mailbox.0.walk = walk - 1;
            }
            mailbox.begin(3);
            assert_eq!(mailbox.0.walk, walk);
            assert!(mailbox.first(0) && !mailbox.first(0) && mailbox.first(2) && !mailbox.first(2));
        }
        mailbox.begin(5);
        assert!((0..5).all(|i| mailbox.first(i)));
    }
}
