use super::*;
use std::collections::BTreeMap;

fn picture(width: u32, channels: &[(&str, Channel)]) -> ChannelPicture {
    let of = |(name, channel): &(&str, Channel)| (name.to_string(), channel.clone());
    let rows = match &channels[0].1 {
        Channel::Numbers(rows) => rows.len(),
        Channel::Ids(rows) => rows.len(),
    };
    ChannelPicture {
        width,
        height: rows as u32 / width,
        encoding: Encoding::Linear,
        channels: channels.iter().map(of).collect::<BTreeMap<_, _>>(),
    }
}

fn numbers(rows: &[f32]) -> Channel {
    Channel::Numbers(rows.to_vec())
}

#[test]
fn errors_are_those_of_their_definitions() {
    let a = picture(2, &[("Z", numbers(&[1.0, 2.0, f32::NAN, f32::INFINITY]))]);
    let b = picture(2, &[("Z", numbers(&[1.0, 4.0, 1.0, f32::INFINITY]))]);
    let channels = comparable((&a, &b), None).unwrap();
    let found = compare((&a, &b), &channels, 0.0);
    assert_eq!((found.wrong, found.pixels), (2, 4));
    let row = &found.channels[0];
    assert_eq!((row.differ, row.not_finite), (2, 1));
    let e = found.error;
    assert_eq!((e.max, e.mean, e.bias), (2.0, 1.0, -1.0));
    assert_eq!(e.rmse, 2.0_f64.sqrt());
    assert!((e.relmse - 0.5 * 4.0 / 16.01).abs() < 1e-12);
    assert!(found.flip.is_none());
    assert_eq!(compare((&a, &b), &channels, 2.0).wrong, 1);
    // NaN in both is no difference.
    assert_eq!(compare((&a, &a), &channels, 0.0).wrong, 0);
}

#[test]
fn ids_are_counted() {
    let a = picture(3, &[("id", Channel::Ids(vec![1, 2, 3]))]);
    let b = picture(3, &[("id", Channel::Ids(vec![1, 9, 4]))]);
    let channels = comparable((&a, &b), None).unwrap();
    let found = compare((&a, &b), &channels, 1e9);
    assert_eq!((found.wrong, found.channels[0].differ), (2, 2));
}

#[test]
fn pictures_of_other_sizes_or_channels_are_refused_with_the_remedy() {
    let a = picture(2, &[("R", numbers(&[0.0; 2])), ("a.X", numbers(&[0.0; 2]))]);
    let b = picture(1, &[("R", numbers(&[0.0; 2]))]);
    let said = comparable((&a, &b), None).unwrap_err();
    assert!(
        said.contains("2x1 and 1x2") && said.contains("--size"),
        "{said}"
    );
    let b = picture(2, &[("R", numbers(&[0.0; 2])), ("Z", numbers(&[0.0; 2]))]);
    let said = comparable((&a, &b), None).unwrap_err();
    assert!(
        said.contains("only the first has a.X, only the second has Z;"),
        "{said}"
    );
    assert!(said.contains("--channels"), "{said}");
    let some = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
    assert_eq!(comparable((&a, &b), Some(&some(&["R"]))).unwrap(), ["R"]);
    assert_eq!(comparable((&a, &a), Some(&some(&["a"]))).unwrap(), ["a.X"]);
    let said = comparable((&a, &b), Some(&some(&["Q"]))).unwrap_err();
    assert!(said.contains("known are R, a.X"), "{said}");
    let mut b = a.clone();
    b.encoding = Encoding::Srgb;
    assert!(comparable((&a, &b), None).unwrap_err().contains("sRGB"));
}

/// Values of the authors' own evaluator (flip-evaluator 1.7), for pictures given by formulas.
#[test]
fn flip_is_that_of_its_authors() {
    let (width, height) = (64, 48);
    let at = |i: usize| ((i % width) as f64, (i / width) as f64);
    let base: Vec<[f64; 3]> = (0..width * height)
        .map(|i| {
            let (x, y) = at(i);
            [x / 63.0, y / 47.0, 0.5 * (x + y) / 110.0]
        })
        .collect();
    let mean = |test: &[[f64; 3]]| {
        let map = flip(&base, test, width);
        map.iter().map(|x| f64::from(*x)).sum::<f64>() / map.len() as f64
    };
    assert_eq!(mean(&base), 0.0);
    let darker: Vec<_> = base.iter().map(|c| c.map(|x| 0.8 * x)).collect();
    let mut dots = base.clone();
    for i in (0..dots.len()).step_by(97) {
        dots[i] = [1.0; 3];
    }
    let swapped: Vec<_> = base.iter().map(|[r, g, b]| [*g, *b, *r]).collect();
    for (test, expected) in [
        (darker, 0.351_616_5),
        (dots, 0.045_454_8),
        (swapped, 0.872_642_8),
    ] {
        let found = mean(&test);
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
}
