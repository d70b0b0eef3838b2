//! The double pass: undecided lanes of a packet evaluated again in f64.
//!
//! Usually one or two of 16 lanes are undecided in f32. They are packed into one 8-lane f64
//! register and evaluated again. Lanes do not interact, so an answer does not depend on the
//! lanes that are packed with it.

use super::packet::Packet;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, f64x8};

/// Rays in f64, each with the t beyond which no hit matters.
pub(super) struct DoublePass<D: Lanes> {
    pub org: Vec3<D>,
    pub dir: Vec3<D>,
    pub t_min: D,
    pub limit: D,
}

/// A test of rays in f64 lanes of any width.
pub(super) trait SecondLook {
    /// Returns which of the lanes `asked` may hit, and which certainly hit. `lanes` are those of
    /// the packet that the pass's lanes have come from.
    fn look<D: Lanes<Scalar = f64, Double = D>>(
        &mut self,
        pass: &DoublePass<D>,
        asked: u32,
        lanes: &[usize; f64x8::COUNT],
    ) -> [u32; 2];
}

/// Evaluates the lanes `asked`, packed into f64 registers.
#[inline(always)]
pub(super) fn look_again<L: Lanes>(
    packet: &Packet<L>,
    limit: L,
    asked: u32,
    look: &mut impl SecondLook,
) -> [u32; 2] {
    // An inline constant leaves the other branch uncompiled.
    if const { L::COUNT <= f64x8::COUNT } {
        let (org, dir) = (packet.org, packet.dir);
        let [t_min, limit] = [packet.ray.t_min, limit].map(L::widen);
        let pass = DoublePass {
            org,
            dir,
            t_min,
            limit,
        };
        return look.look(&pass, asked, &std::array::from_fn(|lane| lane));
    }
    let (mut rest, mut answers) = (asked, [0; 2]);
    while rest != 0 {
        let mut lanes = [rest.trailing_zeros() as usize; f64x8::COUNT];
        let mut count = 0;
        while rest != 0 && count < lanes.len() {
            lanes[count] = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            count += 1;
        }
        let some = look.look(&gathered(packet, limit, &lanes), (1 << count) - 1, &lanes);
        for (answer, some) in answers.iter_mut().zip(some) {
            for (i, lane) in lanes[..count].iter().enumerate() {
                *answer |= (some >> i & 1) << lane;
            }
        }
    }
    answers
}

/// Packs eight lanes of a packet into f64 registers.
#[inline(always)]
fn gathered<L: Lanes>(
    packet: &Packet<L>,
    limit: L,
    lanes: &[usize; f64x8::COUNT],
) -> DoublePass<f64x8> {
    let of = |x: L::Double| {
        let numbers = x.to_array();
        let numbers: &[f64] = numbers.as_ref();
        f64x8::load(&std::array::from_fn::<_, { f64x8::COUNT }, _>(|i| {
            numbers[lanes[i]]
        }))
    };
    let vector = |v: Vec3<L::Double>| Vec3::new(of(v.x), of(v.y), of(v.z));
    DoublePass {
        org: vector(packet.org),
        dir: vector(packet.dir),
        t_min: of(packet.ray.t_min.widen()),
        limit: of(limit.widen()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::{Mask, f32x16};

    /// Test answers encoded in the lanes' origins: one bit says may hit, another must hit.
    struct Bits;

    impl SecondLook for Bits {
        fn look<D: Lanes<Scalar = f64, Double = D>>(
            &mut self,
            pass: &DoublePass<D>,
            asked: u32,
            _: &[usize; f64x8::COUNT],
        ) -> [u32; 2] {
            let same = pass.org.x.eq(pass.t_min) & pass.org.x.eq(pass.limit);
            assert_eq!(same.bits() & asked, asked);
            let bit = |bit: u32| {
                let has = |i: usize| pass.org.x.lane(i) as u32 >> bit & 1;
                let bits: u32 = (0..D::COUNT).map(|i| has(i) << i).sum();
                bits & asked
            };
            [bit(0), bit(2)]
        }
    }

    #[test]
    fn every_lane_that_is_asked_for_answers_for_itself() {
        let numbers: [f32; 16] = std::array::from_fn(|i| (i * 5 % 16) as f32);
        let lanes = f32x16::load(&numbers);
        let (wide, zero) = (lanes.widen(), f32x16::zero().widen());
        let org = Vec3::new(wide, zero, zero);
        let packet = Packet::<f32x16>::open(org, org, lanes);
        let bit = |bit: u32| {
            let has = |i: usize| (numbers[i] as u32 >> bit & 1) << i;
            (0..16).map(has).sum::<u32>()
        };
        for asked in 0..1 << 16 {
            let found = look_again(&packet, lanes, asked, &mut Bits);
            assert_eq!(found, [bit(0) & asked, bit(2) & asked], "{asked:b}");
        }
    }
}
