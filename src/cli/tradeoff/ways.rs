//! The ways to render a scene that `tradeoff` compares: what the scene has, and no more.

use lanecast_light::sampler::Kind as SamplerKind;
use lanecast_model::plan::{Accel, LaneCount, Precision, native_width};
use lanecast_model::scene::{Instances, Scene, Shape};
use lanecast_numerics::roots::Solver;
use lanecast_picture::render::{Adaptive, Exposure, IndirectCaching, Integrator, RenderConfig};

/// The most primitives that a picture is rendered of without a tree: a second or so at the size of the
/// measurement.
const MOST_LISTED: u64 = 1024;

/// One way: a choice, the options that ask for it, and the configuration.
pub struct Way {
    pub choice: &'static str,
    pub options: String,
    pub config: RenderConfig,
    /// Whether its camera rays may meet other things than those of the scene's own way.
    pub changes_rays: bool,
    /// Whether the picture is the denoised one.
    pub is_denoised: bool,
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
            is_denoised: false,
        });
    }
}

/// Lists the ways to render a scene as `base` does, which is the first of them; with those that a
/// denoiser takes part in, if there is one.
pub fn ways(
    (scene, instances): (&Scene, &Instances),
    base: &RenderConfig,
    denoises: bool,
) -> Vec<Way> {
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
    structures(&mut ways, (scene, instances), paths);
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
            let option = format!("--max-bounces {depth}");
            ways.add("depth", &option, |c| c.max_depth = depth);
        }
        caches(&mut ways);
    }
    if denoises && base.integrator == Integrator::Path {
        denoised(&mut ways);
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
}

/// Structures and widths of packets, whose pictures are alike: of paths with few samples, beside
/// those of the scene's own structure.
fn structures(ways: &mut Ways, (scene, instances): (&Scene, &Instances), paths: bool) {
    let (spp, few) = match paths {
        true => (4, " --spp 4"),
        false => (ways.base.spp, ""),
    };
    let primitives = primitives(scene, instances);
    for accel in Accel::ALL {
        // A list tries all things for every ray, and item buffers are for camera rays.
        let is_slow = accel == Accel::Linear && primitives > MOST_LISTED;
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

/// Returns how many triangles and other shapes a ray may meet.
fn primitives(scene: &Scene, instances: &Instances) -> u64 {
    let counts = instances.of_shapes(scene);
    let of_shape = |(shape, count): (&Shape, u64)| match shape {
        Shape::Mesh(id) => count.saturating_mul(scene.meshes.row(*id).triangles.len() as u64),
        _ => count,
    };
    let each = scene.shapes.rows.iter().zip(counts).map(of_shape);
    each.fold(0, u64::saturating_add)
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

/// Pictures of few and of the scene's own number of samples, freed of their noise.
fn denoised(ways: &mut Ways) {
    let own = ways.base.spp;
    for spp in [4, 16, own] {
        let few = match spp == own {
            true => String::new(),
            false => format!("--spp {spp} "),
        };
        ways.add("denoising", &format!("{few}--denoise"), |c| c.spp = spp);
        if let Some(way) = ways.all.last_mut() {
            way.is_denoised = true;
        }
    }
}
