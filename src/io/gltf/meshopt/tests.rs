//! Streams written out by hand, from the specification.

use super::{filters, indices, vertices};

/// The stream of differences that the specification decodes as an example.
#[test]
fn the_example_of_the_specification() {
    let differences = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
    // One column of 4 bits a row, three of zeros; then the baseline.
    let mut stream = vec![0xa0, 2];
    stream.extend(differences);
    stream.extend([0, 0, 0]);
    stream.extend([0; 28]);
    stream.extend([10, 20, 30, 40]);
    let rows = vertices::decode(&stream, 16, 4).unwrap();
    let expected = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    let mut value = 10_u8;
    for (row, by) in rows.chunks(4).zip(expected) {
        value = value.wrapping_add_signed(by);
        assert_eq!(row, [value, 20, 30, 40]);
    }
    for end in 0..stream.len() {
        assert!(vertices::decode(&stream[..end], 16, 4).is_err(), "{end}");
    }
    stream.insert(2, 0);
    assert!(vertices::decode(&stream, 16, 4).is_err());
}

/// Version 1: two columns as they are, one of single bits, one of zeros; then each channel mode.
#[test]
fn channels_of_the_second_version() {
    let stream = |mode: u8| {
        // Modes of the columns: 3 (bytes), 3 (bytes), 0 (bits), 2 (zeros).
        let mut stream = vec![0xa1, 3 | 3 << 2 | 2 << 6];
        stream.extend([1, 2, 0x80, 0x80]);
        // A group of single bits: 1 is another byte, 0 is 0.
        stream.extend([1, 0b101, 0, 0x22, 0x04]);
        stream.extend([0; 19]);
        stream.extend([1, 2, 3, 4, mode]);
        stream
    };
    let rows = |mode| vertices::decode(&stream(mode), 2, 4).unwrap();
    // Bytes: 1 is −1, 2 is 1, 0x80 is 64, 0x22 is 17.
    assert_eq!(rows(0), [0, 66, 20, 4, 1, 130, 20, 4]);
    // 16 bits: 0x8001 is −0x4001, 0x8002 is 0x4001.
    let half = |x: u16| x.to_le_bytes();
    let first = 0x0201_u16.wrapping_sub(0x4001);
    let [a, b] = half(first);
    let [c, d] = half(first.wrapping_add(0x4001));
    let [e, f] = half(0x0403 + 0x11);
    assert_eq!(rows(1), [a, b, e, f, c, d, e, f]);
    // Bits: turned to the left by 4 when they were encoded.
    let first = 0x0403_0201_u32 ^ 0x0022_8001_u32.rotate_right(4);
    let second = first ^ 0x0000_8002_u32.rotate_right(4);
    assert_eq!(
        rows(0x42),
        [first.to_le_bytes(), second.to_le_bytes()].concat()
    );
    for wrong in [3, 0x10, 0x21 | 1] {
        assert!(vertices::decode(&stream(wrong), 2, 4).is_err(), "{wrong}");
    }
}

#[test]
fn triangles_by_what_was_met() {
    let mut stream = vec![0xe1];
    // New: 0 1 2; edge (2, 1)… with a new one; the same edge with a vertex met before; one told.
    stream.extend([0xf0, 0x10, 0x02, 0x0f, 0xfe, 0x0e]);
    // −2 from 0 for the first one told; then a pair: b was met 1 before, c is told.
    stream.extend([0x14, 0x1f, 0x02]);
    stream.extend([0; 16]);
    let found = indices::triangles(&stream, 6, 4).unwrap();
    let found: Vec<u32> = found
        .chunks(4)
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    // Edges, the latest first, after (0, 1, 2): (0 2), (2 1), (1 0).
    let expected = [
        [0, 1, 2],
        [2, 1, 3],
        // (2 3): vertices 3, 2, 1.
        [2, 3, 1],
        [2, 1, 10],
        // New 4, the last vertex but none: 10, and 10 + 1.
        [4, 10, 11],
        // (4 11) and the one after 11.
        [4, 11, 12],
    ];
    assert_eq!(found, expected.concat());
    for end in 0..stream.len() {
        assert!(indices::triangles(&stream[..end], 6, 4).is_err(), "{end}");
    }
}

#[test]
fn indices_by_two_baselines() {
    // +3 and +100 on the two; −1 and +1.
    let stream = [0xd1, 0x0c, 0x91, 0x03, 0x02, 0x05, 0, 0, 0, 0];
    let found = indices::sequence(&stream, 4, 2).unwrap();
    assert_eq!(found, [3, 0, 100, 0, 2, 0, 101, 0]);
    for end in 0..stream.len() {
        assert!(indices::sequence(&stream[..end], 4, 2).is_err(), "{end}");
    }
    let endless = [0xd1, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0, 0];
    assert!(indices::sequence(&endless, 1, 2).is_err());
}

#[test]
fn filters_restore_what_is_meant() {
    let filtered = |filter: &str, row: &[u8]| {
        let mut row = row.to_vec();
        let stride = row.len();
        filters::apply(filter, &mut row, stride).map(|()| row)
    };
    let shorts = |all: [i16; 4]| all.map(i16::to_le_bytes).concat();
    // The axes, and the middle of a face below: (−1, −1, −1)/√3.
    let oct = |x: i16, y: i16| filtered("OCTAHEDRAL", &shorts([x, y, 511, 7])).unwrap();
    assert_eq!(oct(0, 0), shorts([0, 0, 32_767, 7]));
    assert_eq!(oct(511, 0), shorts([32_767, 0, 0, 7]));
    assert_eq!(oct(-511, -511), shorts([0, 0, -32_767, 7]));
    let bytes = filtered("OCTAHEDRAL", &[0, 129, 127, 9]).unwrap();
    assert_eq!(bytes, [0, 129, 0, 9]);
    // A turn by 90° about z, w being left out, and the same with z left out.
    let part = (2047.0 * 1.0_f64).round() as i16;
    let w = filtered("QUATERNION", &shorts([0, 0, part, 2047 & !3 | 3])).unwrap();
    let half = (0.5_f64.sqrt() * 32_767.0).round() as i16;
    let found: Vec<i16> = w
        .chunks(2)
        .map(|b| i16::from_le_bytes([b[0], b[1]]))
        .collect();
    assert!(
        (found[2] - half).abs() <= 1 && (found[3] - half).abs() <= 1,
        "{found:?}"
    );
    assert_eq!(found[..2], [0, 0]);
    let number = |e: i32, m: i32| ((e << 24) | (m & 0xff_ffff)).to_le_bytes();
    for (e, m) in [(0, 1), (-3, -5), (100, 0x7f_ffff), (-100, -0x80_0000)] {
        let found = filtered("EXPONENTIAL", &number(e, m)).unwrap();
        let found = f32::from_le_bytes(found.try_into().unwrap());
        assert_eq!(f64::from(found), f64::from(m) * 2_f64.powi(e), "{e} {m}");
    }
    // Grey, and red: luma ¼ + …, of 8 bits.
    assert_eq!(
        filtered("COLOR", &[100, 0, 0, 255]).unwrap(),
        [100, 100, 100, 255]
    );
    assert_eq!(
        filtered("COLOR", &[64, 127, 192, 255]).unwrap(),
        [255, 0, 1, 255]
    );
    // Of 6 bits: 32/63.
    assert_eq!(
        filtered("COLOR", &[32, 0, 0, 63]).unwrap(),
        [130, 130, 130, 255]
    );
    assert!(filtered("COLOR", &[0; 12]).is_err());
    assert!(filtered("SHARPEN", &[0; 4]).is_err());
    for filter in ["OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] {
        filtered(filter, &[0; 8]).unwrap();
        filtered(filter, &[255; 8]).unwrap();
    }
}
