//! Gains from the frame before. Three ways to get a frame's trees are compared: the
//! top-level tree refitted up to a bound on its cost, rebuilt every frame, and
//! everything rebuilt. Camera rays are traced cold and with temporal bounds. Every
//! frame is measured in all ways in turns, so that disturbances of the machine affect
//! all of them alike.

use super::clock::{Clock, best_and_median};
use super::queries::{columns, padded};
use lanecast_engine::accel::{KeptTrees, RefitOutcome, Structure, WORST_REFIT, World};
use lanecast_engine::trace::{
    Depths, HitId, HitIds, Hits, Rays, Reuse, TemporalBounds, TemporalCounts, TraceScratch,
};
use lanecast_io::RaySet;
use lanecast_model::plan::Kernels;
use lanecast_model::scene::{Instances, Scene, SceneError};
use lanecast_picture::render::Progress;
use serde::Serialize;

/// One way to trace the frames' camera rays, through the trees that `render` would use.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    pub reuse: Reuse,
    pub kind: &'static str,
    pub precision: &'static str,
    pub lanes: usize,
    /// Number of frames measured: all but the first.
    pub frames: usize,
    pub rays: u64,
    /// Rate over all frames, each by its median.
    pub mrays_per_s: f64,
    /// Rate relative to the cold rays.
    pub speedup: f64,
    pub temporal_bounds: TemporalCounts,
    /// Number of answers that differ from those of cold rays through trees built for
    /// the frame; must be 0.
    pub mismatches: u64,
}

/// One way to get a frame's trees.
#[derive(Clone, Debug, Serialize)]
pub struct RefitRow {
    pub precision: &'static str,
    /// Bound on the cost of the top-level tree, relative to its cost when it was built;
    /// 0 rebuilds it every frame. `None` rebuilds every tree every frame.
    pub worst: Option<f64>,
    /// Number of frames whose top-level tree was refitted.
    pub refitted: usize,
    /// Milliseconds per frame: for getting the trees, and for tracing the cold camera
    /// rays.
    pub renewal_ms: f64,
    pub trace_ms: f64,
    /// The top-level tree's expected (SAH) cost in the last frame.
    pub sah: f64,
    /// Number of wrong answers, as in [`FrameRow`].
    pub mismatches: u64,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameReport {
    pub results: Vec<FrameRow>,
    pub renewals: Vec<RefitRow>,
}

/// The measurement's input.
pub struct Question<'a> {
    /// Camera rays, the same in every frame.
    pub rays: &'a RaySet,
    pub kernels: Kernels,
    pub precision: &'static str,
    pub frames: u32,
    /// Runs of each measurement.
    pub reps: u32,
    pub clock: Clock,
}

/// Bounds on the cost of the top-level tree; the last entry rebuilds everything. The
/// first is the oracle of the others.
const BOUNDS: [Option<f64>; 8] = [
    Some(0.0),
    Some(1.05),
    Some(1.1),
    Some(1.25),
    Some(1.5),
    Some(2.0),
    Some(f64::MAX),
    None,
];

/// Answers of one frame.
#[derive(Clone, Default)]
struct Answers {
    t: Vec<f64>,
    id: HitIds,
}

impl Answers {
    fn new(rays: usize) -> Answers {
        Answers {
            t: vec![0.0; rays],
            id: HitIds::none(rays),
        }
    }

    /// Counts rows that differ in a significant bit; t of a miss does not count.
    fn mismatches(&self, other: &Answers) -> u64 {
        let row = |answers: &Answers, i: usize| (answers.t[i].to_bits(), answers.id.get(i));
        let differs = |i: &usize| {
            let missed = self.id.get(*i) == HitId::NONE && other.id.get(*i) == HitId::NONE;
            !missed && row(self, *i) != row(other, *i)
        };
        (0..self.id.len()).filter(differs).count() as u64
    }
}

/// Sums of the frames' medians, in seconds.
#[derive(Clone, Copy, Default)]
struct Way {
    outcome: f64,
    trace: f64,
    refitted: usize,
    sah: f64,
    temporal_bounds: TemporalCounts,
    mismatches: u64,
}

/// Runs the measurement on this thread. Returns `None` if cancelled.
pub fn measure(
    mut scene: Scene,
    question: &Question,
    progress: &Progress,
) -> Result<Option<FrameReport>, SceneError> {
    let tiles = padded(question.rays, 0..question.rays.len());
    let rays = columns(&tiles, 0..tiles.len());
    let mut kept: [Option<KeptTrees>; BOUNDS.len()] = Default::default();
    let mut usual: Option<KeptTrees> = None;
    let mut memories = Reuse::ALL.map(TemporalBounds::new);
    let mut scratch = TraceScratch::default();
    let mut answers = Answers::new(rays.len());
    let mut bounds = [Way::default(); BOUNDS.len()];
    let mut reuses = [Way::default(); Reuse::ALL.len()];
    progress.start(question.frames);
    for frame in 0..question.frames {
        if frame > 0 {
            progress.add_tile(0);
        }
        scene = scene.at(f64::from(frame) / f64::from(question.frames.max(2) - 1))?;
        let instances = Instances::of(&scene)?;
        let renew = |kept: Option<KeptTrees>, worst| match kept {
            Some(kept) => World::next(kept, &scene, &instances, Structure::Bvh, worst),
            None => {
                let world = World::build(&scene, &instances, Structure::Bvh);
                (world, RefitOutcome::Built)
            }
        };
        if frame == 0 {
            let (world, _) = renew(None, 0.0);
            for memory in &mut memories {
                ask(&world, question, &rays, memory, &mut answers, &mut scratch);
            }
            let first = world.keep();
            kept = std::array::from_fn(|_| Some(first.clone()));
            usual = Some(first);
            continue;
        }
        let mut cold = Answers::new(rays.len());
        let mut seconds: [[Vec<f64>; 2]; BOUNDS.len()] = Default::default();
        let mut next: [Option<KeptTrees>; BOUNDS.len()] = Default::default();
        for rep in 0..question.reps {
            for (i, bound) in BOUNDS.into_iter().enumerate() {
                if progress.is_cancelled() {
                    return Ok(None);
                }
                let before = kept[i].clone().filter(|_| bound.is_some());
                let worst = bound.unwrap_or_default();
                let ((world, outcome), spent) = question.clock.time(|| renew(before, worst));
                seconds[i][0].push(spent);
                let mut memory = TemporalBounds::new(Reuse::None);
                let (_, spent) = question.clock.time(|| {
                    ask(
                        &world,
                        question,
                        &rays,
                        &mut memory,
                        &mut answers,
                        &mut scratch,
                    )
                });
                seconds[i][1].push(spent);
                if rep > 0 {
                    continue;
                }
                if i == 0 {
                    cold.clone_from(&answers);
                }
                bounds[i].mismatches += cold.mismatches(&answers);
                bounds[i].refitted += usize::from(outcome == RefitOutcome::Refitted);
                bounds[i].sah = world.accelerator.tlas_figures().sah;
                next[i] = Some(world.keep());
            }
        }
        kept = next;
        for (way, [outcome, trace]) in bounds.iter_mut().zip(&seconds) {
            way.outcome += best_and_median(outcome).1;
            way.trace += best_and_median(trace).1;
        }

        let (world, _) = renew(usual.take(), WORST_REFIT);
        let mut seconds: [Vec<f64>; Reuse::ALL.len()] = Default::default();
        let mut after = memories.clone();
        for rep in 0..question.reps {
            for (i, seconds) in seconds.iter_mut().enumerate() {
                if progress.is_cancelled() {
                    return Ok(None);
                }
                let mut memory = memories[i].clone();
                let (counts, spent) = question.clock.time(|| {
                    ask(
                        &world,
                        question,
                        &rays,
                        &mut memory,
                        &mut answers,
                        &mut scratch,
                    )
                });
                seconds.push(spent);
                if rep == 0 {
                    reuses[i].temporal_bounds.add(&counts);
                    reuses[i].mismatches += cold.mismatches(&answers);
                }
                after[i] = memory;
            }
        }
        memories = after;
        for (way, seconds) in reuses.iter_mut().zip(&seconds) {
            way.trace += best_and_median(seconds).1;
        }
        usual = Some(world.keep());
    }
    let frames = question.frames.saturating_sub(1) as usize;
    let count = question.rays.len();
    let row = |(reuse, way): (Reuse, &Way)| FrameRow {
        reuse,
        kind: "primary",
        precision: question.precision,
        lanes: question.kernels.lanes,
        frames,
        rays: count as u64,
        mrays_per_s: (count * frames) as f64 / way.trace.max(f64::MIN_POSITIVE) * 1e-6,
        speedup: reuses[0].trace / way.trace.max(f64::MIN_POSITIVE),
        temporal_bounds: way.temporal_bounds,
        mismatches: way.mismatches,
    };
    let per_frame = |seconds: f64| seconds * 1e3 / frames.max(1) as f64;
    let outcome = |(worst, way): (Option<f64>, &Way)| RefitRow {
        precision: question.precision,
        worst,
        refitted: way.refitted,
        renewal_ms: per_frame(way.outcome),
        trace_ms: per_frame(way.trace),
        sah: way.sah,
        mismatches: way.mismatches,
    };
    Ok(Some(FrameReport {
        results: Reuse::ALL.into_iter().zip(&reuses).map(row).collect(),
        renewals: BOUNDS.into_iter().zip(&bounds).map(outcome).collect(),
    }))
}

/// Rays per chunk, which stays in the second-level cache.
const CHUNK: usize = 2048;

fn ask(
    world: &World,
    question: &Question,
    rays: &Rays,
    memory: &mut TemporalBounds,
    answers: &mut Answers,
    scratch: &mut TraceScratch,
) -> TemporalCounts {
    let mut counts = TemporalCounts::default();
    for first in (0..rays.len()).step_by(CHUNK) {
        let rows = first..rays.len().min(first + CHUNK);
        let mut hits = Hits {
            t: Depths::Double(&mut answers.t),
            id: answers.id.columns(),
        };
        let hits = &mut hits.rows(rows.clone());
        let rays = rays.rows(rows);
        let kernels = &question.kernels;
        counts.add(&memory.closest(world, kernels, &rays, first, hits, scratch));
    }
    counts
}
