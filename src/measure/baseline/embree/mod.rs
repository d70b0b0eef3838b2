//! Embree 3 as a baseline: its trees, query modes and answers, measured in the same
//! run.
//!
//! A [`Tree`] is one build of the triangles: an instruction set, a build quality, and
//! fast or robust tests. Each tree is queried in every mode that Embree offers
//! ([`Mode`]: single rays, packets, streams, with and without the coherent flag); the
//! best mode for a set of rays is measured, not assumed.
//!
//! Input ([`RaySet`](lanecast_io::RaySet)) and output
//! ([`Answers`](crate::queries::Answers)) are those of our kernels. Embree
//! requires denormals to be flushed to zero while it builds and traces, which [`trace`]
//! does.
//!
//! Instances and other shapes are not supported: the triangles are flattened.

mod ffi;
mod trace;

use crate::baseline::{BaselineError, BaselineTests};
use crate::clock::Clock;
use crate::index_stats::StructureRow;
use crate::queries::{Answers, Ask};
use ffi::Handle;
use lanecast_io::{RaySet, TriangleSet};
use lanecast_picture::render::Progress;
use std::ffi::{CString, c_void};
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quality {
    Medium,
    /// Builds with spatial splits.
    High,
}

impl Quality {
    const ALL: [Quality; 2] = [Quality::Medium, Quality::High];

    fn name(self) -> &'static str {
        match self {
            Quality::Medium => "medium",
            Quality::High => "high",
        }
    }

    fn code(self) -> u32 {
        match self {
            Quality::Medium => 1,
            Quality::High => 2,
        }
    }
}

/// One way to query a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mode {
    call: Call,
    /// The context's coherent flag.
    coherent: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Call {
    /// One ray per call.
    Single,
    /// A packet of 4, 8 or 16 rays per call.
    Packet(usize),
    /// A stream of that many single rays per call.
    Stream(usize),
    /// A stream of that many packets of 16 rays per call.
    PacketStream(usize),
}

impl Mode {
    fn all() -> impl Iterator<Item = Mode> {
        let calls = [
            Call::Single,
            Call::Packet(4),
            Call::Packet(8),
            Call::Packet(16),
            Call::Stream(64),
            Call::Stream(1024),
            Call::PacketStream(4),
            Call::PacketStream(64),
        ];
        let flags = [false, true];
        calls
            .into_iter()
            .flat_map(move |call| flags.map(|coherent| Mode { call, coherent }))
    }

    /// Returns the name of Embree's function, with the sizes that we choose.
    fn name(self, ask: Ask) -> String {
        let verb = match ask {
            Ask::Closest => "Intersect",
            Ask::Any => "Occluded",
        };
        let call = match self.call {
            Call::Single => "1".into(),
            Call::Packet(n) => n.to_string(),
            Call::Stream(m) => format!("1M {m}"),
            Call::PacketStream(m) => format!("NM 16x{m}"),
        };
        let flag = if self.coherent { " coherent" } else { "" };
        format!("{verb}{call}{flag}")
    }
}

/// Bytes held by Embree, as its memory monitor reports them.
#[derive(Default)]
struct Memory {
    now: AtomicIsize,
    peak: AtomicIsize,
}

/// Memory monitor: Embree calls it before it allocates (`bytes` > 0) and after it
/// frees.
extern "C" fn monitor(memory: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: the pointer is the `Memory` of a `Tree`, in an allocation of its own that
    // outlives Embree's device, and is only shared, never changed but by atomics.
    let memory = unsafe { &*memory.cast::<Memory>() };
    let now = memory.now.fetch_add(bytes, Ordering::Relaxed) + bytes;
    memory.peak.fetch_max(now, Ordering::Relaxed);
    true
}

/// The triangles in a layout that Embree may share: 16 readable bytes at the last
/// vertex.
struct Buffers {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Buffers {
    fn new(set: &TriangleSet) -> Arc<Buffers> {
        let mut positions = set.positions.clone();
        positions.push([0.0; 3]);
        Arc::new(Buffers {
            positions,
            triangles: set.triangles.clone(),
        })
    }
}

/// One of Embree's trees.
struct Tree {
    triangles: usize,
    /// Bytes held after the build: nodes and leaves, not the shared triangles.
    bytes: u64,
    /// The most that Embree held during the build.
    peak_bytes: u64,
    scene: Handle,
    device: Handle,
    _memory: Arc<Memory>,
    _buffers: Arc<Buffers>,
}

// SAFETY: a committed scene is only read; Embree allows queries on it from any
// number of threads, and its handles are not bound to the thread that made them.
unsafe impl Send for Tree {}
// SAFETY: as above; no method changes anything.
unsafe impl Sync for Tree {}

impl Tree {
    /// Builds on that many threads, the calling one included.
    fn build(
        buffers: &Arc<Buffers>,
        Setting {
            isa,
            quality,
            tests,
        }: Setting,
        threads: usize,
    ) -> Result<Tree, BaselineError> {
        let config = format!("threads={threads},isa={isa}");
        let text = CString::new(config.clone()).unwrap_or_default();
        let memory = Arc::<Memory>::default();
        let (vertices, triangles) = (buffers.positions.len() - 1, buffers.triangles.len());
        // SAFETY: the calls are those of the header, in the order that it asks
        // for, on handles that it returned (a null device is left alone). The
        // shared buffers hold so many rows of twelve bytes, with the padding
        // that Embree wants behind the last vertex, and live as long as the
        // scene, as does the monitor's `Memory`. Handles are released once: here
        // the geometry, which the scene keeps; the others by `drop`.
        let (tree, error) = unsafe {
            let device = ffi::rtcNewDevice(text.as_ptr());
            if device.is_null() {
                let code = ffi::rtcGetDeviceError(device);
                return Err(BaselineError::Device { config, code });
            }
            let user = Arc::as_ptr(&memory).cast_mut().cast();
            ffi::rtcSetDeviceMemoryMonitorFunction(device, Some(monitor), user);
            let geometry = ffi::rtcNewGeometry(device, ffi::TRIANGLES);
            let share = |kind, format, data: *const c_void, count| {
                ffi::rtcSetSharedGeometryBuffer(geometry, kind, 0, format, data, 0, 12, count);
            };
            let (corners, indices) = (buffers.positions.as_ptr(), buffers.triangles.as_ptr());
            share(ffi::VERTEX_BUFFER, ffi::FLOAT3, corners.cast(), vertices);
            share(ffi::INDEX_BUFFER, ffi::UINT3, indices.cast(), triangles);
            ffi::rtcSetGeometryBuildQuality(geometry, quality.code());
            ffi::rtcCommitGeometry(geometry);
            let scene = ffi::rtcNewScene(device);
            if tests == BaselineTests::Robust {
                ffi::rtcSetSceneFlags(scene, ffi::ROBUST);
            }
            ffi::rtcSetSceneBuildQuality(scene, quality.code());
            ffi::rtcAttachGeometry(scene, geometry);
            ffi::rtcReleaseGeometry(geometry);
            trace::flushing_denormals(|| ffi::rtcCommitScene(scene));
            let tree = Tree {
                triangles,
                bytes: memory.now.load(Ordering::Relaxed).max(0) as u64,
                peak_bytes: memory.peak.load(Ordering::Relaxed).max(0) as u64,
                scene,
                device,
                _memory: memory,
                _buffers: buffers.clone(),
            };
            (tree, ffi::rtcGetDeviceError(device))
        };
        match error {
            0 => Ok(tree),
            code => Err(BaselineError::Build { config, code }),
        }
    }

    /// Returns the version in Embree's encoding: 31305 is 3.13.5.
    fn version(&self) -> u32 {
        // SAFETY: the device lives; property 0 is the version.
        unsafe { ffi::rtcGetDeviceProperty(self.device, 0) as u32 }
    }
}

impl Drop for Tree {
    fn drop(&mut self) {
        // SAFETY: both handles are owned by this tree and released once; the
        // monitor's memory is dropped after them.
        unsafe {
            ffi::rtcReleaseScene(self.scene);
            ffi::rtcReleaseDevice(self.device);
        }
    }
}

/// Returns the instruction sets of this processor that are compared.
fn isas() -> Vec<&'static str> {
    let mut isas = Vec::new();
    if std::is_x86_feature_detected!("avx2") {
        isas.push("avx2");
    }
    // Embree's own list for AVX-512: Skylake's set.
    let skylake = std::is_x86_feature_detected!("avx512f")
        && std::is_x86_feature_detected!("avx512cd")
        && std::is_x86_feature_detected!("avx512dq")
        && std::is_x86_feature_detected!("avx512bw")
        && std::is_x86_feature_detected!("avx512vl");
    if skylake {
        isas.push("avx512");
    }
    isas
}

/// All trees of one set of triangles.
pub struct Embree {
    buffers: Arc<Buffers>,
    threads: usize,
    trees: Vec<Build>,
}

/// The parameters of a tree's build.
#[derive(Clone, Copy)]
struct Setting {
    isa: &'static str,
    quality: Quality,
    tests: BaselineTests,
}

impl Setting {
    /// Returns a name such as `avx2 medium` or `avx2 medium robust`.
    fn name(&self) -> String {
        let Setting {
            isa,
            quality,
            tests,
        } = self;
        let robust = match tests {
            BaselineTests::Fast => "",
            BaselineTests::Robust => " robust",
        };
        format!("{isa} {}{robust}", quality.name())
    }
}

/// A setting, its tree, and the seconds that each of its builds took.
struct Build {
    setting: Setting,
    tree: Option<Tree>,
    seconds: Vec<f64>,
}

/// One tree and one mode of querying it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    tree: usize,
    mode: Mode,
}

impl Embree {
    /// Prepares a tree for each of `tests`, instruction set and quality;
    /// [`build`](Self::build) builds them.
    pub fn new(
        set: &TriangleSet,
        tests: &[BaselineTests],
        threads: usize,
    ) -> Result<Embree, BaselineError> {
        let isas = isas();
        if isas.is_empty() {
            return Err(BaselineError::Processor);
        }
        let mut trees = Vec::new();
        for tests in tests {
            for isa in &isas {
                trees.extend(Quality::ALL.map(|quality| Build {
                    setting: Setting {
                        isa,
                        quality,
                        tests: *tests,
                    },
                    tree: None,
                    seconds: Vec::new(),
                }));
            }
        }
        Ok(Embree {
            buffers: Buffers::new(set),
            threads,
            trees,
        })
    }

    /// Rebuilds every tree, timed; the older tree is dropped first.
    pub fn build(&mut self, clock: Clock) -> Result<(), BaselineError> {
        for build in &mut self.trees {
            build.tree = None;
            let run = || Tree::build(&self.buffers, build.setting, self.threads);
            let (tree, seconds) = clock.time(run);
            build.tree = Some(tree?);
            build.seconds.push(seconds);
        }
        Ok(())
    }

    /// Returns the figures of the trees that are built.
    pub fn index_stats(&self) -> Vec<StructureRow> {
        let row = |build: &Build| {
            let tree = build.tree.as_ref()?;
            let bytes = tree.bytes as usize;
            let name = format!("embree3 {}", build.setting.name());
            let mut row = StructureRow::new(name, tree.triangles as u64, bytes, &build.seconds);
            row.build_peak_bytes = Some(tree.peak_bytes);
            row.version = Some(tree.version());
            Some(row)
        };
        self.trees.iter().filter_map(row).collect()
    }

    /// Returns every mode of every built tree with these tests.
    pub fn ways(&self, tests: BaselineTests) -> Vec<Way> {
        let built = |i: &usize| {
            let build = &self.trees[*i];
            build.setting.tests == tests && build.tree.is_some()
        };
        (0..self.trees.len())
            .filter(built)
            .flat_map(|tree| Mode::all().map(move |mode| Way { tree, mode }))
            .collect()
    }

    /// Returns a name such as `embree3 Intersect8 coherent avx2 medium`.
    pub fn name(&self, way: Way, ask: Ask) -> String {
        let setting = self.trees[way.tree].setting.name();
        format!("embree3 {} {setting}", way.mode.name(ask))
    }

    pub fn isa(&self, way: Way) -> &'static str {
        self.trees[way.tree].setting.isa
    }

    /// Traces all rays on the current rayon pool. Returns `None` if cancelled.
    pub fn trace(
        &self,
        way: Way,
        rays: &RaySet,
        ask: Ask,
        answers: &mut Answers,
        progress: &Progress,
    ) -> Option<()> {
        let tree = self.trees[way.tree].tree.as_ref()?;
        tree.trace(way.mode, rays, ask, answers, progress)
    }
}

impl Way {
    /// Returns the number of rays per packet.
    pub fn lanes(self) -> usize {
        match self.mode.call {
            Call::Single | Call::Stream(_) => 1,
            Call::Packet(lanes) => lanes,
            Call::PacketStream(_) => 16,
        }
    }
}
