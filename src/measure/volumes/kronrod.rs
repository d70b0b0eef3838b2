//! Adaptive quadrature of piecewise smooth functions whose pieces can be told apart.
//!
//! A function returns, beside its values, a signature of the formula that holds there.
//! Panels are cut where signatures of neighbouring nodes differ, so that within a panel
//! the function is smooth but for its ends, where silhouettes make it behave as a square
//! root. The substitution x = a + (b − a)(3s² − 2s³) makes it smooth there as well.
//! Panels use Gauss' rule of 7 points and Kronrod's extension to 15; their difference
//! gives the error, by the estimate of QUADPACK (Piessens et al. 1983).

use rayon::prelude::*;

/// Number of values that are integrated together: volume, first moments (3), second
/// moments (6), and a component of the area.
pub const FIGURES: usize = 11;

pub type Figures = [f64; FIGURES];

/// Values of a function, or an integral.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    pub values: Figures,
    pub errors: Figures,
    /// Equal where the same formula holds.
    pub signature: u64,
    /// Middles of the pieces of an integral: where narrow ones are found again, once they
    /// are known.
    pub middles: Vec<f64>,
}

impl Sample {
    fn add(&mut self, other: &Sample) {
        for k in 0..FIGURES {
            self.values[k] += other.values[k];
            self.errors[k] += other.errors[k];
        }
    }
}

/// What an integral has to reach.
#[derive(Clone, Copy)]
pub struct Tolerance<'a> {
    /// The size of each value that counts as 1.
    pub scale: &'a Figures,
    /// Error of the integral, of the scale.
    pub relative: f64,
    /// Nodes of a panel are evaluated in parallel.
    pub is_parallel: bool,
}

impl Tolerance<'_> {
    fn largest(&self, values: &Figures) -> f64 {
        let share = |k: usize| values[k].abs() / self.scale[k];
        (0..FIGURES).map(share).fold(0.0, f64::max)
    }
}

/// Depth of panels within panels; the error of what is deeper is counted.
const DEEPEST: u32 = 14;

/// Width of a panel, of all, in which its middle stands for it.
const NARROWEST: f64 = 1e-13;

/// What a cut may lose, of the tolerance.
const CUT: f64 = 1e-3;

/// Share of the difference of the two rules that is error at least. By the lengths of the
/// rules, (7/15)³ of an error of third order.
const LEAST_SHARE: f64 = 0.1;

/// Most cuts between two neighbouring nodes.
const MOST_CUTS: u32 = 16;

/// Most places that are looked at beside the nodes of a panel.
const MOST_PROBES: usize = 96;

/// Positive nodes of Kronrod's rule, the outermost first; every second is one of Gauss'.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];

const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];

const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_64,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Place in 0..1 and weights of both rules of node `i` of 15, with the substitution.
fn node(i: usize) -> (f64, f64, f64) {
    let j = i.min(14 - i);
    let x = if i < 7 { -NODES[j] } else { NODES[j] };
    // s and 1 − s, and the place from the nearer end, without cancellation.
    let near = 0.5 * (1.0 - x.abs());
    let place = near * near * (3.0 - 2.0 * near);
    let place = if i <= 7 { place } else { 1.0 - place };
    let weight = 0.5 * 6.0 * near * (1.0 - near);
    let gauss = if j % 2 == 1 { GAUSS[j / 2] } else { 0.0 };
    (place, KRONROD[j] * weight, gauss * weight)
}

/// Integrates over the panels between `splits`, which rise. `f` is given a place and
/// middles of panels that it may meet again.
pub fn integrate<F>(f: &F, splits: &[f64], tolerance: &Tolerance, hints: &[f64]) -> Sample
where
    F: Fn(f64, &[f64]) -> Sample + Sync,
{
    let (Some(first), Some(last)) = (splits.first(), splits.last()) else {
        return Sample::default();
    };
    let work = Work {
        f,
        tolerance,
        whole: last - first,
        probes: hints,
    };
    let panel = |ends: &[f64]| work.panel([ends[0], ends[1]], &[], 0);
    let panels: Vec<Pieces> = match tolerance.is_parallel {
        true => splits.par_windows(2).map(panel).collect(),
        false => splits.windows(2).map(panel).collect(),
    };
    let mut whole = Sample::default();
    for pieces in &panels {
        whole.add(&pieces.sum);
    }
    let all: Vec<&Run> = panels.iter().flat_map(|pieces| &pieces.runs).collect();
    for run in all.chunk_by(|a, b| a.signature == b.signature) {
        let [first, last] = [run[0], run[run.len() - 1]];
        let sum = whole.signature ^ first.signature;
        whole.signature = sum.wrapping_mul(0x0100_0000_01b3).rotate_left(29);
        whole.middles.push(0.5 * (first.from + last.to));
    }
    whole
}

/// An integral over a panel, and the pieces it fell into.
#[derive(Default)]
struct Pieces {
    sum: Sample,
    runs: Vec<Run>,
}

/// A range in which one formula holds.
struct Run {
    signature: u64,
    from: f64,
    to: f64,
}

/// Two places close to each other with different signatures.
struct Cut {
    low: f64,
    high: f64,
    left: Sample,
    right: Sample,
}

/// Returns where the middles of two samples of the same pieces point to at `x`.
fn pointed_to(before: Option<&(f64, Sample)>, (at, now): (f64, &Sample), x: f64) -> Vec<f64> {
    let Some((from, old)) = before.filter(|(_, old)| old.signature == now.signature) else {
        return Vec::new();
    };
    let share = (x - at) / (at - from);
    let pairs = now.middles.iter().zip(&old.middles);
    pairs.map(|(n, o)| n + (n - o) * share).collect()
}

fn rising(mut places: Vec<f64>) -> Vec<f64> {
    places.sort_by(f64::total_cmp);
    places.dedup();
    places
}

struct Work<'a, F> {
    f: &'a F,
    tolerance: &'a Tolerance<'a>,
    whole: f64,
    /// Places to look at, rising.
    probes: &'a [f64],
}

impl<F: Fn(f64, &[f64]) -> Sample + Sync> Work<'_, F> {
    fn panel(&self, [a, b]: [f64; 2], hints: &[f64], depth: u32) -> Pieces {
        let width = b - a;
        if !(width > NARROWEST * self.whole) {
            let middle = (self.f)(0.5 * (a + b), hints);
            let mut sum = Sample::default();
            for k in 0..FIGURES {
                sum.values[k] = middle.values[k] * width;
                sum.errors[k] = sum.values[k].abs() + middle.errors[k] * width;
            }
            return Pieces {
                sum,
                runs: Vec::new(),
            };
        }
        let place = |i: usize| match node(i).0 {
            p if i <= 7 => a + width * p,
            p => b - width * (1.0 - p),
        };
        let at = |i: usize| (self.f)(place(i), hints);
        let nodes: Vec<Sample> = match self.tolerance.is_parallel {
            true => (0..15).into_par_iter().map(at).collect(),
            false => (0..15).map(at).collect(),
        };
        let mut known: Vec<(f64, &Sample)> = (0..15).map(|i| (place(i), &nodes[i])).collect();
        let inside = |x: &&f64| a < **x && **x < b;
        let probes: Vec<(f64, Sample)> = self
            .probes
            .iter()
            .filter(inside)
            .take(MOST_PROBES)
            .map(|x| (*x, (self.f)(*x, hints)))
            .collect();
        known.extend(probes.iter().map(|(x, sample)| (*x, sample)));
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let same = |pair: &[(f64, &Sample)]| pair[0].1.signature == pair[1].1.signature;
        let is_smooth = known.windows(2).all(same);
        let share = (width / self.whole).max(1.0 / 16.0);
        if is_smooth || depth >= DEEPEST {
            let sum = self.rule(&nodes, width, is_smooth);
            let fine = self.tolerance.largest(&sum.errors) <= self.tolerance.relative * share;
            if fine || depth >= DEEPEST {
                let run = Run {
                    signature: nodes[7].signature,
                    from: a,
                    to: b,
                };
                return Pieces {
                    sum,
                    runs: vec![run],
                };
            }
            let middle = 0.5 * (a + b);
            let halves = [[a, middle], [middle, b]];
            return self.together(&halves, &nodes[7].middles, depth);
        }
        if depth > 0 {
            // Where even the plain difference of the rules is small enough, no cut is
            // needed; it holds for functions that are not smooth as well.
            let sum = self.rule(&nodes, width, false);
            if self.tolerance.largest(&sum.errors) <= self.tolerance.relative * share {
                let runs = known.chunk_by(|a, b| a.1.signature == b.1.signature);
                let run = |run: &[(f64, &Sample)]| Run {
                    signature: run[0].1.signature,
                    from: run[0].0,
                    to: run[run.len() - 1].0,
                };
                return Pieces {
                    sum,
                    runs: runs.map(run).collect(),
                };
            }
        }
        let changes = known.windows(2).filter(|pair| !same(pair));
        let mut from = a;
        let mut panels = Vec::new();
        let mut lost = Sample::default();
        let mut hints: Vec<f64> = Vec::new();
        for pair in changes {
            let mut left = (pair[0].0, pair[0].1.clone());
            let right = pair[1];
            // Between the two may lie more pieces, however narrow: a cut ends on the
            // first of them.
            for _ in 0..MOST_CUTS {
                let cut = self.cut(left, (right.0, right.1.clone()));
                for k in 0..FIGURES {
                    let (left, right) = (cut.left.values[k], cut.right.values[k]);
                    let width = cut.high - cut.low;
                    lost.values[k] += 0.5 * (left + right) * width;
                    // Pieces narrower than the cut lie in it, unseen.
                    let unseen = CUT * self.tolerance.relative * self.tolerance.scale[k];
                    lost.errors[k] += (left - right).abs() * width + unseen;
                }
                hints.extend(&cut.left.middles);
                hints.extend(&cut.right.middles);
                // Nodes of the panels beside a cut lie on their own side of it.
                panels.push([from, cut.low]);
                from = cut.high;
                if cut.right.signature == right.1.signature {
                    break;
                }
                left = (cut.high, cut.right);
            }
        }
        panels.push([from, b]);
        let hints = rising(hints);
        let mut pieces = self.together(&panels, &hints, depth);
        pieces.sum.add(&lost);
        pieces
    }

    fn together(&self, panels: &[[f64; 2]], hints: &[f64], depth: u32) -> Pieces {
        let one = |ends: &[f64; 2]| self.panel(*ends, hints, depth + 1);
        let all: Vec<Pieces> = match self.tolerance.is_parallel {
            true => panels.par_iter().map(one).collect(),
            false => panels.iter().map(one).collect(),
        };
        let mut pieces = Pieces::default();
        for one in all {
            pieces.sum.add(&one.sum);
            pieces.runs.extend(one.runs);
        }
        pieces
    }

    /// Bisects to a place where the signature changes, until what may be lost there is
    /// below the tolerance. A piece that narrows to nothing is followed: its middle is looked
    /// for where the last two samples with that piece point to.
    fn cut(&self, (mut low, mut left): (f64, Sample), (mut high, mut right): (f64, Sample)) -> Cut {
        // The samples before `left` and `right`.
        let (mut before, mut beyond) = (None, None);
        loop {
            let width = high - low;
            let jump = std::array::from_fn(|k| (left.values[k] - right.values[k]).abs() * width);
            let most = self.tolerance.largest(&jump);
            let is_near = most <= self.tolerance.relative * CUT && width < 1e-4 * self.whole;
            let middle = low + 0.5 * width;
            if is_near || width <= NARROWEST * self.whole || middle <= low || middle >= high {
                return Cut {
                    low,
                    high,
                    left,
                    right,
                };
            }
            let mut hints = [&left.middles[..], &right.middles[..]].concat();
            hints.extend(pointed_to(before.as_ref(), (low, &left), middle));
            hints.extend(pointed_to(beyond.as_ref(), (high, &right), middle));
            let found = (self.f)(middle, &rising(hints));
            match found.signature == left.signature {
                true => {
                    before = Some((low, left));
                    (low, left) = (middle, found);
                }
                false => {
                    beyond = Some((high, right));
                    (high, right) = (middle, found);
                }
            }
        }
    }

    fn rule(&self, nodes: &[Sample], width: f64, is_smooth: bool) -> Sample {
        let mut sum = Sample::default();
        let (mut gauss, mut spread) = ([0.0; FIGURES], [0.0; FIGURES]);
        for (i, one) in nodes.iter().enumerate() {
            let (_, kronrod, coarse) = node(i);
            for k in 0..FIGURES {
                sum.values[k] += one.values[k] * kronrod * width;
                sum.errors[k] += one.errors[k] * kronrod * width;
                gauss[k] += one.values[k] * coarse * width;
            }
        }
        for (i, one) in nodes.iter().enumerate() {
            let (_, kronrod, _) = node(i);
            for k in 0..FIGURES {
                spread[k] += (one.values[k] * width - sum.values[k]).abs() * kronrod;
            }
        }
        for k in 0..FIGURES {
            // QUADPACK's estimate: the difference is the error of Gauss' rule, and that of
            // Kronrod's is about its power 1.5. At singularities that no signature shows
            // (x² log x on a plane through a saddle) both rules have the same order, and
            // Kronrod's error is a small part of the difference.
            let difference = (sum.values[k] - gauss[k]).abs();
            let share = 200.0 * difference / spread[k];
            let error = match is_smooth && spread[k] > 0.0 {
                true => {
                    let power = spread[k] * (share * share.sqrt()).min(1.0);
                    power.max(LEAST_SHARE * difference)
                }
                false => difference,
            };
            sum.errors[k] += error.max(sum.values[k].abs() * (4.0 * f64::EPSILON));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integral(relative: f64, f: impl Fn(f64) -> (f64, u64) + Sync) -> [f64; 2] {
        let scale = [1.0; FIGURES];
        let tolerance = Tolerance {
            scale: &scale,
            relative,
            is_parallel: false,
        };
        let sample = |x: f64, _: &[f64]| {
            let (value, signature) = f(x);
            let mut sample = Sample {
                signature,
                ..Sample::default()
            };
            sample.values[0] = value;
            sample
        };
        let sum = integrate(&sample, &[-1.0, 0.1, 1.0], &tolerance, &[]);
        [sum.values[0], sum.errors[0]]
    }

    /// A polynomial, a half disc that ends inside panels, and a jump.
    #[test]
    fn integrals_are_known() {
        let [value, error] = integral(1e-12, |x| (x * x * x * x, 0));
        assert!(
            (value - 0.4).abs() <= error + 1e-15 && error < 1e-12,
            "{value} {error}"
        );
        let [value, error] = integral(1e-9, |x| {
            let square = 0.25 - (x - 0.2) * (x - 0.2);
            (square.max(0.0).sqrt(), u64::from(square > 0.0))
        });
        let wanted = std::f64::consts::PI / 8.0;
        assert!(
            (value - wanted).abs() <= error && error < 1e-8,
            "{value} {error}"
        );
        let [value, error] = integral(1e-9, |x| match x < 0.3 {
            true => (libm::exp(x), 0),
            false => (2.0, 1),
        });
        let wanted = libm::exp(0.3) - libm::exp(-1.0) + 1.4;
        assert!(
            (value - wanted).abs() <= error && error < 1e-8,
            "{value} {error}"
        );
    }

    #[test]
    fn weights_sum_to_one() {
        let sum = |of: fn((f64, f64, f64)) -> f64| (0..15).map(|i| of(node(i))).sum::<f64>();
        assert!((sum(|n| n.1) - 1.0).abs() < 1e-15 && (sum(|n| n.2) - 1.0).abs() < 1e-15);
    }
}
