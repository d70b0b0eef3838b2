//! An order of the axes that turns with what it is made from.

/// In which order a sum over the axes goes: last comes the axis that stands out, and
/// the first two are alike, for two numbers may change places in a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder {
    last: u8,
}

impl AxisOrder {
    /// As the axes are numbered.
    pub const NUMBERED: AxisOrder = AxisOrder { last: 2 };

    /// By a size of each, ≥ 0. The largest stands out, or, where two are equal, the
    /// third. Where all are, and of what is not a number, the axes are taken as they
    /// are numbered.
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

    /// What belongs to x, y and z, in this order.
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
