//! Lists of numbers as people and farms write them: `0-99,120` and `1-60:2`; and parts of a job.

use std::ops::Range;

/// The most numbers that ranges may list: those of the tasks of a job, or of its frames.
pub const MOST_NUMBERS: u64 = 10_000_000;

/// Ranges of numbers, in the order in which they were written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ranges {
    /// First, last and step of each.
    Listed(Vec<(u32, u32, u32)>),
    /// To be read from standard input.
    Stdin,
}

impl Ranges {
    /// Reads `A`, `A-B` and `A-B:STEP`, separated by commas.
    pub fn parse(text: &str) -> Result<Ranges, String> {
        let wrong = || {
            format!(
                "'{text}' is no list of numbers; write them and ranges of them, such as 0-99,120 or \
                 1-60:2"
            )
        };
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
        let range = |part: &str| {
            let (range, step) = match part.split_once(':') {
                Some((range, step)) => (range, number(step)?),
                None => (part, 1),
            };
            let (first, last) = match range.split_once('-') {
                Some((first, last)) => (number(first)?, number(last)?),
                None => (number(range)?, number(range)?),
            };
            if first > last {
                return Err(format!(
                    "'{text}' goes from {first} down to {last}; write {last}-{first}"
                ));
            }
            match step > 0 && last < u32::MAX {
                true => Ok((first, last, step)),
                false => Err(wrong()),
            }
        };
        let ranges: Vec<_> = text.split(',').map(range).collect::<Result<_, _>>()?;
        let count = |(first, last, step): &(u32, u32, u32)| u64::from((last - first) / step) + 1;
        match ranges.iter().map(count).sum::<u64>() {
            0..=MOST_NUMBERS => Ok(Ranges::Listed(ranges)),
            more => Err(format!(
                "'{text}' lists {more} numbers; at most {MOST_NUMBERS} are possible"
            )),
        }
    }

    pub fn parse_or_stdin(text: &str) -> Result<Ranges, String> {
        match text {
            "-" => Ok(Ranges::Stdin),
            text => Ranges::parse(text),
        }
    }

    /// Lists the numbers in the order in which they were written.
    pub fn numbers(&self) -> impl Iterator<Item = u32> + '_ {
        let ranges = match self {
            Ranges::Listed(ranges) => &ranges[..],
            Ranges::Stdin => &[],
        };
        let each = |(first, last, step): &(u32, u32, u32)| (*first..=*last).step_by(*step as usize);
        ranges.iter().flat_map(each)
    }
}

/// Reads the numbers of tasks from text: a line each, a number or an object of JSON with `task`.
/// Fails with the line and what is wrong in it.
pub fn numbers_of_lines(text: &str) -> Result<Vec<u32>, String> {
    let mut numbers = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let text = text.trim();
        if text.is_empty() {
            continue;
        }
        let value: Option<serde_json::Value> = serde_json::from_str(text).ok();
        let task = value
            .as_ref()
            .and_then(|v| v.get("task").unwrap_or(v).as_u64());
        match task.and_then(|task| u32::try_from(task).ok()) {
            Some(task) => numbers.push(task),
            None => {
                return Err(format!(
                    "standard input, line {line}: expected the number of a task, or JSON with \
                     \"task\""
                ));
            }
        }
    }
    Ok(numbers)
}

/// The I-th of N parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    part: u32,
    parts: u32,
}

impl Shard {
    pub fn parse(text: &str) -> Result<Shard, String> {
        let number = |text: &str| text.trim().parse::<u32>().ok();
        match text.split_once('/').map(|(i, n)| (number(i), number(n))) {
            Some((Some(part), Some(parts))) if part < parts => Ok(Shard { part, parts }),
            _ => Err("write the part, from 0, and the number of parts, such as 0/4 to 3/4".into()),
        }
    }

    /// Returns the rows of this part. Parts are runs, so that tasks of a scene stay together, and
    /// their lengths differ by at most one.
    pub fn of(self, count: usize) -> Range<usize> {
        let end = |part: u32| (count as u128 * u128::from(part) / u128::from(self.parts)) as usize;
        end(self.part)..end(self.part + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read() {
        let numbers = |text: &str| Ranges::parse(text).map(|r| r.numbers().collect::<Vec<u32>>());
        assert_eq!(numbers("7"), Ok(vec![7]));
        assert_eq!(numbers("1-3, 9"), Ok(vec![1, 2, 3, 9]));
        assert_eq!(numbers("1-6:2,0"), Ok(vec![1, 3, 5, 0]));
        for wrong in ["", "a", "3-1", "1-2:0", "1,", "-1", "1-2-3", "0-4294967295"] {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
        let turned = Ranges::parse("9-3").unwrap_err();
        assert!(turned.contains("write 3-9"), "{turned}");
        let most = Ranges::parse("0-4000000000").unwrap_err();
        assert!(most.contains("at most 10000000"), "{most}");
    }

    #[test]
    fn numbers_come_line_by_line() {
        let read = numbers_of_lines("3\n\n{\"task\": 5, \"x\": 1}\r\n");
        assert_eq!(read, Ok(vec![3, 5]));
        for wrong in ["x", "-1", "{}", "1.5", "{\"task\": \"3\"}", "4294967296"] {
            let said = numbers_of_lines(&format!("1\n{wrong}\n")).unwrap_err();
            assert!(said.contains("line 2"), "{said}");
        }
    }

    #[test]
    fn shards_are_runs_that_cover_all() {
        for (count, parts) in [(0, 3), (1, 4), (10, 3), (12, 4), (5, 5)] {
            let mut next = 0;
            for part in 0..parts {
                let rows = Shard::parse(&format!("{part}/{parts}")).unwrap().of(count);
                assert_eq!(rows.start, next);
                assert!(rows.len().abs_diff(count / parts) <= 1);
                next = rows.end;
            }
            assert_eq!(next, count);
        }
        for wrong in ["", "1", "4/4", "-1/2", "1/0", "a/b"] {
            assert!(Shard::parse(wrong).is_err(), "{wrong}");
        }
    }
}
