//! Published surfaces and rays (assets/surfaces): t of every hit, to twenty digits.

use super::implicits::tape;
use super::*;
use crate::common::assets;
use lanecast::internals::geom::Tape;
use serde_json::Value;

/// Σ c xⁱ yʲ zᵏ.
fn expanded(terms: &[Value]) -> Tape {
    tape(|b, xyz| {
        let mut sum = b.constant(0.0);
        for term in terms {
            let mut product = b.constant(term["c_f64"].as_f64().unwrap());
            for (k, variable) in xyz.iter().enumerate() {
                let power = b.power(*variable, term["m"][k].as_u64().unwrap() as u32);
                product = b.product(product, power);
            }
            sum = b.sum(sum, product);
        }
        sum
    })
}

/// Whether the f64 is the coefficient itself: an integer, or over a power of two.
fn is_exact(term: &Value) -> bool {
    let text = term["c"].as_str().unwrap_or("");
    let (above, below) = text.split_once('/').unwrap_or((text, "1"));
    let short = |s: &str| s.parse::<i64>().is_ok_and(|n| n.unsigned_abs() < 1 << 53);
    short(above) && below.parse::<u64>().is_ok_and(u64::is_power_of_two)
}

#[test]
fn published_surface_hits() {
    let Some(assets) = assets() else { return };
    let text = std::fs::read(assets.join("surfaces/surfaces.json")).unwrap();
    let json: Value = serde_json::from_slice(&text).unwrap();
    let numbers = |v: &Value| -> [f64; 3] { std::array::from_fn(|k| v[k].as_f64().unwrap()) };
    let (mut rays, mut met, mut rounded) = (0, 0, 0);
    for row in json["surfaces"].as_array().unwrap() {
        let name = row["name"].as_str().unwrap();
        let terms = row["terms"].as_array().unwrap();
        let exact = terms.iter().all(is_exact);
        rounded += usize::from(!exact);
        let shape = expanded(terms);
        assert_eq!(
            u64::from(shape.degree()),
            row["degree"].as_u64().unwrap(),
            "{name}"
        );
        let (scene, all) = scene_of(|b| place(b, |b| b.implicit("", shape, true, None)));
        let reference = Reference::new(&scene, &all).unwrap();
        for (i, ray) in row["ray_tests"].as_array().unwrap().iter().enumerate() {
            let (org, dir) = (numbers(&ray["origin"]), numbers(&ray["dir"]));
            let found = reference.crossings(org, dir, 0, 0);
            let known = ray["t_real"].as_array().unwrap();
            assert_eq!(found.len(), known.len(), "{name} {i}");
            rays += 1;
            for (crossing, known) in found.iter().zip(known) {
                let known: f64 = known.as_str().unwrap().parse().unwrap();
                met += 1;
                // Rounded coefficients move roots.
                let within = if exact { 0.0 } else { 1e-9 };
                let off = (crossing.t - known).abs();
                assert!(off <= within, "{name} {i}: {known} {crossing:?}");
            }
            let first = reference.nearest(org, dir, INF).map(|hit| hit.t);
            let ahead = found.iter().map(|c| c.t).find(|t| *t > 0.0);
            assert_eq!(first, ahead, "{name} {i}");
        }
    }
    println!("{rays} rays, {met} hits; {rounded} surfaces with rounded coefficients");
    assert!(rays == 80 && met > 100 && rounded < 6);
}
