//! Deferred rays: undecided rays of many beams, collected into full streams.

use crate::accel::STREAM;
use crate::trace::rays::{Rays, Vectors};

/// Up to a stream of rays, with the batch rows of their answers.
pub(in crate::trace) struct DeferredRays {
    rows: [u32; STREAM],
    count: usize,
    org: [[f64; STREAM]; 3],
    dir: [[f64; STREAM]; 3],
    t_min: [f32; STREAM],
    t_max: [f32; STREAM],
}

impl Default for DeferredRays {
    fn default() -> DeferredRays {
        DeferredRays {
            rows: [0; STREAM],
            count: 0,
            org: [[0.0; STREAM]; 3],
            dir: [[0.0; STREAM]; 3],
            t_min: [0.0; STREAM],
            t_max: [-1.0; STREAM],
        }
    }
}

impl DeferredRays {
    pub fn rows(&self) -> &[u32] {
        &self.rows[..self.count]
    }

    pub fn is_full(&self) -> bool {
        self.count == STREAM
    }

    /// Appends a ray; the stream must not be full.
    #[inline(always)]
    pub fn push(&mut self, rays: &Rays, row: usize) {
        let i = self.count;
        self.count += 1;
        self.rows[i] = row as u32;
        let (org, dir) = (rays.org.at(row), rays.dir.at(row));
        for k in 0..3 {
            self.org[k][i] = org[k];
            self.dir[k][i] = dir[k];
        }
        self.t_min[i] = rays.t_min[row];
        self.t_max[i] = rays.t_max[row];
    }

    /// Removes all rays.
    pub fn clear(&mut self) {
        self.t_max[..self.count].fill(-1.0);
        self.count = 0;
    }

    /// Returns the rays in columns, padded to a whole stream.
    pub fn rays(&self) -> Rays<'_> {
        Rays {
            org: Vectors::Double(self.org.each_ref().map(|x| &x[..])),
            dir: Vectors::Double(self.dir.each_ref().map(|x| &x[..])),
            t_min: &self.t_min,
            t_max: &self.t_max,
        }
    }
}
