//! Statistics of one run, for `--stats`: plain data, filled as the run proceeds.
//!
//! Times are wall-clock seconds, memory is in bytes, counts are exact.

use super::InstanceNames;
use lanecast_engine::trace::TemporalCounts;
use lanecast_picture::render::CacheCounts;
use lanecast_picture::shade::RayCounts;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stats {
    pub picture: PictureSize,
    pub scene: SceneCounts,
    /// What the ids of pictures stand for.
    pub instance_names: InstanceNames,
    pub plan: PlanSummary,
    /// Stages in the order in which they ran.
    pub stages: Vec<Stage>,
    pub rays: RayCounts,
    /// Rays of all kinds per second of the stage `render`.
    pub rays_per_second: f64,
    /// The denoised picture beside the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoised: Option<Denoised>,
    /// Records of a cache of indirect light; of `--frames` each frame has its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<CacheCounts>,
    /// Frames of `render --frames`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<FrameStats>,
    /// Bytes of each table and tree, by name.
    pub memory: BTreeMap<String, u64>,
    /// Peak of the whole process; null where the system does not provide it.
    pub peak_resident_bytes: Option<u64>,
}

/// What a denoised picture is made by.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Denoised {
    /// Name and version.
    pub library: String,
    /// Whether it has one set of bits on all machines, as the first picture has.
    pub has_equal_bits: bool,
}

/// Statistics of one frame of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrameStats {
    pub frame: u32,
    /// Animation time, 0 to 1.
    pub time: f64,
    /// `built`, `refitted` or `rebuilt`.
    pub top_tree: &'static str,
    /// Stages of this frame, which the run's stages include.
    pub stages: Vec<Stage>,
    pub rays: RayCounts,
    /// Camera rays that started with temporal bounds.
    pub temporal_bounds: TemporalCounts,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<CacheCounts>,
    /// What `--noise` came to: the mean of samples a pixel, and the share of the picture that is noisier
    /// than was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_spp: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noisy: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stage {
    pub name: &'static str,
    pub seconds: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PlanSummary {
    pub precision: &'static str,
    /// Number of rays per packet.
    pub lanes: u32,
    pub accel: String,
    pub threads: u32,
    /// The widest instruction set compiled in.
    pub isa: &'static str,
    /// Names of the chosen root finders of polynomial surfaces in `fast`; empty if all
    /// are auto.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solvers: Vec<&'static str>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PictureSize {
    pub width: u32,
    pub height: u32,
    /// Samples of a pixel, at the most.
    pub spp: u32,
    /// Samples of a pixel in the mean, where their number was adaptive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_spp: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Number of instances of shapes.
    pub instances: u64,
    /// Number of shapes, each stored once however often it is instanced.
    pub shapes: u64,
    pub triangles: u64,
    pub lights: u64,
}

impl Stats {
    /// Returns the seconds of all stages with this name; 0 if none ran.
    pub fn seconds(&self, stage: &str) -> f64 {
        // Stages may run more than once (several meshes).
        let runs = self.stages.iter().filter(|s| s.name == stage);
        runs.map(|s| s.seconds).sum()
    }

    /// Computes the derived statistics once all stages have run.
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

/// A clock that times consecutive stages.
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

    /// Ends the stage that began when the previous one ended.
    pub fn stage(&mut self, name: &'static str) -> Stage {
        let now = Instant::now();
        let seconds = (now - self.since).as_secs_f64();
        self.since = now;
        Stage { name, seconds }
    }
}

/// Returns the process's peak resident memory.
pub fn peak_resident_bytes() -> Option<u64> {
    if cfg!(target_os = "linux") {
        high_water_mark(&std::fs::read_to_string("/proc/self/status").ok()?)
    } else {
        None
    }
}

/// Resets the peak of [`peak_resident_bytes`] to the current memory, by Linux's
/// `clear_refs`. Returns false where the system does not support that; the peak then
/// remains that of the whole run.
pub fn restart_peak_resident() -> bool {
    cfg!(target_os = "linux") && std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// Parses the line `VmHWM:     1234 kB` of a process's status.
fn high_water_mark(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanecast_engine::trace::CacheCounts;

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
