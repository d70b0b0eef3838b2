//! `render --display`: what a viewer that speaks tev's protocol is sent.

use crate::run::{BALL, fails, folder, lanecast, stderr};
use exr::prelude::{ReadChannels, ReadLayers};
use std::fs;
use std::io::Read;
use std::net::TcpListener;

/// A packet of tev's protocol: what it is, and the rest.
fn packet(stream: &mut impl Read) -> Option<(u8, Vec<u8>)> {
    let mut length = [0; 4];
    stream.read_exact(&mut length).ok()?;
    let mut rest = vec![0; u32::from_le_bytes(length) as usize - 4];
    stream.read_exact(&mut rest).unwrap();
    Some((rest.remove(0), rest))
}

#[test]
fn tev_is_shown_the_picture_that_is_written() {
    const WIDTH: usize = 70;
    const HEIGHT: usize = 40;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let heard = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut packets = Vec::new();
        while let Some(packet) = packet(&mut stream) {
            packets.push(packet);
        }
        packets
    });
    let folder = folder();
    fs::write(folder.path().join("a.toml"), BALL).unwrap();
    let arguments = [
        "render",
        "a.toml",
        "-o",
        "a.exr",
        "--size",
        "70x40",
        "--background",
    ];
    let more = ["transparent", "--display", &address];
    let output = lanecast(folder.path(), &[&arguments[..], &more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let packets = heard.join().unwrap();

    // As tevclient 1.0.4 writes create_image("a.exr", 70, 40).
    let created = b"\x01a.exr\0\x46\0\0\0\x28\0\0\0\x04\0\0\0R\0G\0B\0A\0";
    assert_eq!(packets[0], (4, created.to_vec()));
    let mut shown = vec![[f32::NAN; 4]; WIDTH * HEIGHT];
    for (kind, packet) in &packets[1..] {
        assert_eq!(*kind, 6);
        let packet = packet.strip_prefix(b"\0a.exr\0").unwrap();
        let int = |at: usize| u32::from_le_bytes(packet[at..at + 4].try_into().unwrap()) as usize;
        let long = |at: usize| u64::from_le_bytes(packet[at..at + 8].try_into().unwrap()) as usize;
        let channels = int(0);
        let names = &packet[4..4 + 2 * channels];
        let mut at = 4 + 2 * channels;
        let [x, y, width, height] = [0, 4, 8, 12].map(|k| int(at + k));
        at += 16;
        let values = at + 16 * channels;
        for k in 0..channels {
            let channel = "RGBA"
                .bytes()
                .position(|name| name == names[2 * k])
                .unwrap();
            let (offset, stride) = (long(at + 8 * k), long(at + 8 * (channels + k)));
            for pixel in 0..width * height {
                let from = values + 4 * (offset + pixel * stride);
                let value = f32::from_le_bytes(packet[from..from + 4].try_into().unwrap());
                let place = (y + pixel / width) * WIDTH + x + pixel % width;
                assert!(shown[place][channel].is_nan(), "twice");
                shown[place][channel] = value;
            }
        }
        assert_eq!(packet.len(), values + 4 * channels * width * height);
    }
    let exr = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(folder.path().join("a.exr"))
        .unwrap();
    for (k, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let channels = &exr.layer_data.channel_data.list;
        let channel = channels
            .iter()
            .find(|channel| channel.name.eq(name))
            .unwrap();
        let written: Vec<f32> = channel.sample_data.values_as_f32().collect();
        let shown: Vec<f32> = shown.iter().map(|pixel| pixel[k]).collect();
        assert_eq!(written, shown, "{name}");
    }
}

#[test]
fn a_viewer_that_is_not_there_is_told_before_work() {
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let address: &'static str = free.to_string().leak();
    fails(&["render", "--display", address], 4, "start tev there");
    fails(&["render", "--display", "nowhere"], 4, "HOST:PORT");
}
