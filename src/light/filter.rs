//! Pixel filters, sampled by importance.
//!
//! A sample of a pixel is placed where the pixel's filter says, with the filter's magnitude
//! as density, and counts for that pixel alone (Ernst, Stamminger & Greiner, "Filter
//! Importance Sampling", 2006). So no sample is splatted on neighbours, and a picture does
//! not depend on the order of its pixels. Filters are separable: one function of the distance
//! along x times the same along y.
//!
//! A filter with negative parts would give samples of two signs, and a constant the mean of these
//! signs, which is 1 only in the long run: at 16 samples a white picture would be 0.57 to 1.14. So the
//! signs are stratified by sample number: of each [`PERIOD`] samples the last is a negative one, and
//! the weights of the others are such that those of the first 1, 2, 4, 8 and of each 16 add up to
//! their number. Constants are kept exactly, and fewer than 16 samples are those of the
//! positive parts alone.
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
    /// with B = C = 1/3, of radius 2. It is negative outside of the main lobe along one axis: of
    /// each 16 samples one is there, and has a negative weight.
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

    /// Says whether the profile has negative parts.
    pub fn is_signed(self) -> bool {
        self.lobe() < self.radius()
    }

    /// Returns the least number of samples, from the one asked for on, whose weights add up to
    /// their number: of signed profiles 1, 2, 4, 8 or a multiple of [`PERIOD`].
    pub fn samples(self, asked: u32) -> u32 {
        match self.is_signed() {
            false => asked,
            true if asked <= PERIOD => asked.next_power_of_two(),
            true => asked.div_ceil(PERIOD).saturating_mul(PERIOD),
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

/// The number of samples of which one is in the negative parts of a signed filter: about the
/// reciprocal of their share of the filter's magnitude, which is 0.062 of Mitchell's.
pub const PERIOD: u32 = 16;

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
}

/// The lobes of a signed profile, and what samples in them count.
#[derive(Clone, Copy, Debug)]
struct Lobes {
    /// Share of the profile's magnitude beyond its zeros.
    outer: f32,
    /// Share of the filter's positive parts that lies in its corners, where both factors are
    /// negative.
    corners: f32,
    /// The weight of samples 8 to 14 of a period; those before weigh 1.
    late: f32,
    /// The weight of sample 15 of a period.
    negative: f32,
}

impl Lobes {
    /// Returns the lobes of a profile of integral 1 whose parts have these magnitudes.
    fn new(inner: f64, outer: f64) -> Lobes {
        let period = f64::from(PERIOD);
        let positive = inner * inner + outer * outer;
        let early = 0.5 * period;
        // In few enough bits that f32 has the last weight exactly, too, and all add up to the period.
        let late = ((period * positive - early) / (early - 1.0) * 65536.0).round() / 65536.0;
        Lobes {
            outer: (outer / (inner + outer)) as f32,
            corners: (outer * outer / positive) as f32,
            late: late as f32,
            // -2 inner outer a sample, within 4e-6.
            negative: (early - (early - 1.0) * late) as f32,
        }
    }

    /// Returns the weight of a sample, and its numbers for x and y within lobes: each with
    /// whether it is the outer one.
    fn sample(&self, [u, v]: [f32; 2], sample: u32) -> (f32, [(f32, bool); 2]) {
        // The part of [0, 1) before `end`, or after it, made [0, 1).
        let split = |u: f32, end: f32| match u < end {
            true => (u / end, true),
            false => ((u - end) / (1.0 - end), false),
        };
        let last = PERIOD - 1;
        let (weight, places) = match sample % PERIOD {
            number if number == last => {
                let (u, along_x) = split(u, 0.5);
                (self.negative, [(u, along_x), (v, !along_x)])
            }
            number => {
                let (u, in_corner) = split(u, self.corners);
                let weight = if number < PERIOD / 2 { 1.0 } else { self.late };
                (weight, [(u, in_corner), (v, in_corner)])
            }
        };
        // Roundings may reach 1, which is no number of a sample.
        (
            weight,
            places.map(|(u, is)| (u.min(1.0 - 0.5 * f32::EPSILON), is)),
        )
    }
}

/// A pixel filter, ready to be sampled.
#[derive(Clone, Debug)]
pub struct Filter {
    kind: Kind,
    cells: Vec<Cell>,
    /// Entry i is the cell in which the share i/512 of the mass lies.
    first: Vec<u16>,
    /// Of signed profiles.
    lobes: Option<Lobes>,
}

impl Filter {
    /// Tabulates a filter.
    pub fn new(kind: Kind) -> Filter {
        let knots = knots(kind);
        let value = |x: f64| kind.profile(x).abs();
        let mass = |x: [f64; 2]| 0.5 * (value(x[0]) + value(x[1])) * (x[0] - x[1]);
        let pieces = || knots.windows(2).map(|x| [x[0], x[1]]);
        let total: f64 = pieces().map(mass).sum();
        // A cell across the zero of a profile does not occur: a knot lies on it.
        let is_outer = |x: &[f64; 2]| kind.profile(0.5 * (x[0] + x[1])) < 0.0;
        let outer: f64 = pieces().filter(is_outer).map(mass).sum();
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
            });
            before = after;
        }
        let first = (0..=CELLS).map(|i| {
            let share = i as f32 / CELLS as f32;
            cells.partition_point(|cell| cell.before <= share) as u16 - 1
        });
        let first = first.collect();
        let net = total - 2.0 * outer;
        let lobes = (outer > 0.0).then(|| Lobes::new((total - outer) / net, outer / net));
        Filter {
            kind,
            cells,
            first,
            lobes,
        }
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns the offset from the pixel's centre along x and y, in pixels, of samples with these
    /// numbers and random numbers in [0, 1), and their weights: 1 of profiles without negative
    /// parts. There is a number for each lane.
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(&self, u: [L; 2], samples: &[u32]) -> ([L; 2], L) {
        match &self.lobes {
            None => (u.map(|u| self.offset(u)), L::splat(1.0)),
            Some(lobes) => self.signed(lobes, u, samples),
        }
    }

    /// Computes [`sample`](Self::sample) of a signed profile.
    fn signed<L: Lanes<Scalar = f32>>(
        &self,
        lobes: &Lobes,
        u: [L; 2],
        samples: &[u32],
    ) -> ([L; 2], L) {
        let [x, y] = u.map(|u| u.to_array());
        let mut weight = L::zero().to_array();
        let mut within = [L::zero().to_array(); 2];
        let mut low = [L::zero().to_array(); 2];
        let mut size = [L::zero().to_array(); 2];
        for i in 0..L::COUNT {
            let (its, places) = lobes.sample([x.as_ref()[i], y.as_ref()[i]], samples[i]);
            weight.as_mut()[i] = its;
            for (k, (u, is_outer)) in places.into_iter().enumerate() {
                within[k].as_mut()[i] = u;
                let (from, share) = match is_outer {
                    true => (0.0, lobes.outer),
                    false => (lobes.outer, 1.0 - lobes.outer),
                };
                low[k].as_mut()[i] = from;
                size[k].as_mut()[i] = share;
            }
        }
        let load = |lanes: &L::Array| L::load(lanes.as_ref());
        let offsets = [0, 1].map(|k| {
            let (left, share) = from_end(load(&within[k]));
            let share = load(&low[k]) + share * load(&size[k]);
            let distance = self.distance(share.min(L::splat(1.0)));
            L::select(left, -distance, distance)
        });
        (offsets, load(&weight))
    }

    /// Returns the offset from the pixel's centre along one axis, in pixels, with the profile's
    /// magnitude as density. It grows with `u` in [0, 1).
    #[inline(always)]
    fn offset<L: Lanes<Scalar = f32>>(&self, u: L) -> L {
        if self.kind == Kind::Box {
            return u - L::splat(0.5);
        }
        let (left, share) = from_end(u);
        let distance = self.distance(share);
        L::select(left, -distance, distance)
    }

    /// Returns the distance from the centre outside of which a share of the magnitude lies.
    #[inline(always)]
    fn distance<L: Lanes<Scalar = f32>>(&self, share: L) -> L {
        let shares = share.to_array();
        let mut columns = [L::zero().to_array(); 6];
        for i in 0..L::COUNT {
            let cell = self.cell(shares.as_ref()[i]);
            let row = [
                cell.outer,
                cell.width,
                cell.before,
                cell.mass,
                cell.from,
                cell.to,
            ];
            for (column, x) in columns.iter_mut().zip(row) {
                column.as_mut()[i] = x;
            }
        }
        let [outer, width, before, mass, from, to] = columns.map(|column| L::load(column.as_ref()));
        // Inverts a linear density without cancellation; 0/0 where it begins with 0.
        let one = L::splat(1.0);
        let v = ((share - before) / mass).min(one);
        let slope = ((one - v) * (from * from) + v * (to * to)).sqrt();
        let t = v * (from + to) / (from + slope).max(L::splat(f32::MIN_POSITIVE));
        outer - t.min(one) * width
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

/// Returns whether a number of [0, 1) is in the first half, and twice its distance from the nearer
/// end, exactly: the share of the mass outside, of the half in which the sample lies.
#[inline(always)]
fn from_end<L: Lanes<Scalar = f32>>(u: L) -> (L::Mask, L) {
    let left = u.lt(L::splat(0.5));
    let share = L::select(left, u, L::splat(1.0) - u) * L::splat(2.0);
    (left, share)
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
mod tests;
