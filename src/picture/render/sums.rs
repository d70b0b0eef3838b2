//! Sums of a pixel's samples: in f64, by halves, in the order of sample numbers. Samples 0 to
//! 127 are the sum of 0 to 63 and 64 to 127, each summed likewise, so that parts of a picture
//! rendered apart add up to the same bits, and the rounding error grows with the logarithm of
//! the count (pairwise summation).

use crate::shade::path::Slot;
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

/// Sums of the samples of a tile's pixels.
pub struct Sums<'b> {
    /// By level l: the sums of the last complete 2^l samples, where bit l of `count` is set.
    levels: ArenaVec<'b, &'b mut [[f64; 4]]>,
    pixels: usize,
    count: u32,
    arena: &'b Bump,
}

impl<'b> Sums<'b> {
    pub fn new(pixels: usize, arena: &'b Bump) -> Sums<'b> {
        Sums {
            levels: ArenaVec::with_capacity_in(32, arena),
            pixels,
            count: 0,
            arena,
        }
    }

    /// Adds the next sample of every pixel.
    pub fn add(&mut self, slots: &[Slot]) {
        let full = self.count.trailing_ones() as usize;
        if self.levels.len() <= full {
            let level = self.arena.alloc_slice_fill_copy(self.pixels, [0.0; 4]);
            self.levels.push(level);
        }
        let (below, above) = self.levels.split_at_mut(full);
        for (pixel, (sum, slot)) in above[0].iter_mut().zip(slots).enumerate() {
            let mut carry = slot.map(f64::from);
            for level in below.iter() {
                carry = plus(level[pixel], carry);
            }
            *sum = carry;
        }
        self.count += 1;
    }

    /// Returns the number of pixels.
    pub fn pixels(&self) -> usize {
        self.pixels
    }

    /// Returns the number of samples.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Returns the sum of a pixel's samples.
    pub fn of(&self, pixel: usize) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for (number, level) in self.levels.iter().enumerate() {
            if self.count >> number & 1 != 0 {
                sum = plus(level[pixel], sum);
            }
        }
        sum
    }

    /// Returns the mean of a pixel's samples.
    pub fn mean(&self, pixel: usize) -> Slot {
        let share = 1.0 / f64::from(self.count.max(1));
        self.of(pixel).map(|sum| (sum * share) as f32)
    }
}

pub fn plus(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|k| a[k] + b[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum_of(samples: impl Iterator<Item = f32>) -> f64 {
        let arena = Bump::new();
        let mut sums = Sums::new(1, &arena);
        samples.for_each(|x| sums.add(&[[x, 0.0, -x, 1.0]]));
        assert_eq!(sums.of(0)[2], -sums.of(0)[0]);
        sums.of(0)[0]
    }

    #[test]
    fn halves_add_up_to_the_whole() {
        let of = |i: u32| (f64::from(i).sin() * 1e6).exp2() as f32 + 1.0 / (i as f32 + 1.0);
        for half in [1, 2, 64, 512] {
            let whole = sum_of((0..2 * half).map(of));
            let parts = sum_of((0..half).map(of)) + sum_of((half..2 * half).map(of));
            assert_eq!(whole, parts, "{half}");
        }
    }

    #[test]
    fn any_count_is_summed() {
        for count in 1..70 {
            let sum = sum_of((1..=count).map(|i| i as f32));
            assert_eq!(sum, f64::from(count * (count + 1) / 2));
        }
    }
}
