//! The columns of a picture as bytes, and copied into those of a larger one.

use crate::{Layer, Matte, Picture};
use std::collections::TryReserveError;

/// What a column has of a pixel: words of 32 bits.
pub trait Cell: Copy + Default {
    const WORDS: usize;

    /// Appends the words.
    fn put(self, to: &mut Vec<u8>);

    /// Reads [`Cell::WORDS`] words.
    fn get(words: &[u32]) -> Self;
}

impl Cell for u32 {
    const WORDS: usize = 1;

    fn put(self, to: &mut Vec<u8>) {
        to.extend(self.to_le_bytes());
    }

    fn get(words: &[u32]) -> u32 {
        words[0]
    }
}

impl Cell for f32 {
    const WORDS: usize = 1;

    fn put(self, to: &mut Vec<u8>) {
        self.to_bits().put(to);
    }

    fn get(words: &[u32]) -> f32 {
        f32::from_bits(words[0])
    }
}

impl Cell for u64 {
    const WORDS: usize = 2;

    fn put(self, to: &mut Vec<u8>) {
        to.extend(self.to_le_bytes());
    }

    fn get(words: &[u32]) -> u64 {
        u64::from(words[0]) | u64::from(words[1]) << 32
    }
}

impl<const N: usize> Cell for [f32; N]
where
    [f32; N]: Default,
{
    const WORDS: usize = N;

    fn put(self, to: &mut Vec<u8>) {
        self.into_iter().for_each(|x| x.put(to));
    }

    fn get(words: &[u32]) -> [f32; N] {
        std::array::from_fn(|k| f32::from_bits(words[k]))
    }
}

/// Calls a macro with the bit in a file and the name of each column that a picture may lack; they
/// differ in type.
macro_rules! each_column {
    ($column:ident) => {
        $column!(0, alpha);
        $column!(1, depth);
        $column!(2, position);
        $column!(3, normal);
        $column!(4, albedo);
        $column!(5, instance_id);
        $column!(6, primitive_id);
        $column!(7, samples);
        $column!(8, distance);
        $column!(9, geometric_normal);
        $column!(10, camera_normal);
        $column!(11, uv);
        $column!(12, vector);
        $column!(13, motion);
        $column!(14, variance);
    };
}
pub(super) use each_column;

/// A rectangle of a picture of a width, whose pixels are those of a smaller picture.
#[derive(Clone, Copy)]
pub struct Place {
    pub corner: (u32, u32),
    pub size: (u32, u32),
    /// Of the larger picture.
    pub whole: (u32, u32),
}

impl Place {
    /// Copies rows of `cells` a pixel. `to` is made first if it is empty.
    fn copy<T: Cell>(
        self,
        from: &[T],
        to: &mut Vec<T>,
        cells: usize,
    ) -> Result<(), TryReserveError> {
        let [width, wide] = [self.size.0, self.whole.0].map(|n| n as usize * cells);
        if to.is_empty() {
            let len = wide * self.whole.1 as usize;
            to.try_reserve_exact(len)?;
            to.resize(len, T::default());
        }
        for (row, from) in from.chunks_exact(width).enumerate() {
            let first = (self.corner.1 as usize + row) * wide + self.corner.0 as usize * cells;
            to[first..first + width].copy_from_slice(from);
        }
        Ok(())
    }

    /// Copies all that the picture `from` has into the larger one, which gets its columns by the first.
    /// Fails if memory does not suffice.
    pub fn put(self, from: &Picture, to: &mut Picture) -> Result<(), TryReserveError> {
        self.copy(&from.color, &mut to.color, 1)?;
        macro_rules! column {
            ($bit:expr, $name:ident) => {
                if let Some(from) = &from.$name {
                    self.copy(from, to.$name.get_or_insert_default(), 1)?;
                }
            };
        }
        each_column!(column);
        for (number, layer) in from.layers.iter().enumerate() {
            if to.layers.len() == number {
                to.layers.push(Layer {
                    name: layer.name.clone(),
                    color: Vec::new(),
                });
            }
            self.copy(&layer.color, &mut to.layers[number].color, 1)?;
        }
        for (number, matte) in from.mattes.iter().enumerate() {
            if to.mattes.len() == number {
                to.mattes.push(Matte {
                    rows: Vec::new(),
                    manifest: Default::default(),
                    ..*matte
                });
            }
            let whole = &mut to.mattes[number];
            self.copy(&matte.rows, &mut whole.rows, matte.ranks as usize)?;
            whole.manifest.extend(matte.manifest.clone());
        }
        Ok(())
    }
}
