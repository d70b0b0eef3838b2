//! View transforms: from the linear radiance of a picture to the colours of a display.
//!
//! A picture is developed for PNG in this order: alpha is divided out, the exposure multiplies,
//! the tone curve compresses, the sRGB transfer function encodes, and codes are rounded or
//! dithered. OpenEXR files keep the linear values and none of this.
//!
//! All arithmetic is f64 with the elementary functions of the crate `libm`, so that files have
//! the same bytes on all machines. Values below 0 and NaN count as 0.

use crate::scene::Rgb;

/// The curve that compresses radiance to the range of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Radiance 1 is white, and what is brighter is cut off.
    #[default]
    None,
    /// Khronos PBR Neutral: base colours up to 0.76 stay as they are; highlights lose saturation.
    Neutral,
    /// AgX (Sobotka) in Rec. 2020 primaries as Blender and Filament have it, with the default
    /// contrast: 16.5 stops about middle grey.
    Agx,
    /// Hill's fit to the reference rendering transform of ACES 1 with the sRGB output.
    Aces,
}

impl Tone {
    pub const ALL: [Tone; 4] = [Tone::None, Tone::Neutral, Tone::Agx, Tone::Aces];

    /// Returns the curve's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Tone::None => "none",
            Tone::Neutral => "neutral",
            Tone::Agx => "agx",
            Tone::Aces => "aces",
        }
    }

    /// Maps linear radiance, Rec. 709, to the linear colour that a display shows, each channel
    /// from 0 to 1.
    pub fn apply(self, color: [f64; 3]) -> [f64; 3] {
        // The upper limit keeps squares finite.
        let color = color.map(|c| if c > 0.0 { c.min(1e30) } else { 0.0 });
        match self {
            Tone::None => color,
            Tone::Neutral => neutral(color),
            Tone::Agx => agx(color),
            Tone::Aces => aces(color),
        }
        .map(|c| c.clamp(0.0, 1.0))
    }
}

/// Compresses as "Khronos PBR Neutral Tone Mapper" (2024) says. The offset takes away the 4 %
/// that a dielectric reflects.
fn neutral(color: [f64; 3]) -> [f64; 3] {
    const FRESNEL: f64 = 0.04;
    const START: f64 = 0.8 - FRESNEL;
    const DESATURATION: f64 = 0.15;
    let least = color[0].min(color[1]).min(color[2]);
    let offset = match least < 2.0 * FRESNEL {
        true => least - least * least / (4.0 * FRESNEL),
        false => FRESNEL,
    };
    let color = color.map(|c| c - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    color.map(|c| {
        let c = c * (compressed / peak);
        c + (compressed - c) * white
    })
}

/// The matrix from Rec. 709 to Rec. 2020 primaries (ITU-R BT.2087), and its inverse, both from
/// the chromaticities of the two.
const REC2020_FROM_709: [[f64; 3]; 3] = [
    [0.627403895934699, 0.329283038377884, 0.043313065687417],
    [0.069097289358232, 0.919540395075459, 0.011362315566309],
    [0.01639143887515, 0.088013307877226, 0.895595253247624],
];
const REC709_FROM_2020: [[f64; 3]; 3] = [
    [1.660491002108434, -0.58764113878855, -0.072849863319885],
    [-0.124550474521591, 1.13289989712596, -0.008349422604369],
    [-0.018150763354905, -0.100578898008007, 1.118729661362913],
];

/// AgX moves the primaries inwards before its curve, and outwards after it (constants of
/// Filament, from Blender's configuration).
const AGX_INSET: [[f64; 3]; 3] = [
    [
        0.856_627_153_315_983,
        0.095_121_240_538_158_8,
        0.048_251_606_145_858_3,
    ],
    [
        0.137_318_972_929_847,
        0.761_241_990_602_591,
        0.101_439_036_467_562,
    ],
    [
        0.111_898_212_999_95,
        0.076_799_418_603_190_3,
        0.811_302_368_396_859,
    ],
];
const AGX_OUTSET: [[f64; 3]; 3] = [
    [
        1.127_100_581_814_436_8,
        -0.110_606_643_096_603_23,
        -0.016_493_938_717_834_573,
    ],
    [
        -0.141_329_763_498_438_3,
        1.157_823_702_216_272,
        -0.016_493_938_717_834_257,
    ],
    [
        -0.141_329_763_498_438_26,
        -0.110_606_643_096_602_94,
        1.251_936_406_595_040_5,
    ],
];

fn agx(color: [f64; 3]) -> [f64; 3] {
    /// The stops below and above middle grey that the curve covers.
    const BELOW: f64 = 10.0;
    const RANGE: f64 = 16.5;
    const GREY: f64 = 0.18;
    let inset = product(&AGX_INSET, product(&REC2020_FROM_709, color));
    let curved = inset.map(|c| {
        // The least value is below the range; a logarithm of 0 is none.
        let stops = libm::log2(c.max(1e-10) / GREY);
        agx_curve(((stops + BELOW) / RANGE).clamp(0.0, 1.0))
    });
    let display = product(&AGX_OUTSET, curved);
    let linear = display.map(|c| libm::pow(c.max(0.0), 2.2));
    product(&REC709_FROM_2020, linear)
}

/// Returns AgX's default contrast: a curve from (0, 0) to (1, 1) through the pivot, middle grey
/// to one half, with slope 2 there, and powers 3 and 3.25 of its toe and shoulder.
///
/// Each half is s·z/(1 + z^p)^(1/p) of z = slope·distance/s, where s makes it end at 0 or 1.
fn agx_curve(x: f64) -> f64 {
    const PIVOT: [f64; 2] = [10.0 / 16.5, 0.5];
    const SLOPE: f64 = 2.0;
    const TOE: f64 = 0.5122773822930714;
    const SHOULDER: f64 = 0.5414641562781498;
    let distance = SLOPE * (x - PIVOT[0]);
    if distance < 0.0 {
        let z = -distance / TOE;
        PIVOT[1] - TOE * z / libm::cbrt(1.0 + z * z * z)
    } else {
        let z = distance / SHOULDER;
        PIVOT[1] + SHOULDER * z / libm::pow(1.0 + libm::pow(z, 3.25), 1.0 / 3.25)
    }
}

/// From linear Rec. 709 to the space of the fit, with ACES's own desaturation, and back.
const ACES_IN: [[f64; 3]; 3] = [
    [0.597_19, 0.354_58, 0.048_23],
    [0.076_00, 0.908_34, 0.015_66],
    [0.028_40, 0.133_83, 0.837_77],
];
const ACES_OUT: [[f64; 3]; 3] = [
    [1.604_75, -0.531_08, -0.073_67],
    [-0.102_08, 1.108_13, -0.006_05],
    [-0.003_27, -0.072_76, 1.076_02],
];

fn aces(color: [f64; 3]) -> [f64; 3] {
    let curved = product(&ACES_IN, color).map(|v| {
        let above = v * (v + 0.024_578_6) - 0.000_090_537;
        above / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081)
    });
    product(&ACES_OUT, curved)
}

fn product(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The bits of a channel in a PNG file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bits {
    #[default]
    Eight,
    Sixteen,
}

impl Bits {
    /// Returns the highest code.
    pub fn highest(self) -> u16 {
        match self {
            Bits::Eight => 255,
            Bits::Sixteen => u16::MAX,
        }
    }
}

/// How a picture is developed for PNG. The default cuts off at 1, and rounds to the nearest of
/// 8 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Development {
    pub tone: Tone,
    /// Stops: radiance is multiplied by 2^exposure.
    pub exposure: f64,
    /// Whether codes are dithered, so that a slow ramp shows no bands, or rounded.
    pub dither: bool,
    pub bits: Bits,
    /// What a picture with alpha is laid over, in linear colours as they are displayed: neither
    /// exposure nor tone curve touch it, so that white is white. The file has no alpha then.
    pub behind: Option<Rgb>,
}

impl Development {
    /// Whether channels can be encoded one by one, by a table.
    pub(crate) fn is_plain(&self) -> bool {
        *self == Development::default()
    }

    /// Prepares what is the same for all pixels.
    pub fn developer(&self) -> Developer {
        Developer {
            tone: self.tone,
            factor: libm::exp2(self.exposure),
            dither: self.dither,
            highest: self.bits.highest(),
        }
    }
}

/// A development, ready for pixels.
#[derive(Clone, Copy, Debug)]
pub struct Developer {
    tone: Tone,
    /// 2^exposure.
    factor: f64,
    dither: bool,
    /// The code of white.
    highest: u16,
}

impl Developer {
    /// Returns the codes of a pixel's radiance, which is not premultiplied.
    pub fn codes(&self, color: Rgb, x: u32, y: u32) -> [u16; 3] {
        self.encode(self.displayed(color), x, y)
    }

    /// Returns the codes of a pixel that covers `alpha` of what lies behind it.
    pub fn codes_over(&self, color: Rgb, alpha: f32, behind: Rgb, x: u32, y: u32) -> [u16; 3] {
        let front = self.displayed(color);
        let alpha = f64::from(alpha).clamp(0.0, 1.0);
        let mixed = [0, 1, 2].map(|k| {
            let back = f64::from(behind[k]).clamp(0.0, 1.0);
            back + alpha * (front[k] - back)
        });
        self.encode(mixed, x, y)
    }

    /// Returns what radiance is displayed as, from 0 to 1.
    fn displayed(&self, color: Rgb) -> [f64; 3] {
        self.tone.apply(color.map(|c| f64::from(c) * self.factor))
    }

    /// Returns the codes of a displayed colour, from 0 to 1, at a pixel. Black and white are
    /// themselves, whatever the dither.
    fn encode(&self, displayed: [f64; 3], x: u32, y: u32) -> [u16; 3] {
        let lift = match self.dither {
            true => threshold(x, y),
            false => 0.5,
        };
        let highest = f64::from(self.highest);
        displayed.map(|c| match c >= 1.0 {
            // The transfer function is a rounding below 1 there.
            true => self.highest,
            false => (srgb_from_linear(c) * highest + lift).min(highest) as u16,
        })
    }
}

/// Encodes a linear value from 0 to 1 by the sRGB transfer function.
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// Returns a number in [0, 1) for a pixel, the same for all channels so that greys stay grey.
///
/// The numbers are the additive recurrence R₂ of Roberts ("The unreasonable effectiveness of
/// quasirandom sequences", 2018) on a sheared lattice: steps of 1/g² along rows and of 1/g² + 1/g = g
/// along columns with g³ = g + 1, in 32-bit fixed point. Both ways they fill [0, 1) evenly, so their
/// spectrum has little at low frequencies, and the mean of any block of pixels is near ½. Without the
/// shear a step along columns, 1/g, is so near to ¾ that slow ramps have longer runs of one code.
fn threshold(x: u32, y: u32) -> f64 {
    const STEPS: [u32; 2] = [2_447_445_414, 1_394_653_007];
    let turn = x
        .wrapping_mul(STEPS[0])
        .wrapping_add(y.wrapping_mul(STEPS[1]));
    f64::from(turn) / 4_294_967_296.0
}

#[cfg(test)]
mod tests;
