//! Traces an array of rays to an array of answers with Embree.
//!
//! Chunks and pool are the same as for our kernels ([`crate::queries`]).
//! Inside a chunk, rays are copied into Embree's layout and traced, and t and id are
//! copied out. All of that is timed, as it is for ours.

use super::ffi::{self, Aligned16, Aligned64, Context, PacketCall, RayHitN, RayN};
use super::{Call, Mode, Tree};
use crate::queries::{Answers, Ask};
use lanecast_engine::trace::{Depths, Hits, Ids};
use lanecast_io::RaySet;
use lanecast_picture::render::Progress;
use rayon::prelude::*;
use std::arch::asm;
use std::ops::Range;

/// Rays per chunk; whole streams of any length.
const CHUNK: usize = 8192;

impl Tree {
    /// Traces all rays on the current rayon pool. Returns `None` if cancelled.
    pub(super) fn trace(
        &self,
        mode: Mode,
        rays: &RaySet,
        ask: Ask,
        answers: &mut Answers,
        progress: &Progress,
    ) -> Option<()> {
        answers.prepare(ask, rays.len());
        let rows = |number: usize, count: usize| number * CHUNK..number * CHUNK + count;
        match ask {
            Ask::Closest => {
                let chunks = answers.hit_chunks(CHUNK).enumerate();
                chunks.for_each(|(number, hits)| {
                    if !progress.is_cancelled() {
                        let chunk = Chunk::new(rays, rows(number, hits.len()));
                        if let Some(to) = Found::single(hits) {
                            flushing_denormals(|| self.closest(mode, &chunk, to));
                        }
                    }
                });
            }
            Ask::Any => {
                let chunks = answers.blocked.par_chunks_mut(CHUNK).enumerate();
                chunks.for_each(|(number, blocked)| {
                    if !progress.is_cancelled() {
                        let chunk = Chunk::new(rays, rows(number, blocked.len()));
                        flushing_denormals(|| self.any(mode, &chunk, blocked));
                    }
                });
            }
        }
        (!progress.is_cancelled()).then_some(())
    }

    fn closest(&self, mode: Mode, rays: &Chunk, to: Found) {
        let mut context = Context::new(if mode.coherent { ffi::COHERENT } else { 0 });
        match mode.call {
            Call::Single => self.singles(&mut context, rays, to),
            Call::Packet(4) => self.packets::<4>(ffi::rtcIntersect4, &mut context, rays, to),
            Call::Packet(8) => self.packets::<8>(ffi::rtcIntersect8, &mut context, rays, to),
            Call::Packet(_) => self.packets::<16>(ffi::rtcIntersect16, &mut context, rays, to),
            Call::Stream(count) => self.stream(&mut context, rays, count, to),
            Call::PacketStream(count) => self.packet_stream(&mut context, rays, count, to),
        }
    }

    fn any(&self, mode: Mode, rays: &Chunk, blocked: &mut [bool]) {
        let mut context = Context::new(if mode.coherent { ffi::COHERENT } else { 0 });
        let context = &mut context;
        match mode.call {
            Call::Single => self.single_shadows(context, rays, blocked),
            Call::Packet(4) => self.shadows::<4>(ffi::rtcOccluded4, context, rays, blocked),
            Call::Packet(8) => self.shadows::<8>(ffi::rtcOccluded8, context, rays, blocked),
            Call::Packet(_) => self.shadows::<16>(ffi::rtcOccluded16, context, rays, blocked),
            Call::Stream(count) => self.shadow_stream(context, rays, count, blocked),
            Call::PacketStream(count) => self.shadow_packets(context, rays, count, blocked),
        }
    }

    fn singles(&self, context: &mut Context, rays: &Chunk, mut to: Found) {
        for i in 0..to.t.len() {
            let mut own = Aligned16(RayHitN::<1>::EMPTY);
            rays.fill(i, &mut own.0.ray);
            // SAFETY: scene and context live; the ray has RTCRayHit's layout.
            unsafe { ffi::rtcIntersect1(self.scene, context, (&raw mut own).cast()) };
            to.put(i, &own.0);
        }
    }

    fn single_shadows(&self, context: &mut Context, rays: &Chunk, blocked: &mut [bool]) {
        for (i, blocked) in blocked.iter_mut().enumerate() {
            let mut own = Aligned16(RayN::<1>::EMPTY);
            rays.fill(i, &mut own.0);
            // SAFETY: scene and context live; the ray has RTCRay's layout.
            unsafe { ffi::rtcOccluded1(self.scene, context, (&raw mut own).cast()) };
            *blocked = is_blocked(own.0.t_far[0]);
        }
    }

    fn packets<const N: usize>(
        &self,
        call: PacketCall,
        context: &mut Context,
        rays: &Chunk,
        mut to: Found,
    ) {
        for first in (0..to.t.len()).step_by(N) {
            let mut own = Aligned64(RayHitN::<N>::EMPTY);
            let valid = Aligned64(rays.fill(first, &mut own.0.ray));
            // SAFETY: scene and context live; `valid` has N numbers and the rays
            // the layout of RTCRayHitN, where N is that of the call.
            unsafe {
                call(
                    (&raw const valid).cast(),
                    self.scene,
                    context,
                    (&raw mut own).cast(),
                );
            }
            to.put(first, &own.0);
        }
    }

    fn shadows<const N: usize>(
        &self,
        call: PacketCall,
        context: &mut Context,
        rays: &Chunk,
        blocked: &mut [bool],
    ) {
        for (number, blocked) in blocked.chunks_mut(N).enumerate() {
            let mut own = Aligned64(RayN::<N>::EMPTY);
            let valid = Aligned64(rays.fill(number * N, &mut own.0));
            // SAFETY: as in `packets`, with the layout of RTCRayN.
            unsafe {
                call(
                    (&raw const valid).cast(),
                    self.scene,
                    context,
                    (&raw mut own).cast(),
                );
            }
            copy_blocked(&own.0, blocked);
        }
    }

    fn stream(&self, context: &mut Context, rays: &Chunk, count: usize, mut to: Found) {
        let mut own = vec![Aligned16(RayHitN::<1>::EMPTY); count];
        let stride = size_of::<Aligned16<RayHitN<1>>>();
        for begin in (0..to.t.len()).step_by(count) {
            let used = count.min(to.t.len() - begin);
            for (k, one) in own[..used].iter_mut().enumerate() {
                rays.fill(begin + k, &mut one.0.ray);
                one.0.hit.geometry = [ffi::INVALID];
                one.0.hit.primitive = [ffi::INVALID];
                one.0.hit.instance = [ffi::INVALID];
            }
            let (first, many) = (own.as_mut_ptr().cast(), used as u32);
            // SAFETY: scene and context live; so many rays of RTCRayHit's layout
            // follow each other at this stride.
            unsafe { ffi::rtcIntersect1M(self.scene, context, first, many, stride) };
            for (k, one) in own[..used].iter().enumerate() {
                to.put(begin + k, &one.0);
            }
        }
    }

    fn shadow_stream(
        &self,
        context: &mut Context,
        rays: &Chunk,
        count: usize,
        blocked: &mut [bool],
    ) {
        let mut own = vec![Aligned16(RayN::<1>::EMPTY); count];
        let stride = size_of::<Aligned16<RayN<1>>>();
        for (number, blocked) in blocked.chunks_mut(count).enumerate() {
            for (k, one) in own[..blocked.len()].iter_mut().enumerate() {
                rays.fill(number * count + k, &mut one.0);
            }
            let (first, many) = (own.as_mut_ptr().cast(), blocked.len() as u32);
            // SAFETY: as in `stream`, with the layout of RTCRay.
            unsafe { ffi::rtcOccluded1M(self.scene, context, first, many, stride) };
            for (one, blocked) in own.iter().zip(blocked) {
                *blocked = is_blocked(one.0.t_far[0]);
            }
        }
    }

    fn packet_stream(&self, context: &mut Context, rays: &Chunk, count: usize, mut to: Found) {
        let mut own = vec![Aligned64(RayHitN::<16>::EMPTY); count];
        let stride = size_of::<Aligned64<RayHitN<16>>>();
        let span = 16 * count;
        for begin in (0..to.t.len()).step_by(span) {
            let used = span.min(to.t.len() - begin).div_ceil(16);
            for (k, packet) in own[..used].iter_mut().enumerate() {
                rays.fill(begin + 16 * k, &mut packet.0.ray);
                packet.0.hit.geometry = [ffi::INVALID; 16];
                packet.0.hit.primitive = [ffi::INVALID; 16];
                packet.0.hit.instance = [ffi::INVALID; 16];
            }
            let (first, many) = (own.as_mut_ptr().cast(), used as u32);
            // SAFETY: scene and context live; so many packets of RTCRayHit16's
            // layout follow each other at this stride. Lanes without a ray are
            // off: their t_far is below their t_near.
            unsafe { ffi::rtcIntersectNM(self.scene, context, first, 16, many, stride) };
            for (k, packet) in own[..used].iter().enumerate() {
                to.put(begin + 16 * k, &packet.0);
            }
        }
    }

    fn shadow_packets(
        &self,
        context: &mut Context,
        rays: &Chunk,
        count: usize,
        blocked: &mut [bool],
    ) {
        let mut own = vec![Aligned64(RayN::<16>::EMPTY); count];
        let stride = size_of::<Aligned64<RayN<16>>>();
        let span = 16 * count;
        for (number, blocked) in blocked.chunks_mut(span).enumerate() {
            let used = blocked.len().div_ceil(16);
            for (k, packet) in own[..used].iter_mut().enumerate() {
                rays.fill(number * span + 16 * k, &mut packet.0);
            }
            let (first, many) = (own.as_mut_ptr().cast(), used as u32);
            // SAFETY: as in `packet_stream`, with the layout of RTCRay16.
            unsafe { ffi::rtcOccludedNM(self.scene, context, first, 16, many, stride) };
            for (packet, blocked) in own.iter().zip(blocked.chunks_mut(16)) {
                copy_blocked(&packet.0, blocked);
            }
        }
    }
}

/// Output columns of hits.
struct Found<'a> {
    t: &'a mut [f32],
    id: Ids<'a>,
}

impl<'a> Found<'a> {
    /// Takes hits with t in f32, `None` for f64.
    fn single(hits: Hits<'a>) -> Option<Found<'a>> {
        match hits.t {
            Depths::Single(t) => Some(Found { t, id: hits.id }),
            Depths::Double(_) => None,
        }
    }

    /// Stores a packet's lanes, as many as there are rows from `first` on.
    #[inline(always)]
    fn put<const N: usize>(&mut self, first: usize, packet: &RayHitN<N>) {
        let rows = first..self.t.len().min(first + N);
        let count = rows.len();
        self.t[rows.clone()].copy_from_slice(&packet.ray.t_far[..count]);
        // Without a hit both ids keep their initial value, all ones, which is also
        // `HitId::NONE`.
        let geometry = &packet.hit.geometry[..count];
        for (to, geometry) in self.id.instance[rows.clone()].iter_mut().zip(geometry) {
            *to = i64::from(geometry.cast_signed()).cast_unsigned();
        }
        self.id.primitive[rows].copy_from_slice(&packet.hit.primitive[..count]);
    }
}

/// Returns whether Embree set t_far to −∞, its mark of an occluded ray. The comparison
/// is of bits: no floating-point arithmetic of ours may run here.
#[inline(always)]
fn is_blocked(t_far: f32) -> bool {
    t_far.to_bits() == f32::NEG_INFINITY.to_bits()
}

#[inline(always)]
fn copy_blocked<const N: usize>(packet: &RayN<N>, blocked: &mut [bool]) {
    for (blocked, t) in blocked.iter_mut().zip(&packet.t_far) {
        *blocked = is_blocked(*t);
    }
}

/// Some rows of a ray set.
struct Chunk<'a> {
    org: [&'a [f32]; 3],
    dir: [&'a [f32]; 3],
    t_min: &'a [f32],
    t_max: &'a [f32],
}

impl<'a> Chunk<'a> {
    fn new(rays: &'a RaySet, rows: Range<usize>) -> Chunk<'a> {
        Chunk {
            org: rays.org.each_ref().map(|x| &x[rows.clone()]),
            dir: rays.dir.each_ref().map(|x| &x[rows.clone()]),
            t_min: &rays.t_min[rows.clone()],
            t_max: &rays.t_max[rows],
        }
    }

    /// Copies the rows from `first` on into a packet; returns −1 for the lanes that
    /// have a row. It only moves numbers and computes none.
    #[inline(always)]
    fn fill<const N: usize>(&self, first: usize, packet: &mut RayN<N>) -> [i32; N] {
        let run = |column: &'a [f32]| column[first..].first_chunk::<N>().copied();
        let some = |[x, y, z]: [&'a [f32]; 3]| Some([run(x)?, run(y)?, run(z)?]);
        if let (Some(org), Some(dir)) = (some(self.org), some(self.dir))
            && let (Some(t_min), Some(t_max)) = (run(self.t_min), run(self.t_max))
        {
            packet.org = org;
            packet.dir = dir;
            packet.t_near = t_min;
            packet.t_far = t_max;
            return [-1; N];
        }
        let mut valid = [0; N];
        *packet = RayN::EMPTY;
        for (lane, row) in (first..self.t_max.len()).take(N).enumerate() {
            for k in 0..3 {
                packet.org[k][lane] = self.org[k][row];
                packet.dir[k][lane] = self.dir[k][row];
            }
            packet.t_near[lane] = self.t_min[row];
            packet.t_far[lane] = self.t_max[row];
            valid[lane] = -1;
        }
        valid
    }
}

/// MXCSR bits: flush results to zero, and read denormals as zero.
const FLUSH: u32 = 1 << 15 | 1 << 6;

/// Runs `run` with denormals flushed to zero on this thread, as Embree requires, and
/// restores the control register, also after a panic.
///
/// `run` must only move floating-point numbers and call foreign functions: the compiler
/// assumes that our own arithmetic runs under the default control register.
pub(super) fn flushing_denormals<T>(run: impl FnOnce() -> T) -> T {
    struct Restore(u32);
    impl Drop for Restore {
        fn drop(&mut self) {
            // SAFETY: the register gets back what it held.
            unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const self.0, options(nostack, readonly)) };
        }
    }
    let mut before = 0_u32;
    // SAFETY: SSE is part of x86-64; the number lives here, and has the four
    // bytes that are written. Exceptions stay masked, rounding stays as it is.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut before, options(nostack)) };
    let _restore = Restore(before);
    let flushing = before | FLUSH;
    // SAFETY: bits 6 and 15 are defined on every x86-64 processor. While they are
    // set, `run` computes nothing in floating point of our own (see above).
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const flushing, options(nostack, readonly)) };
    run()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control() -> u32 {
        let mut now = 0_u32;
        // SAFETY: as in `flushing_denormals`.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut now, options(nostack)) };
        now & !0x3f
    }

    #[test]
    fn the_control_register_is_set_back() {
        let before = control();
        assert_eq!(before & FLUSH, 0);
        assert_eq!(flushing_denormals(control), before | FLUSH);
        assert_eq!(control(), before);
        let panicked = std::panic::catch_unwind(|| flushing_denormals(|| panic!("as it must")));
        assert!(panicked.is_err());
        assert_eq!(control(), before);
    }
}
