//! Growth of time and memory with the number of triangles.
//!
//! One procedural mesh ([`super::generate`]) is measured at two sizes per decade, with
//! the same measurements as for any scene. Exponents are fitted by least squares in
//! logarithms: y ≈ c·n^e. A tree over n triangles is built in about n·log n and
//! traversed in about log n, apart from cache misses once it outgrows a cache.

use super::bench::{Comparison, Row};
use super::index_stats::StructureRow;
use serde::Serialize;

/// The figures of all sizes, with the field names of `bench --growth --json`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Growth {
    pub sizes: Vec<Size>,
    pub fits: Vec<Fit>,
}

#[derive(Clone, Debug, Serialize)]
pub struct Size {
    pub triangles: u64,
    pub structures: Vec<StructureRow>,
    /// Peak resident memory of the process from the generation of the mesh to the end
    /// of the first build of our structures; null where the system does not provide it.
    pub peak_resident_bytes: Option<u64>,
    pub results: Vec<Row>,
    pub comparisons: Vec<Comparison>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The quantity: `build` (seconds), `trace` (nanoseconds per ray) or `memory`
    /// (bytes).
    pub what: &'static str,
    /// The measured item: a structure, or a kind of rays with its tracer.
    pub name: String,
    pub peer: bool,
    pub exponent: f64,
    /// Share of the variance of the logarithms that the fit explains.
    pub r2: f64,
    /// Pairs (triangles, figure).
    pub points: Vec<[f64; 2]>,
}

/// Returns two sizes per decade from `min` on, and `max`.
pub fn sizes(min: u64, max: u64) -> Vec<u64> {
    let mut sizes = Vec::new();
    let (mut power, least) = (1.0, min.max(1) as f64);
    loop {
        for step in [1.0, 10.0_f64.sqrt()] {
            let size = (least * power * step).round();
            // Rounding may leave the last step slightly short of `max`.
            if size >= max as f64 * 0.999 {
                sizes.push(max);
                return sizes;
            }
            sizes.push(size as u64);
        }
        power *= 10.0;
    }
}

/// Fits every quantity measured at two sizes or more.
pub fn fits(sizes: &[Size]) -> Vec<Fit> {
    let mut fits: Vec<Fit> = Vec::new();
    let mut add = |what, name: String, peer, triangles: u64, figure: f64| {
        if triangles == 0 || figure <= 0.0 {
            return;
        }
        let point = [triangles as f64, figure];
        match fits.iter_mut().find(|f| f.what == what && f.name == name) {
            Some(fit) => fit.points.push(point),
            None => fits.push(Fit {
                what,
                name,
                peer,
                exponent: 0.0,
                r2: 0.0,
                points: vec![point],
            }),
        }
    };
    for size in sizes {
        let n = size.triangles;
        for row in &size.structures {
            let peer = row.version.is_some();
            add("build", row.name.clone(), peer, n, row.build_seconds);
            add("memory", row.name.clone(), peer, n, row.tree_bytes as f64);
        }
        if let Some(bytes) = size.peak_resident_bytes {
            add("memory", "process".into(), false, n, bytes as f64);
        }
        for row in &size.results {
            let rate = row.mrays_per_s;
            let nanoseconds = if rate > 0.0 { 1e3 / rate } else { 0.0 };
            if !row.peer {
                let name = format!("{} {}", row.kind, row.tracer());
                add("trace", name, false, n, nanoseconds);
            } else if fastest_peer(&size.results, row) {
                // The baseline's fastest setting changes with the size.
                let name = format!("{} {}", row.kind, row.accel);
                add("trace", name, true, n, nanoseconds);
            }
        }
    }
    fits.retain(|fit| fit.points.len() > 1);
    for fit in &mut fits {
        (fit.exponent, fit.r2) = power_law(&fit.points);
    }
    fits
}

fn fastest_peer(rows: &[Row], row: &Row) -> bool {
    let same = rows.iter().filter(|r| r.peer && r.kind == row.kind);
    let best = same.max_by(|a, b| a.mrays_per_s.total_cmp(&b.mrays_per_s));
    best.is_some_and(|best| std::ptr::eq(best, row))
}

/// Returns exponent and r² of the least-squares line through the logarithms.
fn power_law(points: &[[f64; 2]]) -> (f64, f64) {
    let n = points.len() as f64;
    let logs = || points.iter().map(|p| p.map(f64::ln));
    let mean = |k: usize| logs().map(|p| p[k]).sum::<f64>() / n;
    let (x_mean, y_mean) = (mean(0), mean(1));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        logs().map(|[x, y]| f(x - x_mean, y - y_mean)).sum()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if xx <= 0.0 {
        return (0.0, 0.0);
    }
    let r2 = if yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 };
    (xy / xx, r2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sizes_a_decade() {
        assert_eq!(sizes(1000, 100_000), [1000, 3162, 10_000, 31_623, 100_000]);
        assert_eq!(sizes(1000, 20_000), [1000, 3162, 10_000, 20_000]);
        assert_eq!(sizes(50, 50), [50]);
        assert_eq!(sizes(1000, 10_000_000).len(), 9);
    }

    #[test]
    fn powers_are_found() {
        let points = |f: fn(f64) -> f64| -> Vec<[f64; 2]> {
            [1e3, 1e4, 1e5, 1e6].iter().map(|x| [*x, f(*x)]).collect()
        };
        let (exponent, r2) = power_law(&points(|x| 3.0 * x.powf(1.25)));
        assert!((exponent - 1.25).abs() < 1e-12 && r2 > 1.0 - 1e-12);
        assert_eq!(power_law(&points(|_| 7.0)).0, 0.0);
        // Alternating values: a worse fit.
        let (_, r2) = power_law(&[[1.0, 1.0], [10.0, 50.0], [100.0, 2.0], [1000.0, 60.0]]);
        assert!(r2 < 0.7, "{r2}");
        assert_eq!(power_law(&[[2.0, 1.0], [2.0, 5.0]]), (0.0, 0.0));
    }

    #[test]
    fn structures_are_fitted_by_name() {
        let size = |triangles: u64| Size {
            triangles,
            structures: vec![StructureRow::new(
                "bvh".into(),
                triangles,
                64 * triangles as usize,
                &[triangles as f64 * 1e-6],
            )],
            peak_resident_bytes: None,
            results: Vec::new(),
            comparisons: Vec::new(),
        };
        let fits = fits(&[size(1000), size(100_000)]);
        let named: Vec<_> = fits.iter().map(|f| (f.what, f.name.as_str())).collect();
        assert_eq!(named, [("build", "bvh"), ("memory", "bvh")]);
        for fit in fits {
            assert!((fit.exponent - 1.0).abs() < 1e-9);
        }
    }
}
