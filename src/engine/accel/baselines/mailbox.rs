//! Mailboxes (Amanatides and Woo 1987): a primitive that several cells name is tested
//! once per packet.

/// Stamps of the walks that last tested each entry.
///
/// Numbers of walks go on rising whatever structure is walked, so nothing is cleared
/// between packets. A mailbox that is reused costs no memory after its first walk.
#[derive(Default)]
pub struct Mailbox {
    /// By entry: number of the last walk that has tested it.
    stamps: Vec<u32>,
    /// Number of the current walk, from 1 on.
    walk: u32,
}

impl Mailbox {
    /// Begins a walk over so many entries, none of which has been tested.
    #[inline(always)]
    pub fn begin(&mut self, entries: usize) {
        let Mailbox { stamps, walk } = self;
        if stamps.len() < entries {
            stamps.resize(entries, 0);
        }
        if *walk == u32::MAX {
            stamps.fill(0);
            *walk = 0;
        }
        *walk += 1;
    }

    /// Stamps an entry and returns whether this walk had not tested it yet.
    #[inline(always)]
    pub fn first(&mut self, entry: usize) -> bool {
        let stamp = &mut self.stamps[entry];
        let new = *stamp != self.walk;
        *stamp = self.walk;
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn once_per_walk() {
        let mut mailbox = Mailbox::default();
        for walk in [1, 2, u32::MAX - 1, u32::MAX, 1] {
            if walk == u32::MAX - 1 {
                mailbox.walk = walk - 1;
            }
            mailbox.begin(3);
            assert_eq!(mailbox.walk, walk);
            assert!(mailbox.first(0) && !mailbox.first(0) && mailbox.first(2) && !mailbox.first(2));
        }
        mailbox.begin(5);
        assert!((0..5).all(|i| mailbox.first(i)));
    }
}
