//! Texels and the smaller levels of images.

use super::textures::{Image, Texels};

/// The levels of an image: the first number of each, and its columns and rows.
pub type Levels = Vec<(usize, [u32; 2])>;

/// Decodes an sRGB value by the standard's function (IEC 61966-2-1), from 0…1 to 0…1.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4)
    }
}

/// Returns the linear value of each code of 8 bits: by sRGB's curve, then by none.
pub(super) fn decode_tables() -> [[f32; 256]; 2] {
    [
        std::array::from_fn(|code| linear_from_srgb(code as f64 / 255.0) as f32),
        std::array::from_fn(|code| code as f32 / 255.0),
    ]
}

impl Image {
    /// Makes an image of level 0 with `size` columns and rows, and its smaller levels. Texels
    /// have `channels` numbers each, and those of 16 bits are linear whatever `is_srgb` says.
    /// Colours that have alpha are weighed by it; where theirs does not count, pass them without.
    pub fn new(texels: Texels, channels: u8, is_srgb: bool, size: [u32; 2]) -> Image {
        levels_of(texels, channels, is_srgb, size, &decode_tables())
    }

    /// Returns the size of the largest level.
    pub fn size(&self) -> [u32; 2] {
        self.levels[0].1
    }

    /// Reads and decodes a texel; the place lies inside the level.
    #[inline]
    pub(super) fn texel(&self, level: usize, [x, y]: [u32; 2], decode: &[[f32; 256]]) -> [f32; 4] {
        let (first, [width, _]) = self.levels[level];
        let channels = usize::from(self.channels);
        let at = first + (y as usize * width as usize + x as usize) * channels;
        let curve = &decode[usize::from(!self.is_srgb)];
        let plain = &decode[1];
        let has_alpha = channels % 2 == 0;
        let read = |k: usize| match &self.texels {
            Texels::Bytes(all) => {
                let code = usize::from(all[at + k]);
                match has_alpha && k + 1 == channels {
                    true => plain[code],
                    false => curve[code],
                }
            }
            // 16 bits are linear.
            Texels::Words(all) => f32::from(all[at + k]) * (1.0 / 65_535.0),
        };
        match channels {
            1 | 2 => {
                let grey = read(0);
                let alpha = if has_alpha { read(1) } else { 1.0 };
                [grey, grey, grey, alpha]
            }
            3 => [read(0), read(1), read(2), 1.0],
            _ => [read(0), read(1), read(2), read(3)],
        }
    }

    pub fn bytes(&self) -> usize {
        let texels = match &self.texels {
            Texels::Bytes(all) => all.capacity(),
            Texels::Words(all) => 2 * all.capacity(),
        };
        texels + self.levels.len() * size_of::<(usize, [u32; 2])>()
    }
}

/// Makes the smaller levels of an image: each texel is the mean of the up to four below it, in
/// linear light. Colours that have alpha are weighed by it, so that what does not show has no
/// part; linear numbers are not, for their alpha is a number like the others.
fn levels_of(
    texels: Texels,
    channels: u8,
    is_srgb: bool,
    size: [u32; 2],
    decode: &[[f32; 256]],
) -> Image {
    let per = usize::from(channels);
    let mut sizes = vec![size];
    while let Some([width, height]) = sizes.last().copied()
        && (width > 1 || height > 1)
    {
        sizes.push([width.div_ceil(2), height.div_ceil(2)]);
    }
    let numbers = |[width, height]: [u32; 2]| width as usize * height as usize * per;
    let all: usize = sizes.iter().map(|size| numbers(*size)).sum();
    let mut image = Image {
        texels,
        channels,
        is_srgb,
        levels: Vec::with_capacity(sizes.len()),
    };
    fn make_room<T>(texels: &mut Vec<T>, all: usize) {
        texels.shrink_to(all);
        texels.reserve_exact(all - texels.len());
    }
    match &mut image.texels {
        Texels::Bytes(texels) => make_room(texels, all),
        Texels::Words(texels) => make_room(texels, all),
    }
    let mut first = 0;
    for (level, size) in sizes.iter().enumerate() {
        image.levels.push((first, *size));
        first += numbers(*size);
        if level == 0 {
            continue;
        }
        for y in 0..size[1] {
            for x in 0..size[0] {
                let mean = mean(&image, level - 1, [x, y], decode);
                append(&mut image, mean, decode);
            }
        }
    }
    image
}

/// Returns the mean of the texels of a level below a place of the next.
fn mean(image: &Image, level: usize, [x, y]: [u32; 2], decode: &[[f32; 256]]) -> [f32; 4] {
    let [width, height] = image.levels[level].1;
    let is_weighed = image.is_srgb && image.channels.is_multiple_of(2);
    let (mut sum, mut plain, mut count) = ([0.0; 4], [0.0; 3], 0.0);
    for y in [2 * y, 2 * y + 1] {
        for x in [2 * x, 2 * x + 1] {
            if x >= width || y >= height {
                continue;
            }
            let texel = image.texel(level, [x, y], decode);
            for k in 0..3 {
                sum[k] += texel[k] * texel[3];
                plain[k] += texel[k];
            }
            sum[3] += texel[3];
            count += 1.0;
        }
    }
    let alpha = sum[3] / count;
    match is_weighed && sum[3] > 0.0 {
        true => [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], alpha],
        false => [plain[0] / count, plain[1] / count, plain[2] / count, alpha],
    }
}

/// Appends a texel in the image's own encoding.
fn append(image: &mut Image, [r, g, b, a]: [f32; 4], decode: &[[f32; 256]]) {
    let channels: &[f32] = match image.channels {
        1 => &[r],
        2 => &[r, a],
        3 => &[r, g, b],
        _ => &[r, g, b, a],
    };
    let has_alpha = channels.len().is_multiple_of(2);
    let curve = &decode[usize::from(!image.is_srgb)];
    for (k, x) in channels.iter().enumerate() {
        match &mut image.texels {
            Texels::Bytes(all) => {
                let table = match has_alpha && k + 1 == channels.len() {
                    true => &decode[1],
                    false => curve,
                };
                all.push(nearest_code(table, *x));
            }
            Texels::Words(all) => all.push((x * 65_535.0 + 0.5) as u16),
        }
    }
}

/// Returns the code whose value lies nearest, the lower one of two as near.
fn nearest_code(table: &[f32; 256], x: f32) -> u8 {
    let above = table.partition_point(|value| *value < x).clamp(1, 255);
    let below = above - 1;
    match x - table[below] <= table[above] - x {
        true => below as u8,
        false => above as u8,
    }
}
