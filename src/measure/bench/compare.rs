//! Answers compared with those of f64 at one lane.

use super::{BenchError, Contender};
use crate::measure::queries::{Answers, Ask, Job};
use crate::render::Progress;
use crate::trace::HitId;
use rayon::ThreadPool;
use serde::Serialize;

/// Rays with another answer than f64 at one lane, by what is different.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Differences {
    /// Rays compared.
    pub checked: usize,
    /// Of these, rays with another primitive or another shadow: the sum of the
    /// next four.
    pub differ: usize,
    /// Something is there, and nothing was found.
    pub missed: usize,
    /// Nothing is there, and something was found.
    pub extra: usize,
    /// Another primitive at nearly the same t: a shared edge, or two surfaces in
    /// one place.
    pub tied: usize,
    /// Another primitive elsewhere.
    pub elsewhere: usize,
    /// The first of them: rows of the set.
    pub differing_rows: Vec<usize>,
}

/// Rows that are named.
const NAMED: usize = 16;
/// Relative difference of two t's that f32 may make of one. At grazing rays it
/// makes more.
const SAME_T: f32 = 1e-4;

/// What f64 at one lane says, for some rays of a set.
pub(super) struct Expected {
    /// Rows of the set.
    rows: Vec<usize>,
    answers: Answers,
}

impl Expected {
    pub fn of(
        judge: &Contender,
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
        pool.install(|| judge.trace(&job, &mut answers, progress))?;
        Ok(Expected { rows, answers })
    }

    /// Exact contenders must have the same t as well.
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

/// From a peer's ids to the scene's.
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
