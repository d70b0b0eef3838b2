//! Haines' Standard Procedural Databases at the size of the published figures: one ray through
//! each corner of a 512×512 grid. The number of rays that hit anything is an invariant of the
//! scene (Havran and Sixta, 1999).

use crate::common::{Loaded, assets, load};
use lanecast::internals::accel::{Density, KdQuality, Structure, World};
use lanecast::internals::plan::Precision;
use lanecast::internals::render::{AovSet, Grid, RenderConfig};
use serde_json::Value;
use std::path::Path;

/// File, name in the tables, primary hits published, and by how many rays ours
/// may differ: mount and tree have edges and seams that rays go through.
const SCENES: [(&str, &str, u64, u64); 7] = [
    ("balls_4", "balls", 263_169, 0),
    ("gears_4", "gears", 245_332, 0),
    ("mount_6", "mount", 173_685, 2),
    ("rings_7", "rings", 263_169, 0),
    ("teapot_12", "teapot", 161_546, 0),
    ("tetra_6", "tetra", 49_950, 0),
    ("tree_11", "tree", 169_907, 2),
];

fn corners() -> RenderConfig {
    RenderConfig {
        width: 513,
        height: 513,
        grid: Grid::Corners,
        ..RenderConfig::default()
    }
}

/// Primary hits, and each ray's hit; no ray is cast from them.
fn primary(loaded: &Loaded, world: &World, precision: Precision) -> (u64, Vec<Option<(u64, u32)>>) {
    let config = RenderConfig {
        max_depth: 0,
        aovs: AovSet {
            depth: true,
            instance_id: true,
            primitive_id: true,
            ..AovSet::default()
        },
        ..corners()
    };
    let rendered = loaded.render(world, loaded.kernels(precision), &[], &config);
    let picture = rendered.picture;
    let (instance, primitive) = (picture.instance_id.unwrap(), picture.primitive_id.unwrap());
    let hits = picture.depth.unwrap().into_iter().enumerate();
    let hits = hits.map(|(i, depth)| depth.is_finite().then(|| (instance[i], primitive[i])));
    (rendered.counts.primary_hits, hits.collect())
}

#[test]
fn primary_hits_are_the_published_ones() {
    let Some(assets) = assets() else { return };
    let published = published(&assets);
    for (file, name, expected, allowed) in SCENES {
        let loaded = load(&assets.join(format!("spd/{file}.nff")), 1.0);
        let world = loaded.world(Structure::Bvh);
        let (count, exact) = primary(&loaded, &world, Precision::Exact);
        let (_, fast) = primary(&loaded, &world, Precision::Fast);
        assert_eq!(exact.iter().flatten().count() as u64, count);
        let both = || exact.iter().zip(&fast);
        let covers = both().filter(|(e, f)| e.is_some() != f.is_some()).count();
        let ids = both().filter(|(e, f)| e != f).count() - covers;
        println!(
            "{file}: {count} primary hits, {expected} published; \
             fast: {covers} rays hit or miss otherwise, {ids} hit another primitive"
        );
        assert!(count.abs_diff(expected) <= allowed, "{file}: {count}");
        for structure in [
            Structure::Kd(KdQuality::default()),
            Structure::Grid(Density::default()),
            Structure::Heap,
            Structure::HeapSpheres,
            Structure::ItemBuffer,
        ] {
            let world = loaded.world(structure);
            let (_, seen) = primary(&loaded, &world, Precision::Exact);
            assert!(seen == exact, "{file}: {structure:?} sees something else");
        }
        assert!((covers + ids) * 1000 < exact.len(), "{file}");

        let config = corners();
        let kernels = loaded.kernels(Precision::Exact);
        let counts = loaded.render(&world, kernels, &loaded.scene.lights, &config);
        let counts = counts.counts;
        let (haines, havran) = (
            &published["haines_readme"][name],
            &published["havran_1999_golem"][name],
        );
        println!(
            "    shadow rays {} (Haines {}, Havran {}), blocked {} (Havran {}), \
             mirrored {} and refracted {} (Haines {} and {}, Havran {} together)",
            counts.shadow,
            haines["shadow"],
            havran["shadow"],
            counts.shadow_occluded,
            havran["shadow_hit"],
            counts.reflection,
            counts.refraction,
            haines["reflect"],
            haines["refract"],
            havran["secondary"],
        );
    }
}

fn published(assets: &Path) -> Value {
    let text = std::fs::read(assets.join("spd/published_statistics.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}
