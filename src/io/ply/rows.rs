//! The values of a PLY file in turn, from text or bytes.

use super::Wrong;
use super::header::Kind;
use crate::shared::messages::one_line;
use crate::shared::text::number;

/// What rows are read from.
pub(super) trait Rows {
    fn begin(&mut self);
    /// Reads a number.
    fn value(&mut self, kind: Kind) -> Result<f64, Wrong>;
    /// Reads the length of a list.
    fn count(&mut self, kind: Kind) -> Result<usize, Wrong>;
    fn end(&mut self) -> Result<(), Wrong>;
}

/// Little-endian or big-endian bytes.
pub(super) struct Binary<'a> {
    rest: &'a [u8],
    big_endian: bool,
}

impl<'a> Binary<'a> {
    pub fn new(rest: &'a [u8], big_endian: bool) -> Binary<'a> {
        Binary { rest, big_endian }
    }
}

impl Rows for Binary<'_> {
    fn begin(&mut self) {}

    #[inline(always)]
    fn value(&mut self, kind: Kind) -> Result<f64, Wrong> {
        let size = kind.size();
        let Some((bytes, rest)) = self.rest.split_at_checked(size) else {
            return Err((None, "the file ends too early".into()));
        };
        self.rest = rest;
        let mut word = [0; 8];
        word[..size].copy_from_slice(bytes);
        if self.big_endian {
            word[..size].reverse();
        }
        let bits = u64::from_le_bytes(word);
        Ok(match kind {
            Kind::Char => f64::from(bits as u8 as i8),
            Kind::UChar => f64::from(bits as u8),
            Kind::Short => f64::from(bits as u16 as i16),
            Kind::UShort => f64::from(bits as u16),
            Kind::Int => f64::from(bits as u32 as i32),
            Kind::UInt => f64::from(bits as u32),
            Kind::Float => f64::from(f32::from_bits(bits as u32)),
            Kind::Double => f64::from_bits(bits),
        })
    }

    fn count(&mut self, kind: Kind) -> Result<usize, Wrong> {
        let count = self.value(kind)?;
        // An item takes a byte at least.
        if count < 0.0 || count > self.rest.len() as f64 {
            let message = format!(
                "a list has {count} items, but only {} bytes follow",
                self.rest.len()
            );
            return Err((None, message));
        }
        Ok(count as usize)
    }

    fn end(&mut self) -> Result<(), Wrong> {
        Ok(())
    }
}

/// Words between blanks and line ends.
pub(super) struct Words<'a> {
    /// What is left of the current line, and of the text after it.
    line: &'a [u8],
    rest: &'a [u8],
    /// The current line, whole, and its number.
    whole: &'a [u8],
    number: usize,
    /// Whether a row ends with its line; words that are left there are not read.
    by_lines: bool,
}

impl<'a> Words<'a> {
    /// Takes a text whose rows are lines that are not blank. `lines` are before it.
    pub fn by_lines(text: &'a [u8], lines: usize) -> Words<'a> {
        Words {
            line: b"",
            rest: text,
            whole: b"",
            number: lines,
            by_lines: true,
        }
    }

    /// Takes a text whose rows go on over lines.
    pub fn in_turn(text: &'a [u8], lines: usize) -> Words<'a> {
        Words {
            by_lines: false,
            ..Words::by_lines(text, lines)
        }
    }

    pub fn is_at_end(&self) -> bool {
        let blank = |text: &[u8]| text.iter().all(|b| b.is_ascii_whitespace() || *b == 0x1a);
        blank(self.line) && blank(self.rest)
    }

    /// Goes on to the next line that is not blank.
    fn next_line(&mut self) {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|b| matches!(b, b'\n' | b'\r'));
            let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
            self.rest = match rest {
                [b'\r', b'\n', rest @ ..] | [_, rest @ ..] => rest,
                [] => rest,
            };
            self.number += 1;
            if !line.trim_ascii().is_empty() {
                (self.line, self.whole) = (line, line);
                return;
            }
        }
        self.line = b"";
    }

    fn wrong(&self, why: impl Fn(&str) -> String) -> Wrong {
        let line = format!("'{}'", one_line(&String::from_utf8_lossy(self.whole)));
        (Some(self.number), why(&line))
    }

    fn word(&mut self) -> Result<&'a str, Wrong> {
        let mut line = self.line.trim_ascii_start();
        if line.is_empty() && !self.by_lines {
            self.next_line();
            line = self.line.trim_ascii_start();
        }
        if line.is_empty() {
            return Err(
                match self.whole.is_empty() || self.line.is_empty() && !self.by_lines {
                    true => (Some(self.number), "the file ends too early".into()),
                    false => {
                        self.wrong(|line| format!("{line} has fewer values than the header says"))
                    }
                },
            );
        }
        let end = line.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = line.split_at(end.unwrap_or(line.len()));
        self.line = rest;
        Ok(std::str::from_utf8(word).unwrap_or("?"))
    }
}

impl Rows for Words<'_> {
    fn begin(&mut self) {
        if self.by_lines {
            self.whole = b"";
            self.next_line();
        }
    }

    #[inline(always)]
    fn value(&mut self, kind: Kind) -> Result<f64, Wrong> {
        let word = self.word()?;
        if let (Kind::Float, Ok(x)) = (kind, word.parse::<f32>()) {
            return Ok(f64::from(x));
        }
        let fits = |x: &f64| match kind.range() {
            None => true,
            Some((low, high)) => x.fract() == 0.0 && (low..=high).contains(x),
        };
        number(word).filter(fits).ok_or_else(|| {
            self.wrong(|line| {
                format!("{line} has a value that is not of the type that the header says")
            })
        })
    }

    fn count(&mut self, kind: Kind) -> Result<usize, Wrong> {
        let count = self.value(kind)?;
        // An item takes two bytes, or one at the end.
        if count < 0.0 || count > (self.line.len() + self.rest.len()) as f64 {
            return Err(self.wrong(|line| {
                format!("{line} begins a list of {count} items, and the file is shorter")
            }));
        }
        Ok(count as usize)
    }

    fn end(&mut self) -> Result<(), Wrong> {
        Ok(())
    }
}
