//! Compares answers with those of exact tracing in one f64 lane.

use super::{BenchError, Contender};
use crate::queries::{Answers, Ask, Job};
use lanecast_engine::trace::HitId;
use lanecast_picture::render::Progress;
use rayon::ThreadPool;
use serde::Serialize;

/// Number of rays whose answer differs from that of one f64 lane, by kind of
/// difference.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Differences {
    /// Number of rays compared.
    pub checked: usize,
    /// Number of these rays with another primitive or another shadow: the sum of the
    /// next four.
    pub differ: usize,
    /// Misses where the oracle hits.
    pub missed: usize,
    /// Hits where the oracle misses.
    pub extra: usize,
    /// Another primitive at nearly the same t: a shared edge, or two surfaces in one
    /// place.
    pub tied: usize,
    /// Another primitive at another t.
    pub elsewhere: usize,
    /// Rows in the set of the first differing rays.
    pub differing_rows: Vec<usize>,
}

/// Maximum number of rows listed.
const NAMED: usize = 16;
/// Relative difference up to which two values of t count as equal in f32. At grazing
/// rays f32's error is larger.
const SAME_T: f32 = 1e-4;

/// The oracle's answers (one f64 lane) for a sample of a set's rays.
pub(super) struct Expected {
    /// Rows of the set.
    rows: Vec<usize>,
    answers: Answers,
}

impl Expected {
    pub fn new(
        oracle: &Contender,
        pool: &ThreadPool,
        job: &Job,
        checked: usize,
        progress: &Progress,
    ) -> Result<Expected, BenchError> {
        let step = job.rays.len().div_ceil(checked.max(1)).max(1);
        let rows: Vec<usize> = (0..job.rays.len()).step_by(step).collect();
        let some = job.rays.select(rows.iter().copied());
        let job = Job {
            kind: job.kind.clone(),
            ask: job.ask,
            rays: some,
        };
        let mut answers = Answers::default();
        pool.install(|| oracle.trace(&job, &mut answers, progress))?;
        Ok(Expected { rows, answers })
    }

    /// Counts the differences. Exact contenders must have the same t as well.
    pub fn differences(&self, ask: Ask, contender: &Contender, found: &Answers) -> Differences {
        let mut all = Differences {
            checked: self.rows.len(),
            ..Differences::default()
        };
        for (own, row) in self.rows.iter().enumerate() {
            let same = match ask {
                Ask::Any => {
                    let (there, found) = (self.answers.blocked[own], found.blocked[*row]);
                    all.missed += usize::from(there && !found);
                    all.extra += usize::from(!there && found);
                    there == found
                }
                Ask::Closest => {
                    let (there, id) = (self.answers.id.get(own), found.id.get(*row));
                    let (t, other) = (self.answers.t[own], found.t[*row]);
                    if there == id {
                        let bits = t.to_bits() == other.to_bits();
                        let same = !contender.exact || id == HitId::NONE || bits;
                        all.elsewhere += usize::from(!same);
                        same
                    } else {
                        let count = match (there, id) {
                            (_, HitId::NONE) => &mut all.missed,
                            (HitId::NONE, _) => &mut all.extra,
                            _ if (t - other).abs() <= SAME_T * t.abs() => &mut all.tied,
                            _ => &mut all.elsewhere,
                        };
                        *count += 1;
                        false
                    }
                }
            };
            if !same {
                all.differ += 1;
                if all.differing_rows.len() < NAMED {
                    all.differing_rows.push(*row);
                }
            }
        }
        all
    }
}

/// Translates a baseline's ids to the scene's.
pub(super) fn translate(answers: &mut Answers, ids: &[HitId]) {
    for i in 0..answers.id.len() {
        let id = answers.id.get(i);
        let own = match ids.get(id.primitive as usize) {
            Some(own) if id != HitId::NONE => *own,
            _ => HitId::NONE,
        };
        answers.id.set(i, own);
    }
}
