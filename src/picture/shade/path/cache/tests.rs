use super::*;
use glam::{DMat2, DVec2};

fn record(x: f64, light: f32) -> IrradianceRecord {
    IrradianceRecord {
        point: DVec3::new(x, 0.0, 0.0),
        normal: DVec3::Y,
        axes: [DVec3::X, DVec3::NEG_Z],
        light: [light; 3],
        gradient: [DVec2::ZERO; 3],
        turn: [DVec2::ZERO; 3],
        metric: DMat2::IDENTITY,
        radii: [1.0; 2],
        least_cosine: 0.0,
        close: 0.0,
        blocked: [0.0; SECTORS],
    }
}

fn with_radius(radius: f64, record: IrradianceRecord) -> IrradianceRecord {
    IrradianceRecord {
        metric: DMat2::IDENTITY * radius.powi(-2),
        radii: [radius; 2],
        ..record
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
        .map(|i| {
            let radius = 0.3 + f64::from(i % 17) / 5.0;
            let (normal, axes) = match i % 3 {
                0 => (DVec3::Y, [DVec3::X, DVec3::NEG_Z]),
                _ => {
                    let normal = (DVec3::Y + place(i + 3) * 0.01).normalize();
                    (normal, normal.any_orthonormal_pair().into())
                }
            };
            let one = IrradianceRecord {
                point: place(i),
                normal,
                axes,
                ..record(0.0, i as f32)
            };
            with_radius(radius, one)
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

/// What stands beside a record ends it there, and nowhere else.
#[test]
fn records_serve_nothing_behind_what_stands_around() {
    let mut one = record(0.0, 1.0);
    // A wall at x = 0.5.
    for sector in 0..SECTORS {
        one.blocked[sector] = (sector_direction(sector).x / 0.5).max(0.0) as f32;
    }
    let weight = |x: f64, z: f64| one.weight(DVec3::new(x, 0.0, z), DVec3::Y);
    for i in -9..=9 {
        let z = f64::from(i) / 10.0;
        assert_eq!(weight(0.5, z), 0.0, "{z}");
        let before = f64::hypot(0.4, z);
        let after = f64::hypot(0.2, z);
        assert!(before >= 1.0 || weight(0.4, z) > 0.0, "{z}");
        assert!((weight(-0.2, z) - (1.0 - after).max(0.0)).abs() < 1e-12);
    }
    assert!(one.extent() > 0.95 && one.extent() < 1.2);
    let around = IrradianceRecord {
        blocked: [4.0; SECTORS],
        ..one
    };
    assert!(around.extent() < 0.25);
}

#[test]
fn an_oblong_record_serves_farther_along_than_across() {
    let one = IrradianceRecord {
        metric: DMat2::from_diagonal(DVec2::new(1.0, 16.0)),
        ..record(0.0, 1.0)
    };
    assert_eq!(one.weight(DVec3::X * 0.5, DVec3::Y), 0.5);
    assert_eq!(one.weight(DVec3::Z * 0.125, DVec3::Y), 0.5);
    assert_eq!(one.weight(DVec3::Z * 0.25, DVec3::Y), 0.0);
}

#[test]
fn records_serve_what_turns_away_only_where_it_is_close() {
    let one = IrradianceRecord {
        least_cosine: 0.98,
        close: 0.1,
        ..record(0.0, 1.0)
    };
    let turned = DVec3::new(0.5, 1.0, 0.0).normalize();
    assert!(one.weight(DVec3::X * 0.05, turned) > 0.0);
    assert_eq!(one.weight(DVec3::X * 0.15, turned), 0.0);
    assert!(one.weight(DVec3::X * 0.15, DVec3::new(0.1, 1.0, 0.0).normalize()) > 0.0);
}

#[test]
fn light_changes_as_the_record_says() {
    let one = IrradianceRecord {
        gradient: [DVec2::new(0.5, 0.0), DVec2::new(0.0, 2.0), DVec2::ZERO],
        turn: [DVec2::ZERO, DVec2::ZERO, DVec2::new(0.3, 0.0)],
        ..record(0.0, 1.0)
    };
    let turned = DVec3::new(0.1, 1.0, 0.0);
    let light = one.at(DVec3::new(0.2, 0.0, 0.1), turned);
    let expected = [1.1, 0.8, 1.03];
    assert!(
        (0..3).all(|k| (light[k] - expected[k]).abs() < 1e-6),
        "{light:?}"
    );
    // Light is never less than none.
    let steep = IrradianceRecord {
        gradient: [DVec2::new(4.0, 0.0); 3],
        ..one
    };
    let cache = Irradiance::new(vec![steep]);
    assert_eq!(cache.at(DVec3::X * -0.5, DVec3::Y), Some([0.0; 3]));
}
