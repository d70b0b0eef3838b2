//! Tells whether a JPEG file is whole: its decoder fills what is missing with grey, and says nothing.

/// What begins a marker, and fills the room before one.
const MARK: u8 = 0xFF;

const START_OF_SCAN: u8 = 0xDA;
const END_OF_IMAGE: u8 = 0xD9;

/// Fails unless the segments and scans of a JPEG file go on to the marker of its end (ITU-T T.81, annex B).
/// What stands after that is not looked at.
pub fn check_end(bytes: &[u8]) -> Result<(), String> {
    match ends(bytes) {
        Some(()) => Ok(()),
        None => Err("its file has no end marker, and may be cut off in the middle of the picture; get it whole, or save it anew".into()),
    }
}

/// Walks from marker to marker; `None` if the file ends before the picture does.
fn ends(bytes: &[u8]) -> Option<()> {
    // The marker of the start stands alone.
    let mut at = 2;
    loop {
        let code = *bytes.get(at + 1)?;
        match (*bytes.get(at)?, code) {
            (MARK, END_OF_IMAGE) => return Some(()),
            // One that fills; one that stands alone; the rest of a scan.
            (MARK, MARK) => at += 1,
            (MARK, 0x00 | 0x01 | 0xD0..=0xD7) => at += 2,
            (MARK, code) => {
                let length = [*bytes.get(at + 2)?, *bytes.get(at + 3)?];
                at += 2 + usize::from(u16::from_be_bytes(length)).max(2);
                // What a scan codes has no marker but those of its restarts.
                if code == START_OF_SCAN {
                    at += bytes.get(at..)?.iter().position(|byte| *byte == MARK)?;
                }
            }
            _ => at += 1 + bytes.get(at + 1..)?.iter().position(|byte| *byte == MARK)?,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{DynamicImage, ImageEncoder};

    #[test]
    fn every_shorter_file_is_told() {
        let (width, height) = (37, 21);
        let color = |i: usize| (i * i / 7 + i * 31) as u8;
        let pixels: Vec<u8> = (0..width * height * 3).map(color).collect();
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90)
            .write_image(
                &pixels,
                width as u32,
                height as u32,
                image::ExtendedColorType::Rgb8,
            )
            .unwrap();
        // A thumbnail, whose own end is none of the picture's.
        let thumbnail = [
            &[0xFF, 0xE1, 0x00, 0x08][..],
            &[0xFF, 0xD8, 0xFF, 0xD9, 0, 0],
        ]
        .concat();
        bytes.splice(2..2, thumbnail);
        assert!(check_end(&bytes).is_ok());
        assert!(check_end(&[&bytes[..], &[1, 2, 3]].concat()).is_ok());
        assert!(
            DynamicImage::from_decoder(
                image::codecs::jpeg::JpegDecoder::new(std::io::Cursor::new(&bytes)).unwrap()
            )
            .is_ok()
        );
        for length in 0..bytes.len() {
            assert!(check_end(&bytes[..length]).is_err(), "{length} bytes");
        }
    }
}
