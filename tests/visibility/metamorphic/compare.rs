//! Counts the differences between two pictures, or two records of rays.

use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::render::Rendered;
use lanecast::internals::trace::{HitId, Outcome, RayKind, TracedRay};
use std::ops::AddAssign;

/// What differs, by name, and how often.
pub type Differences = Vec<(&'static str, usize)>;

/// Of many comparisons.
#[derive(Default)]
pub struct Tally {
    comparisons: usize,
    pub rays: usize,
    pub ties: usize,
    pub left_out: usize,
    /// Those that found something: whether it is wrong, and what.
    found: Vec<(bool, String, Differences)>,
    /// How far apart t's are.
    pub spread: Spread,
}

impl Tally {
    /// `held`: nothing may differ. Else it is only said.
    pub fn add(&mut self, held: bool, what: String, mut differences: Differences) {
        self.comparisons += 1;
        differences.retain(|(_, count)| *count > 0);
        if !differences.is_empty() {
            self.found.push((held, what, differences));
        }
    }

    pub fn settle(&self) {
        for (held, what, differences) in &self.found {
            let said = if *held { "wrong" } else { "counted" };
            println!("{said}: {what}: {differences:?}");
        }
        let wrong = self.found.iter().filter(|(held, ..)| *held).count();
        assert_eq!(wrong, 0, "of {} comparisons", self.comparisons);
        assert!(self.comparisons > 0 && self.left_out * 4 < self.comparisons);
    }
}

/// t's of the same hit, two ways, in units in the last place of the mode's own
/// numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    pub hits: usize,
    /// Not the same bits.
    pub differ: usize,
    pub beyond_two: usize,
    pub most: f64,
}

impl AddAssign for Spread {
    fn add_assign(&mut self, other: Spread) {
        self.hits += other.hits;
        self.differ += other.differ;
        self.beyond_two += other.beyond_two;
        self.most = self.most.max(other.most);
    }
}

pub fn show(name: &str, tally: Tally) -> Tally {
    println!(
        "{name}: {} comparisons, {} left out, {} rays, {} exact ties; {} found something; {:?}",
        tally.comparisons,
        tally.left_out,
        tally.rays,
        tally.ties,
        tally.found.len(),
        tally.spread
    );
    tally
}

/// Pixels that differ, channel by channel; depths and positions grow by `scale`.
pub fn same_pictures(before: &Rendered, after: &Rendered, scale: f64) -> Differences {
    let (a, b) = (&before.picture, &after.picture);
    let bits = |p: &[f32; 3]| p.map(f32::to_bits);
    let grown = |x: f32| (f64::from(x) * scale) as f32;
    let triples = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let pairs = a.iter().zip(b);
        pairs.filter(|(a, b)| bits(a) != bits(b)).count()
    };
    let each = |a: &Option<Vec<[f32; 3]>>, b: &Option<Vec<[f32; 3]>>| {
        triples(
            a.as_ref().expect("asked for"),
            b.as_ref().expect("asked for"),
        )
    };
    let depth = {
        let pairs = a.depth.iter().flatten().zip(b.depth.iter().flatten());
        pairs
            .filter(|(a, b)| grown(**a).to_bits() != b.to_bits())
            .count()
    };
    let position = a.position.as_ref().expect("asked for");
    let position: Vec<[f32; 3]> = position.iter().map(|p| p.map(grown)).collect();
    let instance = a
        .instance_id
        .iter()
        .flatten()
        .zip(b.instance_id.iter().flatten());
    let primitive = a
        .primitive_id
        .iter()
        .flatten()
        .zip(b.primitive_id.iter().flatten());
    let mut counts = [before.counts, after.counts];
    for counts in &mut counts {
        // What is tried first depends on what was built.
        counts.shadow_cache = Default::default();
    }
    vec![
        ("color", triples(&a.color, &b.color)),
        ("normal", each(&a.normal, &b.normal)),
        ("albedo", each(&a.albedo, &b.albedo)),
        ("instance", instance.filter(|(a, b)| a != b).count()),
        ("primitive", primitive.filter(|(a, b)| a != b).count()),
        ("depth", depth),
        (
            "position",
            triples(&position, b.position.as_ref().expect("asked for")),
        ),
        ("counts", usize::from(counts[0] != counts[1])),
    ]
}

/// Hits, ids and shadows of every ray, pixel by pixel, and how far apart the t's
/// of camera rays are: these are the same rays but for the turn, others nearly.
pub fn same_records(
    before: &[TracedRay],
    after: &[TracedRay],
    precision: Precision,
) -> (Differences, Spread) {
    let pixels = |rays: &'_ [TracedRay]| -> Vec<usize> {
        let starts = 1..rays.len();
        let starts = starts.filter(|i| rays[*i].pixel != rays[i - 1].pixel);
        [0].into_iter().chain(starts).chain([rays.len()]).collect()
    };
    let (starts, others) = (pixels(before), pixels(after));
    assert_eq!(starts.len(), others.len(), "every pixel has a camera ray");
    let [mut rays, mut kinds, mut hits, mut ids, mut shadows] = [0; 5];
    let mut spread = Spread::default();
    for i in 1..starts.len() {
        let pixel = &before[starts[i - 1]..starts[i]];
        let other = &after[others[i - 1]..others[i]];
        if pixel.len() != other.len() {
            rays += 1;
        }
        for (a, b) in pixel.iter().zip(other) {
            if a.kind != b.kind {
                kinds += 1;
                break;
            }
            match (a.outcome, b.outcome) {
                (Outcome::Miss, Outcome::Miss) => {}
                (Outcome::Hit { .. }, Outcome::Hit { .. }) => {
                    ids += usize::from(id_of(a) != id_of(b));
                    if a.kind == RayKind::Primary && id_of(a) == id_of(b) {
                        let ulps = ulps(t_of(a), t_of(b), precision);
                        spread += Spread {
                            hits: 1,
                            differ: usize::from(ulps > 0.0),
                            beyond_two: usize::from(ulps > 2.0),
                            most: ulps,
                        };
                    }
                }
                (Outcome::Clear | Outcome::Blocked, Outcome::Clear | Outcome::Blocked) => {
                    shadows += usize::from(a.outcome != b.outcome);
                }
                _ => hits += 1,
            }
        }
    }
    let differences = vec![
        ("pixels with more or fewer rays", rays),
        ("kind", kinds),
        ("hit", hits),
        ("id", ids),
        ("shadow", shadows),
    ];
    (differences, spread)
}

fn id_of(ray: &TracedRay) -> (u64, u32) {
    match ray.outcome {
        Outcome::Hit {
            instance,
            primitive,
            ..
        } => (instance, primitive),
        _ => (u64::MAX, u32::MAX),
    }
}

fn t_of(ray: &TracedRay) -> f64 {
    match ray.outcome {
        Outcome::Hit { t, .. } => t,
        _ => f64::NAN,
    }
}

/// Of the mode's own numbers.
fn ulps(a: f64, b: f64, precision: Precision) -> f64 {
    let bits = match precision {
        Precision::Exact => 52,
        _ => 23,
    };
    let largest = a.abs().max(b.abs());
    let ulp = libm::ldexp(1.0, libm::ilogb(largest) - bits);
    (a - b).abs() / ulp
}

/// Whether exact arithmetic has both at the same t.
pub fn is_tie(reference: &Reference, (org, dir): ([f64; 3], [f32; 3]), ids: [HitId; 2]) -> bool {
    let first = |id: HitId| {
        let all = reference.crossings(org, dir.map(f64::from), id.instance, id.primitive);
        all.iter().map(|c| c.t).find(|t| *t > 0.0)
    };
    let [a, b] = ids.map(first);
    a.is_some() && a == b
}
