//! The size of randomised tests.

use proptest::test_runner::Config;

/// The share of its full size that a campaign has if nothing else is asked for.
const QUICK: f64 = 0.05;

/// No campaign has fewer cases than these, unless its full size is smaller.
const FEWEST: usize = 32;

/// How many cases a randomised test tries whose full size is `full`.
///
/// The environment variable `LANECAST_CAMPAIGN` is the share of the full size: 1 is all of
/// it, 10 ten times as much; without the variable it is 0.05. A test whose seed is fixed
/// begins with the same cases at every share.
///
/// ```text
/// LANECAST_CAMPAIGN=1 cargo test --release --features all-lanes
/// ```
///
/// Tests that are ignored because they take minutes have sizes of this kind, too:
///
/// ```text
/// LANECAST_CAMPAIGN=1 cargo test --release --features all-lanes -- --ignored --nocapture
/// ```
pub fn campaign(full: usize) -> usize {
    let count = (full as f64 * share()).ceil() as usize;
    count.max(full.min(FEWEST))
}

fn share() -> f64 {
    let Some(text) = std::env::var_os("LANECAST_CAMPAIGN") else {
        return QUICK;
    };
    let share = text.to_str().and_then(|text| text.parse::<f64>().ok());
    let share = share.filter(|share| share.is_finite() && *share > 0.0);
    share.unwrap_or_else(|| panic!("LANECAST_CAMPAIGN is no number above 0: {text:?}"))
}

/// Random cases of a property, whose full number is `full`. A failure prints its least
/// case and leaves no file.
pub fn property(full: usize) -> Config {
    Config {
        failure_persistence: None,
        ..Config::with_cases(campaign(full) as u32)
    }
}
