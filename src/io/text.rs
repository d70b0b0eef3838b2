//! Words from a file, made fit for one line of a message or a name.

/// Control characters replaced, cut after `LIMIT` characters: whatever a file
/// holds, a message that quotes it stays one readable line.
pub(super) fn one_line(text: &str) -> String {
    const LIMIT: usize = 160;
    let mut line: String = text
        .chars()
        .take(LIMIT)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    if text.chars().nth(LIMIT).is_some() {
        line.push('…');
    }
    line.trim().into()
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn keeps_one_short_line() {
        assert_eq!(one_line("a\nb\u{7}c\r\n"), "a b c");
        assert_eq!(one_line(&"x".repeat(10_000)).chars().count(), 161);
    }
}
