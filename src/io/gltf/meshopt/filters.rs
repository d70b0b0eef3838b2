//! Filters of attributes: from the numbers that compress well to those that are meant.
//!
//! Arithmetic is in f32, as the extensions specify; their results may differ by one unit. What they
//! leave open (a length of 0, exponents beyond ±100) becomes some number.

/// Applies a filter to rows of `stride` bytes. Fails if there is no such filter or it is not for
/// rows of this length.
pub(super) fn apply(filter: &str, rows: &mut [u8], stride: usize) -> Result<(), String> {
    let allowed = match filter {
        "NONE" => return Ok(()),
        "OCTAHEDRAL" | "COLOR" => stride == 4 || stride == 8,
        "QUATERNION" => stride == 8,
        "EXPONENTIAL" => true,
        other => return Err(format!("its filter '{other}' is unknown")),
    };
    if !allowed {
        return Err(format!("its filter {filter} is not for {stride} bytes"));
    }
    let is_wide = stride == 8;
    match filter {
        "EXPONENTIAL" => {
            for number in rows.as_chunks_mut::<4>().0 {
                *number = exponential(i32::from_le_bytes(*number)).to_le_bytes();
            }
        }
        "QUATERNION" => wide(rows, |row| {
            quaternion(row.map(|x| x as i16)).map(|x| x as u16)
        }),
        "OCTAHEDRAL" if is_wide => wide(rows, |row| {
            let row = row.map(|x| f32::from(x as i16));
            octahedral(row, 32_767.0).map(|x| x as i16 as u16)
        }),
        "OCTAHEDRAL" => narrow(rows, |row| {
            let row = row.map(|x| f32::from(x as i8));
            octahedral(row, 127.0).map(|x| x as i8 as u8)
        }),
        _ if is_wide => wide(rows, |row| {
            let [_, co, cg, _] = row.map(|x| i32::from(x as i16));
            let [y, alpha] = [row[0], row[3]].map(i32::from);
            color([y, co, cg, alpha], 65_535.0).map(|x| x as u16)
        }),
        _ => narrow(rows, |row| {
            let [_, co, cg, _] = row.map(|x| i32::from(x as i8));
            let [y, alpha] = [row[0], row[3]].map(i32::from);
            color([y, co, cg, alpha], 255.0).map(|x| x as u8)
        }),
    }
    Ok(())
}

/// Changes rows of four bytes.
fn narrow(rows: &mut [u8], change: impl Fn([u8; 4]) -> [u8; 4]) {
    for row in rows.as_chunks_mut::<4>().0 {
        *row = change(*row);
    }
}

/// Changes rows of four numbers of 16 bits.
fn wide(rows: &mut [u8], change: impl Fn([u16; 4]) -> [u16; 4]) {
    for row in rows.as_chunks_mut::<8>().0 {
        let of = |k: usize| u16::from_le_bytes([row[2 * k], row[2 * k + 1]]);
        let changed = change([of(0), of(1), of(2), of(3)]);
        for (k, x) in changed.iter().enumerate() {
            row[2 * k..2 * k + 2].copy_from_slice(&x.to_le_bytes());
        }
    }
}

/// Unfolds a direction from an octahedron; the fourth number stays.
fn octahedral([x, y, one, rest]: [f32; 4], largest: f32) -> [f32; 4] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|part| (part / length * largest).round());
    [x, y, z, rest]
}

/// Completes a quaternion by its largest component, which is left out.
fn quaternion([x, y, z, which]: [i16; 4]) -> [i16; 4] {
    let one = f32::from(which | 3);
    let [x, y, z] = [x, y, z].map(|part| f32::from(part) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut all = [0; 4];
    let first = usize::from(which as u16 & 3);
    for (k, part) in [w, x, y, z].into_iter().enumerate() {
        all[(first + k) % 4] = (part * 32_767.0).round() as i16;
    }
    all
}

/// Makes a float of a mantissa of 24 bits and an exponent of 8. It is exact, unless it is below
/// the least normal one.
fn exponential(code: i32) -> f32 {
    libm::ldexp(f64::from(code << 8 >> 8), code >> 24) as f32
}

/// Makes red, green, blue and alpha of luma, two colour differences and a scaled alpha.
fn color([y, co, cg, alpha]: [i32; 4], largest: f32) -> [f32; 4] {
    let width = 32 - alpha.leading_zeros();
    let scale = (1 << width) - 1;
    let a = alpha & (scale >> 1);
    let a = a << 1 | a & 1;
    let all = [y + co - cg, y + cg, y - co - cg, a];
    all.map(|part| (part as f32 * (largest / scale as f32)).round())
}
