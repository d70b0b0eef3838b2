//! `lanecast plan`: reports what a scene requires, and the choices made for it.

mod light;
mod price;

use super::args::{PlanArgs, VERIFY_SIZE, needed_integrator};
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use super::pipeline::{Prepared, complete, load, named, of_camera};
use super::scene::{pick_camera, viewed};
use lanecast_engine::accel::{TlasEntry, World};
use lanecast_measure::{InstanceNames, Stats, Watch};
use lanecast_model::plan::{remarks, searched, solved, spindle, stacked, unbounded};
use lanecast_model::scene::{Shape, ShapeId, Tables, shape_bounds};
use lanecast_picture::render::{Exposure, RenderConfig, Slices};
use light::Light;
use price::{Price, prices};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The value that `--json` writes.
#[derive(Debug, Serialize)]
struct Report {
    instances: u64,
    /// What the ids of pictures stand for.
    instance_names: InstanceNames,
    /// Number of instances of each kind of shape.
    shapes: BTreeMap<&'static str, u64>,
    triangles: usize,
    lights: usize,
    materials: usize,
    /// The CSG solids that are instanced.
    csg_solids: Vec<Csg>,
    /// Lints of the shapes.
    remarks: Vec<String>,
    choices: Vec<Choice>,
    light: Light,
    /// Bytes per table.
    tables: BTreeMap<&'static str, usize>,
    /// Bytes per tree.
    trees: BTreeMap<&'static str, usize>,
    /// What would cost how much that the scene lacks; with `--measure`.
    #[serde(skip_serializing_if = "Option::is_none")]
    prices: Option<Prices>,
    /// Expected cost of a random ray through the top-level structure, in primitive
    /// tests.
    top_tree_sah: f64,
}

/// A CSG solid, expanded.
#[derive(Debug, Serialize)]
struct Csg {
    name: String,
    operands: usize,
    gates: usize,
    /// Number of distinct spaces of the operands.
    frames: usize,
    bytes: usize,
}

/// What `--measure` finds.
#[derive(Debug, Serialize)]
struct Prices {
    size: [u32; 2],
    threads: usize,
    /// Median seconds of the scene's own picture.
    seconds: f64,
    of: Vec<Price>,
}

#[derive(Debug, Serialize)]
struct Choice {
    what: &'static str,
    choice: String,
    why: String,
}

pub fn run(args: &PlanArgs) -> Result<(), CliError> {
    interrupt::end_at_signal();
    let config = args.config()?;
    let inputs: Vec<_> = args.scene.as_deref().into_iter().collect();
    let outputs = check_destinations(&inputs, &[], args.common.sinks())?;
    let (mut watch, mut stats) = (Watch::start(), Stats::default());
    let path = args.scene.as_deref();
    let options = args.common.load_options(outputs);
    let scene = load(path, &options, &mut watch, &mut stats)?;
    let (scene, config) = viewed(scene, config, &args.common.view, named(path))?;
    let config = of_camera(config, &scene, args.common.size)?;
    let row = pick_camera(&scene.cameras, config.camera.as_deref())?;
    let config = RenderConfig {
        integrator: needed_integrator(&scene, row, config.grid).0,
        ..config
    };
    let measured = args.measure.then(|| {
        let size = args.common.size.unwrap_or(VERIFY_SIZE);
        let config = RenderConfig {
            width: size.width,
            height: size.height,
            ..config.clone()
        };
        prices(&scene, (named(path), &config))
    });
    let measured = measured.transpose()?;
    let prepared = complete(scene, named(path), &config, &mut watch, &mut stats)?;
    let world = prepared.world(&mut watch, &mut stats);
    stats.finish();
    let light = Light::of(
        &prepared.scene,
        &prepared.instances,
        &prepared.camera,
        (row, config.grid),
    );
    let size = args.common.size.unwrap_or(VERIFY_SIZE);
    let report = Report {
        prices: measured.map(|(seconds, of)| Prices {
            size: [size.width, size.height],
            threads: prepared.pool.current_num_threads(),
            seconds,
            of,
        }),
        ..report(&prepared, &world, light)
    };
    let mut results = Results::default();
    results.add(&args.common.stats, &stats)?;
    results.add(&args.common.json, &report)?;
    results.commit(&text_report(&report))
}

/// Warns about instances whose shapes have bounds but that have none in world space.
fn without_world_bounds(world: &World) -> Option<String> {
    let bounded = |entry: &&TlasEntry| {
        let row = world.instances.get(&world.scene, entry.instance);
        shape_bounds(&world.scene, row.shape).is_some()
    };
    let which = match world.unbounded.iter().filter(bounded).count() {
        0 => return None,
        1 => "one instance".to_owned(),
        count => format!("{count} instances"),
    };
    Some(format!(
        "no tree holds {which}, and every ray is tested against it: a rotation, a non-uniform \
         scale by thousands and another rotation leave no certain box; scale before rotating"
    ))
}

fn report(prepared: &Prepared, world: &World, light: Light) -> Report {
    let scene: &Tables = &prepared.scene;
    let mut shapes = BTreeMap::new();
    let counts = prepared.instances.of_shapes(scene);
    let (mut csg_solids, mut notes) = (Vec::new(), Vec::new());
    let mut met = BTreeSet::new();
    for ((row, shape), count) in (0..).zip(&scene.shapes.rows).zip(counts) {
        if count > 0 {
            *shapes.entry(shape.kind_name()).or_default() += count;
            notes.extend(unbounded(scene, ShapeId(row)));
            notes.extend(searched(scene, ShapeId(row)));
            met.insert(row);
        }
        if let (Shape::Csg(id), 1..) = (shape, count) {
            let csg = world.csg(*id);
            let solid = &csg.solid;
            notes.extend(remarks(scene, ShapeId(row), solid));
            met.extend(solid.operands.iter().map(|operand| operand.id.0));
            csg_solids.push(Csg {
                name: scene.shapes.names.label(row),
                operands: solid.operands.len(),
                gates: solid.program.gates(),
                frames: solid.frames.len(),
                bytes: csg.bytes(),
            });
        }
    }
    for row in met {
        notes.extend(solved(scene, ShapeId(row)));
        notes.extend(spindle(scene, ShapeId(row)));
    }
    notes.extend(stacked(scene));
    notes.extend(without_world_bounds(world));
    let reasons = prepared.plan.reasons.iter();
    let choices = reasons.map(|(what, choice, why)| Choice {
        what,
        choice: choice.clone(),
        why: why.clone(),
    });
    Report {
        instances: prepared.instances.count(),
        instance_names: InstanceNames::of(&prepared.scene, &prepared.instances),
        shapes,
        triangles: scene.meshes.triangles.len(),
        lights: scene.lights.len(),
        materials: scene.materials.len(),
        csg_solids,
        remarks: notes,
        choices: choices.chain([motion(prepared, world)]).collect(),
        light,
        tables: scene.bytes().into_iter().collect(),
        trees: world.bytes().into_iter().collect(),
        prices: None,
        top_tree_sah: world.accelerator.tlas_figures().sah,
    }
}

/// Tells of how many worlds pictures are made.
fn motion(prepared: &Prepared, world: &World) -> Choice {
    let scene = &prepared.scene;
    let choice = |choice: String, why: String| Choice {
        what: "motion",
        choice,
        why,
    };
    if !scene.moves() {
        return choice("one world".into(), "nothing moves".into());
    }
    let transforms = scene.transforms.motions.of.len();
    let moving = match scene.cameras.motions.is_empty() {
        true => format!("{transforms} transforms move"),
        false => format!("{transforms} transforms and the camera move"),
    };
    let row = prepared.camera_row;
    if row.and_then(|row| scene.cameras.shutter(row)).is_none() {
        let why = format!("{moving}, and the camera has no shutter");
        return choice("a world a frame".into(), why);
    }
    let slices = Exposure::SLICES.min(Slices::most(world));
    choice(
        format!("{slices} worlds"),
        format!(
            "{moving} while the shutter is open; {} bytes of each are its own",
            world.bytes_of_a_time()
        ),
    )
}

/// Maximum number of lines shown of a long list.
const SHOWN: usize = 8;

fn more(text: &mut String, count: usize) {
    if count > SHOWN {
        let _ = writeln!(text, "  and {} more", count - SHOWN);
    }
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{} instances, {} stored triangles, {} lights, {} materials",
        report.instances, report.triangles, report.lights, report.materials
    );
    for (kind, count) in &report.shapes {
        let _ = writeln!(text, "  {count:>10} × {kind}");
    }
    if !report.csg_solids.is_empty() {
        let _ = writeln!(text, "\ncombinations");
    }
    for row in report.csg_solids.iter().take(SHOWN) {
        let _ = writeln!(
            text,
            "  {:<16} {} operands, {} gates, {} frames, {} bytes",
            printable_line(&row.name),
            row.operands,
            row.gates,
            row.frames,
            row.bytes
        );
    }
    more(&mut text, report.csg_solids.len());
    for line in report.remarks.iter().take(SHOWN) {
        let _ = writeln!(text, "  note: {}", printable_line(line));
    }
    more(&mut text, report.remarks.len());
    let _ = writeln!(text, "\nchoices");
    let lengths = report.choices.iter().map(|choice| choice.choice.len());
    let width = lengths.max().unwrap_or(0);
    for choice in &report.choices {
        let Choice { what, choice, why } = choice;
        let _ = writeln!(text, "  {what:<16} {choice:<width$}  {why}");
    }
    let _ = writeln!(text, "\nlight");
    report.light.write(&mut text);
    if let Some(prices) = &report.prices {
        write_prices(prices, &mut text);
    }
    for (title, bytes) in [("tables", &report.tables), ("trees", &report.trees)] {
        let total: usize = bytes.values().sum();
        let _ = writeln!(text, "\n{title}: {total} bytes");
        for (name, bytes) in bytes {
            let _ = writeln!(text, "  {name:<16} {bytes:>12}");
        }
    }
    text
}

fn write_prices(prices: &Prices, text: &mut String) {
    let [width, height] = prices.size;
    let _ = writeln!(
        text,
        "\nprices: what one of each thing would cost that the scene lacks, beside {:.3} s of its own \
         picture ({width}x{height}, {} threads)",
        prices.seconds, prices.threads
    );
    for price in &prices.of {
        let [least, most] = price.range;
        let _ = writeln!(
            text,
            "  {:<20} {:>6.3} × the time ({:.3} to {:.3}{}) {:>+10} bytes",
            price.what,
            price.ratio,
            least,
            most,
            if (least..=most).contains(&1.0) {
                ": none seen"
            } else {
                ""
            },
            price.bytes
        );
    }
}
