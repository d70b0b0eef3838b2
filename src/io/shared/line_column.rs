//! Lines and columns, from byte offsets, for messages only.

/// Line and column of a byte, both from 1; the column counts characters.
pub fn line_column(text: &[u8], at: usize) -> (usize, usize) {
    let before = &text[..at.min(text.len())];
    let start = before
        .iter()
        .rposition(|b| *b == b'\n')
        .map_or(0, |i| i + 1);
    let line = before.iter().filter(|b| **b == b'\n').count() + 1;
    // Every byte that does not continue a UTF-8 character begins one.
    let begins = |b: &&u8| **b & 0xc0 != 0x80;
    let column = before[start..].iter().filter(begins).count() + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::line_column;

    #[test]
    fn places_count_lines_and_characters_from_one() {
        let text = "ab\nçd\n".as_bytes();
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, 2), (1, 3));
        assert_eq!(line_column(text, 3), (2, 1));
        assert_eq!(line_column(text, 5), (2, 2));
        assert_eq!(line_column(text, 99), (3, 1));
    }
}
