//! The table `[random]` of a job: options that are drawn anew for each picture.
//!
//! A number depends on the seed, the name of its option, its place there and the number of the draw
//! alone. So a task has the same options on every machine and in every shard, and another option
//! beside changes none of them.

use clap::Command;
use lanecast_picture::render::{mix, unit};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};

/// The most draws of a job.
const MOST: u32 = 10_000_000;

/// Options by chance. What is beside `count` and `seed` names an option of `lanecast render`: a
/// range `[from, to]` of numbers, a list of numbers and ranges that are joined by commas, or
/// `{ choose = [...] }`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
pub struct Random {
    /// Pictures of each view and variant.
    pub count: u32,
    /// Other seeds give other numbers; 0.
    #[serde(default)]
    pub seed: u64,
    #[serde(flatten)]
    pub options: Map<String, Value>,
}

/// Options that say from where a scene is seen.
const OF_VIEWS: [&str; 4] = ["orbit", "eye", "pose", "look-at"];

/// Options that a job has elsewhere.
const ELSEWHERE: [&str; 12] = [
    "output", "camera", "view", "frames", "samples", "threads", "progress", "stats", "json",
    "help", "version", "k",
];

/// Options by which a scene is read.
const OF_SCENES: [&str; 9] = [
    "variant",
    "animation",
    "clip",
    "hatch",
    "point-radius",
    "allow-outside",
    "scad-curves",
    "format",
    "z-up",
];

/// Options whose numbers are whole. A range of them is drawn with both of its ends.
const WHOLE: [&str; 7] = [
    "cryptomatte-levels",
    "spp",
    "max-spp",
    "max-bounces",
    "shutter-slices",
    "kd-depth",
    "kd-leaf",
];

/// A number that is drawn, or that is always the same.
enum Part {
    Fixed(f64),
    Range(f64, f64),
}

impl Random {
    /// Checks names and ranges, by the definition of `lanecast render`. `has_views` says whether the
    /// job has views of its own, `fixed` which options it sets.
    pub fn check(
        &self,
        render: &Command,
        has_views: bool,
        fixed: &dyn Fn(&str) -> bool,
    ) -> Result<(), String> {
        if !(1..=MOST).contains(&self.count) {
            return Err(format!("count is a number from 1 to {MOST}"));
        }
        for (key, value) in &self.options {
            let name = name_of(key);
            let mut known = render.get_arguments().filter_map(|arg| arg.get_long());
            if ELSEWHERE.contains(&&name[..]) || !known.any(|known| known == name) {
                return Err(format!(
                    "{key} is no option that can be drawn; lanecast render --help lists what there is"
                ));
            }
            if OF_VIEWS.contains(&&name[..]) && has_views {
                return Err(format!(
                    "{key} says from where scenes are seen, and so do camera, view and orbit beside \
                     [render]; leave these out"
                ));
            }
            if fixed(&name) {
                return Err(format!(
                    "{key} is set in [render] or a variant, too; leave it out there"
                ));
            }
            let first = drawn(&name, value, &mut || 0.0);
            first.map_err(|why| format!("{key}: {why}"))?;
        }
        Ok(())
    }

    /// Says whether scenes are read otherwise for each draw.
    pub fn changes_scenes(&self) -> bool {
        let changes = |key: &String| OF_SCENES.contains(&&name_of(key)[..]);
        self.options.keys().any(changes)
    }

    /// Returns the options of a draw.
    pub fn arguments(&self, draw: u32) -> Vec<String> {
        let options = self.options.iter();
        let each = options.map(|(key, value)| {
            let name = name_of(key);
            let mut place = 0;
            let mut next = || {
                place += 1;
                number(self.seed, &name, place, draw)
            };
            // Checked before.
            let text = drawn(&name, value, &mut next).unwrap_or_default();
            format!("--{name}={text}")
        });
        each.collect()
    }
}

fn name_of(key: &str) -> String {
    key.replace('_', "-")
}

/// Returns a number of [0, 1).
fn number(seed: u64, name: &str, place: u64, draw: u32) -> f64 {
    let named = name
        .bytes()
        .fold(mix(seed), |hash, byte| mix(hash ^ u64::from(byte)));
    unit(mix(mix(named ^ place) ^ u64::from(draw)))
}

/// Writes the value of the option `name` with numbers of [0, 1) from `next`.
fn drawn(name: &str, value: &Value, next: &mut dyn FnMut() -> f64) -> Result<String, String> {
    if let Some(Value::Array(choices)) = value.get("choose") {
        let place = (next() * choices.len() as f64) as usize;
        let chosen = choices.get(place).ok_or("choose is an empty list")?;
        let texts: Result<Vec<String>, String> = choices.iter().map(text).collect();
        texts?;
        return text(chosen);
    }
    let Value::Array(list) = value else {
        return Err(
            "write a range as [from, to], a list of numbers and ranges, or { choose = [\"a\", \
             \"b\"] }; what is always the same belongs into [render]"
                .into(),
        );
    };
    let parts = match range(value) {
        Some(range) => vec![range],
        None => list
            .iter()
            .map(part)
            .collect::<Result<Vec<Part>, String>>()?,
    };
    if let [Part::Fixed(from), Part::Fixed(to)] = parts[..]
        && from > to
    {
        return Err(format!(
            "the range goes from {from} down to {to}; write [{to}, {from}]"
        ));
    }
    if !parts.iter().any(|part| matches!(part, Part::Range(..))) {
        return Err(
            "no number of it is a range; what is always the same belongs into [render]".into(),
        );
    }
    let is_whole = WHOLE.contains(&name);
    let is_split = |part: &Part| match part {
        Part::Fixed(x) => x.fract() != 0.0,
        Part::Range(from, to) => from.fract() != 0.0 || to.fract() != 0.0,
    };
    if is_whole && parts.iter().any(is_split) {
        return Err("it takes whole numbers; write a range of them, such as [1, 8]".into());
    }
    let texts = parts.iter().map(|part| match part {
        Part::Fixed(x) => x.to_string(),
        Part::Range(from, to) if is_whole => {
            let steps = (next() * (to - from + 1.0)).floor();
            (from + steps).min(*to).to_string()
        }
        Part::Range(from, to) => {
            let share = next();
            (from * (1.0 - share) + to * share).to_string()
        }
    });
    Ok(texts.collect::<Vec<_>>().join(","))
}

fn part(value: &Value) -> Result<Part, String> {
    let fixed = value.as_f64().map(Part::Fixed);
    let wrong = || format!("{value} is neither a number nor a range [from, to] with from <= to");
    fixed.or_else(|| range(value)).ok_or_else(wrong)
}

fn range(value: &Value) -> Option<Part> {
    match value.as_array()?.as_slice() {
        [from, to] => {
            let (from, to) = (from.as_f64()?, to.as_f64()?);
            (from <= to).then_some(Part::Range(from, to))
        }
        _ => None,
    }
}

fn text(value: &Value) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        _ => Err(format!("{value} is neither a text nor a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::RenderArgs;
    use clap::Args;
    use std::any::TypeId;

    fn random(text: &str) -> Random {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn a_draw_depends_on_its_number_and_its_option_alone() {
        let few = random("count = 9\nseed = 7\nexposure = [-1.0, 1.0]");
        let more = random(
            "count = 5\nseed = 7\nexposure = [-1.0, 1.0]\nbackground = { choose = [\"black\", \"white\"] }\n\
             orbit = [[0, 360], [10, 60], 40]",
        );
        for draw in 0..9 {
            let exposure = |random: &Random| {
                let all = random.arguments(draw).into_iter();
                all.filter(|a| a.starts_with("--exposure="))
                    .collect::<Vec<_>>()
            };
            assert_eq!(exposure(&few), exposure(&more));
        }
        // These are pinned: a data set that goes on must not change.
        assert_eq!(few.arguments(17), PINNED);
        let orbits: Vec<String> = (0..1000).map(|i| more.arguments(i)[2].clone()).collect();
        let mut seen = orbits.clone();
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), 1000);
        for orbit in &orbits {
            let numbers: Vec<f64> = orbit[8..].split(',').map(|x| x.parse().unwrap()).collect();
            assert!((0.0..360.0).contains(&numbers[0]) && (10.0..60.0).contains(&numbers[1]));
            assert_eq!(numbers[2], 40.0);
        }
        let mean = |k: usize| -> f64 {
            let number =
                |orbit: &String| -> f64 { orbit[8..].split(',').nth(k).unwrap().parse().unwrap() };
            orbits.iter().map(number).sum::<f64>() / 1000.0
        };
        // Three standard deviations of the mean of 1,000 numbers.
        assert!((mean(0) - 180.0).abs() < 9.9, "{}", mean(0));
        assert!((mean(1) - 35.0).abs() < 1.4, "{}", mean(1));
    }

    const PINNED: [&str; 1] = ["--exposure=0.626283407676965"];

    #[test]
    fn what_is_wrong_is_said() {
        let said = |text: &str| {
            drawn(
                "x",
                &random(&format!("count = 1\nx = {text}")).options["x"],
                &mut || 0.0,
            )
        };
        assert!(said("3").unwrap_err().contains("[render]"));
        assert!(said("[1, 2, 3]").unwrap_err().contains("no number of it"));
        assert!(said("[2, 1]").unwrap_err().contains("write [1, 2]"));
        assert!(said("[[2, 1]]").unwrap_err().contains("from <= to"));
        assert!(said("{ choose = [] }").unwrap_err().contains("empty"));
        assert_eq!(said("[1, 2]").unwrap(), "1");
        assert_eq!(said("[[1, 2], 5]").unwrap(), "1,5");
    }

    #[test]
    fn whole_numbers_are_drawn_of_options_that_take_them() {
        let spp = random("count = 400\nspp = [1, 4]\nkd_depth = [7, 7]");
        let mut counts = [0; 4];
        for draw in 0..400 {
            let arguments = spp.arguments(draw);
            assert_eq!(arguments[0], "--kd-depth=7");
            let spp: usize = arguments[1]["--spp=".len()..].parse().unwrap();
            counts[spp - 1] += 1;
        }
        // A hundred each, within four standard deviations.
        assert!(
            counts.iter().all(|count| (65..=135).contains(count)),
            "{counts:?}"
        );
        let split = drawn(
            "spp",
            &random("count = 1\nspp = [1, 4.5]").options["spp"],
            &mut || 0.0,
        );
        assert!(split.unwrap_err().contains("whole numbers"));
        // All options that take whole numbers, and may be drawn, are known for it.
        let render = RenderArgs::augment_args(Command::new("render"));
        for argument in render.get_arguments() {
            let name = argument.get_long().unwrap_or_default();
            let takes = argument.get_value_parser().type_id() == TypeId::of::<u32>();
            let is_drawn = !ELSEWHERE.contains(&name) && !name.is_empty();
            assert_eq!(WHOLE.contains(&name), takes && is_drawn, "{name}");
        }
    }
}
