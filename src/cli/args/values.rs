//! Parsers and domains of the arguments' values.

use glam::DVec3;
use lanecast_engine::accel::{BuildQuality, KdClip, KdStop};
use lanecast_engine::trace::{Caching, Reuse};
use lanecast_io::{Bits, Curves, Tone, ZUp};
use lanecast_measure::extremes::{SWEEPS, Sweep};
use lanecast_measure::generate::Generated;
use lanecast_measure::ray_kinds::{Kind, Order};
use lanecast_model::plan::{Accel, LaneCount, Precision};
use lanecast_numerics::roots::{Interval, Solver};
use lanecast_picture::render::{Backdrop, Grid, RenderConfig};
use std::ops::Bound;
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// A structure; `None` leaves the choice to the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelChoice(pub Option<Accel>);

/// Temporal bounds; `None` leaves the choice to the scene's needs.
#[derive(Clone, Copy)]
pub struct ReuseChoice(pub Option<Reuse>);

/// Ray kinds that `bench` traces, each at most once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchKinds(pub Vec<Kind>);

/// Structures that `bench` compares.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchAccels(pub Vec<AccelChoice>);

/// Build qualities of wide trees that `bench` compares.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchBuilds(pub Vec<BuildQuality>);

/// Shadow cache on, off, or both to compare them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchCachings(pub Vec<Caching>);

/// Sweeps of `extremes`, in the table's order.
#[derive(Clone)]
pub struct Sweeps(pub Vec<&'static Sweep>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaselineChoice {
    Embree,
}

/// Number of triangles of the smallest and the largest generated mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GrowthRange {
    pub min: u64,
    pub max: u64,
}

/// 10⁸ triangles take about ten gigabytes.
const MAX_GROWTH: u64 = 100_000_000;
const MAX_SIDE: u32 = RenderConfig::MOST_SIDE;
const MAX_PIXELS: u64 = RenderConfig::MOST_PIXELS;

pub fn parse_size(text: &str) -> Result<Size, String> {
    let number = |side: &str| {
        // `parse` alone would accept a plus sign.
        let digits = !side.is_empty() && side.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| side.parse::<u32>().unwrap_or(u32::MAX))
    };
    let (width, height) = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some((number(w)?, number(h)?)))
        .ok_or("write it as WIDTHxHEIGHT, such as 1280x720")?;
    let side = 1..=MAX_SIDE;
    if !side.contains(&width) || !side.contains(&height) {
        return Err(format!("each side must be 1 to {MAX_SIDE} pixels"));
    }
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        return Err(format!(
            "{pixels} pixels are too many; at most {MAX_PIXELS} are supported"
        ));
    }
    Ok(Size { width, height })
}

pub fn parse_scale(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s > 0.0)
        .ok_or("write a finite number above 0, such as 1e-6".into())
}

/// Parses the path of a page, which must be a file.
pub fn parse_page(text: &str) -> Result<PathBuf, String> {
    match text {
        "-" => Err("this goes to a file, not to standard output; name one".into()),
        _ => Ok(text.into()),
    }
}

pub fn parse_offset(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    let three = text.split(',').count() == 3;
    match numbers[..] {
        [x, y, z] if three => Ok(DVec3::new(x, y, z)),
        _ => Err("write three finite numbers as X,Y,Z, such as 1e6,0,-2.5".into()),
    }
}

/// Parses a relative error within the reachable range.
pub fn parse_error(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (1e-6..=0.5).contains(&x) => Ok(x),
        _ => Err("write a number from 1e-6 to 0.5, such as 5e-4".into()),
    }
}

pub fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("write a number above 0".into()),
    }
}

pub fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x <= 1e9 => Ok(x),
        _ => Err("write a number of seconds above 0, such as 30".into()),
    }
}

pub fn parse_grid(text: &str) -> Result<Grid, String> {
    one_of(
        text,
        &[("centers", Grid::Centers), ("corners", Grid::Corners)],
    )
}

pub fn parse_precision(text: &str) -> Result<Precision, String> {
    one_of(
        text,
        &[
            ("fast", Precision::Fast),
            ("guarded", Precision::Guarded),
            ("exact", Precision::Exact),
        ],
    )
}

pub fn parse_z_up(text: &str) -> Result<ZUp, String> {
    one_of(text, &[("asked", ZUp::Asked), ("unsaid", ZUp::WhereUnsaid)])
}

pub fn parse_scad_curves(text: &str) -> Result<Curves, String> {
    one_of(
        text,
        &[("exact", Curves::Exact), ("facets", Curves::Facets)],
    )
}

pub fn parse_lanes(text: &str) -> Result<LaneCount, String> {
    let known = [
        LaneCount::Auto,
        LaneCount::One,
        LaneCount::Four,
        LaneCount::Eight,
        LaneCount::Sixteen,
    ];
    one_of(text, &known.map(|l| (l.name(), l)))
}

/// Widths that `bench` compares; other commands take one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LaneCounts(pub Vec<LaneCount>);

/// Orders of camera rays that `bench` compares.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Orders(pub Vec<Order>);

/// Parses names separated by commas, each at most once.
fn each_once<T: PartialEq>(
    text: &str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<Vec<T>, String> {
    let mut all = Vec::new();
    for name in text.split(',') {
        let one = parse(name.trim())?;
        if all.contains(&one) {
            return Err(format!("'{name}' is named twice; name each once"));
        }
        all.push(one);
    }
    Ok(all)
}

pub fn parse_lane_counts(text: &str) -> Result<LaneCounts, String> {
    each_once(text, parse_lanes).map(LaneCounts)
}

pub fn parse_orders(text: &str) -> Result<Orders, String> {
    let order = |name: &str| one_of(name, &Order::ALL.map(|order| (order.name(), order)));
    each_once(text, order).map(Orders)
}

pub fn parse_accel(text: &str) -> Result<AccelChoice, String> {
    let mut known = vec![("auto", AccelChoice(None))];
    known.extend(Accel::ALL.map(|accel| (accel.name(), AccelChoice(Some(accel)))));
    one_of(text, &known)
}

pub fn parse_kd_stop(text: &str) -> Result<KdStop, String> {
    one_of(text, &KdStop::ALL.map(|stop| (stop.name(), stop)))
}

pub fn parse_kd_clip(text: &str) -> Result<KdClip, String> {
    one_of(text, &KdClip::ALL.map(|clip| (clip.name(), clip)))
}

pub fn parse_reuse(text: &str) -> Result<ReuseChoice, String> {
    let [a, b, c] = Reuse::ALL.map(|reuse| (reuse.name(), ReuseChoice(Some(reuse))));
    one_of(text, &[("auto", ReuseChoice(None)), a, b, c])
}

pub fn parse_view_transform(text: &str) -> Result<Tone, String> {
    one_of(text, &Tone::ALL.map(|tone| (tone.name(), tone)))
}

/// Parses stops within what f32 radiance spans.
pub fn parse_exposure(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(stops) if (-100.0..=100.0).contains(&stops) => Ok(stops),
        _ => Err("write a number of stops from -100 to 100, such as 1.5".into()),
    }
}

pub fn parse_dither(text: &str) -> Result<bool, String> {
    one_of(text, &[("on", true), ("off", false)])
}

pub fn parse_bits(text: &str) -> Result<Bits, String> {
    one_of(text, &[("8", Bits::Eight), ("16", Bits::Sixteen)])
}

pub fn parse_backdrop(text: &str) -> Result<Backdrop, String> {
    let known = [
        ("auto", Backdrop::Auto),
        ("transparent", Backdrop::Transparent),
        ("white", Backdrop::Color([1.0; 3])),
        ("black", Backdrop::Color([0.0; 3])),
    ];
    if let Ok(backdrop) = one_of(text, &known) {
        return Ok(backdrop);
    }
    let channels: Vec<f32> = text
        .split(',')
        .filter_map(|c| c.trim().parse().ok())
        .filter(|c: &f32| c.is_finite() && *c >= 0.0)
        .collect();
    match channels[..] {
        [r, g, b] if text.split(',').count() == 3 => Ok(Backdrop::Color([r, g, b])),
        _ => Err(
            "write auto, transparent, white, black, or a linear colour as R,G,B, such as \
             0.2,0.2,0.25"
                .into(),
        ),
    }
}

pub fn parse_kinds(text: &str) -> Result<BenchKinds, String> {
    let mut kinds = Vec::new();
    for name in text.split(',') {
        let Some(kind) = Kind::named(name.trim()) else {
            let known = Kind::ALL.map(Kind::name).join(", ");
            return Err(format!("there is no ray kind '{name}'; known are {known}"));
        };
        kinds.push(kind);
    }
    kinds.sort();
    kinds.dedup();
    Ok(BenchKinds(kinds))
}

pub fn parse_sweeps(text: &str) -> Result<Sweeps, String> {
    let asked: Vec<&str> = text.split(',').map(str::trim).collect();
    let known = |name: &&str| SWEEPS.iter().any(|sweep| sweep.name == *name);
    if let Some(name) = asked.iter().find(|name| !known(name)) {
        let names: Vec<&str> = SWEEPS.iter().map(|sweep| sweep.name).collect();
        let names = names.join(", ");
        return Err(format!("there is no sweep '{name}'; known are {names}"));
    }
    let sweeps = SWEEPS.iter().filter(|sweep| asked.contains(&sweep.name));
    Ok(Sweeps(sweeps.collect()))
}

pub fn parse_accels(text: &str) -> Result<BenchAccels, String> {
    let accel = |name: &str| parse_accel(name).map_err(|why| format!("'{name}': {why}"));
    each_once(text, accel).map(BenchAccels)
}

pub fn parse_caching(text: &str) -> Result<Caching, String> {
    one_of(text, &Caching::ALL.map(|caching| (caching.name(), caching)))
}

pub fn parse_cachings(text: &str) -> Result<BenchCachings, String> {
    let both: &[Caching] = &Caching::ALL;
    let known = [("on", &both[..1]), ("off", &both[1..]), ("both", both)];
    Ok(BenchCachings(one_of(text, &known)?.to_vec()))
}

pub fn parse_build(text: &str) -> Result<BuildQuality, String> {
    one_of(text, &BuildQuality::ALL.map(|build| (build.name(), build)))
}

pub fn parse_bench_builds(text: &str) -> Result<BenchBuilds, String> {
    let both: &[BuildQuality] = &BuildQuality::ALL;
    let known = [("medium", &both[..1]), ("high", &both[1..]), ("both", both)];
    Ok(BenchBuilds(one_of(text, &known)?.to_vec()))
}

pub fn parse_generated(text: &str) -> Result<Generated, String> {
    one_of(text, &Generated::ALL.map(|mesh| (mesh.name(), mesh)))
}

pub fn parse_peers(text: &str) -> Result<BaselineChoice, String> {
    one_of(text, &[("embree", BaselineChoice::Embree)])
}

pub fn parse_growth(text: &str) -> Result<GrowthRange, String> {
    let number = |text: &str| {
        // Exponents are accepted: 1e6 is easier to read than all its zeros.
        let value: f64 = text.trim().parse().ok()?;
        let whole = value.fract() == 0.0 && (8.0..=MAX_GROWTH as f64).contains(&value);
        whole.then_some(value as u64)
    };
    text.split_once(':')
        .and_then(|(min, max)| Some((number(min)?, number(max)?)))
        .filter(|(min, max)| min <= max)
        .map(|(min, max)| GrowthRange { min, max })
        .ok_or(format!(
            "write it as MIN:MAX, such as 1e3:1e7; each from 8 to {MAX_GROWTH}, the smaller first"
        ))
}

/// Coefficients of a polynomial, the constant one first.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients(pub Vec<f64>);

pub fn parse_coefficients(text: &str) -> Result<Coefficients, String> {
    let number = |x: &str| x.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    numbers
        .map(Coefficients)
        .ok_or("write finite numbers, the constant one first, as C0,C1,C2, such as -1,0,3,1".into())
}

pub fn parse_interval(text: &str) -> Result<Interval, String> {
    let number = |x: &str| x.trim().parse().ok().filter(|x: &f64| !x.is_nan());
    let ends = text.split_once(',');
    ends.and_then(|(low, high)| Some((number(low)?, number(high)?)))
        .filter(|(low, high)| low < high)
        .map(|(low, high)| Interval {
            low: match low {
                f64::NEG_INFINITY => Bound::Unbounded,
                _ => Bound::Excluded(low),
            },
            high: match high {
                f64::INFINITY => Bound::Unbounded,
                _ => Bound::Included(high),
            },
        })
        .ok_or("write it as LOW,HIGH with LOW < HIGH, such as 0,1 or -inf,2.5".into())
}

pub fn parse_solver(text: &str) -> Result<Solver, String> {
    one_of(text, &Solver::ALL.map(|solver| (solver.name(), solver)))
}

pub(super) fn one_of<T: Copy>(text: &str, known: &[(&str, T)]) -> Result<T, String> {
    if let Some((_, value)) = known.iter().find(|(name, _)| *name == text) {
        return Ok(*value);
    }
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    let names = names.join(", ");
    Err(format!("known are {names}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        let size = |width, height| Ok(Size { width, height });
        assert_eq!(parse_size("1x1"), size(1, 1));
        assert_eq!(parse_size("1280X720"), size(1280, 720));
        assert_eq!(parse_size("65535x4096"), size(65535, 4096));
        for bad in [
            "", "x", "1", "1x", "x1", "1x1x1", "-1x1", "+1x1", "1 x1", "axb", "1.5x1",
        ] {
            assert!(
                parse_size(bad).unwrap_err().contains("WIDTHxHEIGHT"),
                "{bad}"
            );
        }
        for bad in ["0x1", "1x0", "65536x1", "1x99999999999999999999"] {
            assert!(parse_size(bad).unwrap_err().contains("1 to 65535"), "{bad}");
        }
        // 2²⁸ pixels, and one row more.
        assert_eq!(parse_size("16384x16384"), size(16384, 16384));
        assert!(parse_size("16384x16385").unwrap_err().contains("too many"));
    }

    #[test]
    fn developments_and_backdrops() {
        assert_eq!(parse_view_transform("agx").unwrap(), Tone::Agx);
        assert!(parse_view_transform("AgX").is_err());
        assert_eq!(parse_exposure("-1.5").unwrap(), -1.5);
        assert!(
            ["nan", "101", "", "1 stop"]
                .iter()
                .all(|t| parse_exposure(t).is_err())
        );
        assert_eq!(parse_bits("16").unwrap(), Bits::Sixteen);
        assert!(parse_bits("10").is_err());
        assert_eq!(
            parse_backdrop("transparent").unwrap(),
            Backdrop::Transparent
        );
        let color = parse_backdrop("0.5, 2,0").unwrap();
        assert_eq!(color, Backdrop::Color([0.5, 2.0, 0.0]));
        for wrong in ["1,1", "1,1,1,1", "-1,0,0", "inf,0,0", "grey", ""] {
            assert!(parse_backdrop(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn scales_and_offsets() {
        assert_eq!(parse_scale("1e-6"), Ok(1e-6));
        for bad in ["", "0", "-1", "inf", "nan", "1,2", "1e999"] {
            assert!(parse_scale(bad).unwrap_err().contains("above 0"), "{bad}");
        }
        let offset = DVec3::new(1e6, 0.0, -2.5);
        assert_eq!(parse_offset("1e6, 0,-2.5"), Ok(offset));
        for bad in [
            "", "1", "1,2", "1,2,3,4", "1,2,x", "1,2,3,", "1,nan,2", "1,2,inf",
        ] {
            assert!(parse_offset(bad).unwrap_err().contains("X,Y,Z"), "{bad}");
        }
    }

    #[test]
    fn intervals_and_coefficients() {
        assert_eq!(parse_interval("-inf,inf"), Ok(Interval::LINE));
        assert_eq!(parse_interval("-1, 0"), Ok(Interval::half_open(-1.0, 0.0)));
        for bad in ["", "1", "1,0", "0,0", "nan,1", "0,1,2", "a,b", "inf,inf"] {
            let said = parse_interval(bad).unwrap_err();
            assert!(said.contains("LOW,HIGH"), "{bad}: {said}");
        }
        let coefficients = Coefficients(vec![-1.0, 0.0, 3e-5]);
        assert_eq!(parse_coefficients("-1, 0,3e-5"), Ok(coefficients));
        for bad in ["", "1,,2", "1;2", "nan", "1,inf", "1e999"] {
            let said = parse_coefficients(bad).unwrap_err();
            assert!(said.contains("constant one first"), "{bad}: {said}");
        }
        assert_eq!(parse_solver("sturm"), Ok(Solver::Sturm));
        let said = parse_solver("laguerre").unwrap_err();
        assert!(said.contains("known are auto, halving"), "{said}");
    }

    #[test]
    fn growth_ranges() {
        let range = |min, max| Ok(GrowthRange { min, max });
        assert_eq!(parse_growth("1e3:1e7"), range(1000, 10_000_000));
        assert_eq!(parse_growth("1000: 1000"), range(1000, 1000));
        for bad in [
            "", "1e3", "1e3:", "1e4:1e3", "0:10", "10.5:20", "10:1e9", "a:b",
        ] {
            assert!(parse_growth(bad).unwrap_err().contains("MIN:MAX"), "{bad}");
        }
    }

    #[test]
    fn sweeps() {
        let names = |text| -> Vec<&str> {
            let Sweeps(sweeps) = parse_sweeps(text).ok().unwrap();
            sweeps.iter().map(|sweep| sweep.name).collect()
        };
        assert_eq!(names("chain, small,chain"), ["small", "chain"]);
        for bad in ["", "small,", "smal"] {
            let said = parse_sweeps(bad).err().unwrap();
            assert!(said.contains("known are small, large"), "{said}");
        }
    }

    #[test]
    fn kinds() {
        let all = "diffuse,primary,shadow,lightshadow, diffuse_any,shadow,mirror,ortho,\
                   areashadow,directional";
        assert_eq!(parse_kinds(all), Ok(BenchKinds(Kind::ALL.into())));
        assert_eq!(parse_kinds("primary").unwrap().0, [Kind::Primary]);
        assert!(parse_kinds("").is_err());
    }
}
