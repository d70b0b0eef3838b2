//! Masks as COCO writes them: lengths of runs, column by column, the first of what is not in the
//! mask; and these lengths as text.

/// Returns the lengths of a mask's runs. The mask is row by row, its runs are column by column, by
/// turns outside and inside, the first outside and perhaps 0.
pub fn runs(mask: &[bool], width: usize) -> Vec<u32> {
    let height = mask.len() / width.max(1);
    let (mut runs, mut length, mut inside) = (Vec::new(), 0, false);
    for x in 0..width {
        for y in 0..height {
            if mask[y * width + x] != inside {
                runs.push(length);
                (length, inside) = (0, !inside);
            }
            length += 1;
        }
    }
    runs.push(length);
    runs
}

/// Writes lengths of runs as COCO's text: from the fourth on each as the difference to that two
/// before it; numbers of 5 bits a letter, the lowest first, a sixth bit where more follow, from '0'
/// on.
pub fn text(runs: &[u32]) -> String {
    let mut text = String::new();
    for (i, run) in runs.iter().enumerate() {
        let before = if i > 2 { runs[i - 2] } else { 0 };
        let mut rest = i64::from(*run) - i64::from(before);
        loop {
            let low = (rest & 0x1f) as u8;
            rest >>= 5;
            // The fifth bit is the sign of the last letter.
            let is_last = rest == if low & 0x10 == 0 { 0 } else { -1 };
            text.push(char::from(48 + (low | if is_last { 0 } else { 0x20 })));
            if is_last {
                break;
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_picture::render::mix;

    /// Reads text back, by the definition.
    fn read(text: &str) -> Vec<u32> {
        let mut runs: Vec<u32> = Vec::new();
        let mut letters = text.bytes();
        while let Some(mut letter) = letters.next() {
            let (mut number, mut shift) = (0_i64, 0);
            loop {
                let code = i64::from(letter - 48);
                number |= (code & 0x1f) << shift;
                shift += 5;
                if code & 0x20 == 0 {
                    if code & 0x10 != 0 {
                        number |= -1 << shift;
                    }
                    break;
                }
                letter = letters.next().unwrap();
            }
            if runs.len() > 2 {
                number += i64::from(runs[runs.len() - 2]);
            }
            runs.push(u32::try_from(number).unwrap());
        }
        runs
    }

    fn painted(runs: &[u32], width: usize, height: usize) -> Vec<bool> {
        let mut columns = Vec::new();
        for (i, run) in runs.iter().enumerate() {
            columns.extend(std::iter::repeat_n(i % 2 == 1, *run as usize));
        }
        let at = |i: usize| columns[i % width * height + i / width];
        (0..width * height).map(at).collect()
    }

    #[test]
    fn masks_come_back() {
        for seed in 0..200_u64 {
            let (width, height) = (
                1 + (mix(seed) % 40) as usize,
                1 + (mix(!seed) % 40) as usize,
            );
            let share = mix(seed ^ 99) % 100;
            let is = |i: usize| mix(seed << 20 | i as u64) % 100 < share;
            let mask: Vec<bool> = (0..width * height).map(is).collect();
            let runs = runs(&mask, width);
            assert_eq!(runs.iter().sum::<u32>() as usize, mask.len());
            assert_eq!(read(&text(&runs)), runs);
            assert!(painted(&runs, width, height) == mask);
        }
    }

    #[test]
    fn a_known_mask_has_its_known_text() {
        // Two rows of three: the middle column, which is the third and fourth of its pixels.
        let mask = [false, true, false, false, true, false];
        assert_eq!(runs(&mask, 3), [2, 2, 2]);
        assert_eq!(text(&[2, 2, 2]), "222");
        assert_eq!(runs(&[true, true], 2), [0, 2]);
        assert_eq!(text(&[0, 1000]), "0Xo0");
        // A difference below 0: 1 - 4.
        assert_eq!(text(&[0, 4, 5, 1]), "045M");
    }
}
