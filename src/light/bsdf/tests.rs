//! Tests of all lobes together: sampling against density, density against 1, furnaces, bits.

use super::*;
use crate::chi2::{self, Random};
use lanecast_model::scene::{Layers, Rgb};
use lanecast_numerics::math::lanes::{f32x4, f32x8, f32x16};
use std::f64::consts::{PI, TAU};

/// Hammersley's points in three dimensions: i of `count`.
fn numbers(i: u32, count: u32) -> [f32; 3] {
    let inverse = |base: u32| {
        let (mut rest, mut digit, mut sum) = (i, 1.0 / f64::from(base), 0.0);
        while rest > 0 {
            sum += f64::from(rest % base) * digit;
            rest /= base;
            digit /= f64::from(base);
        }
        sum
    };
    let x = [
        (f64::from(i) + 0.5) / f64::from(count),
        inverse(2),
        inverse(3),
    ];
    x.map(|x| ((x * 16_777_216.0).floor() / 16_777_216.0) as f32)
}

fn direction(cos: f32, turn: f32) -> Vec3<f32> {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let phi = turn * std::f32::consts::TAU;
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

fn metallic(metallic: f32, roughness: f32) -> Material {
    Material::metallic_roughness([1.0; 3], metallic, roughness)
}

fn glass(roughness: f32, thin_walled: bool) -> Material {
    Material {
        transmission: 1.0,
        layers: Layers {
            thin_walled,
            ..Layers::default()
        },
        ..metallic(0.0, roughness)
    }
}

/// Adds layers to a material.
fn layered(mut material: Material, layer: impl Fn(&mut Layers)) -> Material {
    layer(&mut material.layers);
    material
}

/// The layers that white furnaces hold for, each on a material.
fn layerings(material: Material) -> Vec<(&'static str, Material)> {
    let mut rows = vec![("bare", material)];
    let mut add = |name, layer: &dyn Fn(&mut Layers)| rows.push((name, layered(material, layer)));
    add("leaf", &|l| l.diffuse_transmission = 0.5);
    add("clay", &|l| l.diffuse_roughness = 0.8);
    add("smooth coat", &|l| l.clearcoat = 1.0);
    add("half coat", &|l| {
        l.clearcoat = 0.5;
        l.clearcoat_roughness = 0.6;
    });
    add("velvet", &|l| {
        l.sheen_color = [1.0; 3];
        l.sheen_roughness = 0.7;
    });
    add("coated velvet", &|l| {
        l.sheen_color = [0.5; 3];
        l.sheen_roughness = 0.3;
        l.clearcoat = 1.0;
        l.clearcoat_roughness = 0.2;
    });
    rows
}

fn phong(diffuse: Rgb, specular: Rgb, exponent: f32, mirror: Rgb) -> Material {
    Material {
        model: Model::Phong {
            diffuse,
            specular,
            exponent,
            mirror,
        },
        ..Material::default()
    }
}

/// Materials with every lobe that is no delta distribution, with the index over which they are
/// seen.
fn scattering() -> Vec<(&'static str, Material, f32)> {
    let colored = |m, r| Material::metallic_roughness([0.9, 0.5, 0.1], m, r);
    vec![
        ("plastic", colored(0.0, 0.4), 1.5),
        ("plastic, smooth", colored(0.0, 0.0), 1.5),
        ("metal", colored(1.0, 0.5), 1.5),
        ("rough metal", colored(1.0, 1.0), 1.5),
        ("mixture", colored(0.5, 0.6), 1.5),
        ("glass", glass(0.5, false), 1.5),
        ("glass from inside", glass(0.5, false), 1.0 / 1.5),
        ("rough glass", glass(0.9, false), 1.3),
        (
            "half glass",
            Material {
                transmission: 0.5,
                ..colored(0.3, 0.6)
            },
            1.5,
        ),
        ("sheet", glass(0.5, true), 1.5),
        (
            "half sheet",
            Material {
                transmission: 0.5,
                ..glass(0.7, true)
            },
            1.5,
        ),
        (
            "leaf",
            Material {
                layers: Layers {
                    diffuse_transmission: 0.4,
                    diffuse_transmission_color: [0.2, 0.8, 0.1],
                    ..Layers::default()
                },
                ..colored(0.0, 0.6)
            },
            1.5,
        ),
        (
            "clay",
            layered(colored(0.0, 0.6), |l| l.diffuse_roughness = 1.0),
            1.5,
        ),
        (
            "brushed",
            layered(colored(1.0, 0.4), |l| {
                l.anisotropy = 0.8;
                l.anisotropy_rotation = 0.7;
            }),
            1.5,
        ),
        (
            "coated",
            layered(colored(0.5, 0.6), |l| {
                l.clearcoat = 0.8;
                l.clearcoat_roughness = 0.4;
            }),
            1.5,
        ),
        (
            "velvet under lacquer",
            layered(colored(0.0, 0.6), |l| {
                l.sheen_color = [0.9, 0.2, 0.1];
                l.sheen_roughness = 0.5;
                l.clearcoat = 1.0;
            }),
            1.5,
        ),
        (
            "soap on metal",
            layered(colored(0.5, 0.5), |l| l.iridescence = 1.0),
            1.5,
        ),
        (
            "phong",
            phong([0.5, 0.3, 0.2], [0.4; 3], 12.0, [0.0; 3]),
            1.5,
        ),
        (
            "phong with a mirror",
            phong([0.5, 0.3, 0.2], [0.4; 3], 5.0, [0.2; 3]),
            1.5,
        ),
    ]
}

const ANGLES: [f32; 4] = [1.0, 0.7, 0.3, 0.08];

/// Integrates over the sphere by `f` of directions, with 2n by 2n midpoints of polar angle and
/// azimuth; n is a multiple of 4.
fn integrate(n: usize, mut f: impl FnMut(Vec3<f32x8>) -> f32x8) -> f64 {
    let mut sum = 0.0;
    for i in 0..2 * n {
        let (sin, cos) = ((i as f64 + 0.5) / (2 * n) as f64 * PI).sin_cos();
        for j in (0..2 * n).step_by(8) {
            let into = Vec3::of_lanes(|k| {
                let turn = ((j + k) as f64 + 0.5) / (2 * n) as f64;
                let one = direction(cos as f32, turn as f32);
                [one.x, one.y, one.z]
            });
            let values = f(into).to_array().map(f64::from);
            sum += values.iter().sum::<f64>() * sin;
        }
    }
    sum / (2 * n * 2 * n) as f64 * TAU * PI
}

/// Samples `count` directions; calls `f` with each.
fn sampled(bsdf: &Bsdf, eta: f32, out: Vec3<f32>, count: u32, mut f: impl FnMut(Sampled<f32>)) {
    let looks = bsdf.looks();
    for i in 0..count {
        let [u, v, lobe] = numbers(i, count);
        f(bsdf.sample(&looks, eta, out, [u, v], lobe));
    }
}

/// Returns the albedo by sampling, mean of the channels; refracted light counts as it would
/// past the interface.
fn albedo(material: &Material, eta: f32, cos: f32, count: u32) -> f64 {
    let mut sum = 0.0;
    let bsdf = &Bsdf::new(material);
    let refracts = !bsdf.thin_walled && material.transmission > 0.0;
    sampled(bsdf, eta, direction(cos, 0.1), count, |s| {
        let scale = if s.through && refracts {
            eta * eta
        } else {
            1.0
        };
        sum += f64::from(mean(s.weight) * scale);
    });
    sum / f64::from(count)
}

#[test]
fn the_density_integrates_to_1() {
    let of = |(name, material, eta): (&str, Material, f32)| {
        let bsdf = Bsdf::new(&material);
        // Grazing refraction has a narrow rim.
        let count = if name == "rough glass" { 1500 } else { 500 };
        for cos in ANGLES {
            let out = direction(cos, 0.1);
            let (looks, etas) = (bsdf.looks::<f32x8>(), f32x8::splat(eta));
            let outs = Vec3::of_lanes(|_| [out.x, out.y, out.z]);
            let density = integrate(count, |into| bsdf.eval(&looks, etas, outs, into).pdf);
            // What sampling loses below the horizon, and delta lobes.
            let (mut lost, count) = (0.0, 1 << 16);
            sampled(&bsdf, eta, out, count, |s| {
                if !s.some || s.delta {
                    lost += 1.0 / f64::from(count);
                }
            });
            assert!(
                (density + lost - 1.0).abs() < 1e-3,
                "{name} at {cos}: {density} + {lost}"
            );
        }
    };
    // By threads: no other test takes half as long.
    let all = scattering();
    std::thread::scope(|scope| {
        for one in &all {
            scope.spawn(|| of(*one));
        }
    });
}

#[test]
fn weights_are_value_over_density() {
    for (name, material, eta) in scattering() {
        let bsdf = Bsdf::new(&material);
        for cos in ANGLES {
            let out = direction(cos, 0.1);
            sampled(&bsdf, eta, out, 500, |s| {
                if !s.some || s.delta {
                    return;
                }
                let all = bsdf.eval(&bsdf.looks(), eta, out, s.into);
                assert!(
                    (s.pdf / all.pdf - 1.0).abs() < 1e-5,
                    "{name}: {s:?} {all:?}"
                );
                for k in 0..3 {
                    let expected = all.value[k] / all.pdf;
                    let error = (s.weight[k] - expected).abs();
                    assert!(error <= 1e-5 * expected, "{name}: {s:?} {all:?}");
                }
                assert!((s.into.length() - 1.0).abs() < 1e-5, "{name}: {s:?}");
                assert_eq!(s.through, s.into.z < 0.0);
            });
        }
    }
}

#[test]
fn directions_have_their_density() {
    let rows = scattering();
    let tests = 2 * rows.len();
    for (name, material, eta) in rows {
        let bsdf = Bsdf::new(&material);
        let looks = bsdf.looks();
        for cos in [0.9, 0.3] {
            let out = direction(cos, 0.1);
            let mut random = Random(7);
            chi2::check(
                &format!("{name} at {cos}"),
                [20, 10],
                60_000,
                tests,
                |u| {
                    let s = bsdf.sample(&looks, eta, out, u, random.unit());
                    let into = [s.into.x, s.into.y, s.into.z].map(f64::from);
                    (s.some && !s.delta).then(|| chi2::place_of(into))
                },
                |at| {
                    let into = Vec3::splat(chi2::direction_of(at).map(|x| x as f32));
                    4.0 * PI * f64::from(bsdf.eval(&looks, eta, out, into).pdf)
                },
            );
        }
    }
}

#[test]
fn white_furnaces_are_white() {
    let mut worst = (1.0_f64, 1.0_f64);
    for metal in [0.0, 0.5, 1.0] {
        for roughness in [0.0, 0.1, 0.3, 0.5, 0.75, 1.0] {
            let material = metallic(metal, roughness);
            let mut sheet = material;
            sheet.transmission = 1.0;
            sheet.layers.thin_walled = true;
            let mut rows = layerings(material);
            rows.push(("sheet", sheet));
            for (name, material) in rows {
                for cos in ANGLES {
                    let found = albedo(&material, 1.5, cos, 1 << 15);
                    worst = (worst.0.min(found), worst.1.max(found));
                    assert!(
                        found > 0.995 && found < 1.001,
                        "{name}, metallic {metal}, roughness {roughness}, cos {cos}: {found}"
                    );
                }
            }
        }
    }
    println!("furnaces from {} to {}", worst.0, worst.1);
}

#[test]
fn lambert_is_exact_in_the_furnace() {
    let lambert = phong([1.0; 3], [0.0; 3], 0.0, [0.0; 3]);
    let dull = Material {
        layers: Layers {
            specular: 0.0,
            ..Layers::default()
        },
        ..metallic(0.0, 1.0)
    };
    for material in [lambert, dull] {
        for cos in ANGLES {
            let found = albedo(&material, 1.5, cos, 1 << 12);
            assert!((found - 1.0).abs() < 1e-4, "{found}");
        }
    }
}

#[test]
fn smooth_glass_keeps_all_energy_and_obeys_snell() {
    let bsdf = Bsdf::new(&glass(0.0, false));
    assert!(bsdf.only_delta && bsdf.transmits && !bsdf.is_black);
    for eta in [1.5, 1.0 / 1.5, 1.0, 0.9] {
        for cos in ANGLES {
            let found = albedo(&glass(0.0, false), eta, cos, 1 << 10);
            assert!((found - 1.0).abs() < 1e-5, "{eta} {cos}: {found}");
            let out = direction(cos, 0.1);
            sampled(&bsdf, eta, out, 100, |s| {
                assert!(s.delta && s.some);
                let ratio = if s.through { 1.0 / eta } else { 1.0 };
                assert!((s.into.x + out.x * ratio).abs() < 1e-6);
                assert!((s.into.y + out.y * ratio).abs() < 1e-6);
            });
        }
    }
}

#[test]
fn a_sheet_of_index_1_5_reflects_a_thirteenth() {
    for roughness in [0.0, 0.001] {
        let bsdf = Bsdf::new(&glass(roughness, true));
        let (mut reflected, mut through) = (0.0, 0.0);
        let count = 1 << 17;
        sampled(&bsdf, 1.5, direction(1.0, 0.0), count, |s| {
            let part = if s.through {
                &mut through
            } else {
                &mut reflected
            };
            *part += f64::from(s.weight[0]) / f64::from(count);
        });
        assert!((reflected - 1.0 / 13.0).abs() < 1e-4, "{reflected}");
        assert!((through - 12.0 / 13.0).abs() < 1e-4, "{through}");
    }
    let shares = glass::Glass::new(true, 1.5, [1.0; 3]).shares(1.0_f32, 1.5, [1.0; 3]);
    assert!((shares.reflected[0] - 1.0 / 13.0).abs() < 1e-7);
}

/// Rough glass is given back nearly all that its facets lose (glass_albedo.rs), and gains nothing.
#[test]
fn rough_glass_makes_no_light() {
    for roughness in [0.1, 0.5, 1.0] {
        for eta in [1.5, 1.0 / 1.5] {
            for cos in ANGLES {
                let found = albedo(&glass(roughness, false), eta, cos, 1 << 15);
                assert!(
                    found > 0.985 && found < 1.002,
                    "{roughness} {eta} {cos}: {found}"
                );
            }
        }
    }
}

/// Stretched lobes are given back 97 % of what they lose (albedo.rs), and below films the base is
/// weighed by the film's most reflective channel at one angle.
#[test]
fn brushed_and_iridescent_surfaces_nearly_keep_their_energy() {
    for roughness in [0.1, 0.4, 0.8] {
        for metal in [0.0, 1.0] {
            for cos in ANGLES {
                let material = metallic(metal, roughness);
                let brushed = layered(material, |l| l.anisotropy = 0.5);
                let found = albedo(&brushed, 1.5, cos, 1 << 12);
                assert!(
                    found > 0.985 && found < 1.002,
                    "{metal} {roughness} {cos}: {found}"
                );
                let soap = layered(material, |l| l.iridescence = 1.0);
                let found = albedo(&soap, 1.5, cos, 1 << 14);
                assert!(
                    found > 0.9 && found < 1.001,
                    "{metal} {roughness} {cos}: {found}"
                );
            }
        }
    }
}

/// Phong's lobes against the formula: (d cos + s (r·v)ⁿ)/π.
#[test]
fn phong_has_its_formula() {
    let bsdf = Bsdf::new(&phong([0.5, 0.3, 0.2], [0.4, 0.1, 0.0], 9.0, [0.0; 3]));
    let (out, into) = (direction(0.8, 0.2), direction(0.6, 0.6));
    let found = bsdf.eval(&bsdf.looks(), 1.5, out, into);
    let cos = Vec3::new(-into.x, -into.y, into.z).dot(out);
    assert!(cos > 0.0);
    for k in 0..3 {
        let (d, s) = ([0.5, 0.3, 0.2][k], [0.4, 0.1, 0.0][k]);
        let expected = (d * into.z + s * cos.powi(9)) / std::f32::consts::PI;
        assert!((found.value[k] - expected).abs() < 1e-6, "{found:?}");
    }
}

/// Everything at all widths; one lane is the reference.
#[test]
fn all_widths_give_the_same_bits() {
    fn compare<L: Lanes<Scalar = f32>>(material: &Material) {
        let bsdf = Bsdf::new(material);
        let mut random = Random(3);
        let etas = [1.5, 1.0 / 1.5, 1.0, 0.999_9, 1.002];
        for _ in 0..20 {
            let mut inputs = Vec::new();
            for _ in 0..L::COUNT {
                let out = direction(random.unit(), random.unit());
                let into = direction(random.unit() * 2.0 - 1.0, random.unit());
                let eta = etas[(random.unit() * 5.0) as usize];
                inputs.push((
                    out,
                    into,
                    eta,
                    [random.unit(), random.unit(), random.unit()],
                ));
            }
            let lanes = |f: &dyn Fn(usize) -> f32| {
                let mut array = L::zero().to_array();
                for (i, x) in array.as_mut().iter_mut().enumerate() {
                    *x = f(i);
                }
                L::load(array.as_ref())
            };
            let vector = |f: &dyn Fn(usize) -> Vec3<f32>| {
                Vec3::new(lanes(&|i| f(i).x), lanes(&|i| f(i).y), lanes(&|i| f(i).z))
            };
            let out = vector(&|i| inputs[i].0);
            let into = vector(&|i| inputs[i].1);
            let eta = lanes(&|i| inputs[i].2);
            let u = [lanes(&|i| inputs[i].3[0]), lanes(&|i| inputs[i].3[1])];
            let lobe = lanes(&|i| inputs[i].3[2]);
            let all = bsdf.eval(&bsdf.looks(), eta, out, into);
            let sample = bsdf.sample(&bsdf.looks(), eta, out, u, lobe);
            for (i, (out, into, eta, [u, v, lobe])) in inputs.into_iter().enumerate() {
                let one = bsdf.eval(&bsdf.looks(), eta, out, into);
                assert_eq!(all.pdf.lane(i).to_bits(), one.pdf.to_bits());
                let single = bsdf.sample(&bsdf.looks(), eta, out, [u, v], lobe);
                for k in 0..3 {
                    assert_eq!(all.value[k].lane(i).to_bits(), one.value[k].to_bits());
                    let found = sample.weight[k].lane(i);
                    assert_eq!(found.to_bits(), single.weight[k].to_bits());
                    let found = sample.into.axis(k).lane(i);
                    assert_eq!(found.to_bits(), single.into.axis(k).to_bits());
                }
                assert_eq!(sample.pdf.lane(i).to_bits(), single.pdf.to_bits());
                assert_eq!(sample.delta.bits() >> i & 1, u32::from(single.delta));
                assert_eq!(sample.through.bits() >> i & 1, u32::from(single.through));
                assert_eq!(sample.some.bits() >> i & 1, u32::from(single.some));
            }
        }
    }
    for (_, material, _) in scattering() {
        compare::<f32x4>(&material);
        compare::<f32x8>(&material);
        compare::<f32x16>(&material);
    }
    for material in [glass(0.0, false), glass(0.0, true), metallic(1.0, 0.0)] {
        compare::<f32x8>(&material);
    }
}

/// Whatever is asked, all answers are finite and none is negative.
#[test]
fn no_extreme_makes_a_nan() {
    let mut random = Random(11);
    let pick = |random: &mut Random, from: &[f32]| {
        let i = (random.unit() * (from.len() + 1) as f32) as usize;
        from.get(i).copied().unwrap_or_else(|| random.unit())
    };
    for _ in 0..100_000 {
        let unit = [0.0, 1.0, 1e-8, 1e-4, 0.999_999_94];
        let factor = [0.0, 0.0, 1.0, 0.5];
        let mut color = || [0; 3].map(|_| pick(&mut random, &[0.0, 1.0, 1e-30, 1e30]));
        let (base, other, specular) = (color(), color(), color());
        let r = &mut random;
        let mut material = Material::metallic_roughness(base, pick(r, &factor), pick(r, &unit));
        material.transmission = pick(r, &factor);
        material.ior = pick(r, &[1.0, 1.5, 0.5, 1e-30, 1e30, 1.000_01, 3.0]);
        material.layers.thin_walled = r.unit() < 0.5;
        material.layers.specular = pick(r, &factor);
        material.layers.specular_color = specular;
        material.layers.diffuse_transmission = pick(r, &factor);
        material.layers.diffuse_transmission_color = other;
        let layers = &mut material.layers;
        layers.diffuse_roughness = pick(r, &factor);
        layers.anisotropy = pick(r, &factor);
        layers.anisotropy_rotation = pick(r, &[0.0, 1e4]);
        layers.clearcoat = pick(r, &factor);
        layers.clearcoat_roughness = pick(r, &unit);
        if r.unit() < 0.02 {
            layers.sheen_color = base;
            layers.sheen_roughness = pick(r, &unit);
        }
        layers.iridescence = pick(r, &factor);
        layers.iridescence_ior = pick(r, &[1.0, 1.3, 0.5, 3.0, 1e30]);
        layers.iridescence_thickness = pick(r, &[0.0, 400.0, 1e30, 0.01]);
        if r.unit() < 0.2 {
            material.model = Model::Phong {
                diffuse: base,
                specular,
                exponent: pick(r, &[0.0, 1.0, 1e4, 1e30]),
                mirror: other,
            };
        }
        let bsdf = Bsdf::new(&material);
        let cosines = [1.0, 1e-8, 1e-30, 0.0, -0.1, 1e-4, 0.999_999_9];
        let out = direction(pick(r, &cosines), r.unit());
        let eta = pick(r, &[1.0, 1.5, 1.0 / 1.5, 1.001, 1e-30, 1e30, 0.999]);
        let numbers = [0.0, 0.999_999_94, 1e-7];
        let u = [pick(r, &numbers), pick(r, &numbers)];
        let lobe = pick(r, &numbers);
        let s = bsdf.sample(&bsdf.looks(), eta, out, u, lobe);
        let sign = if r.unit() < 0.5 { -1.0 } else { 1.0 };
        let chosen = direction(pick(r, &cosines) * sign, r.unit());
        let mirrored = Vec3::new(-out.x, -out.y, out.z);
        for into in [s.into, chosen, mirrored, -out, out] {
            let all = bsdf.eval(&bsdf.looks(), eta, out, into);
            let fine = |x: f32| x >= 0.0 && x.is_finite();
            assert!(
                all.value.into_iter().all(fine) && fine(all.pdf),
                "{material:?} {out:?} {into:?} {eta}: {all:?}"
            );
        }
        let fine = |x: f32| x >= 0.0 && x.is_finite();
        assert!(
            s.weight.into_iter().all(fine) && fine(s.pdf),
            "{material:?} {out:?} {u:?} {lobe} {eta}: {s:?}"
        );
        let into = s.into;
        assert!([into.x, into.y, into.z].iter().all(|x| x.is_finite()));
    }
}

/// Measures eval and sample: `cargo test --release -p lanecast-light -- --ignored --nocapture
/// nanoseconds`.
#[test]
#[ignore = "measures"]
fn nanoseconds_per_lane() {
    let diffuse = phong([0.5; 3], [0.0; 3], 0.0, [0.0; 3]);
    let rows = [
        ("diffuse", diffuse),
        ("plastic", metallic(0.0, 0.5)),
        ("metal", metallic(1.0, 0.5)),
        ("smooth glass", glass(0.0, false)),
        ("rough glass", glass(0.3, false)),
    ];
    let lanes = |random: &mut Random| f32x8::from(std::array::from_fn(|_| random.unit()));
    for (name, material) in rows {
        let bsdf = Bsdf::new(&material);
        let mut random = Random(5);
        let vector = |random: &mut Random| {
            let v: [Vec3<f32>; 8] =
                std::array::from_fn(|_| direction(random.unit(), random.unit()));
            Vec3::<f32x8>::of_lanes(|i| [v[i].x, v[i].y, v[i].z])
        };
        let inputs: Vec<_> = (0..256)
            .map(|_| {
                let r = &mut random;
                (vector(r), vector(r), [lanes(r), lanes(r)], lanes(r))
            })
            .collect();
        let eta = f32x8::splat(1.5);
        let rounds = 10;
        let per_lane = 1e9 / (rounds * 256 * 8) as f64;
        let looks = bsdf.looks::<f32x8>();
        let mut best = [f64::INFINITY; 2];
        for _ in 0..100 {
            let start = std::time::Instant::now();
            for _ in 0..rounds {
                for (out, into, _, _) in &inputs {
                    std::hint::black_box(bsdf.eval(&looks, eta, *out, *into));
                }
            }
            best[0] = best[0].min(start.elapsed().as_secs_f64() * per_lane);
            let start = std::time::Instant::now();
            for _ in 0..rounds {
                for (out, _, u, lobe) in &inputs {
                    std::hint::black_box(bsdf.sample(&looks, eta, *out, *u, *lobe));
                }
            }
            best[1] = best[1].min(start.elapsed().as_secs_f64() * per_lane);
        }
        println!("{name}: eval {:.2} ns, sample {:.2} ns", best[0], best[1]);
    }
}
