//! What a frame gains by the one before: the same camera rays, cold and with
//! last frame's answers, and the top tree fitted, built, or built with all the
//! rest. Every frame is measured in all ways in turns, so that what disturbs the
//! machine disturbs them alike.

use super::clock::{Clock, best_and_median};
use super::queries::Columns;
use crate::accel::{Kept, Structure, World};
use crate::io::RaySet;
use crate::plan::Kernels;
use crate::render::Progress;
use crate::scene::{Appearances, Scene, SceneError};
use crate::trace::{GuessCounts, HitId, Hits, Last, Rays, Reuse, closest, closest_after};
use serde::Serialize;

/// One way to trace the frames' camera rays.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    pub reuse: Reuse,
    /// `refitted`: never built again since the first frame; or `rebuilt`.
    pub top_tree: &'static str,
    pub kind: &'static str,
    pub precision: &'static str,
    pub lanes: usize,
    /// From the second frame on.
    pub frames: usize,
    pub rays: u64,
    /// Of the frames' medians, the median.
    pub mrays_per_s: f64,
    /// Its time, over that of the cold rays through the rebuilt tree.
    pub speedup: f64,
    pub guesses: GuessCounts,
    /// Answers that are not those of the cold rays; 0.
    pub mismatches: u64,
}

/// One way to come to a frame's trees.
#[derive(Clone, Debug, Serialize)]
pub struct RenewalRow {
    /// `refitted`, `rebuilt`: the top tree; `built`: every tree.
    pub top_tree: &'static str,
    pub seconds: f64,
    /// The top tree's expected cost, of the last frame.
    pub sah: f64,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameReport {
    pub results: Vec<FrameRow>,
    pub renewals: Vec<RenewalRow>,
}

/// What is measured.
pub struct Question<'a> {
    /// The camera's, the same in every frame.
    pub rays: &'a RaySet,
    pub kernels: Kernels,
    pub precision: &'static str,
    pub frames: u32,
    /// Runs of each measurement.
    pub reps: u32,
    pub clock: Clock,
}

/// Ways to trace: what is reused, and whether through the refitted tree.
const WAYS: [(Reuse, bool); 4] = [
    (Reuse::None, false),
    (Reuse::None, true),
    (Reuse::Hit, true),
    (Reuse::Depth, true),
];

const RENEWALS: [&str; 3] = ["refitted", "rebuilt", "built"];

/// Answers of one frame.
#[derive(Clone, Default)]
struct Answers {
    t: Vec<f64>,
    id: Vec<HitId>,
}

impl Answers {
    fn of(rays: usize) -> Answers {
        Answers {
            t: vec![0.0; rays],
            id: vec![HitId::NONE; rays],
        }
    }

    /// Rows that differ in any bit that means something.
    fn mismatches(&self, other: &Answers) -> u64 {
        let row = |answers: &Answers, i: usize| (answers.t[i].to_bits(), answers.id[i]);
        let differs = |i: &usize| {
            let missed = self.id[*i] == HitId::NONE && other.id[*i] == HitId::NONE;
            !missed && row(self, *i) != row(other, *i)
        };
        (0..self.id.len()).filter(differs).count() as u64
    }
}

/// Runs on this thread. `None` where it was cancelled.
pub fn measure(
    mut scene: Scene,
    question: &Question,
    progress: &Progress,
) -> Result<Option<FrameReport>, SceneError> {
    let mut columns = Columns::default();
    columns.fill(question.rays, 0, question.rays.len());
    let rays = columns.borrowed();
    let mut bounds = vec![0.0; rays.len()];
    let mut kept: Option<Kept> = None;
    let mut last = Answers::default();
    // Medians of each frame.
    let mut traced: [Vec<f64>; 4] = Default::default();
    let mut renewed: [Vec<f64>; 3] = Default::default();
    let mut guesses = [GuessCounts::default(); 4];
    let mut mismatches = [0; 4];
    let mut sah = [0.0; 3];
    for frame in 0..question.frames {
        scene = scene.at(f64::from(frame) / f64::from(question.frames.max(2) - 1))?;
        let appearances = Appearances::of(&scene)?;
        let build = || World::build(&scene, &appearances, Structure::Bvh);
        let next =
            |kept: Kept, worst| World::next(kept, &scene, &appearances, Structure::Bvh, worst).0;
        let Some(before) = kept.take() else {
            let world = build();
            last = Answers::of(rays.len());
            ask(
                &world,
                question,
                &rays,
                Reuse::None,
                &last.clone(),
                &mut bounds,
                &mut last,
            );
            kept = Some(world.keep());
            continue;
        };
        let mut seconds: [Vec<f64>; 3] = Default::default();
        for _ in 0..question.reps {
            for way in 0..RENEWALS.len() {
                if progress.is_cancelled() {
                    return Ok(None);
                }
                let kept = (way < 2).then(|| before.clone());
                let worst = if way == 0 { f64::INFINITY } else { 0.0 };
                let (world, spent) = question.clock.time(|| match kept {
                    Some(kept) => next(kept, worst),
                    None => build(),
                });
                sah[way] = world.forest.top_figures().sah;
                seconds[way].push(spent);
            }
        }
        for (all, seconds) in renewed.iter_mut().zip(&seconds) {
            all.push(best_and_median(seconds).1);
        }
        let rebuilt = next(before.clone(), 0.0);
        let refitted = next(before, f64::INFINITY);
        let mut seconds: [Vec<f64>; 4] = Default::default();
        let mut cold = Answers::of(rays.len());
        let mut answers = cold.clone();
        for rep in 0..question.reps {
            for (way, (reuse, refit)) in WAYS.into_iter().enumerate() {
                if progress.is_cancelled() {
                    return Ok(None);
                }
                let world = if refit { &refitted } else { &rebuilt };
                let (counts, spent) = question.clock.time(|| {
                    ask(
                        world,
                        question,
                        &rays,
                        reuse,
                        &last,
                        &mut bounds,
                        &mut answers,
                    )
                });
                seconds[way].push(spent);
                if rep == 0 {
                    guesses[way].add(&counts);
                    if way == 0 {
                        cold.clone_from(&answers);
                    }
                    mismatches[way] += cold.mismatches(&answers);
                }
            }
        }
        for (all, seconds) in traced.iter_mut().zip(&seconds) {
            all.push(best_and_median(seconds).1);
        }
        last = cold;
        kept = Some(refitted.keep());
    }
    let median = |seconds: &[f64]| best_and_median(seconds).1;
    let cold = median(&traced[0]);
    let row = |(way, (reuse, refit)): (usize, (Reuse, bool))| {
        let seconds = median(&traced[way]).max(f64::MIN_POSITIVE);
        FrameRow {
            reuse,
            top_tree: RENEWALS[usize::from(!refit)],
            kind: "primary",
            precision: question.precision,
            lanes: question.kernels.lanes,
            frames: traced[way].len(),
            rays: question.rays.len() as u64,
            mrays_per_s: question.rays.len() as f64 / seconds * 1e-6,
            speedup: cold / seconds,
            guesses: guesses[way],
            mismatches: mismatches[way],
        }
    };
    let renewal = |(way, top_tree): (usize, &'static str)| RenewalRow {
        top_tree,
        seconds: median(&renewed[way]),
        sah: sah[way],
    };
    Ok(Some(FrameReport {
        results: WAYS.into_iter().enumerate().map(row).collect(),
        renewals: RENEWALS.into_iter().enumerate().map(renewal).collect(),
    }))
}

/// All rays, in chunks that stay in the second-level cache.
const CHUNK: usize = 2048;

fn ask(
    world: &World,
    question: &Question,
    rays: &Rays,
    reuse: Reuse,
    last: &Answers,
    bounds: &mut [f32],
    answers: &mut Answers,
) -> GuessCounts {
    let mut counts = GuessCounts::default();
    for first in (0..rays.len()).step_by(CHUNK) {
        let rows = first..rays.len().min(first + CHUNK);
        let rays = rays.rows(rows.clone());
        let hits = &mut Hits {
            t: &mut answers.t[rows.clone()],
            id: &mut answers.id[rows.clone()],
        };
        if reuse == Reuse::None {
            closest(world, &question.kernels, &rays, hits);
            continue;
        }
        let last = Last {
            reuse,
            t: &last.t[rows.clone()],
            id: &last.id[rows.clone()],
        };
        let bounds = &mut bounds[rows];
        counts.add(&closest_after(
            world,
            &question.kernels,
            &rays,
            &last,
            bounds,
            hits,
        ));
    }
    counts
}
