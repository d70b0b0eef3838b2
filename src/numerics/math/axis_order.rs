//! An order of summation over the axes that is independent of the axes' names.

/// The order in which a sum over three axes is formed. The axis that stands out comes
/// last. The first two may be exchanged, since a sum of two numbers is commutative (lemma
/// A3, docs/numerics/transforms.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder {
    last: u8,
}

impl AxisOrder {
    /// The order x, y, z.
    pub const NUMBERED: AxisOrder = AxisOrder { last: 2 };

    /// Chooses the order by one size (≥ 0) per axis. The largest stands out; if two sizes
    /// are equal, the third does. If all are equal, or a size is NaN, the order is x, y,
    /// z.
    #[inline(always)]
    pub fn of([x, y, z]: [f64; 3]) -> AxisOrder {
        let last = if y == z && x != y || x > y && x > z && y != z {
            0
        } else if z == x && y != z || y > x && y > z && z != x {
            1
        } else {
            2
        };
        AxisOrder { last }
    }

    /// Permutes values given for x, y and z into this order.
    #[inline(always)]
    pub fn of_axes<T>(self, [x, y, z]: [T; 3]) -> [T; 3] {
        match self.last {
            0 => [y, z, x],
            1 => [z, x, y],
            _ => [x, y, z],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_the_axes_are_called_the_same_one_is_last() {
        let sizes = [
            ([1.0, 2.0, 3.0], 3.0),
            ([0.0, 5.0, 1.0], 5.0),
            ([2.0, 2.0, 7.0], 7.0),
            ([2.0, 2.0, 1.0], 1.0),
            ([0.0, 0.0, 1.0], 1.0),
        ];
        for ([a, b, c], last) in sizes {
            let names = [
                [a, b, c],
                [a, c, b],
                [b, a, c],
                [b, c, a],
                [c, a, b],
                [c, b, a],
            ];
            for sizes in names {
                let ordered = AxisOrder::of(sizes).of_axes(sizes);
                assert_eq!(ordered[2], last, "{sizes:?}");
                let mut both = [sizes, ordered];
                both.iter_mut()
                    .for_each(|sizes| sizes.sort_by(f64::total_cmp));
                assert_eq!(both[0], both[1]);
            }
        }
        for like in [[1.0; 3], [f64::NAN; 3]] {
            assert_eq!(AxisOrder::of(like), AxisOrder::NUMBERED);
        }
    }
}
