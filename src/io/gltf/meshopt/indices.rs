//! Modes 1 and 2: triangles by edges and vertices that came before, and indices by differences.

/// Entries that are remembered.
const REMEMBERED: usize = 16;

/// What was met last, 0 the latest.
struct Recent<T> {
    all: [T; REMEMBERED],
    next: usize,
}

impl<T: Copy + Default> Recent<T> {
    fn new() -> Recent<T> {
        Recent {
            all: [T::default(); REMEMBERED],
            next: 0,
        }
    }

    fn push(&mut self, one: T) {
        self.all[self.next] = one;
        self.next = (self.next + 1) % REMEMBERED;
    }

    fn get(&self, back: u8) -> T {
        self.all[(self.next + 2 * REMEMBERED - 1 - usize::from(back)) % REMEMBERED]
    }
}

/// Bytes that follow each other.
struct Bytes<'d> {
    rest: &'d [u8],
}

impl Bytes<'_> {
    fn byte(&mut self) -> Result<u8, String> {
        let (first, rest) = self
            .rest
            .split_first()
            .ok_or("the stream of indices ends too early")?;
        self.rest = rest;
        Ok(*first)
    }

    /// Reads an unsigned number in steps of 7 bits, the lowest first.
    fn number(&mut self) -> Result<u32, String> {
        let mut number = 0_u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            number |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(number);
            }
        }
        Err("the stream of indices has a number of more than 5 bytes".into())
    }

    /// Reads an index as its difference to `last`, which becomes it.
    fn index(&mut self, last: &mut u32) -> Result<u32, String> {
        let number = self.number()?;
        *last = last.wrapping_add(signed(number));
        Ok(*last)
    }

    fn is_read(&self) -> Result<(), String> {
        match self.rest {
            [] => Ok(()),
            _ => Err("the stream of indices is longer than its indices".into()),
        }
    }
}

/// Decodes a signed number whose sign is its lowest bit.
fn signed(number: u32) -> u32 {
    match number & 1 {
        1 => !(number >> 1),
        _ => number >> 1,
    }
}

/// Checks the first byte, and takes it and the tail away.
fn body(data: &[u8], first: u8, tail: usize) -> Result<(&[u8], &[u8]), String> {
    match data.split_first() {
        Some((byte, rest)) if *byte == first => {
            let split = rest.len().checked_sub(tail);
            let split = split.ok_or("the stream of indices ends too early")?;
            Ok(rest.split_at(split))
        }
        _ => Err("the stream of indices has an unknown version".into()),
    }
}

/// Appends indices of `stride` bytes.
fn append(out: &mut Vec<u8>, indices: &[u32], stride: usize) {
    for index in indices {
        out.extend_from_slice(&index.to_le_bytes()[..stride]);
    }
}

/// Decodes the indices of `count` triangles.
pub(super) fn triangles(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (body, table) = body(data, 0xe1, 16)?;
    let (codes, rest) = body
        .split_at_checked(count)
        .ok_or("the stream of indices ends too early")?;
    let mut bytes = Bytes { rest };
    let mut edges = Recent::<[u32; 2]>::new();
    let mut vertices = Recent::<u32>::new();
    let (mut next, mut last) = (0_u32, 0_u32);
    let mut out = Vec::with_capacity(3 * count * stride);
    let new = |next: &mut u32| {
        let index = *next;
        *next = next.wrapping_add(1);
        index
    };
    for code in codes {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let [a, b] = edges.get(high);
            let c = match low {
                0 => new(&mut next),
                1..=12 => vertices.get(low),
                13 | 14 => {
                    let step = if low == 13 { u32::MAX } else { 1 };
                    last = last.wrapping_add(step);
                    last
                }
                _ => bytes.index(&mut last)?,
            };
            edges.push([c, b]);
            edges.push([a, c]);
            if !(1..=12).contains(&low) {
                vertices.push(c);
            }
            append(&mut out, &[a, b, c], stride);
            continue;
        }
        // Three corners, each a new one, one that was met, or one that is told.
        let pair = match low {
            14 | 15 => bytes.byte()?,
            _ => table[usize::from(low)],
        };
        if low >= 14 && pair == 0 {
            next = 0;
        }
        let a = match low {
            15 => bytes.index(&mut last)?,
            _ => new(&mut next),
        };
        let mut corner = |which: u8| match which {
            0 => Ok(new(&mut next)),
            15 if low < 14 => Err("the stream of indices has a malformed table".to_string()),
            15 => bytes.index(&mut last),
            back => Ok(vertices.get(back - 1)),
        };
        let (of_b, of_c) = (pair >> 4, pair & 15);
        let (b, c) = (corner(of_b)?, corner(of_c)?);
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        vertices.push(a);
        for (which, index) in [(of_b, b), (of_c, c)] {
            if matches!(which, 0 | 15) {
                vertices.push(index);
            }
        }
        append(&mut out, &[a, b, c], stride);
    }
    bytes.is_read().map(|()| out)
}

/// Decodes `count` indices.
pub(super) fn sequence(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (rest, _) = body(data, 0xd1, 4)?;
    let mut bytes = Bytes { rest };
    if count > rest.len() {
        return Err("the stream of indices ends too early".into());
    }
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count * stride);
    for _ in 0..count {
        let number = bytes.number()?;
        let last = &mut last[(number & 1) as usize];
        *last = last.wrapping_add(signed(number >> 1));
        append(&mut out, &[*last], stride);
    }
    bytes.is_read().map(|()| out)
}
