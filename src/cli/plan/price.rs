//! `plan --measure`: what it saves to leave out what a scene lacks.
//!
//! Of each thing that is missing, one is added that is too small to be met by more than a ray by
//! chance, in a corner of the scene's box, and the picture is rendered with it and without it, in
//! turns. What it takes more is what the scene does not pay.

use crate::error::CliError;
use crate::pipeline::{Prepared, complete};
use glam::DVec3;
use lanecast_engine::accel::World;
use lanecast_io::LoadError;
use lanecast_measure::tradeoff::median;
use lanecast_measure::{Stats, Watch};
use lanecast_model::geom::{Sphere, implicit::torus};
use lanecast_model::scene::{
    Edge, Instances, Material, MeshData, Operand, Operator, Pattern, Scene, SceneBuilder, Shape,
    ShapeId, Tables, Texturing, framed_bounds,
};
use lanecast_numerics::math::Affine;
use lanecast_picture::render::{Integrator, Progress, RenderConfig, View, render};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// Pictures with each thing and without.
const TURNS: usize = 5;

/// The size of what is added, as a part of the diagonal of the scene's box.
const SPECK: f64 = 1e-7;

/// What one thing would cost that the scene lacks.
#[derive(Debug, Serialize)]
pub struct Price {
    pub what: &'static str,
    /// Median seconds of the picture with one of it.
    pub seconds: f64,
    /// The median of the ratios to the picture without it, of the same turn.
    pub ratio: f64,
    /// The least and the largest of these ratios: where 1 lies between them, no difference was seen.
    pub range: [f64; 2],
    /// Bytes of tables and trees with one of it, less those without.
    pub bytes: i64,
}

/// The things that a scene may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Thing {
    Mesh,
    Primitive,
    Polynomial,
    Csg,
    Transform,
    Glass,
    Holes,
    Texture,
}

impl Thing {
    const ALL: [(Thing, &str); 8] = [
        (Thing::Mesh, "meshes"),
        (Thing::Primitive, "single primitives"),
        (Thing::Polynomial, "polynomial surfaces"),
        (Thing::Csg, "CSG solids"),
        (Thing::Transform, "transforms"),
        (Thing::Glass, "transmission"),
        (Thing::Holes, "opacity below 1"),
        (Thing::Texture, "textures"),
    ];

    fn is_in(self, scene: &Tables, instances: &Instances) -> bool {
        let counts = instances.of_shapes(scene);
        let instanced = |is: &dyn Fn(&Shape) -> bool| {
            let rows = scene.shapes.rows.iter().zip(&counts);
            rows.into_iter()
                .any(|(shape, count)| *count > 0 && is(shape))
        };
        let materials = &scene.materials.rows;
        match self {
            Thing::Mesh => instanced(&|shape| matches!(shape, Shape::Mesh(_))),
            Thing::Primitive => {
                instanced(&|shape| !matches!(shape, Shape::Mesh(_) | Shape::Csg(_)))
            }
            Thing::Polynomial => {
                instanced(&|shape| matches!(shape, Shape::Implicit(_) | Shape::LevelSet(_)))
            }
            Thing::Csg => instanced(&|shape| matches!(shape, Shape::Csg(_))),
            Thing::Transform => instances.placed(scene) > 0,
            Thing::Glass => materials.iter().any(|m| m.transmission > 0.0),
            Thing::Holes => materials.iter().any(|m| m.layers.opacity < 1.0),
            Thing::Texture => !scene.textures.is_empty(),
        }
    }

    /// Adds one of it; `has_meshes` says of which shape it is where any would do.
    fn add(self, builder: &mut SceneBuilder, (place, size): (DVec3, f64), has_meshes: bool) {
        let sphere = Sphere {
            center: place,
            radius: size,
        };
        let moved = |linear, place: DVec3| Affine::new(linear, place.to_array());
        let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let any = |builder: &mut SceneBuilder| match has_meshes {
            true => triangle(builder, place, size),
            false => builder.sphere("", sphere),
        };
        let of_material = |builder: &mut SceneBuilder, material: Material| {
            let material = builder.material("", material);
            let shape = any(builder);
            builder.instance("", Edge::shape(shape).material(material));
            material
        };
        match self {
            Thing::Mesh => {
                let shape = triangle(builder, place, size);
                builder.instance("", Edge::shape(shape));
            }
            Thing::Primitive => {
                let shape = builder.sphere("", sphere);
                builder.instance("", Edge::shape(shape));
            }
            Thing::Polynomial => {
                let tape = torus::tape_of(size, size / 4.0);
                let shape = builder.implicit("", tape, false, None);
                let transform = builder.transform(moved(unit, place));
                builder.instance("", Edge::shape(shape).transform(transform));
            }
            Thing::Csg => {
                let bite = Sphere {
                    center: place + DVec3::X * size,
                    radius: size,
                };
                let operands = [sphere, bite].map(|row| Operand::shape(builder.sphere("", row)));
                let shape = builder.csg("", Operator::Difference, &operands);
                builder.instance("", Edge::shape(shape));
            }
            Thing::Transform => {
                let shape = match has_meshes {
                    true => triangle(builder, DVec3::ZERO, size),
                    false => builder.sphere(
                        "",
                        Sphere {
                            center: DVec3::ZERO,
                            radius: size,
                        },
                    ),
                };
                // A turn by arctan 3/4 about y.
                let turn = [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]];
                let transform = builder.transform(moved(turn, place));
                builder.instance("", Edge::shape(shape).transform(transform));
            }
            Thing::Glass => {
                let glass = Material {
                    transmission: 1.0,
                    ior: 1.5,
                    ..Material::default()
                };
                of_material(builder, glass);
            }
            Thing::Holes => {
                let mut veil = Material::default();
                veil.layers.opacity = 0.5;
                of_material(builder, veil);
            }
            Thing::Texture => {
                let material = of_material(builder, Material::default());
                let pattern = builder.pattern(Pattern::Checker {
                    colors: [[0.2; 3], [0.8; 3]],
                    size: [size; 3],
                });
                let texturing = Texturing {
                    base_color: Some(pattern),
                    ..Texturing::default()
                };
                builder.texture(material, texturing, &[]);
            }
        }
    }
}

fn triangle(builder: &mut SceneBuilder, place: DVec3, size: f64) -> ShapeId {
    let corners = [place, place + DVec3::X * size, place + DVec3::Y * size];
    let data = MeshData {
        positions: corners.map(|p| p.to_array()).to_vec(),
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    builder.mesh("", &data)
}

/// A scene that is ready to be rendered.
struct Ready {
    what: &'static str,
    prepared: Prepared,
    world: World,
    seconds: Vec<f64>,
}

impl Ready {
    fn new(
        scene: Scene,
        what: &'static str,
        (path, config): (&Path, &RenderConfig),
    ) -> Result<Ready, CliError> {
        let (mut watch, mut stats) = (Watch::start(), Stats::default());
        let prepared = complete(scene, path, config, &mut watch, &mut stats)?;
        let world = prepared.world(&mut watch, &mut stats);
        Ok(Ready {
            what,
            prepared,
            world,
            seconds: Vec::new(),
        })
    }

    fn render(&mut self, config: &RenderConfig, progress: &Progress) -> Result<(), CliError> {
        let view = View {
            world: &self.world,
            kernels: self.prepared.plan.kernels,
            camera: self.prepared.camera,
            lights: &self.prepared.scene.lights,
        };
        let begin = Instant::now();
        self.prepared
            .pool
            .install(|| render(&view, config, false, progress))?;
        self.seconds.push(begin.elapsed().as_secs_f64());
        Ok(())
    }

    fn bytes(&self) -> i64 {
        let tables = self.prepared.scene.bytes();
        let of_tables: usize = tables.into_iter().map(|(_, bytes)| bytes).sum();
        let of_trees: usize = self.world.bytes().into_iter().map(|(_, bytes)| bytes).sum();
        (of_tables + of_trees) as i64
    }
}

/// Measures what each thing would cost that the scene lacks. The scene is as it was loaded, and
/// seen by the first camera that `config` names. Also returns the seconds of its own picture.
pub fn prices(
    scene: &Scene,
    (path, config): (&Path, &RenderConfig),
) -> Result<(f64, Vec<Price>), CliError> {
    let config = &RenderConfig {
        // Enough for a time that can be told from another, at any machine.
        spp: match config.integrator {
            Integrator::Path => 16,
            _ => 4,
        },
        ..config.clone()
    };
    // A signal ends `plan` at once.
    let progress = Progress::default();
    let of_scene = |source| LoadError::of_scene(path, source);
    let instances = Instances::of(scene).map_err(of_scene)?;
    let Some(bounds) = framed_bounds(scene, &instances) else {
        return Err(CliError::Usage(
            "--measure puts things beside those of the scene, which has no bounds; leave it out"
                .into(),
        ));
    };
    let place = (bounds.min, bounds.diagonal() * SPECK);
    let has_meshes = Thing::Mesh.is_in(scene, &instances);
    let mut all = vec![Ready::new(scene.clone(), "", (path, config))?];
    for (thing, what) in Thing::ALL {
        if thing.is_in(scene, &instances) {
            continue;
        }
        let mut builder = SceneBuilder::from(scene.clone());
        thing.add(&mut builder, place, has_meshes);
        let with = builder.finish().map_err(of_scene)?;
        all.push(Ready::new(with, what, (path, config))?);
    }
    for _ in 0..TURNS {
        for ready in &mut all {
            ready.render(config, &progress)?;
        }
    }
    let own = &all[0];
    let prices = all[1..].iter().map(|ready| {
        let pairs = ready.seconds.iter().zip(&own.seconds);
        let ratios: Vec<f64> = pairs.map(|(with, without)| with / without).collect();
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let most = ratios.iter().copied().fold(0.0, f64::max);
        Price {
            what: ready.what,
            seconds: median(ready.seconds.clone()).0,
            ratio: median(ratios).0,
            range: [least, most],
            bytes: ready.bytes() - own.bytes(),
        }
    });
    Ok((median(own.seconds.clone()).0, prices.collect()))
}
