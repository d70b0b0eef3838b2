//! The plan: what a scene requires, and nothing else.
//!
//! [`plan`] reads the tables and the user's choices. It chooses the kernels, by precision
//! and width, and the structure that finds primitives. Every choice carries its reason,
//! which `lanecast plan` prints. Planning builds nothing and allocates next to nothing. The
//! lints of scenes are in `lint`.

mod choices;
mod lint;

pub use choices::{Choices, LaneCount, Precision};
pub use lint::{remarks, searched, solved, spindle, stacked, unbounded};

use crate::scene::{Instances, Scene, SceneError, Shape};
use thiserror::Error;

/// The choice among the kernels that are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernels {
    pub precision: Precision,
    /// Rays per packet; one of [`widths`].
    pub lanes: usize,
}

/// The structure that finds primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accel {
    Bvh,
    Kd,
    Grid,
    Heap,
    HeapSpheres,
    Linear,
    ItemBuffer,
}

impl Accel {
    pub const ALL: [Accel; 7] = [
        Accel::Bvh,
        Accel::Kd,
        Accel::Grid,
        Accel::Heap,
        Accel::HeapSpheres,
        Accel::Linear,
        Accel::ItemBuffer,
    ];

    /// The name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Accel::Bvh => "bvh",
            Accel::Kd => "kd",
            Accel::Grid => "grid",
            Accel::Heap => "heap",
            Accel::HeapSpheres => "heap-spheres",
            Accel::Linear => "linear",
            Accel::ItemBuffer => "item-buffer",
        }
    }
}

/// The kernels and the structure for a scene, with the reasons.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub kernels: Kernels,
    pub accel: Accel,
    /// The subject, the choice and the reason, in the order of the choices.
    pub reasons: Vec<(&'static str, String, String)>,
}

/// A choice that this build or this scene does not allow.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    #[error(
        "packets of {asked} rays are not in this build (it has {}); \
         build with --features all-lanes for every width",
        list(built)
    )]
    LanesNotBuilt { asked: usize, built: Vec<usize> },
    #[error("--accel {accel}: {source}; bvh keeps a tree for each shared node instead")]
    TooManyInstances {
        accel: &'static str,
        source: SceneError,
    },
}

fn list(widths: &[usize]) -> String {
    let words: Vec<String> = widths.iter().map(usize::to_string).collect();
    words.join(" and ")
}

/// Which bits this program gives pictures: raised whenever the same scene gets others, for finished
/// pictures of batches, parts of pictures and records of light are taken for those of this program by
/// it. `.ci/answers` holds a table of pictures to it.
pub const BITS: u32 = 3;

/// Whether this build has every packet width.
pub const ALL_LANES: bool = cfg!(feature = "all-lanes");

/// Lists the packet widths that this build can trace with, in rising order.
pub fn widths() -> Vec<usize> {
    if ALL_LANES {
        vec![1, 4, 8, 16]
    } else {
        vec![1, native_width()]
    }
}

/// Returns the machine's own width: the f32 lanes of one register, at least four.
pub const fn native_width() -> usize {
    if cfg!(target_feature = "avx512f") {
        16
    } else if cfg!(target_feature = "avx") {
        8
    } else {
        4
    }
}

/// Chooses the kernels and the structure for a scene.
pub fn plan(scene: &Scene, instances: &Instances, choices: &Choices) -> Result<Plan, PlanError> {
    let mut reasons = contents(scene, instances);
    let why = match choices.precision {
        Precision::Fast => "asked for: fastest, a few rays in a million wrong",
        Precision::Guarded => "guarded: what a ray meets is what exact arithmetic says",
        Precision::Exact => "exact: guarded, and each t is the f64 nearest to the exact one",
    };
    reasons.push(("arithmetic", "f32".into(), why.into()));

    let native = native_width();
    let lanes = choices.lanes.count().unwrap_or(native);
    let built = widths();
    if !built.contains(&lanes) {
        return Err(PlanError::LanesNotBuilt {
            asked: lanes,
            built,
        });
    }
    let why = match choices.lanes {
        LaneCount::Auto => "one register of f32".into(),
        _ => "asked for".into(),
    };
    reasons.push(("rays per packet", lanes.to_string(), why));

    let accel = choices.accel.unwrap_or(Accel::Bvh);
    let why = match choices.accel {
        None => "the fastest structure for most scenes measured",
        Some(Accel::Linear) => "asked for: every primitive is tested",
        Some(Accel::ItemBuffer) => {
            "asked for; rays that do not leave a pinhole camera take the bvh"
        }
        Some(_) => "asked for",
    };
    let nested = accel == Accel::Bvh && !instances.are_laid_out();
    if !nested {
        let too_many = |source| PlanError::TooManyInstances {
            accel: accel.name(),
            source,
        };
        instances.check_enumerable().map_err(too_many)?;
    }
    let name = match accel {
        Accel::Bvh if nested => "bvh (SAH, a tree for each node)",
        Accel::Bvh => "bvh (SAH, a node as wide as a register, two levels)",
        Accel::Kd => "k-d tree (SAH, two levels)",
        Accel::Grid => "uniform grid (two levels in dense cells, tagging)",
        Accel::Heap => "best-first heap over boxes (SAH, 4-wide)",
        Accel::HeapSpheres => "best-first heap over spheres (SAH, 4-wide)",
        Accel::Linear => "linear",
        Accel::ItemBuffer => "item buffer (blocks of triangles binned to tiles of rays)",
    };
    reasons.push(("structure", name.into(), why.into()));
    Ok(Plan {
        kernels: Kernels {
            precision: choices.precision,
            lanes,
        },
        accel,
        reasons,
    })
}

/// Says whether instances place meshes outside world space. For these, temporal bounds on t
/// pay (docs/decisions/018-temporal-bounds.md).
pub fn places_meshes(scene: &Scene, instances: &Instances) -> bool {
    let mut counts = scene.shapes.rows.iter().zip(instances.of_shapes(scene));
    let has_meshes = counts.any(|(shape, count)| matches!(shape, Shape::Mesh(_)) && count > 0);
    has_meshes && instances.placed(scene) > 0
}

/// Lists which kernels the scene needs and which are left out, with counts.
fn contents(scene: &Scene, instances: &Instances) -> Vec<(&'static str, String, String)> {
    let (mut meshes, mut solids) = (0, 0);
    for (shape, count) in scene.shapes.rows.iter().zip(instances.of_shapes(scene)) {
        match shape {
            Shape::Mesh(_) => meshes += count,
            _ => solids += count,
        }
    }
    let placed = instances.placed(scene);
    let say = |what, count: u64, yes: &str, no: &str| {
        let (choice, why) = if count > 0 {
            ("in", yes)
        } else {
            ("left out", no)
        };
        (what, choice.into(), format!("{count} {why}"))
    };
    vec![
        say(
            "mesh kernel",
            meshes,
            "instances of meshes",
            "meshes appear",
        ),
        say(
            "solid kernels",
            solids,
            "instances of single primitives",
            "single primitives appear",
        ),
        say(
            "transforms",
            placed,
            "instances are not in world space",
            "instances have a transform of their own",
        ),
    ]
}
