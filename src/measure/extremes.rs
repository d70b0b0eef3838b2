//! Stress sweeps: the parameter value at which each precision begins to err.
//!
//! A sweep is an axis of values and a function from a value to a scene and its rays
//! ([`SWEEPS`]). At each value every precision traces the same rays, for the closest
//! hit and for any hit, with the plan's kernels and structure; the reference answers
//! them once. A precision *begins to err* at the first value of the axis at which a
//! decision is wrong, or t differs from the reference's by more than [`ULPS_ALLOWED`]
//! units in the last place of the precision's own numbers.
//!
//! A scene that validation rejects at a value is recorded as an outcome; no value
//! panics. Everything except the times is a function of the seed and the number of
//! rays.

mod cases;
mod objects;
mod oracle;
mod rays;
mod sweeps;

pub use oracle::Figures;
pub use rays::SweepRay;
pub use sweeps::{SWEEPS, Subject, Sweep};

use super::verify::Interrupted;
use lanecast_engine::accel::{Structure, World};
use lanecast_model::plan::{Choices, LaneCount, Plan, Precision, plan};
use lanecast_model::scene::{Instances, Scene, SceneBuilder};
use lanecast_picture::render::{Progress, mix};
use lanecast_reference::Reference;
use rays::Random;
use serde::Serialize;
use std::fmt;

/// Allowed error of t in units in the last place: of f32 for `fast` and `guarded`, of
/// f64 for `exact`.
pub const ULPS_ALLOWED: f64 = 64.0;

pub const PRECISIONS: [Precision; 3] = [Precision::Fast, Precision::Guarded, Precision::Exact];

#[derive(Clone, Debug)]
pub struct ExtremesOptions {
    /// Rays at each value; each is traced for the closest hit and for any hit.
    pub rays: usize,
    pub seed: u64,
    pub precisions: Vec<Precision>,
    pub lanes: LaneCount,
}

/// A scene at one value of an axis, and the rays traced in it.
#[derive(Clone, Debug, Default)]
pub struct Case {
    pub scene: SceneBuilder,
    pub rays: Vec<SweepRay>,
}

/// The results of all sweeps, with the field names of `extremes --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub seed: u64,
    pub rays: usize,
    pub ulps_allowed: f64,
    pub sweeps: Vec<SweepReport>,
}

#[derive(Clone, Debug, Serialize)]
pub struct SweepReport {
    pub name: &'static str,
    pub title: &'static str,
    /// Meaning of the axis' values.
    pub axis: &'static str,
    pub subject: &'static str,
    pub starts: Vec<Start>,
    pub points: Vec<Point>,
}

/// The results at one value of the axis.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    pub value: f64,
    /// Reason why `guarded` and `exact` give no guarantee here; `null` where they do.
    pub known_gap: Option<&'static str>,
    /// Reason why there is no valid scene at this value.
    pub refused: Option<String>,
    /// One entry per precision; empty if the scene was refused.
    pub modes: Vec<Figures>,
}

/// The axis value at which a precision begins to err.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Start {
    pub precision: &'static str,
    /// `null` if it errs nowhere on the axis.
    pub value: Option<f64>,
    /// The first fault there: `not finite`, `hit`, `id`, `shadow` or `t`.
    pub what: Option<&'static str>,
    /// The first value with a wrong decision.
    pub decision: Option<f64>,
    /// The first value with an error of t beyond the allowed one.
    pub t: Option<f64>,
}

/// Runs the sweeps on the current rayon pool; one thread traces the rays.
pub fn run(
    sweeps: &[&Sweep],
    options: &ExtremesOptions,
    progress: &Progress,
) -> Result<Report, Interrupted> {
    let of_subjects = || {
        let each = sweeps.iter().map(|sweep| (*sweep, sweep.subjects));
        each.flat_map(|(sweep, subjects)| subjects.iter().map(move |subject| (sweep, *subject)))
    };
    let points: usize = of_subjects().map(|(sweep, _)| (sweep.values)().len()).sum();
    progress.start(points as u32);
    let mut report = Report {
        seed: options.seed,
        rays: options.rays,
        ulps_allowed: ULPS_ALLOWED,
        sweeps: Vec::new(),
    };
    for (sweep, subject) in of_subjects() {
        let mut points = Vec::new();
        for value in (sweep.values)() {
            if progress.is_cancelled() {
                return Err(Interrupted);
            }
            let point = at(sweep, subject, value, options);
            progress.add_tile(point.modes.iter().map(|mode| mode.rays).sum());
            points.push(point);
        }
        report.sweeps.push(SweepReport {
            name: sweep.name,
            title: sweep.title,
            axis: sweep.axis,
            subject: subject.name(),
            starts: starts(&points, &options.precisions),
            points,
        });
    }
    Ok(report)
}

/// Measures one value of one sweep.
fn at(sweep: &Sweep, subject: Subject, value: f64, options: &ExtremesOptions) -> Point {
    let mut random = Random(mix(options.seed ^ value.to_bits()));
    let case = (sweep.case)(subject, value, options.rays, &mut random);
    let (refused, modes) = match figures(case, options) {
        Ok(modes) => (None, modes),
        Err(why) => (Some(why), Vec::new()),
    };
    Point {
        value,
        known_gap: sweep.known_gap(value),
        refused,
        modes,
    }
}

fn figures(case: Case, options: &ExtremesOptions) -> Result<Vec<Figures>, String> {
    let scene: Scene = case.scene.finish().map_err(first_line)?;
    let instances = Instances::of(&scene).map_err(first_line)?;
    let plans = options.precisions.iter().map(|precision| {
        let choices = Choices {
            precision: *precision,
            lanes: options.lanes,
            accel: None,
        };
        let plan = plan(&scene, &instances, &choices).map_err(first_line)?;
        Ok((*precision, plan))
    });
    let plans: Vec<(Precision, Plan)> = plans.collect::<Result<_, String>>()?;
    let reference = Reference::new(&scene, &instances).map_err(first_line)?;
    // The plan's choice is the same for every precision.
    let world = World::build(&scene, &instances, Structure::Bvh);
    let truth = oracle::ask(&reference, &case.rays);
    let modes = plans.iter().map(|(precision, plan)| {
        oracle::figures(&world, (*precision, &plan.kernels), &reference, &truth)
    });
    Ok(modes.collect())
}

fn first_line(error: impl std::fmt::Display) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().into()
}

fn starts(points: &[Point], precisions: &[Precision]) -> Vec<Start> {
    let start = |(row, precision): (usize, &Precision)| {
        let rows = || {
            let built = points.iter().filter(|point| point.refused.is_none());
            built.map(|point| (point.value, &point.modes[row]))
        };
        let first = |errs: &dyn Fn(&Figures) -> bool| {
            let mut erring = rows().filter(|(_, figures)| errs(figures));
            erring.next().map(|(value, _)| value)
        };
        let mut erring = rows().filter_map(|(value, figures)| Some((value, figures.fault()?)));
        let (value, what) = erring.next().unzip();
        Start {
            precision: precision.name(),
            value,
            what,
            decision: first(&|figures| figures.wrong() > 0),
            t: first(&|figures| figures.max_t_ulps > ULPS_ALLOWED),
        }
    };
    precisions.iter().enumerate().map(start).collect()
}

/// Formats a value of an axis as briefly as possible.
pub fn shown(value: f64) -> String {
    if value == 0.0 || (0.01..10_000.0).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

impl fmt::Display for Start {
    /// Writes the first fault and its value, such as `id 1e-3`; if that fault is an
    /// error of t, also the first wrong decision.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (Some(value), Some(what)) = (self.value, self.what) else {
            return f.write_str("-");
        };
        write!(f, "{what} {}", shown(value))?;
        match self.decision {
            Some(decision) if what == "t" => write!(f, ", wrong {}", shown(decision)),
            _ => Ok(()),
        }
    }
}

impl Report {
    /// Iterates over every precision at every value.
    pub fn rows(&self) -> impl Iterator<Item = (&SweepReport, &Point, &Figures)> {
        self.sweeps.iter().flat_map(|sweep| {
            let points = sweep.points.iter();
            points.flat_map(move |point| point.modes.iter().map(move |m| (sweep, point, m)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(precision: Precision, wrong_id: u64, max_t_ulps: f64) -> Figures {
        Figures {
            precision: precision.name(),
            rays: 10,
            hits: 5,
            wrong_hit: 0,
            wrong_id,
            wrong_shadow: 0,
            not_finite: 0,
            max_t_ulps,
            median_t_ulps: 0.0,
            escalated: 0,
            first_wrong: None,
            ns_per_ray: 1.0,
        }
    }

    #[test]
    fn the_first_fault_on_the_axis_is_the_start() {
        let [fast, exact] = [Precision::Fast, Precision::Exact];
        let point = |value, wrong_id, ulps| Point {
            value,
            known_gap: None,
            refused: None,
            modes: vec![
                figures(fast, wrong_id, ulps),
                figures(exact, 0, ULPS_ALLOWED),
            ],
        };
        let refused = Point {
            value: 0.01,
            known_gap: None,
            refused: Some("no".into()),
            modes: Vec::new(),
        };
        let points = [
            point(1.0, 0, 1.0),
            point(0.1, 0, 65.0),
            refused,
            point(1e-3, 2, 65.0),
        ];
        let starts = starts(&points, &[fast, exact]);
        assert_eq!(starts[0].to_string(), "t 0.1, wrong 1e-3");
        assert_eq!((starts[0].decision, starts[0].t), (Some(1e-3), Some(0.1)));
        assert_eq!(starts[1].to_string(), "-");
        assert_eq!(starts[1].value, None);
    }

    #[test]
    fn values_read_well() {
        let read = [1.0, 0.01, 1e-9, 40.0, 1e5, 1e300].map(shown);
        assert_eq!(read, ["1", "0.01", "1e-9", "40", "1e5", "1e300"]);
    }
}
