//! Conversion of byte offsets to lines and columns, for messages only.

/// Returns line and column of the byte at `at`, both from 1; the column counts characters.
/// A carriage return alone ends a line, too. An offset beyond the end gives the place of the
/// end.
pub fn line_column(text: &[u8], at: usize) -> (usize, usize) {
    let before = &text[..at.min(text.len())];
    let ends = |i: &usize| match text[*i] {
        b'\n' => true,
        b'\r' => !matches!(text.get(i + 1), Some(b'\n' | b'\r')),
        _ => false,
    };
    let start = (0..before.len()).rev().find(ends).map_or(0, |i| i + 1);
    let line = (0..before.len()).filter(ends).count() + 1;
    // A UTF-8 character begins at every byte that is not a continuation byte.
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
        assert_eq!(line_column(b"a\rb\r\nc", 5), (3, 1));
    }
}
