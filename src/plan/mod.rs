//! What a scene requires, and nothing else.
//!
//! [`plan`] looks at the tables and at what was asked for, and chooses the
//! kernels (monomorphised over [`Needs`], precision and width) and the
//! structure that finds primitives. Every choice carries its reason, which
//! `lanecast plan` prints. It builds nothing and allocates next to nothing.

mod choices;
mod coplanar;
mod logic;
mod solids;
mod stacked;

pub use choices::{Choices, LaneCount, Precision};
pub use solids::{remarks, searched, solved, unbounded};
pub use stacked::stacked;

use crate::scene::{Appearances, Scene, SceneError, Shape};
use thiserror::Error;

/// What the kernels of a query must be able to do for this scene; what they
/// need not is compiled out of their loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    pub meshes: bool,
    /// Shapes that are one primitive.
    pub solids: bool,
    /// Some appearance's object space is not world space.
    pub transforms: bool,
}

/// The numbers that rays are traced in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arithmetic {
    F32,
    /// f32 where its error bounds let it decide, else exact arithmetic.
    F32Guarded,
    /// f64 with the same bounds.
    #[default]
    F64,
    /// f32, with every decision made by exact arithmetic, by one lane or a register's:
    /// what the others are compared with, not for users.
    F32DoubtingAll,
}

/// The choice among monomorphised kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernels {
    pub arithmetic: Arithmetic,
    /// Rays per packet; one of [`widths`].
    pub lanes: usize,
    pub needs: Needs,
}

/// Which structure finds the primitives.
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

    /// As the command line and the reports call it.
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

#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub kernels: Kernels,
    pub accel: Accel,
    /// (what, choice, why), in the order of the choices.
    pub reasons: Vec<(&'static str, String, String)>,
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    #[error(
        "packets of {asked} rays are not in this build (it has {}); \
         build with --features all-lanes for every width",
        list(built)
    )]
    LanesNotBuilt { asked: usize, built: Vec<usize> },
    #[error("--accel {accel}: {source}; bvh keeps a tree for each shared node instead")]
    TooManyAppearances {
        accel: &'static str,
        source: SceneError,
    },
}

fn list(widths: &[usize]) -> String {
    let words: Vec<String> = widths.iter().map(usize::to_string).collect();
    words.join(" and ")
}

/// Whether this build has every width.
pub(crate) const ALL_LANES: bool = cfg!(feature = "all-lanes");

/// The packet widths that this build can trace with, rising.
pub fn widths(arithmetic: Arithmetic) -> Vec<usize> {
    if ALL_LANES {
        vec![1, 4, 8, 16]
    } else {
        vec![1, native_width(arithmetic)]
    }
}

/// The machine's own width: one register, at least four lanes.
pub const fn native_width(arithmetic: Arithmetic) -> usize {
    let bits = if cfg!(target_feature = "avx512f") {
        512
    } else if cfg!(target_feature = "avx") {
        256
    } else {
        128
    };
    match arithmetic {
        Arithmetic::F64 if bits < 256 => 4,
        Arithmetic::F64 => bits / 64,
        _ => bits / 32,
    }
}

pub fn plan(
    scene: &Scene,
    appearances: &Appearances,
    choices: &Choices,
) -> Result<Plan, PlanError> {
    let mut reasons = Vec::new();
    let needs = needs(scene, appearances, &mut reasons);
    let arithmetic = match choices.precision {
        Precision::Fast => Arithmetic::F32,
        Precision::Guarded => Arithmetic::F32Guarded,
        Precision::Exact => Arithmetic::F64,
    };
    let (numbers, why) = match choices.precision {
        Precision::Fast => ("f32", "asked for: fastest, a few rays in a million wrong"),
        Precision::Guarded => (
            "f32",
            "guarded: what a ray meets is what exact arithmetic says",
        ),
        Precision::Exact => (
            "f64",
            "exact: what a ray meets is what exact arithmetic says",
        ),
    };
    reasons.push(("arithmetic", numbers.into(), why.into()));

    let native = native_width(arithmetic);
    let lanes = choices.lanes.count().unwrap_or(native);
    let built = widths(arithmetic);
    if !built.contains(&lanes) {
        return Err(PlanError::LanesNotBuilt {
            asked: lanes,
            built,
        });
    }
    let why = match choices.lanes {
        LaneCount::Auto => format!("one register of {numbers}"),
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
    let nested = accel == Accel::Bvh && !appearances.are_laid_out();
    if !nested {
        let too_many = |source| PlanError::TooManyAppearances {
            accel: accel.name(),
            source,
        };
        appearances.check_enumerable().map_err(too_many)?;
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
            arithmetic,
            lanes,
            needs,
        },
        accel,
        reasons,
    })
}

fn needs(
    scene: &Scene,
    appearances: &Appearances,
    reasons: &mut Vec<(&'static str, String, String)>,
) -> Needs {
    let (mut meshes, mut solids) = (0, 0);
    for (shape, count) in scene.shapes.rows.iter().zip(appearances.of_shapes(scene)) {
        match shape {
            Shape::Mesh(_) => meshes += count,
            _ => solids += count,
        }
    }
    let placed = appearances.placed(scene);
    let mut say = |what, count: u64, yes: &str, no: &str| {
        let (choice, why) = if count > 0 {
            ("in", yes)
        } else {
            ("left out", no)
        };
        reasons.push((what, choice.into(), format!("{count} {why}")));
    };
    say(
        "mesh kernel",
        meshes,
        "appearances of meshes",
        "meshes appear",
    );
    say(
        "solid kernels",
        solids,
        "appearances of single primitives",
        "single primitives appear",
    );
    say(
        "transforms",
        placed,
        "appearances are not in world space",
        "appearances have a transform of their own",
    );
    Needs {
        meshes: meshes > 0,
        solids: solids > 0,
        transforms: placed > 0,
    }
}
