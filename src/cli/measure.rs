//! `lanecast measure`: mass properties of the solids of a scene.

use super::args::MeasureArgs;
use super::error::CliError;
use super::interrupt;
use super::output::{Results, check_destinations, printable_line};
use super::pipeline::thread_pool;
use super::progress::Drawing;
use super::scene::{self, shape_name};
use glam::DVec3;
use lanecast_io::LoadError;
use lanecast_measure::volumes::moments::inertia;
use lanecast_measure::volumes::{
    Extent, Goal, Measured, Method, NoVolume, Placed, Volume, extent, together,
};
use lanecast_model::scene::{Instance, Instances, Scene, Shape, ShapeId, Target};
use lanecast_numerics::math::Affine;
use lanecast_picture::render::{Progress, mix};
use serde::Serialize;
use std::collections::HashMap;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// The value that `--json` writes.
#[derive(Debug, Serialize)]
struct Report {
    solids: Vec<Row>,
    /// Mass of a unit of volume, if one is given.
    density: Option<f64>,
    /// Number of instances without a volume to measure, by reason.
    surfaces_left_out: u64,
    meshes_left_out: u64,
    unbounded_left_out: u64,
    beyond_left_out: u64,
    /// Number of instances for which the time limit left no figures.
    late_left_out: u64,
}

#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Number of solids it consists of; overlaps count twice.
    parts: u64,
    #[serde(flatten)]
    volume: Volume,
    /// Null for an empty solid.
    bounds: Option<Bounds>,
    /// With a density.
    mass: Option<Mass>,
}

/// A box around a solid, in world space.
#[derive(Debug, Serialize)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
    /// The solid touches all six sides, to roundings; else it is somewhere inside.
    is_tight: bool,
}

#[derive(Debug, Serialize)]
struct Mass {
    mass: f64,
    mass_error: f64,
    /// Inertia tensor about the centroid, along world axes; null where f64 cannot hold it.
    inertia: Option<[[f64; 3]; 3]>,
    /// Error of each of its entries.
    inertia_error: Option<f64>,
}

impl Row {
    fn new(name: String, parts: u64, volume: Volume, extent: Extent, density: Option<f64>) -> Row {
        let mass = density.map(|density| {
            let tensor = volume.spread.map(|spread| {
                let tensor = inertia(&spread);
                tensor.map(|row| row.map(|x| x * density + 0.0))
            });
            let tensor = tensor.filter(|t| t.as_flattened().iter().all(|x| x.is_finite()));
            Mass {
                mass: volume.volume * density,
                mass_error: volume.volume_error * density,
                inertia: tensor,
                // A diagonal entry is the sum of two moments.
                inertia_error: tensor.map(|_| 2.0 * volume.spread_error * density),
            }
        });
        Row {
            name,
            parts,
            volume,
            bounds: extent.bounds.is_finite().then(|| Bounds {
                min: extent.bounds.min.to_array(),
                max: extent.bounds.max.to_array(),
                is_tight: extent.is_tight,
            }),
            mass,
        }
    }
}

pub fn run(args: &MeasureArgs) -> Result<(), CliError> {
    args.progress.check(args.json.iter())?;
    let outputs = check_destinations(&[&args.scene], &[], args.json.iter())?;
    let limit = args.time_limit.map(Duration::from_secs_f64);
    let goal = Goal {
        relative: args.error,
        seed: args.seed,
        deadline: limit.and_then(|limit| Instant::now().checked_add(limit)),
        ..Goal::default()
    };
    let progress = interrupt::watch();
    let scene = scene::load(&args.scene, &args.load_options(outputs))?;
    interrupt::check(&progress)?;
    let of_scene = |source| LoadError::of_scene(&args.scene, source);
    let instances = Instances::of(&scene).map_err(of_scene)?;
    let pool = thread_pool(args.threads)?;
    let mut measurer = Measurer {
        scene: &scene,
        goal,
        density: args.density,
        progress: &progress,
        known: HashMap::new(),
        extents: HashMap::new(),
        vertices: 0,
        left_out: [0; 5],
    };
    let solids = {
        let _drawing = Drawing::start(&progress, args.progress.style);
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
        late_left_out,
    ] = measurer.left_out;
    let report = Report {
        solids,
        density: args.density,
        surfaces_left_out,
        meshes_left_out,
        unbounded_left_out,
        beyond_left_out,
        late_left_out,
    };
    let mut results = Results::default();
    results.add(&args.json, &report)?;
    results.commit(&text_report(&report))
}

/// Index of the count of solids whose figures f64 cannot hold.
const BEYOND: usize = 3;

/// Index of the count of instances that the time did not suffice for.
const LATE: usize = 4;

/// The most vertices of meshes that boxes are made from; beyond, a mesh' own box is placed.
const MOST_VERTICES: u64 = 1 << 30;

/// A shape and the bits of the linear part of its map.
type Known = (ShapeId, [u64; 9]);

fn known(id: ShapeId, map: &Affine) -> Known {
    let mut bits = map.linear().as_flattened().iter().map(|x| x.to_bits());
    (id, std::array::from_fn(|_| bits.next().unwrap_or(0)))
}

struct Measurer<'s> {
    scene: &'s Scene,
    goal: Goal,
    density: Option<f64>,
    progress: &'s Progress,
    /// Number and result of each measurement.
    known: HashMap<Known, (usize, Measured)>,
    extents: HashMap<Known, Extent>,
    /// Number of vertices that `extents` were made from.
    vertices: u64,
    /// Counts of surfaces, meshes, unbounded solids, [`BEYOND`] and [`LATE`].
    left_out: [u64; 5],
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
            let volume = self.or_left_out(own.volume(&Affine::IDENTITY, 1.0), count);
            if let Some(volume) = volume {
                let extent = self.extent(id, &Affine::IDENTITY);
                let name = shape_name(self.scene, id);
                rows.push(Row::new(name, 1, volume, extent, self.density));
            }
        }
        rows
    }

    fn roots(
        &mut self,
        instances: &Instances,
    ) -> Result<Vec<Row>, lanecast_model::scene::SceneError> {
        instances.check_enumerable()?;
        let count = self.scene.roots.len();
        let mut parts: Vec<Vec<(usize, Volume)>> = vec![Vec::new(); count];
        let mut extents = vec![Extent::NOTHING; count];
        for (seen, instance) in (0..).zip(instances.iter(self.scene)) {
            if self.progress.is_cancelled() {
                break;
            }
            if self.goal.is_late() {
                self.left_out[LATE] += instances.count() - seen;
                break;
            }
            let root = instance.root as usize;
            if let Some(part) = self.instance(&instance) {
                parts[root].push(part);
                let map = &instance.world_from_object;
                extents[root] = extents[root].union(&self.extent(instance.shape, map));
            }
        }
        let mut rows = Vec::new();
        let all = parts.iter().zip(extents).enumerate();
        for (row, (parts, extent)) in all.filter(|(_, (p, _))| !p.is_empty()) {
            let count = parts.len() as u64;
            match together(parts) {
                Some(volume) => {
                    let name = root_name(self.scene, row);
                    rows.push(Row::new(name, count, volume, extent, self.density));
                }
                None => self.left_out[BEYOND] += count,
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
                (number, own.volume(outward, scale))
            }
            None => {
                let (number, own) = self.shape(shape, (outward, inward), 1)?;
                let moved = Affine::new(*Affine::IDENTITY.linear(), outward.translation);
                (number, own.volume(&moved, 1.0))
            }
        };
        self.or_left_out(volume, 1).map(|volume| (number, volume))
    }

    /// Returns the box of a placed shape.
    fn extent(&mut self, shape: ShapeId, map: &Affine) -> Extent {
        let key = known(shape, map);
        let (scene, vertices) = (self.scene, &mut self.vertices);
        let own = self.extents.entry(key).or_insert_with(|| {
            if let Shape::Mesh(id) = scene.shapes.row(shape) {
                *vertices += scene.meshes.row(id).positions.len() as u64;
            }
            let linear = Affine::new(*map.linear(), [0.0; 3]);
            extent(scene, shape, &linear, *vertices <= MOST_VERTICES)
        });
        own.moved(DVec3::from_array(map.translation))
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
        let key = known(id, outward);
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
                let found = placed.measure(&goal, self.progress);
                if found.is_none() && self.goal.is_late() {
                    self.left_out[LATE] += count;
                }
                let found = found?;
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

/// The most characters of a name in the table.
const LONGEST_NAME: usize = 40;

/// Shortens a name so that the table keeps its columns, and escapes what a terminal would
/// obey.
fn short(name: &str) -> String {
    let head: String = name.chars().take(LONGEST_NAME + 1).collect();
    let name = printable_line(&head);
    match name.chars().count() > LONGEST_NAME {
        true => name.chars().take(LONGEST_NAME - 1).chain(['…']).collect(),
        false => name,
    }
}

fn method_name(method: Method) -> &'static str {
    match method {
        Method::ClosedForm => "formula",
        Method::Divergence => "divergence",
        Method::Quadrature => "quadrature",
        Method::Sampling => "sampling",
    }
}

fn text_report(report: &Report) -> String {
    let mut text = String::new();
    let names: Vec<String> = report.solids.iter().map(|row| short(&row.name)).collect();
    let width = names.iter().map(|name| name.chars().count()).max();
    let width = width.unwrap_or(0).max(4);
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{:<width$} {:>6} {:>14} {:>9} {:>14} {:>9} {:>10}   centroid",
        "name", "parts", "volume", "±", "area", "±", "method"
    );
    for (row, name) in report.solids.iter().zip(&names) {
        let v = &row.volume;
        let centroid = v.centroid.map_or("none".into(), |centre| {
            centre.map(|x| readable(x, 5)).join(", ")
        });
        let _ = writeln!(
            text,
            "{name:<width$} {:>6} {:>14} {:>9.1e} {:>14} {:>9.1e} {:>10}   {centroid}{}",
            row.parts,
            readable(v.volume, 7),
            v.volume_error,
            readable(v.area, 7),
            v.area_error,
            method_name(v.method.max(v.area_method)),
            if v.is_rough { "  (rough)" } else { "" }
        );
    }
    for (row, name) in report.solids.iter().zip(&names) {
        let Some(mass) = &row.mass else {
            continue;
        };
        let _ = writeln!(
            text,
            "\n{name}: mass {} ± {:.1e}, inertia about the centroid",
            readable(mass.mass, 7),
            mass.mass_error
        );
        match (&mass.inertia, mass.inertia_error) {
            (Some(tensor), Some(error)) => {
                for line in tensor {
                    let line = line.map(|x| format!("{:>14}", readable(x, 7)));
                    let _ = writeln!(text, "  {}", line.join(" "));
                }
                let _ = writeln!(text, "  each ± {error:.1e}");
            }
            _ => {
                let _ = writeln!(text, "  unknown: there is no volume, or it is beyond f64");
            }
        }
    }
    let _ = writeln!(
        text,
        "\n± of formula and divergence is a bound on roundings, of quadrature an estimate, of sampling \
         the half-width of the 95 % confidence interval; parts that overlap count twice"
    );
    if report.solids.iter().any(|row| row.volume.is_rough) {
        let _ = writeln!(
            text,
            "rough: less accurate than requested; too thin for the number of lines, out of time, \
             or empty (volume 0: none of at least 2^18 lines hit it)"
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
        (
            report.late_left_out,
            "instances that the time limit left no figures for",
        ),
    ] {
        if count > 0 {
            let _ = writeln!(text, "left out: {count} {what}");
        }
    }
    text
}
