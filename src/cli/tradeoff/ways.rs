//! The ways to render a scene that `tradeoff` compares: what the scene has, and no more.

use crate::light::filter::Kind as FilterKind;
use crate::light::sampler::Kind as SamplerKind;
use crate::plan::{Accel, LaneCount, Precision, native_width};
use crate::render::{Adaptive, Exposure, IndirectCaching, Integrator, RenderConfig};
use crate::roots::Solver;
use crate::scene::{Instances, Scene};

/// One way: a choice, the options that ask for it, and the configuration.
pub struct Way {
    pub choice: &'static str,
    pub options: String,
    pub config: RenderConfig,
    /// Whether its camera rays may meet other things than those of the scene's own way.
    pub changes_rays: bool,
}

/// Ways by what they vary from the scene's own way.
struct Ways<'a> {
    base: &'a RenderConfig,
    all: Vec<Way>,
}

impl Ways<'_> {
    fn add(&mut self, choice: &'static str, options: &str, change: impl FnOnce(&mut RenderConfig)) {
        let mut config = self.base.clone();
        change(&mut config);
        let changes_rays = config.choices != self.base.choices || config.solver.is_some();
        let options = options.to_owned();
        self.all.push(Way {
            choice,
            options,
            config,
            changes_rays,
        });
    }
}

/// Lists the ways to render a scene as `base` does, which is the first of them.
pub fn ways(scene: &Scene, instances: &Instances, base: &RenderConfig) -> Vec<Way> {
    let mut ways = Ways {
        base,
        all: Vec::new(),
    };
    ways.add("own", "", |_| ());
    let paths = matches!(base.integrator, Integrator::Path | Integrator::Ao);
    samples(&mut ways, paths);
    for precision in [Precision::Fast, Precision::Exact] {
        let option = format!("--precision {}", precision.name());
        ways.add("precision", &option, |c| c.choices.precision = precision);
    }
    if paths {
        for spp in [4, 16] {
            let option = format!("--precision fast --spp {spp}");
            ways.add("precision", &option, |c| {
                c.choices.precision = Precision::Fast;
                c.spp = spp;
            });
        }
    }
    structures(&mut ways, instances, paths);
    if !scene.implicits.is_empty() {
        let solvers = Solver::ALL.iter().filter(|solver| **solver != Solver::Auto);
        for solver in solvers {
            let option = format!("--precision fast --solver {}", solver.name());
            // A solver that cannot take a surface of the scene is left out.
            if scene.clone().solved_by(*solver).is_ok() {
                ways.add("solver", &option, |c| {
                    c.choices.precision = Precision::Fast;
                    c.solver = Some(*solver);
                });
            }
        }
    }
    if base.integrator == Integrator::Path {
        for depth in [1, 2, 4, 8] {
            let option = format!("--max-depth {depth}");
            ways.add("depth", &option, |c| c.max_depth = depth);
        }
        caches(&mut ways);
    }
    if let Some(exposure) = base.shutter {
        for slices in [4, 16, 64] {
            let option = format!("--shutter-slices {slices}");
            let shutter = Some(Exposure { slices, ..exposure });
            ways.add("shutter", &option, |c| c.shutter = shutter);
        }
    }
    ways.all
}

/// Numbers of samples, and where they lie.
fn samples(ways: &mut Ways, paths: bool) {
    let own = ways.base.spp;
    for spp in [1, 4, 16, 64, 256] {
        let few_enough = paths || spp <= 16 || ways.base.shutter.is_some();
        if spp != own && few_enough {
            ways.add("samples", &format!("--spp {spp}"), |c| c.spp = spp);
        }
    }
    if !paths {
        return;
    }
    for noise in [0.1, 0.03] {
        let option = format!("--noise {noise} --max-spp 256");
        ways.add("samples", &option, |c| {
            c.adaptive = Some(Adaptive { noise, most: 256 });
            c.spp = 256;
        });
    }
    for (name, sampler) in [
        ("independent", SamplerKind::Independent),
        ("stratified", SamplerKind::Stratified),
    ] {
        ways.add("sampler", &format!("--sampler {name}"), |c| {
            c.sampler = sampler
        });
    }
    for (name, filter) in [
        ("box", FilterKind::Box),
        ("gaussian", FilterKind::Gaussian),
        ("mitchell", FilterKind::Mitchell),
    ] {
        ways.add("filter", &format!("--filter {name}"), |c| c.filter = filter);
    }
}

/// Structures and widths of packets, whose pictures are alike: of paths with few samples, beside
/// those of the scene's own structure.
fn structures(ways: &mut Ways, instances: &Instances, paths: bool) {
    let (spp, few) = match paths {
        true => (4, " --spp 4"),
        false => (ways.base.spp, ""),
    };
    for accel in Accel::ALL {
        // A list tries all things for every ray, and item buffers are for camera rays.
        let is_slow = accel == Accel::Linear && instances.count() > 64;
        let is_own = accel == Accel::Bvh;
        if !is_own && !is_slow && instances.are_laid_out() {
            let option = format!("--accel {}{few}", accel.name());
            ways.add("structure", &option, |c| {
                c.choices.accel = Some(accel);
                c.spp = spp;
            });
        }
    }
    if native_width() > 1 {
        ways.add("lanes", &format!("--lanes 1{few}"), |c| {
            c.choices.lanes = LaneCount::One;
            c.spp = spp;
        });
    }
}

fn caches(ways: &mut Ways) {
    if ways.base.shutter.is_some() {
        return;
    }
    for error in [0.2, 0.4] {
        for spp in [16, 64] {
            let option = format!("--cache irradiance --cache-error {error} --spp {spp}");
            ways.add("cache", &option, |c| {
                c.spp = spp;
                c.caching = Some(IndirectCaching {
                    is_unbiased: false,
                    error,
                });
            });
        }
    }
    ways.add("cache", "--cache unbiased", |c| {
        c.caching = Some(IndirectCaching {
            is_unbiased: true,
            error: 0.2,
        });
    });
}
