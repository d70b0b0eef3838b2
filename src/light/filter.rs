//! Pixel filters, sampled by importance.
//!
//! A sample of a pixel is placed where the pixel's filter says, with the filter's magnitude
//! as density, and counts for that pixel alone (Ernst, Stamminger & Greiner, "Filter
//! Importance Sampling", 2006). So no sample is splatted on neighbours, and a picture does
//! not depend on the order of its pixels. Filters are separable: one function of the distance
//! along x times the same along y.
//!
//! A profile is tabulated from f64 as a density that is linear in each of 512 cells between
//! its edge and its centre, and such a density is inverted exactly. The table is within 1e-5
//! of the profile's peak (h²/8 times the second derivative). Cells are found lane by lane,
//! from a first guess by the share of the mass (Chen & Asau's cutpoints, 1974).

use lanecast_numerics::math::lanes::Lanes;

/// The profile of a pixel filter; lengths in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// The pixel's own square.
    Box,
    /// Standard deviation 0.5, cut at 1.5 and lowered by its value there, so that it ends
    /// at 0.
    Gaussian,
    /// Mitchell & Netravali's cubic ("Reconstruction Filters in Computer Graphics", 1988)
    /// with B = C = 1/3, of radius 2. It is negative outside of the main lobe: samples there
    /// have a negative weight.
    Mitchell,
    /// Blackman and Harris' window of four terms, three pixels wide.
    #[default]
    BlackmanHarris,
}

impl Kind {
    /// Returns the distance from the centre at which the profile ends.
    pub fn radius(self) -> f64 {
        match self {
            Kind::Box => 0.5,
            Kind::Gaussian | Kind::BlackmanHarris => 1.5,
            Kind::Mitchell => 2.0,
        }
    }

    /// Returns the distance beyond which the profile is negative, or the radius.
    fn lobe(self) -> f64 {
        match self {
            // The zero of the outer cubic's last factor.
            Kind::Mitchell => 8.0 / 7.0,
            _ => self.radius(),
        }
    }

    /// Evaluates the profile at a distance from the centre, up to a constant factor.
    pub fn profile(self, x: f64) -> f64 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match self {
            Kind::Box => 1.0,
            Kind::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-2.0 * 1.5 * 1.5),
            Kind::Mitchell if x < 1.0 => ((7.0 * x - 12.0) * x * x + 16.0 / 3.0) / 6.0,
            // The outer cubic in factors, so that its sign is right.
            Kind::Mitchell => (8.0 - 7.0 * x) * (2.0 - x) * (2.0 - x) / 18.0,
            Kind::BlackmanHarris => {
                let term = |k: f64| libm::cos(2.0 * std::f64::consts::PI * k * (x / 3.0 + 0.5));
                0.358_75 - 0.488_29 * term(1.0) + 0.141_28 * term(2.0) - 0.011_68 * term(3.0)
            }
        }
    }
}

/// Cells of the table of one half of the profile.
const CELLS: usize = 512;

/// A piece of the profile, from its outer end inwards.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Distance of the outer end from the centre, and of the inner end from there.
    outer: f32,
    width: f32,
    /// Share of the half's mass outside of the cell, and in it.
    before: f32,
    mass: f32,
    /// Magnitude of the profile at the outer and the inner end.
    from: f32,
    to: f32,
    /// What a sample in it counts.
    weight: f32,
}

/// A pixel filter, ready to be sampled.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: Kind,
    cells: Vec<Cell>,
    /// Entry i is the cell in which the share i/512 of the mass lies.
    first: Vec<u16>,
}

impl Filter {
    /// Tabulates a filter.
    pub fn new(kind: Kind) -> Filter {
        let knots = knots(kind);
        let value = |x: f64| kind.profile(x).abs();
        // A cell across the zero of a profile does not occur: a knot lies on it.
        let signed = |x: [f64; 2]| kind.profile(0.5 * (x[0] + x[1])).signum();
        let mass = |x: [f64; 2]| 0.5 * (value(x[0]) + value(x[1])) * (x[0] - x[1]);
        let pieces = || knots.windows(2).map(|x| [x[0], x[1]]);
        let total: f64 = pieces().map(mass).sum();
        let net: f64 = pieces().map(|x| signed(x) * mass(x)).sum();
        let mut before = 0.0;
        let mut cells = Vec::with_capacity(CELLS);
        for x in pieces() {
            let after = before + mass(x) / total;
            cells.push(Cell {
                outer: x[0] as f32,
                width: (x[0] - x[1]) as f32,
                before: before as f32,
                mass: (after - before) as f32,
                from: value(x[0]) as f32,
                to: value(x[1]) as f32,
                weight: (signed(x) * total / net) as f32,
            });
            before = after;
        }
        let first = (0..=CELLS).map(|i| {
            let share = i as f32 / CELLS as f32;
            cells.partition_point(|cell| cell.before <= share) as u16 - 1
        });
        let first = first.collect();
        Filter { kind, cells, first }
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns the offset from the pixel's centre along one axis, in pixels, and the weight
    /// of a sample there. The offset grows with `u` in [0, 1). The weight is ± a constant for
    /// profiles with negative parts, else 1; its mean is 1.
    #[inline(always)]
    pub fn offset<L: Lanes<Scalar = f32>>(&self, u: L) -> (L, L) {
        let half = L::splat(0.5);
        if self.kind == Kind::Box {
            return (u - half, L::splat(1.0));
        }
        // Twice the distance from the nearer end of [0, 1], exactly: the share of the mass
        // outside, of the half in which the sample lies.
        let left = u.lt(half);
        let share = L::select(left, u, L::splat(1.0) - u) * L::splat(2.0);
        let shares = share.to_array();
        let mut columns = [L::zero().to_array(); 7];
        for i in 0..L::COUNT {
            let cell = self.cell(shares.as_ref()[i]);
            let row = [
                cell.outer,
                cell.width,
                cell.before,
                cell.mass,
                cell.from,
                cell.to,
                cell.weight,
            ];
            for (column, x) in columns.iter_mut().zip(row) {
                column.as_mut()[i] = x;
            }
        }
        let [outer, width, before, mass, from, to, weight] =
            columns.map(|column| L::load(column.as_ref()));
        // Inverts a linear density without cancellation; 0/0 where it begins with 0.
        let one = L::splat(1.0);
        let v = ((share - before) / mass).min(one);
        let slope = ((one - v) * (from * from) + v * (to * to)).sqrt();
        let t = v * (from + to) / (from + slope).max(L::splat(f32::MIN_POSITIVE));
        let distance = outer - t.min(one) * width;
        (L::select(left, -distance, distance), weight)
    }

    /// Returns the offset from the pixel's centre along x and y, and the sample's weight.
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(&self, [u, v]: [L; 2]) -> ([L; 2], L) {
        let ((x, of_x), (y, of_y)) = (self.offset(u), self.offset(v));
        ([x, y], of_x * of_y)
    }

    /// Finds the cell that contains a share of the mass in [0, 1].
    #[inline(always)]
    fn cell(&self, share: f32) -> &Cell {
        let mut at = usize::from(self.first[(share * CELLS as f32) as usize]);
        while at + 1 < self.cells.len() && self.cells[at + 1].before <= share {
            at += 1;
        }
        &self.cells[at]
    }
}

/// Places the ends of the cells, evenly in the main lobe and outside of it.
fn knots(kind: Kind) -> Vec<f64> {
    let (radius, lobe) = (kind.radius(), kind.lobe());
    let outside = (CELLS as f64 * (radius - lobe) / radius) as usize;
    let inside = CELLS - outside;
    let outer = (0..outside).map(|i| radius - (radius - lobe) * i as f64 / outside as f64);
    let inner = (0..=inside).map(|i| lobe * (inside - i) as f64 / inside as f64);
    outer.chain(inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chi2::{Random, check};
    use lanecast_numerics::math::lanes::{f32x4, f32x8, f32x16};

    const KINDS: [Kind; 4] = [
        Kind::Box,
        Kind::Gaussian,
        Kind::Mitchell,
        Kind::BlackmanHarris,
    ];

    /// Integrates over the profile by the midpoint rule.
    fn integral(kind: Kind, f: impl Fn(f64, f64) -> f64) -> f64 {
        let n = 1_000_000;
        let step = 2.0 * kind.radius() / f64::from(n);
        let x = |i: i32| (f64::from(i) + 0.5) * step - kind.radius();
        (0..n).map(|i| f(x(i), kind.profile(x(i)))).sum::<f64>() * step
    }

    #[test]
    fn offsets_have_the_density_of_the_profile() {
        for kind in KINDS {
            let filter = Filter::new(kind);
            let total = integral(kind, |_, f| f.abs());
            let side = 2.0 * kind.radius();
            let sample = |u| {
                let (at, _) = filter.sample(u);
                Some(at.map(|x| f64::from(x) / side + 0.5))
            };
            let density = |at: [f64; 2]| {
                let [x, y] = at.map(|x| kind.profile((x - 0.5) * side).abs() * side / total);
                x * y
            };
            check(
                &format!("{kind:?}"),
                [40, 31],
                1_000_000,
                4,
                sample,
                density,
            );
        }
    }

    #[test]
    fn means_are_those_of_the_profile() {
        for kind in KINDS {
            let filter = Filter::new(kind);
            let n = 1 << 20;
            let mut sums = [0.0; 3];
            for i in 0..n {
                let (x, weight) = filter.offset((i as f32 + 0.5) / n as f32);
                let (x, weight) = (f64::from(x), f64::from(weight));
                for (sum, term) in sums.iter_mut().zip([1.0, x, x * x]) {
                    *sum += weight * term / f64::from(n);
                }
            }
            let net = integral(kind, |_, f| f);
            let square = integral(kind, |x, f| x * x * f) / net;
            assert!((sums[0] - 1.0).abs() < 1e-5, "{kind:?}: {sums:?}");
            assert!(sums[1].abs() < 1e-6, "{kind:?}: {sums:?}");
            assert!(
                (sums[2] - square).abs() < 2e-5,
                "{kind:?}: {sums:?} {square}"
            );
            let signed = kind == Kind::Mitchell;
            let negative = (0..1000).any(|i| filter.offset(i as f32 / 1000.0).1 < 0.0);
            assert_eq!(negative, signed, "{kind:?}");
        }
    }

    #[test]
    fn mitchell_is_continuous_of_unit_mass_and_changes_sign_once() {
        let kind = Kind::Mitchell;
        assert!((integral(kind, |_, f| f) - 1.0).abs() < 1e-9);
        assert!((kind.profile(0.0) - 8.0 / 9.0).abs() < 1e-15);
        assert!((kind.profile(1.0 - 1e-12) - kind.profile(1.0)).abs() < 1e-11);
        assert!(kind.profile(2.0).abs() < 1e-14);
        for i in 0..2000 {
            let x = (f64::from(i) + 0.5) / 1000.0;
            assert_eq!(kind.profile(x) > 0.0, x < kind.lobe(), "{x}");
        }
    }

    #[test]
    fn offsets_grow_with_the_number_and_stay_inside() {
        let last = 1.0 - 0.5 * f32::EPSILON;
        let mut numbers: Vec<f32> = (0..100_000).map(|i| i as f32 / 100_000.0).collect();
        numbers.extend([1e-30, 1e-7, last, 0.499_999_97, 0.500_000_06]);
        numbers.sort_by(f32::total_cmp);
        for kind in KINDS {
            let filter = Filter::new(kind);
            let offsets: Vec<f32> = numbers.iter().map(|u| filter.offset(*u).0).collect();
            let radius = kind.radius() as f32;
            assert!(offsets.iter().all(|x| x.abs() <= radius), "{kind:?}");
            let grow = offsets.windows(2).all(|x| x[0] <= x[1] + 1e-6);
            assert!(grow, "{kind:?}");
            assert!(filter.offset(0.5_f32).0.abs() < 1e-6, "{kind:?}");
        }
    }

    fn agrees<L: Lanes<Scalar = f32>>() {
        let mut random = Random(1);
        for kind in KINDS {
            let filter = Filter::new(kind);
            for _ in 0..1000 {
                let u: Vec<f32> = (0..L::COUNT).map(|_| random.unit()).collect();
                let (x, weight) = filter.offset(L::load(&u));
                for (i, u) in u.iter().enumerate() {
                    let (one, its_weight) = filter.offset(*u);
                    assert_eq!(x.lane(i).to_bits(), one.to_bits());
                    assert_eq!(weight.lane(i).to_bits(), its_weight.to_bits());
                }
            }
        }
    }

    #[test]
    fn every_width_has_the_bits_of_one_lane() {
        agrees::<f32x4>();
        agrees::<f32x8>();
        agrees::<f32x16>();
    }

    /// `cargo test --release -p lanecast-light -- --ignored --nocapture time_of_an_offset`
    #[test]
    #[ignore = "prints times"]
    fn time_of_an_offset() {
        let mut random = Random(1);
        let numbers: Vec<[f32; 2]> = (0..2400).map(|_| random.square()).collect();
        let column =
            |at: &[[f32; 2]], k: usize| f32x8::load(&std::array::from_fn::<_, 8, _>(|i| at[i][k]));
        let squares: Vec<[f32x8; 2]> = numbers
            .chunks(8)
            .map(|at| [column(at, 0), column(at, 1)])
            .collect();
        for kind in KINDS {
            let filter = Filter::new(kind);
            let mut best = f64::INFINITY;
            for _ in 0..3000 {
                let start = std::time::Instant::now();
                for u in &squares {
                    std::hint::black_box(filter.sample(*u));
                }
                let time = start.elapsed().as_secs_f64() * 1e9;
                best = best.min(time / squares.len() as f64);
            }
            println!("{kind:?}: {best:.1} ns for x and y of eight lanes");
        }
    }
}
