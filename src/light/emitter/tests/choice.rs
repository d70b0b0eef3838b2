//! Emitters are chosen with the probabilities that are told.

use super::*;
use lanecast_model::scene::Falloff;

fn mixed(count: usize) -> Vec<Emitter> {
    let mut random = Random(11);
    (0..count)
        .map(|k| {
            let at = random.vector() * 3.0 + DVec3::Z * 1.5;
            let body = match k % 4 {
                0 => Body::Sphere {
                    center: at,
                    radius: 0.1,
                },
                1 => Body::Triangle([at, at + random.vector(), at + random.vector()]),
                2 => Body::Point {
                    position: at,
                    radius: 0.0,
                    falloff: Falloff::InverseSquare,
                },
                _ => Body::Sun {
                    towards: random.unit(),
                    angle: 0.0,
                },
            };
            Emitter {
                body,
                light: [random.next(), random.next(), random.next()],
            }
        })
        .collect()
}

#[test]
fn choices_follow_their_probabilities() {
    let list = mixed(16);
    let emitters = Emitters::new(list.clone(), None, [0.0; 3]);
    let mut random = Random(5);
    for normal in [DVec3::Z, DVec3::X, DVec3::ZERO] {
        let mut counts = vec![0; list.len()];
        let mut chances = vec![0.0; list.len()];
        let n = 100_000;
        for i in 0..n {
            // The choice is a function of the first number alone.
            let pick = (f64::from(i) + f64::from(random.next())) / f64::from(n);
            let u = [pick as f32, 0.3, 0.6];
            let sample = sample(&emitters, DVec3::ZERO, normal, u);
            if !sample.some {
                continue;
            }
            let id = sample.emitter[0] as usize;
            let chance = match list[id].body {
                Body::Point { .. } | Body::Sun { .. } => f64::from(sample.pdf),
                body => {
                    let alone = only(body);
                    let own = alone.pdf::<f32>([0], DVec3::ZERO.into(), single(normal), sample.dir);
                    f64::from(sample.pdf / own)
                }
            };
            counts[id] += 1;
            chances[id] = chance;
        }
        let total: f64 = chances.iter().sum();
        assert!((total - 1.0).abs() < 1e-4, "{normal}: {total}");
        for (count, chance) in counts.iter().zip(&chances) {
            let apart = f64::from(*count) / f64::from(n) - chance;
            assert!(
                apart.abs() < 3e-5 + 1e-3 * chance,
                "{normal}: {apart} of {chance}"
            );
        }
    }
}
