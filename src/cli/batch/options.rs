//! Options of `lanecast render` as the keys of a table: the command's own definition says which
//! there are, and what they take.

use super::job::nearest;
use crate::args::RenderArgs;
use clap::{ArgAction, Command, FromArgMatches};
use serde_json::{Map, Value};
use std::ffi::OsString;

/// Options that are none of a job's, and what is in their place.
const OF_THE_JOB: [(&str, &str); 17] = [
    (
        "accuracy",
        "it is measured scene by scene; lanecast tradeoff names the options that keep it",
    ),
    ("display", "pictures of tasks go to files"),
    ("output", "name pictures by output = \"{scene}.png\""),
    (
        "camera",
        "name cameras by camera = [\"front\"], beside [render]",
    ),
    ("view", "name views by view = [\"front\"], beside [render]"),
    (
        "orbit",
        "ask for views by orbit = { views = 12 }, beside [render]",
    ),
    (
        "frames",
        "number frames by frame = \"0-47\", beside [render]",
    ),
    ("samples", "a task is a whole picture"),
    (
        "cache-file",
        "tasks are done in any order, and each makes its own records",
    ),
    (
        "cache-keep",
        "tasks are done in any order, and each makes its own records",
    ),
    ("tile", "ask for tiles by tile = \"4x4\", beside [render]"),
    ("threads", "that is an option of lanecast batch"),
    ("progress", "that is an option of lanecast batch"),
    ("stats", "the records have the statistics of each task"),
    ("json", "the records have the statistics of each task"),
    ("help", "that is for people"),
    ("version", "that is for people"),
];

/// Options that are on or off, whose `false` is `off`; of others it takes the option out.
const ON_OFF: [&str; 2] = ["dither", "shadow-cache"];

/// Returns the name of an option on the command line.
pub fn name_of(key: &str) -> String {
    key.replace('_', "-")
}

/// Returns the arguments that a table of options stands for. Fails with the key and the remedy.
pub fn arguments(options: &Map<String, Value>, render: &Command) -> Result<Vec<String>, String> {
    let mut arguments = Vec::new();
    for (key, value) in options {
        let name = name_of(key);
        if let Some((_, instead)) = OF_THE_JOB.iter().find(|(of_job, _)| *of_job == name) {
            return Err(format!("{key} is no option here: {instead}"));
        }
        let known = || {
            render
                .get_arguments()
                .filter(|arg| arg.get_long().is_some())
        };
        let Some(arg) = known().find(|arg| is_named(arg, &name)) else {
            let names = known().filter_map(|arg| arg.get_long());
            let hint = nearest(&name, names).map(|near| format!("did you mean {near}? "));
            return Err(format!(
                "{key} is no option of lanecast render; {}lanecast render --help lists them",
                hint.unwrap_or_default()
            ));
        };
        let is_flag = matches!(arg.get_action(), ArgAction::SetTrue);
        let repeats = matches!(arg.get_action(), ArgAction::Append);
        match value {
            Value::Bool(is_on) if is_flag => arguments.extend(is_on.then(|| format!("--{name}"))),
            Value::Bool(is_on) if ON_OFF.contains(&&name[..]) => {
                arguments.push(format!("--{name}={}", if *is_on { "on" } else { "off" }));
            }
            Value::Bool(false) => {}
            Value::Bool(true) if arg.get_num_args().is_some_and(|n| n.min_values() == 0) => {
                arguments.push(format!("--{name}"));
            }
            Value::Bool(true) => {
                return Err(format!(
                    "{key} takes a value; write it, or false to leave the option out"
                ));
            }
            _ if is_flag => return Err(format!("{key} is true or false")),
            Value::Array(list) if repeats => {
                for value in list {
                    arguments.push(format!("--{name}={}", text(key, value)?));
                }
            }
            Value::Array(list) => {
                let list: Result<Vec<String>, _> = list.iter().map(|v| text(key, v)).collect();
                arguments.push(format!("--{name}={}", list?.join(",")));
            }
            value => arguments.push(format!("--{name}={}", text(key, value)?)),
        }
    }
    Ok(arguments)
}

/// Writes a value as the command line has it.
fn text(key: &str, value: &Value) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Number(number) => Ok(number.to_string()),
        Value::Bool(_) | Value::Array(_) | Value::Object(_) | Value::Null => Err(format!(
            "{key} is a text, a number, a list of these, or false, as lanecast render has it"
        )),
    }
}

/// Parses arguments after `lanecast render`. Fails with what the command would say, as one line.
pub fn parsed(render: &mut Command, arguments: &[OsString]) -> Result<RenderArgs, String> {
    let name = OsString::from("render");
    let line = std::iter::once(&name).chain(arguments);
    let parsed = render.try_get_matches_from_mut(line);
    let parsed = parsed.and_then(|matches| RenderArgs::from_arg_matches(&matches));
    parsed.map_err(|e| {
        let said = e.render().to_string();
        let said = said.strip_prefix("error: ").unwrap_or(&said);
        // What follows is how the command is used.
        let said = said.split("\n\n").next().unwrap_or(said);
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    })
}

/// Says whether an option has a name, or an older one that is still taken.
fn is_named(arg: &clap::Arg, name: &str) -> bool {
    let others = arg.get_all_aliases().unwrap_or_default();
    arg.get_long() == Some(name) || others.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Args;
    use serde_json::json;

    fn render() -> Command {
        RenderArgs::augment_args(Command::new("render"))
    }

    fn of(options: Value) -> Result<Vec<String>, String> {
        arguments(options.as_object().unwrap(), &render())
    }

    #[test]
    fn older_names_of_options_are_taken() {
        let is = ["--max-depth=3", "--tone=agx"];
        assert_eq!(of(json!({"max_depth": 3, "tone": "agx"})).unwrap(), is);
        assert!(
            RenderArgs::augment_args(Command::new("render"))
                .try_get_matches_from(["render", is[0], is[1]])
                .is_ok()
        );
    }

    #[test]
    fn false_takes_an_option_out() {
        let none = json!({"noise": false, "variant": false, "clip": false, "ground": false});
        assert_eq!(of(none).unwrap(), [""; 0]);
        let some = json!({"dither": false, "shadow_cache": true, "ground": true, "spp": 4});
        let is = ["--dither=off", "--ground", "--shadow-cache=on", "--spp=4"];
        assert_eq!(of(some).unwrap(), is);
        let texts = json!({"clip": ["1,0,0,0", "0,1,0,0"], "aov": ["depth", "uv"]});
        let is = ["--aov=depth,uv", "--clip=1,0,0,0", "--clip=0,1,0,0"];
        assert_eq!(of(texts).unwrap(), is);
        for (wrong, says) in [
            (json!({"spp": true}), "spp takes a value"),
            (json!({"clip": [false]}), "a list of these"),
            (json!({"ground": 1}), "ground is true or false"),
        ] {
            let said = of(wrong).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
    }

    /// What takes on and off, and not any text, is an option of these.
    #[test]
    fn on_and_off_are_values_of_few_options() {
        let takes = |name: &str, value: &str| {
            let arguments = ["render".to_owned(), format!("--{name}={value}")];
            let parsed = render().try_get_matches_from(arguments);
            parsed.is_ok_and(|matches| matches.contains_id(&name.replace('-', "_")))
        };
        let all = render();
        let names = all.get_arguments().filter_map(|arg| arg.get_long());
        let found: Vec<&str> = names
            .filter(|name| takes(name, "on") && takes(name, "off") && !takes(name, "x"))
            .collect();
        assert_eq!(found.len(), ON_OFF.len(), "{found:?}");
        assert!(found.iter().all(|name| ON_OFF.contains(name)), "{found:?}");
    }
}
