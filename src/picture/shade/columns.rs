//! Columns of shading data, read and written one step (a register of lanes) at a time.
//! All lanes here have one width: correctly rounded arithmetic gives the same bits at
//! any width.

use crate::math::Vec3;
use crate::math::lanes::{Lanes, f32x8, f64x8};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::DVec3;

/// f32 lanes, used for colours; [`Doubles`] has the same number of lanes.
pub type Singles = f32x8;
pub type Doubles = f64x8;

/// Number of lanes of a step.
pub const STEP: usize = <Doubles as Lanes>::COUNT;

/// Columns of points, directions or colours. Reads take whole steps, so
/// [`Column3::pad`] has to be called first.
pub struct Column3<'b, L: Lanes>([ArenaVec<'b, L::Scalar>; 3]);

impl<'b, L: Lanes> Column3<'b, L> {
    pub fn with_capacity(rows: usize, arena: &'b Bump) -> Column3<'b, L> {
        let column = |_| ArenaVec::with_capacity_in(rows + STEP, arena);
        Column3(std::array::from_fn(column))
    }

    pub fn truncate(&mut self, rows: usize) {
        self.0.iter_mut().for_each(|column| column.truncate(rows));
    }

    pub fn drop_first(&mut self, rows: usize) {
        for column in &mut self.0 {
            column.drain(..rows);
        }
    }

    /// Resizes the columns; new rows get these values.
    pub fn resize(&mut self, rows: usize, values: [L::Scalar; 3]) {
        for (column, value) in self.0.iter_mut().zip(values) {
            column.resize(rows, value);
        }
    }

    #[inline(always)]
    pub fn push(&mut self, values: [L::Scalar; 3]) {
        for (column, value) in self.0.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// Appends the lanes of a step whose bits in `rows` are set.
    #[inline(always)]
    pub fn push_some(&mut self, step: Vec3<L>, rows: u32) {
        // The columns are written one by one: an array of registers would be spilled to
        // the stack.
        let [x, y, z] = &mut self.0;
        keep_lanes(x, step.x, rows);
        keep_lanes(y, step.y, rows);
        keep_lanes(z, step.z, rows);
    }

    /// Repeats the last row up to a whole step.
    pub fn pad(&mut self) {
        self.0.iter_mut().for_each(pad);
    }

    /// Overwrites the rows behind with row `rows - 1`.
    pub fn repeat_last(&mut self, rows: usize) {
        for column in &mut self.0 {
            repeat_last(column, rows);
        }
    }

    pub fn set(&mut self, row: usize, values: [L::Scalar; 3]) {
        for (column, value) in self.0.iter_mut().zip(values) {
            column[row] = value;
        }
    }

    #[inline(always)]
    pub fn row(&self, row: usize) -> [L::Scalar; 3] {
        let [x, y, z] = &self.0;
        [x[row], y[row], z[row]]
    }

    /// Returns the rows from `first` on.
    pub fn slices(&self, first: usize) -> [&[L::Scalar]; 3] {
        self.0.each_ref().map(|column| &column[first..])
    }

    #[inline(always)]
    pub fn step(&self, first: usize) -> Vec3<L> {
        let [x, y, z] = &self.0;
        Vec3::new(
            L::load(&x[first..]),
            L::load(&y[first..]),
            L::load(&z[first..]),
        )
    }

    /// Gathers rows, in any order.
    #[inline(always)]
    pub fn gather(&self, rows: &[u32; STEP]) -> Vec3<L> {
        let [x, y, z] = &self.0;
        Vec3::new(gather(x, rows), gather(y, rows), gather(z, rows))
    }

    #[inline(always)]
    pub fn set_step(&mut self, first: usize, v: Vec3<L>) {
        let [x, y, z] = &mut self.0;
        v.x.store(&mut x[first..]);
        v.y.store(&mut y[first..]);
        v.z.store(&mut z[first..]);
    }

    /// Scatters to rows in any order; one that repeats gets the last of its values.
    #[inline(always)]
    pub fn scatter(&mut self, rows: &[u32; STEP], v: Vec3<L>) {
        let [x, y, z] = &mut self.0;
        scatter(x, rows, v.x);
        scatter(y, rows, v.y);
        scatter(z, rows, v.z);
    }
}

impl Column3<'_, Doubles> {
    #[inline(always)]
    pub fn get(&self, row: usize) -> DVec3 {
        DVec3::from_array(self.row(row))
    }
}

/// Returns the values of a function at all lanes of a step.
///
/// A loop is inlined where `map` and `from_fn` are calls, whose arguments go through memory.
#[inline(always)]
pub fn each_lane<T: Copy>(value: impl Fn(usize) -> T) -> [T; STEP] {
    let mut values = [value(0); STEP];
    for (lane, one) in values.iter_mut().enumerate().skip(1) {
        *one = value(lane);
    }
    values
}

/// Returns whether the rows are contiguous.
#[inline(always)]
fn adjoin(rows: &[u32; STEP]) -> bool {
    // Without a branch per row, so that it is done in lanes.
    let mut apart = 0;
    for (i, row) in rows.iter().enumerate() {
        apart |= row ^ rows[0].wrapping_add(i as u32);
    }
    apart == 0
}

/// Gathers rows, in any order.
#[inline(always)]
pub fn gather<L: Lanes>(column: &[L::Scalar], rows: &[u32; STEP]) -> L {
    if adjoin(rows) {
        return L::load(&column[rows[0] as usize..]);
    }
    L::load(&each_lane(|i| column[rows[i] as usize]))
}

/// Scatters to rows in any order; one that repeats gets the last of its values.
#[inline(always)]
pub fn scatter<L: Lanes>(column: &mut [L::Scalar], rows: &[u32; STEP], x: L) {
    if adjoin(rows) {
        return x.store(&mut column[rows[0] as usize..]);
    }
    for (row, x) in rows.iter().zip(x.to_array().as_ref()) {
        column[*row as usize] = *x;
    }
}

/// Appends the lanes whose bits are set. A whole step is stored straight into the
/// column: an array on the stack may straddle two cache lines, and the stalled loads
/// cost 1 to 3 % of a picture's time.
#[inline(always)]
fn keep_lanes<L: Lanes>(column: &mut ArenaVec<L::Scalar>, step: L, rows: u32) {
    if rows.trailing_ones() as usize == L::COUNT {
        let first = column.len();
        column.extend_from_slice_copy(L::zero().to_array().as_ref());
        return step.store(&mut column[first..]);
    }
    keep(column, step.to_array().as_ref(), rows);
}

/// Appends the values whose bits are set.
#[inline(always)]
pub fn keep<T: Copy>(column: &mut ArenaVec<T>, values: &[T], rows: u32) {
    if rows.trailing_ones() as usize == values.len() {
        return column.extend_from_slice_copy(values);
    }
    let mut rows = rows;
    while rows != 0 {
        column.push(values[rows.trailing_zeros() as usize]);
        rows &= rows - 1;
    }
}

pub fn pad<T: Copy>(column: &mut ArenaVec<T>) {
    if let Some(last) = column.last().copied() {
        column.resize(column.len().next_multiple_of(STEP), last);
    }
}

/// Overwrites the rows behind with row `len - 1`.
pub fn repeat_last<T: Copy>(column: &mut [T], len: usize) {
    let last = len.checked_sub(1).map(|i| column[i]);
    column[len..].fill_with(|| last.expect("a step has a row"));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(arena: &Bump) -> Column3<'_, Doubles> {
        let mut column = Column3::with_capacity(32, arena);
        column.resize(32, [0.0; 3]);
        column
    }

    #[test]
    fn rows_are_set_and_gathered_whether_they_adjoin_or_not() {
        let arena = Bump::new();
        for rows in [
            [8, 9, 10, 11, 12, 13, 14, 15],
            [0, 2, 3, 4, 5, 6, 7, 8],
            // First and last row are as far apart as in a contiguous step.
            [3, 5, 10, 10, 10, 10, 10, 10],
            [0, 1, 2, 3, 4, 5, 7, 7],
            [8, 10, 9, 11, 12, 13, 14, 15],
            [8, 30, 9, 11, 12, 13, 14, 15],
            [9; STEP],
        ] {
            let values = Doubles::load(&rows.map(f64::from));
            let mut column = column(&arena);
            column.scatter(&rows, Vec3::new(values, -values, values + values));
            for row in 0..32 {
                let set = if rows.contains(&row) {
                    f64::from(row)
                } else {
                    0.0
                };
                let expected = DVec3::new(set, -set, 2.0 * set);
                assert_eq!(column.get(row as usize), expected, "{rows:?}");
            }
            let back = column.gather(&rows);
            assert_eq!(back.y.to_array(), (-values).to_array(), "{rows:?}");
        }
    }
}
