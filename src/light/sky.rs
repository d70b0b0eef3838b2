//! The clear sky by day: Preetham, Shirley and Smits 1999, "A Practical Analytic Model for
//! Daylight", appendix A, as a map and a directional light.
//!
//! The sky is Perez' function of five coefficients, linear in turbidity, for luminance and
//! both chromaticities. The sun is the extraterrestrial illuminance, less what air and haze
//! scatter. y is up. Luminances become radiances by [`EFFICACY`]. The model is meant for
//! turbidities from 2 (very clear) to 10 (haze); nearer to the horizon than a few degrees the
//! sun of real skies is redder.

use lanecast_model::scene::{Environment, Light, Rgb};
use std::f64::consts::{FRAC_PI_2, PI};

/// Lumens of a watt of daylight.
const EFFICACY: f64 = 179.0;
/// Half the angle of the sun's disc, in radians: 0.53° in all.
const SUN: f64 = 0.004_625;
/// Illuminance of the sun above the air, in lux.
const SUN_ILLUMINANCE: f64 = 133_100.0;
const WIDTH: u32 = 512;
const HEIGHT: u32 = WIDTH / 2;

/// Makes the sky and the sun; `towards_sun` is any vector ≠ 0 and counts as lying on the
/// horizon at least. Turbidity is clamped to [1.7, 10], the albedo of the ground, which shows
/// below the horizon, to [0, 1].
pub fn sky(towards_sun: [f64; 3], turbidity: f64, ground_albedo: Rgb) -> (Environment, Light) {
    let [x, y, z] = towards_sun;
    let turbidity = turbidity.clamp(1.7, 10.0);
    let flat = libm::hypot(x, z);
    let length = libm::hypot(flat, y.max(0.0)).max(f64::MIN_POSITIVE);
    let sun = [x / length, y.max(0.0) / length, z / length];
    let perez = Perez::new(sun[1].min(1.0), turbidity);
    let direct = sun_irradiance(sun[1], turbidity);
    let above: Vec<Rgb> = (0..WIDTH * HEIGHT / 2)
        .map(|k| perez.radiance(sun, direction(k)))
        .collect();
    // The ground reflects the irradiance of sky and sun.
    let mut irradiance = direct.map(|e| e * sun[1]);
    for (k, radiance) in (0..).zip(&above) {
        let cos = direction(k)[1];
        let solid = 2.0 * PI / f64::from(WIDTH) * PI / f64::from(HEIGHT) * (1.0 - cos * cos).sqrt();
        for (sum, &l) in irradiance.iter_mut().zip(radiance) {
            *sum += f64::from(l) * cos * solid;
        }
    }
    let ground: Rgb =
        std::array::from_fn(|c| (irradiance[c] / PI) as f32 * ground_albedo[c].clamp(0.0, 1.0));
    let below = std::iter::repeat_n(ground, (WIDTH * HEIGHT / 2) as usize);
    let map = Environment {
        width: WIDTH,
        height: HEIGHT,
        pixels: above.into_iter().chain(below).collect(),
        rotation: 0.0,
        scale: [1.0; 3],
    };
    let light = Light::Directional {
        direction: glam::DVec3::from(sun.map(|x| -x)),
        irradiance: direct.map(|e| e as f32),
        angle: SUN,
    };
    (map, light)
}

/// Returns the direction of a pixel's middle, by the map's convention.
fn direction(k: u32) -> [f64; 3] {
    let (column, row) = (f64::from(k % WIDTH) + 0.5, f64::from(k / WIDTH) + 0.5);
    let (sin, cos) = libm::sincos(row / f64::from(HEIGHT) * PI);
    let (s, c) = libm::sincos((column / f64::from(WIDTH) - 0.5) * 2.0 * PI);
    [sin * s, cos, -sin * c]
}

/// Perez' function for luminance Y and chromaticities x and y, scaled to the zenith.
struct Perez {
    coefficients: [[f64; 5]; 3],
    /// The zenith's value over the function's value there.
    scale: [f64; 3],
}

/// The five coefficients as slope and value at turbidity 0.
const LUMINANCE: [[f64; 2]; 5] = [
    [0.1787, -1.4630],
    [-0.3554, 0.4275],
    [-0.0227, 5.3251],
    [0.1206, -2.5771],
    [-0.0670, 0.3703],
];
const CHROMATICITY_X: [[f64; 2]; 5] = [
    [-0.0193, -0.2592],
    [-0.0665, 0.0008],
    [-0.0004, 0.2125],
    [-0.0641, -0.8989],
    [-0.0033, 0.0452],
];
const CHROMATICITY_Y: [[f64; 2]; 5] = [
    [-0.0167, -0.2608],
    [-0.0950, 0.0092],
    [-0.0079, 0.2102],
    [-0.0441, -1.6537],
    [-0.0109, 0.0529],
];
/// The zenith's chromaticities: rows for T², T and 1, columns for θ³, θ², θ and 1.
const ZENITH_X: [[f64; 4]; 3] = [
    [0.001_66, -0.003_75, 0.002_09, 0.0],
    [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
    [0.116_93, -0.211_96, 0.060_52, 0.258_86],
];
const ZENITH_Y: [[f64; 4]; 3] = [
    [0.002_75, -0.006_10, 0.003_17, 0.0],
    [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
    [0.153_46, -0.267_56, 0.066_70, 0.266_88],
];

impl Perez {
    fn new(sun_height: f64, turbidity: f64) -> Perez {
        let theta = libm::acos(sun_height);
        let at = |[slope, start]: [f64; 2]| slope * turbidity + start;
        let coefficients = [LUMINANCE, CHROMATICITY_X, CHROMATICITY_Y].map(|all| all.map(at));
        let cubic = |rows: [[f64; 4]; 3]| {
            let [a, b, c] = rows.map(|[p, q, r, s]| ((p * theta + q) * theta + r) * theta + s);
            (a * turbidity + b) * turbidity + c
        };
        let chi = (4.0 / 9.0 - turbidity / 120.0) * (PI - 2.0 * theta);
        let luminance =
            (4.0453 * turbidity - 4.9710) * libm::tan(chi) - 0.2155 * turbidity + 2.4192;
        // In cd/m²; the fit dips below nothing where the sun sets in clear air.
        let zenith = [
            luminance.max(0.05) * 1000.0,
            cubic(ZENITH_X),
            cubic(ZENITH_Y),
        ];
        let scale = std::array::from_fn(|k| zenith[k] / value(&coefficients[k], 1.0, theta));
        Perez {
            coefficients,
            scale,
        }
    }

    /// Returns the radiance from a direction above the horizon.
    fn radiance(&self, sun: [f64; 3], [x, y, z]: [f64; 3]) -> Rgb {
        let cos = (x * sun[0] + y * sun[1] + z * sun[2]).clamp(-1.0, 1.0);
        let gamma = libm::acos(cos);
        let of = |k: usize| self.scale[k] * value(&self.coefficients[k], y.max(0.01), gamma);
        let [luminance, x, y] = [0, 1, 2].map(of);
        let (big_x, big_z) = (x / y * luminance, (1.0 - x - y) / y * luminance);
        // CIE XYZ to linear Rec. 709.
        let rgb = [
            3.240_97 * big_x - 1.537_383 * luminance - 0.498_611 * big_z,
            -0.969_244 * big_x + 1.875_968 * luminance + 0.041_555 * big_z,
            0.055_63 * big_x - 0.203_977 * luminance + 1.056_972 * big_z,
        ];
        rgb.map(|l| (l / EFFICACY).max(0.0) as f32)
    }
}

/// Perez' function of the cosine to the zenith and the angle to the sun.
fn value([a, b, c, d, e]: &[f64; 5], cos: f64, gamma: f64) -> f64 {
    let near = libm::cos(gamma);
    (1.0 + a * libm::exp(b / cos)) * (1.0 + c * libm::exp(d * gamma) + e * near * near)
}

/// Returns the sun's irradiance on a surface that faces it: Rayleigh scattering and Ångström's
/// haze at the wavelengths of the three primaries (appendix A.1).
fn sun_irradiance(height: f64, turbidity: f64) -> [f64; 3] {
    let degrees = (FRAC_PI_2 - libm::asin(height.clamp(0.0, 1.0))).to_degrees();
    let mass = 1.0 / (height + 0.15 * libm::pow(93.885 - degrees, -1.253));
    let haze = 0.046_08 * turbidity - 0.045_86;
    [0.612, 0.549, 0.465].map(|micrometres| {
        let air = 0.008_735 * libm::pow(micrometres, -4.08);
        let haze = haze * libm::pow(micrometres, -1.3);
        SUN_ILLUMINANCE / EFFICACY * libm::exp(-mass * (air + haze))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(map: &Environment, direction: [f64; 3]) -> Rgb {
        let [x, y, z] = direction;
        let column = (0.5 + libm::atan2(x, -z) / (2.0 * PI)) * f64::from(WIDTH);
        let row = libm::acos(y) / PI * f64::from(HEIGHT);
        map.pixels[row as usize * WIDTH as usize + column as usize]
    }

    #[test]
    fn the_zenith_has_the_luminance_of_the_fit() {
        // T = 3 and the sun at 45°: χ = (4/9 − 1/40)·π/2 and 7.16 kcd/m².
        let (map, _) = sky([1.0, 1.0, 0.0], 3.0, [0.0; 3]);
        let [r, g, b] = pixel(&map, [1e-3, 1.0, 0.0]).map(f64::from);
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let chi = (4.0 / 9.0 - 0.025) * PI / 2.0;
        let expected = (7.1649 * chi.tan() + 1.7727) * 1000.0 / EFFICACY;
        assert!(
            (luminance / expected - 1.0).abs() < 0.01,
            "{luminance}, not {expected}"
        );
        assert!(b > 1.5 * r, "the zenith is blue: {r} {g} {b}");
    }

    #[test]
    fn skies_are_finite_bright_near_the_sun_and_ground_reflects() {
        for height in [-0.2_f64, 0.0, 0.05, 0.5, 1.0] {
            for turbidity in [0.0, 2.0, 4.0, 10.0, 50.0] {
                let sun = [0.3, height, -1.0];
                let (map, light) = sky(sun, turbidity, [0.2; 3]);
                assert!(
                    map.pixels
                        .iter()
                        .flatten()
                        .all(|x| x.is_finite() && *x >= 0.0)
                );
                let Light::Directional {
                    irradiance,
                    direction,
                    ..
                } = light
                else {
                    unreachable!()
                };
                assert!(irradiance.iter().all(|x| x.is_finite() && *x >= 0.0));
                assert!((direction.length() - 1.0).abs() < 1e-12 && direction.y <= 0.0);
            }
        }
        let sun = [0.6, 0.8, 0.0];
        let (map, light) = sky(sun, 3.0, [0.2; 3]);
        assert!(pixel(&map, sun)[1] > 3.0 * pixel(&map, [-0.6, 0.8, 0.0])[1]);
        let Light::Directional { irradiance, .. } = light else {
            unreachable!()
        };
        assert!(
            irradiance[0] > irradiance[2],
            "the sun is yellow: {irradiance:?}"
        );
        // Full daylight is some 100,000 lux, the sky's part 10 to 30 thousand.
        let ground = f64::from(pixel(&map, [0.0, -0.5, 0.5])[1]) / 0.2 * PI * EFFICACY;
        assert!((70_000.0..140_000.0).contains(&ground), "{ground} lux");
    }
}
