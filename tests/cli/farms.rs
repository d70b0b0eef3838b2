//! What farms see of the command: lines of progress, templates, signals, and memory.

use crate::run::{BALL, folder, lanecast, names, stderr, stdout};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A folder with two scenes of equal bytes and another one, and a job of eighteen pictures.
fn job() -> tempfile::TempDir {
    let folder = folder();
    fs::create_dir(folder.path().join("s")).unwrap();
    for name in ["s/a.toml", "s/b.toml"] {
        fs::write(folder.path().join(name), BALL).unwrap();
    }
    // Not a smaller ball, which a view that frames it shows as large.
    let block = BALL.replace(
        "sphere = { center = [0, 0, 0], radius = 1 }",
        "box = { min = [-1, -1, -1], max = [1, 1, 1] }",
    );
    assert_ne!(block, BALL);
    fs::write(folder.path().join("s/c.toml"), block).unwrap();
    let job = "format = 1\nscene = \"s/*.toml\"\norbit = { views = 3 }\n\
               variant = [{ name = \"one\", spp = 1 }, { name = \"two\", spp = 2 }]\n\
               [render]\nsize = \"40x36\"\n";
    fs::write(folder.path().join("job.toml"), job).unwrap();
    folder
}

fn run(folder: &Path, line: &str) -> std::process::Output {
    lanecast(folder, &line.split_whitespace().collect::<Vec<_>>())
}

/// The percentages of a run's lines with a beginning.
fn percentages(said: &str, beginning: &str) -> Vec<f64> {
    let lines = said.lines().filter_map(|line| line.strip_prefix(beginning));
    let numbers = lines.map(|number| number.trim_end_matches('%').parse().unwrap());
    let numbers: Vec<f64> = numbers.collect();
    assert!(numbers.is_sorted() && numbers.iter().all(|p| (0.0..=100.0).contains(p)));
    numbers
}

#[test]
fn engines_read_progress_from_standard_output() {
    let folder = job();
    let path = folder.path();
    for line in [
        "batch job.toml --out o",
        "render s/a.toml --size 40x36 -o x.png",
        "render s/a.toml --size 40x36 --frames 3 -o x.png",
    ] {
        let done = run(path, &format!("{line} --progress openjd"));
        assert!(done.status.success(), "{}", stderr(&done));
        let shown = percentages(stdout(&done), "openjd_progress: ");
        assert_eq!(shown.last(), Some(&100.0), "{}", stdout(&done));
        assert!(stdout(&done).contains("openjd_status: "));
        fs::remove_dir_all(path.join("o")).ok();
        let done = run(path, &format!("{line} --progress afanasy"));
        let shown = percentages(stdout(&done), "PROGRESS: ");
        assert_eq!(shown.last(), Some(&100.0), "{}", stdout(&done));
    }
    for line in ["render gone.toml", "batch gone.toml --out o"] {
        let failed = run(path, &format!("{line} --progress openjd"));
        assert_eq!(failed.status.code(), Some(3));
        let why = stderr(&failed).strip_prefix("error: ").unwrap();
        assert_eq!(stdout(&failed), format!("openjd_fail: {why}"));
    }
    for line in [
        "render s/a.toml --json - --progress openjd",
        "batch job.toml --out o --json --progress afanasy",
        "measure s/a.toml --json - --progress openjd",
    ] {
        let failed = run(path, line);
        assert_eq!(failed.status.code(), Some(2), "{line}");
        assert!(stderr(&failed).contains("give these a file"), "{line}");
    }
}

#[test]
fn a_job_is_a_template_of_open_job_description() {
    let folder = job();
    let path = folder.path();
    let done = run(path, "export job.toml --openjd job.yaml");
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(stderr(&done), "");
    let text = fs::read_to_string(path.join("job.yaml")).unwrap();
    for line in [
        "specificationVersion: jobtemplate-2023-09",
        "extensions: [TASK_CHUNKING]",
        "name: \"job\"",
        "    default: \".\"",
        "    default: \"job.toml\"",
        "    default: \"0-17\"",
        "          type: CHUNK[INT]",
        "      - dependsOn: Render",
        "            mode: NOTIFY_THEN_TERMINATE",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
    // To standard output nothing is known of the template's folder.
    let printed = run(path, "export job.toml --openjd -");
    assert_eq!(stdout(&printed), text.replace("\n    default: \".\"", ""));
    for (line, code, says) in [
        ("export job.toml --openjd job.json", 2, "name a .yaml"),
        (
            "export gone.toml --openjd -",
            3,
            "gone.toml: cannot be read",
        ),
        (
            "export job.toml --openjd - --pov -",
            2,
            "cannot be used with",
        ),
        ("export job.toml --openjd - --fit", 2, "cannot be used with"),
        (
            "export job.toml --openjd - --clip 1,0,0,0",
            2,
            "cannot be used with",
        ),
        ("export s/a.toml --openjd -", 3, "s/a.toml:2:1: "),
    ] {
        let failed = run(path, line);
        assert_eq!(failed.status.code(), Some(code), "{line}");
        assert!(
            stderr(&failed).contains(says),
            "{line}: {}",
            stderr(&failed)
        );
    }
    fs::write(
        path.join("s/out.toml"),
        "format = 1\nscene = \"../s/a.toml\"\n",
    )
    .unwrap();
    let outside = run(path, "export s/out.toml --openjd -");
    assert!(
        stderr(&outside).contains("is not below the folder"),
        "{}",
        stderr(&outside)
    );
}

/// Of equal files one is read; with little room each is, and no bit differs.
#[test]
fn memory_changes_no_bit() {
    let folder = job();
    let path = folder.path();
    let pictures = |folder: &str| {
        let all = names(&path.join(folder)).into_iter();
        let all = all.filter(|name| name.ends_with(".png"));
        let all: Vec<_> = all
            .map(|n| (fs::read(path.join(folder).join(&n)).unwrap(), n))
            .collect();
        assert_eq!(all.len(), 18);
        all
    };
    // A process for each scene shares nothing.
    for tasks in ["0-5", "6-11", "12-17"] {
        let done = run(path, &format!("batch job.toml --out apart --tasks {tasks}"));
        assert!(done.status.success(), "{}", stderr(&done));
    }
    for (out, more) in [
        ("plain", ""),
        ("wide", "--memory 1G"),
        ("tight", "--memory 1"),
    ] {
        let done = run(path, &format!("batch job.toml --out {out} {more}"));
        assert!(done.status.success(), "{}", stderr(&done));
        // Scenes by turns, of which with little room each goes before it is needed again.
        let turns = run(
            path,
            &format!(
                "batch job.toml --out {out}2 {more} --tasks 0,6,12,1,7,13,2,8,14,3-5,9-11,15-17"
            ),
        );
        assert!(turns.status.success(), "{}", stderr(&turns));
        assert!(
            pictures(out) == pictures("apart") && pictures(&format!("{out}2")) == pictures("apart")
        );
    }
    let wrong = run(path, "batch job.toml --out o --memory lots");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        stderr(&wrong).contains("such as 800M or 4G"),
        "{}",
        stderr(&wrong)
    );
}

/// SIGTERM, as engines cancel a task, leaves what is done, and nothing that is not.
#[cfg(unix)]
#[test]
fn a_cancelled_run_ends_with_130_and_goes_on() {
    let folder = job();
    let path = folder.path();
    let text = fs::read_to_string(path.join("job.toml")).unwrap();
    let text = text
        .replace("40x36", "400x360")
        .replace("spp = 1", "spp = 64");
    fs::write(path.join("job.toml"), text).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .current_dir(path)
        .args([
            "batch",
            "job.toml",
            "--out",
            "o",
            "--threads",
            "1",
            "--progress",
            "openjd",
        ])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !path.join("o/records").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let kill = Command::new("kill").arg(child.id().to_string()).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let whole = |name: &String| name == "records" || name.ends_with(".png");
    assert!(
        names(&path.join("o")).iter().all(whole),
        "{:?}",
        names(&path.join("o"))
    );
    assert!(run(path, "batch job.toml --out o").status.success());
}
