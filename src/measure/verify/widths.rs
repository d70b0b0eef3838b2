//! Comparison of the same rays traced at two lane counts.

use super::show::Traced;
use lanecast_engine::trace::{Outcome, TracedRay};

/// Rays that differ in any bit, or that only one of the two runs traced.
#[derive(Clone, Debug, Default)]
pub struct Differences {
    pub count: u64,
    /// Describes the first difference, for messages.
    pub first: Option<String>,
}

impl Differences {
    pub fn add(&mut self, lanes: &[TracedRay], one: &[TracedRay]) {
        let pairs = || lanes.iter().zip(one);
        let differing = pairs().filter(|(a, b)| bits(a) != bits(b)).count();
        self.count += (differing + lanes.len().abs_diff(one.len())) as u64;
        if self.first.is_none() && differing > 0 {
            let first = pairs().find(|(a, b)| bits(a) != bits(b));
            self.first = first.map(|(lanes, one)| {
                format!(
                    "ray org {:?} dir {:?} t_max {:?}: {}, and at one lane {}",
                    lanes.org,
                    lanes.dir,
                    lanes.t_max,
                    Traced(&lanes.outcome),
                    Traced(&one.outcome)
                )
            });
        }
    }
}

type Bits = ([u64; 3], [u64; 3], u32, (u8, u64, u64, u32, [u64; 3]));

fn bits(ray: &TracedRay) -> Bits {
    let outcome = match ray.outcome {
        Outcome::Hit {
            t,
            instance,
            primitive,
            normal,
        } => (
            3,
            t.to_bits(),
            instance,
            primitive,
            normal.map(f64::to_bits),
        ),
        Outcome::Miss => (0, 0, 0, 0, [0; 3]),
        Outcome::Clear => (1, 0, 0, 0, [0; 3]),
        Outcome::Blocked => (2, 0, 0, 0, [0; 3]),
    };
    (
        ray.org.map(f64::to_bits),
        ray.dir.map(f64::to_bits),
        ray.t_max.to_bits(),
        outcome,
    )
}
