//! FLIP, the difference of two pictures that a viewer sees who flips between them: Andersson,
//! Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images" (2020), for pictures of low dynamic range.
//!
//! Names and numbers are those of the paper, whose sections are cited. Filters are sums of
//! products of Gaussians, and are applied row by row and then column by column. At the borders
//! the outermost pixels are repeated.

use rayon::prelude::*;

/// Pixels to a degree of the visual field: a monitor of 3840 pixels on 0.7 m, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * (std::f64::consts::PI / 180.0);

/// Section 4.1, table 1: the contrast sensitivity of the achromatic, red-green and blue-yellow
/// channels as sums of Gaussians of these amplitudes and widths in the frequency domain.
const SENSITIVITY: [[(f64, f64); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

/// Section 4.1: exponent of colour differences; section 4.1.3: the break of their remapping.
const COLOR_EXPONENT: f64 = 0.7;
const BREAK: [f64; 2] = [0.4, 0.95];

/// Section 4.2: width of the features in degrees, and the exponent of their differences.
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_EXPONENT: f64 = 0.5;

/// A column of numbers, row by row.
type Plane = Vec<f64>;

/// The size of a picture.
#[derive(Clone, Copy)]
struct Size {
    width: usize,
    height: usize,
}

/// Returns the difference of each pixel, from 0 to 1, of two pictures in linear Rec. 709 from 0
/// to 1, row by row.
pub fn flip(reference: &[[f64; 3]], test: &[[f64; 3]], width: usize) -> Vec<f32> {
    let size = Size {
        width,
        height: reference.len() / width.max(1),
    };
    let [reference, test] = [reference, test].map(|pixels| Seen::of(pixels, size));
    let green = hunt(lab(xyz([0.0, 1.0, 0.0])));
    let blue = hunt(lab(xyz([0.0, 0.0, 1.0])));
    let most = libm::pow(hyab(green, blue), COLOR_EXPONENT);
    let of = |i: usize| {
        let apart = hyab(reference.color[i], test.color[i]);
        let color = remapped(libm::pow(apart, COLOR_EXPONENT), most);
        let [edges, points] =
            [0, 1].map(|k| (reference.features[k][i] - test.features[k][i]).abs());
        let feature = libm::pow(edges.max(points) / 2.0_f64.sqrt(), FEATURE_EXPONENT);
        libm::pow(color, 1.0 - feature.clamp(0.0, 1.0)) as f32
    };
    (0..reference.color.len()).into_par_iter().map(of).collect()
}

/// A picture as a viewer sees it.
struct Seen {
    /// L*a*b* of the filtered picture, with Hunt's effect.
    color: Vec<[f64; 3]>,
    /// Strengths of edges and of points.
    features: [Plane; 2],
}

impl Seen {
    fn of(pixels: &[[f64; 3]], size: Size) -> Seen {
        let opponent: Vec<[f64; 3]> = pixels.iter().map(|rgb| ycxcz(xyz(*rgb))).collect();
        let plane = |k: usize| -> Plane { opponent.iter().map(|c| c[k]).collect() };
        let filtered: Vec<Plane> = (0..3)
            .map(|k| spatial(&plane(k), &SENSITIVITY[k], size))
            .collect();
        let color = |i: usize| {
            let c = [0, 1, 2].map(|k| filtered[k][i]);
            let rgb = rgb(xyz_of_ycxcz(c)).map(|x| x.clamp(0.0, 1.0));
            hunt(lab(xyz(rgb)))
        };
        let lightness: Plane = opponent.iter().map(|c| (c[0] + 16.0) / 116.0).collect();
        Seen {
            color: (0..pixels.len()).into_par_iter().map(color).collect(),
            features: features(&lightness, size),
        }
    }
}

/// Filters a channel by its contrast sensitivity (section 4.1.1).
fn spatial(plane: &Plane, gaussians: &[(f64, f64); 2], size: Size) -> Plane {
    let pi = std::f64::consts::PI;
    // Three deviations of the widest Gaussian of all channels.
    let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i64;
    let mut sum = vec![0.0; plane.len()];
    let mut total = 0.0;
    for (a, b) in gaussians.iter().filter(|(a, _)| *a > 0.0) {
        let weights: Vec<f64> = (-radius..=radius)
            .map(|i| libm::exp(-pi * pi * (i as f64 / PIXELS_PER_DEGREE).powi(2) / b))
            .collect();
        let amplitude = a * (pi / b).sqrt();
        total += amplitude * weights.iter().sum::<f64>().powi(2);
        let part = separable(plane, (&weights, &weights), size);
        for (sum, part) in sum.iter_mut().zip(part) {
            *sum += amplitude * part;
        }
    }
    sum.iter().map(|x| x / total).collect()
}

/// Returns the strengths of edges and of points (section 4.2): lengths of first and second
/// derivatives of Gaussians, whose weights of each sign have the sum 1.
fn features(lightness: &Plane, size: Size) -> [Plane; 2] {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i64;
    let at = |i: i64| i as f64;
    let gaussian = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
    let smooth: Vec<f64> = (-radius..=radius).map(|i| gaussian(at(i))).collect();
    let total: f64 = smooth.iter().sum();
    let smooth: Vec<f64> = smooth.iter().map(|w| w / total).collect();
    let first = |x: f64| -x * gaussian(x);
    let second = |x: f64| (x * x / (deviation * deviation) - 1.0) * gaussian(x);
    let of = |derivative: &dyn Fn(f64) -> f64| -> Plane {
        let weights: Vec<f64> = (-radius..=radius).map(|i| derivative(at(i))).collect();
        let sum = |sign: f64| -> f64 { weights.iter().map(|w| (w * sign).max(0.0)).sum() };
        let (more, less) = (sum(1.0), sum(-1.0));
        let weights: Vec<f64> = weights
            .iter()
            .map(|w| if *w < 0.0 { w / less } else { w / more })
            .collect();
        let across = separable(lightness, (&weights, &smooth), size);
        let up = separable(lightness, (&smooth, &weights), size);
        across
            .iter()
            .zip(up)
            .map(|(x, y)| libm::hypot(*x, y))
            .collect()
    };
    [of(&first), of(&second)]
}

/// Filters a plane by weights along x, and then along y.
fn separable(plane: &Plane, (along_x, along_y): (&[f64], &[f64]), size: Size) -> Plane {
    let Size { width, height } = size;
    let clamped = |at: usize, k: usize, weights: &[f64], len: usize| {
        (at + k).saturating_sub(weights.len() / 2).min(len - 1)
    };
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let from = &plane[y * width..][..width];
        for (x, sum) in row.iter_mut().enumerate() {
            for (k, w) in along_x.iter().enumerate() {
                *sum += w * from[clamped(x, k, along_x, width)];
            }
        }
    });
    let mut all = vec![0.0; plane.len()];
    all.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (k, w) in along_y.iter().enumerate() {
            let from = &rows[clamped(y, k, along_y, height) * width..][..width];
            for (sum, x) in row.iter_mut().zip(from) {
                *sum += w * x;
            }
        }
    });
    all
}

/// Stretches small differences (section 4.1.3).
fn remapped(difference: f64, most: f64) -> f64 {
    let [share, to] = BREAK;
    let bend = share * most;
    match difference < bend {
        true => to / bend * difference,
        false => to + (difference - bend) / (most - bend) * (1.0 - to),
    }
}

/// The distance of colours that may be far apart (Abasi, Amani Tehran & Fairchild 2020).
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + libm::hypot(a[1] - b[1], a[2] - b[2])
}

/// Applies Hunt's effect: colours are less colourful where it is dark.
fn hunt([l, a, b]: [f64; 3]) -> [f64; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// XYZ of linear Rec. 709, as exact fractions of the primaries' chromaticities.
const TO_XYZ: [[f64; 3]; 3] = [
    [
        10_135_552.0 / 24_577_794.0,
        8_788_810.0 / 24_577_794.0,
        4_435_075.0 / 24_577_794.0,
    ],
    [
        2_613_072.0 / 12_288_897.0,
        8_788_810.0 / 12_288_897.0,
        887_015.0 / 12_288_897.0,
    ],
    [
        1_425_312.0 / 73_733_382.0,
        8_788_810.0 / 73_733_382.0,
        70_074_185.0 / 73_733_382.0,
    ],
];

fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    TO_XYZ.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

/// Solves for linear Rec. 709 by Cramer's rule.
fn rgb(xyz: [f64; 3]) -> [f64; 3] {
    let columns = [0, 1, 2].map(|k| glam::DVec3::from_array(TO_XYZ.map(|row| row[k])));
    let v = glam::DVec3::from_array(xyz);
    let [r, g, b] = columns;
    let determinant = r.dot(g.cross(b));
    [v.dot(g.cross(b)), r.dot(v.cross(b)), r.dot(g.cross(v))].map(|x| x / determinant)
}

/// XYZ over that of white.
fn relative(c: [f64; 3]) -> [f64; 3] {
    let white = xyz([1.0; 3]);
    std::array::from_fn(|k| c[k] / white[k])
}

fn ycxcz(c: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative(c);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn xyz_of_ycxcz([l, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (l + 16.0) / 116.0;
    let c = [y + cx / 500.0, y, y - cz / 200.0];
    let white = xyz([1.0; 3]);
    std::array::from_fn(|k| c[k] * white[k])
}

fn lab(c: [f64; 3]) -> [f64; 3] {
    // CIE 1976: a cube root, and a line near 0.
    let bend = 6.0_f64 / 29.0;
    let f = |t: f64| match t > bend.powi(3) {
        true => libm::cbrt(t),
        false => t / (3.0 * bend * bend) + 4.0 / 29.0,
    };
    let [x, y, z] = relative(c).map(f);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}
