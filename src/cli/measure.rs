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
use crate::measure::volumes::{Goal, NoVolume, Placed, Volume, together};
use crate::render::{Progress, mix};
use crate::scene::{Appearance, Appearances, Scene, ShapeId, Target};
use serde::Serialize;
use std::collections::HashMap;
use std::fmt::Write;

/// What `--json` writes.
#[derive(Debug, Serialize)]
struct Report {
    solids: Vec<Row>,
    /// Appearances that have no volume to measure, by why.
    surfaces_left_out: u64,
    meshes_left_out: u64,
    unbounded_left_out: u64,
    beyond_left_out: u64,
}

#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// How many solids it is made of; where these overlap they count twice.
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
    let appearances = Appearances::of(&scene).map_err(of_scene)?;
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
                Ok(measurer.shapes(&appearances))
            } else {
                measurer.roots(&appearances).map_err(of_scene)
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
    results.commit(&for_people(&report))
}

/// A shape under the linear part of a map, bit for bit.
type Known = (ShapeId, [u64; 9]);

struct Measurer<'s> {
    scene: &'s Scene,
    goal: Goal,
    progress: &'s Progress,
    /// And the number of its measurement.
    known: HashMap<Known, (usize, Volume)>,
    /// Surfaces, meshes, unbounded solids, those whose figures f64 has no numbers for.
    left_out: [u64; 4],
}

impl Measurer<'_> {
    fn shapes(&mut self, appearances: &Appearances) -> Vec<Row> {
        let counts = appearances.of_shapes(self.scene);
        let mut rows = Vec::new();
        for (row, count) in (0..).zip(counts) {
            let id = ShapeId(row);
            let found = match count {
                0 => None,
                _ => self.shape(id, &Affine::IDENTITY, &Affine::IDENTITY, count),
            };
            rows.extend(found.map(|(_, volume)| Row {
                name: shape_name(self.scene, id),
                parts: 1,
                volume,
            }));
        }
        rows
    }

    fn roots(&mut self, appearances: &Appearances) -> Result<Vec<Row>, crate::scene::SceneError> {
        appearances.check_enumerable()?;
        let mut parts: Vec<Vec<(usize, Volume)>> = vec![Vec::new(); self.scene.instances.len()];
        for appearance in appearances.iter(self.scene) {
            if self.progress.is_cancelled() {
                break;
            }
            let root = appearance.root as usize;
            parts[root].extend(self.appearance(&appearance));
        }
        let of_root = |(row, parts): (usize, &Vec<(usize, Volume)>)| {
            (!parts.is_empty()).then(|| Row {
                name: root_name(self.scene, row),
                parts: parts.len() as u64,
                volume: together(parts),
            })
        };
        Ok(parts.iter().enumerate().filter_map(of_root).collect())
    }

    /// Where the map is a similarity, from the shape's own figures.
    fn appearance(&mut self, appearance: &Appearance) -> Option<(usize, Volume)> {
        let (outward, inward) = (&appearance.world_from_object, &appearance.object_from_world);
        let Some(scale) = similarity(outward) else {
            return self.shape(appearance.shape, outward, inward, 1);
        };
        let identity = Affine::IDENTITY;
        let (number, own) = self.shape(appearance.shape, &identity, &identity, 1)?;
        let (square, cube) = (scale * scale, scale * scale * scale);
        let placed = Volume {
            volume: own.volume * cube,
            volume_error: own.volume_error * cube,
            area: own.area * square,
            area_error: own.area_error * square,
            centroid: own.centroid.map(|p| outward.point(p)),
            lines: own.lines,
            is_rough: own.is_rough,
        };
        self.within_range(number, placed, 1)
    }

    /// A solid of a size whose cube is no number is left out.
    fn within_range(
        &mut self,
        number: usize,
        volume: Volume,
        count: u64,
    ) -> Option<(usize, Volume)> {
        let [x, y, z] = volume.centroid.unwrap_or_default();
        let whole = [volume.volume, volume.volume_error];
        let outside = [volume.area, volume.area_error];
        let is_beyond = |figures: &[f64]| figures.iter().any(|figure| !figure.is_finite());
        // Where lines met it, it has a volume and an area.
        let vanished =
            volume.centroid.is_some() && !(volume.volume.is_normal() && volume.area.is_normal());
        if vanished || is_beyond(&whole) || is_beyond(&outside) || is_beyond(&[x, y, z]) {
            self.left_out[3] += count;
            return None;
        }
        Some((number, volume))
    }

    fn shape(
        &mut self,
        id: ShapeId,
        outward: &Affine,
        inward: &Affine,
        count: u64,
    ) -> Option<(usize, Volume)> {
        // Where it stands makes no difference but to the centroid.
        let mut bits = outward.linear().as_flattened().iter().map(|x| x.to_bits());
        let key = (id, std::array::from_fn(|_| bits.next().unwrap_or(0)));
        let place = |volume: &Volume, from: [f64; 3], to: [f64; 3]| Volume {
            centroid: volume
                .centroid
                .map(|p| std::array::from_fn(|k| p[k] - from[k] + to[k])),
            ..*volume
        };
        if let Some((number, known)) = self.known.get(&key) {
            let (number, volume) = (*number, place(known, [0.0; 3], outward.translation));
            return self.within_range(number, volume, count);
        }
        match Placed::of(self.scene, id, outward, inward) {
            Ok(placed) => {
                let number = self.known.len();
                // Other lines, so that errors of different solids are their own.
                let seed = match number {
                    0 => self.goal.seed,
                    _ => mix(self.goal.seed ^ mix(number as u64)),
                };
                let goal = Goal { seed, ..self.goal };
                let found = placed.measure(&goal, self.progress)?;
                let at_origin = place(&found, outward.translation, [0.0; 3]);
                self.known.insert(key, (number, at_origin));
                self.within_range(number, found, count)
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

/// By how much a map lengthens, if all vectors alike.
fn similarity(map: &Affine) -> Option<f64> {
    let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let [x, y, z] = map.linear();
    let square = dot(x, x);
    let near = |value: f64, to: f64| (value - to).abs() <= 1e-12 * square;
    let all = near(dot(y, y), square)
        && near(dot(z, z), square)
        && near(dot(x, y), 0.0)
        && near(dot(y, z), 0.0)
        && near(dot(z, x), 0.0);
    all.then(|| square.sqrt())
}

/// Of what it places.
fn root_name(scene: &Scene, row: usize) -> String {
    match scene.instances.row(row).target {
        Target::Shape(id) => shape_name(scene, id),
        Target::Node(id) => match scene.nodes.names.get(id.0) {
            Some(name) => name.into(),
            None => format!("node {}", id.0),
        },
    }
}

/// With so many decimals, or digits where these would not show it.
fn readable(x: f64, digits: usize) -> String {
    match x.abs() {
        0.0 => format!("{x:.digits$}"),
        1e-3..1e6 => format!("{x:.digits$}"),
        _ => format!("{x:.digits$e}"),
    }
}

fn for_people(report: &Report) -> String {
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
        "\n± holds the value in 95 of 100 cases; parts that overlap count twice"
    );
    if report.solids.iter().any(|row| row.volume.is_rough) {
        let _ = writeln!(
            text,
            "rough: less exact than asked for; too thin for the lines that were drawn, or empty"
        );
    }
    for (count, what) in [
        (report.surfaces_left_out, "surfaces, which have no inside"),
        (report.meshes_left_out, "meshes that are not closed"),
        (report.unbounded_left_out, "solids without bounds"),
        (
            report.beyond_left_out,
            "solids of a size whose square or cube is beyond f64's range: measure them scaled",
        ),
    ] {
        if count > 0 {
            let _ = writeln!(text, "left out: {count} {what}");
        }
    }
    text
}
