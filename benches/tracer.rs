//! Loads or builds a scene, traces a batch of rays, asks for surfaces, lists spans, and renders
//! with a line per tile: the stable interface, and nothing else. Run it with
//! `cargo run --release --example tracer -- scenes/csg_bracket.toml`.

use lanecast::shapes::Sphere;
use lanecast::{
    DVec3, Edge, Error, Light, LoadOptions, Material, Progress, RayBatch, RenderConfig, Scene,
    SceneBuilder, Tracer, TracerOptions, load,
};
use std::path::Path;

fn main() -> Result<(), Error> {
    let scene = match std::env::args().nth(1) {
        Some(path) => load(Path::new(&path), &LoadOptions::default())?.scene,
        None => two_balls()?,
    };
    let tracer = Tracer::new(&scene, &TracerOptions::default())?;

    // A fan of rays, whose answers come in columns.
    let mut rays = RayBatch::default();
    let fan = (-8..=8).map(|i| DVec3::new(f64::from(i) / 16.0, 0.0, -1.0));
    rays.extend(fan.map(|dir| (DVec3::new(0.0, 1.0, 6.0), dir)));
    let hits = tracer.closest(&rays);
    let hit = (0..hits.len()).filter_map(|row| hits.get(row)).count();
    println!("{hit} of {} rays hit something", rays.len());

    // One ray, and what it passes through.
    let (org, dir) = rays.ray(8);
    if let Some(hit) = tracer.closest_one(org, dir) {
        let name = tracer.instance_name(hit.instance).unwrap_or_default();
        println!("the middle one hits {name} at t = {}", hit.t);
    }
    let surfaces = tracer.surfaces(&rays, &hits)?;
    let material = surfaces.material[8].and_then(|id| tracer.material_name(id));
    println!(
        "there at {} with the normal {}, of the material {}",
        surfaces.point[8],
        surfaces.shading_normal[8],
        material.as_deref().unwrap_or("default")
    );
    for span in tracer.solids()?.spans(org, dir).rows {
        let (from, to) = (span.t_enter(), span.t_exit());
        println!(
            "it is inside instance {} from {from} to {to}",
            span.instance
        );
    }

    // A picture, a line for each tile as it is done.
    let config = RenderConfig {
        width: 320,
        height: 240,
        ..RenderConfig::default()
    };
    let picture = tracer.render(&config, &Progress::default(), &|tile| {
        println!(
            "{}x{} pixels at {}, {}",
            tile.width, tile.height, tile.x, tile.y
        );
    })?;
    let path = std::env::temp_dir().join("lanecast-example.png");
    picture.save(&path)?;
    println!("{}", path.display());
    Ok(())
}

fn two_balls() -> Result<Scene, Error> {
    let mut scene = SceneBuilder::default();
    let red = scene.material(
        "red",
        Material::metallic_roughness([0.8, 0.1, 0.1], 0.0, 0.5),
    );
    for (x, radius) in [(-0.8, 1.0), (1.0, 0.8)] {
        let center = DVec3::new(x, radius, 0.0);
        let ball = scene.sphere("", Sphere { center, radius });
        scene.instance("", Edge::shape(ball).material(red));
    }
    scene.light(Light::Directional {
        direction: DVec3::new(1.0, -1.0, -0.5),
        irradiance: [2.0; 3],
        angle: 0.0,
    });
    Ok(scene.finish()?)
}
