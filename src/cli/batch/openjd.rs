//! `lanecast export JOB --openjd`: a job as a template of Open Job Description, version 2023-09, with
//! the extension TASK_CHUNKING.
//!
//! A step renders the tasks in chunks, and one after it joins the records and the tiles. Paths are
//! parameters: those who submit the job, and the engine, say where things are.

use super::job::Job;
use super::key::relative;
use super::tasks::Tasks;
use crate::error::CliError;
use crate::output::{Results, Sink, check_destinations, complain, print, printable_line};
use std::path::{Component, Path, PathBuf, absolute};

/// The most tasks of a chunk that AWS Deadline Cloud takes.
const MOST_OF_CHUNK: usize = 150;

/// Fewer tasks of a chunk are not worth a process, unless engines measure that they are.
const LEAST_OF_CHUNK: usize = 10;

/// The most characters of a job's name in the format.
const MOST_OF_NAME: usize = 128;

/// Writes the template of a job; `render` is the definition of `lanecast render`.
pub fn export(job: &Path, sink: &Sink, render: clap::Command) -> Result<(), CliError> {
    let file = match sink {
        Sink::Stdout => None,
        Sink::File(path) => Some(path.as_path()),
    };
    let is_yaml = |path: &Path| {
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        extension.is_some_and(|e| e == "yaml" || e == "yml")
    };
    if let Some(path) = file.filter(|path| !is_yaml(path)) {
        return Err(CliError::Usage(format!(
            "{}: engines know templates by their ending; name a .yaml",
            path.display()
        )));
    }
    check_destinations(&[job], &[], [sink].into_iter())?;
    let tasks = Tasks::new(&Job::read(job)?, job, render)?;
    if let Some(scene) = tasks.scenes().find(|scene| is_outside(scene)) {
        complain(&format!(
            "warning: {} is not below the folder of the job; engines that copy files copy that \
             folder alone",
            scene.display()
        ));
    }
    let folder = file.and_then(|file| below(&folder_of(job)?, &folder_of(file)?));
    let text = template(job, folder.as_deref(), (tasks.len(), tasks.of_one_scene()));
    let Some(path) = file else {
        return print(&text);
    };
    let mut results = Results::default();
    results.outputs.add(path, text.into_bytes())?;
    let name = printable_line(&path.display().to_string());
    results.commit(&format!("{name}: {} tasks\n", tasks.len()))
}

/// Says whether a scene lies elsewhere than below the folder that it counts from.
fn is_outside(scene: &Path) -> bool {
    let inside = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
    !scene.components().all(inside)
}

fn folder_of(file: &Path) -> Option<PathBuf> {
    Some(absolute(file).ok()?.parent()?.to_path_buf())
}

/// Returns the way from the template's folder down to the job's: engines take no other default of a
/// path.
fn below(folder: &Path, template: &Path) -> Option<PathBuf> {
    let way = relative(folder, template);
    let way = match way.as_os_str().is_empty() {
        true => ".".into(),
        false => way,
    };
    (!is_outside(&way)).then_some(way)
}

/// Writes a text as YAML has it in quotes, which is how JSON has it.
fn quoted(text: &str) -> String {
    serde_json::to_string(text).unwrap_or_default()
}

/// Writes the template of so many tasks, of which each scene has some.
fn template(job: &Path, folder: Option<&Path>, (count, of_one_scene): (usize, usize)) -> String {
    let file = job.file_name().unwrap_or_default().to_string_lossy();
    let stem = job.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: &char| !c.is_control() && !matches!(c, '{' | '}');
    let name: String = stem.chars().filter(plain).take(MOST_OF_NAME).collect();
    let name = quoted(if name.is_empty() { "lanecast" } else { &name });
    let folder = folder.map_or(String::new(), |folder| {
        format!("\n    default: {}", quoted(&folder.to_string_lossy()))
    });
    let chunk = of_one_scene.clamp(LEAST_OF_CHUNK, MOST_OF_CHUNK).min(count);
    let tasks = match count {
        1 => "0".to_owned(),
        count => format!("0-{}", count - 1),
    };
    let file = quoted(&file);
    format!(
        r#"specificationVersion: jobtemplate-2023-09
extensions: [TASK_CHUNKING]
name: {name}
parameterDefinitions:
  - name: Folder
    type: PATH
    objectType: DIRECTORY
    dataFlow: IN
    description: The folder of the job file, and of its scenes{folder}
  - name: Job
    type: STRING
    description: The job file in Folder
    default: {file}
  - name: Out
    type: PATH
    objectType: DIRECTORY
    dataFlow: OUT
    description: The folder of the pictures, common to all workers
  - name: Lanecast
    type: STRING
    description: The program, by its name or path on the workers
    default: lanecast
  - name: Tasks
    type: STRING
    description: Numbers of tasks, such as 0-99,120
    default: "{tasks}"
  - name: ChunkSize
    type: INT
    description: Tasks of one process, at first
    minValue: 1
    maxValue: {MOST_OF_CHUNK}
    default: {chunk}
steps:
  - name: Render
    parameterSpace:
      taskParameterDefinitions:
        - name: Task
          type: CHUNK[INT]
          range: "{{{{Param.Tasks}}}}"
          chunks:
            defaultTaskCount: "{{{{Param.ChunkSize}}}}"
            targetRuntimeSeconds: 60
            rangeConstraint: NONCONTIGUOUS
    script:
      actions:
        onRun:
          command: "{{{{Param.Lanecast}}}}"
          args:
            - batch
            - "{{{{Param.Folder}}}}/{{{{Param.Job}}}}"
            - --out
            - "{{{{Param.Out}}}}"
            - --tasks
            - "{{{{Task.Param.Task}}}}"
            - --progress
            - openjd
          cancelation:
            mode: NOTIFY_THEN_TERMINATE
            notifyPeriodInSeconds: 10
  - name: Merge
    dependencies:
      - dependsOn: Render
    script:
      actions:
        onRun:
          command: "{{{{Param.Lanecast}}}}"
          args:
            - batch
            - "{{{{Param.Folder}}}}/{{{{Param.Job}}}}"
            - --out
            - "{{{{Param.Out}}}}"
            - --tasks
            - "{{{{Param.Tasks}}}}"
            - --merge
            - --progress
            - openjd
          cancelation:
            mode: NOTIFY_THEN_TERMINATE
            notifyPeriodInSeconds: 10
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_texts_of_the_template() {
        let text = template("a/{{x}}\"\n.toml".as_ref(), None, (480, 12));
        assert!(text.contains(r#"name: "x\"""#), "{text}");
        assert!(text.contains(r#"default: "{{x}}\"\n.toml""#), "{text}");
        assert!(text.contains("default: \"0-479\"") && text.contains("default: 12\n"));
        let text = template("j.toml".as_ref(), Some("parts".as_ref()), (1, 1));
        assert!(text.contains("default: \"parts\"") && text.contains("default: \"0\""));
    }

    #[test]
    fn defaults_lead_down_from_the_template() {
        let of = |job: &str, template: &str| below(job.as_ref(), template.as_ref());
        assert_eq!(of("/a/b", "/a"), Some("b".into()));
        assert_eq!(of("/a", "/a"), Some(".".into()));
        assert_eq!(of("/a", "/a/b"), None);
    }
}
