//! A density over the unit square that is constant in each of 4ᵏ cells, sampled from the
//! whole to the cell: hierarchical sample warping, Clarberg, Jarosz, Akenine-Möller and Jensen
//! 2005, "Wavelet Importance Sampling", section 4.2.
//!
//! Each level divides the square by rows, then the row by columns, and stretches the numbers
//! that chose; so points that are spread well stay so.

use lanecast_numerics::math::lanes::{Lanes, Mask};

/// The shares of one node: of its lower row, and of the left cell in each row.
type Shares = [f32; 3];

/// A density over the unit square.
#[derive(Clone, Debug)]
pub struct QuadTree {
    levels: u32,
    /// Nodes level by level; the children of node k of a level are 4k + column + 2·row of the
    /// next.
    shares: Vec<Shares>,
    /// The density of each cell, of mean 1, row by row.
    density: Vec<f32>,
}

/// A cell is entered this far from its upper end at most, so that rounding leaves it there.
const WITHIN: f32 = 1.0 - 1.0 / 1024.0;
const LESS_THAN_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

impl QuadTree {
    /// Builds the tree of 2ᵏ × 2ᵏ weights ≥ 0, row by row, of which one is positive.
    pub fn new(levels: u32, weights: &[f64]) -> QuadTree {
        let side = 1_usize << levels;
        assert_eq!(weights.len(), side * side, "a weight for each cell");
        // Sums of each level, in the order of the nodes.
        let mut sums = vec![Vec::new(); levels as usize + 1];
        sums[levels as usize] = (0..side * side)
            .map(|k| {
                let [x, y] = cell(k);
                weights[y * side + x]
            })
            .collect();
        for level in (0..levels as usize).rev() {
            sums[level] = sums[level + 1]
                .chunks_exact(4)
                .map(|c| c.iter().sum())
                .collect();
        }
        let mean = sums[0][0] / weights.len() as f64;
        let part = |a: f64, b: f64| {
            if a + b > 0.0 {
                (a / (a + b)) as f32
            } else {
                0.5
            }
        };
        let below = &sums[1..];
        let shares = below
            .iter()
            .flat_map(|level| level.chunks_exact(4))
            .map(|c| {
                [
                    part(c[0] + c[1], c[2] + c[3]),
                    part(c[0], c[1]),
                    part(c[2], c[3]),
                ]
            });
        QuadTree {
            levels,
            shares: shares.collect(),
            density: weights.iter().map(|w| (w / mean) as f32).collect(),
        }
    }

    /// Returns the bytes of the tree.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.shares) + size_of_val(&*self.density)
    }

    /// Maps points of the unit square to points of this density.
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(&self, u: [L; 2]) -> [L; 2] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let [mut u, mut v] = u;
        let [mut x, mut y] = [zero; 2];
        let mut nodes = L::ids(0);
        let mut first = 0;
        for level in 0..self.levels {
            let shares = |k: usize| {
                let mut lanes = zero.to_array();
                for (lane, &node) in lanes.as_mut().iter_mut().zip(nodes.as_ref()) {
                    *lane = self.shares[first + node as usize][k];
                }
                L::load(lanes.as_ref())
            };
            let (rows, low, high) = (shares(0), shares(1), shares(2));
            let up = v.ge(rows);
            v = stretch(v, rows, up);
            let columns = L::select(up, high, low);
            let right = u.ge(columns);
            u = stretch(u, columns, right);
            x = x + x + L::select(right, one, zero);
            y = y + y + L::select(up, one, zero);
            let (up, right) = (up.bits(), right.bits());
            for (lane, node) in nodes.as_mut().iter_mut().enumerate() {
                *node = 4 * *node + (right >> lane & 1) + 2 * (up >> lane & 1);
            }
            first += 1 << (2 * level);
        }
        let side = L::splat(1.0 / (1_u32 << self.levels) as f32);
        let within = L::splat(WITHIN);
        [(x + u.min(within)) * side, (y + v.min(within)) * side]
    }

    /// Returns the density at points of the unit square.
    #[inline(always)]
    pub fn density<L: Lanes<Scalar = f32>>(&self, at: [L; 2]) -> L {
        let side = 1_usize << self.levels;
        let scale = side as f32;
        let [x, y] = at.map(L::to_array);
        let mut out = L::zero().to_array();
        let places = x.as_ref().iter().zip(y.as_ref());
        for (out, (&x, &y)) in out.as_mut().iter_mut().zip(places) {
            let [x, y] = [x, y].map(|x| ((x * scale) as usize).min(side - 1));
            *out = self.density[y * side + x];
        }
        L::load(out.as_ref())
    }
}

/// Stretches what is left of a number after it chose a side of `share`.
#[inline(always)]
fn stretch<L: Lanes<Scalar = f32>>(u: L, share: L, second: L::Mask) -> L {
    let one = L::splat(1.0);
    let from = L::select(second, u - share, u);
    let width = L::select(second, one - share, share);
    let left = from / width.max(L::splat(f32::MIN_POSITIVE));
    left.min(L::splat(LESS_THAN_ONE))
}

/// Returns column and row of a cell from its place in the order of nodes.
fn cell(k: usize) -> [usize; 2] {
    let mut at = [0, 0];
    for bit in 0..usize::BITS / 2 {
        at[0] |= (k >> (2 * bit) & 1) << bit;
        at[1] |= (k >> (2 * bit + 1) & 1) << bit;
    }
    at
}
