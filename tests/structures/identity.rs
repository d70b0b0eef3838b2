//! Compares every structure, kernel and width with one lane of `exact`, over the rays of
//! pictures. In `guarded` and `exact` all bits agree; in `fast` the rays that differ are
//! counted. The table of docs/IDENTITY.md:
//!
//! ```text
//! cargo test --release --test structures -- identity --ignored --nocapture
//! ```

use crate::common::{Loaded, assets, load, structures};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::io::RaySet;
use lanecast::internals::measure::queries::{Answers, Ask, trace};
use lanecast::internals::measure::ray_kinds::{Kind, Order};
use lanecast::internals::measure::rays::{Source, direction_of, light_of, ray_sets};
use lanecast::internals::plan::{Kernels, Precision, widths};
use lanecast::internals::render::{Grid, Progress};
use lanecast::internals::trace::{Caching, HitId, ItemBuffer};

/// From one origin and in one direction (as tiles), to a light (as streams) and
/// from it and along its direction (as tiles), and one diffuse bounce.
const KINDS: [Kind; 6] = [
    Kind::Primary,
    Kind::Ortho,
    Kind::Shadow,
    Kind::LightShadow,
    Kind::Directional,
    Kind::Diffuse,
];

/// Five meshes, the Standard Procedural Databases at their published sizes, and
/// shapes that appear often.
const SCENES: [&str; 14] = [
    "meshes/dragon_202k.glb",
    "meshes/armadillo_86k.glb",
    "meshes/bunny_69k.glb",
    "meshes/beast_65k.glb",
    "meshes/cube_subdiv_96k.glb",
    "spd/balls_4.nff",
    "spd/gears_4.nff",
    "spd/mount_6.nff",
    "spd/rings_7.nff",
    "spd/teapot_12.nff",
    "spd/tetra_6.nff",
    "spd/tree_11.nff",
    "gltf/many-cubes/many-cubes.gltf",
    "gltf/2CylinderEngine/2CylinderEngine.glb",
];

/// Roundings of f32 by which t may be off in `fast` before a ray counts.
const ULPS: u64 = 16;

/// Rays whose answers differ, by what is different first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Differing {
    /// One hits or is blocked, and the other is not.
    found: usize,
    /// Another primitive.
    id: usize,
    /// The same primitive, more than [`ULPS`] away.
    t: usize,
}

impl Differing {
    fn of(expected: &Answers, got: &Answers) -> Differing {
        let mut all = Differing::default();
        let blocked = expected.blocked.iter().zip(&got.blocked);
        all.found += blocked.filter(|(a, b)| a != b).count();
        for i in 0..expected.id.len() {
            let (a, b) = (expected.id.get(i), got.id.get(i));
            if (a == HitId::NONE) != (b == HitId::NONE) {
                all.found += 1;
            } else if a != b {
                all.id += 1;
            } else if a != HitId::NONE && ulps(expected.t[i], got.t[i]) > ULPS {
                all.t += 1;
            }
        }
        all
    }

    /// Per million rays: hit or miss, id, t.
    fn cell(&self, rays: usize) -> String {
        let per_million = |n: usize| n as f64 * 1e6 / rays as f64;
        let [found, id, t] = [self.found, self.id, self.t].map(per_million);
        format!("{found:.0} / {id:.0} / {t:.0}")
    }
}

/// Of two distances along a ray.
fn ulps(a: f32, b: f32) -> u64 {
    u64::from(a.to_bits().abs_diff(b.to_bits()))
}

/// Whether all bits agree, of what means anything.
fn same(a: &Answers, b: &Answers) -> bool {
    let bits = |answers: &Answers| -> Vec<Option<u32>> {
        let hits = answers.id.iter().zip(&answers.t);
        hits.map(|(id, t)| (id != HitId::NONE).then(|| t.to_bits()))
            .collect()
    };
    a.id == b.id && a.blocked == b.blocked && bits(a) == bits(b)
}

/// Every so-many-th ray.
fn thinned(rays: &RaySet, step: usize) -> RaySet {
    rays.select((0..rays.len()).step_by(step))
}

fn primitives(loaded: &Loaded) -> usize {
    let scene = &loaded.scene;
    let rows = loaded.instances.iter(scene);
    let of = |shape| match scene.shapes.row(shape) {
        lanecast::internals::scene::Shape::Mesh(id) => scene.meshes.row(id).triangles.len(),
        _ => 1,
    };
    rows.map(|row| of(row.shape)).sum()
}

/// What a scene's rays of one kind say: their number, and those of `fast` that
/// differ.
struct Row {
    kind: Kind,
    rays: usize,
    tiles: Differing,
    /// Of camera rays alone; the others take the trees.
    items: Option<Differing>,
    /// And streams.
    packets: Differing,
}

/// Compares everything; `tests`: those that a linear scan may take for each kind
/// of rays, at each width.
fn compare(name: &str, loaded: &Loaded, side: u32, tests: usize) -> Vec<Row> {
    let progress = Progress::default();
    let bvh = loaded.world(Structure::Bvh);
    let exact = Kernels {
        lanes: 1,
        ..loaded.kernels(Precision::Exact)
    };
    let light = light_of(&bvh, &loaded.camera);
    let source = Source {
        world: &bvh,
        kernels: exact,
        camera: loaded.camera,
        grid: Grid::Corners,
        size: [side, side],
        order: Order::Tile,
        light,
        direction: direction_of(&bvh, light),
    };
    let sets = ray_sets(&source, &KINDS, &progress).unwrap();
    let answers = |world: &World, kernels: &Kernels, rays: &RaySet, ask: Ask| {
        let mut answers = Answers::default();
        let ask = (ask, Caching::On);
        trace(world, kernels, rays, ask, &mut answers, &progress).unwrap();
        answers
    };
    let mut rows = Vec::new();
    // Of each kind: the exact answers; those of tiles and of packets in `fast`.
    let mut expected: Vec<Answers> = Vec::new();
    let [mut tiles, mut packets] = [const { [const { None }; KINDS.len()] }; 2];
    for (kind, rays) in KINDS.iter().zip(&sets) {
        expected.push(answers(&bvh, &exact, rays, kind.ask()));
        rows.push(Row {
            kind: *kind,
            rays: rays.len(),
            tiles: Differing::default(),
            items: None,
            packets: Differing::default(),
        });
    }
    let primitives = primitives(loaded);
    let mut structures = structures().to_vec();
    structures.push(Structure::ItemBuffer);
    // The linear scan, which takes only some of the rays, is compared with others.
    structures.rotate_left(1);
    for structure in structures {
        let world = loaded.world(structure);
        if structure == Structure::ItemBuffer {
            let ray = |i: usize| Some((sets[0].org(i).map(f64::from), sets[0].dir(i)));
            let lists = ItemBuffer::of_rays(&world, sets[0].len(), ray);
            assert!(lists.is_some_and(|lists| !lists.is_empty()), "{name}");
        }
        for (number, (kind, rays)) in KINDS.iter().zip(&sets).enumerate() {
            let step = match structure {
                Structure::Linear => (rays.len() * primitives).div_ceil(tests).max(1),
                _ => 1,
            };
            let some = thinned(rays, step);
            let thin = |answers: &Answers| Answers {
                t: answers.t.iter().step_by(step).copied().collect(),
                id: answers.id.iter().step_by(step).collect(),
                blocked: answers.blocked.iter().step_by(step).copied().collect(),
            };
            let what = |kernels: &Kernels| format!("{name}, {kind:?}: {structure:?}, {kernels:?}");
            for lanes in widths() {
                let kernels = Kernels { lanes, ..exact };
                let got = answers(&world, &kernels, &some, kind.ask());
                assert!(same(&thin(&expected[number]), &got), "{}", what(&kernels));
            }
            // Of this structure, where its arithmetic is like no other's.
            let mut own: Option<Answers> = None;
            for lanes in widths() {
                let kernels = Kernels {
                    precision: Precision::Fast,
                    lanes,
                };
                let got = answers(&world, &kernels, &some, kind.ask());
                let row = &mut rows[number];
                let differing = || {
                    assert_eq!(step, 1, "a linear scan is not the first");
                    Differing::of(&expected[number], &got)
                };
                let like: &mut Option<Answers> = match structure {
                    Structure::ItemBuffer if *kind == Kind::Primary => {
                        row.items = Some(differing());
                        &mut own
                    }
                    // Tiles decide by other arithmetic, at every width alike.
                    Structure::Bvh | Structure::ItemBuffer => {
                        row.tiles = differing();
                        &mut tiles[number]
                    }
                    _ => {
                        if packets[number].is_none() {
                            row.packets = differing();
                        }
                        &mut packets[number]
                    }
                };
                let like = like.get_or_insert_with(|| got.clone());
                assert!(same(&thin(like), &got), "{}", what(&kernels));
            }
        }
    }
    rows
}

const HEADER: &str =
    "| scene | rays | number | exact | fast: wide trees | fast: item buffer | fast: all others |
|---|---|---|---|---|---|---|";

fn print(name: &str, rows: &[Row]) {
    for row in rows {
        let [tiles, packets] = [row.tiles, row.packets].map(|d| d.cell(row.rays));
        let items = row.items.map_or("–".into(), |d| d.cell(row.rays));
        let kind = row.kind.name();
        let rays = row.rays;
        println!("| {name} | {kind} | {rays} | 0 | {tiles} | {items} | {packets} |");
    }
}

fn stem(path: &str) -> &str {
    let name = path.rsplit('/').next().unwrap_or(path);
    name.split('.').next().unwrap_or(name)
}

/// Small enough for every day.
#[test]
fn all_structures_and_kernels_agree() {
    let Some(assets) = assets() else { return };
    for file in [
        "meshes/suzanne_1k.glb",
        "spd/tetra_4.nff",
        "spd/balls_2.nff",
        "spd/tree_5.nff",
        "gltf/many-cubes/many-cubes.gltf",
    ] {
        let loaded = load(&assets.join(file), 1.0);
        let rows = compare(stem(file), &loaded, 65, 20_000_000);
        print(stem(file), &rows);
        for row in rows {
            let few = |d: &Differing| (d.found + d.id) * 500 <= row.rays;
            let all = [Some(row.tiles), row.items, Some(row.packets)];
            assert!(all.iter().flatten().all(few), "{file}, {:?}", row.kind);
            assert_eq!(row.items.is_some(), row.kind == Kind::Primary);
        }
    }
}

/// Four million rays a way: some minutes.
#[test]
#[ignore = "prints the table of docs/IDENTITY.md, in some minutes"]
fn the_table() {
    let Some(assets) = assets() else { return };
    println!("{HEADER}");
    for file in SCENES {
        let loaded = load(&assets.join(file), 1.0);
        let rows = compare(stem(file), &loaded, 513, 50_000_000);
        print(stem(file), &rows);
    }
}
