//! The figures of a run, with the field names of `bench --json`.

use super::{Contender, Differences, Tracer};
use crate::clock::best_and_median;
use crate::queries::{Ask, Job};
use crate::ray_kinds::Kind;
use lanecast_engine::accel::Counts;
use lanecast_engine::trace::CacheCounts;
use serde::Serialize;

/// The figures of one job with one contender.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub kind: String,
    /// One of our structures, or a baseline's name.
    pub accel: String,
    /// `tile` or `packet`, or `single` at one lane; for a baseline its function and
    /// setting.
    pub kernel: String,
    pub lanes: usize,
    /// `fast`, `guarded` or `exact`; for a baseline its tests, `fast` or `robust`.
    pub precision: &'static str,
    pub threads: usize,
    pub isa: &'static str,
    /// True for a baseline.
    pub peer: bool,
    pub rays: usize,
    pub hits: usize,
    /// Median over the repetitions, in 10⁶ rays per second; 0 where nothing could be
    /// measured.
    pub mrays_per_s: f64,
    pub mrays_per_s_best: f64,
    /// Traversal steps (a node's boxes, a plane, a cell) made for the ray or for its
    /// packet or tile, divided by the rays; null where the kernels do not count.
    pub nodes_per_ray: Option<f64>,
    /// Leaves visited, counted in the same way.
    pub blocks_per_ray: Option<f64>,
    /// Tests of one ray against one primitive.
    pub tests_per_ray: Option<f64>,
    /// Packet tests that mailboxes saved, since the packet had already tested the
    /// primitive, divided by the rays.
    pub spared_per_ray: Option<f64>,
    /// `on` if any-hit rays first test the last occluder, else `off`; null for other
    /// rays and for baselines.
    pub shadow_cache: Option<&'static str>,
    /// Tries and hits of the shadow cache, divided by the rays.
    pub cache_tries_per_ray: Option<f64>,
    pub cache_hits_per_ray: Option<f64>,
    #[serde(flatten)]
    pub differences: Differences,
}

impl Row {
    pub(super) fn new(
        job: &Job,
        contender: &Contender,
        threads: usize,
        hits: usize,
        differences: Differences,
    ) -> Row {
        Row {
            kind: job.kind.clone(),
            accel: contender.accel.clone(),
            kernel: contender.kernel.clone(),
            lanes: contender.lanes,
            precision: contender.precision,
            threads,
            isa: contender.isa,
            peer: matches!(contender.tracer, Tracer::Baseline(..)),
            rays: job.rays.len(),
            hits,
            mrays_per_s: 0.0,
            mrays_per_s_best: 0.0,
            nodes_per_ray: None,
            blocks_per_ray: None,
            tests_per_ray: None,
            spared_per_ray: None,
            shadow_cache: match (job.ask, &contender.tracer) {
                (Ask::Any, Tracer::Own { caching, .. }) => Some(caching.name()),
                _ => None,
            },
            cache_tries_per_ray: None,
            cache_hits_per_ray: None,
            differences,
        }
    }

    fn per_ray(&self, n: u64) -> Option<f64> {
        (self.rays > 0).then(|| n as f64 / self.rays as f64)
    }

    pub(super) fn cache(&mut self, counts: &CacheCounts) {
        if self.shadow_cache.is_some() {
            self.cache_tries_per_ray = self.per_ray(counts.tries);
            self.cache_hits_per_ray = self.per_ray(counts.hits);
        }
    }

    pub(super) fn count(&mut self, counts: &Counts) {
        self.nodes_per_ray = self.per_ray(counts.nodes);
        self.blocks_per_ray = self.per_ray(counts.leaves);
        self.tests_per_ray = self.per_ray(counts.test_lanes);
        self.spared_per_ray = self.per_ray(counts.spared);
    }

    pub(super) fn time(&mut self, seconds: &[f64]) {
        let (best, median) = best_and_median(seconds);
        if best > 0.0 && self.rays > 0 {
            self.mrays_per_s = self.rays as f64 / median * 1e-6;
            self.mrays_per_s_best = self.rays as f64 / best * 1e-6;
        }
    }

    /// Describes the tracer in a table's row or a bar's label.
    pub fn tracer(&self) -> String {
        if self.peer {
            return self.kernel.clone();
        }
        let Row {
            accel,
            kernel,
            precision,
            lanes,
            ..
        } = self;
        let cache = match self.shadow_cache {
            Some("off") => " uncached",
            _ => "",
        };
        format!("{accel} {kernel} {precision} {lanes}{cache}")
    }
}

/// Our fastest contender beside the baseline's fastest, for one kind of rays.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    pub kind: String,
    pub precision: &'static str,
    /// Row of our contender in `results`.
    pub own: usize,
    /// Row of the baseline's contender in `results`; its kind may be the opposite
    /// direction.
    pub peer: usize,
    /// Ratio of the median rates, ours over the baseline's.
    pub ratio: f64,
}

/// Compares our contenders with the baseline's by kind and precision: `fast` with its
/// fast tests, `guarded` and `exact` with its robust ones. Rays between hits and a
/// point light may be traced in either direction, and the baseline's faster direction
/// counts.
pub fn comparisons(rows: &[Row]) -> Vec<Comparison> {
    let fastest = |wanted: &dyn Fn(&Row) -> bool| {
        let among = rows.iter().enumerate().filter(|(_, row)| wanted(row));
        among
            .max_by(|a, b| a.1.mrays_per_s.total_cmp(&b.1.mrays_per_s))
            .map(|(i, _)| i)
    };
    let to_light = [Kind::Shadow.name(), Kind::LightShadow.name()];
    let same_work = |kind: &str, other: &str| {
        kind == other || to_light.contains(&kind) && to_light.contains(&other)
    };
    let mut seen: Vec<(&str, &str)> = Vec::new();
    let mut all = Vec::new();
    for row in rows.iter().filter(|row| !row.peer) {
        if seen.contains(&(&row.kind, row.precision)) {
            continue;
        }
        seen.push((&row.kind, row.precision));
        let ours = |r: &Row| !r.peer && r.kind == row.kind && r.precision == row.precision;
        let tests = if row.precision == "fast" {
            "fast"
        } else {
            "robust"
        };
        let fair = |r: &Row| r.precision == tests && same_work(&row.kind, &r.kind);
        let theirs = |r: &Row| r.peer && fair(r);
        let (Some(own), Some(peer)) = (fastest(&ours), fastest(&theirs)) else {
            continue;
        };
        let (fast, slow) = (rows[own].mrays_per_s, rows[peer].mrays_per_s);
        if slow > 0.0 {
            all.push(Comparison {
                kind: row.kind.clone(),
                precision: row.precision,
                own,
                peer,
                ratio: fast / slow,
            });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(kind: Kind, peer: bool, precision: &'static str, mrays_per_s: f64) -> Row {
        Row {
            kind: kind.name().into(),
            accel: "a".into(),
            kernel: "k".into(),
            lanes: 1,
            precision,
            threads: 1,
            isa: "",
            peer,
            rays: 1,
            hits: 0,
            mrays_per_s,
            mrays_per_s_best: mrays_per_s,
            nodes_per_ray: None,
            blocks_per_ray: None,
            tests_per_ray: None,
            spared_per_ray: None,
            shadow_cache: None,
            cache_tries_per_ray: None,
            cache_hits_per_ray: None,
            differences: Differences::default(),
        }
    }

    #[test]
    fn the_fastest_meet_and_shadows_go_either_way() {
        let rows = [
            row(Kind::Primary, false, "fast", 30.0),
            row(Kind::Primary, false, "fast", 40.0),
            row(Kind::Primary, false, "exact", 10.0),
            row(Kind::Primary, true, "fast", 20.0),
            row(Kind::Primary, true, "robust", 16.0),
            row(Kind::Shadow, false, "fast", 6.0),
            row(Kind::Shadow, true, "fast", 12.0),
            row(Kind::LightShadow, false, "fast", 24.0),
            row(Kind::LightShadow, true, "fast", 8.0),
            row(Kind::Diffuse, false, "fast", 5.0),
        ];
        let found = comparisons(&rows);
        let ratio = |i: usize| (found[i].own, found[i].peer, found[i].ratio);
        assert_eq!(found.len(), 4);
        assert_eq!(ratio(0), (1, 3, 2.0));
        // Watertight tests against watertight tests.
        assert_eq!(ratio(1), (2, 4, 10.0 / 16.0));
        assert_eq!(ratio(2), (5, 6, 0.5));
        // The baseline's faster direction, against our own.
        assert_eq!(ratio(3), (7, 6, 2.0));
    }
}
