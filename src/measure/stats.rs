//! The numbers of one run, for `--stats`: plain data, filled along the way.
//!
//! Times are wall-clock seconds, memory is bytes, counts are exact.

use crate::shade::RayCounts;
use crate::trace::GuessCounts;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stats {
    pub picture: PictureSize,
    pub scene: SceneCounts,
    pub plan: PlanSummary,
    /// In the order in which they ran.
    pub stages: Vec<Stage>,
    pub rays: RayCounts,
    /// All kinds, over the stage `render`.
    pub rays_per_second: f64,
    /// Of `render --frames`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<FrameStats>,
    /// Bytes of each table and tree, by name.
    pub memory: BTreeMap<String, u64>,
    /// Of the whole process; null where the system does not tell.
    pub peak_resident_bytes: Option<u64>,
}

/// One frame of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameStats {
    pub frame: u32,
    /// 0 to 1.
    pub time: f64,
    /// `built`, `refitted` or `rebuilt`.
    pub top_tree: &'static str,
    /// These are among the run's, too.
    pub stages: Vec<Stage>,
    pub rays: RayCounts,
    /// Camera rays that began with what they met in the frame before.
    pub guesses: GuessCounts,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    pub name: &'static str,
    pub seconds: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PlanSummary {
    pub precision: &'static str,
    /// Rays per packet.
    pub lanes: u32,
    pub accel: String,
    pub threads: u32,
    /// The widest instruction set compiled in.
    pub isa: &'static str,
    /// What finds the roots of polynomial surfaces in `fast`, where that is not auto: the
    /// solvers that are chosen, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solvers: Vec<&'static str>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PictureSize {
    pub width: u32,
    pub height: u32,
    pub spp: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Shapes after instancing.
    pub appearances: u64,
    /// Stored once each, however often they appear.
    pub shapes: u64,
    pub triangles: u64,
    pub lights: u64,
}

impl Stats {
    /// Seconds of the stage of this name; 0 if it did not run.
    pub fn seconds(&self, stage: &str) -> f64 {
        // Stages may run more than once (several meshes).
        let runs = self.stages.iter().filter(|s| s.name == stage);
        runs.map(|s| s.seconds).sum()
    }

    /// The numbers that follow from others, when all stages have run.
    pub fn finish(&mut self) {
        let seconds = self.seconds("render");
        self.rays_per_second = if seconds > 0.0 {
            self.rays.total() as f64 / seconds
        } else {
            0.0
        };
        self.peak_resident_bytes = peak_resident_bytes();
    }
}

/// Times the stages one after the other.
#[derive(Debug)]
pub struct Watch {
    since: Instant,
}

impl Watch {
    pub fn start() -> Watch {
        Watch {
            since: Instant::now(),
        }
    }

    /// The stage that ran since the last one ended.
    pub fn stage(&mut self, name: &'static str) -> Stage {
        let now = Instant::now();
        let seconds = (now - self.since).as_secs_f64();
        self.since = now;
        Stage { name, seconds }
    }
}

/// The most memory that this process has had at once.
pub fn peak_resident_bytes() -> Option<u64> {
    if cfg!(target_os = "linux") {
        high_water_mark(&std::fs::read_to_string("/proc/self/status").ok()?)
    } else {
        None
    }
}

/// Lets [`peak_resident_bytes`] begin anew from what is held now; false where
/// the system does not (it is Linux's `clear_refs`), and the peak stays that of
/// the whole run.
pub fn restart_peak_resident() -> bool {
    cfg!(target_os = "linux") && std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// `VmHWM:     1234 kB` in a process's status.
fn high_water_mark(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::CacheCounts;

    #[test]
    fn rates_follow_from_the_render_stage() {
        let mut stats = Stats::default();
        for (name, seconds) in [("load", 9.0), ("render", 1.5), ("render", 0.5)] {
            stats.stages.push(Stage { name, seconds });
        }
        let tile = RayCounts {
            primary: 10,
            primary_hits: 7,
            shadow: 20,
            shadow_occluded: 3,
            shadow_cache: CacheCounts { tries: 5, hits: 2 },
            reflection: 4,
            refraction: 6,
        };
        stats.rays.add(&tile);
        stats.rays.add(&tile);
        assert_eq!(stats.rays.primary_hits, 14);
        assert_eq!(stats.rays.shadow_occluded, 6);
        assert_eq!(stats.rays.shadow_cache, CacheCounts { tries: 10, hits: 4 });
        stats.finish();
        assert_eq!(stats.rays_per_second, 40.0);
    }

    #[test]
    fn nothing_rendered_is_no_infinite_rate() {
        let mut stats = Stats::default();
        stats.finish();
        assert_eq!(stats.rays_per_second, 0.0);
    }

    #[test]
    fn high_water_mark_of_a_status_file() {
        let status = "Name:\tx\nVmPeak:\t  99 kB\nVmHWM:\t    1234 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(high_water_mark(status), Some(1234 * 1024));
        assert_eq!(high_water_mark("VmHWM: 12"), None);
        assert_eq!(high_water_mark(""), None);
        if cfg!(target_os = "linux") {
            assert!(peak_resident_bytes().is_some_and(|n| n > 100_000));
        }
    }
}
