//! What `lanecast batch` says where a job, an option or a folder is wrong, and what it leaves.

use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

const BALL: &str = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                    [[instance]]\nshape = \"ball\"\n";
const SMALL: &str = "render = { size = \"9x7\", spp = 1 }\n";

/// A folder with scenes and a job over them, of which `more` is the rest.
fn job(more: &str) -> tempfile::TempDir {
    let folder = folder();
    for name in ["a", "b", "c"] {
        fs::write(folder.path().join(format!("{name}.toml")), BALL).unwrap();
    }
    let text = format!("format = 1\nscene = [\"a.toml\", \"b.toml\", \"c.toml\"]\n{SMALL}{more}");
    fs::write(folder.path().join("job.toml"), text).unwrap();
    folder
}

fn batch(folder: &Path, arguments: &[&str]) -> std::process::Output {
    lanecast(folder, &[&["batch", "job.toml"], arguments].concat())
}

/// Asserts that a job is refused with this text, and that nothing is made.
fn refused(text: &str, says: &str) {
    let folder = job("");
    fs::write(folder.path().join("job.toml"), text).unwrap();
    let done = batch(folder.path(), &["--out", "o"]);
    let said = stderr(&done);
    assert_eq!(done.status.code(), Some(3), "{text}: {said}");
    assert!(
        said.contains(says) && said.starts_with("error: job.toml"),
        "{text}: {said}"
    );
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(!folder.path().join("o").exists());
}

#[test]
fn wrong_jobs_are_refused_before_any_work() {
    let job = |more: &str| format!("format = 1\nscene = \"a.toml\"\n{more}");
    refused("format = 1\n", "missing field `scene`");
    refused("format = 1\nscene = []\n", "the list is empty");
    refused(&job("view = []"), "the list is empty");
    refused("format = 1\nscene = \"*.glb\"\n", "'*.glb' matches no file");
    refused(
        "format = 1\nscene = \"@no.txt\"\n",
        "the list no.txt cannot be read",
    );
    refused(&job("scenes = 1"), "did you mean `scene`?");
    refused(&job("render = { szie = \"9x7\" }"), "did you mean size?");
    refused(
        &job("render = { accuracy = \"within:rmse=0.1\" }"),
        "accuracy is no option here: it is measured scene by scene",
    );
    refused(
        &job("render = { display = \"127.0.0.1:9\" }"),
        "display is no option here",
    );
    refused(
        &job("render = { size = \"9y7\" }"),
        "[render]: invalid value '9y7'",
    );
    refused(
        &job("render = { size = [9, 7] }"),
        "[render]: invalid value '9,7'",
    );
    refused(
        &job("render = { spp = true }"),
        "[render]: spp takes a value; write it, or false",
    );
    refused(&job("render = { ground = 1 }"), "ground is true or false");
    refused(
        &job("render = { spp = { a = 1 } }"),
        "spp is a text, a number",
    );
    refused(
        &job("render = { spp = 4, noise = 0.1 }"),
        "cannot be used with",
    );
    refused(
        &job("render = { threads = 2 }"),
        "an option of lanecast batch",
    );
    refused(&job("render = { camera = \"x\" }"), "beside [render]");
    refused(&job("render = { fps = 24 }"), "--frames");
    refused(
        &job("output = \"x.exr\"\nrender = { view_transform = \"agx\" }"),
        "--view-transform is for PNG",
    );
    refused(
        &job("output = \"x.jpg\"\nrender = { background = \"transparent\" }"),
        "no alpha",
    );
    refused(&job("output = \"x.gif\""), "unknown picture format 'gif'");
    refused(&job("output = \"../x.png\""), "not inside");
    refused(&job("output = \"/x.png\""), "not inside");
    refused(&job("output = \"{scen}.png\""), "did you mean {scene}?");
    refused(
        &job("output = \"{camera}.png\""),
        "the job has no camera, view or orbit",
    );
    refused(&job("view = [\"frnt\"]"), "did you mean front?");
    refused(
        &job("view = [\"top\", \"front\"]\noutput = \"{scene}.png\""),
        "add {camera}",
    );
    refused(
        &job("frame = \"0-1\"\noutput = \"{scene}.png\""),
        "add {frame:04}",
    );
    refused(
        &job("frame = \"5-1\""),
        "frame: '5-1' goes from 5 down to 1; write 1-5",
    );
    refused(&job("frame = \"0-99999999\""), "at most 10000000");
    refused(
        &job("frame = \"0-9999\"\norbit = { views = 9999 }"),
        "99990000 tasks",
    );
    refused(&job("orbit = { views = 0 }"), "views is a number from 1");
    refused(
        &job("orbit = { views = 1, elevation = 100 }"),
        "invalid value '0,100'",
    );
    refused(
        &job("orbit = { views = 1, fov_y = 180 }"),
        "invalid value '0,20,180'",
    );
    refused(&job("variant = [{ spp = 3 }]"), "a variant needs a `name`");
    refused(
        &job("variant = [{ name = \"x\", sp = 3 }]"),
        "variant x: sp is no option",
    );
    refused("format = 1\nscene = \"a.toml\" \"b\"\n", "job.toml:2:");
    refused("{", "job.toml:1:");
    let twice = "format = 1\nscene = [\"a.toml\", \"c/../a.toml\"]\n";
    refused(
        &job("variant = [{ name = \"x\" }, { name = \"x\" }]\noutput = \"{variant}.png\""),
        "variant: two are called 'x'",
    );
    refused(
        &job("camera = [0, \"0\"]"),
        "two views are called '0'; each camera",
    );
    refused(&job("frame = [\"0-3\", 2]"), "frame: 2 is listed twice");
    refused(&job("camera = [\"a:b\", \"a_b\"]"), "add {task:05}");
    refused(twice, "tasks 0 and 1 would both write a.png; add {folder}");
}

#[test]
fn wrong_arguments_are_usage_errors() {
    let folder = job("");
    let wrong = |arguments: &[&str], says: &str| {
        let done = batch(folder.path(), arguments);
        assert_eq!(
            done.status.code(),
            Some(2),
            "{arguments:?}: {}",
            stderr(&done)
        );
        assert!(
            stderr(&done).contains(says),
            "{arguments:?}: {}",
            stderr(&done)
        );
    };
    wrong(&[], "--out <DIR>");
    wrong(&["--out", "o", "--shard", "4/4"], "0/4 to 3/4");
    wrong(&["--out", "o", "--tasks", "x"], "0-99,120");
    wrong(&["--out", "o", "--list"], "cannot be used with");
    for other in ["--check", "--shard=0/2"] {
        wrong(&["--out", "o", "--merge", other], "cannot be used with");
    }
    for arguments in [
        &["no.toml", "--list"][..],
        &[".", "--list"],
        &["a.txt", "--list"],
    ] {
        let done = lanecast(folder.path(), &[&["batch"], arguments].concat());
        assert_eq!(done.status.code(), Some(3), "{}", stderr(&done));
    }
}

#[test]
fn merges_replace_no_file_of_others() {
    let folder = job("");
    let path = folder.path();
    assert!(batch(path, &["--out", "o"]).status.success());
    fs::write(path.join("o/records.jsonl"), "mine").unwrap();
    let merge = || batch(path, &["--out", "o", "--merge"]);
    let done = merge();
    assert_eq!(done.status.code(), Some(2), "{}", stderr(&done));
    assert!(stderr(&done).contains("no --merge of this folder has written it"));
    assert_eq!(fs::read(path.join("o/records.jsonl")).unwrap(), b"mine");
    fs::remove_file(path.join("o/records.jsonl")).unwrap();
    for _ in 0..2 {
        let done = merge();
        assert!(done.status.success(), "{}", stderr(&done));
    }
    let merged = fs::read_to_string(path.join("o/records.jsonl")).unwrap();
    assert_eq!(merged.lines().count(), 3);
}

#[test]
fn pictures_of_one_name_are_told_apart_by_what_differs() {
    let folder = job("");
    let path = folder.path();
    fs::create_dir(path.join("sub")).unwrap();
    fs::write(path.join("sub/b.toml"), BALL).unwrap();
    fs::write(path.join("b.json"), "{}").unwrap();
    let listed = |scenes: &str, output: &str| {
        let text = format!("format = 1\nscene = [{scenes}]\n{output}");
        fs::write(path.join("job.toml"), text).unwrap();
        batch(path, &["--list"])
    };
    let said = stderr(&listed("'b.toml', 'b.json'", "")).to_owned();
    assert!(said.contains("add {file} to it"), "{said}");
    let said = stderr(&listed("'b.toml', 'sub/b.toml'", "")).to_owned();
    assert!(said.contains("add {folder} to it"), "{said}");
    let list = listed(
        "'b.toml', 'sub/b.toml'",
        "output = '{folder}/{scene}.png'\n",
    );
    assert!(list.status.success(), "{}", stderr(&list));
    let list = stdout(&list);
    assert!(
        list.contains(" b.png") && list.contains(" sub/b.png"),
        "{list}"
    );
}

#[test]
fn tasks_past_the_last_are_left_out_with_one_warning() {
    let folder = job("");
    let listed = batch(folder.path(), &["--list", "--tasks", "1-9,1"]);
    assert!(listed.status.success());
    assert_eq!(stdout(&listed).lines().count(), 2, "{}", stdout(&listed));
    let said = stderr(&listed);
    assert!(said.contains("task 3 and 6 more are left out"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn numbers_come_from_standard_input() {
    let folder = job("");
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
    command
        .current_dir(folder.path())
        .args(["batch", "job.toml", "--list", "--tasks", "-"]);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(b"2\n{\"task\": 0}\n")
        .unwrap();
    let listed = child.wait_with_output().unwrap();
    let first = |line: &str| line.chars().next();
    let numbers: String = stdout(&listed).lines().filter_map(first).collect();
    assert_eq!(numbers, "20");
}

#[test]
fn a_camera_that_one_scene_lacks_fails_there_alone() {
    let folder = job("camera = \"front\"\n");
    let with = BALL.replace(
        "[shape",
        "[camera.front]\neye = [0, 0, 3]\nlook_at = [0, 0, 0]\nfov_y = 40\n[shape",
    );
    fs::write(folder.path().join("b.toml"), with).unwrap();
    let done = batch(folder.path(), &["--out", "o"]);
    assert_eq!(done.status.code(), Some(1));
    assert_eq!(names(&folder.path().join("o")), ["b.png", "records"]);
    let said = stderr(&done);
    assert!(said.contains("failed: task 0, a.png: "), "{said}");
    assert!(said.contains("error: 2 of 3 tasks failed"), "{said}");
}

#[test]
fn a_run_stops_after_so_many_failures() {
    let folder = job("camera = \"front\"\n");
    let stopped = batch(
        folder.path(),
        &["--out", "o", "--max-fails", "0", "--threads", "1"],
    );
    assert_eq!(stopped.status.code(), Some(1));
    let said = stderr(&stopped);
    assert!(
        said.contains("1 tasks have failed, more than --max-fails 0"),
        "{said}"
    );
    assert_eq!(said.matches("failed: task").count(), 1, "{said}");
    // As many as allowed do not stop it.
    let done = batch(folder.path(), &["--out", "p", "--max-fails", "3"]);
    assert!(
        stderr(&done).contains("3 of 3 tasks failed"),
        "{}",
        stderr(&done)
    );
}

#[test]
fn what_no_record_names_is_not_replaced() {
    let folder = job("");
    let path = folder.path();
    fs::create_dir(path.join("o")).unwrap();
    fs::write(path.join("o/b.png"), "mine").unwrap();
    let done = batch(path, &["--out", "o"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(
        stderr(&done).contains("o/b.png exists"),
        "{}",
        stderr(&done)
    );
    assert_eq!(names(&path.join("o")), ["b.png"]);
}

#[test]
fn folders_that_cannot_be_written_are_named() {
    let folder = job("output = \"deep/{scene}.png\"\n");
    let path = folder.path();
    fs::write(path.join("file"), "").unwrap();
    let done = batch(path, &["--out", "file/o"]);
    assert_eq!(done.status.code(), Some(4), "{}", stderr(&done));
    assert!(
        stderr(&done).contains("file/o: cannot be written"),
        "{}",
        stderr(&done)
    );
    // Folders below are made as they are needed.
    assert!(batch(path, &["--out", "new/o"]).status.success());
    assert_eq!(names(&path.join("new/o/deep")), ["a.png", "b.png", "c.png"]);
}

/// A limit of file sizes stands for a full disk: both fail in the midst of a write.
#[cfg(unix)]
#[test]
fn a_full_disk_ends_the_run_and_another_goes_on() {
    let folder = job("output = \"{scene}.exr\"\n");
    let path = folder.path();
    let text = fs::read_to_string(path.join("job.toml")).unwrap();
    fs::write(path.join("job.toml"), text.replace("9x7", "200x150")).unwrap();
    let program = env!("CARGO_BIN_EXE_lanecast");
    let line = format!("ulimit -f 16; exec {program:?} batch job.toml --out o --threads 1");
    let mut shell = Command::new("sh");
    let full = shell
        .current_dir(path)
        .args(["-c", &line])
        .output()
        .unwrap();
    assert_eq!(full.status.code(), Some(4), "{}", stderr(&full));
    let said = stderr(&full);
    assert!(said.contains("o/a.exr: cannot be written"), "{said}");
    assert!(said.contains("note: 0 of 3 tasks are done"), "{said}");
    assert_eq!(names(&path.join("o")), ["records"]);
    let done = batch(path, &["--out", "o"]);
    assert!(stdout(&done).contains("3 pictures"), "{}", stdout(&done));
}

/// Records of starts without an end, as a process leaves them that a task ends.
fn started(path: &Path, settings: &str, times: usize) {
    let line = format!(
        "{{\"v\":1,\"task\":1,\"status\":\"started\",\"settings\":{settings},\"attempt\":1,\
         \"outputs\":[{{\"path\":\"b.png\"}}],\"build\":{{\"version\":\"\",\"commit\":\"\",\
         \"isa\":\"\"}},\"started\":1.5}}\n"
    );
    fs::create_dir_all(path.join("o/records")).unwrap();
    let torn = "{\"v\":1,\"task\":1,\"sta";
    fs::write(path.join("o/records/x.jsonl"), line.repeat(times) + torn).unwrap();
}

#[test]
fn a_task_that_never_ended_is_done_by_a_process_of_its_own() {
    let folder = job("");
    let path = folder.path();
    let listed = batch(path, &["--list", "--json", "--tasks", "1"]);
    let task: Value = serde_json::from_slice(&listed.stdout).unwrap();
    started(path, &task["settings"].to_string(), 3);
    let done = batch(path, &["--out", "o", "--threads", "1"]);
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(stdout(&done).contains("3 pictures"), "{}", stdout(&done));
    assert_eq!(stderr(&done), "");
    // Two processes have written records, beside the one that was there.
    assert_eq!(names(&path.join("o/records")).len(), 3);
    let again = batch(path, &["--out", "o"]);
    assert!(
        stdout(&again).contains("3 were there"),
        "{}",
        stdout(&again)
    );
}

#[test]
fn lines_that_are_no_records_are_counted() {
    let folder = job("");
    let path = folder.path();
    fs::create_dir_all(path.join("o/records")).unwrap();
    fs::write(path.join("o/records/x.jsonl"), "{}\nnonsense\n{\"torn").unwrap();
    let done = batch(path, &["--out", "o"]);
    assert!(done.status.success());
    assert!(
        stderr(&done).contains("2 lines are no records"),
        "{}",
        stderr(&done)
    );
}

#[test]
fn what_has_nothing_in_it_is_told() {
    let folder = job("");
    let merged = batch(folder.path(), &["--out", "none", "--merge"]);
    assert_eq!(merged.status.code(), Some(1), "{}", stderr(&merged));
    assert!(
        stderr(&merged).contains("none of 3 tasks is done"),
        "{}",
        stderr(&merged)
    );
    assert!(!folder.path().join("none").exists());
    fs::write(folder.path().join("t.json"), "{\"frames\": []}").unwrap();
    let text = format!("format = 1\nscene = \"a.toml\"\ncamera = {{ file = \"t.json\" }}\n{SMALL}");
    fs::write(folder.path().join("job.toml"), text).unwrap();
    let done = batch(folder.path(), &["--out", "o"]);
    assert_eq!(done.status.code(), Some(3), "{}", stderr(&done));
    assert!(
        stderr(&done).contains("t.json has no cameras"),
        "{}",
        stderr(&done)
    );
}
