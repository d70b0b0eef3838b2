//! `lanecast probe`: lists all spans of one ray inside the solids of a scene.

use super::args::ProbeArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use super::scene::{self, shape_name};
use glam::DVec3;
use lanecast_engine::trace::{End, Solids, Span, Spans, TraceScratch};
use lanecast_io::LoadError;
use lanecast_model::scene::{Instances, MaterialId, Scene};
use serde::Serialize;
use std::fmt::Write;

/// The value that `--json` writes.
#[derive(Debug, Serialize)]
pub struct Report {
    org: [f64; 3],
    dir: [f64; 3],
    spans: Vec<Row>,
    /// Number of instances of polygons, of open cylinders, cones and polynomial
    /// surfaces, and of meshes that are not closed.
    surfaces_left_out: u64,
}

#[derive(Debug, Serialize)]
struct Row {
    solid: String,
    /// The id that instance-id pictures use.
    instance: u64,
    side: Side,
    /// Ends of the span in lengths of `dir`; null for a span without that end.
    t_enter: Option<f64>,
    t_exit: Option<f64>,
    enter: Option<Place>,
    exit: Option<Place>,
}

/// Position of a span relative to the ray's origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Side {
    Behind,
    Around,
    Ahead,
}

#[derive(Debug, Serialize)]
struct Place {
    shape: String,
    instance: u64,
    material: Option<String>,
    point: [f64; 3],
    /// Unit normal, pointing out of the solid.
    normal: [f64; 3],
}

/// Range of lengths whose squares neither overflow nor underflow.
const SHORTEST: f64 = 1e-150;
const LONGEST: f64 = 1e150;

pub fn run(args: &ProbeArgs) -> Result<(), CliError> {
    interrupt::end_at_signal();
    let outputs = check_destinations(&[&args.scene], &[], args.json.iter())?;
    if args.dir == DVec3::ZERO {
        let message = "--dir 0,0,0 points nowhere; give it a length above 0";
        return Err(CliError::Usage(message.into()));
    }
    let longest = args.dir.abs().max_element();
    if !(SHORTEST..=LONGEST).contains(&longest) {
        return Err(CliError::Usage(format!(
            "--dir has {longest:?} as its longest component, too far from 1 for t to be measured in it; \
             give it a length between {SHORTEST:?} and {LONGEST:?}"
        )));
    }
    if args.org.abs().max_element() > LONGEST {
        return Err(CliError::Usage(format!(
            "--org lies beyond {LONGEST:?}; start closer to the scene"
        )));
    }
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    let of_scene = |source| LoadError::of_scene(&args.scene, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let solids = Solids::prepare(&scene, &instances).map_err(of_scene)?;
    let found = solids.spans(args.org, args.dir, &mut TraceScratch::default());
    let report = report(&scene, &found, args.org, args.dir);
    let mut results = Results::default();
    results.add(&args.json, &report)?;
    results.commit(&text_report(&report))
}

/// Tells of the spans of a ray, with names.
pub fn report(scene: &Scene, found: &Spans, org: DVec3, dir: DVec3) -> Report {
    Report {
        org: org.to_array(),
        dir: dir.to_array(),
        spans: found.rows.iter().map(|span| row(scene, span)).collect(),
        surfaces_left_out: found.left_out,
    }
}

fn row(scene: &Scene, span: &Span) -> Row {
    let place = |end: End| Place {
        shape: shape_name(scene, end.shape),
        instance: span.instance,
        material: end.material.map(|id| material_name(scene, id)),
        point: end.point.to_array(),
        normal: end.normal.to_array(),
    };
    Row {
        solid: shape_name(scene, span.shape),
        instance: span.instance,
        side: match (span.t_enter(), span.t_exit()) {
            (_, exit) if exit < 0.0 => Side::Behind,
            (enter, _) if enter > 0.0 => Side::Ahead,
            _ => Side::Around,
        },
        t_enter: span.enter.map(|end| end.t),
        t_exit: span.exit.map(|end| end.t),
        enter: span.enter.map(place),
        exit: span.exit.map(place),
    }
}

fn material_name(scene: &Scene, id: MaterialId) -> String {
    match scene.materials.names.get(id.0) {
        Some(name) => name.into(),
        None => scene.materials.names.label(id.0),
    }
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    let length = DVec3::from_array(report.dir).length();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "from {} along {}; t in units of {length:?}",
        vector(report.org),
        vector(report.dir),
    );
    let mut inside = 0.0;
    for row in &report.spans {
        let side = match row.side {
            Side::Behind => "behind",
            Side::Around => "around",
            Side::Ahead => "ahead",
        };
        let t_enter = row.t_enter.unwrap_or(f64::NEG_INFINITY);
        let t_exit = row.t_exit.unwrap_or(f64::INFINITY);
        // Only the part ahead of the origin counts.
        inside += (t_exit - t_enter.max(0.0)).max(0.0) * length;
        let thickness = (t_exit - t_enter) * length;
        let _ = writeln!(
            text,
            "\n{side:<7} t {t_enter:?} to {t_exit:?}, length {thickness:?}: {} (instance {})",
            printable_line(&row.solid),
            row.instance
        );
        for (what, end) in [("enters", &row.enter), ("leaves", &row.exit)] {
            let Some(end) = end else {
                let _ = writeln!(text, "  {what}   never");
                continue;
            };
            let _ = writeln!(
                text,
                "  {what}   {:<16} {:<16} at {}  normal {}",
                printable_line(&end.shape),
                printable_line(end.material.as_deref().unwrap_or("(no material)")),
                vector(end.point),
                vector(end.normal),
            );
        }
    }
    let _ = writeln!(
        text,
        "\n{} {}; length {inside:?} inside solids ahead of the origin",
        report.spans.len(),
        if report.spans.len() == 1 {
            "span"
        } else {
            "spans"
        },
    );
    if report.surfaces_left_out > 0 {
        let _ = writeln!(
            text,
            "{} instances of surfaces left out: polygons, open shapes, and meshes that are not \
             closed",
            report.surfaces_left_out
        );
    }
    text
}

fn vector([x, y, z]: [f64; 3]) -> String {
    format!("({x:?}, {y:?}, {z:?})")
}
