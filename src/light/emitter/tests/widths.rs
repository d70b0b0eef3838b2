//! Every width of lanes gives the same bits.

use super::*;
use lanecast_model::scene::Falloff;
use lanecast_numerics::math::lanes::{Lanes, Mask, f32x4, f32x8, f32x16};

const COUNT: usize = 4096;

fn scene() -> Emitters {
    let p = DVec3::new(1.0, 2.0, 3.0);
    let bodies = [
        Body::Sphere {
            center: p,
            radius: 0.5,
        },
        Body::Triangle([p.yzx(), p.zxy(), DVec3::new(-1.0, 2.0, 2.0)]),
        Body::Rectangle {
            corner: -p,
            u: DVec3::X,
            v: DVec3::Y,
        },
        Body::Point {
            position: p.zxy(),
            radius: 0.25,
            falloff: Falloff::InverseSquare,
        },
        Body::Spot {
            position: p.yzx(),
            direction: -p,
            inner: 0.3,
            outer: 0.9,
            radius: 0.0,
        },
        Body::Sun {
            towards: p,
            angle: 0.2,
        },
        Body::Sun {
            towards: -p,
            angle: 0.0,
        },
    ];
    let sky = super::irradiance::gradient();
    Emitters::new(
        bodies.into_iter().map(white).collect(),
        Some(&sky),
        [0.1; 3],
    )
}

/// Swaps components.
trait Swap {
    fn yzx(self) -> DVec3;
    fn zxy(self) -> DVec3;
}

impl Swap for DVec3 {
    fn yzx(self) -> DVec3 {
        DVec3::new(self.y, self.z, self.x)
    }
    fn zxy(self) -> DVec3 {
        DVec3::new(self.z, self.x, self.y)
    }
}

/// Returns the bits of everything that samples of these lanes have.
fn all<L: Lanes<Scalar = f32>>(emitters: &Emitters) -> Vec<Vec<u64>> {
    let mut random = Random(21);
    let inputs: Vec<_> = (0..COUNT)
        .map(|k| {
            let normal = if k % 5 == 0 {
                DVec3::ZERO
            } else {
                random.unit()
            };
            let u = [random.next(), random.next(), random.next()];
            (random.vector() * 2.0, normal, u)
        })
        .collect();
    let mut out = Vec::new();
    for chunk in inputs.chunks(L::COUNT) {
        let point = Vec3::<L::Double>::of_lanes(|i| chunk[i].0.to_array());
        let normal = Vec3::<L>::of_lanes(|i| {
            let n = single(chunk[i].1);
            [n.x, n.y, n.z]
        });
        let u = Vec3::<L>::of_lanes(|i| chunk[i].2);
        let s = emitters.sample(point, normal, L::Mask::splat(true), u.x, [u.y, u.z]);
        let pdf = emitters.pdf(s.emitter, point, normal, s.dir);
        let to = |x: L::Double| L::narrow(x);
        let dir = Vec3::new(to(s.dir.x), to(s.dir.y), to(s.dir.z));
        let (sky, sky_pdf) = emitters.sky(dir, point, normal);
        for i in 0..L::COUNT {
            let mask = |m: L::Mask| u64::from(m.bits() >> i & 1);
            let mut row = vec![mask(s.some), mask(s.far), mask(s.delta)];
            row.push(u64::from(s.emitter.as_ref()[i]));
            row.extend([s.dir.x, s.dir.y, s.dir.z].map(|x| x.lane(i).to_bits()));
            row.extend(s.radiance.map(|x| u64::from(x.lane(i).to_bits())));
            row.extend([s.pdf, pdf, sky[0], sky_pdf].map(|x| u64::from(x.lane(i).to_bits())));
            out.push(row);
        }
    }
    out
}

#[test]
fn every_width_gives_the_same_bits() {
    let emitters = scene();
    let one = all::<f32>(&emitters);
    assert!(one.iter().filter(|row| row[0] == 1).count() > COUNT / 2);
    assert_eq!(one, all::<f32x4>(&emitters));
    assert_eq!(one, all::<f32x8>(&emitters));
    assert_eq!(one, all::<f32x16>(&emitters));
}
