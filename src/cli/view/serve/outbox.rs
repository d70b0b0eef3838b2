//! What waits to be sent to a page. A page that is slow to read gets fewer pictures, not later ones:
//! a picture takes the place of those before it, so no more than one picture waits.

use super::locked;
use lanecast_io::Development;
use lanecast_picture::render::FinishedTile;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex};

/// Texts that wait; of more the oldest are left out.
const MOST_TEXTS: usize = 256;

/// Bytes of tiles that wait. A picture follows them, so those beyond are left out.
const MOST_TILES: usize = 1 << 26;

#[derive(Default)]
pub struct Outbox {
    waiting: Mutex<Waiting>,
    more: Condvar,
}

#[derive(Default)]
struct Waiting {
    texts: VecDeque<String>,
    /// Whole messages, the picture first.
    picture: Option<Vec<u8>>,
    /// The look that the tiles are of, and their bytes.
    tiles: (u64, Vec<u8>),
    pong: Option<Vec<u8>>,
    closed: bool,
}

/// A message to a page.
pub enum Letter {
    Text(String),
    Bytes(Vec<u8>),
    Pong(Vec<u8>),
}

impl Outbox {
    fn put(&self, put: impl FnOnce(&mut Waiting)) {
        put(&mut locked(&self.waiting));
        self.more.notify_one();
    }

    pub fn text(&self, text: String) {
        self.put(|waiting| {
            if waiting.texts.len() >= MOST_TEXTS {
                waiting.texts.pop_front();
            }
            waiting.texts.push_back(text);
        });
    }

    pub fn pong(&self, bytes: Vec<u8>) {
        self.put(|waiting| waiting.pong = Some(bytes));
    }

    /// Puts a picture: what its header says, and its PNG file.
    pub fn picture(&self, header: &str, png: &[u8]) {
        self.put(|waiting| {
            waiting.picture = Some(message(header, png));
            waiting.tiles.1.clear();
        });
    }

    /// Puts a tile of the picture of a look: x, y, width and height as u16, then its RGB codes.
    pub fn tile(&self, id: u64, tile: &FinishedTile, development: &Development) {
        let develop = development.developer();
        let mut bytes = Vec::with_capacity(8 + 3 * tile.color.len());
        for number in [tile.x, tile.y, tile.width, tile.height] {
            bytes.extend((number as u16).to_le_bytes());
        }
        for (row, color) in tile.color.iter().enumerate() {
            let row = row as u32;
            let place = (tile.x + row % tile.width, tile.y + row / tile.width);
            let codes = develop.codes(*color, place.0, place.1);
            bytes.extend(codes.map(|code| (code >> shift(development)) as u8));
        }
        self.put(|waiting| {
            if waiting.tiles.0 != id {
                waiting.tiles = (id, Vec::new());
            }
            if waiting.tiles.1.len() < MOST_TILES {
                waiting.tiles.1.append(&mut bytes);
            }
        });
    }

    /// Ends the wait of [`Outbox::take`].
    pub fn close(&self) {
        self.put(|waiting| waiting.closed = true);
    }

    /// Waits for messages; `None` once the box is closed.
    pub fn take(&self) -> Option<Vec<Letter>> {
        let mut waiting = locked(&self.waiting);
        loop {
            if waiting.closed {
                return None;
            }
            let mut letters: Vec<Letter> =
                waiting.pong.take().map(Letter::Pong).into_iter().collect();
            letters.extend(waiting.texts.drain(..).map(Letter::Text));
            letters.extend(waiting.picture.take().map(Letter::Bytes));
            if !waiting.tiles.1.is_empty() {
                let tiles = std::mem::take(&mut waiting.tiles.1);
                let header = format!("{{\"kind\":\"tiles\",\"id\":{}}}", waiting.tiles.0);
                letters.push(Letter::Bytes(message(&header, &tiles)));
            }
            if !letters.is_empty() {
                return Some(letters);
            }
            waiting = self.more.wait(waiting).unwrap_or_else(|e| e.into_inner());
        }
    }
}

/// Returns the bits that a code has beyond eight.
fn shift(development: &Development) -> u32 {
    development.bits.highest().ilog2() - u8::MAX.ilog2()
}

/// Returns a message: the length of its header as u32, the header, and bytes.
fn message(header: &str, bytes: &[u8]) -> Vec<u8> {
    let length = (header.len() as u32).to_le_bytes();
    [&length, header.as_bytes(), bytes].concat()
}
