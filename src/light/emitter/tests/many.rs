//! The light tree: probabilities, and noise against sampling by power.

use super::*;
use lanecast_model::scene::Falloff;

/// Small triangles in a box above the floor, turned and sized at random.
pub fn triangles(count: usize) -> Vec<Emitter> {
    let mut random = Random(31);
    let one = |_| {
        let at = DVec3::new(random.signed() * 10.0, random.signed() * 10.0, 0.0);
        let at = at + DVec3::Z * (0.5 + 2.5 * f64::from(random.next()));
        let size = 0.02 + 0.05 * f64::from(random.next());
        let corners = [at, at + random.unit() * size, at + random.unit() * size];
        Emitter {
            body: Body::Triangle(corners),
            light: [1.0 + 20.0 * random.next().powi(4); 3],
        }
    };
    (0..count).map(one).collect()
}

#[test]
fn the_tree_chooses_with_the_probabilities_that_it_tells() {
    let mut list = triangles(300);
    let mut random = Random(12);
    for k in 0..60 {
        let at = random.vector() * 5.0 + DVec3::Z * 3.0;
        let body = match k % 4 {
            0 => Body::Sphere {
                center: at,
                radius: 0.2,
            },
            1 => Body::Disc {
                center: at,
                normal: random.unit(),
                radius: 0.3,
                two_sided: k % 8 < 4,
            },
            2 => Body::Spot {
                position: at,
                direction: random.vector(),
                inner: 0.3,
                outer: 0.7,
                radius: 0.0,
            },
            _ => Body::Point {
                position: at,
                radius: 0.0,
                falloff: Falloff::InverseSquare,
            },
        };
        list.push(white(body));
    }
    let emitters = Emitters::new(list.clone(), None, [0.0; 3]);
    let tree = emitters.tree.as_ref().unwrap();
    for k in 0..12 {
        let normal = [DVec3::Z, DVec3::ZERO, random.unit()][k % 3];
        let n = single(normal);
        let point = tree::Point {
            at: (random.vector() * 4.0).to_array(),
            normal: [n.x, n.y, n.z],
        };
        let mut counts = vec![0.0; list.len()];
        let tries = 200_000;
        let mut lost = 0;
        for i in 0..tries {
            let pick = (f64::from(i) + f64::from(random.next())) / f64::from(tries);
            match tree.choose(&point, (pick as f32).min(1.0 - f32::EPSILON / 2.0)) {
                None => lost += 1,
                Some((slot, chance)) => {
                    counts[slot as usize] += 1.0 / f64::from(tries);
                    let own = tree.chance(&point, slot);
                    assert!((own / chance - 1.0).abs() < 1e-5, "{own} for {chance}");
                }
            }
        }
        // The rest goes to nodes all of whose emitters prove dark.
        assert!(lost < tries, "{k}");
        let sum: f64 = (0..list.len() as u32)
            .map(|slot| f64::from(tree.chance(&point, slot)))
            .sum();
        assert!(
            (sum + f64::from(lost) / f64::from(tries) - 1.0).abs() < 1e-3,
            "{sum}"
        );
        for (slot, count) in (0..).zip(counts) {
            let chance = f64::from(tree.chance(&point, slot));
            assert!(
                (count - chance).abs() < 2e-5 + 2e-3 * chance,
                "{count} for {chance}"
            );
        }
    }
}

#[test]
fn no_emitter_that_brings_light_has_no_chance() {
    let list = triangles(500);
    let emitters = Emitters::new(list.clone(), None, [0.0; 3]);
    let mut random = Random(13);
    for _ in 0..200 {
        let point = DVec3::new(random.signed() * 12.0, random.signed() * 12.0, 0.0);
        for (id, emitter) in (0..).zip(&list) {
            let Body::Triangle([p, q, r]) = emitter.body else {
                unreachable!()
            };
            let to = (p + q + r) / 3.0 - point;
            let pdf = emitters.pdf::<f32>([id], point.into(), single(DVec3::Z), to.into());
            assert!(pdf > 0.0, "{id} from {point}");
        }
    }
}

/// Returns the sum over points of the floor of the squared error with n samples of a point,
/// and the mean; `sample` makes one estimate.
fn noise(n: u32, exact: &[f64], estimate: impl Fn(DVec3, &mut Random) -> f64) -> f64 {
    let mut random = Random(77);
    let mut error = 0.0;
    for (k, exact) in exact.iter().enumerate() {
        let sum: f64 = (0..n).map(|_| estimate(floor(k), &mut random)).sum();
        error += (sum / f64::from(n) - exact).powi(2);
    }
    error / exact.len() as f64
}

/// Points of a grid on the floor.
fn floor(k: usize) -> DVec3 {
    let (x, y) = (k % 32, k / 32);
    DVec3::new(x as f64 - 15.5, y as f64 - 15.5, 0.0) * (10.0 / 16.0)
}

/// Returns the irradiance estimate of a sample.
fn value(sample: &LightSample<f32>) -> f64 {
    let cos = DVec3::from(sample.dir).normalize().z.max(0.0);
    let value = f64::from(sample.radiance[0]) * cos / f64::from(sample.pdf);
    if sample.some { value } else { 0.0 }
}

#[test]
fn the_tree_has_less_noise_than_sampling_by_power() {
    let list = triangles(10_000);
    let emitters = Emitters::new(list.clone(), None, [0.0; 3]);
    let exact: Vec<f64> = (0..1024)
        .map(|k| {
            let each = list.iter().map(|emitter| {
                let Body::Triangle([p, q, r]) = emitter.body else {
                    unreachable!()
                };
                // All lie above the floor: Lambert's formula.
                let corners = [p, q, r].map(|corner| corner - floor(k));
                let edge = |a: DVec3, b: DVec3| a.angle_between(b) * a.cross(b).normalize().z;
                let [a, b, c] = corners;
                let sum = edge(a, b) + edge(b, c) + edge(c, a);
                f64::from(emitter.light[0]) * 0.5 * sum.abs()
            });
            each.sum()
        })
        .collect();
    let power = |emitter: &Emitter| {
        let Body::Triangle([p, q, r]) = emitter.body else {
            unreachable!()
        };
        f64::from(emitter.light[0]) * (q - p).cross(r - p).length()
    };
    let total: f64 = list.iter().map(power).sum();
    let mut sums = Vec::new();
    let mut sum = 0.0;
    for emitter in &list {
        sum += power(emitter) / total;
        sums.push(sum);
    }
    let alone: Vec<Emitters> = list
        .iter()
        .map(|&emitter| Emitters::new(vec![emitter], None, [0.0; 3]))
        .collect();
    let one = |k: usize, point: DVec3, random: &mut Random| {
        let u = [0.0, random.next(), random.next()];
        value(&sample(&alone[k], point, DVec3::Z, u))
    };
    let by_tree = noise(16, &exact, |point, random| {
        let u = [random.next(), random.next(), random.next()];
        value(&sample(&emitters, point, DVec3::Z, u))
    });
    let by_power = noise(16, &exact, |point, random| {
        let u = f64::from(random.next());
        let k = sums.partition_point(|&sum| sum <= u).min(list.len() - 1);
        one(k, point, random) * total / power(&list[k])
    });
    let uniform = noise(16, &exact, |point, random| {
        let k = (f64::from(random.next()) * list.len() as f64) as usize;
        one(k, point, random) * list.len() as f64
    });
    let mean = exact.iter().sum::<f64>() / exact.len() as f64;
    println!("mean {mean}: tree {by_tree:.4e}, power {by_power:.4e}, uniform {uniform:.4e}");
    assert!(
        by_power > 2.4 * by_tree,
        "{by_power} by power, {by_tree} by the tree"
    );
    assert!(
        uniform > 10.0 * by_tree,
        "{uniform} uniform, {by_tree} by the tree"
    );
    // And it is right: 16 million samples together.
    let found = (0..1024).map(|k| {
        let sum: f64 = (0..64)
            .map(|i| value(&sample(&emitters, floor(k), DVec3::Z, numbers(i))))
            .sum();
        sum / 64.0
    });
    let found = found.sum::<f64>() / 1024.0;
    assert!((found / mean - 1.0).abs() < 5e-3, "{found}, not {mean}");
}

/// Two lamps of one power, each above its own half of the floor: choosing by importance has at
/// most a third of the noise of choosing by power.
#[test]
fn two_lamps_are_chosen_by_importance() {
    let lamp = |x: f64| {
        white(Body::Rectangle {
            corner: DVec3::new(x - 0.25, -0.25, 1.5),
            u: DVec3::X * 0.5,
            v: DVec3::Y * 0.5,
        })
    };
    let list = [lamp(-4.0), lamp(4.0)];
    let both = Emitters::new(list.to_vec(), None, [0.0; 3]);
    let alone = list.map(|emitter| Emitters::new(vec![emitter], None, [0.0; 3]));
    let sum_of = |k: usize| {
        let each = alone.iter().map(|lamp| {
            let one = |i: u32| value(&sample(lamp, floor(k), DVec3::Z, numbers(i)));
            (0..256).map(one).sum::<f64>() / 256.0
        });
        each.sum::<f64>()
    };
    let exact: Vec<f64> = (0..1024).map(sum_of).collect();
    let by_importance = noise(1, &exact, |point, random| {
        let u = [random.next(), random.next(), random.next()];
        value(&sample(&both, point, DVec3::Z, u))
    });
    let by_power = noise(1, &exact, |point, random| {
        let lamp = &alone[usize::from(random.next() < 0.5)];
        let u = [0.0, random.next(), random.next()];
        2.0 * value(&sample(lamp, point, DVec3::Z, u))
    });
    println!("importance {by_importance:.4e}, power {by_power:.4e}");
    assert!(by_power > 3.0 * by_importance);
}

#[test]
fn equal_places_and_lines_make_trees() {
    let point = |position| {
        white(Body::Point {
            position,
            radius: 0.0,
            falloff: Falloff::InverseSquare,
        })
    };
    let one: Vec<Emitter> = (0..100).map(|_| point(DVec3::Z)).collect();
    let line: Vec<Emitter> = (0..1000)
        .map(|k| point(DVec3::new(f64::from(k), 0.0, 1.0)))
        .collect();
    let far: Vec<Emitter> = (0..500)
        .map(|k| point(DVec3::X * (f64::from(k) / 10.0).exp2() + DVec3::Z))
        .collect();
    for list in [one, line, far] {
        let count = list.len();
        let emitters = Emitters::new(list, None, [0.0; 3]);
        let tree = emitters.tree.as_ref().unwrap();
        let point = tree::Point {
            at: [0.5, 0.0, 0.0],
            normal: [0.0, 0.0, 1.0],
        };
        let chances = (0..count as u32).map(|slot| tree.chance(&point, slot));
        let sum: f32 = chances.sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
