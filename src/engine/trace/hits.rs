//! Hits of closest-hit queries in columns.

use super::query::HitId;
use std::ops::Range;

/// Hit columns, a row per ray.
pub struct Hits<'a> {
    pub t: Depths<'a>,
    pub id: Ids<'a>,
}

/// Column of t: computed at the query's precision and converted to the column's. Undefined
/// without a hit.
pub enum Depths<'a> {
    Single(&'a mut [f32]),
    Double(&'a mut [f64]),
}

/// Columns of ids; [`HitId::NONE`] without a hit.
pub struct Ids<'a> {
    pub instance: &'a mut [u64],
    pub primitive: &'a mut [u32],
}

/// Owned columns of ids.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HitIds {
    pub instance: Vec<u64>,
    pub primitive: Vec<u32>,
}

impl Hits<'_> {
    pub fn len(&self) -> usize {
        self.id.instance.len()
    }

    pub fn is_empty(&self) -> bool {
        self.id.instance.is_empty()
    }

    /// Returns the columns of some rows.
    pub fn rows(&mut self, range: Range<usize>) -> Hits<'_> {
        Hits {
            t: self.t.rows(range.clone()),
            id: self.id.rows(range),
        }
    }
}

impl Depths<'_> {
    fn rows(&mut self, range: Range<usize>) -> Depths<'_> {
        match self {
            Depths::Single(t) => Depths::Single(&mut t[range]),
            Depths::Double(t) => Depths::Double(&mut t[range]),
        }
    }
}

impl Ids<'_> {
    #[inline(always)]
    pub fn get(&self, i: usize) -> HitId {
        HitId {
            instance: self.instance[i],
            primitive: self.primitive[i],
        }
    }

    fn rows(&mut self, range: Range<usize>) -> Ids<'_> {
        Ids {
            instance: &mut self.instance[range.clone()],
            primitive: &mut self.primitive[range],
        }
    }
}

impl HitIds {
    /// Makes `rows` rows without a hit.
    pub fn none(rows: usize) -> HitIds {
        let mut ids = HitIds::default();
        ids.resize(rows);
        ids
    }

    /// Changes the number of rows; new rows have no hit.
    pub fn resize(&mut self, rows: usize) {
        self.instance.resize(rows, HitId::NONE.instance);
        self.primitive.resize(rows, HitId::NONE.primitive);
    }

    pub fn len(&self) -> usize {
        self.instance.len()
    }

    pub fn is_empty(&self) -> bool {
        self.instance.is_empty()
    }

    /// Counts the rows with a hit.
    pub fn hits(&self) -> usize {
        // The instance id suffices.
        let hits = self.instance.iter().filter(|x| **x != HitId::NONE.instance);
        hits.count()
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> HitId {
        HitId {
            instance: self.instance[i],
            primitive: self.primitive[i],
        }
    }

    pub fn set(&mut self, i: usize, id: HitId) {
        self.instance[i] = id.instance;
        self.primitive[i] = id.primitive;
    }

    pub fn iter(&self) -> impl ExactSizeIterator<Item = HitId> {
        (0..self.len()).map(|i| self.get(i))
    }

    pub fn columns(&mut self) -> Ids<'_> {
        Ids {
            instance: &mut self.instance,
            primitive: &mut self.primitive,
        }
    }
}

impl FromIterator<HitId> for HitIds {
    fn from_iter<I: IntoIterator<Item = HitId>>(ids: I) -> HitIds {
        let ids = ids.into_iter().map(|id| (id.instance, id.primitive));
        let (instance, primitive) = ids.unzip();
        HitIds {
            instance,
            primitive,
        }
    }
}
