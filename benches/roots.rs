//! Which root finder is fast at which degree, and what are lanes worth?
//!
//! All roots in (0, 1), by each solver, and the least one, by `auto`, by the lanes'
//! kernel one at a time, and in lanes; beside crates that users would pick: the
//! formulas and Sturm of `roots`, Yuksel's method as `polycool` has it, all complex
//! roots by `aberth`. Polynomials come in packets of eight with nearly the same
//! roots, as neighbouring rays have them: some real ones in (−1, 2), others complex
//! near (0, 1). Time is per polynomial. Asserted: `auto`, Sturm and the lanes find
//! the same.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lanecast::internals::math::lanes::{Lanes, Mask, f64x8};
use lanecast::internals::roots::lanes::{Segment, Waiting, exists, from_powers, nearest};
use lanecast::internals::roots::{Interval, Polynomial, Solver, Want, solve};
use std::hint::black_box;
use std::time::Duration;

const PACKETS: usize = 64;

/// Xorshift (Marsaglia), in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

/// Times t² + q₁ t + q₀, or t + q₀.
fn times(c: &mut Vec<f64>, factor: &[f64]) {
    let mut next = vec![0.0; c.len() + factor.len() - 1];
    for (i, c) in c.iter().enumerate() {
        for (j, f) in factor.iter().enumerate() {
            next[i + j] += c * f;
        }
    }
    *c = next;
}

fn packet<const N: usize>(random: &mut Random) -> [[f64; N]; 8] {
    let n = N - 1;
    let pairs = (random.next() * (n / 2 + 1) as f64) as usize;
    let places: Vec<[f64; 2]> = (0..n).map(|_| [random.next(), random.next()]).collect();
    std::array::from_fn(|_| {
        let mut c = vec![1.0];
        for (k, [x, y]) in places.iter().enumerate().take(n - pairs) {
            let (x, y) = (x + 1e-3 * random.next(), y + 1e-3 * random.next());
            if k < pairs {
                let (a, b) = (2.0 * x - 0.5, y);
                times(&mut c, &[a * a + b * b, -2.0 * a, 1.0]);
            } else {
                times(&mut c, &[1.0 - 3.0 * x, 1.0]);
            }
        }
        std::array::from_fn(|i| c[i])
    })
}

fn degree<const N: usize>(criterion: &mut Criterion) {
    let n = N - 1;
    let mut random = Random(88_172_645_463_325_252);
    let packets: Vec<[[f64; N]; 8]> = (0..PACKETS).map(|_| packet(&mut random)).collect();
    let rows: Vec<[f64; N]> = packets.iter().flatten().copied().collect();
    let polynomials: Vec<Polynomial> = rows.iter().map(|c| Polynomial::new(c).unwrap()).collect();
    let unit = Interval::open(0.0, 1.0);
    let by = |p: &Polynomial, solver, want| solve(p, &unit, solver, want, &[]).unwrap();

    let column = |packet: &[[f64; N]; 8], i: usize| {
        let lanes: [f64; 8] = std::array::from_fn(|k| packet[k][i]);
        f64x8::load(&lanes)
    };
    let segment = |packet| {
        let c: [f64x8; N] = std::array::from_fn(|i| column(packet, i));
        from_powers(&c, f64x8::splat(0.0))
    };
    let wide: Vec<Segment<f64x8, N>> = packets.iter().map(segment).collect();
    let narrow: Vec<Segment<f64, N>> = rows.iter().map(|c| from_powers(c, 0.0)).collect();
    let all = <f64x8 as Lanes>::Mask::splat(true);
    let (mut waiting, mut waiting_one) = (Waiting::default(), Waiting::default());

    for (packet, row) in wide.iter().zip(polynomials.chunks(8)) {
        let found = nearest(packet, all, &mut waiting);
        for (k, p) in row.iter().enumerate() {
            let on = |mask: <f64x8 as Lanes>::Mask| mask.bits() >> k & 1 == 1;
            let [auto, sturm] = [Solver::Auto, Solver::Sturm].map(|s| by(p, s, Want::All).roots);
            assert_eq!(auto, sturm);
            if !on(found.doubt) {
                assert_eq!(on(found.hit), !auto.is_empty());
            }
        }
    }

    let mut group = criterion.benchmark_group(format!("roots in (0, 1), degree {n}"));
    group.throughput(Throughput::Elements(rows.len() as u64));
    let mut each = |name: &str, run: &mut dyn FnMut()| {
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(&mut *run));
    };
    for solver in Solver::ALL {
        if solver == Solver::Closed && n > 4 {
            continue;
        }
        each(solver.name(), &mut || {
            for p in &polynomials {
                black_box(by(p, solver, Want::All).roots.len());
            }
        });
    }
    each("least: auto", &mut || {
        for p in &polynomials {
            black_box(by(p, Solver::Auto, Want::Nearest).roots.len());
        }
    });
    each("least: lanes' kernel, one lane", &mut || {
        for segment in &narrow {
            black_box(nearest(segment, true, &mut waiting_one).t);
        }
    });
    each("least: lanes", &mut || {
        for segment in &wide {
            black_box(nearest(segment, all, &mut waiting).t);
        }
    });
    each("whether: lanes", &mut || {
        for segment in &wide {
            black_box(exists(segment, all, &mut waiting).some);
        }
    });
    each("from powers: lanes", &mut || {
        for packet in &wide {
            black_box(from_powers(black_box(&packet.scaled), packet.error).error);
        }
    });
    let yuksel: Vec<_> = rows.iter().map(|c| polycool::PolyDyn::new(*c)).collect();
    each("crate polycool", &mut || {
        for p in &yuksel {
            black_box(p.roots_between(0.0, 1.0, 1e-15).len());
        }
    });
    let mut solver = aberth::AberthSolver::new();
    solver.epsilon = 1e-15;
    each("crate aberth", &mut || {
        for c in &rows {
            black_box(solver.find_roots(c).len());
        }
    });
    // Without the leading 1, the highest first.
    let monic: Vec<Vec<f64>> = rows
        .iter()
        .map(|c| c[..n].iter().rev().copied().collect())
        .collect();
    if n == 4 {
        each("crate roots, quartic", &mut || {
            for c in &rows {
                let roots = roots::find_roots_quartic(c[4], c[3], c[2], c[1], c[0]);
                black_box(roots.as_ref().len());
            }
        });
    }
    if n <= 6 {
        each("crate roots, Sturm", &mut || {
            for c in &monic {
                black_box(roots::find_roots_sturm(c, &mut 1e-15_f64).len());
            }
        });
    }
    group.finish();
}

fn solvers(criterion: &mut Criterion) {
    degree::<3>(criterion);
    degree::<4>(criterion);
    degree::<5>(criterion);
    degree::<7>(criterion);
    degree::<9>(criterion);
    degree::<11>(criterion);
    degree::<13>(criterion);
    degree::<17>(criterion);
    degree::<21>(criterion);
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_millis(400));
    targets = solvers
}
criterion_main!(benches);
