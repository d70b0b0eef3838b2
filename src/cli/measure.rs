//! `lanecast measure`: volume, area and centroid of the solids of a scene.

use super::args::MeasureArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations};
use super::pipeline::thread_pool;
use super::progress::Drawing;
use super::scene::{self, shape_name};
use crate::io::LoadError;
use crate::math::Affine;
use crate::measure::volumes::{Goal, Measured, NoVolume, Placed, Volume, together};
use crate::render::{Progress, mix};
use crate::scene::{Instance, Instances, Scene, ShapeId, Target};
use glam::DVec3;
use serde::Serialize;
use std::collections::HashMap;
use std::fmt::Write;

/// The value that `--json` writes.
#[derive(Debug, Serialize)]
struct Report {
    solids: Vec<Row>,
    /// Number of instances without a volume to measure, by reason.
    surfaces_left_out: u64,
    meshes_left_out: u64,
    unbounded_left_out: u64,
    beyond_left_out: u64,
}

#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Number of solids it consists of; overlaps count twice.
    parts: u64,
    #[serde(flatten)]
    volume: Volume,
}

pub fn run(args: &MeasureArgs) -> Result<(), CliError> {
    let outputs = check_destinations(&[&args.scene], &[], args.json.iter())?;
    let goal = Goal {
        relative: args.error,
        seed: args.seed,
        ..Goal::default()
    };
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    let of_scene = |source| LoadError::of_scene(&args.scene, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let pool = thread_pool(args.threads)?;
    let progress = interrupt::watch();
    let mut measurer = Measurer {
        scene: &scene,
        goal,
        progress: &progress,
        known: HashMap::new(),
        left_out: [0; 4],
    };
    let solids = {
        let _drawing = Drawing::start(&progress);
        pool.install(|| {
            if args.per_shape {
                Ok(measurer.shapes(&instances))
            } else {
                measurer.roots(&instances).map_err(of_scene)
            }
        })?
    };
    interrupt::check(&progress)?;
    let [
        surfaces_left_out,
        meshes_left_out,
        unbounded_left_out,
        beyond_left_out,
    ] = measurer.left_out;
    let report = Report {
        solids,
        surfaces_left_out,
        meshes_left_out,
        unbounded_left_out,
        beyond_left_out,
    };
    let mut results = Results::default();
    results.add(&args.json, &report)?;
    results.commit(&text_report(&report))
}

/// Index of the count of solids whose figures f64 cannot hold.
const BEYOND: usize = 3;

/// A shape and the bits of the linear part of its map.
type Known = (ShapeId, [u64; 9]);

struct Measurer<'s> {
    scene: &'s Scene,
    goal: Goal,
    progress: &'s Progress,
    /// Number and result of each measurement.
    known: HashMap<Known, (usize, Measured)>,
    /// Counts of surfaces, meshes, unbounded solids, and [`BEYOND`].
    left_out: [u64; 4],
}

impl Measurer<'_> {
    fn shapes(&mut self, instances: &Instances) -> Vec<Row> {
        let counts = instances.of_shapes(self.scene);
        let mut rows = Vec::new();
        for (row, count) in (0..).zip(counts) {
            let id = ShapeId(row);
            if count == 0 {
                continue;
            }
            let identity = (&Affine::IDENTITY, &Affine::IDENTITY);
            let Some((_, own)) = self.shape(id, identity, count) else {
                continue;
            };
            let volume = self.or_left_out(own.volume(1.0, |p| p), count);
            rows.extend(volume.map(|volume| Row {
                name: shape_name(self.scene, id),
                parts: 1,
                volume,
            }));
        }
        rows
    }

    fn roots(&mut self, instances: &Instances) -> Result<Vec<Row>, crate::scene::SceneError> {
        instances.check_enumerable()?;
        let mut parts: Vec<Vec<(usize, Volume)>> = vec![Vec::new(); self.scene.roots.len()];
        for instance in instances.iter(self.scene) {
            if self.progress.is_cancelled() {
                break;
            }
            let root = instance.root as usize;
            parts[root].extend(self.instance(&instance));
        }
        let mut rows = Vec::new();
        for (row, parts) in parts.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            match together(parts) {
                Some(volume) => rows.push(Row {
                    name: root_name(self.scene, row),
                    parts: parts.len() as u64,
                    volume,
                }),
                None => self.left_out[BEYOND] += parts.len() as u64,
            }
        }
        Ok(rows)
    }

    /// Measures an instance; under a similarity, from the shape's own figures.
    fn instance(&mut self, instance: &Instance) -> Option<(usize, Volume)> {
        let (outward, inward) = (&instance.world_from_object, &instance.object_from_world);
        let shape = instance.shape;
        let (number, volume) = match similarity(outward) {
            Some(scale) => {
                let identity = (&Affine::IDENTITY, &Affine::IDENTITY);
                let (number, own) = self.shape(shape, identity, 1)?;
                (number, own.volume(scale, |p| outward.point(p)))
            }
            None => {
                let (number, own) = self.shape(shape, (outward, inward), 1)?;
                let to = outward.translation;
                let there = |p: [f64; 3]| std::array::from_fn(|k| p[k] + to[k]);
                (number, own.volume(1.0, there))
            }
        };
        self.or_left_out(volume, 1).map(|volume| (number, volume))
    }

    fn or_left_out(&mut self, volume: Option<Volume>, count: u64) -> Option<Volume> {
        if volume.is_none() {
            self.left_out[BEYOND] += count;
        }
        volume
    }

    /// Measures a shape under the linear part of a map. The translation affects only
    /// the centroid and, far away, the rounding.
    fn shape(
        &mut self,
        id: ShapeId,
        (outward, inward): (&Affine, &Affine),
        count: u64,
    ) -> Option<(usize, Measured)> {
        let mut bits = outward.linear().as_flattened().iter().map(|x| x.to_bits());
        let key = (id, std::array::from_fn(|_| bits.next().unwrap_or(0)));
        if let Some(known) = self.known.get(&key) {
            return Some(*known);
        }
        let here = |map: &Affine| Affine::new(*map.linear(), [0.0; 3]);
        match Placed::new(self.scene, id, &here(outward), &here(inward)) {
            Ok(placed) => {
                let number = self.known.len();
                // Other lines per solid make the solids' errors independent.
                let seed = match number {
                    0 => self.goal.seed,
                    _ => mix(self.goal.seed ^ mix(number as u64)),
                };
                let goal = Goal { seed, ..self.goal };
                let found = placed.measure(&goal, self.progress)?;
                self.known.insert(key, (number, found));
                Some((number, found))
            }
            Err(why) => {
                let sort = match why {
                    NoVolume::Surface => 0,
                    NoVolume::Mesh => 1,
                    NoVolume::Unbounded => 2,
                };
                self.left_out[sort] += count;
                None
            }
        }
    }
}

/// Returns the scale of a map that scales all vectors alike.
fn similarity(map: &Affine) -> Option<f64> {
    let columns = map.linear().map(DVec3::from_array);
    let size = columns
        .iter()
        .fold(0.0, |m: f64, c| m.max(c.abs().max_element()));
    // The columns are scaled first: squares of the map's own numbers may overflow or
    // underflow.
    let [x, y, z] = columns.map(|column| column / size);
    let square = x.length_squared();
    let near = |value: f64, to: f64| (value - to).abs() <= 1e-12 * square;
    let all = near(y.length_squared(), square)
        && near(z.length_squared(), square)
        && near(x.dot(y), 0.0)
        && near(y.dot(z), 0.0)
        && near(z.dot(x), 0.0);
    all.then(|| square.sqrt() * size)
}

/// Returns the name of the shape or node that a root places.
fn root_name(scene: &Scene, row: usize) -> String {
    match scene.roots.row(row).target {
        Target::Shape(id) => shape_name(scene, id),
        Target::Node(id) => match scene.nodes.names.get(id.0) {
            Some(name) => name.into(),
            None => format!("node {}", id.0),
        },
    }
}

/// Formats a number with that many decimals, in scientific notation if it is very small
/// or large.
fn readable(x: f64, digits: usize) -> String {
    match x.abs() {
        0.0 => format!("{x:.digits$}"),
        1e-3..1e6 => format!("{x:.digits$}"),
        _ => format!("{x:.digits$e}"),
    }
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    let width = report.solids.iter().map(|row| row.name.len()).max();
    let width = width.unwrap_or(0).max(4);
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{:<width$} {:>6} {:>14} {:>9} {:>14} {:>9}   centroid",
        "name", "parts", "volume", "±", "area", "±"
    );
    for Row {
        name,
        parts,
        volume: v,
    } in &report.solids
    {
        let centroid = v.centroid.map_or("none".into(), |centre| {
            centre.map(|x| readable(x, 5)).join(", ")
        });
        let _ = writeln!(
            text,
            "{name:<width$} {parts:>6} {:>14} {:>9.1e} {:>14} {:>9.1e}   {centroid}{}",
            readable(v.volume, 7),
            v.volume_error,
            readable(v.area, 7),
            v.area_error,
            if v.is_rough { "  (rough)" } else { "" }
        );
    }
    let _ = writeln!(
        text,
        "\n± is the half-width of the 95 % confidence interval; parts that overlap count twice"
    );
    if report.solids.iter().any(|row| row.volume.is_rough) {
        let _ = writeln!(
            text,
            "rough: less accurate than requested; too thin for the number of lines, or empty \
             (volume 0: none of at least 2^18 lines hit it)"
        );
    }
    for (count, what) in [
        (report.surfaces_left_out, "surfaces, which have no interior"),
        (report.meshes_left_out, "meshes that are not closed"),
        (
            report.unbounded_left_out,
            "solids that are unbounded, or whose bounds were not found: intersect them with a box",
        ),
        (
            report.beyond_left_out,
            "solids of a size whose square or cube is beyond f64's range: scale them first",
        ),
    ] {
        if count > 0 {
            let _ = writeln!(text, "left out: {count} {what}");
        }
    }
    text
}
