//! `lanecast extremes`: what the sweeps promise.

use lanecast::internals::measure::extremes::{
    ExtremesOptions, PRECISIONS, Report, SWEEPS, Sweep, run,
};
use lanecast::internals::plan::{LaneCount, Precision};

fn swept(names: &[&str], rays: usize) -> Report {
    let sweeps = SWEEPS.iter();
    let sweeps: Vec<&Sweep> = sweeps
        .filter(|sweep| names.is_empty() || names.contains(&sweep.name))
        .collect();
    let options = ExtremesOptions {
        rays,
        seed: 1,
        precisions: PRECISIONS.to_vec(),
        lanes: LaneCount::Auto,
    };
    run(&sweeps, &options, &Default::default()).expect("nobody interrupts")
}

/// Edges, slivers, grazing and far rays, denormal directions: what is promised
/// holds at every value of every sweep. Nothing is NaN or infinite there.
#[test]
fn guarded_and_exact_are_right_wherever_they_promise_to_be() {
    let report = swept(&[], 96);
    let mut compared = 0;
    for (sweep, point, figures) in report.rows() {
        if figures.precision == "fast" || point.known_gap.is_some() {
            continue;
        }
        let place = format!(
            "{} {} {:e} {}",
            sweep.name, sweep.subject, point.value, figures.precision
        );
        assert_eq!(figures.wrong(), 0, "{place}: {:?}", figures.first_wrong);
        assert_eq!(figures.not_finite, 0, "{place}");
        compared += figures.rays;
    }
    assert!(compared > 40_000, "{compared}");
}

/// Where f32 cannot know better: the sweeps go as far as they say.
#[test]
fn fast_errs_at_the_extremes_and_not_at_their_beginning() {
    let report = swept(
        &["edges", "slivers", "grazing", "offset", "small-spheres"],
        256,
    );
    for sweep in &report.sweeps {
        let first = &sweep.points[0].modes[0];
        assert_eq!(first.precision, Precision::Fast.name());
        assert!(first.hits > 50, "{}: {}", sweep.name, first.hits);
        assert_eq!(first.wrong(), 0, "{}: {:?}", sweep.name, first.first_wrong);
        // About the mesh's own centre f32 has all it needs.
        let errs = (sweep.name, sweep.subject) != ("offset", "triangles");
        assert_eq!(
            sweep.starts[0].value.is_some(),
            errs,
            "{} {}",
            sweep.name,
            sweep.subject
        );
    }
}

#[test]
fn a_scene_that_is_refused_is_an_outcome() {
    let report = swept(&["overflow"], 8);
    let points = &report.sweeps[0].points;
    let refused = points.iter().find(|point| point.value == 1e39).unwrap();
    assert!(refused.modes.is_empty());
    let why = refused.refused.as_deref().unwrap();
    assert!(
        why.contains("larger than f32 can tell") && why.lines().count() == 1,
        "{why}"
    );
    assert!(points[0].refused.is_none() && points[0].modes.len() == 3);
}
