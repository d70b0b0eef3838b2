use super::*;

fn record(x: f64, light: f32) -> IrradianceRecord {
    IrradianceRecord {
        point: DVec3::new(x, 0.0, 0.0),
        normal: DVec3::Y,
        light: [light; 3],
        radius: 1.0,
    }
}

#[test]
fn records_serve_what_is_near_and_faces_alike() {
    let one = record(0.0, 1.0);
    assert_eq!(one.weight(DVec3::ZERO, DVec3::Y), 1.0);
    assert_eq!(one.weight(DVec3::X, DVec3::Y), 0.0);
    assert_eq!(one.weight(DVec3::X * 0.5, DVec3::Y), 0.5);
    assert_eq!(one.weight(DVec3::ZERO, -DVec3::Y), 0.0);
    assert_eq!(one.weight(DVec3::ZERO, DVec3::X), 0.0);
    // Below lies what sees other things.
    assert_eq!(one.weight(DVec3::new(0.1, -0.2, 0.0), DVec3::Y), 0.0);
    assert_eq!(one.weight(DVec3::NAN, DVec3::Y), 0.0);
}

#[test]
fn the_tree_finds_what_a_scan_finds() {
    let place = |i: u32| {
        let part = |k: u32| f64::from((i.wrapping_mul(2_654_435_761) >> k) % 1000) / 50.0;
        DVec3::new(part(0), part(9), part(17))
    };
    let records: Vec<IrradianceRecord> = (0..500)
        .map(|i| IrradianceRecord {
            point: place(i),
            radius: 0.3 + f64::from(i % 17) / 5.0,
            ..record(0.0, i as f32)
        })
        .collect();
    let cache = Irradiance::new(records.clone());
    let mut met = 0;
    for i in 0..300 {
        let point = place(i + 7) + DVec3::new(0.2, 0.05, -0.1);
        let mut found = Vec::new();
        cache.visit(point, DVec3::Y, |number, _| found.push(number));
        found.sort_unstable();
        let serves = |n: &u32| records[*n as usize].weight(point, DVec3::Y) > 0.0;
        let all: Vec<u32> = (0..500).filter(serves).collect();
        assert_eq!(found, all);
        met += all.len();
    }
    assert!(met > 300);
    assert_eq!(Irradiance::default().at(DVec3::ZERO, DVec3::Y), None);
}

#[test]
fn light_between_records_lies_between_theirs() {
    let cache = Irradiance::new(vec![record(0.0, 1.0), record(1.0, 3.0)]);
    let at = |x: f64| cache.at(DVec3::X * x, DVec3::Y).map(|c| c[0]);
    assert_eq!(
        (at(0.0), at(1.0), at(0.5)),
        (Some(1.0), Some(3.0), Some(2.0))
    );
    assert_eq!(at(-1.0), None);
    assert_eq!(at(-0.5), Some(1.0));
}

/// A small record in a large one bounds it, although the large one's point is far from it.
#[test]
fn records_within_another_are_found_however_small() {
    let small = IrradianceRecord {
        radius: 0.01,
        ..record(0.6, 1.0)
    };
    let turned = IrradianceRecord {
        normal: DVec3::X,
        ..record(0.3, 1.0)
    };
    let cache = Irradiance::new(vec![record(0.0, 1.0), small, record(5.0, 1.0), turned]);
    let mut found = Vec::new();
    cache.within(&cache.records[0], |other| found.push(*other));
    assert_eq!(found, [record(0.0, 1.0), small]);
}
