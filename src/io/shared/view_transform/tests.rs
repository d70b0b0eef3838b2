//! Tests of view transforms against published formulas and values, and of dithering.

use super::*;

fn close(a: [f64; 3], b: [f64; 3], within: f64) {
    for (a, b) in a.into_iter().zip(b) {
        assert!((a - b).abs() <= within, "{a} {b}");
    }
}

#[test]
fn neutral_keeps_base_colours() {
    // Under a light of 1 a dielectric adds its 4 %, which the curve takes away again.
    for base in [0.05, 0.2, 0.5, 0.76] {
        let lit = [base + 0.04, 0.3 + 0.04, 0.1 + 0.04];
        close(Tone::Neutral.apply(lit), [base, 0.3, 0.1], 1e-15);
    }
    // The toe is x − (x − x²/0.16) = x²/0.16.
    close(Tone::Neutral.apply([0.04; 3]), [0.01; 3], 1e-15);
    // Peak 4.8 − 0.04, new peak 1 − 0.24²/(4.76 + 0.24 − 0.76).
    let grey = 1.0 - 0.0576 / 4.24;
    close(Tone::Neutral.apply([4.8; 3]), [grey; 3], 1e-14);
    // A saturated highlight: the least channel is moved towards the peak by g.
    let peak = 1.0 - 0.0576 / 9.48;
    let g = 1.0 - 1.0 / (0.15 * (10.0 - peak) + 1.0);
    close(
        Tone::Neutral.apply([10.0, 0.0, 0.0]),
        [peak, g * peak, g * peak],
        1e-14,
    );
}

#[test]
fn agx_has_its_published_shape() {
    // Wrensch's polynomial of degree 6 ("Minimal AgX implementation", 2023) approximates it.
    for i in 0..=1000 {
        let x = f64::from(i) / 1000.0;
        let high = 15.5 * x.powi(6) - 40.14 * x.powi(5) + 31.96 * x.powi(4);
        let fit = high - 6.868 * x.powi(3) + 0.4298 * x * x + 0.1191 * x - 0.00232;
        assert!((agx_curve(x) - fit).abs() < 0.006, "{x}");
    }
    assert!(agx_curve(0.0).abs() < 1e-12 && (agx_curve(1.0) - 1.0).abs() < 1e-12);
    assert_eq!(agx_curve(10.0 / 16.5), 0.5);
    // Middle grey goes to one half of the display's signal, 6.5 stops above it to white, and
    // 10 below to black.
    close(Tone::Agx.apply([0.18; 3]), [0.5_f64.powf(2.2); 3], 1e-7);
    close(
        Tone::Agx.apply([0.18 * 2.0_f64.powf(6.5); 3]),
        [1.0; 3],
        1e-6,
    );
    close(Tone::Agx.apply([0.18 / 1024.0; 3]), [0.0; 3], 1e-9);
    // A strong red loses saturation as it grows.
    let [r, g, b] = Tone::Agx.apply([40.0, 0.0, 0.0]);
    assert!(r > 0.95 && g > 0.2 && b > 0.2, "{r} {g} {b}");
}

#[test]
fn aces_follows_its_fit() {
    let fit =
        |v: f64| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    for v in [0.1, 0.18, 1.0, 5.0] {
        close(Tone::Aces.apply([v; 3]), [fit(v); 3], 1.1e-5);
    }
    close(Tone::Aces.apply([1e20; 3]), [1.0; 3], 0.0);
}

#[test]
fn matrices_keep_white_and_invert() {
    for (there, back) in [(REC2020_FROM_709, REC709_FROM_2020)] {
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            close(product(&back, product(&there, unit)), unit, 1e-14);
        }
    }
    for matrix in [REC2020_FROM_709, REC709_FROM_2020, AGX_INSET, AGX_OUTSET] {
        close(product(&matrix, [1.0; 3]), [1.0; 3], 1e-14);
    }
    for matrix in [ACES_IN, ACES_OUT] {
        close(product(&matrix, [1.0; 3]), [1.0; 3], 1.1e-5);
    }
}

#[test]
fn greys_stay_grey_and_in_order() {
    for tone in Tone::ALL {
        let mut last = 0.0;
        for i in 0..=4000 {
            let value = libm::exp2(f64::from(i) / 100.0 - 20.0);
            let [r, g, b] = tone.apply([value; 3]);
            // The rows of the matrices of ACES add up to 1 within 1e-5.
            close([r; 3], [r, g, b], 1.1e-5);
            assert!(r >= last - 1e-12, "{tone:?} {value}: {r} after {last}");
            last = r;
        }
        assert!(last > 0.999, "{tone:?}");
        for odd in [f64::NAN, -1.0, f64::NEG_INFINITY] {
            close(tone.apply([odd; 3]), tone.apply([0.0; 3]), 0.0);
        }
        assert!(
            tone.apply([f64::INFINITY, 0.0, 1.0])
                .iter()
                .all(|c| (0.0..=1.0).contains(c))
        );
    }
}

/// Encodes a ramp of the signal, of 1/4096 a pixel along the row or column `line`, in 8 bits.
fn ramp(dither: bool, line: u32, is_column: bool) -> Vec<f64> {
    let development = Development {
        dither,
        ..Development::default()
    };
    let code = |at: u32| {
        let linear = crate::shared::srgb::linear_from_srgb(f64::from(at) / 4096.0);
        let (x, y) = if is_column { (line, at) } else { (at, line) };
        f64::from(development.developer().encode([linear; 3], x, y)[0])
    };
    (0..4096).map(code).collect()
}

fn longest_run(codes: &[f64]) -> usize {
    codes
        .chunk_by(|a, b| a == b)
        .map(<[f64]>::len)
        .max()
        .unwrap_or(0)
}

#[test]
fn a_slow_ramp_shows_no_bands() {
    let (mut sum, mut lines) = (0.0, 0.0);
    for (line, is_column) in (0..128).map(|i| (i / 2, i % 2 == 1)) {
        let codes = ramp(true, line, is_column);
        // The last 16 pixels round up to white, which nothing can break.
        let (shown, _) = codes.split_at(4080);
        assert!(
            longest_run(&shown[8..]) <= 12,
            "line {line}, column {is_column}: {}",
            longest_run(&shown[8..])
        );
        let error: f64 = shown
            .iter()
            .enumerate()
            .map(|(x, code)| code / 255.0 - x as f64 / 4096.0)
            .sum();
        sum += error / shown.len() as f64;
        lines += 1.0;
    }
    assert!((sum / lines).abs() < 1e-4, "{}", sum / lines);
    // Rounded, each code lasts for 16 pixels.
    assert!(longest_run(&ramp(false, 0, false)[8..4080]) > 12);
}

#[test]
fn dithered_means_are_right_in_small_blocks() {
    let development = Development {
        dither: true,
        ..Development::default()
    };
    for i in 0..100 {
        let signal = 0.2 + f64::from(i) / 255.0 / 100.0;
        let linear = crate::shared::srgb::linear_from_srgb(signal);
        let mut sum = 0.0;
        for (x, y) in (0..256).map(|k| (37 + k % 16, 91 + k / 16)) {
            sum += f64::from(development.developer().encode([linear; 3], x, y)[1]);
        }
        let error = sum / 256.0 - signal * 255.0;
        assert!(error.abs() < 0.02, "{signal}: {error}");
    }
}

#[test]
fn black_and_white_are_not_dithered() {
    for bits in [Bits::Eight, Bits::Sixteen] {
        let developer = Development {
            dither: true,
            bits,
            ..Development::default()
        }
        .developer();
        for (x, y) in (0..4096).map(|k| (k % 64, k / 64)) {
            let ends = [1.0, 0.0, 7.5].map(|c: f32| if c > 0.0 { bits.highest() } else { 0 });
            assert_eq!(developer.codes([1.0, 0.0, 7.5], x, y), ends, "{x} {y}");
            for alpha in [0.0, 0.25, 1.0] {
                let codes = developer.codes_over([1.0, -1.0, 1.0], alpha, [1.0, 0.0, 1.0], x, y);
                assert_eq!(codes, ends, "{x} {y} {alpha}");
            }
        }
    }
}

#[test]
fn codes_round_as_the_table_does() {
    let table = crate::SrgbEncoder::new();
    let plain = Development::default();
    for i in 0..=5000_u32 {
        let value = i as f32 / 4500.0;
        let codes = plain.developer().codes([value, 0.0, -value], 3, 5);
        assert_eq!(codes, [u16::from(table.encode(value)), 0, 0]);
    }
    let fine = Development {
        bits: Bits::Sixteen,
        exposure: 1.0,
        ..plain
    };
    let codes = fine.developer().codes([0.5, 0.107_020_705, 0.0], 0, 0);
    assert_eq!(codes, [65535, 32768, 0]);
}
