//! What the samples of pixels meet first, for mattes.

use super::PathTracer;
use super::state::Paths;
use crate::shade::hit_buffer::HitBuffer;
use crate::trace::HitId;

/// What one sample of a pixel meets first, through holes; [`FirstMet::NOTHING`] for the sky.
#[derive(Clone, Copy, Debug)]
pub struct FirstMet {
    pub instance: u64,
    /// The material's number, that of surfaces without one after the last.
    pub material: u32,
    /// The weight that the pixel filter gives the sample.
    pub weight: f32,
}

impl FirstMet {
    pub const NOTHING: FirstMet = FirstMet {
        instance: u64::MAX,
        material: u32::MAX,
        weight: 0.0,
    };
}

impl PathTracer<'_> {
    /// Notes what paths meet that have come through holes alone, in place of the holes.
    pub(super) fn meet(
        &self,
        met: &mut [FirstMet],
        (wave, open): (&Paths, &[bool]),
        (depth, instance): (u32, &[u64]),
        buffer: &HitBuffer,
    ) {
        for (ray, open) in open.iter().enumerate() {
            let first = &mut met[wave.rays.pixel[ray] as usize];
            if depth == 0 {
                first.weight = wave.rays.weight.row(ray)[0];
            } else if *open && instance[ray] == HitId::NONE.instance {
                first.instance = HitId::NONE.instance;
            }
        }
        for hit in 0..buffer.len() {
            let ray = buffer.row[hit] as usize;
            if open[ray] {
                let first = &mut met[wave.rays.pixel[ray] as usize];
                first.instance = instance[ray];
                first.material = self.materials.number(buffer.material[hit]);
            }
        }
    }
}
