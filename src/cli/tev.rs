//! `render --display`: sends a picture to the viewer tev while it is rendered.
//!
//! A packet of tev's protocol is its own length as u32, a byte that says what it is, and numbers and
//! texts, little-endian; texts end with 0. A thread of its own sends, so that no tile waits for the
//! viewer. A viewer that goes away ends the showing, and not the picture.

use super::error::CliError;
use super::output::complain;
use lanecast_io::Picture;
use lanecast_picture::render::FinishedTile;
use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What packets are.
const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE: u8 = 6;

/// How long a viewer may take to answer, and to read.
const PATIENCE: Duration = Duration::from_secs(5);

/// A connection to a viewer.
pub struct Display {
    address: String,
    stream: TcpStream,
}

/// A picture in a viewer.
pub struct Shown {
    name: String,
    packets: Mutex<Sender<Vec<u8>>>,
    sender: JoinHandle<()>,
}

impl Display {
    /// Connects to a viewer, if there is an address. Fails if nobody listens there.
    pub fn connect(address: Option<&str>) -> Result<Option<Display>, CliError> {
        let Some(address) = address else {
            return Ok(None);
        };
        let refused = |why: String| {
            CliError::Display(format!(
                "--display {address}: {why}; start tev there, or leave it out"
            ))
        };
        let places = address.to_socket_addrs();
        let places =
            places.map_err(|e| refused(format!("{e} (write HOST:PORT; tev's is 14158)")))?;
        let mut last = "no such host".to_owned();
        for place in places {
            match TcpStream::connect_timeout(&place, PATIENCE) {
                Ok(stream) => {
                    let _ = stream.set_write_timeout(Some(PATIENCE));
                    return Ok(Some(Display {
                        address: address.to_owned(),
                        stream,
                    }));
                }
                Err(e) => last = e.to_string(),
            }
        }
        Err(refused(last))
    }

    /// Begins a picture of this name, which is empty.
    pub fn begin(self, name: &str, (width, height): (u32, u32), has_alpha: bool) -> Shown {
        let (packets, waiting) = channel();
        let Display { address, stream } = self;
        let sender = std::thread::spawn(move || send(stream, &address, &waiting));
        let mut packet = Packet::new(CREATE_IMAGE);
        // In front of other pictures.
        packet.byte(1).text(name);
        let channels: &[&str] = match has_alpha {
            true => &["R", "G", "B", "A"],
            false => &["R", "G", "B"],
        };
        packet.int(width).int(height).names(channels);
        let shown = Shown {
            name: name.to_owned(),
            packets: Mutex::new(packets),
            sender,
        };
        shown.put(packet);
        shown
    }
}

/// Sends packets until there are no more.
fn send(mut stream: TcpStream, address: &str, waiting: &Receiver<Vec<u8>>) {
    for packet in waiting {
        if let Err(e) = stream.write_all(&packet) {
            complain(&format!(
                "warning: --display {address}: {e}; the picture is no longer shown there"
            ));
            return;
        }
    }
}

impl Shown {
    fn put(&self, packet: Packet) {
        let packets = self.packets.lock().unwrap_or_else(|e| e.into_inner());
        // Who does not read any more has been complained of.
        let _ = packets.send(packet.finish());
    }

    fn update(&self, channels: &[&str], [x, y, width, height]: [u32; 4], values: &[f32]) {
        let mut packet = Packet::new(UPDATE_IMAGE);
        packet.byte(0).text(&self.name).names(channels);
        packet.int(x).int(y).int(width).int(height);
        // Channel k begins at value k, and goes on a pixel later.
        (0..channels.len()).for_each(|k| packet.long(k));
        channels.iter().for_each(|_| packet.long(channels.len()));
        packet.floats(values);
        self.put(packet);
    }

    /// Shows a tile.
    pub fn tile(&self, tile: &FinishedTile) {
        let place = [tile.x, tile.y, tile.width, tile.height];
        self.update(&["R", "G", "B"], place, tile.color.as_flattened());
    }

    /// Shows what tiles do not have, and waits until all is sent.
    pub fn finish(self, picture: &Picture) {
        if let Some(alpha) = &picture.alpha {
            self.update(&["A"], [0, 0, picture.width, picture.height], alpha);
        }
        drop(self.packets);
        let _ = self.sender.join();
    }
}

/// A packet that is being written.
struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Packet {
        // The length comes last.
        Packet(vec![0, 0, 0, 0, kind])
    }

    fn byte(&mut self, byte: u8) -> &mut Packet {
        self.0.push(byte);
        self
    }

    fn int(&mut self, number: u32) -> &mut Packet {
        self.0.extend(number.to_le_bytes());
        self
    }

    fn long(&mut self, number: usize) {
        self.0.extend((number as u64).to_le_bytes());
    }

    /// Writes a text; a 0 within would end it.
    fn text(&mut self, text: &str) -> &mut Packet {
        self.0.extend(text.bytes().filter(|byte| *byte != 0));
        self.byte(0)
    }

    fn names(&mut self, names: &[&str]) -> &mut Packet {
        self.int(names.len() as u32);
        for name in names {
            self.text(name);
        }
        self
    }

    fn floats(&mut self, values: &[f32]) {
        self.0
            .extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn finish(mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}
