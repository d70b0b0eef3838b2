//! Results of `verify`: JSON, a table for readers, and the exit code.

use crate::error::CliError;
use lanecast_measure::PlanSummary;
use lanecast_measure::verify::{Comparison, Counts, Differences, UlpErrors};
use lanecast_model::plan::Precision;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Duration;

/// Maximum relative error of t on a camera path in `exact` that rounding explains:
/// grazing hits of the test scenes stay below 10^-10.
const MAX_T_ERROR: f64 = 1e-6;

/// The results of one precision.
pub struct Mode {
    pub precision: Precision,
    pub lanes: usize,
    /// Rays of one picture.
    pub rays: u64,
    /// Differences from one lane.
    pub widths: Differences,
    pub replayed: Comparison,
    pub own: Comparison,
    pub adversarial: Option<Adversarial>,
    /// (Ray, primitive) pairs of one picture that error bounds left to the exact
    /// fallback.
    pub escalated: u64,
    /// Times at this width, at one lane, and of the reference.
    pub times: [Time; 3],
}

/// Aimed rays, each traced for the closest hit and for any hit.
#[derive(Default)]
pub struct Adversarial {
    pub compared: Comparison,
    pub escalated: u64,
    /// Time of the lanes, for all aimed rays.
    pub took: Duration,
}

impl Adversarial {
    fn ns_per_ray(&self) -> f64 {
        self.took.as_secs_f64() * 1e9 / self.compared.counts.rays.max(1) as f64
    }
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Time {
    pub mode: &'static str,
    pub lanes: usize,
    /// Includes shading for pictures; over all threads.
    pub ns_per_ray: f64,
}

/// The value that `--json` writes: the requested mode, then all modes.
#[derive(Serialize)]
pub struct Report {
    pixels: u64,
    rays: u64,
    plan: PlanSummary,
    lanes_vs_scalar_bit_mismatches: u64,
    replay: Counts,
    independent: Counts,
    escalated: u64,
    times: Vec<Time>,
    /// From fast to exact.
    modes: Vec<Mode>,
}

impl Report {
    /// Creates the report. `modes` includes the plan's precision.
    pub fn new(pixels: u64, plan: PlanSummary, modes: Vec<Mode>) -> Report {
        let asked = modes.iter().find(|m| m.precision.name() == plan.precision);
        let asked = asked.unwrap_or(&modes[0]);
        Report {
            pixels,
            rays: asked.rays,
            lanes_vs_scalar_bit_mismatches: asked.widths.count,
            replay: asked.replayed.counts,
            independent: asked.own.counts,
            escalated: asked.escalated,
            times: modes.iter().flat_map(|mode| mode.times).collect(),
            plan,
            modes,
        }
    }

    /// Formats a table of each mode's errors and cost.
    pub fn text_report(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{} pixels, {} threads\n",
            self.pixels, self.plan.threads
        );
        let _ = writeln!(
            text,
            "{:<8} {:<12} {:>9} {:>9} {:>8} {:>12} {:>9} {:>9} {:>10} {:>10} {:>8}",
            "mode",
            "reference",
            "rays",
            "wrong hit",
            "wrong id",
            "wrong shadow",
            "t ulps",
            "max ulps",
            "normal deg",
            "exactly",
            "ns a ray"
        );
        for mode in &self.modes {
            let (rays, ns) = (mode.rays, mode.times[0].ns_per_ray);
            let cost =
                |escalated: u64, rays: u64, ns: f64| (escalated as f64 / rays.max(1) as f64, ns);
            let replay = cost(mode.escalated, rays, ns);
            let name = mode.precision.name();
            row(&mut text, [name, "replay"], &mode.replayed, Some(replay));
            row(&mut text, ["", "independent"], &mode.own, None);
            if let Some(aimed) = &mode.adversarial {
                let rays = aimed.compared.counts.rays;
                let cost = cost(aimed.escalated, rays, aimed.ns_per_ray());
                row(&mut text, ["", "adversarial"], &aimed.compared, Some(cost));
            }
        }
        let _ = writeln!(
            text,
            "\nreplay: the reference answers the same rays that the mode traced\n\
             independent: the reference traces its own rays from the camera and to the lights\n\
             t ulps: median error of t in units in the last place of the mode's numbers\n\
             exactly: pairs of a ray and a primitive decided by exact arithmetic, per ray\n"
        );
        let without: u64 = self.modes.iter().map(Mode::without_ulps).sum();
        if without > 0 {
            let _ = writeln!(
                text,
                "{without} hits are not in t ulps: their t is 0 but for the origin's rounding, or \
                 outside the range of the mode's numbers\n"
            );
        }
        for mode in &self.modes {
            let (name, lanes) = (mode.precision.name(), mode.lanes);
            let _ = writeln!(
                text,
                "{name}, {lanes} lanes against 1: {} rays differ in a bit",
                mode.widths.count
            );
            if let Some(first) = &mode.widths.first {
                let _ = writeln!(text, "  {first}");
            }
        }
        for mode in &self.modes {
            let aimed = mode.adversarial.as_ref().map(|a| &a.compared);
            let rows = [("replay", Some(&mode.replayed)), ("adversarial", aimed)];
            for (what, comparison) in rows.into_iter().chain([("independent", Some(&mode.own))]) {
                for mismatch in comparison.iter().flat_map(|c| &c.mismatches) {
                    let _ = write!(text, "\n{}, {what}: {mismatch}\n", mode.precision.name());
                }
            }
        }
        let verdicts: Vec<String> = self.modes.iter().map(Mode::verdict).collect();
        let _ = writeln!(text, "\nwrong answers: {}", verdicts.join("; "));
        text
    }

    /// Checks every mode: none may differ between widths, and `fast` may be wrong
    /// unless a limit is set.
    pub fn check(&self, allowed: Option<u64>) -> Result<(), CliError> {
        for mode in &self.modes {
            mode.check(allowed).map_err(|why| {
                let name = mode.precision.name();
                CliError::Short(format!("{name}: {why}"))
            })?;
        }
        Ok(())
    }
}

fn row(text: &mut String, names: [&str; 2], of: &Comparison, cost: Option<(f64, f64)>) {
    let (c, ulps) = (&of.counts, of.ulp_errors());
    let [mode, what] = names;
    let _ = write!(
        text,
        "{mode:<8} {what:<12} {:>9} {:>9} {:>8} {:>12} {:>9.2} {:>9.2e} {:>10.1e}",
        c.rays,
        c.wrong_hit,
        c.wrong_id,
        c.wrong_shadow,
        ulps.median,
        ulps.max,
        c.max_normal_error_deg
    );
    let _ = match cost {
        Some((exactly, ns)) => writeln!(text, " {exactly:>10.4} {ns:>8.1}"),
        None => writeln!(text),
    };
}

impl Mode {
    fn without_ulps(&self) -> u64 {
        let aimed = self.adversarial.as_ref();
        let aimed = aimed.map_or(0, |a| a.compared.counts.without_ulps);
        self.replayed.counts.without_ulps + self.own.counts.without_ulps + aimed
    }

    /// Says in how many of all its answers the mode was wrong. Rays of the reference's own picture are
    /// told apart: they leave from points that are rounded otherwise.
    fn verdict(&self) -> String {
        let aimed = self.adversarial.as_ref().map(|aimed| &aimed.compared);
        let all = [Some(&self.replayed), aimed];
        let (mut wrong, mut rays) = (0, 0);
        for comparison in all.into_iter().flatten() {
            wrong += comparison.counts.wrong();
            rays += comparison.counts.rays;
        }
        let note = match self.precision {
            Precision::Fast => ", which has no bound",
            Precision::Guarded | Precision::Exact => "",
        };
        let own = match self.own.counts.wrong() {
            0 => String::new(),
            more => format!(", and {more} differ from the reference's own picture"),
        };
        format!("{} {wrong} of {rays}{note}{own}", self.precision.name())
    }

    fn check(&self, allowed: Option<u64>) -> Result<(), String> {
        let differing = self.widths.count;
        if differing > 0 {
            return Err(format!(
                "{differing} rays differ between packets and one lane"
            ));
        }
        let allowed = match (allowed, self.precision) {
            (Some(allowed), _) => allowed,
            (None, Precision::Fast) => return Ok(()),
            (None, Precision::Guarded | Precision::Exact) => 0,
        };
        let wrong = self.replayed.counts.wrong();
        let aimed = self.adversarial.as_ref();
        let wrong_aimed = aimed.map_or(0, |a| a.compared.counts.wrong());
        let error = self.replayed.counts.max_rel_t_error;
        if self.precision == Precision::Exact && (error.is_nan() || error > MAX_T_ERROR) {
            return Err(format!(
                "the relative error of a t is {error:.1e}; {MAX_T_ERROR:.0e} is allowed"
            ));
        }
        if wrong + wrong_aimed > allowed {
            let aimed = match wrong_aimed {
                0 => String::new(),
                n => format!(" and {n} adversarial ones"),
            };
            return Err(format!(
                "{wrong} replayed rays{aimed} are wrong; {allowed} are allowed"
            ));
        }
        Ok(())
    }
}

impl Serialize for Mode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let share = |escalated: u64, rays: u64| escalated as f64 / rays.max(1) as f64;
        let mut s = serializer.serialize_struct("Mode", 12)?;
        s.serialize_field("precision", self.precision.name())?;
        s.serialize_field("lanes", &self.lanes)?;
        s.serialize_field("rays", &self.rays)?;
        let differing = self.widths.count;
        s.serialize_field("lanes_vs_scalar_bit_mismatches", &differing)?;
        s.serialize_field("replay", &self.replayed.counts)?;
        s.serialize_field("independent", &self.own.counts)?;
        s.serialize_field("t_ulps", &self.replayed.ulp_errors())?;
        s.serialize_field("wrong_kinds", &self.replayed.wrong_kinds)?;
        s.serialize_field("escalated", &self.escalated)?;
        s.serialize_field("escalated_per_ray", &share(self.escalated, self.rays))?;
        s.serialize_field("ns_per_ray", &self.times[0].ns_per_ray)?;
        s.serialize_field("adversarial", &self.adversarial)?;
        s.end()
    }
}

impl Serialize for Adversarial {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Fields<'a> {
            #[serde(flatten)]
            counts: Counts,
            t_ulps: UlpErrors,
            wrong_kinds: &'a BTreeMap<String, u64>,
            escalated: u64,
            ns_per_ray: f64,
        }
        let fields = Fields {
            counts: self.compared.counts,
            t_ulps: self.compared.ulp_errors(),
            wrong_kinds: &self.compared.wrong_kinds,
            escalated: self.escalated,
            ns_per_ray: self.ns_per_ray(),
        };
        fields.serialize(serializer)
    }
}
